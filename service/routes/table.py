"""The table itself: ``GET /v1/table`` (metadata) and ``GET /v1/table.nc`` (the file)."""

from typing import Any

from pydantic import ValidationError
from starlette.requests import Request
from starlette.responses import Response

from mumacro.errors import TableError

from .. import __version__
from ..models import Strict, TableAnswer, model
from ..options import Positive, bounded
from ..problems import faults_of, refuse
from ..tables import LoadedTable
from ..wire.json import dump
from . import Endpoint, file_answer, given_in_query, reply

_tolerance = bounded("finite and > 0", "Wanted error of mu_macro/mu0 [-]", None)
Table = model("Table", "Choice of a table; the tightest by default.", Strict, tolerance=(Positive | None, _tolerance))


def _chosen(request: Request) -> LoadedTable:
    try:
        choice = Table.model_validate(given_in_query(request))
    except ValidationError as error:
        refuse(faults_of(error, Table, Table.model_fields))
    table: LoadedTable = request.app.tables.pick(choice.tolerance)
    return table


async def get_table(request: Request) -> Response:
    """Describe the default table, or the one chosen by ``tolerance``; list all that are loaded."""
    table = _chosen(request)
    surrogate = table.surrogate
    answer = {name: getattr(surrogate, name) for name in TableAnswer.model_fields if hasattr(surrogate, name)}
    others = {
        "file": surrogate.path.name,
        "size_bytes": table.size_bytes,
        "loaded": [other.label for other in request.app.tables.loaded],
        "service_version": __version__,
    }
    return reply(dump({**answer, **others, **table.signature}))


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
    Endpoint("/v1/table", "GET", get_table, "Properties of a table", Table, TableAnswer, tag="table"),
    Endpoint(
        "/v1/table.nc", "GET", get_table_file, "The table as a netCDF-4 file", Table, statuses=(416,), tag="table",
        content={
            200: {"description": "The file", "content": _FILE},
            206: {"description": "The part of it that Range requests", "content": _FILE},
        },
    ),
]  # fmt: skip
