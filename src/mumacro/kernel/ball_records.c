/* The records of a ball: as those of one spring, of V and Y. */

/* mu~ and its slope along ln Y at rest: sqrt(1 + Y) (E - Y K) for Y < 1, with elliptic integrals of
 * the parameter (1 - Y)/(1 + Y), then 0; the slope is -3/2 Y^2 K / sqrt(1 + Y). */
static double mu_ball_at_rest(double y, double *slope) {
    const double root = sqrt(1.0 + y);
    const mu_outer outer = mu_outer_expansion(sqrt(0.5 * (1.0 - y) / y));
    const double k = 0.5 * MU_PI * outer.first * outer.h;
    *slope = 0.0;
    if (!(y < 1.0)) return 0.0;
    if (y < 1e-300) return 1.0;
    *slope = -1.5 * y * (y * k) / root;
    return mu_min(mu_max(root * (0.5 * MU_PI * outer.i3 - y * k), 0.0), 1.0);
}

static mu_answer mu_ball_ratio_limit(double v, double y) {
    const mu_answer common = mu_common_limit(v, y, 1.0);
    double slope;
    if (y == HUGE_VAL) return mu_limit(NAN, NAN, -1);
    if (common.source != MU_OTHER || v > 0.0) return common;
    return mu_limit(mu_ball_at_rest(y, &slope), MU_ROUNDING, MU_STATIC_LIMIT);
}

static mu_answer mu_ball_power_limit(double v, double y) {
    const mu_answer common = mu_common_limit(v, y, 0.0);
    if (y == HUGE_VAL && v == HUGE_VAL) return mu_limit(NAN, NAN, -1);
    if (common.source != MU_OTHER || y < HUGE_VAL) return common;
    return mu_limit(HUGE_VAL, 0.0, v > 0.0 ? MU_S_TAIL : MU_STATIC_LIMIT);
}

static mu_answer mu_ball_stick_limit(double v, double y) {
    const mu_answer common = mu_common_limit(v, y, 0.0);
    if (common.source != MU_OTHER || y < HUGE_VAL) return common;
    return mu_limit(0.0, 0.0, v > 0.0 ? MU_S_TAIL : MU_STATIC_LIMIT);
}

/* The means of s^2 and s^4 over the load: what terms with 1/v~^2 and 1/v~^4 are multiplied by. */
#define MU_SQUARE 0.6857142857142857
#define MU_FOURTH 0.5541125541125541

/* Two terms as of one spring, (35) at y~ / sqrt(v~^2 + MU_SQUARE), which is exact to 1/v~^2; for
 * small amplitudes what is left of 1/v~^4 is known. */
static mu_answer mu_ball_ratio_fast(const mumacro_data *data, double v, double y) {
    const int plain = mu_max(v, y) < 1e150;
    const double share = plain ? 1.0 / (v * v + MU_SQUARE) : 1.0 / v / v, ratio = y / v;
    const double square = plain ? y * y * share : ratio * ratio, t = 1.0 + square;
    double first, rest, next;
    if (t < MU_OUTER_MAX) {
        mu_outer_terms(data->outer, t, &first, &rest);
    } else {
        const mu_outer outer =
            mu_outer_expansion(y / mu_hypot(v, 0.8280786712108251)); /* sqrt(MU_SQUARE) */
        first = outer.first;
        rest = outer.second + 0.5 * outer.first_slope;
    }
    next = 0.25 * (MU_FOURTH - MU_SQUARE * MU_SQUARE) * (t < HUGE_VAL ? square / t : 1.0);
    return mu_limit(mu_min(first + (MU_SQUARE * rest - next * share) * share, 1.0),
                    2.0 * MU_FAST_ROUNDING * first, MU_B_FAST);
}

