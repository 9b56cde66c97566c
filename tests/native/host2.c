/* FMI 2.0: sequences of calls, misuse, states, threads, speed. */
#include "host.h"
#include "shell.h" /* the hash, which the library does not give away */

#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdlib.h>
#include <time.h>

typedef fmi2Component C;

/* As a host that prints: the text is a format. */
static void logger(fmi2ComponentEnvironment host, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    char text[8192];
    va_list rest;
    (void)name, (void)status;
    va_start(rest, message);
    vsnprintf(text, sizeof text, message, rest);
    va_end(rest);
    if (host != NULL) {
        hear(category);
        hear(text);
    }
}

static int environment;
static const fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, &environment};

static C new_named(const char *name) {
    return two.Instantiate(name, fmi2CoSimulation, guid, place, &callbacks, fmi2False, fmi2True);
}

static C new_one(void) {
    C c = new_named("one");
    CHECK(c != NULL);
    if (c == NULL) {
        exit(1);
    }
    return c;
}

static C start(C c, double from) {
    OK(two.SetupExperiment(c, fmi2False, 0.0, from, fmi2False, 0.0));
    OK(two.EnterInitializationMode(c));
    OK(two.ExitInitializationMode(c));
    return c;
}

static double get(C c, fmi2ValueReference which) {
    double value = NAN;
    OK(two.GetReal(c, &which, 1, &value));
    return value;
}

static int get_int(C c, fmi2ValueReference which) {
    int value = -99;
    OK(two.GetInteger(c, &which, 1, &value));
    return value;
}

static int get_bool(C c, fmi2ValueReference which) {
    int value = -99;
    OK(two.GetBoolean(c, &which, 1, &value));
    return value;
}

static int set(C c, fmi2ValueReference which, double value) {
    return (int)two.SetReal(c, &which, 1, &value);
}

static int set_int(C c, fmi2ValueReference which, int value) {
    return (int)two.SetInteger(c, &which, 1, &value);
}

static int set_bool(C c, fmi2ValueReference which, int value) {
    return (int)two.SetBoolean(c, &which, 1, &value);
}

static void steps(C c, double from, double size, int count) {
    for (int k = 0; k < count; k++) {
        OK(two.DoStep(c, from + k * size, size, fmi2True));
    }
}

/* It works as one that was never asked for nonsense. */
static void works(C c) {
    steps(c, 0.0, 1e-3, 25);
    CHECK(get_int(c, BLOWS) == 2 && fabs(get(c, VELOCITY) - 0.625) < 1e-12);
}

/* ---- the usual sequence ----------------------------------------------------------- */

static void test_usual(void) {
    CHECK(strcmp(two.GetVersion(), "2.0") == 0);
    CHECK(strcmp(two.GetTypesPlatform(), "default") == 0);
    C c = new_one();
    fmi2ValueReference several[] = {POSITION, FEED, PEAK, VELOCITY, AREA};
    double values[5];
    OK(two.GetReal(c, several, 5, values)); /* nothing yet, but parameters and inputs */
    CHECK(values[0] == 0.0 && values[1] == 2500.0 && values[2] == 0.0 && values[4] == 1.5e-3);
    CHECK(get_int(c, ROCK) == 1 && get_bool(c, GRAVITY) == 1 && get_int(c, CELLS) == 0);
    OK(set_int(c, ROCK, 2));
    OK(set_int(c, DIRECTION, -1));
    OK(set_bool(c, GRAVITY, 7));
    CHECK(get_int(c, ROCK) == 2 && get_int(c, DIRECTION) == -1 && get_bool(c, GRAVITY) == 1);
    OK(two.SetupExperiment(c, fmi2True, 1e-6, 0.5, fmi2True, 0.55));
    OK(two.EnterInitializationMode(c));
    CHECK(get(c, FORCE) == 2500.0); /* what follows from the start */
    OK(set(c, FEED, 2000.0));
    CHECK(get(c, FORCE) == 2000.0);
    OK(two.ExitInitializationMode(c));
    steps(c, 0.5, 1e-3, 25);
    OK(two.GetReal(c, several, 5, values));
    CHECK(fabs(values[0] - 0.5 * 20.0 * 0.025 * 0.025) < 1e-12 && values[2] == 2000.0);
    CHECK(get_int(c, BLOWS) == 2 && get_int(c, MODE) == 2 && get_bool(c, OFF_BOTTOM) == 0);
    OK(set(c, FEED, 3000.0));
    CHECK(get(c, FEED) == 3000.0 && get(c, FORCE) == 2000.0); /* acts from the step on */
    OK(two.DoStep(c, 0.525, 1e-3, fmi2True));
    CHECK(get(c, FORCE) == 3000.0 && fabs(get(c, MEAN) - 3000.0) < 1e-6);
    CHECK(get(c, STRESS) == 7.5e8); /* asked for after what needs no flag */
    double now = 0.0;
    OK(two.GetRealStatus(c, fmi2LastSuccessfulTime, &now));
    CHECK(now == 0.525 + 1e-3);
    OK(two.GetReal(c, NULL, 0, NULL));
    OK(two.Terminate(c));
    CHECK(get(c, FORCE) == 3000.0);
    two.FreeInstance(c);
}

