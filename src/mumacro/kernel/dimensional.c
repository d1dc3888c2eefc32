/* Cases in SI units: the groups y~ = y0 k / (mu0 Fz) and v~ = v0 k / (mu0 Fz omega), eqs. (6), (8),
 * unusual inputs, and the chain rule to the six inputs.  An infinite k is rigid contact, eq.
 * (37). */

typedef struct {
    double mu0, Fz, k, y0, omega, v0;
} mu_inputs;

/* 0 for a legal case, else 1 + the place of its first bad input.  Where the normal force oscillates
 * y0 stands for its amplitude, which is below Fz: else the contact lifts off. */
static int mu_first_bad(int direction, const mu_inputs *in) {
    if (!(in->mu0 > 0.0 && in->mu0 < HUGE_VAL)) return 1;
    if (!(in->Fz > 0.0 && in->Fz < HUGE_VAL)) return 2;
    if (!(in->k > 0.0)) return 3;
    if (!(in->y0 >= 0.0 && in->y0 < (direction == MU_NORMAL ? in->Fz : HUGE_VAL))) return 4;
    if (!(in->omega >= 0.0 && in->omega < HUGE_VAL)) return 5;
    return in->v0 >= 0.0 && in->v0 < HUGE_VAL ? 0 : 6;
}

/* r = y~/v~ = y0 omega/v0, which needs no stiffness. */
static double mu_amplitude_ratio(const mu_inputs *in) {
    const double product = in->y0 * in->omega;
    return product > 1e-290 && product < 1e290 ? product / in->v0
                                               : mu_quotient(in->y0, in->omega, in->v0, 1.0, 1.0);
}

/* The groups of any legal case: v~ is infinite where nothing oscillates, both are for rigid
 * contact; z for y~ where the normal force oscillates. */
static void mu_groups(int direction, const mu_inputs *in, double *v, double *y) {
    const int rigid = in->k == HUGE_VAL;
    *v = in->v0 > 0.0 ? HUGE_VAL : 0.0;
    *y = in->y0 == 0.0 ? 0.0 : rigid ? HUGE_VAL : mu_quotient(in->y0, in->k, in->mu0, in->Fz, 1.0);
    if (direction == MU_NORMAL) *y = in->y0 / in->Fz;
    if (in->y0 > 0.0 && in->omega > 0.0 && in->v0 > 0.0 && !rigid)
        *v = mu_quotient(in->v0, in->k, in->mu0, in->Fz, in->omega);
}

/* mu~ of rigid contact at r = y~/v~: eq. (35), or the mean direction of slip. */
static double mu_rigid_ratio(int direction, double r) {
    if (direction == MU_ACROSS) return mu_outer_expansion(r).first;
    return r > 1.0 ? MU_TWO_OVER_PI * mu_arcsine(1.0 / r) : 1.0;
}

/* Its slope along ln r. */
static double mu_rigid_slope(int direction, double r) {
    if (direction == MU_ACROSS) return mu_outer_expansion(r).first_slope;
    return r > 1.0 ? -MU_TWO_OVER_PI / sqrt((r - 1.0) * (r + 1.0)) : 0.0;
}

/* mu~ of any case of any contact, and the groups: zero inputs, rigid contact, groups beyond
 * double precision.  `at`, unless NULL, gets the slopes of a case along or normal with finite
 * groups, which cost nothing more. */
