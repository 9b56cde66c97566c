/* For libraries with the real kernels: many instances, many sequences of calls, bad states. */
#include "host.h"
#include "shell.h" /* the hash, which the library does not give away */

#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdlib.h>

typedef fmi2Component C;

enum { THREADS = 8, INSTANCES = 1000, STEPS = 60, SEQUENCES = 10000, CALLS = 300, BAD = 1000 };

static void logger(fmi2ComponentEnvironment host, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    (void)host, (void)name, (void)status, (void)category, (void)message;
}

static const fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, NULL};

static C started(double feed) {
    const fmi2ValueReference which = FEED;
    C c = two.Instantiate("real", fmi2CoSimulation, guid, place, &callbacks, 0, 0);
    if (c == NULL || two.SetReal(c, &which, 1, &feed) != fmi2OK ||
        two.SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) != fmi2OK ||
        two.EnterInitializationMode(c) != fmi2OK || two.ExitInitializationMode(c) != fmi2OK) {
        fprintf(stderr, "no instance\n");
        exit(1);
    }
    return c;
}

/* ---- many instances at the same time ---------------------------------------------- */

static const fmi2ValueReference READ[] = {POSITION, VELOCITY, FORCE, MEAN, PEAK, STRESS};
enum { COUNT = sizeof READ / sizeof *READ };

typedef struct {
    int first, stride;
    double found[INSTANCES][COUNT];
} Share;

/* All instances of a share live at the same time, and step in turn. */
static void *run_share(void *given) {
    Share *share = given;
    static const double size = 1.0 / 1024.0;
    C *all = calloc(INSTANCES, sizeof *all);
    for (int k = share->first; k < INSTANCES; k += share->stride) {
        all[k] = started(2000.0 + 1.5 * k);
    }
    for (int step = 0; step < STEPS; step++) {
        for (int k = share->first; k < INSTANCES; k += share->stride) {
            two.DoStep(all[k], step * size, size, 1);
        }
    }
    for (int k = share->first; k < INSTANCES; k += share->stride) {
        two.GetReal(all[k], READ, COUNT, share->found[k]);
        two.FreeInstance(all[k]);
    }
    free(all);
    return NULL;
}

void test_many(void) {
    pthread_t threads[THREADS];
    Share *shares = calloc(THREADS + 1, sizeof *shares), *alone = &shares[THREADS];
    *alone = (Share){.first = 0, .stride = 1};
    run_share(alone);
    for (int k = 0; k < THREADS; k++) {
        shares[k].first = k, shares[k].stride = THREADS;
        pthread_create(&threads[k], NULL, run_share, &shares[k]);
    }
    for (int k = 0; k < THREADS; k++) {
        pthread_join(threads[k], NULL);
    }
    int others = 0;
    for (int k = 0; k < INSTANCES; k++) {
        CHECK(memcmp(shares[k % THREADS].found[k], alone->found[k], sizeof alone->found[k]) == 0);
        others += alone->found[k][0] != alone->found[0][0];
    }
    CHECK(others > INSTANCES / 2); /* they are different motions */
    free(shares);
}

/* ---- calls and states ------------------------------------------------------------- */

void test_sequences(void) {
    const char *wanted = getenv("SEQUENCES");
    unsigned most = wanted == NULL ? SEQUENCES : (unsigned)strtoul(wanted, NULL, 10);
    for (unsigned seed = 1; seed <= most; seed++) {
        test_any_calls(seed, CALLS);
    }
}

static uint64_t draw_state = 1;

static size_t draw(size_t below) {
    draw_state = draw_state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (size_t)(draw_state >> 33) % below;
}

static void seal(char *bytes, size_t size) {
    Hash hash;
    hash_begin(&hash);
    hash_add(&hash, bytes, 52);
    hash_add(&hash, bytes + 84, size - 84);
    hash_end(&hash, (uint8_t *)bytes + 52);
}

/* States with a right hash, and bytes or words that are not: refused, or taken and then of no
 * harm; the instance goes on as before once its state is restored. */
void test_bad_states(void) {
    C c = started(2500.0), other = started(2500.0);
    const fmi2ValueReference which = POSITION;
    const double odd[] = {NAN, INFINITY, -1.0, 1e300, -1e300, 4e9, 1e-310, 3.0};
    double now = 0.0, wanted = 0.0, value = 0.0;
    int taken = 0;
    fmi2FMUstate state = NULL, bad_state = NULL;
    size_t size = 0;
    for (; now < 0.07; now += 1e-3) {
        two.DoStep(c, now, 1e-3, 1);
    }
    OK(two.GetFMUstate(c, &state));
    OK(two.SerializedFMUstateSize(c, state, &size));
    char *good = malloc(size), *bad = malloc(size);
    OK(two.SerializeFMUstate(c, state, good, size));
    OK(two.GetRealStatus(c, fmi2LastSuccessfulTime, &now));
    OK(two.DoStep(c, now, 1e-2, 1));
    OK(two.GetReal(c, &which, 1, &wanted));
    for (int k = 0; k < BAD; k++) {
        size_t at = 84 + draw(size - 84 - 8);
        memcpy(bad, good, size);
        if (k % 2 == 0) {
            bad[at] = (char)(bad[at] ^ (1 << draw(8)));
        } else {
            memcpy(bad + 84 + (at - 84) / 8 * 8, &odd[draw(sizeof odd / sizeof *odd)], 8);
        }
        seal(bad, size);
        if (two.DeSerializeFMUstate(other, bad, size, &bad_state) == fmi2OK &&
            two.SetFMUstate(other, bad_state) == fmi2OK) {
            taken++;
            two.GetRealStatus(other, fmi2LastSuccessfulTime, &value);
            two.DoStep(other, value, 1e-2, 1);
            for (int j = 0; j < COUNT; j++) {
                two.GetReal(other, &READ[j], 1, &value);
            }
        }
        two.FreeFMUstate(other, &bad_state);
        if (k % 50 == 0) {
            OK(two.SetFMUstate(other, state));
            OK(two.DoStep(other, now, 1e-2, 1));
            OK(two.GetReal(other, &which, 1, &value));
            CHECK(value == wanted);
        }
    }
    printf("of %d bad states %d were taken\n", BAD, taken);
    two.FreeInstance(c);
    two.FreeInstance(other);
    free(good);
    free(bad);
}
