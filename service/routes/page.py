"""``/``: the page.  It shows the map of all cases with the user's point on it, and the friction law."""

from pathlib import Path

import anyio.to_thread
import numpy as np
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from mumacro import Surrogate
from mumacro.inputs import UNITS_OF
from mumacro.law import APPROXIMATIONS, BORDERS, EQUATIONS, borders

from .. import __version__
from ..formats.columns import dump
from ..kernel import BOUNDS, POSITIVE, UNITS
from ..tables import tables_of
from . import etag_matches, file_answer

__all__ = ["ASSETS", "FOLDER", "OPEN_PATHS", "POLICY", "map_content", "names_content", "router"]

router = APIRouter(include_in_schema=False)

FOLDER = Path(__file__).resolve().parent.parent / "static" / "page"
_TYPES = {".js": "text/javascript", ".css": "text/css"}
ASSETS = {path.name: _TYPES[path.suffix] for path in sorted(FOLDER.iterdir()) if path.suffix in _TYPES}
_NAMES = "/static/page/names.json"
#: paths without an API key: the page and its parts, which hold no number of a table
OPEN_PATHS = frozenset({"/", _NAMES, *(f"/static/page/{name}" for name in ASSETS)})

# No inline script, no inline style, nothing from another host.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

# The range of the map [-]: from deep in creep to fast sliding, twenty points per decade.
_PER_DECADE = 20
_V_DECADES, _Y_DECADES = (-4, 3), (-2, 3)
# Formulas of the paper for the border; "small_amplitude" is eq. (31) among the approximations, not among the borders.
_PAPER_BORDERS = tuple(name for name in BORDERS if name in EQUATIONS.values() and name not in APPROXIMATIONS)
_UNIT = 1e-4  # of the map's integers: a shade of colour is a hundred times coarser


@router.head("/")
@router.get("/")
async def page(request: Request) -> Response:
    """Return the page."""
    headers = {"Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer", "Cache-Control": "no-cache"}
    return file_answer(request, FOLDER / "index.html", headers, media_type="text/html")


def _add_asset(name: str, media_type: str) -> None:
    async def asset(request: Request) -> Response:
        return file_answer(request, FOLDER / name, {"Cache-Control": "no-cache"}, media_type=media_type)

    router.add_api_route(f"/static/page/{name}", asset, methods=["GET", "HEAD"], name=f"page-{name}")


for _name, _media_type in ASSETS.items():
    _add_asset(_name, _media_type)


@router.head(_NAMES)
@router.get(_NAMES)
async def names(request: Request) -> Response:
    """Return the library's inputs, units, bounds, approximations and borders, and whether there is a guide."""
    content = names_content(request.app.state.settings.guide is not None)
    return Response(content, headers={"Cache-Control": "no-cache"}, media_type="application/json")


def names_content(guide: bool) -> bytes:
    """``names.json``."""
    inputs = {
        name: {
            "unit": UNITS[name], "bound": BOUNDS[name], "positive": name in POSITIVE,
            "units": {unit: [scale.times, scale.over] for unit, scale in known.items()},
        }
        for name, known in UNITS_OF.items()
    }  # fmt: skip
    about = {name: {"equations": _equations(name), "text": text} for name, text in APPROXIMATIONS.items()}
    of_paper = {name: {"equations": _equations(name), "text": BORDERS[name]} for name in _PAPER_BORDERS}
    return dump({"inputs": inputs, "approximations": about, "borders": of_paper, "guide": guide})


@router.head("/static/page/map.json")
@router.get("/static/page/map.json")
async def map_data(request: Request) -> Response:
    """Return the data of the map: mu~ on a grid, rows of constant y~ from below, and borders by name."""
    surrogate = tables_of(request).pick().surrogate
    etag = f'"{surrogate.checksum[:32]}-{__version__}"'
    headers = {"ETag": etag, "Cache-Control": "no-cache"}
    if etag_matches(request, etag):
        return Response(status_code=304, headers=headers)
    content = await anyio.to_thread.run_sync(map_content, surrogate)
    return Response(content, headers=headers, media_type="application/json")


def _equations(name: str) -> list[int]:
    """Numbers of the paper's equations that an approximation stands for."""
    return [number for number, found in EQUATIONS.items() if found == name]


def map_content(surrogate: Surrogate) -> bytes:
    """``map.json``."""
    axes = {}
    for name, (low, high) in {"v_tilde": _V_DECADES, "y_tilde": _Y_DECADES}.items():
        axes[name] = {"start": 10.0**low, "stop": 10.0**high, "n": _PER_DECADE * (high - low) + 1}
    v, y = (np.geomspace(axis["start"], axis["stop"], int(axis["n"])) for axis in axes.values())
    ratio = surrogate.mu_ratio(v[None, :], y[:, None])
    amplitudes = np.geomspace(y[0], y[-1], 4 * y.size)
    rounded = np.rint(ratio / _UNIT).astype(int).ravel().tolist()
    lines = {name: _line(column, amplitudes) for name, column in borders(amplitudes).items() if name in _PAPER_BORDERS}
    border = _line(surrogate.v_tilde_crit(amplitudes), amplitudes)
    return dump({**axes, "unit": _UNIT, "mu_ratio": rounded, "border": border, "borders": lines})


def _line(v: np.ndarray, y: np.ndarray) -> list[list[float]]:
    """Points (v~, y~) of a curve, in six digits; without those at which it is not defined."""
    places = np.column_stack((v, y))[np.isfinite(v)]
    return [[float(f"{x:.6g}") for x in place] for place in places.tolist()]
