/* One instance of the FMU: six inputs and what follows from them.  Value references are written in modelDescription.xml:
 * 1 to 6 are the inputs; then mu_macro, mu_ratio (outputs), error_bound, v_tilde, y_tilde, regime, source. */
#include <stdlib.h>

#include "mumacro.h"

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

enum { TIME, INPUTS = 6, MU_MACRO, MU_RATIO, ERROR_BOUND, V_TILDE, Y_TILDE, REGIME, SOURCE };

typedef struct {
    double time, x[6];
    int known; /* whether answer belongs to x */
    mumacro_answer answer;
} State;

typedef struct {
    State state;
    void (*log)(void *instance, const char *name, const char *text);
    void (*logger)(void); /* the simulator's, of the type that its standard has */
    void *environment;
    char *name;
} Instance;

static const double STARTS[6] = MUMACRO_FMU_STARTS;

static void reset(Instance *m) {
    memset(&m->state, 0, sizeof m->state);
    memcpy(m->state.x, STARTS, sizeof STARTS);
}

static Instance *make(const char *name) {
    Instance *m = (Instance *)calloc(1, sizeof *m);
    if (m == NULL) return NULL;
    m->name = (char *)calloc(1, strlen(name ? name : "") + 1);
    if (m->name == NULL) {
        free(m);
        return NULL;
    }
    strcpy(m->name, name ? name : "");
    reset(m);
    return m;
}

static void drop(Instance *m) {
    if (m != NULL) free(m->name);
    free(m);
}

/* 1 when the inputs are legal; says which is not. */
static int answered(Instance *m) {
    const double *x = m->state.x;
    int error;
    if (m->state.known) return 1;
    error = mumacro_evaluate(x[0], x[1], x[2], x[3], x[4], x[5], &m->state.answer);
    m->state.known = error == 0;
    if (error && m->log) m->log(m, m->name, mumacro_error_text(error));
    return m->state.known;
}

/* 2: no such variable, 1: an input is illegal, 0: done. */
static int get_number(Instance *m, unsigned variable, double *value) {
    const mumacro_answer *a = &m->state.answer;
    if (variable == TIME || variable > Y_TILDE) {
        *value = m->state.time;
        return variable == TIME ? 0 : 2;
    }
    if (variable <= INPUTS) {
        *value = m->state.x[variable - 1];
        return 0;
    }
    if (!answered(m)) return 1;
    *value = variable == MU_MACRO      ? a->mu_macro
             : variable == MU_RATIO    ? a->mu_ratio
             : variable == ERROR_BOUND ? a->error_bound
             : variable == V_TILDE     ? a->v_tilde
                                       : a->y_tilde;
    return 0;
}

static int get_whole(Instance *m, unsigned variable, int *value) {
    if (variable != REGIME && variable != SOURCE) return 2;
    if (!answered(m)) return 1;
    *value = variable == REGIME ? m->state.answer.regime : m->state.answer.source;
    return 0;
}

static int set_number(Instance *m, unsigned variable, double value) {
    if (variable < 1 || variable > INPUTS) return 2;
    m->state.x[variable - 1] = value;
    m->state.known = 0;
    return 0;
}

/* d output / d input. */
static int slope(Instance *m, unsigned output, unsigned input, double *value) {
    const mumacro_answer *a = &m->state.answer;
    if ((output != MU_MACRO && output != MU_RATIO) || input < 1 || input > INPUTS) return 2;
    if (!answered(m)) return 1;
    *value = a->gradient[input - 1];
    if (output == MU_RATIO) *value = (*value - (input == 1 ? a->mu_ratio : 0.0)) / m->state.x[0];
    return 0;
}

/* sum over inputs of d output / d input times their seeds */
static int along(Instance *m, unsigned output, const unsigned *inputs, size_t n, const double *seeds, double *value) {
    *value = 0.0;
    for (size_t i = 0; i < n; ++i) {
        double one;
        const int error = slope(m, output, inputs[i], &one);
        if (error) return error;
        if (seeds[i] != 0.0) *value += one * seeds[i];
    }
    return 0;
}
