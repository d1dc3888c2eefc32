"""The verifier must find what is wrong with a table; a judge that always says yes proves nothing."""

import copy
import math
from pathlib import Path

import numpy as np
import pytest

from builder.sweep import Sweep
from builder.verify import CASES, block_errors, draw, monotony, seam_jumps, verify
from friction import Surrogate
from friction.regions import BLOCK_INDEX, BLOCKS, NAMES, SOURCES
from friction.table import Table, read_table

TABLE = Path(__file__).parent.parent / "tables" / "mumacro-1e-7.nc"


@pytest.fixture(scope="module")
def sound() -> Surrogate:
    return Surrogate.open(TABLE)


def damaged(block: str, factor: float) -> Surrogate:
    """The same table with one block's values multiplied by ``factor``."""
    table: Table = copy.deepcopy(read_table(TABLE))
    table.blocks[BLOCK_INDEX[block]].values *= factor
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


def test_a_step_in_the_wrong_direction_is_found(sound: Surrogate) -> None:
    assert monotony(sound, n=2000, lines=40) <= 1e-7
    # mu~ too high below the border: it falls where v~ rises across it
    assert monotony(damaged("stick_slip_mid_2", 1.01), n=2000, lines=40) >= 1e-3


def test_errors_of_every_block_are_found(sound: Surrogate, sweep: Sweep) -> None:
    found = block_errors(sound, sweep, 200, seed=1)
    assert len(found) == len(BLOCKS)
    for spec, block, errors in zip(BLOCKS, sound.table.blocks, found, strict=True):
        assert 0.0 <= errors.quantity <= block.quantity_error, spec.name
        assert errors.absolute <= sound.tolerance
        assert errors.relative <= 10.0 * sound.tolerance
        assert 0.0 <= errors.power <= block.power_error, spec.name
        assert 0.0 <= errors.stick <= (block.stick_error or 0.0), spec.name
    wrong = damaged("corner", 1.0 + 1e-5)
    quantity = block_errors(wrong, sweep, 200, seed=1)[BLOCK_INDEX["corner"]].quantity
    assert quantity == pytest.approx(1e-5, rel=0.3)


def test_report_of_power_and_stick_fraction(sound: Surrogate, sweep: Sweep) -> None:
    report = verify(sound, sweep, 1000, seed=3)
    for key, error in (("power", "max_rel_error"), ("stick_fraction", "max_abs_error")):
        part = report[key]
        assert part["not_covered"] == 0
        assert 0.0 < part[error] < 1e-5
        assert part[error] == max(source[error] for source in part["sources"].values())
        assert set(part["sources"]) == set(report["sources"])


@pytest.mark.parametrize(
    ("key", "nodes", "block"),
    [
        ("power", "power", "continuous_mid_2"),
        ("power", "power", "stick_slip_low"),
        ("stick_fraction", "stick", "corner"),
        ("stick_fraction", "stick", "stick_slip_high"),
    ],
)
def test_companions_off_by_a_hundred_thousandth_are_found(sweep: Sweep, key: str, nodes: str, block: str) -> None:
    table: Table = copy.deepcopy(read_table(TABLE))
    values = getattr(table.blocks[BLOCK_INDEX[block]], nodes)
    values *= 1.0 + 1e-5
    wrong = Surrogate(table, TABLE)
    report = verify(wrong, sweep, 1000, seed=3)
    assert report["not_covered"] == 0
    assert report[key]["not_covered"] > 0
    assert [name for name, part in report[key]["sources"].items() if part["not_covered"]] == [block]
    found = block_errors(wrong, sweep, 200, seed=1)[BLOCK_INDEX[block]]
    assert (found.power if key == "power" else found.stick) > 1e-6


def test_a_table_without_bounds_is_not_blamed_for_it(sweep: Sweep) -> None:
    table: Table = copy.deepcopy(read_table(TABLE))
    for block in table.blocks:
        block.power_error = block.stick_error = None
    report = verify(Surrogate(table, TABLE), sweep, 300, seed=3)
    assert report["power"]["not_covered"] is report["stick_fraction"]["not_covered"] is None
    assert report["power"]["max_rel_error"] > 0.0
