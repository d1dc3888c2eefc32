"""The examples in the documents run unchanged: Python sessions, commands, and requests to a live service."""

import doctest
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from comparing import close

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted((ROOT / "docs").rglob("*.md"))
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
SERVICE = "http://127.0.0.1:8000"


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a page in one language."""
    return [text for kind, text in BLOCK.findall(page.read_text("utf-8")) if kind == language]


def having(language: str) -> list[Path]:
    """The pages with such a block."""
    return [page for page in PAGES if blocks(page, language)]


def name(page: Path) -> str:
    return page.stem


@pytest.mark.parametrize("page", having("pycon"), ids=name)
def test_python_sessions(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    session = "\n".join(blocks(page, "pycon"))
    test = doctest.DocTestParser().get_doctest(session, {}, page.stem, str(page), 0)
    report: list[str] = []
    failed, tried = doctest.DocTestRunner(verbose=False).run(test, out=report.append)
    assert failed == 0, "".join(report)
    assert tried > 0


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment in which ``mumacro`` and ``python3`` are those of this tree."""
    folder = tmp_path_factory.mktemp("bin")
    for word, module in (("mumacro", "-m mumacro"), ("python3", "")):
        script = folder / word
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" {module} "$@"\n', "utf-8")
        script.chmod(0o755)
    return {**os.environ, "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}


def parts(text: str) -> tuple[list[str], list[float]]:
    """Words and numbers of a command's output."""
    return NUMBER.sub("#", text).split(), [float(found) for found in NUMBER.findall(text)]


@pytest.mark.parametrize("page", having("console"), ids=name)
def test_commands(page: Path, commands: dict[str, str], tmp_path: Path, request: pytest.FixtureRequest) -> None:
    if os.name == "nt" or (SERVICE in page.read_text("utf-8") and shutil.which("curl") is None):
        pytest.skip("needs a POSIX shell and curl")
    for block in blocks(page, "console"):
        for entry in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, shown = entry.partition("\n")
            if SERVICE in command:
                command = command.replace(SERVICE, request.getfixturevalue("live_server").url)
            done = subprocess.run(
                ["sh", "-c", command], cwd=tmp_path, env=commands, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, done.stdout + done.stderr
            (words, numbers), (shown_words, shown_numbers) = parts(done.stdout), parts(shown)
            assert words == shown_words, command
            # the last digits depend on the processor; error bounds are of rounding size
            assert numbers == close(shown_numbers, rel=1e-9, abs=2e-13), command
