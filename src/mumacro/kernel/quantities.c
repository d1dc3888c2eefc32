/* How a value follows from what a block tabulates, value = base + factor q: which base and which
 * factor, the list of blocks says (atlas.c).  The records of the quantities are in records.c.
 *
 * mu_ratio        mu~ = mu_macro/mu0 = <u_x>, eq. (15)
 * power           p = <y~ cos tau u_y>, the mean power of the shaker over mu0 Fz l0 omega
 *                 (that of the drive is v~ mu~)
 * stick_fraction  f, the share of the period during which the contact sticks
 *
 * A record says what the bound of a quantity allows beside the table's error, and what is known
 * where there is no table. */

typedef struct {
    double value, bound;
    int source; /* MU_OTHER: no limit here; -1: illegal */
} mu_answer;

typedef struct {
    double value, along_v, along_y, bound_v, bound_y; /* slopes along ln v~ and ln y~ */
    double bound; /* of the value, by the errors of its cell; in blocks only */
} mu_slopes;

typedef struct {
    mumacro_quantity about;
    double most; /* end of the range that starts at 0 */
    double (*slack)(const mumacro_data *data, const mu_place *at, double value, double factor);
    mu_answer (*limit)(int contact, double v, double y);
    mu_answer (*fast)(const mumacro_data *data, int contact, double v, double y);
    mu_slopes (*fast_slopes)(const mumacro_data *data, int contact, double v, double y);
} mu_quantity;

/* --- forms --- */

MU_INLINE mu_form mu_form_in(int block, int quantity) {
    return mu_block_as(block)->forms[quantity];
}

static double mu_factor(int factor, const mu_place *at) {
    const double v = at->v, y = at->y;
    switch (factor) {
        case MU_UNITY:
            return 1.0;
        case MU_Y:
            return y;
        case MU_V_Y2:
            return v * y * y;
        case MU_V_OVER_Y:
            return v / y;
        case MU_V2_OVER_Y:
            return v * (v / y);
        case MU_ROOT_Y:
            return 1.0 / sqrt(y);
        case MU_DEFICIT:
            return -(y * y);
        case MU_SLIP_DEFICIT:
            return y * y * (-0.25 * (1.0 / mu_fma1(v, v, 1.0)));
        case MU_COSINE:
            return sqrt(v * v * (1.0 / mu_fma1(v, v, y * y)));
        case MU_SLIP_POWER:
            return v < 1e150 ? v * (y * y) * (1.0 / mu_fma1(v, v, 1.0)) : y * (y / v);
        case MU_SWEPT_POWER:
            return y * y * sqrt(1.0 / mu_fma1(v, v, y * y));
        case MU_PHI:
            return at->phi;
        case MU_V_OVER_PHI:
            return v / at->phi;
        case MU_Y3:
            return y * y * y;
        case MU_PHI_R:
            return at->phi * at->a;
        default:
            return 0.0;
    }
}

/* The outer solution's logarithm and the layer's; where v~/y~ is tiny they cancel in closed form.
 */
static double mu_outer_layer(double v, double y) {
    const double factor = v / y;
    if (factor < 1e-100) return factor * MU_TWO_OVER_PI * (2.0 * MU_LN2 + 0.5 * mu_log1(y));
    return mu_outer_expansion(1.0 / factor).first + factor * MU_TWO_OVER_PI * mu_log1(v / sqrt(y));
}

static double mu_base(int base, const mu_place *at) {
    switch (base) {
        case MU_ONE:
            return 1.0;
        case MU_OUTER:
            return mu_outer_expansion(at->y / at->v).first;
        case MU_OUTER_LAYER:
            return mu_outer_layer(at->v, at->y);
        case MU_FIRST_POWER:
            return MU_CONTACT[mu_is_ball(at->block)].middle *
                   mu_power_expansion(at->v, at->y, 1.0).first;
        case MU_ONE_LN_V:
            return mu_fma1(at->y * at->y, 0.1875 * mu_log1(at->v), 1.0);
        case MU_ONE_LN_Y:
            return mu_fma1(at->y * at->y, 0.375 * mu_log1(at->y), 1.0);
        case MU_POWER_LN_V:
            return -0.5625 * at->v * at->y * at->y * mu_log1(at->v);
        default:
            return 0.0;
    }
}

