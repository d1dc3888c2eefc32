/* What differs from quantity to quantity: limits, closed forms for large
 * speed, rounding; and the records. */

/* --- limits at v~ = 0, y~ = 0 or infinity ----------------------------------------------------- */

static mu_answer mu_limit(double value, double bound, int source) {
    const mu_answer out = {value, bound, source};
    return out;
}

/* What all quantities share: illegal points, y~ = 0 and v~ = infinity; MU_OTHER elsewhere. */
static mu_answer mu_common_limit(double v, double y, double without_oscillation) {
    if (!(v >= 0.0 && y >= 0.0)) return mu_limit(NAN, NAN, -1);
    if (y == 0.0) return mu_limit(without_oscillation, 0.0, MU_NO_OSCILLATION);
    return v == HUGE_VAL ? mu_limit(without_oscillation, 0.0, MU_FAST)
                         : mu_limit(NAN, NAN, MU_OTHER);
}

/* The static limit, eq. (16).  The last digit of y~ = y0 k/(mu0 Fz) counts next to y~ = 1, where
 * |sqrt(1 - y - d) - sqrt(1 - y)| <= sqrt(d). */
static mu_answer mu_ratio_limit(double v, double y) {
    const double cusp = y < 1.0 + MU_STATIC_ROUNDING ? sqrt(2.0 * MU_STATIC_ROUNDING) : 0.0;
    const mu_answer common = mu_common_limit(v, y, 1.0);
    double mu;
    if (y == HUGE_VAL) return mu_limit(NAN, NAN, -1);
    if (common.source != MU_OTHER || v > 0.0) return common;
    if (y >= 1.0) return mu_limit(0.0, cusp, MU_STATIC_LIMIT);
    mu = sqrt((1.0 - y) * (1.0 + y));
    return mu_limit(mu, mu_min(MU_STATIC_ROUNDING / mu, cusp), MU_STATIC_LIMIT);
}

/* Above y~ = 1 the limit v~ -> 0 is no closed form: MU_OTHER, a very small v~ stands for it. */
static mu_answer mu_power_limit(double v, double y) {
    const mu_answer common = mu_common_limit(v, y, 0.0);
    if (y == HUGE_VAL && v == HUGE_VAL) return mu_limit(NAN, NAN, -1);
    if (common.source != MU_OTHER) return common;
    if (y == HUGE_VAL) return mu_limit(HUGE_VAL, 0.0, MU_S_TAIL);
    if (v > 0.0 || y > 1.0) return common;
    return mu_limit(0.0, y > 1.0 - MU_ROUNDING ? MU_ROUNDING : 0.0, MU_STATIC_LIMIT);
}

static mu_answer mu_stick_limit(double v, double y) {
    const mu_answer common = mu_common_limit(v, y, 0.0);
    if (common.source != MU_OTHER) return common;
    if (y == HUGE_VAL) return mu_limit(0.0, 0.0, MU_S_TAIL);
    if (v > 0.0 || y > 1.0) return common;
    return mu_limit(1.0, y > 1.0 - MU_ROUNDING ? 2.0 * sqrt(MU_ROUNDING) : 0.0, MU_STATIC_LIMIT);
}

/* --- large speed ------------------------------------------------------------------------------ */

static mu_answer mu_ratio_fast(const mumacro_data *data, double v, double y) {
    mu_answer out = {0.0, 0.0, MU_FAST};
    out.value = mu_fast_ratio(data->outer, v, y, &out.bound);
    return out;
}

MU_INLINE double mu_smallness(double v, double y) { return mu_max(1.0 / v, y / v / v); }

static mu_slopes mu_ratio_fast_slopes(const mumacro_data *data, double v, double y) {
    const double small = mu_smallness(v, y), speed = mu_hypot(v, 1.0);
    const mu_outer outer = mu_outer_expansion(y / speed);
    mu_slopes out;
    double bound;
    out.value = mu_fast_ratio(data->outer, v, y, &bound);
    out.bound = HUGE_VAL;
    out.along_y = outer.first_slope + (outer.second_slope + 0.5 * outer.bend) / speed / speed;
    out.along_v = -(v / speed) * (v / speed) *
                  (out.along_y + (2.0 * outer.second + outer.first_slope) / speed / speed);
    bound = fabs(outer.second) + fabs(outer.second_slope) + fabs(outer.first_slope);
    out.bound_v = 16.0 * bound / speed / speed * small * small + 8.0 * MU_ROUNDING * out.value;
    out.bound_y = out.bound_v;
    return out;
}

static mu_answer mu_power_fast(const mumacro_data *data, double v, double y) {
    const double power = mu_power_expansion(v, y).both, small = mu_smallness(v, y);
    (void)data;
    return mu_limit(
        power,
        (MU_POWER_ROUNDING + MU_NEXT_ORDER * small * small * small * small) * power + MU_DENORMAL,
        MU_FAST);
}

static mu_slopes mu_power_fast_slopes(const mumacro_data *data, double v, double y) {
    const mu_power_terms power = mu_power_expansion(v, y);
    const double small = mu_smallness(v, y);
    mu_slopes out;
    (void)data;
    out.value = power.both;
    out.bound = HUGE_VAL;
    out.along_v = power.both_v;
    out.along_y = power.both_y;
    out.bound_v = (2.0 * MU_POWER_ROUNDING + 8.0 * MU_NEXT_ORDER * small * small * small * small) *
                      power.both +
                  MU_DENORMAL;
    out.bound_y = out.bound_v;
    return out;
}

static mu_answer mu_stick_fast(const mumacro_data *data, double v, double y) {
    (void)data, (void)v, (void)y;
    return mu_limit(0.0, 0.0, MU_FAST);
}

