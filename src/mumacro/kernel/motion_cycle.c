/* A period of one spring, and its steady cycle.
 *
 * Steps end where slip and stick do, and at marks of the period, so that each step is smooth.  The
 * cycle is the fixed point of the map of a period, found by Newton's method: of a small disturbance
 * d of the force only the part along t survives where slip begins, and exp(-integral of slip speed
 * / L) of that during slip.
 *
 * The cycle is found with finer and finer steps.  The estimate of the error sums the differences of
 * the last two over all marks, which cannot cancel.
 *
 * A threshold that says *tried* is not derived.  It was tried over the motions of `errors` in
 * benchmarks/motion.py (ranges: motion_slip.c), where the columns *above 1* and *given up* show
 * what it misses: an error beyond its estimate, and an estimate beyond the tolerance. */

enum {
    MU_MOTION_PERIODS = 100,        /* of a search for a cycle; 2 to 5 are usual (tried) */
    MU_MOTION_REST_PERIODS = 500,   /* of the way from rest (tried) */
    MU_MOTION_LEVELS = 6,           /* of halved steps: 2^-6 of a step is 1e-9 of its error */
    MU_MOTION_SLIDING_PERIODS = 12, /* of a search at rest for a cycle that slips (tried) */
    MU_MOTION_RETRIES = 3,          /* with finer steps, where none are found (tried) */
    /* from rest before the cycle that slips is looked for; it decides only the time: 1, 3 and 5
     * give the same cycles (tried) */
    MU_MOTION_FIRST_PERIODS = 2,
    MU_MOTION_TRIALS = 4 /* times the room for steps: a march that tries more often fails (tried) */
};
/* Lengths of a step.  The estimate embedded in a step is of order 4, the error of a cycle of order
 * 6: a step may err by the power 2/3 of the tolerance.  Halves of it err by 2^-4 = 0.0625. */
#define MU_STEP_OF_TOLERANCE 0.1 /* what is raised to 2/3 (tried) */
#define MU_STEP_LARGEST 1e-3     /* of what is raised: a step follows an angle to 1 % then */
#define MU_STEP_HALVED 0.06
/* The rule of step control: the fourth root of tolerance over error, a little less, within bounds
 * (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.8). */
#define MU_STEP_SAFETY 0.85  /* a little less: theirs is 0.9 or less */
#define MU_STEP_SHORTEST 0.2 /* of the step before: theirs */
#define MU_STEP_LONGEST 2.0  /* theirs is 8: events would be passed (tried) */
/* at most, of a step that erred too much: shorter, or it would repeat */
#define MU_STEP_REPEATED 0.9
#define MU_STEP_FAILED 0.25    /* of a step without stages (tried) */
#define MU_STEP_OF_ERROR_0 4.0 /* of a step without an error: any number above the longest */
/* of the fourth root of the tolerance, the first step: the order of its estimate (tried) */
#define MU_STEP_FIRST 0.1
#define MU_STEP_LAST 0.5   /* of the rest: a longer step that does not reach its end takes half */
#define MU_STEP_NONE 1e-15 /* below, rounding of tau: the march fails */
/* of the limit: the way of the force in a part of a stick, so that it passes the limit and comes
 * back once at most (tried) */
#define MU_STICK_WAY 0.5
/* of the limit: a force that begins so near to it begins on it (tried) */
#define MU_ON_LIMIT 1e-12
/* of tau; a shorter stick or slip makes no other kind of cycle (tried) */
#define MU_MOTION_BRIEF 1e-3
#define MU_MOTION_SHORT 1e-10 /* of tau; a shorter stick or step is rounding (tried) */
#define MU_MOTION_UNKNOWN 2.0 /* of the limit: no two forces are further from each other */
/* What the estimate has beside the differences of two levels.  A part of the tolerance, within
 * bounds, for sticks too short to be found (tried): */
#define MU_MOTION_ROUNDING_OF_TOLERANCE 0.05
#define MU_MOTION_ROUNDING 2e-10 /* of the mean force, at least */
#define MU_MOTION_MOST_ROUNDING 5e-9
#define MU_MOTION_OF_DISTANCE 3.0 /* in distances to the cycle (tried) */
/* times the differences of the last two levels; larger at rest, where the errors of the whole way
 * stay, and for slow drags (tried) */
#define MU_MOTION_OF_DIFFERENCE 2.0
#define MU_MOTION_OF_DIFFERENCE_AT_REST 6.0
/* Of the tolerance, the distance to the cycle at which a search ends: with MU_MOTION_OF_DISTANCE it
 * leaves the most of the estimate to the differences.  At rest less, and never more than of 1e-5,
 * as the errors of the whole way stay (tried). */