static mu_slopes mu_ball_ratio_fast_slopes(const mumacro_data *data, double v, double y) {
    const double small = mu_smallness(v, y), speed = mu_hypot(v, 0.8280786712108251);
    const mu_outer outer = mu_outer_expansion(y / speed);
    const double square = MU_SQUARE / speed / speed;
    const double errors = fabs(outer.second) + fabs(outer.second_slope) + fabs(outer.first_slope);
    mu_slopes out;
    (void)data;
    out.value = mu_ball_ratio_fast(data, v, y).value;
    out.bound = HUGE_VAL;
    out.along_y = outer.first_slope + (outer.second_slope + 0.5 * outer.bend) * square;
    out.along_v = -(v / speed) * (v / speed) *
                  (out.along_y + (2.0 * outer.second + outer.first_slope) * square);
    out.bound_v = 16.0 * errors / speed / speed * small * small + 8.0 * MU_ROUNDING * out.value;
    out.bound_y = out.bound_v;
    return out;
}

static mu_answer mu_ball_power_fast(const mumacro_data *data, double v, double y) {
    const mu_power_terms power = mu_power_expansion(v, y);
    const double small = mu_smallness(v, y),
                 value = MU_MIDDLE * (power.first + MU_SQUARE * (power.both - power.first));
    (void)data;
    return mu_limit(
        value,
        (MU_POWER_ROUNDING + MU_NEXT_ORDER * small * small * small * small) * value + MU_DENORMAL,
        MU_B_FAST);
}

static mu_slopes mu_ball_power_fast_slopes(const mumacro_data *data, double v, double y) {
    const mu_power_terms power = mu_power_expansion(v, y);
    const double small = mu_smallness(v, y);
    mu_slopes out;
    (void)data;
    out.value = MU_MIDDLE * (power.first + MU_SQUARE * (power.both - power.first));
    out.bound = HUGE_VAL;
    out.along_v = MU_MIDDLE * (power.first_v + MU_SQUARE * (power.both_v - power.first_v));
    out.along_y = MU_MIDDLE * (power.first_y + MU_SQUARE * (power.both_y - power.first_y));
    out.bound_v = (2.0 * MU_POWER_ROUNDING + 8.0 * MU_NEXT_ORDER * small * small * small * small) *
                      out.value +
                  MU_DENORMAL;
    out.bound_y = out.bound_v;
    return out;
}

static mu_answer mu_ball_stick_fast(const mumacro_data *data, double v, double y) {
    (void)data, (void)v, (void)y;
    return mu_limit(0.0, 0.0, MU_B_FAST);
}

static double mu_ball_ratio_slack(const mumacro_data *data, const mu_place *at, double value,
                                  double factor) {
    if (at->block == MU_B_CORNER) return factor * (4.0 * MU_ROUNDING + mu_corner_digit(at));
    return mu_ratio_slack(data, at, value, factor);
}

/* The least v~ from which two terms answer for one spring with y~ > 1.5: they are what the power of
 * a ball's outer springs was computed from, and miss MU_NEXT_ORDER / v~^4. */
#define MU_LEAST_FAST 55.0

static double mu_ball_power_slack(const mumacro_data *data, const mu_place *at, double value,
                                  double factor) {
    const double share = mu_min(at->v / MU_LEAST_FAST, 1.0), least = mu_max(at->v, MU_LEAST_FAST);
    const double most =
        MU_NEXT_ORDER / (MU_LEAST_FAST * MU_LEAST_FAST * MU_LEAST_FAST * MU_LEAST_FAST);
    /* nodes that have it spread a part of it over the block of all speeds */
    const double spread = at->block == MU_B_LOW ? 0.125 * most : 0.0;
    const double missed =
        mu_max(spread, MU_NEXT_ORDER * share * share / (least * least * least * least));
    (void)data, (void)factor;
    return (2.0 * MU_POWER_ROUNDING + missed) * value + MU_DENORMAL;
}

/* Next to the border the share that sticks changes with the distance d by d ln d at most, at the
 * ridge by d^(3/4). */
