"""``/``: the page.  It shows the map of all cases with the user's point on it, and the friction law."""

from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from mumacro.page import POLICY, map_of, names

from .. import __version__
from ..options import CaseRequest
from ..wire.json import dump
from . import Endpoint, file_answer, in_thread, reply

FOLDER = Path(__file__).resolve().parent.parent / "static" / "page"
_TYPES = {".js": "text/javascript", ".css": "text/css"}
ASSETS = {path.name: _TYPES[path.suffix] for path in sorted(FOLDER.iterdir()) if path.suffix in _TYPES}
_FRESH = {"Cache-Control": "no-cache"}
_SECURE = {"Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer", **_FRESH}


def asset(path: Path, media_type: str, url: str, headers: dict[str, str]) -> Endpoint:
    """The endpoint of a file; it holds no number of a table."""

    async def answer(request: Request) -> Response:
        return file_answer(request, path, headers, media_type=media_type)

    return Endpoint(url, "GET", answer, open=True)


async def _names(request: Request) -> Response:
    """The library's inputs, units and bounds, the geometries of a contact, and what this service can do."""
    guide = ["guide"] if request.app.settings.guide is not None else []
    paths = {getattr(route, "path", "").removeprefix("/v1/") for route in request.app.routes}
    panels = [name for name in ("stiffness", "fit") if name in paths]
    return reply(dump(names(["service", *CaseRequest.model_fields, *panels, *guide])), _FRESH)


async def _map(request: Request) -> Response:
    """The data of the map: mu~ on a grid, rows of constant y~ from below, and the border."""
    surrogate = request.app.tables.pick().surrogate
    etag = f'"{surrogate.checksum[:32]}-{__version__}"'
    headers = {"ETag": etag, **_FRESH}
    if etag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return await in_thread(request, lambda: reply(dump(map_of(surrogate)), headers))


ENDPOINTS = [
    asset(FOLDER / "index.html", "text/html", "/", _SECURE),
    Endpoint("/static/page/names.json", "GET", _names, open=True),
    Endpoint("/static/page/map.json", "GET", _map),
    *(asset(FOLDER / name, kind, f"/static/page/{name}", _FRESH) for name, kind in ASSETS.items()),
]
