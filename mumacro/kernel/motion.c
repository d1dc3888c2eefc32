/* The steady cycle of a contact under any periodic motion beside a drag.
 *
 * Units: the mean limit mu0 Fz for forces, l0 = mu0 Fz / k for lengths, the angle tau = omega t for
 * time.  One spring sticks, where its force follows the motion, or slips, where |f| is the limit L.
 * With the velocity w of the upper point and the angle th of the force, slip is
 *
 *     th' = w.t / L,   slip speed = w.n - L',   n = (cos th, sin th), t = (-sin th, cos th),
 *
 * a quadratic equation for u = tan((th - th0)/2), which the method of Radau of order 5 integrates.
 * Stick ends where |f| reaches L, slip where its speed falls through 0.  Steps end there and at
 * marks of the period, so that each step is smooth.  The cycle is the fixed point of the map of a
 * period, found by Newton's method: of a small disturbance d of the force only the part along t
 * survives where slip begins, and exp(-integral of slip speed / L) of that during slip.
 *
 * The cycle is found with finer and finer steps.  The estimate of the error sums the differences of
 * the last two over all marks, which cannot cancel.  A ball is many independent springs, see
 * element.c. */

enum {
    MU_MARKS = 256,
    MU_MOTION_PERIODS = 100,
    MU_MOTION_REST_PERIODS = 500,
    MU_MOTION_LEVELS = 6,
    MU_MOTION_SLIDING_PERIODS = 12,
    MU_MOTION_KNOWN = 256,
    MU_MOTION_PANELS = 48,
    MU_MOTION_SCAN = 10,
    MU_MOTION_ORDERS = 12,
    MU_MOMENTS = 4
};
enum { MU_MEAN_X, MU_MEAN_Y, MU_MEAN_STUCK, MU_MEAN_PATH, MU_MEAN_WORK, MU_MEANS };
#define MU_MOTION_ROUNDING 2e-10 /* of the mean force, at least: sticks too short to be found */
#define MU_MOTION_NEWTON 1e-6    /* a step of Newton's method that leaves its square */
#define MU_MOTION_LEAP 0.9       /* of what is left of the way to a cycle, at most */
/* of a way of the force, by which Newton's step after it may be off: it shortens by a third of the
 * way where the force moves by the cube of what is left */
#define MU_MOTION_OFF 0.85
/* The search for a cycle beside a drag.  A step too long is cut to a tenth at least, cut once more
 * to a hundredth of that, and so on; the steps after it grow by 4 at most.  Where no cycle is
 * found, those of faster drags lead to it, from 1e-3 l0 per radian by tenths.  Found by search:
 * none of 9,000 random springs with drags from 1e-9 to 1e-3 is left without its cycle, see `slow
 * drag` in benchmarks/motion.py. */
#define MU_MOTION_SLOW \
    1e-6 /* l0 per radian; below, a slip that larger steps miss moves the cycle */
#define MU_MOTION_OF_SLOW 1e-6 /* the tolerance there at most */
#define MU_MOTION_CUT 0.1
#define MU_MOTION_LEAST_SHARE 1e-9
#define MU_MOTION_GROWTH 4.0
#define MU_MOTION_FASTER 1e-3
#define MU_MOTION_SLOWER 0.1
#define MU_MOTION_COARSE 30.0 /* of the tolerance, where only the kind of a cycle is looked for */
#define MU_MOTION_BRIEF 1e-3  /* of tau; a shorter stick or slip makes no other kind of cycle */
#define MU_MOTION_SHORT 1e-10 /* of tau; a shorter stick or step is rounding */
#define MU_SQRT6 2.449489742783178

/* A motion of one spring: harmonics of x, y and the normal force one after another, whose terms are
 * amplitude and phase.  Lengths are multiplied by scale, which is 1 over the spring's share of the
 * limit. */
typedef struct {
    const int32_t *counts;
    const double *orders, *terms;
    double drag, scale, acceleration; /* the last is a bound */
    int marks, nodes;                 /* parts of a period whose sums are kept; steps at least */
    /* where no order is above MU_MOTION_ORDERS, else 0: the highest, and of each what sin and cos
     * in x, y and the normal force are multiplied by */
    int highest;
    double parts[MU_MOTION_ORDERS][6];
} mu_shaken;

/* The motion at tau: way, velocity, limit and its slope. */
typedef struct {
    double tau, x, y, wx, wy, limit, slope;
} mu_moment;

/* Times at which steps end at the latest, up to 2 pi, and room for more of them. */
typedef struct {
    double *nodes;
    int64_t n, room;
} mu_grid;

/* Where a period is, and what it has summed so far. */
typedef struct {
    mu_moment at;
    double f[2];
    int slips;
    /* what the next slip may take; beginning of the last stick; slip since a stick was counted */
    double step, began, slid;
    double mean[MU_MEANS], marked[2 * MU_MARKS];
    /* of a small disturbance: the direction that survives first, the last one, what is left as a
     * logarithm, as a factor; the limit where that direction is the last */
    double first[2], last[2], decay, turned, last_limit;
    int slipped, failed, sticks, phases; /* the last: how often slip begins */
    mu_grid *steps;                      /* ends of all its steps */
} mu_march;

/* A steady cycle: means per period; decay of a disturbance per period as its
 * logarithm; distance to the cycle; the estimate of the error of the mean force; how
 * many sticks it has, but for brief ones.  From which force, with which first step, the period
 * starts on the way from rest that slips more. */
typedef struct {
    double mean[MU_MEANS], marked[2 * MU_MARKS], decay, distance, error, from[2], step;
    int sticks, level, failed, slips_before;
} mu_steady;

/* One cycle at equal times, to be drawn: each spring adds its forces with a weight. */
typedef struct {
    double *forces, weight;
    int64_t n, next;
} mu_drawing;

/* sin x and cos x of |x| < 1e5, off by at most 1.2e-16. */
static inline void mu_sine_cosine(double x, double *sine, double *cosine) {
    static const double odd[8] = {2.8114572543455206e-15, -7.647163731819816e-13,
                                  1.6059043836821613e-10, -2.505210838544172e-08,
                                  2.7557319223985893e-06, -0.0001984126984126984,
                                  0.008333333333333333,   -0.16666666666666666};
    static const double even[8] = {4.779477332387385e-14, -1.1470745597729725e-11,
                                   2.08767569878681e-09,  -2.755731922398589e-07,
                                   2.48015873015873e-05,  -0.001388888888888889,
                                   0.041666666666666664,  -0.5};
    /* x = n pi/2 + r with |r| <= pi/4; pi/2 in three parts, of which n times the first two is
     * exact */
    const int32_t n = mu_whole_of(x * MU_TWO_OVER_PI + (x < 0.0 ? -0.5 : 0.5));
    const double r = ((x - n * 1.57079632673412561417) - n * 6.07710050630396597660e-11) -
                     n * 2.02226624879595063154e-21;
    const double square = r * r;
    double s = odd[0], c = even[0];
    for (int i = 1; i < 8; ++i) {
        s = s * square + odd[i];
        c = c * square + even[i];
    }
    s = r + r * square * s;
    c = 1.0 + square * c;
    {
        const double first = n & 1 ? c : s, second = n & 1 ? s : c;
        *sine = n & 2 ? -first : first;
        *cosine = (n + 1) & 2 ? -second : second;
    }
}

/* The motion at n <= MU_MOMENTS times; n is a constant where it is called. */
MU_INLINE void mu_moments(const mu_shaken *m, int n, const double *tau, mu_moment *moments) {
    double sum[6][MU_MOMENTS] = {{0.0}}, sine[MU_MOMENTS], cosine[MU_MOMENTS], s[MU_MOMENTS],
           c[MU_MOMENTS];
    if (m->highest) { /* sin and cos of n tau from those of (n - 1) tau */
        for (int j = 0; j < n; ++j) {
            mu_sine_cosine(tau[j], &sine[j], &cosine[j]);
            s[j] = 0.0;
            c[j] = 1.0;
        }
        for (int i = 0; i < m->highest; ++i) {
            const double *part = m->parts[i], order = i + 1.0;
            for (int j = 0; j < n; ++j) {
                const double next = s[j] * cosine[j] + c[j] * sine[j];
                c[j] = c[j] * cosine[j] - s[j] * sine[j];
                s[j] = next;
                sum[0][j] += part[0] * s[j] + part[1] * c[j];
                sum[1][j] += part[2] * s[j] + part[3] * c[j];
                sum[2][j] += order * (part[0] * c[j] - part[1] * s[j]);
                sum[3][j] += order * (part[2] * c[j] - part[3] * s[j]);
                sum[4][j] += part[4] * s[j] + part[5] * c[j];
                sum[5][j] += order * (part[4] * c[j] - part[5] * s[j]);
            }
        }
    } else {
        const double *order = m->orders, *term = m->terms;
        for (int part = 0; part < 3; ++part) {
            const int way = part < 2 ? part : 4, velocity = part < 2 ? part + 2 : 5;
            for (int i = 0; i < m->counts[part]; ++i, ++order, term += 2) {
                for (int j = 0; j < n; ++j) {
                    mu_sine_cosine(*order * tau[j] + term[1], &sine[j], &cosine[j]);
                    sum[way][j] += term[0] * sine[j];
                    sum[velocity][j] += *order * term[0] * cosine[j];
                }
            }
        }
    }
    for (int j = 0; j < n; ++j) {
        const mu_moment one = {tau[j],
                               m->scale * (m->drag * tau[j] + sum[0][j]),
                               m->scale * sum[1][j],
                               m->scale * (m->drag + sum[2][j]),
                               m->scale * sum[3][j],
                               1.0 + sum[4][j],
                               sum[5][j]};
        moments[j] = one;
    }
}

