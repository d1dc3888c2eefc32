/* Many points.  The choice of a point's block is a chain of branches that a processor cannot
 * predict.  So MU_CHUNK points go together through passes that select instead: amplitudes and the
 * border's cell, v~crit, blocks and coordinates, cells, values.  What the passes do not handle (the
 * corner, closed forms, zero and extreme inputs) is marked and answered one by one.  A single point
 * is a chunk of one, so it has the same bits as in any array. */

#define MU_CHUNK 256 /* the scratch of the passes stays in the fastest cache */

/* How many of n points go into one chunk. */
MU_INLINE int mu_few(int64_t n) { return n < MU_CHUNK ? (int)n : MU_CHUNK; }

typedef struct {
    double v[MU_CHUNK], y[MU_CHUNK]; /* of a ball V, Y; 1 where a point is not common */
    double crit[MU_CHUNK], ln_y[MU_CHUNK], a[MU_CHUNK], b[MU_CHUNK], base[MU_CHUNK],
        factor[MU_CHUNK];
    double local[MU_CHUNK];          /* coordinate in the border's cell */
    double u[MU_CHUNK], w[MU_CHUNK]; /* coordinates in the cell */
    int64_t block[MU_CHUNK];
    int32_t border[MU_CHUNK + MU_LANES], cell[MU_CHUNK];
} mu_chunk;

/* Points into the chunk, the border's cell, v~crit. */
MU_INLINE void mu_pass_borders(const mumacro_data *data, int contact, int n, const double *v,
                               const double *y, mu_chunk *c) {
    const int rest = n % MU_LANES;
    for (int i = 0; i < n; i += MU_LANES) {
        double few[2][MU_LANES];
        mu_lanes speed, amplitude;
        mu_mask common;
        mu_border_cells cells;
        if (rest && i + MU_LANES > n) {
            for (int j = 0; j < MU_LANES; ++j) {
                few[0][j] = j < rest ? v[i + j] : 1.0;
                few[1][j] = j < rest ? y[i + j] : 1.0;
            }
            speed = mu_load(few[0]);
            amplitude = mu_load(few[1]);
        } else {
            speed = mu_load(v + i);
            amplitude = mu_load(y + i);
        }
        if (contact == MU_BALL) {
            speed = speed / MU_MIDDLE;
            amplitude = amplitude / MU_MIDDLE;
        }
        common = mu_is_common(speed, amplitude);
        speed = mu_select(common, speed, mu_all(1.0));
        amplitude = mu_select(common, amplitude, mu_all(1.0));
        cells = mu_border_cell(data, amplitude);
        mu_store(c->v + i, speed);
        mu_store(c->y + i, amplitude);
        mu_store(c->ln_y + i, cells.ln_y);
        mu_store(c->crit + i, cells.scale);
        mu_store(c->local + i, cells.u);
        memcpy(c->border + i, &cells.cell, sizeof cells.cell);
        mu_store_whole(c->block + i,
                       mu_select_whole(common, mu_all_whole(0), mu_all_whole(MU_OTHER)));
    }
    for (int i = 0; i < n; ++i)
        c->crit[i] *= mu_border_value(data->border + 8 * c->border[i], c->local[i]);
}

/* Blocks, coordinates and forms of mu~; returns how many points are left to be answered one by one.
 */
MU_INLINE int mu_pass_places(const mumacro_data *data, int contact, int n, mu_chunk *c) {
    const double steepest = contact == MU_BALL ? mu_steepest_of(data) : 0.0;
    mu_mask left = mu_all_whole(0);
    int count = 0;
    for (int i = n; i % MU_LANES; ++i) c->crit[i] = 1.0;
    for (int i = 0; i < n; i += MU_LANES) {
        mu_mask chosen, block;
        const mu_lanes v = mu_load(c->v + i), y = mu_load(c->y + i);
        const mu_lanes crit = mu_load(c->crit + i), ln_y = mu_load(c->ln_y + i);
        const mu_places places = contact == MU_BALL ? mu_place_ball(steepest, v, y, crit, ln_y)
                                                    : mu_place_common(v, y, crit, ln_y);
        memcpy(&chosen, c->block + i, sizeof chosen);
        block = mu_select_whole(MU_WHERE(chosen == 0), places.block, chosen);
        left |= MU_WHERE(block == mu_all_whole(MU_CONTACT[contact].corner)) |
                MU_WHERE(block == mu_all_whole(MU_CONTACT[contact].fast)) |
                MU_WHERE(block == mu_all_whole(MU_OTHER));
        mu_store(c->a + i, places.a);
        mu_store(c->b + i, places.b);
        mu_store(c->base + i, places.base);
        mu_store(c->factor + i, places.factor);
        mu_store_whole(c->block + i, block);
    }
    for (int i = 0; i < MU_LANES; ++i) {
        int64_t any[MU_LANES];
        memcpy(any, &left, sizeof left);
        count += any[i] != 0;
    }
    return count;
}

