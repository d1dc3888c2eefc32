"""The table against fresh solves: error off the nodes, coverage of the error bound, seams, monotony."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from builder.blocks import points_of, slope_of
from builder.sweep import Sweep
from friction import Surrogate
from friction.companions import POWER_ROUNDING, edge_uncertainty, power_scale, stick_scale
from friction.regions import (
    BLOCKS,
    CONTINUOUS,
    L_MAX,
    RHO_MAX,
    S_CUT,
    SOURCES,
    Y_CONT,
    Y_HIGH,
    Y_MID,
    Y_STICK_HI,
    Y_STICK_LO,
    Y_TAIL,
)  # fmt: skip
from friction.surrogate import REGIME_OF_SOURCE

__all__ = [
    "CASES",
    "BlockErrors",
    "block_errors",
    "draw",
    "monotony",
    "power_noise",
    "seam_jumps",
    "seam_slope_jumps",
    "verify",
]

Array = NDArray[np.float64]
#: what a fresh solve itself may be wrong by, relative to mu~: rounding, and the input's last digit next to the corner
SOLVER_NOISE = 2e-15
STICK_NOISE = 1e-15  # the same of the stick fraction, absolute, away from the border
SEAMS = (Y_STICK_LO, Y_CONT, Y_MID, Y_HIGH, Y_TAIL)


def _log(rng: np.random.Generator, low: float, high: float, n: int) -> Array:
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high), n)


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


def _fast_from(s: Surrogate, y: Array) -> Array:
    """v~ from which the closed form for large speed answers, y~ > Y_CONT."""
    return np.where(y <= Y_TAIL, RHO_MAX * s.v_tilde_crit(y), math.exp(L_MAX) * np.sqrt(y))


def _seams(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    """Beside the lines where two blocks or a block and a tail meet."""
    y, v = _log(rng, 1e-3, 1e6, n), _log(rng, 1e-6, 1e4, n)
    off = 1.0 + rng.choice([-1.0, 1.0], n) * _log(rng, 1e-12, 1e-3, n)
    which = rng.integers(0, 4, n)
    y = np.where(which < 2, rng.choice(SEAMS, n) * off, y)
    cut = which == 2
    y[cut] = rng.uniform(Y_STICK_LO, Y_STICK_HI, int(cut.sum()))
    v[cut] = s.v_tilde_crit(y[cut]) * np.sin(0.5 * math.pi * S_CUT) ** 2 * off[cut]
    fast = which == 3
    y[fast] = _log(rng, Y_CONT, 1e6, int(fast.sum()))
    v[fast] = _fast_from(s, y[fast]) * off[fast]
    return v, y


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
    ("seams", 0.10, _seams),
    ("creep", 0.08, _creep),
    ("tails", 0.08, _tails),
)


def draw(case: str, n: int, surrogate: Surrogate, seed: int) -> tuple[Array, Array]:
    """``n`` points (v~, y~) of one kind of :data:`CASES`."""
    for name, _, how in CASES:
        if name == case:
            return how(np.random.default_rng(seed), n, surrogate)
    raise ValueError(f"case must be one of {', '.join(name for name, _, _ in CASES)}, got {case!r}")


def power_noise(v: Array, y: Array, power: Array, regime: int | NDArray[np.int8]) -> Array:
    """What the power of a fresh solve itself may be wrong by.

    Where it is small it is the difference of larger numbers: in stick-slip what the drive puts in during stick, v~,
    is taken out; in continuous sliding the angle swings by y~, and only v~ of that is out of phase.
    """
    lost = np.where(np.asarray(regime) == CONTINUOUS, 1e-15 * y * y, 4e-15 * v)
    noise: Array = SOLVER_NOISE * power + np.where((y < 1.0) & (v < 1.0), lost, 0.0)
    return noise


class BlockErrors(NamedTuple):
    """Largest errors over a block: of what it tabulates for mu~, of mu~ (absolute, relative); of what it tabulates for
    power and for the stick fraction, the border's share of the latter apart."""

    quantity: float
    absolute: float
    relative: float
    power: float
    stick: float


