"""A contact: ``POST /v1/stiffness``, from materials and geometry; ``POST /v1/fit``, from measured
points."""

import math
import warnings
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from fastapi import Response

import mumacro
from mumacro.analysis.fit import Fit, quantile
from mumacro.analysis.measured_points import STD
from mumacro.contacts.geometries import contact_of
from mumacro.inputs.fields import RIGID

from .. import API_VERSION
from ..limits import Working
from ..models.answers import FitAnswer, StiffnessAnswer
from ..models.questions import FitRequest, StiffnessRequest
from ..reading import Json, StrictRoute
from ..tables import Loaded, LoadedTable
from . import POST_PROBLEMS, router_of

router = router_of("answers", StrictRoute)
_CURVE = 200  # points of the fitted law
_MEASURED = ("mu_macro", STD)


@router.post(
    "/stiffness",
    responses={200: {"model": StiffnessAnswer}, **POST_PROBLEMS},
    summary="The stiffness of a contact from materials and geometry",
)
async def post_stiffness(contact: StiffnessRequest) -> Response:
    """Return k, and the contact to ask for with it; the arguments of a geometry in SI."""
    arguments = contact.model_dump(exclude_none=True, exclude={"geometry"})
    answer = asdict(contact_of(contact.geometry, **arguments))
    return Json({"geometry": contact.geometry, **answer, "api_version": API_VERSION})


@router.post(
    "/fit",
    responses={200: {"model": FitAnswer}, **POST_PROBLEMS},
    summary="k and mu0 from measured points",
)
async def post_fit(measured: FitRequest, tables: Loaded, work: Working) -> Response:
    """Fit k and mu0 to measured points; infinite bounds are null, an infinite k is the word
    rigid."""
    columns, table = measured.points, tables.pick(measured.tolerance)
    return await work.question(lambda: Json(_fitted(table, measured, columns)))


def _fitted(table: LoadedTable, measured: FitRequest, columns: Mapping[str, Any]) -> dict[str, Any]:
    words: Any = measured.kind.names
    with warnings.catch_warnings():  # they are in the answer
        warnings.simplefilter("ignore")
        fit = mumacro.fit(columns, measured.unknowns, surrogate=table.surrogate, **words)
    members = {name: getattr(fit, name) for name in FitAnswer.model_fields if hasattr(fit, name)}
    return {
        **members,
        "values": _in_words(fit.values),
        "interval": {
            name: [_in_words({name: end})[name] for end in ends]
            for name, ends in fit.interval.items()
        },
        "solutions": [_in_words(one) for one in fit.solutions],
        "curve": _curve(fit),
        **table.signature,
    }


def _in_words(values: Mapping[str, float]) -> dict[str, float | str]:
    """Values with the word rigid for an infinite k."""
    return {
        name: RIGID if name == "k" and value == math.inf else value
        for name, value in values.items()
    }


def _curve(fit: Fit) -> dict[str, Any] | None:
    """The fitted law over v0 with its 95 % band; None where other inputs vary, too."""
    inputs = {name: x for name, x in fit.points.items() if name not in _MEASURED}
    v0 = inputs.pop("v0")
    moving = v0[v0 > 0.0]
    if any(np.ptp(x) > 0.0 for x in inputs.values() if np.isfinite(x).all()) or not moving.size:
        return None
    fine = np.unique(np.concatenate([np.geomspace(moving.min(), moving.max(), _CURVE), v0]))
    mu, off = fit.predict(v0=fine, **{name: float(x[0]) for name, x in inputs.items()})
    width = quantile(None if STD in fit.points else v0.size - len(fit.values)) * off
    return {"v0": fine, "mu_macro": mu, "low": np.maximum(mu - width, 0.0), "high": mu + width}
