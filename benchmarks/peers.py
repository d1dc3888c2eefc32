"""Peers: common interpolators with the same solved values on plain log-log grids.

Every contender takes v~ and y~ and includes the time of the two logarithms, as the table does.  Packages that are not
installed are named in :data:`MISSING` with the command that installs them, and the comparison continues without them.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from hashlib import sha256
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from measuring import best_of
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import NdBSpline, RectBivariateSpline, RegularGridInterpolator, interpn, make_interp_spline
from scipy.sparse.linalg import spsolve

import builder
from builder import steady
from builder.sweep import Sweep

__all__ = ["MISSING", "SQUARE", "Contender", "adaptive", "cache", "grid_axis", "on_grid", "solve_grid", "yardstick"]

Array = NDArray[np.float64]
Evaluate = Callable[[Array, Array], Array]

SQUARE = (1e-3, 1e3)  # of v~ and of y~
SPSOLVE_LIMIT = 256  # nodes a side; with more, the sparse factorisation takes minutes and gigabytes
MISSING: dict[str, str] = {}


@dataclass(frozen=True)
class Contender:
    """One method for mu~: ``evaluate(v~, y~)``, the size of its data (bytes), and the solves to build them."""

    name: str
    size: str
    evaluate: Evaluate
    bytes: int
    solves: int


def cache() -> Path:
    """Cache folder outside the source tree for solved grids; its name depends on the solver's source."""
    folder = Path(builder.__file__).parent
    digest = sha256(
        b"".join(
            (folder / f"{name}.py").read_bytes()
            for name in ("model", "radau", "sections", "series", "steady", "stick", "sweep")
        )
    )
    path = Path(tempfile.gettempdir()) / f"mumacro-benchmarks-{digest.hexdigest()[:16]}"
    path.mkdir(exist_ok=True)
    return path


def grid_axis(n: int) -> Array:
    """``n`` log-spaced values across :data:`SQUARE`."""
    return np.geomspace(*SQUARE, n)


def solve_grid(sweep: Sweep, n: int) -> Array:
    """mu~ on the plain grid of ``n`` x ``n`` nodes, axis 0 along v~."""
    axis = grid_axis(n)
    return sweep.solve("full", axis[:, None], axis[None, :])["mu_ratio"]


def _optional(module: str, package: str) -> Any:
    """The module, or None and an entry in :data:`MISSING`."""
    try:
        return import_module(module)
    except (ImportError, OSError) as error:
        MISSING[package] = f"not installed: pip install {package} ({error})"
        return None


def _pairs(v: Array, y: Array) -> Array:
    out = np.empty((v.size, 2))
    np.log(v, out=out[:, 0])
    np.log(y, out=out[:, 1])
    return out


def _tensor_spline(x: Array, values: Array, k: int) -> Evaluate:
    """The interpolating tensor spline, one banded solve per axis instead of one sparse system for all nodes."""
    first = make_interp_spline(x, values, k=k, axis=0)
    second = make_interp_spline(x, first.c.T, k=k, axis=0)
    spline = NdBSpline((first.t, second.t), np.ascontiguousarray(second.c.T), k)

    def evaluate(v: Array, y: Array) -> Array:
        out: Array = spline(_pairs(v, y))
        return out

    return evaluate


def _rectangle_spline(x: Array, values: Array, k: int) -> Evaluate:
    spline = RectBivariateSpline(x, x, values, kx=k, ky=k)

    def evaluate(v: Array, y: Array) -> Array:
        out: Array = spline.ev(np.log(v), np.log(y))
        return out

    return evaluate


def _map_coordinates(x: Array, values: Array, order: Literal[1, 3, 5]) -> Evaluate:
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


def _interpolation_package(x: Array, values: Array, k: int) -> Evaluate | None:
    splines = _optional("interpolation.splines", "interpolation")
    if splines is None:
        return None
    grid = splines.UCGrid((x[0], x[-1], x.size), (x[0], x[-1], x.size))
    data = splines.prefilter(grid, values, k=k) if k > 1 else values

    def evaluate(v: Array, y: Array) -> Array:
        at = _pairs(v, y)
        out: Array = splines.eval_spline(grid, data, at, out=None, k=k, diff="None", extrap_mode="nearest")
        return out

    return evaluate


