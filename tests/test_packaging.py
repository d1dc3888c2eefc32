"""The distribution: one version, tables with the library, a one-line message if something is missing."""

import importlib
import os
import re
import shutil
import subprocess
import sys
import tarfile

import pytest

import mumacro
import service
from mumacro import bundled
from mumacro.extras import missing
from service.settings import load_settings


def test_the_version_is_the_same_wherever_a_file_must_repeat_it(repository):
    version = mumacro.__version__
    assert service.__version__ == version
    for name, pattern in (
        ("CITATION.cff", r"^version: (.+)$"),
        ("Dockerfile", r'image\.version="(.+?)"'),
        ("deploy/compose.yaml", r"image: mumacro:(\S+)"),
        ("deploy/kubernetes.yaml", r'(?:image: mumacro:|kubernetes\.io/version: ")([^"\s]+)'),
    ):
        found = re.findall(pattern, (repository / name).read_text("utf-8"), re.MULTILINE)
        assert found, name
        assert set(found) == {version}, name


def test_the_manifest_gives_a_pod_nothing_that_it_does_not_need(repository):
    yaml = pytest.importorskip("yaml", reason="the PyPI package PyYAML is not installed")
    found = {
        one["kind"]: one for one in yaml.safe_load_all((repository / "deploy" / "kubernetes.yaml").read_text("utf-8"))
    }
    assert {"Deployment", "Service", "HorizontalPodAutoscaler", "PodDisruptionBudget", "NetworkPolicy"} < found.keys()
    pod = found["Deployment"]["spec"]["template"]["spec"]
    (container,) = pod["containers"]
    assert pod["automountServiceAccountToken"] is found["ServiceAccount"]["automountServiceAccountToken"] is False
    assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
    assert pod["securityContext"]["runAsNonRoot"] is True
    allowed = container["securityContext"]
    assert (allowed["allowPrivilegeEscalation"], allowed["readOnlyRootFilesystem"]) == (False, True)
    assert allowed["capabilities"] == {"drop": ["ALL"]}
    assert container["lifecycle"]["preStop"]
    assert found["NetworkPolicy"]["spec"]["egress"] == []
    labels = found["Deployment"]["spec"]["template"]["metadata"]["labels"]
    for kind in ("NetworkPolicy", "PodDisruptionBudget", "Service"):
        spec = found[kind]["spec"]
        selector = spec.get("podSelector") or spec["selector"]
        assert selector.get("matchLabels", selector).items() <= labels.items(), kind
    scaled = found["HorizontalPodAutoscaler"]["spec"]
    assert scaled["scaleTargetRef"]["name"] == found["Deployment"]["metadata"]["name"]
    assert scaled["minReplicas"] > found["PodDisruptionBudget"]["spec"]["minAvailable"]
    grace = load_settings().shutdown_grace_s + 3.0  # preStop
    assert pod["terminationGracePeriodSeconds"] > grace


# --- the build ---------------------------------------------------------------------------------------


def _build(repository, *arguments, code="", **variables):
    """Run hatch_build.py of a checkout; `code` runs first."""
    program = f"{code}\nimport runpy; runpy.run_path('hatch_build.py', run_name='__main__')"
    env = {name: value for name, value in os.environ.items() if name != "CC"} | variables
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=repository, env=env, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip


def _requirements(repository, **variables):
    program = "import hatchling.build as b; print(*b.get_requires_for_build_wheel())"
    env = {name: value for name, value in os.environ.items() if name != "CC"} | variables
    return subprocess.run(
        [sys.executable, "-c", program], cwd=repository, env=env, capture_output=True, text=True, check=True
    )


def test_zig_is_a_build_requirement_only_where_no_compiler_works(repository, tmp_path):
    without = _requirements(repository, PATH=str(tmp_path))
    assert "ziglang>=" in without.stdout
    assert len(without.stderr.splitlines()) == 1
    assert "ziglang" in without.stderr
    if os.name != "nt" and shutil.which("cc"):
        assert _requirements(repository).stdout.strip() == ""


def test_a_compiler_without_headers_counts_as_none(repository, tmp_path):
    broken = tmp_path / "cc"
    broken.write_text("#!/bin/sh\necho 'fatal error: math.h: No such file or directory' >&2; exit 1\n")
    broken.chmod(0o755)
    assert "ziglang>=" in _requirements(repository, PATH=str(tmp_path)).stdout


def test_another_platform_is_always_compiled_by_zig(repository):
    assert "ziglang>=" in _requirements(repository, MUMACRO_BUILD_PLATFORM="win_amd64").stdout


