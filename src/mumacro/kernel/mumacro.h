/* mumacro.h: macroscopic friction of a contact that slides and is shaken
 * across or along its way, or whose normal force oscillates.
 *
 *     #include "mumacro.h"
 *     mumacro_answer a;
 *     int error = mumacro_evaluate(0.3, 10.0, 1e6, 2e-6, 125663.7, 0.01, &a);
 *     if (error) puts(mumacro_error_text(error));
 *     else printf("%.6f, numerical error %.1e\n", a.mu_macro, a.error_bound);
 *
 * C99 and C++17; of the mathematical library only sqrt and fabs.  No memory is taken, nothing is
 * stored between calls, any thread may call; a call needs up to 100 kB of stack.  Infinities and
 * NaN are needed: no -ffast-math.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef MUMACRO_H
#define MUMACRO_H

#include <stdint.h>

/* The linkage of the functions, such as __declspec(dllexport) for a library. */
#ifndef MUMACRO_API
#define MUMACRO_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Dimensionless quantities, for mumacro_evaluate_point: mu~ = mu_macro/mu0; the mean
 * power of the shaker over mu0 Fz l0 omega, l0 = mu0 Fz / k; the share of the period
 * during which the contact sticks. */
enum { MUMACRO_MU_RATIO, MUMACRO_POWER, MUMACRO_STICK_FRACTION, MUMACRO_QUANTITIES };

/* Where an answer comes from: a block of the table, or a limit in closed form. */
enum {
    MUMACRO_SOURCE_CONTINUOUS_LOW,
    MUMACRO_SOURCE_CONTINUOUS_MID_1,
    MUMACRO_SOURCE_CONTINUOUS_MID_2,
    MUMACRO_SOURCE_CONTINUOUS_HIGH,
    MUMACRO_SOURCE_CONTINUOUS_TAIL,
    MUMACRO_SOURCE_STICK_SLIP_LOW,
    MUMACRO_SOURCE_STICK_SLIP_MID,
    MUMACRO_SOURCE_CORNER,
    MUMACRO_SOURCE_STICK_SLIP_MID_1,
    MUMACRO_SOURCE_STICK_SLIP_MID_2,
    MUMACRO_SOURCE_STICK_SLIP_HIGH,
    MUMACRO_SOURCE_STICK_SLIP_TAIL,
    MUMACRO_SOURCE_TAIL_FAST,
    MUMACRO_SOURCE_NO_OSCILLATION,
    MUMACRO_SOURCE_STATIC_LIMIT,
    MUMACRO_SOURCE_RIGID,
    /* of mumacro_evaluate_as alone: springs of the table in a ball, closed forms */
    MUMACRO_SOURCE_BALL_CONTINUOUS,
    MUMACRO_SOURCE_BALL_PARTIAL_SLIP,
    MUMACRO_SOURCE_ALONG_CONTINUOUS,
    MUMACRO_SOURCE_ALONG_STICK_SLIP,
    MUMACRO_SOURCE_ALONG_REVERSE_SLIP,
    MUMACRO_SOURCE_NORMAL_CONTINUOUS,
    MUMACRO_SOURCE_NORMAL_STICK_SLIP,
    MUMACRO_SOURCE_RIGID_REVERSE_SLIP,
    MUMACRO_SOURCES
};

/* The regime of an answer: slips all the time, sticks during a part of each period, at rest
 * (v0 -> 0); some springs of a ball slip all the time and others do not; slips backwards, too. */
enum {
    MUMACRO_REGIME_CONTINUOUS,
    MUMACRO_REGIME_STICK_SLIP,
    MUMACRO_REGIME_STATIC,
    MUMACRO_REGIME_PARTIAL_SLIP,
    MUMACRO_REGIME_REVERSE_SLIP
};

/* The contact: one spring, or a ball on a flat (Hertz, k = 8 a G*); the direction of the
 * oscillation: across the sliding direction, along it, or of the normal force. */
enum { MUMACRO_SPRING, MUMACRO_BALL };
enum { MUMACRO_ACROSS, MUMACRO_ALONG, MUMACRO_NORMAL };

