/* The atlas: how the quadrant v~, y~ >= 0 of each contact is divided into blocks, and the chart of
 * each.  This file is the only list of blocks and of pieces of the border, records.c that of
 * quantities; Python reads them through the shared object.
 *
 * A chart maps (v~, y~) to two coordinates (a, b) in which what the block tabulates is a smooth
 * function q(a, b); each quantity is value = base + factor q.
 *
 * One spring.  Continuous sliding needs no fitted border: its orbit is analytic in (v~^2, y~^2),
 * beyond the border too.  Stick-slip is between the static limit and the border, both of them
 * square-root edges; with v~ = v~crit sin^2(pi s/2) it is analytic in s on [0, 1].  Around y~ = 1,
 * v~ = 0 only polar coordinates of the normal form mu~^3 + 2 (y~ - 1) mu~ = pi v~ are analytic.  In
 * the tails what is left beyond the outer solution outer = (2/pi) K(i y~/v~), eq. (35), is linear
 * in 1/y~ to 1e-12.
 *
 * A ball is a function of V = v~/1.5 and Y = y~/1.5, which are the v~ and y~ of its middle spring.
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

/* of a ball: load of the middle spring over the mean: gross slip begins at y0 = 1.5 l0 */
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

enum { MU_SPRING, MU_BALL, MU_CONTACTS };
enum { MU_CONTINUOUS, MU_STICK_SLIP, MU_STATIC, MU_PARTIAL_SLIP, MU_REVERSE_SLIP, MU_REGIMES };
enum { MU_MU_RATIO, MU_POWER, MU_STICK, MU_QUANTITIES };
enum { MU_BORDER_LOW, MU_BORDER_MID, MU_BORDER_HIGH, MU_PIECES };
/* Sources: first the blocks of one spring, those of a regime in the order of y~; then what is known
 * in closed form. */
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
    MU_RIGID_REVERSES,
    MU_SOURCES,
    MU_OTHER = MU_SOURCES /* not placed yet: zero, extreme or illegal inputs, and y~ > MU_Y_TAIL */
};
/* Blocks of a ball, numbered apart from the sources: the last five bits are the place in a table.
 */
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

/* --- how values follow from what a block tabulates ----------------------------------------------
 */

/* base */
enum {
    MU_NO_BASE,
    MU_ONE,
    MU_OUTER,
    MU_OUTER_LAYER,
    MU_FIRST_POWER, /* of the springs of the contact */
    MU_ONE_LN_V,    /* 1 + 3/16 y~^2 ln v~ */
    MU_ONE_LN_Y,    /* 1 + 3/8 y~^2 ln y~ */
    MU_POWER_LN_V   /* -9/16 v~ y~^2 ln v~ */
};
/* factor; in brackets what it is */
enum {
    MU_NOTHING,      /* 0 */
    MU_UNITY,        /* 1 */
    MU_Y,            /* y~ */
    MU_V_Y2,         /* v~ y~^2 */
    MU_V_OVER_Y,     /* v~/y~ */
    MU_V2_OVER_Y,    /* v~^2/y~ */
    MU_ROOT_Y,       /* 1/sqrt(y~) */
    MU_DEFICIT,      /* -y~^2 */
    MU_SLIP_DEFICIT, /* -y~^2 / (4 (1 + v~^2)) */
    MU_COSINE,       /* 1 / sqrt(1 + y~^2/v~^2) */
    MU_SLIP_POWER,   /* v~ y~^2 / (1 + v~^2) */
    MU_SWEPT_POWER,  /* y~^2 / sqrt(v~^2 + y~^2) */
    MU_PHI,          /* phi, the root of the corner's normal form */
    MU_V_OVER_PHI,   /* v~/phi */
    MU_Y3,           /* y~^3 */
    MU_PHI_R         /* phi R */
};

typedef struct {
    signed char base, factor;
} mu_form;

/* --- coordinates --------------------------------------------------------------------------------
 */

/* Each with its name in a table file.  In evaluation s stands for sigma, and the angle for its
 * tangent, see charts.c. */
