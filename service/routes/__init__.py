"""The endpoints.  Each is a function from a request to a response, and a record of what OpenAPI says of it.

Starlette routes call them directly: the form of a request is checked by :mod:`service.case`, and what is refused is
raised.
"""

import gzip
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

from pydantic import BaseModel
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.types import Message, Receive, Scope, Send

from mumacro.inputs import NAMES as INPUTS

from ..case import split_names
from ..limits import SMALL_BODY, Work, media_type_of, read_body, wants_gzip
from ..problems import FieldFault, MalformedBodyError, refuse
from ..tables import Tables
from ..wire.json import decode

__all__ = [
    "JSON", "Endpoint", "Routes", "file_answer", "given_in_body", "given_in_query", "path_of", "reply",
    "tables_of", "work_of",
]  # fmt: skip

JSON = "application/json"
_JSON_ONLY = {JSON: JSON}
_COMPRESS_FROM = 16 * 1024  # bytes


@dataclass(frozen=True)
class Endpoint:
    """One path and method, and its description.

    Attributes
    ----------
    path, method : str
        ``GET`` answers ``HEAD``, too.
    answer : callable
        From a request to a response; what it raises becomes a problem document.
    name, summary : str
        The operation's id and its title in OpenAPI; without a name it is not described.
    query, body, model : type of BaseModel, optional
        The forms of the query, the body and the answer.
    statuses : tuple of int
        Of the problems that it can give.
    content : mapping
        Further descriptions of the answer, by status.
    request : mapping, optional
        The description of a body that is no model.
    open : bool
        Whether it needs no API key.
    """

    path: str
    method: str
    answer: Callable[[Request], Awaitable[Response]]
    name: str = ""
    summary: str = ""
    query: type[BaseModel] | None = None
    body: type[BaseModel] | None = None
    model: Any = None
    statuses: tuple[int, ...] = ()
    content: Mapping[int, Any] = field(default_factory=dict)
    request: Mapping[str, Any] | None = None
    tag: str = "answers"
    open: bool = False


class Routes:
    """The application inside the middleware: finds the endpoint of a path and a method, and answers.

    Paths have no parameters, so a look-up finds them.
    """

    def __init__(self, endpoints: Iterable[Endpoint]) -> None:
        self._found: dict[str, dict[str, Endpoint]] = {}
        for endpoint in endpoints:
            methods = self._found.setdefault(endpoint.path, {})
            methods[endpoint.method] = endpoint
            if endpoint.method == "GET":
                methods["HEAD"] = endpoint

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        methods = self._found.get(path_of(scope)) if scope["type"] == "http" else None
        if methods is None:
            raise HTTPException(404, "There is nothing at this path.")
        endpoint = methods.get(scope["method"])
        if endpoint is None:
            allowed = ", ".join(sorted(methods))
            detail = f"{scope['method'][:20]} is not allowed here; allowed: {allowed}"
            raise HTTPException(405, detail, headers={"Allow": allowed})
        response = await endpoint.answer(Request(scope, receive, send))
        await response(scope, receive, send)


def path_of(scope: Scope) -> str:
    """The path within this application: without the prefix of a proxy."""
    path: str = scope["path"]
    root: str = scope.get("root_path", "")
    return path.removeprefix(root) if root else path


def tables_of(request: Request) -> Tables:
    """The tables of the application that the request came to."""
    tables: Tables = request.app.state.tables
    return tables


def work_of(request: Request) -> Work:
    """The slots and threads of the application that the request came to."""
    work: Work = request.app.state.work
    return work


def reply(
    content: bytes, headers: Mapping[str, str] | None = None, media_type: str = JSON, request: Request | None = None
) -> Response:
    """A complete answer; a large one to ``request`` is compressed if that accepts gzip, so this runs in a thread."""
    if request is not None and len(content) >= _COMPRESS_FROM:
        headers = {**(headers or {}), "Vary": "Accept-Encoding"}
        if wants_gzip(request.headers.get("accept-encoding", "")):
            content = gzip.compress(content, 1)
            headers["Content-Encoding"] = "gzip"
    return Response(content, headers=headers, media_type=media_type)


async def given_in_body(request: Request) -> dict[str, Any]:
    """The members of a small JSON body.

    Raises
    ------
    UnsupportedBodyError, BodyTooLargeError, MalformedBodyError, InvalidFieldsError
    """
    headers = dict(request.scope["headers"])
    media_type_of(headers, _JSON_ONLY)
    limit = min(SMALL_BODY, request.app.state.settings.max_body_bytes)
    found = decode(await read_body(headers, request.receive, limit))
    if not isinstance(found, dict):
        refuse([FieldFault((), "must be a JSON object", found)])
    if request.scope["query_string"]:
        pairs = parse_qsl(request.scope["query_string"].decode("latin-1"), keep_blank_values=True)
        refuse([FieldFault((name,), "belongs in the body", value, parameter=True) for name, value in pairs[:100]])
    return found


def given_in_query(request: Request) -> dict[str, Any]:
    """The members of a query, as a body has them: numbers as numbers, ``std_mu0`` within ``std``.

    Raises
    ------
    InvalidFieldsError
        A name is given twice.
    """
    text = request.scope["query_string"].decode("latin-1")
    try:
        pairs = parse_qsl(text, keep_blank_values=True, errors="strict", max_num_fields=1000)
    except (ValueError, UnicodeDecodeError) as error:
        raise MalformedBodyError(f"the query cannot be read: {error}") from None
    found: dict[str, Any] = {}
    names: list[str] = []
    twice = []
    for name, value in pairs:
        inner = name.removeprefix("std_")
        if name == "include":
            names.append(value)
        elif inner != name and inner in INPUTS:
            if found.setdefault("std", {}).setdefault(inner, number := _number(value)) is not number:
                twice.append(name)
        elif name in found:
            twice.append(name)
        else:
            found[name] = _number(value)
    if twice:
        refuse([FieldFault.of(name, "is given more than once") for name in dict.fromkeys(twice)])
    if names:
        found["include"] = split_names(names)
    return found


def _number(text: str) -> Any:
    """A number where the text is one, else the text; an unescaped "+" of a query arrives as a space."""
    if text.strip("0123456789.eE+- ") == "":
        try:
            number = float(text.replace("e ", "e+").replace("E ", "E+"))
        except ValueError:
            return text
        return int(number) if number.is_integer() and text.isdigit() and len(text) < 16 else number
    return text


class _File(FileResponse):
    """A file, or a part of it; a range outside the file is answered with problem details."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_checked(message: Message) -> None:
            if message["type"] == "http.response.start":
                if message["status"] == 416:
                    size = self.headers["content-length"]
                    raise HTTPException(416, f"the file has {size} bytes", headers={"Content-Range": f"bytes */{size}"})
                if message["status"] == 400:
                    raise HTTPException(400, "Range must be such as bytes=0-99, first <= last")
            await send(message)

        await super().__call__(scope, receive, send_checked)


def file_answer(request: Request, path: Path, headers: Mapping[str, str], **options: Any) -> Response:
    """A file, the part of it that Range requests, or 304 if the client has it already.

    The ETag is that of the headers, or is made from the size and the modification time.

    Raises
    ------
    OSError
        The file is gone.
    """
    answer = _File(path, headers=headers, stat_result=path.stat(), **options)
    etag = answer.headers["etag"]
    offered = request.headers.get("if-none-match")
    if offered is not None and (
        offered.strip() == "*" or etag in (part.strip().removeprefix("W/") for part in offered.split(","))
    ):
        return Response(status_code=304, headers={**headers, "ETag": etag})
    return answer
