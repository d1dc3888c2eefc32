"""The wheel in a separate environment, without the checkout: the result of ``pip install mumacro``."""

import importlib.metadata
import json
import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from mumacro import Surrogate

pytestmark = pytest.mark.slow

CASE = "mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20690 v0=0.01"
CORE = ("numpy", "numba", "llvmlite", "h5py")


class Installed:
    """A virtual environment with the wheel and its dependencies, without the checkout."""

    def __init__(self, folder: Path, wheel: Path) -> None:
        self.folder = folder
        venv.create(folder / "venv", with_pip=True)
        self.bin = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        # the tested versions, probably in pip's cache
        pins = folder / "pins.txt"
        pins.write_text("".join(f"{name}=={importlib.metadata.version(name)}\n" for name in CORE))
        self.run("python", "-m", "pip", "--disable-pip-version-check", "install", "-q", "-c", str(pins), str(wheel))

    def run(self, *words, code=0):
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "MUMACRO_"))}
        done = subprocess.run(
            [str(self.bin / words[0]), *words[1:]], cwd=self.folder, capture_output=True, text=True, timeout=600,
            env={**kept, "NUMBA_CACHE_DIR": str(self.folder / "kernels")}, check=False,
        )  # fmt: skip
        assert done.returncode == code, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout if code == 0 else done.stderr


@pytest.fixture(scope="module")
def wheel(repository, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder], cwd=repository, check=True
    )
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    return Installed(tmp_path_factory.mktemp("bare"), wheel)


def test_a_case_is_answered_with_the_bits_of_the_checkout(installed):
    answer = json.loads(installed.run("mumacro", CASE, "--json"))
    assert answer["mu_macro"] == Surrogate.open().evaluate(_case()).mu_macro
    assert answer["table"]["id"] == Surrogate.open().id


def _case():
    return {name: float(value) for name, value in (word.split("=") for word in CASE.split())}


def test_the_tables_are_inside_the_package_and_nothing_generic_is_beside_it(installed):
    found = json.loads(installed.run("mumacro", "table", "--json"))
    site = Path(found["path"]).parents[2]
    assert site.name == "site-packages"
    assert [Path(path).parent for path in found["bundled"]] == [site / "mumacro" / "data"] * 4
    for name in ("service", "builder", "friction", "tables", "tests"):
        assert not (site / name).exists()
    program = "import mumacro, pathlib; print(pathlib.Path(mumacro.__file__).parent)"
    assert Path(installed.run("python", "-c", program).strip()) == site / "mumacro"


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        (("serve",), "service"),
        (("eval", "cases.csv", "-o", "out.csv"), "files"),
        (("export", "--format", "csv"), "builder"),
    ],
)
def test_without_an_extra_one_line_says_what_to_install(installed, words, extra):
    message = installed.run("mumacro", *words, code=1)
    assert len(message.splitlines()) == 1
    assert f"pip install 'mumacro[{extra}]'" in message


def test_the_metadata_holds_the_version_of_the_library(installed):
    program = "import mumacro, importlib.metadata as m; print(mumacro.__version__ == m.version('mumacro'))"
    assert installed.run("python", "-c", program).strip() == "True"


@pytest.mark.parametrize("module", ["mumacro.service", "mumacro.builder"])
def test_parts_of_the_package_run_by_their_names_too(installed, module):
    assert "is not installed: pip install" in installed.run("python", "-m", module, code=1)
