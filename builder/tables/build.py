"""From a tolerance to a verified table file: border, blocks, plain grid, fresh solves,
provenance."""

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mumacro import MumacroError, Surrogate
from mumacro.kernel.arrays import Array
from mumacro.table.atlas import BALL_CHARTS, CHARTS, QUANTITIES, QUANTITY_NAMES, Quantity
from mumacro.table.blocks import Block, Table
from mumacro.table.netcdf import BALL, read_table, write_table
from mumacro.table.polynomials import Border
from mumacro.version import __version__

from ..solver.ball import Springs
from ..solver.sweep import Sweep
from .blocks import build_block, build_border
from .contacts import FINE, SolvedContact, ball, spring
from .measure import block_errors, border_errors
from .quantities import ABS_TO_REL, SOLVED
from .verify import QUANTILES, holds, uncovered, verify, verify_ball

MIN_TOLERANCE, MAX_TOLERANCE = 1e-12, 1e-2
SAFETY = 2.0  # from the largest error found on BLOCK_POINTS fresh solves to the bound of values
#: the same in every cell.  Less, since nothing is left to chance there: the error of a cell is
#: known on 17 x 17 of its points, edges included; what is allowed for is the rest that the finer
#: interpolant misses, see builder/tables/measure.py
CELL_SAFETY = 1.5
BLOCK_POINTS = 1500
FINAL_POINTS = 20_000
SPRING_POINTS = 2000  # fresh solves that the springs of a ball are compared with
ATTEMPTS = 4
#: the least tolerance of a ball, whatever that of its table: beside the ridge the ring misses 1e-11
BALL_TOLERANCE = 1e-10
#: steps of rounding in one tolerance; with 64, mu~ of the coarsest table is no longer monotone to
#: rounding
STEPS = 256
ERROR_BITS = 3  # digits of the errors of the plain grid and of cells
REFERENCE = (
    "Benad J., Nakano K., Popov V. L., Popov M.: Active control of friction by transverse "
    "oscillations. Friction (2018)"
)


class BuildError(MumacroError):
    """The tolerance was not reached; the message states where and by how much."""


# --- rounding: bits below the tolerance are zero, which zlib compresses; errors are those of the
# rounded numbers ---


def bits(tolerance: float) -> int:
    """Binary digits after the point of which the last one is at most
    ``tolerance``/:data:`STEPS`."""
    return math.ceil(math.log2(STEPS / tolerance))


def to_step(values: Array, tolerance: float) -> Array:
    """``values`` at multiples of a power of two; none moves by more than half of
    ``tolerance``/:data:`STEPS`."""
    return np.asarray(np.ldexp(np.round(np.ldexp(values, bits(tolerance))), -bits(tolerance)))


def to_bits(values: Array, digits: int, up: bool = False) -> Array:
    """``values`` with ``digits`` binary digits each, to the nearest or, with ``up``, away from
    zero."""
    mantissa, exponent = np.frexp(values)
    scaled = np.ldexp(mantissa, digits)
    whole = np.copysign(np.ceil(np.abs(scaled)), scaled) if up else np.round(scaled)
    return np.asarray(np.ldexp(whole, exponent - digits))


def round_block(block: Block, tolerance: float) -> Block:
    """``block`` with its node values rounded.

    All that a block tabulates is of order one, and mu~ changes by at most about as much as what is
    tabulated: a step that is the same for all values of a block suits the relative error of mu~
    too.
    """
    return dataclasses.replace(
        block, nodes={name: to_step(x, tolerance) for name, x in block.nodes.items()}
    )


# --- the table ------------------------------------------------------------------------------------


def stages() -> int:
    """The least number of calls of ``progress``, one for each finished stage."""
    return 1 + len(CHARTS) + 3 + ball_stages()


def ball_stages() -> int:
    """The same of :func:`add_ball`."""
    return 1 + len(BALL_CHARTS) + 2


def plain_grid(sweep: Sweep, tolerance: float) -> dict[str, Any]:
    """The log-spaced grid for plots; finer for finer tables, nodes solved, not interpolated.

    mu~ and the stick fraction keep as many digits as the table's tolerance needs;
    ``error_estimate`` is the solver's and that of the rounding.
    """
    n = 31 if tolerance > 1e-5 else (61 if tolerance > 1e-9 else 121)
    v, y = np.geomspace(1e-3, 1e3, n), np.geomspace(1e-3, 1e3, n)
    solved = sweep.solve("full", v[:, None], y[None, :])
    crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
    mu, stick = (to_bits(solved[name], bits(tolerance)) for name in ("mu_ratio", "stick_fraction"))
    error = to_bits(solved["error_estimate"] + np.abs(mu - solved["mu_ratio"]), ERROR_BITS, up=True)
    return {
        "v_tilde": v,
        "y_tilde": y,
        "mu_ratio": mu,
        "stick_fraction": stick,
        "error_estimate": error,
        "v_tilde_crit": crit,
    }


