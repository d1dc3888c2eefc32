"""The layout of the sources: no line that ruff does not see is longer than 100 characters; tests,
benchmarks and fuzz share tests/support and import nothing else from each other."""

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
