"""The application: ``create_app(settings)`` builds it from settings, tables, middleware, handlers and routes.

The import of this module does no work.  ``uvicorn --factory service.app:create_app`` works: without an argument the
settings are read from the environment.
"""

import asyncio
import gc
import logging
import os
import sys
import threading
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from pathlib import Path

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.staticfiles import StaticFiles

from mumacro.errors import MumacroError
from mumacro.processors import processors

from . import __version__
from .connection import Connection
from .errors import answer_problem, invalid_request
from .guard import Guard, Keys, Work, path_of
from .logs import AccessLog
from .metrics import Metrics
from .middleware import HEALTH_PATHS, Compression, RequestRecord
from .openapi import install
from .routes import batch, docs, health, law, mu_macro, page, solve_for, table, umbridge
from .routes import metrics as metrics_route
from .settings import Settings, load_settings, unknown_variables
from .shutdown import draining, end_with_parent
from .single import SingleCase
from .tables import Tables

__all__ = ["create_app", "load"]

_ROUTERS = (
    mu_macro.router, batch.router, solve_for.router, law.router, table.router, health.router, metrics_route.router,
    docs.router, umbridge.router, page.router,
)  # fmt: skip
# The pages are the same for everyone and hold no number. They ask for the key and send it with every request.
_OPEN_PATHS = HEALTH_PATHS | page.OPEN_PATHS | docs.OPEN_PATHS
_NICENESS = 5  # of threads for batches: a third of the usual share of a processor
_log = logging.getLogger("mumacro.app")


def _stand_back() -> None:
    """Lower the priority of this thread, so that short requests are answered first.  Linux only."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


def load(tables: Tables) -> None:
    """Load the tables, then the compiled code that the first answers do not need."""
    tables.load()
    tables.warm_up_more()


async def _start(app: FastAPI, threads: ThreadPoolExecutor) -> None:
    """Load the tables, become ready, then load the rest; ``/livez`` is answered meanwhile."""
    loop = asyncio.get_running_loop()
    tables: Tables = app.state.tables
    await loop.run_in_executor(threads, tables.load, app.state.metrics.start)
    if not tables.loaded:
        app.state.metrics.start([])
    _freeze()
    tables.ready = tables.fault is None
    try:
        await loop.run_in_executor(threads, tables.warm_up_more)
    except Exception:
        _log.exception("some compiled code could not be loaded")
    _freeze()


def _freeze() -> None:
    """Exclude all present objects from garbage collection.

    A full collection visits a hundred thousand objects of the libraries; for about 0.1 s no request is answered.  So
    the first one is made before the service is ready; later ones do not visit frozen objects.
    """
    if threading.current_thread() is threading.main_thread():
        gc.collect()
        gc.freeze()


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    for name in unknown_variables():
        _log.warning("%s is not a setting and has no effect", name)
    end_with_parent()
    state = app.state
    Connection.timeout_s = state.settings.client_timeout_s
    count = processors()
    threads = ThreadPoolExecutor(count, thread_name_prefix="batch", initializer=_stand_back)
    state.work.threads = threads
    state.access_log.start()
    # A separate thread: it does not wait for batches and keeps its priority.
    start = ThreadPoolExecutor(1, thread_name_prefix="start")
    starting = asyncio.create_task(_start(app, start))
    sharing = asyncio.create_task(state.metrics.share())
    if state.wait:
        await starting
    try:
        with draining(state.tables, state.settings):
            yield
    finally:
        for task in (starting, sharing):
            task.cancel()
        state.metrics.save()
        for pool in (threads, start):
            pool.shutdown(wait=False, cancel_futures=True)


def create_app(settings: Settings | None = None, *, wait: bool = False) -> FastAPI:
    """Return the application.

    Parameters
    ----------
    settings : Settings, optional
        Left out: read from the environment.
    wait : bool
        Finish the start only when everything is loaded.  By default the application listens at once, and ``/readyz``
        answers 200 when the tables are loaded.

    Raises
    ------
    SettingsError
        The environment holds a bad setting.
    """
    if settings is None:
        settings = load_settings()
    metrics, access_log, tables, work = Metrics(), AccessLog(), Tables(settings.tables), Work(settings)
    keys, open_paths = Keys(settings.keys()), _OPEN_PATHS | _guide_paths(settings.guide)
    cors = [
        Middleware(
            CORSMiddleware, allow_origins=list(settings.cors_origins), allow_methods=["GET", "HEAD", "POST"],
            allow_headers=["Content-Type", "X-API-Key", "Authorization", "If-None-Match", "X-Request-ID"],
            expose_headers=["ETag", "X-Request-ID", "Retry-After"],
        )
    ] if settings.cors_origins else []  # fmt: skip
    app = FastAPI(
        title="mumacro",
        version=__version__,
        lifespan=_lifespan,
        openapi_url=None,  # routes/docs.py has it, made in a thread,
        docs_url=None,  # and a page: FastAPI's own pages load their assets from a CDN
        redoc_url=None,
        redirect_slashes=False,
        root_path=settings.root_path,
        strict_content_type=False,
        telemetry={"metrics": False, "logs": False, "tracing": settings.tracing},
        middleware=[
            *cors,
            Middleware(SingleCase, tables=tables, settings=settings, metrics=metrics, log=access_log, keys=keys),
            Middleware(RequestRecord, metrics=metrics, log=access_log, tables=tables),
            Middleware(Guard, keys=keys, open_paths=open_paths, max_bytes=settings.max_body_bytes),
            Middleware(Compression),
        ],
    )
    state = app.state
    state.settings, state.tables, state.metrics, state.access_log = settings, tables, metrics, access_log
    state.work, state.wait = work, wait
    state.batches = batch.Batches(tables, work, metrics, settings.max_body_bytes, settings.max_batch)
    app.add_exception_handler(MumacroError, answer_problem)
    app.add_exception_handler(HTTPException, _answer_http)
    app.add_exception_handler(RequestValidationError, _answer_invalid)
    for router in _ROUTERS:
        app.include_router(router)
    if settings.guide is not None:
        app.mount("/guide/", StaticFiles(directory=settings.guide, html=True))
        app.router.add_route("/guide", lambda _: RedirectResponse("guide/"), include_in_schema=False)
    install(app, keys=bool(keys))
    return app


def _guide_paths(folder: Path | None) -> set[str]:
    """Paths of the documentation.  They need no API key."""
    if folder is None:
        return set()
    below = ((path.relative_to(folder).as_posix(), path.is_dir()) for path in folder.rglob("*"))
    return {"/guide", "/guide/", *(f"/guide/{name}/" if is_folder else f"/guide/{name}" for name, is_folder in below)}


async def _answer_invalid(request: Request, error: Exception) -> Response:
    """Answer 400 or 422 where FastAPI refused the body or the query."""
    assert isinstance(error, RequestValidationError)  # noqa: S101  (what it is registered for)
    return await answer_problem(request, invalid_request(path_of(request.scope), error.errors()))


async def _answer_http(request: Request, error: Exception) -> Response:
    """Answer 404 and 405.  The framework's Allow names the methods of the first route of a path only."""
    path = path_of(request.scope)
    if isinstance(error.__cause__, MumacroError):  # raised while the framework read the body
        return await answer_problem(request, error.__cause__)
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
    methods: set[str] = {"GET", "HEAD"} if path.startswith("/guide") else set()
    for router in _ROUTERS:
        for route in router.routes:
            if isinstance(route, APIRoute) and route.path == path:
                methods |= route.methods or set()
    return ", ".join(sorted(methods))
