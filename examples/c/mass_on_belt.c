/* A mass on a belt, held by a spring: friction that falls with speed makes it stick
 * and slip; the shaker stops that.
 *
 *     mumacro export --format c --out friction
 *     cc -O2 -Ifriction -o mass_on_belt mass_on_belt.c friction/mumacro*.c -lm
 *     ./mass_on_belt
 *
 * Prints, without and with the shaker, how far the mass swings from peak to peak
 * and the mean force of friction. */
#include <math.h>
#include <stdio.h>

#include "mumacro.h"

static const double MASS = 0.5, SPRING = 2e3, DAMPER = 0.5; /* kg, N/m, N s/m */
static const double BELT = 0.01, FZ = 10.0, K = 1e6;        /* m/s, N, N/m */
static const double OMEGA = 1.3e5, REST = 5e-4;             /* rad/s, m/s */

/* Friction on the mass at its speed v; the coefficient of Coulomb falls from 0.4 at rest to 0.3. */
static double friction(double v, double y0) {
    const double slip = BELT - v;
    return mumacro_force(slip, REST, 0.3 + 0.1 * exp(-fabs(slip) / 0.01), FZ, K, y0, OMEGA);
}

static double acceleration(double x, double v, double y0) {
    return (friction(v, y0) - SPRING * x - DAMPER * v) / MASS;
}

static void simulate(double y0) {
    const double dt = 1e-5, until = 3.0, watched = 1.0; /* s; the last second is looked at */
    double x = 0.0, v = 0.0, low = HUGE_VAL, high = -HUGE_VAL, sum = 0.0;
    long n = 0;
    for (double t = 0.0; t < until; t += dt) {
        /* the midpoint rule */
        const double vm = v + 0.5 * dt * acceleration(x, v, y0), xm = x + 0.5 * dt * v;
        v += dt * acceleration(xm, vm, y0);
        x += dt * vm;
        if (t < until - watched) continue;
        low = fmin(low, x);
        high = fmax(high, x);
        sum += friction(v, y0);
        n += 1;
    }
    printf("y0 = %.1f um: swings by %.4f mm, mean friction %.3f N\n", 1e6 * y0, 1e3 * (high - low),
           sum / (double)n);
}

int main(void) {
    simulate(0.0);
    simulate(4e-6);
    return 0;
}
