"""The stiffness of a contact from materials and geometry: ``POST /v1/stiffness``."""

import math
from dataclasses import asdict
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, create_model
from starlette.requests import Request
from starlette.responses import Response

from mumacro.contact import ContactName
from mumacro.geometries import ARGUMENTS, GEOMETRIES, contact_of
from mumacro.inputs import RIGID, is_rigid, number_hint

from .. import API_VERSION
from ..options import Positive
from ..problems import FieldFault, refuse
from ..wire.json import dump
from . import Endpoint, given_in_body, reply

__all__ = ["ENDPOINTS"]

_MODULI = ("E", "E2")  # which the word rigid may stand for


async def post_stiffness(request: Request) -> Response:
    """Return k, and the contact to ask for with it; the arguments of a geometry in SI."""
    given = await given_in_body(request)
    geometry = given.pop("geometry", None)
    if not isinstance(geometry, str):
        refuse([FieldFault.of("geometry", f"must be one of {', '.join(GEOMETRIES)}", geometry)])
    found = contact_of(geometry, **_arguments(given))
    return reply(dump({"geometry": geometry, **asdict(found), "api_version": API_VERSION}))


def _arguments(given: dict[str, Any]) -> dict[str, Any]:
    """The arguments with infinite moduli for the word rigid."""
    values: dict[str, Any] = {}
    faults = []
    for name, value in given.items():
        if name in _MODULI and isinstance(value, str) and is_rigid(value):
            values[name] = math.inf
        elif value is None:  # the same as left out
            continue
        elif name in ARGUMENTS and not ARGUMENTS[name].choices and type(value) not in (int, float):
            faults.append(FieldFault.of(name, number_hint(name, value), value))
        elif name in ARGUMENTS and type(value) in (int, float) and not _finite(value):
            faults.append(FieldFault.of(name, "must be finite", value))
        else:
            values[name] = value
    if faults:
        refuse(faults)
    return values


def _finite(value: float) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


# --- models -------------------------------------------------------------------------------------------

_made: Any = create_model
_MEANINGS = "; ".join(f"{name}: {about.meaning}" for name, about in GEOMETRIES.items())
_EXAMPLE: dict[str, Any] = {"geometry": "ball", "radius": 5e-3, "Fz": 10.0, "E": 210e9, "nu": 0.3}


def _kind(name: str) -> Any:
    about = ARGUMENTS[name]
    kind: Any = Literal[about.choices] if about.choices else float if name.startswith("nu") else Positive
    kind = Positive | Annotated[str, Field(pattern=f"^{RIGID}$")] if name in _MODULI else kind
    of = [geometry for geometry, known in GEOMETRIES.items() if name in known.arguments]
    told = f"{about.meaning}{f' [{about.unit}]' if about.unit else ''}{f'; of: {chr(44).join(of)}' if of else ''}"
    return (kind, Field(description=told)) if name in ("E", "nu") else (kind | None, Field(None, description=told))


StiffnessRequest: Any = _made(
    "StiffnessRequest", __config__=ConfigDict(extra="forbid", json_schema_extra={"examples": [_EXAMPLE]}),
    __doc__="Two bodies in contact.",
    geometry=(Literal[tuple(GEOMETRIES)], Field(description=_MEANINGS)),
    **{name: _kind(name) for name in ARGUMENTS},
)  # fmt: skip


class StiffnessAnswer(BaseModel):
    """What a contact of two bodies is; ``k`` and ``contact`` are those of a case."""

    geometry: str
    k: float = Field(description="Tangential stiffness while everything sticks [N/m]")
    k_normal: float = Field(description="Normal stiffness [N/m]")
    half_width: float = Field(description="Radius of a circular contact, half width of a line contact [m]")
    pressure: float = Field(description="Largest pressure [Pa]: Hertz's, or the mean one under a flat punch")
    contact: ContactName
    api_version: str


ENDPOINTS = [
    Endpoint(
        "/v1/stiffness", "POST", post_stiffness, "The stiffness of a contact from materials and geometry",
        body=StiffnessRequest, model=StiffnessAnswer,
    )
]  # fmt: skip
