"""The application: ``create_app(settings)`` builds it from settings, tables, middleware and endpoints.

The import of this module does no work.  ``uvicorn --factory service.app:create_app`` works: without an argument the
settings are read from the environment.
"""

import gc
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from starlette.datastructures import State
from starlette.middleware.cors import CORSMiddleware
from starlette.responses import RedirectResponse
from starlette.routing import BaseRoute, Mount, Route, Router
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from .limits import Keys, Work
from .observe import Metrics, Observe
from .openapi import describe
from .routes import Routes, batch, case, docs, health, law, nothing_here, page, solve_for, table
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


class Application:
    """The whole service as an ASGI application.

    Attributes
    ----------
    state : State
        What the endpoints share: settings, tables, metrics, work, openapi.
    """

    def __init__(self, settings: Settings) -> None:
        keys = Keys(settings.keys())
        state = self.state = State()
        state.settings, state.tables, state.work = settings, Tables(settings.tables), Work(settings)
        state.metrics = Metrics(frozenset(endpoint.path for endpoint in ENDPOINTS))
        state.openapi = dump(self.openapi())
        others: list[BaseRoute] = []
        if settings.guide is not None:
            others.append(Route("/guide", lambda _: RedirectResponse("guide/")))
            others.append(Mount("/guide", StaticFiles(directory=settings.guide, html=True)))
        self.router = Router(others, redirect_slashes=False, default=nothing_here, lifespan=_lifespan)
        # The pages are the same for everyone and hold no number.  They ask for the key and send it with every request.
        opened = frozenset(endpoint.path for endpoint in ENDPOINTS if endpoint.open)
        app: ASGIApp = Observe(
            Routes(ENDPOINTS, self.router), state.metrics, keys, opened, guide=settings.guide is not None
        )
        if settings.cors_origins:
            app = CORSMiddleware(
                app, allow_origins=list(settings.cors_origins), allow_methods=["GET", "HEAD", "POST"],
                allow_headers=["Content-Type", "X-API-Key", "Authorization", "If-None-Match", "X-Request-ID"],
                expose_headers=["ETag", "X-Request-ID", "Retry-After"],
            )  # fmt: skip
        self._app = app

    def openapi(self) -> dict[str, Any]:
        """The description of the interface."""
        settings: Settings = self.state.settings
        return describe(ENDPOINTS, settings.root_path, bool(settings.keys()))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, start or stop."""
        scope["app"] = self
        await self._app(scope, receive, send)


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