#define MU_MOTION_GOAL 0.1
#define MU_MOTION_GOAL_AT_REST 0.01
#define MU_MOTION_GOAL_LARGEST 1e-5
/* of the estimate before: at rest, finer steps help below it (tried) */
#define MU_MOTION_HELPS 0.5
#define MU_MOTION_NO_PATH 1e-13 /* a path of slip that is rounding: some hundred of a force */
/* a way to the cycle, in moves of a period that are rounding (tried) */
#define MU_MOTION_OF_ROUNDING 1e4
/* 1 less the share of a disturbance that is left, at least: rounding */
#define MU_MOTION_STAYS 1e-16
/* The way from rest.  A leap that is taken back is halved, the next ones grow again (tried). */
#define MU_MOTION_LEAP 0.9 /* of what is left of the way to a cycle, at most */
#define MU_MOTION_LEAST_LEAP 0.1
#define MU_MOTION_LEAP_CUT 0.5
#define MU_MOTION_LEAP_GROWTH 1.5
/* moves of a period: those that have shown that it can be trusted */
#define MU_MOTION_LEAP_WORTH 2.0
/* of what a later period moves: by so much a leap changes the end */
#define MU_MOTION_AFTER_LEAP 0.5
#define MU_MOTION_LEAST_MOVE 1e-12 /* of a period before a leap: 100 roundings */
/* of a way of the force, by which Newton's step after it may be off: it shortens by a third of the
 * way where the force moves by the cube of what is left */
#define MU_MOTION_OFF 0.85
#define MU_MOTION_SLIDES 1e3 /* goals: a cycle with a longer path slips (tried) */
/* The search for a cycle beside a drag.  A step too long is cut to a tenth at least, cut once more
 * to a hundredth of that, and so on; the steps after it grow by 4 at most.  Where no cycle is
 * found, those of faster drags lead to it, from 1e-3 l0 per radian by tenths.  Found by search:
 * 1 of 11,000 random springs with drags from 1e-9 to 1e-3 is left short of the tolerance, see `slow
 * drag` in benchmarks/motion.py. */
/* l0 per radian; below, a slip that larger steps miss moves the cycle */
#define MU_MOTION_SLOW 1e-6
#define MU_MOTION_OF_SLOW 1e-6         /* the tolerance there at most */
#define MU_MOTION_ROUNDING_OF_SLOW 0.1 /* of that tolerance: 3 of 6,000 springs need 0.05 */
/* of the move before: a step after which the force moves back further */
#define MU_MOTION_BACK 0.5
#define MU_MOTION_CUT 0.1
#define MU_MOTION_LONGEST_CUT 0.7
#define MU_MOTION_LEAST_SHARE 1e-9
#define MU_MOTION_GROWTH 4.0
#define MU_MOTION_FASTER 1e-3
#define MU_MOTION_SLOWER 0.1
#define MU_MOTION_NEAR 2.0 /* drags: a cycle of this one leads to that of the drag itself */
enum { MU_MEAN_X, MU_MEAN_Y, MU_MEAN_STUCK, MU_MEAN_PATH, MU_MEAN_WORK, MU_MEANS };

/* Times at which steps end at the latest, up to 2 pi, and room for more of them.  Of the steps that
 * are taken: how many more a motion may try, each of which counts as often as it has harmonics and
 * once more, and where another thread asks it to stop. */
typedef struct {
    double *nodes;
    int64_t n, room, left;
    const volatile int32_t *stop;
} mu_grid;

/* Where a period is, and what it has summed so far. */
typedef struct {
    mu_moment at;
    double f[2];
    int slips;
    /* what the next slip may take; beginning of the last stick; slip since a stick was counted */
    double step, began, slid;
    double mean[MU_MEANS], marked[2 * MU_MARKS];
    /* of a small disturbance: the direction that survives first, the last one, what is left as a
     * logarithm, as a factor; the limit where that direction is the last */
    double first[2], last[2], decay, turned, last_limit;
    int slipped, failed, sticks, phases; /* the last: how often slip begins */
    mu_grid *steps;                      /* ends of all its steps */
} mu_march;

/* A steady cycle: means per period; decay of a disturbance per period as its
 * logarithm; distance to the cycle; the estimate of the error of the mean force; how
 * many sticks it has, but for brief ones.  From which force, with which first step, the period
 * starts on the way from rest that slips more. */
typedef struct {
    double mean[MU_MEANS], marked[2 * MU_MARKS], decay, distance, error, from[2], step;
    int sticks, level, failed, slips_before;
} mu_steady;

/* One cycle at equal times, to be drawn: each spring adds its forces with a weight. */
typedef struct {
    double *forces, weight;
    int64_t n, next;
} mu_drawing;

/* --- a period --------------------------------------------------------------------------------- */

/* Adds a force, which has done a work beside the drag. */
static void mu_add(mu_march *march, const mu_shaken *m, double middle, double time, double fx,
                   double fy, double work) {
    const int place = 2 * (int)(middle * (0.5 / MU_PI) * m->marks);
    march->mean[MU_MEAN_X] += time * fx;
    march->mean[MU_MEAN_Y] += time * fy;
    march->mean[MU_MEAN_WORK] += work;
    march->marked[place] += time * fx;
    march->marked[place + 1] += time * fy;
}

/* The forces at the times to be drawn before tau. */
static int mu_is_drawn(const mu_drawing *drawing, double tau, double *time) {
    if (!drawing || drawing->next > drawing->n) return 0;
    *time = drawing->next < drawing->n ? 2.0 * MU_PI * (double)drawing->next / (double)drawing->n
                                       : 2.0 * MU_PI;
    return *time <= tau;
}

