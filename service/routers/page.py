"""Serve ``/``: the page with a map of all cases, the user's point on it, and the friction law; and
``/docs``: the description.

These files hold no number of a table, and load nothing from other hosts.
"""

from pathlib import Path

from fastapi import APIRouter, HTTPException, Request, Response

from mumacro.inputs.fields import SPRING, kind_of

from .. import __version__
from ..admission import compute
from ..json_text import Json
from ..page_data import POLICY, map_of, names
from . import file_answer

STATIC = Path(__file__).resolve().parent.parent / "static"
_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
_FRESH = {"Cache-Control": "no-cache"}
# folders of third-party libraries, which change only with their versions
LIBRARIES = ("lib", "swagger-ui")
_ONE_DAY = {"Cache-Control": "public, max-age=86400"}
# Inline styles are allowed at /docs, because the interface sets some on its elements.
_DOCS_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' "
    "data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
router = APIRouter(include_in_schema=False)


def _page(request: Request, path: Path, policy: str) -> Response:
    headers = {"Content-Security-Policy": policy, "Referrer-Policy": "no-referrer", **_FRESH}
    return file_answer(request, path, headers, media_type=_TYPES[path.suffix])


@router.get("/")
async def page(request: Request) -> Response:
    """Return the page."""
    return _page(request, STATIC / "page" / "index.html", POLICY)


@router.get("/docs")
async def docs(request: Request) -> Response:
    """Return the description."""
    return _page(request, STATIC / "swagger-ui" / "index.html", _DOCS_POLICY)


@router.get("/static/page/names.json")
async def get_names(request: Request) -> Response:
    """Return the library's inputs, units and bounds, and the geometries of a contact."""
    built = request.app.state.settings.guide is not None or not _DOCUMENTS
    return Json(names(built), headers=_FRESH)


@router.get("/static/page/map.json")
async def get_map(request: Request) -> Response:
    """Return the data of the map of a contact and a direction, see ``page_data.map_of``."""
    surrogate = request.app.state.tables.pick().surrogate
    words = [request.query_params.get(name, word) for name, word in SPRING.names.items()]
    kind = kind_of(*words)
    etag = f'"{surrogate.checksum[:32]}-{__version__}-{"-".join(words)}"'
    headers = {"ETag": etag, **_FRESH}
    if etag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return await compute(request, lambda: Json(map_of(surrogate, **kind.names), headers=headers))


# .js, .css
ASSETS, *_VENDORED = ([*(STATIC / folder).glob("*.*s")] for folder in ("page", *LIBRARIES))
_FILES = {
    f"/static/{path.relative_to(STATIC).as_posix()}": path
    for paths in (ASSETS, *_VENDORED)
    for path in paths
}
# the documents as text files, in a checkout whose guide is not built
_SOURCE = Path(__file__).resolve().parent.parent.parent / "docs"
_DOCUMENTS = {
    f"/documents/{path.relative_to(_SOURCE).as_posix()}": path for path in _SOURCE.rglob("*.md")
}
#: paths without an API key: the same for everyone, and without a number of a table
OPEN = ("/", "/docs", "/static/page/names.json", *_FILES, *_DOCUMENTS)


@router.get("/static/{folder}/{name}")
async def get_asset(request: Request, folder: str, name: str) -> Response:
    """Return a script or a style sheet."""
    path = _FILES.get(f"/static/{folder}/{name}")
    if path is None:
        raise HTTPException(404)
    headers = _ONE_DAY if folder in LIBRARIES else _FRESH
    return file_answer(request, path, headers, media_type=_TYPES[path.suffix])


@router.get("/documents/{name:path}")
async def get_document(request: Request, name: str) -> Response:
    """Return a page of the documents as a text file."""
    path = _DOCUMENTS.get(f"/documents/{name}")
    if path is None:
        raise HTTPException(404)
    return file_answer(request, path, _FRESH, media_type="text/plain")
