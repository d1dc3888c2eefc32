"""The table itself: ``GET /v1/table`` (metadata) and ``GET /v1/table.nc`` (the file)."""

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from friction.errors import TableError
from service import __version__
from service.answers import signature
from service.codecs import encode
from service.intake import table_choice_from_query
from service.openapi import describe_json, table_parameters
from service.routes.mu_macro import etag_matches
from service.shelf import LoadedTable, shelf_of

__all__ = ["router"]

router = APIRouter(tags=["table"])


def _chosen(request: Request) -> LoadedTable:
    identity, tolerance = table_choice_from_query(request)
    shelf = shelf_of(request)
    return shelf.pick(tolerance, "parameter") if identity is None else shelf.named(identity)


@router.head("/v1/table", include_in_schema=False)
@router.get(
    "/v1/table",
    operation_id="get_table",
    summary="What is known of a table",
    response_class=Response,
    openapi_extra={"parameters": table_parameters()},
    responses=describe_json("TableAnswer", 401, 422, 503),
)
async def get_table(request: Request) -> Response:
    """Describe the default table, or the one chosen by ``id`` or ``tolerance``; list all that are loaded."""
    table = _chosen(request)
    surrogate = table.surrogate
    shelf = shelf_of(request)
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
        "loaded": [other.label for other in shelf.tables],
        "service_version": __version__,
        **signature(table),
    }
    return Response(encode(answer), media_type="application/json")


@router.head("/v1/table.nc", include_in_schema=False)
@router.get(
    "/v1/table.nc",
    operation_id="get_table_file",
    summary="The table as a netCDF-4 file",
    response_class=Response,
    openapi_extra={"parameters": table_parameters()},
    responses={
        **describe_json("TableAnswer", 401, 422, 503),
        200: {
            "description": "The file",
            "content": {"application/x-netcdf": {"schema": {"type": "string", "format": "binary"}}},
        },
    },
)
async def get_table_file(request: Request) -> Response:
    """Stream the file from disk; ranges are supported.  It is the very file that the answers come from."""
    table = _chosen(request)
    # A file that was replaced after loading would be another table under this one's name.
    table.check()
    path = table.surrogate.path
    etag = f'"{table.surrogate.seal}"'
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
