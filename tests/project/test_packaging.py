"""The distribution: one version, tables with the library, a one-line message if something is
missing."""

import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import mumacro
import service
from mumacro.errors import missing
from mumacro.table import bundled
from service.settings import load_settings


def test_the_version_is_the_same_wherever_a_file_must_repeat_it(repository: Path) -> None:
    assert service.__version__ == mumacro.__version__
    for name, pattern in (
        ("CITATION.cff", r"^version: (.+)$"),
        ("Dockerfile", r'image\.version="(.+?)"'),
        ("deploy/compose.yaml", r"image: mumacro:(\S+)"),
        ("deploy/kubernetes.yaml", r'(?:image: mumacro:|kubernetes\.io/version: ")([^"\s]+)'),
    ):
        matches = re.findall(pattern, (repository / name).read_text("utf-8"), re.MULTILINE)
        assert set(matches) == {mumacro.__version__}, name


def test_the_parts_of_the_manifest_belong_together(repository: Path) -> None:
    yaml = pytest.importorskip("yaml", reason="the PyPI package PyYAML is not installed")
    text = (repository / "deploy" / "kubernetes.yaml").read_text("utf-8")
    result = {one["kind"]: one for one in yaml.safe_load_all(text)}
    pod = result["Deployment"]["spec"]["template"]["spec"]
    labels = result["Deployment"]["spec"]["template"]["metadata"]["labels"]
    for kind in ("NetworkPolicy", "PodDisruptionBudget", "Service"):
        spec = result[kind]["spec"]
        selector = spec.get("podSelector") or spec["selector"]
        assert selector.get("matchLabels", selector).items() <= labels.items(), kind
    scaled = result["HorizontalPodAutoscaler"]["spec"]
    assert scaled["scaleTargetRef"]["name"] == result["Deployment"]["metadata"]["name"]
    assert scaled["minReplicas"] > result["PodDisruptionBudget"]["spec"]["minAvailable"]
    assert pod["terminationGracePeriodSeconds"] > load_settings().shutdown_grace_s + 3.0  # preStop


@pytest.mark.slow
def test_the_image_was_built_and_tried() -> None:
    """.ci/run has done it before the tests; where it could not, this is a skip that has a name."""
    if "container-engine" in os.environ.get("CI_MISSING", "").split():
        pytest.skip("container-engine is not here: the image was neither built nor tried")
    if "CI_CONTAINER" not in os.environ:
        pytest.skip("the image is built and tried by .ci/run, or by bash deploy/container.sh")
    assert os.environ["CI_CONTAINER"] == "0"


def test_the_manifests_give_each_worker_the_memory_that_was_tried(repository: Path) -> None:
    def read(name: str) -> str:
        return (repository / name).read_text("utf-8")

    (megabytes,) = re.findall(r"^WORKER_MB=(\d+) ", read("deploy/container.sh"), re.MULTILINE)
    assert re.findall(r"limits: \{memory: (\d+)Mi\}", read("deploy/kubernetes.yaml")) == [megabytes]
    assert re.findall(r"mem_limit: (\d+)m", read("deploy/compose.yaml")) == [megabytes]
    assert f"{megabytes} MiB for each worker" in read("docs/operations.md")
    (largest,) = re.findall(r"^LARGEST_MB=\S+:-(\d+)\}", read("deploy/container.sh"), re.MULTILINE)
    assert f"at most {largest} MB over its base" in read("docs/operations.md")


BUILD = "import runpy; runpy.run_path('hatch_build.py', run_name='__main__')"
REQUIREMENTS = "import hatchling.build as b; print(*b.get_requires_for_build_wheel())"


def python(folder: Path, program: Any, *arguments: Any, **variables: Any) -> Any:
    env = {name: value for name, value in os.environ.items() if name != "CC"} | variables
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(
        command, cwd=folder, env=env, capture_output=True, text=True, check=False, timeout=300
    )


@pytest.mark.parametrize("where", ["nothing", "without headers", "another platform", "here"])
def test_zig_is_a_build_requirement_only_where_no_compiler_works(
    repository: Path, tmp_path: Path, where: Any
) -> None:
    if where == "without headers":
        (tmp_path / "cc").write_text(
            "#!/bin/sh\necho 'fatal error: math.h: No such file' >&2; exit 1\n"
        )
        (tmp_path / "cc").chmod(0o755)
    other = {"MUMACRO_BUILD_PLATFORM": "win_amd64"}
    variables = {"another platform": other, "here": {}}.get(where, {"PATH": str(tmp_path)})
    done = python(repository, REQUIREMENTS, **variables)
    assert done.returncode == 0, done.stderr
    assert ("ziglang>=" in done.stdout) == (where != "here" or not shutil.which("cc"))
    assert len(done.stderr.splitlines()) == ("PATH" in variables)
    assert "PATH" not in variables or "ziglang" in done.stderr


