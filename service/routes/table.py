"""The table itself: ``GET /v1/table`` (metadata) and ``GET /v1/table.nc`` (the file)."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from mumacro.errors import TableError

from .. import __version__
from ..errors import accepts
from ..formats.columns import dump
from ..openapi import problems
from ..schemas import TableAnswer, TableChoice
from ..tables import LoadedTable, TablesDep, signature
from . import etag_matches, once_each

__all__ = ["router"]

router = APIRouter(tags=["table"])


accepts("/v1/table", TableChoice.model_fields)
accepts("/v1/table.nc", TableChoice.model_fields)


def _chosen(choice: Annotated[TableChoice, Query()], tables: TablesDep) -> LoadedTable:
    return tables.pick(choice.tolerance, "parameter") if choice.id is None else tables.named(choice.id)


ChosenTable = Annotated[LoadedTable, Depends(_chosen)]


@router.head("/v1/table", include_in_schema=False)
@router.get(
    "/v1/table",
    operation_id="get_table",
    summary="Properties of a table",
    response_model=TableAnswer,
    responses=problems(401, 422, 503),
    dependencies=[Depends(once_each)],
)
async def get_table(table: ChosenTable, tables: TablesDep) -> Response:
    """Describe the default table, or the one chosen by ``id`` or ``tolerance``; list all that are loaded."""
    surrogate = table.surrogate
    answer = {
        "id": surrogate.id,
        "tolerance": surrogate.tolerance,
        "checksum": surrogate.checksum,
        "file": surrogate.path.name,
        "size_bytes": table.size_bytes,
        "max_abs_error": surrogate.max_abs_error,
        "max_rel_error": surrogate.max_rel_error,
        "attributes": surrogate.attributes,
        "blocks": surrogate.blocks,
        "loaded": [other.label for other in tables.loaded],
        "service_version": __version__,
        **signature(table),
    }
    return Response(dump(answer), media_type="application/json")


@router.head("/v1/table.nc", include_in_schema=False)
@router.get(
    "/v1/table.nc",
    operation_id="get_table_file",
    summary="The table as a netCDF-4 file",
    response_class=Response,
    responses={
        **problems(401, 422, 503),
        200: {
            "description": "The file",
            "content": {"application/x-netcdf": {"schema": {"type": "string", "format": "binary"}}},
        },
    },
    dependencies=[Depends(once_each)],
)
async def get_table_file(table: ChosenTable, request: Request) -> Response:
    """Stream the file from disk; ranges are supported.  It is the file that the answers come from."""
    # A file that was replaced after loading is another table with the same name.
    table.check()
    path = table.surrogate.path
    etag = f'"{table.kernel.checksum}"'
    headers = {"ETag": etag, "Cache-Control": "no-cache"}
    if etag_matches(request, etag):
        return Response(status_code=304, headers=headers)
    try:
        status = path.stat()
    except OSError as error:
        raise TableError(path, "the file is gone") from error
    return FileResponse(
        path, headers=headers, media_type="application/x-netcdf", filename=path.name, stat_result=status
    )
