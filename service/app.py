"""The application: ``create_app(settings)`` builds it from settings, tables and endpoints.

The import of this module does no work.  ``uvicorn --factory service.app:create_app`` works: without
an argument the settings are read from the environment.
"""

import gc
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.constants import REF_TEMPLATE
from pydantic.json_schema import models_json_schema
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from . import __version__
from .limits import Work
from .models import CaseAnswer, ColumnsAnswer, Problem, RowsAnswer
from .observe import Metrics, Observe
from .options import Case, CaseColumns
from .problems import problem_of
from .routes import Routes, batch, case, contact, page, questions, table
from .settings import Settings, load_settings, unknown_variables
from .tables import Tables
from .wire.json import dump

ENDPOINTS = [
    endpoint
    for module in (case, batch, questions, contact, table, page)
    for endpoint in module.ENDPOINTS
]
_DESCRIPTION = (
    "Macroscopic coefficient of friction of a spring-loaded contact. A body slides at v0 and "
    "oscillates across the sliding direction. Inputs in SI units; answers come from a table "
    "verified against the full model. Errors are problem details (RFC 9457)."
)
#: models that are described by name only
_MORE: Any = [(Case, "validation"), (CaseColumns, "validation"), (CaseAnswer, "serialization")]
_MORE += [(model, "serialization") for model in (ColumnsAnswer, RowsAnswer, Problem)]
_KEYS = {
    "key": {"type": "apiKey", "in": "header", "name": "X-API-Key"},
    "bearer": {"type": "http", "scheme": "bearer"},
}
_log = logging.getLogger("mumacro.app")


@asynccontextmanager
async def _lifespan(app: Any) -> AsyncIterator[dict[str, Any]]:
    for name in unknown_variables():
        _log.warning("%s is not a setting and has no effect", name)
    app.tables.load()
    app.metrics.start(app.tables)
    # A full collection visits a hundred thousand objects of the libraries, and no request is
    # answered meanwhile.
    gc.collect()
    gc.freeze()
    yield {"settings": app.settings}
    app.work.close()


async def _problem(request: Request, error: Exception) -> Response:
    return problem_of(error, request.scope)


class Application(FastAPI):
    """The whole service; the endpoints share its settings, tables, metrics and work.

    FastAPI describes the endpoints, starts and ends the application, and answers what is none of
    them (the guide). Requests to endpoints do not pass its layers (docs/decisions.md).
    """

    def __init__(self, settings: Settings) -> None:
        super().__init__(
            title="mumacro",
            version=__version__,
            description=_DESCRIPTION,
            docs_url=None,
            redoc_url=None,
            openapi_url=None,
            redirect_slashes=False,
            lifespan=_lifespan,
            exception_handlers={HTTPException: _problem},
            servers=[{"url": settings.root_path}] if settings.root_path else None,
        )
        self.settings, self.tables, self.work = settings, Tables(settings.tables), Work(settings)
        self.metrics = Metrics(frozenset(endpoint.path for endpoint in ENDPOINTS))
        for endpoint in ENDPOINTS:
            endpoint.describe_to(self)
        described = self.openapi()  # which FastAPI keeps
        described["components"]["schemas"] |= models_json_schema(_MORE, ref_template=REF_TEMPLATE)[
            1
        ]["$defs"]
        if settings.keys():
            described |= {"security": [{name: []} for name in _KEYS]}
            described["components"]["securitySchemes"] = _KEYS
        self.described = dump(described)
        # The pages are the same for everyone and hold no number.  They ask for the key and send it
        # with every request.
        opened = {endpoint.path for endpoint in ENDPOINTS if endpoint.open}
        if settings.guide is not None:
            self.add_route("/guide", lambda _: RedirectResponse("guide/"))
            self.mount("/guide", StaticFiles(directory=settings.guide, html=True))
            opened.add("/guide")
        self._front: ASGIApp = Observe(
            Routes(ENDPOINTS), super().__call__, self.metrics, settings, opened
        )
        if settings.cors_origins:
            self._front = CORSMiddleware(
                self._front,
                allow_origins=list(settings.cors_origins),
                allow_methods=["GET", "HEAD", "POST"],
                allow_headers=[
                    "Content-Type",
                    "X-API-Key",
                    "Authorization",
                    "If-None-Match",
                    "X-Request-ID",
                ],
                expose_headers=["ETag", "X-Request-ID", "Retry-After"],
            )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request; the events of start and end are FastAPI's."""
        scope["app"] = self
        await (self._front if scope["type"] == "http" else super().__call__)(scope, receive, send)


def create_app(settings: Settings | None = None) -> Application:
    """The application, whose tables are loaded when it starts; settings are read from the
    environment if left out."""
    return Application(load_settings() if settings is None else settings)
