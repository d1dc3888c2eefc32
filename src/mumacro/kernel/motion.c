/* The motion of the upper point of a contact, which is periodic beside a drag.
 *
 * Units of this and of the three files after it, motion_slip.c, motion_cycle.c, motion_ball.c: the
 * mean limit mu0 Fz for forces, l0 = mu0 Fz / k for lengths, the angle tau = omega t for time. */

enum {
    /* parts of a period of a harmonic, whose sums are kept: each turns it by 2 pi/16 = 0.393, below
     * MU_DAMPED */
    MU_MARKS_OF_A_HARMONIC = 16,
    MU_MARKS = 256, /* at most: those of the harmonic 16; of higher ones a part has several steps */
    /* harmonics that are summed by the rule of sin and cos of a sum, which adds a rounding with
     * each order */
    MU_MOTION_ORDERS = 12,
    MU_MOMENTS = 4 /* computed at once: a vector of them */
};

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

/* sin x and cos x of |x| < 1e5, off by at most 1.8e-16, sin x of |x| <= pi/4 by 1e-16: by the
 * series of Taylor, whose coefficients are 1/17! to -1/3! and 1/16! to -1/2!, of what is left of
 * whole quarter turns (Cody and Waite). */
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

/* A harmonic turns by no more than this from one end of a step to the other. */
#define MU_DAMPED 0.4

/* sin(half) / half of half <= MU_DAMPED / 2, to 1e-17: the series of Taylor, whose factors are
 * those of 3!, 5!/3! and so on. */
static double mu_damping(double half) {
    const double z = half * half;
    return 1.0 -
           z / 6.0 * (1.0 - z / 20.0 * (1.0 - z / 42.0 * (1.0 - z / 72.0 * (1.0 - z / 110.0))));
}

/* The mean way over a time in which no harmonic turns by more than MU_DAMPED. */
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

/* The length of a vector whose squares are within the range of numbers. */
static double mu_length(double x, double y) { return sqrt(x * x + y * y); }

/* The motion of a spring with this share of the limit. */
static mu_shaken mu_of_spring(const mu_shaken *m, double share) {
    mu_shaken out = *m;
    out.scale = 1.0 / share;
    out.acceleration = m->acceleration / share;
    return out;
}

/* A motion of library.h: counts of the harmonics, their orders, drag and terms. */
static mu_shaken mu_shaken_as(const int32_t *counts, const double *orders, const double *one) {
    mu_shaken m = {
        counts, orders, one + 1, one[0], 1.0, 0.0, MU_MARKS_OF_A_HARMONIC, MU_MARKS_OF_A_HARMONIC,
        0,      {{0.0}}};
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
    m.marks = MU_MARKS_OF_A_HARMONIC * (int)mu_min(largest, MU_MARKS / MU_MARKS_OF_A_HARMONIC);
    m.nodes = m.marks * (((int)largest + MU_MARKS / MU_MARKS_OF_A_HARMONIC - 1) /
                         (MU_MARKS / MU_MARKS_OF_A_HARMONIC));
    return m;
}
