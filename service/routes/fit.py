"""k and mu0 from measured points: ``POST /v1/fit``."""

import math
import warnings
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field, create_model
from starlette.requests import Request
from starlette.responses import Response

import mumacro
from mumacro.contact import AMPLITUDE, ContactName, DirectionName
from mumacro.extras import missing
from mumacro.fitted import Fit, quantile
from mumacro.inputs import RIGID, is_rigid, number_hint
from mumacro.measured import STD, UNKNOWNS

from ..case import INPUTS
from ..models import Answered
from ..options import Options, Positive, bounded, input_fields, options_of
from ..problems import FieldFault, Kind, RequestError, refuse
from ..tables import LoadedTable
from ..wire.json import dump
from . import Endpoint, given_in_body, in_thread, reply

__all__ = ["ENDPOINTS"]

MAX_POINTS = 1000  # which scipy answers within seconds
_CURVE = 200  # points of the fitted law
_MEASURED = ("mu_macro", STD)
_COLUMNS = (*INPUTS, AMPLITUDE, *_MEASURED)


class FitOptions(Options):
    """What is asked beside the points."""

    unknowns: Annotated[list[Literal["k", "mu0"]], Field(min_length=1, max_length=2)] = bounded(
        "a list of k and mu0, or one of them", "What is fitted", list(UNKNOWNS)
    )


async def post_fit(request: Request) -> Response:
    """Fit k and mu0 to measured points; infinite bounds are null, an infinite k is the word rigid."""
    given = await given_in_body(request)
    std = given.pop(STD, None)  # of the points; the option of the same name is that of inputs
    form, points, faults = options_of(FitOptions, given, (*_COLUMNS, *FitOptions.model_fields))
    faults += [FieldFault.of(name, f"has no effect: {why}") for name, why in _NOT if given.get(name) is not None]
    columns = {name: _column(name, value, faults) for name, value in {**points, STD: std}.items() if value is not None}
    if form is None or faults:
        refuse(faults)
    table = request.app.state.tables.pick(form.tolerance)
    return await in_thread(request, lambda: reply(dump(_answer(table, form, columns))))


_NOT = (("include", "a fit has one answer"),)


def _column(name: str, value: Any, faults: list[FieldFault]) -> Any:
    """Numbers as an array or as one number; the word rigid is an infinite k."""
    if name == "k" and isinstance(value, str) and is_rigid(value):
        return math.inf
    if name not in _COLUMNS:
        faults.append(FieldFault.of(name, f"unknown field; allowed: {', '.join(_COLUMNS)}"))
        return None
    for i, entry in enumerate(value if isinstance(value, list) else [value]):
        if type(entry) not in (int, float) or not abs(entry) <= 1.7976931348623157e308:
            path = (name, i) if isinstance(value, list) else (name,)
            finite = type(entry) in (int, float)
            faults.append(FieldFault(path, "must be finite" if finite else number_hint(name, entry), entry))
            return None
    if isinstance(value, list):
        if len(value) > MAX_POINTS:
            faults.append(
                FieldFault.of(name, f"may have up to {MAX_POINTS} points, this has {len(value)}: average them")
            )
        return np.array(value, np.float64)
    return float(value)


def _answer(table: LoadedTable, form: FitOptions, columns: Mapping[str, Any]) -> dict[str, Any]:
    names: Any = {"contact": form.contact, "direction": form.direction}
    try:
        with warnings.catch_warnings():  # they are in the answer
            warnings.simplefilter("ignore")
            fit = mumacro.fit(columns, form.unknowns, surrogate=table.surrogate, **names)
    except ModuleNotFoundError as error:
        raise RequestError(Kind.NOT_INSTALLED, missing("fit", error)) from None
    return {
        "values": {name: _told(name, value) for name, value in fit.values.items()},
        "std": _finite(fit.std),
        "covariance": fit.covariance.tolist(),
        "interval": {name: [_told(name, end) for end in ends] for name, ends in fit.interval.items()},
        "residuals": fit.residuals.tolist(),
        "chi2": fit.chi2,
        "reduced_chi2": fit.reduced_chi2,
        "solutions": [{name: _told(name, value) for name, value in one.items()} for one in fit.solutions],
        "warnings": list(fit.warnings),
        **names,
        "curve": _curve(fit),
        **table.signature,
    }


def _told(name: str, value: float) -> float | str:
    return RIGID if name == "k" and math.isinf(value) else value


def _finite(values: Mapping[str, float]) -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in values.items()}


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
    low, high = np.maximum(mu - width, 0.0), mu + width
    return {"v0": fine.tolist(), "mu_macro": mu.tolist(), "low": low.tolist(), "high": high.tolist()}


# --- models -------------------------------------------------------------------------------------------

_Numbers = Annotated[list[float], Field(min_length=1, max_length=MAX_POINTS)]
_v0 = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3]
_EXAMPLE = {"v0": _v0, "mu_macro": [0.225, 0.228, 0.24, 0.265, 0.291, 0.298], "Fz": 10.0, "y0": 2e-6, "omega": 1.3e5}
_made: Any = create_model
FitRequest: Any = _made(
    "FitRequest", __base__=FitOptions, __config__=None,
    __doc__="Measured points as columns: lists of one length; a plain number holds for every point.",
    **{
        name: field for name, field in input_fields(optional=INPUTS, null=False, listed=True).items()
        if name in (*INPUTS, AMPLITUDE) and name != "v0"
    },
    v0=(Positive | _Numbers, Field(description="Sliding velocity of each point [m/s]")),
    mu_macro=(_Numbers, Field(description="Measured mu_macro of each point [-]")),
    std=(Positive | _Numbers | None, Field(None, description="Standard deviation of mu_macro [-]")),
)  # fmt: skip
FitRequest.model_config["json_schema_extra"] = {"examples": [_EXAMPLE]}


class FittedCurve(BaseModel):
    """The fitted law over v0, with its 95 % band."""

    v0: list[float] = Field(description="[m/s]")
    mu_macro: list[float]
    low: list[float | None]
    high: list[float | None]


class Interval(BaseModel):
    """What the points say of each unknown; those that were not unknown are left out."""

    k: list[float | Literal["rigid"] | None] | None = None
    mu0: list[float | None] | None = None


class FittedValues(BaseModel):
    """k [N/m], or rigid, and mu0 [-], those that were unknown."""

    k: float | Literal["rigid"] | None = None
    mu0: float | None = None


class Solution(FittedValues):
    """One minimum that the points allow."""

    chi2: float


class FitAnswer(Answered):
    """What measured points say about a contact."""

    values: FittedValues
    std: FittedValues = Field(description="Standard deviations; null: the points do not determine it, see warnings")
    covariance: list[list[float | None]] = Field(description="In the order of values; null: not determined")
    interval: Interval = Field(description="95 % intervals [low, high]; k may be rigid, null: without bound")
    residuals: list[float] = Field(description="Measured minus fitted mu_macro, of each point [-]")
    chi2: float
    reduced_chi2: float | None = Field(description="null: no point more than unknowns")
    solutions: list[Solution] = Field(description="All minima within 95 %, best first")
    warnings: list[str] = Field(description="What the points do not determine")
    contact: ContactName
    direction: DirectionName
    curve: FittedCurve | None = Field(description="null where other inputs than v0 vary, or v0 is 0 everywhere")


ENDPOINTS = [
    Endpoint(
        "/v1/fit", "POST", post_fit, "k and mu0 from measured points",
        body=FitRequest, model=FitAnswer, statuses=(501,),
    )
]  # fmt: skip
