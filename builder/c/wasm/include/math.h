/* What mumacro.h needs of <math.h>: two functions of JavaScript, two instructions of WebAssembly, two constants. */
#define HUGE_VAL __builtin_huge_val()
#define NAN __builtin_nanf("")
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
__attribute__((import_module("Math"), import_name("log"))) double log(double x);
__attribute__((import_module("Math"), import_name("exp"))) double exp(double x);
