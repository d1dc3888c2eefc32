"""The list of inputs has the words for them: docstrings, help, description and exports have the
same."""

import inspect
import re
from typing import Any

import pytest

import mumacro
from mumacro.cli.main import main
from mumacro.inputs.fields import INPUTS, described, in_help
from mumacro.inputs.units import QUANTITIES, UNITS_OF
from tests.support.cases import Capture


@pytest.mark.parametrize("function", [mumacro.Surrogate.evaluate, mumacro.Element])
def test_a_docstring_says_of_an_input_what_the_list_says(function: Any) -> None:
    text = inspect.getdoc(function) or ""
    parameters = dict(re.findall(r"^ *(\w+) : array_like.*\n((?: {4,}\S.*\n)+)", text, re.M))
    parameters |= dict(re.findall(r"^ *(\w+) : float\n((?: {4,}\S.*\n)+)", text, re.M))
    names = [name for name in parameters if name in INPUTS]
    assert len(names) >= 3
    for name in names:
        assert " ".join(parameters[name].split()).startswith(described(name)), name


@pytest.mark.parametrize("command", [[], ["motion"]])
def test_the_help_says_the_same(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    with pytest.raises(SystemExit):
        main([*command, "--help"])
    text = capsys.readouterr().out
    for name in ("mu0", "Fz", "k", "v0"):
        assert in_help(name) in text
    assert all(len(line) <= 100 for line in text.splitlines())


def test_units_and_quantities_of_the_list_agree() -> None:
    for name, field in INPUTS.items():
        assert QUANTITIES[field.quantity].unit == field.unit
        assert QUANTITIES[field.quantity].words == field.words, name
    assert {name: units.keys() for name, units in UNITS_OF.items()}
