/* The gradient of mumacro.h in the form that Modelica calls; mumacro.h is the export in one header. */
#include <string.h>

#include "mumacro.h"

static inline void mumacro_modelica_gradient(double mu0, double Fz, double k, double y0, double omega, double v0,
                                             double *gradient) {
    mumacro_answer answer;
    mumacro_evaluate(mu0, Fz, k, y0, omega, v0, &answer);
    memcpy(gradient, answer.gradient, sizeof answer.gradient);
}
