/* One point: the value of a quantity, its slopes, and their bounds. */

#define MU_CREEP                                                                          \
    1e-60 /* v~ that stands for the limit v~ -> 0: below any speed of interest, far above \
             underflow */

MU_INLINE const double *mu_block_of(const mumacro_data *data, int block) {
    return data->blocks + MU_PLACE_OF(block) * MU_BLOCK_COLUMNS;
}

/* Value and bound in a block: the table's error of q times the factor, an absolute part, and the
 * quantity's slack. */
static mu_answer mu_in_block(const mumacro_data *data, int quantity, const mu_place *at) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    const mumacro_cells *cells = &data->quantities[quantity];
    const mu_form form = mu_form_in(at->block, quantity);
    const double base = mu_base(form.base, at), factor = mu_factor(form.factor, at);
    const double *errors = cells->errors + 2 * MU_PLACE_OF(at->block);
    double error = errors[0];
    mu_answer out = {0.0, 0.0, at->block};
    if (form.factor != MU_NOTHING) {
        const mu_spot spot =
            mu_find(mu_block_of(data, at->block), cells->first, cells->cells, at->a, at->b);
        out.value = mu_fma1(
            factor, mu_cell_value(cells->polynomials + 64 * spot.cell, spot.u, spot.w), base);
        out.value = mu_min(mu_max(out.value, 0.0), about->most);
        /* those of a ball err by orders more beside its border than in the rest of a block */
        if (mu_is_ball(at->block) && quantity != MU_MU_RATIO)
            error = cells->cell_errors[3 * spot.cell];
    }
    out.bound = fabs(factor) * error + errors[1] + about->slack(data, at, out.value, factor);
    return out;
}

/* (value, bound of its absolute error, source or block) at any v~, y~, of a ball V, Y; NaN and -1
 * where illegal. */
static mu_answer mu_answer_at(const mumacro_data *data, int contact, int quantity, double v,
                              double y) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    mu_answer out = {NAN, NAN, MU_OTHER};
    mu_place at;
    if (!(0.0 < v && v < HUGE_VAL && 0.0 < y && y < HUGE_VAL)) {
        out = about->limit(contact, v, y);
        if (out.source != MU_OTHER) return out;
    }
    at = mu_locate(data, contact, v == 0.0 ? MU_CREEP : v, y);
    if (at.block == MU_CONTACT[contact].fast) return about->fast(data, contact, v, y);
    out = mu_in_block(data, quantity, &at);
    if (v == 0.0) out.source = MU_STATIC_LIMIT;
    return out;
}

/* As mu_edge_share in the last cell below the border, of (T_8' at w - T_8' at the border) /
 * (1 - w): from 1344 to 64. */
MU_INLINE double mu_border_share(double w) { return 1.0 / (1.0 + 10.0 * (1.0 - w)); }

/* What errors of q and of its derivatives along a and b move a logarithmic slope by, per |factor|.
 */
MU_INLINE double mu_slope_error(const double *errors, double of_factor, double of_a, double of_b) {
    return errors[0] * fabs(of_factor) + errors[1] * fabs(of_a) + errors[2] * fabs(of_b);
}

/* Whether x is in the last of the cells that end at end. */
MU_INLINE int mu_is_last(double x, double end, double offset, double step) {
    return mu_fma1(x, step, offset) >= (double)mu_whole_of(mu_fma1(end, step, offset));
}

/* d q / d ln x along b in the last cell below the border x = 1, without what is linear in root =
 * sqrt(1 - x), in falling powers of u; left is the way in b to the border. */
MU_INLINE void mu_without_edge(const double *cell, mu_spot spot, double left, double step,
                               const mu_turn *turn, double *along) {
    const double root = left / turn->scale;
    const double factor = -2.0 * step * step * (1.0 - root * root) * (turn->scale * turn->scale);
    mu_bends(cell, spot.w, along);
    for (int i = 0; i < 8; ++i) along[i] *= factor;
}

/* Errors of cells are differences to an interpolant on 3/2 as many nodes.  At the ridge mu~
 * converges like n^-4.5 (docs/derivations.md), and the slope across the rays, at the end of both
 * coordinates a second derivative, by four orders slower: that interpolant misses sqrt(2/3) of what
 * the cells miss, and the difference is short of it by this factor, 5.45. */
