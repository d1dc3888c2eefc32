"""A contact: ``POST /v1/stiffness``, from materials and geometry; ``POST /v1/fit``, from measured
points."""

import math
import warnings
from collections.abc import Mapping
from dataclasses import asdict
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field
from starlette.requests import Request
from starlette.responses import Response

import mumacro
from mumacro.analysis.fit import Fit, quantile
from mumacro.analysis.measured_points import STD, UNKNOWNS
from mumacro.contacts.geometries import ARGUMENTS, GEOMETRIES, contact_of
from mumacro.errors import missing
from mumacro.inputs.fields import NAMES as INPUTS
from mumacro.inputs.fields import RIGID, is_rigid
from mumacro.inputs.kind import AMPLITUDE, ContactName, DirectionName

from .. import API_VERSION
from ..case import Asked, not_finite, stranger
from ..models import Answered, Strict, many, model, optional, told
from ..options import NAMES, Choice, Positive, bounded, input_fields, options_of
from ..problems import FieldFault, Kind, RequestError, refuse
from ..tables import LoadedTable
from ..wire.json import dump
from . import Endpoint, Reply, given_in_body, in_thread

_MODULI = ("E", "E2")  # which the word rigid may stand for
_Poisson = Annotated[float, Field(gt=-1.0, le=0.5)]


async def post_stiffness(request: Request) -> Response:
    """Return k, and the contact to ask for with it; the arguments of a geometry in SI."""
    given = {
        name: value for name, value in (await given_in_body(request)).items() if value is not None
    }
    geometry = str(given.pop("geometry", None))
    rigid = {
        name: math.inf
        for name in _MODULI
        if isinstance(given.get(name), str) and is_rigid(given[name])
    }
    numbers = [
        name
        for name in given
        if name in ARGUMENTS and name not in rigid and not ARGUMENTS[name].choices
    ]
    if faults := [fault for name in numbers if (fault := not_finite(name, given[name]))]:
        refuse(faults)
    found = asdict(contact_of(geometry, **{**given, **rigid}))
    return Reply(dump({"geometry": geometry, **found, "api_version": API_VERSION}))


def _member(name: str) -> Any:
    about = ARGUMENTS[name]
    kind: Any = (
        Literal[about.choices] if about.choices else _Poisson if name.startswith("nu") else Positive
    )
    kind = Positive | Annotated[str, Field(pattern=f"^{RIGID}$")] if name in _MODULI else kind
    of = ", ".join(geometry for geometry, known in GEOMETRIES.items() if name in known.arguments)
    text = f"{about.meaning}{f' [{about.unit}]' if about.unit else ''}{f'; of: {of}' if of else ''}"
    return (told if name in ("E", "nu") else optional)(kind, text)


_MEANINGS = "; ".join(f"{name}: {about.meaning}" for name, about in GEOMETRIES.items())
StiffnessRequest = model(
    "StiffnessRequest",
    "Two bodies in contact.",
    Strict,
    example={"geometry": "ball", "radius": 5e-3, "Fz": 10.0, "E": 210e9, "nu": 0.3},
    geometry=told(Literal[tuple(GEOMETRIES)], _MEANINGS),
    **{name: _member(name) for name in ARGUMENTS},
)
StiffnessAnswer = model(
    "StiffnessAnswer",
    "What a contact of two bodies is; ``k`` and ``contact`` are those of a case.",
    geometry=str,
    k=told(float, "Tangential stiffness while everything sticks [N/m]"),
    k_normal=told(float, "Normal stiffness [N/m]"),
    half_width=told(float, "Radius of a circular contact, half width of a line contact [m]"),
    pressure=told(float, "Largest pressure [Pa]: Hertz's, or the mean one under a flat punch"),
    contact=ContactName,
    warnings=told(many(str), "Where the theory behind k is off"),
    api_version=str,
)


# --- measured points ------------------------------------------------------------------------------

MAX_POINTS = 1000  # which scipy answers within seconds
_CURVE = 200  # points of the fitted law
_MEASURED = ("mu_macro", STD)
_COLUMNS = (*NAMES, *_MEASURED)


class FitOptions(Choice):
    """What is asked beside the points."""

    unknowns: Annotated[list[Literal["k", "mu0"]], Field(min_length=1, max_length=2)] = bounded(
        "a list of k and mu0, or one of them", "What is fitted", list(UNKNOWNS)
    )


async def post_fit(request: Request) -> Response:
    """Fit k and mu0 to measured points; infinite bounds are null, an infinite k is the word
    rigid."""
    given = await given_in_body(request)
    form, points, faults = options_of(FitOptions, given)
    # which null is in it; elsewhere it says nothing
    gap = "k" if form is not None and "k" not in form.unknowns else ""
    columns = {
        n: _column(n, value, faults) for n, value in points.items() if value is not None or n == gap
    }
    if form is not None:
        told = stranger("y0", Asked(form.kind), ())
        wrong = {"y0" if form.kind.normal else AMPLITUDE: told}
        wrong |= dict.fromkeys(form.unknowns, "must be left out: it is among the unknowns")
        faults += [FieldFault.of(name, reason) for name, reason in wrong.items() if name in columns]
    if form is None or faults:
        refuse(faults)
    table = request.app.tables.pick(form.tolerance)
    return await in_thread(request, lambda: Reply(dump(_answer(table, form, columns))))


