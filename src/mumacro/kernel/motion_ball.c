/* A ball is many independent springs (see element.c), and its steady cycle their sum: an adaptive
 * rule of quadrature over them.  At the end the functions of library.h, for springs and balls.
 *
 * A threshold that says *tried* is not derived.  It was tried over the balls of `errors` in
 * benchmarks/motion.py, beside tolerances a hundred times finer (ranges: motion_slip.c). */

enum {
    MU_MOTION_KNOWN = 256, /* cycles that are kept to start others from (tried) */
    MU_MOTION_PANELS = 48, /* a ball with more is given up (tried) */
    MU_MOTION_SCAN = 10, /* springs at which the kind of their cycles is looked at first (tried) */
    MU_KRONROD_POINTS = 15,
    MU_KRONROD_MIDDLE = MU_KRONROD_POINTS / 2,
    /* coefficients by which roughness is judged: those of the last of the rule's polynomials */
    MU_ROUGH_TERMS = 4,
    /* points at either end of the rule: a kink between two of them is seen by few (tried) */
    MU_POINTS_AT_END = 4,
    /* of every so many springs of a panel the steps are halved, to know their errors (tried) */
    MU_HALVED_EACH = 4,
    /* levels of halved steps: while the springs before took no more, the others are computed
     * without, and take the errors of their neighbours (tried: with 0 it takes a third more) */
    MU_EASY_LEVELS = 1
};
/* of the mean limit, that of the middle spring under Hertz's pressure */
#define MU_MIDDLE_SHARE 1.5
/* of the tolerance, where only the kind of a cycle is looked for (tried) */
#define MU_MOTION_COARSE 30.0
/* roots of the tolerance: springs change by the power 3/2 of the distance to a kink, so that the
 * sum errs by the power 5/2 of what the kink is off, a tenth of the tolerance's power 5/4 */
#define MU_KINK_WIDTH 0.4
/* of a panel: a kink so near to its end is left to later divisions (tried) */
#define MU_KINK_AT_END 0.02
/* of the roughness: without and with a kink where few points of the rule see it (tried) */
#define MU_ROUGH 1.5
#define MU_ROUGH_AT_KINK 4.0
/* of the tolerance: that of the springs; the rest is that of their sum */
#define MU_OF_SPRINGS 0.5

/* The rule of Kronrod with 15 points: places and weights from the middle outwards. */
static const double MU_KRONROD[MU_KRONROD_MIDDLE + 1][2] = {
    {0.0, 0.209482141084727828012999174891714},
    {0.207784955007898467600689403773245, 0.204432940075298892414161999234649},
    {0.405845151377397166906606412076961, 0.190350578064785409913256402421014},
    {0.586087235467691130294144691693145, 0.169004726639267902826583426598550},
    {0.741531185599394439863864773280788, 0.140653259715525918745189590510238},
    {0.864864423359769072789712788640926, 0.104790010322250183839876322541518},
    {0.949107912342758524526189684047851, 0.063092092629978553290700663189204},
    {0.991455371120812639206854697526329, 0.022935322010529224963732008058970},
};

/* Place and weight of point i of 15, from -1 to 1. */
static double mu_kronrod(int i, double *weight) {
    const int from_middle = i - MU_KRONROD_MIDDLE;
    const double *point = MU_KRONROD[from_middle < 0 ? -from_middle : from_middle];
    *weight = point[1];
    return from_middle < 0 ? -point[0] : point[0];
}

/* Springs of a ball from t = low to high, which may be kinks: the error of their sum, and their
 * values at both ends by the polynomial through the points. */
typedef struct {
    double low, high, error, start[2], end[2];
    double mean[MU_MEANS], decay, of_springs;
    int kinks[2];
    double at[MU_KRONROD_POINTS];
    int sticks[MU_KRONROD_POINTS];
} mu_panel;

/* How rough two functions are at the points of the rule: the size of their four highest
 * coefficients by polynomials that are orthogonal there.  They stay large at kinks, wherever these
 * lie between the points. */
