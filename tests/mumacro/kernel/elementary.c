/* The kernel's elementary functions, which no program calls from outside, each for a column of
 * points. */
#include "kernel.c"
#include "motion.c"

#define FUNCTION(name, value)                                                             \
    void name(int n, const double *first, const double *second, double *out) {            \
        for (int i = 0; i < n; ++i) {                                                     \
            const double x = first[i], y = second[i];                                     \
            double sine, cosine;                                                          \
            (void)y, (void)sine, (void)cosine;                                            \
            out[i] = value;                                                               \
        }                                                                                 \
    }

FUNCTION(sine, (mu_sine_cosine(x, &sine, &cosine), sine))
FUNCTION(cosine, (mu_sine_cosine(x, &sine, &cosine), cosine))
FUNCTION(logarithm, mu_log1(x))
FUNCTION(length, mu_hypot(x, y))
FUNCTION(cube_root, mu_first(mu_cube_root(mu_all(x))))
FUNCTION(decay, mu_decay(x))
FUNCTION(mean_inverse, mu_mean_inverse(x, y))
FUNCTION(damping, mu_damping(x))
FUNCTION(arcsine, mu_arcsine(x))
FUNCTION(arc_rest, mu_arc_of(x).rest)
FUNCTION(arc_bent, mu_arc_of(x).bent)
FUNCTION(outside, mu_outside(x))