static void mu_moments_at(const mu_shaken *m, const double *tau, mu_moment *moments) {
    mu_moments(m, MU_MOMENTS, tau, moments);
}

static mu_moment mu_moment_at(const mu_shaken *m, double tau) {
    mu_moment out;
    mu_moments(m, 1, &tau, &out);
    return out;
}

/* sin(half) / half of half <= 0.2, to 1e-17. */
static double mu_damping(double half) {
    const double z = half * half;
    return 1.0 -
           z / 6.0 * (1.0 - z / 20.0 * (1.0 - z / 42.0 * (1.0 - z / 72.0 * (1.0 - z / 110.0))));
}

/* The mean way over a time that no harmonic turns by more than 0.4. */
static void mu_mean_way(const mu_shaken *m, double tau, double length, double *way) {
    const double *order = m->orders, *term = m->terms, middle = tau + 0.5 * length;
    double sine, cosine;
    way[0] = m->drag * middle;
    way[1] = 0.0;
    if (m->highest) {
        double s = 0.0, c = 1.0;
        mu_sine_cosine(middle, &sine, &cosine);
        for (int i = 0; i < m->highest; ++i) {
            const double *part = m->parts[i], damping = mu_damping(0.5 * (i + 1.0) * length),
                         next = s * cosine + c * sine;
            c = c * cosine - s * sine;
            s = next;
            way[0] += damping * (part[0] * s + part[1] * c);
            way[1] += damping * (part[2] * s + part[3] * c);
        }
    } else {
        for (int i = 0; i < m->counts[0] + m->counts[1]; ++i, ++order, term += 2) {
            mu_sine_cosine(*order * middle + term[1], &sine, &cosine);
            way[i >= m->counts[0]] += term[0] * sine * mu_damping(0.5 * *order * length);
        }
    }
    way[0] *= m->scale;
    way[1] *= m->scale;
}

/* Of what may be squared. */
static double mu_length(double x, double y) { return sqrt(x * x + y * y); }

/* --- slip ------------------------------------------------------------------------------------- */

static const double MU_RADAU_AT[3] = {(4.0 - MU_SQRT6) / 10.0, (4.0 + MU_SQRT6) / 10.0, 1.0};
static const double MU_RADAU[3][3] = {
    {(88.0 - 7.0 * MU_SQRT6) / 360.0, (296.0 - 169.0 * MU_SQRT6) / 1800.0,
     (-2.0 + 3.0 * MU_SQRT6) / 225.0},
    {(296.0 + 169.0 * MU_SQRT6) / 1800.0, (88.0 + 7.0 * MU_SQRT6) / 360.0,
     (-2.0 - 3.0 * MU_SQRT6) / 225.0},
    {(16.0 - MU_SQRT6) / 36.0, (16.0 + MU_SQRT6) / 36.0, 1.0 / 9.0},
};
/* weights of the embedded estimate of order 3, and the real eigenvalue of the inverse of the
 * matrix */
static const double MU_RADAU_ERROR[3] = {-(13.0 + 7.0 * MU_SQRT6) / 3.0,
                                         (-13.0 + 7.0 * MU_SQRT6) / 3.0, -1.0 / 3.0};
static const double MU_RADAU_REAL = 3.6378342527444962;

/* A step of slip: its stages, with u = tan((th - th0)/2) and the slip speed there. */
typedef struct {
    mu_moment stage[MU_MOMENTS]; /* the last is no stage: four at once take no longer than three */
    /* (ex, ey): direction of the force at the start */
    double length, u[3], speed[3], error, ex, ey;
} mu_slip;

/* Direction of the force at u. */
static void mu_direction(const mu_slip *slip, double u, double *nx, double *ny) {
    const double square = u * u, cosine = (1.0 - square) / (1.0 + square);
    const double sine = 2.0 * u / (1.0 + square);
    *nx = cosine * slip->ex - sine * slip->ey;
    *ny = cosine * slip->ey + sine * slip->ex;
}

static double mu_slip_speed(const mu_slip *slip, const mu_moment *at, double u) {
    double nx, ny;
    mu_direction(slip, u, &nx, &ny);
    return at->wx * nx + at->wy * ny - at->slope;
}

/* The stages of a step of this length; returns 0 where none are found. */
static int mu_slip_step(const mu_shaken *m, const mu_moment *start, double ex, double ey,
                        double length, double end, mu_slip *slip) {
    const double a0 = (start->wx * ex + start->wy * ey) / start->limit;
    const double rate = 0.5 * (start->wy * ex - start->wx * ey) / start->limit;
    const double tau[MU_MOMENTS] = {start->tau + MU_RADAU_AT[0] * length,
                                    start->tau + MU_RADAU_AT[1] * length, end, end};
    double a[3], b[3], *u = slip->u, change = 1.0;
    slip->length = length;
    slip->ex = ex;
    slip->ey = ey;
    mu_moments_at(m, tau, slip->stage);
    for (int i = 0; i < 3; ++i) {
        const mu_moment at = slip->stage[i];
        a[i] = length * (at.wx * ex + at.wy * ey) / at.limit;
        b[i] = length * (at.wy * ex - at.wx * ey) / at.limit;
        u[i] = 0.0;
    }
    for (int count = 0; change > MU_MOTION_NEWTON; ++count) {
        double rest[3], j[3], c[3][3], d[3], minor[3], determinant;
        if (count == 9) return 0;
        for (int i = 0; i < 3; ++i) {
            rest[i] = 0.5 * b[i] * (1.0 - u[i] * u[i]) - a[i] * u[i];
            j[i] = a[i] + b[i] * u[i];
        }
        for (int i = 0; i < 3; ++i) {
            d[i] = -u[i];
            for (int k = 0; k < 3; ++k) {
                d[i] += MU_RADAU[i][k] * rest[k];
                c[i][k] = MU_RADAU[i][k] * j[k];
            }
            c[i][i] += 1.0;
        }
        minor[0] = c[1][1] * c[2][2] - c[1][2] * c[2][1];
        minor[1] = c[1][2] * c[2][0] - c[1][0] * c[2][2];
        minor[2] = c[1][0] * c[2][1] - c[1][1] * c[2][0];
        determinant = c[0][0] * minor[0] + c[0][1] * minor[1] + c[0][2] * minor[2];
        {
            const double x = d[0] * minor[0] + d[1] * (c[0][2] * c[2][1] - c[0][1] * c[2][2]) +
                             d[2] * (c[0][1] * c[1][2] - c[0][2] * c[1][1]);
            const double y = d[0] * minor[1] + d[1] * (c[0][0] * c[2][2] - c[0][2] * c[2][0]) +
                             d[2] * (c[0][2] * c[1][0] - c[0][0] * c[1][2]);
            const double z = d[0] * minor[2] + d[1] * (c[0][1] * c[2][0] - c[0][0] * c[2][1]) +
                             d[2] * (c[0][0] * c[1][1] - c[0][1] * c[1][0]);
            u[0] += x / determinant;
            u[1] += y / determinant;
            u[2] += z / determinant;
            change = (fabs(x) + fabs(y) + fabs(z)) / fabs(determinant);
        }
        if (!(fabs(u[0]) + fabs(u[1]) + fabs(u[2]) < 9.0)) return 0;
    }
    if (!(mu_max(fabs(u[0]), mu_max(fabs(u[1]), fabs(u[2]))) < 0.5)) return 0;
    slip->error = rate * length;
    for (int i = 0; i < 3; ++i) {
        slip->speed[i] = mu_slip_speed(slip, &slip->stage[i], u[i]);
        slip->error += MU_RADAU_ERROR[i] * u[i];
    }
    slip->error =
        fabs(2.0 * start->limit * slip->error / (MU_RADAU_REAL + mu_max(length * a0, 0.0)));
    return 1;
}

