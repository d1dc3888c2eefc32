"""Properties of the answers, checked over the full double range of every input.

    python fuzz/answers.py [--only promises|driven|seams] [--share 0.01] [--write]

Cases are drawn in three ways: any positive double for each input, by its bits; inputs of any size
with groups v~ and y~ in the range of the table; and a share of inputs at the ends of the double
range.
"""

import itertools
import math
import os
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from builder.solver.ball import Springs
from builder.solver.steady import V_RANGE, Y_RANGE
from builder.solver.sweep import Sweep
from builder.tables.build import build_table
from builder.tables.contacts import FINE, SolvedContact, ball, scale_of, spring
from builder.tables.draws import DRAWS
from builder.tables.verify import Neighbours, bound_over_error
from mumacro import Surrogate
from mumacro.inputs.fields import BALL, FIELDS, SPRING, Kind
from mumacro.kernel.binding import CaseRows, kernels
from mumacro.table.atlas import CONTINUOUS, QUANTITIES, QUANTITY_NAMES, REGIME_OF_SOURCE
from tests.support import extended
from tests.support.driven import answered, beside_lines, hard, ordinary
from tests.support.measuring import main, markdown, quantity, sections
from tests.support.seams import (
    beside_every_seam,
    beyond_both_sides,
    by_its_values,
    doubles_at_every_seam,
    off_the_lines,
    true_slopes,
    with_slopes,
)

Array = NDArray[np.float64]
Cases = dict[str, Array]
N = 1_000_000  # cases for each property in the full run
ENDS = np.array(
    [5e-324, 2.2250738585072014e-308, 1e-300, 1e-160, 1.0, 1e160, 1e300, 1.7976931348623157e308]
)


def any_bits(rng: np.random.Generator, n: int) -> Array:
    """Positive finite doubles, all bit patterns equally likely; every tenth at an end of the
    range."""
    out = rng.integers(1, 0x7FF0000000000000, n, dtype=np.uint64).view(np.float64)
    ends = rng.random(n) < 0.1
    out[ends] = rng.choice(ENDS, int(ends.sum()))
    return out


def draw(n: int, seed: int) -> Cases:
    """``n`` legal cases; in half of them the groups lie between 1e-12 and 1e12."""
    rng = np.random.default_rng(seed)
    cases = {name: any_bits(rng, n) for name in FIELDS}
    half = n // 2
    v, y, mu0, Fz, k, omega = (
        10.0 ** rng.uniform(low, high, half)
        for low, high in ((-12, 12), (-12, 12), (-3, 1), (-60, 60), (-60, 60), (-60, 60))
    )
    length = mu0 * Fz / k
    plain = {
        "mu0": mu0,
        "Fz": Fz,
        "k": k,
        "y0": y * length,
        "omega": omega,
        "v0": v * omega * length,
    }
    for name, values in plain.items():
        cases[name][:half] = values
    for name in ("y0", "omega", "v0"):
        cases[name][rng.random(n) < 0.01] = 0.0
    cases["k"][rng.random(n) < 0.01] = np.inf
    return cases


def pieces(total: int, share: float, size: int = 100_000) -> Iterator[tuple[int, int, Cases]]:
    """(how many, seed, cases) in pieces that fit into memory."""
    n = max(1000, int(total * share))
    for low in range(0, n, size):
        count, seed = min(size, n - low), low // size + 1
        yield count, seed, draw(count, seed)


class Count:
    """Cases tried, cases without the property, and the largest of some measure."""

    def __init__(self) -> None:
        self.cases = self.broken = 0
        self.worst = 0.0

    def add(self, wrong: NDArray[np.bool_], measure: Array | float = 0.0) -> None:
        self.cases += wrong.size
        self.broken += int(np.count_nonzero(wrong))
        self.worst = max(self.worst, float(np.max(measure, initial=0.0)))


