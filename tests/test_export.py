"""``python -m builder export``: every format read back by its program: the same numbers, the same bytes."""

import csv
import json
import math
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from scipy.io import loadmat

from builder.c import wasm
from builder.export import FORMATS, MODELICA_TABLES, ExportError, export_table, long_columns
from comparing import close
from mumacro.errors import TableError
from mumacro.table import read_table

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def path(tables_dir):
    return tables_dir / "mumacro-1e-10.nc"


@pytest.fixture(scope="module")
def table(path):
    return read_table(path)


@pytest.fixture(scope="module")
def written(path, tmp_path_factory):
    """Every format, once."""
    folder = tmp_path_factory.mktemp("export")
    for kind, (name, _) in FORMATS.items():
        if kind == "parquet":
            pytest.importorskip("pyarrow")
        if kind == "wasm" and wasm.compiler() is None:
            continue
        export_table(path, kind, folder / name.format("grid"))
    return folder


def matrices(text):
    """The matrices of a Modelica text table, by the rules of ModelicaStandardTables: #1, headers, numbers, comments."""
    first, *lines = text.splitlines()
    assert first == "#1"
    found, name, shape, numbers = {}, None, None, []
    for line in [*lines, "double end(0,0)"]:
        body = line.split("#", 1)[0].strip()
        header = re.fullmatch(r"(?:double|float)\s+(\w+)\s*\(\s*(\d+)\s*,\s*(\d+)\s*\)", body)
        if header:
            if name is not None:
                assert len(numbers) == shape[0] * shape[1], name
                found[name] = np.array(numbers).reshape(shape)
            name, shape, numbers = header[1], (int(header[2]), int(header[3])), []
        else:
            numbers += [float(word) for word in re.split(r"[\s,;]+", body) if word]
    return found


def test_a_row_of_the_csv_is_a_node(table, written):
    with (written / "grid.csv").open(newline="", encoding="ascii") as stream:
        header, *rows = csv.reader(stream)
    assert header == ["v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit"]
    assert len(rows) == table.mu_ratio.size
    columns = dict(zip(header, np.array(rows, dtype=np.float64).T, strict=True))
    shape = table.mu_ratio.shape
    assert np.array_equal(columns["mu_ratio"].reshape(shape), table.mu_ratio)
    assert np.array_equal(columns["v_tilde"].reshape(shape)[:, 0], table.v_tilde)
    assert np.array_equal(columns["y_tilde"].reshape(shape)[3], table.y_tilde)
    assert np.array_equal(columns["v_tilde_crit"].reshape(shape)[5], table.v_tilde_crit)
    assert np.array_equal(columns["stick_fraction"].reshape(shape), table.stick_fraction)


def test_the_mat_file_holds_the_matrices(table, written):
    found = loadmat(written / "grid.mat")
    for name in ("mu_ratio", "stick_fraction", "error_estimate"):
        assert np.array_equal(found[name], getattr(table, name))
    for name in ("v_tilde", "y_tilde", "v_tilde_crit"):
        assert found[name].shape == (getattr(table, name).size, 1)
        assert np.array_equal(found[name].ravel(), getattr(table, name))
    info = found["info"][0, 0]
    assert info["tolerance"][0, 0] == 1e-10
    assert info["content_sha256"][0] == table.attributes["content_sha256"]


def test_the_modelica_file_is_one_by_its_rules(table, written):
    text = (written / "grid.txt").read_text("ascii")
    found = matrices(text)
    assert tuple(found) == MODELICA_TABLES
    assert len(re.findall(r"^double \w+\(\d+,\d+\)$", text, re.MULTILINE)) == len(found)
    for name in ("mu_ratio", "stick_fraction", "error_estimate"):
        matrix = found[name]
        assert matrix[0, 0] == 0.0
        assert np.array_equal(matrix[1:, 0], table.v_tilde)
        assert np.array_equal(matrix[0, 1:], table.y_tilde)
        assert np.array_equal(matrix[1:, 1:], getattr(table, name))
    for name in ("mu_ratio_log10", "stick_fraction_log10"):
        matrix = found[name]
        assert matrix[1:, 0] == close(np.log10(table.v_tilde), abs=1e-15)
        assert matrix[0, 1:] == close(np.log10(table.y_tilde), abs=1e-15)
        assert np.array_equal(matrix[1:, 1:], getattr(table, name.removesuffix("_log10")))
        # axes of a CombiTable2Ds ascend strictly
        assert np.all(np.diff(matrix[1:, 0]) > 0.0)
        assert np.all(np.diff(matrix[0, 1:]) > 0.0)
    assert np.array_equal(found["v_tilde_crit"], np.column_stack((table.y_tilde, table.v_tilde_crit)))


def test_parquet_has_the_rows_and_the_tables_attributes(table, written):
    parquet = pytest.importorskip("pyarrow.parquet")
    found = parquet.read_table(written / "grid.parquet")
    for name, column in long_columns(table).items():
        assert np.array_equal(found[name].to_numpy(), column)
    metadata = {key.decode(): value.decode() for key, value in found.schema.metadata.items()}
    assert metadata["content_sha256"] == table.attributes["content_sha256"]
    assert float(metadata["tolerance"]) == 1e-10


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_table_gives_the_same_bytes(path, written, tmp_path, kind):
    if kind == "wasm" and wasm.compiler() is None:
        with pytest.raises(wasm.WasmError, match="zig"):
            export_table(path, kind, tmp_path / "again")
        pytest.skip("neither zig nor clang with lld is installed")
    export_table(path, kind, tmp_path / "again.h")
    assert (tmp_path / "again.h").read_bytes() == (written / FORMATS[kind][0].format("grid")).read_bytes()
    assert [entry.name for entry in tmp_path.iterdir()] == ["again.h"]


