/* A stiffness that is known as an interval only: the extremes of mu_macro over it.
 *
 * v~ and y~ are both proportional to k, and r = y~/v~ stays.  Across, mu~ falls from 1
 * and, where r > 9.72, rises again between two turns, by up to 0.0087 per unit of ln k,
 * before it falls to its limit of rigid contact.  Along, mu~ falls all the way, normal it
 * rises: the ends are the extremes.
 *
 * Both turns begin in one point, y~ = 6.4 for one spring and 8.3 for a ball (there r = 10.4).
 * Samples stand close there, and two turns between two samples are seen by the cubic through these.
 * For larger r the lower turn goes down to y~ = 4.1, and the upper one goes up, below r^2/2:
 * samples enclose each, whose slopes have digits, which that of a far end may not have. */

#define MU_TURNING 9.7 /* r from which there are turns */
/* y~ of the close samples: the first, the step to the next, and how many */
#define MU_CLOSE_LOW 4.0
#define MU_CLOSE_STEP 1.13
#define MU_CLOSE_SAMPLES 12
#define MU_TURN_WIDTH 1e-7 /* around an extreme, relative to k: mu_macro there is flat to 1e-14 */

/* slope: d mu_macro / d ln k. */
typedef struct {
    double k, mu, slope;
} mu_sample;

typedef struct {
    const mumacro_data *data;
    int contact, direction;
    mu_inputs in;              /* but for k */
    double least, most, bound; /* of the samples so far */
    mu_sample last;
} mu_interval;

static mu_sample mu_take_sample(mu_interval *of, double k) {
    const mu_inputs *in = &of->in;
    const double *const columns[6] = {&in->mu0, &in->Fz, &k, &in->y0, &in->omega, &in->v0};
    static const int64_t strides[6] = {0, 0, 0, 0, 0, 0};
    double rows[MU_ROWS];
    int8_t source;
    mu_sample out;
    mu_cases_as(of->data, of->contact, of->direction, 1, columns, strides, MU_ROWS, rows, 1,
                &source);
    out.k = k;
    out.mu = rows[MU_ROW_MU_MACRO];
    out.slope = rows[MU_ROW_GRADIENT + 2] * k;
    of->least = mu_min(of->least, out.mu);
    of->most = mu_max(of->most, out.mu);
    of->bound = mu_max(of->bound, rows[MU_ROW_ERROR_BOUND]);
    return out;
}

static int mu_is_turn(double first, double last) {
    return (first < 0.0 && last > 0.0) || (first > 0.0 && last < 0.0);
}

/* The slope alone: a ball takes less time for it. */
static double mu_slope_alone(const mu_interval *of, double k) {
    mu_inputs in = of->in;
    double v, y;
    mu_slopes at;
    in.k = k;
    mu_groups(of->direction, &in, &v, &y);
    if (!(v < HUGE_VAL && y < HUGE_VAL)) return 0.0;
    at = mu_slopes_as(of->data, of->contact, of->direction, v, y);
    return in.mu0 * (at.along_v + at.along_y);
}

/* A sample at the turn between two, which come ever closer: by halves in ln k while they are far
 * apart, then by the secant of the slope, where an end that stays twice counts half (Illinois). */
static void mu_close_in(mu_interval *of, mu_sample left, mu_sample right) {
    double k = left.k;
    int side = 0;
    for (int i = 0; i < 60 && right.k > left.k * (1.0 + MU_TURN_WIDTH); ++i) {
        const double low = left.k * (1.0 + 0.4 * MU_TURN_WIDTH);
        const double high = right.k * (1.0 - 0.4 * MU_TURN_WIDTH);
        const double share = left.slope / (left.slope - right.slope);
        const double secant = left.k + share * (right.k - left.k);
        double slope;
        k = right.k > 4.0 * left.k ? sqrt(left.k) * sqrt(right.k)
                                   : mu_min(mu_max(secant, low), high);
        if (!(k > left.k && k < right.k)) break; /* denormal numbers */
        slope = mu_slope_alone(of, k);
        if (mu_is_turn(slope, right.slope)) {
            if (side < 0) right.slope *= 0.5;
            left.k = k;
            left.slope = slope;
            side = -1;
        } else {
            if (side > 0) left.slope *= 0.5;
            right.k = k;
            right.slope = slope;
            side = 1;
        }
    }
    (void)mu_take_sample(of, k);
}

/* Where two turns may hide between close samples whose slopes have the same sign: k of the extreme
 * slope of the cubic with their values and slopes, where it has the other sign; else 0. */
static double mu_hidden_turns(const mu_sample *before, const mu_sample *here) {
    const double length = mu_log1(here->k) - mu_log1(before->k), rise = here->mu - before->mu;
    const double first = before->slope * length, last = here->slope * length;
    const double bend = 3.0 * (first + last - 2.0 * rise);
    const double fall = 6.0 * rise - 4.0 * first - 2.0 * last;
    const double place = -0.5 * fall / bend, on = place * length; /* of the way, and in ln k */
    if (!(place > 0.0 && place < 1.0 && mu_is_turn(first, first + 0.5 * fall * place))) return 0.0;
    return mu_min(before->k * (1.0 + on * (1.0 + 0.5 * on)), here->k); /* exp(on), nearly */
}

/* The next sample, and the turns since the last one. */
static void mu_go_on(mu_interval *of, double k) {
    const mu_sample before = of->last;
    mu_sample here;
    if (!(k > before.k)) return;
    of->last = here = mu_take_sample(of, k);
    if (mu_is_turn(before.slope, here.slope)) {
        mu_close_in(of, before, here);
    } else if (k < 1.01 * MU_CLOSE_STEP * before.k) {
        const double between = mu_hidden_turns(&before, &here);
        if (between > before.k) {
            const mu_sample inside = mu_take_sample(of, between);
            if (!mu_is_turn(before.slope, inside.slope)) return;
            mu_close_in(of, before, inside);
            mu_close_in(of, inside, here);
        }
    }
}

/* The smallest and the largest mu_macro for low <= k <= high, and the largest
 * bound met; NaN for what is no case. */
static void mu_extremes_of(const mumacro_data *data, int contact, int direction,
                           const mu_inputs *low, double high, double out[MU_EXTREME_ROWS]) {
    const double end = low->k, ratio = mu_amplitude_ratio(low);
    mu_interval of = {data, contact, direction, *low, HUGE_VAL, -HUGE_VAL, 0.0, {0.0, 0.0, 0.0}};
    for (int i = 0; i < MU_EXTREME_ROWS; ++i) out[i] = NAN;
    if (mu_first_bad(direction, low) || !(end <= high && high < HUGE_VAL)) return;
    of.last = mu_take_sample(&of, end);
    if (direction == MU_ACROSS && ratio > MU_TURNING) {
        const double unit = mu_quotient(low->mu0, low->Fz, low->y0, 1.0, 1.0); /* k for y~ = 1 */
        double k = MU_CLOSE_LOW * unit;
        for (int i = 0; i < MU_CLOSE_SAMPLES; ++i, k *= MU_CLOSE_STEP)
            mu_go_on(&of, mu_min(k, high));
        /* beyond, mu~ falls, in the end by less than its last digit */
        mu_go_on(&of, mu_min(0.5 * unit * ratio * ratio, high));
    }
    mu_go_on(&of, high);
    if (!(of.least <= of.most)) return;
    out[MU_EXTREME_LOW] = of.least;
    out[MU_EXTREME_HIGH] = of.most;
    out[MU_EXTREME_BOUND] = of.bound;
}
