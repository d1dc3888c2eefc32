/* The atlas of one spring: how the quadrant v~, y~ >= 0 is divided into blocks, and the chart of
 * each.  This file is the only list of its blocks and of pieces of the border, ball_atlas.c that of
 * a ball's blocks, records.c that of quantities; Python reads them through the shared object.
 *
 * A chart maps (v~, y~) to two coordinates (a, b) in which what the block tabulates is a smooth
 * function q(a, b); each quantity is value = base + factor q.
 *
 * Continuous sliding needs no fitted border: its orbit is analytic in (v~^2, y~^2), beyond the
 * border too.  Stick-slip is between the static limit and the border, both of them square-root
 * edges; with v~ = v~crit sin^2(pi s/2) it is analytic in s on [0, 1].  Around y~ = 1, v~ = 0 only
 * polar coordinates of the normal form mu~^3 + 2 (y~ - 1) mu~ = pi v~ are analytic.  In the tails
 * what is left beyond the outer solution outer = (2/pi) K(i y~/v~), eq. (35), is linear in 1/y~ to
 * 1e-12. */

#define MU_Y_STICK_LO 0.75
#define MU_Y_CONT 1.5 /* continuous: rational coordinates below, logarithmic above */
#define MU_Y_STICK_HI MU_Y_CONT
#define MU_Y_MID 3.0
#define MU_Y_HIGH 32.0
#define MU_Y_TAIL 131072.0 /* 2^17 */
#define MU_S_CUT 0.3
#define MU_SIGMA_CUT 0.45399049973954675 /* sin(pi/2 MU_S_CUT): MU_S_CUT as sqrt(v~/v~crit) */
#define MU_R_MAX 1.25 /* covers s <= MU_S_CUT for every y~ in [MU_Y_STICK_LO, MU_Y_STICK_HI] */
/* v~/v~crit from which two terms hold to 1e-14; ln(v~ / sqrt y~) is 3.95 to 4.11 there */
#define MU_RHO_MAX 128.0
#define MU_L_MAX 4.0                     /* ln(v~ / sqrt y~) from which they do in the tail */
#define MU_FAST_KAPPA 54.598150033144236 /* exp(MU_L_MAX) */
/* ln 0.47: below the border for y~ >= MU_Y_HIGH, ln 0.4754 */
#define MU_L_HIGH (-0.7550225842780328)
#define MU_LN_Y_CONT 0.4054651081081644
#define MU_LN_Y_MID 1.0986122886681098
#define MU_LN_Y_HIGH 3.4657359027997265
#define MU_LN_Y_TAIL 11.783502069519070
#define MU_LN_RHO_MAX 4.852030263919617

enum { MU_SPRING, MU_BALL, MU_CONTACTS };
enum { MU_CONTINUOUS, MU_STICK_SLIP, MU_STATIC, MU_PARTIAL_SLIP, MU_REVERSE_SLIP, MU_REGIMES };
/* Sources: first the blocks, those of a regime in the order of y~;
 * then what is known in closed form. */
enum {
    MU_C_LOW,
    MU_C_MID_1,
    MU_C_MID_2,
    MU_C_HIGH,
    MU_C_TAIL,
    MU_S_LOW,
    MU_S_MID,
    MU_CORNER,
    MU_S_MID_1,
    MU_S_MID_2,
    MU_S_HIGH,
    MU_S_TAIL,
    MU_CHARTS,
    MU_FAST = MU_CHARTS,
    MU_NO_OSCILLATION,
    MU_STATIC_LIMIT,
    MU_RIGID,
    MU_BALL_SLIDES,
    MU_BALL_PARTLY,
    MU_ALONG_SLIDES,
    MU_ALONG_STICKS,
    MU_ALONG_REVERSES,
    MU_NORMAL_SLIDES,
    MU_NORMAL_STICKS,
    MU_SOURCES,
    MU_OTHER = MU_SOURCES /* not placed yet: zero, extreme or illegal inputs, and y~ > MU_Y_TAIL */
};
enum { MU_MU_RATIO, MU_POWER, MU_STICK, MU_QUANTITIES };
enum { MU_BORDER_LOW, MU_BORDER_MID, MU_BORDER_HIGH, MU_PIECES };