static void mu_draw(mu_drawing *drawing, double fx, double fy) {
    drawing->forces[2 * drawing->next] += drawing->weight * fx;
    drawing->forces[2 * drawing->next + 1] += drawing->weight * fy;
    ++drawing->next;
}

/* Slip begins with the force as it is: of a disturbance the part along t is left. */
static void mu_begin_slip(mu_march *march) {
    const double size = mu_length(march->f[0], march->f[1]);
    const double tx = -march->f[1] / size, ty = march->f[0] / size;
    if (march->slipped) {
        march->turned *= march->last[0] * tx + march->last[1] * ty;
    } else {
        march->first[0] = tx;
        march->first[1] = ty;
    }
    march->last[0] = tx;
    march->last[1] = ty;
    march->last_limit = size;
    march->slipped = march->slips = 1;
    ++march->phases;
}

static void mu_take_slip(mu_march *march, const mu_shaken *m, double tolerance, double end,
                         int *ends, mu_drawing *drawing) {
    static const double *weight = MU_RADAU[2];
    const mu_moment start = march->at;
    const double size = mu_length(march->f[0], march->f[1]), ex = march->f[0] / size;
    const double ey = march->f[1] / size;
    const double rest = end - start.tau;
    const double length = march->step >= rest                 ? rest
                          : march->step > MU_STEP_LAST * rest ? MU_STEP_LAST * rest
                                                              : march->step;
    double factor, nx, ny, time;
    mu_bracket fall;
    mu_slip slip;
    if (!mu_slip_step(m, &start, ex, ey, length, length == rest ? end : start.tau + length,
                      &slip)) {
        march->step = MU_STEP_FAILED * length;
        return;
    }
    factor =
        slip.error > 0.0 ? MU_STEP_SAFETY * sqrt(sqrt(tolerance / slip.error)) : MU_STEP_OF_ERROR_0;
    factor = mu_max(MU_STEP_SHORTEST, mu_min(factor, MU_STEP_LONGEST));
    if (slip.error > tolerance) {
        march->step = length * mu_min(factor, MU_STEP_REPEATED);
        return;
    }
    march->step = length < march->step ? mu_max(march->step, factor * length) : factor * length;
    if (*ends && mu_slip_falls(m, &start, &slip, &fall)) {
        const double shorter = length * mu_slip_end(m, &start, &slip, &fall);
        if (start.tau + shorter > start.tau &&
            !mu_slip_step(m, &start, ex, ey, shorter, start.tau + shorter, &slip)) {
            /* the step has passed a turn that its stages do not see */
            march->step = MU_STEP_FAILED * length;
            return;
        }
        march->slips = 0;
        march->began = start.tau + shorter;
        if (!(start.tau + shorter > start.tau)) return;
    }
    *ends = 1;
    for (int i = 0; i < 3; ++i) {
        const double share = slip.length * weight[i], limit = slip.stage[i].limit;
        mu_direction(&slip, slip.u[i], &nx, &ny);
        mu_add(
            march, m, start.tau + 0.5 * slip.length, share, limit * nx, limit * ny,
            share * limit * (nx * (slip.stage[i].wx - m->scale * m->drag) + ny * slip.stage[i].wy));
        march->mean[MU_MEAN_PATH] += share * slip.speed[i];
        march->decay += share * slip.speed[i] / limit;
    }
    while (mu_is_drawn(drawing, slip.stage[2].tau, &time)) {
        const mu_moment at = mu_moment_at(m, time);
        mu_direction(&slip, mu_slip_at(&slip, (time - start.tau) / slip.length), &nx, &ny);
        mu_draw(drawing, at.limit * nx, at.limit * ny);
    }
    mu_direction(&slip, slip.u[2], &nx, &ny);
    march->slid += slip.length;
    march->at = slip.stage[2];
    march->f[0] = march->at.limit * nx;
    march->f[1] = march->at.limit * ny;
    march->last[0] = -ny;
    march->last[1] = nx;
    march->last_limit = march->at.limit;
}

