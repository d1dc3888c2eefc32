/* The charts of a ball: which block a point (V, Y) belongs to, and its coordinates there. */

/* y~ at which the ray V/Y = MU_STEEPEST t enters stick-slip, over t: polynomials in t below 1/2, in
 * sqrt(1 - t) above, whose argument u goes from -1 to 1.  It is part of the coordinates: its digits
 * beyond 1e-12 need not be those of the border. */
#define MU_ENTRY_TERMS 16
static const double MU_ENTRY[2][MU_ENTRY_TERMS] = {
    {7.529899464123383e-10, 2.4142285702696728e-09, 4.948493741907489e-09, 1.6879631649285973e-08,
     6.150102362837686e-08, 2.1119908844307156e-07, 7.095534972216651e-07, 2.5532175635437814e-06,
     8.626187551030335e-06, 3.3865879736738795e-05, 0.00011005064762138997, 0.0005337395281198793,
     0.001511262080461144, 0.009896225581826578, 0.017001817731968186, 0.6785015000251045},
    {-5.3433841541453814e-08, 1.6773597041082783e-07, -3.189698578201631e-07, 1.158295431449945e-06,
     -4.008466442806854e-06, 1.3454389629138568e-05, -4.107945914865646e-05, 0.00013860849501784738,
     -0.00041719848030486324, 0.0013823139941749995, -0.004157581264692365, 0.013118432526599107,
     -0.038102689360241436, 0.11833323088165966, -0.24887213010763057, 0.866208341352021},
};

#define MU_ENTRY_WAY 0.6652518899328603 /* -d sqrt(1 - t) / d ln entry at t = 1 */

/* 0 < t <= 1, with sqrt(1 - t) where t >= 1/2. */
MU_INLINE mu_lanes mu_entry(mu_lanes t, mu_mask half, mu_lanes root) {
    const mu_lanes u = mu_select(half, mu_fma(t, mu_all(4.0), mu_all(-1.0)),
                                 mu_fma(root, mu_all(2.0 * MU_SQRT2), mu_all(-1.0)));
    mu_lanes sum = mu_select(half, mu_all(MU_ENTRY[0][0]), mu_all(MU_ENTRY[1][0]));
    for (int i = 1; i < MU_ENTRY_TERMS; ++i)
        sum = mu_fma(sum, u, mu_select(half, mu_all(MU_ENTRY[0][i]), mu_all(MU_ENTRY[1][i])));
    return t * sum;
}

/* d ln entry / d ln t at 0 < t < 1; and d ln entry / d sqrt(1 - t), which stays finite.  half: t is
 * in the first half. */
static double mu_entry_slope(double t, int half, double root, double *of_root) {
    const double *c = MU_ENTRY[half ? 0 : 1],
                 u = half ? 4.0 * t - 1.0 : 2.0 * MU_SQRT2 * root - 1.0;
    double sum = c[0], slope = 0.0;
    for (int i = 1; i < MU_ENTRY_TERMS; ++i) {
        slope = mu_fma1(slope, u, sum);
        sum = mu_fma1(sum, u, c[i]);
    }
    slope /= sum;
    if (half) {
        const double along = 1.0 + 4.0 * t * slope;
        *of_root = -2.0 * root / t * along;
        return along;
    }
    *of_root = 2.0 * MU_SQRT2 * slope - 2.0 * root / t;
    return root > 0.0 ? -0.5 * t / root * *of_root : HUGE_VAL;
}

/* (d ln entry / d root at root = sqrt(1 - t) - that at 0, which is at_end) / root, for t >= 1/2,
 * by division of polynomials, so nothing cancels next to root = 0. */
static double mu_entry_bend(double root, double at_end) {
    const double *c = MU_ENTRY[1], u = mu_fma1(2.0 * MU_SQRT2, root, -1.0);
    const double level = at_end / (2.0 * MU_SQRT2);
    double sum = c[0], quotient = -level * c[0], bend = quotient;
    for (int i = 1; i < MU_ENTRY_TERMS - 1; ++i) { /* (slope - level sum) / (u + 1) */
        quotient = (MU_ENTRY_TERMS - i) * c[i - 1] - level * c[i] - quotient;
        bend = mu_fma1(bend, u, quotient);
        sum = mu_fma1(sum, u, c[i]);
    }
    sum = mu_fma1(sum, u, c[MU_ENTRY_TERMS - 1]);
    return 8.0 * bend / sum - 2.0 / (1.0 - root * root);
}

