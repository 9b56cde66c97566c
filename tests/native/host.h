/* A host in C: it loads the library, and checks what its calls give. */
#ifndef HOST_H
#define HOST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"

/* Value references of the hammer, FMI 2.0 and 3.0. */
enum {
    TIME = 0, FEED = 100, PRESSURE = 101, PISTON_FORCE = 102, ON = 103, STIFFNESS = 104,
    POSITION = 201, VELOCITY = 202, FORCE = 203, MEAN = 204, PEAK = 205, STRESS = 223,
    BLOWS = 300, MODE = 301, OFF_BOTTOM = 302, GRAVITY = 1000, ROCK = 1005, GAP = 1014,
    DIRECTION = 1017, CELLS = 1019, AREA = 1021, GAUGE_AT = 1023, LENGTHS = 10000
};

extern const char *guid, *place, *folder; /* of the FMU: the resources as URI and as path */
extern char said[1 << 16];                /* what was logged since `hush` */
extern int failures;

void hush(void);
void hear(const char *text);
void check_(bool good, const char *what, const char *file, int line);
/* The last call was refused with an error, and the log has the words. */
void refused_(int status, const char *words, const char *file, int line);

#define CHECK(good) check_(good, #good, __FILE__, __LINE__)
#define OK(call) check_((int)(call) == 0, #call, __FILE__, __LINE__)
#define REFUSED(call, words)                                                                   \
    do {                                                                                       \
        hush();                                                                                \
        int status_ = (int)(call);                                                             \
        refused_(status_, words, __FILE__, __LINE__);                                          \
    } while (0)

#define FUNCTIONS2(X)                                                                          \
    X(GetTypesPlatform) X(GetVersion) X(SetDebugLogging) X(Instantiate) X(FreeInstance)        \
    X(SetupExperiment) X(EnterInitializationMode) X(ExitInitializationMode) X(Terminate)       \
    X(Reset) X(GetReal) X(GetInteger) X(GetBoolean) X(GetString) X(SetReal) X(SetInteger)      \
    X(SetBoolean) X(SetString) X(GetFMUstate) X(SetFMUstate) X(FreeFMUstate)                   \
    X(SerializedFMUstateSize) X(SerializeFMUstate) X(DeSerializeFMUstate)                      \
    X(GetDirectionalDerivative) X(SetRealInputDerivatives) X(GetRealOutputDerivatives)         \
    X(DoStep) X(CancelStep) X(GetStatus) X(GetRealStatus) X(GetIntegerStatus)                  \
    X(GetBooleanStatus) X(GetStringStatus)

#define FUNCTIONS3(X)                                                                          \
    X(GetVersion) X(SetDebugLogging) X(InstantiateModelExchange) X(InstantiateCoSimulation)    \
    X(InstantiateScheduledExecution) X(FreeInstance) X(EnterInitializationMode)                \
    X(ExitInitializationMode) X(EnterEventMode) X(Terminate) X(Reset) X(GetFloat32)            \
    X(GetFloat64) X(GetInt8) X(GetUInt8) X(GetInt16) X(GetUInt16) X(GetInt32) X(GetUInt32)     \
    X(GetInt64) X(GetUInt64) X(GetBoolean) X(GetString) X(GetBinary) X(GetClock)               \
    X(SetFloat32) X(SetFloat64) X(SetInt8) X(SetUInt8) X(SetInt16) X(SetUInt16) X(SetInt32)    \
    X(SetUInt32) X(SetInt64) X(SetUInt64) X(SetBoolean) X(SetString) X(SetBinary) X(SetClock)  \
    X(GetNumberOfVariableDependencies) X(GetVariableDependencies) X(GetFMUState)               \
    X(SetFMUState) X(FreeFMUState) X(SerializedFMUStateSize) X(SerializeFMUState)              \
    X(DeserializeFMUState) X(GetDirectionalDerivative) X(GetAdjointDerivative)                 \
    X(EnterConfigurationMode) X(ExitConfigurationMode) X(GetIntervalDecimal)                   \
    X(GetIntervalFraction) X(GetShiftDecimal) X(GetShiftFraction) X(SetIntervalDecimal)        \
    X(SetIntervalFraction) X(SetShiftDecimal) X(SetShiftFraction) X(EvaluateDiscreteStates)    \
    X(UpdateDiscreteStates) X(EnterContinuousTimeMode) X(CompletedIntegratorStep) X(SetTime)   \
    X(SetContinuousStates) X(GetContinuousStateDerivatives) X(GetEventIndicators)              \
    X(GetContinuousStates) X(GetNominalsOfContinuousStates) X(GetNumberOfEventIndicators)      \
    X(GetNumberOfContinuousStates) X(EnterStepMode) X(GetOutputDerivatives) X(DoStep)          \
    X(ActivateModelPartition)

#define MEMBER2(name) fmi2##name##TYPE *name;
#define MEMBER3(name) fmi3##name##TYPE *name;

typedef struct {
    FUNCTIONS2(MEMBER2)
} Two;

typedef struct {
    FUNCTIONS3(MEMBER3)
} Three;

extern Two two;
extern Three three;

/* Tests of FMI 2.0 and of FMI 3.0; of calls at the same time; how long calls take. */
void test_fmi2(void);
void test_fmi3(void);
void test_threads(void);
void measure(void);
/* Calls in any order with any arguments; memory that ends anywhere. */
void test_any_calls(unsigned seed, int count);
void test_no_memory(int (*left_of_memory)(int count));
/* Tables in which a word was changed, with a right hash. */
void test_damaged_tables(const char *file);
/* With the real kernels: many instances and sequences, states with a right hash that are bad. */
void test_many(void);
void test_sequences(void);
void test_bad_states(void);
/* Resources elsewhere: given as they are to FMI 2.0 and 3.0, they are found, or not. */
bool is_found2(const char *location);
bool is_found3(const char *location);

#endif
