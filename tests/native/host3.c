/* FMI 3.0: what differs from FMI 2.0, event mode, early return, intermediate update. */
#include "host.h"

#include <math.h>
#include <stdlib.h>

typedef fmi3Instance I;

static void logger(fmi3InstanceEnvironment host, fmi3Status status, fmi3String category,
                   fmi3String message) {
    (void)host, (void)status;
    hear(category);
    hear(message);
}

static I made(bool events, bool early, const fmi3ValueReference *required, size_t count,
              fmi3IntermediateUpdateCallback update, void *host) {
    I one = three.InstantiateCoSimulation("one", guid, folder, false, true, events, early,
                                          required, count, host, logger, update);
    CHECK(one != NULL);
    if (one == NULL) {
        exit(1);
    }
    return one;
}

static I new_one(void) { return made(false, false, NULL, 0, NULL, NULL); }

static I start(I one) {
    OK(three.EnterInitializationMode(one, false, 0.0, 0.0, false, 0.0));
    OK(three.ExitInitializationMode(one));
    return one;
}

static double get(I one, fmi3ValueReference which) {
    double value = NAN;
    OK(three.GetFloat64(one, &which, 1, &value, 1));
    return value;
}

static int set(I one, fmi3ValueReference which, double value) {
    return (int)three.SetFloat64(one, &which, 1, &value, 1);
}

static int blows(I one) {
    fmi3ValueReference which = BLOWS;
    int32_t value = -1;
    OK(three.GetInt32(one, &which, 1, &value, 1));
    return value;
}

/* What a step says, besides its status. */
typedef struct {
    bool event, end, early;
    double time;
} Said;

static int step(I one, double from, double size, Said *now) {
    return (int)three.DoStep(one, from, size, true, &now->event, &now->end, &now->early,
                             &now->time);
}

static void works(I one) {
    Said now;
    for (int k = 0; k < 25; k++) {
        OK(step(one, k * 1e-3, 1e-3, &now));
        CHECK(!now.event && !now.end && !now.early && now.time == k * 1e-3 + 1e-3);
    }
    CHECK(blows(one) == 2 && fabs(get(one, VELOCITY) - 0.625) < 1e-12);
}

static void test_values(void) {
    I one = new_one();
    CHECK(strcmp(three.GetVersion(), "3.0") == 0);
    fmi3ValueReference lengths = LENGTHS, rock = ROCK, gravity = GRAVITY, feed = FEED, none = 7;
    double three_values[4] = {0};
    int64_t choice = 0;
    bool flag = false;
    size_t n = 0;
    CHECK(get(one, TIME) == 0.0);
    OK(three.GetFloat64(one, &lengths, 1, three_values, SECTIONS));
    CHECK(three_values[0] == 0.2 && three_values[SECTIONS - 1] == 0.1);
    three_values[1] = 0.3;
    OK(three.SetFloat64(one, &lengths, 1, three_values, SECTIONS));
    REFUSED(three.SetFloat64(one, &lengths, 1, three_values, 1),
            "fmi3SetFloat64: there are 1 values where 2 belong");
    fmi3ValueReference mixed[] = {FEED, LENGTHS, GAP};
    OK(three.GetFloat64(one, mixed, 3, three_values, 4));
    CHECK(three_values[0] == 2500.0 && three_values[2] == 0.3 && three_values[3] == 1e-5);
    OK(three.GetInt64(one, &rock, 1, &choice, 1));
    CHECK(choice == 1);
    choice = INT64_C(1) << 40;
    REFUSED(three.SetInt64(one, &rock, 1, &choice, 1), "is no number of an enumeration");
    choice = 2;
    OK(three.SetInt64(one, &rock, 1, &choice, 1));
    OK(three.GetBoolean(one, &gravity, 1, &flag, 1));
    CHECK(flag);
    REFUSED(three.GetInt32(one, &rock, 1, (int32_t *)three_values, 1),
            "there is no Int32 variable of reference 1005");
    REFUSED(three.GetFloat32(one, &feed, 1, (float *)three_values, 1), "no Float32 variable");
    REFUSED(three.SetUInt8(one, &feed, 1, (uint8_t *)three_values, 1), "no UInt8 variable");
    REFUSED(three.GetString(one, &feed, 1, (fmi3String *)three_values, 1), "no String variable");
    REFUSED(three.GetBinary(one, &feed, 1, &n, (fmi3Binary *)three_values, 1), "no Binary");
    REFUSED(three.GetClock(one, &feed, 1, &flag), "no Clock variable");
    REFUSED(three.GetFloat64(one, &none, 1, three_values, 1), "reference 7");
    REFUSED(set(one, TIME, 1.0), "time follows from the steps: it cannot be set");
    REFUSED(set(one, FORCE, 1.0), "bit.force is an output: it cannot be set");
    OK(three.GetFloat32(one, NULL, 0, NULL, 0));
    three_values[0] = 0.2, three_values[1] = -0.3;
    OK(three.SetFloat64(one, &lengths, 1, three_values, SECTIONS));
    REFUSED(three.EnterInitializationMode(one, false, 0.0, 0.0, false, 0.0),
            "piston.sections[2].length = -0.3 m: must be a number above 0");
    OK(three.Reset(one));
    works(start(one));
    CHECK(get(one, TIME) == 0.024 + 1e-3);
    REFUSED(set(one, GAP, 1.0), "start.gap is fixed");
    OK(three.Terminate(one));
    REFUSED(set(one, FEED, 1.0), "no fmi3SetFloat64 after fmi3Terminate");
    three.FreeInstance(one);
}

