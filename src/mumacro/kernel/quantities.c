/* How a value follows from what a block tabulates; the records of the quantities are in records.c.
 *
 * mu_ratio        mu~ = mu_macro/mu0 = <u_x>, eq. (15)
 * power           p = <y~ cos tau u_y>, the mean power of the shaker over mu0 Fz l0 omega
 *                 (that of the drive is v~ mu~)
 * stick_fraction  f, the share of the period during which the contact sticks
 *
 * A record says how a value follows from what a block tabulates, value = base + factor q; what its
 * bound allows beside the table's error; and what is known where there is no table. */

/* base */
enum {
    MU_NO_BASE,
    MU_ONE,
    MU_OUTER,
    MU_OUTER_LAYER,
    MU_FIRST_POWER,
    MU_ONE_LN_V,   /* 1 + 3/16 y~^2 ln v~ */
    MU_ONE_LN_Y,   /* 1 + 3/8 y~^2 ln y~ */
    MU_POWER_LN_V, /* -9/16 v~ y~^2 ln v~ */
    MU_BALL_POWER  /* MU_FIRST_POWER of a ball */
};
/* factor; in brackets what it is */
enum {
    MU_NOTHING,      /* 0 */
    MU_UNITY,        /* 1 */
    MU_Y,            /* y~ */
    MU_V_Y2,         /* v~ y~^2 */
    MU_V_OVER_Y,     /* v~/y~ */
    MU_V2_OVER_Y,    /* v~^2/y~ */
    MU_ROOT_Y,       /* 1/sqrt(y~) */
    MU_DEFICIT,      /* -y~^2 */
    MU_SLIP_DEFICIT, /* -y~^2 / (4 (1 + v~^2)) */
    MU_COSINE,       /* 1 / sqrt(1 + y~^2/v~^2) */
    MU_SLIP_POWER,   /* v~ y~^2 / (1 + v~^2) */
    MU_SWEPT_POWER,  /* y~^2 / sqrt(v~^2 + y~^2) */
    MU_PHI,          /* phi, the root of the corner's normal form */
    MU_V_OVER_PHI,   /* v~/phi */
    MU_Y3,           /* y~^3 */
    MU_PHI_R         /* phi R */
};

typedef struct {
    signed char base, factor;
} mu_form;

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
    double most;                   /* end of the range that starts at 0 */
    mu_form forms[MU_BALL_CHARTS]; /* by block; one spring has two less */
    double (*slack)(const mumacro_data *data, const mu_place *at, double value, double factor);
    mu_answer (*limit)(double v, double y);
    mu_answer (*fast)(const mumacro_data *data, double v, double y);
    mu_slopes (*fast_slopes)(const mumacro_data *data, double v, double y);
} mu_quantity;

/* --- forms --- */

/* mu~ of a block as mu_place_common has it. */
static double mu_ratio_factor(const mu_place *at) {
    const mu_mask yes = mu_all_whole(-1), no = mu_all_whole(0);
    const int deep = at->block == MU_S_LOW || at->block == MU_B_S_LOW || at->block == MU_B_RING ||
                     at->block == MU_B_SLOW;
    const int low = at->block == MU_C_LOW || at->block == MU_B_LOW || deep;
    const mu_mask sliding = mu_is_sliding_block(at->block) && !deep ? yes : no,
                  small = low ? yes : no;
    const mu_mask lowest = deep ? yes : no;
    const mu_lanes v = mu_all(at->v), y = mu_all(at->y), share = mu_share(v, y, sliding, small);
    mu_lanes base, factor;
    mu_ratio_form(v, y, sliding, small, lowest, share, mu_sqrt(v * v * share), &base, &factor);
    return mu_first(factor);
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
        case MU_SLIP_DEFICIT:
        case MU_COSINE:
            return mu_ratio_factor(at);
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
            return mu_power_expansion(at->v, at->y).first;
        case MU_BALL_POWER:
            return MU_MIDDLE * mu_power_expansion(at->v, at->y).first;
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
        const mu_power_terms power = mu_power_expansion(v, y);
        out->base_v = power.first_v;
        out->base_y = power.first_y;
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
