/* The steady cycle of a contact under any periodic motion beside a drag, by the steps of element.c.
 *
 * Units: the limit mu0 Fz for forces, the angle tau = omega t for time, any length for paths.  The curve of the upper
 * point becomes a polygon, each of whose sides is a closed form.  Its nodes lie dense where the direction or the limit
 * changes quickly.  Each level halves the steps; the means converge with their square and are extrapolated.  On a level
 * the cycle is found as the fixed point of the map of a period, which brings any two forces closer. */

enum { MU_MOTION_DEPTH = 40, MU_MOTION_PERIODS = 400, MU_MOTION_REST_PERIODS = 4000, MU_MOTION_PANELS = 48 };
enum { MU_MEAN_X, MU_MEAN_Y, MU_MEAN_STUCK, MU_MEAN_PATH, MU_MEAN_WORK, MU_MEANS };

/* A motion: harmonics of x, y and the limit one after another, whose terms are amplitude and phase. */
typedef struct {
    const int32_t *counts;
    const double *orders, *terms;
    double stiffness, drag;
} mu_shaken;

/* Where it is marched: n steps of a period, with the limit behind each, and the limit at the start. */
typedef struct {
    int64_t nodes, room; /* of the coarsest level, and steps that fit */
    double *tau, *dx, *dy, *limit, first;
    int64_t n;
} mu_grid;

/* A steady cycle: means per period, in units of tau; decay of a disturbance per period as its logarithm; the bound of
 * the error of the mean force that is left. */
typedef struct {
    double mean[MU_MEANS], decay, error;
} mu_steady;

static double mu_largest_order(const mu_shaken *m) {
    double order = 1.0;
    for (int i = 0; i < m->counts[0] + m->counts[1] + m->counts[2]; ++i) order = mu_max(order, m->orders[i]);
    return order;
}

/* Velocity of the upper point and the limit at tau. */
static void mu_shaken_at(const mu_shaken *m, double tau, double *at) {
    const double *order = m->orders, *term = m->terms;
    at[0] = m->drag;
    at[1] = 0.0;
    at[2] = 1.0;
    for (int part = 0; part < 3; ++part)
        for (int i = 0; i < m->counts[part]; ++i, ++order, term += 2)
            at[part] += part < 2 ? term[0] * *order * cos(*order * tau + term[1]) : term[0] * sin(*order * tau + term[1]);
}

/* Whether a step from a to b is cut: where the polygon leaves the curve by more than a thousandth of what a spring of
 * the limit 1 stretches while the direction turns, or the limit changes by half. */
static int mu_is_cut(const mu_shaken *m, double stiffness, double a, double b, const double *start, const double *end) {
    double middle[3], turn, least;
    mu_shaken_at(m, 0.5 * (a + b), middle);
    turn = hypot(end[0] - start[0], end[1] - start[1]) +
           hypot(start[0] - 2.0 * middle[0] + end[0], start[1] - 2.0 * middle[1] + end[1]);
    least = mu_min(mu_min(hypot(start[0], start[1]), hypot(end[0], end[1])), hypot(middle[0], middle[1]));
    if (turn > 0.5 * least && stiffness * turn * (b - a) > 8e-3) return 1;
    least = mu_min(mu_min(start[2], end[2]), middle[2]);
    return fabs(end[2] - start[2]) + fabs(start[2] - 2.0 * middle[2] + end[2]) > 0.5 * least;
}

/* The nodes of the coarsest level. */
static void mu_lay_nodes(const mu_shaken *m, double stiffness, mu_grid *grid) {
    const int64_t equal = (int64_t)(32.0 * mu_largest_order(m)), most = grid->room / 8;
    const double length = 2.0 * MU_PI / (double)equal;
    int64_t n = 0;
    for (int64_t i = 0; i < equal; ++i) {
        double ends[MU_MOTION_DEPTH + 1], there[MU_MOTION_DEPTH + 1][3], a = length * (double)i, start[3];
        int depth = 0;
        ends[0] = i + 1 < equal ? length * (double)(i + 1) : 2.0 * MU_PI;
        mu_shaken_at(m, a, start);
        mu_shaken_at(m, ends[0], there[0]);
        for (;;) {
            while (depth < MU_MOTION_DEPTH && n + depth + equal < most &&
                   mu_is_cut(m, stiffness, a, ends[depth], start, there[depth])) {
                ends[depth + 1] = 0.5 * (a + ends[depth]);
                ++depth;
                mu_shaken_at(m, ends[depth], there[depth]);
            }
            grid->tau[n++] = a;
            a = ends[depth];
            memcpy(start, there[depth], sizeof start);
            if (depth-- == 0) break;
        }
    }
    grid->nodes = n;
    grid->tau[n] = 2.0 * MU_PI;
}

