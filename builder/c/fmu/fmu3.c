/* FMI 3.0 for Model Exchange and Co-Simulation; the model has no states, no events, no clocks and no parameters. */
#include <stdbool.h>

#include "instance.h"

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void *fmi3Instance;
typedef uint32_t fmi3ValueReference;
typedef const char *fmi3String;
typedef const uint8_t *fmi3Binary;
typedef bool fmi3Clock;
typedef void (*Logger)(void *, fmi3Status, fmi3String, fmi3String);
#define AT const fmi3ValueReference at[], size_t n
#define ME fmi3Instance m

static const fmi3Status STATUS[] = {fmi3OK, fmi3Discard, fmi3Error};

static void say(void *m, const char *name, const char *text) {
    const Instance *self = (const Instance *)m;
    (void)name;
    if (self->logger) ((Logger)self->logger)(self->environment, fmi3Discard, "logStatusDiscard", text);
}

static fmi3Instance instantiate(fmi3String name, fmi3String token, void *environment, Logger logger) {
    Instance *m;
    if (token == NULL || strcmp(token, MUMACRO_CHECKSUM) != 0) {
        if (logger) logger(environment, fmi3Error, "logStatusError", "this is another FMU's instantiation token");
        return NULL;
    }
    m = make(name);
    if (m == NULL) return NULL;
    m->log = say;
    m->logger = (void (*)(void))logger;
    m->environment = environment;
    return m;
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path, bool visible,
                                                 bool logging, void *environment, Logger logger) {
    (void)path, (void)visible, (void)logging;
    return instantiate(name, token, environment, logger);
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, bool visible,
                                                bool logging, bool events, bool early, const fmi3ValueReference at[],
                                                size_t n, void *environment, Logger logger, void (*update)(void)) {
    (void)path, (void)visible, (void)logging, (void)events, (void)early, (void)at, (void)n, (void)update;
    return instantiate(name, token, environment, logger);
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String path, bool visible,
                                                      bool logging, void *environment, Logger logger,
                                                      void (*clocks)(void), void (*lock)(void), void (*unlock)(void)) {
    (void)name, (void)token, (void)path, (void)visible, (void)logging, (void)environment, (void)logger;
    (void)clocks, (void)lock, (void)unlock;
    return NULL;
}

EXPORT void fmi3FreeInstance(ME) { drop((Instance *)m); }

