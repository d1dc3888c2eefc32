"""validation.md, model.md, validity.md and hard-cases.md contain their scripts' results; the paper is covered."""

import importlib
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from builder.steady import border, solve
from comparing import close

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
hard_cases = load("hard_cases")
measuring = load("measuring")


def parts(text: str) -> tuple[str, list[str]]:
    """The words and the numbers of a section."""
    return NUMBER.sub("#", text).replace("-", ""), [x.replace(",", "") for x in NUMBER.findall(text)]


def agree(found: str, printed: str) -> bool:
    """Whether two numbers agree but for the last digit shown; a number of rounding size is noise itself."""
    (a, b), digits = map(float, (found, printed)), 0
    for text in (found, printed):
        digits = max(digits, len(text.split("e")[0].lstrip("+-0.").replace(".", "")))
    if digits < 4 and max(abs(a), abs(b)) < 2e-11:
        return max(abs(a), abs(b)) < 5e-15 or 0.1 < a / b < 10.0
    return math.isclose(a, b, rel_tol=0.06 if digits < 3 else 1.5 * 10.0 ** (1 - digits))


SCRIPTS = (
    (validation.SECTIONS, PAGE),
    (validity.SECTIONS, validity.PAGE),
    (model_facts.CASES, model_facts.PAGE),
    (hard_cases.CASES, hard_cases.PAGE),
)
SLOW = {"blocks", "layer", "settle"}  # a minute together
MEASURED = [
    pytest.param(script, name, page, id=f"{page.stem}-{name}", marks=[pytest.mark.slow] if name in SLOW else [])
    for script, page in SCRIPTS
    for name in script
]


@pytest.mark.parametrize(("script", "section", "page"), MEASURED)
def test_a_section_is_what_is_measured(script: dict[str, Callable[[], str]], section: str, page: Path) -> None:
    (words, numbers), (printed_words, printed) = (
        parts(text) for text in (script[section](), measuring.read_section(section, page))
    )
    assert words.split() == printed_words.split()
    assert [pair for pair in zip(numbers, printed, strict=True) if not agree(*pair)] == []


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


def test_the_loss_halves_at_the_second_step() -> None:
    # mu~ approaches 1 around v~ = 1
    assert solve(1.0, 0.1).deficit / (1.0 - border(0.1)[1]) == close(0.5, abs=0.002)