static void test_reset(void) {
    C c = new_one();
    OK(set(c, GAP, 0.5));
    start(c, 1.0);
    OK(set(c, FEED, 1.0));
    steps(c, 1.0, 1e-3, 3);
    OK(two.Terminate(c));
    OK(two.Reset(c));
    CHECK(get(c, GAP) == 1e-5 && get(c, FEED) == 2500.0 && get(c, POSITION) == 0.0);
    REFUSED(two.EnterInitializationMode(c), "fmi2SetupExperiment");
    works(start(c, 0.0));
    two.FreeInstance(c);
}

/* ---- misuse ----------------------------------------------------------------------- */

static void test_instantiate(void) {
    fmi2CallbackFunctions silent = {NULL, NULL, NULL, NULL, NULL};
    hush();
    CHECK(two.Instantiate("x", fmi2CoSimulation, "{other}", place, &callbacks, 0, 0) == NULL);
    CHECK(strstr(said, "x: no instance: the guid is {other}, but this FMU is {") != NULL);
    hush();
    CHECK(two.Instantiate("x", fmi2ModelExchange, guid, place, &callbacks, 0, 0) == NULL);
    CHECK(strstr(said, "for co-simulation only") != NULL);
    hush();
    CHECK(two.Instantiate("x", fmi2CoSimulation, guid, "file:///none", &callbacks, 0, 0) == NULL);
    CHECK(strstr(said, "there is no model.bin in file:///none") != NULL);
    hush();
    CHECK(two.Instantiate("x", fmi2CoSimulation, NULL, place, &callbacks, 0, 0) == NULL);
    CHECK(two.Instantiate("x", fmi2CoSimulation, guid, NULL, &callbacks, 0, 0) == NULL);
    CHECK(two.Instantiate(NULL, fmi2CoSimulation, guid, place, &callbacks, 0, 0) == NULL);
    CHECK(two.Instantiate("x", fmi2CoSimulation, guid, place, NULL, 0, 0) == NULL);
    C c = two.Instantiate("quiet", fmi2CoSimulation, guid, place, &silent, 0, 1);
    CHECK(c != NULL && two.DoStep(c, 0.0, 1e-3, 1) == fmi2Error);
    works(start(c, 0.0));
    two.FreeInstance(c);
    two.FreeInstance(NULL);
}

