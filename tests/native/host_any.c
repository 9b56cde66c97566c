/* Calls of FMI 2.0 and 3.0 in any order, without memory, with damaged tables: no crash. */
#include "host.h"
#include "shell.h" /* the hash, which the library does not give away */

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>

static void logger2(fmi2ComponentEnvironment host, fmi2String name, fmi2Status status,
                    fmi2String category, fmi2String message, ...) {
    (void)host, (void)name, (void)status, (void)category, (void)message;
}

static void logger3(fmi3InstanceEnvironment host, fmi3Status status, fmi3String category,
                    fmi3String message) {
    (void)host, (void)status, (void)category, (void)message;
}

static const fmi2CallbackFunctions callbacks = {logger2, NULL, NULL, NULL, NULL};

static fmi2Component make2(void) {
    return two.Instantiate("any", fmi2CoSimulation, guid, place, &callbacks, 0, 1);
}

static fmi3Instance make3(bool events) {
    return three.InstantiateCoSimulation("any", guid, folder, 0, 1, events, events, NULL, 0, NULL,
                                         logger3, NULL);
}

static uint64_t random_state;

static unsigned draw(unsigned below) {
    random_state = random_state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (unsigned)(random_state >> 33) % below;
}

static double draw_number(double near) {
    const double odd[] = {NAN, INFINITY, -INFINITY, 0.0, -1.0, 1e300, 666.0, 1e-300, -0.0};
    return draw(4) > 0 ? near : odd[draw(9)];
}

/* Of a step: not so long that real kernels are at it for seconds. */
static double draw_size(double near) {
    double size = draw_number(near);
    return size == 666.0 ? 0.02 : size;
}

/* Instances, states, and where the host believes that they are. */
enum { STATES = 4 };
static const fmi2ValueReference REFERENCES[] = {FEED, PRESSURE, ON, STIFFNESS, POSITION, PEAK,
                                                STRESS, BLOWS, MODE, GRAVITY, ROCK, GAP, CELLS,
                                                AREA, LENGTHS, TIME, 4711};

static fmi2ValueReference draw_reference(void) {
    return REFERENCES[draw(sizeof REFERENCES / sizeof *REFERENCES)];
}

static double any_call2(fmi2Component c, fmi2FMUstate *states, double now) {
    fmi2ValueReference which[3] = {draw_reference(), draw_reference(), draw_reference()};
    double values[3] = {draw_number(2000.0), draw_number(1.0), draw_number(1e5)};
    int wholes[3] = {(int)draw(5) - 1, (int)draw(100), 1};
    size_t count = draw(4), size = 0;
    fmi2FMUstate *state = &states[draw(STATES)];
    double h = draw_size(0.004);
    switch (draw(18)) {
    case 0: two.SetupExperiment(c, 0, 0.0, 0.0, draw(2) > 0, draw_number(1.0)); break;
    case 1: two.EnterInitializationMode(c); break;
    case 2: two.ExitInitializationMode(c); break;
    case 3: draw(8) == 0 ? two.Terminate(c) : 0; break;
    case 4: draw(8) == 0 ? two.Reset(c) : 0; break;
    case 5: two.GetReal(c, which, count, values); break;
    case 6: two.GetInteger(c, which, count, wholes); break;
    case 7: two.GetBoolean(c, which, count, wholes); break;
    case 8: two.SetReal(c, which, count, values); break;
    case 9: two.SetInteger(c, which, count, wholes); break;
    case 10: two.SetBoolean(c, which, count, wholes); break;
    case 11: two.GetFMUstate(c, state); break;
    case 12: two.SetFMUstate(c, *state); break;
    case 13: two.FreeFMUstate(c, state); break;
    case 14:
        if (two.SerializedFMUstateSize(c, *state, &size) == fmi2OK) {
            char *bytes = malloc(size);
            two.SerializeFMUstate(c, *state, bytes, size);
            if (draw(3) == 0) {
                bytes[draw((unsigned)size)] ^= 4;
            }
            two.FreeFMUstate(c, state);
            two.DeSerializeFMUstate(c, bytes, size, state);
            free(bytes);
        }
        break;
    default: /* most calls are steps */
        if (two.GetRealStatus(c, fmi2LastSuccessfulTime, &now) == fmi2OK) {
            two.DoStep(c, draw_number(now), h, 1);
        }
    }
    return now;
}

static void any_call3(fmi3Instance one) {
    fmi3ValueReference which[3] = {draw_reference(), draw_reference(), draw_reference()};
    double values[4] = {draw_number(2000.0), 1.0, 2.0, 3.0}, time = 0.0, next;
    int64_t longs[3] = {1, draw(9), -1};
    bool bools[6] = {false};
    fmi3ValueReference clock = TIME;
    size_t count = draw(4), values_count = draw(5);
    switch (draw(12)) {
    case 0: three.EnterInitializationMode(one, 0, 0.0, draw_number(0.0), draw(2), 1.0); break;
    case 1: three.ExitInitializationMode(one); break;
    case 2: three.EnterEventMode(one); break;
    case 3: three.EnterStepMode(one); break;
    case 4:
        three.UpdateDiscreteStates(one, bools, bools + 1, bools + 2, bools + 3, bools + 4, &next);
        break;
    case 5: three.GetFloat64(one, which, count, values, values_count); break;
    case 6: three.SetFloat64(one, which, count, values, values_count); break;
    case 7: three.SetInt64(one, which, count, longs, count); break;
    case 8: three.GetBoolean(one, which, count, bools, count); break;
    case 9: draw(8) == 0 ? three.Reset(one) : 0; break;
    default:
        three.GetFloat64(one, &clock, 1, &time, 1);
        three.DoStep(one, draw_number(time), draw_size(0.013), 1, bools, bools + 1, bools + 2,
                     &next);
    }
}

