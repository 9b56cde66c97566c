/* Memory that entries ask for: motions, and arrays that live while one is made.
 *
 * Numba's code counts who holds an array in a record before its numbers
 * (percussion_model/engine/objects.py), and calls the functions below by these names.
 */
#include "processor.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* In a library of FMUs they are for the shell alone. */
#if !defined(ENGINE_LIBRARY)
#define EXPORTED
#elif defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

enum { LINE = 64 }; /* of a processor's cache [bytes] */

/* As numba's code sees it, whose counts have eight bytes: it reads the first, and where the numbers
 * are. */
typedef struct {
    uint64_t count;
    void (*destroy)(void *data, uint64_t size, void *info);
    void *info;
    void *data;
    uint64_t size;
    void *allocator;
} Array;

EXPORTED int64_t native_allocate(int64_t size);
EXPORTED void native_free(int64_t memory);
EXPORTED int64_t engine_vectors(void);
void *NRT_Allocate(uint64_t size);
void NRT_Free(void *data);
Array *NRT_MemInfo_alloc(uint64_t size);
Array *NRT_MemInfo_alloc_aligned(uint64_t size, unsigned align);
Array *NRT_MemInfo_alloc_safe_aligned(uint64_t size, unsigned align);
void NRT_MemInfo_call_dtor(Array *array);

/* Where a memory really begins stands in the word before it. */
int64_t native_allocate(int64_t size) {
    if (size < 0 || (uint64_t)size > SIZE_MAX / 2) {
        return 0;
    }
    char *whole = calloc(1, (size_t)size + LINE + sizeof whole);
    if (whole == NULL) {
        return 0;
    }
    uintptr_t begin = (uintptr_t)(whole + sizeof whole + LINE - 1) / LINE * LINE;
    memcpy((char *)begin - sizeof whole, &whole, sizeof whole);
    return (int64_t)begin;
}

void native_free(int64_t memory) {
    char *whole;
    memcpy(&whole, (char *)(intptr_t)memory - sizeof whole, sizeof whole);
    free(whole);
}

int64_t engine_vectors(void) { return widest_vectors(); }

Array *NRT_MemInfo_alloc_aligned(uint64_t size, unsigned align) {
    if (size > SIZE_MAX / 2) {
        return NULL;
    }
    size_t step = align > sizeof(void *) ? align : sizeof(void *);
    Array *array = malloc((size_t)(sizeof *array + size + step));
    if (array == NULL) {
        return NULL;
    }
    uintptr_t begin = ((uintptr_t)(array + 1) + step - 1) / step * step;
    *array = (Array){.count = 1, .data = (void *)begin, .size = size};
    return array;
}

Array *NRT_MemInfo_alloc_safe_aligned(uint64_t size, unsigned align) {
    return NRT_MemInfo_alloc_aligned(size, align);
}

Array *NRT_MemInfo_alloc(uint64_t size) { return NRT_MemInfo_alloc_aligned(size, LINE); }

void NRT_MemInfo_call_dtor(Array *array) {
    if (array->destroy != NULL) {
        array->destroy(array->data, array->size, array->info);
    }
    free(array);
}

void *NRT_Allocate(uint64_t size) { return malloc((size_t)size); }

void NRT_Free(void *data) { free(data); }
