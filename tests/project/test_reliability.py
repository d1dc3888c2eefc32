"""Samples of the trials that the scripts in fuzz/ run in full."""

import csv
import math
import random
from decimal import Decimal, localcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.solver.steady import Y_RANGE, solve
from mumacro import Surrogate
from mumacro.closed_forms import outer
from mumacro.files import evaluate_files
from tests.support import cases as ordinary
from tests.support.cases import Case
from tests.support.scripts import script

pytest.importorskip("pyarrow", reason="the extra files is not installed")

answers, faults, tables = map(script, ("fuzz.answers", "fuzz.faults", "fuzz.tables"))
ANOTHER, HARMLESS, HOSTILE = tables.ANOTHER, tables.HARMLESS, tables.HOSTILE
SMALLEST = tables.SMALLEST


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Every hostile file, opened by another process that may use 256 MB."""
    return dict(zip(HOSTILE, tables.opened(tmp_path_factory.mktemp("hostile")), strict=True))


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_before_memory_is_taken(
    opened: dict[str, Any], name: str
) -> None:
    result = opened[name]
    assert result.what == (
        "differs" if name in ANOTHER else "same" if name in HARMLESS else "refused"
    ), result
    assert result.megabytes < 32.0


@pytest.mark.parametrize("change", tables.CHANGES)
def test_damaged_files_are_refused_or_answer_the_same(change: str) -> None:
    size = SMALLEST.stat().st_size
    images: dict[int, bytes] = {}
    for start in range(0, size, 4096 if change == "cut" else 2411):
        images.update(tables.work(start, 1, change))
    assert len(images) > 30
    result = [tables.outcome(image, Path(f"{start}.nc")) for start, image in images.items()]
    assert {one.what for one in result} <= {tables.REFUSED, tables.SAME}, result
    # the rest is in room that HDF5 leaves empty
    assert sum(one.what == tables.REFUSED for one in result) > 0.6 * len(result)


table = ordinary.tables(1e-4, 1e-12)


SLOW: dict[object, list[Any]] = {answers.fresh_solves: [pytest.mark.slow]}
PROMISES = [
    pytest.param(check, id=name, marks=SLOW.get(check, []))
    for name, check in answers.PROMISES.items()
]


@pytest.mark.parametrize("check", PROMISES)
def test_answers_have_their_properties_over_the_full_double_range(
    table: Surrogate, check: Any
) -> None:
    result = check(table, 0.02)
    assert result.cases >= 500
    assert result.broken == 0


@pytest.mark.parametrize("x", [0.6, 1.18, 2.68, 30.0, 54.0, 55.0, 125.0, 250.0])
@pytest.mark.parametrize("y", [1e120, 1e149, 1e151, 1e181, 1e198, 1e202, 1e241, 1e296, 1e304])
def test_layers_at_the_largest_amplitudes_depend_on_one_number(
    table: Surrogate, x: float, y: float
) -> None:
    """(mu~ - f(r)) r = G(v~/sqrt y~); f was taken without a logarithm above 1e200, G was left out
    above 1e150."""
    last = Y_RANGE[1]  # where G is solved

    def expected(v: float, y: float) -> float:
        r = np.sqrt(last) / (v / np.sqrt(y))
        layer = (solve(last / r, last).mu_ratio - float(outer(r))) * r
        return float(outer(y / v) + layer * (v / y))

    v = x * np.sqrt(y)
    result, bound, _ = table.quantity("mu_ratio", v, y)
    assert abs(result - expected(v, y)) <= bound + 1e-14 * result
    along_v, along_y, error_v, error_y = table.slopes(v, y, bounds=True)[1:]
    near = {h: (expected(v * (1.0 + h), y), expected(v, y * (1.0 + h))) for h in (-1e-4, 1e-4)}
    noise = 1e-7 * result  # error of the differences
    assert abs(along_v - (near[1e-4][0] - near[-1e-4][0]) / 2e-4) <= error_v + noise
    assert abs(along_y - (near[1e-4][1] - near[-1e-4][1]) / 2e-4) <= error_y + noise


def test_a_ratio_beyond_double_range_is_bounded(table: Surrogate) -> None:
    """y0 omega/v0 beyond double range: eq. (35) is 2.5e-306 there, not 0."""
    case: Case = {"mu0": 1.0, "Fz": 1.0, "k": "rigid", "y0": 1.7976931348623157e308, "v0": 1e160}
    inside, beyond = (
        table.evaluate(**case, omega=omega) for omega in (1e160, np.nextafter(1e160, 1e161))
    )
    assert inside.mu_ratio > 2.5e-306
    assert abs(inside.mu_ratio - beyond.mu_ratio) <= inside.error_bound + beyond.error_bound


def digits(chance: random.Random) -> str:
    """Any positive double by its bits, or the point half way between two, in all its digits."""
    x = float(np.uint64(chance.randrange(1, 0x7FEFFFFFFFFFFFFF)).view(np.float64))
    with localcontext(prec=1200):
        half_way = str((Decimal(x) + Decimal(math.nextafter(x, math.inf))) / 2)
    texts = (
        repr(x),
        f"{x:.16e}",
        half_way,
        half_way.replace("E", "1E"),
        repr(5e-324 * chance.randrange(1, 2**52)),
    )
    return chance.choice(texts)


WRONG = (
    *(
        " ",
        "-",
        ".",
        "e5",
        "1e",
        "0x10",
        "1_000",
        "1,5,5",
        "1.2.3",
        "--1",
        "1e5.5",
        "one",
        "1 2",
        "∞",
        "1f",
    ),
    *("½", "true", "[1]", "+-1", "'1'", "1-", "1e400", "0e0", "-1.5", "1e-400"),
)


@pytest.mark.parametrize("right", [True, False])
def test_numbers_in_text_have_the_bits_of_float_or_are_refused(tmp_path: Path, right: bool) -> None:
    """Without oscillation mu_macro is mu0."""
    chance = random.Random(5)  # noqa: S311
    texts = [digits(chance) for _ in range(5000)] if right else [*WRONG]
    source, out = tmp_path / "cases.csv", tmp_path / "out.csv"
    lines = ["mu0,Fz,k,y0,omega,v0", *(f'"{text}",1,1,0,0,1' for text in texts)]
    source.write_text("\n".join(lines), "utf-8")
    evaluate_files([source], out, Surrogate.open(1e-4))
    with out.open(encoding="utf-8", newline="") as rows:
        result = [float(row["mu_macro"]) for row in csv.DictReader(rows)]
    assert result == [float(text) for text in texts if right]


@pytest.mark.slow
@pytest.mark.parametrize("name", faults.QUICK)
def test_a_fault_loses_no_data(name: str) -> None:
    what, report = faults.outcome_of(faults.FAULTS[name])
    if what == "not tried":
        pytest.skip(report)
    assert what == "held", report
