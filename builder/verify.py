"""The table against fresh solves: error off the nodes, coverage of every bound, seams, monotony."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate, charts
from mumacro.charts import (
    CONTINUOUS,
    QUANTITIES,
    QUANTITY_NAMES,
    REGIME_OF_SOURCE,
    SOURCES,
    Y_CONT,
    Y_STICK_HI,
    Y_STICK_LO,
)

from .differences import neighbours
from .measure import SEAMS, fast_from, near_seams
from .measure import log_uniform as _log
from .quantities import SOLVED, SOLVER_NOISE, solver_noise
from .sweep import Sweep

__all__ = ["CASES", "draw", "monotony", "seam_jumps", "seam_slope_jumps", "uncovered", "verify"]

Array = NDArray[np.float64]
BESIDE_BORDER = 1e-3  # of v~crit: nearer, slopes of what is not smooth at the border are not compared
SLOPE_SHARE = 20  # one point in so many is also compared with differences, which take twelve solves each


def _random(rng: np.random.Generator, n: int, _: Surrogate) -> tuple[Array, Array]:
    return _log(rng, 1e-3, 1e3, n), _log(rng, 1e-3, 1e3, n)


def _wide(rng: np.random.Generator, n: int, _: Surrogate) -> tuple[Array, Array]:
    return _log(rng, 1e-12, 1e8, n), _log(rng, 1e-8, 1e8, n)


def _border(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    y = _log(rng, 1e-4, 1e6, n)
    return s.v_tilde_crit(y) * (1.0 + rng.choice([-1.0, 1.0], n) * _log(rng, 1e-12, 0.1, n)), y


def _corner(rng: np.random.Generator, n: int, _: Surrogate) -> tuple[Array, Array]:
    radius, psi = _log(rng, 1e-6, 1.3, n), rng.uniform(0.0, 0.5 * math.pi, n)
    phi, s0 = radius * np.sin(psi) / math.sqrt(2.0), math.sqrt(2.0) * radius * np.cos(psi)
    return phi * s0 * s0 / (2.0 * math.pi), 1.0 + 0.25 * s0 * s0 - 0.5 * phi * phi


def _creep(rng: np.random.Generator, n: int, _: Surrogate) -> tuple[Array, Array]:
    return _log(rng, 1e-12, 1e-4, n), _log(rng, 1e-2, 1e3, n)


def _tails(rng: np.random.Generator, n: int, _: Surrogate) -> tuple[Array, Array]:
    """Both tails: large amplitude at every speed, large speed at every amplitude, small amplitude."""
    which = rng.integers(0, 3, n)
    v, y = _log(rng, 1e-6, 1e8, n), _log(rng, 1e5, 1e12, n)
    v = np.where(which == 1, _log(rng, 1e3, 1e8, n), v)
    y = np.where(which == 1, _log(rng, 1e-3, 1e8, n), y)
    return v, np.where(which == 2, _log(rng, 1e-9, 1e-3, n), y)


#: name of the kind of case, share of the points, how they are drawn
CASES: tuple[tuple[str, float, Callable[[np.random.Generator, int, Surrogate], tuple[Array, Array]]], ...] = (
    ("random", 0.30, _random),
    ("wide", 0.20, _wide),
    ("border", 0.12, _border),
    ("corner", 0.12, _corner),
    ("seams", 0.10, near_seams),
    ("creep", 0.08, _creep),
    ("tails", 0.08, _tails),
)


def draw(case: str, n: int, surrogate: Surrogate, seed: int) -> tuple[Array, Array]:
    """``n`` points (v~, y~) of one kind of :data:`CASES`."""
    for name, _, how in CASES:
        if name == case:
            return how(np.random.default_rng(seed), n, surrogate)
    raise ValueError(f"case must be one of {', '.join(name for name, _, _ in CASES)}, got {case!r}")


def _both_sides(surrogate: Surrogate, n: int, seed: int) -> Iterator[tuple[Array, Array, Array, Array]]:
    """Pairs (v, v, y, y) of points 2e-13 apart, on either side of seams, the border, the edge of the closed form."""
    rng = np.random.default_rng(seed)
    for seam in SEAMS:
        v = _log(rng, 1e-9, 1e5, n)
        yield v, v, np.full(n, seam * (1 - 1e-13)), np.full(n, seam * (1 + 1e-13))
    y = _log(rng, 1e-3, 1e7, n)
    edges = [(surrogate.v_tilde_crit(y), y)]
    y = rng.uniform(Y_STICK_LO, Y_STICK_HI, n)
    edges.append((surrogate.v_tilde_crit(y) * charts.SIGMA_CUT**2, y))
    y = _log(rng, Y_CONT, 1e8, n)
    edges.append((fast_from(surrogate, y), y))
    for v, y in edges:
        yield v * (1 - 1e-13), v * (1 + 1e-13), y, y


def seam_jumps(surrogate: Surrogate, n: int = 2000, seed: int = 7) -> float:
    """Largest |mu~(one side) - mu~(other side)| / mu~ over all seams and the border, 2e-13 apart."""
    worst = 0.0
    for v1, v2, y1, y2 in _both_sides(surrogate, n, seed):
        one, two = surrogate.mu_ratio(v1, y1), surrogate.mu_ratio(v2, y2)
        worst = max(worst, float((np.abs(one - two) / np.maximum(one, two)).max()))
    return worst


def seam_slope_jumps(surrogate: Surrogate, n: int = 2000, seed: int = 7) -> float:
    """The same for v~ d mu~/d v~ and y~ d mu~/d y~, absolute [-]; next to the border both are continuous, too."""
    worst = 0.0
    for v1, v2, y1, y2 in _both_sides(surrogate, n, seed):
        for one, two in zip(surrogate.slopes(v1, y1)[1:], surrogate.slopes(v2, y2)[1:], strict=True):
            worst = max(worst, float(np.abs(one - two).max()))
    return worst


def monotony(surrogate: Surrogate, n: int = 3000, lines: int = 200, seed: int = 11) -> float:
    """Largest step of mu~ in the wrong direction along lines of rising v~ and of rising y~, across all seams [-]."""
    rng = np.random.default_rng(seed)
    worst = 0.0
    rise = np.geomspace(1e-9, 1e7, n)
    for fixed in _log(rng, 1e-4, 1e6, lines):
        worst = max(worst, float(-np.diff(surrogate.mu_ratio(rise, fixed)).min()))
        worst = max(worst, float(np.diff(surrogate.mu_ratio(fixed, rise)).max()))
    return max(worst, 0.0)


class _Compared(NamedTuple):
    """Errors beyond the solver's own, the bounds, and the sources of some values."""

    error: Array
    bound: Array
    source: NDArray[np.int8]


