/* The limit of large speed: mu~ = f(r) + g(r)/v~^2 + ... with r = y~/v~, and the same of the
 * power. */

/* of coordinates, Horner sums and the inputs' last digits, relative to the value's scale */
#define MU_ROUNDING 2e-15
/* what a value may lose where it leaves the normal range of double precision */
#define MU_DENORMAL 1e-306
#define MU_FAST_ROUNDING 1.5e-15 /* of mu~ at large speed, relative */
#define MU_RIGID_ROUNDING 1e-15  /* of mu~ of rigid contact, relative */
/* of y~ = y0 k/(mu0 Fz) in the static limit: three roundings, relative */
#define MU_STATIC_ROUNDING 4.5e-16
#define MU_POWER_ROUNDING (8.0 * MU_ROUNDING)
/* Times max(1/v~, y~/v~^2)^4: what two terms of the power leave out, relative;
 * 1.001 at most in 50,000 solves. */
#define MU_NEXT_ORDER 1.25

typedef struct {
    double first, second, first_slope, second_slope, bend; /* f, g, r f', r g', r (r f')' */
    /* sqrt(1 + r^2); h J_p for p = 3, 5, 7, see below */
    double h, i3, i5, i7;
} mu_outer;

/* f = (2/pi) K(i r), eq. (35), K the complete elliptic integral, by the arithmetic-geometric mean;
 * and g = r^2 <sin^2 (1/2 - r^2 cos^2) (1 + r^2 cos^2)^(-7/2)>; r >= 0. */
static mu_outer mu_outer_expansion(double r) {
    mu_outer out = {0.0, 0.0, 0.0, 0.0, 0.0, HUGE_VAL, 1.0, 0.0, 0.0};
    const double h = mu_hypot(1.0, r), q = 1.0 / h; /* q = sqrt(1 - m) with m = r^2 / (1 + r^2) */
    double m, q2, a = 1.0, b = q, power = 0.5, total, k, e, i5, i7, i9;
    if (q == 0.0) return out;
    m = (r * q) * (r * q);
    q2 = q * q;
    total = 0.5 * m;
    for (int i = 0; i < 64; ++i) {
        const double c = 0.5 * (a - b), mean = 0.5 * (a + b);
        b = sqrt(a * b);
        a = mean;
        power *= 2.0;
        total += power * c * c;
        if (c <= 1e-9 * a) break;
    }
    k = 1.0 / a; /* (2/pi) K(m) */
    e = k * (1.0 - total);
    /* q^p <(1 - m sin^2)^(-p/2)> without the powers of q, by the recurrence in p */
    i5 = (2.0 * (2.0 - m) * e - q2 * k) / 3.0;
    i7 = (4.0 * (2.0 - m) * i5 - 3.0 * q2 * e) / 5.0;
    i9 = (6.0 * (2.0 - m) * i7 - 5.0 * q2 * i5) / 7.0;
    /* d J_p / d ln r = -p (J_p - J_(p+2)), J_p = <(1 + r^2 cos^2)^(-p/2)>: J3 = q e, J5 = q i5,
     * J7 = q i7, J9 = q i9, with 1 + r^2 = h^2 taken into i7 and i9 */
    out.first = k * q;
    out.second = (1.5 * i7 - m * i5) * h + q * (e - 2.5 * i5);
    out.first_slope = q * (e - k);
    out.second_slope = 3.0 * m * i7 * h - 10.5 * (i7 - i9) * h - 2.0 * m * i5 * h +
                       5.0 * (m * h + 2.5 * q) * (i5 - i7) - 3.0 * q * (e - i5);
    out.bend = q * (k - e - 3.0 * (e - i5));
    out.h = h;
    out.i3 = e;
    out.i5 = i5;
    out.i7 = i7;
    return out;
}

#define MU_OUTER_CELLS 48
#define MU_OUTER_LOG_MAX 4.0
#define MU_OUTER_MAX 54.598150033144236 /* exp(MU_OUTER_LOG_MAX) */

/* f and g + r f'/2 at 1 <= t = 1 + r^2 < MU_OUTER_MAX, from the cells. */
MU_INLINE void mu_outer_terms(const double *cells, double t, double *first, double *rest) {
    const double x = mu_first(mu_log(mu_all(t))) * (MU_OUTER_CELLS / MU_OUTER_LOG_MAX);
    const int cell = (int)mu_min(mu_max(0.0, x), MU_OUTER_CELLS - 1.0);
    const double u = 2.0 * (x - cell) - 1.0, *row = cells + 16 * cell;
    *first = row[0];
    *rest = row[8];
    for (int i = 1; i < 8; ++i) {
        *first = mu_fma1(*first, u, row[i]);
        *rest = mu_fma1(*rest, u, row[8 + i]);
    }
}

typedef struct {
    /* orders, and their slopes along ln v~ and ln y~ */
    double first, first_v, first_y, both, both_v, both_y;
} mu_power_terms;

/* Power for large v~, from the slow manifold of eq. (11); the relative error of both terms is
 * O(v~^-4).  With D = 1 + r^2 cos^2, r = y~/v~ and J_p = <D^(-p/2)>: the first order is v~ <r^2
 * cos^2 / sqrt D>, the second -(((1 + r^2) J_5 - J_3)/2 + g)/v~ times the square of mu_contact. */
static mu_power_terms mu_power_expansion(double v, double y, double square) {
    /* <cos^2 / sqrt(1 + n cos^2)> = sum of (-1)^k c_k c_(k+1) n^k, c_k = (2k
     * choose k) / 4^k; highest power first */
    static const double series[11] = {
        0.02963424653717084,
        -0.032679369614925236,
        0.03642282681539655,
        -0.04113636910915375,
        0.047254085540771484,
        -0.055515289306640625,
        0.067291259765625,
        -0.08544921875,
        0.1171875,
        -0.1875,
        0.5,
    };
    const double r = y / v, n = r * r;
    const mu_outer outer = mu_outer_expansion(r);
    /* <sqrt(1 + n cos^2)> = (1 + n) J3 = h i3; J1 is f */
    const double h = outer.h, j3 = outer.i3 / h, j5 = outer.i5 / h;
    const double next = square * (0.5 * (h * outer.i5 - j3) + outer.second) / v;
    const double next_y = square *
                          (h * outer.i5 - j5 - 2.5 * h * (outer.i5 - outer.i7) + 1.5 * (j3 - j5) +
                           outer.second_slope) /
                          v;
    double lead = v * (h * outer.i3 - outer.first), lead_y = v * (h * outer.i3 - j3);
    mu_power_terms out;
    if (r < 0.2) { /* of the closed form, digits would cancel; eleven terms hold to rounding */
        double sum = series[0], rising = 0.0;
        for (int k = 1; k < 11; ++k) {
            rising = rising * n + sum;
            sum = sum * n + series[k];
        }
        lead = y * r * sum;
        lead_y = 2.0 * y * r * (sum + n * rising);
    }
    out.first = lead;
    out.first_v = lead - lead_y;
    out.first_y = lead_y;
    out.both = lead - next;
    out.both_v = out.both + 2.0 * next - (lead_y - next_y);
    out.both_y = lead_y - next_y;
    return out;
}
