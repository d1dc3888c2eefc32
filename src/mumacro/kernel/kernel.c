/* The evaluation of mumacro's tables: every program, in any language, computes with these files.
 *
 * C99; no memory is taken, nothing is stored between calls, any thread may call; no input and no
 * table makes it read out of bounds.  SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined __FAST_MATH__ || (defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__) || \
    defined __ASSOCIATIVE_MATH__ || defined __RECIPROCAL_MATH__ || defined _M_FP_FAST
#error \
    "mumacro needs infinities, NaN and the order of its sums: compile without -ffast-math, " \
    "-funsafe-math-optimizations, -ffinite-math-only and /fp:fast"
#endif

#include "data.h"
#include "records.h"
#include "lanes.h"
#include "arithmetic.c"
#include "closed_forms.c"
#include "atlas.c"
#include "border.c"
#include "charts.c"
#include "ball_charts.c"
#include "places.c"
#include "cells.c"
#include "quantities.c"
#include "records.c"
#include "points.c"
#include "passes.c"
#include "directions.c"
#include "contact.c"
#include "dimensional.c"
#include "element.c"
