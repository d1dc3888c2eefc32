"""The endpoints.  Each is a function from a request to a response, and a record of what OpenAPI
says of it.

FastAPI describes them; requests reach them through a look-up (:class:`Routes`): FastAPI's layers
take longer than an answer.  What is refused is raised, see :mod:`service.problems`.
"""

import inspect
import string
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, NamedTuple
from urllib.parse import parse_qsl

from fastapi import Body, FastAPI, Query
from pydantic import BaseModel
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.types import Message, Receive, Scope, Send

from ..answers import Wanted
from ..case import asked_of, checked
from ..limits import SMALL_BODY, form_of, read_body
from ..options import NAMES, Options, kind_in, names_in, options_of, query_of
from ..problems import FieldFault, Kind, RequestError, refuse
from ..tables import LoadedTable, Tables
from ..wire.json import decode

_JSON = "application/json"
_TITLES = {
    code: "; ".join(kind.title for kind in Kind if kind.status == code)
    for code in {k.status for k in Kind}
}
# of a query that needs no decoding
_PLAIN = f"{string.ascii_letters}{string.digits}.-_,=&".encode()
_PROBLEM = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
_ID = {
    "X-Request-ID": {"description": "The request's id, as in the log", "schema": {"type": "string"}}
}
_RETRY = {
    "description": "Seconds after which to send the request again",
    "schema": {"type": "integer"},
}
_STD = frozenset(f"std_{name}" for name in NAMES)


Answer = Callable[[Request], Awaitable[Response]]


@dataclass(frozen=True)
class Endpoint:
    """One path and method, and its description; without a summary it is not described."""

    path: str
    method: str  # GET answers HEAD, too
    answer: Answer  # its name is the operation's id
    summary: str = ""
    # what is asked: a body; of GET, and beside a ``request``, its query
    form: type[BaseModel] | None = None
    model: Any = None  # of the answer
    statuses: tuple[int, ...] = ()  # of the problems that it can give, beside those of its kind
    # further descriptions of answers, by status
    content: Mapping[int | str, Any] = field(default_factory=dict)
    request: Mapping[str, Any] | None = None  # the description of a body that is no model
    tag: str = "answers"
    open: bool = False  # whether it needs no API key

    def describe_to(self, app: FastAPI) -> None:
        """Add the route to an application, with its description."""
        post = self.method == "POST"
        asked: dict[str, Any] = {"request": Request}
        if self.form is not None and post and self.request is None:
            asked["body"] = Annotated[self.form, Body()]
        elif self.form is not None:
            asked["query"] = Annotated[query_of(self.form), Query()]
        statuses = {
            *self.statuses,
            *(() if self.open else (401, 503)),
            *((400, 422) if self.form else ()),
        }
        statuses |= {408, 413, 415} if post else set()
        responses: dict[int | str, dict[str, Any]] = {200: {}, **self.content}
        responses |= {
            code: {"description": _TITLES[code], "content": _PROBLEM} for code in sorted(statuses)
        }
        for code, response in responses.items():
            headers = {
                **response.get("headers", {}),
                **_ID,
                **({"Retry-After": _RETRY} if code == 503 else {}),
            }
            responses[code] = {**response, "headers": headers}

        async def answer(request: Request, **_: Any) -> Response:
            return await self.answer(request)

        answer.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [
                inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=asked[name])
                for name in asked
            ]
        )
        app.add_api_route(
            self.path,
            answer,
            methods=[self.method],
            summary=self.summary,
            operation_id=self.answer.__name__,
            description=" ".join((self.answer.__doc__ or "").split()),
            tags=[self.tag],
            responses=responses,
            response_model=self.model,
            response_class=JSONResponse if self.model else Response,
            response_description="The answer",
            include_in_schema=bool(self.summary),
            openapi_extra={"requestBody": self.request} if self.request else None,
        )


class Routes(dict[str, dict[str, Answer]]):
    """The functions that answer, by path, which has no parameters, and by method."""

    def __init__(self, endpoints: Iterable[Endpoint]) -> None:
        for endpoint in endpoints:
            methods = ("GET", "HEAD") if endpoint.method == "GET" else (endpoint.method,)
            self.setdefault(endpoint.path, {}).update(dict.fromkeys(methods, endpoint.answer))

    def find(self, path: str, method: str) -> Answer | None:
        """The function that answers; None for a path of no endpoint."""
        methods = self.get(path)
        if methods is None:
            return None
        if method in methods:
            return methods[method]
        allowed = ", ".join(sorted(methods))
        raise HTTPException(
            405, f"{method[:20]} is not allowed here; allowed: {allowed}", {"Allow": allowed}
        )


# --- requests -------------------------------------------------------------------------------------


class Asking(NamedTuple):
    """What a request asks: the table, the options, the case, and what is asked of it."""

    table: LoadedTable
    form: Any
    case: dict[str, Any]
    wanted: Wanted

    @classmethod
    async def of(
        cls, request: Request, model: type[Options], wanted: str = "", one: bool = False
    ) -> "Asking":
        """Read and check a request; the option ``wanted`` names the input that is asked for."""
        given = (
            await given_in_body(request)
            if request.scope["method"] == "POST"
            else given_in_query(request)
        )
        name = wanted and given.get(wanted, model.model_fields[wanted].default)
        left_out = [name] if name in NAMES else []
        if name == "Fz" and given.get(name) is not None:  # the load at which k holds
            left_out = []
        return cls.made(request.app.tables, model, given, left_out, one=one)

    @classmethod
    def made(
        cls,
        tables: Tables,
        model: Any,
        given: Mapping[str, Any],
        left_out: Sequence[str] = (),
        one: bool = False,
    ) -> "Asking":
        """Check what is given; ``left_out`` are the inputs that are asked for, of which a null says
        the same."""
        form, rest, faults = options_of(model, given)
        if left_out:
            rest = {
                name: value
                for name, value in rest.items()
                if value is not None or name not in left_out
            }
        asked = asked_of(rest, form.kind if form is not None else kind_in(given))
        values, more = checked(rest, left_out, names_in(model)[1], asked)
        if form is None or more:
            refuse([*faults, *more])
        return cls(tables.pick(form.tolerance), form, values, form.wanted(asked, one))


