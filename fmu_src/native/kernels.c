/* The kernels, compiled elsewhere, for the processor on which the library runs. */
#include "processor.h"
#include "shell.h"

/* Hidden: two libraries in a process must not take each other's. COFF hides all that is not
 * exported. */
#if !defined(_WIN32)
#pragma GCC visibility push(hidden)
#endif

#define DECLARE(suffix)                                                                        \
    int64_t kernel_check##suffix(const int64_t *image, int64_t *notes);                        \
    int64_t kernel_create##suffix(const int64_t *image, int64_t **motion, int64_t *notes);     \
    int64_t kernel_step##suffix(int64_t *motion, const int64_t *image, int64_t flags, double t, \
                                double h, double *reached, int64_t *notes);                    \
    int64_t kernel_read##suffix(int64_t *motion, int64_t flags, double *outputs);              \
    int64_t kernel_fault##suffix(const int64_t *motion, const int64_t *state, double t,        \
                                 int64_t *notes);

#define KERNELS(suffix)                                                                        \
    ((Kernels){kernel_check##suffix, kernel_create##suffix, kernel_step##suffix,               \
               kernel_read##suffix, kernel_fault##suffix})

DECLARE(_base)

#if defined(HAVE_AVX2_KERNELS) && (defined(__x86_64__) || defined(_M_X64))
DECLARE(_avx2)
#if defined(HAVE_AVX512_KERNELS) /* not of parts of a system */
DECLARE(_avx512)
#endif

Kernels kernels_of_machine(void) {
    switch (widest_vectors()) {
#if defined(HAVE_AVX512_KERNELS)
    case AVX512:
        return KERNELS(_avx512);
#endif
    case AVX2:
        return KERNELS(_avx2);
    default:
        return KERNELS(_base);
    }
}
#else
Kernels kernels_of_machine(void) { return KERNELS(_base); }
#endif
