"""The friction law over a range of one input: ``POST /v1/law``, and ``GET /v1/law.csv`` for spreadsheets."""

import csv
import io
import math
from typing import Any

import anyio.to_thread
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from friction.errors import InputError
from friction.law import Law, approximations, border_speeds, friction_law, sweep_values
from friction.nondim import UNITS
from service.answers import signature
from service.codecs import encode
from service.errors import FieldFault, InvalidFieldsError
from service.forms import LawRequest, from_text, read_form
from service.intake import query_pairs, read_body, refuse_query
from service.openapi import describe_json, form_parameters, json_body
from service.shelf import LoadedTable, shelf_of

__all__ = ["router"]

router = APIRouter(tags=["answers"])


@router.post(
    "/v1/law",
    operation_id="post_law",
    summary="mu_macro over a range of one input",
    response_class=Response,
    openapi_extra=json_body("LawRequest"),
    responses=describe_json("LawAnswer", 400, 401, 413, 415, 422, 503),
)
async def post_law(request: Request) -> Response:
    """Return the law in columns, with its static limit and its border; ``include`` adds the paper's approximations."""
    refuse_query(request)
    form = read_form(LawRequest, await read_body(request))
    case = form.inputs(form.along)
    table = shelf_of(request).pick(form.tolerance)
    content = await anyio.to_thread.run_sync(lambda: encode(_answer(table, form, case)))
    return Response(content, media_type="application/json")


@router.head("/v1/law.csv", include_in_schema=False)
@router.get(
    "/v1/law.csv",
    operation_id="get_law_csv",
    summary="mu_macro over a range of one input, as a table for spreadsheets",
    response_class=Response,
    openapi_extra={"parameters": form_parameters(LawRequest)},
    responses={
        **describe_json("LawAnswer", 401, 422, 503),
        200: {"description": "The law", "content": {"text/csv": {"schema": {"type": "string"}}}},
    },
)
async def get_law_csv(request: Request) -> Response:
    """Return the law as CSV (RFC 4180), one row per value; the header names the columns with their units."""
    form = from_text(LawRequest, query_pairs(request))
    try:
        case = form.inputs(form.along)
    except InvalidFieldsError as error:
        raise _as_parameters(error) from None
    table = shelf_of(request).pick(form.tolerance, "parameter")
    content = await anyio.to_thread.run_sync(lambda: _as_csv(_answer(table, form, case, "parameter")))
    headers = {
        "Content-Disposition": f'attachment; filename="friction-law-{form.along}.csv"',
        "Cache-Control": "no-cache",
    }
    return Response(content, headers=headers, media_type="text/csv; charset=utf-8; header=present")


def _as_parameters(error: InvalidFieldsError) -> InvalidFieldsError:
    faults = [FieldFault(f.field, f.reason, bound=f.bound, place="parameter") for f in error.faults]
    return InvalidFieldsError(error.detail, faults)


def _law(table: LoadedTable, form: LawRequest, case: dict[str, float | None]) -> Law:
    values = sweep_values(form.along, form.start, form.stop, form.points, form.scale)
    return friction_law(table.surrogate, form.along, values, case)


def _answer(
    table: LoadedTable, form: LawRequest, case: dict[str, float | None], place: str = "pointer"
) -> dict[str, Any]:
    try:
        law = _law(table, form, case)
    except InputError as error:
        fault = FieldFault(error.field, f"must be {error.bound}", error.value, error.bound, place)
        raise InvalidFieldsError(f"{error.field}: must be {error.bound}", [fault]) from None
    answer: dict[str, Any] = {
        "along": form.along,
        "unit": UNITS[form.along],
        "values": law.values.tolist(),
        "mu_macro": law.answer.mu_macro.tolist(),
        "mu_ratio": law.answer.mu_ratio.tolist(),
        "regime": law.answer.regime.tolist(),
        "error_bound": law.answer.error_bound.tolist(),
        "source": law.answer.source.tolist(),
        "mu_static": law.mu_static.tolist(),
        "border": [{"value": mark.value, "mu_macro": mark.mu_macro} for mark in law.border],
    }
    if form.include:
        for name, columns in (("approximations", approximations), ("border_speeds", border_speeds)):
            found = columns(table.surrogate, law, case)
            answer[name] = {key: column.tolist() for key, column in found.items()}
    answer.update(signature(table))
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
