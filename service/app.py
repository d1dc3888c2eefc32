"""Build the application: ``create_app(settings)`` makes it from settings, routers and middlewares.

The import of this module does no work.  ``uvicorn --factory service.app:create_app`` works: without
an argument the settings come from the environment.
"""

import asyncio
import ctypes
import gc
import logging
import os
import sys
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import orjson
from fastapi import FastAPI
from fastapi.middleware.asyncexitstack import AsyncExitStackMiddleware
from fastapi.openapi.constants import REF_TEMPLATE
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema
from starlette.datastructures import State
from starlette.middleware.cors import CORSMiddleware
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp

from . import __version__
from .admission import Admission, Thread, threads_end
from .guide_pages import GuidePages
from .metrics import Metrics
from .middleware import HEALTH_PATHS, SCHEMES, Direct, Entrance, Failures, HeadAsGet, Keys
from .models.answers import CaseAnswer, ColumnsAnswer, Problem, RowsAnswer
from .models.inputs import without_null
from .models.options import Case, CaseColumns, CaseRequest
from .observe import LogLines, Observe, Observer
from .routers import batch, case, contact, health, motion, page, questions, table
from .settings import Settings, load_settings, unknown_variables
from .tables import Tables

ROUTERS = (
    case.router,
    batch.router,
    questions.router,
    motion.router,
    contact.router,
    table.router,
    health.router,
)
_DESCRIPTION = (
    "Macroscopic coefficient of friction of a spring-loaded contact. A body slides at v0 and "
    "oscillates across or along the sliding direction, or its normal force does; the contact is "
    "one spring or a ball. Inputs in SI units; answers come from a table verified against the full "
    "model. Errors are problem details (RFC 9457)."
)
_TAGS = [
    {
        "name": "answers",
        "description": "The friction of one case and of many; questions about a "
        "range of one input; any periodic motion; what a contact is, from materials or from "
        "measured points",
    },
    {"name": "table", "description": "The verified table that the answers come from"},
    {"name": "health", "description": "For those who run the service: probes and counters"},
]
_LOOK_EVERY_S = 1.0  # seconds between two measurements of what the process holds
# A thread that computes in Python keeps the other threads waiting for this time, including the
# loop.  With Python's default of 5 ms a probe waited five times as long while 200 batches ran
# (docs/operations.md).
_SWITCH_S = 0.0002
# For glibc: number of an option in malloc.h -> its value.  A freed block of at least 4 MiB goes
# back to the system, and so does the free end of a heap above 16 MiB; all threads have one heap.
# glibc's own limits grow with the size of freed blocks, and each thread has a heap: so six batches
# of 9 MB at a time took 200 MB and left 150 MB, instead of 95 and 30 MB.  Lower limits cost time,
# because the system clears every page that it gives.  Other free blocks go back when work has
# ended.
_HEAPS = {
    -3: 4 * 2**20,  # M_MMAP_THRESHOLD
    -1: 16 * 2**20,  # M_TRIM_THRESHOLD
    -8: 1,  # M_ARENA_MAX
}
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None
# held while a description is made, because FastAPI cannot make two at the same time
_DESCRIBING = threading.Lock()
# time after the grace period (or after a stop without requests) until all work has ended
_END_S = 1.6
_log = logging.getLogger("mumacro.app")


def see_now(state: State) -> None:
    """Update the metrics with what this process holds now."""
    admission, lines = state.admission, LogLines.running
    state.metrics.now(
        connections=admission.connections(),
        slots_in_use=admission.slots,
        slots=state.settings.max_computations,
        waiting=len(admission.queue),
        held_bytes=admission.held_bytes,
        overloaded=admission.refused,
        log_lines_lost=lines.lost if lines else 0,
    )


async def _look(state: State) -> None:
    """Update the metrics, and when work has ended give its memory back to the system: free blocks
    between others, too, which takes about a millisecond."""
    trim, ended = getattr(_LIBC, "malloc_trim", None), 0
    while True:
        see_now(state)
        await asyncio.sleep(_LOOK_EVERY_S)
        if trim is not None and ended < state.admission.begun and not state.admission.slots:
            ended = state.admission.begun
            trim(0)


def _bound_heaps() -> None:
    """Let memory that large bodies have used go back to the system, if the system has glibc."""
    set_option = getattr(_LIBC, "mallopt", None)
    if set_option is not None:
        for number, value in _HEAPS.items():
            set_option(number, value)


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[dict[str, Any]]:
    for name in unknown_variables():
        _log.warning("%s is not a setting and has no effect", name)
    sys.setswitchinterval(_SWITCH_S)
    _bound_heaps()
    app.state.tables.load()
    app.state.metrics.start(app.state.tables)
    # A full collection visits a hundred thousand objects of the libraries, and meanwhile no request
    # is answered.
    gc.collect()
    gc.freeze()
    # Making the description takes half as long as the rest of the start.  FastAPI keeps it, so no
    # request has to wait for it.
    Thread(app.openapi)
    state = app.state
    looking = asyncio.create_task(_look(state))
    yield {"settings": state.settings, "observer": state.observer, "admission": state.admission}
    looking.cancel()
    await _end(state.admission)


