/* A ball on a flat under a constant load, Hertz, as independent springs (method of dimensionality reduction): that
 * at the share xi of the contact radius carries 3/2 s d xi of the load, s = 1 - xi^2, and d xi of the stiffness.  So
 *
 *     mu~(v~, y~) = 3/2 int_0^1 s mu~_spring(v~ / (1.5 s), y~ / (1.5 s)) d xi:
 *
 * from the middle outwards the springs are the points of a ray, from (v~, y~)/1.5 to infinity.  A ray with
 * y~ > 2.98 v~ enters stick-slip at an amplitude below 1.29 and leaves it at one above; at y~ = 1 it passes the corner.
 * There the integral is split, into pieces with a rule each.  Logarithmic slopes are averaged as mu~ is. */

enum { MU_SPRING, MU_BALL, MU_CONTACTS };
/* The pieces: before stick-slip; in it below y~ = 1, just above that, further above; after it. */
enum { MU_BEFORE, MU_BELOW, MU_CLOSE, MU_ABOVE, MU_BEYOND, MU_RULES };
/* Errors of a rule: first those of the quantities. */
enum { MU_ERROR_V = MU_QUANTITIES, MU_ERROR_Y };
#define MU_DRIVEN_COLUMNS 5 /* of a node of the rule of oscillation along */

#define MU_MIDDLE 1.5 /* load of the middle spring over the mean: gross slip begins at y0 = 1.5 l0 */
#define MU_STEEPEST 0.33516779066085 /* the largest v~crit / y~, and its amplitude */
#define MU_STEEPEST_Y 1.29079076185
#define MU_HUGE 1e280 /* groups beyond which all springs are as the middle one to rounding */

/* The springs that the rules take: v~, y~, s and share of the load of each; pieces from first[k] to first[k + 1], and
 * between the values edge[k] and edge[k + 1] of 1 - xi. */
typedef struct {
    int n, first[MU_RULES + 1];
    double edge[MU_RULES + 1];
    double v[MU_CHUNK], y[MU_CHUNK], s[MU_CHUNK], share[MU_CHUNK];
} mu_springs;

/* Amplitudes at which the ray y~ = r v~ enters stick-slip and leaves it: v~crit/y~ is concave below its largest value,
 * its inverse squared is convex above, so Newton's method comes from one side. */
static void mu_crossings(const mumacro_data *data, double r, double *entry, double *leave) {
    *entry = 2.0 / r;
    *leave = HUGE_VAL;
    if (!(r < 1e140)) return;
    *leave = mu_max(r * r / 4.402914, MU_STEEPEST_Y);
    for (int i = 0; i < 30; ++i) {
        double tilt;
        const double share = r * mu_border(data, *entry, &tilt, NULL) / *entry;
        const double step = (1.0 - 1.0 / share) / (tilt - 1.0);
        *entry = mu_min(*entry * (1.0 - step), MU_STEEPEST_Y);
        if (!(fabs(step) > 1e-9)) break;
    }
    for (int i = 0; i < 30; ++i) {
        double tilt;
        const double share = r * mu_border(data, *leave, &tilt, NULL) / *leave;
        const double step = 0.5 * (1.0 - share * share) / (1.0 - tilt);
        *leave = mu_max(*leave * (1.0 - step), MU_STEEPEST_Y);
        if (!(fabs(step) > 1e-9)) break;
    }
}

/* 1 - xi of the spring with the load s. */
MU_INLINE double mu_outside(double s) { return s < 1.0 ? s / (1.0 + sqrt(1.0 - s)) : 1.0; }

/* The springs of one piece, between two values of 1 - xi. */
static void mu_take_piece(const mumacro_rule *rule, double from, double to, double v, double y, mu_springs *out) {
    const double length = from - to, least = mu_max(mu_max(v, y), 1.0) / 1e300;
    for (int64_t i = 0; length > 0.0 && i < rule->nodes && out->n < MU_CHUNK; ++i) {
        const double rest = to + length * rule->points[2 * i], s = mu_max(rest * (2.0 - rest), least);
        const int n = out->n++;
        out->s[n] = s;
        out->v[n] = v / (MU_MIDDLE * s);
        out->y[n] = y / (MU_MIDDLE * s);
        out->share[n] = MU_MIDDLE * s * length * rule->points[2 * i + 1];
    }
}

