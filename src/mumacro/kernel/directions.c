/* Oscillation along the sliding direction and of the normal force: one spring,
 * in closed form but for one root.
 *
 * along   the upper point moves with v~ + y~ cos tau, -1 <= u <= 1.  While it moves backwards,
 *         over 2 c with cos c = x = v~/y~, it travels D = 2 y~ (sin c - c cos c).  For D <= 2 the
 *         spring sticks over 2 h until it is where it turned, so mu~ = 1 - y~ (1 - N0(x)); for
 *         D > 2 it slips backwards, too.
 * normal  the upper point moves with v~ under the limit 1 + z cos tau, z = Fz_amplitude / Fz < 1:
 *         the same function, mu~ = 1 - z (1 - N0(v~/z)).
 *
 * N0 is master_curve_limit in mumacro/closed_forms.py; with half the duration of stick, h,
 *     cos c = sin^2 h / R,   1 - N0 = (sin h - h cos h)^2 / (pi R),
 *     R^2 = (h - sin h cos h)^2 + sin^4 h. */

enum { MU_ACROSS, MU_ALONG, MU_NORMAL, MU_DIRECTIONS };

/* What one spring does; slopes are along ln v~ and ln y~ (normal: ln z); stick is a share of the
 * period; terms is the sum of the absolute values that mu is the sum of, for its rounding. */
typedef struct {
    double mu, along_v, along_y, stick, power, terms;
    int source;
} mu_line;

/* sin m, cos m, 1 - cos m, m - sin m, sin m - m cos m and m - sin m cos m for
 * 0 <= m <= pi, each off by at most 1e-15 of itself: no digits cancel. */
typedef struct {
    mu_lanes sine, cosine, versed, lag, bent, rest;
} mu_arcs;

MU_INLINE mu_arcs mu_arcs_of(mu_lanes m) {
    /* (1 - sin m / m) / m^2; its terms times 2, 4, 6, ... are those of (sin m - m cos m) / m^3 */
    static const double series[11] = {
        3.868170170630684e-23,   -1.9572941063391263e-20, 8.22063524662433e-18,
        -2.8114572543455206e-15, 7.647163731819816e-13,   -1.6059043836821613e-10,
        2.505210838544172e-08,   -2.7557319223985893e-06, 0.0001984126984126984,
        -0.008333333333333333,   0.16666666666666666,
    };
    const mu_mask far = MU_WHERE(m > 0.5 * MU_PI);
    const mu_lanes d = mu_select(far, (MU_PI - m) + 1.2246467991473532e-16, m), q = d * d;
    mu_lanes u = mu_all(series[0]), t = mu_all(22.0 * series[0]), cosine;
    mu_arcs out;
    for (int i = 1; i < 11; ++i) {
        u = mu_fma(u, q, mu_all(series[i]));
        t = mu_fma(t, q, mu_all((22.0 - 2.0 * i) * series[i]));
    }
    out.sine = d * (1.0 - q * u);
    out.versed = q * (u + t);
    cosine = 1.0 - out.versed;
    out.cosine = mu_select(far, -cosine, cosine);
    out.versed = mu_select(far, 1.0 + cosine, out.versed);
    out.lag = mu_select(far, m - out.sine, d * q * u);
    out.bent = mu_select(far, out.sine - m * out.cosine, d * q * t);
    out.rest =
        mu_select(far, m - out.sine * out.cosine, d * q * (u * (2.0 - q * u) + (1.0 - q * u) * t));
    return out;
}

/* Those of one angle that are needed alone. */
typedef struct {
    double sine, cosine, bent, rest;
} mu_arc;

static mu_arc mu_arc_of(double m) {
    const mu_arcs of = mu_arcs_of(mu_all(m));
    const mu_arc out = {mu_first(of.sine), mu_first(of.cosine), mu_first(of.bent),
                        mu_first(of.rest)};
    return out;
}

