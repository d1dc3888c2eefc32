"""The kernel's elementary functions: each is as exact as its comment says, against 40 digits."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from mumacro.kernel import binding
from tests.support import compilers
from tests.support.cases import Array

KERNEL = Path(binding.__file__).parent
N = 1500
rng = np.random.default_rng(5)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The functions of elementary.c, by two doubles at a time."""
    out = tmp_path_factory.mktemp("elementary") / "elementary.so"
    words = ("-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-w", f"-I{KERNEL}")
    source = Path(__file__).with_name("elementary.c")
    compilers.run(*compilers.compiler("gcc"), *words, source, "-o", out, "-lm")
    return ctypes.CDLL(str(out))


def uniform(low: float, high: float) -> Array:
    return np.append(rng.uniform(low, high, N), (low, high))


def decades(low: float, high: float) -> Array:
    return np.asarray(10.0 ** uniform(low, high))


SIZES = decades(-300.0, 300.0)


def same(_: Any) -> mpf:
    """Errors count as they are."""
    return mpf(1)


#: name -> points, with a second column where it takes two; the true value; what errors are relative
#: to; what the comment says that they are at most
FUNCTIONS: dict[str, tuple[tuple[Array, ...], Callable[..., Any], Callable[..., Any], float]] = {
    "sine": ((np.append(uniform(-4.0, 4.0), uniform(-1e5, 1e5)),), mp.sin, same, 1.8e-16),
    "sine_of_less": ((uniform(0.7, 0.785),), mp.sin, same, 1e-16),
    "cosine": ((np.append(uniform(-4.0, 4.0), uniform(-1e5, 1e5)),), mp.cos, same, 1.8e-16),
    "logarithm": (
        (np.append(uniform(0.25, 4.0), decades(-323.0, 308.0)),),
        mp.log,
        lambda true: max(abs(true), 1),
        4e-16,
    ),
    "length": ((decades(-3.0, 3.0), decades(-3.0, 3.0)), mp.hypot, abs, 2.3e-16),
    # what may not be squared is scaled, which costs a digit
    "length_of_any_size": ((SIZES, SIZES * decades(-3.0, 3.0)), mp.hypot, abs, 4.5e-16),
    "cube_root": ((decades(-300.0, 300.0),), mp.cbrt, abs, 4e-16),
    "decay": (
        (np.append(uniform(0.0, 2.0), uniform(0.0, 699.0)),),
        lambda x: mp.exp(-x),
        abs,
        4e-16,
    ),
    "mean_inverse": (
        (decades(-3.0, 3.0), decades(-3.1, 3.2)),
        lambda a, b: mp.log(b / a) / (b - a),
        abs,
        1e-15,
    ),
    "damping": ((uniform(1e-9, 0.2),), lambda x: mp.sin(x) / x, abs, 1.2e-16),
    "arcsine": ((np.append(uniform(1e-9, 1.0), decades(-30.0, 0.0)),), mp.asin, abs, 7e-16),
    "arc_rest": ((uniform(1e-6, 3.14),), lambda m: m - mp.sin(m) * mp.cos(m), abs, 1e-15),
    "arc_bent": ((uniform(1e-6, 3.14),), lambda m: mp.sin(m) - m * mp.cos(m), abs, 1e-15),
    "outside": ((uniform(1e-9, 1.0),), lambda s: s / (1 + mp.sqrt(1 - s)), abs, 5e-16),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_is_as_exact_as_stated_and_not_much_better(
    compiled: ctypes.CDLL, name: str
) -> None:
    points, true_of, scale_of, stated = FUNCTIONS[name]
    columns = np.array([points[0], points[-1]])
    out = np.empty(columns.shape[1])
    pointers = (x.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for x in (*columns, out))
    getattr(compiled, name.partition("_of_")[0])(ctypes.c_int(out.size), *pointers)
    errors = []
    with mpmath.workdps(40):
        for value, *arguments in zip(out.tolist(), *(x.tolist() for x in points), strict=True):
            true = true_of(*map(mpf, arguments))
            errors.append(float(abs(mpf(value) - true) / scale_of(true)))
    assert 0.3 * stated < max(errors) <= stated
