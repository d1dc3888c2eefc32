/* What the atlas and the quantities are described by. */
#ifndef MU_RECORDS_H
#define MU_RECORDS_H
#include <stdint.h>

/* One coordinate of a chart or of a piece of the border: its name in a table file, its code
 * (mu_coordinate in atlas.c), its range. */
typedef struct {
    const char *name;
    int code;
    double low, high;
} mumacro_axis;

/* One block: what its nodes hold for mu~; what the bound of mu~ allows for
 * rounding, absolute and per factor. */
typedef struct {
    const char *name;
    int regime;
    mumacro_axis a, b;
    const char *tabulated;
    double floor, rounding;
} mumacro_chart;

/* One piece of v~crit(y~). */
typedef struct {
    const char *name;
    mumacro_axis axis;
    const char *tabulated;
} mumacro_piece;

/* Where an answer comes from, and the regime there. */
typedef struct {
    const char *name;
    int regime;
} mumacro_source;

/* One quantity: its name; its variable in a block of a table file; its meaning; whether it is
 * more than zero in continuous sliding; whether it is smooth in v~ at the border (else it has
 * a square root or a jump there). */
typedef struct {
    const char *name, *variable, *meaning;
    int while_sliding, smooth_at_border;
} mumacro_quantity;
#endif
