/* The kernels, compiled elsewhere, for the processor on which the library runs. */
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
#include <cpuid.h>

DECLARE(_avx2)

/* Whether processor and system have AVX2, and BMI as all processors with it. */
static bool has_avx2(void) {
    uint32_t a, b, c, d, low, high;
    const uint32_t xsave = 1u << 27, avx2 = 1u << 5, bmi = 1u << 3 | 1u << 8;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & xsave) == 0) {
        return false;
    }
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & 6) != 6) { /* the system does not keep the wide registers */
        return false;
    }
    return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & avx2) != 0 && (b & bmi) == bmi;
}

Kernels kernels_of_machine(void) { return has_avx2() ? KERNELS(_avx2) : KERNELS(_base); }
#else
Kernels kernels_of_machine(void) { return KERNELS(_base); }
#endif
