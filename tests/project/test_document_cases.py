"""No case that a document shows is doubted: an example must not be answered with a remark."""

import ast
import re
from collections.abc import Iterator
from typing import Any
from urllib.parse import parse_qsl

import numpy as np

from mumacro.inputs.case import read
from mumacro.inputs.doubts import UNITS, remarks
from mumacro.inputs.fields import INPUTS
from mumacro.motions.oscillation import read_oscillation
from tests.support.documents import PAGES
from tests.support.places import ROOT

COMMAND = re.compile(r"""["'](mu0=[^"'\n]+)["']""")
QUERY = re.compile(r"""[?&](mu0=[^"'\s`)<>]+)""")
LITERAL = re.compile(r"""\{[^{}\n]*["']mu0["']:[^{}\n]*\}""")
KEYWORDS = re.compile(r"\((mu0=[^()\n]*(?:\([^()\n]*\)[^()\n]*)*)\)")


def cases() -> Iterator[tuple[str, dict[str, Any]]]:
    """The page, and the inputs by name, of each case that is written out."""
    for page in PAGES:
        text, name = page.read_text("utf-8"), str(page.relative_to(ROOT))
        for match in COMMAND.finditer(text):
            pairs = (word.partition("=") for word in match[1].split())
            yield name, {key: value for key, equals, value in pairs if equals}
        for match in QUERY.finditer(text):
            yield name, dict(parse_qsl(match[1]))
        for match in LITERAL.finditer(text):
            try:
                case = ast.literal_eval(match[0])
            except (ValueError, SyntaxError):
                continue  # with names of variables
            if "%" not in str(case.get("k")):  # else shares of a variance
                yield name, case
        for match in KEYWORDS.finditer(text):
            try:
                call: Any = ast.parse(f"f({match[1]})", mode="eval").body
            except SyntaxError:
                continue
            yield (
                name,
                {
                    word.arg: ast.literal_eval(word.value)
                    for word in call.keywords
                    if word.arg in INPUTS
                    and isinstance(word.value, (ast.Constant, ast.List, ast.Tuple))
                },
            )


def test_no_case_of_the_documents_is_doubted() -> None:
    count = 0
    for page, case in cases():
        values: dict[str, Any] = {
            name: [read(name, one).si for one in value]
            if isinstance(value, (list, tuple))
            else read(name, value).si
            for name, value in case.items()
            if name in INPUTS and value not in (None, "")
        }
        columns = {
            name: np.asarray(x, float) for name, x in values.items() if not name.startswith("k_")
        }
        if "f" in columns:
            columns["omega"] = 2.0 * np.pi * columns.pop("f")
        if len({*(x.size for x in columns.values())} - {1}) > 1:
            columns = {name: x.ravel()[:1] for name, x in columns.items()}
        if any((x < 0.0).any() for x in columns.values()):
            continue  # an illegal value, which is shown as such
        count += 1
        doubts = [one for one in remarks(columns) if one.row == UNITS]
        assert doubts == [], (page, case)
    assert count > 40


def test_no_motion_of_the_documents_is_larger_than_what_is_usual() -> None:
    """A motion has no remarks of its own; its amplitudes are those of y0."""
    least, most = INPUTS["y0"].usual
    option = re.compile(r"--[xy] (\S+)")
    helps = re.compile(r"<!-- begin help -->.*?<!-- end help -->", re.DOTALL)  # names of arguments
    texts = [helps.sub("", page.read_text("utf-8")) for page in PAGES]
    lines = [line for text in texts for line in text.splitlines()]
    texts = [text for line in lines if "mumacro " in line for text in option.findall(line)]
    amplitudes = [one[1] for text in texts for one in read_oscillation("x", text.strip("`"))]
    assert len(amplitudes) > 3
    assert all(least <= amplitude <= most for amplitude in amplitudes if amplitude)