def test_c_in_three_files_is_written_twice_alike(path, tmp_path):
    for folder in ("one", "two", "two"):
        export_table(path, "c", tmp_path / folder)
    one, two = (
        {entry.name: entry.read_bytes() for entry in (tmp_path / folder).iterdir()} for folder in ("one", "two")
    )
    assert set(one) == {"mumacro.h", "mumacro.c", "mumacro_table.c"}
    assert one == two


def test_octave_reads_the_mat_file(table, written, repository, surrogate):
    if shutil.which("octave-cli") is None:
        pytest.skip("octave-cli is not installed")
    command = ["octave-cli", "--norc", "examples/octave_mat.m", str(written / "grid.mat")]
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    nodes, across = table.mu_ratio.shape
    assert f"{nodes} x {across} nodes, table of tolerance 1e-10" in done.stdout
    case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
    shown = float(re.search(r"mu_macro = ([\d.]+)", done.stdout)[1])
    assert shown == close(surrogate.evaluate(**case).mu_macro, abs=1e-4)  # a spline across the border
    shown = float(re.search(r"from v0 = ([\d.]+) m/s", done.stdout)[1])
    assert shown == close(surrogate.v_tilde_crit(2.0 / 3.0) * 3e-6 * 1.3e5, rel=1e-4)


def test_the_modelica_example_names_what_is_there(repository):
    text = (repository / "examples" / "modelica.md").read_text("utf-8")
    named = set(re.findall(r"`(\w+)`", text)) & set(MODELICA_TABLES)
    assert named == set(MODELICA_TABLES)
    assert re.search(r'tableName = "(\w+)"', text)[1] in MODELICA_TABLES


def test_the_logarithmic_matrix_is_the_one_to_interpolate(written, surrogate):
    from scipy.interpolate import RegularGridInterpolator

    rng = np.random.default_rng(8)
    v, y = 10.0 ** rng.uniform(-2.9, 2.9, (2, 2000))
    exact = surrogate.mu_ratio(v, y)
    error = {}
    for name, place in (("mu_ratio", (v, y)), ("mu_ratio_log10", (np.log10(v), np.log10(y)))):
        matrix = matrices((written / "grid.txt").read_text("ascii"))[name]
        linear = RegularGridInterpolator((matrix[1:, 0], matrix[0, 1:]), matrix[1:, 1:])
        error[name] = np.sqrt(np.mean((linear(np.column_stack(place)) - exact) ** 2))
    assert error["mu_ratio_log10"] < error["mu_ratio"] < 0.01


def test_the_command_writes_to_the_current_folder_by_default_and_names_the_file(
    run_builder, path, table, tmp_path, repository
):
    command = [sys.executable, "-m", "builder", "export", str(path), "--format", "mat"]
    environment = {**os.environ, "PYTHONPATH": str(repository)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {
        "table": str(path), "format": "mat", "out": "mumacro-1e-10.mat", "shape": list(table.mu_ratio.shape)
    }  # fmt: skip
    assert math.isclose(loadmat(tmp_path / "mumacro-1e-10.mat")["v_tilde"][0, 0], 1e-3)
    done = run_builder("export", path, "--format", "csv", "--out", tmp_path / "grid.csv")
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "grid.csv").read_text("ascii").splitlines()) == 1 + table.mu_ratio.size


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [(("no-such.nc", "--format", "csv"), 1, "no-such.nc"), (("README.md", "--format", "csv"), 1, "README.md"),
     (("x.nc", "--format", "xls"), 2, "--format"), (("x.nc",), 2, "--format"),
     (("tables/mumacro-1e-4.nc", "--format", "csv", "--out", "docs"), 2, "--out"),
     (("tables/mumacro-1e-4.nc", "--format", "csv", "--out", "no/such/folder.csv"), 1, "no/such"),
     (("tables/mumacro-1e-4.nc", "--format", "csv", "--out", "tables/mumacro-1e-4.nc"), 1, "is the table itself")],
)  # fmt: skip
def test_what_cannot_be_exported_is_reported_in_one_line(run_builder, arguments, code, said):
    done = run_builder("export", *arguments)
    assert done.returncode == code
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_a_failure_leaves_the_old_file(path, tmp_path, monkeypatch):
    out = tmp_path / "grid.csv"
    out.write_text("before")

    def full(_handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        export_table(path, "csv", out)
    assert out.read_text() == "before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["grid.csv"]


def test_parquet_without_pyarrow_names_the_extra(path, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ExportError, match="arrow"):
        export_table(path, "parquet", tmp_path / "x.parquet")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ExportError, match="xls"):
        export_table(path, "xls", tmp_path / "x.xls")
    with pytest.raises(TableError):
        export_table(tmp_path / "none.nc", "csv", tmp_path / "x.csv")
