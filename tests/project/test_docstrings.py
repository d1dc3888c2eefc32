"""Examples of docstrings run."""

import ast
import contextlib
import doctest
import importlib
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import mumacro
from tests.support.places import ROOT

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
        "outputs.answer.Answer",
        "table.bundled.bundled_tables",
        "fits.fit.fit",
        "motions.element.Element",
    }
    used |= {f"surrogate.Surrogate.{name}" for name in ("evaluate", "mu_ratio", "open", "slopes")}
    assert {f"mumacro.{name}" for name in used} <= shown


def places(module: Any) -> list[Any]:
    """Return what a name in a docstring of a module may be a member of."""
    classes = [member for member in vars(module).values() if isinstance(member, type)]
    return [module, mumacro, *classes]


def walk(value: Any, parts: list[str]) -> bool:
    """Whether members lead on from a value; the last may be an annotation of a class."""
    for i, part in enumerate(parts):
        if i == len(parts) - 1 and part in getattr(value, "__annotations__", {}):
            return True
        if not hasattr(value, part):
            return False
        value = getattr(value, part)
    return True


def is_found(name: str, module: Any) -> bool:
    """Whether a name leads somewhere: from the module, one of its classes, or from the top."""
    parts = name.split(".")
    if any(walk(place, parts) for place in places(module)):
        return True
    for i in range(len(parts), 0, -1):
        with contextlib.suppress(ImportError):
            return walk(importlib.import_module(".".join(parts[:i])), parts[i:])
    return False


@pytest.mark.parametrize("name", MODULES)
def test_names_in_docstrings_lead_somewhere(name: str) -> None:
    module = importlib.import_module(name)
    text = Path(str(module.__file__)).read_text("utf-8")
    named = re.findall(r":(?:func|class|meth|mod|data|attr):`~?([^`]+)`", text)
    missing = [one for one in named if not is_found(one, module)]
    assert [one for one in missing if f"self.{one}: " not in text] == []


NO_VERBS = {
    "A", "All", "An", "As", "At", "Between", "Both", "By", "Each", "Every", "How", "Its", "Of",
    "One", "That", "The", "Those", "What", "Where", "Whether", "Which", "Who", "Why",
}  # fmt: skip


def functions_of(package: str) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    """Yield the functions of a package that are no properties, with their places."""
    for path in sorted((ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                decorators = " ".join(map(ast.unparse, node.decorator_list))
                if not re.search(r"property|setter|overload", decorators):
                    yield f"{path.name}:{node.lineno} {node.name}", node


@pytest.mark.parametrize("package", ["src/mumacro", "service"])
def test_the_docstring_of_a_function_begins_with_a_verb(package: str) -> None:
    told = {
        place: (ast.get_docstring(function) or "Do").split()[0]
        for place, function in functions_of(package)
        if not function.name.startswith("__")
    }
    assert len(told) > 200
    assert [place for place, word in told.items() if word.strip(".,:;") in NO_VERBS] == []
