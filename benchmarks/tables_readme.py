"""Contents and cost of the committed tables: the table in tables/README.md.

    python benchmarks/tables_readme.py [--build] [--workers 2] [--write]

Prints; ``--write`` replaces the text between the markers.  ``--build`` rebuilds each table in a
temporary folder, times it and compares every number with the committed one; without it those
columns are kept from the page, as long as they were measured for the committed table.
"""

# isort: split
import os
import re
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np

from mumacro import Surrogate
from mumacro.kernel.arrays import Array
from mumacro.table.blocks import Table
from tests.support.measuring import machine, main, markdown, progress, quantity
from tests.support.places import ROOT

HEADER = (
    "table",
    "tolerance",
    "solves",
    "bytes",
    "memory of the cells, bytes",
    "max abs error",
    "max rel error",
    "max abs error of the stick fraction",
    "max rel error of the power",
)
BALL_HEADER = (
    "table",
    "tolerance of the ball",
    "max abs error",
    "max rel error",
    "max abs error of the stick fraction",
    "max rel error of the power",
    "max error of a logarithmic slope",
)
COMPANIONS = ("stick_fraction", "power")
BUILD_HEADER = (
    "table",
    "seconds",
    "processor seconds",
    "of border and mu ratio differ",
    "by at most",
    "of power and stick fraction differ",
    "by at most",
    "errors that differ",
    "max abs error, built anew",
    "content_sha256",
)
MEASURED = len(BUILD_HEADER) - 2  # columns that need a build


def command(tolerance: float, out: str, workers: int | None = None) -> list[str]:
    words = [
        "-m",
        "builder",
        "build",
        "--tolerance",
        f"{tolerance:.0e}".replace("e-0", "e-"),
        "--out",
        out,
    ]
    return words + ([] if workers is None else ["--workers", str(workers)])


def rebuilt(table: Surrogate, workers: int) -> list[str]:
    """Build ``table`` again, with the user's command, compare it, and delete it."""
    progress(f"building {table.id}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.nc"
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
        words = [sys.executable, *command(table.tolerance, str(path), workers)]
        subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, check=True)
        seconds, after = perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        again = Surrogate.open(path)
    own = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    friction, others, errors = differences(table.table, again.table)
    return [
        quantity(seconds, 2),
        quantity(own, 2),
        _count(friction),
        _most(friction),
        _count(others),
        _most(others),
        _count(errors),
        f"{again.max_abs_error:.2e}",
    ]


def _count(differences: Sequence[Array]) -> str:
    changed = sum(np.count_nonzero(x) for x in differences)
    return f"{changed:,} of {sum(x.size for x in differences):,}"


def _most(differences: Sequence[Array]) -> str:
    return quantity(max(float(x.max()) for x in differences))


def differences(old: Table, new: Table) -> tuple[list[Array], list[Array], list[Array]]:
    """How far two tables of the same nodes and cells differ: in the border and in what holds mu~,
    on the plain grid and in blocks; in what holds the other quantities; in the errors of cells."""
    friction = [
        np.abs(one.values - other.values) for one, other in zip(old.border, new.border, strict=True)
    ]
    friction += [np.abs(getattr(old, x) - getattr(new, x)) for x in ("mu_ratio", "v_tilde_crit")]
    others, errors = [np.abs(old.stick_fraction - new.stick_fraction)], []
    for name, contact in old.contacts.items():
        for one, other in zip(contact.blocks, new.contacts[name].blocks, strict=True):
            if one.cells != other.cells:
                raise SystemExit(f"{name}: other cells, {one.cells} and {other.cells}")
            for key, values in one.nodes.items():
                kind = friction if key == "mu_ratio" else others
                kind.append(np.abs(values - other.nodes[key]))
                errors.append(np.abs(one.cell_errors[key] - other.cell_errors[key]))
    return friction, others, errors


def errors_of(s: Surrogate, contact: str) -> list[str]:
    """The largest verified errors of a contact: of mu~, absolute and relative, and of
    ``COMPANIONS``."""
    entry = s.table.contacts[contact]
    errors = [
        *(float(entry.attributes[f"verified_max_{norm}_error"]) for norm in ("abs", "rel")),
        *(entry.error_distribution[name]["1"] for name in COMPANIONS),
    ]
    return [f"{error:.2e}" for error in errors]


def cells_in(page: str, checksum: str) -> list[str]:
    """The measured columns of the row with that checksum, if there is one."""
    columns = MEASURED * r"([^|]*)\|"
    row = re.search(rf"^\|[^|]*\|{columns}\s*`{checksum}`\s*\|$", page, re.MULTILINE)
    return [cell.strip() for cell in row.groups()] if row else MEASURED * ["-"]


def tables(build: bool, workers: int) -> str:
    old = (ROOT / "tables" / "README.md").read_text("utf-8")
    opened = sorted(
        (Surrogate.open(path) for path in (ROOT / "tables").glob("*.nc")),
        key=lambda s: -s.tolerance,
    )
    rows, balls, builds = [], [], []
    for s in opened:
        counts = (int(str(s.attributes["n_solves"])), s.path.stat().st_size, s.memory)
        numbers = (*(f"{count:,}" for count in counts), *errors_of(s, "spring"))
        rows.append([f"`{s.path.name}`", f"{s.tolerance:.0e}", *numbers])
        largest = s.table.contacts["ball"].error_distribution
        slope = max(largest[f"slope_along_{name}"]["1"] for name in ("v", "y"))
        tolerance = f"{s.table.contacts['ball'].tolerance:.0e}"
        balls.append([f"`{s.path.name}`", tolerance, *errors_of(s, "ball"), f"{slope:.2e}"])
        cost = rebuilt(s, workers) if build else cells_in(old, s.checksum)
        builds.append([f"`{s.path.name}`", *cost, f"`{s.checksum}`"])
    builds_of_all = "\n".join(
        f"python {' '.join(command(s.tolerance, f'tables/{s.path.name}'))}" for s in opened
    )
    commands = (
        f"Not run by the checks, which build coarser tables:\n\n```bash\n{builds_of_all}\n```"
    )
    note = re.search(r"^Built anew .*\n.*$", old, re.MULTILINE)
    build_note = note.group() if note else "Not built anew yet."
    if build:
        build_note = (
            f"Built anew on {workers} threads with the program that this page was written "
            f"with.\n{machine()}"
        )
    contacts = [contact for s in opened for contact in s.table.contacts.values()]
    points = {int(contact.attributes["verified_points"]) for contact in contacts}
    verified = (
        f"Errors are the largest on {' or '.join(f'{n:,}' for n in sorted(points))} fresh "
        "solves, off the nodes."
    )
    return "\n\n".join(
        [
            commands,
            verified,
            markdown(HEADER, rows),
            "Of a ball that is shaken across, with as many fresh quadratures:",
            markdown(BALL_HEADER, balls),
            build_note,
            markdown(BUILD_HEADER, builds, 1),
        ]
    )


if __name__ == "__main__":
    main(__doc__, {"tables": tables}, build=False, workers=os.cpu_count() or 1)
