/* How far the force of one spring turns while it sticks: what a disturbance loses beside the decay
 * in slip (docs/derivations.md).
 *
 * Stick begins where the force, of length 1 and angle theta, is normal to the velocity, at
 * tau = pi/2 + a with sin a = (v~/y~) cot theta; it lasts for d, pi times the stick fraction, and
 * the spring's end moves by v~ d and y~ (cos(a + d) - cos a).  Then the length is 1 again:
 *
 *     2 v~ cos theta (d - sin d) - 2 y~ sin theta cos a (1 - cos d) + |way|^2 = 0 */

/* d - sin d of 0 <= d <= pi. */
static double mu_lag(double d, double sine) {
    const double z = d * d;
    if (d > 0.5) return d - sine;
    return d * z / 6.0 *
           (1.0 - z / 20.0 * (1.0 - z / 42.0 * (1.0 - z / 72.0 * (1.0 - z / 110.0))));
}

/* The left side and its slope along theta; half of |way|^2, which is 1 - cos(turn). */
typedef struct {
    double left, slope, half;
} mu_stuck_way;

static mu_stuck_way mu_stuck_way_at(double v, double y, double d, const double of_d[2],
                                    double theta) {
    double sine, cosine;
    mu_stuck_way out;
    mu_sine_cosine(theta, &sine, &cosine);
    {
        const double sine_a = mu_min(v / y * (mu_max(cosine, 0.0) / sine), 1.0),
                     cosine_a = sqrt((1.0 - sine_a) * (1.0 + sine_a));
        const double lag = mu_lag(d, of_d[0]), versed = of_d[1];
        const double x = v * d, z = -y * (sine_a * of_d[0] + cosine_a * versed);
        /* d a / d theta times cos a */
        const double turns = -v / y / (sine * sine), tangent = sine_a / mu_max(cosine_a, 1e-9);
        const double along = -y * turns * (of_d[0] - tangent * versed);
        out.left = 2.0 * (v * cosine * lag - y * sine * cosine_a * versed) + x * x + z * z;
        out.slope = -2.0 * (v * sine * lag + y * cosine * cosine_a * versed -
                            y * sine * turns * tangent * versed) +
                    2.0 * z * along;
        out.half = 0.5 * (x * x + z * z);
    }
    return out;
}

/* 1 - cos(turn) for a stick of the length d: the root by Newton's method between bounds.  The left
 * side falls with theta; where it does not reach zero, theta is pi/2. */
static double mu_turn_in_stick(double v, double y, double d) {
    double low, high = 0.5 * MU_PI, theta, of_d[2], half_sine, half_cosine;
    mu_stuck_way at;
    if (d <= 0.0) return 0.0;
    mu_sine_cosine(0.5 * d, &half_sine, &half_cosine);
    of_d[0] = 2.0 * half_sine * half_cosine;
    of_d[1] = 2.0 * half_sine * half_sine;
    /* below atan(v~/y~) the force is normal to no velocity */
    low = v < y ? mu_arcsine(v / mu_hypot(v, y)) : 0.25 * MU_PI;
    theta = high;
    at = mu_stuck_way_at(v, y, d, of_d, theta);
    if (at.left >= 0.0) return mu_min(at.half, 2.0);
    theta = 0.5 * (low + high);
    for (int i = 0; i < 60; ++i) {
        double next;
        at = mu_stuck_way_at(v, y, d, of_d, theta);
        if (at.left > 0.0)
            low = theta;
        else
            high = theta;
        next = theta - at.left / at.slope;
        if (!(next >= low && next <= high)) next = 0.5 * (low + high);
        /* the next step would be the square of this one, and moves the way by less */
        if (fabs(next - theta) <= 1e-9 * theta) i = 60;
        theta = next;
    }
    return mu_min(mu_stuck_way_at(v, y, d, of_d, theta).half, 2.0);
}

/* Rounding of v~, y~ and of the way, whose length is 2 at most. */
#define MU_TURN_ROUNDING (16.0 * MU_ROUNDING)

static void mu_turns_in_stick(int64_t n, const double *v, const double *y, const double *stick,
                              const double *bound, double *turn, double *error) {
    for (int64_t i = 0; i < n; ++i) {
        double low, high;
        turn[i] = error[i] = 0.0;
        if (!(0.0 <= v[i] && v[i] < HUGE_VAL && 0.0 < y[i] && y[i] < HUGE_VAL)) continue;
        turn[i] = mu_turn_in_stick(v[i], y[i], MU_PI * stick[i]);
        low = mu_turn_in_stick(v[i], y[i], MU_PI * (stick[i] - bound[i]));
        high = mu_turn_in_stick(v[i], y[i], MU_PI * mu_min(stick[i] + bound[i], 1.0));
        error[i] = mu_max(fabs(low - turn[i]), fabs(high - turn[i])) +
                   MU_TURN_ROUNDING * mu_min(turn[i], 1.0);
    }
}
