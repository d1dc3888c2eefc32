/* One point: the value of a quantity, its slopes, and their bounds. */

#define MU_CREEP 1e-60 /* v~ that stands for the limit v~ -> 0: below any speed of interest, far above underflow */

MU_INLINE const double *mu_block_of(const mumacro_data *data, int block) {
    return data->blocks + block * MU_BLOCK_COLUMNS;
}

/* Value and bound in a block: the table's error of q times the factor, an absolute part, and the quantity's slack. */
static mu_answer mu_in_block(const mumacro_data *data, int quantity, const mu_place *at) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    const mumacro_cells *cells = &data->quantities[quantity];
    const mu_form form = about->forms[at->block];
    const double base = mu_base(form.base, at), factor = mu_factor(form.factor, at);
    const double *errors = cells->errors + 2 * at->block;
    mu_answer out = {0.0, 0.0, at->block};
    if (form.factor != MU_NOTHING) {
        const mu_spot spot = mu_find(mu_block_of(data, at->block), cells->first, cells->cells, at->a, at->b);
        out.value = mu_fma1(factor, mu_cell_value(cells->polynomials + 64 * spot.cell, spot.u, spot.w), base);
        out.value = mu_min(mu_max(out.value, 0.0), about->most);
    }
    out.bound = fabs(factor) * errors[0] + errors[1] + about->slack(data, at, out.value, factor);
    return out;
}

/* (value, bound of its absolute error, source) at any v~, y~; NaN and -1 where illegal. */
static mu_answer mu_answer_at(const mumacro_data *data, int quantity, double v, double y) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    mu_answer out = {NAN, NAN, MU_OTHER};
    mu_place at;
    if (!(0.0 < v && v < HUGE_VAL && 0.0 < y && y < HUGE_VAL)) {
        out = about->limit(v, y);
        if (out.source != MU_OTHER) return out;
    }
    at = mu_locate(data, v == 0.0 ? MU_CREEP : v, y);
    if (at.block == MU_FAST) return about->fast(data, v, y);
    out = mu_in_block(data, quantity, &at);
    if (v == 0.0) out.source = MU_STATIC_LIMIT;
    return out;
}

/* The share of its largest error that a derivative has at u in a cell, about: that of T_8, what interpolation leaves
 * out, is 64 at both edges and up to 8 between them. */
MU_INLINE double mu_edge_share(double u) { return 1.0 / (1.0 + 7.0 * (1.0 - u * u)); }

/* The same in the last cell below the border of (T_8' at w - T_8' at the border) / (1 - w): from 1344 to 64. */
MU_INLINE double mu_border_share(double w) { return 1.0 / (1.0 + 10.0 * (1.0 - w)); }

/* What errors of q and of its derivatives along a and b move a logarithmic slope by, per |factor|. */
MU_INLINE double mu_slope_error(const double *errors, double of_factor, double of_a, double of_b) {
    return errors[0] * fabs(of_factor) + errors[1] * fabs(of_a) + errors[2] * fabs(of_b);
}

/* The slopes in a block, from the place, its spot in a cell, q there, and base and factor. */
MU_INLINE mu_slopes mu_slopes_in_block(const mumacro_data *data, int quantity, const mu_place *at, mu_spot spot,
                                       mu_slope slope, double base, double factor) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    const mumacro_cells *cells = &data->quantities[quantity];
    const double *block = mu_block_of(data, at->block);
    const mu_turn turn = mu_turn_of(at);
    const mu_form_slopes form = mu_slopes_of_form(about->forms[at->block], at, &turn);
    const double *cell = cells->polynomials + 64 * spot.cell, *errors = cells->slope_errors + 3 * spot.cell;
    const double scale = fabs(factor), q_a = slope.q_a * 2.0 * block[MU_STEP_A];
    const double q_b = slope.q_b * 2.0 * block[MU_STEP_B];
    double reach = fabs(turn.b_v), ratio, noise;
    double share_a = mu_edge_share(spot.u), share_b = mu_edge_share(spot.w);
    /* that near to the border a point may lie beyond it, where a slope changes with the distance in another way */
    const double inside = 1.0 - at->v / at->crit, off = mu_border_error(data);
    const double unknown = MU_ROUNDING + (fabs(inside) <= off ? off : 0.0);
    mu_slopes out;
    double along_b = turn.b_v * q_b, along_b_y = turn.b_y * q_b;
    if (about->about.smooth_at_border && at->block >= MU_S_LOW && at->block != MU_CORNER) {
        /* At the border the quantity is smooth in v~, so q has no linear term in root = sqrt(1 - v~/v~crit); the
         * interpolant has one of the size of its error, which the chain rule would divide by root.  Taken out of the
         * last cell, where 1 - w = 2 step root, it leaves the slope bounded. */
        const double step = block[MU_STEP_B], last = (double)mu_whole_of(mu_fma1(MU_SQRT2, step, block[MU_OFFSET_B]));
        reach = mu_min(reach, 0.5 * step);
        if (mu_fma1(at->b, step, block[MU_OFFSET_B]) >= last) {
            const double root = MU_SQRT2 - at->b;
            along_b = -2.0 * step * step * (1.0 - root * root) * mu_cell_bend(cell, spot.u, spot.w);
            along_b_y = -at->tilt * along_b;
            share_b = mu_border_share(spot.w);
        }
    }
    out.value = mu_min(mu_max(mu_fma1(factor, slope.q, base), 0.0), about->most);
    out.along_v = form.base_v + factor * (form.factor_v * slope.q + turn.a_v * q_a + along_b);
    out.along_y = form.base_y + factor * (form.factor_y * slope.q + turn.a_y * q_a + along_b_y);
    noise = 8.0 * MU_ROUNDING * (fabs(form.base_v) + fabs(form.base_y)) + MU_DENORMAL +
            8.0 * unknown * scale * (1.0 + fabs(form.factor_v) + fabs(form.factor_y) + reach);
    out.bound_v = scale * mu_slope_error(errors, form.factor_v, share_a * turn.a_v, share_b * reach) + noise;
    /* along y~ what is removed from the last cell also depends on the border's slope */
    ratio = turn.b_v != 0.0 ? reach / fabs(turn.b_v) : 1.0;
    out.bound_y = scale * mu_slope_error(errors, form.factor_y, share_a * turn.a_y, share_b * turn.b_y * ratio) + noise;
    out.bound = scale * errors[0] + noise + 8.0 * MU_ROUNDING * fabs(base);
    if (!about->about.smooth_at_border && at->block >= MU_S_LOW && at->block != MU_CORNER) {
        /* a root of the distance to the border: |1/sqrt(1 - d) - 1| <= d / (1 - d) for the error d of that distance */
        const double share = inside > off ? fabs(factor * q_b) * off / (inside - off) : HUGE_VAL;
        out.bound_v += share * fabs(turn.b_v);
        out.bound_y += share * fabs(turn.b_y);
    }
    if (at->block == MU_CORNER) {
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
    const mu_form form = MU_QUANTITY[quantity].forms[at->block];
    const mu_spot spot = mu_find(mu_block_of(data, at->block), cells->first, cells->cells, at->a, at->b);
    const mu_slope slope = mu_cell_slopes(cells->polynomials + 64 * spot.cell, spot.u, spot.w);
    return mu_slopes_in_block(data, quantity, at, spot, slope, mu_base(form.base, at), mu_factor(form.factor, at));
}

