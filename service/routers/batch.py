"""Answer many cases at once: ``POST /v1/mu-macro/batch``, JSON columns or rows; the answer has the
same form.

A body is read whole, and evaluated and answered in slices.  If it is not small, threads read and
compute it, with a slot that is kept until the last piece is sent.  The threads read one body at a
time, because it takes several times the memory of its arrays, and because Python runs one thread at
a time: several would be no faster and would keep the loop waiting longer.
"""

import math
import threading
from collections.abc import Callable, Iterator
from functools import partial
from typing import Annotated, Any, TypeVar

from fastapi import Query, Request, Response
from starlette.types import Receive, Scope, Send

from mumacro.inputs.cases import KIND
from mumacro.kernel.stopping import look

from ..admission import AT_ONCE, LONG, ticket_in, ticket_of
from ..batch import Batch
from ..bodies import JSON, from_client, only_json, read_body, within
from ..forms import MORE_CASES, read
from ..json_text import count
from ..models.inputs import EXAMPLE
from ..models.options import BatchOptions
from ..problems import ProblemKind, RequestError
from . import POST_PROBLEMS, router_of

router = router_of("answers")
T = TypeVar("T")
_PIECE = 256 * 1024  # bytes of an answer that are sent at a time
_BYTES_PER_UNIT = 16  # bytes of a body whose reading has the cost 1, see service/admission.py
# costs of reading a row, and a text or a null, if Python reads them one by one
_ROW, _WORD = 400.0, 40.0
_READS = threading.Lock()
# time between two checks of a waiting thread whether it must end
_LOOK_EVERY_S = 0.05


class _Answer(Response):
    """Read the body of a batch, and answer in pieces."""

    background = None

    def __init__(self, request: Request, options: BatchOptions) -> None:
        self._state, self._options = request.app.state, options
        self._fields: dict[bytes, bytes] = dict(request.scope["headers"])
        self._scope = request.scope
        self._patience: int = self._state.settings.client_timeout_s
        # HTTP/1.0 has no answer in pieces
        self._piece = math.inf if request.scope["http_version"] == "1.0" else _PIECE

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer within the time limit."""
        del scope
        async with within(self._state.settings.time_limit_s):
            await self._answer(receive, send)

    async def _answer(self, receive: Receive, send: Send) -> None:
        async def run(work: Callable[[], T], cost: float) -> T:
            """Do the work at once if it is small, otherwise in a thread, so that it delays no other
            request."""
            return (
                work() if cost <= AT_ONCE else await ticket_of(self._scope).run(work, cost, receive)
            )

        async def give(piece: bytes, unfinished: bool) -> None:
            message = {"type": "http.response.body", "body": piece, "more_body": unfinished}
            await from_client(send(message), self._patience)

        only_json(self._fields, f"for more cases than a batch may have {MORE_CASES}")
        limit = self._state.settings.max_body_bytes
        text = await from_client(
            read_body(self._fields, receive, limit, self._scope), self._patience
        )
        if not text:
            raise RequestError(ProblemKind.MALFORMED_BODY, "the body is empty")
        # The cost of reading depends on the bytes, that of computing on the cases: a small body can
        # request much computation.
        cost = len(text) / _BYTES_PER_UNIT
        of_reading = cost if cost > LONG else cost + _by_one(text)
        read_it = self._batch if of_reading <= AT_ONCE else self._batch_in_turn
        batch = await run(partial(read_it, text), of_reading)
        if ticket := ticket_in(self._scope):
            ticket.hold(0)  # the text is gone
        cost += batch.cost
        pieces = _gathered(batch.write(), self._piece)
        piece, following = await run(lambda: (next(pieces, b""), next(pieces, None)), cost)
        headers = [(b"content-type", JSON), (b"x-table", batch.table.id.encode("latin-1"))]
        if following is None:
            headers.append((b"content-length", b"%d" % len(piece)))
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        while following is not None:
            await give(piece, unfinished=True)
            piece, following = following, await run(lambda: next(pieces, None), cost)
        if ticket := ticket_in(self._scope):
            ticket.leave()
        await give(piece, unfinished=False)

    def _batch_in_turn(self, text: bytearray) -> Batch:
        while not _READS.acquire(timeout=_LOOK_EVERY_S):
            look()
        try:
            return self._batch(text)
        finally:
            _READS.release()

    def _batch(self, text: bytearray) -> Batch:
        state, options = self._state, self._options
        words = {name: x for name, x in options.members.items() if name in KIND}
        words |= options.deviations
        most = state.settings.max_batch
        body = read(text, most, words)
        text.clear()
        return Batch.of(body, options, state.tables, most, count=state.metrics.cases)


def _by_one(text: bytearray) -> float:
    """Return the cost of reading the values that Python may have to read one by one; a null has two
    letters l."""
    words = (count(text, b'"') + count(text, b"l")) / 2
    return _ROW * count(text, b"{") + _WORD * words


def _gathered(pieces: Iterator[bytes], least: float) -> Iterator[bytes]:
    """Yield the same bytes in pieces of at least this size."""
    parts, size = list[bytes](), 0
    for piece in pieces:
        parts.append(piece)
        size += len(piece)
        if size >= least:
            yield b"".join(parts)
            parts, size = [], 0
    if size:
        yield b"".join(parts)


def _ref(name: str) -> dict[str, str]:
    return {"$ref": f"#/components/schemas/{name}"}


_BODY = {
    "schema": {"anyOf": [_ref("CaseColumns"), {"type": "array", "items": _ref("Case")}]},
    "example": {**EXAMPLE, "v0": [0.01, 0.1]},
}
_ANSWER: Any = {
    "description": "The answers, in the form of the request",
    "content": {
        "application/json": {"schema": {"anyOf": [_ref("ColumnsAnswer"), _ref("RowsAnswer")]}}
    },
}


@router.post(
    "/mu-macro/batch",
    response_class=Response,
    openapi_extra={"requestBody": {"required": True, "content": {"application/json": _BODY}}},
    responses={200: _ANSWER, **POST_PROBLEMS},
    summary="Macroscopic friction of many cases",
)
async def post_mu_macro_batch(
    request: Request, options: Annotated[BatchOptions, Query()]
) -> Response:
    """Answer columns with columns and rows with rows, in the same order.  A bad case has the result
    null and an entry in ``errors``."""
    return _Answer(request, options)
