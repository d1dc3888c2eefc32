"""Split a text file into lines: find its encoding and its line ends, and refuse a file that is not
a text.

The encoding is the one that the caller names, or else that of the byte order mark, or else UTF-8,
or else Windows-1252.  A file without a mark is Windows-1252 from the first byte that is not UTF-8,
if everything before it is ASCII, which is the same in both.  Lines end as in an editor: at a line
feed, a carriage return, or both.
"""

import codecs
import gzip
import io
import re
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from mumacro.errors import TextError

PIECE = 4 * 2**20  #: bytes that are read at once
LONGEST = 16 * 2**20  #: largest number of characters in a line
_START = 1024  # number of bytes from which the encoding is decided
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_GZIP = b"\x1f\x8b"
# files that are not tables as text, by their first bytes
_OTHERS = (
    (b"PK\x03\x04", "is a workbook (.xlsx) or another zip file; save its table as CSV"),
    (b"\xd0\xcf\x11\xe0", "is a workbook of old Excel (.xls); save it as .xlsx or as CSV"),
    (_GZIP, "is compressed; name it .gz, or unpack it"),
    (b"PAR1", "is Parquet; mumacro eval reads it by the name .parquet, or write it as CSV"),
    (b"ARROW1", "is an Arrow file (Feather, .arrow); write it as Parquet"),
    (b"\xff\xff\xff\xff", "is a stream of Arrow; write it as Parquet"),
    (b"FEA1", "is Feather; write it as Parquet"),
    (b"SQLite format 3", "is a database of SQLite; export a table as CSV"),
    (b"TDSm", "is a TDMS file of LabVIEW; export it as text"),
    (b"\x89HDF", "is HDF5; export a table as text"),
    (b"MATLAB 5", "is a MAT-file of MATLAB; write a table as text (writetable)"),
    (b"%PDF", "is a PDF"),
    (b"<", "is HTML or XML; save it as CSV"),
)
_JSON = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:\{\s*[\"}]|\[\s*[\[{\"]|\[\s*-?\d[\d.eE+-]*\s*,)")
# the encodings that are read, without those of Python that are not for texts, or are slow
_ENCODING = re.compile(
    r"ascii|big5\w*|cp\w+|euc\w+|gb\w+|hp_roman8|iso8859\w+|johab|koi8\w+|latin\w+|mac\w+"
    r"|ptcp154|shift\w+|tis_620|utf_(?:8|8_sig|16|16_le|16_be|32|32_le|32_be)"
)
#: names of encodings that people use
NAMES = {"utf-8": "UTF-8", "utf-8-sig": "UTF-8", "utf-16": "UTF-16", "utf-32": "UTF-32"}
NAMES |= {"utf-16-le": "UTF-16", "utf-16-be": "UTF-16", "cp1252": "Windows-1252"}


class Piece(NamedTuple):
    """Hold complete lines of a text."""

    first: int  #: the number of the first line, from 1
    text: str  #: the lines, with a line feed between two of them
    share: float = 1.0  #: fraction of the file that is read after them

    @property
    def lines(self) -> list[str]:
        """Return the lines without their ends."""
        return self.text.split("\n")

    def between(self, first: int, last: int | None) -> "Piece | None":
        """Return the lines from ``first`` to ``last``, or None if there are none."""
        start = max(first, self.first)
        *before, text = self.text.split("\n", start - self.first)
        if len(before) < start - self.first or (last is not None and last < start):
            return None
        if last is not None:
            text = "\n".join(text.split("\n", last - start + 1)[: last - start + 1])
        return Piece(start, text, self.share)


def encoding_of(name: str) -> str:
    """Return Python's name of the encoding that a person names.  Raise TextError if there is no
    such encoding.

    >>> encoding_of("Windows-1252"), encoding_of("UTF8")
    ('cp1252', 'utf-8')
    """
    python_name = name.strip().lower().replace("windows-", "cp")
    try:
        codec = codecs.lookup(python_name).name
    except (LookupError, ValueError):
        codec = ""
    if not _ENCODING.fullmatch(codec.replace("-", "_")):
        such_as = "utf-8, utf-16, windows-1252, iso-8859-15, mac-roman, gb18030, shift-jis"
        raise TextError(f"{name[:40]!r} is no encoding; give one such as {such_as}")
    return codec


def byte_pieces(source: Path | bytes) -> Iterator[tuple[bytes, float]]:
    """Yield the bytes of a file in pieces, also of a compressed file (.gz), each with the fraction
    of the file that is read after it.  Raise TextError if a compressed file is damaged."""
    if isinstance(source, bytes) and source.startswith(_GZIP):
        raise TextError("it is compressed: unpack it first")
    most = max(PIECE, _START)
    try:
        with io.BytesIO(source) if isinstance(source, bytes) else source.open("rb") as raw:
            size = max(raw.seek(0, io.SEEK_END), 1)
            raw.seek(0)
            is_compressed = isinstance(source, Path) and source.name.lower().endswith(".gz")
            stream: Any = gzip.GzipFile(fileobj=raw) if is_compressed else raw
            while data := stream.read(most):
                yield data, raw.tell() / size
                most = PIECE
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise TextError(f"the compressed file is damaged ({error})") from None


class Text:
    """Split pieces of bytes into pieces of complete lines.  The first piece must show the encoding:
    it has 1 kB, or all bytes.

    Memory holds a piece and a line.  TextError names the line with bytes that are not text in the
    encoding, with a zero byte, or with too many characters.

    >>> [piece.lines for piece in Text([(b"a\\rb\\r", 0.5), (b"\\nc", 1.0)]).pieces()]
    [['a'], ['b'], ['c']]
    """

    def __init__(self, pieces: Iterable[tuple[bytes, float]], encoding: str | None = None) -> None:
        self._codec_of_caller = None if encoding is None else encoding_of(encoding)
        self.encoding = ""  #: Python's name, known after the first piece
        self._bytes = pieces
        self._lines = 0  # number of complete lines
        self._ascii = True  # whether all bytes so far are ASCII
        self._decoder: codecs.IncrementalDecoder | None = None
        self._line_ends = io.IncrementalNewlineDecoder(None, translate=True)

    def pieces(self) -> Iterator[Piece]:
        """Yield the lines in pieces."""
        begun = list[str]()  # the beginning of the next line
        for data, share in self._bytes:
            text = self._decoded(data)
            whole, end, rest = text.rpartition("\n")
            piece = Piece(self._lines + 1, "".join([*begun, whole]), share) if end else None
            if piece is not None:
                self._lines += text.count("\n")
            begun = [rest] if end else [*begun, rest]
            if sum(map(len, begun)) > LONGEST:
                where = f"line {self._lines + 1} has more than {LONGEST >> 20} MiB"
                raise TextError(f"{where}: it is no table, or its line ends are lost")
            if piece is not None:
                yield piece
        last = "".join(begun) + (self._decoded(b"", final=True) if self._decoder else "")
        if last:
            yield Piece(self._lines + 1, last.removesuffix("\n"))

    def _decoded(self, data: bytes, final: bool = False) -> str:
        """Return the text of some bytes, with line feeds as line ends."""
        if self._decoder is None:
            self._decoder = self._begin(data)
        try:
            text = self._decoder.decode(data, final)
        except UnicodeDecodeError as error:
            text = self._in_windows_1252(error, final)
        self._ascii = self._ascii and text.isascii()
        text = self._line_ends.decode(text, final)
        if "\0" in text:
            line = self._lines + 1 + text.count("\n", 0, text.index("\0"))
            raise TextError(f"line {line} has a zero byte: it is no text, or damaged")
        return text

    def _begin(self, data: bytes) -> codecs.IncrementalDecoder:
        """Return the decoder for the first bytes, which show the encoding.  Refuse a file that is
        not a text."""
        for begin, what in _OTHERS:
            if data.startswith(begin):
                raise TextError(f"it {what}")
        if _JSON.match(data[:_START]):
            raise TextError("it is JSON; write a table as CSV, with a line for each case")
        codec_of_mark = next((name for mark, name in _MARKS if data.startswith(mark)), None)
        self.encoding = (
            self._codec_of_caller or codec_of_mark or _of_zeros(data[:_START]) or "utf-8"
        )
        if codec_of_mark and self.encoding in (
            codec_of_mark.removesuffix("-sig"),
            f"{codec_of_mark}-le",
            f"{codec_of_mark}-be",
        ):
            self.encoding = codec_of_mark
        if data and self.encoding in ("utf-16", "utf-32") and self.encoding != codec_of_mark:
            remedy = f"give {self.encoding}-le or {self.encoding}-be, or another encoding"
            raise TextError(f"it does not begin like {NAMES[self.encoding]}: {remedy}")
        return codecs.getincrementaldecoder(self.encoding)("strict")

    def _in_windows_1252(self, error: UnicodeDecodeError, final: bool) -> str:
        """Return the text of bytes that are not UTF-8, if they may be Windows-1252."""
        data = error.object
        unknown = self._codec_of_caller is None and self.encoding == "utf-8"
        if unknown and self._ascii and data[: error.start].isascii():
            self.encoding = "cp1252"
            self._decoder = codecs.getincrementaldecoder("cp1252")("strict")
            try:
                return self._decoder.decode(data, final)
            except UnicodeDecodeError as other:
                error = other
        before = data[: error.start]
        ends = before.count(b"\n") + before.count(b"\r") - before.count(b"\r\n")
        byte = f"byte 0x{data[error.start]:02x} in line {self._lines + 1 + ends}"
        name = NAMES.get(self.encoding, self.encoding)
        raise TextError(f"{byte} is not {name}: save the file as UTF-8, or give its encoding")


def _of_zeros(data: bytes) -> str | None:
    """Return the encoding with two bytes for each character, if every second byte is mostly
    zero."""
    half = len(data) // 2
    low, high = data[::2].count(0), data[1::2].count(0)
    if half < 2 or max(low, high) < 0.7 * half or min(low, high) > 0.1 * half:
        return None
    return "utf-16-le" if high > low else "utf-16-be"
