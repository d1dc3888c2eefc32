"""The short way: one good case is answered ahead of the router, inside the middleware stack.

Whatever is not plainly good - a fault, a condition, an odd header - goes on to the router, whose routes read the same
request with the same model and find the words for it.  So there is one definition of what is right, in schemas.py, and
every refusal is written in one place.
"""

import orjson
from pydantic import ValidationError
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from . import API_VERSION
from .errors import InvalidFieldsError
from .evaluation import answer_case, case_etag, default_answer
from .guard import CASE_PATH, path_of
from .metrics import Metrics
from .schemas import RequestFields
from .settings import Settings, cache_fields
from .tables import LoadedTable, Tables

__all__ = ["SingleCase"]

_MANY = 4  # digits of a Content-Length that no single case has
_JSON = frozenset({b"application/json", b"application/json; charset=utf-8", b"application/json;charset=utf-8"})
_PLAIN_QUERY = b"0123456789.eE+-=&" + "".join(sorted(set("mu0Fzky0omegafv0tolerance"))).encode()
_validate = RequestFields.__pydantic_validator__.validate_json
_TYPE = (b"content-type", b"application/json")


class SingleCase:
    """Middleware: ``POST`` and ``GET /v1/mu-macro`` for one good case."""

    def __init__(self, app: ASGIApp, tables: Tables, settings: Settings, metrics: Metrics) -> None:
        self.app = app
        self.answered = 0  # how many went this way
        self._tables = tables
        self._metrics = metrics
        self._kept = [(name.encode("ascii"), value.encode("ascii")) for name, value in cache_fields(settings).items()]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or hand the request on with nothing taken from it."""
        if scope["type"] != "http" or path_of(scope) != CASE_PATH or self._tables.fault is not None:
            await self.app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        reply = None
        if scope["method"] == "GET":
            if b"if-none-match" not in headers and b"text/" not in headers.get(b"accept", b""):
                reply = self._get(scope["query_string"])
        elif scope["method"] == "POST" and _is_short(scope, headers):
            message = await receive()
            receive = _again(message, receive)
            if message["type"] == "http.request" and not message.get("more_body"):
                reply = self._post(message.get("body", b""))
        if reply is None:
            await self.app(scope, receive, send)
            return
        self.answered += 1
        content, fields = reply
        fields = [(b"content-length", b"%d" % len(content)), _TYPE, *fields]
        await send({"type": "http.response.start", "status": 200, "headers": fields})
        await send({"type": "http.response.body", "body": content})

    def _post(self, body: bytes) -> tuple[bytes, list[tuple[bytes, bytes]]] | None:
        try:
            case = _validate(body)
        except ValidationError:
            return None
        table = self._table(case)
        if table is None or case.fault() is not None:
            return None
        if case.include:
            if not self._tables.warm or "std" in case.include:
                return None  # in a thread: what is not loaded yet, or takes its time
            values, source = answer_case(table, case)
        else:
            values, source = default_answer(table, case.inputs())
        return self._written(table, values, source), []

    def _get(self, query: bytes) -> tuple[bytes, list[tuple[bytes, bytes]]] | None:
        # A query of plain numbers is a JSON object in another spelling.  Anything that JSON, or a query, spells
        # in its own way has a character or a word that is not let through here, or is no JSON after this.
        if query.translate(None, _PLAIN_QUERY):
            return None
        try:
            case = _validate(b'{"' + query.replace(b"=", b'":').replace(b"&", b',"') + b"}")
        except ValidationError:
            return None
        # fewer fields than names: one is given twice
        if len(case.model_fields_set) != query.count(b"&") + 1 or case.k is None or case.fault() is not None:
            return None
        table = self._table(case)
        if table is None:
            return None
        inputs = case.inputs()
        values, source = default_answer(table, inputs)
        etag = case_etag(table, inputs, (), None)
        return self._written(table, values, source), [(b"etag", etag.encode("ascii")), *self._kept]

    def _table(self, case: RequestFields) -> LoadedTable | None:
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


def _is_short(scope: Scope, headers: dict[bytes, bytes]) -> bool:
    """Whether the head of a request promises one case, plainly put."""
    return (
        0 < len(headers.get(b"content-length", b"")) < _MANY
        and headers.get(b"content-type", b"application/json") in _JSON
        and not scope["query_string"]
        and b"content-encoding" not in headers
    )


def _again(message: Message, receive: Receive) -> Receive:
    """A ``receive`` that gives once more what was taken."""
    first: Message | None = message

    async def receive_again() -> Message:
        nonlocal first
        if first is not None:
            taken, first = first, None
            return taken
        return await receive()

    return receive_again