static void mu_springs_of(const mumacro_data *data, double v, double y, mu_springs *out) {
    const double corner = mu_outside(y / MU_MIDDLE);
    double *edge = out->edge;
    for (int k = 1; k < MU_RULES; ++k) edge[k] = corner;
    edge[0] = 1.0;
    edge[MU_RULES] = 0.0;
    out->n = 0;
    if (v < MU_STEEPEST * y) {
        double entry, leave;
        mu_crossings(data, y / v, &entry, &leave);
        edge[1] = mu_outside(y / (MU_MIDDLE * entry));
        edge[2] = mu_min(corner, edge[1]);
        edge[4] = mu_min(edge[2], mu_outside(y / (MU_MIDDLE * leave)));
        /* mu~ changes within (v~/y~)^(2/3) of y~ = 1: half way to that, in logarithms, the rules share the work */
        edge[3] = mu_outside(y / (MU_MIDDLE * (1.0 + (v > 0.0 ? mu_cube_root_near(v / y) : 0.0))));
        edge[3] = edge[3] > edge[4] ? mu_min(edge[3], edge[2]) : edge[2];
    }
    for (int k = 0; k < MU_RULES; ++k) {
        out->first[k] = out->n;
        mu_take_piece(&data->rules[k], edge[k], edge[k + 1], v, y, out);
    }
    out->first[MU_RULES] = out->n;
}

/* What a rule may leave out: its error of `scale`, or that of `least`, a measure of what it integrates, where one holds
 * at any v~ and y~.  That is not so from y~ = 1 on: mu~ falls within (v~/y~)^(2/3) of it, more steeply than any rule
 * follows. */
static double mu_left_out(const mumacro_data *data, int piece, int error, double scale, double least, double y) {
    const mumacro_rule *rule = &data->rules[piece];
    const double most = rule->errors[0][error] * scale;
    if (piece == MU_CLOSE || (piece == MU_ABOVE && !(y > 1.1 * MU_MIDDLE))) return most;
    return mu_min(most, rule->errors[1][error] * least);
}

/* The smaller of what a piece carries and what it lacks of its load. */
static double mu_least_share(double sum, double load) {
    return mu_min(sum, fabs(load - sum) + 4.0 * MU_ROUNDING * load);
}

/* The slope along y~ is not a share of the load: beside y~ = 1 it grows like the load per length of the piece, squared,
 * and over its xi, down to the root of y~'s last digit. */
static double mu_slope_scale(const mu_springs *c, int piece, double load) {
    const double from = c->edge[piece], to = c->edge[piece + 1], density = load / (from - to);
    if (!(from > to) || (piece != MU_BELOW && piece != MU_CLOSE)) return load;
    return density * density / mu_max(1.0 - 0.5 * (from + to), 1e-8);
}

/* The static limit, y~ < 1.5: sqrt(1 + e) (E - e K) with e = y~/1.5 and elliptic integrals of the parameter
 * (1 - e)/(1 + e); its slope along ln y~ is -3/2 e^2 K / sqrt(1 + e). */
static double mu_ball_at_rest(double y, double *slope) {
    const double e = y / MU_MIDDLE, root = sqrt(1.0 + e);
    const mu_outer outer = mu_outer_expansion(sqrt(0.5 * (1.0 - e) / e));
    const double k = 0.5 * MU_PI * outer.first * outer.h;
    *slope = 0.0;
    if (!(e < 1.0)) return 0.0;
    if (e < 1e-300) return 1.0;
    *slope = -1.5 * e * (e * k) / root;
    return mu_min(mu_max(root * (0.5 * MU_PI * outer.i3 - e * k), 0.0), 1.0);
}

/* --- one ball ----------------------------------------------------------------------------------------- */