enum mu_coordinate {
    MU_BY_Y_SQUARED,
    MU_BY_Y,
    MU_BY_LN_Y,
    MU_BY_INVERSE_Y,
    MU_BY_Y_ROOT, /* the sixth, as those that follow */
    MU_BY_V_ROOT, /* of V over its range */
    MU_BY_RAY_ROOT,
    MU_BY_WAY_ROOT, /* of the place on a ray, between y~ = 0 and the border */
    MU_BY_S_ROOT,
    MU_BY_S,      /* with v~ = v~crit sin^2(pi s/2) */
    MU_BY_LN_RHO, /* ln(v~/v~crit) */
    MU_BY_LN_KAPPA,
    MU_BY_SPEED_SHARE,
    MU_BY_RAY_SQUARED,
    MU_BY_RADIUS,
    MU_BY_ANGLE,
    MU_BY_ANGLE_ROOT /* the third */
};
#define MU_Y_SQUARED "y_squared", MU_BY_Y_SQUARED
#define MU_Y_ITSELF "y", MU_BY_Y
#define MU_LN_Y "ln_y", MU_BY_LN_Y
#define MU_INVERSE_Y "inverse_y", MU_BY_INVERSE_Y
#define MU_Y_ROOT "y_root", MU_BY_Y_ROOT
#define MU_V_ROOT "v_root", MU_BY_V_ROOT
#define MU_RAY_ROOT "ray_root", MU_BY_RAY_ROOT
#define MU_WAY_ROOT "way_root", MU_BY_WAY_ROOT
#define MU_S_ROOT "s_root", MU_BY_S_ROOT
#define MU_S "s", MU_BY_S
#define MU_LN_RHO "ln_rho", MU_BY_LN_RHO
#define MU_LN_KAPPA "ln_kappa", MU_BY_LN_KAPPA
#define MU_SPEED_SHARE "v_squared_share", MU_BY_SPEED_SHARE
#define MU_RAY_SQUARED "ray_squared", MU_BY_RAY_SQUARED
#define MU_RADIUS "radius", MU_BY_RADIUS
#define MU_ANGLE "angle", MU_BY_ANGLE
#define MU_ANGLE_ROOT "angle_root", MU_BY_ANGLE_ROOT

/* --- the list of blocks -------------------------------------------------------------------------
 */

/* A block: its chart, and how mu~, the power and the stick fraction follow from what it tabulates.
 */
typedef struct {
    mumacro_chart chart;
    mu_form forms[MU_QUANTITIES];
} mu_block;

#define MU_HYPOTENUSE "mu_ratio sqrt(1 + y_tilde^2/v_tilde^2)"
#define MU_SLOPE "mu_ratio y_tilde/v_tilde"
#define MU_LAYER \
    "(mu_ratio - outer) y_tilde/v_tilde, outer = 1/AGM(1, sqrt(1 + y_tilde^2/v_tilde^2))"
#define MU_LOG_DEFICIT "(1 - mu_ratio)/y_tilde^2 + 3/16 ln v_tilde"

/* Blocks in ln y~ of large amplitudes, of a spring and of a ball. */
#define MU_SLIDES_BETWEEN(name, low, high)                                                    \
    {                                                                                         \
        {name,          MU_CONTINUOUS, {MU_LN_Y, low, high}, {MU_LN_RHO, 0.0, MU_LN_RHO_MAX}, \
         MU_HYPOTENUSE, 0.0,           6.0 * MU_ROUNDING},                                    \
        {                                                                                     \
            {MU_NO_BASE, MU_COSINE}, {MU_NO_BASE, MU_SWEPT_POWER}, { MU_NO_BASE, MU_NOTHING } \
        }                                                                                     \
    }
#define MU_STICKS_BETWEEN(name, regime, low, high, stick)                        \
    {                                                                            \
        {name,     regime,      {MU_LN_Y, low, high}, {MU_S, 0.0, 1.0},          \
         MU_SLOPE, MU_DENORMAL, 16.0 * MU_ROUNDING},                             \
        {                                                                        \
            {MU_NO_BASE, MU_V_OVER_Y}, {MU_NO_BASE, MU_Y}, { MU_NO_BASE, stick } \
        }                                                                        \
    }
/* The tail: as of continuous sliding there, without the logarithm (2/pi) ln(v~/sqrt y~) that the
 * layers have for v~ -> 0, where the outer solution's cancels it. */
#define MU_STICKS_BEYOND(name, regime)                                                   \
    {                                                                                    \
        {name,                                                                           \
         regime,                                                                         \
         {MU_INVERSE_Y, 0.0, 1.0 / MU_Y_TAIL},                                           \
         {MU_S, 0.0, 1.0},                                                               \
         MU_LAYER ", minus (2/pi) ln(v_tilde/sqrt(y_tilde))",                            \
         0.0,                                                                            \
         0.0},                                                                           \
        {                                                                                \
            {MU_OUTER_LAYER, MU_V_OVER_Y}, {MU_NO_BASE, MU_Y}, { MU_NO_BASE, MU_ROOT_Y } \
        }                                                                                \
    }

