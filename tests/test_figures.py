"""The paper's figures: drawn by one command, the committed ones among them, small enough for a page."""

import json
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from builder.figures import FIGURES, FiguresError, draw_figures


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
    # other versions of fonts and of the drawing library move edges by a pixel, nothing else
    assert float(np.abs(ours - theirs).mean()) < 0.02


def test_without_matplotlib_the_extra_is_named(surrogate, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(FiguresError, match="extra 'figures'"):
        draw_figures(surrogate, tmp_path)
    assert list(tmp_path.iterdir()) == []
