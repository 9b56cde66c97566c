/* Whether processor and system have AVX2, and BMI as all processors with it. */
#ifndef PROCESSOR_H
#define PROCESSOR_H

#include <stdbool.h>
#include <stdint.h>

#if defined(HAVE_AVX2_KERNELS) && (defined(__x86_64__) || defined(_M_X64))
#include <cpuid.h>

static inline bool has_avx2(void) {
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
#else
static inline bool has_avx2(void) { return false; }
#endif

#endif
