/* The evaluation of mumacro's tables: every program, in any language, computes with these files.
 *
 * C99; no memory is taken, nothing is stored between calls, any thread may call; no input and no table makes it read out
 * of bounds.  SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "library.h"
#include "lanes.h"
#include "arithmetic.c"
#include "closed_forms.c"
#include "atlas.c"
#include "border.c"
#include "charts.c"
#include "cells.c"
#include "quantities.c"
#include "records.c"
#include "points.c"
#include "passes.c"
#include "dimensional.c"
