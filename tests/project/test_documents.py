"""Documents: links lead somewhere, formulas survive GitHub, metadata and stated figures agree with
the code."""

import math
import re
import subprocess
import sys
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from builder.approximations import BORDERS, border_speeds
from mumacro import Surrogate, __version__, law
from mumacro.cli.main import COMMANDS
from tests.project.test_benchmarks import tables
from tests.support import extended
from tests.support.cases import UNIT
from tests.support.comparing import close
from tests.support.documents import PAGES
from tests.support.places import ROOT
from tests.support.scripts import script

DOCS = ROOT / "docs"
error_distribution, validation, validity = (
    script(f"benchmarks.{name}") for name in ("error_distribution", "validation", "validity")
)
LINK = re.compile(r"\]\(([^)\s]+)\)")
CODE = re.compile(
    r"^```.*?^```$|^(?:    .*\n)+|<!-- begin .*?<!-- end|`[^`\n]+`|<!--.*?-->",
    re.MULTILINE | re.DOTALL,
)


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and the site make them."""
    heads = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_within_the_project_lead_somewhere(page: Path) -> None:
    for link in LINK.findall(CODE.sub("", page.read_text("utf-8"))):
        if link.startswith(("http://", "https://", "mailto:")):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{page.name}: {link}"
        docs = ROOT / "docs"
        on_site = docs not in page.parents or target.suffix != ".md" or docs in target.parents
        assert on_site, f"{page.name}: the site has no page for {link}"
        if anchor:
            assert anchor in anchors(target), f"{page.name}: {link}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_row_of_a_table_has_the_cells_of_its_head(page: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    for rows in re.findall(r"(?:^\|.*\n?)+", text, re.MULTILINE):
        cells = {row: len(re.findall(r"(?<!\\)\|", row)) for row in rows.splitlines()}
        head = next(iter(cells.values()))
        assert [row for row, number in cells.items() if number != head] == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_github_strikes_nothing_through_and_eats_nothing(page: Path) -> None:
    text = CODE.sub("", page.read_text("utf-8"))
    assert re.findall(r".*~.*", text) == [], "a tilde outside of code and formulas"
    assert re.findall(r"<(?!https?://|->)[\w/][^>\n]*>", text) == [], "a tag"
    for formula in re.findall(r"\$([^$\n]+)\$", text):
        assert not re.search(r"\\[^a-zA-Z]|\}_|\*|(?<!\\)<\w", formula), (
            f"Markdown changes {formula}"
        )


def test_the_errors_of_the_borders_formulas_are_those_on_the_page(surrogate: Surrogate) -> None:
    page = (DOCS / "how-to" / "law.md").read_text("utf-8")
    columns = set()
    for column, span, errors in re.findall(
        r"^\| `(\w+)` \| .+ \| (.+) \| (.+ %.*) \|$", page, re.MULTILINE
    ):
        columns.add(column)
        whole = (1e-4, 1.0) if r"\le 1" in span else (1.0, 1e8) if r"\ge 1" in span else (1e-4, 1e8)
        for error in errors.split("; "):
            ends = [*whole]
            if inner := re.search(r"(up to|from) \$\\tilde\{y\} = ([\d.]+)\$", error):
                ends[inner[1] == "up to"] = float(inner[2])
            y = np.geomspace(ends[0], ends[1], 4001)
            y[[0, -1]] = ends
            speeds = border_speeds(surrogate, law(surrogate, "y0", values=y, **UNIT, v0=0.0))
            off = np.abs(speeds[column] / speeds["exact"] - 1.0).max()
            figure = float(re.findall(r"\d[\d.e-]*", error)[0])  # "12.6 %" is 0.126
            assert (100.0 * off if "%" in error else off) == close(figure, rel=0.03), (
                f"{column}: {error}"
            )
    assert columns == BORDERS.keys() - {"exact"}


def cells(page: str, head: str) -> dict[str, list[str]]:
    """The rows of the table whose first head begins so, by their first cells."""
    (table,) = (table for table in tables(page) if next(iter(table[0])).startswith(head))
    return {title: cells for title, *cells in (row.values() for row in table)}


def test_the_deviations_of_the_border_are_those_of_the_page_on_validation() -> None:
    shown = cells((DOCS / "validation.md").read_text("utf-8"), "deviation")
    computed = cells(validation.deviations(), "deviation")
    for title, figures in shown.items():
        compared = [
            (float(one), float(other))
            for one, other in zip(figures, computed.pop(title), strict=True)
            if one
        ]
        assert len(compared) >= 4, title  # the page leaves out what is far beyond a formula's range
        for one, other in compared:
            assert one == close(other, rel=6e-3, abs=5e-5), title
    assert computed.keys() == {"*exact v~crit*"}


def test_the_ball_beside_one_spring_is_as_the_page_on_validity_says(surrogate: Surrogate) -> None:
    page = (DOCS / "validity.md").read_text("utf-8")
    pattern = r"the ball has ([\d.]+), one spring with \$k\$ ([\d.]+), with .* ([\d.]+): the ball"
    ball, spring, softer = map(float, re.findall(pattern, page)[0])
    assert surrogate.quantity("mu_ratio", 0.05, 0.4, contact="ball")[0] == close(ball, abs=5e-5)
    assert surrogate.mu_ratio(0.05, 0.4) == close(spring, abs=5e-5)
    assert surrogate.mu_ratio(0.05 / 1.5, 0.4 / 1.5) == close(softer, abs=5e-5)
    heads, figures = re.findall(
        r"^\| (?:\$\\tilde\{y\}\$|difference) \| (.*) \|$", page, re.MULTILINE
    )
    computed = cells(validity.partial_slip(), "y~")
    assert heads.split(" | ") == list(computed)
    assert [float(one) for one in figures.split(" | ")] == close(
        [float(one) for (one,) in computed.values()], rel=0.15
    )


def test_the_folds_along_k_are_those_on_the_page(surrogate: Surrogate) -> None:
    page = (DOCS / "how-to" / "law.md").read_text("utf-8")
    pattern = r"above ([\d.]+) it has a minimum \(\$\\tilde\{y\}\$ from ([\d.]+) to ([\d.]+)\)"
    born, first, last = map(float, re.findall(pattern, page)[0])
    y = np.geomspace(2.0, 20.0, 4001)

    def minimum(r: float) -> float:
        rises = np.flatnonzero(np.diff(surrogate.mu_ratio(y / r, y)) > 0.0)
        return float(y[rises[0]]) if rises.size else math.nan

    minima = np.array([minimum(r) for r in born + np.linspace(-0.005, 0.005, 101)])
    assert np.isnan(minima[0])
    assert minima[np.isfinite(minima)][0] == close(last, abs=0.05)
    assert minimum(1e8) == close(first, abs=0.05)


def test_the_largest_bounds_of_the_stick_fraction_are_those_on_the_page(
    surrogate: Surrogate,
) -> None:
    y = np.geomspace(1e-4, 1e8, 20_001)
    text = (DOCS / "accuracy.md").read_text("utf-8")
    bounds = re.findall(
        r"up to ([\d.e-]+) with the tightest table, ([\d.e-]+\d) with the coarsest", text
    )[0]
    for table, bound in zip((surrogate, Surrogate.open(1e-4)), bounds, strict=True):
        shares = (1.0, 1.0 - 1e-15, 1.0 + 1e-15)
        largest = max(
            table.quantity("stick_fraction", share * table.v_tilde_crit(y), y)[:2][1].max()
            for share in shares
        )
        assert largest == close(float(bound), rel=0.05)


def shown_distribution() -> dict[tuple[str, str, str], list[str]]:
    """The figures of the page on accuracy by contact, quantity and table."""
    page = (DOCS / "accuracy.md").read_text("utf-8")
    (table,) = (table for table in tables(page) if "bound/error, median" in table[0])
    rows = (list(row.values()) for row in table)
    return {(contact, name, table): figures for contact, name, table, *figures in rows}


def test_the_distribution_of_errors_on_the_page_is_what_the_tables_state() -> None:
    shown = shown_distribution()
    computed = {(row[0], row[1], row[2]): row[3:] for row in error_distribution.spring_across()}
    assert len(computed) == 24
    assert {place: shown[place] for place in computed} == computed
    assert {contact for contact, *_ in shown} == {
        "spring across",
        "ball across",
        "spring along",
        "ball along",
        "spring normal",
    }
    for place, (half, most, nearly, largest, least, *_) in shown.items():
        assert float(half) <= float(most) <= float(nearly) <= float(largest), place
        assert float(least.replace(",", "")) >= 1.0, place


@pytest.mark.skipif(not extended.HAS_EXTENDED, reason="longdouble has the digits of a double here")
@pytest.mark.parametrize("direction", ["along", "normal"])
def test_the_distribution_of_a_springs_errors_is_that_on_the_page(direction: str) -> None:
    shown = shown_distribution()
    for contact, name, table, *figures in error_distribution.driven("spring", direction, 0.2):
        compared = zip(figures[:2], shown[contact, name, table][:2], strict=True)
        for one, other in compared:
            assert float(one) == close(float(other), rel=0.3), name


@pytest.mark.slow
def test_the_distribution_of_a_balls_errors_is_that_on_the_page() -> None:
    shown = shown_distribution()
    for contact, name, table, *figures in error_distribution.ball_across(0.2):
        there = shown[contact, name, table]
        assert float(figures[3]) <= 10.0 * float(there[3]), (name, table)
        assert float(figures[3]) > float(there[0]), (name, table)


def test_every_test_that_the_threats_name_exists_and_every_line_names_one() -> None:
    text = (DOCS / "threats.md").read_text("utf-8").partition("\n## Reliability\n")[0]
    named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", text)
    assert len(named) >= 30
    for path, test in named:
        assert re.search(rf"^def {test}\(", (ROOT / path).read_text("utf-8"), re.MULTILINE), (
            f"{path}::{test}"
        )
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    assert len(lines) >= 20
    assert [line for line in lines[2:] if "::" not in line] == []


def test_the_pages_that_the_program_makes_are_what_it_makes_now() -> None:
    """Otherwise: python3 dev.py exec python docs/reference.py."""
    pytest.importorskip("sphinx")
    # in a process of its own: what other tests have imported or replaced must not count
    command = [sys.executable, str(DOCS / "reference.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_reference_of_python_shows_no_docstring_of_python_itself() -> None:
    text = (DOCS / "python.md").read_text("utf-8")
    inherited = [(one.__doc__ or "").splitlines()[0] for one in (str, tuple, float, list, dict)]
    assert all(inherited)
    assert [line for line in [*inherited, "Alias for field number"] if line in text] == []
    titles = re.findall(r"^#{3,4} (.+)$", text, re.MULTILINE)
    assert len(titles) > 100
    assert sorted({one for one in titles if titles.count(one) > 1}) == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_no_page_needs_a_directive_to_be_read(page: Path) -> None:
    directives = set(re.findall(r"^```\{(\S+)\}", page.read_text("utf-8"), re.M))
    assert directives <= ({"toctree"} if page == DOCS / "index.md" else set())


def test_the_rest_reference_names_the_fields_within_fields() -> None:
    text = (DOCS / "http-fields.md").read_text("utf-8")
    rows = re.findall(r"^\| `(\S+?)`(?:, required)? \| (.*?) \|", text, re.MULTILINE)
    paths = {
        "power.saved",
        "results[].roots[].settling.periods",
        "border[].value",
        "errors[].reason",
    }
    assert paths <= {field for field, _ in rows}
    assert "number > 0 or string | Coulomb friction coefficient of the contact [-] |" in text
    # an object is followed by its fields, unless the description does not fix them
    objects = (
        (one, other)
        for (one, kind), (other, _) in pairwise(rows)
        if re.search(r"\bobject\b(?! of)", kind)
    )
    bare = {one for one, other in objects if not other.startswith(one)}
    assert bare == {"attributes", "blocks", "inputs"}


def test_the_floors_of_contributing_are_those_that_are_checked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    (floors,) = (
        contract["layers"]
        for contract in project["tool"]["importlinter"]["contracts"]
        if contract["type"] == "layers"
    )
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    heads = re.findall(r"^    (src/mumacro/[^\s,]+(?:, [^\s,]+)*)", text, re.MULTILINE)
    told = re.findall(r"\w+(?=/|\.py)", " ".join(heads).replace("src/mumacro/", ""))
    checked = [name for floor in floors for name in floor.split(" | ")]
    assert told == [name for name in checked if name not in ("__main__", "version", "_pyinstaller")]


def test_metadata_agrees_with_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    lines = (
        f"version: {__version__}\n",
        f"license: {project['license']}\n",
        f"title: {project['name']}\n",
    )
    assert [text for text in lines if text not in citation] == []


def test_the_formulas_of_the_border_are_all_described() -> None:
    text = (DOCS / "how-to" / "law.md").read_text("utf-8")
    assert [column for column in BORDERS if column != "exact" and f"`{column}`" not in text] == []


def test_the_completion_of_the_shell_knows_every_command() -> None:
    text = (DOCS / "command-line.md").read_text("utf-8")
    (words,) = re.findall(r'^complete -o default -W "(.*)" mumacro$', text, re.MULTILINE)
    assert {*words.split()} == {*COMMANDS}
