"""The stiffness of a contact from materials and geometry: ``POST /v1/stiffness``."""

import math
from dataclasses import asdict
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field
from starlette.requests import Request
from starlette.responses import Response

from mumacro.contact import ContactName
from mumacro.geometries import ARGUMENTS, GEOMETRIES, contact_of
from mumacro.inputs import RIGID, is_rigid

from .. import API_VERSION
from ..case import not_finite
from ..models import model, optional, told
from ..options import Positive
from ..problems import FieldFault, refuse
from ..wire.json import dump
from . import Endpoint, given_in_body, reply

__all__ = ["ENDPOINTS"]

_MODULI = ("E", "E2")  # which the word rigid may stand for


async def post_stiffness(request: Request) -> Response:
    """Return k, and the contact to ask for with it; the arguments of a geometry in SI."""
    given = {name: value for name, value in (await given_in_body(request)).items() if value is not None}
    geometry = given.pop("geometry", None)
    for name in _MODULI:
        if isinstance(given.get(name), str) and is_rigid(given[name]):
            given[name] = math.inf
    numbers = [name for name in given if name in ARGUMENTS and not ARGUMENTS[name].choices]
    faults = [fault for name in numbers if given[name] != math.inf and (fault := not_finite(name, given[name]))]
    if not isinstance(geometry, str):
        faults.append(FieldFault.of("geometry", f"must be one of {', '.join(GEOMETRIES)}", geometry))
    if faults:
        refuse(faults)
    found = asdict(contact_of(str(geometry), **given))
    return reply(dump({"geometry": geometry, **found, "api_version": API_VERSION}))


# --- models -------------------------------------------------------------------------------------------


def _member(name: str) -> Any:
    about = ARGUMENTS[name]
    kind: Any = Literal[about.choices] if about.choices else float if name.startswith("nu") else Positive
    kind = Positive | Annotated[str, Field(pattern=f"^{RIGID}$")] if name in _MODULI else kind
    of = ", ".join(geometry for geometry, known in GEOMETRIES.items() if name in known.arguments)
    text = f"{about.meaning}{f' [{about.unit}]' if about.unit else ''}{f'; of: {of}' if of else ''}"
    return (told if name in ("E", "nu") else optional)(kind, text)


_MEANINGS = "; ".join(f"{name}: {about.meaning}" for name, about in GEOMETRIES.items())
StiffnessRequest = model(
    "StiffnessRequest", "Two bodies in contact.", geometry=told(Literal[tuple(GEOMETRIES)], _MEANINGS),
    **{name: _member(name) for name in ARGUMENTS},
)  # fmt: skip
StiffnessRequest.model_config |= ConfigDict(
    extra="forbid",
    json_schema_extra={"examples": [{"geometry": "ball", "radius": 5e-3, "Fz": 10.0, "E": 210e9, "nu": 0.3}]},
)
StiffnessAnswer = model(
    "StiffnessAnswer", "What a contact of two bodies is; ``k`` and ``contact`` are those of a case.",
    geometry=str, k=told(float, "Tangential stiffness while everything sticks [N/m]"),
    k_normal=told(float, "Normal stiffness [N/m]"),
    half_width=told(float, "Radius of a circular contact, half width of a line contact [m]"),
    pressure=told(float, "Largest pressure [Pa]: Hertz's, or the mean one under a flat punch"),
    contact=ContactName, api_version=str,
)  # fmt: skip
ENDPOINTS = [
    Endpoint(
        "/v1/stiffness", "POST", post_stiffness, "The stiffness of a contact from materials and geometry",
        StiffnessRequest, StiffnessAnswer,
    )
]  # fmt: skip
