/* FMI 3.0 for Model Exchange and Co-Simulation: what 2.0 does not have, or has in another form. */
#define MUMACRO_FMI 3
#include "instance.h"

EXPORT String fmi3GetVersion(void) { return "3.0"; }

EXPORT Instance *fmi3InstantiateModelExchange(String name, String token, String path, bool visible,
                                              bool logging, void *environment, Logger logger) {
    return instantiate(name, token, logger, environment);
}

EXPORT Instance *fmi3InstantiateCoSimulation(String name, String token, String path, bool visible,
                                             bool logging, bool events, bool early, AT,
                                             void *environment, Logger logger,
                                             void (*update)(void)) {
    return instantiate(name, token, logger, environment);
}

EXPORT Instance *fmi3InstantiateScheduledExecution(String name, String token, String path,
                                                   bool visible, bool logging, void *environment,
                                                   Logger logger, void (*clocks)(void),
                                                   void (*lock)(void), void (*unlock)(void)) {
    return NULL;
}

EXPORT Status fmi3EnterInitializationMode(ME, bool known, double tolerance, double start, bool ends,
                                          double stop) {
    return fmi3SetTime(m, start);
}

EXPORT Status fmi3GetAdjointDerivative(ME, const Reference unknowns[], size_t n,
                                       const Reference knowns[], size_t k, const double seeds[],
                                       size_t seeded, double out[], size_t outs) {
    if (seeded < n || outs < k) return ERROR;
    memset(out, 0, k * sizeof *out);
    for (size_t i = 0; i < n; ++i)
        EACH(j, k, add_slope(m, unknowns[i], knowns[j], seeds[i], out + j))
    return OK;
}

EXPORT Status fmi3UpdateDiscreteStates(ME, bool *again, bool *terminate, bool *nominals,
                                       bool *values, bool *event, double *next) {
    *again = *terminate = *nominals = *values = *event = false;
    *next = 0.0;
    return OK;
}

EXPORT Status fmi3DoStep(ME, double time, double step, bool keeps, bool *event, bool *terminate,
                         bool *early, double *last) {
    *event = *terminate = *early = false;
    m->state.time = *last = time + step;
    return answered(m);
}

EXPORT Status fmi3GetNumberOfEventIndicators(ME, size_t *n) { return *n = 0, OK; }
EXPORT Status fmi3GetNumberOfContinuousStates(ME, size_t *n) { return *n = 0, OK; }

FOR_ALL(fmi3GetInt32, int32_t, get_whole(m, at[i], value + i))

RETURNS(NONE, SetInt32, ME, AT, const int32_t value[], size_t values)
NO_VALUES(Float32, float)
NO_VALUES(Int8, int8_t)
NO_VALUES(UInt8, uint8_t)
NO_VALUES(Int16, int16_t)
NO_VALUES(UInt16, uint16_t)
NO_VALUES(UInt32, uint32_t)
NO_VALUES(UInt64, uint64_t)
RETURNS(NONE, GetBinary, ME, AT, size_t size[], const uint8_t *value[], size_t values)
RETURNS(NONE, SetBinary, ME, AT, const size_t size[], const uint8_t *const value[], size_t values)
RETURNS(NONE, GetOutputDerivatives, ME, AT, const int32_t order[], double value[], size_t values)
RETURNS(NONE, GetContinuousStateDerivatives, ME, double x[], size_t n)
RETURNS(NONE, GetClock, ME, AT, bool value[])
RETURNS(NONE, SetClock, ME, AT, const bool value[])
RETURNS(NONE, GetIntervalDecimal, ME, AT, double interval[], int qualifier[])
RETURNS(NONE, SetIntervalDecimal, ME, AT, const double interval[])
RETURNS(NONE, GetIntervalFraction, ME, AT, uint64_t counter[], uint64_t resolution[],
        int qualifier[])
RETURNS(NONE, SetIntervalFraction, ME, AT, const uint64_t counter[], const uint64_t resolution[])
RETURNS(NONE, GetShiftDecimal, ME, AT, double shift[])
RETURNS(NONE, SetShiftDecimal, ME, AT, const double shift[])
RETURNS(NONE, GetShiftFraction, ME, AT, uint64_t counter[], uint64_t resolution[])
RETURNS(NONE, SetShiftFraction, ME, AT, const uint64_t counter[], const uint64_t resolution[])
RETURNS(OK, EnterStepMode, ME)
RETURNS(OK, EnterConfigurationMode, ME)
RETURNS(OK, ExitConfigurationMode, ME)
RETURNS(OK, EvaluateDiscreteStates, ME)
RETURNS(ERROR, ActivateModelPartition, ME, Reference clock, double time)
/* of single elements of arrays, which this unit does not have and does not promise */
RETURNS(ERROR, GetNumberOfVariableDependencies, ME, Reference at, size_t *n)
RETURNS(ERROR, GetVariableDependencies, ME, Reference at, size_t elements[], Reference inputs[],
        size_t of[], int kinds[], size_t n)