static void test_names(void) {
    const char *names[] = {"100%s%n of it", "M\xc3\xbcller", "\xff\xfe bad \xc3", "", "a\nb"};
    const char *shown[] = {"100%s%n of it: ", "M\xc3\xbcller: ", "?? bad ?: ", ": ", "a\nb: "};
    for (int k = 0; k < 5; k++) {
        C c = new_named(names[k]);
        REFUSED(two.Terminate(c), shown[k]);
        CHECK(strstr(said, "call out of order: fmi2Terminate is allowed while stepping, but the "
                           "instance is instantiated") != NULL);
        two.FreeInstance(c);
    }
    char *name = malloc(100000);
    memset(name, 'n', 99999);
    name[99999] = 0;
    C c = new_named(name);
    REFUSED(two.Terminate(c), "n...: call out of order");
    two.FreeInstance(c);
    hush(); /* and of what is named in a message */
    CHECK(two.Instantiate("x", fmi2CoSimulation, name, place, &callbacks, 0, 0) == NULL);
    CHECK(strstr(said, "x: no instance: the guid is nnn") != NULL && strlen(said) < 4200);
    free(name);
}

static void test_sequence(void) {
    C c = new_one();
    REFUSED(two.EnterInitializationMode(c), "needs fmi2SetupExperiment before it");
    REFUSED(two.ExitInitializationMode(c), "allowed while initialising");
    REFUSED(two.DoStep(c, 0.0, 1e-3, 1), "fmi2DoStep is allowed while stepping, but the instance "
                                         "is instantiated");
    REFUSED(two.SetupExperiment(c, 0, 0.0, 1.0, 1, 0.5),
            "stopTime = 0.5: must not lie before startTime = 1.0 s");
    REFUSED(two.SetupExperiment(c, 0, 0.0, 0.0, 1, NAN), "stopTime = nan");
    REFUSED(two.SetupExperiment(c, 0, 0.0, INFINITY, 0, 0.0),
            "startTime = inf: must be a time within 1e10 s of 0");
    start(c, 0.0);
    REFUSED(two.SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0), "fmi2SetupExperiment");
    REFUSED(two.EnterInitializationMode(c), "stepping");
    double bad[] = {0.0, -1e-3, NAN, INFINITY};
    for (int k = 0; k < 4; k++) {
        REFUSED(two.DoStep(c, 0.0, bad[k], 1), "communicationStepSize = ");
    }
    for (int k = 0; k < 3; k++) { /* it would not come back */
        REFUSED(two.DoStep(c, 0.0, (double[]){1e300, DBL_MAX, 1.001e6}[k], 1),
                ": must be at most 1000000.0 s");
    }
    REFUSED(two.DoStep(c, NAN, 1e-3, 1), "nan s lies after the present time of 0.0 s");
    works(c);
    REFUSED(two.DoStep(c, 0.01, 0.1, 1), "0.01 s lies before the present time of 0.025");
    REFUSED(two.DoStep(c, 0.2, 0.1, 1), "currentCommunicationPoint = 0.2 s lies after");
    OK(two.DoStep(c, 0.025000001, 1e-3, 1)); /* within the slack */
    REFUSED(two.CancelStep(c), "fmi2CancelStep");
    OK(two.Terminate(c));
    REFUSED(two.Terminate(c), "terminated");
    REFUSED(set(c, FEED, 1.0), "call out of order: no fmi2SetReal after fmi2Terminate");
    REFUSED(two.DoStep(c, 0.026, 1e-3, 1), "terminated");
    two.FreeInstance(c);
    CHECK(two.DoStep(NULL, 0.0, 1.0, 1) == fmi2Error && two.Reset(NULL) == fmi2Error);
}

static void test_stop(void) {
    C c = new_one();
    OK(two.SetupExperiment(c, 0, 0.0, 0.0, 1, 0.03));
    OK(two.EnterInitializationMode(c));
    OK(two.ExitInitializationMode(c));
    double time = 0.0;
    for (int k = 0; k < 30; k++, time += 1e-3) { /* sums of the host's own */
        OK(two.DoStep(c, time, 1e-3, 1));
    }
    REFUSED(two.DoStep(c, time, 1e-3, 1), "beyond stopTime = 0.03 s");
    two.FreeInstance(c);
}

