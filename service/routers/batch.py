"""Answer many cases at once: ``POST /v1/mu-macro/batch``, JSON columns or rows; the answer has the
same form.

A body is read whole, and evaluated and answered in slices.  If it is not small, threads read and
compute it, with a slot that is kept until the last piece is sent.  The threads read one body at a
time, because it takes several times the memory of its arrays, and because Python runs one thread at
a time: several would be no faster and would keep the loop waiting longer.
"""

import math
import threading
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, TypeVar

from fastapi import Query, Request, Response
from starlette.types import Receive, Scope, Send

from mumacro.kernel.threads import look

from ..admission import AT_ONCE, LONG, Ticket, ticket_of
from ..batch import MORE_CASES, Batch, costs_of_reading
from ..bodies import JSON, only_json, read_body, within
from ..models.inputs import EXAMPLE
from ..models.options import BatchOptions
from ..problems import TICKET, ProblemKind, RequestError
from . import POST_PROBLEMS, router_of

router = router_of("answers")
T = TypeVar("T")
_PIECE = 2 * 1024**2  # bytes of an answer that are sent at a time
_READS = threading.Lock()
# time between two checks of a waiting thread whether it must end
_LOOK_EVERY_S = 0.05


class _Answer(Response):
    """Read the body of a batch, and answer in pieces."""

    background = None

    def __init__(self, request: Request, options: BatchOptions) -> None:
        self._state = request.app.state
        self._query = {name: x for name, x in options if x is not None}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer within the time limit."""
        limit = self._state.settings.time_limit_s
        await within(limit, self._answer(scope, receive, send), ProblemKind.TOOK_TOO_LONG)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        state, settings = self._state, self._state.settings
        patience, fields = settings.client_timeout_s, dict[bytes, bytes](scope["headers"])

        async def run(work: Callable[[], T], cost: float) -> T:
            """Do the work at once if it is small, otherwise in a thread, so that it delays no other
            request."""
            return work() if cost <= AT_ONCE else await ticket_of(scope).run(work, cost, receive)

        only_json(fields, f"for more cases than a batch may have {MORE_CASES}")
        text = await within(patience, read_body(fields, receive, settings.max_body_bytes, scope))
        if not text:
            raise RequestError(ProblemKind.MALFORMED_BODY, "the body is empty")
        # The cost of reading depends on the bytes, that of computing on the cases: a small body can
        # request much computation.
        cost, of_reading = costs_of_reading(text, LONG)
        most, count = settings.max_batch, state.metrics.cases
        work = partial(Batch.of, text, self._query, state.tables, most, count)
        if of_reading > AT_ONCE:
            work = partial(_in_turn, work)
        batch = await run(work, of_reading)
        held: Ticket | None = scope.get(TICKET)
        if held:
            held.hold(0)  # the text is gone
        cost += batch.cost
        # HTTP/1.0 has no answer in pieces
        pieces = batch.write(math.inf if scope["http_version"] == "1.0" else _PIECE)
        piece, following = await run(lambda: (next(pieces), next(pieces, None)), cost)
        headers = [(b"content-type", JSON), (b"x-table", batch.table.id.encode("latin-1"))]
        if following is None:
            headers.append((b"content-length", b"%d" % len(piece)))
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        while following is not None:
            message = {"type": "http.response.body", "body": piece, "more_body": True}
            await within(patience, send(message))
            piece, following = following, await run(lambda: next(pieces, None), cost)
        if held := scope.get(TICKET):
            held.leave()  # a slow client keeps no slot, only the bytes
            held.hold(len(piece))
        await within(patience, send({"type": "http.response.body", "body": piece}))


def _in_turn(work: Callable[[], T]) -> T:
    """Do work while no other thread does work that is called in this way."""
    while not _READS.acquire(timeout=_LOOK_EVERY_S):
        look()
    try:
        return work()
    finally:
        _READS.release()


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
