"""The wheel in a separate environment, without the checkout and without a compiler: ``pip install mumacro``."""

import importlib.metadata
import importlib.util
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from mumacro import Surrogate

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PYTHONS = [line.rpartition(" ")[2] for line in PROJECT["project"]["classifiers"] if re.search(r":: 3\.\d+$", line)]
PLATFORMS = PROJECT["tool"]["mumacro"]["wheels"]
CASE = "mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20690 v0=0.01"
CORE = ("numpy", "h5py", "cffi")


class Installed:
    """A virtual environment with the wheel and its dependencies; nothing else is on the PATH of its programs."""

    def __init__(self, folder: Path, wheel: Path, python: str = sys.executable) -> None:
        self.folder = folder
        self.bin = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        subprocess.run([python, "-m", "venv", folder / "venv"], check=True)
        # the tested versions, probably in pip's cache
        pins = folder / "pins.txt"
        pins.write_text("".join(f"{name}=={importlib.metadata.version(name)}\n" for name in CORE))
        pip = ("-m", "pip", "--disable-pip-version-check", "install", "-q", "--only-binary=:all:")
        self.run("python", *pip, "-c", str(pins), str(wheel))

    def run(self, *words, code=0):
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "MUMACRO_"))}
        done = subprocess.run(
            [str(self.bin / words[0]), *words[1:]], cwd=self.folder, capture_output=True, text=True, timeout=600,
            env={**kept, "PATH": str(self.bin)}, check=False,
        )  # fmt: skip
        assert done.returncode == code, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout if code == 0 else done.stderr


def find_python(version: str) -> str:
    """A Python of that version, on the PATH or from pyenv; skips the test if there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    for name in (shutil.which(f"python{version}"), *sorted(pyenv.glob(f"{version}.*/bin/python"))):
        if (
            name
            and not subprocess.run([name, "-c", "import venv, ensurepip"], capture_output=True, check=False).returncode
        ):
            return str(name)
    return pytest.skip(f"Python {version} is neither on the PATH nor in pyenv")


def build(folder: Path, platform: str) -> Path:
    """The wheel for a platform, by zig; without one, for this machine."""
    env = {**os.environ, "MUMACRO_BUILD_PLATFORM": platform}
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder]
    subprocess.run(command, cwd=ROOT, env=env, check=True)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel that is published for this machine if zig is installed, else that of the compiler found here."""
    from packaging.tags import platform_tags

    own = {*platform_tags()} if importlib.util.find_spec("ziglang") else set()
    published = next((tags for tags in PLATFORMS if own & {*tags.split(".")}), "")
    return build(tmp_path_factory.mktemp("wheel"), published)


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    return Installed(tmp_path_factory.mktemp("bare"), wheel)


@pytest.mark.parametrize("version", PYTHONS)
def test_one_wheel_gives_every_python_the_bits_of_the_checkout(wheel, tmp_path, version):
    answer = json.loads(Installed(tmp_path, wheel, find_python(version)).run("mumacro", CASE, "--json"))
    assert answer["mu_macro"] == Surrogate.open().evaluate(_case()).mu_macro


def test_the_wheel_holds_the_sources_and_one_shared_object_for_every_python(wheel, repository):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (metadata,) = (archive.read(name).decode() for name in names if name.endswith(".dist-info/WHEEL"))
    assert len([name for name in names if name.startswith("mumacro/_kernel.")]) == 1
    sources = {f"mumacro/kernel/{path.name}" for path in (repository / "mumacro" / "kernel").iterdir()}
    assert sources == {name for name in names if name.startswith("mumacro/kernel/")}
    assert "Root-Is-Purelib: false" in metadata
    tags = re.findall(r"^Tag: (.*)$", metadata, re.MULTILINE)
    assert tags
    assert all(re.fullmatch("py3-none-(?!any).+", tag) for tag in tags)


@pytest.mark.parametrize("platform", [name for name in PLATFORMS if "linux" in name])
def test_a_linux_wheel_asks_for_no_newer_system_than_its_tag_promises(tmp_path, platform):
    for package in ("ziglang", "auditwheel"):
        pytest.importorskip(package, reason=f"the PyPI package {package} is not installed")
    # its own folder as the path of libraries: what this machine has must not count
    command = [sys.executable, "-m", "auditwheel", "show", "--json", "--ldpaths", tmp_path, build(tmp_path, platform)]
    verdict = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    system, *needs, processor = _parts(verdict["sym_tag"])
    promised_system, *promises, promised_processor = _parts(platform.partition(".")[0])
    assert (system, processor) == (promised_system, promised_processor)
    assert needs <= promises
    assert verdict["overall_tag"] == verdict["sym_tag"]


@pytest.mark.parametrize("platform", [name for name in PLATFORMS if "linux" in name])
def test_the_shared_object_calls_nothing_whose_last_digit_depends_on_the_system(tmp_path, platform):
    elffile = pytest.importorskip("elftools.elf.elffile", reason="the PyPI package pyelftools is not installed")
    pytest.importorskip("ziglang", reason="the PyPI package ziglang is not installed")
    with zipfile.ZipFile(build(tmp_path, platform)) as archive:
        found = elffile.ELFFile(io.BytesIO(archive.read("mumacro/_kernel.so"))).get_section_by_name(".dynsym")
    symbols = [(symbol.name, symbol["st_shndx"]) for symbol in found.iter_symbols() if symbol.name]
    harmless = {"memcmp", "memcpy", "memmove", "memset", "strlen"}
    assert {name for name, place in symbols if place == "SHN_UNDEF"} <= harmless
    offered = {"mumacro_kernel_at", "mumacro_xla_handler", "mumacro_xla_open"}
    assert {name for name, place in symbols if place != "SHN_UNDEF"} == offered


def _parts(tag):
    system, major, minor, processor = re.fullmatch(r"(\w+linux)_(\d+)_(\d+)_(\w+)", tag).groups()
    return system, int(major), int(minor), processor


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


@pytest.mark.parametrize("words", [("mumacro.service",), ("mumacro.builder", "solve", "--v", "0.1", "--y", "0.5")])
def test_parts_of_the_package_run_by_their_names_too(installed, words):
    assert "is not installed: pip install" in installed.run("python", "-m", *words, code=1)