static void test_values(void) {
    C c = new_one();
    fmi2ValueReference none[] = {FEED, 987654}, feed = FEED;
    double two_values[] = {1.0, 2.0};
    int whole = 1;
    const char *word = NULL;
    REFUSED(two.GetReal(c, none, 2, two_values), "there is no Real variable of reference 987654");
    CHECK(two_values[0] == 1.0); /* all or nothing */
    REFUSED(two.SetReal(c, none, 2, two_values), "987654");
    CHECK(get(c, FEED) == 2500.0);
    REFUSED(two.SetBoolean(c, &feed, 1, &whole), "no Boolean variable of reference 100");
    REFUSED(two.GetInteger(c, &feed, 1, &whole), "no Integer variable of reference 100");
    REFUSED(two.GetString(c, &feed, 1, &word), "no String variable of reference 100");
    REFUSED(two.SetString(c, &feed, 1, &word), "no String variable");
    REFUSED(two.GetReal(c, NULL, 1, two_values), "fmi2GetReal: a list is NULL");
    REFUSED(two.SetReal(c, &feed, 1, NULL), "fmi2SetReal: a list is NULL");
    REFUSED(set(c, FORCE, 1.0), "bit.force is an output: it cannot be set");
    start(c, 0.0);
    REFUSED(set(c, AREA, 1.0),
            "drive.effective_area is fixed: it can be set before the first step only");
    REFUSED(two.GetDirectionalDerivative(c, &feed, 1, &feed, 1, two_values, two_values), "none");
    REFUSED(two.SetRealInputDerivatives(c, &feed, 1, &whole, two_values), "not interpolated");
    REFUSED(two.GetRealOutputDerivatives(c, &feed, 1, &whole, two_values), "none");
    works(c);
    two.FreeInstance(c);
}

