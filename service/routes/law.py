"""The friction law over a range of one input: ``POST /v1/law``, and ``GET /v1/law.csv`` for spreadsheets."""

import csv
import io
import math
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from mumacro.errors import InputError
from mumacro.law import approximations, border_speeds, friction_law, sweep_values

from ..errors import FieldFault, InvalidFieldsError, accepts
from ..evaluation import Batch, answer_batch
from ..formats.columns import dump
from ..kernel import FIELDS, RAD_PER_CYCLE, UNITS
from ..openapi import problems
from ..quantities import nested
from ..questions import LawAnswer, LawFamilyAnswer, LawQuery, LawRequest
from ..schemas import deviations
from ..tables import LoadedTable, TablesDep, signature
from . import JsonRoute, no_query, once_each, parameters_of

__all__ = ["router"]

router = APIRouter(tags=["answers"], route_class=JsonRoute)
accepts("/v1/law", LawRequest.model_fields)
accepts("/v1/law.csv", LawQuery.model_fields)


@router.post(
    "/v1/law",
    operation_id="post_law",
    summary="mu_macro over a range of one input",
    response_model=LawAnswer | LawFamilyAnswer,
    responses=problems(400, 401, 413, 415, 422, 503),
    dependencies=[Depends(no_query)],
)
async def post_law(form: LawRequest, tables: TablesDep, request: Request) -> Response:
    """Return the law in columns, with its static limit and its border; with ``family``, one curve per value."""
    table = tables.pick(form.tolerance)
    content = await request.app.state.work.run_in_place(lambda: dump(_answer(table, form, "pointer")))
    return Response(content, media_type="application/json")


@router.head("/v1/law.csv", include_in_schema=False)
@router.get(
    "/v1/law.csv",
    operation_id="get_law_csv",
    summary="mu_macro over a range of one input, as a table for spreadsheets",
    response_class=Response,
    responses={
        **problems(401, 422, 503),
        200: {"description": "The law", "content": {"text/csv": {"schema": {"type": "string"}}}},
    },
    dependencies=[Depends(once_each)],
)
async def get_law_csv(query: Annotated[LawQuery, Query()], tables: TablesDep, request: Request) -> Response:
    """Return the law as CSV (RFC 4180), one row per value; the header names the columns with their units."""
    with parameters_of("/v1/law.csv"):
        form = query.form()
    table = tables.pick(form.tolerance, "parameter")
    content = await request.app.state.work.run_in_place(lambda: _as_csv(_answer(table, form, "parameter")))
    headers = {
        "Content-Disposition": f'attachment; filename="friction-law-{form.along}.csv"',
        "Cache-Control": "no-cache",
    }
    return Response(content, headers=headers, media_type="text/csv; charset=utf-8; header=present")


def _answer(table: LoadedTable, form: LawRequest, place: str) -> dict[str, Any]:
    case = form.inputs()
    swept: dict[str, Any] = {"along": form.along, "unit": UNITS[form.along]}
    try:
        values = sweep_values(*_internal(form.along, form.start, form.stop), form.points, form.scale)
        swept["values"] = (values / _per(form.along)).tolist()
        if not form.family:
            return {**swept, **_curve(table, form, values, case), **signature(table)}
        ((name, listed),) = form.family.items()
        inner = "omega" if name == "f" else name
        curves = [
            {"value": value, **_curve(table, form, values, {**case, inner: value * _per(name)})} for value in listed
        ]
        return {**swept, "family": name, "family_unit": UNITS[name], "curves": curves, **signature(table)}
    except InputError as error:
        reason = f"must be {error.bound}"
        raise InvalidFieldsError(
            f"{error.field}: {reason}", [FieldFault(error.field, reason, error.value, error.bound, place)]
        ) from None


def _per(name: str) -> float:
    """Factor from a value of this name to the library's input: omega [rad/s] from f [Hz]."""
    return RAD_PER_CYCLE if name == "f" else 1.0


def _internal(name: str, start: float, stop: float) -> tuple[str, float, float]:
    return "omega" if name == "f" else name, start * _per(name), stop * _per(name)


def _curve(table: LoadedTable, form: LawRequest, values: Any, case: dict[str, Any]) -> dict[str, Any]:
    along = "omega" if form.along == "f" else form.along
    law = friction_law(table.surrogate, along, values, case)
    answer: dict[str, Any] = {
        "mu_macro": law.answer.mu_macro.tolist(),
        "mu_ratio": law.answer.mu_ratio.tolist(),
        "regime": law.answer.regime.tolist(),
        "error_bound": law.answer.error_bound.tolist(),
        "source": law.answer.source.tolist(),
        "mu_static": law.mu_static.tolist(),
        "border": [{"value": mark.value / _per(form.along), "mu_macro": mark.mu_macro} for mark in law.border],
    }
    if "approximations" in (form.include or ()):
        for name, columns in (("approximations", approximations), ("border_speeds", border_speeds)):
            found = columns(table.surrogate, law, case)
            answer[name] = {key: column.tolist() for key, column in found.items()}
    quantities = form.quantities()
    if quantities:
        full = {"k": math.inf, **{name: math.inf if value is None else value for name, value in case.items()}}
        columns_of = [values if name == along else np.array([full[name]]) for name in FIELDS]
        more = answer_batch(table, Batch(values.size, columns_of), quantities, deviations(form.std))
        answer.update(nested({path: column.tolist() for path, column in more.extras.items()}))
    return answer


def _as_csv(answer: dict[str, Any]) -> str:
    columns: dict[str, list[Any]] = {f"{answer['along']} [{answer['unit']}]": answer["values"]}
    for name in ("mu_macro", "mu_ratio", "error_bound", "mu_static"):
        columns[f"{name} [-]"] = answer[name]
    for group, prefix, unit in (("approximations", "", "-"), ("border_speeds", "border_", "m/s")):
        for name, column in answer.get(group, {}).items():
            columns[f"{prefix}{name} [{unit}]"] = ["" if math.isnan(value) else value for value in column]
    columns.update(regime=answer["regime"], source=answer["source"])
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()
