"""The application: ``create_app(settings)`` puts settings, tables, middleware, handlers and routes together.

Nothing happens at import.  ``uvicorn --factory service.app:create_app`` works: without an argument the settings
come from the environment.
"""

import asyncio
import logging
import os
import sys
import threading
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from functools import partial

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import Response

from friction.errors import MumacroError
from service import __version__
from service.connection import sweep
from service.drain import draining
from service.errors import answer_problem
from service.logs import AccessLog
from service.memory import keep_lean
from service.metrics import Metrics
from service.middleware import HEALTH_PATHS, ApiKeyGate, BodyLimit, Compression, RequestRecord
from service.openapi import install
from service.routes import batch, docs, health, inverse, law, mu_macro, page, table, umbridge
from service.routes import metrics as metrics_route
from service.routes.batch import BatchEndpoint
from service.settings import Settings, load_settings, unknown_variables
from service.shelf import Shelf
from service.warm import prepare, settle_memory
from service.wire import Application, ShortWay

__all__ = ["create_app"]

_ROUTERS = (
    mu_macro.router, batch.router, inverse.router, law.router, table.router, health.router, metrics_route.router,
    docs.router, umbridge.router, page.router,
)  # fmt: skip
# The pages are the same for everyone and tell nothing; they ask their user for the key and send it with every question.
_OPEN_PATHS = HEALTH_PATHS | page.OPEN_PATHS | docs.OPEN_PATHS
_NICENESS = 5  # of threads for batches: a third of the weight
_log = logging.getLogger("mumacro.app")


def _stand_back() -> None:
    """Let who answers short requests go first where both want one processor.  On Linux threads have priorities."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    for name in unknown_variables():
        _log.warning("%s is no setting and has no effect", name)
    state = app.state
    settings: Settings = state.settings
    with ThreadPoolExecutor(1) as start:
        await asyncio.get_running_loop().run_in_executor(start, prepare, state.shelf)
    with ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="batch", initializer=_stand_back) as threads:
        state.metrics.start([table.label for table in state.shelf.tables])
        state.access_log.start()
        state.batches.start(threads)
        settle_memory()
        always = [sweep(settings.client_timeout_s), state.metrics.share()]
        if threading.current_thread() is threading.main_thread():  # as settle_memory
            always.append(keep_lean(partial(asyncio.get_running_loop().run_in_executor, threads)))
        tasks = [asyncio.create_task(work) for work in always]
        with draining(state.shelf, settings.drain_s):
            yield
        for task in tasks:
            task.cancel()
        state.metrics.save()


def create_app(settings: Settings | None = None) -> Application:
    """Return the application.

    Parameters
    ----------
    settings : Settings, optional
        Left out: read from the environment.

    Raises
    ------
    SettingsError
        The environment holds a bad setting.
    """
    if settings is None:
        settings = load_settings()
    key = None if settings.api_key is None else settings.api_key.get_secret_value()
    metrics, access_log, shelf = Metrics(), AccessLog(), Shelf(settings.tables)
    app = Application(
        title="mumacro",
        version=__version__,
        lifespan=_lifespan,
        docs_url=None,  # FastAPI's own pages load their assets from a CDN; routes/docs.py has ours
        redoc_url=None,
        redirect_slashes=False,
        middleware=[
            Middleware(RequestRecord, metrics=metrics, log=access_log),
            Middleware(ApiKeyGate, key=key, open_paths=_OPEN_PATHS),
            Middleware(BodyLimit, max_bytes=settings.max_body_bytes),
            Middleware(Compression),
        ],
    )
    app.state.settings = settings
    app.state.shelf = shelf
    app.state.metrics = metrics
    app.state.access_log = access_log
    app.state.batches = BatchEndpoint(shelf, settings, metrics)
    app.batch_way = RequestRecord(ApiKeyGate(app.state.batches, key), metrics, access_log)
    app.short = ShortWay(app.long_way, app.state.batches.small, shelf, settings, metrics, access_log)
    app.add_exception_handler(MumacroError, answer_problem)
    app.add_exception_handler(HTTPException, _answer_http)
    for router in _ROUTERS:
        app.include_router(router)
    install(app)
    return app


async def _answer_http(request: Request, error: Exception) -> Response:
    """Answer 404 and 405.  The framework's Allow names the methods of the first route of a path only."""
    path = request.url.path
    if isinstance(error, HTTPException) and error.status_code == 405:
        allowed = _allowed_methods(path)
        if path in umbridge.PATHS:
            answer = umbridge.umbridge_error("UnsupportedFeature", f"{path} takes {allowed}", 405)
            answer.headers["Allow"] = allowed
            return answer
        error = HTTPException(
            405, f"{request.method} is not allowed here; allowed: {allowed}", headers={"Allow": allowed}
        )
    elif isinstance(error, HTTPException) and error.status_code == 404:
        error = HTTPException(404, "There is nothing at this path.")
    return await answer_problem(request, error)


def _allowed_methods(path: str) -> str:
    methods: set[str] = {"GET", "HEAD"} if path == "/openapi.json" else set()
    for router in _ROUTERS:
        for route in router.routes:
            if isinstance(route, APIRoute) and route.path == path:
                methods |= route.methods or set()
    return ", ".join(sorted(methods))
