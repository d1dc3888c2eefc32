/* Returned where there is nothing to write to, or no such quantity; 0 is success, 1 and more are bad inputs. */
#define MUMACRO_NO_OUTPUT (-1)
#define MUMACRO_NO_QUANTITY (-2)

/* An answer to a dimensional case: mu_macro and mu_ratio = mu_macro / mu0 [-]; the bound of mu_macro's absolute error;
 * v_tilde and y_tilde [-], infinite for rigid contact; where the answer comes from (mumacro_source_name) and the
 * regime; d mu_macro / d (mu0, Fz, k, y0, omega, v0) [-, 1/N, m/N, 1/m, s/rad, s/m] and the bounds of their errors. */
typedef struct {
    double mu_macro, mu_ratio, error_bound, v_tilde, y_tilde;
    int source, regime;
    double gradient[6];
    double gradient_bound[6];
} mumacro_answer;

/* The cycle of a dimensional case: the speed at the border of continuous sliding [m/s]; the mean power [W] that the
 * shaker puts in; the share of the period during which the contact sticks [-]; the bounds of the last two.
 * Not in the table and NaN: the power of rigid contact, and v0_crit and power where v~ or y~ is not finite. */
typedef struct {
    double v0_crit, power, power_bound, stick_fraction, stick_fraction_bound;
} mumacro_cycle;

/* A dimensionless quantity at (v~, y~): value and bound of its absolute error; v~ d/d v~ and y~ d/d y~ and the bounds
 * of their errors; where it comes from. */
typedef struct {
    double value, bound, slope_v, slope_y, slope_v_bound, slope_y_bound;
    int source;
} mumacro_point;

/* Answer a case.  mu0 [-], Fz [N], k [N/m] > 0, with k = HUGE_VAL for rigid contact; y0 [m], omega [rad/s],
 * v0 [m/s] >= 0; all but k finite.  Returns 0, or 1 + the place of the first illegal input among these six; then all
 * numbers of *out are NaN, source and regime -1. */
MUMACRO_API int mumacro_evaluate(double mu0, double Fz, double k, double y0, double omega, double v0,
                                 mumacro_answer *out);

/* As mumacro_evaluate. */
MUMACRO_API int mumacro_evaluate_cycle(double mu0, double Fz, double k, double y0, double omega, double v0,
                                       mumacro_cycle *out);

/* mu_macro [-] alone, in a fraction of the time; NaN where mumacro_evaluate would return an error. */
MUMACRO_API double mumacro_mu_macro(double mu0, double Fz, double k, double y0, double omega, double v0);

/* A quantity with its slopes and bounds.  v_tilde, y_tilde >= 0, y_tilde finite for MUMACRO_MU_RATIO.  Returns 0,
 * 1 for a bad v_tilde, 2 for a bad y_tilde. */
MUMACRO_API int mumacro_evaluate_point(int quantity, double v_tilde, double y_tilde, mumacro_point *out);

/* Values alone [-]; NaN where illegal.  The power is that of the shaker over mu0 Fz l0 omega, l0 = mu0 Fz / k. */
MUMACRO_API double mumacro_mu_ratio(double v_tilde, double y_tilde);
MUMACRO_API double mumacro_power(double v_tilde, double y_tilde);
MUMACRO_API double mumacro_stick_fraction(double v_tilde, double y_tilde);

/* Smallest v~ without stick [-]; 0 at y~ = 0, infinite for infinite y~, NaN for what is no amplitude. */
MUMACRO_API double mumacro_v_tilde_crit(double y_tilde);

/* Name of a source, a static text; "illegal" for -1 and for what is no source. */
MUMACRO_API const char *mumacro_source_name(int source);

/* What mumacro_evaluate's return value says, a static text. */
MUMACRO_API const char *mumacro_error_text(int error);