/* u at a share of the step: the cubic through the stages and 0. */
static double mu_slip_at(const mu_slip *slip, double share) {
    const double p = MU_RADAU_AT[0], q = MU_RADAU_AT[1];
    const double at_p = (share - q) * (share - 1.0) / (p * (p - q) * (p - 1.0));
    const double at_q = (share - p) * (share - 1.0) / (q * (q - p) * (q - 1.0));
    const double at_1 = (share - p) * (share - q) / ((1.0 - p) * (1.0 - q));
    return share * (slip->u[0] * at_p + slip->u[1] * at_q + slip->u[2] * at_1);
}

/* --- events ----------------------------------------------------------------------------------- */

/* A root between low and high, where the values have different signs, or that of low is 0. */
typedef struct {
    double low, high, at_low, at_high;
    int last;
} mu_bracket;

static double mu_next_guess(const mu_bracket *b) {
    const double middle = 0.5 * (b->low + b->high);
    const double guess = b->low + (b->high - b->low) * (b->at_low / (b->at_low - b->at_high));
    return b->at_low != 0.0 && guess > b->low && guess < b->high ? guess : middle;
}

/* Regula falsi, as of Illinois: the value at an end that stays is halved. */
static void mu_narrow(mu_bracket *b, double x, double value) {
    if ((value > 0.0) == (b->at_high > 0.0)) {
        b->high = x;
        b->at_high = value;
        if (b->last == 1) b->at_low *= 0.5;
        b->last = 1;
    } else {
        b->low = x;
        b->at_low = value;
        if (b->last == -1) b->at_high *= 0.5;
        b->last = -1;
    }
}

static double mu_speed_at(const mu_shaken *m, const mu_moment *start, const mu_slip *slip,
                          double share) {
    const mu_moment at = mu_moment_at(m, start->tau + share * slip->length);
    return mu_slip_speed(slip, &at, mu_slip_at(slip, share));
}

/* Whether the speed of a step falls below 0, and between which shares first.  Where all stages are
 * above, the least of the cubic through them is looked at. */
static int mu_slip_falls(const mu_shaken *m, const mu_moment *start, const mu_slip *slip,
                         mu_bracket *b) {
    const double x[4] = {0.0, MU_RADAU_AT[0], MU_RADAU_AT[1], 1.0};
    const double speed[4] = {mu_max(mu_slip_speed(slip, start, 0.0), 0.0), slip->speed[0],
                             slip->speed[1], slip->speed[2]};
    double first, second, last, third, c, d, e, root, at[3], value[3];
    int left = 0;
    for (int i = 1; i < 4; ++i) {
        if (speed[i] < 0.0) {
            const mu_bracket bracket = {x[i - 1], x[i], speed[i - 1], speed[i], 0};
            *b = bracket;
            return 1;
        }
    }
    /* divided differences, and the slope c x^2 + 2 d x + e of the cubic */
    first = (speed[1] - speed[0]) / x[1];
    second = ((speed[2] - speed[1]) / (x[2] - x[1]) - first) / x[2];
    last = (speed[3] - speed[2]) / (x[3] - x[2]) - (speed[2] - speed[1]) / (x[2] - x[1]);
    third = (last / (x[3] - x[1]) - second) / x[3];
    c = 3.0 * third;
    d = second - third * (x[1] + x[2]);
    e = first - second * x[1] + third * x[1] * x[2];
    if (!(d * d > c * e)) return 0;
    root = sqrt(d * d - c * e);
    /* of the two places of no slope that with c x + d > 0 */
    at[1] = d > 0.0 ? -e / (d + root) : (root - d) / c;
    if (!(at[1] > 0.0 && at[1] < 1.0)) return 0;
    while (left < 2 && x[left + 1] < at[1]) ++left;
    value[0] = speed[left];
    value[2] = speed[left + 1];
    at[0] = x[left];
    at[2] = x[left + 1];
    value[1] = speed[0] + at[1] * (first + (at[1] - x[1]) * (second + (at[1] - x[2]) * third));
    if (value[1] > 0.3 * mu_max(mu_max(speed[0], speed[1]), mu_max(speed[2], speed[3]))) return 0;
    for (int count = 0; count < 3; ++count) {
        double p, q, next;
        value[1] = mu_speed_at(m, start, slip, at[1]);
        if (value[1] < 0.0) {
            const mu_bracket bracket = {at[0], at[1], value[0], value[1], 0};
            *b = bracket;
            return 1;
        }
        /* the vertex of the parabola */
        p = (value[1] - value[0]) / (at[1] - at[0]);
        q = (value[2] - value[1]) / (at[2] - at[1]);
        if (!(q > p)) return 0;
        next = 0.5 * (at[0] + at[1]) - 0.5 * p * (at[2] - at[0]) / (q - p);
        if (!(next > at[0] && next < at[2]) || next == at[1]) return 0;
        if (next > at[1]) {
            at[0] = at[1];
            value[0] = value[1];
        } else {
            at[2] = at[1];
            value[2] = value[1];
        }
        at[1] = next;
    }
    return 0;
}

/* At which share of a step its speed falls through 0. */
static double mu_slip_end(const mu_shaken *m, const mu_moment *start, const mu_slip *slip,
                          mu_bracket *b) {
    const double fastest = mu_max(slip->speed[0], mu_max(slip->speed[1], slip->speed[2]));
    for (int count = 0; count < 60 && b->high - b->low > 1e-15; ++count) {
        const double share = mu_next_guess(b), speed = mu_speed_at(m, start, slip, share);
        mu_narrow(b, share, speed);
        if (fabs(speed) <= 1e-13 * fastest) return share;
    }
    return b->low;
}

/* A stick from a moment with a force, and how far that is inside the limit. */
typedef struct {
    const mu_shaken *m;
    mu_moment start;
    double f[2], length;
} mu_stick;

static mu_moment mu_stuck_at(const mu_stick *stick, double share, double *f) {
    const mu_moment at = mu_moment_at(stick->m, stick->start.tau + share * stick->length);
    f[0] = stick->f[0] + (at.x - stick->start.x);
    f[1] = stick->f[1] + (at.y - stick->start.y);
    return at;
}

/* |f|^2 - L^2, and its slope over 2. */
static double mu_excess(const mu_moment *at, const double *f) {
    return f[0] * f[0] + f[1] * f[1] - at->limit * at->limit;
}

static double mu_excess_slope(const mu_moment *at, const double *f) {
    return f[0] * at->wx + f[1] * at->wy - at->limit * at->slope;
}

/* At which share of its step a stick ends; 1 where it lasts, whose moment and force are last and
 * at_last.  fresh: it has just begun, on the limit; then 0 says that it does not begin. */
static double mu_stick_end(const mu_stick *stick, int fresh, mu_moment *last, double *at_last) {
    double f[2];
    mu_moment at = mu_stuck_at(stick, 1.0, f);
    mu_bracket b = {0.0, 1.0, mu_min(mu_excess(&stick->start, stick->f), 0.0), mu_excess(&at, f),
                    0};
    *last = at;
    at_last[0] = f[0];
    at_last[1] = f[1];
    if (b.at_high <= 0.0) {
        /* between the ends it may have been outside */
        mu_bracket top = {0.0, 1.0, mu_excess_slope(&stick->start, stick->f),
                          mu_excess_slope(&at, f), 0};
        if (fresh || top.at_low <= 0.0 || top.at_high >= 0.0) return 1.0;
        for (int count = 0; count < 12 && b.at_high <= 0.0; ++count) {
            const double share = mu_next_guess(&top);
            at = mu_stuck_at(stick, share, f);
            b.high = share;
            b.at_high = mu_excess(&at, f);
            mu_narrow(&top, share, mu_excess_slope(&at, f));
        }
        if (b.at_high <= 0.0) return 1.0;
    }
    if (fresh) {
        b.at_low = 0.0;
        for (double share = 0.5 * b.high; b.at_low >= 0.0; share *= 0.5) {
            double value;
            if (share < 1e-12) return 0.0;
            at = mu_stuck_at(stick, share, f);
            value = mu_excess(&at, f);
            if (value < 0.0) {
                b.low = share;
                b.at_low = value;
            } else {
                b.high = share;
                b.at_high = value;
            }
        }
    }
    for (int count = 0; count < 60 && b.high - b.low > 1e-15; ++count) {
        const double share = mu_next_guess(&b);
        double value;
        at = mu_stuck_at(stick, share, f);
        value = mu_excess(&at, f);
        mu_narrow(&b, share, value);
        if (fabs(value) <= 1e-15 * at.limit * at.limit) return share;
    }
    return b.high;
}

/* --- a period --------------------------------------------------------------------------------- */

/* Adds a force, which has done a work beside the drag. */
static void mu_add(mu_march *march, const mu_shaken *m, double middle, double time, double fx,
                   double fy, double work) {
    const int place = 2 * (int)(middle * (0.5 / MU_PI) * m->marks);
    march->mean[MU_MEAN_X] += time * fx;
    march->mean[MU_MEAN_Y] += time * fy;
    march->mean[MU_MEAN_WORK] += work;
    march->marked[place] += time * fx;
    march->marked[place + 1] += time * fy;
}