static mu_slopes mu_stick_fast_slopes(const mumacro_data *data, double v, double y) {
    const mu_slopes none = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    (void)data, (void)v, (void)y;
    return none;
}

/* --- what a bound allows beside the error of q: rounding, in the corner the last digit of y~ -- */

/* d ln phi for that digit: d phi / d eta = -2 phi / stiff; where that is no longer linear over a
 * digit, the root itself is computed. */
static double mu_corner_digit(const mu_place *at) {
    const double eta = at->y - 1.0, digit = MU_ROUNDING / (3.0 * at->phi * at->phi + 2.0 * eta);
    return digit < 1e-3 ? digit
                        : (mu_normal_form_root(at->v, eta - MU_ROUNDING) - at->phi) / at->phi;
}

MU_INLINE int mu_is_tail(int block) {
    return block == MU_C_TAIL || block == MU_S_TAIL || block == MU_B_TAIL || block == MU_B_S_TAIL;
}

static double mu_ratio_slack(const mumacro_data *data, const mu_place *at, double value,
                             double factor) {
    double terms;
    (void)data;
    if (at->block == MU_CORNER) return MU_ROUNDING * at->phi + at->phi * mu_corner_digit(at);
    /* that of common charts is in the table's errors */
    if (!mu_is_tail(at->block)) return 0.0;
    /* the terms that are added up: the outer solution, and the layer's logarithm */
    terms = value + (factor > 0.0 ? factor * fabs(mu_log1(at->v) - 0.5 * mu_log1(at->y)) : 0.0);
    return 8.0 * MU_ROUNDING * terms +
           (mu_is_sliding_block(at->block) ? 0.0 : 16.0 * MU_ROUNDING * factor) + MU_DENORMAL;
}

static double mu_power_slack(const mumacro_data *data, const mu_place *at, double value,
                             double factor) {
    /* p = v~/phi has d p / d eta = 2 p / stiff <= 2/pi */
    const double shaken =
        at->block == MU_CORNER ? mu_min(4.0 * value * mu_corner_digit(at), MU_ROUNDING) : 0.0;
    (void)data, (void)factor;
    return MU_POWER_ROUNDING * value + MU_DENORMAL + shaken;
}

/* The stick fraction below the border is C(y~) sqrt(1 - rho); C is below the first,
 * and below the second / sqrt(y~). */
#define MU_EDGE_LOW 0.7
#define MU_EDGE_HIGH 0.96

/* What the stick fraction may be off by because v~crit is known to some digits only:
 * |sqrt(x) - sqrt(x - d)| <= d / sqrt(max(x, d)) below the border; above it,
 * sqrt(d - distance) within d of it. */
static double mu_edge_uncertainty(const mumacro_data *data, const mu_place *at) {
    const double inside = 1.0 - at->v / at->crit, off = mu_border_error(data);
    const double slope = mu_min(MU_EDGE_LOW, MU_EDGE_HIGH / sqrt(at->y));
    if (inside > 0.0) return slope * off / sqrt(mu_max(inside, off));
    return off + inside > 0.0 ? slope * sqrt(off + inside) : 0.0;
}

static double mu_stick_slack(const mumacro_data *data, const mu_place *at, double value,
                             double factor) {
    double shaken = 0.0;
    (void)value;
    if (at->block == MU_CORNER) /* s0 = sqrt(2 pi v~/phi) moves by half as much as ln phi */
        shaken = 2.0 * mu_min(sqrt(2.0 * MU_PI * at->v / at->phi) * mu_corner_digit(at),
                              sqrt(MU_ROUNDING));
    return 4.0 * MU_ROUNDING * factor + shaken + mu_edge_uncertainty(data, at);
}

/* --- the records ------------------------------------------------------------------------------ */

static const mu_quantity MU_SPRING_QUANTITY[] = {
    {{"mu_ratio", "value", "macroscopic over Coulomb friction coefficient", 1, 1},
     1.0,
     {{MU_ONE, MU_SLIP_DEFICIT},
      {MU_NO_BASE, MU_COSINE},
      {MU_NO_BASE, MU_COSINE},
      {MU_NO_BASE, MU_COSINE},
      {MU_OUTER, MU_V_OVER_Y},
      {MU_ONE, MU_DEFICIT},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_PHI},
      {MU_NO_BASE, MU_V_OVER_Y},
      {MU_NO_BASE, MU_V_OVER_Y},
      {MU_NO_BASE, MU_V_OVER_Y},
      {MU_OUTER_LAYER, MU_V_OVER_Y}},
     mu_ratio_slack,
     mu_ratio_limit,
     mu_ratio_fast,
     mu_ratio_fast_slopes},
    {{"power", "power", "mean power of the shaker over mu0 Fz l0 omega", 1, 1},
     HUGE_VAL,
     {{MU_NO_BASE, MU_SLIP_POWER},
      {MU_NO_BASE, MU_SWEPT_POWER},
      {MU_NO_BASE, MU_SWEPT_POWER},
      {MU_NO_BASE, MU_SWEPT_POWER},
      {MU_FIRST_POWER, MU_V2_OVER_Y},
      {MU_NO_BASE, MU_V_Y2},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_V_OVER_PHI},
      {MU_NO_BASE, MU_Y},
      {MU_NO_BASE, MU_Y},
      {MU_NO_BASE, MU_Y},
      {MU_NO_BASE, MU_Y}},
     mu_power_slack,
     mu_power_limit,
     mu_power_fast,
     mu_power_fast_slopes},
    {{"stick_fraction", "stick", "share of the period during which the contact sticks", 0, 0},
     1.0,
     {{MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_ROOT_Y},
      {MU_NO_BASE, MU_ROOT_Y}},
     mu_stick_slack,
     mu_stick_limit,
     mu_stick_fast,
     mu_stick_fast_slopes},
};
