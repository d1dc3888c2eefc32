"""Let a request pass on its way to an endpoint, through these middlewares from the first to the
last; :class:`~service.observe.Observe` is in front of them."""

import logging
import secrets
from collections.abc import Iterable, Mapping

from fastapi import Request
from starlette.requests import ClientDisconnect
from starlette.routing import BaseRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .bodies import DirectRoute
from .problems import (
    FULL,
    STATUS,
    TICKET,
    ProblemKind,
    RequestError,
    meaning,
    path_in,
    problem_of,
)

#: the two ways to send a key, as OpenAPI names them
SCHEMES = {
    "key": {"type": "apiKey", "in": "header", "name": "X-API-Key"},
    "bearer": {"type": "http", "scheme": "bearer"},
}
HEALTH_PATHS = frozenset({"/livez", "/readyz", "/healthz"})
NOSNIFF = (b"x-content-type-options", b"nosniff")
_ONCE = (
    b"host",
    b"x-api-key",
    b"authorization",
    b"content-type",
    b"content-encoding",
    b"transfer-encoding",
    b"x-request-id",
)
_log = logging.getLogger("mumacro.error")


class HeadAsGet:
    """Answer HEAD as GET, without the body (middleware)."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return

        async def send_head(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
                # at once, because the client may already send its next request
                await send({"type": "http.response.body", "body": b""})

        await self._app({**scope, "method": "GET"}, receive, send_head)


class Failures:
    """Convert every exception to a problem document (middleware), and give back what the request
    holds.  An unexpected exception goes to the log."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        try:
            await self._app(scope, receive, send)
        except ClientDisconnect:
            raise
        except Exception as error:
            _log_unexpected(error, scope)
            # an answer that has begun ends with its connection, without its end
            if STATUS in scope["state"]:
                raise ClientDisconnect from error
            try:
                answer = problem_of(meaning(error, scope), scope)
            except Exception as fault:  # such as a detail that JSON cannot hold
                _log_unexpected(fault, scope)
                answer = problem_of(meaning(fault, scope), scope)
            await answer(scope, receive, send)
        finally:
            if ticket := scope.get(TICKET):
                ticket.hold(0)
                ticket.leave()


def _log_unexpected(error: Exception, scope: Scope) -> None:
    if meaning(error, scope).kind is ProblemKind.UNEXPECTED:
        fields = {"request_id": scope.get("request_id"), "path": scope["path"]}
        _log.error("unexpected error", exc_info=error, extra={"fields": fields})


class Entrance:
    """Refuse headers that contradict each other, and all but the probes on a connection beyond the
    limit (middleware)."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request pass if there is room for it and its headers are unambiguous."""
        if FULL in scope.get("state", ()) and path_in(scope) not in HEALTH_PATHS:
            raise RequestError(ProblemKind.OVERLOADED, "too many connections are open")
        fields = scope.get("headers", ())
        headers = dict(fields)
        if scope.get("http_version") == "1.1" and b"host" not in headers:
            raise RequestError(ProblemKind.MALFORMED_HTTP, "a request of HTTP/1.1 has one Host")
        if headers.get(b"transfer-encoding", b"chunked").lower().strip(b" \t,") != b"chunked":
            raise RequestError(ProblemKind.MALFORMED_HTTP, "the only transfer coding is chunked")
        if len(headers) != len(fields):
            names = [name for name, _ in fields]
            for name in _ONCE:
                if names.count(name) > 1:
                    detail = f"the header {name.decode()} is given more than once"
                    raise RequestError(ProblemKind.MALFORMED_HTTP, detail)
        await self._app(scope, receive, send)


class Keys:
    """Require a key for every path, except the paths in the list and those below ``/guide/``.

    A dependency of each router would leave a path open if somebody forgets it.
    """

    def __init__(self, app: ASGIApp, keys: Mapping[str, str], open_paths: Iterable[str]) -> None:
        self._app, self._keys, self._open = app, keys, frozenset(open_paths)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request with a known key pass; the name of the key's holder goes into the log."""
        if scope["type"] == "http":
            path = path_in(scope)
            if path not in self._open and not path.startswith("/guide/"):
                scope["key_holder"] = self._holder(dict(scope["headers"]))
        await self._app(scope, receive, send)

    def _holder(self, headers: Mapping[bytes, bytes]) -> str:
        candidate = headers.get(b"x-api-key")
        if candidate is None:
            scheme, _, credentials = headers.get(b"authorization", b"").partition(b" ")
            candidate = credentials if scheme.lower() == b"bearer" else b""
        candidate = candidate.strip()
        # compares all keys, so that the time does not depend on the key in the request
        names = [
            name
            for key, name in self._keys.items()
            if secrets.compare_digest(candidate, key.encode("ascii"))
        ]
        if not names:
            detail = "send the API key as X-API-Key or as Authorization: Bearer"
            headers_back = {"WWW-Authenticate": "Bearer"}
            raise RequestError(ProblemKind.UNAUTHORIZED, detail, headers=headers_back)
        return names[0]


class Direct:
    """Send a request for a :class:`DirectRoute` directly to its handler (middleware).  All other
    requests, and other methods, go to the router."""

    def __init__(self, app: ASGIApp, routes: Iterable[BaseRoute]) -> None:
        self._app = app
        self._handlers = {
            (method, route.path): route.get_route_handler()
            for route in routes
            if isinstance(route, DirectRoute)
            for method in route.methods or ()
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        handler = scope["type"] == "http" and self._handlers.get((scope["method"], path_in(scope)))
        if not handler:
            await self._app(scope, receive, send)
            return
        answer = await handler(Request(scope, receive))
        await answer(scope, receive, send)
