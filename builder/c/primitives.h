/* What the C library has under other names, or not in every freestanding one. */

static inline double mumacro_in_fmin(double a, double b) { return b < a ? b : a; }
static inline double mumacro_in_fmax(double a, double b) { return b > a ? b : a; }
static inline int64_t mumacro_in_imin(int64_t a, int64_t b) { return b < a ? b : a; }
static inline int64_t mumacro_in_imax(int64_t a, int64_t b) { return b > a ? b : a; }

/* The bits of a number, and back. */
static inline int64_t mumacro_in_bits(double x) {
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline double mumacro_in_number(int64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* Whole part of |x| < 2^63. */
static inline double mumacro_in_trunc(double x) { return (double)(int64_t)x; }

/* sqrt(x^2 + y^2) of what may not be squared, to the last digit: the root's own error is taken out of it. */
static inline double mumacro_in_hypot(double x, double y) {
    const double larger = mumacro_in_fmax(fabs(x), fabs(y)), smaller = mumacro_in_fmin(fabs(x), fabs(y));
    const double scale = larger > 1e150 ? 1e-160 : smaller < 1e-140 ? 1e140 : 1.0;
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

/* x = m 2^e with 1/2 <= m < 1, of finite x > 0. */
static inline mumacro_in_di mumacro_in_frexp(double x) {
    const int subnormal = x < 2.2250738585072014e-308;
    const int64_t bits = mumacro_in_bits(subnormal ? x * 18014398509481984.0 : x); /* 2^54 */
    return mumacro_in_di_of(
        mumacro_in_number((bits & INT64_C(0xfffffffffffff)) | INT64_C(0x3fe0000000000000)),
        (bits >> 52) - 1022 - (subnormal ? 54 : 0));
}

/* x 2^e of 2^-60 < |x| < 2^60, rounded once. */
static inline double mumacro_in_ldexp(double x, int64_t e) {
    if (e > 2200) e = 2200;
    if (e < -2200) e = -2200;
    for (; e > 900; e -= 900) x *= mumacro_in_number(INT64_C(1923) << 52);
    for (; e < -900; e += 900) x *= mumacro_in_number(INT64_C(123) << 52);
    return x * mumacro_in_number((e + 1023) << 52);
}

/* Cube root of finite x > 0. */
static inline double mumacro_in_cbrt(double x) {
    const mumacro_in_di parts = mumacro_in_frexp(x);
    const int64_t rest = (parts._1 % 3 + 3) % 3;
    const double m = mumacro_in_ldexp(parts._0, rest), root = exp(log(m) / 3.0);
    return mumacro_in_ldexp(root - (root * root * root - m) / (3.0 * root * root), (parts._1 - rest) / 3);
}