static void test_instantiate(void) {
    fmi3ValueReference gap = GAP;
    hush();
    CHECK(three.InstantiateCoSimulation("x", "{no}", folder, 0, 0, 0, 0, NULL, 0, NULL, logger,
                                        NULL) == NULL);
    CHECK(strstr(said, "the instantiationToken is {no}, but this FMU is {") != NULL);
    hush();
    CHECK(three.InstantiateCoSimulation("x", guid, folder, 0, 0, 0, 0, &gap, 1, NULL, logger,
                                        NULL) == NULL);
    CHECK(strstr(said, "no input or output of reference 1014") != NULL);
    CHECK(three.InstantiateCoSimulation("x", guid, "/none", 0, 0, 0, 0, NULL, 0, NULL, NULL,
                                        NULL) == NULL);
    CHECK(three.InstantiateCoSimulation(NULL, guid, folder, 0, 0, 0, 0, NULL, 0, NULL, logger,
                                        NULL) == NULL);
    hush();
    CHECK(three.InstantiateModelExchange("x", guid, folder, 0, 0, NULL, logger) == NULL);
    CHECK(three.InstantiateScheduledExecution("x", guid, folder, 0, 0, NULL, logger, NULL, NULL,
                                              NULL) == NULL);
    CHECK(strstr(said, "not for model exchange") && strstr(said, "not for scheduled execution"));
    three.FreeInstance(NULL);
}

static void test_sequence(void) {
    I one = new_one();
    Said now;
    REFUSED(three.ExitInitializationMode(one), "initialising");
    REFUSED(step(one, 0.0, 1e-3, &now), "fmi3DoStep is allowed while stepping");
    REFUSED(three.EnterInitializationMode(one, 0, 0.0, 1.0, true, 0.5), "stopTime = 0.5");
    OK(three.EnterInitializationMode(one, true, 1e-6, 0.0, true, 2e-3));
    OK(three.ExitInitializationMode(one));
    REFUSED(three.EnterEventMode(one), "needs eventModeUsed");
    REFUSED(three.EnterStepMode(one), "in event mode");
    OK(step(one, 0.0, 1e-3, &now));
    OK(step(one, 1e-3, 1e-3, &now));
    REFUSED(step(one, 2e-3, 1e-3, &now), "beyond stopTime = 0.002 s");
    REFUSED(step(one, 2e-3, 1e300, &now), ": must be at most 1000000.0 s");
    CHECK(now.time == 2e-3 && !now.early);
    REFUSED(three.DoStep(one, 2e-3, 1e-3, true, NULL, NULL, NULL, NULL), "an argument is NULL");
    REFUSED(three.EnterConfigurationMode(one), "no structural parameters");
    REFUSED(three.ExitConfigurationMode(one), "fmi3ExitConfigurationMode");
    REFUSED(three.SetTime(one, 0.0), "fmi3SetTime: this FMU is for co-simulation");
    REFUSED(three.GetNumberOfContinuousStates(one, NULL), "not for model exchange");
    REFUSED(three.GetIntervalDecimal(one, NULL, 0, NULL, NULL), "there are no clocks");
    REFUSED(three.ActivateModelPartition(one, 0, 0.0), "no clocks");
    REFUSED(three.GetAdjointDerivative(one, NULL, 0, NULL, 0, NULL, 0, NULL, 0), "none");
    REFUSED(three.GetOutputDerivatives(one, NULL, 0, NULL, NULL, 0), "none");
    fmi3String categories[] = {"logStatusError"};
    OK(three.SetDebugLogging(one, true, 1, categories));
    three.FreeInstance(one);
}