/* What is not allowed is refused when it is used. */
static void test_bounds(void) {
    C c = new_one();
    OK(two.SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
    OK(set(c, GAP, 101.0));
    REFUSED(two.EnterInitializationMode(c),
            "one: start.gap = 101.0 m: must be a number from 0 to 100 m");
    OK(set(c, GAP, 60.0));
    REFUSED(two.EnterInitializationMode(c), "one: the gap of 60.0 m is 60 m, below the bit {");
    OK(set(c, GAP, 1.0));
    OK(set_int(c, ROCK, 9));
    REFUSED(two.EnterInitializationMode(c), "effects.rock = 9: must be one of \"bilinear\"");
    OK(set_int(c, ROCK, 1));
    OK(set_int(c, DIRECTION, 0));
    REFUSED(two.EnterInitializationMode(c), "start.drive_direction = 0: must be one of 1, -1");
    OK(set_int(c, DIRECTION, 1));
    OK(set_int(c, CELLS, -3));
    REFUSED(two.EnterInitializationMode(c),
            "solver.cells = -3: must be a whole number from 1 to 100000");
    OK(set_int(c, CELLS, 0)); /* left out */
    OK(set(c, PRESSURE, 1e9));
    OK(set(c, AREA, 10.0));
    REFUSED(two.EnterInitializationMode(c),
            "supply_pressure * drive.effective_area = 10000000000.0 N: must be a number");
    OK(set(c, PRESSURE, 1e6));
    OK(set(c, AREA, 1e-3));
    OK(two.EnterInitializationMode(c));
    OK(set(c, GAUGE_AT, 7.0));
    REFUSED(two.ExitInitializationMode(c), "gauge.position = 7.0 m: lies below the bit");
    fmi2ValueReference force = FORCE;
    double value = -1.0;
    REFUSED(two.GetReal(c, &force, 1, &value), "gauge.position");
    OK(set(c, GAUGE_AT, -1.0));
    OK(two.ExitInitializationMode(c));
    OK(set(c, FEED, NAN));
    OK(set(c, PISTON_FORCE, 1.0));
    REFUSED(two.DoStep(c, 0.0, 1e-3, 1), "feed_force = nan N: must be a number from -1e9 to 1e9 N");
    REFUSED(two.DoStep(c, 0.0, 1e-3, 1), "feed_force = nan");
    OK(set(c, FEED, 2500.0));
    OK(set(c, PRESSURE, -1.0));
    REFUSED(two.DoStep(c, 0.0, 1e-3, 1), "supply_pressure = -1.0 Pa");
    OK(set(c, PRESSURE, 1e6));
    works(c);
    two.FreeInstance(c);
}

static void test_notes_and_faults(void) {
    C c = start(new_one(), 0.0);
    OK(set(c, FEED, -0.1));
    hush();
    OK(two.DoStep(c, 0.0, 1e-3, 1));
    CHECK(strcmp(said, "logStatusWarning\none: at t = 0.001 s: 100% off bottom by -0.1\n") == 0);
    hush();
    OK(two.DoStep(c, 1e-3, 1e-3, 1));
    CHECK(said[0] == 0);
    fmi2FMUstate state = NULL;
    OK(two.GetFMUstate(c, &state));
    OK(set(c, FEED, 666.0));
    REFUSED(two.DoStep(c, 2e-3, 1e-3, 1), "logStatusError\none: a storm at 0.003 s");
    REFUSED(two.DoStep(c, 2e-3, 1e-3, 1), "the instance has failed in a step");
    REFUSED(set(c, FEED, 1.0), "no fmi2SetReal after a step that failed");
    REFUSED(two.Terminate(c), "has failed");
    CHECK(get(c, FEED) == 666.0);
    get(c, FORCE);
    fmi2Status status = fmi2OK;
    OK(two.GetStatus(c, fmi2DoStepStatus, &status));
    OK(two.SetFMUstate(c, state));
    CHECK(get(c, FEED) == -0.1);
    OK(two.DoStep(c, 2e-3, 1e-3, 1));
    OK(set(c, FEED, 666.0));
    REFUSED(two.DoStep(c, 3e-3, 1e-3, 1), "storm");
    OK(two.Reset(c));
    works(start(c, 0.0));
    OK(two.FreeFMUstate(c, &state));
    two.FreeInstance(c);
}

static void test_logging(void) {
    C c = new_one();
    fmi2String errors[] = {"logStatusError"}, events[] = {"logEvents"}, none[] = {"nonsense", NULL};
    OK(two.SetDebugLogging(c, 1, 1, errors));
    REFUSED(two.Terminate(c), "out of order");
    OK(two.SetDebugLogging(c, 1, 1, events));
    hush();
    CHECK(two.Terminate(c) == fmi2Error && said[0] == 0);
    OK(two.SetDebugLogging(c, 1, 0, NULL));
    REFUSED(two.Terminate(c), "out of order");
    OK(two.SetDebugLogging(c, 0, 0, NULL)); /* errors are told all the same */
    REFUSED(two.Terminate(c), "out of order");
    OK(two.SetDebugLogging(c, 0, 1, errors));
    hush();
    CHECK(two.Terminate(c) == fmi2Error && said[0] == 0);
    OK(two.SetDebugLogging(c, 1, 0, NULL));
    hush();
    CHECK(two.SetDebugLogging(c, 1, 2, none) == fmi2Warning && strstr(said, "nonsense") != NULL);
    OK(two.SetDebugLogging(c, 1, 0, NULL));
    REFUSED(two.SetDebugLogging(c, 1, 1, NULL), "a list is NULL");
    two.FreeInstance(c);
}

/* ---- states ----------------------------------------------------------------------- */

static char *bytes_of(C c, size_t *size) {
    fmi2FMUstate state = NULL;
    OK(two.GetFMUstate(c, &state));
    OK(two.SerializedFMUstateSize(c, state, size));
    char *bytes = malloc(*size);
    OK(two.SerializeFMUstate(c, state, bytes, *size));
    REFUSED(two.SerializeFMUstate(c, state, bytes, *size - 1), "the place for it has");
    OK(two.FreeFMUstate(c, &state));
    CHECK(state == NULL);
    return bytes;
}

static int give(C c, const char *bytes, size_t size) {
    fmi2FMUstate state = NULL;
    int status = (int)two.DeSerializeFMUstate(c, bytes, size, &state);
    if (status == 0) {
        status = (int)two.SetFMUstate(c, state);
        OK(two.FreeFMUstate(c, &state));
    } else {
        CHECK(state == NULL);
    }
    return status;
}

static void test_states(void) {
    C c = start(new_one(), 0.0), twin = start(new_one(), 0.0);
    fmi2FMUstate state = NULL;
    steps(c, 0.0, 1e-3, 12);
    OK(set(c, FEED, 1234.5)); /* waits to be passed on */
    OK(two.GetFMUstate(c, &state));
    double x_saved = get(c, POSITION);
    steps(c, 0.012, 1e-3, 10);
    double x = get(c, POSITION), mean = get(c, MEAN);
    fmi2FMUstate same = state;
    for (int k = 0; k < 3; k++) {
        OK(two.SetFMUstate(c, state));
        CHECK(get_int(c, BLOWS) == 1 && get(c, FEED) == 1234.5 && get(c, FORCE) == 2500.0);
        CHECK(fabs(get(c, MEAN) - 2500.0) < 1e-6 && get(c, POSITION) == x_saved);
        steps(c, 0.012, 1e-3, 10);
        CHECK(get(c, POSITION) == x && get(c, MEAN) == mean);
    }
    OK(two.SetFMUstate(twin, state)); /* of another instance that lives */
    steps(twin, 0.012, 1e-3, 10);
    CHECK(get(twin, POSITION) == x);
    REFUSED(two.FreeFMUstate(twin, &state), "belongs to another instance");
    OK(two.GetFMUstate(c, &state)); /* overwritten */
    CHECK(state == same);
    OK(two.FreeFMUstate(c, &state));
    CHECK(state == NULL);
    OK(two.FreeFMUstate(c, &state));
    OK(two.FreeFMUstate(c, NULL));
    REFUSED(two.FreeFMUstate(c, &same), "the saved state was freed");
    OK(two.GetFMUstate(c, &state));
    OK(two.FreeFMUstate(c, (fmi2FMUstate *)state)); /* as fmusim does */
    REFUSED(two.FreeFMUstate(c, (fmi2FMUstate *)state), "the saved state was freed");
    REFUSED(two.SetFMUstate(c, state), "the saved state was freed");
    state = NULL;
    REFUSED(two.SetFMUstate(c, same), "the saved state was freed");
    REFUSED(two.SetFMUstate(c, NULL), "the saved state is NULL");
    REFUSED(two.GetFMUstate(c, NULL), "NULL");
    uint64_t foreign[64] = {1, 2, 3};
    REFUSED(two.SetFMUstate(c, foreign), "belongs to another FMU");
    void *strange = foreign;
    REFUSED(two.FreeFMUstate(c, &strange), "belongs to another instance");
    fmi2FMUstate many[200] = {NULL};
    for (int k = 0; k < 200; k++) {
        OK(two.GetFMUstate(c, &many[k]));
    }
    for (int k = 0; k < 100; k++) { /* the rest is freed with the instance */
        OK(two.FreeFMUstate(c, &many[2 * k]));
    }
    two.FreeInstance(c);
    two.FreeInstance(twin);
}

static void test_states_of_phases(void) {
    C c = new_one();
    size_t sizes[6];
    char *saved[6];
    OK(set(c, AREA, 2e-3));
    saved[0] = bytes_of(c, &sizes[0]);
    OK(two.SetupExperiment(c, 0, 0.0, 0.5, 0, 0.0));
    saved[1] = bytes_of(c, &sizes[1]);
    OK(two.EnterInitializationMode(c));
    get(c, FORCE);
    saved[2] = bytes_of(c, &sizes[2]);
    OK(two.ExitInitializationMode(c));
    saved[3] = bytes_of(c, &sizes[3]);
    steps(c, 0.5, 1e-3, 25);
    double x = get(c, POSITION);
    saved[4] = bytes_of(c, &sizes[4]);
    OK(two.Terminate(c));
    saved[5] = bytes_of(c, &sizes[5]);
    for (int round = 0; round < 2; round++) {
        C one = round == 0 ? c : new_one();
        OK(give(one, saved[0], sizes[0]));
        CHECK(get(one, AREA) == 2e-3);
        REFUSED(two.EnterInitializationMode(one), "fmi2SetupExperiment");
        OK(give(one, saved[1], sizes[1]));
        OK(two.EnterInitializationMode(one));
        OK(two.ExitInitializationMode(one));
        steps(one, 0.5, 1e-3, 25);
        CHECK(get(one, POSITION) == x);
        OK(give(one, saved[2], sizes[2]));
        REFUSED(two.DoStep(one, 0.5, 1e-3, 1), "initialising");
        OK(two.ExitInitializationMode(one));
        OK(give(one, saved[3], sizes[3]));
        steps(one, 0.5, 1e-3, 25);
        CHECK(get(one, POSITION) == x);
        OK(give(one, saved[5], sizes[5]));
        REFUSED(two.DoStep(one, 0.525, 1e-3, 1), "terminated");
        OK(give(one, saved[4], sizes[4]));
        CHECK(get(one, POSITION) == x);
        steps(one, 0.525, 1e-3, 1);
        two.FreeInstance(one);
    }
    C other = new_one();
    REFUSED(give(other, saved[3], sizes[3]), "belongs to other parameters or to another FMU");
    works(start(other, 0.0));
    two.FreeInstance(other);
    for (int k = 0; k < 6; k++) {
        free(saved[k]);
    }
}

/* Inputs that the motion was made with come along. */
static void test_given_inputs(void) {
    C c = new_one();
    size_t size;
    OK(set(c, STIFFNESS, 4e8));
    start(c, 0.0);
    OK(set(c, STIFFNESS, 5e8));
    steps(c, 0.0, 1e-3, 5);
    char *saved = bytes_of(c, &size);
    C other = start(new_one(), 0.0);
    CHECK(get(other, STRESS) == 7.5e8);
    OK(give(other, saved, size));
    CHECK(get(other, STRESS) == 4e8 && get(other, STIFFNESS) == 5e8);
    OK(set(c, STIFFNESS, 0.0)); /* a bad input belongs to the state as well */
    free(saved);
    saved = bytes_of(c, &size);
    OK(give(other, saved, size));
    REFUSED(two.DoStep(other, 0.005, 1e-3, 1), "rock.loading_stiffness = 0.0 N/m");
    two.FreeInstance(c);
    two.FreeInstance(other);
    free(saved);
}

/* Give a state its right hash, whatever is in it. */
static void seal(char *bytes, size_t size) {
    Hash hash;
    uint64_t length = size - 84;
    memcpy(bytes + 44, &length, 8);
    hash_begin(&hash);
    hash_add(&hash, bytes, 52);
    hash_add(&hash, bytes + 84, size - 84);
    hash_end(&hash, (uint8_t *)bytes + 52);
}

static void test_damaged(void) {
    C c = new_one();
    size_t size;
    start(c, 0.0);
    works(c);
    char *good = bytes_of(c, &size), *bad = malloc(size + 8);
    double x = get(c, POSITION);
    for (size_t k = 0; k < size; k++) {
        memcpy(bad, good, size);
        bad[k] = (char)(bad[k] ^ (1 << k % 8));
        REFUSED(give(c, bad, size), "saved state");
        CHECK(get(c, POSITION) == x);
    }
    for (size_t k = 0; k <= size; k++) {
        char *cut = malloc(k + 1); /* so that reading beyond it is seen */
        memcpy(cut, good, k);
        if (k < size) {
            REFUSED(give(c, cut, k), "saved state");
        }
        free(cut);
    }
    memcpy(bad, good, size);
    memset(bad + size, 0, 8);
    REFUSED(give(c, bad, size + 8), "bytes where");
    bad[8]++;
    REFUSED(give(c, bad, size), "the saved state has version 4, this FMU reads 3");
    REFUSED(give(c, "\0", 1), "a saved state of 1 bytes is too short to be one");
    fmi2FMUstate state = NULL;
    REFUSED(two.DeSerializeFMUstate(c, NULL, 0, &state), "NULL");
    REFUSED(two.DeSerializeFMUstate(c, good, size, NULL), "NULL");
    OK(give(c, good, size));
    /* with a right hash: refused, or taken and then of no harm */
    for (size_t k = 84; k < size; k++) {
        for (int bit = 0; bit < 8; bit += k < 120 ? 1 : 7) {
            memcpy(bad, good, size);
            bad[k] = (char)(bad[k] ^ (1 << bit));
            seal(bad, size);
            hush();
            if (give(c, bad, size) == 0) {
                double value;
                fmi2ValueReference force = FORCE;
                two.GetReal(c, &force, 1, &value);
                two.DoStep(c, 0.025, 1e-3, 1);
            } else {
                CHECK(said[0] != 0);
            }
            OK(give(c, good, size));
            CHECK(get(c, POSITION) == x);
        }
    }
    for (size_t k = 84; k < size; k += 5) { /* cut short, with a right hash */
        char *cut = malloc(k);
        memcpy(cut, good, k);
        seal(cut, k);
        REFUSED(give(c, cut, k), "saved state");
        free(cut);
    }
    steps(c, 0.025, 1e-3, 1);
    free(good);
    free(bad);
    two.FreeInstance(c);
}

/* ---- at the same time ------------------------------------------------------------- */

static void *run(void *result) {
    C c = start(new_named("thread"), 0.0);
    for (int k = 0; k < 2000; k++) {
        double feed = 2000.0 + k % 7;
        fmi2ValueReference which = FEED, out = POSITION;
        two.SetReal(c, &which, 1, &feed);
        two.DoStep(c, k * 1e-3, 1e-3, 1);
        two.GetReal(c, &out, 1, result);
    }
    two.FreeInstance(c);
    return NULL;
}

void test_threads(void) {
    pthread_t threads[4];
    double found[5];
    run(&found[4]);
    for (int k = 0; k < 4; k++) {
        pthread_create(&threads[k], NULL, run, &found[k]);
    }
    for (int k = 0; k < 4; k++) {
        pthread_join(threads[k], NULL);
        CHECK(found[k] == found[4]);
    }
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void measure(void) {
    enum { COUNT = 2000000, OUTS = 25 };
    C c = start(new_one(), 0.0);
    fmi2ValueReference outs[OUTS], feed = FEED;
    double values[OUTS];
    for (unsigned k = 0; k < OUTS; k++) {
        outs[k] = 200 + k;
    }
    double begin = seconds();
    for (int k = 0; k < COUNT; k++) {
        two.DoStep(c, k * 1e-3, 1e-3, 1);
    }
    double stepped = seconds();
    for (int k = 0; k < COUNT; k++) {
        two.GetReal(c, outs, OUTS, values);
    }
    double got = seconds();
    for (int k = 0; k < COUNT; k++) {
        double value = 2000.0 + k % 7;
        two.SetReal(c, &feed, 1, &value);
    }
    double was_set = seconds();
    fmi2FMUstate state = NULL;
    for (int k = 0; k < COUNT / 10; k++) {
        two.GetFMUstate(c, &state);
        two.SetFMUstate(c, state);
    }
    double saved = seconds();
    printf("step %.1f ns, get of %d %.1f ns, set %.1f ns, save and restore %.1f ns\n",
           1e9 * (stepped - begin) / COUNT, OUTS, 1e9 * (got - stepped) / COUNT,
           1e9 * (was_set - got) / COUNT, 1e10 * (saved - was_set) / COUNT);
    two.FreeFMUstate(c, &state);
    two.FreeInstance(c);
}

bool is_found2(const char *location) {
    C c = two.Instantiate("x", fmi2CoSimulation, guid, location, &callbacks, 0, 0);
    two.FreeInstance(c);
    return c != NULL;
}

void test_fmi2(void) {
    test_usual();
    test_reset();
    test_instantiate();
    test_names();
    test_sequence();
    test_stop();
    test_values();
    test_bounds();
    test_notes_and_faults();
    test_logging();
    test_states();
    test_states_of_phases();
    test_given_inputs();
    test_damaged();
}