async def given_in_body(request: Request) -> dict[str, Any]:
    """The members of a small JSON body."""
    headers = dict(request.scope["headers"])
    if headers.get(b"content-type") != b"application/json" or b"content-encoding" in headers:
        form_of(headers, {_JSON: _JSON})
    limit = min(SMALL_BODY, request.app.settings.max_body_bytes)
    found = decode(await read_body(headers, request.receive, limit))
    if not isinstance(found, dict):
        refuse([FieldFault((), "must be a JSON object", found)])
    if query := request.scope["query_string"]:
        pairs = _pairs(query)[:100]
        refuse(
            [
                FieldFault((name,), "belongs in the body", value, parameter=True)
                for name, value in pairs
            ]
        )
    return found


def given_in_query(request: Request) -> dict[str, Any]:
    """The members of a query, as a body has them: numbers as numbers, ``std_mu0`` within
    ``std``."""
    found: dict[str, Any] = {}
    names: list[str] = []
    twice: dict[str, None] = {}
    for name, value in _pairs(request.scope["query_string"]):
        place, inner = (found.setdefault("std", {}), name[4:]) if name in _STD else (found, name)
        if name == "include":
            names.append(value)
        elif inner in place:
            twice[name] = None
        elif name == "k" and ".." in value:
            place["k_range"] = [_number(end) for end in value.split("..")]
        else:
            place[inner] = _number(value)
    if twice:
        refuse([FieldFault((name,), "is given more than once", parameter=True) for name in twice])
    if names:
        found["include"] = [part.strip() for name in names for part in name.split(",")]
    return found


def _pairs(query: bytes) -> list[tuple[str, str]]:
    """Names and values of a query."""
    text = query.decode("latin-1")
    # what urllib would take longer to find
    if not query.translate(None, _PLAIN) and query.count(b"&") < 100:
        pairs = (pair.partition("=") for pair in text.split("&") if pair)
        return [(name, value) for name, _, value in pairs]
    try:
        return parse_qsl(text, keep_blank_values=True, errors="strict", max_num_fields=1000)
    except (ValueError, UnicodeDecodeError) as error:
        raise RequestError(Kind.MALFORMED_BODY, f"the query cannot be read: {error}") from None


def _number(text: str) -> Any:
    """A number where the text is one, else the text; an unescaped "+" of a query arrives as a
    space."""
    if text.strip("0123456789.eE+- ") == "":
        try:
            number = float(text.replace("e ", "e+").replace("E ", "E+"))
        except ValueError:
            return text
        return int(number) if text.isdigit() and len(text) < 16 else number
    return text


# --- responses ------------------------------------------------------------------------------------


class Reply(Response):
    """A complete answer; Starlette's own looks for what the headers may lack, which takes as long
    as a case."""

    def __init__(
        self, content: bytes, headers: Mapping[str, str] | None = None, media_type: str = _JSON
    ) -> None:
        self.status_code, self.body, self.background = 200, content, None
        self.raw_headers = [
            (b"content-length", b"%d" % len(content)),
            (b"content-type", media_type.encode()),
        ]
        self.raw_headers += [
            (name.lower().encode(), value.encode()) for name, value in (headers or {}).items()
        ]

    async def __call__(self, _scope: Scope, _receive: Receive, send: Send) -> None:
        """Send head and body."""
        await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
        await send({"type": "http.response.body", "body": self.body})


async def in_thread(request: Request, work: Callable[[], Response]) -> Response:
    """The answer to the question of a person, made in a thread."""
    answer: Response = await request.app.work.question(work)
    return answer


def question(model: type[Options], wanted: str) -> Callable[[Callable[[Asking], Response]], Answer]:
    """Makes the function of a question about the input that the option ``wanted`` names an
    endpoint's."""

    def made(work: Callable[[Asking], Response]) -> Answer:
        @wraps(work)
        async def answer(request: Request) -> Response:
            found = await Asking.of(request, model, wanted)
            return await in_thread(request, lambda: work(found))

        return answer

    return made


class _File(FileResponse):
    """A file, or a part of it; a range outside the file is answered with problem details."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        size = self.headers["content-length"]

        async def send_checked(message: Message) -> None:
            if message.get("status") == 416:
                raise HTTPException(
                    416, f"the file has {size} bytes", {"Content-Range": f"bytes */{size}"}
                )
            if message.get("status") == 400:
                raise HTTPException(400, "Range must be such as bytes=0-99, first <= last")
            await send(message)

        await super().__call__(scope, receive, send_checked)


def file_answer(
    request: Request, path: Path, headers: Mapping[str, str], **options: Any
) -> Response:
    """A file, the part of it that Range requests, or 304 if the client has it already; OSError if
    it is gone.

    The ETag is that of the headers, or is made from the size and the modification time.
    """
    answer = _File(path, headers=headers, stat_result=path.stat(), **options)
    etag = answer.headers["etag"]
    offered = [
        part.strip().removeprefix("W/")
        for part in request.headers.get("if-none-match", "").split(",")
    ]
    if etag in offered or "*" in offered:
        return Response(status_code=304, headers={**headers, "ETag": etag})
    return answer
