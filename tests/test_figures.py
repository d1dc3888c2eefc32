"""The figures, of cycles and of the paper: drawn by one command, equal to the committed ones, small files."""

import doctest
import json
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from builder import cycle
from builder.cycle import CASES, steady_cycle
from builder.figures import FIGURES, FiguresError, draw_figures
from comparing import close

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def drawn(run_builder, tmp_path_factory) -> Path:
    """A folder with all figures."""
    folder = tmp_path_factory.mktemp("figures")
    done = run_builder("figures", "--out", folder)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["figures"] == [str(folder / f"{name}.png") for name in FIGURES]
    return folder


@pytest.mark.parametrize("name", FIGURES)
def test_the_committed_figure_is_the_one_that_is_drawn(drawn, repository, name) -> None:
    committed = repository / "docs" / "figures" / f"{name}.png"
    assert committed.stat().st_size < 120_000
    ours, theirs = (matplotlib.image.imread(path)[..., :3] for path in (drawn / committed.name, committed))
    assert ours.shape == theirs.shape
    # other versions of fonts and of the drawing library move edges by one pixel at most
    assert float(np.abs(ours - theirs).mean()) < 0.02


def test_without_matplotlib_the_extra_is_named(surrogate, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(FiguresError, match="extra 'figures'"):
        draw_figures(surrogate, tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("v", "y"), CASES)
def test_the_cycle_that_is_drawn_is_the_steady_one(surrogate, v, y) -> None:
    tau, u, sticks = steady_cycle(v, y)
    assert tau[-1] == close(2.0 * np.pi, rel=1e-14)
    assert np.hypot(*u.T).max() <= 1.0 + 1e-12
    assert u[:, 0].mean() == close(surrogate.mu_ratio(v, y), abs=1e-6)
    assert sticks.mean() == close(surrogate.stick_fraction(v, y), abs=5e-4)
    # half a period later the same, mirrored
    half = tau.size // 2
    assert np.abs(u[:half] * (1.0, -1.0) - u[half:]).max() < 1e-6


def test_the_example_runs() -> None:
    assert doctest.testmod(cycle).failed == 0
