"""The documentation is correct: examples of docstrings run, and a user's typed program passes the checker."""

import doctest
import importlib
import importlib.util
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import mumacro

LEFT_OUT = {"mumacro.__main__", "mumacro._kernel"}  # the second is no module of Python
for package in ("jax", "torch"):  # hundreds of megabytes, needed only by their own tests
    if importlib.util.find_spec(package) is None:
        LEFT_OUT.add(f"mumacro.{package}")
MODULES = sorted(
    {"mumacro", *(module.name for module in pkgutil.walk_packages(mumacro.__path__, "mumacro."))} - LEFT_OUT
)

PROGRAM = '''
"""What friction will I feel if I shake this contact sideways?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import mumacro
from mumacro import Answer, InputError, MumacroError, Surrogate, TableError
from mumacro.inverse import Root, Solution, border_crossings, solve_for


def shaken(surrogate: Surrogate, v0: float | NDArray[np.float64]) -> Answer:
    return surrogate.evaluate(mu0=0.3, Fz=10, k=1e6, y0=2e-6, omega=1.3e5, v0=v0, gradient=True)


def report(path: str | None) -> str:
    try:
        surrogate = Surrogate.open(path, threads=1)
        answer = shaken(surrogate, np.array([0.0, 0.01]))
    except (InputError, TableError) as error:
        assert isinstance(error, MumacroError)
        return str(error)
    one = shaken(surrogate, 0.01)
    slope = one.gradient["v0"] if one.gradient is not None else 0.0
    rigid = surrogate.evaluate(mu0=0.3, Fz=10, k=None, y0=2e-6, f=2e4, v0=0.01)
    dimensionless: float = surrogate.mu_ratio(0.1, 0.5)
    power, bound = surrogate.power_with_bound(0.1, 0.5)
    solution: Solution = solve_for(
        surrogate, "v0", 0.25, {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
    )
    roots: tuple[Root, ...] = solution.roots[0]
    crossings = border_crossings(
        surrogate, "v0", {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}, 0.0, 1.0
    )
    shown = [f"{one.mu_macro:.6f}", one.regime, mumacro.SOURCES[one.source_code], slope, rigid.mu_macro, dimensionless]
    return " ".join(map(str, [*shown, power, bound, roots[0].value, crossings[0].value, answer.mu_macro.shape]))


print(report(None))
'''


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name: str) -> None:
    module = importlib.import_module(name)
    found = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE, raise_on_error=False)
    assert found.failed == 0


def test_there_are_examples() -> None:
    finder = doctest.DocTestFinder(exclude_empty=True)
    shown = {
        test.name for name in MODULES for test in finder.find(importlib.import_module(name)) if test.examples
    }  # fmt: skip
    assert {
        "mumacro.answer.Answer", "mumacro.surrogate.Surrogate.evaluate", "mumacro.surrogate.Surrogate.mu_ratio",
        "mumacro.surrogate.Surrogate.open", "mumacro.surrogate.Surrogate.slopes", "mumacro.bundled.bundled_tables",
    } <= shown  # fmt: skip


@pytest.mark.slow
def test_a_typed_program_passes_the_strict_checker_and_runs(tmp_path: Path, repository: Path) -> None:
    program = tmp_path / "shaken.py"
    program.write_text(PROGRAM)
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(repository / "pyproject.toml"),
               "--cache-dir", str(tmp_path / "cache"), str(program)]  # fmt: skip
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    done = subprocess.run([sys.executable, str(program)], cwd=repository, capture_output=True, text=True,
                          env={"PYTHONPATH": str(repository), "PATH": ""}, timeout=300, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("0.240012 stick_slip ")


@pytest.mark.slow
def test_a_program_with_a_wrong_name_does_not_pass(tmp_path: Path, repository: Path) -> None:
    program = tmp_path / "wrong.py"
    program.write_text("from mumacro import Surrogate\n\nSurrogate.open().mu_rato(0.1, 0.5)\nSurrogate.open([1])\n")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), str(program)]
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 1
    assert "mu_rato" in done.stdout
    assert "arg-type" in done.stdout