EXPORT fmi3Status fmi3SetDebugLogging(ME, bool on, size_t n, const fmi3String names[]) {
    (void)m, (void)on, (void)n, (void)names;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterInitializationMode(ME, bool known, double tolerance, double start, bool ends, double stop) {
    (void)known, (void)tolerance, (void)ends, (void)stop;
    ((Instance *)m)->state.time = start;
    return fmi3OK;
}

#define NOTHING(name, result) \
    EXPORT fmi3Status name(ME) { \
        (void)m; \
        return result; \
    }
NOTHING(fmi3ExitInitializationMode, fmi3OK)
NOTHING(fmi3EnterEventMode, fmi3OK)
NOTHING(fmi3EnterStepMode, fmi3OK)
NOTHING(fmi3EnterContinuousTimeMode, fmi3OK)
NOTHING(fmi3EnterConfigurationMode, fmi3OK)
NOTHING(fmi3ExitConfigurationMode, fmi3OK)
NOTHING(fmi3EvaluateDiscreteStates, fmi3OK)
NOTHING(fmi3Terminate, fmi3OK)

EXPORT fmi3Status fmi3Reset(ME) {
    reset((Instance *)m);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(ME, AT, double value[], size_t values) {
    if (values < n) return fmi3Error;
    for (size_t i = 0; i < n; ++i) {
        const int error = get_number((Instance *)m, at[i], value + i);
        if (error) return STATUS[error];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(ME, AT, const double value[], size_t values) {
    if (values < n) return fmi3Error;
    for (size_t i = 0; i < n; ++i)
        if (set_number((Instance *)m, at[i], value[i])) return fmi3Error;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetInt32(ME, AT, int32_t value[], size_t values) {
    if (values < n) return fmi3Error;
    for (size_t i = 0; i < n; ++i) {
        int whole = 0;
        const int error = get_whole((Instance *)m, at[i], &whole);
        if (error) return STATUS[error];
        value[i] = whole;
    }
    return fmi3OK;
}

#define NONE_OF(name, type) \
    EXPORT fmi3Status name(ME, AT, type value[], size_t values) { \
        (void)m, (void)at, (void)value, (void)values; \
        return n ? fmi3Error : fmi3OK; \
    }
#define NONE(name, type) NONE_OF(fmi3Get##name, type) NONE_OF(fmi3Set##name, const type)
NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE_OF(fmi3SetInt32, const int32_t)
NONE(UInt32, uint32_t)
NONE(Int64, int64_t)
NONE(UInt64, uint64_t)
NONE(Boolean, bool)
NONE(String, fmi3String)

#define NONE_SIZED(name, sizes, type) \
    EXPORT fmi3Status name(ME, AT, sizes size[], type value[], size_t values) { \
        (void)m, (void)at, (void)size, (void)value, (void)values; \
        return n ? fmi3Error : fmi3OK; \
    }
NONE_SIZED(fmi3GetBinary, size_t, fmi3Binary)
NONE_SIZED(fmi3SetBinary, const size_t, const fmi3Binary)

#define NO_CLOCK(name, ...) \
    EXPORT fmi3Status name(ME, AT, __VA_ARGS__) { \
        (void)m, (void)at, (void)a, (void)b; \
        return n ? fmi3Error : fmi3OK; \
    }
#define NO_CLOCK_VALUE(name, type) \
    EXPORT fmi3Status name(ME, AT, type a[]) { \
        (void)m, (void)at, (void)a; \
        return n ? fmi3Error : fmi3OK; \
    }
NO_CLOCK_VALUE(fmi3GetClock, fmi3Clock)
NO_CLOCK_VALUE(fmi3SetClock, const fmi3Clock)
NO_CLOCK(fmi3GetIntervalDecimal, double a[], int b[])
NO_CLOCK_VALUE(fmi3GetShiftDecimal, double)
NO_CLOCK_VALUE(fmi3SetIntervalDecimal, const double)
NO_CLOCK_VALUE(fmi3SetShiftDecimal, const double)
NO_CLOCK(fmi3GetShiftFraction, uint64_t a[], uint64_t b[])
NO_CLOCK(fmi3SetIntervalFraction, const uint64_t a[], const uint64_t b[])
NO_CLOCK(fmi3SetShiftFraction, const uint64_t a[], const uint64_t b[])

EXPORT fmi3Status fmi3GetIntervalFraction(ME, AT, uint64_t a[], uint64_t b[], int kind[]) {
    (void)m, (void)at, (void)a, (void)b, (void)kind;
    return n ? fmi3Error : fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(ME, fmi3ValueReference at, size_t *n) {
    (void)m;
    *n = at == MU_MACRO || at == MU_RATIO ? INPUTS : 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetVariableDependencies(ME, fmi3ValueReference at, size_t elements[], fmi3ValueReference inputs[],
                                              size_t input_elements[], int kinds[], size_t n) {
    size_t count;
    fmi3GetNumberOfVariableDependencies(m, at, &count);
    if (n != count) return fmi3Error;
    for (size_t i = 0; i < n; ++i) {
        elements[i] = input_elements[i] = 0;
        inputs[i] = (fmi3ValueReference)i + 1;
        kinds[i] = 0; /* dependent */
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFMUState(ME, void **kept) {
    if (*kept == NULL) *kept = malloc(sizeof(State));
    if (*kept == NULL) return fmi3Error;
    memcpy(*kept, &((Instance *)m)->state, sizeof(State));
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(ME, void *kept) {
    memcpy(&((Instance *)m)->state, kept, sizeof(State));
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(ME, void **kept) {
    (void)m;
    free(*kept);
    *kept = NULL;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(ME, void *kept, size_t *size) {
    (void)m, (void)kept;
    *size = sizeof(State);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(ME, void *kept, uint8_t bytes[], size_t size) {
    (void)m;
    if (size < sizeof(State)) return fmi3Error;
    memcpy(bytes, kept, sizeof(State));
    return fmi3OK;
}

EXPORT fmi3Status fmi3DeserializeFMUState(ME, const uint8_t bytes[], size_t size, void **kept) {
    (void)m;
    if (size < sizeof(State)) return fmi3Error;
    if (*kept == NULL) *kept = malloc(sizeof(State));
    if (*kept == NULL) return fmi3Error;
    memcpy(*kept, bytes, sizeof(State));
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetDirectionalDerivative(ME, const fmi3ValueReference unknowns[], size_t n,
                                               const fmi3ValueReference knowns[], size_t k, const double seeds[],
                                               size_t seeded, double out[], size_t outs) {
    if (seeded < k || outs < n) return fmi3Error;
    for (size_t i = 0; i < n; ++i) {
        const int error = along((Instance *)m, unknowns[i], (const unsigned *)knowns, k, seeds, out + i);
        if (error) return STATUS[error];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetAdjointDerivative(ME, const fmi3ValueReference unknowns[], size_t n,
                                           const fmi3ValueReference knowns[], size_t k, const double seeds[],
                                           size_t seeded, double out[], size_t outs) {
    if (seeded < n || outs < k) return fmi3Error;
    for (size_t j = 0; j < k; ++j) {
        out[j] = 0.0;
        for (size_t i = 0; i < n; ++i) {
            double one;
            const int error = slope((Instance *)m, unknowns[i], knowns[j], &one);
            if (error) return STATUS[error];
            if (seeds[i] != 0.0) out[j] += one * seeds[i];
        }
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(ME, bool *again, bool *terminate, bool *nominals, bool *values, bool *event,
                                           double *next) {
    (void)m;
    *again = *terminate = *nominals = *values = *event = false;
    *next = 0.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3CompletedIntegratorStep(ME, bool fixed, bool *event, bool *terminate) {
    (void)m, (void)fixed;
    *event = *terminate = false;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(ME, double time) {
    ((Instance *)m)->state.time = time;
    return fmi3OK;
}

#define NO_STATES(name, type) \
    EXPORT fmi3Status name(ME, type x[], size_t n) { \
        (void)m, (void)x; \
        return n ? fmi3Error : fmi3OK; \
    }
NO_STATES(fmi3SetContinuousStates, const double)
NO_STATES(fmi3GetContinuousStates, double)
NO_STATES(fmi3GetContinuousStateDerivatives, double)
NO_STATES(fmi3GetEventIndicators, double)
NO_STATES(fmi3GetNominalsOfContinuousStates, double)

#define NO_NUMBER(name) \
    EXPORT fmi3Status name(ME, size_t *n) { \
        (void)m; \
        *n = 0; \
        return fmi3OK; \
    }
NO_NUMBER(fmi3GetNumberOfEventIndicators)
NO_NUMBER(fmi3GetNumberOfContinuousStates)

EXPORT fmi3Status fmi3GetOutputDerivatives(ME, AT, const int32_t order[], double value[], size_t values) {
    (void)m, (void)at, (void)order, (void)value, (void)values;
    return n ? fmi3Error : fmi3OK;
}

EXPORT fmi3Status fmi3DoStep(ME, double time, double step, bool keeps, bool *event, bool *terminate, bool *early,
                             double *last) {
    (void)keeps;
    *event = *terminate = *early = false;
    ((Instance *)m)->state.time = *last = time + step;
    return answered((Instance *)m) ? fmi3OK : fmi3Discard;
}

EXPORT fmi3Status fmi3ActivateModelPartition(ME, fmi3ValueReference clock, double time) {
    (void)m, (void)clock, (void)time;
    return fmi3Error;
}