/* In the formulas of a ball v_tilde and y_tilde are those of its middle spring. */
static const mu_block MU_BLOCK[MU_CONTACTS][MU_BALL_CHARTS] = {
    {
        /* Continuous sliding, y~ <= 1.5.  a = y~^2, b = v~^2/(1 + v~^2): the orbit is analytic in
         * both squares, and b brings v~ = infinity to 1.  q is the deficit 1 - mu~ over that of eq.
         * (31), 1 at y~ = 0: no digits are lost. */
        {{"continuous_low",
          MU_CONTINUOUS,
          {MU_Y_SQUARED, 0.0, MU_Y_CONT * MU_Y_CONT},
          {MU_SPEED_SHARE, 0.0, 1.0},
          "(1 - mu_ratio) 4 (1 + v_tilde^2)/y_tilde^2",
          MU_ROUNDING,
          0.0},
         {{MU_ONE, MU_SLIP_DEFICIT}, {MU_NO_BASE, MU_SLIP_POWER}, {MU_NO_BASE, MU_NOTHING}}},
        /* Continuous sliding, 1.5 < y~ <= 2^17.  a = ln y~, b = ln(v~/v~crit) from the border to
         * rho = 128, where two terms take over.  q is mu~ over the cosine v~/sqrt(v~^2 + y~^2): it
         * grows from 1 as slowly as a logarithm.  Three blocks, each with its own number of cells.
         */
        MU_SLIDES_BETWEEN("continuous_mid_1", MU_LN_Y_CONT, MU_LN_Y_MID),
        MU_SLIDES_BETWEEN("continuous_mid_2", MU_LN_Y_MID, MU_LN_Y_HIGH),
        MU_SLIDES_BETWEEN("continuous_high", MU_LN_Y_HIGH, MU_LN_Y_TAIL),
        /* Continuous sliding, y~ > 2^17.  a = 1/y~, b = ln(v~/sqrt y~): the border is at a fixed
         * kappa = v~/sqrt(y~) there.  What the layers at the turning points add to the outer
         * solution, eq. (35), is v~/y~ times q, linear in a. */
        {{"continuous_tail",
          MU_CONTINUOUS,
          {MU_INVERSE_Y, 0.0, 1.0 / MU_Y_TAIL},
          {MU_LN_KAPPA, MU_L_HIGH, MU_L_MAX},
          MU_LAYER,
          0.0,
          0.0},
         {{MU_OUTER, MU_V_OVER_Y}, {MU_FIRST_POWER, MU_V2_OVER_Y}, {MU_NO_BASE, MU_NOTHING}}},
        /* Stick-slip, y~ <= 0.75.  a = y~^2, b = s with v~ = v~crit sin^2(pi s/2): square roots at
         * the static limit (s = 0) and at the border (s = 1) become analytic.
         * q = (1 - mu~)/y~^2, which has a limit at y~ = 0. */
        {{"stick_slip_low",
          MU_STICK_SLIP,
          {MU_Y_SQUARED, 0.0, MU_Y_STICK_LO * MU_Y_STICK_LO},
          {MU_S, 0.0, 1.0},
          "(1 - mu_ratio)/y_tilde^2",
          MU_ROUNDING,
          0.0},
         {{MU_ONE, MU_DEFICIT}, {MU_NO_BASE, MU_V_Y2}, {MU_NO_BASE, MU_UNITY}}},
        /* Stick-slip beside the corner, 0.75 < y~ <= 1.5.  a = y~, b = s above 0.3; mu~ is of order
         * 1 and is tabulated. */
        {{"stick_slip_mid",
          MU_STICK_SLIP,
          {MU_Y_ITSELF, MU_Y_STICK_LO, MU_Y_STICK_HI},
          {MU_S, MU_S_CUT, 1.0},
          "mu_ratio",
          MU_ROUNDING,
          0.0},
         {{MU_NO_BASE, MU_UNITY}, {MU_NO_BASE, MU_UNITY}, {MU_NO_BASE, MU_UNITY}}},
        /* The corner y~ = 1, v~ = 0, where sqrt(1 - y~^2), a cube root in v~ and a line in v~ meet.
         * All three are the root phi of the normal form; a and b are polar coordinates of phi and
         * sqrt(v~/phi), in which mu~/phi is analytic. */
        {{"corner",
          MU_STICK_SLIP,
          {MU_RADIUS, 0.0, MU_R_MAX},
          {MU_ANGLE, 0.0, 1.0},
          "mu_ratio/phi, phi^3 + 2 (y_tilde - 1) phi = pi v_tilde",
          0.0,
          0.0},
         {{MU_NO_BASE, MU_PHI}, {MU_NO_BASE, MU_V_OVER_PHI}, {MU_NO_BASE, MU_UNITY}}},
        /* Stick-slip, 1.5 < y~ <= 2^17.  a = ln y~, b = s.  mu~ is proportional to v~ for v~ -> 0,
         * eq. (16) gives 0: q is the slope mu~ y~/v~, which keeps its digits down to the smallest
         * speed. */
        MU_STICKS_BETWEEN("stick_slip_mid_1", MU_STICK_SLIP, MU_LN_Y_CONT, MU_LN_Y_MID, MU_UNITY),
        MU_STICKS_BETWEEN("stick_slip_mid_2", MU_STICK_SLIP, MU_LN_Y_MID, MU_LN_Y_HIGH, MU_UNITY),
        MU_STICKS_BETWEEN("stick_slip_high", MU_STICK_SLIP, MU_LN_Y_HIGH, MU_LN_Y_TAIL, MU_ROOT_Y),
        MU_STICKS_BEYOND("stick_slip_tail", MU_STICK_SLIP),
    },
    {
        /* All springs slide, Y <= MU_STEEPEST_Y, V above the steepest ray's there: as one spring.
         */
        {{"continuous_low",
          MU_CONTINUOUS,
          {MU_Y_SQUARED, 0.0, MU_STEEPEST_Y2},
          {MU_SPEED_SHARE, MU_SLOW_SHARE, 1.0},
          "(1 - mu_ratio) 4 (1 + v_tilde^2)/y_tilde^2",
          MU_ROUNDING,
          0.0},
         {{MU_ONE, MU_SLIP_DEFICIT}, {MU_NO_BASE, MU_SLIP_POWER}, {MU_NO_BASE, MU_NOTHING}}},
        /* All springs slide, slower.  b: the ray, 1 at the steepest. */
        {{"continuous_slow",
          MU_CONTINUOUS,
          {MU_V_ROOT, 0.0, 1.0},
          {MU_RAY_SQUARED, 0.0, 1.0},
          MU_LOG_DEFICIT,
          MU_ROUNDING,
          0.0},
         {{MU_ONE_LN_V, MU_DEFICIT}, {MU_POWER_LN_V, MU_V_Y2}, {MU_NO_BASE, MU_NOTHING}}},
        /* All springs slide, Y > MU_STEEPEST_Y: as one spring, V/v~crit from the border to 128 up
         * to infinity. */
        MU_SLIDES_BETWEEN("continuous_mid_1", MU_LN_STEEPEST_Y, MU_LN_Y_MID),
        MU_SLIDES_BETWEEN("continuous_mid_2", MU_LN_Y_MID, MU_LN_Y_HIGH),
        MU_SLIDES_BETWEEN("continuous_high", MU_LN_Y_HIGH, MU_LN_Y_TAIL),
        {{"continuous_tail",
          MU_CONTINUOUS,
          {MU_INVERSE_Y, 0.0, 1.0 / MU_Y_TAIL},
          {MU_LN_RHO, 0.0, MU_LN_RHO_MAX},
          MU_LAYER,
          0.0,
          0.0},
         {{MU_OUTER, MU_V_OVER_Y}, {MU_FIRST_POWER, MU_V2_OVER_Y}, {MU_NO_BASE, MU_NOTHING}}},
        /* The middle slides, further out springs stick for a part of the period.  Both coordinates
         * have a sixth root at 0 and a square root at 1. */
        {{"partial_slip_ring",
          MU_PARTIAL_SLIP,
          {MU_RAY_ROOT, 0.0, 1.0},
          {MU_WAY_ROOT, 0.0, 1.0},
          MU_LOG_DEFICIT,
          MU_ROUNDING,
          0.0},
         {{MU_ONE_LN_V, MU_DEFICIT}, {MU_POWER_LN_V, MU_Y3}, {MU_NO_BASE, MU_UNITY}}},
        /* The middle sticks for a part of the period, Y <= 0.75. */
        {{"partial_slip_low",
          MU_PARTIAL_SLIP,
          {MU_Y_ROOT, 0.0, MU_ROOT_Y_MAX},
          {MU_S_ROOT, 0.0, 1.0},
          "(1 - mu_ratio)/y_tilde^2 + 3/8 ln y_tilde",
          MU_ROUNDING,
          0.0},
         {{MU_ONE_LN_Y, MU_DEFICIT}, {MU_NO_BASE, MU_Y3}, {MU_NO_BASE, MU_UNITY}}},
        {{"partial_slip_mid",
          MU_PARTIAL_SLIP,
          {MU_Y_ITSELF, MU_Y_STICK_LO, MU_STEEPEST_Y},
          {MU_S, MU_S_CUT, 1.0},
          "mu_ratio",
          MU_ROUNDING,
          0.0},
         {{MU_NO_BASE, MU_UNITY}, {MU_NO_BASE, MU_UNITY}, {MU_NO_BASE, MU_UNITY}}},
        /* The corner in the polar coordinates of one spring; towards the static limit of Y < 1 a
         * logarithm is left, in which the cube root of the angle is flat.  mu~ is of order phi
         * there, of order phi R or less elsewhere. */
        {{"corner",
          MU_PARTIAL_SLIP,
          {MU_RADIUS, 0.0, MU_R_MAX},
          {MU_ANGLE_ROOT, 0.0, 1.0},
          "mu_ratio/(phi R), phi^3 + 2 (y_tilde - 1) phi = pi v_tilde",
          0.0,
          0.0},
         {{MU_NO_BASE, MU_PHI_R}, {MU_NO_BASE, MU_UNITY}, {MU_NO_BASE, MU_UNITY}}},
        MU_STICKS_BETWEEN("partial_slip_mid_1", MU_PARTIAL_SLIP, MU_LN_STEEPEST_Y, MU_LN_Y_MID,
                          MU_UNITY),
        MU_STICKS_BETWEEN("partial_slip_mid_2", MU_PARTIAL_SLIP, MU_LN_Y_MID, MU_LN_Y_HIGH,
                          MU_UNITY),
        MU_STICKS_BETWEEN("partial_slip_high", MU_PARTIAL_SLIP, MU_LN_Y_HIGH, MU_LN_Y_TAIL,
                          MU_ROOT_Y),
        MU_STICKS_BEYOND("partial_slip_tail", MU_PARTIAL_SLIP),
    },
};