/* The slopes where the record knows the value in closed form, at the ends of v~ and y~. */
static mu_slopes mu_limit_slopes(int quantity, double y, mu_answer known) {
    mu_slopes out = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    out.value = known.value;
    if (known.source == -1) out.along_v = out.along_y = out.bound_v = out.bound_y = NAN;
    else if (quantity == MU_MU_RATIO && known.source == MU_STATIC_LIMIT && y < 1.0) {
        const double mu = known.value;
        out.along_y = -y * y / mu;
        /* the slope of the square root, whose argument is uncertain by the last digit of y~ */
        out.bound_y = fabs(out.along_y) * mu_min(2.0 * MU_ROUNDING / (mu * mu) + MU_ROUNDING, 1e300);
    }
    return out;
}

/* (value, v~ d/d v~, y~ d/d y~, bounds of both slopes) at any point.
 *
 * The logarithmic slopes are the natural ones: bounded everywhere but on the line v~ -> 0 at y~ = 1, where mu~ has the
 * infinite slope of a cube root in v~ (and a finite logarithmic one). */
static mu_slopes mu_slopes_at(const mumacro_data *data, int quantity, double v, double y) {
    const mu_quantity *about = &MU_QUANTITY[quantity];
    mu_slopes out = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    mu_place at;
    if (!(0.0 < v && v < HUGE_VAL && 0.0 < y && y < HUGE_VAL)) {
        const mu_answer known = about->limit(v, y);
        if (known.source != MU_OTHER) return mu_limit_slopes(quantity, y, known);
    }
    at = mu_locate(data, v == 0.0 ? MU_CREEP : v, y);
    if (at.block == MU_FAST) return about->fast_slopes(data, v, y);
    if (about->forms[at.block].factor == MU_NOTHING) {
        if (!about->about.smooth_at_border && at.v <= at.crit * (1.0 + mu_border_error(data)))
            out.bound_v = out.bound_y = HUGE_VAL;
        return out;
    }
    out = mu_slopes_at_place(data, quantity, &at);
    if (v == 0.0) out.along_v = 0.0;
    return out;
}

/* d mu~/d v~ at v~ = 0 and its bound: pi/(2 (1 - y~^2)) below y~ = 1, C(y~) above, infinite on y~ = 1; 0 at y~ = 0 or
 * infinity.  C(y~) = lim mu~/v~ is read off the table at a speed that stands for the limit. */
static double mu_speed_slope_at_zero(const mumacro_data *data, double y, double *bound) {
    double v;
    mu_answer found;
    *bound = 0.0;
    if (y == 0.0 || y == HUGE_VAL) return 0.0;
    if (y < 1.0) {
        const double gap = (1.0 - y) * (1.0 + y), slope = 0.5 * MU_PI / gap;
        *bound = slope * (4.0 * MU_ROUNDING / gap + MU_ROUNDING);
        return slope;
    }
    if (y == 1.0) return *bound = HUGE_VAL;
    v = MU_CREEP * mu_min(1.0, y - 1.0);
    found = mu_answer_at(data, MU_MU_RATIO, v, y);
    *bound = found.bound / v;
    return found.value / v;
}
