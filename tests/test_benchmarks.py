"""The scripts of benchmarks/: each runs, its tables are right, and results are stored where they belong."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import measuring
from builder.steady import border, solve
from comparing import close

ROOT = Path(__file__).resolve().parent.parent
Row = dict[str, str]


def run(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """One script of benchmarks/, in a separate process, from the root."""
    command = [sys.executable, str(ROOT / "benchmarks" / f"{script}.py"), *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600, check=False)


def tables(text: str) -> list[list[Row]]:
    """Every Markdown table in ``text``, rows as mappings from the header; unequal lengths are an error."""
    found: list[list[Row]] = []
    block: list[list[str]] = []
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            block.append([cell.strip() for cell in line.strip("|").split("|")])
        elif block:
            header, rule, *rows = block
            assert all(re.fullmatch(r"-+:?", cell) for cell in rule)
            found.append([dict(zip(header, row, strict=True)) for row in rows])
            block = []
    return found


def number(cell: str) -> float:
    """A printed number."""
    return float(cell.replace(",", ""))


# --- results ------------------------------------------------------------------------------------------


def test_a_result_is_stored_and_put_between_its_markers(tmp_path: Path, monkeypatch, capsys) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin times -->\n\nold\n\n<!-- end times -->\nafter\n", "utf-8")
    monkeypatch.setattr(measuring, "PAGES", (page,))
    monkeypatch.setattr(measuring, "RESULTS", tmp_path / "results")
    monkeypatch.setattr(sys, "argv", ["benchmarks/trial.py", "--write", "--points", "7"])
    sections = {"times": lambda points: f"{points} points", "other": lambda points: "elsewhere"}  # noqa: ARG005
    measuring.main(None, sections, points=5)
    stored = (tmp_path / "results" / "trial-times.md").read_text("utf-8")
    assert stored.startswith("7 points\n\nTook 0.0 min. Machine: ")
    assert page.read_text("utf-8") == f"before\n<!-- begin times -->\n\n{stored}\n<!-- end times -->\nafter\n"
    assert (tmp_path / "results" / "trial-other.md").exists()
    assert "## other\n\nelsewhere" in capsys.readouterr().out


@pytest.mark.parametrize("short", ["--quick", "--share=0.5"])
def test_short_runs_are_never_stored(short: str, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["trial.py", "--write", short])
    with pytest.raises(SystemExit):
        measuring.main(None, {}, quick=False, share=1.0)
    assert "--write stores full runs only" in capsys.readouterr().err


# --- the model ----------------------------------------------------------------------------------------

SLOW = {"model", "angles", "slow_angle", "stiffness", "blocks", "layer", "settle", "cusp", "creep"}
SECTIONS = [
    pytest.param(script, name, id=f"{script}-{name}", marks=[pytest.mark.slow] if name in SLOW else [])
    for script in ("validation", "validity", "model_facts", "hard_cases")
    for name in importlib.import_module(f"benchmarks.{script}").SECTIONS
]


@pytest.mark.parametrize(("script", "section"), SECTIONS)
def test_a_section_is_a_table_of_finite_numbers(script: str, section: str) -> None:
    found = tables(importlib.import_module(f"benchmarks.{script}").SECTIONS[section]())
    assert found
    assert all(found)
    assert not {"nan", "inf", "-inf"} & {cell for table in found for row in table for cell in row.values()}


def test_the_solver_beats_every_naive_number() -> None:
    hard = importlib.import_module("benchmarks.hard_cases")
    (roots,) = tables(hard.double_root())
    assert number(roots[-1]["its rel error"]) > 0.1  # 1 - 1 shortly after the onset
    assert max(number(row["rel error, root divided out"]) for row in roots) < 1e-13
    (ends,) = tables(hard.surplus())
    assert number(ends[1]["max rel error"]) < 1e-14 < number(ends[0]["max rel error"])
    (rounded,) = tables(hard.exact_eta())
    assert number(rounded[-1]["rel change of mu~ by rounding y~"]) > 1e-8


def test_the_loss_halves_at_the_second_step() -> None:
    # mu~ approaches 1 around v~ = 1
    assert solve(1.0, 0.1).deficit / (1.0 - border(0.1)[1]) == close(0.5, abs=0.002)


# --- speed --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def speed() -> list[list[Row]]:
    """The tables that a quick comparison prints."""
    done = run("speed_against_error", "--quick", "--rounds", "1")
    assert done.returncode == 0, done.stderr
    return tables(done.stdout)


@pytest.mark.slow
def test_tables_keep_their_tolerance_where_plain_grids_do_not(speed: list[list[Row]]) -> None:
    comparison, single, quantities = speed
    assert len(single) == 4
    for row in comparison:
        name = row["method"].strip("*")
        assert number(row["ns/point"]) > 0.0
        if name.startswith("mumacro-"):
            tolerance = float(name.removeprefix("mumacro-"))
            assert 0.0 < number(row["max abs error"]) <= tolerance
            assert number(row["max rel error"]) <= 10.0 * tolerance
        elif " x " in row["data"]:
            assert number(row["max abs error"]) > 1e-3, "24 and 48 nodes a side cannot follow the border"
    for path in (ROOT / "tables").glob("*.nc"):
        names = [row["method"] for row in comparison]
        assert names.count(f"**{path.stem}**") == 2, "one thread and all cores"
    for row in quantities:
        assert row["max bound"] == "-" or number(row["max error"]) <= number(row["max bound"])


@pytest.mark.slow
def test_linear_peers_agree_with_each_other(speed: list[list[Row]]) -> None:
    linear = ("RegularGridInterpolator linear", "map_coordinates order 1", "interpn linear", "xarray interp linear")
    for size in ("24 x 24", "48 x 48"):
        errors = {
            (row["max abs error"], row["max rel error"])
            for row in speed[0]
            if row["data"] == size and row["method"].endswith(linear)
        }
        assert len(errors) == 1, "the same grid, the same interpolant"


@pytest.mark.slow
def test_solver_script_prints_its_tables() -> None:
    done = run("solver", "--quick", "--rounds", "1")
    assert done.returncode == 0, done.stderr
    regimes, accuracy, marching, slowing = tables(done.stdout)
    assert [row["regime"] for row in regimes] == ["all", "continuous", "stick-slip"]
    assert sum(number(row["points"]) for row in regimes) == 2 * 500
    total = accuracy[-1]
    assert number(total["points"]) == 496
    assert number(total["max abs error"]) < 1e-15
    assert number(total["failed"]) == 0
    assert 0.0 < number(marching[0]["max abs error"]) < 1e-6
    assert number(slowing[1]["cycles"]) > number(slowing[0]["cycles"])


@pytest.mark.slow
@pytest.mark.parametrize("script", ["calls --quick", "c_header --quick", "cold_start --quick", "files --rows 20000"])
def test_a_script_prints_positive_times(script: str) -> None:
    done = run(*script.split())
    assert done.returncode == 0, done.stderr
    for table in tables(done.stdout):
        for row in table:
            assert number(list(row.values())[-1 if "files" in script else 1]) > 0.0


@pytest.mark.slow
def test_picture_of_the_surface_is_drawn(tmp_path: Path) -> None:
    done = run("surface", str(tmp_path / "surface.png"))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "surface.png").read_bytes().startswith(b"\x89PNG")


# --- tables/README.md ---------------------------------------------------------------------------------


def test_the_page_of_the_tables_is_what_its_script_prints() -> None:
    from benchmarks.tables_readme import tables as printed

    page = (ROOT / "tables" / "README.md").read_text("utf-8")
    section = page.split("<!-- begin tables -->")[1].split("<!-- end tables -->")[0]
    assert printed(build=False, workers=2).strip() in section