async def _end(admission: Admission) -> None:
    """End all work within a fixed time, even if a thread waits for something such as a hanging file
    system.

    If Python ends while a thread is in compiled code, such as pydantic's, the process aborts.  So
    if a thread does not end, leave the process at once, unless it belongs to another server.
    """
    admission.end()
    now = asyncio.get_running_loop().time()
    seconds = min(admission.stops_at, now) + _END_S - now
    if not await threads_end(seconds) and (lines := LogLines.running):
        _log.warning("the process ends beside a thread that does not end")
        lines.flush()
        os._exit(0)


class Service(FastAPI):
    """Run FastAPI within our own middlewares only; the one that was added last is the outermost.

    :class:`Failures` answers every exception.  Starlette has two middlewares for this, and wraps
    every endpoint once more (docs/decisions.md).
    """

    def build_middleware_stack(self) -> ASGIApp:
        """Put the router within the middlewares; Starlette calls this once, at the start."""
        app: ASGIApp = AsyncExitStackMiddleware(self.router)  # FastAPI's own routes need it
        for cls, args, kwargs in reversed(self.user_middleware):
            app = cls(app, *args, **kwargs)
        return app

    def openapi(self) -> dict[str, Any]:
        """Return the description of the interface: FastAPI's, with what FastAPI cannot know; it is
        made once."""
        with _DESCRIBING:
            schema: dict[str, Any] = self.openapi_schema or _described(self)
            self.openapi_schema = schema
        return schema


def create_app(settings: Settings | None = None) -> FastAPI:
    """Return the application; it loads its tables when it starts.  By default the settings come
    from the environment."""
    settings = load_settings() if settings is None else settings
    app = Service(
        title="mumacro",
        version=__version__,
        description=_DESCRIPTION,
        openapi_tags=_TAGS,
        servers=[{"url": settings.root_path}] if settings.root_path else None,
        docs_url=None,  # the page of routers/page.py loads nothing from other hosts
        redoc_url=None,
        redirect_slashes=False,
        lifespan=_lifespan,
        # FastAPI would ask for a provider of OpenTelemetry at every request
        telemetry={"tracing": False, "metrics": False, "logs": False},
    )
    # include_router would search for the route of every request twice (docs/decisions.md); our
    # routes come before FastAPI's own
    app.router.routes[:0] = [route for one in (*ROUTERS, page.router) for route in one.routes]
    open_paths = {*HEALTH_PATHS, *page.OPEN}
    if settings.guide is not None:
        app.add_route("/guide", lambda _: RedirectResponse("guide/"), include_in_schema=False)
        app.mount("/guide", GuidePages(settings.guide))
        open_paths.add("/guide")
    state = app.state
    state.methods = _methods_of_paths(app)
    state.settings, state.tables = settings, Tables(settings.tables)
    state.admission = Admission(settings)
    state.metrics = Metrics({*state.methods, *page.OPEN})
    state.observer = Observer(state.metrics)
    keys = settings.keys()
    # the last one is the outermost
    app.add_middleware(Direct, routes=app.routes)
    if keys:
        app.add_middleware(Keys, keys=keys, open_paths=open_paths)
    app.add_middleware(Entrance)
    app.add_middleware(Failures)
    app.add_middleware(HeadAsGet)
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
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
    app.add_middleware(
        Observe, observer=state.observer, trusted_proxies=list(settings.trusted_proxies)
    )
    return app


def _methods_of_paths(app: FastAPI) -> dict[str, str]:
    """Return path -> the methods that it accepts, as in the header Allow."""
    methods: dict[str, set[str]] = {}
    for route in app.routes:
        of_path = methods.setdefault(getattr(route, "path", ""), set())
        of_path.update(getattr(route, "methods", None) or ())
        if "GET" in of_path:
            of_path.add("HEAD")
    return {path: ", ".join(sorted(of_path)) for path, of_path in methods.items()}


#: models that are described only by their name
_MORE: Any = [(model, "validation") for model in (Case, CaseRequest, CaseColumns)]
_MORE += [(model, "serialization") for model in (CaseAnswer, ColumnsAnswer, RowsAnswer, Problem)]


def _without_default(member: dict[str, Any]) -> None:
    """Describe in words the value of a member that is left out, because clients that are generated
    from the description require every member that has a default."""
    default = member.pop("default", None)
    if default is not None and "description" in member:
        default_text = default if isinstance(default, str) else orjson.dumps(default).decode()
        member["description"] += f"; left out: {default_text}"


def _described(app: FastAPI) -> dict[str, Any]:
    """Return FastAPI's description, with what FastAPI cannot know."""
    document: dict[str, Any] = get_openapi(
        title=app.title,
        version=app.version,
        description=app.description,
        routes=app.routes,
        tags=app.openapi_tags,
        servers=app.servers,
    )
    schemas = document["components"]["schemas"]
    schemas |= models_json_schema(_MORE, ref_template=REF_TEMPLATE)[1]["$defs"]
    for schema in schemas.values():
        for member in schema.get("properties", {}).values():
            _without_default(member)
    for path in document["paths"].values():
        for parameter in path.get("get", {}).get("parameters", ()):
            usual = {name: x for name, x in parameter["schema"].items() if name == "default"}
            without_null(parameter["schema"])
            parameter["schema"] |= usual
    if app.state.settings.keys():
        document |= {"security": [{name: []} for name in SCHEMES]}
        document["components"]["securitySchemes"] = SCHEMES
    return document