/* The forces at the times to be drawn before tau. */
static int mu_is_drawn(const mu_drawing *drawing, double tau, double *time) {
    if (!drawing || drawing->next > drawing->n) return 0;
    *time = drawing->next < drawing->n ? 2.0 * MU_PI * (double)drawing->next / (double)drawing->n
                                       : 2.0 * MU_PI;
    return *time <= tau;
}

static void mu_draw(mu_drawing *drawing, double fx, double fy) {
    drawing->forces[2 * drawing->next] += drawing->weight * fx;
    drawing->forces[2 * drawing->next + 1] += drawing->weight * fy;
    ++drawing->next;
}

/* Slip begins with the force as it is: of a disturbance the part along t is left. */
static void mu_begin_slip(mu_march *march) {
    const double size = mu_length(march->f[0], march->f[1]);
    const double tx = -march->f[1] / size, ty = march->f[0] / size;
    if (march->slipped) {
        march->turned *= march->last[0] * tx + march->last[1] * ty;
    } else {
        march->first[0] = tx;
        march->first[1] = ty;
    }
    march->last[0] = tx;
    march->last[1] = ty;
    march->last_limit = size;
    march->slipped = march->slips = 1;
    ++march->phases;
}

static void mu_take_slip(mu_march *march, const mu_shaken *m, double tolerance, double end,
                         int *ends, mu_drawing *drawing) {
    static const double *weight = MU_RADAU[2];
    const mu_moment start = march->at;
    const double size = mu_length(march->f[0], march->f[1]), ex = march->f[0] / size;
    const double ey = march->f[1] / size;
    const double rest = end - start.tau;
    const double length = march->step >= rest        ? rest
                          : march->step > 0.5 * rest ? 0.5 * rest
                                                     : march->step;
    double factor, nx, ny, time;
    mu_bracket fall;
    mu_slip slip;
    if (!mu_slip_step(m, &start, ex, ey, length, length == rest ? end : start.tau + length,
                      &slip)) {
        march->step = 0.25 * length;
        return;
    }
    factor = slip.error > 0.0 ? 0.85 * sqrt(sqrt(tolerance / slip.error)) : 4.0;
    factor = mu_max(0.2, mu_min(factor, 2.0));
    if (slip.error > tolerance) {
        march->step = length * mu_min(factor, 0.9);
        return;
    }
    march->step = length < march->step ? mu_max(march->step, factor * length) : factor * length;
    if (*ends && mu_slip_falls(m, &start, &slip, &fall)) {
        const double shorter = length * mu_slip_end(m, &start, &slip, &fall);
        march->slips = 0;
        march->began = start.tau + shorter;
        if (!(start.tau + shorter > start.tau)) return;
        if (!mu_slip_step(m, &start, ex, ey, shorter, start.tau + shorter, &slip)) {
            march->failed = 1;
            return;
        }
    }
    *ends = 1;
    for (int i = 0; i < 3; ++i) {
        const double share = slip.length * weight[i], limit = slip.stage[i].limit;
        mu_direction(&slip, slip.u[i], &nx, &ny);
        mu_add(
            march, m, start.tau + 0.5 * slip.length, share, limit * nx, limit * ny,
            share * limit * (nx * (slip.stage[i].wx - m->scale * m->drag) + ny * slip.stage[i].wy));
        march->mean[MU_MEAN_PATH] += share * slip.speed[i];
        march->decay += share * slip.speed[i] / limit;
    }
    while (mu_is_drawn(drawing, slip.stage[2].tau, &time)) {
        const mu_moment at = mu_moment_at(m, time);
        mu_direction(&slip, mu_slip_at(&slip, (time - start.tau) / slip.length), &nx, &ny);
        mu_draw(drawing, at.limit * nx, at.limit * ny);
    }
    mu_direction(&slip, slip.u[2], &nx, &ny);
    march->slid += slip.length;
    march->at = slip.stage[2];
    march->f[0] = march->at.limit * nx;
    march->f[1] = march->at.limit * ny;
    march->last[0] = -ny;
    march->last[1] = nx;
    march->last_limit = march->at.limit;
}

static void mu_take_stick(mu_march *march, const mu_shaken *m, double end, int *fresh, int *ends,
                          mu_drawing *drawing) {
    mu_stick stick = {m, march->at, {march->f[0], march->f[1]}, end - march->at.tau};
    const double speed = mu_length(stick.start.wx, stick.start.wy), way = 0.5 * stick.start.limit;
    const double slowest = speed + sqrt(speed * speed + 2.0 * m->acceleration * way);
    double share, time, at_last[2];
    mu_moment last;
    int whole = 1;
    if (slowest * stick.length > 2.0 * way) {
        whole = 0;
        stick.length = 2.0 * way / slowest;
    }
    if (*fresh && stick.length < MU_MOTION_SHORT) {
        share = 1.0;
        last = mu_stuck_at(&stick, 1.0, at_last);
    } else {
        share = mu_stick_end(&stick, *fresh, &last, at_last);
    }
    if (share > 0.0) {
        const double taken = share * stick.length, drag = m->scale * m->drag;
        double dx, dy, fx, fy, size, way[2];
        time = stick.start.tau + taken;
        march->at = share < 1.0 ? mu_moment_at(m, time) : last;
        if (whole && share == 1.0) march->at.tau = end;
        dx = march->at.x - stick.start.x;
        dy = march->at.y - stick.start.y;
        fx = stick.f[0] + dx;
        fy = stick.f[1] + dy;
        mu_mean_way(m, stick.start.tau, taken, way);
        way[0] -= stick.start.x;
        way[1] -= stick.start.y;
        /* the integral of f (w - drag), exactly */
        mu_add(march, m, stick.start.tau + 0.5 * taken, taken, stick.f[0] + way[0],
               stick.f[1] + way[1],
               stick.f[0] * (dx - drag * taken) + stick.f[1] * dy + 0.5 * (dx * dx + dy * dy) -
                   drag * way[0] * taken);
        march->mean[MU_MEAN_STUCK] += taken;
        size = mu_length(fx, fy);
        if (share < 1.0 && size > 0.0) {
            fx *= march->at.limit / size;
            fy *= march->at.limit / size;
        }
        while (mu_is_drawn(drawing, march->at.tau, &time)) {
            const mu_moment at = mu_moment_at(m, time);
            mu_draw(drawing, stick.f[0] + (at.x - stick.start.x),
                    stick.f[1] + (at.y - stick.start.y));
        }
        march->f[0] = fx;
        march->f[1] = fy;
    }
    *fresh = *fresh && share == 1.0 && stick.length < MU_MOTION_SHORT;
    if (share < 1.0) {
        /* slip that rounding ends goes on for a step */
        *ends = march->at.tau - march->began > MU_MOTION_SHORT;
        if (march->at.tau - march->began > MU_MOTION_BRIEF && march->slid > MU_MOTION_BRIEF) {
            ++march->sticks;
            march->slid = 0.0;
        }
        mu_begin_slip(march);
    }
}

/* One period from the force f, with this tolerance of a step; the ends
 * of the steps go to march->steps. */
static void mu_take_period(const mu_shaken *m, const mu_grid *grid, const double *f,
                           double tolerance, mu_march *march, mu_drawing *drawing) {
    static const mu_march none;
    const double step = march->step;
    mu_grid *steps = march->steps;
    int64_t count = 0;
    int fresh, ends = 1;
    *march = none;
    march->step = step > 0.0 ? step : 0.1 * sqrt(sqrt(tolerance));
    march->turned = 1.0;
    march->began = -1.0;
    march->slid = 1.0;
    march->steps = steps;
    steps->n = 0;
    march->at = mu_moment_at(m, 0.0);
    march->f[0] = f[0];
    march->f[1] = f[1];
    fresh = mu_length(f[0], f[1]) >= march->at.limit * (1.0 - 1e-12);
    if (fresh &&
        f[0] * march->at.wx + f[1] * march->at.wy - march->at.limit * march->at.slope > 0.0)
        mu_begin_slip(march);
    for (int64_t i = 0; i < grid->n; ++i) {
        const double end = grid->nodes[i];
        if (end - march->at.tau < MU_MOTION_SHORT && i + 1 < grid->n) continue;
        while (march->at.tau < end && !march->failed) {
            const double before = march->at.tau;
            if (march->slips) {
                mu_take_slip(march, m, tolerance, end, &ends, drawing);
                fresh = 1;
            } else {
                mu_take_stick(march, m, end, &fresh, &ends, drawing);
            }
            if (march->at.tau > before && steps->n < steps->room)
                steps->nodes[steps->n++] = march->at.tau;
            if (steps->n == steps->room || ++count > 4 * steps->room || !(march->step > 1e-15))
                march->failed = 1;
        }
    }
    for (int i = 0; i < MU_MEANS; ++i)
        if (i != MU_MEAN_PATH && i != MU_MEAN_WORK) march->mean[i] /= 2.0 * MU_PI;
    for (int i = 0; i < 2 * m->marks; ++i) march->marked[i] /= 2.0 * MU_PI;
}