static int mu_ball_source(double v, double crit) {
    return v == 0.0 ? MU_STATIC_LIMIT : v < crit ? MU_BALL_PARTLY : MU_BALL_SLIDES;
}

/* v~ from which all springs slide: the slowest for its amplitude is the middle one, or the one of the steepest ray. */
static double mu_ball_border(const mumacro_data *data, double y) {
    if (!(y > MU_MIDDLE * MU_STEEPEST_Y)) return y >= 0.0 ? MU_STEEPEST * y : NAN;
    return MU_MIDDLE * mu_border_at(data, y / MU_MIDDLE);
}

/* Whether a point is one for quadrature: not illegal, zero or beyond MU_HUGE. */
static int mu_is_spread(double v, double y) { return v >= 0.0 && y > 0.0 && v < MU_HUGE && y < MU_HUGE; }

static mu_answer mu_ball_answer(const mumacro_data *data, int quantity, double v, double y) {
    mu_answer out;
    mu_springs c;
    double value[MU_CHUNK], bound[MU_CHUNK];
    if (!mu_is_spread(v, y)) {
        out = mu_answer_at(data, quantity, v, y);
        if (out.source == MU_NO_OSCILLATION || out.source < 0) return out;
        out.source = mu_ball_source(v, mu_ball_border(data, y));
        if (quantity == MU_MU_RATIO && v < 1e150) out.bound += out.value;
        return out;
    }
    out = mu_limit(0.0, MU_DENORMAL, mu_ball_source(v, mu_ball_border(data, y)));
    if (v == 0.0 && quantity == MU_MU_RATIO) {
        double slope;
        out.value = mu_ball_at_rest(y, &slope);
        out.bound = MU_ROUNDING;
        return out;
    }
    mu_springs_of(data, v, y, &c);
    mu_values(data, quantity, c.n, c.v, c.y, value, bound, NULL);
    for (int k = 0; k < MU_RULES; ++k) {
        double sum = 0.0, load = 0.0, errors = 0.0;
        for (int i = c.first[k]; i < c.first[k + 1]; ++i) {
            const double share = quantity == MU_POWER ? c.share[i] * MU_MIDDLE * c.s[i] : c.share[i];
            sum += share * value[i];
            load += share;
            errors += share * bound[i];
        }
        out.value += sum;
        out.bound += errors + mu_left_out(data, k, quantity, load, quantity == MU_POWER ? sum : mu_least_share(sum, load), y);
    }
    out.bound += MU_ROUNDING * out.value;
    if (quantity == MU_STICK) { /* whether a spring sticks at all is not known next to the border */
        const double off = mu_border_error(data), crit = mu_ball_border(data, y);
        if (fabs(v - MU_STEEPEST * y) < 0.01 * v || fabs(v - crit) < 2.0 * off * v) out.bound += 4.0 * off;
    }
    out.value = mu_min(out.value, MU_QUANTITY[quantity].most);
    return out;
}

/* d mu~ / d v~ at v~ = 0: the mean of the springs' own; infinite from rest on for y~ <= 1.5, like a logarithm. */
static double mu_ball_speed_slope(const mumacro_data *data, double y, double *bound) {
    double found[2] = {0.0, 0.0};
    *bound = HUGE_VAL;
    if (!(y > MU_MIDDLE)) return HUGE_VAL;
    *bound = 0.0;
    for (int k = 0; k < 2; ++k) {
        mu_springs c;
        c.n = 0;
        mu_take_piece(&data->rules[k ? MU_BELOW : MU_CLOSE], 1.0, 0.0, 0.0, y, &c);
        for (int i = 0; i < c.n; ++i) {
            double error;
            found[k] += c.share[i] / (MU_MIDDLE * c.s[i]) * mu_speed_slope_at_zero(data, c.y[i], &error);
            *bound += k ? 0.0 : c.share[i] / (MU_MIDDLE * c.s[i]) * error;
        }
    }
    *bound += 2.0 * fabs(found[0] - found[1]); /* two rules whose nodes stand close at opposite ends */
    return found[0];
}