/* Slopes along ln v~ and ln y~: of a base, and of ln |factor|. */
typedef struct {
    double base_v, base_y, factor_v, factor_y;
} mu_form_slopes;

static void mu_base_slopes(int base, const mu_place *at, mu_form_slopes *out) {
    const double v = at->v, y = at->y, factor = v / y;
    if (base == MU_ONE_LN_V) {
        out->base_v = 0.1875 * y * y;
        out->base_y = 0.375 * y * y * mu_log1(v);
    } else if (base == MU_ONE_LN_Y) {
        out->base_y = 0.375 * y * y * (1.0 + 2.0 * mu_log1(y));
    } else if (base == MU_FIRST_POWER) {
        const mu_power_terms power = mu_power_expansion(v, y, 1.0);
        const double middle = MU_CONTACT[mu_is_ball(at->block)].middle;
        out->base_v = middle * power.first_v;
        out->base_y = middle * power.first_y;
    } else if (base == MU_OUTER_LAYER && factor < 1e-100) {
        out->base_v = mu_outer_layer(v, y);
        out->base_y = 0.5 * factor * MU_TWO_OVER_PI - out->base_v;
    } else if (base == MU_OUTER || base == MU_OUTER_LAYER) {
        const double slope = mu_outer_expansion(1.0 / factor).first_slope;
        const double layer = base == MU_OUTER_LAYER ? factor * MU_TWO_OVER_PI : 0.0;
        const double level = base == MU_OUTER_LAYER ? layer * mu_log1(v / sqrt(y)) : 0.0;
        out->base_v = layer + level - slope;
        out->base_y = slope - level - 0.5 * layer;
    }
}

MU_INLINE mu_form_slopes mu_slopes_of_form(mu_form form, const mu_place *at, const mu_turn *turn) {
    static const signed char powers[][2] = {
        /* twice the powers of v~ and y~ in each factor, in their order */
        {0, 0}, {0, 0}, {0, 2}, {2, 4}, {2, -2}, {4, -2}, {0, -1}, {0, 4},
        {0, 4}, {0, 0}, {2, 4}, {0, 2}, {0, 0},  {2, 0},  {0, 6},  {0, 0},
    };
    const signed char *power = powers[(int)form.factor];
    mu_form_slopes out = {0.0, 0.0, 0.5 * power[0], 0.5 * power[1]};
    double share;
    if (form.base > MU_ONE) mu_base_slopes(form.base, at, &out);
    switch (form.factor) {
        case MU_SLIP_DEFICIT:
        case MU_SLIP_POWER:
            out.factor_v -= 2.0 * mu_speed_share(at->v);
            break;
        case MU_COSINE:
            share = 1.0 / (1.0 + (at->v / at->y) * (at->v / at->y));
            out.factor_v += share;
            out.factor_y -= share;
            break;
        case MU_SWEPT_POWER:
            share = at->v * at->v * (1.0 / mu_fma1(at->v, at->v, at->y * at->y));
            out.factor_v -= share;
            out.factor_y += share;
            break;
        case MU_PHI:
            out.factor_v += turn->phi_v;
            out.factor_y += turn->phi_y;
            break;
        case MU_V_OVER_PHI:
            out.factor_v -= turn->phi_v;
            out.factor_y -= turn->phi_y;
            break;
        case MU_PHI_R:
            out.factor_v += turn->phi_v + turn->a_v / at->a;
            out.factor_y += turn->phi_y + turn->a_y / at->a;
            break;
        default:
            break;
    }
    return out;
}
