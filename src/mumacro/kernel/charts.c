/* The charts: which block a point belongs to, and its coordinates there. */

/* A point in its block: coordinates (a, b), v~crit and its tilt; phi in the corner only. */
typedef struct {
    int block;
    double v, y, a, b, phi, crit;
    mu_tilt tilt;
} mu_place;

/* The corner, where a and b are polar. */
MU_INLINE int mu_is_corner(int64_t block) { return block == MU_CORNER || block == MU_B_CORNER; }

/* Whether springs slide all the time in a block: in all of a ball's, but for those of partial
 * slip. */
MU_INLINE int mu_is_sliding_block(int block) {
    return mu_is_ball(block) ? block < MU_B_RING : block < MU_S_LOW;
}

/* --- coordinates with two halves -------------------------------------------------------------- */

/* A folded coordinate has one formula in its first half and another in its second.  The knot
 * between them is an edge of cells, and the slope of the coordinate may jump there.  So the half is
 * decided once, by the point: the coordinate is at the knot at most in the first half, and above it
 * in the second by as much as cells are counted short of their ends (polynomials.py), with two
 * digits for rounding.  Cell and slope then follow from the coordinate. */
#define MU_PAST_KNOT 8.881784197001252e-16 /* 2^-50 */

MU_INLINE mu_lanes mu_on_side(mu_mask half, mu_lanes first, mu_lanes second, double knot) {
    return mu_select(half, mu_lower(first, mu_all(knot)),
                     mu_higher(second, mu_all(knot + MU_PAST_KNOT)));
}

MU_INLINE int mu_is_first_half(double b, double knot) { return b <= knot; }

/* sigma stands for s: sqrt(rho), then sqrt 2 - sqrt(1 - rho) from rho = 1/2 on, from the root of
 * rho or of 1 - rho; both square-root edges become smooth for one root. */
#define MU_SIGMA_KNOT (0.5 * MU_SQRT2)

MU_INLINE mu_lanes mu_sigma(mu_mask half, mu_lanes root) {
    return mu_on_side(half, root, MU_SQRT2 - root, MU_SIGMA_KNOT);
}

static double mu_sigma_of(double rho) {
    const mu_mask half = mu_all_whole(rho < 0.5 ? -1 : 0);
    return mu_first(mu_sigma(half, mu_all(sqrt(rho < 0.5 ? rho : 1.0 - rho))));
}

/* d sigma / d ln rho; in the last 1e-9 below the border that 1e-9 below it. */
MU_INLINE double mu_sigma_slope(double sigma) {
    const double root = mu_max(MU_SQRT2 - sigma, 1e-9);
    return mu_is_first_half(sigma, MU_SIGMA_KNOT) ? 0.5 * sigma : 0.5 * (1.0 - root * root) / root;
}

/* --- many points: selections, no branches ----------------------------------------------------- */

/* The one quotient of all common charts: 1/(1 + v~^2), 1/(v~^2 + y~^2) or, in stick-slip, 1/y~. */
MU_INLINE mu_lanes mu_share(mu_lanes v, mu_lanes y, mu_mask sliding, mu_mask small) {
    const mu_lanes square = mu_fma(v, v, mu_select(small, mu_all(1.0), y * y));
    return 1.0 / mu_select(sliding, square, y);
}

/* base and factor of mu~ in a common chart; in continuous sliding root = v~ sqrt(share).
 *
 * continuous, y~ <= 1.5:   mu~ = 1 - q y~^2 / (4 (1 + v~^2)), eq. (31)
 * continuous, above:       mu~ = q / sqrt(1 + y~^2/v~^2)
 * stick-slip, y~ <= 0.75:  mu~ = 1 - q y~^2
 * stick-slip, y~ <= 1.5:   mu~ = q
 * stick-slip, above:       mu~ = q v~/y~ */
MU_INLINE void mu_ratio_form(mu_lanes v, mu_lanes y, mu_mask sliding, mu_mask small, mu_mask lowest,
                             mu_lanes share, mu_lanes root, mu_lanes *base, mu_lanes *factor) {
    const mu_mask deficit = lowest | (small & sliding);
    const mu_lanes of_deficit = y * y * mu_select(sliding, -0.25 * share, mu_all(-1.0));
    const mu_lanes of_value = mu_select(sliding, root, mu_select(small, mu_all(1.0), v * share));
    *base = mu_select(deficit, mu_all(1.0), mu_all(0.0));
    *factor = mu_select(deficit, of_deficit, of_value);
}

typedef struct {
    mu_lanes a, b, base, factor; /* mu~ = base + factor q(a, b) */
    mu_mask block;
} mu_places;

/* The blocks of points with 0 < y~ <= MU_Y_TAIL, v~ > 0.  MU_CORNER and
 * MU_FAST come without coordinates. */