static mu_answer mu_any_case(const mumacro_data *data, int contact, int direction,
                             const mu_inputs *in, double *v, double *y, mu_slopes *at) {
    double r, mu;
    int source;
    *v = *y = NAN;
    if (mu_first_bad(direction, in)) return mu_limit(NAN, NAN, -1);
    mu_groups(direction, in, v, y);
    if (in->y0 == 0.0 || in->omega == 0.0) return mu_limit(1.0, 0.0, MU_NO_OSCILLATION);
    if (in->v0 == 0.0 && *y == HUGE_VAL) return mu_limit(0.0, 0.0, MU_STATIC_LIMIT);
    if (*y == 0.0 && in->v0 > 0.0) return mu_limit(1.0, MU_ROUNDING, MU_NO_OSCILLATION);
    if ((*v < HUGE_VAL && *y < HUGE_VAL) || direction == MU_NORMAL) {
        mu_answer answer;
        if (at && direction != MU_ACROSS) {
            const mu_driven driven = mu_drive(data, contact, direction, *v, *y);
            *at = mu_slopes_of_driven(&driven);
            answer = mu_limit(at->value, at->bound, driven.line.source);
        } else {
            answer = mu_answer_as(data, contact, direction, MU_MU_RATIO, *v, *y);
        }
        /* v~ below 5e-324: the static limit holds to rounding, mu~ itself underflows for y~ > 1 */
        if (*v == 0.0 && in->v0 > 0.0) answer.bound += MU_DENORMAL;
        return answer;
    }
    r = mu_amplitude_ratio(in);
    source = direction == MU_ALONG && r > 1.0 ? MU_RIGID_REVERSES : MU_RIGID;
    if (r == 0.0) return mu_limit(1.0, MU_RIGID_ROUNDING, source);
    /* eq. (35) is 2.5e-306 there */
    if (r == HUGE_VAL) return mu_limit(0.0, 3.0 * MU_DENORMAL, source);
    mu = mu_rigid_ratio(direction, r);
    /* y~ beyond double range: only the outer solution is left, corrected by
     * the layers when v~ is not large */
    return mu_limit(mu, MU_RIGID_ROUNDING * mu + (in->k == HUGE_VAL || *v > 1e150 ? 0.0 : mu),
                    source);
}

/* What the chain rule takes of each case: mu~ and its slopes along ln v~ and
 * ln y~, and the bounds of all three. */
enum { MU_OF_MU, MU_OF_V, MU_OF_Y, MU_OF_BOUND, MU_OF_BOUND_V, MU_OF_BOUND_Y, MU_TERMS };

/* Whether a product of two numbers has all its digits; zero has them where a factor is zero. */
MU_INLINE int mu_is_plain(double product) {
    return fabs(product) > 1e-290 && fabs(product) < 1e290;
}

/* mu0 slope / input, whose product may leave the range of numbers where the result does not. */
static double mu_chain(double mu0, double slope, double input) {
    const double product = mu0 * slope, size = fabs(slope);
    if (mu_is_plain(product) || !(size > 0.0 && size < HUGE_VAL && input > 0.0))
        return product / input;
    return (slope < 0.0 ? -1.0 : 1.0) * mu_quotient(mu0, size, input, 1.0, 1.0);
}

/* sign mu0 slope / input. */
static void mu_chain_row(int n, double sign, const double *mu0, const double *slope,
                         const double *input, double *out) {
    int odd = 0;
    for (int i = 0; i < n; ++i) {
        const double product = sign * mu0[i] * slope[i];
        odd |= !mu_is_plain(product);
        out[i] = product / input[i];
    }
    for (int i = 0; odd && i < n; ++i) out[i] = sign * mu_chain(mu0[i], slope[i], input[i]);
}

/* d mu_macro / d input of cases without zeros and infinities, and the
 * bounds: 12 rows, stride apart. */
static void mu_chain_rule(int direction, int n, double in[6][MU_CHUNK],
                          double terms[MU_TERMS][MU_CHUNK], double *out, int64_t stride) {
    for (int bounds = 0; bounds < 2; ++bounds, out += 6 * stride) {
        double (*of)[MU_CHUNK] = terms + (bounds ? MU_OF_BOUND : MU_OF_MU), both[MU_CHUNK];
        /* z = Fz_amplitude / Fz has neither mu0 nor k */
        const double *stiff = direction == MU_NORMAL ? of[MU_OF_V] : both,
                     sign = bounds ? 1.0 : -1.0;
        for (int i = 0; i < n; ++i) both[i] = of[MU_OF_V][i] + of[MU_OF_Y][i];
        for (int i = 0; i < n; ++i) out[i] = of[MU_OF_MU][i] + sign * stiff[i];
        mu_chain_row(n, sign, in[0], both, in[1], out + stride);
        mu_chain_row(n, 1.0, in[0], stiff, in[2], out + 2 * stride);
        mu_chain_row(n, 1.0, in[0], of[MU_OF_Y], in[3], out + 3 * stride);
        mu_chain_row(n, sign, in[0], of[MU_OF_V], in[4], out + 4 * stride);
        mu_chain_row(n, 1.0, in[0], of[MU_OF_V], in[5], out + 5 * stride);
    }
}

/* Whether slopes bring a bound of the value by its cell with them. */
MU_INLINE int mu_has_cells(int source) {
    return source < MU_CHARTS || source == MU_BALL_SLIDES || source == MU_BALL_PARTLY;
}