static double mu_roughness(double values[MU_KRONROD_POINTS][2], double *start, double *end) {
    double x[MU_KRONROD_POINTS], weight[MU_KRONROD_POINTS];
    double last[MU_KRONROD_POINTS] = {0.0}, p[MU_KRONROD_POINTS], size = 0.0, square = 0.0;
    /* the first of the polynomials is constant, of the norm 1 on [-1, 1] */
    double at_end = 0.5 * MU_SQRT2, before = 0.0, sign = 1.0;
    for (int i = 0; i < MU_KRONROD_POINTS; ++i) {
        x[i] = mu_kronrod(i, &weight[i]);
        p[i] = at_end;
    }
    start[0] = start[1] = end[0] = end[1] = 0.0;
    for (int degree = 0; degree < MU_KRONROD_POINTS; ++degree) {
        double next[MU_KRONROD_POINTS], sum = 0.0, c[2] = {0.0, 0.0}, beyond;
        for (int i = 0; i < MU_KRONROD_POINTS; ++i) {
            c[0] += weight[i] * p[i] * values[i][0];
            c[1] += weight[i] * p[i] * values[i][1];
        }
        for (int j = 0; j < 2; ++j) {
            start[j] += sign * at_end * c[j];
            end[j] += at_end * c[j];
        }
        if (degree >= MU_KRONROD_POINTS - MU_ROUGH_TERMS) square += c[0] * c[0] + c[1] * c[1];
        for (int i = 0; i < MU_KRONROD_POINTS; ++i) {
            next[i] = x[i] * p[i] - size * last[i];
            sum += weight[i] * next[i] * next[i];
        }
        beyond = at_end - size * before;
        size = sqrt(sum);
        before = at_end;
        at_end = beyond / size;
        sign = -sign;
        for (int i = 0; i < MU_KRONROD_POINTS; ++i) {
            last[i] = p[i];
            p[i] = next[i] / size;
        }
    }
    return sqrt(square);
}

/* The springs of a ball at t: xi = 1 - t^2, so that they lie dense at the rim, where little load
 * may behave otherwise than all the rest.  What a spring adds per t is multiplied by 2 t. */
static double mu_share_at(double t) { return MU_MIDDLE_SHARE * t * t * (2.0 - t * t); }

/* The start of the cycle of the spring at t. */
typedef struct {
    double t, f[2];
} mu_start;

/* A ball whose springs are computed one after another, with what is known of them. */
typedef struct {
    const mu_shaken *m;
    mu_grid *grid, *steps;
    int known; /* so far; of these the last are kept */
    mu_start starts[MU_MOTION_KNOWN];
} mu_ball;

/* The start of the cycle at t by the cubic through the four nearest that are known; that of the
 * nearest, where t is beyond them. */
static void mu_predict(const mu_ball *ball, double t, double *f) {
    const mu_start *near[4] = {NULL, NULL, NULL, NULL};
    const int n = ball->known < MU_MOTION_KNOWN ? ball->known : MU_MOTION_KNOWN;
    double low = 1.0, high = 0.0;
    int count = 0;
    for (int i = 0; i < n; ++i) {
        const mu_start *start = &ball->starts[i];
        int place = count < 4 ? count : 3;
        int again = 0;
        for (int j = 0; j < count; ++j) again = again || near[j]->t == start->t;
        if (again || (count == 4 && fabs(start->t - t) >= fabs(near[3]->t - t))) continue;
        for (; place > 0 && fabs(start->t - t) < fabs(near[place - 1]->t - t); --place)
            near[place] = near[place - 1];
        near[place] = start;
        if (count < 4) ++count;
    }
    f[0] = count ? near[0]->f[0] : ball->m->drag > 0.0 ? 1.0 : 0.0;
    f[1] = count ? near[0]->f[1] : 0.0;
    for (int j = 0; j < count; ++j) {
        low = mu_min(low, near[j]->t);
        high = mu_max(high, near[j]->t);
    }
    if (count < 4 || t < low || t > high) return;
    f[0] = f[1] = 0.0;
    for (int j = 0; j < 4; ++j) {
        double share = 1.0;
        for (int i = 0; i < 4; ++i)
            if (i != j) share *= (t - near[i]->t) / (near[j]->t - near[i]->t);
        f[0] += share * near[j]->f[0];
        f[1] += share * near[j]->f[1];
    }
}

/* The spring at t, which is sought from f. */
static mu_steady mu_spring_from(mu_ball *ball, double t, double tolerance, int levels, double *f) {
    const double share = mu_share_at(t);
    const mu_shaken one = mu_of_spring(ball->m, share);
    const mu_steady out =
        mu_spring_motion(&one, tolerance / share, levels, ball->grid, ball->steps, f);
    /* one that came from rest to stick is no start for others */
    if (ball->m->drag > 0.0 || out.mean[MU_MEAN_PATH] > MU_MOTION_NO_PATH) {
        const mu_start start = {t, {f[0], f[1]}};
        ball->starts[ball->known++ % MU_MOTION_KNOWN] = start;
    }
    return out;
}

