"""The table itself: ``GET /v1/table`` (metadata) and ``GET /v1/table.nc`` (the file)."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from mumacro.errors import TableError

from .. import __version__
from ..errors import accepts
from ..formats.columns import dump
from ..openapi import problems
from ..schemas import TableAnswer, TableChoice
from ..tables import LoadedTable, TablesDep, signature
from . import file_answer, once_each

__all__ = ["router"]

router = APIRouter(tags=["table"])
_FILE: dict[str, Any] = {"application/x-netcdf": {"schema": {"type": "string", "format": "binary"}}}


accepts("/v1/table", TableChoice.model_fields)
accepts("/v1/table.nc", TableChoice.model_fields)


async def _chosen(choice: Annotated[TableChoice, Query()], tables: TablesDep) -> LoadedTable:
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
        **problems(400, 401, 416, 422, 503),
        200: {"description": "The file", "content": _FILE},
        206: {"description": "The part of it that Range requests", "content": _FILE},
    },
    dependencies=[Depends(once_each)],
)
async def get_table_file(table: ChosenTable, request: Request) -> Response:
    """Stream the file from disk; ranges are supported.  It is the file that the answers come from."""
    # A file that was replaced after loading holds another table with the same name.
    table.check()
    path = table.surrogate.path
    headers = {"ETag": f'"{table.kernel.checksum}"', "Cache-Control": "no-cache"}
    try:
        return file_answer(request, path, headers, media_type="application/x-netcdf", filename=path.name)
    except OSError as error:
        raise TableError(path, "the file is gone") from error