/* x^(1/6), then 2 MU_FOLD_KNOT - MU_FOLD_SCALE sqrt(1 - x) from x = 1/2 on: from the sixth root of
 * x, and from the root of 1 - x. */
MU_INLINE mu_lanes mu_folded(mu_mask half, mu_lanes sixth_root, mu_lanes rest) {
    return mu_on_side(half, sixth_root, 2.0 * MU_FOLD_KNOT - MU_FOLD_SCALE * rest, MU_FOLD_KNOT);
}

/* The steepest ray as the table's border has it: where the two touch, a digit of one is the root of
 * a digit in Y. */
static double mu_steepest_of(const mumacro_data *data) {
    return mu_border(data, MU_STEEPEST_Y, NULL, NULL) / MU_STEEPEST_Y;
}

/* As mu_place_common, of a ball. */
MU_INLINE mu_places mu_place_ball(double steepest, mu_lanes v, mu_lanes y, mu_lanes crit,
                                  mu_lanes ln_y) {
    const mu_lanes rho = v / crit, t = v / (steepest * y), one = mu_all(1.0), zero = mu_all(0.0);
    const mu_mask above = MU_WHERE(rho >= 1.0), low = MU_WHERE(y <= MU_STEEPEST_Y);
    const mu_mask slides = above & (~low | MU_WHERE(t >= 1.0)), ring = above & ~slides;
    const mu_mask slow = slides & low & MU_WHERE(v < MU_SLOW), fast_low = slides & low & ~slow;
    const mu_mask small = ~above & low, lowest = small & MU_WHERE(y <= MU_Y_STICK_LO);
    /* first coordinates that are folded or a sixth root */
    const mu_lanes x = mu_select(slow, v / MU_SLOW, mu_select(ring, t, y));
    const mu_mask half = ~ring | MU_WHERE(x < 0.5);
    const mu_lanes root = mu_sqrt(mu_select(half, x, 1.0 - x));
    const mu_lanes entry =
        mu_entry(mu_select(ring, t, one), half & ring, mu_select(ring, root, zero));
    const mu_lanes on_ray = y / entry, beyond = mu_higher(on_ray - 1.0, zero);
    /* where the last digits of t have y~ beyond the entry, the ray gives way: at fixed y~ a
     * quantity depends on root by its square only */
    const mu_lanes nearer = mu_fma(beyond, mu_all(-MU_ENTRY_WAY), root);
    const mu_lanes sixth = mu_cube_root(root);
    const mu_lanes first = mu_select(ring, mu_folded(half, sixth, mu_higher(nearer, zero)), sixth);
    /* second ones */
    const mu_lanes way = mu_lower(on_ray, one), z = mu_select(ring, way, rho);
    const mu_mask half_z = MU_WHERE(z < 0.5);
    const mu_lanes root_z = mu_sqrt(mu_select(slides, one, mu_select(half_z, z, 1.0 - z)));
    const mu_lanes second = mu_folded(half_z, mu_cube_root(root_z), root_z),
                   sigma = mu_sigma(half_z, root_z);
    const mu_lanes share = mu_share(v, y, slides, low), log = mu_log(mu_select(low, v, rho)),
                   squared = y * y;
    const mu_lanes hypotenuse = mu_sqrt(v * v * share);
    const mu_lanes level =
        mu_select(lowest, 0.375 * ln_y, 0.1875 * log); /* the logarithm of small amplitudes */
    const mu_mask deep = slow | ring | lowest;
    const mu_mask of_low =
        mu_select_whole(fast_low, mu_all_whole(MU_B_LOW), mu_all_whole(MU_B_SLOW));
    const mu_mask corner = MU_WHERE(sigma < MU_SIGMA_CUT);
    const mu_mask of_small = mu_select_whole(
        lowest, mu_all_whole(MU_B_S_LOW),
        mu_select_whole(corner, mu_all_whole(MU_B_CORNER), mu_all_whole(MU_B_S_MID)));
    const mu_mask of_high =
        mu_select_whole(above, mu_all_whole(MU_B_MID_1), mu_all_whole(MU_B_S_MID_1)) -
        MU_WHERE(y > MU_Y_MID) - MU_WHERE(y > MU_Y_HIGH);
    const mu_mask far = ~low & MU_WHERE(rho > MU_RHO_MAX);
    mu_places out;
    out.a = mu_select(low, mu_select(deep, first, mu_select(fast_low, squared, y)), ln_y);
    out.b = mu_select(slides, mu_select(low, mu_select(slow, 1.0 / (t * t), 1.0 - share), log),
                      mu_select(ring | lowest, second, sigma));
    out.base = mu_select(deep, mu_fma(squared, level, one), mu_select(fast_low, one, zero));
    out.factor = mu_select(deep, -squared,
                           mu_select(low, mu_select(fast_low, -0.25 * squared * share, one),
                                     mu_select(slides, hypotenuse, v * share)));
    out.block = mu_select_whole(
        low,
        mu_select_whole(slides, of_low, mu_select_whole(ring, mu_all_whole(MU_B_RING), of_small)),
        of_high);
    out.block = mu_select_whole(far, mu_all_whole(MU_B_FAST), out.block);
    return out;
}

