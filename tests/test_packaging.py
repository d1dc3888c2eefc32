"""The distribution: one version, tables with the library, a one-line message if something is missing."""

import re
import subprocess
import sys

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


def test_a_missing_module_of_the_project_itself_is_not_explained_away():
    with pytest.raises(ModuleNotFoundError):
        missing("builder", ModuleNotFoundError("No module named 'builder.nothing'", name="builder.nothing"))
