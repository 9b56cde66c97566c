/* An FMU whose outputs are its inputs and parameters: output OUT + k tells what k was set to. */
#include <stdlib.h>
#include <string.h>

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { MOST = 32, OUT = MOST };

typedef struct {
    double reals[MOST];
    int integers[MOST], booleans[MOST];
} Echo;

#define EXCHANGE(Family, type, values)                                                       \
    EXPORT int fmi2Set##Family(void *c, const unsigned *r, size_t n, const type *v) {        \
        for (size_t k = 0; k < n; k++) {                                                     \
            if (r[k] >= OUT) return 3;                                                       \
            ((Echo *)c)->values[r[k]] = v[k];                                                \
        }                                                                                    \
        return 0;                                                                            \
    }                                                                                        \
    EXPORT int fmi2Get##Family(void *c, const unsigned *r, size_t n, type *v) {              \
        for (size_t k = 0; k < n; k++) v[k] = ((Echo *)c)->values[r[k] % OUT];               \
        return 0;                                                                            \
    }

EXCHANGE(Real, double, reals)
EXCHANGE(Integer, int, integers)
EXCHANGE(Boolean, int, booleans)

EXPORT void *fmi2Instantiate(const char *name, int type, const char *guid, const char *place,
                             const void *callbacks, int visible, int logging) {
    Echo *made = calloc(1, sizeof(Echo));
    if (made) for (int k = 0; k < MOST; k++) made->integers[k] = 1;
    return made;
}
EXPORT void fmi2FreeInstance(void *c) { free(c); }
EXPORT int fmi2SetupExperiment(void *c, int given, double tolerance, double start, int stops,
                               double stop) {
    ((Echo *)c)->reals[0] = start;
    return 0;
}
EXPORT int fmi2EnterInitializationMode(void *c) { return 0; }
EXPORT int fmi2ExitInitializationMode(void *c) { return 0; }
EXPORT int fmi2DoStep(void *c, double time, double step, int forward) {
    ((Echo *)c)->reals[0] = time + step;
    return 0;
}
EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

/* A text is told by its length. */
EXPORT int fmi2SetString(void *c, const unsigned *r, size_t n, const char *const *v) {
    for (size_t k = 0; k < n; k++) ((Echo *)c)->reals[r[k]] = (double)strlen(v[k]);
    return 0;
}

/* Hosts look for all of them. */
#define UNUSED(name)                                                                         \
    EXPORT int fmi2##name(void) { return 3; }
UNUSED(SetDebugLogging) UNUSED(Terminate) UNUSED(Reset) UNUSED(GetString)
UNUSED(GetFMUstate) UNUSED(SetFMUstate) UNUSED(FreeFMUstate) UNUSED(SerializedFMUstateSize)
UNUSED(SerializeFMUstate) UNUSED(DeSerializeFMUstate) UNUSED(GetDirectionalDerivative)
UNUSED(SetRealInputDerivatives) UNUSED(GetRealOutputDerivatives) UNUSED(CancelStep)
UNUSED(GetStatus) UNUSED(GetRealStatus) UNUSED(GetIntegerStatus) UNUSED(GetBooleanStatus)
UNUSED(GetStringStatus)