/* A column of the blocks' rows, for looking up several at once. */
#if MU_LANES == 8
typedef struct {
    __m512d low, high; /* 16 rows in two registers */
} mu_column;

MU_INLINE mu_column mu_column_of(const double *blocks, int column) {
    double rows[16];
    mu_column out;
    for (int i = 0; i < 16; ++i) rows[i] = blocks[i * MU_BLOCK_COLUMNS + column];
    out.low = (__m512d)mu_load(rows);
    out.high = (__m512d)mu_load(rows + 8);
    return out;
}

MU_INLINE mu_lanes mu_look_up(const mu_column *column, mu_mask block) {
    return (mu_lanes)_mm512_permutex2var_pd(column->low, (__m512i)block, column->high);
}
#else
typedef const double *mu_column;

MU_INLINE mu_column mu_column_of(const double *blocks, int column) { return blocks + column; }

MU_INLINE mu_lanes mu_look_up(const mu_column *column, mu_mask block) {
    int64_t row[MU_LANES];
    double values[MU_LANES];
    memcpy(row, &block, sizeof block);
    for (int i = 0; i < MU_LANES; ++i)
        values[i] = (*column)[MU_PLACE_OF(row[i]) * MU_BLOCK_COLUMNS];
    return mu_load(values);
}
#endif

/* As mu_find, the whole part of what may be any number. */
MU_INLINE mu_lanes mu_wholes_of(mu_lanes x) {
    x = mu_select(MU_WHERE(x > -1e9), x, mu_all(-1e9));
    return MU_AS(mu_lanes, MU_AS(mu_whole, mu_select(MU_WHERE(x < 1e9), x, mu_all(1e9))));
}

/* Cells of mu~: mu_find, several points at once.  A point without a cell gets one that means
 * nothing. */
MU_INLINE void mu_pass_cells(const mumacro_data *data, int n, mu_chunk *c) {
    const int64_t cells = data->quantities[MU_MU_RATIO].cells;
    const mu_lanes last = mu_all((double)(cells - 1)), zero = mu_all(0.0);
    mu_column column[MU_STEP_B + 1];
    int done = 0;
    const int together =
        n < 2 * MU_LANES ? 0 : n - n % MU_LANES; /* not for few: the columns have to be fetched */
    for (int i = 0; together && i <= MU_STEP_B; ++i) column[i] = mu_column_of(data->blocks, i);
    for (; done < together; done += MU_LANES) {
        const mu_lanes a = mu_load(c->a + done), b = mu_load(c->b + done);
        mu_mask block;
        mu_lanes x, z, i, j, cell;
        mu_whole index;
        memcpy(&block, c->block + done, sizeof block);
        x = mu_fma(a, mu_look_up(column + MU_STEP_A, block),
                   mu_look_up(column + MU_OFFSET_A, block));
        z = mu_fma(b, mu_look_up(column + MU_STEP_B, block),
                   mu_look_up(column + MU_OFFSET_B, block));
        i = mu_wholes_of(x);
        j = mu_wholes_of(z);
        cell =
            mu_look_up(column + MU_FIRST, block) + i * mu_look_up(column + MU_CELLS_B, block) + j;
        cell = mu_select(MU_WHERE(cell > 0.0), cell, zero);
        index = MU_AS(mu_whole, mu_select(MU_WHERE(cell < last), cell, last));
        memcpy(c->cell + done, &index, sizeof index);
        mu_store(c->u + done, 2.0 * (x - i) - 1.0);
        mu_store(c->w + done, 2.0 * (z - j) - 1.0);
    }
    for (; done < n; ++done) {
        const mu_spot spot =
            mu_find(mu_block_of(data, (int)c->block[done]), 0, cells, c->a[done], c->b[done]);
        c->cell[done] = (int32_t)spot.cell;
        c->u[done] = spot.u;
        c->w[done] = spot.w;
    }
}

/* q and its derivatives in the cells: apart from what is made of them, so that the sums of several
 * points overlap. */
MU_INLINE void mu_pass_slopes(const mumacro_data *data, int n, const mu_chunk *c, mu_slope *slope) {
    const double *polynomials = data->quantities[MU_MU_RATIO].polynomials;
    for (int i = 0; i < n; ++i)
        slope[i] = mu_cell_slopes(polynomials + 64 * (int64_t)c->cell[i], c->u[i], c->w[i]);
}

