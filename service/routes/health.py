"""Health: ``/livez`` (the process answers), ``/readyz`` and its alias ``/healthz`` (answers are correct)."""

from fastapi import APIRouter
from starlette.responses import Response

from .. import API_VERSION, __version__
from ..formats.columns import dump
from ..openapi import problems
from ..schemas import Health
from ..tables import TablesDep

__all__ = ["router"]

router = APIRouter(tags=["health"])

_NO_STORE = {"Cache-Control": "no-store"}
_VERSIONS = {"api_version": API_VERSION, "service_version": __version__}


@router.head("/livez", include_in_schema=False)
@router.get(
    "/livez",
    operation_id="livez",
    summary="The process is alive",
    response_model=Health,
)
async def livez() -> Response:
    """Report that the process answers, also without a table: a restart would not repair a table."""
    return Response(dump({"status": "alive", **_VERSIONS}), headers=_NO_STORE, media_type="application/json")


@router.head("/healthz", include_in_schema=False)
@router.get(
    "/healthz",
    operation_id="healthz",
    summary="The same as /readyz",
    response_model=Health,
    responses=problems(503),
)
@router.head("/readyz", include_in_schema=False)
@router.get(
    "/readyz",
    operation_id="readyz",
    summary="The service is ready",
    response_model=Health,
    responses=problems(503),
)
async def readyz(tables: TablesDep) -> Response:
    """Check that every table is loaded, has the right checksum, gives its known answer and has an unchanged file."""
    tables.check()
    answer = {"status": "ready", "tables": [table.label for table in tables.loaded], **_VERSIONS}
    return Response(dump(answer), headers=_NO_STORE, media_type="application/json")