def build_table(
    out: Path,
    tolerance: float,
    sweep: Sweep,
    progress: Callable[[str, bool], None] = lambda _text, _done: None,
) -> Surrogate:
    """Build the table for ``tolerance`` (largest absolute error of mu~), verify it and write it to
    ``out``.

    ``progress(text, done)`` is called while a stage runs and when it is done.  A block whose fresh
    solves miss the tolerance is built again for a third of it.

    Raises
    ------
    BuildError
        When the verified error does not come below the tolerance.
    """
    border = Border(pieces := build_border(sweep, tolerance))
    largest = float(border_errors(border, sweep, np.random.default_rng(23), 600).max())
    for piece in pieces:
        piece.max_rel_error = SAFETY * largest
    progress("border", True)
    targets, one = [tolerance] * len(CHARTS), spring(sweep)

    def build(i: int) -> Block:
        return round_block(
            build_block(one, i, border, targets[i], lambda text: progress(text, False)),
            targets[i],
        )

    blocks: list[Block] = []
    for i, chart in enumerate(CHARTS):
        blocks.append(build(i))
        progress(chart.name, True)
    grid = plain_grid(sweep, tolerance)
    progress("plain grid", True)
    table = Table(pieces, blocks, **grid)
    table.attributes = {"tolerance": tolerance, "quantities": " ".join(QUANTITY_NAMES)}
    _meet_tolerance(table, out, one, tolerance, targets, build)
    progress("errors of the blocks", True)
    return _finish(table, out, targets, sweep, progress)


def add_ball(
    table: Table,
    out: Path,
    sweep: Sweep,
    progress: Callable[[str, bool], None] = lambda _text, _done: None,
) -> Table:
    """The table with a ball of its tolerance, but not below :data:`BALL_TOLERANCE`, verified; its
    springs are the same.

    A ball is integrated over springs of the tolerance :data:`.contacts.FINE`, see
    :func:`springs_for`.

    Raises
    ------
    BuildError
        When the verified error does not come below the tolerance.
    """
    tolerance = max(float(table.attributes["tolerance"]), BALL_TOLERANCE)
    of = ball(springs_for(table, sweep), tolerance, sweep.workers)
    progress("springs of the ball", True)
    border, targets = Border(table.border), [tolerance] * len(BALL_CHARTS)

    def build(i: int) -> Block:
        return round_block(
            build_block(of, i, border, targets[i], lambda text: progress(f"ball {text}", False)),
            targets[i],
        )

    blocks: list[Block] = []
    for i, chart in enumerate(BALL_CHARTS):
        blocks.append(build(i))
        progress(f"ball {chart.name}", True)
    table = of.with_blocks(table, blocks)
    _meet_tolerance(table, out, of, tolerance, targets, build)
    progress("errors of the ball", True)
    report = verify_ball(Surrogate(table, out), of, FINAL_POINTS)
    progress("fresh balls", True)
    if not holds(report, tolerance):
        raise _missed(report, tolerance)
    stated = verified_attributes(report, table.quantities)
    table.attributes = (
        table.attributes
        | {f"{BALL}tolerance": tolerance}
        | {f"{BALL}{name}": x for name, x in stated.items()}
    )
    return table


def springs_for(table: Table, sweep: Sweep) -> Springs:
    """The springs that a ball is integrated over: those of ``table`` where its tolerance is
    :data:`.contacts.FINE`, else those of the bundled table of that tolerance.

    They are compared with fresh solves first: the solver may have changed since they were built.

    Raises
    ------
    BuildError
        No such table is bundled, or it cannot be read, or it is not what the solver gives.
    """
    remedy = (
        f"a ball is integrated over the springs of the bundled table of {FINE:g}; build that "
        f"first: python -m builder build --tolerance {FINE:g} --out tables/mumacro-{FINE:g}.nc"
    )
    try:
        own = float(table.attributes["tolerance"]) <= FINE
        fine = Surrogate(table, "this table") if own else Surrogate.open(FINE)
    except MumacroError as error:
        raise BuildError(f"{error}; {remedy}") from error
    if not holds(verify(fine, sweep, SPRING_POINTS), FINE):
        raise BuildError(f"{fine.path} is not what the solver gives now; {remedy}")
    return Springs(fine)


def _missed(report: dict[str, Any], tolerance: float) -> BuildError:
    missed = {what: count for what, count in uncovered(report).items() if count}
    return BuildError(
        f"verified error {report['max_abs_error']:.2e} absolute, {report['max_rel_error']:.2e} "
        f"relative against a tolerance of {tolerance:.0e} and {ABS_TO_REL * tolerance:.0e}; "
        f"outside their bound: {missed or 'none'}; no table was written"
    )


