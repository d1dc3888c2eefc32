"""Time of mu~ inside JAX and PyTorch: one point, arrays, a loop of 1,000 steps; the library and ellipk beside it."""

from __future__ import annotations

from benchmarks.measuring import main, markdown, quantity  # isort: split

import timeit
from collections.abc import Callable
from time import process_time
from typing import Any

import jax
import numpy as np
import torch
from scipy.special import ellipk

import mumacro
from mumacro.jax import Friction as InJax
from mumacro.torch import Friction as InTorch

STEPS = 1000


def best(call: Callable[[], Any], number: int) -> float:
    """Least processor time of a call [s] in nine rounds."""
    call()
    return min(timeit.repeat(call, number=number, repeat=9, timer=process_time)) / number


def loop(step: Callable[[Any], Any], start: Any) -> Any:
    """A body that takes 1,000 small steps."""
    for _ in range(STEPS):
        start = 0.9 * start + 0.1 * step(start)
    return start


def interop(quick: bool) -> str:
    """mu~ in every library."""
    n = 10_000 if quick else 1_000_000
    jax.config.update("jax_enable_x64", True)
    table = mumacro.open(1e-10, threads=1)
    in_jax, in_torch = InJax(table), InTorch(table)
    v, y = 10.0 ** np.random.default_rng(0).uniform(-3.0, 3.0, (2, n))
    jitted = jax.jit(in_jax.mu_ratio)
    slope = jax.jit(jax.vmap(jax.grad(in_jax.mu_ratio)))
    scan = jax.jit(
        lambda c: jax.lax.scan(lambda c, _: (0.9 * c + 0.1 * in_jax.mu_ratio(c, 0.5), None), c, None, length=STEPS)[0]
    )

    def torch_slope(v: Any, y: Any) -> Any:
        v = v.clone().requires_grad_()
        return torch.autograd.grad(in_torch.mu_ratio(v, y).sum(), v)[0]

    def ready(function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *x: function(*x).block_until_ready()

    def steps_in_torch(c: float) -> Any:
        return loop(lambda x: in_torch.mu_ratio(x, 0.5), torch.tensor(c))

    # the call, what makes its arguments, 1,000 steps
    ways: dict[str, tuple[Callable[..., Any], Callable[..., Any], Callable[[float], Any] | None]] = {
        "mumacro.Surrogate": (table.mu_ratio, lambda x: x, lambda c: loop(lambda x: table.mu_ratio(x, 0.5), c)),
        "JAX, jitted": (ready(jitted), jax.numpy.asarray, ready(scan)),
        "JAX, slope along v~": (ready(slope), jax.numpy.atleast_1d, None),
        "PyTorch": (in_torch.mu_ratio, torch.as_tensor, steps_in_torch),
        "PyTorch, slope along v~": (torch_slope, torch.as_tensor, None),
        "scipy.special.ellipk": (lambda v, _: ellipk(v), lambda x: x, lambda c: loop(ellipk, c)),
    }
    rows = []
    for name, (call, made, steps) in ways.items():
        one, many, all_points = ([made(x[:size] if size else float(x[0])) for x in (v, y)] for size in (0, 1000, n))
        figures = [best(lambda: call(*one), 200) * 1e6, best(lambda: call(*many), 20) * 1e6]  # noqa: B023
        figures.append(best(lambda: call(*all_points), 1) / n * 1e9)  # noqa: B023
        figures += [best(lambda: steps(0.1), 1) * 1e3] if steps else []  # noqa: B023
        rows.append([name, *map(quantity, figures), *([] if steps else ["-"])])
    header = ["mu~", "one point [us]", "1,000 points [us]", f"{n:,} points [ns a point]", f"{STEPS:,} steps [ms]"]
    return f"Table 1e-10, one thread.\n\n{markdown(header, rows)}"


if __name__ == "__main__":
    main(__doc__, {"interop": interop}, quick=False)