static void mu_take_stick(mu_march *march, const mu_shaken *m, double end, int *fresh, int *ends,
                          mu_drawing *drawing) {
    mu_stick stick = {m, march->at, {march->f[0], march->f[1]}, end - march->at.tau};
    const double speed = mu_length(stick.start.wx, stick.start.wy),
                 way = MU_STICK_WAY * stick.start.limit;
    const double slowest = speed + sqrt(speed * speed + 2.0 * m->acceleration * way);
    double share, time, at_last[2];
    mu_moment last;
    int whole = 1, brief;
    if (slowest * stick.length > 2.0 * way) {
        whole = 0;
        stick.length = 2.0 * way / slowest;
    }
    /* a part that is short because the motion is fast may end in itself; what is left of a step may
     * not */
    brief = whole && stick.length < MU_MOTION_SHORT;
    if (*fresh && brief) {
        share = 1.0;
        last = mu_stuck_at(&stick, 1.0, at_last);
    } else {
        share = mu_stick_end(&stick, *fresh, &last, at_last);
    }
    if (share > 0.0) {
        const double taken = share * stick.length, drag = m->scale * m->drag;
        double dx, dy, fx, fy, size, way[2];
        time = stick.start.tau + taken;
        march->at = share < 1.0 ? mu_moment_at(m, time) : last;
        if (whole && share == 1.0) march->at.tau = end;
        dx = march->at.x - stick.start.x;
        dy = march->at.y - stick.start.y;
        fx = stick.f[0] + dx;
        fy = stick.f[1] + dy;
        mu_mean_way(m, stick.start.tau, taken, way);
        way[0] -= stick.start.x;
        way[1] -= stick.start.y;
        /* the integral of f (w - drag), exactly */
        mu_add(march, m, stick.start.tau + 0.5 * taken, taken, stick.f[0] + way[0],
               stick.f[1] + way[1],
               stick.f[0] * (dx - drag * taken) + stick.f[1] * dy + 0.5 * (dx * dx + dy * dy) -
                   drag * way[0] * taken);
        march->mean[MU_MEAN_STUCK] += taken;
        size = mu_length(fx, fy);
        if (share < 1.0 && size > 0.0) {
            fx *= march->at.limit / size;
            fy *= march->at.limit / size;
        }
        while (mu_is_drawn(drawing, march->at.tau, &time)) {
            const mu_moment at = mu_moment_at(m, time);
            mu_draw(drawing, stick.f[0] + (at.x - stick.start.x),
                    stick.f[1] + (at.y - stick.start.y));
        }
        march->f[0] = fx;
        march->f[1] = fy;
    }
    *fresh = *fresh && share == 1.0 && brief;
    if (share < 1.0) {
        /* slip that rounding ends goes on for a step */
        *ends = march->at.tau - march->began > MU_MOTION_SHORT;
        if (march->at.tau - march->began > MU_MOTION_BRIEF && march->slid > MU_MOTION_BRIEF) {
            ++march->sticks;
            march->slid = 0.0;
        }
        mu_begin_slip(march);
    }
}

/* One period from the force f, with this tolerance of a step; the ends
 * of the steps go to march->steps. */
static void mu_take_period(const mu_shaken *m, const mu_grid *grid, const double *f,
                           double tolerance, mu_march *march, mu_drawing *drawing) {
    static const mu_march none;
    const double step = march->step;
    mu_grid *steps = march->steps;
    const int64_t cost =
        1 + (m->highest ? m->highest : m->counts[0] + m->counts[1] + m->counts[2]);
    int64_t count = 0;
    int fresh, ends = 1;
    *march = none;
    march->step = step > 0.0 ? step : MU_STEP_FIRST * sqrt(sqrt(tolerance));
    march->turned = 1.0;
    /* the stick and the slip before the period are no brief ones */
    march->began = -1.0;
    march->slid = 1.0;
    march->steps = steps;
    steps->n = 0;
    march->at = mu_moment_at(m, 0.0);
    march->f[0] = f[0];
    march->f[1] = f[1];
    fresh = mu_length(f[0], f[1]) >= march->at.limit * (1.0 - MU_ON_LIMIT);
    if (fresh &&
        f[0] * march->at.wx + f[1] * march->at.wy - march->at.limit * march->at.slope > 0.0)
        mu_begin_slip(march);
    for (int64_t i = 0; i < grid->n; ++i) {
        const double end = grid->nodes[i];
        if (end - march->at.tau < MU_MOTION_SHORT && i + 1 < grid->n) continue;
        while (march->at.tau < end && !march->failed) {
            const double before = march->at.tau;
            if (march->slips) {
                mu_take_slip(march, m, tolerance, end, &ends, drawing);
                fresh = 1;
            } else {
                mu_take_stick(march, m, end, &fresh, &ends, drawing);
            }
            if (march->at.tau > before && steps->n < steps->room)
                steps->nodes[steps->n++] = march->at.tau;
            if (steps->n == steps->room || ++count > MU_MOTION_TRIALS * steps->room ||
                (steps->left -= cost) < 0 || *steps->stop || !(march->step > MU_STEP_NONE))
                march->failed = 1;
        }
    }
    for (int i = 0; i < MU_MEANS; ++i)
        if (i != MU_MEAN_PATH && i != MU_MEAN_WORK) march->mean[i] /= 2.0 * MU_PI;
    for (int i = 0; i < 2 * m->marks; ++i) march->marked[i] /= 2.0 * MU_PI;
}

/* --- the steady cycle ------------------------------------------------------------------------- */

static void mu_keep_below(double limit, double *f) {
    const double size = mu_length(f[0], f[1]);
    if (size > limit) {
        f[0] *= limit / size;
        f[1] *= limit / size;
    }
}

/* A period as a map of the force at its start: how far it moves it, and by
 * how much Newton's method would. */
typedef struct {
    double moved[2], step[2], size;
} mu_residual;

