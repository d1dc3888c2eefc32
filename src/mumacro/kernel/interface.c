/* The functions of mumacro.h, of the table mumacro_table. */

static const mumacro_data *const MU_TABLE = &mumacro_table.spring;

/* What a contact is read from: along and normal there are closed forms, which need a rule at
 * most. */
static const mumacro_data *mu_table_of(int contact, int direction) {
    return contact == MU_BALL && direction == MU_ACROSS ? &mumacro_table.ball : MU_TABLE;
}

/* A table may hold fewer quantities than there are. */
static int mu_is_held(int quantity) {
    return quantity >= 0 && quantity < MU_QUANTITIES && MU_TABLE->quantities[quantity].cells > 0;
}

/* Value of a quantity at a point, and its bound, where wanted; NaN
 * where the table does not hold it. */
static double mu_held_value(int quantity, double v, double y, double *bound) {
    double value = NAN;
    if (bound) *bound = NAN;
    if (mu_is_held(quantity))
        mu_values(MU_TABLE, MU_SPRING, quantity, 1, &v, &y, &value, bound, NULL);
    return value;
}

/* An answer from its rows; what is returned. */
static int mu_fill(const double *rows, int source, int returned, mumacro_answer *out) {
    out->mu_macro = rows[MU_ROW_MU_MACRO];
    out->mu_ratio = rows[MU_ROW_MU_RATIO];
    out->error_bound = rows[MU_ROW_ERROR_BOUND];
    out->v_tilde = rows[MU_ROW_V_TILDE];
    out->y_tilde = rows[MU_ROW_Y_TILDE];
    out->source = source;
    out->regime = source < 0 ? -1 : mu_source_of(source).regime;
    memcpy(out->gradient, rows + MU_ROW_GRADIENT, sizeof out->gradient);
    memcpy(out->gradient_bound, rows + MU_ROW_GRADIENT_BOUND, sizeof out->gradient_bound);
    return returned;
}

MUMACRO_API int mumacro_evaluate(double mu0, double Fz, double k, double y0, double omega,
                                 double v0, mumacro_answer *out) {
    return mumacro_evaluate_as(MU_SPRING, MU_ACROSS, mu0, Fz, k, y0, omega, v0, out);
}

MUMACRO_API int mumacro_evaluate_as(int contact, int direction, double mu0, double Fz, double k,
                                    double y0, double omega, double v0, mumacro_answer *out) {
    const mu_inputs in = {mu0, Fz, k, y0, omega, v0};
    const double *const columns[6] = {&mu0, &Fz, &k, &y0, &omega, &v0};
    static const int64_t strides[6] = {0, 0, 0, 0, 0, 0};
    double rows[MU_ROWS];
    int8_t source = -1;
    int bad;
    if (out == NULL) return MUMACRO_NO_OUTPUT;
    for (int i = 0; i < MU_ROWS; ++i) rows[i] = NAN;
    if (contact < 0 || contact >= MU_CONTACTS || direction < 0 || direction >= MU_DIRECTIONS)
        return mu_fill(rows, -1, MUMACRO_NO_CONTACT, out);
    if (contact == MU_BALL && direction == MU_NORMAL)
        return mu_fill(rows, -1, MUMACRO_NO_NORMAL_BALL, out);
    if (mu_table_of(contact, direction)->quantities[MU_MU_RATIO].cells == 0)
        return mu_fill(rows, -1, MUMACRO_NO_CONTACT, out);
    mu_cases_as(mu_table_of(contact, direction), contact, direction, 1, columns, strides, MU_ROWS,
                rows, 1, &source);
    bad = mu_first_bad(direction, &in);
    return mu_fill(rows, source, bad == 4 && direction == MU_NORMAL ? MUMACRO_LIFT_OFF : bad, out);
}

/* The power of rigid contact: p is v~ times a function of y~/v~, or y~ times a constant. */
static double mu_rigid_power(const mu_inputs *in, double *bound) {
    const double fast = 1e100, steepest = 1e50, r = mu_amplitude_ratio(in);
    const double steep = r < steepest ? r : steepest;
    const double speed = r < steepest ? in->v0 : in->y0 * in->omega / steepest;
    const double unit = in->mu0 * in->Fz * speed / fast;
    const double power = unit * mu_held_value(MU_POWER, fast, fast * steep, bound);
    *bound *= unit;
    return power;
}

/* Where nothing oscillates there is no border and no power: 0.  Rigid contact has its border at
 * 0. */
