"""The application: ``create_app(settings)`` builds it from settings, tables, middleware and endpoints.

The import of this module does no work.  ``uvicorn --factory service.app:create_app`` works: without an argument the
settings are read from the environment.
"""

import gc
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.staticfiles import StaticFiles

from .limits import Keys, Work
from .observe import Metrics, Observe
from .openapi import describe
from .problems import problem_of
from .routes import Routes, batch, case, docs, health, law, page, solve_for, table
from .settings import Settings, load_settings, unknown_variables
from .tables import Tables
from .wire.json import dump

__all__ = ["Application", "create_app"]

ENDPOINTS = [
    endpoint for module in (case, batch, solve_for, law, table, health, docs, page) for endpoint in module.ENDPOINTS
]
_log = logging.getLogger("mumacro.app")


@asynccontextmanager
async def _lifespan(app: Any) -> AsyncIterator[dict[str, Any]]:
    for name in unknown_variables():
        _log.warning("%s is not a setting and has no effect", name)
    app.state.tables.load()
    app.state.metrics.start(app.state.tables)
    # A full collection visits a hundred thousand objects of the libraries, and no request is answered meanwhile.
    gc.collect()
    gc.freeze()
    yield {"settings": app.state.settings}
    app.state.work.close()


async def _problem(request: Request, error: Exception) -> Response:
    return problem_of(error, request.scope)


class Application(FastAPI):
    """The whole service.

    The endpoints are plain functions behind one route: FastAPI's solving of dependencies takes longer than an answer
    (docs/decisions/0011-wire.md).

    Attributes
    ----------
    state : State
        What the endpoints share: settings, tables, metrics, work, openapi.
    """

    def __init__(self, settings: Settings) -> None:
        super().__init__(
            openapi_url=None, docs_url=None, redoc_url=None, lifespan=_lifespan,
            exception_handlers={HTTPException: _problem},
        )  # fmt: skip
        keys = Keys(settings.keys())
        state = self.state
        state.settings, state.tables, state.work = settings, Tables(settings.tables), Work(settings)
        state.metrics = Metrics(frozenset(endpoint.path for endpoint in ENDPOINTS))
        state.openapi = dump(self.openapi())
        if settings.guide is not None:
            self.add_route("/guide", lambda _: RedirectResponse("guide/"))
            self.mount("/guide", StaticFiles(directory=settings.guide, html=True))
        self.mount("", Routes(ENDPOINTS))
        # The pages are the same for everyone and hold no number.  They ask for the key and send it with every request.
        opened = frozenset(endpoint.path for endpoint in ENDPOINTS if endpoint.open)
        self.add_middleware(
            Observe, metrics=state.metrics, keys=keys, open_paths=opened, guide=settings.guide is not None
        )
        if settings.cors_origins:
            self.add_middleware(
                CORSMiddleware,
                allow_origins=list(settings.cors_origins), allow_methods=["GET", "HEAD", "POST"],
                allow_headers=["Content-Type", "X-API-Key", "Authorization", "If-None-Match", "X-Request-ID"],
                expose_headers=["ETag", "X-Request-ID", "Retry-After"],
            )  # fmt: skip

    def openapi(self) -> dict[str, Any]:
        """The description of the interface."""
        settings: Settings = self.state.settings
        return describe(ENDPOINTS, settings.root_path, bool(settings.keys()))


def create_app(settings: Settings | None = None) -> Application:
    """Return the application; its tables are loaded when it starts.

    Parameters
    ----------
    settings : Settings, optional
        Left out: read from the environment.

    Raises
    ------
    SettingsError
        The environment holds a bad setting.
    """
    return Application(load_settings() if settings is None else settings)
