"""Time of `mumacro eval` and of a fit's table, beside pyarrow with our evaluation between.

    python benchmarks/files.py [--cases 1e6] [--write]

The peer reads the same file by pyarrow, evaluates its columns and writes all columns by pyarrow: it
knows the layout, looks at no line and rejects no row.  Both run in turn, on one thread.
"""

from tests.support.measuring import best_of, main, markdown, progress, quantity  # isort: split

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from mumacro import Surrogate
from mumacro.files import evaluate_files
from mumacro.fits.measured_points import read_points

NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
LOW, HIGH = (-2, -1, 4, -8, 2, -5), (0, 3, 8, -4, 6, 1)  # powers of ten
ROUNDS = 3


def written(folder: Path, n: int) -> dict[str, Path]:
    """Return the same cases as files of several kinds."""
    table = 10.0 ** np.random.default_rng(1).uniform(LOW, HIGH, (n, 6))
    rows = [[f"{x:.8g}" for x in row] for row in table.tolist()]
    head = ",".join(NAMES)
    plain = "\n".join([head, *map(",".join, rows), ""])
    named = [f'"run {i % 97}",{",".join(row)}' for i, row in enumerate(rows)]
    texts = {
        "plain text": plain,
        "decimal comma, semicolon": plain.replace(",", ";").replace(".", ","),
        "quoted names": "\n".join([f"name,{head}", *named, ""]),
    }
    paths = {name: folder / f"{i}.csv" for i, name in enumerate(texts)}
    for name, path in paths.items():
        path.write_text(texts[name], "utf-8")
    columns = dict(zip(NAMES, table.T, strict=True))
    pa.parquet.write_table(pa.table(columns), folder / "cases.parquet")
    return {**paths, "Parquet": folder / "cases.parquet"}


def by_pyarrow(source: Path, out: Path, surrogate: Surrogate, decimal: str) -> Path:
    """Read, evaluate and write with what a person would write who knows the layout."""
    if source.suffix == ".parquet":
        table = pa.parquet.read_table(source, use_threads=False)
    else:
        table = pa.csv.read_csv(
            source,
            pa.csv.ReadOptions(use_threads=False),
            pa.csv.ParseOptions(delimiter=";" if decimal == "," else ","),
            pa.csv.ConvertOptions(decimal_point=decimal),
        )
    answer = surrogate.evaluate({name: table.column(name).to_numpy() for name in NAMES})
    added: dict[str, Any] = {
        name: getattr(answer, name)
        for name in ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
    }
    for name, column in added.items():
        table = table.append_column(name, pa.array(column))
    if out.suffix == ".parquet":
        pa.parquet.write_table(table, out)
    else:
        pa.csv.write_csv(table, out)
    return out


def files(cases: float) -> str:
    """Seconds of each kind of file, and their ratio."""
    surrogate, n, rows = Surrogate.open(), round(cases), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, source in written(folder, n).items():
            progress(kind)
            out = folder / f"out{source.suffix}"
            decimal = "," if "comma" in kind else "."

            def ours(source: Path = source, out: Path = out) -> object:
                return evaluate_files([source], out, surrogate, force=True)

            def peer(source: Path = source, out: Path = out, sign: str = decimal) -> None:
                by_pyarrow(source, out.with_stem("peer"), surrogate, sign)

            work: dict[str, Callable[[], object]] = {"ours": ours, "peer": peer}
            best = best_of(ROUNDS, work)
            ratio = quantity(best["ours"] / best["peer"])
            each = [quantity(1e6 * best[one] / n) for one in work]
            rows.append([kind, *each, ratio])
    header = (f"{n:,} rows", "`mumacro eval`, µs a row", "pyarrow and `evaluate`, µs", "ratio")
    return markdown(header, rows)


def points(cases: float) -> str:  # noqa: ARG001
    """Milliseconds to read a table of 1,000 points for a fit."""
    v0 = np.geomspace(1e-3, 1.0, 1000)
    lines = [f"{1e3 * v:.6g};{0.3 - 0.1 * i / 1000:.4f}" for i, v in enumerate(v0)]
    data = "\n".join(["Rig 7", "v0 [mm/s];mu_macro", *lines, ""]).encode()
    best = best_of(20, {"fit": lambda: read_points(data)})
    return markdown(("table of a fit", "ms"), [["1,000 points", quantity(1e3 * best["fit"])]])


if __name__ == "__main__":
    main(__doc__, {"files": files, "points": points}, cases=1e6)
