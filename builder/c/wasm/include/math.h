/* What the kernel needs of <math.h>: two instructions of WebAssembly and two constants. */
#define HUGE_VAL __builtin_huge_val()
#define NAN __builtin_nanf("")
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
