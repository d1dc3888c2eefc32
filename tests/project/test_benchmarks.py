"""The scripts of benchmarks/: each runs, its tables are right, and results are stored where they
belong."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support import measuring
from tests.support.cases import Capture
from tests.support.places import ROOT
from tests.support.scripts import script as loaded

Row = dict[str, str]


def run(script: str, *arguments: str) -> list[list[Row]]:
    """The tables that a script of benchmarks/ prints, in a separate process, from the root."""
    command = [sys.executable, str(ROOT / "benchmarks" / f"{script}.py"), *arguments]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    return tables(done.stdout)


def tables(text: str) -> list[list[Row]]:
    """Every Markdown table in ``text``, rows as mappings from the header; unequal lengths are an
    error."""
    result: list[list[Row]] = []
    for block in re.findall(r"(?:^\|.*\n?)+", text, re.MULTILINE):
        header, rule, *rows = (
            [cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines()
        )
        assert all(re.fullmatch(r"-+:?", cell) for cell in rule)
        result.append([dict(zip(header, row, strict=True)) for row in rows])
    return result


def test_a_result_is_put_between_its_markers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin times -->\n\nold\n\n<!-- end times -->\nafter\n", "utf-8")
    other = tmp_path / "other.md"
    empty = "<!-- begin trial-other, table -->\n\n{}\n\n<!-- end trial-other -->\n"
    other.write_text(empty.format("old"), "utf-8")
    monkeypatch.setattr(measuring, "PAGES", (page, other))
    monkeypatch.setattr(measuring, "RESULTS", tmp_path / "results")
    monkeypatch.setattr(sys, "argv", ["benchmarks/trial.py", "--write", "--points", "7"])
    sections = {
        "times": lambda points: f"{points} points",
        "other": lambda points: "| elsewhere |\n| --- |\n| 1 |\n\nIn words.",  # noqa: ARG005
    }
    measuring.main(None, sections, points=5)
    stored = (tmp_path / "results" / "trial-times.md").read_text("utf-8")
    assert stored.startswith("7 points\n\nTook 0.0 min. Machine: ")
    assert (
        page.read_text("utf-8")
        == f"before\n<!-- begin times -->\n\n{stored}\n<!-- end times -->\nafter\n"
    )
    assert (tmp_path / "results" / "trial-other.md").exists()
    assert other.read_text("utf-8") == empty.format("| elsewhere |\n| --- |\n| 1 |")
    assert "## other\n\n| elsewhere" in capsys.readouterr().out
    for short in ("--quick", "--share=0.5"):  # short runs are never stored
        monkeypatch.setattr(sys, "argv", ["trial.py", "--write", short])
        with pytest.raises(SystemExit):
            measuring.main(None, {}, quick=False, share=1.0)
        assert "--write stores full runs only" in capsys.readouterr().err


def test_the_page_of_the_tables_is_what_its_script_prints() -> None:
    page = (ROOT / "tables" / "README.md").read_text("utf-8")
    section = page.split("<!-- begin tables -->")[1].split("<!-- end tables -->")[0]
    assert loaded("benchmarks.tables_readme").tables(build=False, workers=2).strip() in section


SLOW = {"model", "angles", "stiffness", "cusp", "creep"}
SECTIONS = [
    pytest.param(section, id=f"{script}-{name}", marks=[pytest.mark.slow] if name in SLOW else [])
    for script in ("validation", "validity", "model_facts", "hard_cases")
    for name, section in loaded(f"benchmarks.{script}").SECTIONS.items()
]


def check(tables: list[list[Row]]) -> None:
    assert tables
    assert all(tables)
    assert not {"nan", "inf", "-inf"} & {
        cell for table in tables for row in table for cell in row.values()
    }


@pytest.mark.parametrize("section", SECTIONS)
def test_a_section_is_a_table_of_finite_numbers(section: Any) -> None:
    check(tables(section()))


SCRIPTS = ["calls --quick", "c_header --quick", "solver --quick"]
SCRIPTS += ["error_distribution --share 0.002"]


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS)
def test_a_script_prints_tables_of_finite_numbers(script: str) -> None:
    check(run(*script.split()))


@pytest.mark.slow
@pytest.mark.parametrize(("script", "least"), [("speed_against_error", 1e-12), ("ball", 1e-10)])
def test_tables_keep_their_tolerance_where_plain_grids_do_not(script: str, least: float) -> None:
    """The ball of the finest table is one of 1e-10."""
    (comparison,) = run(script, "--quick", "--rounds", "1")
    check([comparison])
    names = []
    for row in comparison:
        if row["max abs error"] == "-":
            continue
        name, error = row["method"].strip("*"), float(row["max abs error"])
        if name.startswith("mumacro-"):
            assert 0.0 < error <= max(float(name.removeprefix("mumacro-")), least)
            names.append(name)
        assert " x " not in row["data"] or error > 1e-3, (
            "24 and 48 nodes a side cannot follow the border"
        )
    assert sorted(names) == sorted(path.stem for path in (ROOT / "tables").glob("*.nc"))


@pytest.mark.slow
def test_picture_of_the_surface_is_drawn(tmp_path: Path) -> None:
    assert run("surface", str(tmp_path / "surface.png")) == []
    assert (tmp_path / "surface.png").read_bytes().startswith(b"\x89PNG")


def test_the_picture_of_the_set_ups_is_the_sketch_of_the_page(tmp_path: Path) -> None:
    """It is written anew where the sketch has changed: python benchmarks/setups.py."""
    assert run("setups", str(tmp_path / "setups.svg")) == []
    drawn = (tmp_path / "setups.svg").read_bytes()
    assert drawn == (ROOT / "docs" / "img" / "setups.svg").read_bytes()