/* --- the steady cycle ------------------------------------------------------------------------- */

static void mu_keep_below(double limit, double *f) {
    const double size = mu_length(f[0], f[1]);
    if (size > limit) {
        f[0] *= limit / size;
        f[1] *= limit / size;
    }
}

/* A period as a map of the force at its start: how far it moves it, and by
 * how much Newton's method would. */
typedef struct {
    double moved[2], step[2], size;
} mu_residual;

static mu_residual mu_residual_of(const mu_march *march, const double *f, double limit) {
    mu_residual r = {{march->f[0] - f[0], march->f[1] - f[1]}, {0.0, 0.0}, 0.0};
    r.size = mu_length(r.moved[0], r.moved[1]);
    if (march->slipped) { /* the derivative of the map is left last first^T */
        const double left = march->turned * mu_decay(march->decay), *first = march->first,
                     *last = march->last;
        const double stays = mu_max(1.0 - left * (first[0] * last[0] + first[1] * last[1]), 1e-16);
        const double along = left * (first[0] * r.moved[0] + first[1] * r.moved[1]) / stays;
        r.step[0] = r.moved[0] + along * last[0];
        r.step[1] = r.moved[1] + along * last[1];
    } else if (r.size > 0.0) { /* it is only stretched: up to the limit */
        const double a = r.size * r.size, b = f[0] * r.moved[0] + f[1] * r.moved[1];
        const double c = mu_min(f[0] * f[0] + f[1] * f[1] - limit * limit, 0.0);
        const double times = mu_max((sqrt(mu_max(b * b - a * c, 0.0)) - b) / a, 1.0);
        r.step[0] = times * r.moved[0];
        r.step[1] = times * r.moved[1];
    }
    return r;
}

static mu_steady mu_steady_of(const mu_march *march, double distance) {
    mu_steady out = {{0.0}, {0.0},         0.0, distance,      0.0, {0.0, 0.0},
                     0.0,   march->sticks, 0,   march->failed, 0};
    memcpy(out.mean, march->mean, sizeof out.mean);
    memcpy(out.marked, march->marked, sizeof out.marked);
    if (march->slipped) { /* over the end of the period, too, it turns from last to first */
        const double turned =
            march->turned * (march->first[0] * march->last[0] + march->first[1] * march->last[1]);
        out.decay = turned != 0.0 ? march->decay - mu_log1(mu_min(fabs(turned), 1.0)) : HUGE_VAL;
    }
    return out;
}

/* A step of Newton's method that may be cut: it starts from a force, takes a share of the way, and
 * is no longer than reach. */
typedef struct {
    double from[2], share, least, reach;
    mu_residual at;
} mu_newton;

/* No two forces move apart, so that a step is too long where the force then moves back against it,
 * by more than half of what it moved before.  Then the step is cut by the rule of the secant.  The
 * map of a slow drag is made of pieces: beyond a kink it moves the force by a million times as
 * much, the secant alone would stand still, and the steps after a cut have to grow again. */
static int mu_cut_step(mu_newton *step, const mu_residual *r) {
    const double *way = step->at.step, *moved = step->at.moved;
    const double now = way[0] * r->moved[0] + way[1] * r->moved[1];
    const double before = way[0] * moved[0] + way[1] * moved[1];
    if (!(now < 0.0 && r->size > 0.5 * step->at.size && step->share > MU_MOTION_LEAST_SHARE))
        return 0;
    step->share *= mu_max(step->least, mu_min(before / (before - now), 0.7));
    step->least *= MU_MOTION_CUT;
    step->reach = 0.0;
    return 1;
}

static void mu_next_step(mu_newton *step, const mu_residual *r, const double *f) {
    const double size = mu_length(r->step[0], r->step[1]);
    if (step->reach < HUGE_VAL)
        step->reach =
            MU_MOTION_GROWTH * step->share * mu_length(step->at.step[0], step->at.step[1]);
    step->share = size > step->reach ? step->reach / size : 1.0;
    if (size <= step->reach) step->reach = HUGE_VAL;
    step->least = MU_MOTION_CUT;
    step->at = *r;
    step->from[0] = f[0];
    step->from[1] = f[1];
}

/* The cycle whose distance to the steady one is below goal, or the nearest of so many periods; f is
 * its start.  A path of slip below the least ends the search. */
static mu_steady mu_find_cycle(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                               double tolerance, double goal, int periods, double least,
                               double *f) {
    const double limit = mu_moment_at(m, 0.0).limit;
    mu_newton step = {
        {f[0], f[1]}, 1.0, MU_MOTION_CUT, HUGE_VAL, {{0.0, 0.0}, {0.0, 0.0}, HUGE_VAL}};
    mu_march march;
    march.step = 0.0;
    march.steps = steps;
    for (int period = 1;; ++period) {
        mu_residual r;
        double distance;
        mu_take_period(m, grid, f, tolerance, &march, NULL);
        r = mu_residual_of(&march, f, limit);
        distance = march.failed ? HUGE_VAL : mu_max(r.size, mu_length(r.step[0], r.step[1]));
        if (!march.slipped) distance = m->drag > 0.0 ? HUGE_VAL : 0.0;
        distance = mu_min(distance, 2.0 * limit);
        if (distance <= goal || period == periods || march.failed ||
            march.mean[MU_MEAN_PATH] < least)
            return mu_steady_of(&march, distance);
        if (!mu_cut_step(&step, &r)) mu_next_step(&step, &r, f);
        f[0] = step.from[0] + step.share * step.at.step[0];
        f[1] = step.from[1] + step.share * step.at.step[1];
        mu_keep_below(limit, f);
    }
}

/* The cycle near f of a contact that is dragged; where none is found, from the cycles of faster
 * drags. */
static mu_steady mu_find_dragged(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                                 double tolerance, double goal, double *f) {
    mu_shaken faster = *m;
    const double start[2] = {f[0], f[1]};
    const mu_steady out = mu_find_cycle(m, grid, steps, tolerance, goal, MU_MOTION_PERIODS, 0.0, f);
    faster.drag = MU_MOTION_FASTER / m->scale;
    if (out.distance <= goal || out.failed || faster.drag <= m->drag) return out;
    f[0] = start[0];
    f[1] = start[1];
    for (; faster.drag > 2.0 * m->drag; faster.drag *= MU_MOTION_SLOWER)
        (void)mu_find_cycle(&faster, grid, steps, tolerance, goal, MU_MOTION_PERIODS, 0.0, f);
    return mu_find_cycle(m, grid, steps, tolerance, goal, MU_MOTION_PERIODS, 0.0, f);
}

/* How far a contact at rest is from a cycle that sticks, after a period from f. */
static double mu_distance_at_rest(const mu_march *march, const mu_residual *r) {
    const double step = mu_length(r->step[0], r->step[1]);
    if (march->failed) return 2.0;
    if (march->mean[MU_MEAN_PATH] < 1e-13) return 0.0;
    if (r->size < 1e-13) return 1e4 * r->size; /* rounding */
    return mu_min(3.0 * mu_max(r->size, step), 2.0);
}

/* Whether Newton's step after a period is near the expected one. */
static int mu_is_expected(const mu_residual *r, const double *expected, double off) {
    return mu_length(r->step[0] - expected[0], r->step[1] - expected[1]) <= off;
}

/* The cycle that slips near f of a contact at rest, which is the only one; returns 0 where none is
 * found. */
static int mu_find_sliding(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                           double tolerance, double goal, double *f, mu_steady *cycle) {
    const double least = 1e3 * goal;
    *cycle = mu_find_cycle(m, grid, steps, tolerance, goal, MU_MOTION_SLIDING_PERIODS, least, f);
    return cycle->failed || (cycle->distance <= goal && cycle->mean[MU_MEAN_PATH] > least);
}

/* The cycle that a contact without force comes to from rest, period by period, where allowed with
 * leaps along Newton's step.  One that slips is the only one; of those that stick there are many,
 * and only its way decides between them.
 *
 * A period maps all forces around onto one line, as its derivative has rank one.  So a leap comes
 * back to the line of the way itself, and changes its end by no more than half of what any later
 * period moves the force.  Two periods one after another show that Newton's step can be trusted: it
 * has to shorten by what the first has moved.  A leap stays short of the end of the way: where the
 * contact does not slip after it as before, it is taken back.
 *
 * The steps that are left to be halved are those of the period that slips most: the last one hardly
 * slips, and halves of its steps may be those that the periods before have taken already. */
