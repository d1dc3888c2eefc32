"""Read a sheet of a workbook (.xlsx) as text, a line for each row; this needs openpyxl.

openpyxl reads row by row.  Other packages hold the whole rectangle of a sheet in memory: a file of
5 kB with one cell in the last corner needs 512 GB, and ends the process.
"""

import datetime
import io
import re
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import islice, repeat
from pathlib import Path
from typing import Any, BinaryIO

from mumacro.errors import TextError, missing
from mumacro.inputs.cells import evidence
from mumacro.inputs.layout import LOOKED_AT

# other zip files, by the beginning of their first member or of the list of their members
_OPEN_DOCUMENT = b"mimetypeapplication/vnd.oasis.opendocument"
BEGIN = b"PK\x03\x04"  #: the first bytes of a workbook
SEP = "\t"  #: separator of the cells in a line
_ROWS = 1_048_576  # largest number of rows of a sheet of Excel
# largest size of the parts of a workbook, unpacked, in bytes: openpyxl reads sheets row by row, the
# texts of cells into a list, and everything else into objects, which for 1 MiB of styles take 16
# MiB
_SHEETS, _TEXTS, _OTHERS = 512 * 2**20, 64 * 2**20, 4 * 2**20
# parts that openpyxl does not open here
_UNREAD = tuple(f"xl/{name}" for name in ("media/", "charts/", "drawings/", "embeddings/", "pivot"))
_LARGEST = 100 * 2**20  # largest number of characters of a sheet as text
_FORMULA = re.compile(rb"<f[ />]")
# what a number format adds to a number: texts in quotes, or characters after a backslash
_LITERAL = re.compile(r'"([^"]*)"|\\(.)')


def read_sheet(
    source: Path | bytes,
    sheet: str | None,
    decimal: str | None,
    has_names: Callable[[list[str]], bool],
) -> tuple[bytes, str]:
    """Return a sheet as UTF-8, a line for each row with tabs between the cells, and what to say
    about it.

    The sheet is the one with the name ``sheet``, or else the visible one in whose first lines
    ``has_names`` finds the necessary names.  Raise TextError if there is not exactly one such
    sheet, if the file is not a workbook, or if openpyxl is missing.
    """
    with io.BytesIO(source) if isinstance(source, bytes) else source.open("rb") as stream:
        _check(stream)
        try:
            import openpyxl  # type: ignore[import-untyped]
        except ModuleNotFoundError as error:
            remedy = f"{missing('files', error)}; or save it as CSV"
            raise TextError(f"it is a workbook (.xlsx), and {remedy}") from None
        try:
            book: Any = openpyxl.load_workbook(stream, read_only=True, data_only=True)
            one = _chosen(book.worksheets, sheet, decimal, has_names)
            formulas: Any = None
            if _has_formulas(stream):
                formulas = openpyxl.load_workbook(stream, read_only=True)[one.title]
            text = _as_text(one, formulas, decimal)
        except TextError:
            raise
        except Exception as error:  # a damaged file makes openpyxl raise any exception
            reason = " ".join(str(error).split())[:200] or type(error).__name__
            raise TextError(f"it is no workbook, or a damaged one ({reason})") from None
    rest = [repr(other.title) for other in book.worksheets if other.title != one.title]
    left_out = f", not {', '.join(rest[:10])}" if rest else ""
    return text.encode(), f"sheet {one.title!r}{left_out}, " if rest else ""


def _chosen(
    sheets: Sequence[Any],
    sheet: str | None,
    decimal: str | None,
    has_names: Callable[[list[str]], bool],
) -> Any:
    """Return the sheet of a name, or the one that has the names of the columns."""
    titles = ", ".join(repr(one.title) for one in sheets[:10])
    if sheet is not None:
        named = next((one for one in sheets if one.title == sheet), None)
        if named is None:
            raise TextError(f"there is no sheet {sheet!r}; there are {titles}")
        return named
    if not sheets:
        raise TextError("it is a workbook without a sheet")
    visible = [one for one in sheets if one.sheet_state == "visible"] or [*sheets]
    if len(sheets) == 1:
        return sheets[0]
    for group in (visible, [one for one in sheets if one not in visible]):
        with_names = []
        for one in group:
            one.reset_dimensions()
            rows = islice(one.iter_rows(), LOOKED_AT)
            with suppress(TextError):  # an empty sheet
                if has_names([SEP.join(_text(cell, decimal) for cell in row) for row in rows]):
                    with_names.append(one)
        if len(with_names) > 1:
            names = " and ".join(repr(one.title) for one in with_names[:5])
            raise TextError(f"the sheets {names} all have the names; choose one (--sheet)")
        if with_names:
            return with_names[0]
    return visible[0]