static void mu_set_terms(mu_answer answer, mu_slopes at, double terms[MU_TERMS][MU_CHUNK], int i) {
    terms[MU_OF_MU][i] = answer.value;
    terms[MU_OF_V][i] = at.along_v;
    terms[MU_OF_Y][i] = at.along_y;
    terms[MU_OF_BOUND][i] =
        mu_has_cells(answer.source) ? mu_min(answer.bound, at.bound) : answer.bound;
    terms[MU_OF_BOUND_V][i] = at.bound_v;
    terms[MU_OF_BOUND_Y][i] = at.bound_y;
}

/* slope k / (Fz omega) of slope >= 0. */
static double mu_per_speed(double slope, const mu_inputs *in) {
    const double per_force = in->k / in->Fz, unit = per_force / in->omega;
    if ((mu_is_plain(per_force) && mu_is_plain(unit) && mu_is_plain(slope * unit)) ||
        !(slope > 0.0 && slope < HUGE_VAL))
        return slope > 0.0 ? slope * unit : slope;
    return mu_quotient(slope, in->k, in->Fz, in->omega, 1.0);
}

/* The same of any case; `slopes` is NULL where they are still to be found.  One-sided at the edges:
 * d/dy0 = 0 at y0 = 0, d/domega = 0 at omega = 0, d/dv0 = mu0/(l0 omega) dmu~/dv~ at v0 = 0,
 * infinite on y~ = 1 and for rigid contact.  Relative to k the slope is 0 for rigid contact. */
static void mu_gradient(const mumacro_data *data, int contact, int direction, const mu_inputs *in,
                        mu_answer answer, const mu_slopes *slopes, double v, double y, double *out,
                        int64_t stride) {
    const double mu0 = in->mu0, six[6] = {in->mu0, in->Fz, in->k, in->y0, in->omega, in->v0};
    double *error = out + 6 * stride;
    const int rigid = answer.source == MU_RIGID || answer.source == MU_RIGID_REVERSES;
    if (answer.source != -1 && !rigid && answer.source != MU_NO_OSCILLATION &&
        !(answer.source == MU_STATIC_LIMIT && y == HUGE_VAL)) {
        const mu_slopes at = slopes ? *slopes : mu_slopes_as(data, contact, direction, v, y);
        double inputs[6][MU_CHUNK], terms[MU_TERMS][MU_CHUNK];
        for (int i = 0; i < 6; ++i) inputs[i][0] = six[i];
        mu_set_terms(answer, at, terms, 0);
        mu_chain_rule(direction, 1, inputs, terms, out, stride);
        if (!(v > 0.0)) { /* mu0 over l0 omega */
            double bound, slope = mu_speed_slope_as(data, contact, direction, y, &bound);
            out[5 * stride] = mu_per_speed(slope, in);
            error[5 * stride] = mu_per_speed(bound, in);
        }
        return;
    }
    for (int i = 0; i < 12; ++i) out[i * stride] = answer.source == -1 ? NAN : 0.0;
    if (answer.source == -1) return;
    out[0] = answer.value;
    error[0] = answer.bound;
    if (answer.source == MU_STATIC_LIMIT) out[5 * stride] = error[5 * stride] = HUGE_VAL;
    if (rigid) {
        const double rounding = 8.0 * MU_ROUNDING * answer.value;
        const double all = rounding + (answer.bound > rounding ? answer.bound : 0.0);
        const int oscillates = answer.value < 1.0 || in->y0 * in->omega > 0.0;
        const double along = oscillates ? mu_rigid_slope(direction, mu_amplitude_ratio(in)) : 0.0;
        for (int i = 3; i < 6; ++i) {
            out[i * stride] = (i < 5 ? 1.0 : -1.0) * mu_chain(mu0, along, six[i]);
            error[i * stride] = mu_chain(mu0, all, six[i]);
        }
    }
}

/* --- many cases ------------------------------------------------------------------------------- */

/* v~ and y~ where inputs are legal and no product is near the ends of the range, else -1: with mu0
 * and k positive, positive products leave no negative factor, and NaN fails the comparisons. */
