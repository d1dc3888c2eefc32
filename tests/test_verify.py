"""The verifier must find the faults of a wrong table."""

import copy
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from builder.measure import SEAMS, block_errors, fast_from
from builder.quantities import SOLVED, solver_noise
from builder.sweep import Sweep
from builder.verify import CASES, draw, monotony, seam_jumps, seam_slope_jumps, uncovered, verify
from comparing import close
from mumacro import Surrogate
from mumacro.charts import CHARTS, NAMES, QUANTITY_NAMES, SIGMA_CUT, SOURCES
from mumacro.table import Table, read_table

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
TABLE = Path(__file__).parent.parent / "tables" / "mumacro-1e-7.nc"


@pytest.fixture(scope="module")
def sound() -> Surrogate:
    return Surrogate.open(TABLE)


def damaged(block: str, factor: float) -> Surrogate:
    """The same table with one block's values multiplied by ``factor``."""
    table: Table = copy.deepcopy(read_table(TABLE))
    table.blocks[NAMES.index(block)].nodes["mu_ratio"] *= factor
    return Surrogate(table, TABLE)


def test_shares_of_the_cases_are_all_there_is() -> None:
    assert math.isclose(sum(share for _, share, _ in CASES), 1.0)
    assert len({name for name, _, _ in CASES}) == len(CASES)


@pytest.mark.parametrize("case", [name for name, _, _ in CASES])
def test_drawn_points_are_legal_and_repeatable(sound: Surrogate, case: str) -> None:
    v, y = draw(case, 500, sound, seed=1)
    assert v.shape == y.shape == (500,)
    assert np.all((v > 0.0) & np.isfinite(v) & (y > 0.0) & np.isfinite(y))
    again = draw(case, 500, sound, seed=1)
    assert np.array_equal(v, again[0])
    assert np.array_equal(y, again[1])
    assert not np.array_equal(v, draw(case, 500, sound, seed=2)[0])


def test_the_builder_knows_every_quantity_of_the_kernel(sweep: Sweep) -> None:
    assert tuple(SOLVED) == QUANTITY_NAMES
    solved = sweep.solve("full", np.array([0.1, 2.0]), np.array([0.5, 0.5]))
    for name, about in SOLVED.items():
        noise = solver_noise(name, np.array([0.1, 2.0]), np.array([0.5, 0.5]), solved, np.array([False, True]))
        assert np.all((noise > 0.0) & (noise < 1e-14))
        assert not about.complement or np.all(np.abs(solved[about.complement] + solved[name] - 1.0) <= 3e-16)


def test_unknown_case_is_refused_with_the_known_ones(sound: Surrogate) -> None:
    with pytest.raises(ValueError, match=r"case must be one of random, .*, got 'easy'"):
        draw("easy", 5, sound, seed=0)


def test_cases_reach_every_block_and_the_fast_tail(sound: Surrogate) -> None:
    reached: set[str] = set()
    for name, _, _ in CASES:
        _, _, source = sound.ratio_with_bound(*draw(name, 3000, sound, seed=0))
        reached |= {SOURCES[code] for code in source}
    assert reached >= {*NAMES, "tail_fast"}


def test_report_of_a_sound_table(sound: Surrogate, sweep: Sweep) -> None:
    report = verify(sound, sweep, 1000, seed=3)
    assert report["points"] >= 1000
    assert report["not_covered"] == 0
    assert 0.0 < report["max_abs_error"] <= sound.tolerance
    assert set(report["cases"]) == {name for name, _, _ in CASES}
    assert report["max_abs_error"] == max(case["max_abs_error"] for case in report["cases"].values())
    assert report["max_rel_error"] == max(case["max_rel_error"] for case in report["cases"].values())
    assert report["max_abs_error"] == max(part["max_abs_error"] for part in report["sources"].values())
    assert report["points"] == sum(part["points"] for part in report["sources"].values())
    assert report == verify(sound, sweep, 1000, seed=3)


@pytest.mark.parametrize("block", ["continuous_mid_1", "corner"])
def test_a_block_off_by_a_millionth_is_found_and_named(block: str, sweep: Sweep) -> None:
    wrong = damaged(block, 1.0 + 1e-6)
    report = verify(wrong, sweep, 1000, seed=3)
    assert report["not_covered"] > 0
    named = report["sources"][block]
    assert named["max_rel_error"] > 5e-8
    others = [part["max_rel_error"] for name, part in report["sources"].items() if name != block]
    assert max(others) <= 10.0 * wrong.tolerance


def test_a_jump_at_a_seam_is_found(sound: Surrogate) -> None:
    assert seam_jumps(sound) <= 2e-7
    for block in ("stick_slip_mid", "continuous_high"):
        assert seam_jumps(damaged(block, 1.0 + 1e-4)) >= 9e-5