static double mu_ball_stick_slack(const mumacro_data *data, const mu_place *at, double value,
                                  double factor) {
    const double off = mu_border_error(data), root = sqrt(off);
    (void)value;
    return 4.0 * MU_ROUNDING * factor + (mu_is_ridge(at) ? 2.0 * root * sqrt(root) : 32.0 * off);
}

/* Meanings are those of one spring. */
static const mu_quantity MU_BALL_QUANTITY[] = {
    {{"mu_ratio", "value", "macroscopic over Coulomb friction coefficient", 1, 1},
     1.0,
     {{MU_ONE, MU_SLIP_DEFICIT},
      {MU_ONE_LN_V, MU_DEFICIT},
      {MU_NO_BASE, MU_COSINE},
      {MU_NO_BASE, MU_COSINE},
      {MU_NO_BASE, MU_COSINE},
      {MU_OUTER, MU_V_OVER_Y},
      {MU_ONE_LN_V, MU_DEFICIT},
      {MU_ONE_LN_Y, MU_DEFICIT},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_PHI_R},
      {MU_NO_BASE, MU_V_OVER_Y},
      {MU_NO_BASE, MU_V_OVER_Y},
      {MU_NO_BASE, MU_V_OVER_Y},
      {MU_OUTER_LAYER, MU_V_OVER_Y}},
     mu_ball_ratio_slack,
     mu_ball_ratio_limit,
     mu_ball_ratio_fast,
     mu_ball_ratio_fast_slopes},
    {{"power", "power", "mean power of the shaker over mu0 Fz l0 omega", 1, 1},
     HUGE_VAL,
     {{MU_NO_BASE, MU_SLIP_POWER},
      {MU_POWER_LN_V, MU_V_Y2},
      {MU_NO_BASE, MU_SWEPT_POWER},
      {MU_NO_BASE, MU_SWEPT_POWER},
      {MU_NO_BASE, MU_SWEPT_POWER},
      {MU_BALL_POWER, MU_V2_OVER_Y},
      {MU_POWER_LN_V, MU_Y3},
      {MU_NO_BASE, MU_Y3},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_Y},
      {MU_NO_BASE, MU_Y},
      {MU_NO_BASE, MU_Y},
      {MU_NO_BASE, MU_Y}},
     mu_ball_power_slack,
     mu_ball_power_limit,
     mu_ball_power_fast,
     mu_ball_power_fast_slopes},
    {{"stick_fraction", "stick",
      "share of the load and of the period during which the contact sticks", 0, 0},
     1.0,
     {{MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_NOTHING},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_UNITY},
      {MU_NO_BASE, MU_ROOT_Y},
      {MU_NO_BASE, MU_ROOT_Y}},
     mu_ball_stick_slack,
     mu_ball_stick_limit,
     mu_ball_stick_fast,
     mu_stick_fast_slopes},
};

/* The compiler refuses a quantity without a record. */
#define MU_COMPLETE(records) (sizeof(records) == MU_QUANTITIES * sizeof(mu_quantity) ? 1 : -1)
typedef char mu_each_quantity_of_a_spring[MU_COMPLETE(MU_SPRING_QUANTITY)];
typedef char mu_each_quantity_of_a_ball[MU_COMPLETE(MU_BALL_QUANTITY)];

/* The record of a quantity of a contact, or in a block. */
MU_INLINE const mu_quantity *mu_quantity_of(int contact, int quantity) {
    return (contact == MU_BALL ? MU_BALL_QUANTITY : MU_SPRING_QUANTITY) + quantity;
}
MU_INLINE const mu_quantity *mu_quantity_in(int block, int quantity) {
    return mu_quantity_of(mu_is_ball(block) ? MU_BALL : MU_SPRING, quantity);
}
MU_INLINE mu_form mu_form_in(int block, int quantity) {
    return mu_quantity_in(block, quantity)->forms[MU_PLACE_OF(block)];
}
