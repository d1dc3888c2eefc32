"""The check values for ports: made of the references only; the solver and, within bounds, every table agree."""

import csv
import importlib
from pathlib import Path
from typing import Any

import pytest

from builder.steady import border, solve
from mumacro import Surrogate
from mumacro.bundled import bundled_tables

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "tests" / "data" / "check_values.csv"
INPUTS = ("mu0", "Fz", "k", "y0", "omega", "v0")


def rows(*quantities: str) -> list[dict[str, Any]]:
    """Rows of these quantities, numbers as floats; empty cells are left out."""
    with FILE.open(newline="", encoding="utf-8") as stream:
        found = [row for row in csv.DictReader(stream) if row["quantity"] in quantities]
    assert found
    words = ("quantity", "where", "rigid")
    return [
        {name: text if name in words or text in words else float(text) for name, text in row.items() if text}
        for row in found
    ]


def test_the_file_is_the_scripts() -> None:
    pytest.importorskip("mpmath")
    script = importlib.import_module("benchmarks.check_values")
    assert FILE.read_text("utf-8") == script.text()


def test_the_solver_meets_them() -> None:
    for row in rows("mu_ratio", "stick_fraction"):
        found = getattr(solve(row["v_tilde"], row["y_tilde"]), row["quantity"])
        assert abs(found - row["value"]) <= row["tolerance"], row
    for row in rows("v_tilde_crit", "mu_ratio_crit"):
        found = border(row["y_tilde"])[row["quantity"] == "mu_ratio_crit"]
        assert abs(found - row["value"]) <= row["tolerance"], row


@pytest.fixture(scope="module", params=bundled_tables(), ids=lambda path: path.stem)
def table(request: pytest.FixtureRequest) -> Surrogate:
    """Every table of the package."""
    return Surrogate.open(request.param)


def test_a_table_meets_them_within_its_bounds(table: Surrogate) -> None:
    for row in rows("mu_macro"):
        case = {name: None if row[name] == "rigid" else row[name] for name in INPUTS}
        found = table.evaluate(**case)
        assert abs(found.mu_macro - row["value"]) <= found.error_bound + row["tolerance"], row
    for row in rows("mu_ratio"):
        mu, bound, _ = table.ratio_with_bound(row["v_tilde"], row["y_tilde"])
        assert abs(mu - row["value"]) <= bound + row["tolerance"], row
    for row in rows("stick_fraction"):
        share, bound = table.stick_fraction_with_bound(row["v_tilde"], row["y_tilde"])
        assert abs(share - row["value"]) <= bound + row["tolerance"], row
    for row in rows("v_tilde_crit"):
        found = table.v_tilde_crit(row["y_tilde"])
        assert abs(found / row["value"] - 1.0) <= table.border.max_rel_error + 1e-14, row
