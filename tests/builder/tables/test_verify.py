"""The verifier must find the faults of a wrong table."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from builder.solver.sweep import Sweep
from builder.tables.blocks import solve_nodes
from builder.tables.contacts import spring
from builder.tables.draws import DRAWS, SEAMS, fast_from
from builder.tables.measure import block_errors, cell_errors, finer
from builder.tables.quantities import SOLVED, solver_noise
from builder.tables.verify import (
    bound_over_error,
    distribution,
    monotony,
    seam_jumps,
    seam_slope_jumps,
    uncovered,
    verify,
)
from mumacro import Surrogate
from mumacro.table.atlas import BLOCK_NAMES, CHARTS, QUANTITY_NAMES, SIGMA_CUT, SOURCES
from mumacro.table.netcdf import read_table
from mumacro.table.polynomials import chebyshev_coefficients, interpolation_matrix, nodes
from tests.support.cases import Array, opened, tables
from tests.support.comparing import close
from tests.support.nightly import nightly
from tests.support.places import TABLES

SPRING_CHARTS = CHARTS["spring"]
pytestmark = pytest.mark.slow

TABLE = TABLES / "mumacro-1e-7.nc"
sound = tables(1e-7)


def damaged(block: str, factor: Any, key: str = "mu_ratio") -> Surrogate:
    """The same table with one quantity of one block multiplied by ``factor``."""
    table = read_table(TABLE)
    table.contacts["spring"].blocks[BLOCK_NAMES.index(block)].nodes[key] *= factor
    return Surrogate(table, TABLE)


def test_cases_are_legal_and_repeatable_and_reach_every_block_and_the_fast_tail(
    sound: Surrogate,
) -> None:
    reached: set[str] = set()
    draws = DRAWS["spring"]
    for name in draws.cases:
        v, y = draws.draw(name, 3000, sound, seed=0)
        assert v.shape == y.shape == (3000,)
        assert np.all((v > 0.0) & np.isfinite(v) & (y > 0.0) & np.isfinite(y))
        assert np.array_equal((v, y), draws.draw(name, 3000, sound, seed=0))
        assert not np.array_equal(v, draws.draw(name, 3000, sound, seed=2)[0])
        reached |= {SOURCES[code] for code in sound.quantity("mu_ratio", v, y)[2]}
    assert reached >= {*BLOCK_NAMES, "tail_fast"}
    assert math.isclose(sum(share for share, _ in draws.cases.values()), 1.0)
    with pytest.raises(KeyError):
        draws.draw("easy", 5, sound, seed=0)


def test_the_builder_knows_every_quantity_of_the_kernel(sweep: Sweep) -> None:
    assert tuple(SOLVED) == QUANTITY_NAMES
    solved = sweep.solve("full", np.array([0.1, 2.0]), np.array([0.5, 0.5]))
    for name, about in SOLVED.items():
        noise = solver_noise(
            name, np.array([0.1, 2.0]), np.array([0.5, 0.5]), solved, np.array([False, True])
        )
        assert np.all((noise > 0.0) & (noise < 1e-14))
        assert not about.complement or np.all(
            np.abs(solved[about.complement] + solved[name] - 1.0) <= 3e-16
        )


# --- the report -----------------------------------------------------------------------------------


def test_a_sound_table_keeps_its_bounds_and_its_report_adds_up(
    sound: Surrogate, sweep: Sweep
) -> None:
    report = verify(sound, spring(sweep), 1000, seed=3)
    assert report["points"] >= 1000
    assert 0.0 < report["max_abs_error"] <= sound.tolerance
    assert set(report["cases"]) == set(DRAWS["spring"].cases)
    for parts in (report["cases"], report["sources"]):
        for error in ("max_abs_error", "max_rel_error"):
            assert report[error] == max(part[error] for part in parts.values())
        assert report["points"] == sum(part["points"] for part in parts.values())
    assert report["slopes"].keys() == {*QUANTITY_NAMES}
    slopes = [(part, "max_abs_error") for part in report["slopes"].values()]
    for part, error in (
        (report["power"], "max_rel_error"),
        (report["stick_fraction"], "max_abs_error"),
        *slopes,
    ):
        assert part[error] > 0.0
        assert part[error] == max(source[error] for source in part["sources"].values())
        assert len(part["sources"]) > 8
    names = {*QUANTITY_NAMES, "border", *(f"slopes of {name}" for name in QUANTITY_NAMES)}
    assert uncovered(report) == dict.fromkeys(names, 0)
    for diagnosis, most in (("seam_jump", 2e-7), ("seam_slope_jump", 9e-5), ("monotony", 1e-7)):
        assert 0.0 <= report[diagnosis] <= most


def test_the_distribution_of_errors_is_that_of_its_points(sound: Surrogate, sweep: Sweep) -> None:
    report = verify(sound, spring(sweep), 1000, seed=3)
    spread = report["distribution"]
    largest = {
        "mu_ratio": report["max_abs_error"],
        "power": report["power"]["max_rel_error"],
        "stick_fraction": report["stick_fraction"]["max_abs_error"],
        "border": report["border"]["max_rel_error"],
    }
    assert spread.keys() == {*largest, "slope_along_v", "slope_along_y"}
    for name, part in spread.items():
        assert part["error_quantiles"] == sorted(part["error_quantiles"]), name
        assert part["error_quantiles"][0] < 0.2 * part["error_quantiles"][-1], name
        least, median, most = part["bound_over_error"]
        assert 1.0 <= least < median < most < math.inf, name
    assert {name: spread[name]["error_quantiles"][-1] for name in largest} == largest
    slopes = (spread[name]["error_quantiles"][-1] for name in ("slope_along_v", "slope_along_y"))
    assert max(slopes) == report["slopes"]["mu_ratio"]["max_abs_error"]


def test_shares_of_errors_and_ratios_are_counted() -> None:
    error = np.arange(1.0, 102.0)
    shares = distribution(error, bound_over_error(np.full(101, 201.0), np.full(101, 1.5), error))
    assert shares["error_quantiles"] == [51.0, 96.0, 100.0, 101.0]
    # the first error is within the solver's own
    least, median, most = shares["bound_over_error"]
    assert (least, most) == close((202.5 / 101.0, 202.5 / 2.0), rel=1e-15)
    assert median == close(202.5 / 51.5, rel=1e-3)
    assert distribution(error, np.full(101, np.nan))["bound_over_error"] == [0.0, 0.0, 0.0]


def test_a_border_that_is_off_is_found(sweep: Sweep) -> None:
    table = read_table(TABLE)
    for piece in table.border:
        piece.values *= 1.0 + 1e-9
    missed = uncovered(verify(Surrogate(table, TABLE), spring(sweep), 200, seed=3))
    assert missed["border"] > 1000


@pytest.mark.parametrize(
    ("key", "block"),
    [
        ("mu_ratio", "corner"),
        ("power", "continuous_mid_2"),
        ("stick_fraction", "stick_slip_high"),
        nightly("mu_ratio", "continuous_mid_1"),
        nightly("power", "stick_slip_low"),
        nightly("stick_fraction", "corner"),
    ],
)
def test_a_block_off_by_a_hundred_thousandth_is_found_and_named(
    sweep: Sweep, key: str, block: str
) -> None:
    wrong = damaged(block, 1.0 + 1e-5, key)
    report = verify(wrong, spring(sweep), 1000, seed=3)
    part = report.get(key, report)
    assert part["not_covered"] == uncovered(report)[key] > 0
    assert [name for name, source in part["sources"].items() if source["not_covered"]] == [block]
    assert [name for name in QUANTITY_NAMES if uncovered(report)[name]] == [key]
    errors = block_errors(wrong, spring(sweep), 200, seed=1)[BLOCK_NAMES.index(block)]
    assert errors.values[key] > 1e-6
    if (key, block) == ("mu_ratio", "corner"):
        assert errors.values[key] == close(1e-5, rel=0.3)
        assert errors.cells[key][:, 1:].max() > 1e-6  # the slopes are wrong by the same factor


# --- seams and monotony ---------------------------------------------------------------------------


class Stepped:
    """A table whose ratio and slopes are larger by a thousandth beyond one line."""

    def __init__(
        self, table: Surrogate, beyond: Callable[[Surrogate, Array, Array], Array]
    ) -> None:
        self.v_tilde_crit = table.v_tilde_crit
        self.quantity = lambda name, v, y, **kind: [
            table.quantity(name, v, y, **kind)[0] * (1.0 + 1e-3 * beyond(table, v, y))
        ]
        self.tabulated = self
        self.slopes = lambda name, v, y, kind: [
            part + 1e-3 * beyond(table, v, y) for part in table.tabulated.slopes(name, v, y, kind)
        ]


@pytest.mark.parametrize(
    "beyond",
    [
        *(lambda _s, _v, y, seam=seam: y > seam for seam in SEAMS),
        lambda s, v, y: v > s.v_tilde_crit(y),
        lambda s, v, y: v > s.v_tilde_crit(y) * SIGMA_CUT**2,
        lambda s, v, y: v > fast_from(s, y),
    ],
    ids=[*map(str, SEAMS), "border", "edge of the corner", "closed form"],
)
def test_a_step_at_any_seam_is_found(sound: Surrogate, beyond: Callable[..., Array]) -> None:
    stepped: Any = Stepped(sound, beyond)
    for jumps in (seam_jumps, seam_slope_jumps):
        assert jumps(stepped, 100) > 9e-4 > 10.0 * jumps(sound, 100)


def test_a_step_in_the_wrong_direction_is_found() -> None:
    # mu~ is too high below the border: it falls as v~ crosses the border upwards
    assert monotony(damaged("stick_slip_mid_2", 1.01), n=2000, lines=40) >= 1e-3


# --- errors of blocks -----------------------------------------------------------------------------


def test_the_errors_that_are_measured_are_those_that_the_table_states(
    sound: Surrogate, sweep: Sweep
) -> None:
    measured = block_errors(sound, spring(sweep), 200, seed=1)
    for chart, block, errors in zip(
        SPRING_CHARTS, sound.table.contacts["spring"].blocks, measured, strict=True
    ):
        assert errors.values.keys() == errors.cells.keys() == block.nodes.keys()
        for name in block.nodes:
            assert 0.0 < errors.values[name] <= block.errors[name][0], chart.name
            assert np.all(
                (errors.cells[name] >= 0.0) & (errors.cells[name] <= block.cell_errors[name])
            ), chart.name
        assert errors.absolute <= sound.tolerance
        assert errors.relative <= 10.0 * sound.tolerance


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10, 1e-12])
def test_errors_that_are_stated_do_not_hang_on_the_last_digits_of_the_solves(
    tolerance: float, sweep: Sweep
) -> None:
    """The power of the tail is what is left of y~ after its first order is subtracted: the solver's
    rounding is in it.

    Other processors round otherwise: draws of that rounding stand for them.
    """
    table, index = opened(tolerance), BLOCK_NAMES.index("continuous_tail")
    block = table.table.contacts["spring"].blocks[index]
    _, _, exact, noise = solve_nodes(
        spring(sweep), index, finer((block.a.size, block.b.size)), table.border
    )
    assert noise["power"].max() > 1e3 * noise["mu_ratio"].max() > 0.0
    c = chebyshev_coefficients(exact["power"])
    c[1, 8:] = c[2:] = 0.0  # all of it is rounding
    to_a, to_b = (interpolation_matrix(n, nodes(n, -1.0, 1.0)) for n in c.shape)
    for seed in range(4):
        drawn = 0.5 * noise["power"] * np.random.default_rng(seed).standard_normal(c.shape)
        other = exact | {"power": to_a @ c @ to_b.T + drawn}
        largest = cell_errors(spring(sweep), index, block, other, noise)["power"]
        assert np.all(largest <= block.cell_errors["power"])
        assert np.all(largest[:, 0] > 0.0)


@pytest.mark.parametrize("block", ["continuous_low", "stick_slip_mid", "stick_slip_high"])
def test_wrinkles_too_small_for_the_value_are_found_in_the_slope(sweep: Sweep, block: str) -> None:
    """Every second node off by half the stated error: values stay within their bound, slopes do
    not."""
    table, index = read_table(TABLE), BLOCK_NAMES.index(block)
    part = table.contacts["spring"].blocks[index]
    values = part.nodes["mu_ratio"]
    values += 0.25 * part.errors["mu_ratio"][0] * (-1.0) ** np.arange(values.shape[1])
    measured = block_errors(Surrogate(table, TABLE), spring(sweep), 200, seed=1)[index]
    assert np.any(measured.cells["mu_ratio"][:, 2] > part.cell_errors["mu_ratio"][:, 2])
    for name in part.nodes.keys() - {"mu_ratio"}:
        assert measured.values[name] <= part.errors[name][0]
        assert np.all(measured.cells[name] <= part.cell_errors[name])


@pytest.mark.parametrize("block", ["corner", "continuous_mid_1"])
def test_an_error_along_one_edge_of_a_block_counts_whole(sweep: Sweep, block: str) -> None:
    table, index = read_table(TABLE), BLOCK_NAMES.index(block)
    table.contacts["spring"].blocks[index].nodes["mu_ratio"][:, -1] *= 1.0 + 1e-5
    assert (
        block_errors(Surrogate(table, TABLE), spring(sweep), 200, seed=1)[index].values["mu_ratio"]
        > 5e-6
    )