static mu_residual mu_residual_of(const mu_march *march, const double *f, double limit) {
    mu_residual r = {{march->f[0] - f[0], march->f[1] - f[1]}, {0.0, 0.0}, 0.0};
    r.size = mu_length(r.moved[0], r.moved[1]);
    if (march->slipped) { /* the derivative of the map is left last first^T */
        const double left = march->turned * mu_decay(march->decay), *first = march->first,
                     *last = march->last;
        const double stays =
            mu_max(1.0 - left * (first[0] * last[0] + first[1] * last[1]), MU_MOTION_STAYS);
        const double along = left * (first[0] * r.moved[0] + first[1] * r.moved[1]) / stays;
        r.step[0] = r.moved[0] + along * last[0];
        r.step[1] = r.moved[1] + along * last[1];
    } else if (r.size > 0.0) { /* it is only stretched: up to the limit */
        const double a = r.size * r.size, b = f[0] * r.moved[0] + f[1] * r.moved[1];
        const double c = mu_min(f[0] * f[0] + f[1] * f[1] - limit * limit, 0.0);
        const double times = mu_max((sqrt(mu_max(b * b - a * c, 0.0)) - b) / a, 1.0);
        r.step[0] = times * r.moved[0];
        r.step[1] = times * r.moved[1];
    }
    return r;
}

static mu_steady mu_steady_of(const mu_march *march, double distance) {
    mu_steady out = {{0.0}, {0.0},         0.0, distance,      0.0, {0.0, 0.0},
                     0.0,   march->sticks, 0,   march->failed, 0};
    memcpy(out.mean, march->mean, sizeof out.mean);
    memcpy(out.marked, march->marked, sizeof out.marked);
    if (march->slipped) { /* over the end of the period, too, it turns from last to first */
        const double turned =
            march->turned * (march->first[0] * march->last[0] + march->first[1] * march->last[1]);
        out.decay = turned != 0.0 ? march->decay - mu_log1(mu_min(fabs(turned), 1.0)) : HUGE_VAL;
    }
    return out;
}

/* A step of Newton's method that may be cut: it starts from a force, takes a share of the way, and
 * is no longer than reach. */
typedef struct {
    double from[2], share, least, reach;
    mu_residual at;
} mu_newton;

/* No two forces move apart, so that a step is too long where the force then moves back against it,
 * by more than half of what it moved before.  Then the step is cut by the rule of the secant.  The
 * map of a slow drag is made of pieces: beyond a kink it moves the force by a million times as
 * much, the secant alone would stand still, and the steps after a cut have to grow again. */
static int mu_cut_step(mu_newton *step, const mu_residual *r) {
    const double *way = step->at.step, *moved = step->at.moved;
    const double now = way[0] * r->moved[0] + way[1] * r->moved[1];
    const double before = way[0] * moved[0] + way[1] * moved[1];
    if (!(now < 0.0 && r->size > MU_MOTION_BACK * step->at.size &&
          step->share > MU_MOTION_LEAST_SHARE))
        return 0;
    step->share *= mu_max(step->least, mu_min(before / (before - now), MU_MOTION_LONGEST_CUT));
    step->least *= MU_MOTION_CUT;
    step->reach = 0.0;
    return 1;
}

static void mu_next_step(mu_newton *step, const mu_residual *r, const double *f) {
    const double size = mu_length(r->step[0], r->step[1]);
    if (step->reach < HUGE_VAL)
        step->reach =
            MU_MOTION_GROWTH * step->share * mu_length(step->at.step[0], step->at.step[1]);
    step->share = size > step->reach ? step->reach / size : 1.0;
    if (size <= step->reach) step->reach = HUGE_VAL;
    step->least = MU_MOTION_CUT;
    step->at = *r;
    step->from[0] = f[0];
    step->from[1] = f[1];
}

/* The cycle whose distance to the steady one is below goal, or the nearest of so many periods; f is
 * its start.  A path of slip below the least ends the search. */
static mu_steady mu_find_cycle(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                               double tolerance, double goal, int periods, double least,
                               double *f) {
    const double limit = mu_moment_at(m, 0.0).limit;
    mu_newton step = {
        {f[0], f[1]}, 1.0, MU_MOTION_CUT, HUGE_VAL, {{0.0, 0.0}, {0.0, 0.0}, HUGE_VAL}};
    mu_march march;
    march.step = 0.0;
    march.steps = steps;
    for (int period = 1;; ++period) {
        mu_residual r;
        double distance;
        mu_take_period(m, grid, f, tolerance, &march, NULL);
        r = mu_residual_of(&march, f, limit);
        distance = march.failed ? HUGE_VAL : mu_max(r.size, mu_length(r.step[0], r.step[1]));
        if (!march.slipped) distance = m->drag > 0.0 ? HUGE_VAL : 0.0;
        distance = mu_min(distance, MU_MOTION_UNKNOWN * limit);
        if (distance <= goal || period == periods || march.failed ||
            march.mean[MU_MEAN_PATH] < least)
            return mu_steady_of(&march, distance);
        if (!mu_cut_step(&step, &r)) mu_next_step(&step, &r, f);
        f[0] = step.from[0] + step.share * step.at.step[0];
        f[1] = step.from[1] + step.share * step.at.step[1];
        mu_keep_below(limit, f);
    }
}

