"""Answer many cases at once: read a body, columns or rows, evaluate it slice by slice, and write
the answers in the same form.

:meth:`Batch.of` makes the library's ``Cases`` of a body once.  :meth:`Batch.write` evaluates slices
of them, so that memory stays small and other threads can run between two slices.  A bad case
affects only itself.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import msgspec
import numpy as np
import orjson

from mumacro.errors import InputError
from mumacro.inputs.cases import KIND, Cases
from mumacro.kernel.arrays import Codes
from mumacro.outputs.answer import TEXTS, Answer, nested
from mumacro.outputs.entry import Output
from mumacro.outputs.evaluation import chosen, cost
from mumacro.results import Note, add

from .bodies import of_members
from .json_text import NotRead, decode_batch, dump, words
from .models.inputs import MAX_REASONS
from .models.options import OF_ONE_CASE, CaseColumns
from .problems import FieldFault, ProblemKind, RequestError, reason_of, refuse
from .rows import NUMBERS, Reason, decode_rows, read_one_by_one
from .tables import LoadedTable, Tables

MORE_CASES = "send several requests, or give `mumacro eval` a file, or use Dask"
_SLICE = 8192  # number of cases that are computed and written at a time
# costs, see service/admission.py: bytes of a body whose reading has the cost 1; a row, and a text
# or a null, that Python reads one by one
_BYTES_PER_UNIT, _ROW, _WORD = 16, 400.0, 40.0
_COUNTED = 2**18  # bytes of a text that are counted at a time, so that they stay in the cache
_KNOWN = len(CaseColumns.model_fields)  # number of names that a case or its columns may have
_OPENS_LIST = re.compile(rb"[ \t\r\n]*\[")
_PLACE = "\0"  # stands for a value in the layout of an answer


# --- what is read ---------------------------------------------------------------------------------


def count(text: bytearray, character: bytes) -> int:
    """Return how often a character occurs in a text; ``text.count`` is slower if it occurs
    often."""
    codes, code = np.frombuffer(text, np.uint8), character[0]
    starts = range(0, codes.size, _COUNTED)
    return sum(int(np.count_nonzero(codes[i : i + _COUNTED] == code)) for i in starts)


def costs_of_reading(text: bytearray, enough: float) -> tuple[float, float]:
    """Return the cost of reading a body, by its bytes, and by what Python may have to read one by
    one; this is not counted if the first cost is ``enough``."""
    of_bytes = len(text) / _BYTES_PER_UNIT
    if of_bytes > enough:
        return of_bytes, of_bytes
    words = (count(text, b'"') + count(text, b"l")) / 2  # a null has two letters l
    return of_bytes, of_bytes + _ROW * count(text, b"{") + _WORD * words


class Body(NamedTuple):
    """Hold the content of a body."""

    #: inputs by name (one value, a list, or an array of numbers) and options
    members: dict[str, Any]
    #: why rows are not cases, by their index; such a case has a NaN
    reasons: Mapping[int, Reason]
    rows: bool


def read(text: bytearray, max_batch: int, query: Mapping[str, Any]) -> Body:
    """Return the cases and the options of a body: an object of columns, or a list of rows.  The
    query may have contact, direction and deviations of all rows.

    The size is estimated before the text is decoded: every value except the first of its list or
    object follows a comma, and every list or object has a bracket.
    """
    most, objects = max_batch + 64, count(text, b"{")
    if max(objects, count(text, b"[")) > most or count(text, b",") > _KNOWN * most:
        raise _too_large(max_batch)
    try:
        if not _OPENS_LIST.match(text):
            return Body(decode_columns(text), {}, rows=False)
        return Body(decode_rows(text, query), {}, rows=True)
    except NotRead:
        if count(text, b":") > _KNOWN * objects + 64:
            detail = "the body has objects with more members than there are fields"
            raise RequestError(ProblemKind.INVALID_VALUE, detail) from None
        values = decode_batch(text)
    if isinstance(values, list):
        if len(values) > max_batch:
            raise _too_large(max_batch)
        return Body(*read_one_by_one(values, query), rows=True)
    if not isinstance(values, dict):
        refuse([FieldFault((), "must be an object of columns or a list of rows", values)])
    return Body(values, {}, rows=False)


def _too_large(max_batch: int) -> RequestError:
    """Return the error for a batch with more cases than the settings allow."""
    return RequestError(
        ProblemKind.BATCH_TOO_LARGE,
        f"a batch may have up to {max_batch} cases, this one has more: {MORE_CASES}",
        max_batch=max_batch,
    )


# splits an object into its members, and leaves the texts of columns unread
_split = msgspec.json.Decoder(
    msgspec.defstruct(
        "Members",
        [
            (name, msgspec.Raw if name in NUMBERS else Any, msgspec.UNSET)
            for name in CaseColumns.model_fields
        ],
        forbid_unknown_fields=True,
    )
).decode
_numbers = msgspec.json.Decoder(list[float]).decode


def decode_columns(text: bytearray) -> dict[str, Any]:
    """Return the members of an object: a list of an input becomes an array if it holds only
    numbers.  Raise one of :data:`NotRead` for an unknown name."""
    members = {}
    for name, value in msgspec.structs.asdict(_split(text)).items():
        if isinstance(value, msgspec.Raw):
            try:
                members[name] = np.array(_numbers(value), np.float64)
            except msgspec.ValidationError:
                members[name] = orjson.loads(memoryview(value))
        elif value is not msgspec.UNSET:
            members[name] = value
    return members


# --- what is answered -----------------------------------------------------------------------------


@dataclass
class Batch:
    """Hold cases and the options of their answers.  ``errors``, ``n_errors`` and ``notes`` grow as
    the slices are evaluated."""

    table: LoadedTable
    cases: Cases
    outputs: tuple[Output, ...]
    cost: float  #: of all cases together, see :mod:`service.admission`
    reasons: Mapping[int, Reason]
    rows: bool
    count: Callable[[LoadedTable, Codes], None]
    errors: list[dict[str, Any]] = field(default_factory=list)
    n_errors: int = 0
    notes: list[Note] = field(default_factory=list)

    @classmethod
    def of(
        cls,
        text: bytearray,
        query: Mapping[str, Any],
        tables: Tables,
        max_batch: int,
        count: Callable[[LoadedTable, Codes], None],
    ) -> "Batch":
        """Return the batch of a body, with the options of body and query together.  Empty the text;
        ``count`` is called with the sources of each slice."""
        members, reasons, rows = read(text, max_batch, query)
        text.clear()
        lengths = {
            name: len(value)
            for name, value in members.items()
            if isinstance(value, (list, np.ndarray)) and name != "include"
        }
        if any(length > max_batch for length in lengths.values()):
            raise _too_large(max_batch)
        if repeats := [name for name in query if members.get(name) is not None]:
            reason = "is given in the query and in the body"
            refuse([FieldFault.of(name, reason, members[name]) for name in repeats])
        model = of_members(CaseColumns, {**members, **query})
        outputs = model.include or ()
        for name in OF_ONE_CASE:
            if name in outputs:
                raise InputError("include", name, f"without {name}, which is for one case")
        values = {
            name: value
            for name, value in model
            if value is not None
            and name in model.model_fields_set
            and name not in ("include", "tolerance")
        }
        lengths = {name: n for name, n in lengths.items() if name in values.keys() - KIND}
        if len({*lengths.values()}) > 1:
            size = next(iter(lengths.values()))
            sizes = ", ".join(f"{name}: {length}" for name, length in lengths.items())
            reason = f"lists must have one length; given {sizes}"
            wrong = [name for name, length in lengths.items() if length != size]
            refuse([FieldFault.of(name, reason) for name in wrong])
        if not lengths and "v0" in values:  # otherwise it is refused below
            values["v0"] = np.array([values["v0"]])
        cases = Cases.of(values)
        outputs = chosen(tuple(outputs), cases)
        of_all = cases.size * cost(outputs, cases)
        table = tables.pick(model.tolerance, True if "tolerance" in query else None)
        return cls(table, cases, outputs, of_all, reasons, rows, count)

    def write(self, least: float) -> Iterator[bytes]:
        """Yield the answer as JSON, in the form of the body and in pieces of at least this size."""
        parts, size = list[bytes](), 0
        for part in self._as_rows() if self.rows else self._as_columns():
            parts.append(part)
            size += len(part)
            if size >= least:
                yield b"".join(parts)
                parts, size = [], 0
        end: dict[str, Any] = {"errors": self.errors, "n_errors": self.n_errors}
        if self.notes:
            end["remarks"] = [note.as_remark for note in self.notes]
        yield b"".join([*parts, b",", dump(end | self.table.signature)[1:]])

    def _as_columns(self) -> Iterator[bytes]:
        """Yield an object of lists, without its closing brace."""
        parts = [answer.columns for answer in self._answers()]
        layout = dump(nested(dict.fromkeys(parts[0], _PLACE)))[:-1].split(dump(_PLACE))
        for path, before in zip(parts[0], layout, strict=False):
            opening = before + b"["
            for part in parts:
                column = words(part[path]) if path in TEXTS else part[path]
                yield opening + dump(column)[1:-1]
                opening = b","
            yield b"]"
        yield layout[-1]

    def _as_rows(self) -> Iterator[bytes]:
        """Yield an object with the list ``results`` (null for a bad case), without its closing
        brace."""
        # by source code, which determines the words: a row with a place for each number
        opening, rows = b'{"results":[', {-1: b"null"}
        for answer in self._answers():
            columns, codes = answer.columns, answer.source_code.tolist()
            for code in {*codes} - rows.keys():
                first = codes.index(code)
                row = {path: x[first] if path in TEXTS else _PLACE for path, x in columns.items()}
                text = dump(nested(row)).replace(b"%", b"%%")
                rows[code] = text.replace(dump(_PLACE), b"%b")
            numbers = [column for path, column in columns.items() if path not in TEXTS]
            legal = np.column_stack(numbers)[answer.source_code >= 0].ravel()
            text = b",".join(map(rows.__getitem__, codes))
            yield opening + (text % (*dump(legal)[1:-1].split(b","),) if legal.size else text)
            opening = b","
        yield b"]"

    def _answers(self) -> Iterator[Answer[Any]]:
        """Yield the answers, slice by slice; yield one empty slice if there is no case."""
        for start in range(0, max(self.cases.size, 1), _SLICE):
            part = self.cases.part(slice(start, start + _SLICE))
            answer = self.table.surrogate.answer(part, self.outputs)
            self.count(self.table, answer.source_code)
            bad = np.flatnonzero(answer.source_code < 0).tolist()
            self.n_errors += len(bad)
            for index in (start + i for i in bad[: MAX_REASONS - len(self.errors)]):
                name, reason = self.reasons.get(index) or _reason(self.cases, index)
                self.errors.append({"index": index, "field": name, "reason": reason})
            for note in answer.notes:
                add(self.notes, note)
            yield answer


def _reason(cases: Cases, index: int) -> Reason:
    """Return why a case has no answer."""
    for name, faults in cases.faults.items():
        if index in faults:
            return Reason(name, faults[index].reason)
    error = cases.reason(index)
    return Reason(error.field, reason_of(error))
