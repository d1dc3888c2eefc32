/* What a web page calls: everything about one case as an array of doubles, and texts. */
#include "mumacro.h"

#define EXPORT(name) __attribute__((export_name(#name)))

static double found[18];

/* Return code of mumacro_evaluate, mu_macro, mu_ratio, error bound, v~, y~, source, regime, speed at the border [m/s],
 * power [W], stick fraction, the gradient. */
EXPORT(evaluate) double *evaluate(double mu0, double Fz, double k, double y0, double omega, double v0) {
    mumacro_answer a;
    mumacro_cycle c;
    found[0] = mumacro_evaluate(mu0, Fz, k, y0, omega, v0, &a);
    mumacro_evaluate_cycle(mu0, Fz, k, y0, omega, v0, &c);
    found[1] = a.mu_macro, found[2] = a.mu_ratio, found[3] = a.error_bound, found[4] = a.v_tilde, found[5] = a.y_tilde;
    found[6] = a.source, found[7] = a.regime;
    found[8] = c.v0_crit, found[9] = c.power, found[10] = c.stick_fraction;
    for (int i = 0; i < 6; ++i) found[11 + i] = a.gradient[i];
    return found;
}

EXPORT(tolerance) double tolerance(void) { return mumacro_tolerance(); }
EXPORT(checksum) const char *checksum(void) { return mumacro_checksum(); }
EXPORT(error_text) const char *error_text(int error) { return mumacro_error_text(error); }
EXPORT(source_name) const char *source_name(int source) { return mumacro_source_name(source); }
EXPORT(regime_name) const char *regime_name(int regime) { return mumacro_regime_name(regime); }
