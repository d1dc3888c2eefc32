"""Check values for ports and installations: tests/data/check_values.csv, from quadruple-precision
points.

    python benchmarks/check_values.py            prints the file
    python benchmarks/check_values.py --write    writes it

Values come from tests/data/points.csv and border.csv, computed by another solver, and from closed
forms in 50 digits; not from this project's own solver or tables.  docs/accuracy.md describes them.
"""

import csv
import io
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mpmath import agm, mp, mpf, sqrt

DATA = Path(__file__).resolve().parent.parent / "tests" / "data"
FILE = DATA / "check_values.csv"
COLUMNS = (
    "quantity",
    "where",
    "v_tilde",
    "y_tilde",
    "mu0",
    "Fz",
    "k",
    "y0",
    "omega",
    "v0",
    "value",
    "tolerance",
)
A_CLASS = 6  # reference points of each class
# powers of two: l0 = mu0 Fz / k = 2^-19 m and l0 omega = 2^-2 m/s, so that y0 and v0 give the
# groups back exactly
MU0, FZ, K, OMEGA = 0.25, 8.0, 2.0**20, 2.0**17
L0 = MU0 * FZ / K
DOUBLE = 1e-14  # relative, of a solver in double precision
STICK = 1e-11  # absolute: next to the border the end of slip is a grazing root


def read(name: str) -> list[dict[str, str]]:
    with (DATA / name).open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def row(quantity: str, where: str, value: float, tolerance: float, **inputs: Any) -> dict[str, Any]:
    """One check value; inputs that it does not depend on stay empty."""
    numbers = {
        name: text if isinstance(text, str) else repr(float(text)) for name, text in inputs.items()
    }
    return {
        "quantity": quantity,
        "where": where,
        **numbers,
        "value": repr(value),
        "tolerance": f"{tolerance:.1e}",
    }


def chosen() -> list[dict[str, str]]:
    points = read("points.csv")
    chosen_points = []
    for kind in dict.fromkeys(point["case"] for point in points):
        of_kind = [point for point in points if point["case"] == kind]
        chosen_points += [of_kind[i * len(of_kind) // A_CLASS] for i in range(A_CLASS)]
    return chosen_points


def rows() -> Iterator[dict[str, Any]]:
    for point in chosen():
        v, y, mu = (float(point[name]) for name in ("v", "y", "mu_ratio"))
        groups = {"v_tilde": v, "y_tilde": y}
        yield row("mu_ratio", point["case"], mu, DOUBLE * mu, **groups)
        yield row("stick_fraction", point["case"], float(point["stick_fraction"]), STICK, **groups)
        case = {"mu0": MU0, "Fz": FZ, "k": K, "y0": y * L0, "omega": OMEGA, "v0": v * (L0 * OMEGA)}
        if case["y0"] / L0 == y and case["v0"] / (L0 * OMEGA) == v:  # not where a double underflows
            yield row("mu_macro", point["case"], MU0 * mu, DOUBLE * MU0 * mu, **case)
    for point in read("border.csv"):
        y, crit, mu = (float(text) for text in point.values())
        yield row("v_tilde_crit", "border", crit, DOUBLE * crit, y_tilde=y)
        yield row("mu_ratio_crit", "border", mu, DOUBLE * mu, y_tilde=y)
    yield from closed_forms()


def closed_forms() -> Iterator[dict[str, Any]]:
    """Limits that hold exactly: no oscillation, no drive, rigid contact."""
    mp.dps = 50
    usual = {"mu0": MU0, "Fz": FZ, "k": K, "y0": L0 / 2, "omega": OMEGA, "v0": L0 * OMEGA / 8}
    for where, change in (("no amplitude", {"y0": 0.0}), ("no oscillation", {"omega": 0.0})):
        yield row("mu_macro", where, MU0, DOUBLE * MU0, **{**usual, **change})
    for y in (0.25, 0.5, 0.75, 0.96875, 1.0, 2.0):
        value = MU0 * float(sqrt(max(mpf(0), 1 - mpf(y) ** 2)))
        yield row(
            "mu_macro", "static (38)", value, DOUBLE * MU0, **{**usual, "y0": y * L0, "v0": 0.0}
        )
    for ratio in (2.0**-10, 0.5, 1.0, 4.0, 1024.0):
        value = MU0 * float(1 / agm(1, sqrt(1 + mpf(ratio) ** 2)))
        case = {**usual, "k": "rigid", "y0": L0, "v0": L0 * OMEGA / ratio}
        yield row("mu_macro", "rigid (37)", value, DOUBLE * value, **case)


def text() -> str:
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows())
    return out.getvalue()


if __name__ == "__main__":
    if "--write" in sys.argv[1:]:
        FILE.write_text(text(), "utf-8", newline="\n")
    else:
        print(text(), end="")