static void mu_cycle_of(const mu_inputs *in, mumacro_cycle *out) {
    double v, y, length, unit;
    mu_groups(MU_ACROSS, in, &v, &y);
    out->stick_fraction = mu_held_value(MU_STICK, v, y, &out->stick_fraction_bound);
    if (in->y0 == 0.0 || in->omega == 0.0) {
        out->v0_crit = out->power = out->power_bound = 0.0;
        return;
    }
    if (in->k == HUGE_VAL) {
        out->v0_crit = 0.0;
        out->power = mu_rigid_power(in, &out->power_bound);
        return;
    }
    /* an amplitude that underflows no longer tells whether such a contact sticks */
    if (y == 0.0 && v < HUGE_VAL) out->stick_fraction_bound = 1.0;
    if (v == HUGE_VAL || y == HUGE_VAL) return;
    length = mu_length_scale(in->mu0, in->Fz, in->k);
    unit = in->mu0 * in->Fz * (length * in->omega);
    out->v0_crit = length * mu_border_at(MU_TABLE, y) * in->omega;
    out->power = unit * mu_held_value(MU_POWER, v, y, &out->power_bound);
    out->power_bound *= unit;
}

MUMACRO_API int mumacro_evaluate_cycle(double mu0, double Fz, double k, double y0, double omega,
                                       double v0, mumacro_cycle *out) {
    const mumacro_cycle nothing = {NAN, NAN, NAN, NAN, NAN};
    const mu_inputs in = {mu0, Fz, k, y0, omega, v0};
    const int error = mu_first_bad(MU_ACROSS, &in);
    if (out == NULL) return MUMACRO_NO_OUTPUT;
    *out = nothing;
    if (!error) mu_cycle_of(&in, out);
    return error;
}

MUMACRO_API double mumacro_mu_macro(double mu0, double Fz, double k, double y0, double omega,
                                    double v0) {
    mumacro_case answer;
    mu_one(MU_TABLE, MU_SPRING, mu0, Fz, k, y0, omega, v0, 0, &answer);
    return answer.mu_macro;
}

MUMACRO_API void mumacro_mu_macros(int64_t n, const double *mu0, const double *Fz, const double *k,
                                   const double *y0, const double *omega, const double *v0,
                                   double *mu_macro, double *bound) {
    static const int64_t strides[6] = {1, 1, 1, 1, 1, 1};
    for (int64_t i = 0; i < n; i += MU_CHUNK) {
        const double *const columns[6] = {mu0 + i, Fz + i, k + i, y0 + i, omega + i, v0 + i};
        const int few = mu_few(n - i);
        double rows[MU_ROW_V_TILDE * MU_CHUNK];
        int8_t source[MU_CHUNK];
        mu_cases(MU_TABLE, MU_SPRING, few, columns, strides, MU_ROW_V_TILDE, rows, MU_CHUNK,
                 source);
        memcpy(mu_macro + i, rows + MU_ROW_MU_MACRO * MU_CHUNK, (size_t)few * sizeof *rows);
        if (bound)
            memcpy(bound + i, rows + MU_ROW_ERROR_BOUND * MU_CHUNK, (size_t)few * sizeof *rows);
    }
}

MUMACRO_API int mumacro_evaluate_point(int quantity, double v_tilde, double y_tilde,
                                       mumacro_point *out) {
    const mumacro_point nothing = {NAN, NAN, NAN, NAN, NAN, NAN, -1};
    double slopes[MU_SLOPE_ROWS];
    int8_t source;
    if (out == NULL) return MUMACRO_NO_OUTPUT;
    *out = nothing;
    if (!mu_is_held(quantity)) return MUMACRO_NO_QUANTITY;
    mu_values(MU_TABLE, MU_SPRING, quantity, 1, &v_tilde, &y_tilde, &out->value, &out->bound,
              &source);
    mu_slopes_of_points(MU_TABLE, MU_SPRING, quantity, 1, &v_tilde, &y_tilde, slopes, 1);
    out->slope_v = slopes[MU_SLOPE_V];
    out->slope_y = slopes[MU_SLOPE_Y];
    out->slope_v_bound = slopes[MU_SLOPE_V_BOUND];
    out->slope_y_bound = slopes[MU_SLOPE_Y_BOUND];
    out->source = source;
    return source >= 0 ? 0 : v_tilde >= 0.0 ? 2 : 1;
}

MUMACRO_API int mumacro_values(int quantity, int64_t n, const double *v_tilde,
                               const double *y_tilde, double *value, double *bound) {
    if (!mu_is_held(quantity)) return MUMACRO_NO_QUANTITY;
    mu_values(MU_TABLE, MU_SPRING, quantity, n, v_tilde, y_tilde, value, bound, NULL);
    return 0;
}

MUMACRO_API double mumacro_mu_ratio(double v_tilde, double y_tilde) {
    return mu_ratio_alone(MU_TABLE, v_tilde, y_tilde);
}

MUMACRO_API double mumacro_power(double v_tilde, double y_tilde) {
    return mu_held_value(MU_POWER, v_tilde, y_tilde, NULL);
}