void test_any_calls(unsigned seed, int count) {
    fmi2Component pair[2] = {make2(), make2()};
    fmi3Instance third = make3(seed % 2);
    fmi2FMUstate states[2][STATES] = {{NULL}};
    double now = 0.0;
    random_state = seed;
    for (int k = 0; k < count; k++) {
        unsigned which = draw(2);
        now = any_call2(pair[which], states[which], now);
        any_call3(third);
    }
    two.FreeInstance(pair[0]);
    two.FreeInstance(pair[1]);
    three.FreeInstance(third);
}

/* ---- no memory -------------------------------------------------------------------- */

/* A short life; true if nothing was missing in it. */
static bool live(void) {
    size_t size = 0;
    char bytes[4096];
    fmi2FMUstate state = NULL, other = NULL;
    fmi2Component c = make2();
    if (c == NULL) {
        return false;
    }
    fmi2ValueReference which = STIFFNESS;
    double value = 5e8;
    bool is_good =
        two.SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) == fmi2OK &&
        two.EnterInitializationMode(c) == fmi2OK && two.ExitInitializationMode(c) == fmi2OK &&
        two.DoStep(c, 0.0, 1e-3, 1) == fmi2OK && two.GetFMUstate(c, &state) == fmi2OK &&
        two.SerializedFMUstateSize(c, state, &size) == fmi2OK &&
        two.SerializeFMUstate(c, state, bytes, sizeof bytes) == fmi2OK &&
        two.Reset(c) == fmi2OK && two.SetReal(c, &which, 1, &value) == fmi2OK &&
        two.DeSerializeFMUstate(c, bytes, size, &other) == fmi2OK &&
        two.SetFMUstate(c, other) == fmi2OK;
    two.FreeInstance(c);
    fmi3Instance one = is_good ? make3(true) : NULL;
    three.FreeInstance(one);
    return one != NULL;
}

void test_no_memory(int (*left_of_memory)(int count)) {
    int count = 1;
    for (; count < 1000; count++) {
        left_of_memory(count);
        bool is_good = live();
        if (is_good) {
            break;
        }
        CHECK(left_of_memory(-1) == 0); /* it was missing that, and nothing else */
    }
    left_of_memory(-1);
    CHECK(count > 15 && count < 1000);
}

/* ---- damaged tables --------------------------------------------------------------- */

static void write_tables(const char *path, uint8_t *bytes, size_t size) {
    Hash hash;
    hash_begin(&hash);
    hash_add(&hash, bytes, 24);
    hash_add(&hash, bytes + 56, size - 56);
    hash_end(&hash, bytes + 24);
    FILE *file = fopen(path, "wb");
    fwrite(bytes, 1, size, file);
    fclose(file);
}

static void try_tables(void) {
    fmi2Component c = make2();
    fmi3Instance one = make3(false);
    bool bools[3];
    double time, value;
    for (size_t k = 0; c != NULL && k < sizeof REFERENCES / sizeof *REFERENCES; k++) {
        two.GetReal(c, &REFERENCES[k], 1, &value);
    }
    if (c != NULL && two.SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) == fmi2OK &&
        two.EnterInitializationMode(c) == fmi2OK && two.ExitInitializationMode(c) == fmi2OK) {
        two.DoStep(c, 0.0, 1e-3, 1);
    }
    if (one != NULL && three.EnterInitializationMode(one, 0, 0.0, 0.0, 0, 0.0) == fmi3OK &&
        three.ExitInitializationMode(one) == fmi3OK) {
        three.DoStep(one, 0.0, 1e-3, 1, bools, bools + 1, bools + 2, &time);
    }
    two.FreeInstance(c);
    three.FreeInstance(one);
}

void test_damaged_tables(const char *name) {
    static uint8_t good[1 << 20], bad[1 << 20];
    char path[4096];
    const uint8_t changes[] = {0x01, 0x80, 0xff};
    bool is_long = getenv("PERCUSSION_LONG") != NULL;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    size_t size = file == NULL ? 0 : fread(good, 1, sizeof good, file);
    CHECK(size > 1000);
    if (file == NULL) {
        return;
    }
    fclose(file);
    for (size_t k = 8; k < size; k += is_long ? 1 : k < 500 ? 3 : 41) {
        memcpy(bad, good, size);
        bad[k] ^= changes[k % 3];
        write_tables(path, bad, size);
        try_tables();
    }
    for (size_t k = 0; k < size; k += is_long ? 1 : k < 300 ? 7 : 197) { /* cut short */
        memcpy(bad, good, size);
        memcpy(bad + 16, &k, 8);
        if (k > 56) {
            write_tables(path, bad, k);
        } else {
            file = fopen(path, "wb");
            fwrite(bad, 1, k, file);
            fclose(file);
        }
        hush();
        CHECK(make2() == NULL);
    }
    write_tables(path, good, size);
}
