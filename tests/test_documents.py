"""Documents: links are valid, metadata agrees with the package, terms agree with the code."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from comparing import close
from mumacro import Surrogate, __version__, closed_forms
from mumacro.law import APPROXIMATIONS, BORDERS, borders

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and the site make them."""
    heads = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_within_the_project_lead_somewhere(page: Path) -> None:
    for link in LINK.findall(page.read_text("utf-8")):
        if link.startswith(("http://", "https://", "mailto:")):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), f"{page.name}: {link}"
        if anchor:
            assert anchor in anchors(target), f"{page.name}: {link}"


def test_the_rest_reference_names_the_fields_within_fields(monkeypatch) -> None:
    from service.app import create_app
    from service.settings import Settings

    monkeypatch.syspath_prepend(ROOT / "docs" / "_ext")
    from interface import _operations

    text = "\n".join(_operations(create_app(Settings(tables=(ROOT / "tables",))).openapi()))
    for name in ("power.saved", "results[].roots[].settling.periods", "curves[].border[].value", "errors[].reason"):
        assert f"| `{name}`" in text
    # an object is followed by its fields, unless the description does not fix them
    rows = re.findall(r"^\| `(\S+?)`(?:, required)? \| (.*?) \|", text, re.MULTILINE)
    objects = [place for place, (_, kind) in enumerate(rows) if re.search(r"\bobject\b(?! of)", kind)]
    bare = {rows[place][0] for place in objects if not rows[place + 1][0].startswith(rows[place][0])}
    assert bare == {"attributes", "blocks"}


def number(text: str) -> float:
    """A number of a document: "12.6 %" is 0.126."""
    value = float(re.findall(r"\d[\d.e-]*", text)[0])
    return value / 100.0 if "%" in text else value


def test_the_errors_of_the_borders_formulas_are_those_on_the_page(surrogate) -> None:
    page = (ROOT / "docs" / "asking.md").read_text("utf-8")
    seen = set()
    for name, given, errors in re.findall(r"^\| `(\w+)` \| .+ \| (.+) \| (.+ %.*) \|$", page, re.MULTILINE):
        seen.add(name)
        low, high = {"y~ <= 1": (1e-4, 1.0), "y~ >= 1": (1.0, 1e8), "everywhere": (1e-4, 1e8)}[given]
        for told in errors.split("; "):
            inner = re.search(r"(up to|from) y~ = ([\d.]+)", told)
            ends = low, high
            if inner is not None:
                ends = (low, float(inner[2])) if inner[1] == "up to" else (float(inner[2]), high)
            y = np.geomspace(*ends, 4001)
            y[[0, -1]] = ends
            off = np.abs(borders(y)[name] / surrogate.v_tilde_crit(y) - 1.0)
            assert off.max() == close(number(told), rel=0.03), f"{name}: {told}"
    assert seen == BORDERS.keys() - {"exact"}


def test_the_folds_are_those_on_the_page(surrogate, monkeypatch) -> None:
    page = (ROOT / "docs" / "asking.md").read_text("utf-8")
    born, first, last = re.findall(r"above ([\d.]+) it has a minimum \(y~ from ([\d.]+) to ([\d.]+)\)", page)[0]
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    from folds import turning_points

    low, high = 9.0, 10.0
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if turning_points(surrogate, middle) else (middle, high)
    assert high == close(float(born), abs=0.005)
    # the minimum moves from its first position to the one at large r
    assert turning_points(surrogate, high)[0][0] == close(float(last), abs=0.05)
    assert turning_points(surrogate, 1e8)[0][0] == close(float(first), abs=0.05)


def test_the_largest_bounds_of_the_stick_fraction_are_those_on_the_pages(surrogate) -> None:
    y = np.geomspace(1e-4, 1e8, 20_001)
    largest = {}
    for name, table in (("tightest", surrogate), ("coarsest", Surrogate.open(1e-4))):
        largest[name] = max(
            table.stick_fraction_with_bound(share * table.v_tilde_crit(y), y)[1].max()
            for share in (1.0, 1.0 - 1e-15, 1.0 + 1e-15)
        )
    for page in ("asking.md", "accuracy.md"):
        text = (ROOT / "docs" / page).read_text("utf-8")
        fine, coarse = re.findall(r"up to ([\d.e-]+) with the tightest table, ([\d.e-]+\d) with the coarsest", text)[0]
        assert largest["tightest"] == close(float(fine), rel=0.05)
        assert largest["coarsest"] == close(float(coarse), rel=0.05)


def project() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def test_metadata_agrees_with_the_package() -> None:
    meta = json.loads((ROOT / "codemeta.json").read_text("utf-8"))
    assert meta["version"] == __version__
    assert meta["description"] == project()["description"]
    assert meta["license"].endswith(project()["license"])
    assert meta["keywords"] == project()["keywords"]
    assert meta["softwareRequirements"] == project()["dependencies"]
    assert meta["runtimePlatform"] == f"Python {project()['requires-python']}"
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"version: {__version__}\n" in citation
    assert f"license: {project()['license']}\n" in citation
    (article,) = meta["referencePublication"]
    assert article["name"] in citation
    for author in article["author"]:
        assert f"family-names: {author['familyName']}\n        given-names: {author['givenName']}\n" in citation


def test_every_citation_of_the_paper_is_in_its_bibliography() -> None:
    cited = set(re.findall(r"@(\w+)", (ROOT / "paper.md").read_text("utf-8")))
    entries = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "paper.bib").read_text("utf-8"), re.MULTILINE))
    assert cited == entries


def test_the_columns_of_a_law_are_all_described() -> None:
    page = (ROOT / "docs" / "asking.md").read_text("utf-8")
    assert [name for name in (*APPROXIMATIONS, *BORDERS) if f"`{name}`" not in page] == []


def test_every_formula_states_its_largest_deviation() -> None:
    for name in closed_forms.__all__:
        item = getattr(closed_forms, name)
        if callable(item) and name != "agm":
            text = item.__doc__.lower()
            words = ("off by", "too low", "error", "relative accuracy", "exact", "to o(")
            assert any(word in text for word in words), name


def test_no_page_calls_a_part_of_the_paper_missing() -> None:
    for page in PAGES:
        assert "not at hand" not in page.read_text("utf-8").lower()
