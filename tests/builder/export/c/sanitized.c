/* Every entry of the kernel and of mumacro.h under sanitizers: random, nasty and illegal inputs,
 * with a real table and with tables of nonsense.  Arrays are allocated to the last number, so that
 * one too many is seen.  What the numbers are is tested elsewhere.  Prints how much was asked. */
#include <stdio.h>
#include <stdlib.h>

#define MUMACRO_LEVEL base
#include "level.c"
#include "mumacro.h"

extern const mumacro_export mumacro_table;
#include "interface.c"

static const double nasty[] = {
    -1.0,     -0.0,      0.0, 5e-324, 1e-310, 1e-160, 1.0, 1e160, 1.7976931348623157e308,
    HUGE_VAL, -HUGE_VAL, NAN,
};
/* a ball costs as much as 100 springs */
enum { NASTY = sizeof nasty / sizeof *nasty, LONGEST = 1000, FEW = 16, MOTIONS = 400 };

static uint64_t state = 88172645463325252u;

/* xorshift64, in [0, 1). */
static double drawn(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53;
}

static double scaled(double low, double high) { return pow(10.0, low + (high - low) * drawn()); }

/* A number of any size and kind. */
static double anything(void) {
    const double way = drawn(), sign = drawn() < 0.5 ? -1.0 : 1.0;
    if (way < 0.1) return nasty[(int)(drawn() * NASTY)];
    if (way < 0.5) return sign * scaled(-2.0, 6.0);
    return way < 0.6 ? sign * scaled(-320.0, 308.0) : sign * drawn() * 20.0;
}

static double *numbers(size_t n) {
    double *made = (double *)malloc(n * sizeof *made);
    if (made == NULL) exit(2);
    return made;
}

static double *nonsense(size_t n) {
    double *made = numbers(n);
    for (size_t i = 0; i < n; ++i) made[i] = anything();
    return made;
}

static void wrong(const char *what) {
    printf("wrong: %s\n", what);
    exit(1);
}

static volatile double used; /* by it no call is left out as needless */

/* Points v, y through every function of points, in an array of n and alone. */
static void ask_points(const mumacro_kernel *kernel, const mumacro_data *data, int64_t n,
                       const double *v, const double *y) {
    double *value = numbers((size_t)n), *bound = numbers((size_t)n), *again = numbers((size_t)n);
    double *rows = numbers(5 * (size_t)n);
    int8_t *source = (int8_t *)malloc((size_t)n);
    for (int quantity = 0; quantity < 3; ++quantity) {
        kernel->values(data, 0, 0, quantity, n, v, y, value, bound, source);
        kernel->values(data, 0, 0, quantity, n, v, y, again, NULL, NULL);
        kernel->values(data, 0, 0, quantity, n, v, y, again, NULL, source);
        kernel->values(data, 0, 0, quantity, n, v, y, again, bound, NULL);
        /* the ball's cells have no errors of slopes but those of mu~, which
         * is all that is asked of a ball */
        for (int contact = data == &mumacro_table.ball; contact < MU_CONTACTS; ++contact)
            kernel->slopes(data, contact, quantity, n, v, y, rows, n);
        for (int64_t i = 0; i < n; ++i)
            if (source[i] < -1 || source[i] >= MU_SOURCES) wrong("a source that there is not");
    }
    for (int64_t i = 0; i < n; ++i) used = kernel->ratio(data, v[i], y[i]);
    for (int kind = 0; kind < MU_CONTACTS * MU_DIRECTIONS; ++kind) {
        const int contact = kind / MU_DIRECTIONS, direction = kind % MU_DIRECTIONS;
        kernel->border_as(data, contact, direction, n, y, bound);
        for (int quantity = 0; quantity < 3; ++quantity)
            kernel->values(data, contact, direction, quantity, n < FEW ? n : FEW, v, y, value,
                           bound, source);
    }
    free(value), free(bound), free(again), free(rows), free(source);
}

