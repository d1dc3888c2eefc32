/* The atlas of a ball: a function of V = v~/1.5 and Y = y~/1.5, which are the v~ and y~ of its
 * middle spring.
 *
 * Its springs are the points of a ray, from (V, Y) to infinity (contact.c), so it has the
 * singularities of one spring at the same places, half an order weaker, and one more line: the
 * steepest ray, which touches the border of continuous sliding.  Beyond that all springs slide.
 * Between it and the border the middle slides and a ring around it sticks for a part of the period.
 * A ray enters stick-slip below MU_STEEPEST_Y and leaves it above: there blocks meet.
 *
 * For small amplitudes the ray passes y~ = 1 far out: powers of V and Y then come with logarithms.
 * The largest, whose factor is known, is taken out; of the others x^k ln x nothing is left to see
 * in the sixth root of x, in which the roots and cube roots that creep and corner have are
 * analytic, too. */

/* load of the middle spring over the mean: gross slip begins at y0 = 1.5 l0 */
#define MU_MIDDLE 1.5
#define MU_STEEPEST 0.33516779066085 /* the largest v~crit / y~, and its amplitude */
#define MU_STEEPEST_Y 1.29079076185
#define MU_LN_STEEPEST_Y 0.25525502425186863
#define MU_STEEPEST_Y2 1.6661407908773036
#define MU_SLOW 0.4326314878546999        /* v~crit there: MU_STEEPEST MU_STEEPEST_Y */
#define MU_SLOW_SHARE 0.15766065821074676 /* v~^2 / (1 + v~^2) there */
#define MU_FOLD_KNOT 0.8908987181403393   /* (1/2)^(1/6) */
#define MU_FOLD_SCALE 1.2599210498948732  /* 2^(1/3) */
#define MU_ROOT_Y_MAX 0.9535 /* covers y~ <= MU_Y_STICK_LO, whose sixth root is 0.95318 */

/* Blocks, numbered apart from the sources: the last five bits are the place in a table. */
enum {
    MU_BALL_BLOCKS = 32,
    MU_B_LOW = MU_BALL_BLOCKS,
    MU_B_SLOW,
    MU_B_MID_1,
    MU_B_MID_2,
    MU_B_HIGH,
    MU_B_TAIL,
    MU_B_RING,
    MU_B_S_LOW,
    MU_B_S_MID,
    MU_B_CORNER,
    MU_B_S_MID_1,
    MU_B_S_MID_2,
    MU_B_S_HIGH,
    MU_B_S_TAIL,
    MU_B_END,
    MU_B_FAST = MU_B_END,
    MU_BALL_CHARTS = MU_B_END - MU_BALL_BLOCKS
};
#define MU_PLACE_OF(block) ((block) & 31)
MU_INLINE int mu_is_ball(int64_t block) { return block >= MU_BALL_BLOCKS; }

#define MU_LOG_DEFICIT "(1 - mu_ratio)/y_tilde^2 + 3/16 ln v_tilde"

/* In all formulas v_tilde and y_tilde are those of the middle spring. */
MU_LISTED mumacro_chart MU_BALL_CHART[MU_BALL_CHARTS] = {
    /* All springs slide, Y <= MU_STEEPEST_Y, V above the steepest ray's there: as one spring. */
    {"continuous_low",
     MU_CONTINUOUS,
     {"y_squared", 0.0, MU_STEEPEST_Y2},
     {"v_squared_share", MU_SLOW_SHARE, 1.0},
     "(1 - mu_ratio) 4 (1 + v_tilde^2)/y_tilde^2",
     MU_ROUNDING,
     0.0},
    /* All springs slide, slower.  a: the sixth root of V over its range; b: the ray, 1 at the
       steepest. */
    {"continuous_slow",
     MU_CONTINUOUS,
     {"v_root", 0.0, 1.0},
     {"ray_squared", 0.0, 1.0},
     MU_LOG_DEFICIT,
     MU_ROUNDING,
     0.0},
    /* All springs slide, Y > MU_STEEPEST_Y: as one spring, V/v~crit from the border to 128 up to
       infinity. */
    MU_SLIDES_BETWEEN("continuous_mid_1", MU_LN_STEEPEST_Y, MU_LN_Y_MID),
    MU_SLIDES_BETWEEN("continuous_mid_2", MU_LN_Y_MID, MU_LN_Y_HIGH),
    MU_SLIDES_BETWEEN("continuous_high", MU_LN_Y_HIGH, MU_LN_Y_TAIL),
    {"continuous_tail",
     MU_CONTINUOUS,
     {"inverse_y", 0.0, 1.0 / MU_Y_TAIL},
     {"ln_rho", 0.0, MU_LN_RHO_MAX},
     MU_LAYER,
     0.0,
     0.0},
    /* The middle slides, further out springs stick for a part of the period.  a: the ray, b: the
     * place on it between y~ = 0 and the border, both with a sixth root at 0 and a square root
     * at 1. */
    {"partial_slip_ring",
     MU_PARTIAL_SLIP,
     {"ray_root", 0.0, 1.0},
     {"way_root", 0.0, 1.0},
     MU_LOG_DEFICIT,
     MU_ROUNDING,
     0.0},
    /* The middle sticks for a part of the period, Y <= 0.75. */
    {"partial_slip_low",
     MU_PARTIAL_SLIP,
     {"y_root", 0.0, MU_ROOT_Y_MAX},
     {"s_root", 0.0, 1.0},
     "(1 - mu_ratio)/y_tilde^2 + 3/8 ln y_tilde",
     MU_ROUNDING,
     0.0},
    {"partial_slip_mid",
     MU_PARTIAL_SLIP,
     {"y", MU_Y_STICK_LO, MU_STEEPEST_Y},
     {"s", MU_S_CUT, 1.0},
     "mu_ratio",
     MU_ROUNDING,
     0.0},
    /* The corner in the polar coordinates of one spring; towards the static limit of Y < 1 a
     * logarithm is left, in which the cube root of the angle is flat.  mu~ is of order phi there,
     * of order phi R or less elsewhere. */
    {"corner",
     MU_PARTIAL_SLIP,
     {"radius", 0.0, MU_R_MAX},
     {"angle_root", 0.0, 1.0},
     "mu_ratio/(phi R), phi^3 + 2 (y_tilde - 1) phi = pi v_tilde",
     0.0,
     0.0},
    MU_STICKS_BETWEEN("partial_slip_mid_1", MU_PARTIAL_SLIP, MU_LN_STEEPEST_Y, MU_LN_Y_MID),
    MU_STICKS_BETWEEN("partial_slip_mid_2", MU_PARTIAL_SLIP, MU_LN_Y_MID, MU_LN_Y_HIGH),
    MU_STICKS_BETWEEN("partial_slip_high", MU_PARTIAL_SLIP, MU_LN_Y_HIGH, MU_LN_Y_TAIL),
    {"partial_slip_tail",
     MU_PARTIAL_SLIP,
     {"inverse_y", 0.0, 1.0 / MU_Y_TAIL},
     {"s", 0.0, 1.0},
     MU_LAYER ", minus (2/pi) ln(v_tilde/sqrt(y_tilde))",
     0.0,
     0.0},
};
