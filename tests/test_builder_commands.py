"""``python -m builder``: valid calls, and every bad argument refused without a traceback."""

import json

import pytest

from comparing import close

pytestmark = pytest.mark.slow


def test_solve_prints_the_steady_cycle(run_builder):
    done = run_builder("solve", "--v", 0.1, "--y", 0.5)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["mu_ratio"] == close(0.9420042895137095, abs=1e-15)
    assert answer["regime"] == "stick_slip"


def test_verify_reports_and_judges(run_builder, repository):
    done = run_builder("verify", repository / "tables" / "mumacro-1e-4.nc", "--points", 500)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["holds"]
    assert report["not_covered"] == 0


BAD = {
    "negative speed": (("solve", "--v", "-1", "--y", "1"), "--v"),
    "zero amplitude": (("solve", "--v", "1", "--y", "0"), "--y"),
    "nan": (("solve", "--v", "nan", "--y", "1"), "--v"),
    "infinite": (("solve", "--v", "1", "--y", "inf"), "--y"),
    "no number": (("solve", "--v", "fast", "--y", "1"), "--v"),
    "missing option": (("solve", "--v", "1"), "--y"),
    "tolerance too small": (("build", "--tolerance", "1e-15", "--out", "x.nc"), "1e-15"),
    "tolerance nan": (("build", "--tolerance", "nan", "--out", "x.nc"), "--tolerance"),
    "no folder": (("build", "--tolerance", "1e-3", "--out", "no/such/folder/x.nc"), "no/such/folder"),
    "no workers": (("build", "--tolerance", "1e-3", "--out", "x.nc", "--workers", "0"), "--workers"),
    "no table": (("verify", "no-such-table.nc"), "no-such-table.nc"),
    "no table but text": (("verify", "README.md"), "README.md"),
    "too few points": (("verify", "x.nc", "--points", "1"), "--points"),
    "no folder for figures": (("figures", "--out", "no/such/folder"), "--out"),
    "no table for figures": (("figures", "--out", ".", "--table", "no-such-table.nc"), "no-such-table.nc"),
    "no command": (("bake",), "bake"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_arguments_get_a_clear_error(run_builder, case):
    arguments, named = BAD[case]
    done = run_builder(*arguments)
    assert done.returncode != 0
    assert "Traceback" not in done.stderr
    assert named in " ".join(done.stderr.split())
