"""Report the state of the service: ``/livez`` (the process answers), ``/readyz`` and ``/healthz``
(answers are correct), ``/metrics``."""

import asyncio
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from prometheus_client import CONTENT_TYPE_LATEST

from .. import API_VERSION, __version__
from ..json_text import Json
from ..models.answers import Health
from . import problems, router_of

router = router_of("health", APIRoute, prefix="")
_NO_STORE = {"Cache-Control": "no-store"}
_VERSIONS = {"api_version": API_VERSION, "service_version": __version__}
_READY: dict[int | str, Any] = {200: {"model": Health}, **problems(503)}


@router.get("/livez", responses={200: {"model": Health}}, summary="The process is alive")
async def livez() -> Response:
    """Report that the process answers, also without a table, because a restart would not repair a
    table."""
    return Json({"status": "alive", **_VERSIONS}, headers=_NO_STORE)


@router.get("/readyz", responses=_READY, summary="The service is ready")
async def readyz(request: Request) -> Response:
    """Check that every table is loaded, has the right checksum, gives its known answer and has an
    unchanged file."""
    tables = request.app.state.tables
    await tables.check()
    labels = [table.label for table in tables.loaded]
    return Json({"status": "ready", "tables": labels, **_VERSIONS}, headers=_NO_STORE)


@router.get("/healthz", responses=_READY, summary="As /readyz")
async def healthz(request: Request) -> Response:
    """Answer as /readyz does."""
    return await readyz(request)


_COUNTERS: dict[int | str, Any] = {
    200: {
        "description": "Requests by route, method and status, their duration, cases by table, "
        "source and regime",
        "content": {"text/plain": {"schema": {"type": "string"}}},
    },
    **problems(401, 503),
}


@router.get(
    "/metrics", response_class=Response, responses=_COUNTERS, summary="Counters for Prometheus"
)
async def get_metrics(request: Request) -> Response:
    """Return the counters of all worker processes, in the text format of Prometheus."""
    text = await asyncio.to_thread(request.app.state.metrics.text)  # without a slot
    return Response(text, headers={**_NO_STORE, "Content-Type": CONTENT_TYPE_LATEST})
