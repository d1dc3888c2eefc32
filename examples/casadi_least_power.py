"""Which amplitude and frequency bring friction down to a target at the least power?  With CasADi and Ipopt.

    python examples/casadi_least_power.py

The question of least_power.py.  ``mumacro export --format c`` writes the kernel and the table in C; GLUE gives CasADi
mu_macro and the contact's power with exact derivatives.  Needs a C compiler.
"""

import subprocess
import tempfile
from pathlib import Path
from typing import Any

import casadi as ca

GLUE = """
#include "mumacro.h"
static int both(const double *x, double *value, double *slopes) { /* mu_macro, power; 2 x 6, column by column */
    mumacro_answer a; mumacro_point p;
    if (mumacro_evaluate(x[0], x[1], x[2], x[3], x[4], x[5], &a)) return 1; /* a line search steps back */
    if (mumacro_evaluate_point(MUMACRO_POWER, a.v_tilde, a.y_tilde, &p)) return 1;
    const double unit = x[0] * x[1] * (x[0] * x[1] / x[2]) * x[4], all = p.value, v = p.slope_v, y = p.slope_y;
    const double slope[6] = {2 * all - v - y, 2 * all - v - y, v + y - all, y, all - v, v};
    if (value) value[0] = a.mu_macro, value[1] = unit * all;
    for (int i = 0; slopes && i < 6; ++i) slopes[2 * i] = a.gradient[i], slopes[2 * i + 1] = unit * slope[i] / x[i];
    return 0;
}
int friction(const double **in, double **out, long long *iw, double *w, int mem) { return both(in[0], out[0], 0); }
int jac_friction(const double **in, double **out, long long *iw, double *w, int mem) { return both(in[0], 0, out[0]); }
static const long long six[] = {6, 1, 1}, two[] = {2, 1, 1}, matrix[] = {2, 6, 1};
const long long *friction_sparsity_in(long long i) { return six; }
const long long *friction_sparsity_out(long long i) { return two; }
long long jac_friction_n_in(void) { return 2; }
const long long *jac_friction_sparsity_in(long long i) { return i ? two : six; }
const long long *jac_friction_sparsity_out(long long i) { return matrix; }
"""


def optimise(target: float = 0.15, mass: float = 0.005, quality: float = 1000.0) -> tuple[float, ...]:
    """y0 [m], omega [rad/s], mu_macro and total power [W] at least power under mu_macro <= target."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["mumacro", "export", "--format", "c", "--out", folder], check=True, capture_output=True)
        Path(folder, "glue.c").write_text(GLUE)
        sources = [f"{folder}/{name}.c" for name in ("glue", "mumacro", "mumacro_table")]
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", *sources, "-lm", "-o", f"{folder}/friction.so"], check=True)
        friction = ca.external("friction", f"{folder}/friction.so")
        x = ca.MX.sym("ln y0, ln omega", 2)
        y0, omega = ca.exp(x[0]), ca.exp(x[1])
        found = friction(ca.vertcat(0.3, 10.0, 1e6, y0, omega, 0.01))
        power = found[1] + mass * omega**3 * y0**2 / (2.0 * quality)
        quiet = {"print_level": 0, "hessian_approximation": "limited-memory"}
        options: dict[str, Any] = {"print_time": False, "ipopt": quiet}
        solver: Any = ca.nlpsol("least", "ipopt", {"x": x, "f": 1e3 * power, "g": found[0]}, options)
        solved = solver(x0=ca.log([3e-6, 3e4]), ubg=target)
    return *map(float, ca.exp(solved["x"]).full().ravel()), float(solved["g"]), 1e-3 * float(solved["f"])


if __name__ == "__main__":
    y0, omega, mu_macro, power = optimise()
    print(f"y0 = {1e6 * y0:.4f} um, omega = {omega:.1f} rad/s: mu_macro = {mu_macro:.6f}, power {1e3 * power:.3f} mW")