static mu_slopes mu_ball_slopes(const mumacro_data *data, double v, double y) {
    mu_slopes out = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    mu_springs c;
    double rows[MU_SLOPE_ROWS * MU_CHUNK];
    if (!mu_is_spread(v, y)) {
        out = mu_slopes_at(data, MU_MU_RATIO, v, y);
        if (v < 1e150) {
            out.bound_v += fabs(out.along_v);
            out.bound_y += fabs(out.along_y);
        }
        return out;
    }
    if (v == 0.0) {
        out.value = mu_ball_at_rest(y, &out.along_y);
        /* which jumps at y~ = 1.5 */
        out.bound_y = 8.0 * MU_ROUNDING * fabs(out.along_y) + (fabs(y - MU_MIDDLE) < 2.0 * MU_ROUNDING ? 1.7 : 0.0);
        return out;
    }
    mu_springs_of(data, v, y, &c);
    mu_slopes_of_points(data, MU_MU_RATIO, c.n, c.v, c.y, rows, MU_CHUNK);
    out.bound = MU_ROUNDING;
    for (int k = 0; k < MU_RULES; ++k) {
        double load = 0.0, sum = 0.0, along_y = 0.0;
        for (int i = c.first[k]; i < c.first[k + 1]; ++i) {
            const double share = c.share[i];
            load += share;
            sum += share * rows[MU_SLOPE_VALUE * MU_CHUNK + i];
            out.along_v += share * rows[MU_SLOPE_V * MU_CHUNK + i];
            out.along_y += share * rows[MU_SLOPE_Y * MU_CHUNK + i];
            out.bound_v += share * rows[MU_SLOPE_V_BOUND * MU_CHUNK + i];
            out.bound_y += share * rows[MU_SLOPE_Y_BOUND * MU_CHUNK + i];
            along_y += share * fabs(rows[MU_SLOPE_Y * MU_CHUNK + i]);
        }
        out.value += sum;
        out.bound_v += mu_left_out(data, k, MU_ERROR_V, load, mu_least_share(sum, load), y);
        out.bound_y += mu_left_out(data, k, MU_ERROR_Y, mu_slope_scale(&c, k, load), along_y, y);
    }
    return out;
}

/* --- along and normal ----------------------------------------------------------------------------------- */

/* What a spring or a ball does under oscillation along or normal, with bounds. */
typedef struct {
    mu_line line;
    double bound, bound_v, bound_y, power_bound, stick_bound;
} mu_driven;

/* v~ and y~ may be off by four roundings each; a formula adds as many, relative to the sum of its terms. */
#define MU_LINE_ROUNDING 5e-16

/* Without reverse slip.  The error of h is that of c = arccos x over the slope dc/dh.  c follows y~ - v~ like a root:
 * twice its differential bounds it where y~ - v~ has digits. */
static void mu_bound_stick(const mu_turning *at, const mu_stuck *stuck, double v, mu_driven *out) {
    const mu_line *line = &out->line;
    const double h = stuck->h, deficit = -(line->along_v + line->along_y);
    const double inputs = fabs(line->along_v) + fabs(line->along_y);
    const double off = at->x > 0.0 ? 2.0 * at->x / (at->sine * stuck->slope) : 0.0;
    out->stick_bound = MU_LINE_ROUNDING * (off + h) / MU_PI;
    out->bound = MU_LINE_ROUNDING * (line->terms + inputs);
    out->bound_v = 2.0 * v * h * out->stick_bound + MU_LINE_ROUNDING * line->along_v;
    out->bound_y = MU_LINE_ROUNDING * (4.0 * deficit + inputs) + out->bound_v;
    out->power_bound = v * MU_LINE_ROUNDING * (4.0 * deficit + inputs);
}

/* The rounding of D/y~ - 2/y~, whose sign tells whether there is reverse slip. */
static double mu_turn_rounding(const mu_turning *at, double y) {
    return MU_LINE_ROUNDING * (2.0 / y + 2.0 * at->sine + 2.0 * at->x * at->c);
}

