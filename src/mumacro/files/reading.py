"""The formats of files: which files there are, their columns, and their rows in blocks.

Cells of tables as text are text.  Inputs become numbers; other columns stay text.
"""

import glob
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.dataset

from mumacro.files.errors import FilesError
from mumacro.files.text_source import Block, TextTable
from mumacro.inputs.layout import ColumnNames, Dialect

#: endings of files that are written, and their format
WRITTEN = {
    ".csv": "text",
    ".tsv": "text",
    ".txt": "text",
    ".parquet": "parquet",
}
#: endings of files that are read, and their format
FORMATS = WRITTEN | dict.fromkeys((".lvm", ".dat", ".asc", ".prn", ".xlsx"), "text")
ENDINGS = f"{', '.join(WRITTEN)} (text also .gz)"
# endings that only tables have; a text with another ending may be a note beside them
_TABLES = {".csv", ".tsv", ".parquet"}
#: endings of files with a JSON object a line, which are refused
_JSON = {".ndjson", ".jsonl", ".json"}
# what begins the names of files that others leave in a folder: metadata, hidden files, Excel's lock
_STRAY = ("_", ".", "~$")
ROWS = 65_536  # rows of a block, at most: a third of a second of work


def format_of(path: Path, formats: Mapping[str, str] = WRITTEN) -> tuple[str, bool]:
    """The format by a name's ending, empty for another ending, and whether it is compressed."""
    name = path.name.lower()
    is_compressed = name.endswith(".gz")
    file_format = formats.get(ending_of(path), "")
    return "" if is_compressed and file_format == "parquet" else file_format, is_compressed


def ending_of(path: Path) -> str:
    """The ending of a name, before that of a compressed file.

    >>> ending_of(Path("cases.CSV.gz"))
    '.csv'
    """
    return Path(path.name.lower().removesuffix(".gz")).suffix


def find_files(
    cases: Sequence[str | Path], say: Callable[[str], None] = lambda _text: None
) -> tuple[list[Path], str]:
    """The files that paths, folders and patterns name, in order, and their format.

    A file that is named itself is a table as text where its ending tells nothing.  What others
    leave in a folder is skipped, and said.  FilesError where one names no file, or formats differ.
    """
    files: list[Path] = []
    formats: dict[str, None] = {}
    for entry in cases:
        path = Path(entry)
        if path.is_file():
            if ending_of(path) in _JSON:
                remedy = "write CSV or Parquet, as pandas.read_json(..., lines=True).to_csv does"
                raise FilesError(f"{path}: JSON is no table: {remedy}")
            files.append(path)
            formats[format_of(path, FORMATS)[0] or "text"] = None
            continue
        pattern = f"{glob.escape(str(path))}/**/*" if path.is_dir() else str(path)
        matches = sorted(map(Path, glob.glob(pattern, recursive=True)))
        tables, strays = _tables_among([match for match in matches if match.is_file()])
        if not tables:
            raise FilesError(f"{entry}: no such file, or none that ends in {ENDINGS}")
        if strays:
            names = ", ".join(stray.name for stray in strays[:5])
            more = f" and {len(strays) - 5} more" if len(strays) > 5 else ""
            say(f"{entry}: skipped {names}{more}")
        files += tables
        formats |= dict.fromkeys(format_of(one, FORMATS)[0] for one in tables)
    if len(formats) > 1:
        raise FilesError(f"the files are of several formats: {', '.join(sorted(formats))}")
    return files, next(iter(formats))


def _tables_among(paths: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """The files of a folder that are tables of cases, and the others."""
    usable = [
        path
        for path in paths
        if format_of(path, FORMATS)[0]
        and not path.name.startswith(_STRAY)
        and not path.name.endswith(".rejects.csv")
    ]
    tables = [path for path in usable if ending_of(path) in _TABLES] or usable
    return tables, [path for path in paths if path not in set(tables)]


class ParquetSource:
    """Parquet; folders below ``folder`` that are named ``key=value`` give columns, as in Hive."""

    head: Sequence[str] = ()
    has_mark, sep, decimal = False, "", "."

    def __init__(self, files: Sequence[Path], folder: str | None) -> None:
        names = [str(path) for path in files]
        hive = pa.dataset.partitioning(flavor="hive") if folder else None
        options = {"format": "parquet", "partitioning": hive, "partition_base_dir": folder}
        dataset = pa.dataset.dataset(names, **options)
        schemas = [part.physical_schema.remove_metadata() for part in dataset.get_fragments()]
        self.schema = pa.unify_schemas([dataset.schema, *schemas], promote_options="permissive")
        self.parts = list(pa.dataset.dataset(names, schema=self.schema, **options).get_fragments())

    def blocks(self, file: int, names: Sequence[str]) -> Iterator[Block]:
        """The blocks of a file, of the columns ``names``."""
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
                yield Block(batch, row / max(part.metadata.num_rows, 1), numbers)
        except (pa.ArrowException, OSError) as error:
            raise FilesError(f"{part.path}: damaged after row {row} ({error})") from None


class TextSource:
    """Tables as text, whose heads name the same columns.

    ``to_text``, rows come out as they came in: as lines where the separator of the output is that
    of every file, else as cells.  FilesError where heads differ.
    """

    def __init__(
        self, files: Sequence[Path], dialect: Dialect, column_names: ColumnNames, to_text: bool
    ) -> None:
        self.tables = [TextTable(path, column_names, dialect) for path in files]
        first = self.tables[0]
        for table in self.tables:
            if table.layout.heads != first.layout.heads:
                raise FilesError(f"{table.path}: its header differs from that of {first.path}")
            if to_text and table.decimal != first.decimal:
                raise FilesError(
                    f"{table.path}: its decimal sign differs from that of {first.path}; give the "
                    "files one by one, or write Parquet"
                )
        self.to_text, self.as_lines = to_text, to_text
        self.sep, self.decimal = first.sep, first.decimal
        self.head = first.layout.heads
        self.schema = pa.schema([(head, pa.string()) for head in self.head])

    @property
    def has_mark(self) -> bool:
        """Whether the first file has a mark of byte order, or needs one as UTF-8, so that Excel
        reads its signs."""
        return self.tables[0].layout.encoding != "utf-8"

    @property
    def where(self) -> str:
        """The place of the head, for messages."""
        return f"{self.tables[0].path}: line {self.tables[0].layout.head}: "

    def describe(self, say: Callable[[str], None]) -> None:
        """Say how the files were read, once where all are alike, and what was left out."""
        by_form: dict[str, list[str]] = {}
        for table in self.tables:
            by_form.setdefault(table.read_as, []).append(table.path.name)
        for form, names in by_form.items():
            where = "" if len(names) == len(self.tables) else f"{', '.join(names[:3])} "
            say(f"{where}read as: {form}")

    def write_with(self, sep: str) -> bool:
        """Prepare for an output with the separator ``sep``; return whether rows come as lines."""
        self.as_lines = self.to_text and all(table.sep == sep for table in self.tables)
        return self.as_lines

    def blocks(self, file: int, names: Sequence[str]) -> Iterator[Block]:
        """The blocks of a file, of the columns ``names``."""
        numbers = self.as_lines or not self.to_text
        return self.tables[file].blocks(names, lines=self.as_lines, numbers=numbers)
