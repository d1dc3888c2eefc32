"""Many cases at once: ``POST /v1/mu-macro/batch``, in every format of :mod:`service.formats`.

The Content-Type gives the format.  ``/v1/mu-macro/batch/<name>`` takes one format only, so that generated clients are
typed.  Answers are sent piece by piece, no faster than the client reads them.
"""

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine, Iterator
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from fastapi.routing import APIRoute
from pydantic import ValidationError
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from mumacro.errors import MumacroError

from ..errors import BodyTooLargeError, FieldFault, MalformedBodyError, accepts, faults_of, problem_of, refusal
from ..evaluation import Answers, answer_batch
from ..formats import FORMATS, Format, choose
from ..formats.columns import dump
from ..formats.lines import LineAnswers
from ..formats.rows import objects
from ..guard import AT_ONCE, BATCH_PATH, CLOSE, SMALL_BODY, Work, check_media_type
from ..metrics import Metrics
from ..openapi import batch_operation, problems
from ..quantities import cost_of
from ..schemas import BatchQuery, Options, deviations
from ..tables import LoadedTable, Tables, TablesDep, signature, tables_of
from . import once_each

__all__ = ["Batches", "router"]

router = APIRouter(tags=["answers"])

_PIECE = 256 * 1024  # bytes of an answer that are sent at a time
_AHEAD = 1024 * 1024  # bytes of a stream that are read before their answers are taken
_LINES = 512 * 1024  # bytes of lines that are answered together
_BYTES_PER_UNIT = 16  # of a body, read in the time of a plain case
_LONG = 1e9  # cost of what may have to be compiled first
_NO_QUERY = BatchQuery()


class Batches:
    """Objects that all batches share; one per application."""

    def __init__(self, tables: Tables, work: Work, metrics: Metrics, max_body_bytes: int, max_batch: int) -> None:
        self.tables = tables
        self.work = work
        self.metrics = metrics
        self.max_body_bytes = max_body_bytes
        self.max_batch = max_batch

    def count(self, table: LoadedTable, answers: Answers) -> None:
        """Count the cases of an answer."""
        self.metrics.count_cases(table.cell, answers.source, answers.n_bad)

    def too_large(self) -> BodyTooLargeError:
        """The error for a body with more bytes than the settings allow."""
        return BodyTooLargeError(
            f"the body may have up to {self.max_body_bytes} bytes: split it, or stream it as NDJSON without a "
            "Content-Length and read the answer while you send",
            headers=CLOSE, max_bytes=self.max_body_bytes,
        )  # fmt: skip


