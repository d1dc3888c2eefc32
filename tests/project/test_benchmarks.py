"""The scripts of benchmarks/: each runs, its tables are right, and results are stored where they
belong."""

import re
import subprocess
import sys
from collections.abc import Callable
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


PICTURES = [path.stem for path in (ROOT / "docs" / "img").glob("hard-*.png")]
SLOW = {"gallery", "model", "angles", "stiffness", "cusp", "creep"}
SECTIONS = [
    pytest.param(section, id=f"{script}-{name}", marks=[pytest.mark.slow] if name in SLOW else [])
    for script in ("validation", "validity", "model_facts", "hard_cases")
    for name, section in loaded(f"benchmarks.{script}").SECTIONS.items()
]


def column(rows: list[Row], name: str) -> list[float]:
    """The numbers of a column, without what is not defined."""
    return [float(row[name].replace(",", "")) for row in rows if row[name] != "-"]


def alike(rows: list[Row], one: str, two: str, share: float) -> bool:
    """Whether two columns differ by no more than a share."""
    pairs = zip(column(rows, one), column(rows, two), strict=True)
    return all(abs(x - y) <= share * abs(y) for x, y in pairs)


#: what the first table of a section shows, for which it was written
SHOWN: dict[str, Callable[[list[Row]], bool]] = {
    "validation-model": lambda rows: column(rows, "largest difference of mu~")[0] <= 2e-16,
    "validation-large_amplitudes": lambda rows: column(rows, "(35) too low by")[-1] < 2e-5,
    "validation-normal_oscillation": lambda rows: (
        {row["both ends off by"] for row in rows} == {"< 1e-14"}
    ),
    "validity-partial_slip": lambda rows: (
        max(column(rows, "largest difference of mu~, ball and one spring")) < 0.5
    ),
    "model_facts-limits": lambda rows: abs(column(rows, "y~/v~crit^2")[-1] - 4.402914) < 1e-5,
    "model_facts-creep": lambda rows: alike(rows, "slope derived", "slope solved", 1e-4),
    "model_facts-contact": lambda rows: all(
        abs(share - 1.0) < 3e-3 for share in column(rows, "over (3/pi) sqrt(2 e/lam'')")
    ),
    "hard_cases-grazing": lambda rows: column(rows, "of 101 samples below 0")[-1] == 0.0,
    "hard_cases-surplus": lambda rows: column(rows, "surplus taken out")[0] <= 1e-15,
    "hard_cases-double_root": lambda rows: (
        max(column(rows, "rel error, root divided out")) <= 4e-16
        and max(column(rows, "its rel error")) > 1.0
    ),
    "hard_cases-exact_eta": lambda rows: (
        max(column(rows, "rel change of mu~ by rounding y~")) > 1e-9
    ),
    "hard_cases-cusp": lambda rows: (
        column(rows, "mu~/phi on (R, psi)")[-1]
        < 1e-14
        < 0.01
        < column(rows, "mu~ on (ln v~, ln y~)")[-1]
    ),
    "hard_cases-small_amplitude": lambda rows: max(column(rows, "rel error of 1 - fl(mu~)")) == 1.0,
    "hard_cases-short_stick": lambda rows: (
        max(column(rows, "rel change of the slip's share of mu~, far turn")) > 1e-12
    ),
    "hard_cases-stiffness": lambda rows: max(column(rows, "steps here")) < 30.0,
    "hard_cases-gallery": lambda rows: (
        set(column(rows, "% within the bound")) == {100.0}
        and max(column(rows, "largest error")) < 1e-9
        and len(rows) == len(PICTURES)
    ),
}


