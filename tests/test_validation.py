"""validation.md, model.md and validity.md contain their scripts' results; the paper is covered completely."""

import importlib
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from builder.steady import border, solve
from mumacro import closed_forms

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "validation.md"
NUMBER = re.compile(r"[-+]?\d[\d,]*\.?\d*(?:e[-+]?\d+)?")


def load(name: str) -> ModuleType:
    """A script of benchmarks/ as a module, the folder is on the path only during the import."""
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(ROOT / "benchmarks"))


validation = load("validation")
model_facts = load("model_facts")
validity = load("validity")
measuring = load("measuring")


def parts(text: str) -> tuple[str, list[float]]:
    """The words and the numbers of a section."""
    return NUMBER.sub("#", text).replace("-", ""), [float(x.replace(",", "")) for x in NUMBER.findall(text)]


MEASURED = [(validation.SECTIONS, name, PAGE) for name in validation.SECTIONS]
# "blocks" takes minutes: it interpolates every block of the table at five sizes
MEASURED += [(validity.SECTIONS, name, validity.PAGE) for name in validity.SECTIONS]
MEASURED += [(model_facts.CASES, name, model_facts.PAGE) for name in model_facts.CASES if name != "blocks"]


@pytest.mark.parametrize(("script", "section", "page"), MEASURED, ids=[name for _, name, _ in MEASURED])
def test_a_section_is_what_is_measured(script: dict[str, Callable[[], str]], section: str, page: Path) -> None:
    (words, numbers), (printed_words, printed) = (
        parts(text) for text in (script[section](), measuring.read_section(section, page))
    )
    assert words.split() == printed_words.split()
    # rounding of the last digit shown; differences of rounding size are noise
    assert numbers == pytest.approx(printed, rel=0.06, abs=2e-11)


@pytest.mark.parametrize(
    "equation", [5, *range(9, 17), *range(18, 25), *range(26, 29), *range(29, 33), 34, 35, 37, 38, 39, 40]
)
def test_every_equation_is_judged(equation: int) -> None:
    found = set()
    for first, last in re.findall(r"\((\d+)\)(?: to \((\d+)\))?", PAGE.read_text("utf-8")):
        found.update(range(int(first), int(last or first) + 1))
    assert equation in found


def test_every_figure_is_on_the_page() -> None:
    page = PAGE.read_text("utf-8")
    drawn = {path.name for path in (ROOT / "docs" / "figures").glob("fig*.png")}
    assert set(re.findall(r"\]\(figures/(fig\w+\.png)\)", page)) == drawn
    assert len(drawn) == 8


def test_the_statements_between_the_tables() -> None:
    # the border meets the line of small angles
    for y, side in ((1.055, 1.0), (1.065, -1.0)):
        assert side * (np.hypot(1.0, border(y)[0]) - y) > 0.0
    # from where on (23) is better than (24)
    for y, better in ((0.57, False), (0.59, True)):
        exact = border(y)[0]
        assert (abs(closed_forms.border_23(y) - exact) < abs(closed_forms.border_24(y) - exact)) == better
    y = np.linspace(0.05, 1.0, 20)
    top = np.array([border(float(a))[1] for a in y])
    assert np.abs(closed_forms.critical_next(y) / top - 1.0).max() == pytest.approx(0.0024, rel=0.02)
    # mu~ approaches 1 around v~ = 1: there 1 - mu~ halves
    assert solve(1.0, 0.1).deficit / (1.0 - border(0.1)[1]) == pytest.approx(0.5, abs=0.002)