/* n cases through every function of cases; where column i is single, all have its first number. */
static void ask_cases(const mumacro_kernel *kernel, const mumacro_data *data, int64_t n,
                      double *const *columns, int single) {
    static const int ends[3] = {MU_ROW_V_TILDE, MU_ROW_GRADIENT, MU_ROWS};
    const size_t size = (size_t)n;
    double *rows[3], *high = numbers(size), *extremes = numbers(MU_EXTREME_ROWS * size);
    int8_t *source = (int8_t *)malloc(size);
    mumacro_columns in;
    memset(&in, 0, sizeof in);
    for (int i = 0; i < 6; ++i) {
        if (i == single)
            in.constant[i] = columns[i][0];
        else
            in.array[i] = columns[i];
    }
    for (int i = 0; i < 3; ++i) {
        rows[i] = numbers((size_t)ends[i] * size);
        kernel->cases(data, 0, 0, n, &in, ends[i], rows[i], n, source);
    }
    for (int kind = 1; kind < MU_CONTACTS * MU_DIRECTIONS; ++kind)
        kernel->cases(data, kind / MU_DIRECTIONS, kind % MU_DIRECTIONS, n < FEW ? n : FEW, &in,
                      MU_ROWS, rows[2], n, source);
    for (int64_t i = 0; i < n; ++i)
        high[i] = columns[2][single == 2 ? 0 : i] * scaled(-0.1, drawn() < 0.5 ? 4.0 : 600.0);
    for (int kind = 0; kind < MU_CONTACTS * MU_DIRECTIONS; ++kind)
        kernel->intervals(data, kind / MU_DIRECTIONS, kind % MU_DIRECTIONS,
                          kind      ? n < 2 ? n : 2
                          : n < FEW ? n
                                    : FEW,
                          &in, high, extremes, n);
    for (int64_t i = 0; i < n; ++i) {
        double x[6];
        mumacro_case *answer = (mumacro_case *)malloc(sizeof *answer);
        if (answer == NULL) exit(2);
        for (int j = 0; j < 6; ++j) x[j] = columns[j][j == single ? 0 : i];
        kernel->one(data, i % 4 / 2, x[0], x[1], x[2], x[3], x[4], x[5], i % 2, answer);
        free(answer);
    }
    free(rows[0]), free(rows[1]), free(rows[2]), free(high), free(extremes), free(source);
}

/* A motion of a few harmonics, in room for few steps or for many; every eighth is that of a
 * ball. */
static void ask_motions(const mumacro_kernel *kernel, int turn) {
    const int ball = turn % 8 == 1;
    const int32_t counts[3] = {(int32_t)(drawn() * 3.0), (int32_t)(drawn() * 3.0),
                               ball ? 0 : (int32_t)(drawn() * 2.0)};
    const int terms = counts[0] + counts[1] + counts[2], n = 1 + (int)(drawn() * 50.0);
    const int64_t room = (int64_t)1 << (3 + (int)(drawn() * 14.0)),
                  most = (int64_t)1 << (int)(drawn() * 28.0);
    const int32_t stop = drawn() < 0.02;
    const double tolerance = scaled(ball ? -5.0 : -8.0, -2.0);
    double *orders = numbers((size_t)terms + 1), *one = numbers(1 + 2 * (size_t)terms);
    double *work = numbers(2 * (size_t)room), *out = numbers(7),
           *forces = numbers(2 * (size_t)n + 2);
    double *shares = numbers(2), *weights = numbers(2);
    one[0] = drawn() < 0.1 ? 0.0 : scaled(-6.0, 2.0);
    for (int i = 0; i < terms; ++i) {
        orders[i] = 1 + (int)(drawn() * 4.0);
        one[1 + 2 * i] = i < counts[0] + counts[1] ? scaled(-6.0, ball ? 1.0 : 3.0) : 0.9 * drawn();
        one[2 + 2 * i] = 7.0 * drawn();
    }
    shares[0] = weights[0] = 0.5, shares[1] = weights[1] = 1.0;
    kernel->motions(ball, 1, counts, orders, one, tolerance, room, work, most, &stop, out);
    kernel->motion_cycle(counts, orders, one, 2, shares, weights, tolerance, room, work, most,
                         &stop, n, forces);
    free(orders), free(one), free(work), free(out), free(forces), free(shares), free(weights);
}

/* Steps of n contacts of a few springs, whose forces are what x holds. */
static void ask_elements(const mumacro_kernel *kernel, int64_t n, double *const *x) {
    const int springs = 1 + (int)(drawn() * 5.0);
    double *held = nonsense(2 * (size_t)(n * springs)), *sums = numbers(2 * (size_t)n);
    for (int step = 0; step < 3; ++step)
        kernel->element_steps(n, springs, x[0], x[1], x[2], x[3], x[5], held, sums);
    free(held), free(sums);
}

