"""Health: ``/livez`` (the process answers), ``/readyz`` and ``/healthz`` (answers are correct); and ``/metrics``."""

from prometheus_client import CONTENT_TYPE_LATEST
from starlette.requests import Request
from starlette.responses import Response

from .. import API_VERSION, __version__
from ..models import Health
from ..wire.json import dump
from . import Endpoint, reply

_NO_STORE = {"Cache-Control": "no-store"}
_VERSIONS = {"api_version": API_VERSION, "service_version": __version__}


async def livez(_request: Request) -> Response:
    """Report that the process answers, also without a table: a restart would not repair a table."""
    return reply(dump({"status": "alive", **_VERSIONS}), _NO_STORE)


async def readyz(request: Request) -> Response:
    """Check that every table is loaded, has the right checksum, gives its known answer and has an unchanged file."""
    tables = request.app.tables
    tables.check()
    return reply(dump({"status": "ready", "tables": [table.label for table in tables.loaded], **_VERSIONS}), _NO_STORE)


async def healthz(request: Request) -> Response:
    """Answer as /readyz."""
    return await readyz(request)


async def get_metrics(request: Request) -> Response:
    """Return the counters of all worker processes, in the text form of Prometheus."""
    text = await request.app.work.question(request.app.metrics.text)
    return Response(text, headers={**_NO_STORE, "Content-Type": CONTENT_TYPE_LATEST})


_TEXT = {
    "description": "Requests by route, method and status, their duration, cases by table, source and regime",
    "content": {"text/plain": {"schema": {"type": "string"}}},
}
ENDPOINTS = [
    Endpoint("/livez", "GET", livez, "The process is alive", model=Health, tag="health", open=True),
    Endpoint("/readyz", "GET", readyz, "The service is ready", model=Health, statuses=(503,), tag="health", open=True),
    Endpoint("/healthz", "GET", healthz, "As /readyz", model=Health, statuses=(503,), tag="health", open=True),
    Endpoint("/metrics", "GET", get_metrics, "Counters for Prometheus", content={200: _TEXT}, tag="health"),
]  # fmt: skip
