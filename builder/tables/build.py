"""Build a verified table file from a tolerance: border, blocks, plain grid, fresh solves,
provenance."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mumacro import MumacroError, Surrogate, __version__
from mumacro.table.atlas import CHARTS, QUANTITY_NAMES
from mumacro.table.blocks import Block, Table, TabulatedContact
from mumacro.table.netcdf import read_table, write_table
from mumacro.table.polynomials import Border

from ..solver.ball import Springs
from ..solver.sweep import Sweep
from .blocks import build_block, build_border
from .contacts import FINE, SolvedContact, ball, spring
from .measure import block_errors, border_errors
from .plain_grid import interpolation_errors, plain_grid
from .quantities import ABS_TO_REL
from .rounding import ERROR_BITS, round_block, to_bits
from .verify import QUANTILES, holds, uncovered, verify

MIN_TOLERANCE, MAX_TOLERANCE = 1e-12, 1e-2
# factor from the largest error found on BLOCK_POINTS fresh solves to the bound of values
SAFETY = 2.0
#: the same in every cell.  It is smaller, because nothing is left to chance there: the error of a
#: cell is known on 17 x 17 of its points, edges included.  The allowance is for the rest that the
#: finer interpolant misses, see builder/tables/measure.py
CELL_SAFETY = 1.5
BLOCK_POINTS = 1500
FINAL_POINTS = 20_000
SPRING_POINTS = 2000  # fresh solves with which the springs of a ball are compared
ATTEMPTS = 4
REFERENCE = (
    "Benad J., Nakano K., Popov V. L., Popov M.: Active control of friction by transverse "
    "oscillations. Friction (2018)"
)
#: for a person who opens the file with another program
COMMENT = (
    "mu_ratio is right at its nodes; interpolation between them errs as much as the attributes "
    "interpolation_error_* say. mumacro answers from the blocks in /border, whose tolerance and "
    "verified errors are attributes of /border/spring and /border/ball."
)


class BuildError(MumacroError):
    """Report that the tolerance was not reached; the message says where and by how much."""


# --- the table ------------------------------------------------------------------------------------


Progress = Callable[[str, bool], None]


def stages() -> int:
    """Return the number of stages of a build, each of which calls ``progress`` when it is done."""
    of_contacts = sum(len(charts) + len(("errors", "fresh solves")) for charts in CHARTS.values())
    return len(("border", "plain grid")) + of_contacts


def build_table(
    out: Path,
    tolerance: float,
    sweep: Sweep,
    progress: Progress = lambda _stage, _is_finished: None,
) -> Surrogate:
    """Build the table for ``tolerance`` (largest absolute error of mu~), verify it and write it to
    ``out``.

    ``progress(text, done)`` is called while a stage runs and when it is done.  If the fresh solves
    of a block miss the tolerance, it is built again for a third of it.

    Raises
    ------
    BuildError
        If the verified error of a contact does not come below its tolerance.
    """
    border = Border(pieces := build_border(sweep, tolerance))
    largest = float(border_errors(border, sweep, np.random.default_rng(23), 600).max())
    for piece in pieces:
        piece.max_rel_error = SAFETY * largest
    progress("border", True)
    table = Table(pieces, {}, **plain_grid(sweep, tolerance))
    table.attributes = {"quantities": " ".join(QUANTITY_NAMES)}
    of_grid = interpolation_errors(table, sweep)
    progress("plain grid", True)
    targets = {name: add_contact(table, out, name, tolerance, sweep, progress) for name in CHARTS}
    table.attributes = {
        "title": "Macroscopic friction coefficient under transverse oscillation",
        "summary": "mu_macro/mu0 of a contact dragged at constant speed and shaken across, as a "
        "function of the dimensionless speed and amplitude; plain grid for reading, border-fitted "
        "Chebyshev blocks for evaluation",
        "comment": COMMENT,
        "history": f"mumacro {__version__}: python -m builder build --tolerance {tolerance:g}",
        "source": "full stick-slip model, steady cycle by root-finding on half a period",
        "references": REFERENCE,
        "license": "Apache-2.0",
        "product_version": __version__,
        "Conventions": "CF-1.11",
        "quantities": " ".join(table.quantities),
        **of_grid,
        "n_solves": np.int32(sweep.n_solves),
        "builder_options": json.dumps({"tolerance": tolerance, "block_targets": targets}),
    }
    write_table(table, out)
    return Surrogate.open(out)


def add_contact(
    table: Table, out: Path, name: str, tolerance: float, sweep: Sweep, progress: Progress
) -> list[float]:
    """Build the blocks of a contact into the table and verify them.  Return the tolerances for
    which they were built.

    The contacts are built in the order of ``atlas.CHARTS``, because the springs of a ball may be
    those of the table.

    Raises
    ------
    BuildError
        If the verified error does not come below the tolerance.
    """
    contact = SOLVED_BY[name](table, tolerance, sweep)
    tolerance = max(tolerance, contact.least_tolerance)
    entry = TabulatedContact(name, [], {"tolerance": tolerance})
    border, targets = Border(table.border), [tolerance] * len(entry.charts)

    def build(i: int) -> Block:
        return round_block(
            build_block(
                contact, i, border, targets[i], lambda text: progress(f"{name} {text}", False)
            ),
            targets[i],
        )

    for i, chart in enumerate(entry.charts):
        entry.blocks.append(build(i))
        progress(f"{name} {chart.name}", True)
    table.contacts[name] = entry
    for attempt in range(ATTEMPTS):
        misses = _state_errors(Surrogate(table, out), contact, attempt)
        if not misses or attempt == ATTEMPTS - 1:
            break
        for i in misses:
            targets[i] /= 3.0
            entry.blocks[i] = build(i)
    progress(f"{name}: errors", True)
    report = verify(Surrogate(table, out), contact, FINAL_POINTS)
    progress(f"{name}: fresh solves", True)
    if not holds(report, tolerance):
        raise _miss(report, tolerance)
    entry.attributes |= verified_attributes(report)
    return targets


def _ball_for(table: Table, tolerance: float, sweep: Sweep) -> SolvedContact:
    return ball(springs_for(table, sweep.workers), tolerance, sweep.workers)


#: by contact: the function that solves it for a table whose earlier contacts are built
SOLVED_BY: dict[str, Callable[[Table, float, Sweep], SolvedContact]] = {
    "spring": lambda _table, _tolerance, sweep: spring(sweep),
    "ball": _ball_for,
}


def springs_for(table: Table, workers: int) -> Springs:
    """Return the springs over which a ball is integrated: those of ``table`` if its tolerance is
    :data:`.contacts.FINE`, otherwise those of the bundled table of that tolerance.

    First they are compared with fresh solves, on ``workers`` threads, because the solver may have
    changed since they were built.

    Raises
    ------
    BuildError
        If no such table is bundled, it cannot be read, or it differs from the solver.
    """
    remedy = (
        f"a ball is integrated over the springs of the bundled table of {FINE:g}; build that "
        f"first: python -m builder build --tolerance {FINE:g} --out tables/mumacro-{FINE:g}.nc"
    )
    try:
        is_fine = table.contacts["spring"].tolerance <= FINE
        fine = Surrogate(table, "this table") if is_fine else Surrogate.open(FINE)
    except MumacroError as error:
        raise BuildError(f"{error}; {remedy}") from error
    with Sweep(workers) as sweep:  # its solves do not count for the build
        report = verify(fine, spring(sweep), SPRING_POINTS)
    if not holds(report, FINE):
        raise BuildError(f"{fine.path} is not what the solver gives now; {remedy}")
    return Springs(fine)


def _miss(report: dict[str, Any], tolerance: float) -> BuildError:
    misses = {what: count for what, count in uncovered(report).items() if count}
    return BuildError(
        f"verified error {report['max_abs_error']:.2e} absolute, {report['max_rel_error']:.2e} "
        f"relative against a tolerance of {tolerance:.0e} and {ABS_TO_REL * tolerance:.0e}; "
        f"outside their bound: {misses or 'none'}; no table was written"
    )


def _state_errors(surrogate: Surrogate, contact: SolvedContact, seed: int) -> list[int]:
    """Measure the errors of the blocks of a contact and write them into the table.  Return the
    blocks that miss its tolerance."""
    misses, entry = [], contact.of(surrogate)
    tolerance = entry.tolerance
    for i, largest in enumerate(block_errors(surrogate, contact, BLOCK_POINTS, seed)):
        block = entry.blocks[i]
        for name, value in largest.values.items():
            slopes = np.zeros(2)
            if name in largest.cells:
                errors = CELL_SAFETY * largest.cells[name]
                if name not in contact.slope_names:
                    # they bound values: a rough quadrature can make the finer interpolant worse
                    # than the table, and some points of cells are in another block
                    errors[:, 0] = np.minimum(errors[:, 0], SAFETY * value)
                errors = to_bits(errors, ERROR_BITS, away_from_zero=True)
                block.cell_errors[name], slopes = errors, errors.max(axis=0)[1:]
            block.errors[name] = np.array([SAFETY * value, *slopes])
        block.max_abs_error, block.max_rel_error = largest.absolute, largest.relative
        if largest.absolute > 0.8 * tolerance or largest.relative > 0.8 * ABS_TO_REL * tolerance:
            misses.append(i)
    return misses


def verified_attributes(report: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of a contact that state the results of :func:`.verify.verify`."""
    distribution = report["distribution"]
    # few and flat, because each attribute costs about a hundred bytes, and HDF5 keeps more than
    # eight of a group in a separate structure of several kilobytes
    return {
        "verified_max_abs_error": report["max_abs_error"],
        "verified_max_rel_error": report["max_rel_error"],
        "verified_points": np.int32(report["points"]),
        "verified_quantiles": np.array(QUANTILES),
        "verified_quantities": " ".join(distribution),
        "verified_error_quantiles": np.concatenate(
            [part["error_quantiles"] for part in distribution.values()]
        ),
        "verified_bound_over_error": np.concatenate(
            [part["bound_over_error"] for part in distribution.values()]
        ),
    }


def write_verified(
    path: Path, reports: dict[str, dict[str, Any]], of_grid: dict[str, float]
) -> None:
    """Write the results of :func:`.verify.verify`, by contact, and the errors of interpolating the
    plain grid into the attributes of a table file; no other number of it changes."""
    table = read_table(path)
    table.attributes |= of_grid
    for name, report in reports.items():
        table.contacts[name].attributes |= verified_attributes(report)
    write_table(table, path)
