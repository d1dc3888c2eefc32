"""What is measured and built as processors without AVX-512 and without AVX2 see it.

NumPy, OpenBLAS, LLVM and the compiled kernel choose other instructions there, and last digits
differ.  The levels of the kernel are also compared with each other in test_cells.py, beside this
file, and in tests/builder/export/test_c_header.py.
"""

import importlib
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from builder.tables.draws import DRAWS
from mumacro import Surrogate
from mumacro.table.atlas import QUANTITY_NAMES
from tests.support.cases import opened
from tests.support.nightly import nightly
from tests.support.places import ROOT

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        platform.machine().lower() not in ("x86_64", "amd64"),
        reason="no x86 processor: its levels are not there",
    ),
]

#: beginnings of the features of NumPy that are switched off, and what OpenBLAS and numba are told
PROCESSORS = {
    "AVX2": ("X86_V4", "AVX512"),
    "neither AVX2 nor AVX-512": ("X86_V3", "AVX2", "FMA3", "X86_V4", "AVX512"),
}
#: the one that differs most, and what lies between it and this one
OLDEST_FIRST = ["neither AVX2 nor AVX-512", nightly("AVX2")]
OTHERS = {
    "AVX2": {"OPENBLAS_CORETYPE": "Haswell", "NUMBA_CPU_NAME": "haswell"},
    "neither AVX2 nor AVX-512": {"OPENBLAS_CORETYPE": "Nehalem", "NUMBA_CPU_NAME": "x86-64"},
}
#: the levels of the kernel that such a processor can run
LEVELS = {"AVX2": "base avx2", "neither AVX2 nor AVX-512": "base"}
#: the program that is started: other levels are taken away before mumacro looks for the best, so
#: that an empty package stands for it at first.  Of the builder's last fresh solves, which the test
#: of what a table states repeats there, few are made
_START = """
import importlib, runpy, sys, types
levels, module, *words = sys.argv[1:]
empty = sys.modules["mumacro"] = types.ModuleType("mumacro")
empty.__path__ = ["src/mumacro"]
kernels = importlib.import_module("mumacro.kernel.binding").kernels
kernels[:] = [kernel for kernel in kernels if kernel.level in levels.split()]
del sys.modules["mumacro"]
assert importlib.import_module("mumacro.outputs.tabulated")._KERNEL is kernels[-1]
if module == "builder":
    importlib.import_module("builder.tables.build").FINAL_POINTS = 500
sys.argv = [module, *words]
runpy.run_module(module, run_name="__main__", alter_sys=True)
"""
_SHOW = (
    "from numpy._core._multiarray_umath import __cpu_features__ as f; print(*(k for k, v in "
    "f.items() if v))"
)


def at_level(processor: str, module: str, *words: str) -> str:
    """What ``python -m`` with these words prints there, with the kernel of that processor."""
    return on(processor, "-c", _START, LEVELS[processor], module, *words)


def on(processor: str, *words: str) -> str:
    """What ``python`` with these words prints there; it must end well."""
    features = importlib.import_module("numpy._core._multiarray_umath").__cpu_dispatch__
    off = [name for name in features if name.startswith(PROCESSORS[processor])]
    switches = {
        "NPY_DISABLE_CPU_FEATURES": " ".join(off),
        "NUMBA_CPU_FEATURES": "",
        **OTHERS[processor],
    }
    env = {**os.environ, **switches}
    done = subprocess.run(
        [sys.executable, *words],
        cwd=ROOT,
        env=env,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


@pytest.mark.parametrize("processor", PROCESSORS)
def test_the_switches_work(processor: str) -> None:
    have = on(processor, "-c", _SHOW).split()
    assert "X86_V2" in have or "SSE42" in have
    assert not {"X86_V4", "AVX512_SKX"} & {*have}
    assert processor == "AVX2" or not {"X86_V3", "FMA3_AVX2"} & {*have}


@pytest.mark.parametrize("processor", OLDEST_FIRST)
def test_what_a_table_states_is_measured_there_too(processor: str) -> None:
    at_level(
        processor,
        "pytest",
        "-q",
        "-n",
        "0",
        "-m",
        "",
        "tests/builder/tables/test_verify.py",
        "-k",
        "stated or states",
    )


@pytest.mark.parametrize("processor", OLDEST_FIRST)
def test_a_table_that_is_built_there_differs_within_what_both_state(
    processor: str, tmp_path: Path
) -> None:
    out = tmp_path / "other.nc"
    at_level(
        processor,
        "builder",
        "build",
        "--tolerance",
        "1e-4",
        "--workers",
        "2",
        "--out",
        str(out),
    )
    here, there = opened(1e-4), Surrogate.open(out)
    assert there.tolerance == here.tolerance
    for case in DRAWS["spring"].cases:
        v, y = DRAWS["spring"].draw(case, 2000, here, seed=5)
        for name in QUANTITY_NAMES:
            (one, of_one, _), (two, of_two, _) = (
                table.quantity(name, v, y) for table in (here, there)
            )
            assert np.all(np.abs(one - two) <= of_one + of_two), (case, name)