def _column(name: str, value: Any, faults: list[FieldFault]) -> Any:
    """Numbers as an array, of no dimension for one number; the word rigid is an infinite k."""
    if name == "k" and isinstance(value, str) and is_rigid(value):
        return math.inf
    entries = (
        {(i,): entry for i, entry in enumerate(value)} if isinstance(value, list) else {(): value}
    )
    bad = [fault for place, entry in entries.items() if (fault := not_finite(name, entry, *place))][
        :1
    ]
    if name not in _COLUMNS:
        bad = [FieldFault.of(name, f"unknown field; allowed: {', '.join(_COLUMNS)}")]
    elif len(entries) > MAX_POINTS:
        bad = [
            FieldFault.of(
                name, f"may have up to {MAX_POINTS} points, this has {len(entries)}: average them"
            )
        ]
    faults += bad
    return None if bad else np.array(value, np.float64)


def _answer(table: LoadedTable, form: FitOptions, columns: Mapping[str, Any]) -> dict[str, Any]:
    try:
        with warnings.catch_warnings():  # they are in the answer
            warnings.simplefilter("ignore")
            fit = mumacro.fit(columns, form.unknowns, surrogate=table.surrogate, **form.kind.names)
    except ModuleNotFoundError as error:
        raise RequestError(Kind.NOT_INSTALLED, missing("fit", error)) from None
    found = {name: getattr(fit, name) for name in FitAnswer.model_fields if hasattr(fit, name)}
    return {
        **found,
        "values": _told(fit.values),
        "interval": {
            name: [_told({name: end})[name] for end in ends] for name, ends in fit.interval.items()
        },
        "solutions": [_told(one) for one in fit.solutions],
        "curve": _curve(fit),
        **table.signature,
    }


def _told(values: Mapping[str, float]) -> dict[str, float | str]:
    """Values with the word rigid for an infinite k."""
    return {
        name: RIGID if name == "k" and value == math.inf else value
        for name, value in values.items()
    }


def _curve(fit: Fit) -> dict[str, Any] | None:
    """The fitted law over v0 with its 95 % band; None where other inputs vary, too."""
    given = {name: x for name, x in fit.points.items() if name not in _MEASURED}
    v0 = given.pop("v0")
    moving = v0[v0 > 0.0]
    if any(np.ptp(x) > 0.0 for x in given.values() if np.isfinite(x).all()) or not moving.size:
        return None
    fine = np.unique(np.concatenate([np.geomspace(moving.min(), moving.max(), _CURVE), v0]))
    mu, off = fit.predict(v0=fine, **{name: float(x[0]) for name, x in given.items()})
    width = quantile(None if STD in fit.points else v0.size - len(fit.values)) * off
    return {"v0": fine, "mu_macro": mu, "low": np.maximum(mu - width, 0.0), "high": mu + width}


_Numbers = Annotated[list[float], Field(min_length=1, max_length=MAX_POINTS)]
_Stiffness = float | Literal["rigid"] | None
_inputs = input_fields(INPUTS, listed=True, shown=())
_columns = {name: _inputs[name] for name in NAMES} | {
    "k": (Positive | Literal["rigid"] | _Numbers | None, _inputs["k"][1]),  # the word stands alone
    "v0": told(Positive | _Numbers, "Sliding velocity of each point [m/s]"),
    "mu_macro": told(_Numbers, "Measured mu_macro of each point [-]"),
    "std": optional(Positive | _Numbers, "Standard deviation of mu_macro [-]"),
}
_text = "Measured points as columns: lists of one length; a plain number holds for every point."
_points = {
    "v0": [0.001, 0.003, 0.01, 0.03, 0.1, 0.3],
    "mu_macro": [0.225, 0.228, 0.24, 0.265, 0.291, 0.298],
}
_EXAMPLE = {**_points, "Fz": 10.0, "y0": 2e-6, "omega": 1.3e5}
FitRequest = model("FitRequest", _text, FitOptions, example=_EXAMPLE, **_columns)
FittedCurve = model(
    "FittedCurve",
    "The fitted law over v0, with its 95 % band.",
    v0=told(list[float], "[m/s]"),
    mu_macro=list[float],
    low=list[float | None],
    high=list[float | None],
)
Interval = model(
    "Interval",
    "What the points say of each unknown; those that were not unknown are left out.",
    k=optional(list[_Stiffness]),
    mu0=optional(list[float | None]),
)
FittedValues = model(
    "FittedValues",
    "k [N/m], or rigid, and mu0 [-], those that were unknown.",
    k=optional(_Stiffness),
    mu0=optional(float),
)
Solution = model("Solution", "One minimum that the points allow.", FittedValues, chi2=float)
FitAnswer = model(
    "FitAnswer",
    "What measured points say about a contact.",
    Answered,
    values=FittedValues,
    std=told(
        FittedValues, "Standard deviations; null: the points do not determine it, see warnings"
    ),
    covariance=told(list[list[float | None]], "In the order of values; null: not determined"),
    interval=told(Interval, "95 % intervals [low, high]; k may be rigid, null: without bound"),
    residuals=told(list[float], "Measured minus fitted mu_macro, of each point [-]"),
    chi2=float,
    reduced_chi2=told(float | None, "null: no point more than unknowns"),
    solutions=told(many(Solution), "All minima within 95 %, best first"),
    warnings=told(list[str], "What the points do not determine"),
    contact=ContactName,
    direction=DirectionName,
    curve=told(FittedCurve | None, "null where other inputs than v0 vary, or v0 is 0 everywhere"),
)
ENDPOINTS = [
    Endpoint(
        "/v1/stiffness",
        "POST",
        post_stiffness,
        "The stiffness of a contact from materials and geometry",
        StiffnessRequest,
        StiffnessAnswer,
    ),
    Endpoint(
        "/v1/fit",
        "POST",
        post_fit,
        "k and mu0 from measured points",
        FitRequest,
        FitAnswer,
        statuses=(501,),
    ),
]