/* The steps of a level, 2^level in each of the coarsest. */
static void mu_lay_steps(const mu_shaken *m, int level, mu_grid *grid) {
    const int64_t parts = (int64_t)1 << level;
    double at[3];
    mu_shaken_at(m, 0.0, at);
    grid->first = at[2];
    grid->n = grid->nodes * parts;
    for (int64_t i = 0; i < grid->n; ++i) {
        const int64_t node = i / parts;
        const double from = grid->tau[node], length = (grid->tau[node + 1] - from) / (double)parts;
        const double middle = from + ((double)(i % parts) + 0.5) * length;
        const double *order = m->orders, *term = m->terms;
        double part[3] = {m->drag * length, 0.0, 1.0};
        for (int j = 0; j < 3; ++j)
            for (int count = 0; count < m->counts[j]; ++count, ++order, term += 2) {
                const double phase = *order * middle + term[1], half = 0.5 * *order * length;
                /* differences of sines, which do not cancel; the limit is that at the end of the step */
                part[j] += j < 2 ? 2.0 * term[0] * cos(phase) * sin(half) : term[0] * sin(phase + half);
            }
        grid->dx[i] = part[0];
        grid->dy[i] = part[1];
        grid->limit[i] = part[2];
    }
    grid->limit[grid->n - 1] = grid->first;
}

/* One period of a spring with this share of the limit; f is its force.  Forces after the steps go to path, if wanted,
 * of which each is added with a weight. */
static mu_steady mu_period(const mu_shaken *m, const mu_grid *grid, double share, double *f, double weight,
                           double *path) {
    mu_steady out = {{0.0}, 0.0, 0.0};
    double before = share * grid->first;
    int64_t i = 0;
    const int64_t parts = grid->n / grid->nodes;
    for (int64_t node = 0; node < grid->nodes; ++node) {
        const double length = (grid->tau[node + 1] - grid->tau[node]) / (double)parts, time = length / (2.0 * MU_PI);
        for (int64_t part = 0; part < parts; ++part, ++i) {
            const double after = share * grid->limit[i];
            mu_stretch step;
            mu_move_spring(before, after, m->stiffness, grid->dx[i], grid->dy[i], f, &step);
            before = after;
            out.mean[MU_MEAN_X] += time * step.x;
            out.mean[MU_MEAN_Y] += time * step.y;
            out.mean[MU_MEAN_STUCK] += time * step.stuck;
            out.mean[MU_MEAN_PATH] += step.slip;
            out.mean[MU_MEAN_WORK] += step.x * (grid->dx[i] - m->drag * length) + step.y * grid->dy[i];
            out.decay += step.decay;
            if (path) {
                path[2 * i] += weight * f[0];
                path[2 * i + 1] += weight * f[1];
            }
        }
    }
    return out;
}

static void mu_keep_below(double limit, double *f) {
    const double size = mu_hypot(f[0], f[1]);
    if (size > limit) {
        f[0] *= limit / size;
        f[1] *= limit / size;
    }
}

/* The steady cycle on a grid, by the secant method on the map of a period; f is where it starts.  The bound: a
 * disturbance d falls by exp(-decay / 2) at least per period, so that it is below the change per period over one less
 * that.  A contact that is not dragged may have many cycles; its own is the one that it comes to. */
static mu_steady mu_find_cycle(const mu_shaken *m, const mu_grid *grid, double share, double goal, double *f) {
    const double limit = share * grid->first;
    const int most = m->drag > 0.0 ? MU_MOTION_PERIODS : MU_MOTION_REST_PERIODS;
    double last_moved[2] = {0.0, 0.0}, last_end[2] = {0.0, 0.0}, last = HUGE_VAL;
    mu_steady found;
    int between;
    for (int period = 1;; ++period) {
        double end[2] = {f[0], f[1]}, moved[2], size, rate;
        found = mu_period(m, grid, share, end, 0.0, NULL);
        moved[0] = end[0] - f[0];
        moved[1] = end[1] - f[1];
        size = mu_hypot(moved[0], moved[1]);
        rate = -expm1(-0.5 * found.decay);
        found.error = size == 0.0 ? 0.0 : mu_min(size / rate, 2.0 * share);
        if (m->drag == 0.0 && found.decay == 0.0) found.error = 0.0; /* it sticks: each period is the same */
        if (m->drag == 0.0 && size < last) found.error = mu_min(found.error, 2.0 * size * last / (last - size));
        if (found.error <= goal || size <= 4e-16 * share || period >= most) return found;
        /* what the last change and this one say together: whether a step of the secant is worth it */
        between = moved[0] * last_moved[0] + moved[1] * last_moved[1] < 0.0;
        if (m->drag > 0.0 && last < HUGE_VAL && (size < last || between)) {
            const double dx = moved[0] - last_moved[0], dy = moved[1] - last_moved[1], square = dx * dx + dy * dy;
            const double back = square > 0.0 ? (dx * moved[0] + dy * moved[1]) / square : 0.0;
            f[0] = end[0] - back * (end[0] - last_end[0]);
            f[1] = end[1] - back * (end[1] - last_end[1]);
            last = size;
        } else {
            f[0] = end[0];
            f[1] = end[1];
            last = size;
            if (m->drag > 0.0 && found.decay == 0.0) { /* the drag only stretches it: up to the limit */
                const double a = size * size, b = end[0] * moved[0] + end[1] * moved[1];
                const double c = mu_min(end[0] * end[0] + end[1] * end[1] - limit * limit, 0.0);
                const double times = mu_max((sqrt(mu_max(b * b - a * c, 0.0)) - b) / a, 0.0);
                f[0] += times * moved[0];
                f[1] += times * moved[1];
            }
        }
        mu_keep_below(limit, f);
        memcpy(last_moved, moved, sizeof moved);
        memcpy(last_end, end, sizeof end);
    }
}

