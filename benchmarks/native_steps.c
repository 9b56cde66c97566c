/* Processor time of steps of a native FMU, from C. Arguments: library, GUID, resources, runs,
 * references of Real outputs. Writes one object of JSON. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef void *Component;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

enum { EMPTY = 1000000, STEPS = 100000, MOST = 100, WORST = 5 };
static const double STEP = 1e-4; /* [s] */
/* Steps in which nothing happens, within the flight after a blow [s]. */
static const double IN_FLIGHT = 0.02, SHORT = 1e-10;

static Component (*instantiate)(const char *, int, const char *, const char *, const Callbacks *,
                                int, int);
static int (*setup)(Component, int, double, double, int, double);
static int (*enter)(Component), (*leave)(Component);
static int (*step)(Component, double, double, int);
static int (*get)(Component, const unsigned *, size_t, double *);
static void (*release)(Component);
static char **words;
static unsigned outputs[MOST];
static size_t count;

static void log_message(void *environment, const char *name, int status, const char *category,
                        const char *text, ...) {
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s: %s\n", name, text);
}

/* [ns] */
static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e9 * (double)time.tv_sec + (double)time.tv_nsec;
}

static void stop(const char *why) {
    fprintf(stderr, "%s\n", why);
    exit(1);
}

static Component begin(void) {
    static const Callbacks callbacks = {log_message, calloc, free, NULL, NULL};
    Component one = instantiate("hammer", 1, words[2], words[3], &callbacks, 0, 1);
    if (one == NULL || setup(one, 0, 0.0, 0.0, 0, 0.0) || enter(one) || leave(one)) {
        stop("no instance");
    }
    return one;
}

/* Steps so short that nothing happens in them [ns a step]. */
static double time_empty(size_t read) {
    double values[MOST], best = 1e300;
    for (int run = 0; run < 5; run++) {
        Component one = begin();
        double t = IN_FLIGHT, from = step(one, 0.0, IN_FLIGHT, 1) ? 0.0 : now();
        for (int k = 0; k < EMPTY; k++) {
            if (step(one, t, SHORT, 1) || (read > 0 && get(one, outputs, read, values))) {
                stop("a step failed");
            }
            t += SHORT;
        }
        double took = (now() - from) / EMPTY;
        best = took < best ? took : best;
        release(one);
    }
    return best;
}

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Every step of ten seconds: in the first run, and the least of all runs. */
static void time_steps(const char *name, int runs, size_t read) {
    static double first[STEPS], least[STEPS], sorted[STEPS];
    double values[MOST], unloaded = 1e300;
    for (int k = 0; k < 1000; k++) { /* what looking at the clock takes */
        double from = now(), took = now() - from;
        unloaded = took < unloaded ? took : unloaded;
    }
    for (int run = 0; run < runs; run++) {
        Component one = begin();
        for (int k = 0; k < STEPS; k++) {
            double from = now();
            if (step(one, k * STEP, STEP, 1) || (read > 0 && get(one, outputs, read, values))) {
                stop("a step failed");
            }
            double took = now() - from - unloaded;
            first[k] = run == 0 ? took : first[k];
            least[k] = run == 0 || took < least[k] ? took : least[k];
        }
        release(one);
    }
    const char *which[] = {"first", "least"};
    for (int k = 0; k < 2; k++) {
        for (int j = 0; j < STEPS; j++) {
            sorted[j] = k == 0 ? first[j] : least[j];
        }
        qsort(sorted, STEPS, sizeof *sorted, ascending);
        printf("\"%s_%s\": [%.0f, %.0f, %.0f], ", name, which[k], sorted[STEPS / 2],
               sorted[STEPS - STEPS / 1000], sorted[STEPS - 1]);
    }
    printf("\"%s_worst\": [", name);
    for (int j = 0; j < WORST; j++) {
        int worst = 0;
        for (int k = 1; k < STEPS; k++) {
            worst = least[k] > least[worst] ? k : worst;
        }
        printf("%s[%.4f, %.0f]", j == 0 ? "" : ", ", (worst + 1) * STEP, least[worst]);
        least[worst] = -1.0;
    }
    printf("]");
}

int main(int number, char **given) {
    void *library = number < 6 ? NULL : dlopen(given[1], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        stop("no library");
    }
    words = given;
    for (int k = 5; k < number && count < MOST; k++) {
        outputs[count++] = (unsigned)strtoul(given[k], NULL, 10);
    }
    *(void **)&instantiate = dlsym(library, "fmi2Instantiate");
    *(void **)&setup = dlsym(library, "fmi2SetupExperiment");
    *(void **)&enter = dlsym(library, "fmi2EnterInitializationMode");
    *(void **)&leave = dlsym(library, "fmi2ExitInitializationMode");
    *(void **)&step = dlsym(library, "fmi2DoStep");
    *(void **)&get = dlsym(library, "fmi2GetReal");
    *(void **)&release = dlsym(library, "fmi2FreeInstance");
    int runs = atoi(given[4]);
    printf("{\"empty\": %.1f, \"empty_read\": %.1f, ", time_empty(0), time_empty(count));
    time_steps("step", runs, 0);
    printf(", ");
    time_steps("read", runs, count);
    printf("}\n");
    return 0;
}