def _as_text(sheet: Any, formulas: Any, decimal: str | None) -> str:
    """Return the rows of a sheet as lines; a formula without a value is its text."""
    sheet.reset_dimensions()
    if formulas is not None:
        formulas.reset_dimensions()
    rows_of_formulas = repeat(()) if formulas is None else formulas.iter_rows()
    lines, size = list[str](), 0
    for row, formula_row, _ in zip(sheet.iter_rows(), rows_of_formulas, range(_ROWS), strict=False):
        cells = [_text(cell, decimal) for cell in row]
        for i, formula in enumerate(formula_row):
            if i < len(cells) and not cells[i] and str(formula.value or "").startswith("="):
                cells[i] = _quoted(" ".join(str(formula.value).split()))
        lines.append(SEP.join(cells).rstrip(SEP))
        size += len(lines[-1]) + 1
        if size > _LARGEST:
            raise TextError(f"it has a sheet of more than {_LARGEST >> 20} MiB; save it as CSV")
    return "\n".join([*lines, ""])


def _has_formulas(stream: BinaryIO) -> bool:
    """Return whether a sheet has a formula."""
    with zipfile.ZipFile(stream) as parts:
        for name in parts.namelist():
            if not name.lower().lstrip("/").startswith("xl/worksheets/"):
                continue
            with parts.open(name) as part:
                before = b""
                while data := part.read(2**20):
                    if _FORMULA.search(before + data):
                        return True
                    before = data[-3:]
    return False


def _check(stream: BinaryIO) -> None:
    """Say what a zip file is if it is not a workbook, and refuse a workbook that would be too large
    when unpacked; openpyxl refuses a damaged one.

    The directory of the zip file tells the sizes, and no part unpacks to more.
    """
    if _OPEN_DOCUMENT in stream.read(200):
        raise TextError("it is an OpenDocument file (.ods); save it as .xlsx or as CSV")
    try:
        with zipfile.ZipFile(stream) as parts:
            members = parts.infolist()
    except (zipfile.BadZipFile, OSError, ValueError):
        return
    names = [member.filename for member in members]
    if "xl/workbook.bin" in names:
        raise TextError("it is a binary workbook (.xlsb); save it as .xlsx or as CSV")
    if not any(name.lower().lstrip("/").startswith("xl/") for name in names):
        first = ", ".join(name[:60] for name in names[:3])
        raise TextError(f"it is a zip file with {first or 'nothing in it'}; unpack it")
    sizes = dict.fromkeys((_SHEETS, _TEXTS, _OTHERS), 0)
    for member in members:
        name = member.filename.lower().lstrip("/")
        if name.startswith(_UNREAD):
            continue
        is_sheet = name.startswith("xl/worksheets/")
        most = _SHEETS if is_sheet else _TEXTS if name == "xl/sharedstrings.xml" else _OTHERS
        sizes[most] += member.file_size
        if sizes[most] > most:
            raise TextError(
                f"it is a workbook with more than {most >> 20} MiB in {member.filename[:80]!r} "
                "and parts such as this; save it as CSV"
            )


def _text(cell: Any, decimal: str | None) -> str:
    """Return a cell as a person would type it: with the chosen decimal separator, and with the unit
    that its number format shows."""
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        form = cell.number_format or ""
        # the sheet shows 7 % for 0.07
        number = f"{100 * value:.15g}%" if "%" in form else repr(value)
        shown = "".join(a or b for a, b in _LITERAL.findall(form.partition(";")[0])).strip()
        unit = f" {shown}" if any(map(str.isalpha, shown)) else ""
        return (number.replace(".", decimal) if decimal else number) + unit
    text = " ".join(str(value).split())
    # a text that may mean two numbers means none of them, unless the separator is chosen
    doubtful = not decimal and evidence(text) in ((".", False), (",", False))
    return _quoted(f"'{text}" if doubtful else text)


def _quoted(text: str) -> str:
    """Return a text as a cell."""
    return '"' + text.replace('"', '""') + '"' if '"' in text else text
