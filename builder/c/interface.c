MUMACRO_API int mumacro_evaluate(double mu0, double Fz, double k, double y0, double omega, double v0,
                                 mumacro_answer *out) {
    const int error = (int)mumacro_in_first_bad(mu0, Fz, k, y0, omega, v0);
    const mumacro_in_ddidd found = mumacro_in_case(mu0, Fz, k, y0, omega, v0, mumacro_in_table_of(mu));
    double slopes[2][6];
    if (out == NULL) return MUMACRO_NO_OUTPUT;
    mumacro_in_gradient(mu0, Fz, k, y0, omega, v0, found._0, found._1, found._2, found._3, found._4,
                        mumacro_in_table_of(mu), slopes);
    out->mu_macro = mu0 * found._0;
    out->mu_ratio = found._0;
    out->error_bound = mu0 * found._1;
    out->v_tilde = found._3;
    out->y_tilde = found._4;
    out->source = (int)found._2;
    out->regime = found._2 < 0 ? -1 : mumacro_in_regimes[found._2];
    memcpy(out->gradient, slopes[0], sizeof slopes[0]);
    memcpy(out->gradient_bound, slopes[1], sizeof slopes[1]);
    return error;
}

MUMACRO_API int mumacro_evaluate_cycle(double mu0, double Fz, double k, double y0, double omega, double v0,
                                       mumacro_cycle *out) {
    const int error = (int)mumacro_in_first_bad(mu0, Fz, k, y0, omega, v0);
    mumacro_in_ddddd found;
    if (out == NULL) return MUMACRO_NO_OUTPUT;
    found = error ? mumacro_in_ddddd_of(NAN, NAN, NAN, NAN, NAN)
                  : mumacro_in_cycle(mu0, Fz, k, y0, omega, v0, mumacro_in_cells_of(power), mumacro_in_table_of(stick));
    out->v0_crit = found._0;
    out->power = found._1;
    out->power_bound = found._2;
    out->stick_fraction = found._3;
    out->stick_fraction_bound = found._4;
    return error;
}

MUMACRO_API double mumacro_mu_macro(double mu0, double Fz, double k, double y0, double omega, double v0) {
    return mu0 * mumacro_in_case(mu0, Fz, k, y0, omega, v0, mumacro_in_table_of(mu))._0;
}

MUMACRO_API int mumacro_evaluate_point(int quantity, double v_tilde, double y_tilde, mumacro_point *out) {
    mumacro_in_ddi found = mumacro_in_ddi_of(NAN, NAN, -1);
    mumacro_in_ddddd slopes = mumacro_in_ddddd_of(NAN, NAN, NAN, NAN, NAN);
    int known = 1;
    if (out == NULL) return MUMACRO_NO_OUTPUT;
    switch (quantity) {
#define MUMACRO_IN_QUANTITY(code, name) \
    case code: \
        found = mumacro_in_answer(code, v_tilde, y_tilde, mumacro_in_table_of(name)); \
        slopes = mumacro_in_answer_with_slopes(code, v_tilde, y_tilde, mumacro_in_table_of(name)); \
        break
        MUMACRO_IN_QUANTITY(MUMACRO_MU_RATIO, mu);
        MUMACRO_IN_QUANTITY(MUMACRO_POWER, power);
        MUMACRO_IN_QUANTITY(MUMACRO_STICK_FRACTION, stick);
#undef MUMACRO_IN_QUANTITY
    default:
        known = 0;
    }
    out->value = found._0;
    out->bound = found._1;
    out->slope_v = slopes._1;
    out->slope_y = slopes._2;
    out->slope_v_bound = slopes._3;
    out->slope_y_bound = slopes._4;
    out->source = (int)found._2;
    if (!known) return MUMACRO_NO_QUANTITY;
    return found._2 >= 0 ? 0 : v_tilde >= 0.0 ? 2 : 1;
}

MUMACRO_API double mumacro_mu_ratio(double v_tilde, double y_tilde) {
    return mumacro_in_ratio(v_tilde, y_tilde, mumacro_in_table_of(mu));
}

MUMACRO_API double mumacro_power(double v_tilde, double y_tilde) {
    return mumacro_in_answer(MUMACRO_POWER, v_tilde, y_tilde, mumacro_in_table_of(power))._0;
}

MUMACRO_API double mumacro_stick_fraction(double v_tilde, double y_tilde) {
    return mumacro_in_answer(MUMACRO_STICK_FRACTION, v_tilde, y_tilde, mumacro_in_table_of(stick))._0;
}

MUMACRO_API double mumacro_v_tilde_crit(double y_tilde) {
    return mumacro_in_border_at(y_tilde, mumacro_in_border_cells, mumacro_in_pieces);
}

MUMACRO_API const char *mumacro_source_name(int source) {
    return source < 0 || source >= MUMACRO_SOURCES ? "illegal" : mumacro_in_source_names[source];
}

MUMACRO_API const char *mumacro_error_text(int error) {
    if (error == MUMACRO_NO_OUTPUT) return "there is no place for the answer";
    if (error == MUMACRO_NO_QUANTITY) return "there is no such quantity";
    return error < 0 || error > 6 ? "there is no such error" : mumacro_in_error_texts[error];
}