static mu_steady mu_spring_at(mu_ball *ball, double t, double tolerance, int levels) {
    double f[2];
    mu_predict(ball, t, f);
    return mu_spring_from(ball, t, tolerance, levels, f);
}

/* How many sticks the cycle at t has: longer steps show them. */
static int mu_sticks_at(mu_ball *ball, double t, double tolerance) {
    return mu_spring_at(ball, t, MU_MOTION_COARSE * tolerance, 0).sticks;
}

/* Where between low and high, with different numbers of slips, the cycle changes its kind. */
static double mu_kink(mu_ball *ball, double low, double high, int sticks, double tolerance) {
    const double close = MU_KINK_WIDTH * sqrt(tolerance);
    while (high - low > close) {
        const double t = 0.5 * (low + high);
        if (mu_sticks_at(ball, t, tolerance) == sticks) {
            low = t;
        } else {
            high = t;
        }
    }
    return 0.5 * (low + high);
}

/* t at the share u of a panel, and its slope: at a kink, where springs change as
 * (t - kink)^(3/2), it changes as the square. */
static double mu_place_in(const mu_panel *panel, double u, double *slope) {
    const double width = panel->high - panel->low, rest = 1.0 - u;
    double share = u;
    *slope = width;
    if (panel->kinks[0] && panel->kinks[1]) {
        share = u * u * (3.0 - 2.0 * u);
        *slope = 6.0 * u * rest * width;
    } else if (panel->kinks[0]) {
        share = u * u;
        *slope = 2.0 * u * width;
    } else if (panel->kinks[1]) {
        share = 1.0 - rest * rest;
        *slope = 2.0 * rest * width;
    }
    return panel->low + share * width;
}

/* The springs of a panel in the order in which they are computed: first those with halved steps,
 * MU_HALVED_EACH apart, so that the rest lie between known ones. */
enum { MU_FIRST_HALVED = 1, MU_LAST_HALVED = 13, MU_HALVED_SPRINGS = 4 };
static const int MU_PANEL_ORDER[MU_KRONROD_POINTS] = {1, 5, 9, 13, 3, 7, 11, 0,
                                                      2, 4, 6, 8,  10, 12, 14};

/* The larger error of the springs with halved steps next to spring i. */
static double mu_error_beside(const double *errors, int i) {
    int before, after;
    if (i < MU_FIRST_HALVED) return errors[MU_FIRST_HALVED];
    if (i > MU_LAST_HALVED) return errors[MU_LAST_HALVED];
    before = MU_FIRST_HALVED + MU_HALVED_EACH * ((i - MU_FIRST_HALVED) / MU_HALVED_EACH);
    after = before + MU_HALVED_EACH;
    return mu_max(errors[before], errors[after]);
}