/* arcsin x for 0 <= x <= 1, off by at most 7e-16 of itself. */
MU_INLINE mu_lanes mu_arcsines(mu_lanes x) {
    /* arcsin(x)/x in x^2 up to 1/4: interpolated at 16 Chebyshev points, highest power first */
    static const double series[16] = {
        0.03485960124195166,  -0.03164232760578032, 0.028856087526518862, -0.002711145590491113,
        0.009796130641150287, 0.007910687786082768, 0.009828794225546476, 0.011544945401300811,
        0.013965349878854743, 0.01735273787150877,  0.022372160049880758, 0.03038194442177626,
        0.04464285714318035,  0.07499999999999758,  0.16666666666666669,  1.0,
    };
    const mu_mask far = MU_WHERE(x > 0.5);
    const mu_lanes q = mu_select(far, 0.5 * (1.0 - x), x * x), root = mu_select(far, mu_sqrt(q), x);
    mu_lanes sum = mu_all(series[0]);
    for (int i = 1; i < 16; ++i) sum = mu_fma(sum, q, mu_all(series[i]));
    return mu_select(far, 0.5 * MU_PI - 2.0 * root * sum, root * sum);
}

static double mu_arcsine(double x) { return mu_first(mu_arcsines(mu_all(x))); }

/* x = v~/a below 1, sin c, c = arccos x, b = arcsin x and D / a = 2 (sin c - c
 * cos c), with the digits of a - v~. */
typedef struct {
    double x, sine, c, b, travel;
} mu_turning;

static mu_turning mu_turning_of(double v, double a) {
    const double gap = (a - v) / a;
    const int near = gap < 0.5;
    const double angle = mu_arcsine(near ? sqrt(0.5 * gap) : v / a);
    mu_turning out;
    out.x = v / a;
    out.sine = sqrt(gap * (1.0 + out.x));
    out.b = near ? 0.5 * MU_PI - 2.0 * angle : angle;
    out.c = near ? 2.0 * angle : 0.5 * MU_PI - angle;
    out.travel = 2.0 * mu_arc_of(out.c).bent;
    return out;
}

/* Half the duration of stick, h, of N0, and dc/dh there. */
typedef struct {
    double h, slope;
} mu_stuck;

/* Newton's method for the angle c(h) with tan c = (h - sin h cos h) / sin^2 h; 7 steps at most. */
static mu_stuck mu_half_stick(const mu_turning *at) {
    const double start = 0.5 * at->b + sqrt(0.25 * at->b * at->b + MU_PI * at->b);
    double h = at->c < 0.3 ? 1.5 * at->c : MU_PI - mu_min(start, MU_PI);
    mu_stuck out = {MU_PI - sqrt(MU_PI * at->x), 2.0 * sqrt(at->x / MU_PI)};
    if (at->x < 1e-18) return out;
    for (int i = 0; i < 20; ++i) {
        const mu_arc arc = mu_arc_of(h);
        const double square = arc.sine * arc.sine, norm = arc.rest * arc.rest + square * square;
        /* sin(c(h) - c) times the root of norm */
        const double off = arc.rest * at->x - square * at->sine;
        const double tilt = 2.0 * arc.sine * (square * arc.sine - arc.cosine * arc.rest);
        const double step = off * sqrt(norm) / tilt * (1.0 + off * off / (6.0 * norm));
        const double next = h - step;
        h = next > MU_PI ? 0.5 * (h + MU_PI) : next < 0.5 * h ? 0.5 * h : next;
        out.slope = tilt / norm;
        /* slow speeds: pi - h is what changes */
        if (fabs(step) < 1e-9 * mu_min(h, MU_PI - h)) break;
    }
    out.h = h;
    return out;
}

/* 1 - N0(x) for half the duration of stick h. */
static double mu_master_deficit(double h) {
    const mu_arc arc = mu_arc_of(h);
    const double square = arc.sine * arc.sine;
    return h > 0.0 ? arc.bent * arc.bent / (MU_PI * sqrt(arc.rest * arc.rest + square * square))
                   : 0.0;
}

