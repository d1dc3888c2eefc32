"""``/``: the page, a map of all cases with the user's point on it, and the friction law; ``/docs``:
the description.

What is served from files holds no number of a table and loads nothing from elsewhere.
"""

from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from mumacro.inputs.kind import SPRING, kind_of

from .. import __version__
from ..page_data import POLICY, map_of, names
from ..wire.json import dump
from . import Endpoint, Reply, file_answer, in_thread

STATIC = Path(__file__).resolve().parent.parent / "static"
_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
_FRESH = {"Cache-Control": "no-cache"}
# Inline styles are allowed at /docs: the interface sets some on its elements.
_DOCS_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' "
    "data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


def _file(path: Path, url: str = "", policy: str = "") -> Endpoint:
    """The endpoint of a file.  What is vendored changes with its version only."""
    headers = (
        {"Cache-Control": "public, max-age=86400"} if path.name.startswith("swagger-ui") else _FRESH
    )
    if policy:
        headers = {"Content-Security-Policy": policy, "Referrer-Policy": "no-referrer", **headers}

    async def answer(request: Request) -> Response:
        return file_answer(request, path, headers, media_type=_TYPES[path.suffix])

    return Endpoint(
        url or f"/static/{path.relative_to(STATIC).as_posix()}", "GET", answer, open=True
    )


async def _names(request: Request) -> Response:
    """The library's inputs, units and bounds, and the geometries of a contact."""
    return Reply(dump(names(guide=request.app.settings.guide is not None)), _FRESH)


async def _map(request: Request) -> Response:
    """The data of the map of a contact and a direction, see ``page_data.map_of``."""
    surrogate = request.app.tables.pick().surrogate
    asked = [request.query_params.get(name, word) for name, word in SPRING.names.items()]
    kind = kind_of(*asked)
    etag = f'"{surrogate.checksum[:32]}-{__version__}-{"-".join(asked)}"'
    headers = {"ETag": etag, **_FRESH}
    if etag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return await in_thread(request, lambda: Reply(dump(map_of(surrogate, **kind.names)), headers))


async def _description(request: Request) -> Response:
    return await in_thread(request, lambda: Reply(request.app.described))


# .js, .css
ASSETS, _VENDORED = ([*(STATIC / folder).glob("*.*s")] for folder in ("page", "swagger-ui"))
ENDPOINTS = [
    _file(STATIC / "page" / "index.html", "/", POLICY),
    _file(STATIC / "swagger-ui" / "index.html", "/docs", _DOCS_POLICY),
    *map(_file, [*ASSETS, *_VENDORED]),
    Endpoint("/static/page/names.json", "GET", _names, open=True),
    Endpoint("/static/page/map.json", "GET", _map),
    Endpoint("/openapi.json", "GET", _description),
]