def _report(parts: list[_Compared], relative: bool) -> dict[str, Any]:
    error, bound, source = (np.concatenate([part[i] for part in parts]) for i in range(3))
    error_name, bound_name = ("max_rel_error", "max_rel_bound") if relative else ("max_abs_error", "max_bound")

    def said(at: NDArray[np.bool_]) -> dict[str, Any]:
        return {
            error_name: float(error[at].max()),
            bound_name: float(bound[at].max()),
            "not_covered": int(np.count_nonzero(error[at] > bound[at])),
        }

    by_source = {SOURCES[code]: said(source == code) for code in np.unique(source)}
    return {**said(np.ones(error.size, dtype=np.bool_)), "sources": dict(sorted(by_source.items()))}


def _compare(
    surrogate: Surrogate, v: Array, y: Array, source: NDArray[np.int8], solved: dict[str, Array]
) -> dict[str, _Compared]:
    """The quantities beside mu~."""
    sliding = REGIME_OF_SOURCE[source] == CONTINUOUS
    found = {}
    for name in surrogate.table.quantities[1:]:
        value, bound, _ = surrogate.quantity(name, v, y)
        off = np.maximum(np.abs(value - solved[name]) - solver_noise(name, v, y, solved, sliding), 0.0)
        scale = solved[name] if SOLVED[name].relative else np.ones_like(v)
        found[name] = _Compared(off / scale, bound / scale, source)
    return found


