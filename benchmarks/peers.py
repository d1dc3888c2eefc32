"""What speed against error is measured with: interpolators on plain grids, points, and pictures."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator

from mumacro.plotting import save

Array = NDArray[np.float64]
Evaluate = Callable[[Array, Array], Array]
# what a method is called, and its (largest error, ns a point)
Line = tuple[str, list[tuple[float, float]]]
SQUARE = (1e-3, 1e3)  # of v~ and of y~
LINEAR, CUBIC, SPLINE = (
    "scipy RegularGridInterpolator linear",
    "scipy map_coordinates order 3",
    "scipy RectBivariateSpline.ev k=3",
)
ERROR = r"error of $\tilde\mu$ over $\tilde v$, $\tilde y$ from 0.001 to 1000"
BETTER = "lower left is better"


class Contender(NamedTuple):
    """One method for mu~: ``evaluate(v~, y~)``, the size of its data, the solved numbers that it is
    made of, and their bytes in memory."""

    name: str
    size: str
    evaluate: Evaluate
    solves: int = 0
    memory: int = 0


def grid_axis(n: int) -> Array:
    return np.geomspace(*SQUARE, n)


def _map_coordinates(x: Array, values: Array, order: Literal[1, 3]) -> Evaluate:
    filtered: Array = (
        ndimage.spline_filter(values, order=order, mode="nearest") if order > 1 else values
    )
    start, scale = x[0], 1.0 / (x[1] - x[0])

    def evaluate(v: Array, y: Array) -> Array:
        at = np.empty((2, v.size))
        np.log(v, out=at[0])
        np.log(y, out=at[1])
        at -= start
        at *= scale
        out: Array = ndimage.map_coordinates(
            filtered, at, order=order, mode="nearest", prefilter=False
        )
        return out

    return evaluate


def on_grid(values: Array) -> Iterator[Contender]:
    """Interpolators on the plain grid that ``values`` (n, n) were solved on.

    Others of scipy and xarray give the errors of these, for they interpolate alike, and take
    longer.
    """
    n = values.shape[0]
    x = np.log(grid_axis(n))
    linear, cubic = RegularGridInterpolator((x, x), values), RectBivariateSpline(x, x, values)
    methods: dict[str, Evaluate] = {
        LINEAR: lambda v, y: np.asarray(linear(np.log(np.stack((v, y), axis=1)))),
        SPLINE: lambda v, y: np.asarray(cubic.ev(np.log(v), np.log(y))),
        "scipy map_coordinates order 1": _map_coordinates(x, values, 1),
        CUBIC: _map_coordinates(x, values, 3),
    }
    for name, evaluate in methods.items():
        yield Contender(name, f"{n} x {n}", evaluate, n * n, 8 * n * n)


def draw(n: int, seed: int) -> Array:
    low, high = np.log(SQUARE)
    return np.exp(np.random.default_rng(seed).uniform(low, high, (2, n)))


def plot(lines: list[Line], path: Path) -> None:
    """The picture of all methods: ns a point against the largest error, one line a method."""
    colors = ("#c1272d", "#1f5fa8", "#2a8c8c", "#8a8a8a", "#b07aa1", "#e08214", "#222222")

    def drawn(axes: Any) -> None:
        for (name, points), color in zip(lines, colors, strict=True):
            axes.plot(*zip(*points, strict=True), "o-", label=name, color=color, lw=1.5)
        axes.set(xlabel=ERROR, ylabel="ns per point, one thread")
        logarithmic(axes)
        axes.set_ylim(bottom=7.0)
        axes.legend(fontsize=9, loc="upper left")

    save(path, drawn, dpi=100, figsize=(9.5, 5.0))


def logarithmic(axes: Any) -> None:
    """Both scales, and which way is better."""
    axes.set(xscale="log", yscale="log")
    axes.minorticks_off()
    axes.annotate(
        BETTER,
        (0.01, 0.015),
        (0.1, 0.06),
        xycoords="axes fraction",
        textcoords="axes fraction",
        arrowprops={"arrowstyle": "->", "color": "#555555"},
        color="#555555",
        style="italic",
        fontsize=9,
    )