/* The steady cycle of a spring with this share of the limit, level by level until the error of the mean force is below
 * the tolerance. */
static mu_steady mu_spring_motion(const mu_shaken *m, double share, double tolerance, mu_grid *grid, double *f) {
    mu_steady level[3] = {{{0.0}, 0.0, 0.0}}, out = {{0.0}, 0.0, 0.0};
    mu_lay_nodes(m, m->stiffness / share, grid);
    for (int i = 1; grid->nodes << i <= grid->room; ++i) {
        double change[2] = {0.0, 0.0};
        memmove(level, level + 1, 2 * sizeof *level);
        mu_lay_steps(m, i, grid);
        if (m->drag == 0.0) f[0] = f[1] = 0.0;
        mu_keep_below(share * grid->first, f);
        level[2] = mu_find_cycle(m, grid, share, 0.05 * tolerance, f);
        if (i < 3) continue;
        out = level[2];
        for (int j = 0; j < MU_MEANS; ++j) {
            const double fine = level[2].mean[j] - level[1].mean[j], coarse = level[1].mean[j] - level[0].mean[j];
            if (j != MU_MEAN_STUCK) out.mean[j] += fine / 3.0;
            if (j <= MU_MEAN_Y) change[j] = mu_max(fabs(fine), 0.25 * fabs(coarse));
        }
        out.error = hypot(change[0], change[1]) + 1e-15 + (4.0 * level[2].error + level[1].error) / 3.0;
        if (out.error <= tolerance) break;
    }
    return out;
}

/* Gauss and Kronrod, 7 and 15 points: nodes from the middle outwards. */
static const double MU_KRONROD[8][3] = {
    {0.0, 0.209482141084727828012999174891714, 0.417959183673469387755102040816327},
    {0.207784955007898467600689403773245, 0.204432940075298892414161999234649, 0.0},
    {0.405845151377397166906606412076961, 0.190350578064785409913256402421014, 0.381830050505118944950369775488975},
    {0.586087235467691130294144691693145, 0.169004726639267902826583426598550, 0.0},
    {0.741531185599394439863864773280788, 0.140653259715525918745189590510238, 0.279705391489276667901467771423780},
    {0.864864423359769072789712788640926, 0.104790010322250183839876322541518, 0.0},
    {0.949107912342758524526189684047851, 0.063092092629978553290700663189204, 0.129484966168869693270611432679082},
    {0.991455371120812639206854697526329, 0.022935322010529224963732008058970, 0.0},
};

typedef struct {
    double low, high, error;
    mu_steady sum;
} mu_panel;

/* The springs of a ball from xi = low to high. */
static mu_panel mu_ball_panel(const mu_shaken *m, double low, double high, double tolerance, mu_grid *grid,
                              double *f) {
    mu_panel out = {low, high, 0.0, {{0.0}, HUGE_VAL, 0.0}};
    const double half = 0.5 * (high - low), middle = 0.5 * (high + low);
    double difference[2] = {0.0, 0.0};
    for (int i = 0; i < 15; ++i) {
        const double *rule = MU_KRONROD[(i + 1) / 2], xi = middle + (i % 2 ? half : -half) * rule[0];
        const double share = 1.5 * (1.0 - xi) * (1.0 + xi);
        double force[2] = {f[0] * share, f[1] * share}; /* of the spring before, as a share of its limit */
        const mu_steady spring = mu_spring_motion(m, share, tolerance, grid, force);
        f[0] = force[0] / share;
        f[1] = force[1] / share;
        for (int j = 0; j < MU_MEANS; ++j) out.sum.mean[j] += half * rule[1] * spring.mean[j];
        for (int j = 0; j < 2; ++j) difference[j] += half * (rule[1] - rule[2]) * spring.mean[j];
        out.sum.error += half * rule[1] * spring.error;
        out.sum.decay = mu_min(out.sum.decay, spring.decay);
    }
    out.error = hypot(difference[0], difference[1]);
    return out;
}