#define MU_RIDGE_SLOPES (1.0 / (1.0 - 0.816496580927726))

/* What errors along a and b are multiplied by in a slope across the rays. */
typedef struct {
    double slope, reach_a, reach_b;
} mu_across;

/* A slope of q along ln v~ at fixed y~ in the ring next to the steepest ray, that is across the
 * rays.
 *
 * With root = sqrt(1 - t), t the ray, it is -t/(2 root) times d q/d root = -MU_FOLD_SCALE q_a -
 * of_root per_z, where of_root is d ln entry/d root.  q is smooth in root without a linear term at
 * fixed y~, so at root = 0 that is zero wherever b is.  The polynomial of a cell has what it errs
 * by there; that is taken out at the same b, so that both are of one polynomial and root divides
 * their difference, as at the border.  per_z: d q/d ln z, in falling powers of u. */
static mu_across mu_across_rays(const double *cell, const mu_place *at, mu_spot spot,
                                const double *block, const mu_turn *turn) {
    const double root = (turn->end - at->a) / turn->scale, t = 1.0 - root * root;
    const double of_u = 2.0 * block[MU_STEP_A] * turn->scale; /* -d u/d root */
    double row[8], per_z[8], of_root, of_edge, at_edge, rise, bend;
    mu_across out;
    mu_rows(cell, spot.w, row, per_z);
    if (mu_is_last(at->b, turn->end, block[MU_OFFSET_B], block[MU_STEP_B]))
        mu_without_edge(cell, spot, turn->end - at->b, block[MU_STEP_B], turn, per_z);
    else
        for (int i = 0; i < 8; ++i) per_z[i] *= mu_fold_slope(at->b) * 2.0 * block[MU_STEP_B];
    (void)mu_entry_slope(t, 0, root, &of_root);
    (void)mu_entry_slope(1.0, 0, 0.0, &of_edge);
    rise = mu_rise(per_z, spot.u, &at_edge);
    bend = mu_entry_bend(root, of_edge);
    out.slope = 0.5 * t * (bend * at_edge - of_u * (of_u * mu_bend(row, spot.u) + of_root * rise));
    out.reach_a = mu_min(0.5 * turn->scale * t / mu_max(root, 1e-9), 0.5 * block[MU_STEP_A]);
    /* an error of per_z changes by twice its largest at most, and by 64 times that per unit of u,
     * as T_8 does */
    out.reach_b =
        0.5 * t * (fabs(bend) + fabs(of_root) * mu_min(2.0 / mu_max(root, 1e-9), 64.0 * of_u));
    return out;
}