static void test_events(void) {
    I one = made(true, true, NULL, 0, NULL, NULL);
    bool flags[5];
    double next;
    Said now;
    start(one);
    REFUSED(step(one, 0.0, 1e-3, &now), "but the instance is in event mode");
    OK(three.UpdateDiscreteStates(one, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4],
                                  &next));
    CHECK(!flags[0] && !flags[1] && !flags[2] && !flags[3] && !flags[4]);
    OK(three.EvaluateDiscreteStates(one));
    OK(three.EnterStepMode(one));
    OK(step(one, 0.0, 8e-3, &now));
    CHECK(!now.event && !now.early && now.time == 8e-3);
    OK(step(one, 8e-3, 8e-3, &now));
    CHECK(now.event && now.early && now.time == 0.01 && blows(one) == 1);
    CHECK(fabs(get(one, MEAN) - 2500.0) < 1e-6 && get(one, TIME) == 0.01);
    OK(three.EnterEventMode(one));
    OK(set(one, FEED, 2600.0));
    fmi3FMUState state = NULL;
    OK(three.GetFMUState(one, &state));
    OK(three.UpdateDiscreteStates(one, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4],
                                  &next));
    REFUSED(three.UpdateDiscreteStates(one, NULL, NULL, NULL, NULL, NULL, NULL), "NULL");
    OK(three.EnterStepMode(one));
    OK(step(one, now.time, 0.1, &now));
    CHECK(now.event && now.time == 0.02 && get(one, FORCE) == 2600.0);
    OK(three.SetFMUState(one, state));
    REFUSED(step(one, 0.01, 0.1, &now), "in event mode");
    OK(three.EnterStepMode(one));
    OK(step(one, 0.01, 0.1, &now));
    CHECK(now.time == 0.02 && blows(one) == 2);
    OK(three.FreeFMUState(one, &state));
    OK(three.EnterEventMode(one));
    OK(three.Terminate(one));
    three.FreeInstance(one);
    one = start(made(true, false, NULL, 0, NULL, NULL)); /* no early return */
    OK(three.EnterStepMode(one));
    OK(step(one, 0.0, 0.1, &now));
    CHECK(now.event && !now.early && now.time == 0.1 && blows(one) == 10);
    three.FreeInstance(one);
}

/* What a host does when it is asked within a step. */
typedef struct {
    I one;
    int calls, misuse;
    double times[64], positions[64], means[64];
    bool may_stop[64];
    double stop_after, stop_at; /* asks for an early return */
} Watch;

static void update(fmi3InstanceEnvironment host, fmi3Float64 time, fmi3Boolean set_requested,
                   fmi3Boolean get_allowed, fmi3Boolean finished, fmi3Boolean may_stop,
                   fmi3Boolean *stop, fmi3Float64 *stop_at) {
    Watch *watch = host;
    int k = watch->calls++ % 64;
    fmi3ValueReference position = POSITION, mean = MEAN;
    CHECK(!set_requested && get_allowed && finished);
    watch->times[k] = time;
    watch->may_stop[k] = may_stop;
    OK(three.GetFloat64(watch->one, &position, 1, &watch->positions[k], 1));
    OK(three.GetFloat64(watch->one, &mean, 1, &watch->means[k], 1));
    if (watch->misuse) {
        Said now;
        fmi3FMUState state = NULL;
        REFUSED(step(watch->one, time, 1e-3, &now), "within a step");
        REFUSED(set(watch->one, FEED, 1.0), "no fmi3SetFloat64 within a step");
        REFUSED(three.Reset(watch->one), "no fmi3Reset within a step");
        REFUSED(three.GetFMUState(watch->one, &state), "within a step");
        REFUSED(three.Terminate(watch->one), "within a step");
        hush();
        three.FreeInstance(watch->one);
        CHECK(strstr(said, "no fmi3FreeInstance within a step") != NULL);
    }
    if (time >= watch->stop_after && may_stop) {
        *stop = true;
        *stop_at = watch->stop_at;
    }
}

