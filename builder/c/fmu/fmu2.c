/* FMI 2.0 for Model Exchange and Co-Simulation; the model has no states, no events and no parameters. */
#include "instance.h"

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef void *fmi2Component;
typedef unsigned fmi2ValueReference;
typedef const char *fmi2String;
typedef int fmi2Boolean;
typedef void (*Logger)(void *, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, fmi2Status);
    void *environment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean again, terminate, nominals, values, next_known;
    double next;
} fmi2EventInfo;

static const fmi2Status STATUS[] = {fmi2OK, fmi2Discard, fmi2Error};

static void say(void *m, const char *name, const char *text) {
    const Instance *self = (const Instance *)m;
    if (self->logger)
        ((Logger)self->logger)(self->environment, name, fmi2Discard, "logStatusDiscard", "%s", text);
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    Instance *m;
    (void)type, (void)resources, (void)visible, (void)logging;
    if (guid == NULL || strcmp(guid, MUMACRO_CHECKSUM) != 0) {
        if (functions && functions->logger)
            functions->logger(functions->environment, name, fmi2Error, "logStatusError", "this is another FMU's guid");
        return NULL;
    }
    m = make(name);
    if (m == NULL) return NULL;
    m->log = say;
    m->logger = (void (*)(void))(functions ? functions->logger : NULL);
    m->environment = functions ? functions->environment : NULL;
    return m;
}

EXPORT void fmi2FreeInstance(fmi2Component m) { drop((Instance *)m); }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component m, fmi2Boolean on, size_t n, const fmi2String names[]) {
    (void)m, (void)on, (void)n, (void)names;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component m, fmi2Boolean known, double tolerance, double start,
                                      fmi2Boolean ends, double stop) {
    (void)known, (void)tolerance, (void)ends, (void)stop;
    ((Instance *)m)->state.time = start;
    return fmi2OK;
}

#define NOTHING(name) \
    EXPORT fmi2Status name(fmi2Component m) { \
        (void)m; \
        return fmi2OK; \
    }
NOTHING(fmi2EnterInitializationMode)
NOTHING(fmi2ExitInitializationMode)
NOTHING(fmi2Terminate)
NOTHING(fmi2EnterEventMode)
NOTHING(fmi2EnterContinuousTimeMode)

EXPORT fmi2Status fmi2Reset(fmi2Component m) {
    reset((Instance *)m);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component m, const fmi2ValueReference at[], size_t n, double value[]) {
    for (size_t i = 0; i < n; ++i) {
        const int error = at[i] == TIME ? 2 : get_number((Instance *)m, at[i], value + i);
        if (error) return STATUS[error];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component m, const fmi2ValueReference at[], size_t n, int value[]) {
    for (size_t i = 0; i < n; ++i) {
        const int error = get_whole((Instance *)m, at[i], value + i);
        if (error) return STATUS[error];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component m, const fmi2ValueReference at[], size_t n, const double value[]) {
    for (size_t i = 0; i < n; ++i)
        if (set_number((Instance *)m, at[i], value[i])) return fmi2Error;
    return fmi2OK;
}

#define NONE_OF(name, type) \
    EXPORT fmi2Status name(fmi2Component m, const fmi2ValueReference at[], size_t n, type value[]) { \
        (void)m, (void)at, (void)value; \
        return n ? fmi2Error : fmi2OK; \
    }
NONE_OF(fmi2GetBoolean, fmi2Boolean)
NONE_OF(fmi2GetString, fmi2String)
NONE_OF(fmi2SetInteger, const int)
NONE_OF(fmi2SetBoolean, const fmi2Boolean)
NONE_OF(fmi2SetString, const fmi2String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component m, void **kept) {
    if (*kept == NULL) *kept = malloc(sizeof(State));
    if (*kept == NULL) return fmi2Error;
    memcpy(*kept, &((Instance *)m)->state, sizeof(State));
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component m, void *kept) {
    memcpy(&((Instance *)m)->state, kept, sizeof(State));
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component m, void **kept) {
    (void)m;
    free(*kept);
    *kept = NULL;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component m, void *kept, size_t *size) {
    (void)m, (void)kept;
    *size = sizeof(State);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component m, void *kept, char bytes[], size_t size) {
    (void)m;
    if (size < sizeof(State)) return fmi2Error;
    memcpy(bytes, kept, sizeof(State));
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component m, const char bytes[], size_t size, void **kept) {
    (void)m;
    if (size < sizeof(State)) return fmi2Error;
    if (*kept == NULL) *kept = malloc(sizeof(State));
    if (*kept == NULL) return fmi2Error;
    memcpy(*kept, bytes, sizeof(State));
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component m, const fmi2ValueReference unknowns[], size_t n,
                                               const fmi2ValueReference knowns[], size_t k, const double seeds[],
                                               double out[]) {
    for (size_t i = 0; i < n; ++i) {
        const int error = along((Instance *)m, unknowns[i], knowns, k, seeds, out + i);
        if (error) return STATUS[error];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component m, fmi2EventInfo *info) {
    (void)m;
    memset(info, 0, sizeof *info);
    return fmi2OK;
}

EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component m, fmi2Boolean fixed, fmi2Boolean *event,
                                              fmi2Boolean *terminate) {
    (void)m, (void)fixed;
    *event = *terminate = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetTime(fmi2Component m, double time) {
    ((Instance *)m)->state.time = time;
    return fmi2OK;
}

#define NO_STATES(name, type) \
    EXPORT fmi2Status name(fmi2Component m, type x[], size_t n) { \
        (void)m, (void)x; \
        return n ? fmi2Error : fmi2OK; \
    }
NO_STATES(fmi2SetContinuousStates, const double)
NO_STATES(fmi2GetContinuousStates, double)
NO_STATES(fmi2GetDerivatives, double)
NO_STATES(fmi2GetEventIndicators, double)
NO_STATES(fmi2GetNominalsOfContinuousStates, double)

EXPORT fmi2Status fmi2DoStep(fmi2Component m, double time, double step, fmi2Boolean keeps) {
    (void)keeps;
    ((Instance *)m)->state.time = time + step;
    return answered((Instance *)m) ? fmi2OK : fmi2Discard;
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component m) {
    (void)m;
    return fmi2Error;
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component m, const fmi2ValueReference at[], size_t n,
                                              const int order[], const double value[]) {
    (void)m, (void)at, (void)order, (void)value;
    return n ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component m, const fmi2ValueReference at[], size_t n,
                                               const int order[], double value[]) {
    (void)m, (void)at, (void)order, (void)value;
    return n ? fmi2Error : fmi2OK;
}

#define NO_STATUS(name, type) \
    EXPORT fmi2Status name(fmi2Component m, int kind, type *value) { \
        (void)m, (void)kind, (void)value; \
        return fmi2Discard; \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, int)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component m, int kind, double *value) {
    *value = ((Instance *)m)->state.time; /* the last successful time, kind 2 */
    return kind == 2 ? fmi2OK : fmi2Discard;
}
