"""Time of mu~ inside other programs: one point, arrays, a loop of 1,000 steps; scipy's ellipk beside it.

PyTorch is measured where it is installed.
"""

from benchmarks.measuring import best_of, main, markdown, quantity  # isort: split

import functools
import importlib.util
import subprocess
import sys
import tempfile
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi
import jax
import numpy as np
from scipy.special import ellipk

import mumacro
from mumacro.jax import Friction as InJax

STEPS = 1000
GLUE = """#include "mumacro.h"
int ratio(const double **in, double **out, long long *iw, double *w, int mem) {
    return out[0][0] = mumacro_mu_ratio(in[0][0], in[1][0]), 0;
}
long long ratio_n_in(void) { return 2; }
"""
Way = tuple[Callable[..., Any], Callable[..., Any], Callable[[float], Any]]


def loop(step: Callable[[Any], Any], start: Any) -> Any:
    for _ in range(STEPS):
        start = 0.9 * start + 0.1 * step(start)
    return start


def in_jax(table: mumacro.Surrogate) -> Way:
    """Jitted; the loop is a scan."""
    jax.config.update("jax_enable_x64", True)
    ratio = InJax(table).mu_ratio
    jitted = jax.jit(ratio)
    scan = jax.jit(lambda c: jax.lax.scan(lambda c, _: (0.9 * c + 0.1 * ratio(c, 0.5), None), c, None, STEPS)[0])
    return lambda *x: jitted(*x).block_until_ready(), jax.numpy.asarray, lambda c: scan(c).block_until_ready()


def in_torch(table: mumacro.Surrogate) -> Way:
    import torch

    from mumacro.torch import Friction

    ratio = Friction(table).mu_ratio
    made = functools.partial(torch.as_tensor, dtype=torch.float64)
    half = made(0.5)
    return ratio, made, lambda c: loop(lambda x: ratio(x, half), made(c))


def in_casadi(table: mumacro.Surrogate) -> Way:
    """The exported C as an external function; arrays are a map, the loop a fold."""
    folder = Path(tempfile.mkdtemp())
    words = [sys.executable, "-m", "mumacro", "export", "--format", "c", "--table", f"{table.tolerance:g}"]
    subprocess.run([*words, "--out", folder / "mumacro.h"], check=True, capture_output=True)
    (folder / "glue.c").write_text(GLUE)
    words = ["cc", "-O2", "-shared", "-fPIC", str(folder / "glue.c"), "-lm", "-o", str(folder / "ratio.so")]
    subprocess.run(words, check=True)
    ratio, x = casadi.external("ratio", str(folder / "ratio.so")), casadi.MX.sym("c")
    step = casadi.Function("step", [x], [0.9 * x + 0.1 * ratio(x, 0.5)])
    folded, maps = step.fold(STEPS), {n: ratio.map(n) if n > 1 else ratio for n in (1, 1000, 10_000, 1_000_000)}
    return lambda v, y: maps[v.size2()](v, y), lambda x: casadi.DM(np.reshape(x, (1, -1))), folded


def interop(quick: bool) -> str:
    n = 10_000 if quick else 1_000_000
    table = mumacro.open(1e-7, threads=1)
    v, y = 10.0 ** np.random.default_rng(0).uniform(-3.0, 3.0, (2, n))
    ways: dict[str, Way] = {
        "Python": (table.mu_ratio, lambda x: x, lambda c: loop(lambda x: table.mu_ratio(x, 0.5), c)),
        "JAX": in_jax(table),
        **({"PyTorch": in_torch(table)} if importlib.util.find_spec("torch") else {}),
        "CasADi": in_casadi(table),
        "scipy.special.ellipk": (lambda v, _: ellipk(v), lambda x: x, lambda c: loop(ellipk, c)),
    }
    rows = {name: [name] for name in ways}
    for points, number, unit in ((0, 2000, 1e6), (1000, 200, 1e6), (n, 1, 1e9 / n), (None, 1, 1e3)):
        work = {}
        for name, (call, made, steps) in ways.items():
            given = [0.1] if points is None else [made(x[:points] if points else float(x[0])) for x in (v, y)]
            once = functools.partial(steps if points is None else call, *given)
            work[name] = functools.partial(timeit.timeit, once, number=number)
        for name, seconds in best_of(15, work).items():
            rows[name].append(quantity(seconds / number * unit))
    head = ["mu~", "one point [us]", "1,000 [us]", f"{n:,} [ns each]", f"{STEPS:,} steps [ms]"]
    return markdown(head, list(rows.values()))


if __name__ == "__main__":
    main(__doc__, {"interop": interop}, quick=False)