/* One case through the plain functions of mumacro.h: an answer only where it is right. */
static void check_case(const double *x) {
    mumacro_answer a;
    mumacro_cycle c;
    const int error = mumacro_evaluate(x[0], x[1], x[2], x[3], x[4], x[5], &a);
    (void)mumacro_evaluate_cycle(x[0], x[1], x[2], x[3], x[4], x[5], &c);
    used = mumacro_mu_macro(x[0], x[1], x[2], x[3], x[4], x[5]);
    if (error ? a.source != -1 || a.regime != -1 || a.mu_macro == a.mu_macro
              : !(a.mu_ratio >= 0.0 && a.mu_ratio <= 1.0 && a.error_bound >= 0.0))
        wrong("an answer to an illegal case, value or bound");
}

static void check_point(double v, double y) {
    mumacro_point p;
    for (int quantity = -1; quantity <= 3; ++quantity) {
        const int error = mumacro_evaluate_point(quantity, v, y, &p);
        if ((error == 0) != (p.value == p.value) || (p.source >= 0) != (error == 0))
            wrong("value without right");
    }
    used = mumacro_mu_ratio(v, y) + mumacro_power(v, y) + mumacro_stick_fraction(v, y) +
           mumacro_v_tilde_crit(y);
}

/* Without a place for the answer, and with codes that there are not. */
static void check_misuse(void) {
    if (mumacro_evaluate(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, NULL) != MUMACRO_NO_OUTPUT)
        wrong("no place");
    if (mumacro_evaluate_cycle(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, NULL) != MUMACRO_NO_OUTPUT)
        wrong("no place");
    if (mumacro_evaluate_point(0, 1.0, 1.0, NULL) != MUMACRO_NO_OUTPUT)
        wrong("no place for the point");
    for (int code = -1000; code < 1000; ++code)
        if (!mumacro_source_name(code)[0] || (code && !mumacro_error_text(code)[0]))
            wrong("no text");
}

/* One case in every contact and direction; its force, and the elements of a few springs. */
static void ask_calls(const double *x, double v_rest) {
    double held[8], *sum = numbers(2);
    mumacro_answer *answer = (mumacro_answer *)malloc(sizeof *answer);
    if (answer == NULL) exit(2);
    for (int contact = -1; contact <= MU_CONTACTS; ++contact)
        for (int direction = -1; direction <= MU_DIRECTIONS; ++direction) {
            const int error =
                mumacro_evaluate_as(contact, direction, x[0], x[1], x[2], x[3], x[4], x[5], answer);
            if ((error != 0) != (answer->source < 0) ||
                (error != 0) != (answer->mu_macro != answer->mu_macro))
                wrong("an answer beside its error");
        }
    used = mumacro_force(x[5], v_rest, x[0], x[1], x[2], x[3], x[4]);
    for (int springs = 0; springs <= 4; ++springs) {
        memset(held, 0, sizeof held);
        for (int step = 0; step < 3; ++step)
            (void)mumacro_element_step(springs, x[0], x[1], x[2], x[3], x[5], held, sum);
    }
    free(sum), free(answer);
}

/* What the builder calls. */
static void ask_builder(const mumacro_kernel *kernel, int64_t n, const double *v, const double *y) {
    double *one = numbers((size_t)n), *two = numbers((size_t)n), *rows = numbers(5 * (size_t)n);
    for (int quantity = 0; quantity < 3; ++quantity)
        for (int contact = 0; contact < MU_CONTACTS; ++contact)
            for (int block = 0; block < (contact ? (int)MU_BALL_CHARTS : (int)MU_CHARTS); ++block)
                kernel->forms(contact, quantity, block, n, v, y, y, one, two);
    for (int piece = 0; piece < MU_PIECES; ++piece) kernel->border_scales(piece, n, y, one, two);
    kernel->entries(n, v, one);
    kernel->normal_form_root(n, v, y, one);
    kernel->outer_expansion(n, v, rows);
    kernel->cell_shares(n, v, one, two);
    free(one), free(two), free(rows);
}

