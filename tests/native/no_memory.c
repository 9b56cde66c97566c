/* Memory that ends: linked in the place of malloc, calloc and realloc of the shell. */
#include <stddef.h>

int left_of_memory(int count);
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *block, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *block, size_t size);

static int left = -1; /* allocations that still succeed; -1: all */

/* Let this many succeed; how many were left of those before. */
__attribute__((visibility("default"))) int left_of_memory(int count) {
    int before = left;
    left = count;
    return before;
}

static int is_there(void) {
    if (left > 0) {
        left--;
    }
    return left != 0;
}

void *__wrap_malloc(size_t size) { return is_there() ? __real_malloc(size) : NULL; }

void *__wrap_calloc(size_t count, size_t size) {
    return is_there() ? __real_calloc(count, size) : NULL;
}

void *__wrap_realloc(void *block, size_t size) {
    return is_there() ? __real_realloc(block, size) : NULL;
}
