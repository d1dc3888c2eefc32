/* What tests and benchmarks call: the functions of mumacro.h over arrays, for a shared library. */
#include <string.h>

#include "mumacro.h"

void ratios(const double *v, const double *y, int n, double *out) {
    for (int i = 0; i < n; ++i) out[i] = mumacro_mu_ratio(v[i], y[i]);
}

void ratio_array(const double *v, const double *y, int n, double *out) {
    mumacro_values(MUMACRO_MU_RATIO, n, v, y, out, NULL);
}

void borders(const double *y, int n, double *out) {
    for (int i = 0; i < n; ++i) out[i] = mumacro_v_tilde_crit(y[i]);
}

/* out (n, 9): value, bound, slopes along ln v~ and ln y~, their bounds,
 * source, return value, value alone */
void points(int quantity, const double *v, const double *y, int n, double *out) {
    double (*const alone[])(double, double) = {mumacro_mu_ratio, mumacro_power,
                                               mumacro_stick_fraction};
    for (int i = 0; i < n; ++i, out += 9) {
        mumacro_point p;
        out[7] = mumacro_evaluate_point(quantity, v[i], y[i], &p);
        out[0] = p.value, out[1] = p.bound, out[2] = p.slope_v, out[3] = p.slope_y;
        out[4] = p.slope_v_bound, out[5] = p.slope_y_bound, out[6] = p.source;
        out[8] = alone[quantity](v[i], y[i]);
    }
}

/* out (2, n): values and bounds */
int values(int quantity, const double *v, const double *y, int n, double *out) {
    return mumacro_values(quantity, n, v, y, out, out + n);
}

/* in (6, n); out (n, 21): mu_macro, mu_ratio, bound, v~, y~, source, regime, return value,
 * gradient, its bounds, value alone */
void cases(int contact, int direction, const double *in, int n, double *out) {
    for (int i = 0; i < n; ++i, ++in, out += 21) {
        const double mu0 = in[0], Fz = in[n], k = in[2 * n], y0 = in[3 * n], omega = in[4 * n];
        const double v0 = in[5 * n];
        mumacro_answer a;
        out[7] = mumacro_evaluate_as(contact, direction, mu0, Fz, k, y0, omega, v0, &a);
        out[0] = a.mu_macro, out[1] = a.mu_ratio, out[2] = a.error_bound, out[3] = a.v_tilde,
        out[4] = a.y_tilde;
        out[5] = a.source, out[6] = a.regime;
        memcpy(out + 8, a.gradient, sizeof a.gradient);
        memcpy(out + 14, a.gradient_bound, sizeof a.gradient_bound);
        out[20] = mumacro_mu_macro(mu0, Fz, k, y0, omega, v0);
    }
}

/* in (6, n); out (2, n): mu_macro and its bound */
void case_arrays(const double *in, int n, double *out) {
    mumacro_mu_macros(n, in, in + n, in + 2 * n, in + 3 * n, in + 4 * n, in + 5 * n, out, out + n);
}

/* in (6, n); out (n, 6): v0 at the border, power, its bound, stick
 * fraction, its bound, return value */
void cycles(const double *in, int n, double *out) {
    for (int i = 0; i < n; ++i, ++in, out += 6) {
        mumacro_cycle c;
        out[5] =
            mumacro_evaluate_cycle(in[0], in[n], in[2 * n], in[3 * n], in[4 * n], in[5 * n], &c);
        out[0] = c.v0_crit, out[1] = c.power, out[2] = c.power_bound;
        out[3] = c.stick_fraction, out[4] = c.stick_fraction_bound;
    }
}
