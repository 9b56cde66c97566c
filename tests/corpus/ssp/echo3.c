/* The same by FMI 3.0: the output of reference OUT + k tells what that of k was set to. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { MOST = 32, OUT = MOST };

typedef struct {
    double values[MOST];
} Echo;

#define EXCHANGE(Type, type)                                                                 \
    EXPORT int fmi3Set##Type(void *c, const unsigned *r, size_t n, const type *v, size_t m) { \
        for (size_t k = 0; k < n; k++) {                                                     \
            if (r[k] >= OUT || m != n) return 3;                                             \
            ((Echo *)c)->values[r[k]] = (double)v[k];                                        \
        }                                                                                    \
        return 0;                                                                            \
    }                                                                                        \
    EXPORT int fmi3Get##Type(void *c, const unsigned *r, size_t n, type *v, size_t m) {      \
        for (size_t k = 0; k < n; k++) v[k] = (type)((Echo *)c)->values[r[k] % OUT];         \
        return m == n ? 0 : 3;                                                               \
    }

EXCHANGE(Float32, float) EXCHANGE(Float64, double) EXCHANGE(Boolean, bool)
EXCHANGE(Int8, int8_t) EXCHANGE(UInt8, uint8_t) EXCHANGE(Int16, int16_t)
EXCHANGE(UInt16, uint16_t) EXCHANGE(Int32, int32_t) EXCHANGE(UInt32, uint32_t)
EXCHANGE(Int64, int64_t) EXCHANGE(UInt64, uint64_t)

EXPORT void *fmi3InstantiateCoSimulation(
    const char *name, const char *token, const char *place, bool visible, bool logging,
    bool events, bool early, const unsigned *updated, size_t count, void *environment,
    void *log, void *update) {
    return events || early ? NULL : calloc(1, sizeof(Echo));
}
EXPORT void fmi3FreeInstance(void *c) { free(c); }
EXPORT int fmi3EnterInitializationMode(void *c, bool given, double tolerance, double start,
                                       bool stops, double stop) {
    ((Echo *)c)->values[0] = start;
    return 0;
}
EXPORT int fmi3ExitInitializationMode(void *c) { return 0; }
EXPORT int fmi3DoStep(void *c, double time, double step, bool forward, bool *event, bool *ends,
                      bool *early, double *last) {
    Echo *one = c;
    one->values[0] = *last = time + step;
    *event = *early = false;
    *ends = one->values[1] > 1e6;
    return 0;
}
EXPORT int fmi3GetFMUState(void *c, void **state) {
    Echo *copy = malloc(sizeof(Echo));
    *copy = *(Echo *)c;
    *state = copy;
    return 0;
}
EXPORT int fmi3SetFMUState(void *c, void *state) {
    *(Echo *)c = *(Echo *)state;
    return 0;
}
EXPORT int fmi3FreeFMUState(void *c, void **state) {
    free(*state);
    *state = NULL;
    return 0;
}
EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

/* A text is told by its length. */
EXPORT int fmi3SetString(void *c, const unsigned *r, size_t n, const char *const *v, size_t m) {
    for (size_t k = 0; k < n; k++) ((Echo *)c)->values[r[k]] = (double)strlen(v[k]);
    return 0;
}

/* Hosts look for all of them. */
#define UNUSED(name)                                                                         \
    EXPORT int fmi3##name(void) { return 3; }
UNUSED(SetDebugLogging) UNUSED(InstantiateModelExchange) UNUSED(InstantiateScheduledExecution)
UNUSED(Terminate) UNUSED(Reset) UNUSED(EnterEventMode) UNUSED(EnterStepMode)
UNUSED(GetString) UNUSED(GetBinary) UNUSED(SetBinary) UNUSED(GetClock)
UNUSED(SetClock) UNUSED(GetNumberOfVariableDependencies) UNUSED(GetVariableDependencies)
UNUSED(SerializedFMUStateSize) UNUSED(SerializeFMUState) UNUSED(DeserializeFMUState)
UNUSED(GetDirectionalDerivative) UNUSED(GetAdjointDerivative) UNUSED(EnterConfigurationMode)
UNUSED(ExitConfigurationMode) UNUSED(GetIntervalDecimal) UNUSED(GetIntervalFraction)
UNUSED(GetShiftDecimal) UNUSED(GetShiftFraction) UNUSED(SetIntervalDecimal)
UNUSED(SetIntervalFraction) UNUSED(SetShiftDecimal) UNUSED(SetShiftFraction)
UNUSED(EvaluateDiscreteStates) UNUSED(UpdateDiscreteStates) UNUSED(EnterContinuousTimeMode)
UNUSED(CompletedIntegratorStep) UNUSED(SetTime) UNUSED(SetContinuousStates)
UNUSED(GetContinuousStateDerivatives) UNUSED(GetEventIndicators) UNUSED(GetContinuousStates)
UNUSED(GetNominalsOfContinuousStates) UNUSED(GetNumberOfEventIndicators)
UNUSED(GetNumberOfContinuousStates) UNUSED(GetOutputDerivatives) UNUSED(ActivateModelPartition)
