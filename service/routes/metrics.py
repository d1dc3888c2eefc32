"""``GET /metrics``, for Prometheus: counts of all worker processes of the service."""

import anyio.to_thread
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..metrics import CONTENT_TYPE, Metrics
from ..openapi import problems

__all__ = ["router"]

router = APIRouter(tags=["health"])


@router.head("/metrics", include_in_schema=False)
@router.get(
    "/metrics",
    operation_id="get_metrics",
    summary="Counters for Prometheus",
    response_class=Response,
    responses={
        200: {
            "description": "Requests by route, method and status, their duration, cases by table, source and regime",
            "content": {"text/plain": {"schema": {"type": "string"}}},
        },
        **problems(401),
    },
)
async def get_metrics(request: Request) -> Response:
    """Return the text form, version 0.0.4."""
    metrics: Metrics = request.app.state.metrics
    text = await anyio.to_thread.run_sync(metrics.text)
    return Response(text, headers={"Cache-Control": "no-store", "Content-Type": CONTENT_TYPE})