/* Returned where there is nothing to write to, no such quantity, no such contact or direction, a
 * ball whose normal force oscillates (its contact radius changes: not modelled), no such step,
 * no such velocity of a force; 0 is success, 1 to 6 are bad inputs, 7 is an amplitude of the
 * normal force that is not below it. */
enum {
    MUMACRO_NO_VELOCITY = -6,
    MUMACRO_NO_STEP,
    MUMACRO_NO_NORMAL_BALL,
    MUMACRO_NO_CONTACT,
    MUMACRO_NO_QUANTITY,
    MUMACRO_NO_OUTPUT,
    MUMACRO_LIFT_OFF = 7
};

/* An answer to a dimensional case: mu_macro and mu_ratio = mu_macro / mu0 [-]; the bound of
 * mu_macro's absolute error; v_tilde and y_tilde [-], infinite for rigid contact; where the answer
 * comes from (mumacro_source_name) and the regime; d mu_macro / d (mu0, Fz, k, y0, omega, v0) [-,
 * 1/N, m/N, 1/m, s/rad, s/m] and the bounds of their errors. */
typedef struct {
    double mu_macro, mu_ratio, error_bound, v_tilde, y_tilde;
    int source, regime;
    double gradient[6];
    double gradient_bound[6];
} mumacro_answer;

/* The cycle of a dimensional case: the speed at the border of continuous sliding [m/s]; the mean
 * power [W] that the shaker puts in; the share of the period during which the contact sticks [-];
 * the bounds of the last two.  NaN: v0_crit and power of an elastic contact where v~ or y~
 * is not finite. */
typedef struct {
    double v0_crit, power, power_bound, stick_fraction, stick_fraction_bound;
} mumacro_cycle;

/* A dimensionless quantity at (v~, y~): value and bound of its absolute error; v~ d/d v~ and y~ d/d
 * y~ and the bounds of their errors; where it comes from. */
typedef struct {
    double value, bound, slope_v, slope_y, slope_v_bound, slope_y_bound;
    int source;
} mumacro_point;

/* Answer a case.  mu0 [-], Fz [N], k [N/m] > 0, with k = HUGE_VAL for rigid contact; y0 [m], omega
 * [rad/s], v0 [m/s] >= 0; all but k finite.  Returns 0, or 1 + the place of the first illegal input
 * among these six; then all numbers of *out are NaN, source and regime -1. */
MUMACRO_API int mumacro_evaluate(double mu0, double Fz, double k, double y0, double omega,
                                 double v0, mumacro_answer *out);

/* As mumacro_evaluate, for a contact and a direction of those above.  Where the
 * normal force oscillates, y0 is its amplitude [N], below Fz, in the gradient too,
 * and y_tilde is Fz_amplitude / Fz. */
MUMACRO_API int mumacro_evaluate_as(int contact, int direction, double mu0, double Fz, double k,
                                    double y0, double omega, double v0, mumacro_answer *out);

/* As mumacro_evaluate. */
MUMACRO_API int mumacro_evaluate_cycle(double mu0, double Fz, double k, double y0, double omega,
                                       double v0, mumacro_cycle *out);

/* mu_macro [-] alone, in a fraction of the time; NaN where mumacro_evaluate would return an
 * error. */
MUMACRO_API double mumacro_mu_macro(double mu0, double Fz, double k, double y0, double omega,
                                    double v0);

/* n cases, in a fraction of the time that n calls take: each input an array of n.  bound may be
 * NULL; illegal cases are NaN in both. */
MUMACRO_API void mumacro_mu_macros(int64_t n, const double *mu0, const double *Fz, const double *k,
                                   const double *y0, const double *omega, const double *v0,
                                   double *mu_macro, double *bound);

/* A quantity with its slopes and bounds.  v_tilde, y_tilde >= 0, y_tilde finite for
 * MUMACRO_MU_RATIO and not infinite together with v_tilde for MUMACRO_POWER.  Returns 0, 1 for a
 * bad v_tilde, 2 for a bad y_tilde. */
