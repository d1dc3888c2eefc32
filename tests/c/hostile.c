/* Every combination of hostile values as the six inputs and as v~, y~, under sanitizers; prints what was answered. */
#include <math.h>
#include <stdio.h>

#include "mumacro.h"

static const double values[] = {
    -1.0, -0.0, 0.0, 5e-324, 1e-310, 1e-160, 1.0, 1e160, 1.7976931348623157e308, HUGE_VAL, -HUGE_VAL, NAN,
};
enum { N = sizeof values / sizeof *values };

static int wrong(const char *what) {
    printf("wrong: %s\n", what);
    return 1;
}

static int check_case(const double *x, long *answered, long *refused) {
    mumacro_answer a;
    mumacro_cycle c;
    const int error = mumacro_evaluate(x[0], x[1], x[2], x[3], x[4], x[5], &a);
    if (mumacro_evaluate_cycle(x[0], x[1], x[2], x[3], x[4], x[5], &c) != error) return wrong("two verdicts");
    if (error) {
        ++*refused;
        if (a.source != -1 || a.regime != -1 || a.mu_macro == a.mu_macro) return wrong("an answer to an illegal case");
        return c.power == c.power ? wrong("a power of an illegal case") : 0;
    }
    ++*answered;
    if (!(a.mu_ratio >= 0.0 && a.mu_ratio <= 1.0 && a.error_bound >= 0.0)) return wrong("value or bound");
    if (a.source < 0 || a.source >= MUMACRO_SOURCES || a.regime < 0) return wrong("source or regime");
    if (mumacro_mu_macro(x[0], x[1], x[2], x[3], x[4], x[5]) != a.mu_macro) return wrong("two values");
    if (!(c.stick_fraction >= 0.0 && c.stick_fraction <= 1.0)) return wrong("stick fraction");
    return 0;
}

static int is_legal(int quantity, double v, double y) {
    if (!(v >= 0.0 && y >= 0.0)) return 0;
    return y < HUGE_VAL || quantity == MUMACRO_STICK_FRACTION || (quantity == MUMACRO_POWER && v < HUGE_VAL);
}

static int check_point(double v, double y) {
    mumacro_point p;
    for (int quantity = -1; quantity <= 3; ++quantity) {
        const int error = mumacro_evaluate_point(quantity, v, y, &p);
        if (quantity < 0 || quantity > 2) {
            if (error != MUMACRO_NO_QUANTITY) return wrong("an unknown quantity");
        } else if ((error == 0) != is_legal(quantity, v, y)) {
            return wrong("legal or not");
        } else if ((error == 0) != (p.value == p.value) || (p.source >= 0) != (error == 0)) {
            return wrong("value without right, or right without value");
        }
    }
    (void)mumacro_mu_ratio(v, y);
    (void)mumacro_power(v, y);
    (void)mumacro_stick_fraction(v, y);
    (void)mumacro_v_tilde_crit(y);
    return 0;
}

int main(void) {
    long answered = 0, refused = 0;
    for (long code = 0; code < (long)N * N * N * N * N * N; code += 7) { /* 7 and 12 share no divisor */
        double x[6];
        long rest = code;
        for (int i = 0; i < 6; ++i, rest /= N) x[i] = values[rest % N];
        if (check_case(x, &answered, &refused)) return 1;
    }
    for (int i = 0; i < N * N; ++i)
        if (check_point(values[i / N], values[i % N])) return 1;
    if (mumacro_evaluate(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, NULL) != MUMACRO_NO_OUTPUT) return wrong("no place");
    if (mumacro_evaluate_cycle(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, NULL) != MUMACRO_NO_OUTPUT) return wrong("no place");
    if (mumacro_evaluate_point(0, 1.0, 1.0, NULL) != MUMACRO_NO_OUTPUT) return wrong("no place for the point");
    for (int code = -1000; code < 1000; ++code)
        if (!mumacro_source_name(code)[0] || (code && !mumacro_error_text(code)[0])) return wrong("no text");
    printf("answered %ld refused %ld\n", answered, refused);
    return 0;
}
