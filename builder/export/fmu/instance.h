/* What FMI 2.0 and 3.0 share; MUMACRO_FMI is 2 or 3.  The model has no states, events or clocks, so
 * most functions of the standards have nothing to do.
 * Value references, as in modelDescription.xml: 0 is the time (3.0 only), 1 to 7 are the inputs,
 * the last of them Fz_amplitude; then come mu_macro and mu_ratio (outputs), error_bound, v_tilde,
 * y_tilde, regime, source, the parameters contact and direction, the output force and its parameter
 * v_rest.  v0 may be negative: all but the force are those of its absolute value. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "mumacro.h"

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif
#if defined __GNUC__
/* what a standard passes and this model has no use for */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

enum { TIME, Y0 = 4, V0 = 6, INPUTS };
enum { MU_MACRO = INPUTS + 1, MU_RATIO, ERROR_BOUND, V_TILDE, Y_TILDE, REGIME, SOURCE };
enum { CONTACT = SOURCE + 1, DIRECTION, FORCE, V_REST };
enum { CONTACTS = 2, DIRECTIONS = 3 };
typedef enum { OK, WARNING, DISCARD, ERROR } Status;
typedef const char *String;
typedef uint32_t Reference;

#if MUMACRO_FMI == 2
typedef int Boolean, Choice;
typedef void (*Logger)(void *environment, String instance, Status status, String category,
                       String text, ...);
#define FMI(name) fmi2##name
#define STATE(before, after) fmi2##before##FMUstate##after
#define DESERIALIZE fmi2DeSerializeFMUstate
#define GET_NUMBERS fmi2GetReal
#define SET_NUMBERS fmi2SetReal
#define GET_CHOICES fmi2GetInteger /* and other integers */
#define SET_CHOICES fmi2SetInteger
#define SIZE(name) /* 3.0 gives the length of arrays of values, too */
#define SHORTER(name, n) 0
#else
typedef bool Boolean;
typedef int64_t Choice;
typedef void (*Logger)(void *environment, Status status, String category, String text);
#define FMI(name) fmi3##name
#define STATE(before, after) fmi3##before##FMUState##after
#define DESERIALIZE fmi3DeserializeFMUState
#define GET_NUMBERS fmi3GetFloat64
#define SET_NUMBERS fmi3SetFloat64
#define GET_CHOICES fmi3GetInt64 /* of enumerations */
#define SET_CHOICES fmi3SetInt64
#define SIZE(name) , size_t name
#define SHORTER(name, n) (name < n)
#endif

typedef struct {
    double time, x[INPUTS], v_rest;
    int contact, direction;
    int valid; /* whether the answer and the force belong to x */
    mumacro_answer answer;
    double force, force_slopes[6];
} State;

typedef struct {
    State state;
    Logger logger;
    void *environment;
    char name[];
} Instance;

#define ME Instance *m
#define AT const Reference at[], size_t n
#define NONE (n ? ERROR : OK) /* there are no variables of this kind */
#define RETURNS(result, name, ...) RETURNING(result, FMI(name), __VA_ARGS__)
#define RETURNING(result, name, ...) \
    EXPORT Status name(__VA_ARGS__) { return result; }

/* --- the model -------------------------------------------------------------------------------- */

static void say(Logger logger, void *environment, String name, Status status, String text) {
    const String category = status == ERROR ? "logStatusError" : "logStatusDiscard";
    if (logger == NULL) return;
#if MUMACRO_FMI == 2
    logger(environment, name, status, category, "%s", text);
#else
    logger(environment, status, category, text);
#endif
}

/* The input in whose place its amplitude goes: that of the normal force, or y0;
 * the other one has no influence. */
static Reference amplitude(const Instance *m) {
    return m->state.direction == MUMACRO_NORMAL ? INPUTS : Y0;
}

