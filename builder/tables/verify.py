"""Verify the table with fresh solves: errors off the nodes, coverage of every bound, seams,
monotony."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate
from mumacro.inputs.fields import SPRING, Kind
from mumacro.kernel.arrays import Array
from mumacro.table.atlas import (
    CONTINUOUS,
    QUANTITIES,
    QUANTITY_NAMES,
    REGIME_OF_SOURCE,
    SOURCES,
)

from ..solver.sweep import Sweep
from .contacts import SolvedContact, draws_of, ratio_of, slopes_of
from .draws import log_uniform
from .measure import border_errors
from .quantities import ABS_TO_REL, SOLVED, SOLVER_NOISE

# distance from v~crit below which derivatives that are not smooth at the border are not compared
BESIDE_BORDER = 1e-3
# differences of fresh solves represent the derivatives of the model
_STENCIL = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
_SIXTH_ORDER = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
_FOURTH_ORDER = np.array([0.0, 1.0, -8.0, 8.0, -1.0, 0.0]) / 12.0
# in ln v~ and ln y~: next to the corner a step of 0.01 has a larger error than the finest table
_STEP = 0.003
# one point in so many is also compared with differences, which need twelve solves each
SLOPE_SHARE = 20
BORDER_POINTS = 2000  # fresh solves of v~crit
#: fractions of the points; the error that each fraction does not exceed is published, the last one
#: is the largest error
QUANTILES = (0.5, 0.95, 0.99, 1.0)


def seam_jumps(surrogate: Surrogate, n: int = 2000, seed: int = 7, kind: Kind = SPRING) -> float:
    """Return the largest |mu~(one side) - mu~(other side)| / mu~ over all seams and the border,
    2e-13 apart."""
    sides = (
        (ratio_of(surrogate, kind, v1, y1), ratio_of(surrogate, kind, v2, y2))
        for v1, v2, y1, y2 in draws_of(kind).sides(surrogate, n, seed)
    )
    return max(float((np.abs(one - two) / np.maximum(one, two)).max()) for one, two in sides)


def seam_slope_jumps(
    surrogate: Surrogate, n: int = 2000, seed: int = 7, kind: Kind = SPRING
) -> float:
    """Return the same for v~ d mu~/d v~ and y~ d mu~/d y~, absolute [-]; both are continuous at the
    border, too."""
    sides = (
        [slopes_of(surrogate, kind, "mu_ratio", v, y)[1:3] for v, y in ((v1, y1), (v2, y2))]
        for v1, v2, y1, y2 in draws_of(kind).sides(surrogate, n, seed)
    )
    return max(float(np.abs(one - two).max()) for one, two in sides)


def monotony(
    surrogate: Surrogate, n: int = 3000, lines: int = 200, seed: int = 11, kind: Kind = SPRING
) -> float:
    """Return the largest step of mu~ in the wrong direction along lines of rising v~ and of rising
    y~, across all seams [-]."""
    rise, worst = np.geomspace(1e-9, 1e7, n), 0.0
    for level in log_uniform(np.random.default_rng(seed), 1e-4, 1e6, lines):
        line = np.full(n, level)
        along_v, along_y = (
            ratio_of(surrogate, kind, v, y) for v, y in ((rise, line), (line, rise))
        )
        worst = max(worst, float(np.max([-np.diff(along_v), np.diff(along_y)])))
    return worst


class Neighbours:
    """Solve around points (n,): three fresh solves on either side along ln v~ and along ln y~.

    A step is a fraction of the distance to the nearest place that is not smooth: border or corner.
    """

    def __init__(self, surrogate: Surrogate, contact: SolvedContact, v: Array, y: Array) -> None:
        self.v, self.y, self.crit, mu = v, y, surrogate.v_tilde_crit(y), surrogate.mu_ratio(v, y)
        self.noise = contact.noise
        gap = np.minimum(np.abs(np.log(v / self.crit)), contact.draws.off_steps(v, y))
        stiff = np.maximum(mu * mu, np.abs(1.0 - y * y))
        self.steps = (
            np.minimum(_STEP, gap / 32.0),
            np.minimum(np.minimum(_STEP, gap / 64.0), _STEP * stiff),
        )
        around_v, around_y = (
            x[:, None] * np.exp(_STENCIL * step[:, None])
            for x, step in zip((v, y), self.steps, strict=True)
        )
        self.solved = (
            contact.solve(around_v, y[:, None]),
            contact.solve(v[:, None], around_y),
        )

    def slopes(self, name: str) -> tuple[Array, Array]:
        """Return the derivatives with respect to ln v~ and ln y~, (2, n), by central differences,
        and their possible error."""
        slope, noise = np.empty((2, self.v.size)), np.empty((2, self.v.size))
        sliding = (self.v > self.crit)[:, None]
        for row, (step, solution) in enumerate(zip(self.steps, self.solved, strict=True)):
            slope[row] = solution[name] @ _SIXTH_ORDER / step
            # the error of the fourth order; the sixth order has up to a seventh of it
            left_out = np.abs(slope[row] - solution[name] @ _FOURTH_ORDER / step)
            each = self.noise(name, self.v[:, None], self.y[:, None], solution, sliding).max(axis=1)
            noise[row] = (2.0 * each + 4e-16 * np.abs(slope[row])) / step + 0.2 * left_out
        return slope, noise


class _Comparison(NamedTuple):
    """Hold errors (for all but mu~ only what exceeds the solver's own), the same relative to the
    value, bounds, bounds over errors, sources.

    ``over`` is bound plus solver's own error, divided by the difference from the fresh solve; NaN
    if this difference is not larger than the solver's own error.
    """

    error: Array
    relative: Array
    bound: Array
    over: Array
    misses: NDArray[np.bool_]
    source: NDArray[np.int8]


def bound_over_error(bound: Array, noise: Array, difference: Array) -> Array:
    """Return the values of ``over`` in :class:`_Comparison`."""
    with np.errstate(all="ignore"):
        return np.where(difference > noise, (bound + noise) / difference, np.nan)


def _values(
    surrogate: Surrogate,
    contact: SolvedContact,
    name: str,
    v: Array,
    y: Array,
    solution: dict[str, Array],
) -> _Comparison:
    value, bound, source = contact.quantity(surrogate, name, v, y)
    truth = solution[name]
    noise = contact.noise(name, v, y, solution, REGIME_OF_SOURCE[source] == CONTINUOUS)
    error = np.abs(value - truth)
    misses, over = error > bound + noise, bound_over_error(bound, noise, error)
    if name != "mu_ratio":
        error = np.maximum(error - noise, 0.0)
    scale = np.where(truth == 0.0, 1.0, truth)
    return _Comparison(error, error / scale, bound, over, misses, source)


def _slopes(
    surrogate: Surrogate, contact: SolvedContact, around: Neighbours, name: str
) -> _Comparison:
    """Return the comparison of both logarithmic derivatives of each point."""
    (truth, noise), (v, y) = around.slopes(name), (around.v, around.y)
    source = contact.quantity(surrogate, "mu_ratio", v, y)[2]
    _, along_v, along_y, *bounds = contact.slopes(surrogate, name, v, y)
    difference, bound = np.abs(np.stack((along_v, along_y)) - truth), np.stack(bounds)
    off, over = np.maximum(difference - noise, 0.0), bound_over_error(bound, noise, difference)
    # at the border of a quantity that is not smooth there, the last digits of v~crit decide
    keep = np.full(v.shape, True)
    if not QUANTITIES[QUANTITY_NAMES.index(name)].smooth_at_border:
        keep = np.abs(v / around.crit - 1.0) > BESIDE_BORDER
    off, bound, over = (x[:, keep].ravel() for x in (off, bound, over))
    return _Comparison(off, off, bound, over, off > bound, np.tile(source[keep], 2))


def _summary(comparison: _Comparison, selected: Any = slice(None)) -> dict[str, Any]:
    return {
        "points": int(comparison.error[selected].size),
        "max_abs_error": float(comparison.error[selected].max()),
        "max_rel_error": float(comparison.relative[selected].max()),
        "max_bound": float(comparison.bound[selected].max()),
        "not_covered": int(np.count_nonzero(comparison.misses[selected])),
    }


def _report(parts: list[_Comparison]) -> dict[str, Any]:
    """Return the results for all points, and by source."""
    whole = _Comparison(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    names = sorted((SOURCES[code], code) for code in np.unique(whole.source))
    return {
        **_summary(whole),
        "sources": {name: _summary(whole, whole.source == code) for name, code in names},
    }


def distribution(error: Array, over: Array) -> dict[str, list[float]]:
    """Return errors at :data:`QUANTILES`; and the least, median and largest bound over error, 0 if
    no error exceeds the solver's own."""
    ratios = over[~np.isnan(over)]
    return {
        "error_quantiles": np.quantile(error, QUANTILES).tolist(),
        "bound_over_error": np.quantile(ratios, (0.0, 0.5, 1.0)).tolist()
        if ratios.size
        else [0.0, 0.0, 0.0],
    }


def _distributions(
    values: dict[str, list[_Comparison]], slopes: list[_Comparison], border: _Comparison | None
) -> dict[str, dict[str, list[float]]]:
    """Return the distributions by quantity, then of the derivatives of mu~ with respect to ln v~
    and ln y~, and of v~crit, relative."""
    columns = {}
    for name, parts in values.items():
        error = [part.relative if SOLVED[name].relative else part.error for part in parts]
        columns[name] = np.concatenate(error), np.concatenate([part.over for part in parts])
    for row, name in enumerate(("slope_along_v", "slope_along_y")):
        error, over = (
            [x.reshape(2, -1)[row] for x in column]
            for column in ([part.error for part in slopes], [part.over for part in slopes])
        )
        columns[name] = np.concatenate(error), np.concatenate(over)
    if border is not None:
        columns["border"] = border.relative, border.over
    return {name: distribution(error, over) for name, (error, over) in columns.items()}


def _border_comparison(surrogate: Surrogate, sweep: Sweep, rng: np.random.Generator) -> _Comparison:
    """Return the errors of v~crit, all relative."""
    error = border_errors(surrogate.border, sweep, rng, BORDER_POINTS)
    bound, noise = (
        np.full_like(error, surrogate.border.max_rel_error),
        np.full_like(error, SOLVER_NOISE),
    )
    off = np.maximum(error - noise, 0.0)
    return _Comparison(
        off,
        off,
        bound,
        bound_over_error(bound, noise, error),
        off > bound,
        np.zeros(error.size, np.int8),
    )


def uncovered(report: dict[str, Any]) -> dict[str, int]:
    """Return how many values and derivatives of each quantity, and speeds of the border, miss their
    bound in a report of :func:`verify`."""
    misses = {
        name: report.get(name, report)["not_covered"]
        for name in report["distribution"]
        if name in QUANTITY_NAMES
    }
    if "border" in report:
        misses["border"] = report["border"]["not_covered"]
    return misses | {
        f"slopes of {name}": part["not_covered"] for name, part in report["slopes"].items()
    }


def holds(report: dict[str, Any], tolerance: float) -> bool:
    """Return whether a report of :func:`verify` keeps the tolerance and every bound."""
    errors = (
        report["max_abs_error"] <= tolerance and report["max_rel_error"] <= ABS_TO_REL * tolerance
    )
    return errors and not any(uncovered(report).values())


def verify(
    surrogate: Surrogate, contact: SolvedContact, points: int, seed: int = 2018
) -> dict[str, Any]:
    """Compare a contact of a table with ``points`` fresh solves, drawn as its draws say.

    Returns
    -------
    dict
        Of mu~: ``points``, ``max_abs_error``, ``max_rel_error``, ``max_bound``, ``not_covered``
        (values whose error exceeds their bound), and the same by kind of case in ``cases`` and by
        block or closed form in ``sources``; ``seam_jump``, ``seam_slope_jump``, ``monotony``.  By
        name the same of each other quantity, beyond the solver's own error, and in ``slopes`` of
        the slopes of each along ln v~ and ln y~, absolute, of one point in twenty; of a contact
        that solves the border, in ``border`` of v~crit, relative.  ``distribution``: errors at
        :data:`QUANTILES` and bounds over errors.
    """
    names, cases = surrogate.table.quantities, contact.draws.cases
    border = None
    if contact.border is not None:
        rng = np.random.default_rng([seed, len(cases)])
        border = _border_comparison(surrogate, contact.border, rng)
    slope_names = [name for name in names if name in contact.slope_names]
    values: dict[str, list[_Comparison]] = {name: [] for name in names}
    slopes: dict[str, list[_Comparison]] = {name: [] for name in slope_names}
    for i, (share, draw) in enumerate(cases.values()):
        v, y = draw(np.random.default_rng([seed, i]), max(1, math.ceil(share * points)), surrogate)
        v, y = contact.as_asked(v[(v > 0.0) & (y > 0.0)], y[(v > 0.0) & (y > 0.0)])
        solution = contact.solve(v, y)
        around = Neighbours(surrogate, contact, v[::SLOPE_SHARE], y[::SLOPE_SHARE])
        for name in names:
            values[name].append(_values(surrogate, contact, name, v, y, solution))
        for name in slope_names:
            slopes[name].append(_slopes(surrogate, contact, around, name))
    return {
        **_report(values["mu_ratio"]),
        "cases": {
            case: _summary(part) for case, part in zip(cases, values["mu_ratio"], strict=True)
        },
        **{name: _report(values[name]) for name in names[1:]},
        "slopes": {name: _report(parts) for name, parts in slopes.items()},
        **({} if border is None else {"border": _summary(border)}),
        "distribution": _distributions(values, slopes["mu_ratio"], border),
        "seam_jump": seam_jumps(surrogate, kind=contact.kind),
        "seam_slope_jump": seam_slope_jumps(surrogate, kind=contact.kind),
        "monotony": monotony(surrogate, kind=contact.kind),
    }