MU_INLINE const mu_block *mu_block_as(int block) {
    return &MU_BLOCK[mu_is_ball(block)][MU_PLACE_OF(block)];
}

/* What large speed needs of a contact, whose springs have the loads s of the middle one, 1 or less:
 * the load of the middle spring over the mean, the means of s^2 and s^4 over the load, which terms
 * with 1/v~^2 and 1/v~^4 are multiplied by; then its own names of the blocks. */
typedef struct {
    double middle, square, root_square, fourth;
    int corner, fast, charts;
} mu_contact;
static const mu_contact MU_CONTACT[MU_CONTACTS] = {
    {1.0, 1.0, 1.0, 1.0, MU_CORNER, MU_FAST, MU_CHARTS},
    {MU_MIDDLE, 0.6857142857142857, 0.8280786712108251, 0.5541125541125541, MU_B_CORNER, MU_B_FAST,
     MU_BALL_CHARTS},
};

MU_LISTED mumacro_piece MU_PIECE[MU_PIECES] = {
    {"low", {MU_Y_SQUARED, 0.0, MU_Y_CONT * MU_Y_CONT}, "2 v_tilde_crit / y_tilde^2"},
    {"mid", {MU_LN_Y, MU_LN_Y_CONT, MU_LN_Y_TAIL}, "v_tilde_crit / sqrt(y_tilde)"},
    {"high", {MU_INVERSE_Y, 0.0, 1.0 / MU_Y_TAIL}, "v_tilde_crit / sqrt(y_tilde)"},
};