static void ask_all(const mumacro_kernel *kernel, const mumacro_data *data, int64_t n,
                    double (*number)(int), int single) {
    double *columns[6];
    for (int i = 0; i < 6; ++i) columns[i] = numbers(i == single ? 1 : (size_t)n);
    for (int64_t j = 0; j < n; ++j)
        for (int i = 0; i < 6; ++i) columns[i][i == single ? 0 : j] = number(i);
    ask_cases(kernel, data, n, columns, single);
    if (single < 0) ask_elements(kernel, n, columns);
    if (single < 0 && data == &mumacro_table.spring)
        for (int64_t j = 0; j < n; ++j) {
            double x[6];
            for (int i = 0; i < 6; ++i) x[i] = columns[i][j];
            check_case(x);
            check_point(x[5], x[3]);
            if (j < FEW) ask_calls(x, drawn() < 0.2 ? anything() : x[5] * scaled(-2.0, 2.0));
        }
    if (single < 0) ask_points(kernel, data, n, columns[5], columns[3]);
    if (single < 0) ask_builder(kernel, n, columns[5], columns[3]);
    for (int i = 0; i < 6; ++i) free(columns[i]);
}

/* Inputs whose groups fall into every block. */
static double ordinary(int input) {
    static const double low[6] = {-1.0, -1.0, 3.0, -9.0, 1.0, -7.0},
                        high[6] = {0.3, 4.0, 9.0, -2.0, 6.0, 2.0};
    return drawn() < 0.02 ? anything() : scaled(low[input], high[input]);
}

static uint64_t step; /* between two of the NASTY^6 combinations that are tried */

/* Combinations of nasty numbers, spread over all of them. */
static double combined(int input) {
    static uint64_t code, rest;
    if (input == 0)
        rest = (code += step);
    else
        rest /= NASTY;
    return nasty[rest % NASTY];
}

static double any(int input) { return (void)input, anything(); }

static void ask_nonsense(const mumacro_kernel *kernel) {
    mumacro_data data;
    double *held[19];
    int n = 0;
    memset(&data, 0, sizeof data);
    data.border_cells = 1 + (int)(drawn() * 30);
    data.border = held[n++] = nonsense(8 * (size_t)data.border_cells);
    data.pieces = held[n++] = nonsense(MU_PIECES * MU_PIECE_COLUMNS);
    data.blocks = held[n++] = nonsense((MU_SOURCES + 1) * MU_BLOCK_COLUMNS);
    data.outer = held[n++] = nonsense(MU_OUTER_CELLS * 16);
    for (int i = 0; i < 3; ++i) {
        mumacro_cells *cells = &data.quantities[i];
        cells->first = (int64_t)(drawn() * 20.0);
        cells->cells = 1 + (int)(drawn() * 20.0);
        cells->polynomials = held[n++] = nonsense(64 * (size_t)cells->cells);
        cells->errors = held[n++] = nonsense((MU_SOURCES + 1) * 2);
        cells->cell_errors = held[n++] = nonsense(3 * (size_t)cells->cells);
    }
    data.driven.nodes = (int)(drawn() * 40.0);
    data.driven.points = held[n++] = nonsense(MU_DRIVEN_COLUMNS * (size_t)data.driven.nodes + 1);
    ask_all(kernel, &data, 61, ordinary, -1);
    ask_all(kernel, &data, 19, any, -1);
    while (n) free(held[--n]);
}

int main(int count, char **words) {
    static const int64_t lengths[] = {0, 1, 7, 8, 255, 256, 257, LONGEST};
    const mumacro_kernel *kernel = &mumacro_kernel_base;
    const long random = count > 1 ? atol(words[1]) : 300000,
               hostile = count > 2 ? atol(words[2]) : 172800;
    const long tables = count > 3 ? atol(words[3]) : 1000;
    long asked = 0, combinations = 0;
    check_misuse();
    for (int i = 0; asked < random; ++i) {
        const int64_t n = lengths[i % 8];
        ask_all(kernel, i % 4 == 1 ? &mumacro_table.ball : &mumacro_table.spring, n, ordinary,
                i % 7 - 1);
        asked += (long)n;
    }
    step = hostile < 2985984 ? 2985984 / (uint64_t)hostile : 1;
    while (step % 2 == 0 || step % 3 == 0) ++step; /* shares no divisor with NASTY = 12 */
    while (combinations < hostile) {
        ask_all(kernel, &mumacro_table.spring, LONGEST, combined, -1);
        combinations += LONGEST;
    }
    for (long i = 0; i < tables; ++i) ask_nonsense(kernel);
    for (int i = 0; i < MOTIONS; ++i) ask_motions(kernel, i);
    printf("random %ld nasty %ld tables %ld lanes %d\n", asked, combinations, tables, MU_LANES);
    return 0;
}
