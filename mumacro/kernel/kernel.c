/* Placeholder: one exported function for each instruction level. */
#include <math.h>

#define MUMACRO_JOIN(a, b) a##_##b
#define MUMACRO_NAME(a, b) MUMACRO_JOIN(a, b)

double MUMACRO_NAME(mumacro_hypotenuse, MUMACRO_LEVEL)(double a, double b);

double MUMACRO_NAME(mumacro_hypotenuse, MUMACRO_LEVEL)(double a, double b) { return sqrt(a * a + b * b); }