class Stepped:
    """A table whose ratio and slopes are larger by a thousandth beyond one line."""

    def __init__(self, table: Surrogate, beyond: Callable[[Surrogate, Array, Array], Array]) -> None:
        self.v_tilde_crit = table.v_tilde_crit
        self.mu_ratio = lambda v, y: table.mu_ratio(v, y) * (1.0 + 1e-3 * beyond(table, v, y))
        self.slopes = lambda v, y: [part + 1e-3 * beyond(table, v, y) for part in table.slopes(v, y)]


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


def test_a_step_in_the_wrong_direction_is_found(sound: Surrogate) -> None:
    assert monotony(sound, n=2000, lines=40) <= 1e-7
    # mu~ is too high below the border: it falls as v~ crosses the border upwards
    assert monotony(damaged("stick_slip_mid_2", 1.01), n=2000, lines=40) >= 1e-3


def test_errors_of_every_block_are_found(sound: Surrogate, sweep: Sweep) -> None:
    found = block_errors(sound, sweep, 200, seed=1)
    assert len(found) == len(CHARTS)
    for chart, block, errors in zip(CHARTS, sound.table.blocks, found, strict=True):
        assert errors.values.keys() == errors.cells.keys() == block.nodes.keys()
        for name in block.nodes:
            assert 0.0 < errors.values[name] <= block.errors[name][0], chart.name
            assert np.all((errors.cells[name] >= 0.0) & (errors.cells[name] <= block.cell_errors[name])), chart.name
        assert errors.absolute <= sound.tolerance
        assert errors.relative <= 10.0 * sound.tolerance
    wrong = block_errors(damaged("corner", 1.0 + 1e-5), sweep, 200, seed=1)[NAMES.index("corner")]
    assert wrong.values["mu_ratio"] == close(1e-5, rel=0.3)
    assert wrong.cells["mu_ratio"][:, 1:].max() > 1e-6  # the slopes are wrong by the same factor


def test_report_of_power_stick_fraction_and_slopes(sound: Surrogate, sweep: Sweep) -> None:
    report = verify(sound, sweep, 1000, seed=3)
    assert report["slopes"].keys() == {*QUANTITY_NAMES}
    slopes = [(part, "max_abs_error") for part in report["slopes"].values()]
    for part, error in ((report["power"], "max_rel_error"), (report["stick_fraction"], "max_abs_error"), *slopes):
        assert part["not_covered"] == 0
        assert part[error] > 0.0
        assert part[error] == max(source[error] for source in part["sources"].values())
        assert len(part["sources"]) > 8
    for name, error in (("power", "max_rel_error"), ("stick_fraction", "max_abs_error")):
        assert report[name][error] < 1e-5
        assert set(report[name]["sources"]) == set(report["sources"])
    assert report["slopes"]["mu_ratio"]["max_abs_error"] < 1e-5
    assert set(uncovered(report)) == {*QUANTITY_NAMES, *(f"slopes of {name}" for name in QUANTITY_NAMES)}


@pytest.mark.parametrize(
    ("key", "block"),
    [
        ("power", "continuous_mid_2"),
        ("power", "stick_slip_low"),
        ("stick_fraction", "corner"),
        ("stick_fraction", "stick_slip_high"),
    ],
)
def test_companions_off_by_a_hundred_thousandth_are_found(sweep: Sweep, key: str, block: str) -> None:
    table: Table = copy.deepcopy(read_table(TABLE))
    table.blocks[NAMES.index(block)].nodes[key] *= 1.0 + 1e-5
    wrong = Surrogate(table, TABLE)
    report = verify(wrong, sweep, 1000, seed=3)
    assert report["not_covered"] == 0
    assert report[key]["not_covered"] == uncovered(report)[key] > 0
    assert [name for name, part in report[key]["sources"].items() if part["not_covered"]] == [block]
    found = block_errors(wrong, sweep, 200, seed=1)[NAMES.index(block)]
    assert found.values[key] > 1e-6


@pytest.mark.parametrize("block", ["continuous_low", "stick_slip_mid", "stick_slip_high"])
def test_wrinkles_too_small_for_the_value_are_found_in_the_slope(sweep: Sweep, block: str) -> None:
    """Every second node off by half the stated error: values stay within their bound, slopes do not."""
    table: Table = copy.deepcopy(read_table(TABLE))
    part = table.blocks[NAMES.index(block)]
    values = part.nodes["mu_ratio"]
    values += 0.25 * part.errors["mu_ratio"][0] * (-1.0) ** np.arange(values.shape[1])
    wrong = Surrogate(table, TABLE)
    found = block_errors(wrong, sweep, 200, seed=1)[NAMES.index(block)]
    assert np.any(found.cells["mu_ratio"][:, 2] > part.cell_errors["mu_ratio"][:, 2])
    for name in part.nodes.keys() - {"mu_ratio"}:
        assert found.values[name] <= part.errors[name][0]
        assert np.all(found.cells[name] <= part.cell_errors[name])
