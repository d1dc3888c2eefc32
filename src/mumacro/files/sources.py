"""Find files of cases, and read their columns and their rows in blocks.

In a table as text Arrow reads a piece at once, if each of its lines is a row of numbers and texts.
:class:`mumacro.inputs.text_tables.TextTable` accounts for the records of any other piece.
"""

import functools
import glob
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.dataset

from mumacro.errors import TextError
from mumacro.files.record_batch import FilesError
from mumacro.inputs.carried import units_of_fields
from mumacro.inputs.cells import GAPS, Signs, split_row
from mumacro.inputs.layout import Dialect
from mumacro.inputs.names import ColumnNames
from mumacro.inputs.text_tables import NO_ROW, Line, Rows, TextTable, find_table

PARQUET = ".parquet"
#: extensions of files that can be written: Parquet, and text, also compressed
WRITTEN = (".csv", ".tsv", ".txt", PARQUET)
ENDINGS = f"{', '.join(WRITTEN)} (text also .gz)"
_READ = (*WRITTEN, ".lvm", ".dat", ".asc", ".prn", ".xlsx")
# extensions that only tables have; a text with another extension may be a note
_TABLES = (".csv", ".tsv", PARQUET)
_JSON = (".ndjson", ".jsonl", ".json")  # is refused
# first letters of files that other programs leave in a folder: metadata, hidden files, Excel's lock
_STRAY = ("_", ".", "~$")
ROWS = 65_536  # rows of a block of Parquet, at most: a third of a second of work
_NULLS = sorted({text for gap in GAPS for text in (gap, gap.upper(), gap.title())} | {"NaN"})


def ending_of(path: Path) -> str:
    """Return the extension of a name; for a compressed text the one before that of compression.

    >>> ending_of(Path("cases.CSV.gz")), ending_of(Path("cases.parquet.gz"))
    ('.csv', '.gz')
    """
    name = Path(path.name.lower())
    inner = Path(name.stem).suffix if name.suffix == ".gz" else ""
    return name.suffix if inner in ("", PARQUET) else inner


def find_files(
    cases: Sequence[str | Path], say: Callable[[str], None] = lambda _text: None
) -> list[Path]:
    """Return the files that paths, folders and patterns name, in order.

    A file that the caller names itself is read as text if its extension is unknown.  Files of other
    programs in a folder are skipped, and ``say`` is told so.  Raise FilesError if a name fits no
    file, or if only some are Parquet.
    """
    files: list[Path] = []
    for entry in cases:
        path = Path(entry)
        if path.is_file():
            if ending_of(path) in _JSON:
                remedy = "write CSV or Parquet, as pandas.read_json(..., lines=True).to_csv does"
                raise FilesError(f"{path}: JSON is no table: {remedy}")
            files.append(path)
            continue
        pattern = f"{glob.escape(str(path))}/**/*" if path.is_dir() else str(path)
        matches = sorted(map(Path, glob.glob(pattern, recursive=True)))
        tables, strays = _tables_among([match for match in matches if match.is_file()])
        if not tables:
            raise FilesError(f"{entry}: no such file, or none that ends in {ENDINGS}")
        if strays:
            names = ", ".join(stray.name for stray in strays[:5])
            rest = f" and {len(strays) - 5} more" if len(strays) > 5 else ""
            say(f"{entry}: skipped {names}{rest}")
        files += tables
    if len({ending_of(one) == PARQUET for one in files}) > 1:
        raise FilesError("the files are of several formats: parquet, text")
    return files


