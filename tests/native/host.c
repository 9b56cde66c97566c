/* The host's own part: loading, logging, counting of failures. */
#include "host.h"

#include <dlfcn.h>
#include <stdlib.h>

const char *guid, *place, *folder;
char said[1 << 16];
int failures;
Two two;
Three three;

void hush(void) { said[0] = 0; }

void hear(const char *text) {
    size_t used = strlen(said), more = strlen(text);
    if (used + more + 2 < sizeof said) {
        memcpy(said + used, text, more);
        memcpy(said + used + more, "\n", 2);
    }
}

void check_(bool good, const char *what, const char *file, int line) {
    if (!good) {
        failures++;
        fprintf(stderr, "%s:%d: %s\n  log: %s\n", file, line, what, said);
    }
}

void refused_(int status, const char *words, const char *file, int line) {
    if (status != 3 || strstr(said, words) == NULL) {
        failures++;
        fprintf(stderr, "%s:%d: status %d, and no words: %s\n  log: %s\n", file, line, status,
                words, said);
    }
}

static void *symbol(void *library, const char *name) {
    void *found = dlsym(library, name);
    if (found == NULL) {
        fprintf(stderr, "%s\n", dlerror());
        exit(2);
    }
    return found;
}

#define LOAD2(name) *(void **)&two.name = symbol(library, "fmi2" #name);
#define LOAD3(name) *(void **)&three.name = symbol(library, "fmi3" #name);

/* host library guid URI folder tests... */
int main(int count, char **words) {
    void *library = count > 5 ? dlopen(words[1], RTLD_NOW | RTLD_LOCAL) : NULL;
    if (library == NULL) {
        fprintf(stderr, "%s\n", count > 5 ? dlerror() : "what is to be tested?");
        return 2;
    }
    FUNCTIONS2(LOAD2)
    FUNCTIONS3(LOAD3)
    guid = words[2], place = words[3], folder = words[4];
    for (int k = 5; k < count; k++) {
        if (strcmp(words[k], "fmi2") == 0) {
            test_fmi2();
        } else if (strcmp(words[k], "fmi3") == 0) {
            test_fmi3();
        } else if (strcmp(words[k], "threads") == 0) {
            test_threads();
        } else if (strcmp(words[k], "measure") == 0) {
            measure();
        } else if (strcmp(words[k], "any") == 0) {
            for (unsigned seed = 1; seed <= 40; seed++) {
                test_any_calls(seed, 3000);
            }
        } else if (strcmp(words[k], "many") == 0) {
            test_many();
        } else if (strcmp(words[k], "sequences") == 0) {
            test_sequences();
        } else if (strcmp(words[k], "states") == 0) {
            test_bad_states();
        } else if (strcmp(words[k], "memory") == 0) {
            int (*left)(int);
            *(void **)&left = symbol(library, "left_of_memory");
            test_no_memory(left);
        } else if (strcmp(words[k], "tables") == 0) {
            test_damaged_tables("model.bin");
        } else if (strcmp(words[k], "place") == 0) {
            printf("%d %d\n", is_found2(place), is_found3(folder));
        } else {
            fprintf(stderr, "no such test: %s\n", words[k]);
            failures++;
        }
    }
    dlclose(library);
    return failures > 0;
}
