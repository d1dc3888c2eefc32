"""Rows a second of ``mumacro eval`` on one core, by format, compared with reading and writing alone.

    python benchmarks/files.py [--rows 4000000]

"floor" copies the same Parquet file with the same columns added as constants: read, write, no computation.  Times
are processor time, so that other work on the machine has little effect; ratios are more reproducible than rates.
"""

import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.measuring import main, markdown
from mumacro import Surrogate
from mumacro.files import answer, evaluate_files
from mumacro.files.answering import added_fields
from mumacro.inputs import FIELDS

STEPS = (("parquet", "parquet"), ("csv", "csv"), ("ndjson", "ndjson"), ("csv", "parquet"), ("parquet", "csv"))


def cases(n: int) -> pa.Table:
    """Random cases and a number for each."""
    rng = np.random.default_rng(1)
    low, high = np.array([-2, -1, 4, -8, 2, -5]), np.array([0, 3, 8, -4, 6, 1])
    values = 10.0 ** rng.uniform(low, high, (n, 6))
    return pa.table({**dict(zip(FIELDS, values.T, strict=True)), "id": pa.array(np.arange(n), pa.int32())})


def floor(source: Path, out: Path) -> None:
    """Read and write, with the same number of bytes as the answers."""
    with pq.ParquetFile(source, pre_buffer=False) as file:
        schema = pa.schema([*file.schema_arrow, *added_fields()])
        noise = np.random.default_rng(0).random(2**19)
        coded = [field.name for field in schema if not pa.types.is_floating(field.type)]
        with pq.ParquetWriter(out, schema, use_dictionary=coded, compression="snappy") as writer:
            for batch in file.iter_batches(262_144):
                n = batch.num_rows
                words = pa.DictionaryArray.from_arrays(
                    pa.array(np.arange(n) % 12, pa.int8()), [str(i) for i in range(12)]
                )
                plain = pa.array(noise[:n])
                added = [words if pa.types.is_dictionary(field.type) else plain for field in added_fields()]
                writer.write_batch(pa.RecordBatch.from_arrays([*batch.columns, *added], schema=schema))


def _drop_answers(made: Path, cases: Path) -> None:
    with made.open() as source, cases.open("w") as out:
        for line in source:
            if made.suffix == ".csv":
                out.write(",".join(line.rstrip("\n").split(",")[:7]) + "\n")
            else:
                out.write(line[: line.index(', "mu_macro"')] + "}\n")


def files(rows: int) -> str:
    """Million rows a second."""
    pa.set_cpu_count(1)
    pa.set_io_thread_count(1)
    surrogate = Surrogate.open(1e-10)
    table = cases(rows)
    answer(table.slice(0, 9).to_batches()[0], surrogate)  # kernels are loaded before timing
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pq.write_table(table, folder / "cases.parquet")
        pq.write_table(table.slice(0, max(rows // 8, 1)), folder / "few.parquet")
        for kind in ("csv", "ndjson"):
            evaluate_files([folder / "few.parquet"], folder / f"made.{kind}", surrogate, force=True)
            _drop_answers(folder / f"made.{kind}", folder / f"cases.{kind}")
        started = time.process_time()
        floor(folder / "cases.parquet", folder / "floor.parquet")
        found = [["parquet", "floor", f"{rows / (time.process_time() - started) / 1e6:.2f}"]]
        for start, end in STEPS:
            given = folder / ("few.parquet" if (start, end) == ("parquet", "csv") else f"cases.{start}")
            started = time.process_time()
            done = evaluate_files([given], folder / f"out.{end}", surrogate, force=True)
            found.append([start, end, f"{done.rows / (time.process_time() - started) / 1e6:.2f}"])
    return markdown(("from", "to", "million rows a second"), found, 2)


if __name__ == "__main__":
    main(__doc__, {"files": files}, rows=4_000_000)