def _meet_tolerance(
    table: Table,
    out: Path,
    of: SolvedContact,
    tolerance: float,
    targets: list[float],
    build: Callable[[int], Block],
) -> None:
    """State the errors of a contact's blocks; those that miss the tolerance are built again, for a
    third of their target, at most :data:`ATTEMPTS` times in all."""
    for attempt in range(ATTEMPTS):
        late = _state_errors(table, out, of, attempt, tolerance)
        if not late or attempt == ATTEMPTS - 1:
            return
        for i in late:
            targets[i] /= 3.0
            of.blocks(table)[i] = build(i)


def _state_errors(
    table: Table, out: Path, of: SolvedContact, seed: int, tolerance: float
) -> list[int]:
    """Measure the errors of the blocks and write them into the table; the blocks that miss its
    tolerance."""
    late = []
    for i, measured in enumerate(block_errors(Surrogate(table, out), of, BLOCK_POINTS, seed)):
        block = of.blocks(table)[i]
        for name, value in measured.values.items():
            slopes = np.zeros(2)
            if name in measured.cells:
                errors = CELL_SAFETY * measured.cells[name]
                if name not in of.sloped:
                    # they bound values: a rough quadrature can make the finer interpolant worse
                    # than the table, and some points of cells are in another block
                    errors[:, 0] = np.minimum(errors[:, 0], SAFETY * value)
                errors = to_bits(errors, ERROR_BITS, up=True)
                block.cell_errors[name], slopes = errors, errors.max(axis=0)[1:]
            block.errors[name] = np.array([SAFETY * value, *slopes])
        block.max_abs_error, block.max_rel_error = measured.absolute, measured.relative
        if measured.absolute > 0.8 * tolerance or measured.relative > 0.8 * ABS_TO_REL * tolerance:
            late.append(i)
    return late


def _verified(quantity: Quantity, report: dict[str, Any]) -> tuple[str, float]:
    """Name and value of the attribute that states the verified error of a quantity."""
    if SOLVED[quantity.name].relative:
        return f"verified_max_rel_{quantity.variable}_error", report["max_rel_error"]
    return f"verified_max_{quantity.variable}_error", report["max_abs_error"]


def verified_attributes(report: dict[str, Any], quantities: list[str]) -> dict[str, Any]:
    """The attributes that state what a report of :func:`.verify.verify` found."""
    spread = report["distribution"]
    return {
        "verified_max_abs_error": report["max_abs_error"],
        "verified_max_rel_error": report["max_rel_error"],
        **dict(
            _verified(quantity, report[quantity.name])
            for quantity in QUANTITIES[1:]
            if quantity.name in quantities
        ),
        "verified_max_slope_error": report["slopes"]["mu_ratio"]["max_abs_error"],
        "verified_points": np.int32(report["points"]),
        # few and flat: each attribute costs about a hundred bytes
        "verified_quantiles": np.array(QUANTILES),
        "verified_quantities": " ".join(spread),
        "verified_error_quantiles": np.concatenate(
            [part["error_quantiles"] for part in spread.values()]
        ),
        "verified_bound_over_error": np.concatenate(
            [part["bound_over_error"] for part in spread.values()]
        ),
    }


def write_verified(path: Path, report: dict[str, Any]) -> None:
    """Put what a report of :func:`.verify.verify` found into the attributes of a table file; no
    other number of it changes."""
    table = read_table(path)
    table.attributes |= verified_attributes(report, table.quantities)
    stated = verified_attributes(report["ball"], table.quantities)
    table.attributes |= {f"{BALL}{name}": x for name, x in stated.items()}
    write_table(table, path)


def _finish(
    table: Table,
    out: Path,
    targets: list[float],
    sweep: Sweep,
    progress: Callable[[str, bool], None],
) -> Surrogate:
    """Verify the table on fresh solves, write it to ``out`` with its provenance, and open it."""
    tolerance = float(table.attributes["tolerance"])
    surrogate = Surrogate(table, out)
    report = verify(surrogate, sweep, FINAL_POINTS)
    progress("fresh solves", True)
    if not holds(report, tolerance):
        raise _missed(report, tolerance)
    table.attributes = {
        "title": "Macroscopic friction coefficient under transverse oscillation",
        "summary": "mu_macro/mu0 of a contact dragged at constant speed and shaken across, as a "
        "function of the dimensionless speed and amplitude; plain grid for reading, border-fitted "
        "Chebyshev blocks for evaluation",
        "history": f"mumacro {__version__}: python -m builder build --tolerance {tolerance:g}",
        "source": "full stick-slip model, steady cycle by root-finding on half a period",
        "references": REFERENCE,
        "license": "Apache-2.0",
        "product_version": __version__,
        "Conventions": "CF-1.11",
        "tolerance": tolerance,
        "quantities": " ".join(table.quantities),
        **verified_attributes(report, table.quantities),
        "n_solves": np.int32(sweep.n_solves),
        "builder_options": json.dumps({"tolerance": tolerance, "block_targets": targets}),
    }
    table = add_ball(table, out, sweep, progress)
    write_table(table, out)
    return Surrogate.open(out)
