"""The list of inputs has the words for them: docstrings, help, description and exports have the
same."""

import inspect
import re
from typing import Any

import pytest

import mumacro
from builder.export.fmu import model
from mumacro.cli import common, motion
from mumacro.inputs.fields import INPUTS, described, in_help
from mumacro.inputs.units import QUANTITIES, UNITS_OF


@pytest.mark.parametrize("function", [mumacro.Surrogate.evaluate, mumacro.Element])
def test_a_docstring_says_of_an_input_what_the_list_says(function: Any) -> None:
    text = inspect.getdoc(function) or ""
    parameters = dict(re.findall(r"^ *(\w+) : array_like.*\n((?: {4,}\S.*\n)+)", text, re.M))
    parameters |= dict(re.findall(r"^ *(\w+) : float\n((?: {4,}\S.*\n)+)", text, re.M))
    names = [name for name in parameters if name in INPUTS]
    assert len(names) >= 3
    for name in names:
        assert " ".join(parameters[name].split()).startswith(described(name)), name


@pytest.mark.parametrize("text", [common.ABOUT_INPUTS, motion._INPUTS])
def test_the_help_says_the_same(text: str) -> None:
    for name in ("mu0", "Fz", "k", "v0"):
        assert in_help(name) in text
    assert all(len(line) <= 100 for line in text.splitlines())


def test_the_unit_of_fmi_says_the_same() -> None:
    for name in model.STARTS:
        assert model._TEXTS[name].startswith(INPUTS[name].meaning)


def test_units_and_quantities_of_the_list_agree() -> None:
    for name, field in INPUTS.items():
        assert QUANTITIES[field.quantity].unit == field.unit
        assert QUANTITIES[field.quantity].words == field.words, name
    assert {name: units.keys() for name, units in UNITS_OF.items()}