/* The cycle near f of a contact that is dragged; where none is found, from the cycles of faster
 * drags. */
static mu_steady mu_find_dragged(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                                 double tolerance, double goal, double *f) {
    mu_shaken faster = *m;
    const double start[2] = {f[0], f[1]};
    const mu_steady out = mu_find_cycle(m, grid, steps, tolerance, goal, MU_MOTION_PERIODS, 0.0, f);
    faster.drag = MU_MOTION_FASTER / m->scale;
    if (out.distance <= goal || out.failed || faster.drag <= m->drag) return out;
    f[0] = start[0];
    f[1] = start[1];
    for (; faster.drag > MU_MOTION_NEAR * m->drag; faster.drag *= MU_MOTION_SLOWER)
        (void)mu_find_cycle(&faster, grid, steps, tolerance, goal, MU_MOTION_PERIODS, 0.0, f);
    return mu_find_cycle(m, grid, steps, tolerance, goal, MU_MOTION_PERIODS, 0.0, f);
}

/* How far a contact at rest is from a cycle that sticks, after a period from f. */
static double mu_distance_at_rest(const mu_march *march, const mu_residual *r) {
    const double step = mu_length(r->step[0], r->step[1]);
    if (march->failed) return MU_MOTION_UNKNOWN;
    if (march->mean[MU_MEAN_PATH] < MU_MOTION_NO_PATH) return 0.0;
    if (r->size < MU_MOTION_NO_PATH) return MU_MOTION_OF_ROUNDING * r->size;
    return mu_min(MU_MOTION_OF_DISTANCE * mu_max(r->size, step), MU_MOTION_UNKNOWN);
}

/* The cycle that slips near a force of a contact at rest, which is the only one, and its start f;
 * returns 0 where none is found, and leaves f. */
static int mu_find_sliding(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                           double tolerance, double goal, const double *near, double *f,
                           mu_steady *cycle) {
    const double least = MU_MOTION_SLIDES * goal;
    double start[2] = {near[0], near[1]};
    *cycle =
        mu_find_cycle(m, grid, steps, tolerance, goal, MU_MOTION_SLIDING_PERIODS, least, start);
    if (!cycle->failed && !(cycle->distance <= goal && cycle->mean[MU_MEAN_PATH] > least)) return 0;
    f[0] = start[0];
    f[1] = start[1];
    return 1;
}

/* The period of the way from rest that slips most, which has to be halved: the last one hardly
 * slips, and halves of its steps may be those that the periods before have taken already. */
typedef struct {
    double path, step, from[2];
} mu_longest_slip;

static void mu_keep_longest(mu_longest_slip *longest, const mu_march *march, double step,
                            const double *f) {
    if (!(march->mean[MU_MEAN_PATH] > longest->path)) return;
    longest->path = march->mean[MU_MEAN_PATH];
    longest->step = step;
    longest->from[0] = f[0];
    longest->from[1] = f[1];
}

/* Leaps along the way from rest.
 *
 * A period maps all forces around onto one line, as its derivative has rank one.  So a leap comes
 * back to the line of the way itself, and changes its end by no more than half of what any later
 * period moves the force.  Two periods one after another show that Newton's step can be trusted: it
 * has to shorten by what the first has moved.  A leap stays short of the end of the way: where the
 * contact does not slip after it as before, it is taken back. */
typedef struct {
    int allowed;
    double share;               /* of Newton's step, the next leap */
    int wait, waited;           /* periods in which Newton's step has to be as expected before it */
    int leapt, has_leapt;       /* whether the last period began with a leap, any did */
    double expected[2], length; /* Newton's step after the next period; the way there */
    double back[2];             /* the force to which a leap is taken back */
    double moved;               /* by the last period */
    int phases;                 /* of its slip */
} mu_leaps;

/* Whether a period slips as the one before, and leaves Newton's step as it was expected. */
static int mu_is_alike(const mu_leaps *leaps, const mu_march *march, const mu_residual *r) {
    return march->phases == leaps->phases &&
           mu_length(r->step[0] - leaps->expected[0], r->step[1] - leaps->expected[1]) <=
               MU_MOTION_OFF * leaps->length;
}

static void mu_take_back(mu_leaps *leaps, double *f) {
    f[0] = leaps->back[0];
    f[1] = leaps->back[1];
    leaps->share = mu_max(MU_MOTION_LEAP_CUT * leaps->share, MU_MOTION_LEAST_LEAP);
    leaps->wait *= 2;
    leaps->leapt = leaps->waited = leaps->phases = 0;
}

static void mu_trust_leaps(mu_leaps *leaps) {
    leaps->share = mu_min(MU_MOTION_LEAP_GROWTH * leaps->share, MU_MOTION_LEAP);
    leaps->wait = leaps->wait > 1 ? leaps->wait / 2 : 1;
}

