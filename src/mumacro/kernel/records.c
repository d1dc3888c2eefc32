/* What differs from quantity to quantity: limits, closed forms for large speed, rounding; and the
 * records.  Of a ball v and y are V and Y everywhere. */

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

/* mu~ of a ball and its slope along ln Y at rest: sqrt(1 + Y) (E - Y K) for Y < 1, with elliptic
 * integrals of the parameter (1 - Y)/(1 + Y), then 0; the slope is -3/2 Y^2 K / sqrt(1 + Y). */
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

/* The static limit, of one spring eq. (16).  The last digit of y~ = y0 k/(mu0 Fz) counts next to y~
 * = 1, where |sqrt(1 - y - d) - sqrt(1 - y)| <= sqrt(d). */
static mu_answer mu_ratio_limit(int contact, double v, double y) {
    const double cusp = y < 1.0 + MU_STATIC_ROUNDING ? sqrt(2.0 * MU_STATIC_ROUNDING) : 0.0;
    const mu_answer common = mu_common_limit(v, y, 1.0);
    double mu, slope;
    if (y == HUGE_VAL) return mu_limit(NAN, NAN, -1);
    if (common.source != MU_OTHER || v > 0.0) return common;
    if (contact == MU_BALL)
        return mu_limit(mu_ball_at_rest(y, &slope), MU_ROUNDING, MU_STATIC_LIMIT);
    if (y >= 1.0) return mu_limit(0.0, cusp, MU_STATIC_LIMIT);
    mu = sqrt((1.0 - y) * (1.0 + y));
    return mu_limit(mu, mu_min(MU_STATIC_ROUNDING / mu, cusp), MU_STATIC_LIMIT);
}

/* What answers at an infinite amplitude: in the tail at any speed, at rest the limit of it. */
static int mu_source_far_out(double v) { return v > 0.0 ? MU_S_TAIL : MU_STATIC_LIMIT; }

/* Above y~ = 1, and of a ball, the limit v~ -> 0 is no closed form: MU_OTHER, a very small v~
 * stands for it. */
static mu_answer mu_power_limit(int contact, double v, double y) {
    const mu_answer common = mu_common_limit(v, y, 0.0);
    if (y == HUGE_VAL && v == HUGE_VAL) return mu_limit(NAN, NAN, -1);
    if (common.source != MU_OTHER) return common;
    if (y == HUGE_VAL) return mu_limit(HUGE_VAL, 0.0, mu_source_far_out(v));
    if (contact == MU_BALL || v > 0.0 || y > 1.0) return common;
    return mu_limit(0.0, y > 1.0 - MU_ROUNDING ? MU_ROUNDING : 0.0, MU_STATIC_LIMIT);
}

static mu_answer mu_stick_limit(int contact, double v, double y) {
    const mu_answer common = mu_common_limit(v, y, 0.0);
    if (common.source != MU_OTHER) return common;
    if (y == HUGE_VAL) return mu_limit(0.0, 0.0, mu_source_far_out(v));
    if (contact == MU_BALL || v > 0.0 || y > 1.0) return common;
    return mu_limit(1.0, y > 1.0 - MU_ROUNDING ? 2.0 * sqrt(MU_ROUNDING) : 0.0, MU_STATIC_LIMIT);
}

/* --- large speed ------------------------------------------------------------------------------ */

/* mu~ for large v~: two terms.  (35) at y~ / sqrt(v~^2 + <s^2>) is exact to 1/v~^2, and of one
 * spring to O(y~^2) at every v~; what it takes from the second term is half r f'.  For small
 * amplitudes what is left of 1/v~^4 is known; of one spring that is 0.  For 1 + r^2 below
 * MU_OUTER_MAX f and g + r f'/2 are read from cells of ln(1 + r^2), (MU_OUTER_CELLS, 2, 8), to
 * rounding: its singularities are at +-i pi and beyond. */
