/* A ball on a flat under a constant load, Hertz, as independent springs (method of dimensionality
 * reduction): that at the share xi of the contact radius carries 3/2 s d xi of the load,
 * s = 1 - xi^2, and d xi of the stiffness.  So
 *
 *     mu~(v~, y~) = 3/2 int_0^1 s mu~_spring(v~ / (1.5 s), y~ / (1.5 s)) d xi:
 *
 * from the middle outwards the springs are the points of a ray, from (v~, y~)/1.5 to
 * infinity.  Across, a table holds that (atlas.c).  Along, it is an integral
 * over closed forms, taken here. */

/* null rules of the rule of oscillation along, in three bands of degrees, and the columns of a node
 */
enum {
    MU_BANDS = 3,
    MU_OF_BAND = 3,
    MU_NULLS = MU_BANDS * MU_OF_BAND,
    MU_DRIVEN_COLUMNS = 2 + MU_NULLS
};
#define MU_HUGE 1e280 /* groups beyond which all springs are as the middle one to rounding */

/* 1 - xi of the spring with the load s. */
MU_INLINE double mu_outside(double s) { return s < 1.0 ? s / (1.0 + sqrt(1.0 - s)) : 1.0; }

/* v~ from which all springs slide: the slowest for its amplitude is the middle one,
 * or the one of the steepest ray. */
MU_INLINE double mu_ball_border(const mumacro_data *data, double y) {
    if (!(y > MU_MIDDLE * MU_STEEPEST_Y)) return y >= 0.0 ? MU_STEEPEST * y : NAN;
    return MU_MIDDLE * mu_border_at(data, y / MU_MIDDLE);
}

/* d mu~ / d v~ at v~ = 0: infinite from rest on for y~ <= 1.5, like a logarithm; else read off the
 * table at a speed that stands for the limit. */
static double mu_ball_speed_slope(const mumacro_data *data, double y, double *bound) {
    double v;
    mu_answer answer;
    *bound = HUGE_VAL;
    if (!(y > MU_MIDDLE)) return HUGE_VAL;
    *bound = 0.0;
    if (y == HUGE_VAL) return 0.0;
    v = MU_CREEP * mu_min(1.0, y / MU_MIDDLE - 1.0);
    answer = mu_answer_at(data, MU_BALL, MU_MU_RATIO, v, y / MU_MIDDLE);
    *bound = answer.bound / (MU_MIDDLE * v);
    return answer.value / (MU_MIDDLE * v);
}

/* --- along and normal ------------------------------------------------------------------------- */

/* What a spring or a ball does under oscillation along or normal, with bounds. */
typedef struct {
    mu_line line;
    double bound, bound_v, bound_y, power_bound, stick_bound;
} mu_driven;

/* v~ and y~ may be off by four roundings each; a formula adds as many,
 * relative to the sum of its terms. */
#define MU_LINE_ROUNDING 5e-16

/* Without reverse slip.  The error of h is that of c = arccos x over the slope dc/dh.  c follows
 * y~ - v~ like a root: twice its differential bounds it where y~ - v~ has digits. */
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

/* With reverse slip.  m is the root of F(m) = 2/y~: its error is that of F over its
 * slope, or a root where the slope vanishes.  mu~ is stationary in m; its slopes and
 * the duration of stick are not. */