/* Whether the next period begins with a leap, which has to be worth more than two periods. */
static int mu_is_leap_due(mu_leaps *leaps, const mu_march *march, const mu_residual *r, int alike) {
    leaps->waited = leaps->leapt ? 0 : alike ? leaps->waited + 1 : 0;
    leaps->length = leaps->share * mu_length(r->step[0], r->step[1]);
    leaps->moved = r->size;
    leaps->phases = march->phases;
    leaps->back[0] = march->f[0];
    leaps->back[1] = march->f[1];
    return leaps->allowed && leaps->waited >= leaps->wait && leaps->phases > 1 &&
           leaps->moved > MU_MOTION_LEAST_MOVE &&
           leaps->length > MU_MOTION_LEAP_WORTH * leaps->moved;
}

/* Along the circle of the forces on which the last slip ends. */
static void mu_leap(mu_leaps *leaps, const mu_march *march, const mu_residual *r, double *f) {
    const double share = leaps->share, *last = march->last;
    const double along = share * (r->step[0] * last[0] + r->step[1] * last[1]);
    const double inwards = 0.5 * along * along / march->last_limit;
    f[0] += share * r->step[0] - inwards * last[1];
    f[1] += share * r->step[1] + inwards * last[0];
    mu_keep_below(march->at.limit, f);
    leaps->has_leapt = 1;
    leaps->expected[0] = (1.0 - share) * r->step[0];
    leaps->expected[1] = (1.0 - share) * r->step[1];
}

static void mu_next_period(mu_leaps *leaps, const mu_march *march, const mu_residual *r,
                           double *f) {
    f[0] = march->f[0];
    f[1] = march->f[1];
    leaps->expected[0] = r->step[0] - r->moved[0];
    leaps->expected[1] = r->step[1] - r->moved[1];
    leaps->length = leaps->moved;
}

/* Whether the last period shows that the leap before it went too far. */
static int mu_is_leap_lost(const mu_leaps *leaps, const mu_march *march, int alike, double goal) {
    return leaps->leapt && !alike && leaps->length > goal && !march->failed;
}

/* As mu_distance_at_rest, and what the leaps may have changed. */
static double mu_distance_after_leaps(const mu_leaps *leaps, const mu_march *march,
                                      const mu_residual *r) {
    const double distance = mu_distance_at_rest(march, r);
    if (!leaps->has_leapt) return distance;
    return distance + MU_MOTION_AFTER_LEAP * (distance == 0.0 ? leaps->moved : r->size);
}

static int mu_is_end_of_way(const mu_march *march, double distance, double goal, int period) {
    return distance <= goal || march->mean[MU_MEAN_PATH] < MU_MOTION_NO_PATH ||
           period >= MU_MOTION_REST_PERIODS || march->failed;
}

/* The end of the way from rest, as a cycle. */
static mu_steady mu_end_of_way(const mu_march *march, double distance,
                               const mu_longest_slip *longest) {
    mu_steady out = mu_steady_of(march, mu_min(distance, MU_MOTION_UNKNOWN));
    out.from[0] = longest->from[0];
    out.from[1] = longest->from[1];
    out.step = longest->step;
    out.slips_before = march->mean[MU_MEAN_PATH] < longest->path;
    return out;
}

/* The cycle that a contact without force comes to from rest, period by period, where allowed with
 * leaps along Newton's step.  One that slips is the only one, and is looked for after the first
 * periods; of those that stick there are many, and only the way decides between them. */
static mu_steady mu_follow_from_rest(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                                     double tolerance, double goal, int leaps_allowed, double *f) {
    mu_longest_slip longest = {0.0, 0.0, {0.0, 0.0}};
    mu_leaps leaps = {leaps_allowed, MU_MOTION_LEAP, 1,   0, 0, 0, {0.0, 0.0},
                      0.0,           {0.0, 0.0},     0.0, 0};
    mu_march march;
    mu_steady sliding;
    f[0] = f[1] = 0.0;
    march.step = 0.0;
    march.steps = steps;
    for (int period = 1;; ++period) {
        const double step = march.step;
        double distance;
        int alike;
        mu_residual r;
        mu_take_period(m, grid, f, tolerance, &march, NULL);
        r = mu_residual_of(&march, f, march.at.limit);
        mu_keep_longest(&longest, &march, step, f);
        alike = mu_is_alike(&leaps, &march, &r);
        if (mu_is_leap_lost(&leaps, &march, alike, goal)) {
            mu_take_back(&leaps, f);
            continue;
        }
        if (leaps.leapt) mu_trust_leaps(&leaps);
        distance = mu_distance_after_leaps(&leaps, &march, &r);
        if (mu_is_end_of_way(&march, distance, goal, period))
            return mu_end_of_way(&march, distance, &longest);
        if (period == MU_MOTION_FIRST_PERIODS && leaps.allowed &&
            mu_find_sliding(m, grid, steps, tolerance, goal, march.f, f, &sliding))
            return sliding;
        leaps.leapt = mu_is_leap_due(&leaps, &march, &r, alike);
        if (leaps.leapt) {
            mu_leap(&leaps, &march, &r, f);
        } else {
            mu_next_period(&leaps, &march, &r, f);
        }
    }
}

/* The steady cycle near f; at rest the one that a contact without force comes to, which may be near
 * f only if it slips. */
