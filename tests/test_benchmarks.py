"""The scripts behind docs/benchmarks.md: they run, their tables are right, and the page contains them."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks.md"
PAGES = {
    "solver": PAGE,
    "speed_against_error": PAGE,
    "build_cost": PAGE,
    "cold_start": PAGE,
    "scale": ROOT / "docs" / "scale.md",
}
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


@pytest.fixture(scope="module")
def printed() -> str:
    """The output of a quick comparison."""
    done = run("speed_against_error", "--quick", "--rounds", "1")
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def speed(printed: str) -> list[list[Row]]:
    """The tables that a quick comparison prints."""
    return tables(printed)


def test_comparison_has_a_row_for_every_method(speed: list[list[Row]]) -> None:
    names = [row["method"] for row in speed[0]]
    for path in (ROOT / "tables").glob("*.nc"):
        assert names.count(f"**{path.stem}**") == 2, "one thread and all cores"
    for peer in (
        "scipy RegularGridInterpolator linear",
        "scipy RegularGridInterpolator cubic, spsolve",
        "scipy NdBSpline k=5",
        "scipy RectBivariateSpline.ev k=3",
        "scipy map_coordinates order 5",
        "scipy interpn linear",
        "xarray interp linear",
    ):
        assert names.count(peer) == 2, f"{peer}: one row for each of the two grids"
    assert names.count("eq. (35), rigid contact") == 1
    assert names.count("direct solve of the full model") == 1
    assert names.count("scipy solve_ivp, marched") == 1


def test_tables_keep_their_tolerance_where_plain_grids_do_not(speed: list[list[Row]]) -> None:
    for row in speed[0]:
        name = row["method"].strip("*")
        if name.startswith("mumacro-"):
            tolerance = float(name.removeprefix("mumacro-"))
            assert 0.0 < number(row["max abs error"]) <= tolerance
            assert number(row["max rel error"]) <= 10.0 * tolerance
        elif " x " in row["data"] and name.startswith(("scipy", "xarray")):
            assert number(row["max abs error"]) > 1e-3, "24 and 48 nodes a side cannot follow the border"
    by_name = {row["method"]: row for row in speed[0]}
    assert number(by_name["direct solve of the full model"]["max abs error"]) < 1e-15
    assert 0.5 < number(by_name["eq. (35), rigid contact"]["max abs error"]) <= 1.0


def test_comparison_times_every_row(speed: list[list[Row]]) -> None:
    comparison, single, batch, quantities = speed
    assert all(number(row["ns/point"]) > 0.0 for row in comparison + batch)
    assert all(number(row["microseconds"]) > 0.0 for row in single)
    assert len(single) == 4
    assert len(batch) == 12  # two tables, three kinds of columns, one thread and all cores
    assert len(quantities) == 4 * 4  # four tables: gradient, power, stick fraction, inverse question


def test_errors_of_the_other_quantities_lie_below_their_largest_bound(speed: list[list[Row]]) -> None:
    for row in speed[3]:
        assert number(row["ns/point"]) > 0.0
        assert row["max bound"] == "-" or number(row["max error"]) <= number(row["max bound"])


def test_a_peer_that_is_not_installed_is_named(printed: str, speed: list[list[Row]]) -> None:
    names = [row["method"] for row in speed[0]]
    for package in ("CoolProp", "baobzi", "interpolation"):
        answered = any(name.startswith(package) for name in names)
        assert answered != (f"\n- {package}: " in printed), "either a row or a reason"


def test_verdict_follows_from_the_rows(printed: str, speed: list[list[Row]]) -> None:
    found = re.search(r"both faster and closer than (\d+) of the (\d+) peers", printed)
    assert found
    beaten, peers = map(int, found.groups())
    assert peers == sum(
        " x " in r["data"] or r["data"].startswith("tol") or r["data"] == "formula" for r in speed[0]
    ) - ("CoolProp BICUBIC, its own function" in printed)
    assert 0 <= beaten <= peers


def test_linear_peers_agree_with_each_other(speed: list[list[Row]]) -> None:
    linear = ("RegularGridInterpolator linear", "map_coordinates order 1", "interpn linear", "xarray interp linear")
    for size in ("24 x 24", "48 x 48"):
        errors = {
            (row["max abs error"], row["max rel error"])
            for row in speed[0]
            if row["data"] == size and row["method"].endswith(linear)
        }
        assert len(errors) == 1, "the same grid, the same interpolant"


def test_solver_script_prints_its_tables() -> None:
    done = run("solver", "--quick", "--points", "200", "--rounds", "1")
    assert done.returncode == 0, done.stderr
    regimes, accuracy, marching, slowing = tables(done.stdout)
    assert [row["regime"] for row in regimes] == ["all", "continuous", "stick-slip"]
    assert sum(number(row["points"]) for row in regimes) == 2 * 200
    total = accuracy[-1]
    assert total["kind of point"] == "all"
    assert number(total["points"]) == 496
    assert number(total["max abs error"]) < 1e-15
    assert number(total["failed"]) == 0
    assert 0.0 < number(marching[0]["max abs error"]) < 1e-6
    assert number(slowing[1]["cycles"]) > number(slowing[0]["cycles"])


def test_build_cost_script_prints_its_tables() -> None:
    done = run("build_cost", "--quick", "--workers", "1")
    assert done.returncode == 0, done.stderr
    (built,), plain = tables(done.stdout)
    assert built["tolerance"] == "1e-03"
    assert number(built["verified max abs error"]) <= 1e-3
    assert number(built["solves, nodes"]) < number(built["solves, all"])
    assert [row["plain grid"] for row in plain] == ["24 x 24", "48 x 48"]
    assert number(plain[0]["max abs error"]) > number(plain[1]["max abs error"])


def test_cold_start_script_prints_its_table() -> None:
    done = run("cold_start", "--quick")
    assert done.returncode == 0, done.stderr
    ((row,),) = tables(done.stdout)
    assert number(row["time [s]"]) > 0.0
    assert number(row["processor time [s]"]) > 0.0
    assert 10.0 < number(row["memory [MB]"]) < 1000.0


def test_picture_of_the_surface_is_drawn(tmp_path: Path) -> None:
    out = tmp_path / "surface.png"
    done = run("surface", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("script", PAGES)
def test_quick_runs_are_never_written_down(script: str) -> None:
    before = PAGES[script].read_bytes()
    done = run(script, "--quick", "--write")
    assert done.returncode == 2
    assert "--quick cannot be combined with --write" in done.stderr
    assert PAGES[script].read_bytes() == before


@pytest.mark.parametrize("script", PAGES)
def test_page_holds_a_full_section_of_each_script(script: str) -> None:
    page = PAGES[script].read_text(encoding="utf-8")
    section = page.split(f"<!-- begin {script} -->")[1].split(f"<!-- end {script} -->")[0]
    assert section.strip().startswith("Machine: "), "what is timed says where"
    found = tables(section)
    assert found
    assert all(found)


def test_page_links_pictures_that_exist() -> None:
    links = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", PAGE.read_text(encoding="utf-8"))
    assert links
    for link in links:
        assert (PAGE.parent / link).read_bytes().startswith(b"\x89PNG"), link


def test_sections_on_the_page_name_the_committed_tables() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for path in (ROOT / "tables").glob("*.nc"):
        assert f"**{path.stem}**" in page
