/* The contact in the time domain.  One spring is the play operator of eqs. (9) to (12): its force follows the motion of
 * the upper point, f <- P(f + k dw), and P brings a force beyond the limit back to it, along its own direction.
 * A ball is many independent springs (method of dimensionality reduction, Hertz's pressure): with the middle of the
 * contact at xi = 0 and its rim at 1, the limit of a spring is 3/2 (1 - xi^2) of the mean one. */

/* The share of the limit mu0 Fz that spring i of n has: the integral of 3/2 (1 - xi^2) from i/n to (i + 1)/n.  All
 * shares sum to 1, so that gross slip begins at mu0 Fz exactly; one spring is the contact of one spring. */
static double mu_share_of_limit(int i, int n) {
    const double at = i, all = n;
    return (3.0 * all * all - 3.0 * at * (at + 1.0) - 1.0) / (2.0 * all * all * all);
}

/* Moves one spring of stiffness k by (dx, dy); f is its force. */
static void mu_move_spring(double limit, double k, double dx, double dy, double *f) {
    double x = f[0] + k * dx, y = f[1] + k * dy, size;
    if (!(mu_max(fabs(x), fabs(y)) < HUGE_VAL)) x = dx, y = dy; /* so far that where it began does not count */
    else if (mu_hypot(x, y) <= limit) {
        f[0] = x;
        f[1] = y;
        return;
    }
    size = mu_max(fabs(x), fabs(y)); /* not 0: beyond the limit, which is not below 0 */
    x /= size;
    y /= size;
    size = limit / mu_hypot(x, y);
    f[0] = x * size;
    f[1] = y * size;
}

/* One step of n contacts: limits mu0 Fz [N], stiffnesses [N/m], motions [m]; forces (n, springs, 2) [N] are the state,
 * moved in place; sums (n, 2) are the forces on the contacts after the step. */
static void mu_element_steps(int64_t n, int springs, const double *limit, const double *k, const double *dx,
                             const double *dy, double *forces, double *sums) {
    for (int64_t i = 0; i < n; ++i) {
        sums[2 * i] = sums[2 * i + 1] = 0.0;
        for (int j = 0; j < springs; ++j, forces += 2) {
            mu_move_spring(limit[i] * mu_share_of_limit(j, springs), k[i] / springs, dx[i], dy[i], forces);
            sums[2 * i] += forces[0];
            sums[2 * i + 1] += forces[1];
        }
    }
}