/* Both kinds of stick-slip without reverse slip; envelope theorem: d mu~/d v~ = h^2/pi. */
static mu_line mu_line_of_stick(double v, double a, double h, int source) {
    const double deficit = a * mu_master_deficit(h);
    mu_line out;
    out.mu = 1.0 - deficit;
    out.terms = 1.0 + deficit;
    out.along_v = v * h * h / MU_PI;
    out.along_y = -(deficit + out.along_v);
    out.stick = h / MU_PI;
    /* heat is what slip takes, v~ in all, less the work of the drive, v~ mu~ */
    out.power = v * deficit;
    out.source = source;
    return out;
}

/* Reverse slip: the spring sticks over m + p after the first turn and over m - p after the second,
 * on which both follow from x = cos c: cos(c - p) = x m / sin m, and F(m) = sin c - cos m
 * sin(c - p) - p cos c = 2/y~.  Springs of the same turning, one in each lane. */
typedef struct {
    mu_lanes m, p, bent, of_p; /* bent = 1 - m cot m; of_p = dp/dm */
    mu_lanes left, slope;      /* F(m) and its slope, infinite and 0 beyond the end */
} mu_reverse;

MU_INLINE mu_reverse mu_reverse_at(const mu_turning *at, mu_lanes m) {
    const mu_arcs arc = mu_arcs_of(m);
    const mu_lanes more = arc.lag / arc.sine, cosine = at->x * (1.0 + more), zero = mu_all(0.0);
    const mu_mask legal = MU_WHERE(arc.sine > 0.0) & MU_WHERE(cosine <= 1.0);
    const mu_lanes root = mu_sqrt(mu_select(legal, (1.0 - cosine) * (1.0 + cosine), mu_all(1.0)));
    /* sin c - sin(c - p) */
    const mu_lanes apart = at->x * more * (at->x + cosine) / (at->sine + root);
    const mu_lanes turn = at->x * (arc.versed - arc.cosine * more), steep = arc.sine * root;
    const mu_lanes lead = mu_lower(at->x * (more * at->sine + apart), mu_all(1.0));
    mu_reverse out;
    out.m = m;
    out.p = mu_select(legal, mu_arcsines(lead), zero);
    out.bent = mu_select(legal, arc.bent / arc.sine, zero);
    out.of_p = mu_select(legal, at->x * out.bent / steep, mu_all(1.0));
    out.left = mu_select(legal, apart + arc.versed * root - out.p * at->x, mu_all(HUGE_VAL));
    out.slope =
        mu_select(legal & MU_WHERE(m + out.p < 2.0 * at->c), steep - turn * turn / steep, zero);
    return out;
}

/* m for rigid contact, nearly: where Newton's method may start. */
MU_INLINE mu_lanes mu_reverse_start(mu_lanes a) {
    return 2.0 * mu_arcsines(mu_lower(1.0 / mu_sqrt(a), mu_all(1.0)));
}

/* m by Newton's method between bounds; where D is near 2 the root is double, but mu~ is stationary
 * in m.  A lane that has its root keeps it. */
static mu_reverse mu_reverse_of(const mu_turning *at, mu_lanes a) {
    mu_lanes low = mu_all(0.0), high = mu_all(MU_PI), m = mu_reverse_start(a);
    mu_mask done = mu_all_whole(0);
    for (int i = 0; i < 100 && !mu_is_everywhere(done); ++i) {
        const mu_reverse reverse = mu_reverse_at(at, m);
        const mu_lanes off = reverse.left - 2.0 / a, newton = m - off / reverse.slope;
        const mu_mask above = MU_WHERE(off > 0.0) | ~MU_WHERE(reverse.slope > 0.0);
        mu_lanes next;
        high = mu_select(above, m, high);
        low = mu_select(above, low, m);
        next = mu_select(MU_WHERE(newton >= low) & MU_WHERE(newton <= high), newton,
                         0.5 * (low + high));
        next = mu_select(done, m, next);
        done |= MU_WHERE(mu_size(next - m) <= 1e-10 * next);
        m = next;
    }
    return mu_reverse_at(at, m);
}

/* a times the integral of the way back (way 1) or forth (-1) since the
 * turn, over the stick s after it. */
