"""The interface's description as ``/openapi.json``, and in a browser at ``/docs`` with assets of this package only."""

from pathlib import Path

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from . import file_answer

__all__ = ["ASSETS", "OPEN_PATHS", "router"]

router = APIRouter(include_in_schema=False)

_FOLDER = Path(__file__).resolve().parent.parent / "static" / "swagger-ui"
ASSETS = {
    "swagger-ui-bundle.js": "text/javascript", "swagger-ui.css": "text/css", "start.js": "text/javascript",
    "docs.css": "text/css",
}  # fmt: skip
#: paths without an API key: the page and its parts; /openapi.json needs the key
OPEN_PATHS = frozenset({"/docs", *(f"/static/swagger-ui/{name}" for name in ASSETS)})

# Inline styles are allowed: the interface sets some on its elements.  Everything else comes from this host only.
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


@router.head("/docs")
@router.get("/docs")
async def docs(request: Request) -> Response:
    """Return the page."""
    headers = {"Content-Security-Policy": _POLICY, "Referrer-Policy": "no-referrer", "Cache-Control": "no-cache"}
    return file_answer(request, _FOLDER / "index.html", headers, media_type="text/html")


@router.head("/openapi.json")
@router.get("/openapi.json")
def description(request: Request) -> Response:
    """Return the description.  In a thread, unlike the framework's own route: the first time takes half a second."""
    return JSONResponse(request.app.openapi())


def _add_asset(name: str, media_type: str) -> None:
    vendored = name.startswith("swagger-ui")  # changes with its version only
    headers = {"Cache-Control": "public, max-age=86400" if vendored else "no-cache"}

    async def asset(request: Request) -> Response:
        return file_answer(request, _FOLDER / name, headers, media_type=media_type)

    router.add_api_route(f"/static/swagger-ui/{name}", asset, methods=["GET", "HEAD"], name=name)


for _name, _media_type in ASSETS.items():
    _add_asset(_name, _media_type)