static mu_steady mu_follow_from_rest(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                                     double tolerance, double goal, int leaps, double *f) {
    double most = 0.0, step = 0.0, from[2] = {0.0, 0.0}, expected[2] = {0.0, 0.0};
    double back[2] = {0.0, 0.0}, share = MU_MOTION_LEAP, way = 0.0, moved = 0.0;
    int leapt = 0, any = 0, phases = 0, wait = 1, waited = 0;
    mu_march march;
    f[0] = f[1] = 0.0;
    march.step = 0.0;
    march.steps = steps;
    for (int period = 1;; ++period) {
        const double before = march.step;
        double distance;
        int alike;
        mu_residual r;
        mu_take_period(m, grid, f, tolerance, &march, NULL);
        r = mu_residual_of(&march, f, march.at.limit);
        if (march.mean[MU_MEAN_PATH] > most) {
            most = march.mean[MU_MEAN_PATH];
            step = before;
            from[0] = f[0];
            from[1] = f[1];
        }
        distance = mu_distance_at_rest(&march, &r);
        alike = march.phases == phases && mu_is_expected(&r, expected, MU_MOTION_OFF * way);
        if (leapt && !alike && way > goal && !march.failed) {
            f[0] = back[0];
            f[1] = back[1];
            share = mu_max(0.5 * share, 0.1);
            wait *= 2;
            leapt = waited = phases = 0;
            continue;
        }
        if (leapt) {
            share = mu_min(1.5 * share, MU_MOTION_LEAP);
            wait = wait > 1 ? wait / 2 : 1;
        }
        if (any) distance += 0.5 * (distance == 0.0 ? moved : r.size);
        if (distance <= goal || march.mean[MU_MEAN_PATH] < 1e-13 ||
            period >= MU_MOTION_REST_PERIODS || march.failed) {
            mu_steady out = mu_steady_of(&march, mu_min(distance, 2.0));
            out.from[0] = from[0];
            out.from[1] = from[1];
            out.step = step;
            out.slips_before = march.mean[MU_MEAN_PATH] < most;
            return out;
        }
        if (period == 2 && leaps) {
            double start[2] = {march.f[0], march.f[1]};
            mu_steady sliding;
            if (mu_find_sliding(m, grid, steps, tolerance, goal, start, &sliding)) {
                f[0] = start[0];
                f[1] = start[1];
                return sliding;
            }
        }
        waited = leapt ? 0 : alike ? waited + 1 : 0;
        way = share * mu_length(r.step[0], r.step[1]);
        moved = r.size;
        phases = march.phases;
        leapt = leaps && waited >= wait && phases > 1 && moved > 1e-12 && way > 2.0 * moved;
        back[0] = march.f[0];
        back[1] = march.f[1];
        if (leapt) { /* along the circle of the forces on which the last slip ends */
            const double *last = march.last;
            const double along = share * (r.step[0] * last[0] + r.step[1] * last[1]);
            const double inwards = 0.5 * along * along / march.last_limit;
            any = 1;
            f[0] += share * r.step[0] - inwards * last[1];
            f[1] += share * r.step[1] + inwards * last[0];
            mu_keep_below(march.at.limit, f);
            expected[0] = (1.0 - share) * r.step[0];
            expected[1] = (1.0 - share) * r.step[1];
        } else {
            f[0] = march.f[0];
            f[1] = march.f[1];
            expected[0] = r.step[0] - r.moved[0];
            expected[1] = r.step[1] - r.moved[1];
            way = moved;
        }
    }
}

/* The steady cycle near f; at rest the one that a contact without force comes to, which may be near
 * f only if it slips. */
static mu_steady mu_cycle_near(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                               double tolerance, double goal, int near, double *f) {
    mu_steady out;
    if (m->drag > 0.0) return mu_find_dragged(m, grid, steps, tolerance, goal, f);
    if (near && mu_find_sliding(m, grid, steps, tolerance, goal, f, &out)) return out;
    out = mu_follow_from_rest(m, grid, steps, tolerance, goal, 1, f);
    if (out.failed || out.distance <= goal || out.mean[MU_MEAN_PATH] > 1e-13) return out;
    return mu_follow_from_rest(m, grid, steps, tolerance, goal, 0, f);
}

static double mu_difference(const mu_steady *a, const mu_steady *b, int marks) {
    double sum = 0.0;
    for (int i = 0; i < 2 * marks; i += 2)
        sum += mu_length(a->marked[i] - b->marked[i], a->marked[i + 1] - b->marked[i + 1]);
    return sum;
}

/* Each step in two halves. */
static int mu_halve(const mu_grid *steps, mu_grid *grid) {
    double from = 0.0;
    if (2 * steps->n > grid->room) return 0;
    for (int64_t i = 0; i < steps->n; ++i) {
        const double to = steps->nodes[i];
        grid->nodes[2 * i] = 0.5 * (from + to);
        grid->nodes[2 * i + 1] = to;
        from = to;
    }
    grid->n = 2 * steps->n;
    return 1;
}

/* The steady cycle of a spring: steps are halved until the estimate is below the
 * tolerance, or this many times. */
static mu_steady mu_spring_motion(const mu_shaken *m, double tolerance, int levels, mu_grid *grid,
                                  mu_grid *steps, double *f) {
    const double limit = mu_moment_at(m, 0.0).limit;
    const int slow = m->drag > 0.0 && m->drag * m->scale < MU_MOTION_SLOW;
    const double followed = slow ? mu_min(tolerance, MU_MOTION_OF_SLOW) : tolerance;
    double of_step = mu_cube_root_near(mu_min(0.1 * followed, 1e-3));
    const double rounding = mu_max(MU_MOTION_ROUNDING, mu_min(0.05 * tolerance, 5e-9));
    const double goal = m->drag > 0.0 ? 0.1 * followed : 0.01 * mu_min(tolerance, 1e-5);
    int near = f[0] != 0.0 || f[1] != 0.0;
    mu_steady last, out;
    of_step *= of_step;
    grid->n = mu_min(m->nodes, (double)grid->room);
    for (int i = 0; i < grid->n; ++i)
        grid->nodes[i] = 2.0 * MU_PI * (double)(i + 1) / (double)grid->n;
    for (int level = 0;; ++level) { /* at rest, the errors of the whole way to the cycle stay */
        mu_keep_below(limit, f);
        out = mu_cycle_near(m, grid, steps, of_step, goal, near, f);
        /* steps too large to be followed */
        for (int i = 0; level == 0 && i < 3 && out.distance >= 2.0 * limit; ++i) {
            near = 0;
            f[0] = m->drag > 0.0 ? limit : 0.0;
            f[1] = 0.0;
            of_step *= 0.06;
            out = mu_cycle_near(m, grid, steps, of_step, goal, near, f);
        }
        out.level = level;
        out.error = 2.0 * limit;
        if (level > 0)
            out.error =
                (m->drag > 0.0 && !slow ? 2.0 : 6.0) * mu_difference(&out, &last, m->marks) +
                3.0 * out.distance + rounding;
        /* finer steps bring no cycle nearer, and of a contact at rest not always the same */
        if (out.error <= tolerance || level == levels) return out;
        if (level > 0 && (out.distance > tolerance ||
                          (m->drag == 0.0 && level > 1 && out.error > 0.5 * last.error)))
            return out;
        if (out.slips_before) { /* the steps of the last period are too few */
            mu_march march;
            march.step = out.step;
            march.steps = steps;
            mu_take_period(m, grid, out.from, of_step, &march, NULL);
        }
        if (!mu_halve(steps, grid)) return out;
        near = out.mean[MU_MEAN_PATH] > 1e3 * goal;
        last = out;
        of_step *= 0.06;
    }
}

/* The rule of Kronrod with 15 points: places and weights from the middle outwards. */
static const double MU_KRONROD[8][2] = {
    {0.0, 0.209482141084727828012999174891714},
    {0.207784955007898467600689403773245, 0.204432940075298892414161999234649},
    {0.405845151377397166906606412076961, 0.190350578064785409913256402421014},
    {0.586087235467691130294144691693145, 0.169004726639267902826583426598550},
    {0.741531185599394439863864773280788, 0.140653259715525918745189590510238},
    {0.864864423359769072789712788640926, 0.104790010322250183839876322541518},
    {0.949107912342758524526189684047851, 0.063092092629978553290700663189204},
    {0.991455371120812639206854697526329, 0.022935322010529224963732008058970},
};

/* Place and weight of point i of 15, from -1 to 1. */
static double mu_kronrod(int i, double *weight) {
    const double *point = MU_KRONROD[i < 7 ? 7 - i : i - 7];
    *weight = point[1];
    return i < 7 ? -point[0] : point[0];
}

/* Springs of a ball from t = low to high, which may be kinks: the error of their sum, and their
 * values at both ends by the polynomial through the points. */
typedef struct {
    double low, high, error, start[2], end[2];
    double mean[MU_MEANS], decay, of_springs;
    int kinks[2];
    double at[15];
    int sticks[15];
} mu_panel;