MU_INLINE mu_places mu_place_common(mu_lanes v, mu_lanes y, mu_lanes crit, mu_lanes ln_y) {
    const mu_lanes rho = v / crit, squared = y * y;
    const mu_mask sliding = MU_WHERE(rho >= 1.0), half = MU_WHERE(rho < 0.5);
    const mu_mask small = MU_WHERE(y <= MU_Y_CONT), lowest = MU_WHERE(y <= MU_Y_STICK_LO);
    /* one division and one root do for all blocks */
    const mu_lanes share = mu_share(v, y, sliding, small);
    const mu_lanes root =
        mu_sqrt(mu_select(sliding, v * v * share, mu_select(half, rho, 1.0 - rho)));
    const mu_lanes sigma = mu_sigma(half, root);
    const mu_lanes beyond = mu_select(small, 1.0 - share, mu_log(rho));
    /* -1 where true: what is counted is subtracted */
    const mu_mask of_regime =
        mu_select_whole(sliding, mu_all_whole(0), mu_all_whole(MU_S_LOW) - ~lowest - ~small);
    const mu_mask block = of_regime - ~small - MU_WHERE(y > MU_Y_MID) - MU_WHERE(y > MU_Y_HIGH);
    const mu_mask near = small | MU_WHERE(rho <= MU_RHO_MAX);
    const mu_mask off_corner = ~small | lowest | MU_WHERE(sigma >= MU_SIGMA_CUT) | sliding;
    mu_places out;
    mu_ratio_form(v, y, sliding, small, lowest, share, root, &out.base, &out.factor);
    out.a = mu_select(small & ~lowest & ~sliding, y, mu_select(small, squared, ln_y));
    out.b = mu_select(sliding, beyond, sigma);
    out.block =
        mu_select_whole(near & off_corner, block,
                        mu_select_whole(small, mu_all_whole(MU_CORNER), mu_all_whole(MU_FAST)));
    return out;
}

/* Whether mu_place_common handles the points: legal, above zero,
 * neither extreme nor beyond MU_Y_TAIL. */
MU_INLINE mu_mask mu_is_common(mu_lanes v, mu_lanes y) {
    return MU_WHERE(v > 1e-290) & MU_WHERE(v < 1e150) & MU_WHERE(y > 1e-150) &
           MU_WHERE(y <= MU_Y_TAIL);
}

/* --- one point -------------------------------------------------------------------------------- */

/* Positive root phi of phi^3 + 2 eta phi = pi v~, v~ > 0: a guess right in every limit, off by 28 %
 * at most, then Halley's method; three steps of third order take that to rounding. */
static double mu_normal_form_root(double v, double eta) {
    const double c = MU_PI * v, p = 2.0 * eta, root = mu_cube_root_near(c);
    double phi = eta >= 0.0 ? c / (p + root * root) : sqrt(root * root - p);
    for (int i = 0; i < 3; ++i) {
        const double slope = 3.0 * phi * phi + p, newton = (phi * (phi * phi + p) - c) / slope;
        phi -= newton / (1.0 - 3.0 * phi * newton / slope);
    }
    return phi;
}

/* Corner coordinates (R, tan(psi/2)): R sin psi = sqrt 2 phi, R cos psi = s0/sqrt 2,
 * s0^2 = 2 pi v~/phi.  The tangent of half the angle is analytic in it, runs from 0 to 1
 * as well, and costs a division. */
static void mu_place_corner(mu_place *at) {
    const double phi = mu_normal_form_root(at->v, at->y - 1.0), squared = 2.0 * MU_PI * at->v / phi;
    at->phi = phi;
    at->a = sqrt(0.5 * squared + 2.0 * phi * phi);
    at->b = 2.0 * phi / (MU_SQRT2 * at->a + sqrt(squared));
}

/* Derivatives of a chart's coordinates along ln v~ and ln y~. */
typedef struct {
    double a_v, a_y, b_v, b_y;
    double phi_v, phi_y;   /* of ln phi, in the corner */
    double edge_v, edge_y; /* of ln x, where b = end - scale sqrt(1 - x) below the border x = 1 */
    double end, scale;
} mu_turn;

static mu_turn mu_turn_corner(const mu_place *at) {
    const double phi = at->phi, v = at->v, y = at->y, s0 = sqrt(2.0 * MU_PI * v / phi);
    const double stiff = 3.0 * phi * phi + 2.0 * (y - 1.0);
    const double phi_v = MU_PI * v / stiff, phi_y = -2.0 * phi * y / stiff;
    const double s_v = 0.5 * s0 * (1.0 - phi_v / phi), s_y = -0.5 * s0 * phi_y / phi;
    /* d tan(psi/2) / d psi, over R^2 */
    const double turn = 0.5 * (1.0 + at->b * at->b) / (at->a * at->a);
    mu_turn out = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0};
    out.a_v = (0.5 * s0 * s_v + 2.0 * phi * phi_v) / at->a;
    out.a_y = (0.5 * s0 * s_y + 2.0 * phi * phi_y) / at->a;
    out.b_v = turn * (s0 * phi_v - phi * s_v);
    out.b_y = turn * (s0 * phi_y - phi * s_y);
    out.phi_v = phi_v / phi;
    out.phi_y = phi_y / phi;
    return out;
}

/* v~^2 / (1 + v~^2). */
MU_INLINE double mu_speed_share(double v) {
    const double rest = 1.0 / mu_fma1(v, v, 1.0);
    return v < 1.0 ? v * v * rest : 1.0 - rest;
}
