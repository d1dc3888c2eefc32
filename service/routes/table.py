"""The table itself: ``GET /v1/table`` (metadata) and ``GET /v1/table.nc`` (the file)."""

from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError
from starlette.requests import Request
from starlette.responses import Response

from mumacro.errors import TableError

from .. import __version__
from ..models import TableAnswer
from ..options import Positive, bounded, query_of
from ..problems import faults_of, refuse
from ..tables import LoadedTable
from ..wire.json import dump
from . import Endpoint, file_answer, given_in_query, reply

__all__ = ["ENDPOINTS"]


class TableChoice(BaseModel):
    """Choice of a table; without a tolerance, the tightest."""

    model_config = ConfigDict(strict=True, extra="forbid")

    tolerance: Positive | None = bounded("finite and > 0", "Wanted error of mu_macro/mu0 [-]", None)


TableQuery: Any = query_of("TableQuery", TableChoice)


def _chosen(request: Request) -> LoadedTable:
    try:
        choice = TableChoice.model_validate(given_in_query(request))
    except ValidationError as error:
        refuse(faults_of(error, TableChoice, TableChoice.model_fields))
    table: LoadedTable = request.app.state.tables.pick(choice.tolerance)
    return table


async def get_table(request: Request) -> Response:
    """Describe the default table, or the one chosen by ``tolerance``; list all that are loaded."""
    table = _chosen(request)
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
        "loaded": [other.label for other in request.app.state.tables.loaded],
        "service_version": __version__,
        **table.signature,
    }
    return reply(dump(answer))


async def get_table_file(request: Request) -> Response:
    """Stream the file from disk; ranges are supported.  It is the file that the answers come from."""
    table = _chosen(request)
    table.check()  # a file that was replaced after loading holds another table with the same name
    path = table.surrogate.path
    headers = {"ETag": f'"{table.surrogate.checksum}"', "Cache-Control": "no-cache"}
    try:
        return file_answer(request, path, headers, media_type="application/x-netcdf", filename=path.name)
    except OSError as error:
        raise TableError(path, "the file is gone") from error


_FILE: dict[str, Any] = {"application/x-netcdf": {"schema": {"type": "string", "format": "binary"}}}
ENDPOINTS = [
    Endpoint(
        "/v1/table", "GET", get_table, "Properties of a table",
        query=TableQuery, model=TableAnswer, tag="table",
    ),
    Endpoint(
        "/v1/table.nc", "GET", get_table_file, "The table as a netCDF-4 file",
        query=TableQuery, statuses=(416,), tag="table",
        content={
            200: {"description": "The file", "content": _FILE},
            206: {"description": "The part of it that Range requests", "content": _FILE},
        },
    ),
]  # fmt: skip
