"""The first sheet of a workbook (.xlsx) as text, a line for each row; needs openpyxl.

openpyxl reads row by row.  A reader that holds the whole rectangle of a sheet is no choice here: a
file of 5 kB with one cell in the last corner asks it for 512 GB, and ends the process.
"""

import datetime
import io
import zipfile
from collections.abc import Iterator
from typing import Any, BinaryIO

from mumacro.errors import missing
from mumacro.inputs.decoding import TextError
from mumacro.inputs.signs import evidence

# other zip files, by what their first member or the list of their members begins with
_OPEN_DOCUMENT = b"mimetypeapplication/vnd.oasis.opendocument"
BEGIN = b"PK\x03\x04"  #: the first bytes of a workbook
SEP = "\t"  #: between the cells of a line
_ROWS = 1_048_576  # rows of a sheet of Excel, at most
# bytes of the parts of a workbook, unpacked, at most: openpyxl reads sheets row by row, the texts
# of cells into a list, and everything else into objects, of which 1 MiB of styles takes 16 MiB
_SHEETS, _TEXTS, _OTHERS = 512 * 2**20, 64 * 2**20, 4 * 2**20
# parts that openpyxl does not open here
_UNREAD = tuple(f"xl/{name}" for name in ("media/", "charts/", "drawings/", "embeddings/", "pivot"))
_LINES = 4096  # lines of a piece


def sheet_pieces(stream: BinaryIO) -> Iterator[bytes]:
    """The first sheet as UTF-8 in pieces, with tabs between the cells and decimal points.

    TextError where it is no workbook, or openpyxl is missing.
    """
    _refuse_no_workbook(stream)
    try:
        import openpyxl  # type: ignore[import-untyped]
    except ModuleNotFoundError as error:
        remedy = f"{missing('files', error)}; or save it as CSV"
        raise TextError(f"it is a workbook (.xlsx), and {remedy}") from None
    try:
        _weigh(stream)
        sheet: Any = openpyxl.load_workbook(stream, read_only=True, data_only=True).worksheets[0]
        sheet.reset_dimensions()
        lines: list[str] = []
        for row, _ in zip(sheet.iter_rows(), range(_ROWS), strict=False):
            lines.append(SEP.join(map(_text, row)))
            if len(lines) == _LINES:
                yield "\n".join([*lines, ""]).encode()
                lines = []
        yield "\n".join([*lines, ""]).encode()
    except TextError:
        raise
    except Exception as error:  # openpyxl raises what a damaged file makes it to
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise TextError(f"it is no workbook, or a damaged one ({reason})") from None


def _weigh(stream: BinaryIO) -> None:
    """Refuse a workbook that would be too large unpacked; the directory of the zip file tells the
    sizes, and no part unpacks to more than that."""
    sizes = dict.fromkeys((_SHEETS, _TEXTS, _OTHERS), 0)
    with zipfile.ZipFile(stream) as parts:
        for part in parts.infolist():
            name = part.filename.lower().lstrip("/")
            if name.startswith(_UNREAD):
                continue
            is_sheet = name.startswith("xl/worksheets/")
            most = _SHEETS if is_sheet else _TEXTS if name == "xl/sharedstrings.xml" else _OTHERS
            sizes[most] += part.file_size
            if sizes[most] > most:
                raise TextError(
                    f"it is a workbook with more than {most >> 20} MiB in {part.filename[:80]!r} "
                    "and parts such as this; save it as CSV"
                )


def _refuse_no_workbook(stream: BinaryIO) -> None:
    """Name a zip file for what it is, where that is no workbook; openpyxl refuses a damaged one."""
    if _OPEN_DOCUMENT in stream.read(200):
        raise TextError("it is an OpenDocument file (.ods); save it as .xlsx or as CSV")
    try:
        with zipfile.ZipFile(stream) as parts:
            names = parts.namelist()
    except (zipfile.BadZipFile, OSError, ValueError):
        return
    if "xl/workbook.bin" in names:
        raise TextError("it is a binary workbook (.xlsb); save it as .xlsx or as CSV")
    if not any(name.lower().lstrip("/").startswith("xl/") for name in names):
        members = ", ".join(name[:60] for name in names[:3])
        raise TextError(f"it is a zip file with {members or 'nothing in it'}; unpack it")


def sheet_of(data: bytes) -> Iterator[bytes]:
    """As :func:`sheet_pieces`, from the bytes of a file."""
    return sheet_pieces(io.BytesIO(data))


def _text(cell: Any) -> str:
    """A cell as it would be typed."""
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        # the sheet shows 7 % where it holds 0.07
        return f"{100 * value:.15g}%" if "%" in (cell.number_format or "") else repr(value)
    text = " ".join(str(value).split())
    # a text that may be one of two numbers is none of them
    return f"'{text}" if evidence(text) in ((".", False), (",", False)) else text