MU_INLINE void mu_pass_groups(int n, double in[6][MU_CHUNK], double *v, double *y) {
    for (int i = 0; i < n; i += MU_LANES) {
        const mu_lanes mu0 = mu_load(in[0] + i), k = mu_load(in[2] + i), omega = mu_load(in[4] + i);
        const mu_lanes force = mu0 * mu_load(in[1] + i), stretch = mu_load(in[3] + i) * k;
        const mu_lanes speed = mu_load(in[5] + i) * k, rate = force * omega;
        const mu_lanes slow = speed / rate, small = stretch / force;
        const mu_mask low = MU_WHERE(force > 1e-290) & MU_WHERE(stretch > 1e-290) &
                            MU_WHERE(speed > 1e-290) & MU_WHERE(rate > 1e-290);
        const mu_mask high = MU_WHERE(force < 1e290) & MU_WHERE(stretch < 1e290) &
                             MU_WHERE(speed < 1e290) & MU_WHERE(rate < 1e290);
        const mu_mask plain = low & high & MU_WHERE(mu0 > 0.0) & MU_WHERE(k > 0.0) &
                              MU_WHERE(slow > 0.0) & MU_WHERE(slow < HUGE_VAL) &
                              MU_WHERE(small > 0.0) & MU_WHERE(small < HUGE_VAL);
        mu_store(v + i, mu_select(plain, slow, mu_all(-1.0)));
        mu_store(y + i, mu_select(plain, small, mu_all(-1.0)));
    }
}

/* l0 = mu0 Fz / k, eq. (5); 0 for rigid contact. */
static double mu_length_scale(double mu0, double Fz, double k) {
    const double quotient = Fz / k, length = mu0 * quotient;
    int64_t i, j, l;
    if (k == HUGE_VAL || (mu_min(quotient, length) > 1e-290 && mu_max(quotient, length) < 1e290))
        return length;
    const double mantissa = mu_split(mu0, &i) * (mu_split(Fz, &j) / mu_split(k, &l));
    return mu_scale(mantissa, i + j - l);
}

/* Up to MU_CHUNK cases; in: the six inputs, filled up to whole lanes. */
MU_INLINE void mu_chunk_of_cases(const mumacro_data *data, int contact, int n,
                                 double in[6][MU_CHUNK], int rows, double *out, int64_t stride,
                                 int8_t *source) {
    double v[MU_CHUNK], y[MU_CHUNK], *mu = out + MU_ROW_MU_RATIO * stride,
                                     *bound = out + MU_ROW_ERROR_BOUND * stride;
    double *slopes = rows == MU_ROWS ? out + MU_ROW_GRADIENT * stride : NULL;
    mu_chunk c;
    mu_slope slope[MU_CHUNK];
    int left;
    mu_pass_groups(n, in, v, y);
    left = mu_chunk_of_ratios(data, contact, n, v, y, &c, slopes ? slope : NULL, mu, bound, source);
    if (slopes) {
        double terms[MU_TERMS][MU_CHUNK];
        const mu_slopes none = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        for (int i = 0; i < n; ++i) {
            const int later = mu_is_left(c.block[i]);
            const mu_slopes at =
                later ? none : mu_slopes_of(data, contact, MU_MU_RATIO, &c, slope, i, v[i], y[i]);
            mu_set_terms(mu_limit(at.value, bound[i], source[i]), at, terms, i);
        }
        mu_chain_rule(MU_ACROSS, n, in, terms, slopes, stride);
    }
    for (int i = 0; left && i < n; ++i) {
        const mu_inputs six = {in[0][i], in[1][i], in[2][i], in[3][i], in[4][i], in[5][i]};
        mu_answer answer = {mu[i], bound[i], source[i]};
        if (!mu_is_left(c.block[i])) continue;
        if (v[i] == -1.0) answer = mu_any_case(data, contact, MU_ACROSS, &six, v + i, y + i, NULL);
        mu[i] = answer.value;
        bound[i] = answer.bound;
        source[i] = (int8_t)answer.source;
        if (slopes)
            mu_gradient(data, contact, MU_ACROSS, &six, answer, NULL, v[i], y[i], slopes + i,
                        stride);
    }
    for (int i = 0; i < n; ++i) {
        out[i] = mu[i] * in[0][i];
        bound[i] *= in[0][i];
    }
    if (rows > MU_ROW_V_TILDE) {
        memcpy(out + MU_ROW_V_TILDE * stride, v, (size_t)n * sizeof *v);
        memcpy(out + MU_ROW_Y_TILDE * stride, y, (size_t)n * sizeof *y);
        for (int i = 0; i < n; ++i)
            out[MU_ROW_LENGTH_SCALE * stride + i] =
                source[i] < 0 ? NAN : mu_length_scale(in[0][i], in[1][i], in[2][i]);
    }
}

