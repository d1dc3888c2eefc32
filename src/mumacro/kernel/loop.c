/* The force of a contact that is moved along one line, from sample to sample, for measured loops.
 * Forces are over mu0, so that one number is left: p = k / mu0.  A spring is the play operator,
 * under a load that changes along the straight steps.  A ball under a constant load is Cattaneo's
 * and Mindlin's: with z = p way / Fz a first loading has the force phi(z) Fz and slips at z = 3/2;
 * behind a reversal the way and the force are those of a loading of twice the size (Masing), until
 * the point is passed where the branch before began, which then goes on as if nothing had been. */

/* phi(z) = 1 - (1 - 2z/3)^(3/2), and z phi'(z), for 0 <= z <= 3/2. */
static double mu_loaded(double z, double *slope) {
    const double rest = mu_max(1.0 - z * (2.0 / 3.0), 0.0), root = sqrt(rest);
    *slope = root;
    return 1.0 - rest * root;
}

/* p way, which is 0 for no way of a rigid contact, too. */
static double mu_stretch(double p, double way) { return way == 0.0 ? 0.0 : p * way; }

/* A branch begins at place x, with force f and its slope d along ln p. */
typedef struct {
    double x, f, d;
} mu_reversal;

typedef struct {
    double p, x, f, d; /* p / Fz; where it is, its force over mu0 Fz and the slope of that */
    double origin, lead; /* of the first loading: z = p (x - origin) + lead */
    int direction;
    int64_t turns; /* reversals that count */
} mu_memory;

static void mu_move_ball(mu_memory *at, mu_reversal *turn, double x) {
    const int direction = x > at->x ? 1 : x < at->x ? -1 : 0;
    double z, slope;
    if (direction == 0) return;
    if (at->direction == -direction) {
        const mu_reversal here = {at->x, at->f, at->d};
        turn[at->turns++] = here;
    }
    at->direction = direction;
    at->x = x;
    while (at->turns > 1 && direction * (x - turn[at->turns - 2].x) >= 0.0) at->turns -= 2;
    z = mu_stretch(at->p, x - at->origin) + at->lead;
    if (at->turns == 1) {
        const double first = mu_stretch(at->p, turn[0].x - at->origin) + at->lead;
        if (direction * (z + first) >= 0.0) at->turns = 0;
    }
    if (at->turns > 0) {
        const mu_reversal *from = turn + (at->turns - 1);
        const double half = 0.5 * fabs(mu_stretch(at->p, x - from->x));
        at->f = from->f + 2.0 * direction * mu_loaded(half, &slope);
        at->d = from->d + 2.0 * direction * slope * half;
    } else if (fabs(z) < 1.5) {
        at->f = z < 0.0 ? -mu_loaded(-z, &slope) : mu_loaded(z, &slope);
        at->d = slope * (z - at->lead);
    } else { /* it slips, and drags its first loading behind */
        at->f = direction;
        at->d = 0.0;
        at->origin = x;
        at->lead = 1.5 * direction;
    }
}

/* Forces over mu0 (places, n) and their slopes along ln p at n samples of the place x under the
 * load Fz, for each p.  `before` samples from the first on are passed once before, to set the
 * state; start is the force over mu0 from which it begins, of a ball 0.  room: 3 (n + before)
 * numbers for a ball. */
static void mu_loop_forces(int contact, int64_t places, const double *p, int64_t n, int64_t before,
                           const double *x, const double *Fz, double start, double *room,
                           double *force, double *slope) {
    for (int64_t j = 0; j < places; ++j, force += n, slope += n) {
        double f = start, d = 0.0, last = x[0];
        mu_memory at = {p[j] / Fz[0], x[0], 0.0, 0.0, x[0], 0.0, 0, 0};
        for (int64_t i = 0; i < before + n; ++i) {
            const int64_t sample = i < before ? i : i - before;
            if (contact == MU_BALL) {
                mu_move_ball(&at, (mu_reversal *)room, x[sample]);
                f = at.f * Fz[0];
                d = at.d * Fz[0];
            } else {
                const double limit = Fz[sample], step = mu_stretch(p[j], x[sample] - last);
                f += step;
                d += step;
                if (!(fabs(f) <= limit)) {
                    f = f < 0.0 ? -limit : limit;
                    d = 0.0;
                }
                last = x[sample];
            }
            if (i >= before) {
                force[sample] = f;
                slope[sample] = d;
            }
        }
    }
}