static void test_updates(void) {
    fmi3ValueReference wanted[] = {POSITION, FEED};
    Watch watch = {.misuse = 1, .stop_after = 1e9};
    Said now;
    watch.one = start(made(false, false, wanted, 2, update, &watch));
    OK(step(watch.one, 0.0, 0.025, &now));
    CHECK(watch.calls == 3 && watch.times[0] == 0.01 && watch.times[2] == 0.025 && !now.early);
    CHECK(!now.event && !watch.may_stop[0] && blows(watch.one) == 2);
    OK(set(watch.one, FEED, 5000.0));
    OK(step(watch.one, 0.025, 0.025, &now)); /* the mean is that of the communication step */
    CHECK(fabs(get(watch.one, MEAN) - 5000.0) < 1e-6);
    three.FreeInstance(watch.one);

    watch = (Watch){.stop_after = 0.015, .stop_at = 0.0234};
    watch.one = start(made(false, true, wanted, 2, update, &watch));
    OK(step(watch.one, 0.0, 0.05, &now)); /* the host wants to stop between two blows */
    CHECK(watch.calls == 3 && now.early && !now.event && now.time == 0.0234);
    CHECK(watch.may_stop[0] && fabs(get(watch.one, VELOCITY) - 25.0 * 0.0234) < 1e-12);
    CHECK(fabs(get(watch.one, MEAN) - 2500.0) < 1e-6 && fabs(watch.means[1] - 2500.0) < 1e-6);
    watch.stop_at = 0.0;
    OK(step(watch.one, 0.0234, 0.05, &now)); /* at once */
    CHECK(now.early && now.time == 0.03 && blows(watch.one) == 3);
    three.FreeInstance(watch.one);

    watch = (Watch){.stop_after = 1e9};
    watch.one = start(made(true, true, NULL, 0, update, &watch));
    OK(three.EnterStepMode(watch.one));
    OK(step(watch.one, 0.0, 0.05, &now));
    CHECK(watch.calls == 1 && now.early && now.event && now.time == 0.01);
    three.FreeInstance(watch.one);
}

static void test_states(void) {
    I one = start(new_one()), other = new_one();
    fmi3FMUState state = NULL, again = NULL;
    size_t size = 0;
    Said now;
    OK(step(one, 0.0, 0.0123, &now));
    OK(three.GetFMUState(one, &state));
    OK(three.SerializedFMUStateSize(one, state, &size));
    uint8_t *bytes = malloc(size);
    OK(three.SerializeFMUState(one, state, bytes, size));
    OK(step(one, 0.0123, 0.01, &now));
    OK(three.DeserializeFMUState(other, bytes, size, &again));
    OK(three.SetFMUState(other, again));
    OK(step(other, 0.0123, 0.01, &now));
    CHECK(get(one, POSITION) == get(other, POSITION));
    bytes[90]++;
    REFUSED(three.DeserializeFMUState(other, bytes, size, &again), "its hash does not fit");
    free(bytes);
    OK(three.FreeFMUState(one, &state));
    three.FreeInstance(one);
    three.FreeInstance(other);
}

static void test_dependencies(void) {
    I one = new_one();
    size_t count = 99;
    OK(three.GetNumberOfVariableDependencies(one, POSITION, &count));
    CHECK(count == 0);
    OK(three.GetNumberOfVariableDependencies(one, FORCE, &count));
    CHECK(count > 50);
    fmi3ValueReference *known = malloc(count * sizeof *known);
    size_t *mine = malloc(count * sizeof *mine), *theirs = malloc(count * sizeof *theirs);
    fmi3DependencyKind *kinds = malloc(count * sizeof *kinds);
    OK(three.GetVariableDependencies(one, FORCE, mine, known, theirs, kinds, count));
    bool has_feed = false, has_lengths = false, has_output = false;
    for (size_t k = 0; k < count; k++) {
        has_feed |= known[k] == FEED;
        has_lengths |= known[k] == LENGTHS;
        has_output |= known[k] == POSITION;
        CHECK(kinds[k] == fmi3Dependent && mine[k] == 0);
    }
    CHECK(has_feed && has_lengths && !has_output);
    REFUSED(three.GetVariableDependencies(one, FORCE, mine, known, theirs, kinds, 1), "not 1");
    REFUSED(three.GetVariableDependencies(one, FORCE, NULL, known, theirs, kinds, count), "NULL");
    REFUSED(three.GetNumberOfVariableDependencies(one, 12345, &count), "12345");
    start(one);
    OK(three.GetNumberOfVariableDependencies(one, FORCE, &count));
    CHECK(count == 0);
    OK(three.GetVariableDependencies(one, FORCE, NULL, NULL, NULL, NULL, 0));
    free(known), free(mine), free(theirs), free(kinds);
    three.FreeInstance(one);
}

bool is_found3(const char *location) {
    I one = three.InstantiateCoSimulation("x", guid, location, 0, 0, 0, 0, NULL, 0, NULL, logger,
                                          NULL);
    three.FreeInstance(one);
    return one != NULL;
}

void test_fmi3(void) {
    test_values();
    test_instantiate();
    test_sequence();
    test_events();
    test_updates();
    test_states();
    test_dependencies();
}
