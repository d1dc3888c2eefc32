"""``python -m builder export``: every format read back by its program: the same numbers, the same bytes."""

import csv
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.io import loadmat

from builder.__main__ import main
from builder.c import wasm
from builder.c.source import ExportError
from builder.export import FORMATS, MODELICA_TABLES, export_table
from mumacro import Surrogate
from mumacro.errors import TableError
from mumacro.table import Table, read_table
from tests.cases import Capture, Case
from tests.comparing import close

pytestmark = pytest.mark.slow

PATH = Path(__file__).resolve().parent.parent / "tables" / "mumacro-1e-10.nc"
AXES, PLANES = ("v_tilde", "y_tilde", "v_tilde_crit"), ("mu_ratio", "stick_fraction", "error_estimate")


@pytest.fixture(scope="module")
def table() -> Table:
    return read_table(PATH)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Every format, once."""
    folder = tmp_path_factory.mktemp("export")
    for kind, (name, _) in FORMATS.items():
        if kind != "wasm" or wasm.compiler() is not None:
            export_table(PATH, kind, folder / name.format("grid"))
    return folder


# --- the numbers, by the program of each format; and the attributes that it carries ---------------------


def from_columns(columns: Any, table: Table) -> Any:
    """Columns of a row a node as matrices and axes."""
    full = {name: np.asarray(column, dtype=float).reshape(table.mu_ratio.shape) for name, column in columns.items()}
    assert list(full) == ["v_tilde", "y_tilde", *PLANES, "v_tilde_crit"]
    for name in AXES:
        full[name] = full[name][:, 0] if name == "v_tilde" else full[name][7]
    return full


def from_csv(path: Any, table: Table) -> Any:
    with path.open(newline="", encoding="ascii") as stream:
        header, *rows = csv.reader(stream)
    return from_columns(dict(zip(header, zip(*rows, strict=True), strict=True)), table), {}


def from_mat(path: Any, _table: Table) -> Any:
    found = loadmat(path)
    assert all(found[name].shape[1] == 1 for name in AXES)
    info = {name: found["info"][0, 0][name].ravel()[0] for name in ("tolerance", "content_sha256")}
    return {name: found[name].ravel() if name in AXES else found[name] for name in (*AXES, *PLANES)}, info


def from_parquet(path: Any, table: Table) -> Any:
    parquet = pytest.importorskip("pyarrow.parquet")
    found = parquet.read_table(path)
    attributes = {key.decode(): value.decode() for key, value in found.schema.metadata.items()}
    return from_columns({name: found[name].to_numpy() for name in found.column_names}, table), attributes


def matrices(path: Any) -> Any:
    """The matrices of a Modelica text table, by the rules of ModelicaStandardTables: #1, headers, numbers, comments."""
    first, *parts = re.split(r"^double (\w+)\((\d+),(\d+)\)$", path.read_text("ascii"), flags=re.MULTILINE)
    assert first.startswith("#1\n")
    assert all(line.startswith("#") for line in first.splitlines())
    found = {}
    for name, rows, columns, numbers in zip(*(parts[i::4] for i in range(4)), strict=True):
        found[name] = np.array(numbers.split(), dtype=float).reshape(int(rows), int(columns))
    return found


def from_modelica(path: Any, _table: Table) -> Any:
    read = matrices(path)
    assert tuple(read) == MODELICA_TABLES
    for name in PLANES:
        v, y = read[name][1:, 0], read[name][0, 1:]
        if name != "error_estimate":
            logarithmic = read[f"{name}_log10"]
            assert logarithmic[1:, 0] == close(np.log10(v), abs=1e-15)
            assert logarithmic[0, 1:] == close(np.log10(y), abs=1e-15)
            assert np.all(np.diff(logarithmic[1:, 0]) > 0.0)  # axes of a CombiTable2Ds ascend strictly
            assert np.array_equal(logarithmic[1:, 1:], read[name][1:, 1:])
        assert read[name][0, 0] == 0.0
    assert np.array_equal(read["v_tilde_crit"][:, 0], y)
    held = {name: read[name][1:, 1:] for name in PLANES}
    return held | {"v_tilde": v, "y_tilde": y, "v_tilde_crit": read["v_tilde_crit"][:, 1]}, {}


@pytest.mark.parametrize("read", [from_csv, from_mat, from_parquet, from_modelica])
def test_a_format_holds_the_grid_and_what_it_can_of_the_attributes(table: Table, written: Any, read: Any) -> None:
    kind = read.__name__.removeprefix("from_")
    found, attributes = read(written / FORMATS[kind][0].format("grid"), table)
    for name in (*AXES, *PLANES):
        assert np.array_equal(found[name], getattr(table, name)), name
    assert float(attributes.get("tolerance", 1e-10)) == 1e-10
    assert attributes.get("content_sha256", table.attributes["content_sha256"]) == table.attributes["content_sha256"]
    assert bool(attributes) == (kind in ("mat", "parquet"))


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_table_gives_the_same_bytes(written: Any, tmp_path: Path, kind: Any) -> None:
    if kind == "wasm" and wasm.compiler() is None:
        with pytest.raises(ExportError, match="zig"):
            export_table(PATH, kind, tmp_path / "again")
        pytest.skip("neither zig nor clang with lld is installed")
    export_table(PATH, kind, tmp_path / "again.h")
    assert (tmp_path / "again.h").read_bytes() == (written / FORMATS[kind][0].format("grid")).read_bytes()
    assert [entry.name for entry in tmp_path.iterdir()] == ["again.h"]