def test_a_build_that_cannot_be_made_says_so_in_one_line(repository: Path, tmp_path: Path) -> None:
    for variables, code, words in (
        ({"PATH": ""}, "import sys; sys.modules['ziglang'] = None", "pip install ziglang"),
        ({"CC": "no-such-compiler"}, "", "CC=no-such-compiler"),
        ({"MUMACRO_BUILD_DEBUG": "1", "PATH": ""}, "", "needs gcc or clang"),
    ):
        done = python(repository, f"{code}\n{BUILD}", tmp_path, **variables)
        assert (done.returncode, len(done.stderr.splitlines())) == (1, 1)
        assert words in done.stderr
        assert not list(tmp_path.iterdir())


def test_a_platform_without_a_wheel_is_named(repository: Path) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel"]
    env = {**os.environ, "MUMACRO_BUILD_PLATFORM": "amiga"}
    done = subprocess.run(
        command, cwd=repository, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert re.search("MUMACRO_BUILD_PLATFORM=amiga is not one of .*win_amd64", done.stderr)


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
def test_a_failed_compilation_keeps_the_shared_object_that_was_there(
    repository: Path, tmp_path: Path
) -> None:
    shutil.copytree(
        repository / "src" / "mumacro" / "kernel", tmp_path / "src" / "mumacro" / "kernel"
    )
    for name in ("hatch_build.py", "pyproject.toml"):
        shutil.copy(repository / name, tmp_path)
    before = tmp_path / "src" / "mumacro" / "_kernel.so"
    before.write_bytes(b"a shared object")
    (tmp_path / "src" / "mumacro" / "kernel" / "kernel.c").write_text("#error broken\n")
    done = python(tmp_path, BUILD)
    assert done.returncode == 1
    assert "broken" in done.stderr
    assert before.read_bytes() == b"a shared object"
    assert {path.name for path in (tmp_path / "src" / "mumacro").iterdir()} == {
        "kernel",
        before.name,
    }


@pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
def test_a_kernel_is_compiled_once_for_the_same_sources_compiler_and_flags(
    repository: Path, tmp_path: Path
) -> None:
    """The debug build alone has both sanitizers."""
    kernel = shutil.copytree(
        repository / "src" / "mumacro" / "kernel", tmp_path / "src" / "mumacro" / "kernel"
    )
    for name in ("hatch_build.py", "pyproject.toml"):
        shutil.copy(repository / name, tmp_path)
    compiler, calls = tmp_path / "cc", tmp_path / "calls"
    # it writes how often it was called into what it makes
    compiler.write_text(
        f"#!/bin/sh\ncase $* in --version) echo one; exit;; esac\necho $* >>{calls}\n"
        f"while [ $1 != -o ]; do shift; done; wc -l <{calls} >$2\n"
    )
    compiler.chmod(0o755)

    def made(**more: str) -> bytes:
        done = python(
            tmp_path, BUILD, **{"CC": str(compiler), "MUMACRO_BUILD_CACHE": "kept", **more}
        )
        assert done.returncode == 0, done.stderr
        return (tmp_path / "src" / "mumacro" / "_kernel.so").read_bytes()

    first = made()
    (tmp_path / "src" / "mumacro" / "_kernel.so").write_bytes(b"another")
    assert made() == first
    assert made(MUMACRO_BUILD_CACHE="empty") != first
    before = calls.read_text()
    assert "-fsanitize" not in before
    assert made(MUMACRO_BUILD_DEBUG="1") != first
    debug = calls.read_text().removeprefix(before).splitlines()
    assert debug
    assert all("-fsanitize=address,undefined " in line for line in debug)
    (kernel / "kernel.c").write_text("other")
    assert made() != first
    compiler.write_text(compiler.read_text().replace("echo one", "echo two"))
    shutil.copy(repository / "src" / "mumacro" / "kernel" / "kernel.c", kernel)
    assert made() != first
    compiler.write_text(compiler.read_text().replace("echo two", "echo one"))
    assert made() == first


def test_dev_py_sees_a_changed_c_source(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(repository)
    dev = importlib.import_module("dev")
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    kernel = tmp_path / "src" / "mumacro" / "kernel"
    kernel.mkdir(parents=True)
    made = ("src/mumacro/_kernel.so", "src/mumacro/kernel/_declarations.py")
    for path in ("hatch_build.py", "src/mumacro/kernel/kernel.c", *made):
        (tmp_path / path).write_text(path)
    shutil.copytree(repository / "requirements", tmp_path / "requirements")
    digests = {dev.current()["kernel"]}
    (kernel / "kernel.c").touch()
    assert digests == {dev.current()["kernel"]}
    for change in (
        lambda: (kernel / "kernel.c").write_text("other"),
        lambda: (kernel / "new.h").write_text("new"),
        lambda: (tmp_path / "hatch_build.py").write_text("other flags"),
        lambda: (tmp_path / "src" / "mumacro" / "_kernel.so").unlink(),
        lambda: (kernel / "_declarations.py").unlink(),
    ):
        change()
        digests.add(dev.current()["kernel"])
    assert len(digests) == 6


@pytest.mark.parametrize(
    ("uv", "fails", "programs"),
    [
        ("uv", False, ["uv"]),
        ("uv", True, ["uv", "python"]),
        (None, False, ["python"]),
    ],
)
def test_packages_are_installed_by_uv_where_it_is_there_and_else_by_pip(
    repository: Path, monkeypatch: pytest.MonkeyPatch, uv: Any, fails: bool, programs: list[str]
) -> None:
    monkeypatch.syspath_prepend(repository)
    dev = importlib.import_module("dev")
    used = []

    def run(program: str, *words: str, quiet: bool) -> int:
        used.append(Path(program).stem)
        assert words[-1] == "numpy"
        assert quiet
        return int(fails and program == uv)

    monkeypatch.setattr(dev, "run", run)
    monkeypatch.setattr(dev.shutil, "which", {"uv": uv}.get)
    dev.pip("numpy")
    assert used == programs


@pytest.mark.slow
def test_the_source_distribution_is_what_git_tracks_and_builds(
    repository: Path, tmp_path: Path
) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)]
    subprocess.run(command, cwd=repository, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tar.gz")
    # the oldest Python 3.11 has no filter of archives, and the newest warns where there is none
    subprocess.run(["tar", "-xzf", archive, "-C", tmp_path], check=True)
    source = tmp_path / archive.name.removesuffix(".tar.gz")
    held = {path.relative_to(source).as_posix() for path in source.rglob("*") if path.is_file()}
    assert held - {"PKG-INFO"} == tracked(repository)
    done = python(source, BUILD)
    assert done.returncode == 0, done.stderr


def tracked(repository: Path) -> set[str]:
    """The files that git tracks, and new ones that it does not ignore."""
    words = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(words, cwd=repository, capture_output=True, check=True, text=True)
    return {name for name in listed.stdout.split("\0") if name and (repository / name).is_file()}


def test_a_package_finds_its_own_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tables_dir: Path
) -> None:
    assert bundled.bundled_tables() == sorted(tables_dir.glob("*.nc"))  # a checkout
    package = tmp_path / "mumacro"
    for folder in (package, tmp_path / "tables"):
        folder.mkdir()
    (tmp_path / "tables" / "hdf5-table.nc").touch()
    monkeypatch.setattr(bundled, "_PACKAGE", package)
    monkeypatch.setattr(bundled, "_CHECKOUT", tmp_path)
    assert bundled.bundled_tables() == []
    (package / "data").mkdir()
    (package / "data" / "mumacro-1e-10.nc").touch()
    assert bundled.bundled_tables() == [package / "data" / "mumacro-1e-10.nc"]