/* How rough two functions are at the points of the rule: the size of their four highest
 * coefficients by polynomials that are orthogonal there.  They stay large at kinks, wherever these
 * lie between the points. */
static double mu_roughness(double values[15][2], double *start, double *end) {
    double x[15], weight[15], last[15] = {0.0}, p[15], size = 0.0, square = 0.0;
    double at_end = 0.7071067811865476, before = 0.0, sign = 1.0;
    for (int i = 0; i < 15; ++i) {
        x[i] = mu_kronrod(i, &weight[i]);
        p[i] = at_end;
    }
    start[0] = start[1] = end[0] = end[1] = 0.0;
    for (int degree = 0; degree < 15; ++degree) {
        double next[15], sum = 0.0, c[2] = {0.0, 0.0}, beyond;
        for (int i = 0; i < 15; ++i) {
            c[0] += weight[i] * p[i] * values[i][0];
            c[1] += weight[i] * p[i] * values[i][1];
        }
        for (int j = 0; j < 2; ++j) {
            start[j] += sign * at_end * c[j];
            end[j] += at_end * c[j];
        }
        if (degree > 10) square += c[0] * c[0] + c[1] * c[1];
        for (int i = 0; i < 15; ++i) {
            next[i] = x[i] * p[i] - size * last[i];
            sum += weight[i] * next[i] * next[i];
        }
        beyond = at_end - size * before;
        size = sqrt(sum);
        before = at_end;
        at_end = beyond / size;
        sign = -sign;
        for (int i = 0; i < 15; ++i) {
            last[i] = p[i];
            p[i] = next[i] / size;
        }
    }
    return sqrt(square);
}

/* The motion of a spring with this share of the limit. */
static mu_shaken mu_of_spring(const mu_shaken *m, double share) {
    mu_shaken out = *m;
    out.scale = 1.0 / share;
    out.acceleration = m->acceleration / share;
    return out;
}

/* The springs of a ball at t: xi = 1 - t^2, so that they lie dense at the rim, where little load
 * may behave otherwise than all the rest.  What a spring adds per t is multiplied by 2 t. */
static double mu_share_at(double t) { return 1.5 * t * t * (2.0 - t * t); }

/* The start of the cycle of the spring at t. */
typedef struct {
    double t, f[2];
} mu_start;

/* A ball whose springs are computed one after another, with what is known of them. */
typedef struct {
    const mu_shaken *m;
    mu_grid *grid, *steps;
    int known; /* so far; of these the last are kept */
    mu_start starts[MU_MOTION_KNOWN];
} mu_ball;

/* The start of the cycle at t by the cubic through the four nearest that are known; that of the
 * nearest, where t is beyond them. */
static void mu_predict(const mu_ball *ball, double t, double *f) {
    const mu_start *near[4] = {NULL, NULL, NULL, NULL};
    const int n = ball->known < MU_MOTION_KNOWN ? ball->known : MU_MOTION_KNOWN;
    double low = 1.0, high = 0.0;
    int count = 0;
    for (int i = 0; i < n; ++i) {
        const mu_start *start = &ball->starts[i];
        int place = count < 4 ? count : 3;
        int again = 0;
        for (int j = 0; j < count; ++j) again = again || near[j]->t == start->t;
        if (again || (count == 4 && fabs(start->t - t) >= fabs(near[3]->t - t))) continue;
        for (; place > 0 && fabs(start->t - t) < fabs(near[place - 1]->t - t); --place)
            near[place] = near[place - 1];
        near[place] = start;
        if (count < 4) ++count;
    }
    f[0] = count ? near[0]->f[0] : ball->m->drag > 0.0 ? 1.0 : 0.0;
    f[1] = count ? near[0]->f[1] : 0.0;
    for (int j = 0; j < count; ++j) {
        low = mu_min(low, near[j]->t);
        high = mu_max(high, near[j]->t);
    }
    if (count < 4 || t < low || t > high) return;
    f[0] = f[1] = 0.0;
    for (int j = 0; j < 4; ++j) {
        double share = 1.0;
        for (int i = 0; i < 4; ++i)
            if (i != j) share *= (t - near[i]->t) / (near[j]->t - near[i]->t);
        f[0] += share * near[j]->f[0];
        f[1] += share * near[j]->f[1];
    }
}

/* The spring at t, which is sought from f. */
static mu_steady mu_spring_from(mu_ball *ball, double t, double tolerance, int levels, double *f) {
    const double share = mu_share_at(t);
    const mu_shaken one = mu_of_spring(ball->m, share);
    const mu_steady out =
        mu_spring_motion(&one, tolerance / share, levels, ball->grid, ball->steps, f);
    /* one that came from rest to stick is no start for others */
    if (ball->m->drag > 0.0 || out.mean[MU_MEAN_PATH] > 1e-13) {
        const mu_start start = {t, {f[0], f[1]}};
        ball->starts[ball->known++ % MU_MOTION_KNOWN] = start;
    }
    return out;
}

static mu_steady mu_spring_at(mu_ball *ball, double t, double tolerance, int levels) {
    double f[2];
    mu_predict(ball, t, f);
    return mu_spring_from(ball, t, tolerance, levels, f);
}

/* How many sticks the cycle at t has: longer steps show them. */
static int mu_sticks_at(mu_ball *ball, double t, double tolerance) {
    return mu_spring_at(ball, t, MU_MOTION_COARSE * tolerance, 0).sticks;
}

/* Where between low and high, with different numbers of slips, the cycle changes its kind. */
static double mu_kink(mu_ball *ball, double low, double high, int sticks, double tolerance) {
    const double close = 0.4 * sqrt(tolerance);
    while (high - low > close) {
        const double t = 0.5 * (low + high);
        if (mu_sticks_at(ball, t, tolerance) == sticks) {
            low = t;
        } else {
            high = t;
        }
    }
    return 0.5 * (low + high);
}

/* t at the share u of a panel, and its slope: at a kink, where springs change as
 * (t - kink)^(3/2), it changes as the square. */
static double mu_place_in(const mu_panel *panel, double u, double *slope) {
    const double width = panel->high - panel->low, rest = 1.0 - u;
    double share = u;
    *slope = width;
    if (panel->kinks[0] && panel->kinks[1]) {
        share = u * u * (3.0 - 2.0 * u);
        *slope = 6.0 * u * rest * width;
    } else if (panel->kinks[0]) {
        share = u * u;
        *slope = 2.0 * u * width;
    } else if (panel->kinks[1]) {
        share = 1.0 - rest * rest;
        *slope = 2.0 * rest * width;
    }
    return panel->low + share * width;
}

/* The springs of a panel in the order in which they are computed: those with halved steps first, so
 * that the rest lie between known ones. */
enum { MU_MOTION_HALVED = 4 };
static const int MU_PANEL_ORDER[15] = {1, 5, 9, 13, 3, 7, 11, 0, 2, 4, 6, 8, 10, 12, 14};

/* The larger error of the springs with halved steps next to spring i. */
static double mu_error_beside(const double *errors, int i) {
    const int before = i < 1 ? 1 : 4 * ((i - 1) / 4) + 1, after = before + 4;
    return i < 1 ? errors[1] : i > 13 ? errors[13] : mu_max(errors[before], errors[after]);
}

static mu_panel mu_ball_panel(mu_ball *ball, double low, double high, int kink_low, int kink_high,
                              double tolerance) {
    mu_panel out;
    double values[15][2], sums[15][2], ends[2], errors[15];
    int halvings = 0, kinks = 0;
    memset(&out, 0, sizeof out);
    out.low = low;
    out.high = high;
    out.kinks[0] = kink_low;
    out.kinks[1] = kink_high;
    out.decay = HUGE_VAL;
    for (int k = 0; k < 15; ++k) {
        const int i = MU_PANEL_ORDER[k], single = k >= MU_MOTION_HALVED && halvings < 2;
        double weight, slope;
        const double u = 0.5 + 0.5 * mu_kronrod(i, &weight), t = mu_place_in(&out, u, &slope);
        const double share = mu_share_at(t);
        mu_steady spring = mu_spring_at(ball, t, tolerance, single ? 0 : MU_MOTION_LEVELS);
        errors[i] = share * spring.error;
        if (single) errors[i] = mu_error_beside(errors, i) + 3.0 * share * spring.distance;
        if (!(errors[i] <= tolerance)) { /* from where the search for the cycle begins else */
            double f[2] = {ball->m->drag > 0.0 ? 1.0 : 0.0, 0.0};
            spring = mu_spring_from(ball, t, tolerance, MU_MOTION_LEVELS, f);
            errors[i] = share * spring.error;
        }
        halvings = spring.level > halvings ? spring.level : halvings;
        out.at[i] = t;
        out.sticks[i] = spring.sticks;
        for (int j = 0; j < MU_MEANS; ++j) {
            /* forces and works are in units of its limit, paths in those of its l0 */
            const double unit = 2.0 * t * (j == MU_MEAN_WORK ? share * share : share);
            out.mean[j] += 0.5 * weight * slope * unit * spring.mean[j];
            if (j <= MU_MEAN_Y) {
                values[i][j] = unit * spring.mean[j];
                sums[i][j] = slope * values[i][j];
            }
        }
        out.of_springs += 0.5 * weight * slope * 2.0 * t * errors[i];
        out.decay = mu_min(out.decay, spring.decay);
    }
    (void)mu_roughness(values, out.start, out.end);
    for (int i = 1; i < 15; ++i)
        kinks += (low == 0.0 || i < 4 || i > 11) && out.sticks[i] != out.sticks[i - 1];
    /* few of the points see springs at the rim, or close to an end, that behave otherwise than the
     * rest */
    out.error = (kinks ? 4.0 : 1.5) * mu_roughness(sums, ends, ends);
    return out;
}