def on_grid(values: Array) -> Iterator[Contender]:
    """Every interpolator on the plain grid that ``values`` (n, n) were solved on."""
    n = values.shape[0]
    x = np.log(grid_axis(n))
    axes = (x, x)

    def entry(name: str, evaluate: Evaluate, copies: int = 1) -> Contender:
        return Contender(name, f"{n} x {n}", evaluate, copies * values.nbytes, n * n)

    linear = RegularGridInterpolator(axes, values)
    yield entry("scipy RegularGridInterpolator linear", lambda v, y: np.asarray(linear(_pairs(v, y))))
    if n <= SPSOLVE_LIMIT:
        cubic = RegularGridInterpolator(axes, values, method="cubic", solver=spsolve)
        yield entry("scipy RegularGridInterpolator cubic, spsolve", lambda v, y: np.asarray(cubic(_pairs(v, y))), 2)
    for k in (3, 5):
        yield entry(f"scipy NdBSpline k={k}", _tensor_spline(x, values, k))
    for k in (3, 5):
        yield entry(f"scipy RectBivariateSpline.ev k={k}", _rectangle_spline(x, values, k))
    logarithm = _rectangle_spline(x, np.log(values), 3)
    yield entry("scipy RectBivariateSpline.ev k=3 of ln mu~", lambda v, y: np.exp(logarithm(v, y)))
    orders: tuple[Literal[1, 3, 5], ...] = (1, 3, 5)
    for order in orders:
        yield entry(f"scipy map_coordinates order {order}", _map_coordinates(x, values, order))
    yield entry("scipy interpn linear", lambda v, y: np.asarray(interpn(axes, values, _pairs(v, y))))
    labelled = xr.DataArray(values, coords={"v": x, "y": x}, dims=("v", "y"))

    def through_xarray(v: Array, y: Array) -> Array:
        at = {"v": xr.DataArray(np.log(v), dims="p"), "y": xr.DataArray(np.log(y), dims="p")}
        return np.asarray(labelled.interp(at, assume_sorted=True).values)

    yield entry("xarray interp linear", through_xarray)
    for k in (1, 3):
        compiled = _interpolation_package(x, values, k)
        if compiled is not None:
            yield entry(f"interpolation (numba) k={k}", compiled)


def adaptive(order: int, tolerance: float) -> Contender | None:
    """baobzi: a quadtree of Chebyshev patches that calls the solver where it refines; kept in the cache."""
    baobzi = _optional("baobzi", "baobzi")
    if baobzi is None:
        return None
    file = cache() / f"baobzi-{order}-{tolerance:g}.bin"
    count = file.with_suffix(".solves")
    if not (file.exists() and count.exists()):
        w, out, orbit, res = steady.workspace()
        solves = 0

        def ask(at: Any) -> float:
            nonlocal solves
            solves += 1
            v, y = math.exp(at[0]), math.exp(at[1])
            steady.solve_raw(v, y, y - 1.0, w, out, orbit, res)
            return float(res[steady.MU_RATIO])

        low, high = math.log(SQUARE[0]), math.log(SQUARE[1])
        centre, half = np.full(2, 0.5 * (low + high)), np.full(2, 0.5 * (high - low))
        baobzi.Baobzi(ask, 2, order, centre, half, tolerance).save(str(file))  # built once; later runs read the file
        count.write_text(str(solves))
    tree = baobzi.Baobzi(filename=str(file))

    def evaluate(v: Array, y: Array) -> Array:
        out: Array = tree(_pairs(v, y))
        return out

    return Contender(
        f"baobzi order {order}", f"tol {tolerance:g}", evaluate, file.stat().st_size, int(count.read_text())
    )


@dataclass(frozen=True)
class Yardstick:
    """Speed of a well-known table of another field: ns a point, and its relative error on its own function."""

    name: str
    ns: float
    max_rel: float
    bytes: int


def _steam_folder() -> Path:
    return Path(tempfile.gettempdir()) / f"mumacro-benchmarks-coolprop-{version('CoolProp')}"


def yardstick(points: int, rounds: int, build: bool = True) -> Yardstick | None:
    """CoolProp's BICUBIC backend: density of superheated steam of enthalpy and pressure, against the equation of state.

    Its tables take a while to build; with ``build`` false they are used only if an earlier run left them in the cache.
    """
    CoolProp = _optional("CoolProp", "CoolProp")
    if CoolProp is None:
        return None
    settings = CoolProp.CoolProp
    if not hasattr(CoolProp.AbstractState, "fast_evaluate"):
        MISSING["CoolProp"] = "this version cannot evaluate arrays of points; pip install CoolProp>=8"
        return None
    folder = _steam_folder()
    if not build and not any(folder.rglob("single_phase_logph*")):
        MISSING["CoolProp"] = "its tables are not built yet; a full run builds them"
        return None
    folder.mkdir(exist_ok=True)
    settings.set_config_string(settings.ALTERNATIVE_TABLES_DIRECTORY, f"{folder}{os.sep}")
    table, exact = CoolProp.AbstractState("BICUBIC&HEOS", "Water"), CoolProp.AbstractState("HEOS", "Water")
    table.update(CoolProp.HmolarP_INPUTS, 5e4, 1e5)  # builds the tables, or reads them
    rng = np.random.default_rng(5)
    pressure = 10.0 ** rng.uniform(4.0, 7.0, points)
    enthalpy = rng.uniform(3.0e6, 4.2e6, points) * 0.018015268
    wanted, out, status = np.array([CoolProp.iDmolar], np.int32), np.empty((points, 1)), np.empty(points, np.int32)
    best = best_of(
        rounds,
        {"": lambda: table.fast_evaluate(CoolProp.HmolarP_INPUTS, enthalpy, pressure, wanted, out, status)},
    ).best[""]
    sample = min(points, 2000)
    truth = np.empty(sample)
    for i in range(sample):
        exact.update(CoolProp.HmolarP_INPUTS, enthalpy[i], pressure[i])
        truth[i] = exact.rhomolar()
    worst = float(np.abs(out[:sample, 0] / truth - 1.0).max())
    used = sum(file.stat().st_size for file in folder.rglob("single_phase_logph*"))
    return Yardstick("CoolProp BICUBIC, its own function", best / points * 1e9, worst, used)
