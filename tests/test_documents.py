"""Documents: links are valid, metadata agrees with the package, terms agree with the code."""

import json
import re
import tomllib
from pathlib import Path

import pytest

from mumacro import __version__, closed_forms
from mumacro.law import APPROXIMATIONS, BORDERS

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
