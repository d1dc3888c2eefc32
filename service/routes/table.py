"""The state of the service: ``/livez`` (the process answers), ``/readyz`` and ``/healthz`` (answers
are correct), ``/metrics``; the table itself: ``/v1/table`` (metadata) and ``/v1/table.nc`` (the
file).
"""

from typing import Any

from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import ValidationError
from starlette.requests import Request
from starlette.responses import Response

from mumacro.errors import TableError

from .. import API_VERSION, __version__
from ..models import Health, Strict, TableAnswer, model
from ..options import Positive, bounded
from ..problems import faults_of, refuse
from ..tables import LoadedTable
from ..wire.json import dump
from . import Endpoint, Reply, file_answer, given_in_query

_NO_STORE = {"Cache-Control": "no-store"}
_VERSIONS = {"api_version": API_VERSION, "service_version": __version__}
_tolerance = bounded("finite and > 0", "Wanted error of mu_macro/mu0 [-]", None)
Table = model(
    "Table",
    "Choice of a table; the tightest by default.",
    Strict,
    tolerance=(Positive | None, _tolerance),
)


async def livez(_request: Request) -> Response:
    """Report that the process answers, also without a table: a restart would not repair a table."""
    return Reply(dump({"status": "alive", **_VERSIONS}), _NO_STORE)


async def readyz(request: Request) -> Response:
    """Check that every table is loaded, has the right checksum, gives its known answer and has an
    unchanged file."""
    tables = request.app.tables
    tables.check()
    return Reply(
        dump({"status": "ready", "tables": [table.label for table in tables.loaded], **_VERSIONS}),
        _NO_STORE,
    )


async def healthz(request: Request) -> Response:
    """Answer as /readyz."""
    return await readyz(request)


async def get_metrics(request: Request) -> Response:
    """Return the counters of all worker processes, in the text form of Prometheus."""
    text = await request.app.work.question(request.app.metrics.text)
    return Response(text, headers={**_NO_STORE, "Content-Type": CONTENT_TYPE_LATEST})


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
    loaded = [other.label for other in request.app.tables.loaded]
    return Reply(dump({**answer, "loaded": loaded, **table.signature}))


async def get_table_file(request: Request) -> Response:
    """Stream the file from disk; ranges are supported.  It is the file that the answers come
    from."""
    table = _chosen(request)
    table.check()  # a file that was replaced after loading holds another table with the same name
    path = table.surrogate.path
    headers = {"ETag": f'"{table.surrogate.checksum}"', "Cache-Control": "no-cache"}
    try:
        return file_answer(
            request, path, headers, media_type="application/x-netcdf", filename=path.name
        )
    except OSError as error:
        raise TableError(path, "the file is gone") from error


_TEXT = {
    "description": "Requests by route, method and status, their duration, cases by table, source "
    "and regime",
    "content": {"text/plain": {"schema": {"type": "string"}}},
}
_FILE: dict[str, Any] = {"application/x-netcdf": {"schema": {"type": "string", "format": "binary"}}}
_WHOLE, _PART = (
    {"description": text, "content": _FILE}
    for text in ("The file", "The part of it that Range requests")
)
ENDPOINTS = [
    Endpoint(
        "/v1/table", "GET", get_table, "Properties of a table", Table, TableAnswer, tag="table"
    ),
    Endpoint(
        "/v1/table.nc",
        "GET",
        get_table_file,
        "The table as a netCDF-4 file",
        Table,
        statuses=(416,),
        tag="table",
        content={200: _WHOLE, 206: _PART},
    ),
    Endpoint("/livez", "GET", livez, "The process is alive", model=Health, tag="health", open=True),
    Endpoint(
        "/readyz",
        "GET",
        readyz,
        "The service is ready",
        model=Health,
        statuses=(503,),
        tag="health",
        open=True,
    ),
    Endpoint(
        "/healthz",
        "GET",
        healthz,
        "As /readyz",
        model=Health,
        statuses=(503,),
        tag="health",
        open=True,
    ),
    Endpoint(
        "/metrics",
        "GET",
        get_metrics,
        "Counters for Prometheus",
        content={200: _TEXT},
        tag="health",
    ),
]
