/* The shared object's functions for one instruction level; compiled once for each. */
#include "kernel.c"
#include "motion.c"
#include "motion_slip.c"
#include "motion_cycle.c"
#include "motion_ball.c"
#include "settling.c"
#include "loop.c"
#include "library.h"
#include "interval.c"

static void mu_values_as(const mumacro_data *data, int contact, int direction, int quantity,
                         int64_t n, const double *v, const double *y, double *value, double *bound,
                         int8_t *source) {
    if (direction == MU_ACROSS) {
        mu_values(data, contact, quantity, n, v, y, value, bound, source);
        return;
    }
    for (int64_t i = 0; i < n; ++i) {
        const mu_answer answer = mu_answer_as(data, contact, direction, quantity, v[i], y[i]);
        value[i] = answer.value;
        bound[i] = answer.bound;
        source[i] = (int8_t)answer.source;
    }
}

/* v~ from which nothing sticks; NaN for what is no amplitude. */
static double mu_border_as(const mumacro_data *data, int contact, int direction, double y) {
    if (direction == MU_NORMAL) return y >= 0.0 && y < 1.0 ? y : NAN;
    if (direction == MU_ALONG) return y >= 0.0 ? y : NAN;
    return contact == MU_BALL ? mu_ball_border(data, y) : mu_border_at(data, y);
}

static void mu_borders_as(const mumacro_data *data, int contact, int direction, int64_t n,
                          const double *y, double *crit) {
    for (int64_t i = 0; i < n; ++i) crit[i] = mu_border_as(data, contact, direction, y[i]);
}

/* Where the columns stand, and their strides. */
static void mu_take_columns(const mumacro_columns *in, const double *columns[6],
                            int64_t strides[6]) {
    for (int i = 0; i < 6; ++i) {
        columns[i] = in->array[i] ? in->array[i] : &in->constant[i];
        strides[i] = in->array[i] != NULL;
    }
}

static void mu_cases_of_columns(const mumacro_data *data, int contact, int direction, int64_t n,
                                const mumacro_columns *in, int rows, double *out, int64_t stride,
                                int8_t *source) {
    const double *columns[6];
    int64_t strides[6];
    mu_take_columns(in, columns, strides);
    mu_cases_as(data, contact, direction, n, columns, strides, rows, out, stride, source);
}

static void mu_intervals(const mumacro_data *data, int contact, int direction, int64_t n,
                         const mumacro_columns *in, const double *high, double *out,
                         int64_t stride) {
    const double *columns[6];
    int64_t strides[6];
    mu_take_columns(in, columns, strides);
    for (int64_t i = 0; i < n; ++i) {
        double six[6], extremes[MU_EXTREME_ROWS];
        mu_inputs low;
        for (int j = 0; j < 6; ++j) six[j] = columns[j][strides[j] ? i : 0];
        memcpy(&low, six, sizeof low);
        mu_extremes_of(data, contact, direction, &low, high[i], extremes);
        for (int j = 0; j < MU_EXTREME_ROWS; ++j) out[j * stride + i] = extremes[j];
    }
}

static void mu_places_of(const mumacro_data *data, int contact, int64_t n, const double *v,
                         const double *y, int8_t *block, double *a, double *b) {
    for (int64_t i = 0; i < n; ++i) {
        const mu_place at = mu_locate(data, contact, v[i], y[i]);
        block[i] = (int8_t)MU_PLACE_OF(at.block);
        a[i] = at.a;
        b[i] = at.b;
    }
}

static void mu_tabulated(const mumacro_data *data, int quantity, int block, int64_t n,
                         const double *a, const double *b, double *q) {
    const mumacro_cells *cells = &data->quantities[quantity];
    const double *row = mu_block_of(data, block);
    for (int64_t i = 0; i < n; ++i) {
        const mu_spot spot = mu_find(row, cells->first, cells->cells, a[i], b[i]);
        q[i] = mu_cell_value(cells->polynomials + 64 * spot.cell, spot.u, spot.w);
    }
}

static void mu_border_scales(int piece, int64_t n, const double *y, double *of_nodes,
                             double *of_cells) {
    for (int64_t i = 0; i < n; ++i) {
        of_nodes[i] = mu_border_scale(piece, y[i]);
        of_cells[i] = piece == MU_BORDER_MID ? 1.0 : of_nodes[i];
    }
}

