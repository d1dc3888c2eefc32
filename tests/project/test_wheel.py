"""The wheel in a separate environment, without the checkout and without a compiler: ``pip install
mumacro``."""

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
from typing import Any

import pytest
from packaging.tags import platform_tags

from mumacro import Surrogate
from tests.support.places import ROOT

pytestmark = pytest.mark.slow

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PYTHONS = [
    line.rpartition(" ")[2]
    for line in PROJECT["project"]["classifiers"]
    if re.search(r":: 3\.\d+$", line)
]
PLATFORMS = PROJECT["tool"]["mumacro"]["wheels"]
CASE = "mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20690 v0=0.01"
CORE = ("numpy", "h5py", "cffi")


class Installed:
    """A virtual environment with the wheel and its dependencies; nothing else is on the PATH of its
    programs."""

    def __init__(self, folder: Path, wheel: Path, python: str = sys.executable) -> None:
        self.folder = folder
        self.bin = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        # the tested versions, probably in a cache
        pins = folder / "pins.txt"
        pins.write_text("".join(f"{name}=={importlib.metadata.version(name)}\n" for name in CORE))
        wanted = ("--only-binary=:all:", "-c", str(pins), str(wheel))
        if uv := shutil.which("uv"):  # its cache is that of the other environments
            subprocess.run([uv, "venv", "-q", "-p", python, folder / "venv"], check=True)
            into = ("-p", self.bin / "python", "--no-progress")
            subprocess.run([uv, "pip", "install", "-q", *into, *wanted], check=True)
            return
        subprocess.run([python, "-m", "venv", folder / "venv"], check=True)
        pip = ("-m", "pip", "--disable-pip-version-check", "install", "-q", "--no-compile")
        self.run("python", *pip, *wanted)

    def run(self, *words: Any, code: int = 0) -> Any:
        variables = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("PYTHON", "MUMACRO_"))
        }
        done = subprocess.run(
            [str(self.bin / words[0]), *words[1:]],
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=600,
            env={**variables, "PATH": str(self.bin)},
            check=False,
        )
        assert done.returncode == code, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout if code == 0 else done.stderr


