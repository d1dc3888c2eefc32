"""Define the endpoints, one router for each topic."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse
from starlette.types import Message, Receive, Scope, Send

from ..bodies import DirectRoute
from ..problems import ProblemKind


def router_of(
    tag: str, route_class: type[APIRoute] = DirectRoute, prefix: str = "/v1"
) -> APIRouter:
    """Return a router whose operations have the names of their functions."""
    return APIRouter(
        prefix=prefix,
        tags=[tag],
        route_class=route_class,
        generate_unique_id_function=lambda route: route.name,
        strict_content_type=False,
    )


_PROBLEM = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
_ID = {
    "X-Request-ID": {"description": "The request's id, as in the log", "schema": {"type": "string"}}
}
_RETRY = {
    "Retry-After": {
        "description": "Seconds after which to send the request again",
        "schema": {"type": "integer"},
    }
}


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the descriptions of problems with these statuses, for ``responses``."""
    return {
        status: {
            "description": "; ".join(kind.title for kind in ProblemKind if kind.status == status),
            "content": _PROBLEM,
            "headers": _ID | (_RETRY if status == 503 else {}),
        }
        for status in statuses
    }


#: options of every question, in the query and in the body
GET_PROBLEMS = problems(400, 401, 422, 503)
POST_PROBLEMS = problems(400, 401, 408, 413, 415, 422, 503)


class _File(FileResponse):
    """Send a file, or a part of it; a range outside the file is answered with problem details."""

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


SMALL = 100_000  # bytes; the page's own files and libraries are smaller


def file_answer(
    request: Request, path: Path, headers: Mapping[str, str], **options: Any
) -> Response:
    """Return a file, the part of it that Range requests, or 304 if the client has it already.
    Raise OSError if it is gone.

    The ETag comes from the headers, or from the size and the modification time.
    """
    answer = _File(path, headers=headers, stat_result=path.stat(), **options)
    etag = answer.headers["etag"]
    etags = [
        part.strip().removeprefix("W/")
        for part in request.headers.get("if-none-match", "").split(",")
    ]
    if etag in etags or "*" in etags:
        return Response(status_code=304, headers={**headers, "ETag": etag})
    if int(answer.headers["content-length"]) > SMALL or "range" in request.headers:
        return answer
    # FileResponse uses the thread pool three times, which costs more than reading a small file
    return Response(path.read_bytes(), headers={**answer.headers}, **options)
