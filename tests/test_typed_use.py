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
    rest = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
    solution: Solution = solve_for(surrogate, "v0", 0.25, rest)
    roots: tuple[Root, ...] = solution.roots[0]
    crossings = border_crossings(surrogate, "v0", rest, 0.0, 1.0)
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
    shown = {test.name for name in MODULES for test in doctest.DocTestFinder().find(importlib.import_module(name))
             if test.examples}  # fmt: skip
    used = {"answer.Answer", "bundled.bundled_tables", "settling.settling", "fitting.fit", "element.Element"}
    used |= {f"surrogate.Surrogate.{name}" for name in ("evaluate", "mu_ratio", "open", "slopes")}
    assert {f"mumacro.{name}" for name in used} <= shown


def checked(program: Path, repository: Path, cache: Path) -> "subprocess.CompletedProcess[str]":
    """What the strict checker says."""
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(repository / "pyproject.toml"),
               "--cache-dir", str(cache), str(program)]  # fmt: skip
    return subprocess.run(command, cwd=repository, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.slow
def test_a_typed_program_passes_the_strict_checker_and_runs_and_a_wrong_one_does_not(
    tmp_path: Path, repository: Path
) -> None:
    right, wrong = tmp_path / "shaken.py", tmp_path / "wrong.py"
    right.write_text(PROGRAM)
    wrong.write_text("from mumacro import Surrogate\n\nSurrogate.open().mu_rato(0.1, 0.5)\nSurrogate.open([1])\n")
    done = checked(right, repository, tmp_path / "cache")
    assert done.returncode == 0, done.stdout + done.stderr
    found = checked(wrong, repository, tmp_path / "cache")
    assert found.returncode == 1
    assert all(told in found.stdout for told in ("mu_rato", "arg-type"))
    done = subprocess.run([sys.executable, str(right)], cwd=repository, capture_output=True, text=True,
                          env={"PYTHONPATH": str(repository), "PATH": ""}, timeout=300, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("0.240012 stick_slip ")