MUMACRO_API double mumacro_stick_fraction(double v_tilde, double y_tilde) {
    return mu_held_value(MU_STICK, v_tilde, y_tilde, NULL);
}

MUMACRO_API double mumacro_v_tilde_crit(double y_tilde) { return mu_border_at(MU_TABLE, y_tilde); }

/* How a force is made of the law: mu_macro(speed) Fz share, with d speed / d v0 and d share / d
 * v0. */
typedef struct {
    double speed, share, of_speed, of_share;
} mu_motion;

static mu_motion mu_motion_of(double v0, double v_rest) {
    const double a = v0 / v_rest, square = 1.0 + a * a, sign = v0 < 0.0 ? -1.0 : 1.0;
    const mu_motion sliding = {fabs(v0), sign, sign, 0.0}, illegal = {NAN, NAN, NAN, NAN};
    const mu_motion resting = {0.5 * v_rest * square, 2.0 * a / square, a,
                               2.0 * (1.0 - a * a) / (square * square) / v_rest};
    if (!(fabs(v0) < HUGE_VAL && v_rest > 0.0 && v_rest < HUGE_VAL)) return illegal;
    return fabs(v0) < v_rest ? resting : sliding;
}

MUMACRO_API double mumacro_force(double v0, double v_rest, double mu0, double Fz, double k,
                                 double y0, double omega) {
    const mu_motion at = mu_motion_of(v0, v_rest);
    return at.share * Fz * mumacro_mu_macro(mu0, Fz, k, y0, omega, at.speed);
}

MUMACRO_API int mumacro_evaluate_force(int contact, int direction, double v0, double v_rest,
                                       double mu0, double Fz, double k, double y0, double omega,
                                       double *force, double gradient[6]) {
    const mu_motion at = mu_motion_of(v0, v_rest);
    mumacro_answer law;
    int error;
    if (force == NULL || gradient == NULL) return MUMACRO_NO_OUTPUT;
    error = mumacro_evaluate_as(contact, direction, mu0, Fz, k, y0, omega, at.speed, &law);
    *force = at.share * Fz * law.mu_macro;
    for (int i = 0; i < 6; ++i) gradient[i] = at.share * Fz * law.gradient[i];
    gradient[1] += at.share * law.mu_macro;
    gradient[5] = Fz * (at.of_speed * at.share * law.gradient[5] + at.of_share * law.mu_macro);
    return error == 6 ? MUMACRO_NO_VELOCITY : error;
}

MUMACRO_API int mumacro_element_step(int springs, double mu0, double Fz, double k, double dx,
                                     double dy, double *state, double force[2]) {
    double limit;
    if (state == NULL || force == NULL) return MUMACRO_NO_OUTPUT;
    if (springs < 1 || !(fabs(dx) < HUGE_VAL && fabs(dy) < HUGE_VAL)) return MUMACRO_NO_STEP;
    if (!(mu0 > 0.0 && mu0 < HUGE_VAL)) return 1;
    limit = mu0 * Fz;
    if (!(Fz >= 0.0 && limit < HUGE_VAL)) return 2;
    if (!(k > 0.0 && k < HUGE_VAL)) return 3;
    mu_element_steps(1, springs, &limit, &limit, &k, &dx, &dy, state, force);
    return 0;
}

MUMACRO_API const char *mumacro_source_name(int source) {
    return source < 0 || source >= MU_SOURCES ? "illegal" : mu_source_of(source).name;
}

MUMACRO_API const char *mumacro_regime_name(int regime) {
    return regime < 0 || regime >= MU_REGIMES ? "illegal" : MU_REGIME_NAME[regime];
}

MUMACRO_API const char *mumacro_error_text(int error) {
    static const char *const texts[14] = {
        "for a force v0 must be finite, and v_rest finite and > 0",
        "dx and dy must be finite, and there must be a spring",
        ("the normal force of a ball cannot oscillate: its contact radius would change, which is "
         "not modelled"),
        "there is no such contact or direction",
        "there is no such quantity",
        "there is no place for the answer",
        "",
        "mu0 must be finite and > 0",
        "Fz must be finite and > 0",
        "k must be finite and > 0, or infinite",
        "y0 must be finite and >= 0",
        "omega must be finite and >= 0",
        "v0 must be finite and >= 0",
        "the amplitude of the normal force must be >= 0 and below Fz: at Fz the contact lifts off",
    };
    return error < MUMACRO_NO_VELOCITY || error > MUMACRO_LIFT_OFF
               ? "there is no such error"
               : texts[error - MUMACRO_NO_VELOCITY];
}

MUMACRO_API double mumacro_tolerance(void) { return mumacro_table.tolerance; }
MUMACRO_API const char *mumacro_checksum(void) { return mumacro_table.checksum; }
MUMACRO_API const char *mumacro_version(void) { return mumacro_table.version; }
