"""A contact: ``POST /v1/stiffness``, from materials and geometry; ``POST /v1/fit``, from measured
points."""

import warnings
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from fastapi import Response

import mumacro
from mumacro.contacts.geometries import contact_of

from .. import API_VERSION
from ..limits import Working
from ..models.answers import FitAnswer, StiffnessAnswer
from ..models.questions import FitRequest, StiffnessRequest
from ..reading import Json, StrictRoute
from ..tables import Loaded, LoadedTable
from . import POST_PROBLEMS, router_of

router = router_of("answers", StrictRoute)


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
    return {**fit.to_dict(), **table.signature}