static mu_answer mu_ratio_fast(const mumacro_data *data, int contact, double v, double y) {
    const mu_contact *of = &MU_CONTACT[contact];
    const int plain = mu_max(v, y) < 1e150;
    const double share = 1.0 / (v * v + of->square);
    const double square = plain ? y * y * share : (y / v) * (y / v), t = 1.0 + square;
    double first, rest, next = 0.0, correction;
    if (t < MU_OUTER_MAX) {
        mu_outer_terms(data->outer, t, &first, &rest);
    } else {
        const mu_outer outer = mu_outer_expansion(y / mu_hypot(v, of->root_square));
        first = outer.first;
        rest = outer.second + 0.5 * outer.first_slope;
    }
    if (contact == MU_BALL)
        next = 0.25 * (of->fourth - of->square * of->square) * (t < HUGE_VAL ? square / t : 1.0);
    correction = plain ? (of->square * rest - next * share) * share : of->square * rest / v / v;
    /* rounding; what two terms leave out is at most 6.2e-16 of mu~, where large speeds begin, near
     * y~ = 1e4 */
    return mu_limit(mu_min(first + correction, 1.0),
                    (contact == MU_BALL ? 2.0 : 1.0) * MU_FAST_ROUNDING * first, of->fast);
}

MU_INLINE double mu_smallness(double v, double y) { return mu_max(1.0 / v, y / v / v); }

static mu_slopes mu_ratio_fast_slopes(const mumacro_data *data, int contact, double v, double y) {
    const mu_contact *of = &MU_CONTACT[contact];
    const double small = mu_smallness(v, y), speed = mu_hypot(v, of->root_square);
    const mu_outer outer = mu_outer_expansion(y / speed);
    const double errors = fabs(outer.second) + fabs(outer.second_slope) + fabs(outer.first_slope);
    mu_slopes out;
    out.value = mu_ratio_fast(data, contact, v, y).value;
    out.bound = HUGE_VAL;
    out.along_y =
        outer.first_slope + of->square * (outer.second_slope + 0.5 * outer.bend) / speed / speed;
    out.along_v =
        -(v / speed) * (v / speed) *
        (out.along_y + of->square * (2.0 * outer.second + outer.first_slope) / speed / speed);
    out.bound_v = 16.0 * errors / speed / speed * small * small + 8.0 * MU_ROUNDING * out.value;
    out.bound_y = out.bound_v;
    return out;
}

/* What two terms of the power leave out, of it. */
static double mu_power_missed(double v, double y) {
    const double small = mu_smallness(v, y);
    return MU_NEXT_ORDER * small * small * small * small;
}

static mu_answer mu_power_fast(const mumacro_data *data, int contact, double v, double y) {
    const mu_contact *of = &MU_CONTACT[contact];
    const double power = of->middle * mu_power_expansion(v, y, of->square).both;
    (void)data;
    return mu_limit(power, (MU_POWER_ROUNDING + mu_power_missed(v, y)) * power + MU_DENORMAL,
                    of->fast);
}

static mu_slopes mu_power_fast_slopes(const mumacro_data *data, int contact, double v, double y) {
    const mu_contact *of = &MU_CONTACT[contact];
    const mu_power_terms power = mu_power_expansion(v, y, of->square);
    mu_slopes out;
    (void)data;
    out.value = of->middle * power.both;
    out.bound = HUGE_VAL;
    out.along_v = of->middle * power.both_v;
    out.along_y = of->middle * power.both_y;
    out.bound_v = (2.0 * MU_POWER_ROUNDING + 8.0 * mu_power_missed(v, y)) * out.value + MU_DENORMAL;
    out.bound_y = out.bound_v;
    return out;
}

static mu_answer mu_stick_fast(const mumacro_data *data, int contact, double v, double y) {
    (void)data, (void)v, (void)y;
    return mu_limit(0.0, 0.0, MU_CONTACT[contact].fast);
}

