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

/* sqrt(x^2 + y^2) of what may not be squared. */
static inline double mumacro_in_hypot(double x, double y) {
    const double a = mumacro_in_fmax(fabs(x), fabs(y)), b = mumacro_in_fmin(fabs(x), fabs(y));
    if (a == HUGE_VAL || b == 0.0) return a;
    if (a < 1e150 && b > 1e-150) return sqrt(x * x + y * y);
    return a * sqrt(1.0 + (b / a) * (b / a));
}

/* Cube root of x > 0, to 13 digits: it starts an iteration. */
static inline double mumacro_in_cbrt(double x) { return exp(log(x) / 3.0); }

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
