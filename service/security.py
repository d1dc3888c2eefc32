"""Check API keys and the headers of a request, with two middlewares in front of every path."""

import secrets
from collections.abc import Iterable, Mapping

from starlette.types import ASGIApp, Receive, Scope, Send

from .problems import FULL, ProblemKind, RequestError, path_in

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
