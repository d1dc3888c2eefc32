"""The exported C beside the library: nanoseconds a point, in one run; the size of the one header.

    python benchmarks/c_header.py [--quick] [--write]

Points are spread evenly in ln v~ and ln y~ over 1e-3 to 1e3, in random order.
"""

from tests.support.measuring import best_of, main, markdown, progress, quantity
from tests.support.places import ROOT

# isort: split

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from builder.export.c import write_c
from mumacro import Surrogate

DRIVER = ROOT / "tests" / "builder" / "export" / "c" / "driver.c"
OPTIONS = ("-O2", "-O3 -march=native", "-O3 -march=native -ffp-contract=off")


def c_header(quick: bool) -> str:
    """The library, and the export by every compiler with every set of options."""
    n, rounds = (20_000, 2) if quick else (500_000, 7)
    surrogate = Surrogate.open(ROOT / "tables" / "mumacro-1e-10.nc", threads=1)
    v, y = 10.0 ** np.random.default_rng(11).uniform(-3.0, 3.0, (2, n))
    at, beside, out = (
        a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (v, y, np.empty(n))
    )
    work: dict[str, Callable[[], object]] = {"the library": lambda: surrogate.mu_ratio(v, y)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_c(surrogate.table, folder)
        sources: list[str | Path] = [
            DRIVER,
            folder / "mumacro.c",
            folder / "mumacro_table.c",
            f"-I{folder}",
        ]
        for compiler in [*filter(shutil.which, ("gcc", "clang"))][: 1 if quick else None]:
            for options in OPTIONS[:1] if quick else OPTIONS:
                progress(row := f"`{compiler} {options}`")
                shared_object = folder / f"driver{len(work)}.so"
                words = [
                    compiler,
                    *options.split(),
                    "-shared",
                    "-fPIC",
                    *sources,
                    "-o",
                    shared_object,
                    "-lm",
                ]
                subprocess.run(words, check=True)
                library = ctypes.CDLL(str(shared_object))
                work[row] = partial(library.ratio_array, at, beside, n, out)
                work[f"{row}, call by call"] = partial(library.ratios, at, beside, n, out)
        best = best_of(rounds, work)
    rows = [[name, quantity(1e9 * seconds / n)] for name, seconds in best.items()]
    return markdown(("evaluator", "ns/point"), rows)


def header_sizes(quick: bool) -> str:
    """The size of the one header with each bundled table."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for tolerance in (1e-4,) if quick else (1e-4, 1e-7, 1e-10, 1e-12):
            path = Path(name) / "mumacro.h"
            write_c(Surrogate.open(tolerance).table, path)
            rows.append([f"{tolerance:g}", quantity(path.stat().st_size / 1e6)])
    return markdown(("table", "MB"), rows)


if __name__ == "__main__":
    main(__doc__, {"c_header": c_header, "header_sizes": header_sizes}, quick=False)