def test_c_in_three_files_is_written_twice_alike(tmp_path: Path) -> None:
    for folder in ("one", "two", "two"):
        export_table(PATH, "c", tmp_path / folder)
    one, two = ({file.name: file.read_bytes() for file in (tmp_path / name).iterdir()} for name in ("one", "two"))
    assert set(one) == {"mumacro.h", "mumacro.c", "mumacro_table.c"}
    assert one == two


def test_octave_reads_it(table: Table, written: Any, repository: Path, surrogate: Surrogate, case: Case) -> None:
    if shutil.which("octave-cli") is None:
        pytest.skip("octave-cli is not installed")
    command = ["octave-cli", "--norc", "examples/octave_mat.m", str(written / "grid.mat")]
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    nodes, across = table.mu_ratio.shape
    assert f"{nodes} x {across} nodes, table of tolerance 1e-10" in done.stdout
    shown = float(re.findall(r"mu_macro = ([\d.]+)", done.stdout)[0])
    assert shown == close(surrogate.evaluate(**case).mu_macro, abs=1e-4)  # a spline across the border
    shown = float(re.findall(r"from v0 = ([\d.]+) m/s", done.stdout)[0])
    assert shown == close(surrogate.v_tilde_crit(2.0 / 3.0) * 3e-6 * 1.3e5, rel=1e-4)


def test_the_logarithmic_matrix_is_the_one_to_interpolate(written: Any, surrogate: Surrogate) -> None:
    v, y = 10.0 ** np.random.default_rng(8).uniform(-2.9, 2.9, (2, 2000))
    error = {}
    for name, place in (("mu_ratio", (v, y)), ("mu_ratio_log10", (np.log10(v), np.log10(y)))):
        matrix = matrices(written / "grid.txt")[name]
        linear = RegularGridInterpolator((matrix[1:, 0], matrix[0, 1:]), matrix[1:, 1:])
        error[name] = np.sqrt(np.mean((linear(np.column_stack(place)) - surrogate.mu_ratio(v, y)) ** 2))
    assert error["mu_ratio_log10"] < error["mu_ratio"] < 0.01


# --- the command, what is refused -----------------------------------------------------------------------


def test_the_command_writes_to_the_current_folder_by_default_and_names_the_file(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(PATH), "--format", "mat"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "table": str(PATH), "format": "mat", "out": "mumacro-1e-10.mat", "shape": list(table.mu_ratio.shape)
    }  # fmt: skip
    assert np.array_equal(loadmat(tmp_path / "mumacro-1e-10.mat")["mu_ratio"], table.mu_ratio)


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [(["pyproject.toml", "--format", "csv"], 1, "pyproject.toml"), (["x.nc", "--format", "xls"], 2, "--format"),
     (["x.nc"], 2, "--format"), ([str(PATH), "--format", "csv", "--out", "."], 2, "--out")],
)  # fmt: skip
def test_what_the_command_cannot_export_is_reported_in_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Capture, arguments: Any, code: Any, said: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(PATH.parent.parent / "pyproject.toml", tmp_path)
    with pytest.raises(SystemExit) as end:
        sys.exit(main(["export", *arguments]))
    assert end.value.code == code
    told = capsys.readouterr().err
    assert said in told
    assert len(told.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["pyproject.toml"]


def test_what_cannot_be_exported_is_refused_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copy, folder = Path(shutil.copy(PATH, tmp_path / "table.nc")), tmp_path / "folder.h"
    folder.mkdir()
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for path, kind, out, error, said in (
        (PATH, "parquet", "x.parquet", ExportError, "arrow"),
        (PATH, "xls", "x.xls", ExportError, "xls"),
        (tmp_path / "none.nc", "csv", "x.csv", TableError, "no such file"),
        (copy, "csv", "table.nc", ExportError, "is the table itself"),
        (PATH, "csv", "no/such/x.csv", FileNotFoundError, "no/such"),
        (PATH, "c", "no/such/x.h", FileNotFoundError, "no/such"),
        (PATH, "c", "folder.h", ExportError, "is a folder"),
        (PATH, "c", "table.nc", ExportError, "is a file"),
    ):
        with pytest.raises(error, match=said):
            export_table(path, kind, tmp_path / out)
    assert {*tmp_path.rglob("*")} == {copy, folder}
    assert copy.read_bytes() == PATH.read_bytes()
