"""The layout of the sources that ruff does not see: no line is longer than 100 characters."""

from pathlib import Path

import pytest

from tests.support.places import ROOT

FOLDERS = (".ci", "builder", "deploy", "examples", "mumacro", "service", "tests")
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
FOREIGN = (ROOT / "service" / "static" / "swagger-ui", ROOT / "tests" / "data")


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