/* --- names and regimes --------------------------------------------------------------------------
 */

/* What is known in closed form: the sources behind the blocks of one spring. */
static const mumacro_source MU_CLOSED_FORM[MU_SOURCES - MU_CHARTS] = {
    {"tail_fast", MU_CONTINUOUS},
    {"no_oscillation", MU_CONTINUOUS},
    {"static_limit", MU_STATIC},
    {"rigid", MU_CONTINUOUS},
    {"ball_continuous", MU_CONTINUOUS},
    {"ball_partial_slip", MU_PARTIAL_SLIP},
    {"along_continuous", MU_CONTINUOUS},
    {"along_stick_slip", MU_STICK_SLIP},
    {"along_reverse_slip", MU_REVERSE_SLIP},
    {"normal_continuous", MU_CONTINUOUS},
    {"normal_stick_slip", MU_STICK_SLIP},
    {"rigid_reverse_slip", MU_REVERSE_SLIP},
};
static const char *const MU_REGIME_NAME[MU_REGIMES] = {
    "continuous", "stick_slip", "static", "partial_slip", "reverse_slip",
};

MU_INLINE mumacro_source mu_source_of(int code) {
    const mumacro_chart *chart = &MU_BLOCK[MU_SPRING][code < MU_CHARTS ? code : 0].chart;
    const mumacro_source block = {chart->name, chart->regime};
    return code < MU_CHARTS ? block : MU_CLOSED_FORM[code - MU_CHARTS];
}