MUMACRO_API int mumacro_evaluate_point(int quantity, double v_tilde, double y_tilde,
                                       mumacro_point *out);

/* Values of a quantity at n points, each array of length n; bound may be NULL; illegal points are
 * NaN in both.  Returns 0, or MUMACRO_NO_QUANTITY and writes nothing. */
MUMACRO_API int mumacro_values(int quantity, int64_t n, const double *v_tilde,
                               const double *y_tilde, double *value, double *bound);

/* Values alone [-]; NaN where illegal. */
MUMACRO_API double mumacro_mu_ratio(double v_tilde, double y_tilde);
MUMACRO_API double mumacro_power(double v_tilde, double y_tilde);
MUMACRO_API double mumacro_stick_fraction(double v_tilde, double y_tilde);

/* Smallest v~ without stick [-]; 0 at y~ = 0, infinite for infinite
 * y~, NaN for what is no amplitude. */
MUMACRO_API double mumacro_v_tilde_crit(double y_tilde);

/* The friction force [N] for time integration, at a velocity v0 [m/s] of either sign:
 * mu_macro(|v0|) Fz along v0, so that it is odd in v0.  Below v_rest [m/s] > 0 it is regularised:
 * with a = |v0| / v_rest it is mu_macro(v_rest (1 + a^2) / 2) Fz 2 a / (1 + a^2), which meets the
 * law at v_rest with the same slope, and rises all the way.  So there is no jump, no NaN where v0
 * crosses zero, and a contact at rest creeps at less than v_rest; take v_rest well below the speeds
 * that matter, and a step that resolves 2 mu_macro Fz / v_rest, a damper.  NaN where v0 or v_rest
 * is not finite or another input is illegal. */
MUMACRO_API double mumacro_force(double v0, double v_rest, double mu0, double Fz, double k,
                                 double y0, double omega);

/* The same for a contact and a direction as in mumacro_evaluate_as, with d force / d
 * (mu0, Fz, k, y0, omega, v0).  Returns as that does, or MUMACRO_NO_VELOCITY for v0 or
 * v_rest; then all numbers are NaN. */
MUMACRO_API int mumacro_evaluate_force(int contact, int direction, double v0, double v_rest,
                                       double mu0, double Fz, double k, double y0, double omega,
                                       double *force, double gradient[6]);

/* The contact in the time domain, for any motion: moves its upper point by (dx, dy) [m] and
 * writes the force that must be applied there after the step [N], x > 0 for motion along x.  1
 * spring is the model's contact; more are a ball, whose k is that of full stick and whose Fz must
 * stay the same; 32 give its mean to 1.1e-3 mu0.  Of one spring Fz >= 0 may change between steps,
 * k must be finite.  state: 2 * springs numbers, the springs' forces [N], zeros at first.  A
 * straight step is exact; the error of a curved motion falls with the square of the steps, 400 a
 * period give 4e-5 up to an amplitude of 9 mu0 Fz/k, and 1.3e-4 at 100.  Returns 0, 1 to 3 for a
 * bad mu0, Fz or k, MUMACRO_NO_STEP, or MUMACRO_NO_OUTPUT; then nothing is moved. */
MUMACRO_API int mumacro_element_step(int springs, double mu0, double Fz, double k, double dx,
                                     double dy, double *state, double force[2]);

/* Names of a source and of a regime, static texts; "illegal" for -1 and for what is none. */
MUMACRO_API const char *mumacro_source_name(int source);
MUMACRO_API const char *mumacro_regime_name(int regime);

/* What a function's return value says, a static text. */
MUMACRO_API const char *mumacro_error_text(int error);

/* The table: the largest error of mu~ that it was built for, the checksum of its
 * file, the release that wrote it. */
MUMACRO_API double mumacro_tolerance(void);
MUMACRO_API const char *mumacro_checksum(void);
MUMACRO_API const char *mumacro_version(void);

#ifdef __cplusplus
}
#endif
#endif