static mu_panel mu_ball_panel(mu_ball *ball, double low, double high, int kink_low, int kink_high,
                              double tolerance) {
    mu_panel out;
    double values[MU_KRONROD_POINTS][2], sums[MU_KRONROD_POINTS][2], ends[2];
    double errors[MU_KRONROD_POINTS];
    int halvings = 0, kinks = 0;
    memset(&out, 0, sizeof out);
    out.low = low;
    out.high = high;
    out.kinks[0] = kink_low;
    out.kinks[1] = kink_high;
    out.decay = HUGE_VAL;
    for (int k = 0; k < MU_KRONROD_POINTS; ++k) {
        const int i = MU_PANEL_ORDER[k];
        const int single = k >= MU_HALVED_SPRINGS && halvings <= MU_EASY_LEVELS;
        double weight, slope;
        const double u = 0.5 + 0.5 * mu_kronrod(i, &weight), t = mu_place_in(&out, u, &slope);
        const double share = mu_share_at(t);
        mu_steady spring = mu_spring_at(ball, t, tolerance, single ? 0 : MU_MOTION_LEVELS);
        errors[i] = share * spring.error;
        if (single)
            errors[i] =
                mu_error_beside(errors, i) + MU_MOTION_OF_DISTANCE * share * spring.distance;
        if (!(errors[i] <= tolerance)) { /* from where the search for the cycle begins else */
            double f[2] = {ball->m->drag > 0.0 ? 1.0 : 0.0, 0.0};
            spring = mu_spring_from(ball, t, tolerance, MU_MOTION_LEVELS, f);
            errors[i] = share * spring.error;
        }
        halvings = spring.level > halvings ? spring.level : halvings;
        out.at[i] = t;
        out.sticks[i] = spring.sticks;
        for (int j = 0; j < MU_MEANS; ++j) {
            /* forces and works are in units of its limit, paths in those of its l0 */
            const double unit = 2.0 * t * (j == MU_MEAN_WORK ? share * share : share);
            out.mean[j] += 0.5 * weight * slope * unit * spring.mean[j];
            if (j <= MU_MEAN_Y) {
                values[i][j] = unit * spring.mean[j];
                sums[i][j] = slope * values[i][j];
            }
        }
        out.of_springs += 0.5 * weight * slope * 2.0 * t * errors[i];
        out.decay = mu_min(out.decay, spring.decay);
    }
    (void)mu_roughness(values, out.start, out.end);
    for (int i = 1; i < MU_KRONROD_POINTS; ++i)
        kinks += (low == 0.0 || i < MU_POINTS_AT_END || i > MU_KRONROD_POINTS - MU_POINTS_AT_END) &&
                 out.sticks[i] != out.sticks[i - 1];
    /* few of the points see springs at the rim, or close to an end, that behave otherwise than the
     * rest */
    out.error = (kinks ? MU_ROUGH_AT_KINK : MU_ROUGH) * mu_roughness(sums, ends, ends);
    return out;
}

/* The error of panel i: its own, and that of a kink between its end and its first point, which
 * shows in the neighbour's other value there. */
static double mu_panel_error(const mu_panel *panels, int n, int i) {
    const mu_panel *one = &panels[i];
    double error = one->error;
    for (int j = 0; j < n; ++j) {
        const mu_panel *other = &panels[j];
        if (other->low == one->high)
            error += (one->high - one->at[MU_KRONROD_POINTS - 1]) *
                     mu_length(one->end[0] - other->start[0], one->end[1] - other->start[1]);
        if (other->high == one->low)
            error += (one->at[0] - one->low) *
                     mu_length(one->start[0] - other->end[0], one->start[1] - other->end[1]);
    }
    return error;
}

/* Panels of a ball before any is divided: from one kink to the next. */
static int mu_first_panels(mu_ball *ball, double tolerance, mu_panel *panels) {
    double edges[MU_MOTION_SCAN + 2] = {0.0}, before = 0.0;
    int n = 0, last = -1;
    for (int i = 0; i < MU_MOTION_SCAN; ++i) {
        const double t = (i + 1.0) / MU_MOTION_SCAN;
        const int now = mu_sticks_at(ball, t, tolerance);
        if (i > 0 && now != last) edges[++n] = mu_kink(ball, before, t, last, tolerance);
        last = now;
        before = t;
    }
    if (n == 0) {
        panels[0] = mu_ball_panel(ball, 0.0, 0.5, 0, 0, tolerance);
        panels[1] = mu_ball_panel(ball, 0.5, 1.0, 0, 0, tolerance);
        return 2;
    }
    edges[n + 1] = 1.0;
    for (int i = 0; i <= n; ++i)
        panels[i] = mu_ball_panel(ball, edges[i], edges[i + 1], i > 0, i < n, tolerance);
    return n + 1;
}

/* Where a panel is divided: at the kink between its points that is nearest to the middle, or in the
 * middle.  A kink close to an end is left to later divisions: coarse steps may see it where fine
 * ones do not. */
static double mu_division(mu_ball *ball, const mu_panel *panel, double tolerance, int *kink) {
    const double middle = 0.5 * (panel->low + panel->high);
    const double near = MU_KINK_AT_END * (panel->high - panel->low);
    int best = -1;
    *kink = 0;
    double nearest = HUGE_VAL;
    for (int i = 0; i + 1 < MU_KRONROD_POINTS; ++i) {
        const double distance = fabs(i + 0.5 - MU_KRONROD_MIDDLE);
        if (panel->sticks[i] != panel->sticks[i + 1] && distance < nearest)
            best = i, nearest = distance;
    }
    if (best >= 0) {
        const double at =
            mu_kink(ball, panel->at[best], panel->at[best + 1], panel->sticks[best], tolerance);
        *kink = at - panel->low > near && panel->high - at > near;
        if (*kink) return at;
    }
    return middle;
}