@pytest.mark.parametrize(
    ("variables", "code", "words"),
    [
        ({"PATH": ""}, "import sys; sys.modules['ziglang'] = None", "pip install ziglang"),
        ({"CC": "no-such-compiler"}, "", "CC=no-such-compiler"),
        ({"MUMACRO_BUILD_DEBUG": "1", "PATH": ""}, "", "needs gcc or clang"),
    ],
)
def test_a_build_that_cannot_be_made_says_so_in_one_line(repository, tmp_path, variables, code, words):
    done = _build(repository, tmp_path, code=code, **variables)
    assert done.returncode == 1
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_platform_without_a_wheel_is_refused_by_name(repository):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel"]
    env = {**os.environ, "MUMACRO_BUILD_PLATFORM": "amiga"}
    done = subprocess.run(command, cwd=repository, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "MUMACRO_BUILD_PLATFORM=amiga is not one of" in done.stderr
    assert "win_amd64" in done.stderr


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
def test_a_failed_compilation_keeps_the_shared_object_that_was_there(repository, tmp_path):
    checkout = tmp_path / "checkout"
    for folder in ("mumacro/kernel", "third_party"):
        shutil.copytree(repository / folder, checkout / folder)
    for name in ("hatch_build.py", "pyproject.toml"):
        shutil.copy(repository / name, checkout)
    assert _build(checkout).returncode == 0
    (before,) = (checkout / "mumacro").glob("_kernel.*")
    content, bits = before.read_bytes(), before.stat().st_ino
    (checkout / "mumacro" / "kernel" / "kernel.c").write_text("#error broken\n")
    done = _build(checkout)
    assert done.returncode == 1
    assert "broken" in done.stderr
    assert (before.read_bytes(), before.stat().st_ino) == (content, bits)
    assert {path.name for path in (checkout / "mumacro").iterdir()} == {"kernel", before.name}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux" or not shutil.which("gcc"), reason="needs Linux and gcc")
def test_the_debug_build_has_both_sanitizers_and_the_other_has_neither(repository, tmp_path):
    for name, variables in (("debug", {"MUMACRO_BUILD_DEBUG": "1"}), ("fast", {})):
        (tmp_path / name).mkdir()
        done = _build(repository, tmp_path / name, CC="gcc", **variables)
        assert done.returncode == 0, done.stderr
        made = (tmp_path / name / "_kernel.so").read_bytes()
        assert (b"libasan" in made, b"libubsan" in made) == ((name == "debug",) * 2)


def test_the_development_command_sees_a_change_of_the_c_sources(repository, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(repository)
    dev = importlib.import_module("dev")
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    for path in ("hatch_build.py", "mumacro/kernel/kernel.c", "mumacro/_kernel.so"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(path)
    shutil.copytree(repository / "requirements", tmp_path / "requirements")
    seen = [dev.current()["kernel"]]
    (tmp_path / "mumacro/kernel/kernel.c").touch()
    assert dev.current()["kernel"] == seen[0]
    for change in (
        lambda: (tmp_path / "mumacro/kernel/kernel.c").write_text("other"),
        lambda: (tmp_path / "mumacro/kernel/new.h").write_text("new"),
        lambda: (tmp_path / "hatch_build.py").write_text("other flags"),
        lambda: (tmp_path / "mumacro/_kernel.so").unlink(),
    ):
        change()
        seen.append(dev.current()["kernel"])
    assert len(set(seen)) == 5


@pytest.mark.slow
def test_the_source_distribution_builds_and_its_tests_collect(repository, tmp_path):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path]
    subprocess.run(command, cwd=repository, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        opened.extractall(tmp_path, filter="data")
    source = tmp_path / archive.name.removesuffix(".tar.gz")
    assert not list((source / "mumacro").glob("_kernel.*"))
    done = _build(source)
    assert done.returncode == 0, done.stderr
    command = [sys.executable, "-m", "pytest", "--collect-only", "-m", "", "-p", "no:cacheprovider"]
    env = {**os.environ, "PYTHONPATH": str(source)}
    done = subprocess.run(command, cwd=source, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:]
    collected = {line.partition("::")[0] for line in done.stdout.splitlines() if "::" in line}
    assert collected == {f"tests/{path.name}" for path in (repository / "tests").glob("test_*.py")}


# --- the installed package -----------------------------------------------------------------------------


def test_a_name_that_the_service_does_not_have_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = service.nothing


def test_a_checkout_finds_its_committed_tables(repository, tables_dir):
    assert bundled.bundled_tables() == sorted(tables_dir.glob("*.nc"))
    assert repository / "tables" / "mumacro-1e-10.nc" in bundled.bundled_tables()


def test_an_installed_package_finds_its_own_tables_and_no_others(tmp_path, monkeypatch):
    package, stranger = tmp_path / "mumacro", tmp_path / "tables"
    package.mkdir()
    stranger.mkdir()
    (stranger / "hdf5-table.nc").touch()
    monkeypatch.setattr(bundled, "_PACKAGE", package)
    assert bundled.bundled_tables() == []
    (package / "data").mkdir()
    (package / "data" / "mumacro-1e-10.nc").touch()
    assert bundled.bundled_tables() == [package / "data" / "mumacro-1e-10.nc"]


@pytest.mark.parametrize("module", ["service", "builder", "mumacro"])
def test_without_packages_one_line_says_what_to_install(repository, module):
    # -S leaves out site-packages: only the standard library is available
    done = subprocess.run(
        [sys.executable, "-S", "-m", module], cwd=repository, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert re.fullmatch(r".*(\w+) is not installed: pip install 'mumacro.*", done.stderr.strip())


@pytest.mark.parametrize("module", ["builder", "mumacro"])
def test_without_the_compiled_kernel_one_line_says_what_to_do(repository, tmp_path, module):
    for name in {"mumacro", module}:
        shutil.copytree(repository / name, tmp_path / name, ignore=shutil.ignore_patterns("_kernel.*", "__pycache__"))
    done = subprocess.run(
        [sys.executable, "-m", module], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert re.fullmatch(r".*compiled kernel.* missing .* C compiler .* ziglang.*", done.stderr.strip())


def test_a_missing_module_of_the_project_itself_is_not_explained_away():
    with pytest.raises(ModuleNotFoundError):
        missing("builder", ModuleNotFoundError("No module named 'builder.nothing'", name="builder.nothing"))