/* mu~, from q in its cells or from slopes that are there already. */
MU_INLINE void mu_pass_values(const mumacro_data *data, int n, const mu_chunk *c,
                              const mu_slope *slopes, double *value) {
    const double *polynomials = data->quantities[MU_MU_RATIO].polynomials;
    for (int i = 0; i < n; ++i) {
        const double *cell = polynomials + 64 * (int64_t)c->cell[i];
        const double q = slopes ? slopes[i].value : mu_cell_value(cell, c->u[i], c->w[i]);
        value[i] = mu_fma1(c->factor[i], q, c->base[i]);
    }
    for (int i = 0; i < n; ++i) value[i] = mu_min(mu_max(value[i], 0.0), 1.0);
}

/* A point of the chunk in its block. */
MU_INLINE mu_place mu_place_of(const mumacro_data *data, const mu_chunk *c, int i, int slope) {
    mu_place at = {(int)c->block[i], c->v[i], c->y[i],    c->a[i],
                   c->b[i],          0.0,     c->crit[i], {0.0, 0.0}};
    if (mu_is_corner(at.block))
        mu_place_in_corner(&at);
    else if (slope)
        at.tilt =
            mu_border_tilt(data->pieces, data->border + 8 * c->border[i], c->local[i], c->y[i]);
    return at;
}

/* What the passes leave: the corner, closed forms, zero and extreme inputs. */
MU_INLINE int mu_is_left(int64_t block) {
    return mu_is_ball(block) ? block == MU_B_FAST || block == MU_B_CORNER
                             : block >= MU_FAST || block == MU_CORNER;
}

/* Where a ball's answer comes from, as it is reported. */
static int mu_ball_source(int source) {
    if (source == -1 || source == MU_NO_OSCILLATION || source == MU_STATIC_LIMIT) return source;
    if (mu_is_ball(source))
        return source == MU_B_FAST || mu_is_sliding_block(source) ? MU_BALL_SLIDES : MU_BALL_PARTLY;
    return source == MU_FAST ? MU_BALL_SLIDES : MU_BALL_PARTLY;
}

MU_INLINE mu_answer mu_answer_left(const mumacro_data *data, int contact, int quantity,
                                   const mu_chunk *c, int i, double v, double y) {
    const double middle = MU_CONTACT[contact].middle;
    mu_answer out;
    if (c->block[i] == MU_CONTACT[contact].corner) {
        const mu_place at = mu_place_of(data, c, i, 0);
        out = mu_in_block(data, quantity, &at);
    } else if (c->block[i] == MU_CONTACT[contact].fast) {
        out = MU_QUANTITY[quantity].fast(data, contact, c->v[i], c->y[i]);
    } else {
        out = mu_answer_at(data, contact, quantity, v / middle, y / middle);
    }
    if (contact == MU_BALL) out.source = mu_ball_source(out.source);
    return out;
}

/* mu~ at up to MU_CHUNK points, and where slope is not NULL, q and its derivatives; returns as
 * mu_pass_places. */
MU_INLINE int mu_chunk_of_ratios(const mumacro_data *data, int contact, int n, const double *v,
                                 const double *y, mu_chunk *c, mu_slope *slope, double *value,
                                 double *bound, int8_t *source) {
    const double *errors = data->quantities[MU_MU_RATIO].errors;
    int left;
    mu_pass_borders(data, contact, n, v, y, c);
    left = mu_pass_places(data, contact, n, c);
    mu_pass_cells(data, n, c);
    if (slope) mu_pass_slopes(data, n, c, slope);
    mu_pass_values(data, n, c, slope, value);
    for (int i = 0; bound && i < n; ++i) {
        const double *error = errors + 2 * MU_PLACE_OF(c->block[i]);
        bound[i] = fabs(c->factor[i]) * error[0] + error[1];
    }
    for (int i = 0; source && i < n; ++i)
        source[i] =
            (int8_t)(contact == MU_BALL ? mu_ball_source((int)c->block[i]) : (int)c->block[i]);
    for (int i = 0; left && i < n; ++i) {
        if (mu_is_left(c->block[i])) {
            const mu_answer answer = mu_answer_left(data, contact, MU_MU_RATIO, c, i, v[i], y[i]);
            value[i] = answer.value;
            if (bound) bound[i] = answer.bound;
            if (source) source[i] = (int8_t)answer.source;
        }
    }
    return left;
}

/* Another quantity at up to MU_CHUNK points. */
MU_INLINE void mu_chunk_of_others(const mumacro_data *data, int contact, int quantity, int n,
                                  const double *v, const double *y, mu_chunk *c, double *value,
                                  double *bound, int8_t *source) {
    mu_pass_borders(data, contact, n, v, y, c);
    mu_pass_places(data, contact, n, c);
    for (int i = 0; i < n; ++i) {
        mu_answer answer;
        if (mu_is_left(c->block[i]))
            answer = mu_answer_left(data, contact, quantity, c, i, v[i], y[i]);
        else {
            const mu_place at = mu_place_of(data, c, i, 0);
            answer = mu_in_block(data, quantity, &at);
            if (contact == MU_BALL) answer.source = mu_ball_source(answer.source);
        }
        value[i] = answer.value;
        if (bound) bound[i] = answer.bound;
        if (source) source[i] = (int8_t)answer.source;
    }
}

