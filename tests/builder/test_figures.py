"""The figures, of cycles and of the paper: what they show compared with known values, and drawn by
one command."""

import doctest
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from builder import figures
from builder.__main__ import main
from builder.figures import CASES, FIGURES, Curve, Panel, draw_figures, steady_cycle
from builder.solver.steady import border, solve
from mumacro import MumacroError, Surrogate
from tests.support.comparing import close

pytestmark = pytest.mark.slow
Shown = dict[str, list[Panel]]  # by figure
#: of the figures whose lines are mu~ at these y~, over v~ times the scale
AMPLITUDES: dict[str, tuple[Any, Callable[..., Any]]] = {
    "fig08_cuts": (np.arange(21) * 0.1, lambda _: 1.0),
    "fig10_large_amplitude": (np.arange(1, 101) * 0.8, lambda y: y),
}


@pytest.fixture(scope="module")
def shown(surrogate: Surrogate) -> Shown:
    """What every figure shows."""
    return {name: panels(surrogate) for name, panels in FIGURES.items()}


def labelled(panel: Panel, part: str) -> Curve:
    (result,) = [curve for curve in panel.curves if part in curve.label]
    return result


LENGTH, OMEGA = 1e-6, 2.0 * np.pi * 20e3
MU = Surrogate.open().mu_ratio
#: figure, the start or a part of a curve's label, what it shows as a function of x, relative and
#: absolute tolerance
SHOWN: list[tuple[str, str, Callable[[Any], Any], float, float]] = [
    *(
        (name, label, lambda y: [border(at)[0] for at in y], 1e-11, 0.0)
        for name, label in (
            ("fig04_regions", "border, exact"),
            ("fig05_border_small_amplitude", "exact, solved"),
            ("fig06_border", "exact, solved"),
        )
    ),
    ("fig04_regions", "(20)", lambda y: np.sqrt(y * y - 1.0), 1e-6, 1e-9),
    (
        "fig05_border_small_amplitude",
        "(24)",
        lambda y: np.sqrt(0.25 + 0.5 * y * y) - 0.5,
        1e-6,
        1e-9,
    ),
    ("fig06_border", "(26)", lambda y: np.sqrt(y / 4.5), 1e-6, 1e-9),
    (
        "fig09_master_curve",
        "(28)",
        lambda x: 1.0 - 0.75 * (x - 1.0) ** 2 - 0.25 * (x - 1.0) ** 4,
        1e-6,
        1e-9,
    ),
    # the limit of large amplitude, to O(1/y~)
    (
        "fig10_large_amplitude",
        "(35)",
        lambda x: [solve(1e6 * at, 1e6).mu_ratio for at in x],
        0.0,
        1e-5,
    ),
    (
        "fig11_friction_law",
        "= 0.6 $l_0",
        lambda v0: 0.5 * MU(v0 / (LENGTH * OMEGA), 0.6),
        1e-9,
        0.0,
    ),
    ("fig11_friction_law", "= 4 $l_0", lambda v0: 0.5 * MU(v0 / (LENGTH * OMEGA), 4.0), 1e-9, 0.0),
]


