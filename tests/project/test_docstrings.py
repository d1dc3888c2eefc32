"""Examples of docstrings run."""

import doctest
import importlib
import pkgutil

import pytest

import mumacro

# no module of Python, or one of PyInstaller
NO_PYTHON = {"mumacro.__main__", "mumacro._kernel", "mumacro._pyinstaller.hook-mumacro"}
MODULES = sorted(
    {"mumacro", *(one.name for one in pkgutil.walk_packages(mumacro.__path__, "mumacro."))}
    - NO_PYTHON
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_run(name: str) -> None:
    module = importlib.import_module(name)
    tested = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE, raise_on_error=False)
    assert tested.failed == 0


def test_there_are_examples() -> None:
    shown = {
        test.name
        for name in MODULES
        for test in doctest.DocTestFinder().find(importlib.import_module(name))
        if test.examples
    }
    used = {
        "answer.Answer",
        "table.bundled.bundled_tables",
        "fits.fit.fit",
        "contacts.element.Element",
    }
    used |= {f"surrogate.Surrogate.{name}" for name in ("evaluate", "mu_ratio", "open", "slopes")}
    assert {f"mumacro.{name}" for name in used} <= shown