/* A ball: adaptive quadrature over its springs. */
static mu_steady mu_ball_motion(const mu_shaken *m, double tolerance, mu_grid *grid,
                                mu_grid *steps) {
    mu_panel panels[MU_MOTION_PANELS];
    const double half = MU_OF_SPRINGS * tolerance;
    double error = 0.0;
    mu_ball ball;
    mu_steady out;
    int n;
    ball.m = m;
    ball.grid = grid;
    ball.steps = steps;
    ball.known = 0;
    n = mu_first_panels(&ball, half, panels);
    memset(&out, 0, sizeof out);
    out.decay = HUGE_VAL;
    for (;; ++n) {
        double most = -1.0, of_springs = 0.0;
        int worst = 0;
        error = 0.0;
        for (int i = 0; i < n; ++i) {
            const double own = mu_panel_error(panels, n, i);
            error += own;
            of_springs += panels[i].of_springs;
            if (own > most) {
                most = own;
                worst = i;
            }
        }
        if (error <= mu_max(half, tolerance - of_springs) || n == MU_MOTION_PANELS ||
            steps->left < 0)
            break;
        {
            const mu_panel whole = panels[worst];
            int kink;
            const double middle = mu_division(&ball, &whole, half, &kink);
            panels[worst] = mu_ball_panel(&ball, whole.low, middle, whole.kinks[0], kink, half);
            panels[n] = mu_ball_panel(&ball, middle, whole.high, kink, whole.kinks[1], half);
            if (steps->left < 0) { /* what was reached */
                panels[worst] = whole;
                break;
            }
        }
    }
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < MU_MEANS; ++j) out.mean[j] += panels[i].mean[j];
        out.error += panels[i].of_springs;
        out.decay = mu_min(out.decay, panels[i].decay);
    }
    out.error += error;
    return out;
}

/* --- springs and balls ------------------------------------------------------------------------ */

/* Steady cycles of n motions, see library.h. */
static void mu_motions(int contact, int64_t n, const int32_t *counts, const double *orders,
                       const double *cases, double tolerance, int64_t room, double *work,
                       int64_t most, const int32_t *stop, double *out) {
    mu_grid grid = {work, 0, room, 0, stop}, steps = {work + room, 0, room, 0, stop};
    const int64_t numbers = 1 + 2 * ((int64_t)counts[0] + counts[1] + counts[2]);
    for (int64_t i = 0; i < n; ++i, cases += numbers, out += MU_MEANS + 2) {
        const mu_shaken m = mu_shaken_as(counts, orders, cases);
        double f[2] = {m.drag > 0.0 ? 1.0 : 0.0, 0.0};
        mu_steady cycle;
        steps.left = most;
        cycle =
            contact == MU_BALL
                ? mu_ball_motion(&m, tolerance, &grid, &steps)
                : mu_spring_motion(&m, tolerance, MU_MOTION_LEVELS, &grid, &steps, f);
        memcpy(out, cycle.mean, sizeof cycle.mean);
        out[MU_MEANS] = cycle.decay;
        out[MU_MEANS + 1] = cycle.error;
    }
}

/* One cycle of springs with shares of the limit and weights at n + 1 equal times, see library.h. */
static void mu_motion_cycle(const int32_t *counts, const double *orders, const double *one,
                            int springs, const double *shares, const double *weights,
                            double tolerance, int64_t room, double *work, int64_t most,
                            const int32_t *stop, int64_t n, double *forces) {
    mu_grid grid = {work, 0, room, 0, stop}, steps = {work + room, 0, room, 0, stop};
    const mu_shaken m = mu_shaken_as(counts, orders, one);
    double f[2] = {m.drag > 0.0 ? 1.0 : 0.0, 0.0};
    for (int64_t i = 0; i < 2 * (n + 1); ++i) forces[i] = 0.0;
    for (int i = 0; i < springs; ++i) {
        const mu_shaken spring = mu_of_spring(&m, shares[i]);
        mu_drawing drawing = {forces, weights[i] * shares[i], n, 0};
        mu_march march;
        march.step = 0.0;
        march.steps = &steps;
        steps.left = most;
        (void)mu_spring_motion(&spring, tolerance, MU_MOTION_LEVELS, &grid, &steps, f);
        steps.left = most;
        mu_take_period(&spring, &grid, f, tolerance, &march, &drawing);
    }
}