@pytest.mark.parametrize(("name", "label", "law", "rel", "within"), SHOWN)
def test_a_curve_is_as_its_label_says(
    shown: Shown, name: str, label: str, law: Any, rel: float, within: float
) -> None:
    curve = next(curve for curve in shown[name][0].curves if label in curve.label)
    at = np.flatnonzero(curve.x > 0.0)[:: max(1, curve.x.size // 40)]
    assert curve.y[at] == close(np.asarray(law(curve.x[at])), rel=rel, abs=within)


def test_the_surface_is_the_models(shown: Shown) -> None:
    surface = shown["fig07_surface"][0].curves[0]
    assert surface.z is not None
    for i, j in ((1, 1), (20, 120), (90, 60), (180, 240), (60, 200)):
        assert surface.z[j, i] == close(solve(surface.x[i], surface.y[j]).mu_ratio, abs=1e-11)
    line = shown["fig07_surface"][0].curves[1]  # y~ over v~, as every map
    at = np.flatnonzero(line.y > 0.0)[::10]
    assert line.x[at] == close([border(y)[0] for y in line.y[at]], rel=1e-11)


@pytest.mark.parametrize("name", AMPLITUDES)
def test_lines_of_constant_amplitude_are_the_models(shown: Shown, name: str) -> None:
    amplitudes, scale = AMPLITUDES[name]
    (panel,) = shown[name]
    for y, curve in zip(amplitudes, panel.curves, strict=False):
        result = [solve(x * scale(y), y).mu_ratio if y else 1.0 for x in curve.x[[1, 200, 400]]]
        assert curve.y[[1, 200, 400]] == close(result, abs=1e-11)
    top = labelled(panel, "border")
    at = [border(y) for y in amplitudes if y]
    for x, mu in zip(top.x, top.y, strict=True):
        scaled = [
            (crit / scale(y), of)
            for (crit, of), y in zip(at, amplitudes[amplitudes > 0.0], strict=True)
        ]
        assert (x, mu) == close(
            min(scaled, key=lambda end: abs(end[0] - x) + abs(end[1] - mu)), rel=1e-14
        )


def test_the_master_curve_rises_from_zero_to_one_at_the_border(shown: Shown) -> None:
    (panel,) = shown["fig09_master_curve"]
    for y, curve in zip(np.arange(1, 10) * 0.1, panel.curves, strict=False):
        (crit, top), low = border(y), np.sqrt(1.0 - y * y)
        result = [
            (solve(x * crit, y).mu_ratio - low) / (top - low) for x in curve.x[[100, 300, 600]]
        ]
        assert curve.y[[0, 100, 300, 600]] == close([0.0, *result], abs=1e-7)
    limit, first = labelled(panel, "N_0"), panel.curves[0]
    assert limit.y[[0, -1]] == close([0.0, 1.0], abs=1e-12)
    assert np.abs(np.interp(limit.x, first.x, first.y) - limit.y).max() < 0.01


def test_marks_are_at_the_border_and_at_rest(shown: Shown) -> None:
    (panel,) = shown["fig11_friction_law"]
    crit, top = border(0.6)
    mark = labelled(panel, "border")
    assert (mark.x[0], mark.y[0]) == close((crit * LENGTH * OMEGA, 0.5 * top), rel=1e-9)
    assert labelled(panel, "static").y[0] == close(0.4, rel=1e-12)
    static = labelled(shown["fig08_cuts"][0], "static")
    assert static.y == close(np.sqrt(1.0 - (np.arange(11) * 0.1) ** 2), abs=1e-7)
    assert not static.x.any()


@pytest.mark.parametrize(("v", "y"), CASES)
def test_the_drawn_cycle_is_the_steady_one(
    surrogate: Surrogate, shown: Shown, v: float, y: float
) -> None:
    tau, u, sticks = steady_cycle(v, y)
    assert tau[-1] == close(2.0 * np.pi, rel=1e-14)
    assert np.hypot(*u.T).max() <= 1.0 + 1e-12
    assert u[:, 0].mean() == close(surrogate.mu_ratio(v, y), abs=1e-6)
    assert sticks.mean() == close(surrogate.stick_fraction(v, y), abs=5e-4)
    # half a period later the same, mirrored
    half = tau.size // 2
    assert np.abs(u[:half] * (1.0, -1.0) - u[half:]).max() < 1e-6
    place = list(CASES).index((v, y))
    disc, trace = shown["cycle"][place], shown["cycle"][place + 3]
    assert [labelled(trace, part).y.tolist() for part in ("along", "across")] == u.T.tolist()
    at = np.where(sticks, labelled(disc, "stick").x, labelled(disc, "slip").x)
    assert np.array_equal(at, u[:, 0])
    assert np.array_equal(np.isfinite(labelled(trace, "stick").y), sticks)


def test_all_are_drawn_by_one_command(capsys: Any, repository: Path, tmp_path: Path) -> None:
    folder = tmp_path / "made"
    assert main(["figures", "--out", str(folder)]) == 0
    assert json.loads(capsys.readouterr().out)["figures"] == [
        str(folder / f"{name}.png") for name in FIGURES
    ]
    for name in FIGURES:  # what they show is compared above
        drawn, committed = (
            place / f"{name}.png" for place in (folder, repository / "docs" / "figures")
        )
        assert matplotlib.image.imread(drawn).shape == matplotlib.image.imread(committed).shape
        assert committed.stat().st_size < 120_000


def test_without_matplotlib_the_extra_is_named(
    surrogate: Surrogate, tmp_path: Any, monkeypatch: Any
) -> None:
    loaded = [name for name in sys.modules if name.startswith("matplotlib.")]  # by another test
    for name in ("matplotlib", *loaded):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MumacroError, match="extra 'figures'"):
        draw_figures(surrogate, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_example_runs() -> None:
    assert doctest.testmod(figures).failed == 0