MU_INLINE void mu_cases_of(const mumacro_data *data, int contact, int64_t n,
                           const double *const *columns, const int64_t *strides, int rows,
                           double *out, int64_t stride, int8_t *source) {
    for (int64_t start = 0; start < n; start += MU_CHUNK) {
        const int few = mu_few(n - start);
        const int whole = (few + MU_LANES - 1) / MU_LANES * MU_LANES;
        double in[6][MU_CHUNK];
        for (int i = 0; i < 6; ++i) {
            if (strides[i]) memcpy(in[i], columns[i] + start, (size_t)few * sizeof **in);
            for (int j = strides[i] ? few : 0; j < whole; ++j)
                in[i][j] = strides[i] ? 1.0 : columns[i][0];
        }
        mu_chunk_of_cases(data, contact, few, in, rows, out + start, stride, source + start);
    }
}

static void mu_cases(const mumacro_data *data, int contact, int64_t n, const double *const *columns,
                     const int64_t *strides, int rows, double *out, int64_t stride,
                     int8_t *source) {
    if (contact == MU_BALL)
        mu_cases_of(data, MU_BALL, n, columns, strides, rows, out, stride, source);
    else
        mu_cases_of(data, MU_SPRING, n, columns, strides, rows, out, stride, source);
}

/* As mu_cases, of any contact and direction; where the normal force oscillates,
 * y0's column holds its amplitude. */
static void mu_cases_as(const mumacro_data *data, int contact, int direction, int64_t n,
                        const double *const *columns, const int64_t *strides, int rows, double *out,
                        int64_t stride, int8_t *source) {
    if (direction == MU_ACROSS) {
        mu_cases(data, contact, n, columns, strides, rows, out, stride, source);
        return;
    }
    for (int64_t i = 0; i < n; ++i) {
        double in[6], v, y;
        mu_inputs six;
        mu_answer answer;
        mu_slopes at, *slopes = rows == MU_ROWS ? &at : NULL;
        for (int j = 0; j < 6; ++j) in[j] = columns[j][strides[j] ? i : 0];
        memcpy(&six, in, sizeof six);
        answer = mu_any_case(data, contact, direction, &six, &v, &y, slopes);
        out[MU_ROW_MU_MACRO * stride + i] = answer.value * six.mu0;
        out[MU_ROW_MU_RATIO * stride + i] = answer.value;
        out[MU_ROW_ERROR_BOUND * stride + i] = answer.bound * six.mu0;
        source[i] = (int8_t)answer.source;
        if (rows > MU_ROW_V_TILDE) {
            out[MU_ROW_V_TILDE * stride + i] = v;
            out[MU_ROW_Y_TILDE * stride + i] = y;
            out[MU_ROW_LENGTH_SCALE * stride + i] =
                answer.source < 0 ? NAN : mu_length_scale(six.mu0, six.Fz, six.k);
        }
        if (rows == MU_ROWS)
            mu_gradient(data, contact, direction, &six, answer, slopes, v, y,
                        out + MU_ROW_GRADIENT * stride + i, stride);
    }
}

static void mu_one(const mumacro_data *data, int contact, double mu0, double Fz, double k,
                   double y0, double omega, double v0, int with_gradient, mumacro_case *out) {
    double in[6][MU_CHUNK], rows[MU_ROWS];
    const double six[6] = {mu0, Fz, k, y0, omega, v0};
    int8_t source;
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < MU_LANES; ++j) in[i][j] = six[i];
    if (contact == MU_BALL)
        mu_chunk_of_cases(data, MU_BALL, 1, in, with_gradient ? MU_ROWS : MU_ROW_GRADIENT, rows, 1,
                          &source);
    else
        mu_chunk_of_cases(data, MU_SPRING, 1, in, with_gradient ? MU_ROWS : MU_ROW_GRADIENT, rows,
                          1, &source);
    out->mu_macro = rows[MU_ROW_MU_MACRO];
    out->mu_ratio = rows[MU_ROW_MU_RATIO];
    out->error_bound = rows[MU_ROW_ERROR_BOUND];
    out->v_tilde = rows[MU_ROW_V_TILDE];
    out->y_tilde = rows[MU_ROW_Y_TILDE];
    out->length_scale = rows[MU_ROW_LENGTH_SCALE];
    out->source = source;
    if (with_gradient) {
        memcpy(out->gradient, rows + MU_ROW_GRADIENT, sizeof out->gradient);
        memcpy(out->gradient_bound, rows + MU_ROW_GRADIENT_BOUND, sizeof out->gradient_bound);
    }
}
