"""How much of the tolerance nodes and cells may take: memory and file size for other shares than the builder's.

    python benchmarks/shares.py [--quick] [--write]

Builds tables with other values of ``SHARE`` and ``CELL_SHARE`` (builder/blocks.py), each verified as every build is;
oscillation power and stick fraction, which a table holds at the same nodes, are compared with 5,000 fresh solves.
``--write`` puts the table into docs/decisions/0012-degree-and-coordinates.md.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
import tempfile
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from measuring import markdown, progress, quantity

from builder import blocks
from builder.assemble import BuildError, build_table
from builder.sweep import Sweep

PAGE = measuring.ROOT / "docs" / "decisions" / "0012-degree-and-coordinates.md"
TOLERANCES = (1e-4, 1e-7, 1e-10)
NODES = (0.05, 0.1, 0.3, 0.6)
CELLS = (0.2, 0.4, 0.6, 0.8)
POINTS = 5000  # for what stands beside mu~ and is not verified with it


def row(tolerance: float, share: float, cell_share: float, folder: Path) -> list[str]:
    """Build one table and say what came of it."""
    out = folder / "table.nc"
    name = [f"{tolerance:.0e}", f"{share:g}", f"{cell_share:g}"]
    with patch.object(blocks, "SHARE", share), patch.object(blocks, "CELL_SHARE", cell_share), Sweep() as sweep:
        try:
            built = build_table(out, tolerance, sweep)
        except BuildError as error:
            progress(str(error))
            return [*name, "not reached", *["-"] * 7]
        rng = np.random.default_rng(4)
        v, y = 10.0 ** rng.uniform(-3.0, 3.0, POINTS), 10.0 ** rng.uniform(-3.0, 3.0, POINTS)
        solved = sweep.solve("full", v, y)
    power = np.abs(built.power(v, y) - solved["power"]) / y
    stick = np.abs(built.stick_fraction(v, y) - solved["stick_fraction"])
    options: Any = built.attributes["builder_options"]
    again = sum(target < tolerance for target in options["block_targets"])
    return [
        *name, f"{built.memory:,}", f"{out.stat().st_size:,}", quantity(built.max_abs_error),
        quantity(built.max_rel_error), quantity(power.max()), quantity(stick.max()), str(again),
        f"{sum(b.values.size for b in built.table.blocks):,}",
    ]  # fmt: skip


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one tolerance, two choices")
    parser.add_argument("--write", action="store_true", help="put the table into the decision")
    given = parser.parse_args()
    if given.quick and given.write:
        parser.error("--quick measures nothing worth writing down")
    chosen = [(1e-3, s, c) for s, c in ((0.1, 0.4), (0.1, 0.1))] if given.quick else [
        (tolerance, share, cell_share) for tolerance in TOLERANCES for share in NODES for cell_share in CELLS
    ]  # fmt: skip
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for one in chosen:
            rows.append(row(*one, Path(folder)))
            progress(" ".join(rows[-1]))
    header = (
        "tolerance", "SHARE (nodes)", "CELL_SHARE", "memory of the cells, bytes", "file, bytes", "max abs error",
        "max rel error", "power / y~, error", "stick fraction, error", "blocks built again", "nodes",
    )  # fmt: skip
    text = markdown(header, rows)
    print(text)
    if given.write:
        measuring.write_section("shares", text, PAGE)


if __name__ == "__main__":
    main()
