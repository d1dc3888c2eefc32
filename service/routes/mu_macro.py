"""One case: ``GET`` and ``POST /v1/mu-macro``."""

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from service.answers import answer_case, case_etag
from service.codecs import encode
from service.intake import canonical, case_from_body, case_from_query, read_body, refuse_query
from service.metrics import Metrics
from service.openapi import case_parameters, describe_json, json_body
from service.schemas import CaseRequest
from service.settings import cache_fields
from service.shelf import LoadedTable, shelf_of

__all__ = ["etag_matches", "router"]

router = APIRouter(tags=["answers"])


def etag_matches(request: Request, etag: str) -> bool:
    """Whether the caller already has this answer (If-None-Match, weak comparison)."""
    offered = request.headers.get("if-none-match")
    if offered is None:
        return False
    return offered.strip() == "*" or etag in (part.strip().removeprefix("W/") for part in offered.split(","))


def _answer(request: Request, table: LoadedTable, case: CaseRequest) -> bytes:
    values, source = answer_case(table, case, canonical(case.include))
    metrics: Metrics = request.app.state.metrics
    metrics.cells[table.metrics_place + source] += 1.0
    return encode(values)


@router.head("/v1/mu-macro", include_in_schema=False)
@router.get(
    "/v1/mu-macro",
    operation_id="get_mu_macro",
    summary="Macroscopic friction of one case",
    response_class=Response,
    openapi_extra={"parameters": case_parameters()},
    responses=describe_json("CaseAnswer", 401, 422, 503),
)
async def get_mu_macro(request: Request) -> Response:
    """Answer one case given as a query.  The answer can be cached: ETag, If-None-Match, Cache-Control."""
    case = case_from_query(request)
    table = shelf_of(request).pick(case.tolerance, "parameter")
    include = canonical(case.include)
    etag = case_etag(table, case, include)
    headers = {"ETag": etag, **cache_fields(request.app.state.settings)}
    if etag_matches(request, etag):
        return Response(status_code=304, headers=headers)
    return Response(_answer(request, table, case), headers=headers, media_type="application/json")


@router.post(
    "/v1/mu-macro",
    operation_id="post_mu_macro",
    summary="Macroscopic friction of one case, as JSON",
    response_class=Response,
    openapi_extra=json_body("CaseRequest"),
    responses=describe_json("CaseAnswer", 400, 401, 413, 415, 422, 503),
)
async def post_mu_macro(request: Request) -> Response:
    """Answer one case given as a JSON object; ``include`` asks for more than the default answer."""
    refuse_query(request)
    case = case_from_body(await read_body(request))
    table = shelf_of(request).pick(case.tolerance)
    return Response(_answer(request, table, case), media_type="application/json")
