/* Several points at once: arithmetic on as many doubles as the processor holds in one register.
 *
 * One type, mu_lanes, and a few operations on it; MU_LANES is 8, 4, 2 or, for any other compiler,
 * 1.  Every operation is exact or rounded once, lane by lane, so the number of lanes never changes
 * a result.  mu_fma is fused where the processor can do that (AVX2 with FMA, AVX-512, NEON);
 * elsewhere the last digits may differ. */
#ifndef MU_LANES_H
#define MU_LANES_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined __FMA__ || defined __ARM_FEATURE_FMA
#define MU_FUSED 1
#else
#define MU_FUSED 0
#endif

#if !defined __GNUC__ || defined MUMACRO_ONE_LANE /* which is what tests define */
#define MU_LANES 1
#elif defined __AVX512F__ && defined __AVX512DQ__ && defined __AVX512VL__
#define MU_LANES 8
#elif defined __AVX2__ && MU_FUSED
#define MU_LANES 4
#else
#define MU_LANES 2
#endif

#if MU_LANES > 2
#include <immintrin.h>
#endif

#if defined __GNUC__
#define MU_INLINE static inline __attribute__((always_inline, unused))
#define MU_LISTED static const __attribute__((unused)) /* only some programs read the list */
#else
#define MU_INLINE static inline
#define MU_LISTED static const
#endif

/* The bits of a number, and back. */
MU_INLINE int64_t mu_bits(double x) {
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
MU_INLINE double mu_number(int64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* a b + c of single numbers, as mu_fma. */
MU_INLINE double mu_fma1(double a, double b, double c) {
#if MU_FUSED && defined __GNUC__
    return __builtin_fma(a, b, c);
#else
    return a * b + c;
#endif
}

#if MU_LANES > 1
typedef double mu_lanes __attribute__((vector_size(8 * MU_LANES)));
/* -1 where true, 0 where false */
typedef int64_t mu_mask __attribute__((vector_size(8 * MU_LANES)));
typedef int32_t mu_whole __attribute__((vector_size(4 * MU_LANES)));
#define MU_WHERE(condition) ((mu_mask)(condition))
#define MU_BITS(x) ((mu_mask)(x))
#define MU_NUMBER(bits) ((mu_lanes)(bits))
#define MU_AS(type, x) __builtin_convertvector(x, type)

MU_INLINE mu_lanes mu_all(double x) {
    const mu_lanes zero = {0};
    return zero + x;
}
MU_INLINE mu_mask mu_all_whole(int64_t x) {
    const mu_mask zero = {0};
    return zero + x;
}
MU_INLINE double mu_first(mu_lanes x) { return x[0]; }
MU_INLINE int64_t mu_first_whole(mu_mask x) { return x[0]; }
MU_INLINE int32_t mu_first_cell(mu_whole x) { return x[0]; }
MU_INLINE mu_lanes mu_select(mu_mask where, mu_lanes a, mu_lanes b) {
    return (mu_lanes)((where & (mu_mask)a) | (~where & (mu_mask)b));
}
MU_INLINE mu_mask mu_select_whole(mu_mask where, mu_mask a, mu_mask b) {
    return (where & a) | (~where & b);
}
#if MU_LANES == 8
MU_INLINE mu_lanes mu_sqrt(mu_lanes x) { return (mu_lanes)_mm512_maskz_sqrt_pd(255, (__m512d)x); }
MU_INLINE mu_lanes mu_fma(mu_lanes a, mu_lanes b, mu_lanes c) {
    return (mu_lanes)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c);
}
#elif MU_LANES == 4
MU_INLINE mu_lanes mu_sqrt(mu_lanes x) { return (mu_lanes)_mm256_sqrt_pd((__m256d)x); }
MU_INLINE mu_lanes mu_fma(mu_lanes a, mu_lanes b, mu_lanes c) {
    return (mu_lanes)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
}
#else
MU_INLINE mu_lanes mu_sqrt(mu_lanes x) {
    const mu_lanes root = {__builtin_sqrt(x[0]), __builtin_sqrt(x[1])};
    return root;
}
MU_INLINE mu_lanes mu_fma(mu_lanes a, mu_lanes b, mu_lanes c) {
#if MU_FUSED
    const mu_lanes sum = {__builtin_fma(a[0], b[0], c[0]), __builtin_fma(a[1], b[1], c[1])};
    return sum;
#else
    return a * b + c;
#endif
}
#endif
#else
typedef double mu_lanes;
typedef int64_t mu_mask;
typedef int32_t mu_whole;
#define MU_WHERE(condition) (-(int64_t)(condition))
#define MU_BITS(x) mu_bits(x)
#define MU_NUMBER(bits) mu_number(bits)
#define MU_AS(type, x) ((type)(x))

MU_INLINE mu_lanes mu_all(double x) { return x; }
MU_INLINE mu_mask mu_all_whole(int64_t x) { return x; }
MU_INLINE double mu_first(mu_lanes x) { return x; }
MU_INLINE int64_t mu_first_whole(mu_mask x) { return x; }
MU_INLINE int32_t mu_first_cell(mu_whole x) { return x; }
MU_INLINE mu_lanes mu_select(mu_mask where, mu_lanes a, mu_lanes b) { return where ? a : b; }
MU_INLINE mu_mask mu_select_whole(mu_mask where, mu_mask a, mu_mask b) { return where ? a : b; }
MU_INLINE mu_lanes mu_sqrt(mu_lanes x) { return sqrt(x); }
MU_INLINE mu_lanes mu_fma(mu_lanes a, mu_lanes b, mu_lanes c) { return mu_fma1(a, b, c); }
#endif

MU_INLINE mu_lanes mu_load(const double *at) {
    mu_lanes x;
    memcpy(&x, at, sizeof x);
    return x;
}
MU_INLINE void mu_store(double *at, mu_lanes x) { memcpy(at, &x, sizeof x); }
/* The lower of two numbers, the higher, the one without its sign. */
MU_INLINE mu_lanes mu_lower(mu_lanes a, mu_lanes b) { return mu_select(MU_WHERE(b < a), b, a); }
MU_INLINE mu_lanes mu_higher(mu_lanes a, mu_lanes b) { return mu_select(MU_WHERE(b > a), b, a); }
MU_INLINE mu_lanes mu_size(mu_lanes x) { return mu_higher(x, -x); }
/* Whether a condition holds in every lane. */
MU_INLINE int mu_is_everywhere(mu_mask where) {
    int64_t lanes[MU_LANES], all = -1;
    memcpy(lanes, &where, sizeof lanes);
    for (int i = 0; i < MU_LANES; ++i) all &= lanes[i];
    return all != 0;
}
MU_INLINE void mu_store_whole(int64_t *at, mu_mask x) { memcpy(at, &x, sizeof x); }

#endif
