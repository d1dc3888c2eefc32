/* What tests and benchmarks call: the header's functions over arrays, for a shared library. */
#include "mumacro.h"

void ratios(const double *v, const double *y, int n, double *out) {
    for (int i = 0; i < n; ++i) out[i] = mumacro_mu_ratio(v[i], y[i]);
}

void borders(const double *y, int n, double *out) {
    for (int i = 0; i < n; ++i) out[i] = mumacro_v_tilde_crit(y[i]);
}

/* out (n, 8): value, bound, slopes along ln v~ and ln y~, their bounds, source, return value */
void points(int quantity, const double *v, const double *y, int n, double *out) {
    for (int i = 0; i < n; ++i, out += 8) {
        mumacro_point p;
        out[7] = mumacro_evaluate_point(quantity, v[i], y[i], &p);
        out[0] = p.value, out[1] = p.bound, out[2] = p.slope_v, out[3] = p.slope_y;
        out[4] = p.slope_v_bound, out[5] = p.slope_y_bound, out[6] = p.source;
    }
}

/* in (n, 6); out (n, 20): mu_macro, mu_ratio, bound, v~, y~, source, regime, return value, gradient, its bounds */
void cases(const double *in, int n, double *out) {
    for (int i = 0; i < n; ++i, in += 6, out += 20) {
        mumacro_answer a;
        out[7] = mumacro_evaluate(in[0], in[1], in[2], in[3], in[4], in[5], &a);
        out[0] = a.mu_macro, out[1] = a.mu_ratio, out[2] = a.error_bound, out[3] = a.v_tilde, out[4] = a.y_tilde;
        out[5] = a.source, out[6] = a.regime;
        memcpy(out + 8, a.gradient, sizeof a.gradient);
        memcpy(out + 14, a.gradient_bound, sizeof a.gradient_bound);
    }
}

void values(const double *in, int n, double *out) {
    for (int i = 0; i < n; ++i, in += 6) out[i] = mumacro_mu_macro(in[0], in[1], in[2], in[3], in[4], in[5]);
}

/* in (n, 6); out (n, 6): v0 at the border, power, its bound, stick fraction, its bound, return value */
void cycles(const double *in, int n, double *out) {
    for (int i = 0; i < n; ++i, in += 6, out += 6) {
        mumacro_cycle c;
        out[5] = mumacro_evaluate_cycle(in[0], in[1], in[2], in[3], in[4], in[5], &c);
        out[0] = c.v0_crit, out[1] = c.power, out[2] = c.power_bound;
        out[3] = c.stick_fraction, out[4] = c.stick_fraction_bound;
    }
}