/* The bounds of springs that slip backwards, one in each lane. */
typedef struct {
    mu_lanes mu, along_v, along_y, stick;
} mu_bounds;

/* With reverse slip.  m is the root of F(m) = 2/y~: its error is that of F over its slope, or a root where the slope
 * vanishes.  mu~ is stationary in m; its slopes and the duration of stick are not. */
MU_INLINE mu_bounds mu_bound_reverse(const mu_turning *at, mu_lanes v, mu_lanes y, const mu_reverse *found,
                                     const mu_lines *line) {
    const mu_lanes m = found->m, p = found->p, ill = at->x * y / (y - v);
    const mu_lanes off = MU_LINE_ROUNDING * (2.0 / y + 2.0 * p * at->x) * (1.0 + ill);
    const mu_lanes flat = 4.0 * mu_sqrt(off / at->travel), steep = 2.0 * off / found->slope;
    const mu_lanes of_m = mu_select(MU_WHERE(found->slope > 0.0), mu_lower(steep, flat), flat);
    const mu_lanes of_p = mu_lower(found->of_p, mu_all(1.0)) * of_m + MU_LINE_ROUNDING * p * (1.0 + ill);
    const mu_lanes inputs = mu_size(line->along_v) + mu_size(line->along_y);
    mu_bounds out;
    out.stick = of_m / MU_PI + MU_LINE_ROUNDING * line->stick;
    out.mu = MU_LINE_ROUNDING * (line->terms + inputs);
    out.along_v = v * (m * of_m + p * of_p) / MU_PI + MU_LINE_ROUNDING * line->along_v;
    out.along_y = 2.0 / MU_PI * of_p + out.along_v + MU_LINE_ROUNDING * (line->terms + inputs);
    return out;
}

/* A spring with v~ < y~, of which y~ - v~ has digits. */
static mu_driven mu_drive_spring(int direction, double v, double y) {
    mu_driven out;
    const mu_turning at = mu_turning_of(v, y);
    const double turn = at.travel - 2.0 / y, nearest = mu_turn_rounding(&at, y);
    if (mu_is_reversing(direction, &at, y)) {
        const mu_lanes slow = mu_all(v), wide = mu_all(y);
        const mu_reverse found = mu_reverse_of(&at, wide);
        const mu_lines line = mu_lines_of_reverse(&at, slow, wide, &found);
        const mu_bounds bounds = mu_bound_reverse(&at, slow, wide, &found, &line);
        out.line = mu_line_of_reverse(&at, v, y, &line);
        out.bound = mu_first(bounds.mu);
        out.bound_v = mu_first(bounds.along_v);
        out.bound_y = mu_first(bounds.along_y);
        out.stick_bound = mu_first(bounds.stick);
        out.power_bound = v * (out.bound + MU_LINE_ROUNDING) +
                          MU_LINE_ROUNDING * (y * at.travel + 2.0 + 2.0 * at.c * v + 2.0 * y * at.sine) / MU_PI;
    } else {
        const mu_stuck stuck = mu_half_stick(&at);
        out.line = mu_line_of_stick(v, y, stuck.h, direction == MU_NORMAL ? MU_NORMAL_STICKS : MU_ALONG_STICKS);
        mu_bound_stick(&at, &stuck, v, &out);
    }
    if (v == 0.0) out.line.source = MU_STATIC_LIMIT;
    if (direction == MU_ALONG && fabs(turn) < nearest) { /* where reverse slip begins slopes jump, and m has a root */
        const double root = 2.0 * MU_PI * out.line.stick / at.c * sqrt(nearest / at.travel);
        out.stick_bound += root;
        out.power_bound += y * nearest;
        out.bound_v += (v + y) * at.c + v * MU_PI * out.line.stick * root;
        out.bound_y += (v + y) * at.sine + (v * MU_PI * out.line.stick + 1.0) * root;
    }
    return out;
}