static mu_slopes mu_stick_fast_slopes(const mumacro_data *data, int contact, double v, double y) {
    const mu_slopes none = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    (void)data, (void)contact, (void)v, (void)y;
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

static double mu_ratio_slack(const mumacro_data *data, const mu_place *at, double value,
                             double factor) {
    double terms;
    (void)data;
    if (mu_is_corner(at->block)) {
        const double rounding = mu_is_ball(at->block) ? 4.0 * MU_ROUNDING : MU_ROUNDING;
        return rounding * factor + factor * mu_corner_digit(at);
    }
    /* that of common charts is in the table's errors */
    if (!mu_is_tail(at->block)) return 0.0;
    /* the terms that are added up: the outer solution, and the layer's logarithm */
    terms = value + (factor > 0.0 ? factor * fabs(mu_log1(at->v) - 0.5 * mu_log1(at->y)) : 0.0);
    return 8.0 * MU_ROUNDING * terms +
           (mu_is_sliding_block(at->block) ? 0.0 : 16.0 * MU_ROUNDING * factor) + MU_DENORMAL;
}

/* The least v~ from which two terms answer for one spring with y~ > 1.5: they are what the power of
 * a ball's outer springs was computed from, and miss MU_NEXT_ORDER / v~^4. */
#define MU_LEAST_FAST 55.0

/* The share of the power of a ball that they miss. */
static double mu_power_missed_outside(const mu_place *at) {
    const double share = mu_min(at->v / MU_LEAST_FAST, 1.0), least = mu_max(at->v, MU_LEAST_FAST);
    const double most =
        MU_NEXT_ORDER / (MU_LEAST_FAST * MU_LEAST_FAST * MU_LEAST_FAST * MU_LEAST_FAST);
    /* nodes that have it spread a part of it over the block of all speeds */
    const double spread = at->block == MU_B_LOW ? 0.125 * most : 0.0;
    return mu_max(spread, MU_NEXT_ORDER * share * share / (least * least * least * least));
}

static double mu_power_slack(const mumacro_data *data, const mu_place *at, double value,
                             double factor) {
    /* p = v~/phi has d p / d eta = 2 p / stiff <= 2/pi */
    const double shaken =
        at->block == MU_CORNER ? mu_min(4.0 * value * mu_corner_digit(at), MU_ROUNDING) : 0.0;
    (void)data, (void)factor;
    if (mu_is_ball(at->block))
        return (2.0 * MU_POWER_ROUNDING + mu_power_missed_outside(at)) * value + MU_DENORMAL;
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
    const double inside = 1.0 - at->v / at->crit, off = mu_border_error(data), root = sqrt(off);
    const double slope = mu_min(MU_EDGE_LOW, MU_EDGE_HIGH / sqrt(at->y));
    /* of a ball it changes with the distance d to the border by d ln d at most, at the ridge by
     * d^(3/4) */
    if (mu_is_ball(at->block)) return mu_is_ridge(at) ? 2.0 * root * sqrt(root) : 32.0 * off;
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

static const mu_quantity MU_QUANTITY[MU_QUANTITIES] = {
    {{"mu_ratio", "value", "macroscopic over Coulomb friction coefficient", 1, 1},
     1.0,
     mu_ratio_slack,
     mu_ratio_limit,
     mu_ratio_fast,
     mu_ratio_fast_slopes},
    {{"power", "power", "mean power of the shaker over mu0 Fz l0 omega", 1, 1},
     HUGE_VAL,
     mu_power_slack,
     mu_power_limit,
     mu_power_fast,
     mu_power_fast_slopes},
    /* of a ball the share of the load and of the period */
    {{"stick_fraction", "stick", "share of the period during which the contact sticks", 0, 0},
     1.0,
     mu_stick_slack,
     mu_stick_limit,
     mu_stick_fast,
     mu_stick_fast_slopes},
};