/* OK when the inputs are legal; else DISCARD, and the log says which is not. */
static Status answered(ME) {
    State *s = &m->state;
    if (!s->valid) {
        const double *x = s->x, moved = x[amplitude(m) - 1];
        const int error = mumacro_evaluate_as(s->contact, s->direction, x[0], x[1], x[2], moved,
                                              x[4], fabs(x[V0 - 1]), &s->answer);
        if (error)
            say(m->logger, m->environment, m->name, DISCARD, mumacro_error_text(error));
        else
            mumacro_evaluate_force(s->contact, s->direction, x[V0 - 1], s->v_rest, x[0], x[1], x[2],
                                   moved, x[4], &s->force, s->force_slopes);
        s->valid = error == 0;
    }
    return s->valid ? OK : DISCARD;
}

static Status get_number(ME, Reference variable, double *value) {
    const mumacro_answer *a = &m->state.answer;
    if ((MUMACRO_FMI == 2 && variable == TIME) || (variable > Y_TILDE && variable < FORCE) ||
        variable > V_REST)
        return ERROR;
    if (variable == TIME || variable == V_REST) {
        *value = variable == TIME ? m->state.time : m->state.v_rest;
    } else if (variable <= INPUTS) {
        *value = m->state.x[variable - 1];
    } else {
        const Status status = answered(m);
        const double outputs[] = {a->mu_macro, a->mu_ratio, a->error_bound, a->v_tilde, a->y_tilde};
        if (status != OK) return status;
        *value = variable == FORCE ? m->state.force : outputs[variable - MU_MACRO];
    }
    return OK;
}

static Status get_whole(ME, Reference variable, int32_t *value) {
    if (variable != REGIME && variable != SOURCE) return ERROR;
    if (answered(m) != OK) return DISCARD;
    *value = variable == REGIME ? m->state.answer.regime : m->state.answer.source;
    return OK;
}

static Status get_choice(ME, Reference variable, Choice *value) {
#if MUMACRO_FMI == 2
    if (variable == REGIME || variable == SOURCE) return get_whole(m, variable, value);
#endif
    if (variable != CONTACT && variable != DIRECTION) return ERROR;
    *value = variable == CONTACT ? m->state.contact : m->state.direction;
    return OK;
}

static Status set_choice(ME, Reference variable, Choice value) {
    const int count = variable == CONTACT ? CONTACTS : variable == DIRECTION ? DIRECTIONS : 0;
    if (value < 0 || value >= count) {
        say(m->logger, m->environment, m->name, ERROR, mumacro_error_text(MUMACRO_NO_CONTACT));
        return ERROR;
    }
    *(variable == CONTACT ? &m->state.contact : &m->state.direction) = (int)value;
    return m->state.valid = 0, OK;
}

static Status set_number(ME, Reference variable, double value) {
    if (variable == V_REST && value > 0.0 && value < HUGE_VAL) {
        m->state.v_rest = value;
    } else if (variable == V_REST) {
        say(m->logger, m->environment, m->name, ERROR, mumacro_error_text(MUMACRO_NO_VELOCITY));
        return ERROR;
    } else if (variable <= TIME || variable > INPUTS) {
        return ERROR;
    } else {
        m->state.x[variable - 1] = value;
    }
    return m->state.valid = 0, OK;
}

/* Adds seed times d output / d input. */
static Status add_slope(ME, Reference output, Reference input, double seed, double *sum) {
    const mumacro_answer *a = &m->state.answer;
    const double *slopes = output == FORCE ? m->state.force_slopes : a->gradient;
    double slope;
    if ((output != MU_MACRO && output != MU_RATIO && output != FORCE) || input <= TIME ||
        input > INPUTS)
        return ERROR;
    if (answered(m) != OK) return DISCARD;
    slope = input == amplitude(m)            ? slopes[Y0 - 1]
            : input == Y0 || input == INPUTS ? 0.0
                                             : slopes[input - 1];
    if (output != FORCE && input == V0 && m->state.x[V0 - 1] < 0.0) slope = -slope;
    if (output == MU_RATIO) slope = (slope - (input == 1 ? a->mu_ratio : 0.0)) / m->state.x[0];
    if (seed != 0.0) *sum += seed * slope;
    return OK;
}

/* --- an instance ------------------------------------------------------------------------------ */

EXPORT Status FMI(Reset)(ME) {
    /* a spring, across */
    static const State start = {.x = MUMACRO_FMU_STARTS, .v_rest = MUMACRO_FMU_REST};
    return m->state = start, OK;
}