#define MU_HYPOTENUSE "mu_ratio sqrt(1 + y_tilde^2/v_tilde^2)"
#define MU_SLOPE "mu_ratio y_tilde/v_tilde"
#define MU_LAYER \
    "(mu_ratio - outer) y_tilde/v_tilde, outer = 1/AGM(1, sqrt(1 + y_tilde^2/v_tilde^2))"

/* Charts in ln y~ of large amplitudes, of a spring and of a ball. */
#define MU_SLIDES_BETWEEN(name, low, high)                                              \
    {name,          MU_CONTINUOUS, {"ln_y", low, high}, {"ln_rho", 0.0, MU_LN_RHO_MAX}, \
     MU_HYPOTENUSE, 0.0,           6.0 * MU_ROUNDING}
#define MU_STICKS_BETWEEN(name, regime, low, high) \
    {name, regime, {"ln_y", low, high}, {"s", 0.0, 1.0}, MU_SLOPE, MU_DENORMAL, 16.0 * MU_ROUNDING}

/* Each with coordinates a and b; s stands for sigma in evaluation and the angle
 * for its tangent, see charts.c. */
MU_LISTED mumacro_chart MU_CHART[MU_CHARTS] = {
    /* Continuous sliding, y~ <= 1.5.  a = y~^2, b = v~^2/(1 + v~^2): the orbit is analytic in both
     * squares, and b brings v~ = infinity to 1.  q is the deficit 1 - mu~ over that of eq. (31), 1
     * at y~ = 0: no digits are lost. */
    {"continuous_low",
     MU_CONTINUOUS,
     {"y_squared", 0.0, MU_Y_CONT * MU_Y_CONT},
     {"v_squared_share", 0.0, 1.0},
     "(1 - mu_ratio) 4 (1 + v_tilde^2)/y_tilde^2",
     MU_ROUNDING,
     0.0},
    /* Continuous sliding, 1.5 < y~ <= 2^17.  a = ln y~, b = ln(v~/v~crit) from the border to
     * rho = 128, where two terms take over.  q is mu~ over the cosine v~/sqrt(v~^2 + y~^2): it
     * grows from 1 as slowly as a logarithm.  Three blocks, each with its own number of cells. */
    MU_SLIDES_BETWEEN("continuous_mid_1", MU_LN_Y_CONT, MU_LN_Y_MID),
    MU_SLIDES_BETWEEN("continuous_mid_2", MU_LN_Y_MID, MU_LN_Y_HIGH),
    MU_SLIDES_BETWEEN("continuous_high", MU_LN_Y_HIGH, MU_LN_Y_TAIL),
    /* Continuous sliding, y~ > 2^17.  a = 1/y~, b = ln(v~/sqrt y~): the border is at a fixed
     * kappa = v~/sqrt(y~) there.  What the layers at the turning points add to the outer solution,
     * eq. (35), is v~/y~ times q, linear in a. */
    {"continuous_tail",
     MU_CONTINUOUS,
     {"inverse_y", 0.0, 1.0 / MU_Y_TAIL},
     {"ln_kappa", MU_L_HIGH, MU_L_MAX},
     MU_LAYER,
     0.0,
     0.0},
    /* Stick-slip, y~ <= 0.75.  a = y~^2, b = s with v~ = v~crit sin^2(pi s/2): square roots
     * at the static limit (s = 0) and at the border (s = 1) become analytic.
     * q = (1 - mu~)/y~^2, which has a limit at y~ = 0. */
    {"stick_slip_low",
     MU_STICK_SLIP,
     {"y_squared", 0.0, MU_Y_STICK_LO * MU_Y_STICK_LO},
     {"s", 0.0, 1.0},
     "(1 - mu_ratio)/y_tilde^2",
     MU_ROUNDING,
     0.0},
    /* Stick-slip beside the corner, 0.75 < y~ <= 1.5.  a = y~, b = s above 0.3; mu~
     * is of order 1 and is tabulated. */
    {"stick_slip_mid",
     MU_STICK_SLIP,
     {"y", MU_Y_STICK_LO, MU_Y_STICK_HI},
     {"s", MU_S_CUT, 1.0},
     "mu_ratio",
     MU_ROUNDING,
     0.0},
    /* The corner y~ = 1, v~ = 0, where sqrt(1 - y~^2), a cube root in v~ and a line in v~ meet.
     * All three are the root phi of the normal form; a and b are polar coordinates of phi and
     * sqrt(v~/phi), in which mu~/phi is analytic. */
    {"corner",
     MU_STICK_SLIP,
     {"radius", 0.0, MU_R_MAX},
     {"angle", 0.0, 1.0},
     "mu_ratio/phi, phi^3 + 2 (y_tilde - 1) phi = pi v_tilde",
     0.0,
     0.0},
    /* Stick-slip, 1.5 < y~ <= 2^17.  a = ln y~, b = s.  mu~ is proportional to v~
     * for v~ -> 0, eq. (16) gives 0: q is the slope mu~ y~/v~, which keeps its
     * digits down to the smallest speed. */
    MU_STICKS_BETWEEN("stick_slip_mid_1", MU_STICK_SLIP, MU_LN_Y_CONT, MU_LN_Y_MID),
    MU_STICKS_BETWEEN("stick_slip_mid_2", MU_STICK_SLIP, MU_LN_Y_MID, MU_LN_Y_HIGH),
    MU_STICKS_BETWEEN("stick_slip_high", MU_STICK_SLIP, MU_LN_Y_HIGH, MU_LN_Y_TAIL),
    /* Stick-slip, y~ > 2^17.  a = 1/y~, b = s.  As in the tail of continuous sliding,
     * without the logarithm (2/pi) ln(v~/sqrt y~) that the layers have for v~ -> 0, where
     * the outer solution's cancels it. */
    {"stick_slip_tail",
     MU_STICK_SLIP,
     {"inverse_y", 0.0, 1.0 / MU_Y_TAIL},
     {"s", 0.0, 1.0},
     MU_LAYER ", minus (2/pi) ln(v_tilde/sqrt(y_tilde))",
     0.0,
     0.0},
};