def block_errors(surrogate: Surrogate, sweep: Sweep, n: int, seed: int) -> list[BlockErrors]:
    """Largest errors on fresh solves, block by block, on ``n`` points each.

    Points crowd towards the edges of the block, where polynomials err most, and beside the seams that cut through it;
    those which the dispatch sends to a neighbour are left out.
    """
    found = []
    for index, spec in enumerate(BLOCKS):
        rng = np.random.default_rng([seed, index])
        a = _crowded(rng, spec.a, n, radial=spec.a_name == "radius")
        b = _crowded(rng, spec.b, n, radial=False)
        p = points_of(spec, a, b, surrogate.border)
        v_seam, y_seam = _seams(rng, 2 * n, surrogate)
        v_all, y_all = np.concatenate([p.v, v_seam]), np.concatenate([p.y, y_seam])
        p = type(p)(v_all, y_all, y_all - 1.0)
        mu, _, source = surrogate.ratio_with_bound(p.v, p.y)
        keep = source == index
        v, y, eta = p.v[keep], p.y[keep], p.y[keep] - 1.0
        solved = sweep.solve("full", v, y, eta)
        truth = solved["mu_ratio"]
        kept = type(p)(v, y, eta)
        error = np.abs(mu[keep] - truth)
        # a solve's own rounding is not the table's error
        quantity = np.maximum(error - SOLVER_NOISE * truth, 0.0) / slope_of(spec, kept)
        scale = np.vectorize(power_scale, otypes=[np.float64])(index, v, y)
        # nor is half of the rounding that every bound allows for: for y~ -> infinity it would swamp the block's own
        rounding = power_noise(v, y, solved["power"], spec.regime) + 0.5 * POWER_ROUNDING * solved["power"]
        power = np.maximum(np.abs(surrogate.power(v, y) - solved["power"]) - rounding, 0.0) / scale
        stick = np.zeros(1)
        if spec.regime != CONTINUOUS:
            off = np.abs(surrogate.stick_fraction(v, y) - solved["stick_fraction"]) - STICK_NOISE
            scale = np.vectorize(stick_scale, otypes=[np.float64])(index, y)
            stick = np.maximum(off - _edges(surrogate, v, y, 0.5), 0.0) / scale
        worst = (quantity, error, error / truth, power, stick)
        found.append(BlockErrors(*(float(part.max()) for part in worst)))
    return found


def _edges(surrogate: Surrogate, v: Array, y: Array, share: float) -> Array:
    """:func:`friction.companions.edge_uncertainty` where the border errs by ``share`` of its bound.

    Half of the bound is what was found: a larger share would hide errors of the block below the border.
    """
    coef, meta = surrogate._data[2:]
    error = share * max(piece.max_rel_error for piece in surrogate.table.border)
    found = [edge_uncertainty(a, b, coef, meta, error) for a, b in zip(v.tolist(), y.tolist(), strict=True)]
    return np.array(found)


