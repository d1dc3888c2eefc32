"""Many cases at once: ``POST /v1/mu-macro/batch``; the Content-Type gives the form, the answer has
the same.

A body is read whole, evaluated and answered in slices.  A stream of lines is answered line by line
while it arrives. A slot is taken when more than a small body, or a large computation, is at hand;
for a stream at its first complete line.  Computing and reading happen in threads.
"""

import asyncio
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from mumacro.errors import MumacroError

from ..answers import answer_case
from ..case import Columns
from ..limits import AT_ONCE, SMALL_BODY, form_of, read_body, within
from ..options import Options, options_of
from ..problems import FieldFault, Kind, RequestError, document_of, refuse
from ..wire import Batch, Form, csv, json
from ..wire.json import decode, dump
from . import Asking, Endpoint, given_in_query

_PIECE = 256 * 1024  # bytes of an answer that are sent at a time
_LINES = 512 * 1024  # bytes of lines that are answered together
_BYTES_PER_UNIT = 16  # of a body, read in the time of a plain case
_FORMS = [*json.FORMS, csv.FORM]
if find_spec("pyarrow"):
    from ..wire import arrow

    _FORMS.append(arrow.FORM)
FORMS = {name: form for form in _FORMS for name in (form.media_type, *form.aliases)}


class _Answer(Response):
    """Reads the body of a batch, and answers in pieces."""

    background = None

    def __init__(self, request: Request) -> None:
        self._request, self._app, self._work = request, request.app, request.app.work
        self._given: Mapping[bytes, bytes] = dict(request.scope["headers"])
        self._limit, self._most = self._app.settings.max_body_bytes, self._app.settings.max_batch
        self._placed = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, and give the slot back if one was taken."""
        del scope
        try:
            async with within(self._app.settings.time_limit_s):
                self._query = given_in_query(self._request)
                _, rest, faults = options_of(Options, self._query, parameter=True)
                told = "is no option; inputs belong in the body"
                if faults := [
                    *faults,
                    *(FieldFault((name,), told, parameter=True) for name in rest),
                ]:
                    refuse(faults)
                form = form_of(self._given, FORMS)
                await (self._stream if form.streams else self._whole)(form, receive, send)
        finally:
            if self._placed:
                self._work.batches.give_back()

    def _place(self) -> None:
        if not self._placed:
            self._work.batches.take()
            self._placed = True

    async def _run(self, work: Any, cost: float) -> Any:
        """Do the work at once if it is small, else in a thread, so that it delays no other
        request."""
        if cost <= AT_ONCE:
            return work()
        self._place()
        return await asyncio.wrap_future(self._work.batches.threads.submit(work))

    def _batch(self, columns: Columns, given: Mapping[str, Any]) -> Batch:
        """The batch with the options of query and body together."""
        options, _, faults = options_of(Options, self._both(given))
        if options is None:
            refuse(faults)
        wanted = options.wanted(columns.asked)
        table = self._app.tables.pick(options.tolerance, "tolerance" in self._query)
        return Batch(table, columns, wanted, count=self._app.metrics.cases)

    def _both(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """What the query and the body give, each name once."""
        if twice := [name for name in given if name in self._query]:
            refuse(
                [
                    FieldFault.of(name, "is given in the query and in the body", given[name])
                    for name in twice
                ]
            )
        return {**given, **self._query}

    # --- bodies that are read whole ---------------------------------------------------------------

    async def _whole(self, form: Form, receive: Receive, send: Send) -> None:
        text = await self._work.client(read_body(self._given, receive, self._limit, self._place))
        if not text:
            raise RequestError(Kind.MALFORMED_BODY, "the body is empty")
        # Reading costs by the byte, computing by the case: a small body can request much
        # computation.
        cost = len(text) / _BYTES_PER_UNIT
        columns, given = await self._run(lambda: form.read(text, self._most, self._query), cost)
        text = bytearray()  # freed, unless the columns are views of it
        batch = self._batch(columns, given)
        cost += columns.size * batch.wanted.cost
        pieces = _gathered(form.write(batch))
        piece, following = await self._run(lambda: (next(pieces, b""), next(pieces, None)), cost)
        headers = [
            (b"content-type", form.media_type.encode()),
            (b"x-table", batch.table.id.encode("latin-1")),
        ]
        if following is None:
            headers.append((b"content-length", b"%d" % len(piece)))
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        while following is not None:
            await self._work.client(
                send({"type": "http.response.body", "body": piece, "more_body": True})
            )
            piece, following = following, await self._run(lambda: next(pieces, None), cost)
        await self._work.client(
            send({"type": "http.response.body", "body": piece, "more_body": False})
        )

    # --- streams ----------------------------------------------------------------------------------

    async def _stream(self, form: Form, receive: Receive, send: Send) -> None:
        """Answer each line as soon as it has arrived; memory does not grow with the stream."""
        # A client that gives a length may send all of the body before it reads: the answer then
        # comes after the body. A client that gives none may wait for the start of the answer before
        # it sends more.
        more = b"content-length" not in self._given
        text = bytearray()
        if not more:
            text = await self._work.client(
                read_body(self._given, receive, self._limit, self._place)
            )
        self._app.tables.pick(self._query.get("tolerance"), parameter=True)
        head = [(b"content-type", form.media_type.encode()), (b"x-accel-buffering", b"no")]
        await send({"type": "http.response.start", "status": 200, "headers": head})
        number = 0
        while True:
            if not more and text and not text.endswith(b"\n"):
                text += b"\n"
            while cut := text.rfind(b"\n", 0, _LINES) + 1 or text.find(b"\n") + 1:
                self._place()
                lines = bytes(text[:cut]).split(b"\n")[:-1]
                del text[:cut]
                pieces = await self._run(
                    lambda lines=lines, first=number: self._lines(form, lines, first), 1e9
                )
                number += len(lines)
                for piece in pieces:
                    await self._work.client(
                        send({"type": "http.response.body", "body": piece, "more_body": True})
                    )
            if not more:
                break
            if len(text) > SMALL_BODY:
                self._place()
            if len(text) > self._limit:
                raise RequestError(
                    Kind.BODY_TOO_LARGE, f"a line may have up to {self._limit} bytes"
                )
            more = await self._work.client(_next_line(receive, text))
        await self._work.client(
            send({"type": "http.response.body", "body": b"", "more_body": False})
        )

    def _lines(self, form: Form, lines: list[bytes], first: int) -> list[bytes]:
        """The answers to some lines; blank ones are counted and have none."""
        answers = (
            self._line(form, line, first + i + 1) for i, line in enumerate(lines) if line.strip()
        )
        return list(_gathered(piece for answer in answers for piece in answer))

    def _line(self, form: Form, line: bytes, number: int) -> Iterator[bytes]:
        """Answer one line: one case, or a block of columns or a list of rows as a batch of its
        own."""
        try:
            columns, given = (
                form.read(bytearray(line), self._most, self._query) if b"[" in line else (None, {})
            )
            if columns is not None and columns.listed:
                yield from form.write(self._batch(columns, given))
            else:
                yield self._case(decode(line))
        except MumacroError as error:
            scope = {**self._request.scope, "path": f"{self._request.scope['path']}#line={number}"}
            yield dump(document_of(error, scope))
        yield b"\n"

    def _case(self, given: Any) -> bytes:
        """The answer to one case of a stream, where a null is a gap."""
        if not isinstance(given, dict):
            refuse([FieldFault((), "must be an object or a list of rows", given)])
        table, _, case, wanted = Asking.made(self._app.tables, Options, self._both(given))
        values, source = answer_case(table.surrogate, case, wanted)
        self._app.metrics.case(table, source)
        return dump({**values, **table.signature})


async def _next_line(receive: Receive, text: bytearray) -> bool:
    """Add to the text until a line is complete, or the next piece is large; whether there is
    more."""
    while True:
        message = await receive()
        if message["type"] != "http.request":
            raise ClientDisconnect
        piece, more = message.get("body", b""), bool(message.get("more_body", False))
        text += piece
        if b"\n" in piece or not more or len(text) > SMALL_BODY:
            return more


def _gathered(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """The same bytes in larger pieces."""
    gathered = bytearray()
    for piece in pieces:
        gathered += piece
        if len(gathered) >= _PIECE:
            yield bytes(gathered)
            gathered.clear()
    if gathered:
        yield bytes(gathered)


async def post_mu_macro_batch(request: Request) -> Response:
    """Answer in the form of the request, order kept.  A bad case has the result null and an entry
    in ``errors``.

    A stream of lines (NDJSON) is answered line by line: a line is a block of columns, a list of
    rows, or one case.
    """
    return _Answer(request)


_BODIES, _ANSWERS = (
    {form.media_type: getattr(form, part) for form in _FORMS} for part in ("body", "answer")
)
ENDPOINTS = [
    Endpoint(
        "/v1/mu-macro/batch",
        "POST",
        post_mu_macro_batch,
        "Macroscopic friction of many cases",
        Options,
        request={"required": True, "content": _BODIES},
        content={
            200: {"description": "The answers, in the form of the request", "content": _ANSWERS}
        },
    )
]