def excess(one: Any, other: Any, change: Array) -> tuple[NDArray[np.bool_], Array]:
    """Where a change of mu_macro is larger than the sum of both bounds, and the change over that
    sum.

    Below 2.3e-308 doubles are 5e-324 apart: there both numbers, and their bounds, are rounded to a
    multiple of that.
    """
    allowed = one.error_bound + other.error_bound
    rounded = np.minimum(one.mu_macro, other.mu_macro) < 2.3e-308
    allowed = np.where(rounded, allowed + 4 * 5e-324, allowed)
    with np.errstate(all="ignore"):
        return change > allowed, np.where(
            change > 0.0, change / np.where(allowed > 0.0, allowed, 5e-324), 0.0
        )


def finite(table: Surrogate, share: float) -> Count:
    count = Count()
    for _, _, cases in pieces(N, share):
        a = table.evaluate(cases)
        good = np.isfinite(a.mu_macro) & (a.mu_macro >= 0.0) & (a.mu_macro <= cases["mu0"])
        good &= (
            (a.mu_ratio >= 0.0)
            & (a.mu_ratio <= 1.0)
            & np.isfinite(a.error_bound)
            & (a.error_bound >= 0.0)
        )
        count.add(~good)
    return count


def monotone(table: Surrogate, share: float) -> Count:
    """mu_macro does not fall as v0 rises, nor rise as y0 or omega rise, by more than both
    bounds."""
    count = Count()
    for n, seed, cases in pieces(N // 3, share):
        rng = np.random.default_rng(seed + 1000)
        one = table.evaluate(cases)
        for name, sign in (("v0", 1.0), ("y0", -1.0), ("omega", -1.0)):
            with np.errstate(all="ignore"):
                step = cases[name] * (1.0 + 10.0 ** rng.uniform(-16.0, 1.0, n))
                step = np.minimum(
                    np.maximum(step, np.nextafter(cases[name], np.inf)), 1.7976931348623157e308
                )
            other = table.evaluate({**cases, name: step})
            # omega = 0 means no oscillation for any v0: a separate limit, like y0 = 0
            count.add(*excess(one, other, sign * (one.mu_macro - other.mu_macro)))
    return count


def scaled(table: Surrogate, share: float, by_twos: bool) -> Count:
    """(Fz, k) and (v0, omega) by one power of two: the same bits; by any factor: within both
    bounds."""
    count = Count()
    for n, seed, cases in pieces(N // 2, share):
        rng = np.random.default_rng(seed + 2000)
        for pair in (("Fz", "k"), ("v0", "omega")):
            factor = 2.0 ** rng.integers(-60, 60, n) if by_twos else 10.0 ** rng.uniform(-20, 20, n)
            with np.errstate(all="ignore"):
                moved = {name: cases[name] * factor for name in pair}
            # outside the normal range the scaled input itself is rounded
            in_range = np.ones(n, np.bool_)
            for name in pair:
                normal = (moved[name] >= 1e-305) & (moved[name] < 1e305) & (cases[name] >= 1e-305)
                in_range &= normal | (cases[name] == 0.0) | np.isinf(cases[name])
            one, other = (
                table.evaluate(
                    {name: values[in_range] for name, values in {**cases, **change}.items()}
                )
                for change in ({}, moved)
            )
            change = np.abs(one.mu_macro - other.mu_macro)
            count.add(*((change != 0.0,) if by_twos else excess(one, other, change)))
    return count


def neighbours(table: Surrogate, share: float) -> Count:
    """One input moved to the next double: mu_macro moves by no more than both bounds."""
    count = Count()
    for _, _, cases in pieces(N // 6, share):
        one = table.evaluate(cases)
        for name in FIELDS:
            # zero is a separate limit, and the last digit of a denormal number is a large part of
            # it
            ordinary = (cases[name] > 1e-300) & (cases[name] < 1e300)
            moved = np.where(ordinary, np.nextafter(cases[name], 1.7e308), cases[name])
            other = table.evaluate({**cases, name: moved})
            change = np.abs(one.mu_macro - other.mu_macro)
            if name == "mu0":
                # mu_macro is proportional to it
                change = np.maximum(change - 2.3e-16 * one.mu_macro, 0.0)
            count.add(*excess(one, other, change))
    return count


def fresh_solves(table: Surrogate, share: float) -> Count:
    """|table - full model| against bound + error estimate of the solver, in the solver's range."""
    count = Count()
    with Sweep(os.cpu_count() or 1) as sweep:
        for _, _, cases in pieces(N // 10, share, 20_000):
            a = table.evaluate(cases, include="groups")
            v, y = a.v_tilde, a.y_tilde
            (v_low, v_high), (y_low, y_high) = V_RANGE, Y_RANGE
            solvable = (v_low <= v) & (v <= v_high) & (y_low <= y) & (y <= y_high)
            v, y, mu = v[solvable], y[solvable], a.mu_ratio[solvable]
            _, bound, _ = table.quantity("mu_ratio", v, y)
            solved = sweep.solve("full", v, y)
            error = np.maximum(np.abs(mu - solved["mu_ratio"]) - solved["error_estimate"], 0.0)
            with np.errstate(all="ignore"):
                count.add(error > bound, np.where(bound > 0.0, error / bound, 0.0))
    return count


def on_any_processor(table: Surrogate, share: float) -> Count:
    """The best kernel of this processor and the basic one, without AVX and fused multiply-add."""
    count = Count()
    for n, _, cases in pieces(N // 5, share):
        rows = []
        for kernel in (kernels[-1], kernels[0]):
            answers = CaseRows((n,))
            kernel.cases(table.tabulated.data(), list(cases.values()), answers, slice(0, n))
            rows.append(answers)
        here, there = rows
        change = np.abs(here.mu_macro - there.mu_macro)
        allowed = here.error_bound + there.error_bound
        with np.errstate(all="ignore"):
            count.add(
                (change > allowed) | (here.source != there.source),
                np.where(change > 0.0, change / allowed, 0.0),
            )
    return count


def nearby(rng: np.random.Generator, v: Array, y: Array, size: float) -> tuple[Array, Array]:
    """Points around others, with v~ < y~: the amplitude and the distance to v~ = y~ moved by a
    factor."""
    moved = y * np.exp(size * rng.standard_normal(y.size))
    x, gap = v / y, (y - v) / y
    with np.errstate(all="ignore"):
        x, gap = (
            x * np.exp(size * rng.standard_normal(y.size)),
            gap * np.exp(size * rng.standard_normal(y.size)),
        )
    slow = np.where(
        v / y < 0.5, moved * np.minimum(x, 0.999), moved * (1.0 - np.minimum(gap, 0.999))
    )
    return np.where(slow < moved, slow, v), np.where(slow < moved, moved, y)


Ratios = dict[str, tuple[Array, Array]]  # by row: error over bound, bound over error


def compared(table: Surrogate, contact: SolvedContact, v: Array, y: Array, slopes: bool) -> Ratios:
    """A ball across at v~ and y~ of its middle spring against fresh quadratures, beyond what those
    may be wrong by."""
    ratios = {}
    if slopes:
        true, noise = Neighbours(table, contact, v, y).slopes("mu_ratio")
        rows = contact.slopes(table, "mu_ratio", v, y)
        parts = zip(extended.ROWS[3:], rows[1:3], rows[3:5], true, noise, strict=True)
    else:
        solved = contact.solve(v, y)
        answers = [contact.quantity(table, name, v, y)[:2] for name in QUANTITY_NAMES]
        parts = zip(
            QUANTITY_NAMES,
            *zip(*answers, strict=True),
            [solved[name] for name in QUANTITY_NAMES],
            [contact.noise(name, v, y, solved, False) for name in QUANTITY_NAMES],
            strict=True,
        )
    for name, value, bound, truth, unsure in parts:
        error = np.abs(value - truth)
        with np.errstate(all="ignore"):
            beyond = np.where(error > unsure, (error - unsure) / bound, 0.0)
            ratios[name] = beyond, bound_over_error(bound, unsure, error)
    return ratios


def across(share: float) -> list[list[str]]:
    """Rows of :func:`driven` for a ball across: border, corner, ridge, seams, then around the
    worst."""
    rng, rows = np.random.default_rng(22), []
    springs = Springs(Surrogate.open(1e-12))
    for tolerance in (1e-7, 1e-10):
        table = Surrogate.open(tolerance)
        contact = ball(springs, tolerance, os.cpu_count() or 1)
        for slopes, n in ((False, N // 5), (True, N // 100)):
            n = max(500, int(n * share))
            cases = DRAWS["ball"].cases.values()
            drawn = [how(rng, math.ceil(part * n), table) for part, how in cases]
            v, y = (np.concatenate(x) for x in zip(*drawn, strict=True))
            v, y = contact.as_asked(v[(v > 0.0) & (y > 0.0)], y[(v > 0.0) & (y > 0.0)])
            ratios = compared(table, contact, v, y, slopes)
            medians = {name: np.nanmedian(over) for name, (_, over) in ratios.items()}
            worst = {name: beyond for name, (beyond, _) in ratios.items()}
            for size in (0.3, 0.03, 0.003):
                best = np.unique(
                    [np.argsort(x)[-max(20, int(200 * share)) :] for x in worst.values()]
                )
                near_v, near_y = contact.as_asked(
                    *(
                        np.repeat(x[best], 4) * np.exp(size * rng.standard_normal(4 * best.size))
                        for x in (v, y)
                    )
                )
                near = compared(table, contact, near_v, near_y, slopes)
                v, y = np.append(v, near_v), np.append(y, near_y)
                worst = {name: np.append(x, near[name][0]) for name, x in worst.items()}
            for name, beyond in worst.items():
                what = f"across, table of {tolerance:g}"
                largest, median = f"{beyond.max():.2f}", quantity(float(medians[name]))
                rows.append(["ball", what, name, f"{v.size:,}", largest, median])
    return rows


def driven(share: float) -> str:
    """Bounds of oscillation along and of the normal force, against more digits, and of a ball
    across, against fresh quadratures: random, hard, around the worst."""
    if not extended.HAS_EXTENDED:
        return "numpy.longdouble has the digits of a double on this machine: no reference."
    table, rng, rows = Surrogate.open(1e-10), np.random.default_rng(21), []
    for contact, direction, n in (
        ("spring", "along", N),
        ("spring", "normal", N),
        ("ball", "along", N // 50),
    ):
        normal, count = direction == "normal", max(500, int(n * share))

        def exact(v: Array, y: Array, contact: str = contact, normal: bool = normal) -> Any:
            return (
                extended.ball(v, y, 48) if contact == "ball" else extended.spring(v, y, not normal)
            )

        def shares(
            v: Array,
            y: Array,
            contact: str = contact,
            direction: str = direction,
            exact: Any = exact,
        ) -> Any:
            parts = [slice(low, low + 20_000) for low in range(0, v.size, 20_000)]
            pairs = [
                (answered(table, v[part], y[part], contact, direction), exact(v[part], y[part]))
                for part in parts
            ]
            error = np.concatenate(
                [np.abs(rows[:, 0].astype(np.longdouble) - true) for rows, true in pairs], axis=1
            )
            bound = np.concatenate([rows[:, 1] for rows, _ in pairs], axis=1)
            return np.nan_to_num((error / np.maximum(bound, 1e-300)).astype(float))

        v, y = ordinary(count, 22, normal)
        worst = shares(v, y)
        medians = [
            float(np.median(1.0 / row[row > 0])) if (row > 0).any() else math.nan for row in worst
        ]
        more = [beside_lines(count // 10, 24, contact, normal)]
        if not normal:
            more.append(hard(count // 20, 23))
        for hard_v, hard_y in more:
            v, y, worst = (
                np.append(v, hard_v),
                np.append(y, hard_y),
                np.hstack([worst, shares(hard_v, hard_y)]),
            )
        for size in (0.3, 0.03, 0.003):
            best = np.argsort(worst.max(axis=0))[-max(50, int(1000 * share)) :]
            close_v, close_y = nearby(rng, np.repeat(v[best], 4), np.repeat(y[best], 4), size)
            v, y, worst = (
                np.append(v, close_v),
                np.append(y, close_y),
                np.hstack([worst, shares(close_v, close_y)]),
            )
        for name, row, median in zip(extended.ROWS, worst, medians, strict=True):
            if not math.isnan(median):  # direction normal has no power
                rows.append(
                    [contact, direction, name, f"{v.size:,}", f"{row.max():.2f}", quantity(median)]
                )
    rows += across(share)
    return markdown(
        (
            "contact",
            "direction",
            "row",
            "points",
            "largest error, bound = 1",
            "median bound / error",
        ),
        rows,
    )


#: tolerances between those of the bundled tables: other cells, other seams
OTHER_TOLERANCES = (3e-9, 5e-6)
LINES = 300  # that look for seams in a full run


def seams(share: float) -> str:
    """Both sides of every seam of cells, of the border's too, in every bundled table and in two
    that are built for it: values and slopes against the finest table and fresh solves, slopes
    against differences of the table's own values; and all doubles beside every seam, against both
    sides of it, too."""
    rows, fine = [], Surrogate.open(FINE)
    springs, workers = Springs(fine), os.cpu_count() or 1
    with Sweep(workers) as sweep, tempfile.TemporaryDirectory() as folder:
        tables = [Surrogate.open(tolerance) for tolerance in (1e-4, 1e-7, 1e-10, 1e-12)]
        tables += [
            build_table(Path(folder, f"{tolerance:g}.nc"), tolerance, sweep)
            for tolerance in OTHER_TOLERANCES
        ]
        for table, kind in itertools.product(tables, (SPRING, BALL)):
            contact = ball(springs, FINE, workers) if kind == BALL else spring(sweep)
            sources = {
                "own values": (by_its_values(table, contact), N // 50),
                "fresh solves": (contact, N // 2500),
            }
            if table.tolerance > FINE:
                sources["finest table"] = (by_its_values(fine, contact), N // 10)
            named = kind.names.get("contact", "spring"), f"{table.tolerance:g}"
            for source, (truth, n) in sources.items():
                found: Found = {}
                for _, v, y in beside_every_seam(table, kind, max(40, int(n * share))):
                    here = off_the_lines(table, v, y)
                    for row, ratios in beside(table, truth, source, v[here], y[here]):
                        found.setdefault(row, []).append(ratios)
                rows += rows_of_seams(*named, source, found)
            rows += rows_of_seams(*named, "both sides", doubles(table, kind, share))
            sources.pop("own values")  # two sides of a seam are in no difference of a step
            for source, (truth, n) in sources.items():
                v, y = drawn_doubles(table, kind, share, 10 * n)
                found = {row: [pair] for row, pair in beside(table, truth, source, v, y)}
                rows += rows_of_seams(*named, f"{source}, doubles", found)
    return markdown(
        (
            "across",
            "table",
            "against",
            "row",
            "points",
            "largest error, bound = 1",
            "outside",
            "median bound / error",
        ),
        rows,
        4,
    )


Found = dict[str, list[tuple[Array, Array]]]  # error over bound and bound over error by row


def rows_of_seams(contact: str, tolerance: str, source: str, found: Found) -> list[list[str]]:
    rows = []
    for row, parts in found.items():
        beyond, over = (np.concatenate(x) for x in zip(*parts, strict=True))
        cells = f"{beyond.size:,}", f"{beyond.max():.2f}", f"{(beyond > 1.0).sum():,}"
        middle = quantity(float(np.nanmedian(over))) if (over == over).any() else ""
        rows.append([contact, tolerance, source, row, *cells, middle])
    return rows


def doubles(table: Surrogate, kind: Kind, share: float) -> Found:
    """All doubles beside every seam that random lines cross, against both sides of it."""
    found: Found = {}
    for points in doubles_at_every_seam(table, kind, max(3, int(LINES * share))):
        for row, beyond in beyond_both_sides(table, kind, points):
            found.setdefault(row, []).append((beyond, np.full(beyond.shape, np.nan)))
    return found


def drawn_doubles(table: Surrogate, kind: Kind, share: float, n: int) -> tuple[Array, Array]:
    """About ``n`` of these, off the lines where differences have no step."""
    rng = np.random.default_rng(61)
    parts = doubles_at_every_seam(table, kind, max(3, int(LINES * share)), seed=1)
    pairs = zip(*(part[:2] for part in parts), strict=True)
    v, y = (np.concatenate(x) / scale_of(kind) for x in pairs)
    here = np.flatnonzero(off_the_lines(table, v, y))
    here = rng.choice(here, min(here.size, max(400, int(n * share))), replace=False)
    return v[here], y[here]


def beside(
    table: Surrogate, truth: SolvedContact, source: str, v: Array, y: Array
) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """Error over bound and bound over error of every row of :func:`seams`."""

    def ratios(value: Array, bound: Array, true: Array, unsure: Array) -> tuple[Array, Array]:
        error = np.abs(value - true)
        with np.errstate(all="ignore"):
            beyond = np.where(error > unsure, (error - unsure) / bound, 0.0)
        return np.nan_to_num(beyond, posinf=1e99), bound_over_error(bound, unsure, error)

    if source != "own values":
        solved = truth.solve(v, y)
        for name in QUANTITY_NAMES:
            value, bound, code = truth.quantity(table, name, v, y)
            sliding = REGIME_OF_SOURCE[code] == CONTINUOUS
            yield name, ratios(value, bound, solved[name], truth.noise(name, v, y, solved, sliding))
    for name, slopes, unsure in true_slopes(table, truth, truth.slope_names, v, y):
        rows = truth.slopes(table, name, v, y)
        keep = with_slopes(table, QUANTITIES[QUANTITY_NAMES.index(name)], v, y)
        pair = ratios(rows[1:3], rows[3:5], slopes, unsure)
        beyond, over = (x[:, keep].ravel() for x in pair)
        yield f"slopes of {name}", (beyond, over)


PROMISES: dict[str, Callable[[Surrogate, float], Count]] = {
    "finite, in [0, mu0], with a finite bound": finite,
    "rises with v0, falls with y0 and omega": monotone,
    "(Fz, k) or (v0, omega) by a power of two: the same bits": partial(scaled, by_twos=True),
    "(Fz, k) or (v0, omega) by any factor": partial(scaled, by_twos=False),
    "one input to the next double": neighbours,
    "the bound covers a fresh solve, in the solver's range": fresh_solves,
    "the same source, and a value within both bounds, on any processor": on_any_processor,
}


def promises(share: float) -> str:
    rows = []
    for tolerance in (1e-4, 1e-12):
        for name, check in PROMISES.items():
            count = check(Surrogate.open(tolerance), share)
            worst = quantity(count.worst) if count.worst else ""
            rows.append([name, f"{tolerance:g}", f"{count.cases:,}", f"{count.broken:,}", worst])
    return markdown(
        ("property", "table", "tried", "broken", "largest change or error, bound = 1"), rows
    )


if __name__ == "__main__":
    main(__doc__, sections(promises, driven, seams), share=1.0)