/* The rows that a ball sums over its springs. */
enum { MU_SUM_MU, MU_SUM_V, MU_SUM_Y, MU_SUM_STICK, MU_SUMS };
/* A rule of n nodes misses what Legendre polynomials of degree 2n and more carry.  The three highest that it can tell
 * apart, of degree n - 3 to n - 1, carry more: the largest of them, times this, is the bound. */
#define MU_NULL_SAFETY 16.0

/* What a ball's springs are driven by. */
enum { MU_NODE_V, MU_NODE_Y, MU_NODE_SHARE, MU_NODE_ROWS };

/* v~, y~ and share of the load of springs from node i of the rule on.  A spring that the rounding of the edge puts
 * among those without reverse slip, and a lane behind the last node, has no share. */
MU_INLINE void mu_springs_in_lanes(const mu_turning *at, const mumacro_driven_rule *rule, int64_t i, double v, double y,
                                   double reversed, double out[MU_NODE_ROWS][MU_LANES]) {
    const double least = mu_max(y, 1.0) / 1e300;
    for (int lane = 0; lane < MU_LANES; ++lane) {
        const double *point = rule->points + MU_DRIVEN_COLUMNS * (i + lane < rule->nodes ? i + lane : i);
        const double rest = reversed * point[0], s = mu_max(rest * (2.0 - rest), least), load = MU_MIDDLE * s;
        const int counts = y / load * at->travel > 2.0 && i + lane < rule->nodes;
        out[MU_NODE_V][lane] = counts ? v / load : at->x * 4.0 / at->travel;
        out[MU_NODE_Y][lane] = counts ? y / load : 4.0 / at->travel;
        out[MU_NODE_SHARE][lane] = counts ? load * reversed * point[1] : 0.0;
    }
}

/* Their shares of mu~, of its slopes and of the stick fraction, then of the bounds of these. */
MU_INLINE void mu_drive_lanes(const mu_turning *at, double nodes[MU_NODE_ROWS][MU_LANES],
                              double out[2 * MU_SUMS][MU_LANES]) {
    const mu_lanes v = mu_load(nodes[MU_NODE_V]), y = mu_load(nodes[MU_NODE_Y]), share = mu_load(nodes[MU_NODE_SHARE]);
    const mu_reverse found = mu_reverse_of(at, y);
    const mu_lines line = mu_lines_of_reverse(at, v, y, &found);
    const mu_bounds bounds = mu_bound_reverse(at, v, y, &found, &line);
    mu_store(out[MU_SUM_MU], share * line.mu);
    mu_store(out[MU_SUM_V], share * line.along_v);
    mu_store(out[MU_SUM_Y], share * line.along_y);
    mu_store(out[MU_SUM_STICK], share * line.stick);
    mu_store(out[MU_SUMS + MU_SUM_MU], share * bounds.mu);
    mu_store(out[MU_SUMS + MU_SUM_V], share * bounds.along_v);
    mu_store(out[MU_SUMS + MU_SUM_Y], share * bounds.along_y);
    mu_store(out[MU_SUMS + MU_SUM_STICK], share * bounds.stick);
}

/* A ball with v~ < y~.  Its springs all turn at the same phase: those further out than 1 - xi = `reversed` slip
 * backwards, too. */
