"""``python -m builder export``: every format read back by its program: the same numbers, the same
bytes."""

import csv
import json
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.__main__ import main
from builder.export.c import ExportError
from builder.export.grid import FORMATS, export_table
from mumacro.errors import TableError
from mumacro.table.blocks import Table
from mumacro.table.netcdf import read_table
from tests.support.cases import Capture
from tests.support.places import TABLES

pytestmark = pytest.mark.slow

PATH = TABLES / "mumacro-1e-4.nc"
PLANES = ("mu_ratio", "stick_fraction", "error_estimate")


@pytest.fixture(scope="module")
def table() -> Table:
    return read_table(PATH)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Every format, once."""
    folder = tmp_path_factory.mktemp("export")
    for kind, (name, _) in FORMATS.items():
        export_table(PATH, kind, folder / name.format("grid"))
    return folder


def test_the_grid_as_csv_has_a_row_a_node_with_all_digits(table: Table, written: Any) -> None:
    with (written / "grid.csv").open(newline="", encoding="ascii") as stream:
        header, *rows = csv.reader(stream)
    assert header == ["v_tilde", "y_tilde", *PLANES, "v_tilde_crit"]
    columns = dict(zip(header, zip(*rows, strict=True), strict=True))
    result = {
        name: np.asarray(column, dtype=float).reshape(table.mu_ratio.shape)
        for name, column in columns.items()
    }
    for name in PLANES:
        assert np.array_equal(result[name], getattr(table, name)), name
    assert np.array_equal(result["v_tilde"][:, 0], table.v_tilde)
    for name in ("y_tilde", "v_tilde_crit"):
        assert np.array_equal(result[name][7], getattr(table, name)), name


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_table_gives_the_same_bytes(written: Any, tmp_path: Path, kind: Any) -> None:
    export_table(PATH, kind, tmp_path / "again.h")
    assert (tmp_path / "again.h").read_bytes() == (
        written / FORMATS[kind][0].format("grid")
    ).read_bytes()
    assert [entry.name for entry in tmp_path.iterdir()] == ["again.h"]


def test_c_in_three_files_is_written_twice_alike(tmp_path: Path) -> None:
    for folder in ("one", "two", "two"):
        export_table(PATH, "c", tmp_path / folder)
    one, two = (
        {file.name: file.read_bytes() for file in (tmp_path / name).iterdir()}
        for name in ("one", "two")
    )
    assert set(one) == {"mumacro.h", "mumacro.c", "mumacro_table.c"}
    assert one == two


# --- the command, what is refused -----------------------------------------------------------------


def test_the_command_writes_to_the_current_folder_by_default_and_names_the_file(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(PATH), "--format", "csv", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    of_grid = {name: answer.pop(name) for name in [*answer] if name in table.attributes}
    assert of_grid == {
        name: x for name, x in table.attributes.items() if name.startswith("interpolation_error_")
    }
    assert answer == {
        "table": str(PATH),
        "format": "csv",
        "out": "mumacro-1e-4.csv",
        "shape": list(table.mu_ratio.shape),
    }
    assert (tmp_path / "mumacro-1e-4.csv").stat().st_size > 9e4


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["pyproject.toml", "--format", "csv"], 1, "pyproject.toml"),
        (["x.nc", "--format", "xls"], 2, "--format"),
        (["x.nc"], 2, "--format"),
        ([str(PATH), "--format", "csv", "--out", "."], 2, "--out"),
    ],
)
def test_what_the_command_cannot_export_is_reported_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: Capture,
    arguments: Any,
    code: Any,
    message: Any,
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(PATH.parent.parent / "pyproject.toml", tmp_path)
    with pytest.raises(SystemExit) as end:
        sys.exit(main(["export", *arguments]))
    assert end.value.code == code
    output = capsys.readouterr().err
    assert message in output
    assert len(output.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["pyproject.toml"]


def test_what_cannot_be_exported_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    copy, folder = Path(shutil.copy(PATH, tmp_path / "table.nc")), tmp_path / "folder.h"
    folder.mkdir()
    for path, kind, out, error, words in (
        (PATH, "xls", "x.xls", ExportError, "xls"),
        (tmp_path / "none.nc", "csv", "x.csv", TableError, "no such file"),
        (copy, "csv", "table.nc", ExportError, "is the table itself"),
        (PATH, "csv", "no/such/x.csv", FileNotFoundError, "no/such"),
        (PATH, "c", "no/such/x.h", FileNotFoundError, "no/such"),
        (PATH, "c", "folder.h", ExportError, "is a folder"),
        (PATH, "c", "table.nc", ExportError, "is a file"),
    ):
        with pytest.raises(error, match=words):
            export_table(path, kind, tmp_path / out)
    assert {*tmp_path.rglob("*")} == {copy, folder}
    assert copy.read_bytes() == PATH.read_bytes()
