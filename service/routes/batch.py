"""Many cases at once: ``POST /v1/mu-macro/batch``, as JSON columns, JSON rows, NDJSON or an Arrow stream.

A pure ASGI endpoint: it reads and writes the messages itself, so that an answer can begin before the last of its
question has come, and so that no more of either is held than is being worked on.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from functools import partial
from importlib.util import find_spec
from typing import TypeVar

import numpy as np
from fastapi import APIRouter
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from friction.errors import MumacroError
from friction.regions import SOURCES
from service.answers import Answers, answer_cases, signature
from service.codecs import columns_text, is_rows, read_batch, row_text, rows_text, terminated
from service.compiled.block import count_codes
from service.compiled.digits import PADDING, Bytes
from service.connection import FILL, PIECES
from service.errors import (
    BodyTooLargeError,
    MalformedBodyError,
    OverloadedError,
    problem_of,
)
from service.intake import ARROW, JSON, NDJSON, Options, media_type, merged_options, options_from_query
from service.memory import trim
from service.metrics import Metrics
from service.middleware import BATCH_PATH, COMPRESS_FROM
from service.openapi import batch_bodies, describe_batch, option_parameters
from service.rooms import Rooms
from service.sending import CLOSE, Budget, Packer, gather, wants_gzip
from service.settings import Settings
from service.shelf import LoadedTable, Shelf
from service.streams import Blocks, LineAnswers, Lines, Spans
from service.wire import SMALL_BATCH

__all__ = ["BatchEndpoint", "router"]

router = APIRouter(tags=["answers"])
T = TypeVar("T")

_AT_ONCE = 256 * 1024  # bytes that are answered without a thread: it takes about a millisecond
_FEW_LINES = 16
_QUIET_S = 1.0  # without a large batch, before free memory is handed back


class BatchEndpoint:
    """Answers batches; holds what they share: places, threads, counters."""

    def __init__(self, shelf: Shelf, settings: Settings, metrics: Metrics) -> None:
        self._shelf = shelf
        self._settings = settings
        self._metrics = metrics
        self._threads: ThreadPoolExecutor | None = None
        self._kinds = (JSON, NDJSON, ARROW) if find_spec("pyarrow") else (JSON, NDJSON)
        self._arrow_known = False
        self.rooms = Rooms(settings.max_body_bytes)
        self._plain = Blocks(settings.max_batch)
        self.holders: set[Budget] = set()
        self._trimming: asyncio.TimerHandle | None = None

    def start(self, threads: ThreadPoolExecutor) -> None:
        """Take over the threads that large batches run in."""
        self._threads = threads

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        request = Request(scope)
        started = False

        async def send_noted(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            kind = media_type(request, self._kinds)
            options = options_from_query(request)
            budget = Budget(self._settings)
            given = request.headers.get("content-length", "")
            length = int(given) if given.isdigit() else -1
            async with self._place(length, budget):
                if kind == NDJSON:
                    await self._stream(request, receive, send_noted, options, budget)
                else:
                    await self._whole(request, receive, send_noted, options, budget, kind, length)
        except MumacroError as error:
            if started:
                raise ClientDisconnect from error  # nothing but the end of the connection can say it now
            await problem_of(error, scope["path"])(scope, receive, send)

    @asynccontextmanager
    async def _place(self, length: int, budget: Budget) -> AsyncIterator[None]:
        if 0 <= length <= SMALL_BATCH:
            yield
            return
        holders = self.holders
        if len(holders) >= self._settings.max_batches:
            slowest = min(holders, key=lambda held: held.rate())
            if not slowest.is_slow:
                raise OverloadedError(f"{len(holders)} large batches are being answered already", headers=CLOSE)
            # Places are for who uses them: a few who send a byte a second would keep all others out.
            holders.discard(slowest)
            slowest.give_way()
        holders.add(budget)
        if self._trimming is not None:
            self._trimming.cancel()
        try:
            yield
        finally:
            holders.discard(budget)
            if not holders:  # not at once: the next batch would have to ask for it again
                self._trimming = asyncio.get_running_loop().call_later(_QUIET_S, self._trim)

    def _trim(self) -> None:
        self.rooms.empty()
        with suppress(RuntimeError):  # the threads have been stopped
            asyncio.get_running_loop().run_in_executor(self._threads, trim)

    async def _run(self, size: int, work: Callable[[], T]) -> T:
        """Do the work at once if it is small, else in a thread: short requests are not kept waiting behind it."""
        if size <= _AT_ONCE or self._threads is None:
            return work()
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)

    # --- bodies that are read whole -------------------------------------------------------------------

    async def _whole(
        self, request: Request, receive: Receive, send: Send, query: Options, budget: Budget, kind: str, length: int
    ) -> None:
        body = await self._body(request.scope, length, receive, budget)
        size = body.size - PADDING
        if size == 0:
            raise MalformedBodyError("the body is empty")
        if kind == ARROW:
            query, place = merged_options(query, {})
            table = self._shelf.pick(query.tolerance, place)
            if not self._arrow_known:
                size += _AT_ONCE  # into a thread, where the first one loads pyarrow
            pieces = self._arrow_pieces(body, table, query)
        else:
            pieces = self._pieces(body, query)
        del body  # or it would be held until the last piece is sent
        await self._send(request, send, kind, size, gather(pieces), budget)

    async def _body(self, scope: Scope, length: int, receive: Receive, budget: Budget) -> Bytes:
        """The body, with 0 bytes behind it.  Memory is taken as it comes in, not as it is announced."""
        limit = self._settings.max_body_bytes
        if length > limit:
            raise _body_too_large(limit)
        deadline = budget.deadline()
        message = await self._message(receive, budget, deadline)
        piece, more = message.get("body", b""), message.get("more_body", False)
        if length >= 0 and len(piece) <= length:
            text = self.rooms.take(length)
            room = text.data
            room[: len(piece)] = piece
            filled = len(piece)
            fill = scope.get("extensions", {}).get(FILL)
            if more and fill is not None:
                # the server below puts the rest in its place, instead of sending a message for every few kilobytes
                if not await budget.client(fill(room, filled, budget.note), deadline):
                    raise ClientDisconnect
                return text
            while more:
                message = await self._message(receive, budget, deadline)
                piece, more = message.get("body", b""), message.get("more_body", False)
                room[filled : filled + len(piece)] = piece
                filled += len(piece)
            text[filled:] = 0
            return text
        body = bytearray(piece)
        while more:
            if len(body) > limit:
                raise _body_too_large(limit)
            message = await self._message(receive, budget, deadline)
            body += message.get("body", b"")
            more = message.get("more_body", False)
        if len(body) > limit:
            raise _body_too_large(limit)
        return terminated(body)

    @staticmethod
    async def _message(receive: Receive, budget: Budget, deadline: float) -> Message:
        message = await budget.client(receive(), deadline)
        if message["type"] != "http.request":
            raise ClientDisconnect
        budget.note(len(message.get("body", b"")))
        return message

    def _pieces(self, text: Bytes, query: Options) -> Iterator[bytes]:
        """Answer one JSON text when the first piece is asked for."""
        block = self._block(text) if text.size <= _AT_ONCE and query == Options() else None
        if block is not None:
            table, answers, content = block
            self._count(table, answers)
            yield content
            return
        answered = self._answer(text, query)
        del text
        yield from answered

    def small(self, body: bytes, most: int) -> bytes | None:
        """Answer a small batch without options beside it, in ``most`` bytes; None where that cannot be done."""
        text = terminated(body)
        if text.size > self._settings.max_body_bytes + PADDING or self._shelf.fault is not None:
            return None
        try:
            table, answers, content = self._block(text) or self._small(text)
        except MumacroError:
            return None  # the long way will find the words for it
        if len(content) > most:
            return None
        self._count(table, answers)
        return content

    def _block(self, text: Bytes) -> tuple[LoadedTable, Answers, bytes] | None:
        """Answer plain columns of good cases, in a tenth of the time; None if it is anything else.

        In the loop's thread only, which small texts never leave: the memory for it is there once.
        """
        size = self._plain.read(text, 0, text.size - PADDING)
        if size <= 0:
            return None
        table = self._shelf.pick()
        answers = self._plain.answer(table, size)
        return None if answers is None else (table, answers, self._plain.text(table, answers, (0, size))[:-1])

    def _small(self, text: Bytes) -> tuple[LoadedTable, Answers, bytes]:
        table, answers, pieces = self._answered(text, Options())
        return table, answers, b"".join(pieces)

    def _arrow_pieces(self, body: Bytes, table: LoadedTable, query: Options) -> Iterator[bytes]:
        from service.arrow import answer_arrow

        self._arrow_known = True
        yield from answer_arrow(body[: body.size - PADDING], table, query, self._settings.max_batch, self._count)

    def _answer(self, text: Bytes, query: Options, *, line: bool = False) -> Iterator[bytes]:
        """Answer and count one JSON text, which ends in 0 bytes; what is returned writes it, piece by piece."""
        table, answers, pieces = self._answered(text, query, line=line)
        self._count(table, answers)
        return pieces

    def _answered(
        self, text: Bytes, query: Options, *, line: bool = False
    ) -> tuple[LoadedTable, Answers, Iterator[bytes]]:
        rows = is_rows(text)
        cases, given = read_batch(text, self._settings.max_batch)
        options, place = merged_options(query, given)
        table = self._shelf.pick(options.tolerance, place)
        answers = answer_cases(table, cases, options.include, options.std)
        write = row_text if line and not rows and not cases.listed else rows_text if rows else columns_text
        return table, answers, write(answers, signature(table))

    def _count(self, table: LoadedTable, answers: Answers, n_bad: int | None = None) -> None:
        by_source = np.zeros(len(SOURCES) + 1, dtype=np.int64)
        count_codes(answers.source, by_source)
        self._metrics.count_cases(
            table.metrics_place, by_source[:-1].tolist(), answers.n_bad if n_bad is None else n_bad
        )

    async def _send(
        self, request: Request, send: Send, kind: str, size: int, pieces: Iterator[bytes], budget: Budget
    ) -> None:
        """Send the pieces, no faster than the caller takes them."""
        packer: Packer | None = None
        started = False
        async for piece, last in self._each(size, pieces):
            if not started:
                started = True
                headers = [(b"content-type", kind.encode("ascii"))]
                if len(piece) >= COMPRESS_FROM and wants_gzip(request.headers.get("accept-encoding", "")):
                    packer = Packer()
                    headers += [(b"content-encoding", b"gzip"), (b"vary", b"accept-encoding")]
                elif last:
                    headers.append((b"content-length", b"%d" % len(piece)))
                await send({"type": "http.response.start", "status": 200, "headers": headers})
            if packer is not None:
                piece = await self._run(len(piece), partial(packer.pack, piece, last=last))
            budget.note(len(piece))
            await budget.client(send({"type": "http.response.body", "body": piece, "more_body": not last}))

    async def _each(self, size: int, pieces: Iterator[bytes]) -> AsyncIterator[tuple[bytes, bool]]:
        """The pieces, each with whether it is the last; a thread is asked once for the first two."""
        piece, following = await self._run(size, lambda: (next(pieces, None), next(pieces, None)))
        while piece is not None:
            yield piece, following is None
            piece = following
            if piece is not None:
                following = await self._run(size, lambda: next(pieces, None))

    # --- streams --------------------------------------------------------------------------------------

    async def _stream(self, request: Request, receive: Receive, send: Send, query: Options, budget: Budget) -> None:
        """Answer line by line, each as soon as it is there: what is held does not grow with the stream."""
        answer = partial(self._answer, query=query, line=True)
        answers = LineAnswers(self._shelf, query, self._settings.max_batch, answer, self._count)  # or an error, by now
        headers = [(b"content-type", NDJSON.encode("ascii"))]
        packer = Packer() if wants_gzip(request.headers.get("accept-encoding", "")) else None
        if packer is not None:
            headers += [(b"content-encoding", b"gzip"), (b"vary", b"accept-encoding")]
        # Who asks whether to go on sends nothing until the server says so, which it does when it is to receive; others
        # may send nothing until they see that the answer begins.
        first = await self._message(receive, budget, budget.deadline()) if "expect" in request.headers else None
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        async for lines, spans, number in self._lines(request.scope, receive, budget, first):
            # Lines that are not plain are answered one by one, so many of them take longer than their bytes say.
            size = max(end - start for start, end in spans) if len(spans) <= _FEW_LINES else _AT_ONCE + 1
            async for piece, _ in self._each(size, gather(answers.pieces(lines, spans, number))):
                if packer is not None:
                    piece = await self._run(len(piece), partial(packer.pack, piece, flush=True))
                budget.note(len(piece))
                await budget.client(send({"type": "http.response.body", "body": piece, "more_body": True}))
        end = b"" if packer is None else packer.pack(b"", last=True)
        await budget.client(send({"type": "http.response.body", "body": end, "more_body": False}))

    async def _lines(
        self, scope: Scope, receive: Receive, budget: Budget, first: Message | None
    ) -> AsyncIterator[tuple[Lines, Spans, int]]:
        """Whole lines, some at a time, and how many came before."""
        limit = self._settings.max_body_bytes
        take = scope.get("extensions", {}).get(PIECES)
        lines = Lines()
        number = 0
        deadline = budget.deadline()
        message = first or await self._message(receive, budget, deadline)
        pieces, more = [message.get("body", b"")], message.get("more_body", False)
        while True:
            for piece in pieces:
                lines.put(piece)
            while spans := lines.take(_AT_ONCE, last=not more):
                yield lines, spans, number
                number += len(spans)
                deadline = budget.deadline()
                await asyncio.sleep(0)  # others' turn
            if lines.rest > limit:
                raise BodyTooLargeError(f"a line may have up to {limit} bytes", headers=CLOSE, max_bytes=limit)
            if not more:
                return
            if take is None:
                message = await self._message(receive, budget, deadline)
                pieces, more = [message.get("body", b"")], message.get("more_body", False)
            else:
                taken = await budget.client(take(), deadline)
                if taken is None:
                    raise ClientDisconnect
                pieces, more = taken
                budget.note(sum(map(len, pieces)))


def _body_too_large(limit: int) -> BodyTooLargeError:
    return BodyTooLargeError(f"the body may have up to {limit} bytes", headers=CLOSE, max_bytes=limit)


class Direct(Response):
    """Lets the router's route end in the endpoint itself."""

    def __init__(self, endpoint: BatchEndpoint) -> None:
        self._endpoint = endpoint
        self.background = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the endpoint."""
        await self._endpoint(scope, receive, send)


@router.post(
    BATCH_PATH,
    operation_id="post_mu_macro_batch",
    summary="Macroscopic friction of many cases",
    response_class=Response,
    openapi_extra={"parameters": option_parameters(), "requestBody": batch_bodies()},
    responses=describe_batch(),
)
async def post_batch(request: Request) -> Response:
    """Answer in the form that was asked in, order kept.  A bad case has the result null and an entry in ``errors``.

    A stream of lines (NDJSON) is answered line by line: a line is a block of columns, a list of rows, or one case.
    Read the answer while you send, or the stream stands still.
    """
    endpoint: BatchEndpoint = request.app.state.batches
    return Direct(endpoint)
