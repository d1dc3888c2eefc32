/* Slip and stick of one spring, and where they end.
 *
 * It sticks, where its force follows the motion, or slips, where |f| is the limit L.  With the
 * velocity w of the upper point and the angle th of the force, slip is
 *
 *     th' = w.t / L,   slip speed = w.n - L',   n = (cos th, sin th), t = (-sin th, cos th),
 *
 * a quadratic equation for u = tan((th - th0)/2), which the method of Radau of order 5 integrates.
 * Stick ends where |f| reaches L, slip where its speed falls through 0.
 *
 * A threshold that says *tried* is not derived.  It was tried over the motions of `errors` in
 * benchmarks/motion.py: amplitudes to 1e2 l0, drags from 1e-9 to 1e3 l0 per radian, tolerances from
 * 1e-9 to 1e-4.  What it decides is only time, or a step that is taken again: the estimate of the
 * error does not rest on it. */

#define MU_SQRT6 2.449489742783178
#define MU_RADAU_NEWTON 1e-6 /* a step of Newton's method leaves its square, which is rounding */
/* of Newton's method; with more the step is too long, and is taken again (tried) */
#define MU_RADAU_ITERATIONS 9
/* sum of the u of the stages: beyond, Newton's method is lost (tried) */
#define MU_RADAU_FURTHEST 9.0
/* u of a stage: 53 degrees, to which the cubic through them follows the angle (tried) */
#define MU_RADAU_LARGEST 0.5
#define MU_EVENT_ITERATIONS 60 /* halving a step as often leaves 2^-60 = 1e-18 of it */
#define MU_EVENT_WIDTH 1e-15   /* of a step: a few roundings of its end */
/* of the fastest slip of a step: roundings of the slip speed, a sum of velocities */
#define MU_EVENT_SPEED 1e-13
#define MU_EVENT_EXCESS 1e-15 /* of the limit squared: a few roundings of |f|^2 - L^2 */
/* of the fastest: a speed whose cubic has a higher least does not fall to 0 (tried) */
#define MU_EVENT_LOW 0.3
#define MU_EVENT_PARABOLAS 3 /* steps to that least (tried) */
#define MU_EVENT_TOPS 12     /* steps of regula falsi to the largest excess of a stick (tried) */
/* of a step: a stick that is outside the limit after it is rounding, and does not begin (tried) */
#define MU_EVENT_NO_STICK 1e-12

/* The method of Radau IIA of order 5: places of the stages, and their weights. */
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
    for (int count = 0; change > MU_RADAU_NEWTON; ++count) {
        double rest[3], j[3], c[3][3], d[3], minor[3], determinant;
        if (count == MU_RADAU_ITERATIONS) return 0;
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
        if (!(fabs(u[0]) + fabs(u[1]) + fabs(u[2]) < MU_RADAU_FURTHEST)) return 0;
    }
    if (!(mu_max(fabs(u[0]), mu_max(fabs(u[1]), fabs(u[2]))) < MU_RADAU_LARGEST)) return 0;
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
    if (value[1] > MU_EVENT_LOW * mu_max(mu_max(speed[0], speed[1]), mu_max(speed[2], speed[3])))
        return 0;
    for (int count = 0; count < MU_EVENT_PARABOLAS; ++count) {
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
    for (int count = 0; count < MU_EVENT_ITERATIONS && b->high - b->low > MU_EVENT_WIDTH; ++count) {
        const double share = mu_next_guess(b), speed = mu_speed_at(m, start, slip, share);
        mu_narrow(b, share, speed);
        if (fabs(speed) <= MU_EVENT_SPEED * fastest) return share;
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
        for (int count = 0; count < MU_EVENT_TOPS && b.at_high <= 0.0; ++count) {
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
            if (share < MU_EVENT_NO_STICK) return 0.0;
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
    for (int count = 0; count < MU_EVENT_ITERATIONS && b.high - b.low > MU_EVENT_WIDTH; ++count) {
        const double share = mu_next_guess(&b);
        double value;
        at = mu_stuck_at(stick, share, f);
        value = mu_excess(&at, f);
        mu_narrow(&b, share, value);
        if (fabs(value) <= MU_EVENT_EXCESS * at.limit * at.limit) return share;
    }
    return b.high;
}