static mu_driven mu_drive_ball(const mumacro_data *data, double v, double y) {
    const mumacro_driven_rule *rule = &data->driven;
    const mu_turning at = mu_turning_of(v, y);
    const double last = 0.5 * at.travel * y / MU_MIDDLE, reversed = mu_outside(last);
    const double still = 1.0 - reversed; /* xi of the last spring without reverse slip; next the load of these */
    const double load = MU_MIDDLE * still * (1.0 - still * still / 3.0);
    const double ill = 1.0 + 2.0 * at.x * y / (y - v);
    double nulls[MU_SUMS][3] = {{0.0}}, sums[2 * MU_SUMS] = {0.0};
    const mu_stuck stuck = mu_half_stick(&at);
    mu_driven out = {mu_line_of_stick(v, y, stuck.h, MU_ALONG_REVERSES), 0.0, 0.0, 0.0, 0.0, 0.0};
    mu_line *sum = &out.line;
    mu_bound_stick(&at, &stuck, v, &out);
    sum->mu = load + still * (sum->along_v + sum->along_y); /* whose sum is -(1 - mu~) */
    sum->along_v *= still;
    sum->along_y *= still;
    sum->stick *= load;
    sum->power = reversed * reversed * MU_MIDDLE / MU_PI *
                 (y * at.travel * (1.0 - reversed / 3.0) -
                  3.0 * reversed * (4.0 / 3.0 - reversed + 0.2 * reversed * reversed));
    /* the load has roundings of its own */
    out.bound = out.bound * mu_max(still, load) + MU_LINE_ROUNDING * load;
    out.bound_v *= still;
    out.bound_y *= still;
    out.stick_bound = (out.stick_bound + MU_LINE_ROUNDING) * load;
    for (int64_t i = 0; i < rule->nodes; i += MU_LANES) {
        double nodes[MU_NODE_ROWS][MU_LANES], rows[2 * MU_SUMS][MU_LANES];
        const int few = rule->nodes - i < MU_LANES ? (int)(rule->nodes - i) : MU_LANES;
        mu_springs_in_lanes(&at, rule, i, v, y, reversed, nodes);
        mu_drive_lanes(&at, nodes, rows);
        for (int lane = 0; lane < few; ++lane) {
            const double *point = rule->points + MU_DRIVEN_COLUMNS * (i + lane);
            for (int row = 0; row < 2 * MU_SUMS; ++row) sums[row] += rows[row][lane];
            for (int row = 0; row < MU_SUMS; ++row)
                for (int j = 0; j < 3; ++j) nulls[row][j] += point[2 + j] * rows[row][lane];
        }
    }
    sum->mu += sums[MU_SUM_MU];
    sum->along_v += sums[MU_SUM_V];
    sum->along_y += sums[MU_SUM_Y];
    sum->stick += sums[MU_SUM_STICK];
    out.bound += sums[MU_SUMS + MU_SUM_MU];
    out.bound_v += sums[MU_SUMS + MU_SUM_V];
    out.bound_y += sums[MU_SUMS + MU_SUM_Y];
    out.stick_bound += sums[MU_SUMS + MU_SUM_STICK];
    {
        double missed[MU_SUMS];
        for (int row = 0; row < MU_SUMS; ++row) {
            const double *of = nulls[row];
            missed[row] = MU_NULL_SAFETY * mu_max(fabs(of[0]), mu_max(fabs(of[1]), fabs(of[2])));
        }
        out.bound += missed[MU_SUM_MU];
        out.bound_v += missed[MU_SUM_V];
        out.bound_y += missed[MU_SUM_Y];
        out.stick_bound += missed[MU_SUM_STICK];
    }
    if (last < 1.0 + 4.0 * MU_LINE_ROUNDING * ill) { /* a spring at the edge may belong to the others: slopes jump */
        const double room = mu_max(1.0 - last, MU_LINE_ROUNDING * ill);
        const double moved = mu_min(MU_LINE_ROUNDING * ill * last / sqrt(room), 1.0);
        out.bound_v += moved * (v + y) * at.c;
        out.bound_y += moved * (v + y) * at.sine;
    }
    sum->mu = mu_min(mu_max(sum->mu, 0.0), 1.0);
    sum->power += v * (1.0 - sum->mu);
    sum->source = v == 0.0 ? MU_STATIC_LIMIT : MU_ALONG_REVERSES;
    out.power_bound = v * (out.bound + MU_LINE_ROUNDING) +
                      MU_LINE_ROUNDING * reversed * reversed * MU_MIDDLE / MU_PI *
                          (y * at.travel + 4.0 * reversed + 2.0 * at.c * v + 2.0 * y * at.sine);
    return out;
}

static mu_driven mu_drive_inside(const mumacro_data *data, int contact, int direction, double v, double y) {
    return contact == MU_BALL && y < MU_HUGE ? mu_drive_ball(data, v, y) : mu_drive_spring(direction, v, y);
}

