"""The fast path: the outermost middleware answers a plain case itself.

A plain case is six numbers, optionally with names of quantities and a tolerance.  msgspec reads it.  Any other request
(a fault, a text, a name given twice, a condition, an unusual header) takes the general path: the other middleware and
the router.  There the models of schemas.py read the same request and give the reason of a refusal.  So every error
message is written in one place only.
"""

import math
import time
from typing import Annotated, Any, Literal

import msgspec
import orjson
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from . import API_VERSION
from .errors import InvalidFieldsError
from .evaluation import answer_case, case_etag, default_answer
from .guard import CASE_PATH, Keys, path_of
from .kernel import MOST_HZ, RAD_PER_CYCLE
from .logs import AccessLog, accept_request_id
from .metrics import Metrics
from .middleware import NOSNIFF
from .quantities import QUANTITIES
from .schemas import MAX_INCLUDE, canonical
from .settings import Settings, cache_fields
from .tables import LoadedTable, Tables

__all__ = ["SingleCase"]

_MANY = 4  # digits of a Content-Length that no single case has
_JSON = frozenset({b"application/json", b"application/json; charset=utf-8", b"application/json;charset=utf-8"})
_PLAIN_QUERY = b"0123456789.eE+-=&" + "".join(sorted(set("mu0Fzky0omegafv0tolerance"))).encode()
_TYPE = (b"content-type", b"application/json")

_Positive = Annotated[float, msgspec.Meta(gt=0.0)]
_NotNegative = Annotated[float, msgspec.Meta(ge=0.0)]
_Quick: Any = Literal[tuple(name for name in QUANTITIES if name != "std")]  # std takes long: in a thread


class _Plain(msgspec.Struct, forbid_unknown_fields=True, gc=False):
    """The usual form of a case; any other form is read again on the general path."""

    mu0: _Positive
    Fz: _Positive
    k: _Positive | None
    y0: _NotNegative
    v0: _NotNegative
    omega: _NotNegative | None = None
    f: Annotated[float, msgspec.Meta(ge=0.0, le=MOST_HZ)] | None = None
    include: Annotated[list[_Quick], msgspec.Meta(max_length=MAX_INCLUDE)] | None = None
    tolerance: _Positive | None = None


_decode = msgspec.json.Decoder(_Plain).decode


def _read(text: bytes) -> _Plain | None:
    try:
        case = _decode(text)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None
    # No string of a plain case has a colon: more colons than members mean a name given twice.
    members = 6 + (case.include is not None) + (case.tolerance is not None)
    return case if text.count(b":") == members and (case.omega is None) != (case.f is None) else None


def _inputs(case: _Plain) -> tuple[float, float, float, float, float, float]:
    """The six inputs in the order of FIELDS; k = inf is rigid contact."""
    omega = case.omega if case.omega is not None else RAD_PER_CYCLE * (case.f or 0.0)
    return case.mu0, case.Fz, math.inf if case.k is None else case.k, case.y0, omega, case.v0


class SingleCase:
    """Middleware: ``POST`` and ``GET /v1/mu-macro`` for one plain case."""

    def __init__(
        self, app: ASGIApp, tables: Tables, settings: Settings, metrics: Metrics, log: AccessLog, keys: Keys
    ) -> None:
        self.app = app
        self.answered = 0  # number of requests answered here
        self._tables, self._metrics, self._log, self._keys = tables, metrics, log, keys
        self._kept = [(name.encode("ascii"), value.encode("ascii")) for name, value in cache_fields(settings).items()]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or pass the unchanged request on."""
        started = time.perf_counter()
        if scope["type"] != "http" or path_of(scope) != CASE_PATH:
            await self.app(scope, receive, send)
            return
        method = scope["method"]
        headers: dict[bytes, bytes] = dict(scope["headers"])
        holder = self._keys.holder(headers) if self._keys else None
        reply, message = None, None
        if (holder is not None or not self._keys) and self._is_plain(scope, headers):
            text = scope["query_string"]
            if method == "POST":
                message = await receive()
                text = message.get("body", b"") if not message.get("more_body") else b""
            try:
                reply = self._get(text) if method == "GET" else self._post(text)
            except Exception:
                reply = None  # the general path raises the same error; RequestRecord logs and answers it
        if reply is None:
            await self.app(scope, receive if message is None else _again(message, receive), send)
            return
        self.answered += 1
        content, fields = reply
        identity = accept_request_id(headers.get(b"x-request-id"))
        fields += (
            _TYPE, NOSNIFF, (b"content-length", b"%d" % len(content)), (b"x-request-id", identity.encode("ascii")),
        )  # fmt: skip
        await send({"type": "http.response.start", "status": 200, "headers": fields})
        await send({"type": "http.response.body", "body": content})
        seconds = time.perf_counter() - started
        self._metrics.count(CASE_PATH, method, 200, seconds)
        client = scope.get("client")
        self._log.write(identity, method, CASE_PATH, 200, seconds, client[0] if client else None, holder)

    def _is_plain(self, scope: Scope, headers: dict[bytes, bytes]) -> bool:
        """Whether the head of a request allows the fast path."""
        if (
            len(headers) != len(scope["headers"])
            or b"upgrade" in headers
            or self._tables.fault is not None
            or self._tables.draining
        ):
            return False
        if scope["method"] == "GET":
            return b"if-none-match" not in headers and b"text/" not in headers.get(b"accept", b"")
        return (
            scope["method"] == "POST"
            and 0 < len(headers.get(b"content-length", b"")) < _MANY
            and headers.get(b"content-type", b"application/json") in _JSON
            and not scope["query_string"]
            and b"content-encoding" not in headers
        )

    def _post(self, body: bytes) -> tuple[bytes, list[tuple[bytes, bytes]]] | None:
        case = _read(body)
        table = None if case is None else self._table(case)
        if case is None or table is None:
            return None
        if not case.include:
            values, source = default_answer(table, _inputs(case))
        elif self._tables.warm:
            values, source = answer_case(table, _inputs(case), canonical(case.include))
        else:
            return None  # loading takes long: in a thread, on the general path
        return self._written(table, values, source), []

    def _get(self, query: bytes) -> tuple[bytes, list[tuple[bytes, bytes]]] | None:
        # A query of plain numbers becomes a JSON object by replacing "=" and "&".  Any other query has a character
        # that is refused here, or is not valid JSON after the replacement.
        if query.translate(None, _PLAIN_QUERY):
            return None
        case = _read(b'{"' + query.replace(b"=", b'":').replace(b"&", b',"') + b"}")
        table = None if case is None else self._table(case)
        if case is None or table is None or case.k is None:  # a query has no null
            return None
        inputs = _inputs(case)
        values, source = default_answer(table, inputs)
        etag = case_etag(table, inputs, (), None)
        return self._written(table, values, source), [(b"etag", etag.encode("ascii")), *self._kept]

    def _table(self, case: _Plain) -> LoadedTable | None:
        if case.tolerance is None:
            return self._tables.loaded[0]
        try:
            return self._tables.pick(case.tolerance)
        except InvalidFieldsError:
            return None

    def _written(self, table: LoadedTable, values: dict[str, object], source: int) -> bytes:
        values["table"] = table.fragment
        values["api_version"] = API_VERSION
        self._metrics.cells[table.cell + source] += 1.0
        return orjson.dumps(values)


def _again(message: Message, receive: Receive) -> Receive:
    """A ``receive`` that returns the given message first."""
    first: Message | None = message

    async def receive_again() -> Message:
        nonlocal first
        if first is not None:
            taken, first = first, None
            return taken
        return await receive()

    return receive_again
