"""``python -m builder`` beyond the simple cases: complete builds, failures during work, help."""

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest

from builder.__main__ import main
from builder.tables.quantities import ABS_TO_REL
from mumacro import Surrogate
from mumacro.table.blocks import Table
from mumacro.table.netcdf import read_table, write_table
from tests.support.comparing import close

pytestmark = pytest.mark.slow

Run = Callable[..., "CompletedProcess[str]"]


@pytest.fixture
def here(
    repository: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Run:
    """``python -m builder ARGUMENTS`` without a process of its own, which would compile the solver
    anew."""
    monkeypatch.chdir(repository)

    def run(*arguments: object) -> "CompletedProcess[str]":
        words = [*map(str, arguments)]
        code: Any = 0
        try:
            code = main(words)
        except SystemExit as end:
            code = end.code
        out, err = capfd.readouterr()
        return CompletedProcess(words, int(code or 0), out, err)

    return run


def refused(done: Any, *parts: str) -> None:
    """The command failed with a message that contains ``parts``, and without a traceback."""
    assert done.returncode not in (0, None)
    assert "Traceback" not in done.stderr + done.stdout
    message = " ".join(done.stderr.split())
    for part in parts:
        assert part in message


def test_build_makes_the_smallest_table_again_and_it_verifies(
    here: Run, tmp_path: Path, tables_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # its last fresh solves are verified below, by others
    monkeypatch.setattr("builder.tables.build.FINAL_POINTS", 500)
    out = tmp_path / "again.nc"
    done = here("build", "--tolerance", "1e-4", "--out", out, "--workers", 2)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)  # JSON only: the progress bar goes to stderr
    opened = Surrogate.open(out)
    assert (report["table"], report["content_sha256"]) == (str(out), opened.checksum)
    assert report["tolerance"] == opened.tolerance == 1e-4
    assert report["verified_max_abs_error"] == opened.max_abs_error <= 1e-4
    assert report["verified_max_rel_error"] == opened.max_rel_error <= ABS_TO_REL * 1e-4
    assert report["bytes"] == out.stat().st_size
    assert report["n_solves"] == opened.attributes["n_solves"]
    assert report["n_solves"] > 10_000
    # no partial file
    assert [path.name for path in tmp_path.iterdir()] == ["again.nc"]
    assert_same(read_table(tables_dir / "mumacro-1e-4.nc"), opened.table)

    verified = here("verify", out, "--points", 300, "--seed", 5)
    assert verified.returncode == 0, verified.stderr
    report = json.loads(verified.stdout)
    assert report["holds"] is True
    assert [*report["contacts"]] == ["spring", "ball"]
    assert {part["not_covered"] for part in report["contacts"].values()} == {0}


def assert_same(table: Table, again: Table) -> None:
    """Two tables of one tolerance have the same cells and values."""
    for contact, entry in table.contacts.items():
        for old, new in zip(entry.blocks, again.contacts[contact].blocks, strict=True):
            assert old.cells == new.cells
            # the last digits depend on the processor's instructions
            for name in old.nodes:
                np.testing.assert_allclose(new.nodes[name], old.nodes[name], rtol=1e-12, atol=1e-14)
                if contact == "spring":
                    # of the differences between cells and model: 3 binary digits, rounded up.  Of
                    # a ball a derivative may hang on which coefficients count as rounding
                    np.testing.assert_allclose(
                        new.cell_errors[name], old.cell_errors[name], rtol=0.26
                    )


def test_verify_stores_what_it_finds_only_when_asked(
    here: Run, tables_dir: Path, tmp_path: Path
) -> None:
    path = Path(shutil.copy(tables_dir / "mumacro-1e-4.nc", tmp_path / "copy.nc"))
    before, image = Surrogate.open(path), path.read_bytes()
    words = ("verify", path, "--points", 300, "--seed", 5)
    assert here(*words).returncode == 0
    assert path.read_bytes() == image
    found = json.loads(here(*words, "--write").stdout)
    reports = found["contacts"]
    after = Surrogate.open(path)
    assert after.checksum == before.checksum
    assert after.max_abs_error == reports["spring"]["max_abs_error"] < before.max_abs_error
    for contact, report in reports.items():
        old, new = (table.table.contacts[contact] for table in (before, after))
        assert new.attributes["verified_points"] == report["points"]
        assert new.attributes["verified_max_abs_error"] == report["max_abs_error"]
        for name, part in report["distribution"].items():
            numbers = [*part["error_quantiles"], *part["bound_over_error"]]
            assert [*new.error_distribution[name].values()] == numbers
            assert numbers != [*old.error_distribution[name].values()]
    for name, error in found["plain_grid"].items():
        assert after.attributes[name] == error != before.attributes[name]
    # a table that misses its bounds is left as it is
    table = read_table(path)
    table.contacts["spring"].attributes["tolerance"] = 1e-9
    write_table(table, path)
    image = path.read_bytes()
    done = here(*words, "--write")
    refused(done, "copy.nc", "misses its tolerance of 1e-09")
    assert path.read_bytes() == image
    report = json.loads(done.stdout)
    assert report["holds"] is False
    assert report["contacts"]["spring"]["max_abs_error"] > 1e-9


def test_solve_answers_at_the_ends_of_its_range(run_builder: Run, here: Run) -> None:
    done = run_builder("solve", "--v", 0.1, "--y", 0.5)
    assert json.loads(done.stdout)["mu_ratio"] == close(0.9420042895137095, abs=1e-15)
    for v, y in (("1e10", "1e-15"), ("1e-60", "1e14")):
        done = here("solve", "--v", v, "--y", y)
        assert done.returncode == 0, done.stderr
        answer = json.loads(done.stdout)
        assert answer["status"] == 0
        assert 0.0 < answer["mu_ratio"] <= 1.0
        assert 0.0 <= answer["error_estimate"] < 2e-15
    answer = json.loads(here("solve", "--v", "1e-9", "--y", "0.5").stdout)
    # far below the border: not computed
    assert (answer["regime"], answer["min_slip_speed"]) == ("stick_slip", None)
    assert answer["stick_fraction"] > 0.99


def test_verify_names_a_damaged_table(here: Run, tables_dir: Path, tmp_path: Path) -> None:
    cut = Path(shutil.copy(tables_dir / "mumacro-1e-4.nc", tmp_path / "cut.nc"))
    cut.write_bytes(cut.read_bytes()[:60_000])
    refused(here("verify", cut), "cut.nc", "not a readable netCDF-4 table")


ROUGH, V_RANGE = "build --tolerance 1e-3 --out x.nc", "from 1e-60 to 1e+10"
REFUSED: dict[str, tuple[str, ...]] = {
    "build --tolerance 0.5 --out x.nc": ("--tolerance", "must be from 1e-12 to 0.01"),
    **dict.fromkeys(
        (f"build --tolerance {x} --out x.nc" for x in ("-1e-8", "nan")), ("--tolerance",)
    ),
    "build --tolerance 1e-15 --out x.nc": ("--tolerance", "1e-15"),
    "build --tolerance 1e-3": ("--out",),
    **dict.fromkeys((f"{ROUGH} --workers {n}" for n in ("0", "2000")), ("--workers",)),
    f"{ROUGH} --sideways": ("--sideways",),
    "build --tolerance 1e-2 --out tables": ("--out", "is a folder"),
    "build --tolerance 1e-3 --out no/such/folder/x.nc": ("no/such/folder",),
    **dict.fromkeys(("verify x.nc --points 1", "verify x.nc --points 99999999"), ("--points",)),
    "verify x.nc --seed -1": ("--seed",),
    "verify x.nc --workers 0": ("--workers",),
    "verify": ("missing: table",),
    "verify no-such-table.nc": ("no-such-table.nc",),
    "verify README.md": ("README.md",),
    "bake": ("bake",),
    "figures --out no/such/folder": ("--out",),
    "figures --out . --table no-such-table.nc": ("no-such-table.nc",),
    **dict.fromkeys((f"solve --v={v} --y 1" for v in ("-1", "nan", "fast", "")), ("--v",)),
    "solve --v 1 --y 0": ("--y",),
    "solve --v 1": ("--y",),
    "solve 1 2": (),
    "solve --v 1 --y=-inf": ("--y", "from 1e-15 to 1e+14", "-inf", "a table answers"),
    "solve --v 1e999 --y 1": ("--v", V_RANGE, "got inf"),
    "solve --v 1e-61 --y 1": ("--v", V_RANGE, "got 1e-61"),
}


@pytest.mark.parametrize("words", REFUSED)
def test_bad_arguments_are_told_before_any_work(here: Run, words: str, repository: Path) -> None:
    refused(here(*words.split()), *REFUSED[words])
    assert not list(repository.glob("x.nc*"))


def test_what_writes_tables_is_asked_for_before_any_work(
    tmp_path: Path, tables_dir: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setitem(sys.modules, "netCDF4", None)
    table = tables_dir / "mumacro-1e-4.nc"
    for words in (
        ["build", "--tolerance", "1e-4", "--out", str(tmp_path / "new.nc")],
        ["verify", str(table), "--write"],
    ):
        assert main(words) == 1
        assert "netCDF4 is not installed" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
