"""No regular expression of the packages takes more than linear time, whatever its text.

The expressions are found in the sources: every call of a function of ``re``, and every
``pattern=``.  An expression stands where a module's names are enough to read it.
"""

import ast
import importlib
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import pytest

from tests.support.growth import MOST
from tests.support.places import ROOT

PACKAGES = ("src/mumacro", "builder", "service")
FUNCTIONS = ("match", "fullmatch", "search", "sub", "subn", "split", "findall", "finditer")
PATIENCE_S = 900  # then one has no end: nothing else interrupts a match


class Expression(NamedTuple):
    """A regular expression, and how it is used."""

    where: str
    pattern: str | bytes
    flags: int
    method: str


def _sources() -> list[Path]:
    return sorted(path for name in PACKAGES for path in (ROOT / name).rglob("*.py"))


def _module(path: Path) -> ModuleType:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return importlib.import_module(".".join(parts).removeprefix("src.").removesuffix(".__init__"))


def _calls(tree: ast.AST) -> Iterator[ast.Call]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.Call))


def _base(node: ast.expr) -> str:
    """The name that a value is taken from: NAME of NAME, module.NAME and NAME[...]."""
    if isinstance(node, ast.Subscript):
        return _base(node.value)
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _compiled(value: object) -> Iterator[re.Pattern[Any]]:
    """The compiled expressions in a value of a module."""
    if isinstance(value, re.Pattern):
        yield value
    elif isinstance(value, dict):
        for one in value.values():
            yield from _compiled(one)
    elif isinstance(value, (list, tuple, set, frozenset)):
        for one in value:
            yield from _compiled(one)


def _uses() -> dict[str, set[str]]:
    """Name of a compiled expression -> the methods that are called of it anywhere."""
    uses: dict[str, set[str]] = {}
    for path in _sources():
        for call in _calls(ast.parse(path.read_text("utf-8"))):
            if isinstance(call.func, ast.Attribute) and call.func.attr in FUNCTIONS:
                uses.setdefault(_base(call.func.value), set()).add(call.func.attr)
    return uses


def _read(node: ast.expr, module: ModuleType, where: str) -> Any:
    """What an argument is, by the names of its module."""
    try:
        return eval(compile(ast.Expression(node), where, "eval"), vars(module))  # noqa: S307
    except NameError as error:
        raise AssertionError(
            f"{where}: {error}: compile the expression at the top of the module"
        ) from None


def _of_module(path: Path, uses: dict[str, set[str]]) -> Iterator[Expression]:
    """The expressions of a source."""
    tree, place = ast.parse(path.read_text("utf-8")), str(path.relative_to(ROOT))
    assert not any(isinstance(n, ast.ImportFrom) and n.module == "re" for n in ast.walk(tree))
    if not re.search(r"\bre\.|\bpattern=", path.read_text("utf-8")):
        return
    module, at_top = _module(path), set[ast.Call]()
    for statement in tree.body:
        if not isinstance(statement, (ast.Assign, ast.AnnAssign)):
            continue
        made = [call for call in _calls(statement) if ast.unparse(call.func) == "re.compile"]
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        for name in [target.id for target in targets if isinstance(target, ast.Name)]:
            for one in _compiled(getattr(module, name)) if made else ():
                where = f"{place}:{statement.lineno} {name}"
                for method in sorted(uses.get(name, {"search"})):
                    yield Expression(where, one.pattern, one.flags, method)
        at_top.update(made)
    for call in _calls(tree):
        where = f"{place}:{call.lineno}"
        function = ast.unparse(call.func).removeprefix("re.")
        if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) == "re":
            assert function != "compile" or call in at_top, f"{where}: compile it at the top"
            if function in FUNCTIONS:
                pattern = _read(call.args[0], module, where)
                compiled = pattern if isinstance(pattern, re.Pattern) else re.compile(pattern)
                named = [
                    _read(word.value, module, where)
                    for word in call.keywords
                    if word.arg == "flags"
                ]
                flags = compiled.flags | int(named[0] if named else 0)
                yield Expression(where, compiled.pattern, flags, function)
        for word in call.keywords:
            if word.arg == "pattern":
                yield Expression(where, _read(word.value, module, where), 0, "search")


def expressions() -> list[Expression]:
    """All of the packages."""
    uses = _uses()
    return [one for path in _sources() for one in _of_module(path, uses)]


def slow(tried: list[Expression], patience: float = PATIENCE_S) -> list[str]:
    """Those with a repetition whose time grows more than linearly, each with its worst text."""
    lines = []
    for where, pattern, flags, method in tried:
        text = pattern if isinstance(pattern, str) else [pattern.decode("latin-1")]
        # flags of a pattern hold what its own text says, too
        own = flags & ~re.UNICODE if isinstance(pattern, str) else flags
        lines.append(json.dumps([where, text, own, method]))
    command = [sys.executable, "-m", "tests.support.growth"]
    try:
        done = subprocess.run(
            command,
            input="\n".join(lines),
            capture_output=True,
            text=True,
            cwd=ROOT,
            timeout=patience,
            check=False,
        )
    except subprocess.TimeoutExpired as late:
        last = bytes(late.stdout or b"").splitlines()[-1:]
        return [f"has no end: {json.loads(line)['where']}" for line in last or [b'{"where": "?"}']]
    assert done.returncode == 0, done.stderr
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert [one["where"] for one in found if "begun" in one] == [one.where for one in tried]
    return [f"{one['where']}: {one['text']}" for one in found if one.get("ratio", 0.0) >= MOST]


def test_every_repetition_of_every_expression_is_linear() -> None:
    tried = expressions()
    assert len({one.where for one in tried}) > 5
    assert slow(tried) == []


@pytest.mark.parametrize(
    ("pattern", "method"),
    [
        (r"\s*(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\])\s*", "fullmatch"),  # cubic in blanks
        (r'charset=(?! *"?(utf-?8|) *"? *(;|$))', "search"),  # cubic, within a look ahead
        (r"\s*=\s*", "sub"),  # quadratic, from every blank anew
        (r"(\d+)\s*(\D.*)?", "fullmatch"),  # quadratic, with a line break at the end
        (r".*a.*b.*", "search"),  # quadratic in what stands between
    ],
)
def test_an_expression_that_is_not_linear_is_found(pattern: str, method: str) -> None:
    assert slow([Expression("here", pattern, 0, method)]) != []


def test_an_expression_without_an_end_is_stopped() -> None:
    assert slow([Expression("here", "(a+)+b", 0, "match")], patience=3) != []