static Instance *instantiate(String name, String token, Logger logger, void *environment) {
    Instance *m;
    if (name == NULL) name = "";
    if (token == NULL || strcmp(token, mumacro_checksum()) != 0) {
        say(logger, environment, name, ERROR, "this token (2.0: guid) is that of another FMU");
        return NULL;
    }
    m = (Instance *)calloc(1, sizeof *m + strlen(name) + 1);
    if (m == NULL) return NULL;
    strcpy(m->name, name);
    m->logger = logger;
    m->environment = environment;
    FMI(Reset)(m);
    return m;
}

EXPORT void FMI(FreeInstance)(ME) { free(m); }

EXPORT Status STATE(Get, )(ME, void **state) {
    if (*state == NULL) *state = malloc(sizeof(State));
    return *state == NULL ? ERROR : (memcpy(*state, &m->state, sizeof(State)), OK);
}
EXPORT Status STATE(Set, )(ME, const void *state) {
    return memcpy(&m->state, state, sizeof(State)), OK;
}
EXPORT Status STATE(Free, )(ME, void **state) { return free(*state), *state = NULL, OK; }
/* which modelDescription.xml does not promise */
EXPORT Status STATE(Serialized, Size)(ME, void *state, size_t *size) { return ERROR; }
EXPORT Status STATE(Serialize, )(ME, const void *state, void *bytes, size_t size) { return ERROR; }
EXPORT Status DESERIALIZE(ME, const void *bytes, size_t size, void **state) { return ERROR; }

/* --- values and time -------------------------------------------------------------------------- */

#define EACH(i, n, call)                 \
    for (size_t i = 0; i < n; ++i) {     \
        const Status status = call;      \
        if (status != OK) return status; \
    }
#define FOR_ALL(name, type, call)                           \
    EXPORT Status name(ME, AT, type value[] SIZE(values)) { \
        if (SHORTER(values, n)) return ERROR;               \
        EACH(i, n, call)                                    \
        return OK;                                          \
    }
FOR_ALL(GET_NUMBERS, double, get_number(m, at[i], value + i))
FOR_ALL(SET_NUMBERS, const double, set_number(m, at[i], value[i]))
FOR_ALL(GET_CHOICES, Choice, get_choice(m, at[i], value + i))
FOR_ALL(SET_CHOICES, const Choice, set_choice(m, at[i], value[i]))

EXPORT Status FMI(GetDirectionalDerivative)(ME, const Reference unknowns[], size_t n,
                                            const Reference knowns[], size_t k,
                                            const double seeds[] SIZE(seeded),
                                            double out[] SIZE(outs)) {
    if (SHORTER(seeded, k) || SHORTER(outs, n)) return ERROR;
    memset(out, 0, n * sizeof *out);
    for (size_t i = 0; i < n; ++i)
        EACH(j, k, add_slope(m, unknowns[i], knowns[j], seeds[j], out + i))
    return OK;
}

EXPORT Status FMI(SetTime)(ME, double time) { return m->state.time = time, OK; }

/* --- functions that have nothing to do, in both standards ------------------------------------- */

RETURNS(OK, SetDebugLogging, ME, Boolean on, size_t n, const String names[])
RETURNS(OK, ExitInitializationMode, ME)
RETURNS(OK, EnterEventMode, ME)
RETURNS(OK, EnterContinuousTimeMode, ME)
RETURNS(OK, Terminate, ME)
#define NO_VALUES(name, type)                                   \
    RETURNS(NONE, Get##name, ME, AT, type value[] SIZE(values)) \
    RETURNS(NONE, Set##name, ME, AT, type const value[] SIZE(values))
NO_VALUES(Boolean, Boolean)
NO_VALUES(String, String)
RETURNS(NONE, SetContinuousStates, ME, const double x[], size_t n)
RETURNS(NONE, GetContinuousStates, ME, double x[], size_t n)
RETURNS(NONE, GetEventIndicators, ME, double x[], size_t n)
RETURNS(NONE, GetNominalsOfContinuousStates, ME, double x[], size_t n)

EXPORT Status FMI(CompletedIntegratorStep)(ME, Boolean fixed, Boolean *event, Boolean *terminate) {
    return *event = *terminate = 0, OK;
}