MU_INLINE mu_lanes mu_way_in_stick(const mu_turning *at, mu_lanes a, mu_lanes s, double way) {
    /* of (s^2/2 - 1 + cos s) / s^4 */
    static const double series[9] = {
        4.110317623312165e-19,   -1.5619206968586225e-16, 4.779477332387385e-14,
        -1.1470745597729725e-11, 2.08767569878681e-09,    -2.7557319223985894e-07,
        2.48015873015873e-05,    -0.001388888888888889,   0.041666666666666664,
    };
    const mu_arcs arc = mu_arcs_of(s);
    const mu_lanes q = s * s;
    mu_lanes dip = mu_all(series[0]);
    for (int i = 1; i < 9; ++i) dip = mu_fma(dip, q, mu_all(series[i]));
    dip = mu_select(MU_WHERE(s > 1.0), (0.5 * q - arc.versed) / (q * q), dip);
    return a * (at->sine * arc.lag - way * at->x * dip * q * q);
}

/* mu_line's rows of springs that slip backwards, too. */
typedef struct {
    mu_lanes mu, along_v, along_y, stick, terms;
} mu_lines;

MU_INLINE mu_lines mu_lines_of_reverse(const mu_turning *at, mu_lanes v, mu_lanes a,
                                       const mu_reverse *reverse) {
    const mu_lanes m = reverse->m, p = reverse->p, both = m * m + p * p;
    const mu_lanes sweep = 2.0 / MU_PI * (at->b + p); /* of rigid contact, for p = 0 */
    const mu_mask rigid = MU_WHERE(a > 1e100); /* nothing to rounding, while m^3 underflows */
    mu_lanes layers, size; /* what stick adds, and the sum of its absolute terms */
    mu_lines out;
    if (at->x < 0.5) {
        const mu_lanes first = at->x * both, second = 2.0 * at->x * reverse->bent;
        const mu_lanes third = 2.0 * p * at->sine;
        layers = a * (first - second - third);
        size = a * (first + second + third);
    } else {
        const mu_lanes back = mu_way_in_stick(at, a, m - p, -1.0);
        const mu_lanes forth = mu_way_in_stick(at, a, m + p, 1.0);
        layers = back - forth;
        size = mu_size(back) + mu_size(forth);
    }
    layers = mu_select(rigid, mu_all(0.0), layers);
    size = mu_select(rigid, mu_all(0.0), size);
    out.terms = sweep + size / (2.0 * MU_PI);
    out.mu = mu_lower(mu_higher(sweep + layers / (2.0 * MU_PI), mu_all(0.0)), mu_all(1.0));
    out.along_v = v * both / (2.0 * MU_PI);
    out.along_y = layers / (2.0 * MU_PI) - out.along_v;
    out.stick = m / MU_PI;
    return out;
}

static mu_line mu_line_of_reverse(const mu_turning *at, double v, double a, const mu_lines *rows) {
    mu_line out;
    out.mu = mu_first(rows->mu);
    out.along_v = mu_first(rows->along_v);
    out.along_y = mu_first(rows->along_y);
    out.stick = mu_first(rows->stick);
    out.terms = mu_first(rows->terms);
    out.power = v * (1.0 - out.mu) + (a * at->travel - 2.0) / MU_PI;
    out.source = MU_ALONG_REVERSES;
    return out;
}

/* Whether a spring slips backwards, too, and for which turning. */
static int mu_is_reversing(int direction, const mu_turning *at, double y) {
    return direction == MU_ALONG && y * at->travel > 2.0;
}

/* One spring that slips all the time, or does not oscillate; NaN and -1
 * where illegal.  The others follow. */
static mu_line mu_line_of_sliding(int direction, double v, double y) {
    mu_line out = {
        1.0, 0.0, 0.0, 0.0, 0.0, 1.0, direction == MU_NORMAL ? MU_NORMAL_SLIDES : MU_ALONG_SLIDES};
    if (!(v >= 0.0 && y >= 0.0 && y < (direction == MU_NORMAL ? 1.0 : HUGE_VAL))) {
        out.mu = out.along_v = out.along_y = out.stick = out.power = NAN;
        out.source = -1;
    } else if (y == 0.0)
        out.source = MU_NO_OSCILLATION;
    return out;
}