class BatchResponse(Response):
    """Reads the body, and answers in pieces."""

    def __init__(self, request: Request, batches: Batches, chosen: Format | None, query: BatchQuery) -> None:
        self._request = request
        self._batches = batches
        self._chosen = chosen
        self._query = query
        self._placed = False
        self.background = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, and give the slot back if one was taken."""
        started = False

        async def send_noted(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            known = {name: entry.media_type for entry in FORMATS for name in (entry.media_type, *entry.aliases)}
            if self._chosen is not None:
                known = dict.fromkeys((self._chosen.media_type, *self._chosen.aliases), self._chosen.media_type)
            media_type = check_media_type(self._request.headers, known)
            if any(entry.streams for entry in FORMATS if entry.media_type == media_type):
                await self._stream(receive, send_noted, media_type)
            else:
                await self._whole(receive, send_noted, media_type)
        except MumacroError as error:
            if started:
                raise ClientDisconnect from error  # the answer has begun: end the connection
            await problem_of(error, scope["path"])(scope, receive, send)
        finally:
            if self._placed:
                self._batches.work.used -= 1

    def _place(self) -> None:
        if not self._placed:
            self._batches.work.take()
            self._placed = True

    # --- bodies that are read whole -------------------------------------------------------------------

    async def _whole(self, receive: Receive, send: Send, media_type: str) -> None:
        text = await self._body(receive)
        if not text:
            raise MalformedBodyError("the body is empty")
        size = len(text)
        chosen = self._chosen or choose(media_type, memoryview(text))
        query = self._options({}, "parameter")[0]
        # Reading costs by the byte, computing by the case: a small body can request much computation.
        reading = size / _BYTES_PER_UNIT if self._batches.tables.warm else _LONG
        batch, given = await self._run(partial(chosen.read, text, self._batches.max_batch), reading)
        options, place = self._options(given, "pointer") if given else (query, "parameter")
        if given and self._query.given().get("tolerance") is not None:
            place = "parameter"
        del text
        table = self._batches.tables.pick(options.tolerance, place)
        include = options.names()
        cost = batch.size * cost_of(include) * (1.0 if not include or self._batches.tables.warm else _LONG)
        answers = await self._run(partial(answer_batch, table, batch, include, deviations(options.std)), cost)
        del batch
        self._batches.count(table, answers)
        pieces = _gathered(chosen.write(answers, signature(table)))
        await self._send(send, chosen.media_type, pieces, cost=size / _BYTES_PER_UNIT + cost, table=table)

    async def _run(self, work: Any, cost: float) -> Any:
        if cost > AT_ONCE:
            self._place()
        return await self._batches.work.run(work, cost)

    async def _body(self, receive: Receive) -> bytearray:
        """The body; one of more than 64 KiB needs a slot."""
        limit, work = self._batches.max_body_bytes, self._batches.work
        length = self._request.headers.get("content-length", "0")
        if not length.isdigit() or len(length) > 18 or int(length) > limit:
            raise self._batches.too_large()
        if int(length) > SMALL_BODY:
            self._place()
        return await work.client(self._read(receive))

    async def _read(self, receive: Receive) -> bytearray:
        body = bytearray()
        more = True
        while more:
            message = await receive()
            if message["type"] != "http.request":
                raise ClientDisconnect
            body += message.get("body", b"")
            more = message.get("more_body", False)
            if len(body) > SMALL_BODY:
                self._place()
            if len(body) > self._batches.max_body_bytes:
                raise self._batches.too_large()
        return body

    def _options(self, given: dict[str, Any], place: str) -> tuple[Options, str]:
        """Options of query and body together, and which of the two holds them."""
        query = self._query.given()
        twice = [name for name in given if name in query]
        if twice:
            faults = [FieldFault(name, "is given in the query and in the body", given[name]) for name in twice]
            raise refusal(faults)
        try:
            return Options.model_validate({**query, **given}), place
        except ValidationError as error:
            faults = faults_of(error.errors(include_url=False), place, tuple(Options.model_fields))
            raise refusal(faults) from None

    async def _send(
        self, send: Send, media_type: str, pieces: Iterator[bytes], *, cost: float, table: LoadedTable
    ) -> None:
        """Send the pieces, with a Content-Length if there is only one."""
        work = self._batches.work
        piece, following = await work.run(lambda: (next(pieces, b""), next(pieces, None)), cost)
        headers = [(b"content-type", media_type.encode("ascii")), (b"x-table", table.surrogate.id.encode("latin-1"))]
        if following is None:
            headers.append((b"content-length", b"%d" % len(piece)))
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        while following is not None:
            await work.client(send({"type": "http.response.body", "body": piece, "more_body": True}))
            piece, following = following, await work.run(lambda: next(pieces, None), cost)
        await work.client(send({"type": "http.response.body", "body": piece, "more_body": False}))

    # --- streams --------------------------------------------------------------------------------------

    async def _stream(self, receive: Receive, send: Send, media_type: str) -> None:
        """Answer each line as soon as it arrives; memory does not grow with the stream."""
        batches, work = self._batches, self._batches.work
        # A client that gives a length may send all of the body before it reads: the answer then comes after the body.
        # A client that gives no length may wait for the start of the answer before it sends more.
        more = "content-length" not in self._request.headers
        options, place = self._options({}, "parameter")
        table = batches.tables.pick(options.tolerance, place)
        include = options.names()
        answers = LineAnswers(
            table,
            include,
            deviations(options.std),
            batches.max_batch,
            self._line,
            batches.count,
            self._request.scope["path"],
        )
        text = bytearray() if more else await self._body(receive)
        self._place()
        source = _Pieces(receive, work)
        patience = self._request.app.state.settings.client_timeout_s
        source.until = asyncio.get_running_loop().time() + patience
        reader = asyncio.create_task(source.read_on()) if more else None
        end = asyncio.get_running_loop().time() + self._request.app.state.settings.time_limit_s
        try:
            await send({
                "type": "http.response.start", "status": 200,
                "headers": [(b"content-type", media_type.encode("ascii")), (b"x-accel-buffering", b"no")],
            })  # fmt: skip
            number = 0
            while True:
                if not more and not text.endswith(b"\n"):
                    text += b"\n"
                cut = text.rfind(b"\n") + 1
                for start, stop in _cut(text, cut, _LINES):
                    pieces, count = await work.run(partial(_answered, answers, text, start, stop, number))
                    number += count
                    for piece in pieces:
                        await work.client(send({"type": "http.response.body", "body": piece, "more_body": True}))
                del text[:cut]
                if cut:
                    source.until = asyncio.get_running_loop().time() + patience
                if not more:
                    break
                if len(text) > batches.max_body_bytes:
                    raise batches.too_large()
                if asyncio.get_running_loop().time() > end:
                    raise work.took_too_long()
                taken, more = await source.taken()
                text += taken
            await work.client(send({"type": "http.response.body", "body": b"", "more_body": False}))
        finally:
            if reader is not None:
                reader.cancel()

    def _line(self, line: bytearray) -> Iterator[bytes]:
        """Answer one line as a batch of its own: a block of columns, a list of rows, or one case."""
        chosen = choose("application/json", memoryview(line))
        batch, given = chosen.read(line, self._batches.max_batch)
        options, place = self._options(given, "pointer")
        table = self._batches.tables.pick(options.tolerance, place)
        answers = answer_batch(table, batch, options.names(), deviations(options.std))
        if answers.n_bad and not batch.listed:  # one case, and no list that could hold a null for it
            raise refusal([FieldFault(error["field"] or "body", error["reason"]) for error in answers.errors])
        self._batches.count(table, answers)
        if batch.listed:
            return chosen.write(answers, signature(table))
        return iter([dump(objects(answers, 0, 1, signature(table))[0])])


class _Pieces:
    """A body that is read ahead of the answers: some clients send the whole body before they read."""

    def __init__(self, receive: Receive, work: Work) -> None:
        self._receive = receive
        self._work = work
        self._held: deque[bytearray] = deque()
        self._size = 0
        self._more = True
        self._fault: BaseException | None = None
        self.until = 0.0  # time at which the current line must be complete
        self._came, self._went = asyncio.Event(), asyncio.Event()

    async def next(self) -> tuple[bytearray, bool]:
        """The next piece, and whether there may be more."""
        message = await self._work.message(self._receive, self.until)
        return bytearray(message.get("body", b"")), message.get("more_body", False)

    async def read_on(self) -> None:
        """Read to the end of the body; pause while the buffer is full."""
        try:
            while self._more:
                if self._size > _AHEAD:
                    self._went.clear()
                    await self._went.wait()
                piece, self._more = await self.next()
                self._held.append(piece)
                self._size += len(piece)
                self._came.set()
        except (MumacroError, ClientDisconnect) as error:
            self._fault = error
            self._came.set()

    async def taken(self) -> tuple[bytes, bool]:
        """All bytes since the last call; waits until there are some."""
        while not self._held and self._more:
            if self._fault is not None:
                raise self._fault
            self._came.clear()
            await self._came.wait()
        text = b"".join(self._held)
        self._held.clear()
        self._size = 0
        self._went.set()
        return text, self._more


def _cut(text: bytearray, stop: int, most: int) -> Iterator[tuple[int, int]]:
    """Where some whole lines of the text before ``stop`` begin and end, one after another."""
    start = 0
    while start < stop:
        end = stop if stop - start <= most else text.find(b"\n", start + most, stop) + 1 or stop
        yield start, end
        start = end


def _answered(answers: LineAnswers, text: bytearray, start: int, stop: int, number: int) -> tuple[list[bytes], int]:
    """The answers to some lines, and the number of lines; blank lines are counted and have no answer."""
    spans, count = [], 0
    while start < stop:
        end = text.find(b"\n", start)
        count += 1
        if text[start] not in b" \t\r\n" or text[start:end].strip():
            spans.append((start, end, number + count))
        start = end + 1
    return list(_gathered(answers.pieces(text, spans))), count


def _gathered(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """The same bytes in larger pieces."""
    gathered: list[bytes] = []
    size = 0
    for piece in pieces:
        gathered.append(piece)
        size += len(piece)
        if size >= _PIECE:
            yield b"".join(gathered)
            gathered, size = [], 0
    if size:
        yield b"".join(gathered)


class _Route(APIRoute):
    """Lets FastAPI read the parameters only if there is a query: that takes as long as a small batch."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """A handler that calls FastAPI's own only if there is a query."""
        usual = super().get_route_handler()

        async def answer(request: Request) -> Response:
            if request.scope["query_string"]:
                return await usual(request)
            response: Response = await self.endpoint(_NO_QUERY, request, tables_of(request))
            return response

        return answer