static void mu_forms(int contact, int quantity, int place, int64_t n, const double *v,
                     const double *y, const double *eta, double *base, double *factor) {
    const int block = contact == MU_BALL ? MU_BALL_BLOCKS + place : place;
    const mu_form form = mu_form_in(block, quantity);
    for (int64_t i = 0; i < n; ++i) {
        mu_place at = {block, v[i], y[i], 0.0, 0.0, 0.0, 0.0, {0.0, 0.0}};
        if (mu_is_corner(block)) {
            at.phi = mu_normal_form_root(v[i], eta[i]);
            at.a = sqrt(MU_PI * v[i] / at.phi + 2.0 * at.phi * at.phi);
        }
        base[i] = mu_base(form.base, &at);
        factor[i] = mu_factor(form.factor, &at);
    }
}

static void mu_cell_shares(int64_t n, const double *w, double *inside, double *at_border) {
    for (int64_t i = 0; i < n; ++i) {
        inside[i] = mu_edge_share(w[i]);
        at_border[i] = mu_border_share(w[i]);
    }
}

static void mu_entries(int64_t n, const double *t, double *entry) {
    for (int64_t i = 0; i < n; ++i) {
        const mu_mask half = t[i] < 0.5 ? mu_all_whole(-1) : mu_all_whole(0);
        entry[i] = mu_first(mu_entry(mu_all(t[i]), half, mu_all(sqrt(mu_max(1.0 - t[i], 0.0)))));
    }
}

static void mu_roots(int64_t n, const double *v, const double *eta, double *root) {
    for (int64_t i = 0; i < n; ++i) root[i] = mu_normal_form_root(v[i], eta[i]);
}

static void mu_outers(int64_t n, const double *r, double *out) {
    for (int64_t i = 0; i < n; ++i) {
        const mu_outer outer = mu_outer_expansion(r[i]);
        memcpy(out + 5 * i, &outer, 5 * sizeof *out);
    }
}

static const mumacro_quantity *mu_about(int code) {
    return code >= 0 && code < MU_QUANTITIES ? &MU_QUANTITY[code].about : NULL;
}

static const mumacro_chart *mu_chart_of(int contact, int place) {
    if (contact < 0 || contact >= MU_CONTACTS) return NULL;
    return place >= 0 && place < MU_CONTACT[contact].charts ? &MU_BLOCK[contact][place].chart
                                                            : NULL;
}

static mumacro_source mu_source_at(int code) {
    const mumacro_source none = {NULL, -1};
    return code >= 0 && code < MU_SOURCES ? mu_source_of(code) : none;
}

static const mumacro_atlas MU_ATLAS = {
    MU_Y_STICK_LO, MU_Y_STICK_HI, MU_Y_CONT,      MU_Y_MID,      MU_Y_HIGH,      MU_Y_TAIL,
    MU_S_CUT,      MU_SIGMA_CUT,  MU_RHO_MAX,     MU_FAST_KAPPA, MU_ROUNDING,    MU_OUTER_LOG_MAX,
    MU_MIDDLE,     MU_STEEPEST,   MU_STEEPEST_Y,  MU_SLOW,       MU_FOLD_KNOT,   MU_FOLD_SCALE,
    MU_PIECES,     MU_REGIMES,    MU_OUTER_CELLS, MU_PIECE,      MU_REGIME_NAME,
};

#define MU_TEXT(x) #x
#define MU_NAME(x) MU_TEXT(x)
#define MU_JOINED(a, b) a##b
#define MU_SYMBOL(level) MU_JOINED(mumacro_kernel_, level)

extern const mumacro_kernel MU_SYMBOL(MUMACRO_LEVEL);
const mumacro_kernel MU_SYMBOL(MUMACRO_LEVEL) = {
    MU_NAME(MUMACRO_LEVEL),
    &MU_ATLAS,
    mu_chart_of,
    mu_source_at,
    mu_about,
    mu_values_as,
    mu_slopes_of_points,
    mu_cases_of_columns,
    mu_intervals,
    mu_ratio_alone,
    mu_one,
    mu_borders_as,
    mu_places_of,
    mu_tabulated,
    mu_forms,
    mu_border_scales,
    mu_cell_shares,
    mu_entries,
    mu_roots,
    mu_outers,
    mu_element_steps,
    mu_motions,
    mu_motion_cycle,
    mu_turns_in_stick,
    mu_loop_forces,
};
