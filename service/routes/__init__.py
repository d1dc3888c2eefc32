"""The endpoints, and the dependencies that they share."""

import json
from collections.abc import Callable, Coroutine, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fastapi.routing import APIRoute
from pydantic import ValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.types import Message, Receive, Scope, Send

from ..errors import FieldFault, faults_of, names_at, refusal, repeated
from ..formats import unique_names

__all__ = ["JsonRoute", "etag_matches", "file_answer", "no_query", "once_each", "parameters_of"]


class _Once(Request):
    """A request whose JSON has no name twice."""

    async def json(self) -> Any:
        """Decode the body."""
        return json.loads(await self.body(), object_pairs_hook=unique_names)


class JsonRoute(APIRoute):
    """Refuses a body in which an object has a name twice."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The usual handler of such a request."""
        usual = super().get_route_handler()

        async def answer(request: Request) -> Response:
            return await usual(_Once(request.scope, request.receive))

        return answer


async def no_query(request: Request) -> None:
    """Refuse a query where there is a body."""
    if request.scope["query_string"]:
        pairs = request.query_params.multi_items()[:100]
        faults = [FieldFault(name, "belongs in the body", text, place="parameter") for name, text in pairs]
        if faults:
            raise refusal(faults)


async def once_each(request: Request) -> None:
    """Refuse parameters that are given more than once; ``include`` may be."""
    if request.scope["query_string"]:
        faults = repeated((name for name, _ in request.query_params.multi_items() if name != "include"), "parameter")
        if faults:
            raise refusal(faults)


@contextmanager
def parameters_of(path: str) -> Iterator[None]:
    """Report the errors of a model as faults of the query of that path."""
    try:
        yield
    except ValidationError as error:
        entries = error.errors(include_url=False)
        raise refusal(faults_of(entries, "parameter", names_at(path))) from None


def etag_matches(request: Request, etag: str) -> bool:
    """Whether the client has this answer already (If-None-Match, weak comparison)."""
    offered = request.headers.get("if-none-match")
    if offered is None:
        return False
    return offered.strip() == "*" or etag in (part.strip().removeprefix("W/") for part in offered.split(","))


class _File(FileResponse):
    """A file, or a part of it; a range outside the file is answered with problem details."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_checked(message: Message) -> None:
            if message["type"] == "http.response.start":
                if message["status"] == 416:
                    size = self.headers["content-length"]
                    headers = {"Content-Range": f"bytes */{size}"}
                    raise HTTPException(416, f"the file has {size} bytes", headers=headers)
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
    if etag_matches(request, etag):
        return Response(status_code=304, headers={**headers, "ETag": etag})
    return answer