def _compare_slopes(
    surrogate: Surrogate, sweep: Sweep, v: Array, y: Array, source: NDArray[np.int8]
) -> dict[str, _Compared]:
    """The logarithmic slopes of all quantities, both of each point."""
    around = neighbours(surrogate, sweep, v, y)
    found = {}
    for name in surrogate.table.quantities:
        truth, noise = around.slopes(name)
        _, along_v, along_y, bound_v, bound_y = surrogate.slopes(v, y, name, bounds=True)
        off = np.maximum(np.abs(np.stack((along_v, along_y)) - truth) - noise, 0.0)
        # at the border of one that is not smooth there, the last digits of v~crit decide
        keep = np.full(v.shape, True)
        if not QUANTITIES[QUANTITY_NAMES.index(name)].smooth_at_border:
            keep = np.abs(v / around.crit - 1.0) > BESIDE_BORDER
        found[name] = _Compared(
            off[:, keep].ravel(), np.concatenate((bound_v[keep], bound_y[keep])), np.tile(source[keep], 2)
        )
    return found


def uncovered(report: dict[str, Any]) -> dict[str, int]:
    """Of the report of :func:`verify`: how many values and slopes of each quantity miss their bound."""
    found = {"mu_ratio": report["not_covered"]}
    for name in report["slopes"]:
        if name in report:
            found[name] = report[name]["not_covered"]
        found[f"slopes of {name}"] = report["slopes"][name]["not_covered"]
    return found


def verify(surrogate: Surrogate, sweep: Sweep, points: int, seed: int = 2018) -> dict[str, Any]:
    """Compare the table with ``points`` fresh solves drawn as in :data:`CASES`.

    Returns
    -------
    dict
        ``points``, ``max_abs_error``, ``max_rel_error``, ``not_covered`` (values whose error exceeds their bound),
        ``cases`` and ``sources`` (the same, by kind of case and by block or closed form), ``seam_jump``,
        ``seam_slope_jump``, ``monotony``; by name of each other quantity, and in ``slopes`` by name of each: largest
        error beyond the solver's own, ``not_covered``, and the same by source.  Errors are absolute, those of the power
        relative.  Slopes are those along ln v~ and ln y~, of one point in twenty.
    """
    report: dict[str, Any] = {"points": 0, "max_abs_error": 0.0, "max_rel_error": 0.0, "not_covered": 0}
    values: dict[str, list[_Compared]] = {name: [] for name in surrogate.table.quantities[1:]}
    slopes: dict[str, list[_Compared]] = {name: [] for name in surrogate.table.quantities}
    cases: dict[str, dict[str, Any]] = {}
    by_source: dict[str, list[tuple[Array, Array, Array]]] = {}
    for i, (name, share, how) in enumerate(CASES):
        n = max(1, math.ceil(share * points))
        v, y = how(np.random.default_rng([seed, i]), n, surrogate)
        keep = (v > 0.0) & (y > 0.0)
        v, y = v[keep], y[keep]
        mu, bound, source = surrogate.ratio_with_bound(v, y)
        solved = sweep.solve("full", v, y)
        truth = solved["mu_ratio"]
        for key, compared in _compare(surrogate, v, y, source, solved).items():
            values[key].append(compared)
        some = slice(0, None, SLOPE_SHARE)
        for key, compared in _compare_slopes(surrogate, sweep, v[some], y[some], source[some]).items():
            slopes[key].append(compared)
        error = np.abs(mu - truth)
        relative = error / truth
        missed = int(np.count_nonzero(error > bound + SOLVER_NOISE * truth))
        cases[name] = {
            "points": int(v.size), "max_abs_error": float(error.max()), "max_rel_error": float(relative.max()),
            "not_covered": missed,
        }  # fmt: skip
        report["points"] += int(v.size)
        report["not_covered"] += missed
        for key in ("max_abs_error", "max_rel_error"):
            report[key] = max(report[key], cases[name][key])
        for code in np.unique(source):
            at = source == code
            by_source.setdefault(SOURCES[code], []).append((error[at], relative[at], bound[at]))
    report["cases"] = cases
    report["sources"] = {
        name: {
            "points": int(sum(e.size for e, _, _ in parts)),
            "max_abs_error": float(max(e.max() for e, _, _ in parts)),
            "max_rel_error": float(max(r.max() for _, r, _ in parts)),
            "max_bound": float(max(b.max() for _, _, b in parts)),
        }
        for name, parts in sorted(by_source.items())
    }
    for key, parts in values.items():
        report[key] = _report(parts, SOLVED[key].relative)
    report["slopes"] = {key: _report(parts, False) for key, parts in slopes.items()}
    report["seam_jump"] = seam_jumps(surrogate)
    report["seam_slope_jump"] = seam_slope_jumps(surrogate)
    report["monotony"] = monotony(surrogate)
    return report