def _crowded(rng: np.random.Generator, span: tuple[float, float], n: int, radial: bool) -> Array:
    low, high = span
    if radial:
        half = n // 2
        return np.concatenate([10.0 ** rng.uniform(-5.0, math.log10(high), half), high * rng.beta(0.5, 0.5, n - half)])
    t = rng.beta(0.5, 0.5, n)
    edge = 10.0 ** rng.uniform(-6.0, -1.0, n // 4)
    t[: edge.size] = np.where(rng.random(edge.size) < 0.5, edge, 1.0 - edge)
    return low + (high - low) * np.clip(t, 1e-7, 1.0 - 1e-7)


def _both_sides(surrogate: Surrogate, n: int, seed: int) -> Iterator[tuple[Array, Array, Array, Array]]:
    """Pairs (v, v, y, y) of points 2e-13 apart, on either side of seams, the border, the edge of the closed form."""
    rng = np.random.default_rng(seed)
    for seam in SEAMS:
        v = _log(rng, 1e-9, 1e5, n)
        yield v, v, np.full(n, seam * (1 - 1e-13)), np.full(n, seam * (1 + 1e-13))
    y = _log(rng, 1e-3, 1e7, n)
    edges = [(surrogate.v_tilde_crit(y), y)]
    y = rng.uniform(Y_STICK_LO, Y_STICK_HI, n)
    edges.append((surrogate.v_tilde_crit(y) * math.sin(0.5 * math.pi * S_CUT) ** 2, y))
    y = _log(rng, Y_CONT, 1e8, n)
    edges.append((_fast_from(surrogate, y), y))
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
    """Errors beyond the solver's own, bounds (None: the table has none) and sources of some answers."""

    error: Array
    bound: Array | None
    source: NDArray[np.int8]


def _compare_companions(
    surrogate: Surrogate, v: Array, y: Array, source: NDArray[np.int8], solved: dict[str, Array]
) -> dict[str, _Compared]:
    """Power, relative to itself, and stick fraction."""
    power, power_bound = surrogate.power_with_bound(v, y)
    stick, stick_bound = surrogate.stick_fraction_with_bound(v, y)
    truth = solved["power"]
    regime = REGIME_OF_SOURCE[source]
    off = np.maximum(np.abs(power - truth) - power_noise(v, y, truth, regime), 0.0)
    far = np.maximum(np.abs(stick - solved["stick_fraction"]) - STICK_NOISE, 0.0)
    return {
        "power": _Compared(off / truth, None if power_bound is None else power_bound / truth, source),
        "stick_fraction": _Compared(far, stick_bound, source),
    }


def _companion_report(parts: list[_Compared], error_name: str, bound_name: str) -> dict[str, Any]:
    error, source = (np.concatenate([getattr(part, name) for part in parts]) for name in ("error", "source"))
    bounds = [part.bound for part in parts if part.bound is not None]
    bound = np.concatenate(bounds) if bounds else None

    def said(at: NDArray[np.bool_]) -> dict[str, Any]:
        return {
            error_name: float(error[at].max()),
            bound_name: None if bound is None else float(bound[at].max()),
            "not_covered": None if bound is None else int(np.count_nonzero(error[at] > bound[at])),
        }

    by_source = {SOURCES[code]: said(source == code) for code in np.unique(source)}
    return {**said(np.ones(error.size, dtype=np.bool_)), "sources": dict(sorted(by_source.items()))}


def verify(surrogate: Surrogate, sweep: Sweep, points: int, seed: int = 2018) -> dict[str, Any]:
    """Compare the table with ``points`` fresh solves drawn as :data:`CASES` say.

    Returns
    -------
    dict
        ``points``, ``max_abs_error``, ``max_rel_error``, ``not_covered`` (answers whose error exceeds their bound),
        ``cases`` and ``sources`` (the same, by kind of case and by block or tail), ``seam_jump``, ``seam_slope_jump``,
        ``monotony``; ``power`` (relative errors beyond the solver's own) and ``stick_fraction`` (absolute ones):
        largest error, ``not_covered``, and the same by source.  None where a table has no bounds of them.
    """
    report: dict[str, Any] = {"points": 0, "max_abs_error": 0.0, "max_rel_error": 0.0, "not_covered": 0}
    companions: dict[str, list[_Compared]] = {"power": [], "stick_fraction": []}
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
        for key, compared in _compare_companions(surrogate, v, y, source, solved).items():
            companions[key].append(compared)
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
    report["power"] = _companion_report(companions["power"], "max_rel_error", "max_rel_bound")
    report["stick_fraction"] = _companion_report(companions["stick_fraction"], "max_abs_error", "max_bound")
    report["seam_jump"] = seam_jumps(surrogate)
    report["seam_slope_jump"] = seam_slope_jumps(surrogate)
    report["monotony"] = monotony(surrogate)
    return report