/* Corner coordinates: R as of one spring, and the cube root of tan((pi/2 - psi)/2). */
static void mu_place_ball_corner(mu_place *at) {
    const double phi = mu_normal_form_root(at->v, at->y - 1.0),
                 root = sqrt(2.0 * MU_PI * at->v / phi);
    at->phi = phi;
    at->a = sqrt(0.5 * root * root + 2.0 * phi * phi);
    at->b = mu_first(mu_cube_root(mu_all(root / (MU_SQRT2 * at->a + 2.0 * phi))));
}

static void mu_place_in_corner(mu_place *at) {
    if (at->block == MU_CORNER) mu_place_corner(at);
    if (at->block == MU_B_CORNER) mu_place_ball_corner(at);
}

/* d b / d ln x of a folded coordinate. */
MU_INLINE double mu_fold_slope(double b) {
    const double root = mu_max((2.0 * MU_FOLD_KNOT - b) / MU_FOLD_SCALE, 1e-9);
    return mu_is_first_half(b, MU_FOLD_KNOT) ? b / 6.0
                                             : 0.5 * MU_FOLD_SCALE * (1.0 - root * root) / root;
}

static mu_turn mu_turn_of_ring(const mu_place *at) {
    const double cube = at->a * at->a * at->a, left = (2.0 * MU_FOLD_KNOT - at->a) / MU_FOLD_SCALE;
    const int half = mu_is_first_half(at->a, MU_FOLD_KNOT);
    const double t = half ? cube * cube : 1.0 - left * left;
    const double root = half ? sqrt(1.0 - t) : mu_max(left, 1e-9);
    double of_root;
    const double tilt = mu_entry_slope(t, half, root, &of_root), a = mu_fold_slope(at->a),
                 b = mu_fold_slope(at->b);
    const mu_turn out = {a,   -a,    -tilt * b,  (1.0 + tilt) * b,   0.0,
                         0.0, -tilt, 1.0 + tilt, 2.0 * MU_FOLD_KNOT, MU_FOLD_SCALE};
    return out;
}

static mu_turn mu_turn_of_ball_corner(const mu_place *at) {
    mu_turn out =
        mu_turn_corner(at); /* whose b is that of one spring at b = 0; only R and phi are taken */
    const double phi = at->phi, root = sqrt(2.0 * MU_PI * at->v / phi);
    /* tan((pi/2 - psi)/2) = p^3: its slope is -(1 + p^6)/2 d psi, with tan psi = 2 phi / s0 */
    const double cube = root / (MU_SQRT2 * at->a + 2.0 * phi),
                 share = 0.5 * phi * root / (at->a * at->a);
    const double turn_v = share * (1.5 * out.phi_v - 0.5), turn_y = share * 1.5 * out.phi_y;
    const double of_b = -(1.0 + cube * cube) / (6.0 * at->b * at->b);
    out.b_v = of_b * 2.0 * turn_v;
    out.b_y = of_b * 2.0 * turn_y;
    return out;
}

/* Whether a place of a ball is next to the ridge, where the steepest ray touches the border. */
MU_INLINE int mu_is_ridge(const mu_place *at) {
    return fabs(at->y - MU_STEEPEST_Y) < 0.01 && fabs(at->v - MU_SLOW) < 0.01;
}
