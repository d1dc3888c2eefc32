"""Peers: common interpolators with the same solved values on plain log-log grids.

Every contender takes v~ and y~ and includes the time of the two logarithms, as the table does.
"""

import tempfile
from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator, make_interp_spline

import builder
from builder.sweep import Sweep

Array = NDArray[np.float64]
Evaluate = Callable[[Array, Array], Array]

SQUARE = (1e-3, 1e3)  # of v~ and of y~


class Contender(NamedTuple):
    """One method for mu~: ``evaluate(v~, y~)``, the size of its data, and the solves to build them."""

    name: str
    size: str
    evaluate: Evaluate
    solves: int = 0


def cache() -> Path:
    """Cache folder outside the source tree for solved grids; its name depends on the solver's source."""
    names = ("model", "radau", "sections", "series", "steady", "stick", "sweep")
    digest = sha256(b"".join(Path(builder.__file__).with_name(f"{name}.py").read_bytes() for name in names))
    path = Path(tempfile.gettempdir()) / f"mumacro-benchmarks-{digest.hexdigest()[:16]}"
    path.mkdir(exist_ok=True)
    return path


def grid_axis(n: int) -> Array:
    return np.geomspace(*SQUARE, n)


def solve_grid(sweep: Sweep, n: int) -> Array:
    """mu~ on the plain grid of ``n`` x ``n`` nodes, axis 0 along v~."""
    axis = grid_axis(n)
    return sweep.solve("full", axis[:, None], axis[None, :])["mu_ratio"]


def _map_coordinates(x: Array, values: Array, order: Literal[1, 3]) -> Evaluate:
    filtered: Array = ndimage.spline_filter(values, order=order, mode="nearest") if order > 1 else values
    start, scale = x[0], 1.0 / (x[1] - x[0])

    def evaluate(v: Array, y: Array) -> Array:
        at = np.empty((2, v.size))
        np.log(v, out=at[0])
        np.log(y, out=at[1])
        at -= start
        at *= scale
        out: Array = ndimage.map_coordinates(filtered, at, order=order, mode="nearest", prefilter=False)
        return out

    return evaluate


def on_grid(values: Array) -> Iterator[Contender]:
    """Interpolators on the plain grid that ``values`` (n, n) were solved on.

    Others of scipy and xarray give the errors of these, for they interpolate alike, and take longer.
    """
    n = values.shape[0]
    x = np.log(grid_axis(n))
    linear, cubic = RegularGridInterpolator((x, x), values), RectBivariateSpline(x, x, values)
    methods: dict[str, Evaluate] = {
        "scipy RegularGridInterpolator linear": lambda v, y: np.asarray(linear(np.log(np.stack((v, y), axis=1)))),
        "scipy RectBivariateSpline.ev k=3": lambda v, y: np.asarray(cubic.ev(np.log(v), np.log(y))),
        "scipy map_coordinates order 1": _map_coordinates(x, values, 1),
        "scipy map_coordinates order 3": _map_coordinates(x, values, 3),
    }
    for name, evaluate in methods.items():
        yield Contender(name, f"{n} x {n}", evaluate, n * n)


def fitted_to_the_border(sweep: Sweep, n: int) -> Contender:
    """What an engineer would build who knows of the border: one quintic patch on each side, ``n`` x ``n`` nodes each.

    Along ln y~, and along ln v~ as the share of the way to the border, which is a quintic spline of 4 n nodes.  The
    corner v~ -> 0, y~ = 1, where three scales meet, gets no coordinate of its own.
    """
    low, high = SQUARE
    fine = np.geomspace(low, high, 4 * n)
    border = make_interp_spline(np.log(fine), np.log(sweep.solve("border", np.ones_like(fine), fine)["deficit"]), k=5)
    first = float(np.interp(low, np.exp(border(np.log(fine))), fine))  # the amplitude whose border is at the least v~
    share = np.linspace(0.0, 1.0, n)

    def patch(axis: Array, end: float, kind: str) -> RectBivariateSpline:
        crit = border(axis)
        v = np.exp(crit + np.outer(share, np.log(end) - crit))
        values = sweep.solve(kind, v, np.broadcast_to(np.exp(axis), v.shape))["mu_ratio"]
        return RectBivariateSpline(axis, share, values.T, kx=5, ky=5)

    ends = 0.25 * low, 2.0 * high  # beyond the square, so that the shares have no singular end
    stick = patch(np.linspace(np.log(first), np.log(high), n), ends[0], "full")
    slide = patch(np.linspace(np.log(low), np.log(high), n), ends[1], "continuous")

    def evaluate(v: Array, y: Array) -> Array:
        x, at = np.log(y), np.log(v)
        crit, out = border(x), np.empty(v.size)
        for spline, end, inside in ((stick, ends[0], at < crit), (slide, ends[1], at >= crit)):
            way = (at[inside] - crit[inside]) / (np.log(end) - crit[inside])
            out[inside] = spline.ev(x[inside], way)
        return out

    return Contender("two quintic patches fitted to the border", f"2 x {n} x {n}", evaluate, 2 * n * n + 4 * n)
