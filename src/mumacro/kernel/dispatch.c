/* The one function of the shared object: the kernel of an instruction level,
 * where this processor can run it. */
#include <stddef.h>

#include "export.h"
#include "library.h"

extern const mumacro_kernel mumacro_kernel_base;
#if defined MUMACRO_HAS_AVX2
extern const mumacro_kernel mumacro_kernel_avx2;
#endif
#if defined MUMACRO_HAS_AVX512
extern const mumacro_kernel mumacro_kernel_avx512;
#endif

#if defined MUMACRO_HAS_AVX2
#include <cpuid.h>

/* Whether the processor has the instructions of a level (1: AVX2, 2: AVX-512) and the system keeps
 * their registers.  Not by __builtin_cpu_supports: what it reads is missing or empty in the
 * run-time library of some compilers. */
static int mu_runs(int level) {
    const unsigned first = bit_OSXSAVE | bit_FMA;
    const unsigned wide = bit_AVX512F | bit_AVX512DQ | bit_AVX512VL | bit_AVX512BW;
    const unsigned seventh = level == 1 ? bit_AVX2 : bit_AVX2 | wide;
    const unsigned registers = level == 1 ? 0x06 : 0xe6; /* bits of XCR0 */
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & first) != first) return 0;
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & seventh) != seventh) return 0;
    __asm__("xgetbv" : "=a"(a), "=d"(d) : "c"(0));
    return (a & registers) == registers;
}
#endif

MU_EXPORT const mumacro_kernel *mumacro_kernel_at(int level) {
    if (level == 0) return &mumacro_kernel_base;
#if defined MUMACRO_HAS_AVX2
    if (level == 1 && mu_runs(level)) return &mumacro_kernel_avx2;
#endif
#if defined MUMACRO_HAS_AVX512
    if (level == 2 && mu_runs(level)) return &mumacro_kernel_avx512;
#endif
    return NULL;
}
