"""The layout of the sources: no line that ruff does not see is longer than 100 characters; tests,
benchmarks and fuzz share tests/support and import nothing else from each other; a private name of a
module is used there."""

import ast
from pathlib import Path

import pytest

from tests.support.places import ROOT

FOLDERS = (".ci", "builder", "deploy", "examples", "service", "src", "tests")
KINDS = {
    ".c",
    ".h",
    ".f",
    ".f90",
    ".m",
    ".js",
    ".mjs",
    ".css",
    ".html",
    ".sh",
    ".yaml",
    ".toml",
    ".cff",
}
#: written by others
FOREIGN = (
    ROOT / "service" / "static" / "swagger-ui",
    ROOT / "service" / "static" / "lib",
    ROOT / "tests" / "data",
)


def _is_source(path: Path) -> bool:
    return path.suffix in KINDS and not any(folder in path.parents for folder in FOREIGN)


SOURCES = [
    *(path for path in ROOT.iterdir() if path.is_file() and _is_source(path)),
    ROOT / "Dockerfile",
    *(path for name in FOLDERS for path in (ROOT / name).rglob("*") if _is_source(path)),
    *(ROOT / ".ci").iterdir(),
]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_line_is_longer_than_100_characters(path: Path) -> None:
    lines = path.read_text("utf-8").splitlines()
    assert [number for number, line in enumerate(lines, 1) if len(line) > 100] == []


#: folder -> what a script of it may import of these three
SHARED = {
    "benchmarks": ("benchmarks", "tests.support"),
    "fuzz": ("fuzz", "tests.support"),
    "tests": ("tests",),
    "tests/support": ("tests.support",),
}
SCRIPTS = [(folder, path) for folder in SHARED for path in sorted((ROOT / folder).rglob("*.py"))]


@pytest.mark.parametrize(
    ("folder", "path"), SCRIPTS, ids=lambda part: str(part).removeprefix(f"{ROOT}/")
)
def test_benchmarks_fuzz_and_tests_share_tests_support_alone(folder: str, path: Path) -> None:
    modules = []
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom):
            modules += [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
    ours = [name for name in modules if name.startswith(("benchmarks.", "fuzz.", "tests."))]
    assert [
        name for name in ours if not f"{name}.".startswith(tuple(f"{x}." for x in SHARED[folder]))
    ] == []


PYTHON = [
    path
    for name in ("benchmarks", "builder", "docs", "examples", "fuzz", "service", "src", "tests")
    for path in sorted((ROOT / name).rglob("*.py"))
]


@pytest.mark.parametrize("path", PYTHON, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_private_name_of_a_module_is_used_there(path: Path) -> None:
    tree = ast.parse(path.read_text("utf-8"))
    made, used = set[str](), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            used |= {node.id} if isinstance(node.ctx, ast.Load) else set()
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.decorator_list:
            made.add(node.name)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = (name for target in targets for name in ast.walk(target))
            made |= {name.id for name in names if isinstance(name, ast.Name)}
    private = {name for name in made if name.startswith("_") and not name.startswith("__")}
    assert private - used <= {"_"}


def test_no_two_modules_or_functions_of_the_library_have_one_name() -> None:
    """A command and the question that it asks have one name; every command has ``run``, the
    programs ``main``."""
    modules: dict[str, list[str]] = {}
    names: dict[str, list[str]] = {}
    library = ROOT / "src" / "mumacro"
    for path in sorted(library.rglob("*.py")):
        place = path.relative_to(library).as_posix()
        if not path.stem.startswith("_") and path.parent.name != "cli":
            modules.setdefault(path.stem, []).append(place)
        for node in ast.parse(path.read_text("utf-8")).body:
            if not isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                continue
            if not node.name.startswith("_") and node.name not in ("run", "main"):
                names.setdefault(node.name, []).append(place)
    assert len(names) > 300
    assert {name: places for name, places in modules.items() if len(places) > 1} == {}
    assert {name: places for name, places in names.items() if len(places) > 1} == {}