/* The error of panel i: its own, and that of a kink between its end and its first point, which
 * shows in the neighbour's other value there. */
static double mu_panel_error(const mu_panel *panels, int n, int i) {
    const mu_panel *one = &panels[i];
    double error = one->error;
    for (int j = 0; j < n; ++j) {
        const mu_panel *other = &panels[j];
        if (other->low == one->high)
            error += (one->high - one->at[14]) *
                     mu_length(one->end[0] - other->start[0], one->end[1] - other->start[1]);
        if (other->high == one->low)
            error += (one->at[0] - one->low) *
                     mu_length(one->start[0] - other->end[0], one->start[1] - other->end[1]);
    }
    return error;
}

/* Panels of a ball before any is divided: from one kink to the next. */
static int mu_first_panels(mu_ball *ball, double tolerance, mu_panel *panels) {
    double edges[MU_MOTION_SCAN + 2] = {0.0}, before = 0.0;
    int n = 0, last = -1;
    for (int i = 0; i < MU_MOTION_SCAN; ++i) {
        const double t = (i + 1.0) / MU_MOTION_SCAN;
        const int now = mu_sticks_at(ball, t, tolerance);
        if (i > 0 && now != last) edges[++n] = mu_kink(ball, before, t, last, tolerance);
        last = now;
        before = t;
    }
    if (n == 0) {
        panels[0] = mu_ball_panel(ball, 0.0, 0.5, 0, 0, tolerance);
        panels[1] = mu_ball_panel(ball, 0.5, 1.0, 0, 0, tolerance);
        return 2;
    }
    edges[n + 1] = 1.0;
    for (int i = 0; i <= n; ++i)
        panels[i] = mu_ball_panel(ball, edges[i], edges[i + 1], i > 0, i < n, tolerance);
    return n + 1;
}

/* Where a panel is divided: at the kink between its points that is nearest to the middle, or in the
 * middle.  A kink close to an end is left to later divisions: coarse steps may see it where fine
 * ones do not. */
static double mu_division(mu_ball *ball, const mu_panel *panel, double tolerance, int *kink) {
    const double middle = 0.5 * (panel->low + panel->high);
    const double near = 0.02 * (panel->high - panel->low);
    int best = -1;
    *kink = 0;
    double nearest = HUGE_VAL;
    for (int i = 0; i < 14; ++i) {
        const double distance = fabs(i - 6.5);
        if (panel->sticks[i] != panel->sticks[i + 1] && distance < nearest)
            best = i, nearest = distance;
    }
    if (best >= 0) {
        const double at =
            mu_kink(ball, panel->at[best], panel->at[best + 1], panel->sticks[best], tolerance);
        *kink = at - panel->low > near && panel->high - at > near;
        if (*kink) return at;
    }
    return middle;
}

/* A ball: adaptive quadrature over its springs. */
static mu_steady mu_ball_motion(const mu_shaken *m, double tolerance, mu_grid *grid,
                                mu_grid *steps) {
    mu_panel panels[MU_MOTION_PANELS];
    const double half = 0.5 * tolerance;
    double error = 0.0;
    mu_ball ball;
    mu_steady out;
    int n;
    ball.m = m;
    ball.grid = grid;
    ball.steps = steps;
    ball.known = 0;
    n = mu_first_panels(&ball, half, panels);
    memset(&out, 0, sizeof out);
    out.decay = HUGE_VAL;
    for (;; ++n) {
        double most = -1.0, of_springs = 0.0;
        int worst = 0;
        error = 0.0;
        for (int i = 0; i < n; ++i) {
            const double own = mu_panel_error(panels, n, i);
            error += own;
            of_springs += panels[i].of_springs;
            if (own > most) {
                most = own;
                worst = i;
            }
        }
        if (error <= mu_max(half, tolerance - of_springs) || n == MU_MOTION_PANELS) break;
        {
            const mu_panel whole = panels[worst];
            int kink;
            const double middle = mu_division(&ball, &whole, half, &kink);
            panels[worst] = mu_ball_panel(&ball, whole.low, middle, whole.kinks[0], kink, half);
            panels[n] = mu_ball_panel(&ball, middle, whole.high, kink, whole.kinks[1], half);
        }
    }
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < MU_MEANS; ++j) out.mean[j] += panels[i].mean[j];
        out.error += panels[i].of_springs;
        out.decay = mu_min(out.decay, panels[i].decay);
    }
    out.error += error;
    return out;
}

static mu_shaken mu_shaken_as(const int32_t *counts, const double *orders, const double *one) {
    mu_shaken m = {counts, orders, one + 1, one[0], 1.0, 0.0, 16, 16, 0, {{0.0}}};
    double largest = 1.0;
    for (int i = 0; i < counts[0] + counts[1] + counts[2]; ++i) {
        if (i < counts[0] + counts[1])
            m.acceleration += orders[i] * orders[i] * fabs(m.terms[2 * i]);
        largest = mu_max(largest, orders[i]);
    }
    if (largest <= MU_MOTION_ORDERS) {
        m.highest = (int)largest;
        for (int i = 0; i < counts[0] + counts[1] + counts[2]; ++i) {
            const int place = i < counts[0] ? 0 : i < counts[0] + counts[1] ? 2 : 4;
            double *part = m.parts[(int)orders[i] - 1] + place, sine, cosine;
            mu_sine_cosine(m.terms[2 * i + 1], &sine, &cosine);
            part[0] += m.terms[2 * i] * cosine;
            part[1] += m.terms[2 * i] * sine;
        }
    }
    m.marks = 16 * (int)mu_min(largest, MU_MARKS / 16);
    m.nodes = m.marks * (((int)largest + MU_MARKS / 16 - 1) / (MU_MARKS / 16));
    return m;
}

/* Steady cycles of n motions, see library.h. */
static void mu_motions(int contact, int64_t n, const int32_t *counts, const double *orders,
                       const double *cases, double tolerance, int64_t room, double *work,
                       double *out) {
    mu_grid grid = {work, 0, room}, steps = {work + room, 0, room};
    const int64_t numbers = 1 + 2 * ((int64_t)counts[0] + counts[1] + counts[2]);
    for (int64_t i = 0; i < n; ++i, cases += numbers, out += MU_MEANS + 2) {
        const mu_shaken m = mu_shaken_as(counts, orders, cases);
        double f[2] = {m.drag > 0.0 ? 1.0 : 0.0, 0.0};
        const mu_steady cycle =
            contact == MU_BALL
                ? mu_ball_motion(&m, tolerance, &grid, &steps)
                : mu_spring_motion(&m, tolerance, MU_MOTION_LEVELS, &grid, &steps, f);
        memcpy(out, cycle.mean, sizeof cycle.mean);
        out[MU_MEANS] = cycle.decay;
        out[MU_MEANS + 1] = cycle.error;
    }
}

/* One cycle of springs with shares of the limit and weights at n + 1 equal times, see library.h. */
static void mu_motion_cycle(const int32_t *counts, const double *orders, const double *one,
                            int springs, const double *shares, const double *weights,
                            double tolerance, int64_t room, double *work, int64_t n,
                            double *forces) {
    mu_grid grid = {work, 0, room}, steps = {work + room, 0, room};
    const mu_shaken m = mu_shaken_as(counts, orders, one);
    double f[2] = {m.drag > 0.0 ? 1.0 : 0.0, 0.0};
    for (int64_t i = 0; i < 2 * (n + 1); ++i) forces[i] = 0.0;
    for (int i = 0; i < springs; ++i) {
        const mu_shaken spring = mu_of_spring(&m, shares[i]);
        mu_drawing drawing = {forces, weights[i] * shares[i], n, 0};
        mu_march march;
        march.step = 0.0;
        march.steps = &steps;
        (void)mu_spring_motion(&spring, tolerance, MU_MOTION_LEVELS, &grid, &steps, f);
        mu_take_period(&spring, &grid, f, tolerance, &march, &drawing);
    }
}