/* Any v~ and y~.  Where y~ - v~ has no digits it is not known whether the contact sticks: there a bound is that a little
 * inside, and the way from there. */
static mu_driven mu_drive(const mumacro_data *data, int contact, int direction, double v, double y) {
    const double inside = y * (1.0 - 2.0 * MU_LINE_ROUNDING);
    mu_driven out = {mu_line_of_sliding(direction, v, y), 0.0, 0.0, 0.0, 0.0, 0.0}, near;
    const mu_line *line = &out.line;
    if (line->source < 0 || y == 0.0 || v > y * (1.0 + 2.0 * MU_ROUNDING)) return out;
    if (!(inside < y) && !(v < y)) { /* the last of the denormal numbers */
        out.bound = out.bound_v = out.bound_y = out.power_bound = 4.0 * y;
        out.stick_bound = 1.0;
        return out;
    }
    near = mu_drive_inside(data, contact, direction, v < y ? v : inside, y);
    if (v <= inside) return near;
    if (v < y) { /* the answer is that just inside, where it can be told */
        out.line = near.line;
        near = mu_drive_inside(data, contact, direction, inside, y);
    }
    out.bound = near.bound + fabs(line->mu - near.line.mu);
    out.bound_v = near.bound_v + fabs(line->along_v - near.line.along_v);
    out.bound_y = near.bound_y + fabs(line->along_y - near.line.along_y);
    out.power_bound = near.power_bound + fabs(line->power - near.line.power);
    out.stick_bound = near.stick_bound + fabs(line->stick - near.line.stick);
    return out;
}

/* --- any contact and direction ---------------------------------------------------------------------------- */

/* A quantity of a contact; the normal direction has z for y~ and no power: how far the load moves is not modelled. */
static mu_answer mu_answer_as(const mumacro_data *data, int contact, int direction, int quantity, double v, double y) {
    if (direction != MU_ACROSS) {
        const mu_driven found = mu_drive(data, contact, direction, v, y);
        const mu_line *line = &found.line;
        if (quantity == MU_POWER)
            return direction == MU_NORMAL ? mu_limit(NAN, NAN, -1)
                                          : mu_limit(line->power, found.power_bound, line->source);
        if (quantity == MU_STICK) return mu_limit(line->stick, found.stick_bound, line->source);
        return mu_limit(line->mu, found.bound, line->source);
    }
    if (contact == MU_SPRING) { /* the same bits as in any array */
        int8_t source;
        mu_answer out;
        mu_values(data, quantity, 1, &v, &y, &out.value, &out.bound, &source);
        return mu_limit(out.value, out.bound, source);
    }
    return mu_ball_answer(data, quantity, v, y);
}

static mu_slopes mu_slopes_of_driven(const mu_driven *found) {
    const mu_line *line = &found->line;
    const mu_slopes out = {line->mu, line->along_v, line->along_y, found->bound_v, found->bound_y, found->bound};
    return out;
}

static mu_slopes mu_slopes_as(const mumacro_data *data, int contact, int direction, double v, double y) {
    if (direction != MU_ACROSS) {
        const mu_driven found = mu_drive(data, contact, direction, v, y);
        return mu_slopes_of_driven(&found);
    }
    return contact == MU_BALL ? mu_ball_slopes(data, v, y) : mu_slopes_at(data, MU_MU_RATIO, v, y);
}

/* d mu~ / d v~ at v~ = 0; along and normal it is h^2 / pi = pi for springs that have not begun to slip backwards. */
static double mu_speed_slope_as(const mumacro_data *data, int contact, int direction, double y, double *bound) {
    *bound = 0.0;
    if (direction == MU_ACROSS)
        return contact == MU_BALL ? mu_ball_speed_slope(data, y, bound) : mu_speed_slope_at_zero(data, y, bound);
    {
        const double v = MU_CREEP * mu_min(y, 1.0);
        const mu_driven found = mu_drive(data, contact, direction, v, y);
        *bound = found.bound_v / v;
        return found.line.along_v / v;
    }
}