/* The slopes in a block, from the place, its spot in a cell, q there, and base and factor. */
MU_INLINE mu_slopes mu_slopes_in_block(const mumacro_data *data, int quantity, const mu_place *at,
                                       mu_spot spot, mu_slope slope, double base, double factor) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    const mumacro_cells *cells = &data->quantities[quantity];
    const double *block = mu_block_of(data, at->block);
    const mu_turn turn = mu_turn_of(at);
    const mu_form_slopes form = mu_slopes_of_form(mu_form_in(at->block, quantity), at, &turn);
    /* d b / d ln x where b is folded */
    const double fold = turn.edge_v == 1.0 ? fabs(turn.b_v) : fabs(turn.b_v / turn.edge_v);
    const double *cell = cells->polynomials + 64 * spot.cell,
                 *errors = cells->cell_errors + 3 * spot.cell;
    const double scale = fabs(factor), q_a = slope.q_a * 2.0 * block[MU_STEP_A];
    const double q_b = slope.q_b * 2.0 * block[MU_STEP_B];
    double reach = fold, ratio, noise, along_a, along_a_y, more = 0.0;
    double share_a = mu_edge_share(spot.u), share_b = mu_edge_share(spot.w);
    /* that near to the border a point may lie beyond it, where a slope changes with the distance in
     * another way */
    const double inside = 1.0 - at->v / at->crit, off = mu_border_error(data);
    const double unknown = MU_ROUNDING + (fabs(inside) <= off ? off : 0.0);
    mu_slopes out;
    double along_b = turn.b_v * q_b, along_b_y = turn.b_y * q_b;
    if (about->about.smooth_at_border && mu_has_edge(at->block)) {
        /* At the border the quantity is smooth in v~, so q has no linear term in root = sqrt(1 -
         * v~/v~crit); the interpolant has one of the size of its error, which the chain rule would
         * divide by root.  Taken out of the last cell, where 1 - w = 2 step root, it leaves the
         * slope bounded. */
        const double step = block[MU_STEP_B];
        reach =
            mu_min(reach, 0.5 * step *
                              (turn.scale * turn.scale)); /* what it is one cell from the border */
        if (mu_is_last(at->b, turn.end, block[MU_OFFSET_B], step)) {
            double along[8];
            mu_without_edge(cell, spot, turn.end - at->b, step, &turn, along);
            along_b = mu_by_halves(along, spot.u);
            along_b_y = turn.edge_y * along_b;
            along_b = turn.edge_v * along_b;
            share_b = mu_border_share(spot.w);
        }
    }
    along_a = turn.a_v * q_a;
    along_a_y = turn.a_y * q_a;
    if (at->block == MU_B_RING &&
        mu_is_last(at->a, turn.end, block[MU_OFFSET_A], block[MU_STEP_A])) {
        const mu_across rays = mu_across_rays(cell, at, spot, block, &turn);
        along_a = rays.slope;
        along_a_y = -rays.slope;
        along_b = 0.0;
        along_b_y /= turn.edge_y;
        share_a = mu_border_share(spot.u);
        more = scale *
               (errors[1] * share_a * rays.reach_a + errors[2] * share_b * reach * rays.reach_b);
    }
    out.value = mu_min(mu_max(mu_fma1(factor, slope.q, base), 0.0), about->most);
    out.along_v = form.base_v + factor * (form.factor_v * slope.q + along_a + along_b);
    out.along_y = form.base_y + factor * (form.factor_y * slope.q + along_a_y + along_b_y);
    noise = 8.0 * MU_ROUNDING * (fabs(form.base_v) + fabs(form.base_y)) + MU_DENORMAL +
            8.0 * unknown * scale * (1.0 + fabs(form.factor_v) + fabs(form.factor_y) + reach);
    out.bound_v = more > 0.0 ? scale * errors[0] * fabs(form.factor_v) + more + noise
                             : scale * mu_slope_error(errors, form.factor_v, share_a * turn.a_v,
                                                      share_b * reach * turn.edge_v) +
                                   noise;
    /* along y~ what is removed from the last cell also depends on the border's slope */
    ratio = fold != 0.0 ? reach / fold : 1.0;
    out.bound_y =
        more > 0.0
            ? scale * (errors[0] * fabs(form.factor_y) + errors[2] * share_b * reach) + more + noise
            : scale * mu_slope_error(errors, form.factor_y, share_a * turn.a_y,
                                     share_b * turn.b_y * ratio) +
                  noise;
    if (mu_is_ridge(at) && at->block == MU_B_RING) {
        out.bound_v *= MU_RIDGE_SLOPES;
        out.bound_y *= MU_RIDGE_SLOPES;
    }
    if (mu_follows_border(at->block)) out.bound_y += scale * fabs(along_b) * at->tilt.error;
    out.bound = scale * errors[0] + noise + 8.0 * MU_ROUNDING * fabs(base);
    if (!about->about.smooth_at_border && mu_has_edge(at->block)) {
        /* a root of the distance to the border: |1/sqrt(1 - d) - 1| <= d / (1 - d) for the error d
         * of that distance */
        const double share = inside > off ? fabs(factor * q_b) * off / (inside - off) : HUGE_VAL;
        out.bound_v += share * fabs(turn.b_v);
        out.bound_y += share * fabs(turn.b_y);
    }
    if (mu_is_corner(at->block)) {
        const double digit = 8.0 * MU_ROUNDING / (3.0 * at->phi * at->phi + 2.0 * (at->y - 1.0));
        out.bound += digit * scale;
        out.bound_v += digit * (fabs(out.along_v) + scale);
        out.bound_y += digit * (fabs(out.along_y) + scale * fabs(form.factor_y));
    }
    return out;
}

/* The same from the place alone. */
static mu_slopes mu_slopes_at_place(const mumacro_data *data, int quantity, const mu_place *at) {
    const mumacro_cells *cells = &data->quantities[quantity];
    const mu_form form = mu_form_in(at->block, quantity);
    const mu_spot spot =
        mu_find(mu_block_of(data, at->block), cells->first, cells->cells, at->a, at->b);
    const mu_slope slope = mu_cell_slopes(cells->polynomials + 64 * spot.cell, spot.u, spot.w);
    return mu_slopes_in_block(data, quantity, at, spot, slope, mu_base(form.base, at),
                              mu_factor(form.factor, at));
}

