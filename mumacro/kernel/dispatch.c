/* The one function of the shared object: the kernel of an instruction level, where this processor can run it. */
#include <stddef.h>

#include "library.h"

#if defined _WIN32
#define MU_EXPORT __declspec(dllexport)
#else
#define MU_EXPORT __attribute__((visibility("default")))
#endif

extern const mumacro_kernel mumacro_kernel_base;
#if defined MUMACRO_HAS_AVX2
extern const mumacro_kernel mumacro_kernel_avx2;
#endif
#if defined MUMACRO_HAS_AVX512
extern const mumacro_kernel mumacro_kernel_avx512;
#endif

MU_EXPORT const mumacro_kernel *mumacro_kernel_at(int level) {
    if (level == 0) return &mumacro_kernel_base;
#if defined MUMACRO_HAS_AVX2
    __builtin_cpu_init();
    if (level == 1 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &mumacro_kernel_avx2;
#endif
#if defined MUMACRO_HAS_AVX512
    if (level == 2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
        return &mumacro_kernel_avx512;
#endif
    return NULL;
}
