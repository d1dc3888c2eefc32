/* The border of continuous sliding, v~crit(y~), in three pieces; this file
 * alone knows how they are scaled.
 *
 * low   y~ <= 1.5            coordinate y~^2, nodes hold 2 v~crit / y~^2
 * mid   1.5 < y~ <= 2^17     coordinate ln y~, nodes hold v~crit / sqrt(y~), cells v~crit itself
 * high  y~ > 2^17            coordinate 1/y~, nodes hold v~crit / sqrt(y~) */

/* How far v~crit may be off, relative, with the last digits of v~ and y~. */
MU_INLINE double mu_border_error(const mumacro_data *data) {
    return data->pieces[MU_PIECE_ERROR] + MU_ROUNDING;
}

/* What a node's value is multiplied by to give v~crit. */
static double mu_border_scale(int piece, double y) {
    return piece == MU_BORDER_LOW ? 0.5 * y * y : sqrt(y);
}

typedef struct {
    mu_whole cell;
    mu_lanes u, scale, ln_y; /* coordinate in the cell, -1 to 1; factor of the cell's polynomial */
} mu_border_cells;

/* The cells of both pieces up to MU_Y_TAIL; 0 < y <= MU_Y_TAIL. */
MU_INLINE mu_border_cells mu_border_cell(const mumacro_data *data, mu_lanes y) {
    const double *low = data->pieces, *mid = low + MU_PIECE_COLUMNS;
    const mu_lanes ln_y = mu_log(y), squared = y * y;
    const mu_mask small = MU_WHERE(y <= MU_Y_CONT);
    mu_lanes x =
        mu_select(small, mu_fma(squared, mu_all(low[MU_PIECE_STEP]), mu_all(low[MU_PIECE_OFFSET])),
                  mu_fma(ln_y, mu_all(mid[MU_PIECE_STEP]), mu_all(mid[MU_PIECE_OFFSET])));
    const mu_lanes first =
        mu_select(small, mu_all(low[MU_PIECE_FIRST]), mu_all(mid[MU_PIECE_FIRST]));
    const mu_lanes last = mu_all((double)(data->border_cells - 1));
    mu_lanes whole, cell;
    mu_border_cells out;
    /* no table makes it read elsewhere, and NaN is cell 0 */
    x = mu_select(MU_WHERE(x > -1.0) & MU_WHERE(x < 1e9), x, mu_all(0.0));
    whole = MU_AS(mu_lanes, MU_AS(mu_whole, x));
    cell = mu_select(MU_WHERE(whole + first > 0.0), whole + first, mu_all(0.0));
    out.cell = MU_AS(mu_whole, mu_select(MU_WHERE(cell < last), cell, last));
    out.u = 2.0 * (x - whole) - 1.0;
    out.scale = mu_select(small, 0.5 * squared, mu_all(1.0));
    out.ln_y = ln_y;
    return out;
}

/* The polynomial of a cell, highest power first, by halves: u^4, u^2, u. */
MU_INLINE double mu_border_value(const double *c, double u) {
    const double u2 = u * u, u4 = u2 * u2;
    const double high = mu_fma1(mu_fma1(c[0], u, c[1]), u2, mu_fma1(c[2], u, c[3]));
    return mu_fma1(high, u4, mu_fma1(mu_fma1(c[4], u, c[5]), u2, mu_fma1(c[6], u, c[7])));
}

/* The share of its largest error that a derivative has at u in a cell, about: that of T_8, what
 * interpolation leaves out, is 64 at both edges and up to 8 between them. */
MU_INLINE double mu_edge_share(double u) { return 1.0 / (1.0 + 7.0 * (1.0 - u * u)); }

/* d ln v~crit / d ln y~, and what it may be off by. */
typedef struct {
    double slope, error;
} mu_tilt;

/* The slope from the same cell: 2 for y~ -> 0, 1/2 for y~ -> infinity.  v~crit errs as T_8 does, so
 * its slope errs most where two cells meet. */
MU_INLINE mu_tilt mu_border_tilt(const double *pieces, const double *cell, double u, double y) {
    double value = cell[0], slope = 0.0;
    const int piece = y <= MU_Y_CONT   ? MU_BORDER_LOW
                      : y <= MU_Y_TAIL ? MU_BORDER_MID
                                       : MU_BORDER_HIGH;
    const double step = 2.0 * pieces[piece * MU_PIECE_COLUMNS + MU_PIECE_STEP];
    const double weight = piece == MU_BORDER_LOW   ? 2.0 * y * y
                          : piece == MU_BORDER_MID ? 1.0
                                                   : -1.0 / y;
    mu_tilt out;
    for (int i = 1; i < 8; ++i) {
        slope = mu_fma1(slope, u, value);
        value = mu_fma1(value, u, cell[i]);
    }
    out.slope = (piece == MU_BORDER_LOW   ? 2.0
                 : piece == MU_BORDER_MID ? 0.0
                                          : 0.5) +
                weight * step * slope / value;
    out.error = 64.0 * mu_edge_share(u) * fabs(weight) * step * pieces[MU_PIECE_ERROR];
    return out;
}

/* v~crit at 0 < y < infinity, with its tilt and ln y~ where they are wanted. */
static double mu_border(const mumacro_data *data, double y, mu_tilt *tilt, double *ln_y) {
    const double *cell;
    double u, scale;
    if (y > MU_Y_TAIL) {
        const double *piece = data->pieces + MU_BORDER_HIGH * MU_PIECE_COLUMNS;
        const double x = mu_fma1(1.0 / y, piece[MU_PIECE_STEP], piece[MU_PIECE_OFFSET]);
        const double whole = (double)mu_whole_of(x), last = (double)(data->border_cells - 1);
        cell = data->border + 8 * (int64_t)mu_min(mu_max(0.0, piece[MU_PIECE_FIRST] + whole), last);
        u = 2.0 * (x - whole) - 1.0;
        scale = mu_border_scale(MU_BORDER_HIGH, y);
        if (ln_y) *ln_y = mu_log1(y);
    } else {
        const mu_border_cells cells = mu_border_cell(data, mu_all(y));
        cell = data->border + 8 * mu_first_cell(cells.cell);
        u = mu_first(cells.u);
        scale = mu_first(cells.scale);
        if (ln_y) *ln_y = mu_first(cells.ln_y);
    }
    if (tilt) *tilt = mu_border_tilt(data->pieces, cell, u, y);
    return scale * mu_border_value(cell, u);
}

/* v~crit at any y: 0 at 0, infinite at infinity, NaN for what is no amplitude. */
static double mu_border_at(const mumacro_data *data, double y) {
    if (y > 0.0 && y < HUGE_VAL) return mu_border(data, y, NULL, NULL);
    return y >= 0.0 ? y : NAN;
}
