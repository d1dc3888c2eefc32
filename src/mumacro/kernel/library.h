/* What the shared object offers.  mumacro/kernel/binding.py reads this file, data.h and records.h
 * too: declarations only, no macros. */
#ifndef MU_LIBRARY_H
#define MU_LIBRARY_H
#include <stdint.h>

#include "data.h"
#include "records.h"

/* Where blocks meet, and other constants of the atlas (atlas.c). */
typedef struct {
    double y_stick_lo, y_stick_hi, y_cont, y_mid, y_high, y_tail, s_cut, sigma_cut, rho_max,
        fast_kappa, rounding, outer_log_max;
    double middle, steepest, steepest_y, slow, fold_knot, fold_scale; /* of a ball */
    int pieces, regimes, outer_cells;
    const mumacro_piece *piece;
    const char *const *regime_name;
} mumacro_atlas;

/* The evaluation for one instruction level.  Arrays are float64 and contiguous; nothing is read or
 * written beyond n.  A single point is an array of one.  Illegal points give NaN and the source
 * -1. */
typedef struct {
    const char *level;
    const mumacro_atlas *atlas;
    /* lists, which end with NULL: the blocks of a contact, where an answer comes from, quantities
     */
    const mumacro_chart *(*chart)(int contact, int place);
    mumacro_source (*source)(int code);
    const mumacro_quantity *(*quantity)(int code);
    /* a quantity: value, bound of its error and source.  contact 1 is a ball, whose data are its
     * own where it is shaken across and need the rule along; direction 1 is along, 2 normal, with
     * Fz_amplitude / Fz for y~.  bound and source may be NULL across */
    void (*values)(const mumacro_data *data, int contact, int direction, int quantity, int64_t n,
                   const double *v, const double *y, double *value, double *bound, int8_t *source);
    /* a quantity and its slopes: mumacro_slope_row, stride apart; of a ball mu~
     * alone has them, others are NaN */
    void (*slopes)(const mumacro_data *data, int contact, int quantity, int64_t n, const double *v,
                   const double *y, double *out, int64_t stride);
    /* dimensional cases; out has the first `rows` of mumacro_row, stride apart: those before v~,
     * those before the gradient, or all */
    void (*cases)(const mumacro_data *data, int contact, int direction, int64_t n,
                  const mumacro_columns *columns, int rows, double *out, int64_t stride,
                  int8_t *source);
    /* cases whose k, the third column, reaches to high: mumacro_extreme_row, stride apart */
    void (*intervals)(const mumacro_data *data, int contact, int direction, int64_t n,
                      const mumacro_columns *columns, const double *high, double *out,
                      int64_t stride);
    /* across, alone, in a fraction of the time: mu~ of a spring; and one case,
     * its gradient only where asked for */
    double (*ratio)(const mumacro_data *data, double v, double y);
    void (*one)(const mumacro_data *data, int contact, double mu0, double Fz, double k, double y0,
                double omega, double v0, int with_gradient, mumacro_case *out);
    /* v~crit(y~) of a contact and direction: 0 at 0, infinite at
     * infinity, NaN for what is no amplitude */
    void (*border_as)(const mumacro_data *data, int contact, int direction, int64_t n,
                      const double *y, double *crit);
    /* blocks of points with 0 < v~, y~ < infinity, of a ball those of its middle spring,
     * and their coordinates as evaluation counts them, which large speed has not: there
     * the block is the number of blocks */
    void (*places)(const mumacro_data *data, int contact, int64_t n, const double *v,
                   const double *y, int8_t *block, double *a, double *b);
    /* for the builder: what a block tabulates, q, at its coordinates as evaluation counts them */
    void (*tabulated)(const mumacro_data *data, int quantity, int block, int64_t n, const double *a,
                      const double *b, double *q);
    /* base and factor with value = base + factor q; eta = y~ - 1 counts in the corner only */
    void (*forms)(int contact, int quantity, int block, int64_t n, const double *v, const double *y,
                  const double *eta, double *base, double *factor);
    /* what node values of a piece of the border, and what its cells,
     * are multiplied by to give v~crit */
    void (*border_scales)(int piece, int64_t n, const double *y, double *of_nodes,
                          double *of_cells);
    /* the shares of a cell's largest error that its derivatives have at w, -1 to 1, and in
     * the last cell below the border */
    void (*cell_shares)(int64_t n, const double *w, double *inside, double *at_border);
    /* y~ at which rays v~/y~ = t times the steepest enter stick-slip, 0 < t <= 1 */
    void (*entries)(int64_t n, const double *t, double *entry);
    void (*normal_form_root)(int64_t n, const double *v, const double *eta, double *root);
    /* the two terms of large speed and their slopes, 5 rows of out */
    void (*outer_expansion)(int64_t n, const double *r, double *out);
    /* one step of n contacts in the time domain: limits mu0 Fz before and after it, stiffnesses,
     * motions; forces (n, springs, 2) are the state, sums (n, 2) the result */
    void (*element_steps)(int64_t n, int springs, const double *before, const double *after,
                          const double *k, const double *dx, const double *dy, double *forces,
                          double *sums);
    /* steady cycles of n periodic motions.  Units: mu0 Fz, l0 = mu0 Fz / k, tau = omega t.  counts:
     * harmonics of x, y and the normal force, whose orders follow each other; a case: drag per tau,
     * amplitude and phase of each.  A row of out: mean forces along and across, share of stick,
     * path of the foot per period, work of the shaker per period, decay of a disturbance per period
     * as a logarithm, estimate of the error of the mean force.  work: 2 room numbers for room
     * steps.  A motion tries so many steps at most, each counted as often as it has harmonics and
     * once more; then it gives up with the mean force that it has reached and its estimate, and
     * so it does as soon as stop is not 0 */
    void (*motions)(int contact, int64_t n, const int32_t *counts, const double *orders,
                    const double *cases, double tolerance, int64_t room, double *work, int64_t most,
                    const int32_t *stop, double *out);
    /* one cycle of a case, summed over springs by weight, each with its share of the limit: forces
     * (n + 1, 2) at equal times of the period */
    void (*motion_cycle)(const int32_t *counts, const double *orders, const double *one,
                         int springs, const double *shares, const double *weights, double tolerance,
                         int64_t room, double *work, int64_t most, const int32_t *stop, int64_t n,
                         double *forces);
    /* 1 - cos of the angle by which the force of a spring turns in a stick, from the stick fraction
     * and its bound, and what that leaves open; 0 for what is no point */
    void (*turns_in_stick)(int64_t n, const double *v, const double *y, const double *stick,
                           const double *bound, double *turn, double *error);
    /* forces over mu0 (places, n) of a contact that is moved along a line, for each p = k / mu0,
     * and their slopes along ln p; see loop.c */
    void (*loop_forces)(int contact, int64_t places, const double *p, int64_t n, int64_t before,
                        const double *x, const double *Fz, double start, double *room,
                        double *force, double *slope);
} mumacro_kernel;

/* Levels: 0 runs on any processor of this kind; NULL where this processor or this
 * build has none of that number. */
const mumacro_kernel *mumacro_kernel_at(int level);
#endif
