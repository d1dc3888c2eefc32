/* Placeholder: chooses the instruction level of this processor. */
#ifdef _WIN32
#define MUMACRO_EXPORT __declspec(dllexport)
#else
#define MUMACRO_EXPORT __attribute__((visibility("default")))
#endif

typedef double (*mumacro_kernel)(double, double);

double mumacro_hypotenuse_base(double a, double b);
#ifdef MUMACRO_HAS_AVX512
double mumacro_hypotenuse_avx2(double a, double b);
double mumacro_hypotenuse_avx512(double a, double b);
#endif

static const mumacro_kernel kernels[] = {
    mumacro_hypotenuse_base,
#ifdef MUMACRO_HAS_AVX512
    mumacro_hypotenuse_avx2,
    mumacro_hypotenuse_avx512,
#endif
};

MUMACRO_EXPORT const mumacro_kernel *mumacro_kernel_at(int level);
MUMACRO_EXPORT int mumacro_best_level(void);

const mumacro_kernel *mumacro_kernel_at(int level) { return &kernels[level]; }

int mumacro_best_level(void) {
#ifdef MUMACRO_HAS_AVX512
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
        return 2;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return 1;
#endif
    return 0;
}
