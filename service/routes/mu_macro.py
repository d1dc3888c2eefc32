"""One case: ``GET`` and ``POST /v1/mu-macro``, and ``GET /v1/mu-macro.txt`` for spreadsheets.

Most valid cases are answered by the fast path before they get here: :mod:`service.single`.
"""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from pydantic import Field
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from ..errors import FieldFault, accepts, refusal
from ..evaluation import answer_case, case_etag
from ..formats.columns import dump
from ..metrics import Metrics
from ..openapi import ANSWER_HEADERS, problems
from ..quantities import cost_of
from ..schemas import CaseAnswer, CaseQuery, CaseRequest
from ..settings import cache_fields
from ..tables import LoadedTable, TablesDep
from . import JsonRoute, etag_matches, no_query, once_each, parameters_of

__all__ = ["router"]

router = APIRouter(tags=["answers"], route_class=JsonRoute)
PATH, TEXT_PATH = "/v1/mu-macro", "/v1/mu-macro.txt"
accepts(PATH, CaseRequest.model_fields)
accepts(TEXT_PATH, [*CaseQuery.model_fields, "value"])


class ValueQuery(CaseQuery):
    """One case as a query, and the name of the requested value."""

    value: str = Field(
        "mu_macro", description="Name in the answer, such as mu_macro, regime or power.saved", max_length=64
    )


async def _answered(request: Request, table: LoadedTable, case: CaseRequest) -> dict[str, Any]:
    # Code that is not loaded yet, or takes long, runs in a thread.
    costly = case.include and (not request.app.state.tables.warm or cost_of(case.names()) > 100)
    work = request.app.state.work
    values, source = await work.run(
        lambda: answer_case(table, case.inputs(), case.names(), case.std), float("inf") if costly else 0.0
    )
    metrics: Metrics = request.app.state.metrics
    metrics.cells[table.cell + source] += 1.0
    answer: dict[str, Any] = values
    return answer


async def _get(request: Request, tables: Any, query: CaseQuery) -> tuple[dict[str, Any] | None, dict[str, str]]:
    """The answer, None if the client has it already, and its headers."""
    with parameters_of(request.url.path):
        case = query.case()
    table = tables.pick(case.tolerance, "parameter")
    etag = case_etag(table, case.inputs(), case.names(), case.std)
    headers = {"ETag": etag, **cache_fields(request.app.state.settings)}
    if etag_matches(request, etag):
        return None, headers
    return await _answered(request, table, case), headers


@router.head(PATH, include_in_schema=False)
@router.get(
    PATH,
    operation_id="get_mu_macro",
    summary="Macroscopic friction of one case",
    response_model=CaseAnswer,
    responses={
        200: {"headers": ANSWER_HEADERS, "content": {"text/plain": {"schema": {"type": "number"}}}},
        **problems(400, 401, 422, 503),
    },
    dependencies=[Depends(once_each)],
)
async def get_mu_macro(query: Annotated[CaseQuery, Query()], tables: TablesDep, request: Request) -> Response:
    """Answer one case given as a query; with ``Accept: text/plain`` the answer is mu_macro only.

    The answer can be cached: ETag, If-None-Match, Cache-Control.
    """
    answer, headers = await _get(request, tables, query)
    plain = "text/plain" in request.headers.get("accept", "")
    if plain:
        headers["ETag"] = headers["ETag"][:-1] + '-t"'
        if etag_matches(request, headers["ETag"]):
            answer = None
    if answer is None:
        return Response(status_code=304, headers=headers)
    if plain:
        return PlainTextResponse(repr(answer["mu_macro"]), headers=headers)
    return Response(dump(answer), headers=headers, media_type="application/json")


@router.head(TEXT_PATH, include_in_schema=False)
@router.get(
    TEXT_PATH,
    operation_id="get_mu_macro_text",
    summary="One value of one case, for spreadsheets (WEBSERVICE)",
    response_class=PlainTextResponse,
    responses=problems(400, 401, 422, 503),
    dependencies=[Depends(once_each)],
)
async def get_mu_macro_text(query: Annotated[ValueQuery, Query()], tables: TablesDep, request: Request) -> Response:
    """Answer one case with one value as text: ``mu_macro``, or the one that ``value`` names."""
    answer, headers = await _get(request, tables, query)
    headers["ETag"] = f'{headers["ETag"][:-1]}-{query.value}"'
    if answer is None or etag_matches(request, headers["ETag"]):
        return Response(status_code=304, headers=headers)
    found: Any = answer
    for name in query.value.split("."):
        found = found.get(name) if isinstance(found, dict) else None
    if found is None or isinstance(found, dict):
        offer = ", ".join(answer)
        reason = f"is not in the answer; there are: {offer}; more with include"
        raise refusal([FieldFault("value", reason, query.value, place="parameter")])
    return PlainTextResponse(found if isinstance(found, str) else dump({"v": found})[5:-1].decode(), headers=headers)


@router.post(
    PATH,
    operation_id="post_mu_macro",
    summary="Macroscopic friction of one case, as JSON",
    response_model=CaseAnswer,
    responses=problems(400, 401, 413, 415, 422, 503),
    dependencies=[Depends(no_query)],
)
async def post_mu_macro(case: CaseRequest, tables: TablesDep, request: Request) -> Response:
    """Answer one case given as a JSON object; ``include`` adds quantities to the default answer."""
    answer = await _answered(request, tables.pick(case.tolerance), case)
    return Response(dump(answer), media_type="application/json")