@pytest.mark.parametrize("section", SECTIONS)
def test_a_section_prints_its_tables(
    section: Any,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    name = request.node.callspec.id
    # its pictures are not put into docs
    module = loaded(f"benchmarks.{name.partition('-')[0]}")
    monkeypatch.setattr(module, "IMAGES", tmp_path, raising=False)
    first, *_ = tables(section())
    assert name not in SHOWN or SHOWN[name](first), first


def test_what_is_shown_is_shown_by_a_section() -> None:
    assert SHOWN.keys() <= {section.id for section in SECTIONS}


TIMES = [("calls --quick", "[us]"), ("c_header --quick", "ns/point")]
TIMES += [("solver --quick", "mean, microseconds")]


@pytest.mark.slow
@pytest.mark.parametrize(("script", "name"), TIMES)
def test_a_script_prints_times(script: str, name: str) -> None:
    times = column(run(*script.split())[0], name)
    assert len(times) > 2
    assert min(times) > 0.0


@pytest.mark.slow
def test_the_errors_that_are_printed_are_within_their_bounds() -> None:
    (rows,) = run("error_distribution", "--share", "0.002")
    assert min(column(rows, "bound/error, least")) >= 1.0


def kept(rows: list[Row], name_in: str, least: float) -> list[str]:
    """The tables among the rows, whose errors are within their tolerance, or ``least``; no grid of
    24 or 48 nodes a side follows the border."""
    names = []
    for row in rows:
        if row["max abs error"] == "-":
            continue
        name, error = row[name_in].strip("*"), float(row["max abs error"])
        if name.startswith("mumacro-"):
            assert 0.0 < error <= max(float(name.removeprefix("mumacro-")), least), row
            names.append(name)
        assert " x " not in row["data"] or error > 1e-3, row
    return sorted(names)


TABLES = sorted(path.stem for path in (ROOT / "tables").glob("*.nc"))


@pytest.mark.slow
def test_tables_keep_their_tolerance_where_plain_grids_do_not() -> None:
    """In C and in NumPy, and those of a ball."""
    words = "--quick", "--rounds", "1"
    (rows,) = run("speed_against_error", *words, "--only", "speed")
    assert kept(rows, "data", 1e-12) == sorted(2 * TABLES)
    # the ball of the finest table is one of 1e-10
    (balls,) = run("speed_against_error", *words, "--only", "ball_speed_against_error")
    assert kept(balls, "method", 1e-10) == TABLES


@pytest.mark.slow
def test_blocks_converge_and_tails_join_within_their_bounds() -> None:
    words = "--quick", "--rounds", "1"
    (rows,) = run("speed_against_error", *words, "--only", "convergence")
    built = {
        float(row["built for"].removeprefix("blocks, ")): float(row["max abs error"])
        for row in rows
        if row["built for"].startswith("blocks")
    }
    assert all(0.0 < error <= tolerance for tolerance, error in built.items())
    _, joins = run("speed_against_error", *words, "--only", "tails")
    assert max(column(joins, "largest jump over both bounds")) <= 1.0
    (blocks,) = run("speed_against_error", *words, "--only", "error_map")
    for row in blocks:
        assert float(row["largest"]) <= float(row["largest bound"])


def test_the_first_page_has_the_numbers_of_the_page_on_speed() -> None:
    """All are of one run."""
    (first,) = tables(marked("README.md", "speed_against_error-headline"))
    rows = tables(marked("docs/speed-and-error.md", "speed"))[0]
    ours, peer, direct = first
    by_method = {(row["method"], row["data"]): row for row in rows}
    for row, key in (
        (ours, ("blocks in C, with bound", "mumacro-1e-12")),
        (peer, ("scipy RectBivariateSpline.ev k=3", "1024 x 1024")),
        (direct, ("one solve of the full model", "compiled")),
    ):
        there = by_method[key]
        assert (row["ns a point"], row["largest error"]) == (
            there["ns/point"],
            there["max abs error"],
        )


def marked(page: str, name: str) -> str:
    """What stands between the markers of a section."""
    text = (ROOT / page).read_text("utf-8")
    return re.split(rf"<!-- begin {name}(?:, table)? -->", text)[1].split(f"<!-- end {name} -->")[0]


def test_the_figures_of_one_page_are_of_one_machine() -> None:
    page = (ROOT / "docs" / "speed-and-error.md").read_text("utf-8")
    machines = re.findall(r"^Took .* min\. Machine: (.*?), load average", page, re.MULTILINE)
    # sections state the packages that were loaded so far
    assert len(machines) == page.count("<!-- begin ")
    assert len({re.split(r", numpy ", machine)[0] for machine in machines}) == 1


@pytest.mark.slow
def test_picture_of_the_surface_is_drawn(tmp_path: Path) -> None:
    assert run("surface", str(tmp_path / "surface.png")) == []
    assert (tmp_path / "surface.png").read_bytes().startswith(b"\x89PNG")


def test_the_pictures_of_the_set_ups_are_the_sketch_of_the_page(tmp_path: Path) -> None:
    """They are written anew where the sketch has changed: python benchmarks/setups.py."""
    assert run("setups", str(tmp_path)) == []
    for name in ("setup.svg", "setups.svg"):
        assert (tmp_path / name).read_bytes() == (ROOT / "docs" / "img" / name).read_bytes()