PARTS = ("service", "builder", "mumacro")
LACKS = [(name, "packages", r'.*(\w+) is not installed: pip install "mumacro.*') for name in PARTS]
LACKS += [
    (name, "kernel", r".*compiled kernel.* missing: .*sources in .*/mumacro.* hide .* ziglang.*")
    for name in PARTS[1:]
]


@pytest.mark.parametrize(("module", "lacks", "message"), LACKS)
def test_one_line_says_what_is_missing(
    repository: Path, tmp_path: Path, module: Any, lacks: Any, message: Any
) -> None:
    made = ["_kernel.*", "_declarations.py"] if lacks == "kernel" else []
    ignored = shutil.ignore_patterns("__pycache__", *made)
    for name in {"mumacro", module}:
        source = "src/mumacro" if name == "mumacro" else name
        shutil.copytree(repository / source, tmp_path / name, ignore=ignored)
    # without site-packages: the standard library alone
    options = ["-S"] if lacks == "packages" else []
    command = [sys.executable, *options, "-m", module]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(message, done.stderr.strip())


def test_a_missing_module_of_the_project_itself_is_not_explained_away() -> None:
    with pytest.raises(ModuleNotFoundError):
        missing(
            "builder",
            ModuleNotFoundError("No module named 'builder.nothing'", name="builder.nothing"),
        )
