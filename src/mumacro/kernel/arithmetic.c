/* Elementary functions that give the same bits everywhere, alone and in arrays: no
 * call of a mathematical library. */

#define MU_PI 3.141592653589793
#define MU_TWO_OVER_PI 0.6366197723675814
#define MU_LN2 0.6931471805599453
#define MU_SQRT2 1.4142135623730951

MU_INLINE double mu_min(double a, double b) { return b < a ? b : a; }
MU_INLINE double mu_max(double a, double b) { return b > a ? b : a; }

/* The whole part of x, of any x: beyond 1e9 that is 1e9, and NaN counts as the lowest. */
MU_INLINE int32_t mu_whole_of(double x) { return (int32_t)mu_min(mu_max(-1e9, x), 1e9); }

/* ln x of normal x > 0; off by at most 4e-16 of the larger of 1 and |ln x|.
 *
 * The exponent times ln 2, plus the interpolant of ln m at 22 Chebyshev points of
 * 1 <= m < 2, in powers of 2 m - 3. */
MU_INLINE mu_lanes mu_log(mu_lanes x) {
    /* by the remainder of the power by 4: four short sums instead of one long chain */
    static const double c[4][6] = {
        {-2.5599340398034772e-11, -1.4937846446461467e-09, -1.5682598837570532e-07,
         -1.9051975262152995e-05, -0.003086419753098382, 0.4054651081081644},
        {8.147030617423693e-12, 4.68876933664286e-10, 4.825438145941571e-08, 5.645029741591138e-06,
         0.000823045267493534, 0.3333333333333333},
        {0.0, -1.137399589058893e-10, -1.489798820617583e-08, -1.6935019474605292e-06,
         -0.00022862368522794772, -0.055555555555555254},
        {0.0, 3.581167726977918e-11, 4.634629673422033e-09, 5.131822958476521e-07,
         6.53210529159902e-05, 0.012345679012345583},
    };
    const mu_mask bits = MU_BITS(x);
    /* a whole number below 2^52 as a double: its bits behind those of 2^52 */
    const mu_lanes exponent = MU_NUMBER((bits >> 52) | 0x4330000000000000) - 4503599627371519.0;
    const mu_lanes t = 2.0 * MU_NUMBER((bits & 0x000fffffffffffff) | 0x3ff0000000000000) - 3.0;
    const mu_lanes t2 = t * t, t4 = t2 * t2;
    mu_lanes sum[4];
    for (int j = 0; j < 4; ++j) {
        sum[j] = mu_all(c[j][0]);
        for (int i = 1; i < 6; ++i) sum[j] = mu_fma(sum[j], t4, mu_all(c[j][i]));
    }
    sum[0] = mu_fma(t2, mu_fma(t, sum[3], sum[2]), mu_fma(t, sum[1], sum[0]));
    return mu_fma(exponent, mu_all(MU_LN2), sum[0]);
}

/* ln x of any finite x > 0. */
static double mu_log1(double x) {
    const int subnormal = x < 2.2250738585072014e-308;
    const double log = mu_first(mu_log(mu_all(subnormal ? x * 18014398509481984.0 : x))); /* 2^54 */
    return subnormal ? log - 54.0 * MU_LN2 : log;
}

/* sqrt(x^2 + y^2) of what may not be squared, to the last digit: the
 * root's own error is taken out of it. */
static double mu_hypot(double x, double y) {
    const double larger = mu_max(fabs(x), fabs(y)), smaller = mu_min(fabs(x), fabs(y));
    const double scale = larger > 1e150     ? 1e-160
                         : larger < 1e-280  ? 1e300
                         : smaller < 1e-140 ? 1e140
                                            : 1.0;
    const double a = larger * scale, b = smaller * scale;
    double h, d, excess;
    if (larger == HUGE_VAL || smaller <= larger * 1e-17) return larger;
    h = sqrt(a * a + b * b);
    if (h <= 2.0 * b) { /* h^2 - a^2 - b^2, without squares that cancel */
        d = h - b;
        excess = a * (2.0 * d - a) + (d - 2.0 * (a - b)) * d;
    } else {
        d = h - a;
        excess = 2.0 * d * (a - 2.0 * b) + ((4.0 * d - b) * b + d * d);
    }
    return (h - excess / (2.0 * h)) / scale;
}

/* The cube root of finite x > 0, to about 1e-5 for a start: a third of the
 * exponent, then Halley's method once. */
static double mu_cube_root_near(double x) {
    const int subnormal = x < 2.2250738585072014e-308;
    const double m = subnormal ? x * 18014398509481984.0 : x; /* 2^54 */
    double root = mu_number(mu_bits(m) / 3 + 0x2a9f7893782da1ce), cube;
    cube = root * root * root;
    root *= (cube + 2.0 * m) / (2.0 * cube + m);
    return subnormal ? root / 262144.0 : root; /* 2^18 */
}

/* The cube root of normal x > 0 in lanes, off by at most 4e-16 of itself: as
 * above, and then to the fourth order. */
MU_INLINE mu_lanes mu_cube_root(mu_lanes x) {
    const mu_mask third =
        (((MU_BITS(x) >> 32) * 0x55555556) & ~(int64_t)0xffffffff) + 0x2a9f7893782da1ce;
    mu_lanes root = MU_NUMBER(third), cube = root * root * root, off;
    root = root * ((cube + 2.0 * x) / (2.0 * cube + x));
    off = (x - root * root * root) / x;
    return mu_fma(
        root * off,
        mu_fma(off, mu_fma(off, mu_all(14.0 / 81.0), mu_all(2.0 / 9.0)), mu_all(1.0 / 3.0)), root);
}

/* x = m 2^e with 1/2 <= m < 1, of finite x > 0: returns m. */
static double mu_split(double x, int64_t *exponent) {
    const int subnormal = x < 2.2250738585072014e-308;
    const int64_t bits = mu_bits(subnormal ? x * 18014398509481984.0 : x); /* 2^54 */
    *exponent = (bits >> 52) - 1022 - (subnormal ? 54 : 0);
    return mu_number((bits & 0x000fffffffffffff) | 0x3fe0000000000000);
}

/* x 2^e of 2^-60 < x < 2^60, rounded once. */
static double mu_scale(double x, int64_t e) {
    if (e > 2200) e = 2200;
    if (e < -2200) e = -2200;
    for (; e > 900; e -= 900) x *= mu_number((int64_t)1923 << 52);
    for (; e < -900; e += 900) x *= mu_number((int64_t)123 << 52);
    return x * mu_number((e + 1023) << 52);
}

/* exp(-x) of x >= 0, off by at most 4e-16 of itself while x < 700; 0 of an infinite x. */
static double mu_decay(double x) {
    /* x = n ln 2 + r with |r| <= ln(2)/2; n ln 2 in two parts, of which the first is exact */
    const int32_t n = mu_whole_of(x / MU_LN2 + 0.5);
    const double r = x - n * 0.693147180369123816490 - n * 1.90821492927058770002e-10;
    double sum = 1.0;
    if (!(x < 800.0)) return 0.0;
    /* the terms that are left out: below 5e-18 */
    for (int i = 13; i > 0; --i) sum = 1.0 - sum * r / i;
    return mu_scale(sum, -n);
}

/* a b / (c d e) of finite positive numbers whose partial products may overflow or underflow. */
static double mu_quotient(double a, double b, double c, double d, double e) {
    int64_t i, j, k, l, m;
    const double above = mu_split(a, &i) * mu_split(b, &j);
    const double below = mu_split(c, &k) * mu_split(d, &l) * mu_split(e, &m);
    return mu_scale(above / below, i + j - k - l - m);
}
