"""Serve the table itself: ``/v1/table`` (metadata) and ``/v1/table.nc`` (the file)."""

from typing import Annotated, Any

from fastapi import Query, Request, Response
from pydantic import Field

from mumacro.errors import TableError

from .. import __version__
from ..json_text import Json
from ..models.answers import TableAnswer
from ..models.inputs import Strict
from ..models.values import Positive
from . import GET_PROBLEMS, file_answer, problems, router_of

router = router_of("table")


class TableQuery(Strict):
    """Choice of a table; the tightest by default."""

    tolerance: Positive | None = Field(None, description="Error of mu_macro/mu0 [-]")


Chosen = Annotated[TableQuery, Query()]


@router.get(
    "/table",
    responses={200: {"model": TableAnswer}, **GET_PROBLEMS},
    summary="Properties of a table",
)
async def get_table(request: Request, query: Chosen) -> Response:
    """Describe the default table, or the one chosen by ``tolerance``; list all that are loaded."""
    tables = request.app.state.tables
    table = tables.pick(query.tolerance)
    surrogate = table.surrogate
    answer = {
        name: getattr(surrogate, name)
        for name in TableAnswer.model_fields
        if hasattr(surrogate, name)
    }
    answer |= {
        "file": surrogate.path.name,
        "size_bytes": table.stamp[0],
        "service_version": __version__,
    }
    loaded = [other.label for other in tables.loaded]
    return Json({**answer, "loaded": loaded, **table.signature})


_FILE: Any = {"application/x-netcdf": {"schema": {"type": "string", "format": "binary"}}}
_PARTS: dict[int | str, Any] = {
    200: {"description": "The file", "content": _FILE},
    206: {"description": "The part of it that Range requests", "content": _FILE},
}


@router.get(
    "/table.nc",
    response_class=Response,
    responses={**_PARTS, **GET_PROBLEMS, **problems(416)},
    summary="The table as a netCDF-4 file",
)
async def get_table_file(request: Request, query: Chosen) -> Response:
    """Stream the file from disk; ranges are supported.  The answers come from this file."""
    tables = request.app.state.tables
    table = tables.pick(query.tolerance)
    await tables.check()  # a file that was replaced has another table of the same name
    path = table.surrogate.path
    headers = {"ETag": f'"{table.surrogate.checksum}"', "Cache-Control": "no-cache"}
    try:
        return file_answer(
            request, path, headers, media_type="application/x-netcdf", filename=path.name
        )
    except OSError as error:
        raise TableError(path, "the file is gone") from error
