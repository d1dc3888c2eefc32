/* The cells: polynomials of degree 7 in both local coordinates, and where a point finds its own. */

/* Polynomial and local coordinates u, w in [-1, 1] of the coordinates (a, b) in a block. */
typedef struct {
    int64_t cell;
    double u, w;
} mu_spot;

MU_INLINE mu_spot mu_find(const double *block, int64_t first, int64_t cells, double a, double b) {
    const double x = mu_fma1(a, block[MU_STEP_A], block[MU_OFFSET_A]);
    const double z = mu_fma1(b, block[MU_STEP_B], block[MU_OFFSET_B]);
    /* an offset's rounding may leave a coordinate at the near end below zero:
     * truncation keeps it in the first cell */
    const double i = (double)mu_whole_of(x), j = (double)mu_whole_of(z);
    const double cell = block[MU_FIRST] + i * block[MU_CELLS_B] + j - (double)first;
    const double last = (double)(cells - 1);
    mu_spot out;
    /* no table and no input makes it read elsewhere */
    out.cell = (int32_t)mu_min(mu_max(0.0, cell), last);
    out.u = 2.0 * (x - i) - 1.0;
    out.w = 2.0 * (z - j) - 1.0;
    return out;
}

enum { MU_PARTS = 8 / MU_LANES };

/* Rows hold falling powers of w, columns falling powers of u: Horner in w for all columns at once,
 * and where rising is not NULL the derivative along w. */
MU_INLINE void mu_rows(const double *cell, double w, double *row, double *rising) {
    mu_lanes sum[MU_PARTS], slope[MU_PARTS];
    for (int p = 0; p < MU_PARTS; ++p) {
        sum[p] = mu_load(cell + p * MU_LANES);
        slope[p] = mu_all(0.0);
    }
    for (int k = 1; k < 8; ++k)
        for (int p = 0; p < MU_PARTS; ++p) {
            if (rising) slope[p] = mu_fma(slope[p], mu_all(w), sum[p]);
            sum[p] = mu_fma(sum[p], mu_all(w), mu_load(cell + 8 * k + p * MU_LANES));
        }
    for (int p = 0; p < MU_PARTS; ++p) {
        mu_store(row + p * MU_LANES, sum[p]);
        if (rising) mu_store(rising + p * MU_LANES, slope[p]);
    }
}

/* A sum over falling powers of u by halves, u^4, u^2, u. */
MU_INLINE double mu_by_halves(const double *c, double u) {
    double half[4];
    const double u2 = u * u, u4 = u2 * u2;
    for (int i = 0; i < 4; ++i) half[i] = mu_fma1(c[i], u4, c[i + 4]);
    return mu_fma1(mu_fma1(half[0], u2, half[2]), u, mu_fma1(half[1], u2, half[3]));
}

/* The polynomial of a cell at u, w. */
MU_INLINE double mu_cell_value(const double *cell, double u, double w) {
    double c[8];
    mu_rows(cell, w, c, NULL);
    return mu_by_halves(c, u);
}

typedef struct {
    double q, q_a, q_b; /* and its derivatives along a and b */
    double value;       /* q to the bit as mu_cell_value has it */
} mu_slope;

/* The same with its derivatives along u and w. */
MU_INLINE mu_slope mu_cell_slopes(const double *cell, double u, double w) {
    double c[8], d[8];
    mu_slope out;
    mu_rows(cell, w, c, d);
    out.value = mu_by_halves(c, u);
    out.q = c[0];
    out.q_a = 0.0;
    out.q_b = d[0];
    for (int i = 1; i < 8; ++i) {
        out.q_a = mu_fma1(out.q_a, u, out.q);
        out.q = mu_fma1(out.q, u, c[i]);
        out.q_b = mu_fma1(out.q_b, u, d[i]);
    }
    return out;
}

/* (d/dw at w - d/dw at 1) / (w - 1) of a cell's polynomial: a polynomial again, so nothing cancels
 * next to w = 1.  Its coefficients in falling powers of u, as in mu_rows. */
MU_INLINE void mu_bends(const double *cell, double w, double *bends) {
    for (int p = 0; p < MU_PARTS; ++p) {
        mu_lanes sum = mu_all(0.0), quotient = mu_all(0.0);
        for (int k = 0; k < 6; ++k) { /* the power 7 - k of w */
            quotient = mu_fma(mu_all(7.0 - k), mu_load(cell + 8 * k + p * MU_LANES), quotient);
            sum = mu_fma(sum, mu_all(w), quotient);
        }
        mu_store(bends + p * MU_LANES, sum);
    }
}

/* The same of a sum over falling powers of u. */
MU_INLINE double mu_bend(const double *c, double u) {
    double sum = 0.0, quotient = 0.0;
    for (int i = 0; i < 6; ++i) {
        quotient = mu_fma1(7.0 - i, c[i], quotient);
        sum = mu_fma1(sum, u, quotient);
    }
    return sum;
}

/* (c at u - c at 1) / (u - 1) of a sum over falling powers of u, and c at 1. */
MU_INLINE double mu_rise(const double *c, double u, double *at_end) {
    double sum = 0.0, quotient = 0.0;
    for (int i = 0; i < 7; ++i) {
        quotient += c[i];
        sum = mu_fma1(sum, u, quotient);
    }
    *at_end = quotient + c[7];
    return sum;
}