MU_INLINE mu_bounds mu_bound_reverse(const mu_turning *at, mu_lanes v, mu_lanes y,
                                     const mu_reverse *reverse, const mu_lines *line) {
    const mu_lanes m = reverse->m, p = reverse->p, ill = at->x * y / (y - v);
    const mu_lanes off = MU_LINE_ROUNDING * (2.0 / y + 2.0 * p * at->x) * (1.0 + ill);
    const mu_lanes flat = 4.0 * mu_sqrt(off / at->travel), steep = 2.0 * off / reverse->slope;
    const mu_lanes of_m = mu_select(MU_WHERE(reverse->slope > 0.0), mu_lower(steep, flat), flat);
    const mu_lanes of_p =
        mu_lower(reverse->of_p, mu_all(1.0)) * of_m + MU_LINE_ROUNDING * p * (1.0 + ill);
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
        const mu_reverse reverse = mu_reverse_of(&at, wide);
        const mu_lines line = mu_lines_of_reverse(&at, slow, wide, &reverse);
        const mu_bounds bounds = mu_bound_reverse(&at, slow, wide, &reverse, &line);
        out.line = mu_line_of_reverse(&at, v, y, &line);
        out.bound = mu_first(bounds.mu);
        out.bound_v = mu_first(bounds.along_v);
        out.bound_y = mu_first(bounds.along_y);
        out.stick_bound = mu_first(bounds.stick);
        out.power_bound =
            v * (out.bound + MU_LINE_ROUNDING) +
            MU_LINE_ROUNDING * (y * at.travel + 2.0 + 2.0 * at.c * v + 2.0 * y * at.sine) / MU_PI;
    } else {
        const mu_stuck stuck = mu_half_stick(&at);
        out.line = mu_line_of_stick(v, y, stuck.h,
                                    direction == MU_NORMAL ? MU_NORMAL_STICKS : MU_ALONG_STICKS);
        mu_bound_stick(&at, &stuck, v, &out);
    }
    if (v == 0.0) out.line.source = MU_STATIC_LIMIT;
    /* where reverse slip begins slopes jump, and m has a root */
    if (direction == MU_ALONG && fabs(turn) < nearest) {
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
/* A rule of n nodes misses what Legendre polynomials of degree 2n and more carry.  The three
 * highest that it can tell apart, of degree n - 3 to n - 1, carry more: the largest of them, times
 * this, is the bound. */
#define MU_NULL_SAFETY 16.0
/* The coefficients of an integrand without a singularity near the nodes fall with the degree d, by
 * r from one band to the next.  Where they fall like rho^-d, r = rho^-6, the rule misses 2 r^(29/6)
 * / (1 - r^(1/6)) times the largest of the last band; where they fall like d^-p, r = (20/26)^p, it
 * is 112/(p - 1) (26/56)^p.  Up to this r, of p = 4, both are less than MU_NULL_SAFETY r^2. */
#define MU_NULL_FALL 0.35
/* The singularities near the nodes, which the rule may step over, are two: at the load `last` = 1
 * the first spring slips backwards, by the root of the distance to it; and at slow speed the last
 * spring without reverse slip has a layer.  Away from both the coefficients fall. */
#define MU_NULL_BELOW 0.8
#define MU_NULL_ABOVE 2.0
#define MU_NULL_SLOW 0.02
/* of their sum, the errors of the weights of the rule (tests), at an integrand of thrice its mean
 */
#define MU_RULE_ROUNDING 5e-15

/* What the rule misses of a sum over springs, from the coefficients of its integrand. */
static double mu_missed(const double nulls[MU_NULLS], double sum, int falls) {
    /* rounding of a coefficient of the degree 27 */
    const double noise = 55.0 * MU_LINE_ROUNDING * fabs(sum);
    double largest[MU_BANDS] = {0.0}, r = 0.0;
    for (int i = 0; i < MU_NULLS; ++i) {
        double *of_band = &largest[i / MU_OF_BAND];
        *of_band = mu_max(*of_band, fabs(nulls[i]));
    }
    for (int band = 1; band < MU_BANDS; ++band) /* one that is noise does not fall any more */
        if (band == 1 || largest[band - 1] > noise)
            r = mu_max(r, largest[band] < MU_NULL_FALL * largest[band - 1]
                              ? largest[band] / largest[band - 1]
                              : 1.0);
    return MU_NULL_SAFETY * largest[MU_BANDS - 1] * (falls ? r * r : 1.0) +
           MU_RULE_ROUNDING * fabs(sum);
}

/* What a ball's springs are driven by. */
enum { MU_NODE_V, MU_NODE_Y, MU_NODE_SHARE, MU_NODE_ROWS };

/* v~, y~ and share of the load of springs from node i of the rule on.  A spring that the rounding
 * of the edge puts among those without reverse slip, and a lane behind the last node, has no
 * share. */
MU_INLINE void mu_springs_in_lanes(const mu_turning *at, const mumacro_driven_rule *rule, int64_t i,
                                   double v, double y, double reversed,
                                   double out[MU_NODE_ROWS][MU_LANES]) {
    const double least = mu_max(y, 1.0) / 1e300;
    for (int lane = 0; lane < MU_LANES; ++lane) {
        const double *point =
            rule->points + MU_DRIVEN_COLUMNS * (i + lane < rule->nodes ? i + lane : i);
        const double rest = reversed * point[0], s = mu_max(rest * (2.0 - rest), least);
        const double load = MU_MIDDLE * s;
        const int counts = y / load * at->travel > 2.0 && i + lane < rule->nodes;
        out[MU_NODE_V][lane] = counts ? v / load : at->x * 4.0 / at->travel;
        out[MU_NODE_Y][lane] = counts ? y / load : 4.0 / at->travel;
        out[MU_NODE_SHARE][lane] = counts ? load * reversed * point[1] : 0.0;
    }
}

/* Their shares of mu~, of its slopes and of the stick fraction, then of the bounds of these. */
MU_INLINE void mu_drive_lanes(const mu_turning *at, double nodes[MU_NODE_ROWS][MU_LANES],
                              double out[2 * MU_SUMS][MU_LANES]) {
    const mu_lanes v = mu_load(nodes[MU_NODE_V]), y = mu_load(nodes[MU_NODE_Y]);
    const mu_lanes share = mu_load(nodes[MU_NODE_SHARE]);
    const mu_reverse reverse = mu_reverse_of(at, y);
    const mu_lines line = mu_lines_of_reverse(at, v, y, &reverse);
    const mu_bounds bounds = mu_bound_reverse(at, v, y, &reverse, &line);
    mu_store(out[MU_SUM_MU], share * line.mu);
    mu_store(out[MU_SUM_V], share * line.along_v);
    mu_store(out[MU_SUM_Y], share * line.along_y);
    mu_store(out[MU_SUM_STICK], share * line.stick);
    mu_store(out[MU_SUMS + MU_SUM_MU], share * bounds.mu);
    mu_store(out[MU_SUMS + MU_SUM_V], share * bounds.along_v);
    mu_store(out[MU_SUMS + MU_SUM_Y], share * bounds.along_y);
    mu_store(out[MU_SUMS + MU_SUM_STICK], share * bounds.stick);
}

/* A ball with v~ < y~.  Its springs all turn at the same phase: those further out than
 * 1 - xi = `reversed` slip backwards, too. */
static mu_driven mu_drive_ball(const mumacro_data *data, double v, double y) {
    const mumacro_driven_rule *rule = &data->driven;
    const mu_turning at = mu_turning_of(v, y);
    const double last = 0.5 * at.travel * y / MU_MIDDLE, reversed = mu_outside(last);
    /* xi of the last spring without reverse slip; next the load of these */
    const double still = 1.0 - reversed;
    const double load = MU_MIDDLE * still * (1.0 - still * still / 3.0);
    const double ill = 1.0 + 2.0 * at.x * y / (y - v);
    const int falls = last > MU_NULL_ABOVE || (last < MU_NULL_BELOW && at.x > MU_NULL_SLOW);
    double nulls[MU_SUMS][MU_NULLS] = {{0.0}}, sums[2 * MU_SUMS] = {0.0};
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
                for (int j = 0; j < MU_NULLS; ++j) nulls[row][j] += point[2 + j] * rows[row][lane];
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
    out.bound += mu_missed(nulls[MU_SUM_MU], sums[MU_SUM_MU], falls);
    out.bound_v += mu_missed(nulls[MU_SUM_V], sums[MU_SUM_V], falls);
    out.bound_y += mu_missed(nulls[MU_SUM_Y], sums[MU_SUM_Y], falls);
    out.stick_bound += mu_missed(nulls[MU_SUM_STICK], sums[MU_SUM_STICK], falls);
    /* a spring at the edge may belong to the others: slopes jump */
    if (last < 1.0 + 4.0 * MU_LINE_ROUNDING * ill) {
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

static mu_driven mu_drive_inside(const mumacro_data *data, int contact, int direction, double v,
                                 double y) {
    return contact == MU_BALL && y < MU_HUGE ? mu_drive_ball(data, v, y)
                                             : mu_drive_spring(direction, v, y);
}

/* Any v~ and y~.  Where y~ - v~ has no digits it is not known whether the contact sticks: there a
 * bound is that a little inside, and the way from there. */
static mu_driven mu_drive(const mumacro_data *data, int contact, int direction, double v,
                          double y) {
    const double inside = y * (1.0 - 2.0 * MU_LINE_ROUNDING);
    mu_driven out = {mu_line_of_sliding(direction, v, y), 0.0, 0.0, 0.0, 0.0, 0.0}, near;
    const mu_line *line = &out.line;
    if (line->source < 0) {
        out.bound = out.bound_v = out.bound_y = out.power_bound = out.stick_bound = NAN;
        return out;
    }
    if (y == 0.0 || v > y * (1.0 + 2.0 * MU_ROUNDING)) return out;
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

/* --- any contact and direction ---------------------------------------------------------------- */

/* A quantity of a contact; the normal direction has z for y~ and no power: how far
 * the load moves is not modelled. */
static mu_answer mu_answer_as(const mumacro_data *data, int contact, int direction, int quantity,
                              double v, double y) {
    if (direction != MU_ACROSS) {
        const mu_driven driven = mu_drive(data, contact, direction, v, y);
        const mu_line *line = &driven.line;
        if (quantity == MU_MU_RATIO) return mu_limit(line->mu, driven.bound, line->source);
        if (quantity == MU_STICK) return mu_limit(line->stick, driven.stick_bound, line->source);
        if (quantity == MU_POWER && direction == MU_ALONG)
            return mu_limit(line->power, driven.power_bound, line->source);
        return mu_limit(NAN, NAN, -1);
    }
    { /* the same bits as in any array */
        int8_t source;
        mu_answer out;
        mu_values(data, contact, quantity, 1, &v, &y, &out.value, &out.bound, &source);
        return mu_limit(out.value, out.bound, source);
    }
}

static mu_slopes mu_slopes_of_driven(const mu_driven *driven) {
    const mu_line *line = &driven->line;
    const mu_slopes out = {line->mu,        line->along_v,   line->along_y,
                           driven->bound_v, driven->bound_y, driven->bound};
    return out;
}

static mu_slopes mu_slopes_as(const mumacro_data *data, int contact, int direction, double v,
                              double y) {
    if (direction != MU_ACROSS) {
        const mu_driven driven = mu_drive(data, contact, direction, v, y);
        return mu_slopes_of_driven(&driven);
    }
    return mu_slopes_at(data, contact, MU_MU_RATIO, v / MU_CONTACT[contact].middle,
                        y / MU_CONTACT[contact].middle);
}

/* d mu~ / d v~ at v~ = 0; along and normal it is h^2 / pi = pi for springs that
 * have not begun to slip backwards. */
static double mu_speed_slope_as(const mumacro_data *data, int contact, int direction, double y,
                                double *bound) {
    *bound = 0.0;
    if (direction == MU_ACROSS)
        return contact == MU_BALL ? mu_ball_speed_slope(data, y, bound)
                                  : mu_speed_slope_at_zero(data, y, bound);
    {
        const double v = MU_CREEP * mu_min(y, 1.0);
        const mu_driven driven = mu_drive(data, contact, direction, v, y);
        *bound = driven.bound_v / v;
        return driven.line.along_v / v;
    }
}