def find_python(version: str) -> str:
    """A Python of that version, on the PATH or from pyenv; skips the test if there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    for name in map(
        str,
        filter(None, (shutil.which(f"python{version}"), *pyenv.glob(f"{version}.*/bin/python"))),
    ):
        if (
            subprocess.run(
                [name, "-c", "import venv, ensurepip"], capture_output=True, check=False
            ).returncode
            == 0
        ):
            return name
    return pytest.skip(f"Python {version} is neither on the PATH nor in pyenv")


def build(folder: Path, platform: str | None = None) -> Path:
    """The wheel for a platform, by zig; without a name, that which is published for this machine.

    Where ``dev.py wheels`` has made it after the last change of what goes into it, that one;
    without zig, a wheel of the compiler found here.
    """
    if platform is None:
        own = {*platform_tags()} if importlib.util.find_spec("ziglang") else set()
        platform = next((tags for tags in PLATFORMS if own & {*tags.split(".")}), "")
    places = (ROOT / name for name in ("src/mumacro", "builder", "service", "tables"))
    files = [
        path
        for place in places
        for path in place.rglob("*")
        # what is made there is no source
        if path.suffix not in (".so", ".pyc", "") and path.name != "_declarations.py"
    ]
    newest = max(
        path.stat().st_mtime for path in (*files, ROOT / "hatch_build.py", ROOT / "pyproject.toml")
    )
    wheels = [
        path
        for path in ROOT.glob(f"dist/*-{platform}.whl")
        if platform and path.stat().st_mtime > newest
    ]
    if not wheels:
        env = {**os.environ, "MUMACRO_BUILD_PLATFORM": platform}
        command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
        subprocess.run(command, cwd=ROOT, env=env, check=True)
        wheels = [*folder.glob("*.whl")]
    (result,) = wheels
    return result


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return build(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    return Installed(tmp_path_factory.mktemp("bare"), wheel)


@pytest.mark.parametrize("version", PYTHONS)
def test_one_wheel_gives_every_python_the_same_bits(
    wheel: Any, installed: Any, tmp_path: Path, version: Any
) -> None:
    own = version == "{}.{}".format(*sys.version_info)
    python = installed if own else Installed(tmp_path, wheel, find_python(version))
    answer = json.loads(python.run("mumacro", CASE, "--json"))
    case = {name: float(value) for name, value in (word.split("=") for word in CASE.split())}
    assert answer["mu_macro"] == Surrogate.open().evaluate(case).mu_macro
    assert answer["table"]["id"] == Surrogate.open().id


def test_the_wheel_holds_the_sources_and_one_shared_object_for_every_python(
    wheel: Any, repository: Path
) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (metadata,) = (
            archive.read(name).decode() for name in names if name.endswith(".dist-info/WHEEL")
        )
    assert len([name for name in names if name.startswith("mumacro/_kernel.")]) == 1
    assert "mumacro/kernel/_declarations.py" in names
    sources = {
        f"mumacro/kernel/{path.name}"
        for path in (repository / "src" / "mumacro" / "kernel").iterdir()
    }
    assert sources == {name for name in names if name.startswith("mumacro/kernel/")}
    assert "Root-Is-Purelib: false" in metadata
    tags = re.findall(r"^Tag: (.*)$", metadata, re.MULTILINE)
    assert tags
    assert all(re.fullmatch("py3-none-(?!any).+", tag) for tag in tags)


@pytest.mark.parametrize("platform", [name for name in PLATFORMS if "linux" in name])
def test_a_linux_wheel_asks_for_no_newer_system_and_calls_no_mathematics(
    tmp_path: Path, platform: Any
) -> None:
    for package in ("ziglang", "auditwheel", "elftools"):
        pytest.importorskip(package, reason=f"the package {package} is not installed")
    wheel = build(tmp_path, platform)
    # an empty folder as the path of libraries: what this machine has must not count
    command = [
        sys.executable,
        "-m",
        "auditwheel",
        "show",
        "--json",
        "--ldpaths",
        str(tmp_path),
        str(wheel),
    ]
    verdict = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    system, *needs, processor = _parts(verdict["sym_tag"])
    promised_system, *promises, promised_processor = _parts(platform.partition(".")[0])
    assert (system, processor) == (promised_system, promised_processor)
    assert needs <= promises
    assert verdict["overall_tag"] == verdict["sym_tag"]
    elffile = importlib.import_module("elftools.elf.elffile")
    with zipfile.ZipFile(wheel) as archive:
        result = elffile.ELFFile(
            io.BytesIO(archive.read("mumacro/_kernel.so"))
        ).get_section_by_name(".dynsym")
    symbols = [(symbol.name, symbol["st_shndx"]) for symbol in result.iter_symbols() if symbol.name]
    harmless = {"memcmp", "memcpy", "memmove", "memset", "strlen"}
    assert {name for name, place in symbols if place == "SHN_UNDEF"} <= harmless
    assert {name for name, place in symbols if place != "SHN_UNDEF"} == {"mumacro_kernel_at"}


def _parts(tag: Any) -> Any:
    ((system, major, minor, processor),) = re.findall(r"^(\w+linux)_(\d+)_(\d+)_(\w+)$", tag)
    return system, int(major), int(minor), processor


def test_the_tables_are_inside_the_package_and_nothing_generic_is_beside_it(installed: Any) -> None:
    output = json.loads(installed.run("mumacro", "table", "--json"))
    site = Path(output["path"]).parents[2]
    assert site.name == "site-packages"
    assert [Path(path).parent for path in output["bundled"]] == [site / "mumacro" / "data"] * 4
    for name in ("service", "builder", "friction", "tables", "tests"):
        assert not (site / name).exists()
    program = (
        "import mumacro as f, importlib.metadata as m; print(f.__version__ == "
        "m.version('mumacro'), f.__file__)"
    )
    assert installed.run("python", "-c", program).split() == [
        "True",
        str(site / "mumacro" / "__init__.py"),
    ]


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        ("mumacro serve", "service"),
        ("mumacro eval cases.csv -o out.csv", "files"),
        ("python -m mumacro.service", "service"),
        ("python -m mumacro.builder solve --v 0.1 --y 0.5", "builder"),
    ],
)
def test_without_an_extra_one_line_says_what_to_install(
    installed: Any, words: Any, extra: Any
) -> None:
    message = installed.run(*words.split(), code=1)
    assert len(message.splitlines()) == 1
    assert f'pip install "mumacro[{extra}]"' in message