def _tables_among(paths: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Return the files of a folder that are tables of cases, and the other files."""
    usable = [
        path
        for path in paths
        if ending_of(path) in _READ
        and not path.name.startswith(_STRAY)
        and not path.name.endswith(".rejects.csv")
    ]
    tables = [path for path in usable if ending_of(path) in _TABLES] or usable
    return tables, [path for path in paths if path not in set(tables)]


class RowBlock(NamedTuple):
    """Hold some rows in order."""

    batch: pa.RecordBatch  #: the rows; nulls in a row that could not be read
    rows: Rows  #: their lines in the file, or their numbers from 1 if it has no lines
    signs: Signs = Signs()  #: the separators in numbers as text


class ParquetSource:
    """Read Parquet; folders below ``folder`` that are named ``key=value`` give columns, as in
    Hive."""

    has_mark, sep, decimal = False, "", "."

    def __init__(self, files: Sequence[Path], folder: str | None) -> None:
        names = [str(path) for path in files]
        hive = pa.dataset.partitioning(flavor="hive") if folder else None
        options = {"format": "parquet", "partitioning": hive, "partition_base_dir": folder}
        dataset = pa.dataset.dataset(names, **options)
        schemas = [part.physical_schema.remove_metadata() for part in dataset.get_fragments()]
        self.units = units_of_fields(schemas[0])  #: in the metadata of its fields
        for name, schema in zip(names[1:], schemas[1:], strict=True):
            if units_of_fields(schema) != self.units:
                raise FilesError(f"{name}: its fields have other units than those of {names[0]}")
        self.schema = pa.unify_schemas([dataset.schema, *schemas], promote_options="permissive")
        self.parts = list(pa.dataset.dataset(names, schema=self.schema, **options).get_fragments())
        self.where = f"{files[0]}: "

    def blocks(self, file: int, names: Sequence[str]) -> Iterator[RowBlock]:
        """Yield the rows of a file in blocks, with the columns ``names``."""
        part, row = self.parts[file], 0
        scan = pa.dataset.ParquetFragmentScanOptions(pre_buffer=False)
        options = {
            "batch_size": ROWS,
            "batch_readahead": 1,
            "fragment_scan_options": scan,
            "use_threads": False,
        }
        try:
            for batch in part.to_batches(self.schema, columns=names, **options):
                numbers = range(row + 1, row + 1 + len(batch))
                row += len(batch)
                share = row / max(part.metadata.num_rows, 1)
                yield RowBlock(batch, Rows(numbers, share))
        except (pa.ArrowException, OSError) as error:
            raise FilesError(f"{part.path}: damaged after row {row} ({error})") from None

    def cell(self, block: RowBlock, i: int, name: str) -> str | None:
        """Return a cell of a row as text."""
        cell = block.batch.column(name)[i].as_py()
        return None if cell is None else str(cell)

    def describe(self, say: Callable[[str], None]) -> None:
        """Say nothing: Parquet is read in one way."""


class TextSource:
    """Read tables as text whose headers name the same columns.  Raise FilesError if one does
    not."""

    units = None  # they are in the headers

    def __init__(
        self, files: Sequence[Path], dialect: Dialect, column_names: ColumnNames, to_text: bool
    ) -> None:
        self.files, self.tables = files, list[TextTable]()
        #: for each file: the lines that repeat the header or its units, so far
        self._repeated = [dict[int, Line]() for _ in files]
        for path in files:
            try:
                table = find_table(path, column_names, dialect)
            except TextError as error:
                raise FilesError(f"{path}: {error}") from None
            self.tables.append(table)
            heads, decimal = _named(table.units.heads), table.signs.decimal
            if len(self.tables) == 1:
                self.heads, self.decimal = heads, decimal or "."
            if heads != self.heads:
                raise FilesError(f"{path}: its header differs from that of {files[0]}")
            if to_text and decimal not in ("", self.decimal):
                raise FilesError(
                    f"{path}: its decimal separator differs from that of {files[0]}; give the "
                    "files one by one, or write Parquet"
                )
        first = self.tables[0]
        # Excel reads UTF-8 correctly if it begins with a byte-order mark
        self.has_mark = first.encoding != "utf-8"
        self.where = f"{files[0]}: line {first.header.start + 1}: "
        self.sep = first.sep
        self.schema = pa.schema([(head, pa.string()) for head in self.heads])

    def describe(self, say: Callable[[str], None]) -> None:
        """Say how the files were read (once if all are alike), and what was left out."""
        by_form: dict[str, list[str]] = {}
        for path, table, repeated in zip(self.files, self.tables, self._repeated, strict=True):
            by_form.setdefault(table.read_as(repeated), []).append(path.name)
        for form, names in by_form.items():
            where = "" if len(names) == len(self.tables) else f"{', '.join(names[:3])} "
            say(f"{where}read as: {form}")

    def cell(self, block: RowBlock, i: int, name: str) -> str | None:
        """Return a cell of a row as it is in the file."""
        return split_row(block.rows.texts[i], block.rows.sep)[self.heads.index(name)]

    def blocks(self, file: int, names: Sequence[str]) -> Iterator[RowBlock]:
        """Yield the rows of a file in blocks, with the columns ``names``.  An input is a column of
        numbers if all its cells in the block are plain numbers."""
        table, places = self.tables[file], [self.heads.index(name) for name in names]
        try:
            for rows in table.rows(lambda text: _read_at_once(text, table)):
                self._repeated[file] |= {
                    line: what for line, what in rows.skipped.items() if what is Line.REPEATED
                }
                if not rows.texts:
                    continue
                columns = rows.columns
                if columns is None:
                    text = "\n".join(rows.texts)
                    columns = _columns(text, table, table.units.inputs)
                    columns = columns or _columns(text, table, ())
                batch = pa.RecordBatch.from_arrays([columns[i] for i in places], [*names])
                yield RowBlock(batch, rows, table.signs)
        except TextError as error:
            raise FilesError(f"{self.files[file]}: {error}") from None


def _named(heads: Sequence[str]) -> Sequence[str]:
    """Return the names of columns.  Where several have none, they get those of their places.

    >>> _named(["", "v0"]), _named(["", "v0", ""])
    (['', 'v0'], ['column 1', 'v0', 'column 3'])
    """
    if heads.count("") < 2:
        return heads
    return [head or f"column {place}" for place, head in enumerate(heads, 1)]


def _read_at_once(text: str, table: TextTable) -> list[pa.Array] | None:
    """Return the columns of some lines, inputs as doubles, if every line is a row that Arrow reads:
    each input is a number or a gap, and no line may begin like a comment or a row of statistics.

    Return None if the lines must be examined one by one.
    """
    inputs = table.units.inputs
    if (
        not inputs
        or table.column_names.may_be_in(text)
        or "\n\n" in text  # an empty line has no number
        or ('"' in text and not _quotes_surround_cells(text, table.sep))
    ):
        return None
    columns = _columns(text, table, inputs)
    if columns is None or _may_hold_no_row(columns):
        return None
    has_number = functools.reduce(pc.or_, (pc.is_valid(columns[i]) for i in inputs))
    return columns if pc.all(has_number).as_py() else None


def _columns(text: str, table: TextTable, inputs: Collection[int]) -> list[pa.Array] | None:
    """Return the columns of rows, those of ``inputs`` as doubles.

    Return None if a row has another number of cells, or a cell no number, or one with so many
    digits that it would be infinite, which must not become a rigid contact.
    """
    data = text.encode()
    types = {str(i): pa.float64() if i in inputs else pa.string() for i in range(table.width)}
    try:
        read = pa.csv.read_csv(
            pa.BufferReader(data),
            pa.csv.ReadOptions(use_threads=False, block_size=len(data) + 1, column_names=[*types]),
            pa.csv.ParseOptions(
                delimiter=table.sep,
                quote_char='"' if b'"' in data else False,
                ignore_empty_lines=False,
                newlines_in_values=True,
            ),
            pa.csv.ConvertOptions(
                check_utf8=False,
                column_types=types,
                null_values=_NULLS,
                strings_can_be_null=False,
                decimal_point=table.signs.decimal or ".",
            ),
        )
    except pa.ArrowInvalid:
        return None
    columns = [column.combine_chunks() for column in read.columns]
    return None if any(pc.any(pc.is_inf(columns[i])).as_py() for i in inputs) else columns


def _may_hold_no_row(columns: Iterable[pa.Array]) -> bool:
    """Return whether a line may begin like a comment or a row of statistics: in a column of texts
    up to the first column, of texts or numbers, that no line leaves empty."""
    for column in columns:
        if not pa.types.is_string(column.type):
            if not column.null_count:
                return False
            continue
        if pc.any(pc.match_substring_regex(column, NO_ROW, ignore_case=True)).as_py():
            return True
        if pc.min(pc.utf8_length(pc.utf8_trim_whitespace(column))).as_py():
            return False
    return False


def _quotes_surround_cells(text: str, sep: str) -> bool:
    """Return whether each quote begins or ends a cell, or is one of two within it."""
    data = f"\n{text}\n".encode()
    signs = np.frombuffer(data, np.uint8)
    quotes = np.flatnonzero(signs == ord('"'))
    is_beside = np.isin(np.arange(256), [ord(sign) for sign in (sep, "\n", '"')])
    before, behind = is_beside[signs[quotes[::2] - 1]], is_beside[signs[quotes[1::2] + 1]]
    return quotes.size % 2 == 0 and bool(before.all() and behind.all())