def _add(path: str, chosen: Format | None) -> None:
    accepts(path, BatchQuery.model_fields)

    async def post_batch(query: Annotated[BatchQuery, Query()], request: Request, _tables: TablesDep) -> Response:
        """Answer in the format of the request, order kept.  A bad case has the result null and an entry in ``errors``.

        A stream of lines (NDJSON) is answered line by line: a line is a block of columns, a list of rows, or one case.
        """
        return BatchResponse(request, request.app.state.batches, chosen, query)

    forms = FORMATS if chosen is None else [chosen]
    router.add_api_route(
        path, post_batch, methods=["POST"],
        operation_id="post_mu_macro_batch" + (f"_{chosen.name}" if chosen else ""),
        summary="Macroscopic friction of many cases" + (f", as {chosen.name}" if chosen else ""),
        response_class=Response, route_class_override=_Route, dependencies=[Depends(once_each)],
        responses={200: batch_operation(forms)["answer"], **problems(400, 401, 408, 413, 415, 422, 503)},
        openapi_extra={"requestBody": batch_operation(forms)["body"]},
    )  # fmt: skip


def add_routes() -> None:
    """One path for all formats, and one for each."""
    _add(BATCH_PATH, None)
    for entry in FORMATS:
        _add(f"{BATCH_PATH}/{entry.name}", entry)


add_routes()
