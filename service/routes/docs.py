"""The interface's description as ``/openapi.json``, and in a browser at ``/docs`` with assets of this package only."""

from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from . import Endpoint, file_answer, in_thread, reply
from .page import asset

_FOLDER = Path(__file__).resolve().parent.parent / "static" / "swagger-ui"
ASSETS = {
    "swagger-ui-bundle.js": "text/javascript", "swagger-ui.css": "text/css", "start.js": "text/javascript",
    "docs.css": "text/css",
}  # fmt: skip
# Inline styles are allowed: the interface sets some on its elements.  Everything else comes from this host only.
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


def _age(name: str) -> dict[str, str]:
    """What is vendored changes with its version only."""
    return {"Cache-Control": "public, max-age=86400" if name.startswith("swagger-ui") else "no-cache"}


async def _docs(request: Request) -> Response:
    headers = {"Content-Security-Policy": _POLICY, "Referrer-Policy": "no-referrer", "Cache-Control": "no-cache"}
    return file_answer(request, _FOLDER / "index.html", headers, media_type="text/html")


async def _description(request: Request) -> Response:
    return await in_thread(request, lambda: reply(request.app.described))


ENDPOINTS = [
    Endpoint("/docs", "GET", _docs, open=True),
    Endpoint("/openapi.json", "GET", _description),
    *(asset(_FOLDER / name, kind, f"/static/swagger-ui/{name}", _age(name)) for name, kind in ASSETS.items()),
]
