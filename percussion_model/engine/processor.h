/* The widest vectors of processor and system for which there are kernels. */
#ifndef PROCESSOR_H
#define PROCESSOR_H

#include <stdbool.h>
#include <stdint.h>

enum { PLAIN, AVX2, AVX512 };

#if defined(HAVE_AVX2_KERNELS) && (defined(__x86_64__) || defined(_M_X64))
#include <cpuid.h>

static inline bool has_all(uint32_t bits, uint32_t wanted) { return (bits & wanted) == wanted; }

static inline int widest_vectors(void) {
    uint32_t a, b, c, d, low, high;
    /* AVX2, and BMI as all processors with it */
    const uint32_t xsave = 1u << 27, avx2 = 1u << 5 | 1u << 3 | 1u << 8;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !has_all(c, xsave)) {
        return PLAIN;
    }
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    /* the system keeps the wide registers */
    if (!has_all(low, 0x6) || !__get_cpuid_count(7, 0, &a, &b, &c, &d) || !has_all(b, avx2)) {
        return PLAIN;
    }
#if defined(HAVE_AVX512_KERNELS)
    /* F, DQ, CD, BW, VL; and VBMI2, which processors do not have that slow down for wide vectors */
    const uint32_t avx512 = 1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31;
    if (has_all(low, 0xe6) && has_all(b, avx512) && has_all(c, 1u << 6)) {
        return AVX512;
    }
#endif
    return AVX2;
}
#else
static inline int widest_vectors(void) { return PLAIN; }
#endif

#endif