/* The same of a ball, where mu_limit_slopes is that of one spring: at rest along ln Y, which jumps
 * at Y = 1. */
static mu_slopes mu_ball_limit_slopes(double y, mu_answer limit) {
    mu_slopes out = {0.0, 0.0, 0.0, 0.0, 0.0, HUGE_VAL};
    out.value = limit.value;
    if (limit.source == -1)
        out.along_v = out.along_y = out.bound_v = out.bound_y = NAN;
    else if (limit.source == MU_STATIC_LIMIT) {
        mu_ball_at_rest(y, &out.along_y);
        out.bound_y =
            8.0 * MU_ROUNDING * fabs(out.along_y) + (fabs(y - 1.0) < 2.0 * MU_ROUNDING ? 1.7 : 0.0);
    }
    return out;
}

/* The slopes where the record knows the value in closed form, at the ends of v~ and y~. */
static mu_slopes mu_limit_slopes(int quantity, double y, mu_answer limit) {
    mu_slopes out = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    out.value = limit.value;
    if (limit.source == -1)
        out.along_v = out.along_y = out.bound_v = out.bound_y = NAN;
    else if (quantity == MU_MU_RATIO && limit.source == MU_STATIC_LIMIT && y < 1.0) {
        const double mu = limit.value;
        out.along_y = -y * y / mu;
        /* the slope of the square root, whose argument is uncertain by the last digit of y~ */
        out.bound_y =
            fabs(out.along_y) * mu_min(2.0 * MU_ROUNDING / (mu * mu) + MU_ROUNDING, 1e300);
    }
    return out;
}

/* (value, v~ d/d v~, y~ d/d y~, bounds of both slopes) at any point.
 *
 * The logarithmic slopes are the natural ones: bounded everywhere but on the line v~ -> 0 at y~ =
 * 1, where mu~ has the infinite slope of a cube root in v~ (and a finite logarithmic one). */
static mu_slopes mu_slopes_at(const mumacro_data *data, int contact, int quantity, double v,
                              double y) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    mu_slopes out = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    mu_place at;
    if (!(0.0 < v && v < HUGE_VAL && 0.0 < y && y < HUGE_VAL)) {
        const mu_answer limit = about->limit(contact, v, y);
        if (limit.source != MU_OTHER)
            return contact == MU_BALL ? mu_ball_limit_slopes(y, limit)
                                      : mu_limit_slopes(quantity, y, limit);
    }
    at = mu_locate(data, contact, v == 0.0 ? MU_CREEP : v, y);
    if (at.block == MU_CONTACT[contact].fast) return about->fast_slopes(data, contact, v, y);
    if (mu_form_in(at.block, quantity).factor == MU_NOTHING) {
        if (!about->about.smooth_at_border && at.v <= at.crit * (1.0 + mu_border_error(data)))
            out.bound_v = out.bound_y = HUGE_VAL;
        return out;
    }
    out = mu_slopes_at_place(data, quantity, &at);
    if (v == 0.0) out.along_v = 0.0;
    return out;
}

/* d mu~/d v~ at v~ = 0 and its bound: pi/(2 (1 - y~^2)) below y~ = 1, C(y~) above, infinite on y~ =
 * 1; 0 at y~ = 0 or infinity.  C(y~) = lim mu~/v~ is read off the table at a speed that stands for
 * the limit. */
static double mu_speed_slope_at_zero(const mumacro_data *data, double y, double *bound) {
    double v;
    mu_answer ratio;
    *bound = 0.0;
    if (y == 0.0 || y == HUGE_VAL) return 0.0;
    if (y < 1.0) {
        const double gap = (1.0 - y) * (1.0 + y), slope = 0.5 * MU_PI / gap;
        *bound = slope * (4.0 * MU_ROUNDING / gap + MU_ROUNDING);
        return slope;
    }
    if (y == 1.0) return *bound = HUGE_VAL;
    v = MU_CREEP * mu_min(1.0, y - 1.0);
    ratio = mu_answer_at(data, MU_SPRING, MU_MU_RATIO, v, y);
    *bound = ratio.bound / v;
    return ratio.value / v;
}
