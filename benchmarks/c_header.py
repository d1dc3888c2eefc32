"""The exported C beside the library: nanoseconds a point, and distance in units of the last place, in one run.

    python benchmarks/c_header.py [--quick] [--write]

Times: points spread evenly in ln v~ and ln y~ over 1e-3 to 1e3, in random order.  Distances: points over 1e-9 to 1e9,
half of them around the border of continuous sliding and around the corner, without those within 1e-8 of the border,
where rounding decides the side.
"""

from benchmarks.measuring import ROOT, best_of, main, markdown, progress, quantity  # isort: split

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from builder.c.source import write_c
from mumacro import Surrogate

Array = NDArray[np.float64]
DRIVER = ROOT / "tests" / "c" / "driver.c"
OPTIONS = ("-O2", "-O3 -march=native", "-O3 -march=native -ffp-contract=off")
SIDE = 1e-8  # of v~/v~crit - 1


def library(folder: Path, compiler: str, options: str) -> Any:
    """The driver with the export in ``folder`` as a shared library."""
    out = folder / f"driver{len(list(folder.glob('*.so')))}.so"
    sources = [str(DRIVER), str(folder / "mumacro.c"), str(folder / "mumacro_table.c"), f"-I{folder}"]
    subprocess.run([compiler, *options.split(), "-shared", "-fPIC", *sources, "-o", str(out), "-lm"], check=True)
    return ctypes.CDLL(str(out))


def called(function: Any, v: Array, y: Array, out: Array) -> Callable[[], object]:
    pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (v, y, out)]
    return lambda: function(pointers[0], pointers[1], v.size, pointers[2])


def hard_points(surrogate: Surrogate, n: int) -> tuple[Array, Array]:
    """Everywhere; around the border, to the last digit; around the corner y~ = 1, v~ = 0."""
    rng = np.random.default_rng(12)
    y = 10.0 ** np.where(rng.random(n) < 0.25, rng.uniform(-0.3, 0.3, n), rng.uniform(-6.0, 9.0, n))
    off = rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-16.0, -0.1, n)
    crit = np.asarray(surrogate.v_tilde_crit(y))
    v = np.where(rng.random(n) < 0.25, crit * (1.0 + off), 10.0 ** rng.uniform(-9.0, 9.0, n))
    away = np.abs(v / crit - 1.0) > SIDE
    return v[away], y[away]


def c_header(quick: bool) -> str:
    """The library, and the export by every compiler with every set of options."""
    n, rounds = (20_000, 2) if quick else (500_000, 7)
    surrogate = Surrogate.open(ROOT / "tables" / "mumacro-1e-10.nc", threads=1)
    v, y = 10.0 ** np.random.default_rng(11).uniform(-3.0, 3.0, (2, n))
    hard_v, hard_y = hard_points(surrogate, n)
    expected = np.asarray(surrogate.mu_ratio(hard_v, hard_y))
    out, found = np.empty(n), np.empty(hard_v.size)
    work: dict[str, Callable[[], object]] = {"the library": lambda: surrogate.mu_ratio(v, y)}
    apart = {"the library": "0"}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_c(surrogate.table, folder)
        for compiler in filter(shutil.which, ("gcc", "clang")):
            for options in OPTIONS:
                progress(row := f"`{compiler} {options}`")
                made = library(folder, compiler, options)
                work[row] = called(made.ratio_array, v, y, out)
                work[f"{row}, call by call"] = called(made.ratios, v, y, out)
                called(made.ratio_array, hard_v, hard_y, found)()
                ulps = np.where(found == expected, 0.0, np.abs(found - expected) / np.spacing(np.abs(expected)))
                apart[row] = f"{ulps.max():.0f}"
        best = best_of(rounds, work)
    rows = [[name, quantity(1e9 * best[name] / n), apart.get(name, "-")] for name in work]
    return markdown(("evaluator", "ns/point", "largest distance off the border"), rows)


if __name__ == "__main__":
    main(__doc__, {"c_header": c_header}, quick=False)
