"""Many cases at once: ``POST /v1/mu-macro/batch``; the Content-Type gives the form, the answer has
the same.

A body is read whole, evaluated and answered in slices.  A stream of lines is answered line by line
while it arrives. A slot is taken when more than a small body, or a large computation, is at hand;
for a stream at its first complete line.  Computing and reading happen in threads.
"""

import asyncio
from collections.abc import Iterator
from typing import Annotated, Any

from fastapi import Query, Request, Response
from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope, Send

from mumacro.errors import MumacroError

from ..batch import Batch, Body, Form, both
from ..batch_forms import ALL, FORMS
from ..included import Plan, answer_case
from ..limits import AT_ONCE, SMALL_BODY, Work, form_of, read_body, within
from ..models.options import BatchOptions, CaseRequest
from ..problems import FieldFault, ProblemKind, RequestError, document_of, meaning, refuse
from ..reading import DirectRoute, decode, dump, of_members, validated
from . import POST_PROBLEMS, router_of

router = router_of("answers", DirectRoute)
_PIECE = 256 * 1024  # bytes of an answer that are sent at a time
_LINES = 512 * 1024  # bytes of lines that are answered together
_BYTES_PER_UNIT = 16  # of a body, read in the time of a plain case


class _Answer(Response):
    """Reads the body of a batch, and answers in pieces."""

    background = None

    def __init__(self, request: Request, options: BatchOptions) -> None:
        self._scope, self._state, self._options = request.scope, request.app.state, options
        self._fields: dict[bytes, bytes] = dict(request.scope["headers"])
        self._work: Work = self._state.work
        settings = self._state.settings
        self._limit, self._most = settings.max_body_bytes, settings.max_batch
        self._placed = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, and give the slot back if one was taken."""
        del scope
        try:
            async with within(self._state.settings.time_limit_s):
                form = form_of(self._fields, FORMS)
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

    def _batch(self, body: Body) -> Batch:
        state = self._state
        return Batch.of(body, self._options, state.tables, self._most, count=state.metrics.cases)

    # --- bodies that are read whole ---------------------------------------------------------------

    async def _whole(self, form: Form, receive: Receive, send: Send) -> None:
        text = await self._work.client(read_body(self._fields, receive, self._limit, self._place))
        if not text:
            raise RequestError(ProblemKind.MALFORMED_BODY, "the body is empty")
        # Reading costs by the byte, computing by the case: a small body can request much
        # computation.
        cost = len(text) / _BYTES_PER_UNIT
        batch = await self._run(
            lambda: self._batch(form.read(text, self._most, self._options)), cost
        )
        text = bytearray()  # freed, unless the columns are views of it
        cost += batch.size * batch.plan.cost
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
        more = b"content-length" not in self._fields
        text = bytearray()
        if not more:
            text = await self._work.client(
                read_body(self._fields, receive, self._limit, self._place)
            )
        self._state.tables.pick(self._options.tolerance, parameter=True)
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
                    ProblemKind.BODY_TOO_LARGE, f"a line may have up to {self._limit} bytes"
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
            body = None
            if b"[" in line:
                body = form.read(bytearray(line), self._most, self._options)
            if body is not None and _listed(body):
                yield from form.write(self._batch(body))
            else:
                yield self._case(line)
        except MumacroError as error:
            scope = {**self._scope, "path": f"{self._scope['path']}#line={number}"}
            yield dump(document_of(meaning(error, scope), scope))
        yield b"\n"

    def _case(self, line: bytes) -> bytes:
        """The answer to one case of a stream."""
        if self._options.model_fields_set:
            members = decode(line)
            if not isinstance(members, dict):
                refuse([FieldFault((), "must be an object or a list of rows", members)])
            case = of_members(CaseRequest, both(members, self._options))
        else:
            case = validated(CaseRequest, line)
        table, inputs = self._state.tables.pick(case.tolerance), case.inputs
        values, source = answer_case(table.surrogate, inputs, Plan.of(case, inputs))
        self._state.metrics.case(table, source)
        return dump({**values, **table.signature})


def _listed(body: Body) -> bool:
    """Whether a line holds many cases."""
    lists = (name for name, value in body.members.items() if not isinstance(value, (float, int)))
    named = {*lists} - {"include", "k_range", "contact", "direction", "std", "k"}
    k = body.members.get("k")
    return body.rows or bool(named) or not (k is None or isinstance(k, (float, int, str)))


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
    gathered, size = list[bytes](), 0
    for piece in pieces:
        gathered.append(piece)
        size += len(piece)
        if size >= _PIECE:
            yield b"".join(gathered)
            gathered, size = [], 0
    if size:
        yield b"".join(gathered)


_BODIES = {form.media_type: form.body for form in ALL}
_ANSWERS: Any = {
    "description": "The answers, in the form of the request",
    "content": {form.media_type: form.answer for form in ALL},
}


@router.post(
    "/mu-macro/batch",
    response_class=Response,
    openapi_extra={"requestBody": {"required": True, "content": _BODIES}},
    responses={200: _ANSWERS, **POST_PROBLEMS},
    summary="Macroscopic friction of many cases",
)
async def post_mu_macro_batch(
    request: Request, options: Annotated[BatchOptions, Query()]
) -> Response:
    """Answer in the form of the request, order kept.  A bad case has the result null and an entry
    in ``errors``.

    A stream of lines (NDJSON) is answered line by line: a line is a block of columns, a list of
    rows, or one case.
    """
    return _Answer(request, options)