MU_LISTED mumacro_piece MU_PIECE[MU_PIECES] = {
    {"low", {"y_squared", 0.0, MU_Y_CONT * MU_Y_CONT}, "2 v_tilde_crit / y_tilde^2"},
    {"mid", {"ln_y", MU_LN_Y_CONT, MU_LN_Y_TAIL}, "v_tilde_crit / sqrt(y_tilde)"},
    {"high", {"inverse_y", 0.0, 1.0 / MU_Y_TAIL}, "v_tilde_crit / sqrt(y_tilde)"},
};

static const char *const MU_SOURCE_NAME[MU_SOURCES] = {
    "continuous_low",     "continuous_mid_1",  "continuous_mid_2",  "continuous_high",
    "continuous_tail",    "stick_slip_low",    "stick_slip_mid",    "corner",
    "stick_slip_mid_1",   "stick_slip_mid_2",  "stick_slip_high",   "stick_slip_tail",
    "tail_fast",          "no_oscillation",    "static_limit",      "rigid",
    "ball_continuous",    "ball_partial_slip", "along_continuous",  "along_stick_slip",
    "along_reverse_slip", "normal_continuous", "normal_stick_slip",
};
static const char *const MU_REGIME_NAME[MU_REGIMES] = {
    "continuous", "stick_slip", "static", "partial_slip", "reverse_slip",
};
static const signed char MU_REGIME_OF_SOURCE[MU_SOURCES] = {0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1,
                                                            0, 0, 2, 0, 0, 3, 0, 1, 4, 0, 1};
