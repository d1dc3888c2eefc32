"""Health: ``/livez`` (the process answers), ``/readyz`` and its alias ``/healthz`` (it answers rightly)."""

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from service import API_VERSION, __version__
from service.codecs import encode
from service.openapi import describe_json
from service.shelf import shelf_of

__all__ = ["router"]

router = APIRouter(tags=["health"])

_NO_STORE = {"Cache-Control": "no-store"}
_VERSIONS = {"api_version": API_VERSION, "service_version": __version__}


@router.head("/livez", include_in_schema=False)
@router.get(
    "/livez",
    operation_id="livez",
    summary="The process is alive",
    response_class=Response,
    responses=describe_json("Health"),
)
async def livez() -> Response:
    """Say that the process answers.  It does so without a table, too: a restart would not mend a table."""
    return Response(encode({"status": "alive", **_VERSIONS}), headers=_NO_STORE, media_type="application/json")


@router.head("/healthz", include_in_schema=False)
@router.get(
    "/healthz",
    operation_id="healthz",
    summary="The same as /readyz",
    response_class=Response,
    responses=describe_json("Health", 503),
)
@router.head("/readyz", include_in_schema=False)
@router.get(
    "/readyz",
    operation_id="readyz",
    summary="The service answers rightly",
    response_class=Response,
    responses=describe_json("Health", 503),
)
async def readyz(request: Request) -> Response:
    """Say whether every table is loaded, was checksummed, gives its known answer and still is the file it was."""
    shelf = shelf_of(request)
    shelf.check()
    answer = {"status": "ready", "tables": [table.label for table in shelf.tables], **_VERSIONS}
    return Response(encode(answer), headers=_NO_STORE, media_type="application/json")
