"""The examples of README, tutorial and how-to pages run unchanged in an environment with the wheel,
not with this tree.

README and tutorial have nothing but the wheel and what it requires; the other pages also have the
packages of the running environment, for extras.  The blocks of a page share one session.
"""

import os
import re
import shutil
import site
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.comparing import close
from tests.serving import running
from tests.test_wheel import Installed, build

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")]

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
BARE = {"README", "tutorial"}
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
SERVICE = "http://127.0.0.1:8000"
SESSION = """
import doctest, sys
name = sys.argv[1]
test = doctest.DocTestParser().get_doctest(open(name, encoding="utf-8").read(), {}, name, name, 0)
result = doctest.DocTestRunner(verbose=False).run(test)
sys.exit(0 if result.attempted and not result.failed else 1)
"""


def blocks(page: Path, language: str) -> list[str]:
    return [text for kind, text in BLOCK.findall(page.read_text("utf-8")) if kind == language]


def having(language: str) -> list[Path]:
    return [page for page in PAGES if blocks(page, language)]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def bare(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Installed(tmp_path_factory.mktemp("bare"), wheel).bin


@pytest.fixture(scope="module")
def full(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment with the wheel and the packages of this one."""
    folder = tmp_path_factory.mktemp("full") / "venv"
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    pip = (
        folder / "bin" / "python",
        "-m",
        "pip",
        "--disable-pip-version-check",
        "install",
        "-q",
        "--no-deps",
    )
    subprocess.run([*pip, wheel], check=True)
    (packages,) = folder.glob("lib/python*/site-packages")
    # behind the wheel, and without the links to this tree that an installation in place has
    (packages / "more.pth").write_text("\n".join(site.getsitepackages()), "utf-8")
    return folder / "bin"


@pytest.fixture(scope="module")
def service(full: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    log = tmp_path_factory.mktemp("service") / "log.jsonl"
    with running([str(full / "mumacro"), "serve", "--port", "0"], log, PYTHONPATH="") as server:
        server.wait_until_ready()
        yield server.url


def run(programs: Path, folder: Path, *words: str | Path) -> str:
    env = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "MUMACRO_"))
    }
    env |= {
        "PATH": f"{programs}{os.pathsep}/usr/bin{os.pathsep}/bin",
        "COLUMNS": "120",
        "MPLBACKEND": "agg",
    }
    done = subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("page", having("pycon"), ids=lambda page: page.stem)
def test_python_sessions(page: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    programs = request.getfixturevalue("bare" if page.stem in BARE else "full")
    (tmp_path / "session.txt").write_text("\n".join(blocks(page, "pycon")), "utf-8")
    run(programs, tmp_path, programs / "python", "-c", SESSION, "session.txt")


def parts(text: str) -> tuple[list[str], list[str]]:
    return NUMBER.sub("#", text).split(), NUMBER.findall(text)


def last_place(number: str) -> float:
    """What one unit is in the last digit of a printed number."""
    digits, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))


def test_a_number_of_the_guide_has_a_last_place() -> None:
    assert [last_place(text) for text in ("8.444e-16", "0.2400", "-12", "1e-12")] == [
        1e-19,
        1e-4,
        1.0,
        1e-12,
    ]


@pytest.mark.parametrize("page", having("console"), ids=lambda page: page.stem)
def test_commands(page: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    programs = request.getfixturevalue("bare" if page.stem in BARE else "full")
    for block in blocks(page, "console"):
        for entry in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, shown = entry.partition("\n")
            if SERVICE in command:
                if shutil.which("curl") is None:
                    pytest.skip("needs curl")
                command = command.replace(SERVICE, request.getfixturevalue("service"))
            found = run(programs, tmp_path, "sh", "-c", command)
            (words, numbers), (shown_words, shown_numbers) = parts(found), parts(shown)
            assert words == shown_words, f"{command}\n{found}"
            for number, shown_number in zip(numbers, shown_numbers, strict=True):
                # the last of sixteen digits depend on the processor
                expected = close(float(shown_number), rel=1e-9, abs=1.01 * last_place(shown_number))
                assert float(number) == expected, f"{command}\n{found}"
