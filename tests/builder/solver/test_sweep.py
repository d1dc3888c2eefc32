"""Many solves at once: the same numbers for any division of the work, and no missing points."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mumacro
from builder.solver import compiled
from builder.solver import sweep as module
from builder.solver.slip import NO_STICK
from builder.solver.steady import ADVICE, border, solve
from builder.solver.sweep import CHUNK, COLUMNS, SolveError, Sweep, solve_chunk
from mumacro import InputError


def points(n: int) -> tuple[Any, Any]:
    rng = np.random.default_rng(1)
    return 10.0 ** rng.uniform(-3.0, 3.0, n), 10.0 ** rng.uniform(-3.0, 3.0, n)


def test_values_do_not_depend_on_workers_or_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    v, y = points(3 * CHUNK + 17)
    with Sweep(1) as one, Sweep(4) as four:
        expected = one.solve("full", v, y)
        solved = four.solve("full", v, y)
    monkeypatch.setattr(module, "CHUNK", 7)
    with Sweep(2) as small:
        again = small.solve("full", v, y)
    for name in COLUMNS:
        assert np.array_equal(solved[name], expected[name])
        assert np.array_equal(again[name], expected[name])


def test_every_kind_equals_a_single_solve_in_every_shape() -> None:
    v, y = points(40)
    eta = np.where(np.arange(40) == 3, 1e-18, y - 1.0)
    v[3], y[3] = 1e-27, 1.0  # y~ - 1 that y~ does not hold
    with Sweep(2) as sweep:
        full = sweep.solve("full", v.reshape(4, 10), y.reshape(4, 10), eta.reshape(4, 10))
        crit = sweep.solve("border", np.ones((1, 1)), y)
        assert sweep.n_solves == 80
        assert crit["mu_ratio"].shape == (1, 40)
        assert sweep.solve("full", np.empty(0), np.empty(0))["mu_ratio"].shape == (0,)
        assert full["mu_ratio"][0, 3] < 0.8 * sweep.solve("full", v[3], y[3])["mu_ratio"]
    for i in range(40):
        single, row, column = solve(v[i], y[i], eta[i]), *divmod(i, 10)
        for name in ("mu_ratio", "deficit", "stick_fraction", "power", "error_estimate"):
            assert full[name][row, column] == getattr(single, name)
        assert (crit["deficit"][0, i], crit["mu_ratio"][0, i]) == border(y[i])


def test_a_point_out_of_range_is_named() -> None:
    with Sweep(1) as sweep, pytest.raises(InputError) as caught:
        sweep.solve("full", np.array([0.1, -1.0, math.nan]), np.array([0.5, 0.5, 0.5]))
    assert (caught.value.field, caught.value.value, caught.value.index) == ("v_tilde", -1.0, 1)
    assert sweep.n_solves == 0


def test_a_point_that_fails_is_named_with_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(kind: str, points: Any) -> Any:
        out = solve_chunk(kind, points)
        out[1:, -1] = NO_STICK
        return out

    monkeypatch.setattr(module, "solve_chunk", fails)
    with Sweep(1) as sweep, pytest.raises(SolveError) as caught:
        sweep.solve("full", np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.5, 0.5]))
    assert str(caught.value) == f"2 of 3 points failed, first v~=0.2, y~=0.5: {ADVICE[NO_STICK]}"


def test_compiled_functions_are_kept_until_a_source_or_the_compiler_changes(tmp_path: Path) -> None:
    """Also a function whose own module stays the same, while one that it calls changes."""
    for package in (Path(compiled.__file__).parents[1], Path(mumacro.__file__).parent):
        shutil.copytree(package, tmp_path / package.name)
    solver = tmp_path / "builder" / "solver"
    calls = "from .compiled import solver_kernel\n"
    inner = calls + "@solver_kernel\ndef inner(x):\n    return {} * x\n"
    outer = calls + "from .inner import inner\n@solver_kernel\ndef outer(x):\n    return inner(x)\n"
    (solver / "inner.py").write_text(inner.format(2))
    (solver / "outer.py").write_text(outer)

    def result(before: str = "") -> tuple[float, int]:
        """What the function gives, and how many functions have been kept."""
        done = subprocess.run(
            [
                *(sys.executable, "-c"),
                f"{before}\nfrom builder.solver.outer import outer; print(outer(1.0))",
            ],
            cwd=tmp_path,
            # Python takes a source of the same size and second for the one that it has compiled
            env={
                **os.environ,
                "NUMBA_CACHE_DIR": str(tmp_path / "store"),
                "PYTHONPATH": str(tmp_path),
                "PYTHONDONTWRITEBYTECODE": "1",
            },
            capture_output=True,
            text=True,
            check=True,
        )
        return float(done.stdout), len([*(tmp_path / "store").rglob("*.nbc")])

    value, count = result()
    assert (value, result()) == (2.0, (2.0, count))
    (solver / "inner.py").write_text(inner.format(3))
    assert result() == (3.0, 2 * count)
    for times, source in enumerate(("mumacro/folder/module.py", "mumacro/kernel/header.h"), 3):
        (tmp_path / source).parent.mkdir(exist_ok=True)
        (tmp_path / source).touch()
        assert result() == (3.0, times * count)
    assert result("import numba; numba.__version__ = '0.0.0'") == (3.0, 5 * count)


def test_the_solver_runs_where_nothing_can_be_kept(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    script = "from builder.solver.sections import border_guess; print(border_guess(1.0))"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "file" / "store")}
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=Path(compiled.__file__).parents[2],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(done.stdout) > 0.0
