/* A host in C: loads an FMU of FMI 2.0, steps it, writes an output after each step, and whether
 * any Python lies in its process. Arguments: library, GUID, resources, reference, steps. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
static void *open_library(const char *path) { return (void *)LoadLibraryA(path); }
static void *symbol(void *library, const char *name) {
    return (void *)GetProcAddress((HMODULE)library, name);
}
static const char *why(void) { return "LoadLibrary"; }
#else
#include <dlfcn.h>
static void *open_library(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *symbol(void *library, const char *name) { return dlsym(library, name); }
static const char *why(void) { return dlerror(); }
#endif

typedef void *Component;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static void log_message(void *environment, const char *name, int status, const char *category,
                        const char *text, ...) {
    (void)environment;
    fprintf(stderr, "%s %d %s %s\n", name, status, category, text);
}

static int has_python(void) {
    char line[4096];
    int found = 0;
    FILE *maps = fopen("/proc/self/maps", "r");
    while (maps != NULL && fgets(line, sizeof line, maps) != NULL) {
        found |= strstr(line, "libpython") != NULL || strstr(line, "/numpy/") != NULL;
    }
    if (maps != NULL) {
        fclose(maps);
    }
    return found;
}

int main(int count, char **words) {
    if (count != 6) {
        return 2;
    }
    void *library = open_library(words[1]);
    if (library == NULL) {
        fprintf(stderr, "%s\n", why());
        return 3;
    }
    Component (*instantiate)(const char *, int, const char *, const char *, const Callbacks *, int,
                             int);
    int (*setup)(Component, int, double, double, int, double);
    int (*enter)(Component), (*leave)(Component), (*end)(Component);
    int (*step)(Component, double, double, int);
    int (*get)(Component, const unsigned *, size_t, double *);
    void (*release)(Component);
    *(void **)&instantiate = symbol(library, "fmi2Instantiate");
    *(void **)&setup = symbol(library, "fmi2SetupExperiment");
    *(void **)&enter = symbol(library, "fmi2EnterInitializationMode");
    *(void **)&leave = symbol(library, "fmi2ExitInitializationMode");
    *(void **)&step = symbol(library, "fmi2DoStep");
    *(void **)&get = symbol(library, "fmi2GetReal");
    *(void **)&end = symbol(library, "fmi2Terminate");
    *(void **)&release = symbol(library, "fmi2FreeInstance");
    Callbacks callbacks = {log_message, calloc, free, NULL, NULL};
    Component one = instantiate("hammer", 1, words[2], words[3], &callbacks, 0, 1);
    if (one == NULL || setup(one, 0, 0.0, 0.0, 0, 0.0) || enter(one) || leave(one)) {
        return 4;
    }
    unsigned reference = (unsigned)strtoul(words[4], NULL, 10);
    const double size = 1.0 / 1024.0;
    puts(has_python() ? "python" : "no-python");
    for (long k = 0; k < strtol(words[5], NULL, 10); k++) {
        double value = 0.0;
        if (step(one, (double)k * size, size, 1) || get(one, &reference, 1, &value)) {
            return 5;
        }
        printf("%a\n", value);
    }
    end(one);
    release(one);
    return 0;
}