MU_INLINE void mu_values_of(const mumacro_data *data, int contact, int quantity, int64_t n,
                            const double *v, const double *y, double *value, double *bound,
                            int8_t *source) {
    for (int64_t i = 0; i < n; i += MU_CHUNK) {
        const int few = mu_few(n - i);
        double *error = bound ? bound + i : NULL;
        int8_t *from = source ? source + i : NULL;
        mu_chunk c;
        if (quantity == MU_MU_RATIO)
            mu_chunk_of_ratios(data, contact, few, v + i, y + i, &c, NULL, value + i, error, from);
        else
            mu_chunk_of_others(data, contact, quantity, few, v + i, y + i, &c, value + i, error,
                               from);
    }
}

/* The passes once for each contact, so that no point has to ask for it. */
static void mu_values(const mumacro_data *data, int contact, int quantity, int64_t n,
                      const double *v, const double *y, double *value, double *bound,
                      int8_t *source) {
    if (contact == MU_BALL)
        mu_values_of(data, MU_BALL, quantity, n, v, y, value, bound, source);
    else
        mu_values_of(data, MU_SPRING, quantity, n, v, y, value, bound, source);
}

static double mu_ratio_alone(const mumacro_data *data, double v, double y) {
    double mu;
    mu_values(data, MU_SPRING, MU_MU_RATIO, 1, &v, &y, &mu, NULL, NULL);
    return mu;
}

/* Slopes at a point of the chunk; slope: of mu_pass_slopes for mu~, NULL for other quantities. */
MU_INLINE mu_slopes mu_slopes_of(const mumacro_data *data, int contact, int quantity,
                                 const mu_chunk *c, const mu_slope *slope, int i, double v,
                                 double y) {
    const int charted = c->block[i] != MU_OTHER && c->block[i] != MU_CONTACT[contact].fast;
    const double middle = MU_CONTACT[contact].middle;
    if (charted && mu_form_in((int)c->block[i], quantity).factor != MU_NOTHING) {
        const mu_place at = mu_place_of(data, c, i, 1);
        if (slope != NULL && !mu_is_corner(at.block)) {
            const mu_spot spot = {c->cell[i], c->u[i], c->w[i]};
            return mu_slopes_in_block(data, quantity, &at, spot, slope[i], c->base[i],
                                      c->factor[i]);
        }
        return mu_slopes_at_place(data, quantity, &at);
    }
    return mu_slopes_at(data, contact, quantity, v / middle, y / middle);
}

MU_INLINE void mu_slopes_of_contact(const mumacro_data *data, int contact, int quantity, int64_t n,
                                    const double *v, const double *y, double *out, int64_t stride) {
    for (int64_t i = 0; i < n; i += MU_CHUNK) {
        const int few = mu_few(n - i);
        mu_chunk c;
        mu_slope slope[MU_CHUNK];
        const mu_slope *computed = NULL;
        mu_pass_borders(data, contact, few, v + i, y + i, &c);
        mu_pass_places(data, contact, few, &c);
        if (quantity == MU_MU_RATIO) {
            mu_pass_cells(data, few, &c);
            mu_pass_slopes(data, few, &c, slope);
            computed = slope;
        }
        for (int j = 0; j < few; ++j) {
            const mu_slopes slopes =
                mu_slopes_of(data, contact, quantity, &c, computed, j, v[i + j], y[i + j]);
            out[MU_SLOPE_VALUE * stride + i + j] = slopes.value;
            out[MU_SLOPE_V * stride + i + j] = slopes.along_v;
            out[MU_SLOPE_Y * stride + i + j] = slopes.along_y;
            out[MU_SLOPE_V_BOUND * stride + i + j] = slopes.bound_v;
            out[MU_SLOPE_Y_BOUND * stride + i + j] = slopes.bound_y;
        }
    }
}

static void mu_slopes_of_points(const mumacro_data *data, int contact, int quantity, int64_t n,
                                const double *v, const double *y, double *out, int64_t stride) {
    if (contact == MU_BALL && quantity != MU_MU_RATIO) { /* a table has no errors of these */
        for (int row = 0; row < MU_SLOPE_ROWS; ++row)
            for (int64_t i = 0; i < n; ++i) out[row * stride + i] = NAN;
    } else if (contact == MU_BALL)
        mu_slopes_of_contact(data, MU_BALL, quantity, n, v, y, out, stride);
    else
        mu_slopes_of_contact(data, MU_SPRING, quantity, n, v, y, out, stride);
}
