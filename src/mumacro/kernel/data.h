/* A table as evaluation reads it: arrays of doubles, prepared by mumacro/table/polynomials.py. */
#ifndef MU_DATA_H
#define MU_DATA_H
#include <stdint.h>

/* The cells of one quantity, from cell `first` of the blocks' count on: what comes before is zero
 * and not stored. polynomials (cells, 8, 8): powers of b's coordinate along rows, of a's along
 * columns, both from 7 down to 0; errors of the tabulated quantity (sources + 1, 2): relative to
 * the factor, absolute; errors in every cell (cells, 3): of q, of its derivatives along a and along
 * b, the largest where these have their share of it. */
typedef struct {
    int64_t first, cells;
    const double *polynomials, *errors, *cell_errors;
} mumacro_cells;

/* Quadrature over the springs of a ball that slip backwards, under oscillation along the sliding
 * direction: points (nodes, 11), the share of the radius beyond a node, its weight, and then null
 * rules, which are coefficients of the integrand by Legendre polynomials: three bands of three
 * degrees, the last of them the highest that the nodes can tell apart. */
typedef struct {
    int64_t nodes;
    const double *points;
} mumacro_driven_rule;

/* Columns of a block's row: its first cell, cells along b, and how they are counted along a and
 * along b: step times coordinate plus offset.  The columns up to the eighth are unused. */
enum mumacro_block_column {
    MU_FIRST,
    MU_CELLS_B,
    MU_OFFSET_A,
    MU_STEP_A,
    MU_OFFSET_B,
    MU_STEP_B,
    MU_BLOCK_COLUMNS = 8
};

/* Columns of a row of a piece of the border: likewise, and the relative error of v~crit. */
enum mumacro_piece_column {
    MU_PIECE_FIRST,
    MU_PIECE_OFFSET,
    MU_PIECE_STEP,
    MU_PIECE_ERROR,
    MU_PIECE_COLUMNS
};

/* border (border_cells, 8): polynomials of v~crit, highest power first; pieces (3,
 * MU_PIECE_COLUMNS); blocks (sources + 1, MU_BLOCK_COLUMNS), zero for sources without cells.  outer
 * (outer_cells, 2, 8): the two terms of large speed, in cells of ln(1 + y~^2/v~^2).  Whatever
 * numbers stand in these arrays, nothing outside of them is read.  A ball that is shaken across has
 * blocks and quantities of its own, with the same border; driven is for one that is shaken along,
 * without nodes where that is not wanted. */
typedef struct {
    int64_t border_cells;
    const double *border, *pieces, *blocks, *outer;
    mumacro_cells quantities[8];
    mumacro_driven_rule driven;
} mumacro_data;

/* The six inputs of n cases, mu0, Fz, k, y0 (normal: Fz_amplitude), omega, v0: each an array (n,),
 * or one constant where its array is NULL. */
typedef struct {
    const double *array[6];
    double constant[6];
} mumacro_columns;

/* Rows of the answers to cases.  A call fills all of them, or those before
 * the gradient, or those before v~. */
enum mumacro_row {
    MU_ROW_MU_MACRO,
    MU_ROW_MU_RATIO,
    MU_ROW_ERROR_BOUND,
    MU_ROW_V_TILDE,
    MU_ROW_Y_TILDE,
    MU_ROW_LENGTH_SCALE, /* l0 = mu0 Fz / k, eq. (5); 0 for rigid contact */
    /* d mu_macro / d input, one row for each of the six */
    MU_ROW_GRADIENT,
    MU_ROW_GRADIENT_BOUND = MU_ROW_GRADIENT + 6, /* bounds of the errors of these six */
    MU_ROWS = MU_ROW_GRADIENT_BOUND + 6
};

/* Rows of a quantity and its slopes v~ d/d v~ and y~ d/d y~, and of the bounds of these two. */
enum mumacro_slope_row {
    MU_SLOPE_VALUE,
    MU_SLOPE_V,
    MU_SLOPE_Y,
    MU_SLOPE_V_BOUND,
    MU_SLOPE_Y_BOUND,
    MU_SLOPE_ROWS
};

/* Rows of the answers over an interval of k: smallest and largest
 * mu_macro, the largest bound met there. */
enum mumacro_extreme_row { MU_EXTREME_LOW, MU_EXTREME_HIGH, MU_EXTREME_BOUND, MU_EXTREME_ROWS };

/* The answer to one case, as in these rows. */
typedef struct {
    double mu_macro, mu_ratio, error_bound, v_tilde, y_tilde, length_scale, gradient[6],
        gradient_bound[6];
    int source;
} mumacro_case;

/* A table as the export writes it: mumacro_table. */
typedef struct {
    mumacro_data spring, ball;
    double tolerance;
    const char *checksum, *version;
} mumacro_export;
#endif
