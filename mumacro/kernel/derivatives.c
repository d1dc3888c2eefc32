/* Derivatives along v~ and y~ themselves, for automatic differentiation.
 *
 * First ones: the slopes along ln v~ and ln y~ over v~ and y~, one-sided at v~ = 0.  Second ones: differences of those
 * slopes over steps of MU_STEP in the logarithms, of fourth order, all on one side of the border. */

#define MU_STEP 2e-3

/* e^x - 1 to rounding for |x| <= 4 MU_STEP. */
static double mu_growth(double x) {
    return x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0)))));
}

static void mu_partials(const mumacro_data *data, int quantity, int64_t n, const double *v, const double *y,
                        double *along_v, double *along_y) {
    for (int64_t i = 0; i < n; i += MU_CHUNK) {
        const int few = mu_few(n - i);
        double rows[5][MU_CHUNK];
        mu_slopes_of_points(data, quantity, few, v + i, y + i, rows[0], MU_CHUNK);
        for (int j = 0; j < few; ++j) {
            const double speed = v[i + j], amplitude = y[i + j], by_v = rows[1][j], by_y = rows[2][j];
            const int rest = speed == 0.0 && by_v == by_v;
            along_v[i + j] = rest ? MU_QUANTITY[quantity].from_rest(data, amplitude) : by_v / speed;
            along_y[i + j] = amplitude == 0.0 ? 0.0 * by_y : by_y / amplitude; /* even in y~ */
        }
    }
}

/* Derivatives of both slopes along one logarithm: central, or towards `side` where the border is near. */
static void mu_bend(const mumacro_data *data, int quantity, double v, double y, double step_v, double step_y, int side,
                    double *out) {
    static const double central[5] = {1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0};
    static const double forward[5] = {-25.0 / 12.0, 4.0, -3.0, 4.0 / 3.0, -0.25};
    const double step = step_v + step_y, sign = side ? (double)side : 1.0;
    out[0] = out[1] = 0.0;
    for (int i = 0; i < 5; ++i) {
        const double weight = (side ? sign * forward[i] : central[i]) / step;
        const double at = side ? sign * i : i - 2;
        mu_slopes beside;
        if (weight == 0.0) continue;
        beside = mu_slopes_at(data, quantity, v * (1.0 + mu_growth(at * step_v)), y * (1.0 + mu_growth(at * step_y)));
        out[0] += weight * beside.along_v;
        out[1] += weight * beside.along_y;
    }
}

/* The direction of a step that stays on this side of the border; 0 where both do. */
static int mu_free_side(const mumacro_data *data, double v, double y, double step_v, double step_y) {
    const int here = v < mu_border_at(data, y);
    int same[2];
    for (int i = 0; i < 2; ++i) {
        const double way = i ? 2.0 : -2.0;
        const double crit = mu_border_at(data, y * (1.0 + mu_growth(way * step_y)));
        same[i] = here == (v * (1.0 + mu_growth(way * step_v)) < crit);
    }
    return same[0] && same[1] ? 0 : same[1] ? 1 : -1;
}

/* d2/dv~2, d2/dv~ dy~, d2/dy~2; NaN where v~ = 0, or a point is illegal or infinite. */
static void mu_bends_at(const mumacro_data *data, int quantity, double v, double given, double *out) {
    /* at y~ = 0 the limit y~ -> 0; next to the corner v~ -> 0, y~ = 1 all changes over |y~ - 1| + phi^2, phi of
     * y~ = 1, the cube root of pi v~ */
    const double y = mu_max(given, 1e-6);
    double along_v[2], along_y[2], phi, step;
    mu_slopes here;
    out[0] = out[1] = out[2] = NAN;
    if (!(v > 0.0 && v < HUGE_VAL && given >= 0.0 && given < HUGE_VAL)) return;
    phi = mu_normal_form_root(mu_min(v, 1.0), 0.0);
    step = MU_STEP * mu_min(1.0, fabs(y - 1.0) + 0.5 * phi * phi);
    here = mu_slopes_at(data, quantity, v, y);
    mu_bend(data, quantity, v, y, MU_STEP, 0.0, mu_free_side(data, v, y, MU_STEP, 0.0), along_v);
    mu_bend(data, quantity, v, y, 0.0, step, mu_free_side(data, v, y, 0.0, step), along_y);
    out[0] = given == 0.0 ? 0.0 : (along_v[0] - here.along_v) / v / v;
    out[1] = given == 0.0 ? 0.0 : along_v[1] / v / y;
    out[2] = (along_y[1] - here.along_y) / y / y;
}

static void mu_bends(const mumacro_data *data, int quantity, int64_t n, const double *v, const double *y, double *vv,
                     double *vy, double *yy) {
    for (int64_t i = 0; i < n; ++i) {
        double bends[3];
        mu_bends_at(data, quantity, v[i], y[i], bends);
        vv[i] = bends[0];
        vy[i] = bends[1];
        yy[i] = bends[2];
    }
}