static mu_steady mu_cycle_near(const mu_shaken *m, const mu_grid *grid, mu_grid *steps,
                               double tolerance, double goal, int near, double *f) {
    mu_steady out;
    if (m->drag > 0.0) return mu_find_dragged(m, grid, steps, tolerance, goal, f);
    if (near && mu_find_sliding(m, grid, steps, tolerance, goal, f, f, &out)) return out;
    out = mu_follow_from_rest(m, grid, steps, tolerance, goal, 1, f);
    if (out.failed || out.distance <= goal || out.mean[MU_MEAN_PATH] > MU_MOTION_NO_PATH)
        return out;
    return mu_follow_from_rest(m, grid, steps, tolerance, goal, 0, f);
}

static double mu_difference(const mu_steady *a, const mu_steady *b, int marks) {
    double sum = 0.0;
    for (int i = 0; i < 2 * marks; i += 2)
        sum += mu_length(a->marked[i] - b->marked[i], a->marked[i + 1] - b->marked[i + 1]);
    return sum;
}

/* Each step in two halves. */
static int mu_halve(const mu_grid *steps, mu_grid *grid) {
    double from = 0.0;
    if (2 * steps->n > grid->room) return 0;
    for (int64_t i = 0; i < steps->n; ++i) {
        const double to = steps->nodes[i];
        grid->nodes[2 * i] = 0.5 * (from + to);
        grid->nodes[2 * i + 1] = to;
        from = to;
    }
    grid->n = 2 * steps->n;
    return 1;
}

/* The steady cycle of a spring: steps are halved until the estimate is below the
 * tolerance, or this many times. */
static mu_steady mu_spring_motion(const mu_shaken *m, double tolerance, int levels, mu_grid *grid,
                                  mu_grid *steps, double *f) {
    const double limit = mu_moment_at(m, 0.0).limit;
    const int slow = m->drag > 0.0 && m->drag * m->scale < MU_MOTION_SLOW;
    const double followed = slow ? mu_min(tolerance, MU_MOTION_OF_SLOW) : tolerance;
    double of_step = mu_cube_root_near(mu_min(MU_STEP_OF_TOLERANCE * followed, MU_STEP_LARGEST));
    const double rounding =
        slow ? MU_MOTION_ROUNDING_OF_SLOW * followed
             : mu_max(MU_MOTION_ROUNDING,
                      mu_min(MU_MOTION_ROUNDING_OF_TOLERANCE * tolerance, MU_MOTION_MOST_ROUNDING));
    const double goal = m->drag > 0.0
                            ? MU_MOTION_GOAL * followed
                            : MU_MOTION_GOAL_AT_REST * mu_min(tolerance, MU_MOTION_GOAL_LARGEST);
    const double of_difference =
        m->drag > 0.0 && !slow ? MU_MOTION_OF_DIFFERENCE : MU_MOTION_OF_DIFFERENCE_AT_REST;
    int near = f[0] != 0.0 || f[1] != 0.0;
    mu_steady last, out;
    of_step *= of_step;
    grid->n = mu_min(m->nodes, (double)grid->room);
    for (int i = 0; i < grid->n; ++i)
        grid->nodes[i] = 2.0 * MU_PI * (double)(i + 1) / (double)grid->n;
    for (int level = 0;; ++level) { /* at rest, the errors of the whole way to the cycle stay */
        mu_keep_below(limit, f);
        out = mu_cycle_near(m, grid, steps, of_step, goal, near, f);
        /* steps too large to be followed */
        for (int i = 0;
             level == 0 && i < MU_MOTION_RETRIES && out.distance >= MU_MOTION_UNKNOWN * limit;
             ++i) {
            near = 0;
            f[0] = m->drag > 0.0 ? limit : 0.0;
            f[1] = 0.0;
            of_step *= MU_STEP_HALVED;
            out = mu_cycle_near(m, grid, steps, of_step, goal, near, f);
        }
        if (level > 0 && steps->left < 0) return last; /* what was reached */
        out.level = level;
        out.error = MU_MOTION_UNKNOWN * limit;
        if (level == 0 && out.failed) return out; /* its steps are those of a part of a period */
        if (level > 0)
            out.error = of_difference * mu_difference(&out, &last, m->marks) +
                        MU_MOTION_OF_DISTANCE * out.distance + rounding;
        /* finer steps bring no cycle nearer, and of a contact at rest not always the same */
        if (out.error <= tolerance || level == levels) return out;
        if (level > 0 && (out.distance > tolerance || (m->drag == 0.0 && level > 1 &&
                                                       out.error > MU_MOTION_HELPS * last.error)))
            return out;
        if (out.slips_before) { /* the steps of the last period are too few */
            mu_march march;
            march.step = out.step;
            march.steps = steps;
            mu_take_period(m, grid, out.from, of_step, &march, NULL);
        }
        if (!mu_halve(steps, grid)) return out;
        near = out.mean[MU_MEAN_PATH] > MU_MOTION_SLIDES * goal;
        last = out;
        of_step *= MU_STEP_HALVED;
    }
}
