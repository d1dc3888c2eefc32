/* The contact in the time domain.  One spring is the play operator of eqs. (9) to (12).  A step is
 * straight, and the limit mu0 Fz changes along it in proportion to the way; then the step has a
 * closed form.  The spring sticks up to a root of a quadratic and slips from there to the end.  In
 * slip |f| is the limit, and the angle psi between force and motion obeys
 *
 *     tan(psi/2) -> tan(psi/2) exp(-q),    q = integral of k ds / limit
 *
 * over the way s.  Slip does not end within a step: as psi falls, the speed of the foot
 * rises.  A ball is many independent springs (method of dimensionality reduction, Hertz's
 * pressure): with the middle of the contact at xi = 0 and its rim at 1, the limit of a spring
 * is 3/2 (1 - xi^2) of the mean one. */

/* The mean of 1/x over x from a > 0 to b > 0, both at most 1: ln(b/a) / (b - a), off by at most
 * 1e-15 of itself.  Where b/a is beyond the doubles, a below 1e-308, it is that of 2^1024: no slip
 * is left after either. */
static double mu_mean_inverse(double a, double b) {
    const double z = (b - a) / (b + a), square = z * z;
    double sum = 1.0 / 17.0;
    if (fabs(z) > 0.15) return mu_log1(b / a) / (b - a);
    /* ln(b/a) = 2 (z + z^3/3 + z^5/5 + ...); what is left out, z^18/19, is below 1e-16 of it */
    for (int i = 15; i > 0; i -= 2) sum = sum * square + 1.0 / i;
    return 2.0 * sum / (b + a);
}

/* A step in which one spring slips, if only in its last part.  All forces are in one unit and at
 * most about 1: limits before and after, the drive k ds >= 0 along the direction (ex, ey); f is the
 * spring's force, which is moved. */
static void mu_slip_in_step(double before, double after, double drive, double ex, double ey,
                            double *f) {
    const double size = sqrt(f[0] * f[0] + f[1] * f[1]), change = after - before;
    /* the end of the last step, rounded */
    const double shrink = size > before ? before / size : 1.0;
    const double x0 = f[0] * shrink, y0 = f[1] * shrink;
    /* |f + drive e share|^2 = (before + change share)^2: there the force leaves
     * the limit's circle, which is once */
    const double a = (drive - change) * (drive + change);
    const double b = drive * (x0 * ex + y0 * ey) - before * change;
    const double c = mu_min((size - before) * (size + before), 0.0);
    const double root = sqrt(mu_max(b * b - a * c, 0.0));
    const double share = b >= 0.0  ? (c < 0.0 ? -c / (b + root) : 0.0)
                         : a > 0.0 ? (root - b) / a
                                   : 1.0;
    const double stuck = mu_min(mu_max(share, 0.0), 1.0), rest = 1.0 - stuck;
    const double x = x0 + drive * stuck * ex, y = y0 + drive * stuck * ey;
    const double reach = sqrt(x * x + y * y);
    const double start = before + change * stuck;
    /* psi at the start of slip; a spring without force follows the motion at once */
    const double cosine = reach > 0.0 ? (x * ex + y * ey) / reach : 1.0;
    const double sine = reach > 0.0 ? (y * ex - x * ey) / reach : 0.0;
    const double plus = cosine > 0.0 ? 1.0 + cosine : sine * sine / (1.0 - cosine);
    /* beside plus, which is 2 for a small psi, its rounding does not count */
    const double minus = 1.0 - cosine;
    const double ahead = drive * rest;
    const int open = mu_min(start, after) <= 0.0;
    const double q = ahead == 0.0 ? 0.0 : open ? HUGE_VAL : ahead * mu_mean_inverse(start, after);
    const double left = mu_decay(q), sum = plus + minus * left * left;
    /* sum is 0 for a force against the motion only, where the limit falls
     * faster than the spring unloads */
    const double cosine1 = sum > 0.0 ? (plus - minus * left * left) / sum : cosine;
    const double sine1 = sum > 0.0 ? 2.0 * left * sine / sum : 0.0;
    const double unit = sqrt(cosine1 * cosine1 + sine1 * sine1);
    f[0] = after * ((cosine1 * ex - sine1 * ey) / unit);
    f[1] = after * ((cosine1 * ey + sine1 * ex) / unit);
}

/* Moves one spring of stiffness k by (dx, dy), while its limit goes from
 * before to after; f is its force. */
static void mu_move_spring(double before, double after, double k, double dx, double dy, double *f) {
    const double larger = mu_max(fabs(dx), fabs(dy));
    const double x = larger > 0.0 ? f[0] + k * dx : f[0], y = larger > 0.0 ? f[1] + k * dy : f[1];
    double ex = 1.0, ey = 0.0, drive = 0.0, unit;
    if (mu_max(fabs(x), fabs(y)) < HUGE_VAL && mu_hypot(x, y) <= after) {
        f[0] = x;
        f[1] = y;
        return;
    }
    if (larger > 0.0) {
        ex = dx / larger;
        ey = dy / larger;
        unit = sqrt(ex * ex + ey * ey);
        ex /= unit;
        ey /= unit;
        drive = k * (larger * unit);
    }
    if (!(drive < HUGE_VAL)) { /* so far that where it began does not count */
        f[0] = after * ex;
        f[1] = after * ey;
        return;
    }
    unit = mu_max(mu_max(before, after), mu_max(drive, mu_max(fabs(f[0]), fabs(f[1]))));
    f[0] /= unit;
    f[1] /= unit;
    mu_slip_in_step(before / unit, after / unit, drive / unit, ex, ey, f);
    f[0] *= unit;
    f[1] *= unit;
}

/* The share of the limit mu0 Fz that spring i of n has: the integral of 3/2 (1 - xi^2) from
 * i/n to (i + 1)/n.  All shares sum to 1, so that gross slip begins at mu0 Fz exactly; one
 * spring is the contact of one spring. */
static double mu_share_of_limit(int i, int n) {
    const double at = i, all = n;
    return (3.0 * all * all - 3.0 * at * (at + 1.0) - 1.0) / (2.0 * all * all * all);
}

/* One step of n contacts: limits mu0 Fz [N] before and after it, stiffnesses [N/m], motions
 * [m]; forces (n, springs, 2) [N] are the state, moved in place; sums (n, 2) are the forces
 * on the contacts after the step. */
static void mu_element_steps(int64_t n, int springs, const double *before, const double *after,
                             const double *k, const double *dx, const double *dy, double *forces,
                             double *sums) {
    for (int64_t i = 0; i < n; ++i) {
        sums[2 * i] = sums[2 * i + 1] = 0.0;
        for (int j = 0; j < springs; ++j, forces += 2) {
            const double share = mu_share_of_limit(j, springs);
            mu_move_spring(before[i] * share, after[i] * share, k[i] / springs, dx[i], dy[i],
                           forces);
            sums[2 * i] += forces[0];
            sums[2 * i + 1] += forces[1];
        }
    }
}