/* A ball: adaptive quadrature over its springs. */
static mu_steady mu_ball_motion(const mu_shaken *m, double tolerance, mu_grid *grid) {
    mu_panel panels[MU_MOTION_PANELS];
    double f[2] = {0.0, 0.0}, error = 0.0;
    mu_steady out = {{0.0}, HUGE_VAL, 0.0};
    int n = 2;
    if (m->drag > 0.0) f[0] = 1.0;
    panels[0] = mu_ball_panel(m, 0.0, 0.5, 0.5 * tolerance, grid, f);
    panels[1] = mu_ball_panel(m, 0.5, 1.0, 0.5 * tolerance, grid, f);
    for (;; ++n) {
        int worst = 0;
        error = 0.0;
        for (int i = 0; i < n; ++i) {
            error += panels[i].error;
            if (panels[i].error > panels[worst].error) worst = i;
        }
        if (error <= 0.5 * tolerance || n == MU_MOTION_PANELS) break;
        {
            const double low = panels[worst].low, high = panels[worst].high, middle = 0.5 * (low + high);
            panels[worst] = mu_ball_panel(m, low, middle, 0.5 * tolerance, grid, f);
            panels[n] = mu_ball_panel(m, middle, high, 0.5 * tolerance, grid, f);
        }
    }
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < MU_MEANS; ++j) out.mean[j] += panels[i].sum.mean[j];
        out.error += panels[i].sum.error;
        out.decay = mu_min(out.decay, panels[i].sum.decay);
    }
    out.error += error;
    return out;
}

static mu_grid mu_grid_in(double *work, int64_t room) {
    const mu_grid grid = {0, room, work, work + room + 1, work + 2 * room + 1, work + 3 * room + 1, 1.0, 0};
    return grid;
}

static int64_t mu_terms(const int32_t *counts) { return 2 * ((int64_t)counts[0] + counts[1] + counts[2]); }

/* Steady cycles of n motions, see library.h. */
static void mu_motions(int contact, int64_t n, const int32_t *counts, const double *orders, const double *cases,
                       double tolerance, int64_t room, double *work, double *out) {
    mu_grid grid = mu_grid_in(work, room);
    for (int64_t i = 0; i < n; ++i, cases += 2 + mu_terms(counts), out += MU_MEANS + 2) {
        const mu_shaken m = {counts, orders, cases + 2, cases[0], cases[1]};
        double f[2] = {m.drag > 0.0 ? 1.0 : 0.0, 0.0};
        const mu_steady found = contact == MU_BALL ? mu_ball_motion(&m, tolerance, &grid)
                                                   : mu_spring_motion(&m, 1.0, tolerance, &grid, f);
        memcpy(out, found.mean, sizeof found.mean);
        out[MU_MEANS] = found.decay;
        out[MU_MEANS + 1] = found.error;
    }
}

/* One cycle of springs with shares of the limit and weights, see library.h. */
static int64_t mu_motion_cycle(const int32_t *counts, const double *orders, const double *one, int level, int springs,
                               const double *shares, const double *weights, double goal, int64_t room, double *work,
                               double *tau, double *limit, double *forces) {
    const mu_shaken m = {counts, orders, one + 2, one[0], one[1]};
    mu_grid grid = mu_grid_in(work, room);
    int64_t i = 0, parts;
    mu_lay_nodes(&m, m.stiffness, &grid);
    while (level > 0 && grid.nodes << level > room) --level;
    mu_lay_steps(&m, level, &grid);
    parts = (int64_t)1 << level;
    tau[0] = 0.0;
    limit[0] = grid.first;
    memcpy(limit + 1, grid.limit, (size_t)grid.n * sizeof *limit);
    for (int64_t node = 0; node < grid.nodes; ++node)
        for (int64_t part = 1; part <= parts; ++part) {
            const double share = (double)part / (double)parts;
            tau[++i] = grid.tau[node] + (grid.tau[node + 1] - grid.tau[node]) * share;
        }
    for (i = 0; i <= grid.n; ++i) forces[2 * i] = forces[2 * i + 1] = 0.0;
    for (int spring = 0; spring < springs; ++spring) {
        double f[2] = {m.drag > 0.0 ? shares[spring] * grid.first : 0.0, 0.0};
        (void)mu_find_cycle(&m, &grid, shares[spring], goal, f);
        forces[0] += weights[spring] * f[0];
        forces[1] += weights[spring] * f[1];
        (void)mu_period(&m, &grid, shares[spring], f, weights[spring], forces + 2);
    }
    return grid.n;
}
