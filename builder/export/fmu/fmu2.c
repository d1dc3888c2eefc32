/* FMI 2.0 for Model Exchange and Co-Simulation: what 3.0 does not have, or has in another form. */
#define MUMACRO_FMI 2
#include "instance.h"

typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, Status);
    void *environment;
} Callbacks;

typedef struct {
    Boolean again, terminate, nominals, values, next_known;
    double next;
} EventInfo;

EXPORT String fmi2GetTypesPlatform(void) { return "default"; }
EXPORT String fmi2GetVersion(void) { return "2.0"; }

EXPORT Instance *fmi2Instantiate(String name, int type, String guid, String resources,
                                 const Callbacks *functions, Boolean visible, Boolean logging) {
    return instantiate(name, guid, functions ? functions->logger : NULL,
                       functions ? functions->environment : NULL);
}

EXPORT Status fmi2SetupExperiment(ME, Boolean known, double tolerance, double start, Boolean ends,
                                  double stop) {
    return fmi2SetTime(m, start);
}

EXPORT Status fmi2NewDiscreteStates(ME, EventInfo *info) {
    memset(info, 0, sizeof *info);
    return OK;
}

EXPORT Status fmi2DoStep(ME, double time, double step, Boolean keeps) {
    m->state.time = time + step;
    return answered(m);
}

EXPORT Status fmi2GetRealStatus(ME, int kind, double *value) {
    *value = m->state.time; /* the last successful time, kind 2 */
    return kind == 2 ? OK : DISCARD;
}

RETURNS(OK, EnterInitializationMode, ME)
RETURNS(NONE, GetDerivatives, ME, double x[], size_t n)
RETURNS(NONE, SetRealInputDerivatives, ME, AT, const int order[], const double value[])
RETURNS(NONE, GetRealOutputDerivatives, ME, AT, const int order[], double value[])
RETURNS(ERROR, CancelStep, ME)
RETURNS(DISCARD, GetStatus, ME, int kind, Status *value)
RETURNS(DISCARD, GetIntegerStatus, ME, int kind, int *value)
RETURNS(DISCARD, GetBooleanStatus, ME, int kind, Boolean *value)
RETURNS(DISCARD, GetStringStatus, ME, int kind, String *value)
