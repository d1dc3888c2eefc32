/* Where a point is: its block, its coordinates there, and how these turn with v~ and y~.  The list
 * of blocks says which coordinates a block has. */

/* The place of any point with v~ > 0, y~ > 0, both finite, of a ball V and Y; the block of large
 * speed has no coordinates. */
static mu_place mu_locate(const mumacro_data *data, int contact, double v, double y) {
    const int ball = contact == MU_BALL;
    mu_place at = {MU_CONTACT[contact].fast, v, y, 0.0, 0.0, 0.0, 0.0, {0.0, 0.0}};
    double ln_y;
    at.crit = mu_border(data, y, &at.tilt, &ln_y);
    if (y > MU_Y_TAIL) {
        /* what speed is counted in where all slides */
        const double unit = ball ? at.crit : sqrt(y);
        const int slides = v >= at.crit;
        if (v > (ball ? MU_RHO_MAX : MU_FAST_KAPPA) * unit) return at;
        at.a = 1.0 / y;
        at.b = slides ? mu_log1(v / unit) : mu_sigma_of(v / at.crit);
        if (ball)
            at.block = slides ? MU_B_TAIL : MU_B_S_TAIL;
        else
            at.block = slides ? MU_C_TAIL : MU_S_TAIL;
    } else {
        const mu_lanes speed = mu_all(v), amplitude = mu_all(y), crit = mu_all(at.crit);
        const mu_places places =
            ball ? mu_place_ball(mu_steepest_of(data), speed, amplitude, crit, mu_all(ln_y))
                 : mu_place_common(speed, amplitude, crit, mu_all(ln_y));
        at.block = (int)mu_first_whole(places.block);
        at.a = mu_first(places.a);
        at.b = mu_first(places.b);
        mu_place_in_corner(&at);
    }
    return at;
}

/* The turn of the coordinates of a place; in the ring and in the corners both depend on v~ and y~.
 */
MU_INLINE mu_turn mu_turn_of(const mu_place *at) {
    /* the powers of y~ that a is; 0: ln y~ */
    static const signed char power[] = {2, 1, 0, -1};
    const mumacro_chart *chart = &mu_block_as(at->block)->chart;
    const int a = chart->a.code, b = chart->b.code;
    mu_turn out = {0.0, 1.0, 1.0, -at->tilt.slope, 0.0, 0.0, 1.0, -at->tilt.slope, MU_SQRT2, 1.0};
    if (a == MU_BY_RADIUS)
        return mu_is_ball(at->block) ? mu_turn_of_ball_corner(at) : mu_turn_corner(at);
    if (a == MU_BY_RAY_ROOT) return mu_turn_of_ring(at);
    if (a <= MU_BY_INVERSE_Y) {
        if (power[a]) out.a_y = power[a] * at->a;
    } else if (a == MU_BY_Y_ROOT) {
        out.a_y = at->a / 6.0;
    } else { /* MU_BY_V_ROOT */
        out.a_v = at->a / 6.0;
        out.a_y = 0.0;
    }
    if (b == MU_BY_S) {
        out.b_v = mu_sigma_slope(at->b);
        out.b_y = -at->tilt.slope * out.b_v;
    } else if (b == MU_BY_S_ROOT) {
        out.end = 2.0 * MU_FOLD_KNOT;
        out.scale = MU_FOLD_SCALE;
        out.b_v = mu_fold_slope(at->b);
        out.b_y = -at->tilt.slope * out.b_v;
    } else if (b == MU_BY_SPEED_SHARE) {
        out.b_v = 2.0 * mu_speed_share(at->v) / mu_fma1(at->v, at->v, 1.0);
        out.b_y = 0.0;
    } else if (b == MU_BY_RAY_SQUARED) {
        out.b_v = -2.0 * at->b;
        out.b_y = 2.0 * at->b;
    } else if (b == MU_BY_LN_KAPPA) {
        out.b_y = -0.5;
    } /* else ln(v~/v~crit) */
    return out;
}

/* Whether b is a function of v~/v~crit. */
MU_INLINE int mu_follows_border(int block) {
    const int code = mu_block_as(block)->chart.b.code;
    return code == MU_BY_S || code == MU_BY_S_ROOT || code == MU_BY_LN_RHO;
}

/* Whether b ends at the border with a square root. */
MU_INLINE int mu_has_edge(int block) { return !mu_is_sliding_block(block) && !mu_is_corner(block); }

MU_INLINE int mu_is_tail(int block) { return mu_block_as(block)->chart.a.code == MU_BY_INVERSE_Y; }
