/* A host of FMI 3.0 with event mode and early return: steps an FMU and writes the time of each event,
 * with the number of blows then and in the end.
 * Arguments: library, token, folder of the resources, reference of blow_count, step, steps. */
#include "fmi3FunctionTypes.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

static void *library;

static void *symbol(const char *name) {
    void *found = dlsym(library, name);
    if (found == NULL) {
        fprintf(stderr, "%s\n", dlerror());
        exit(3);
    }
    return found;
}

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message) {
    (void)environment;
    fprintf(stderr, "%d %s %s\n", (int)status, category, message);
}

#define LOAD(name) fmi3##name##TYPE *name; *(void **)&name = symbol("fmi3" #name)

int main(int count, char **words) {
    if (count != 7 || (library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL)) == NULL) {
        fprintf(stderr, "%s\n", count == 7 ? dlerror() : "six arguments");
        return 2;
    }
    LOAD(InstantiateCoSimulation);
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(EnterEventMode);
    LOAD(UpdateDiscreteStates);
    LOAD(EnterStepMode);
    LOAD(DoStep);
    LOAD(GetInt32);
    LOAD(FreeInstance);
    fmi3Instance one = InstantiateCoSimulation("one", words[2], words[3], false, false, true, true,
                                               NULL, 0, NULL, log_message, NULL);
    fmi3ValueReference blow_count = (fmi3ValueReference)strtoul(words[4], NULL, 10);
    double step = strtod(words[5], NULL), now = 0.0;
    long steps = strtol(words[6], NULL, 10);
    int32_t blows = 0;
    bool event, ends, early, flags[5];
    if (one == NULL || EnterInitializationMode(one, false, 0.0, 0.0, false, 0.0) ||
        ExitInitializationMode(one) || EnterStepMode(one)) {
        return 4;
    }
    for (long k = 1; k <= steps;) {
        double end = (double)k * step;
        if (DoStep(one, now, end - now, true, &event, &ends, &early, &now)) {
            return 5;
        }
        k += !early;
        if (event) {
            if (EnterEventMode(one) ||
                UpdateDiscreteStates(one, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4],
                                     &end) ||
                EnterStepMode(one) || GetInt32(one, &blow_count, 1, &blows, 1)) {
                return 6;
            }
            printf("%a %d\n", now, (int)blows);
        }
    }
    GetInt32(one, &blow_count, 1, &blows, 1);
    printf("end %d\n", (int)blows);
    FreeInstance(one);
    return 0;
}
