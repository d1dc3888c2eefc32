"""UM-Bridge 1.0 at the root: ``GET /Info`` and seven POSTs; the protocol itself is :mod:`service.umbridge`.

At the root, because the C++ client fails with a path prefix.  The body is read raw: several clients send no JSON
content type.  Whatever goes wrong here is told in the protocol's own form, never as problem details.
"""

import json
import logging
from collections.abc import Awaitable, Callable
from typing import Any

from fastapi import APIRouter
from pydantic_core import from_json
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from friction.errors import MumacroError
from service.errors import BodyTooLargeError
from service.shelf import shelf_of
from service.umbridge import INFO, OPERATIONS, UmBridgeError, model_of

__all__ = ["PATHS", "router", "umbridge_error"]

router = APIRouter(include_in_schema=False)

PATHS = frozenset({"/Info", *(f"/{name}" for name in OPERATIONS)})

_errors = logging.getLogger("mumacro.error")


def _write(content: dict[str, Any], status: int = 200) -> Response:
    return Response(json.dumps(content, allow_nan=False), status, media_type="application/json")


def umbridge_error(kind: str, message: str, status: int | None = None) -> Response:
    """An error in the protocol's form; ``status`` where HTTP has a better one (405)."""
    error = UmBridgeError(kind, message)
    return _write(error.as_json(), error.status if status is None else status)


@router.head("/Info")
@router.get("/Info")
async def info() -> Response:
    """Return the protocol's version and the names of the models."""
    return _write(INFO)


async def _parsed(request: Request) -> Any:
    try:
        return from_json(await request.body())
    except ValueError as error:
        raise UmBridgeError("InvalidInput", f"the body is not JSON: {error}") from None


def _endpoint(name: str) -> Callable[[Request], Awaitable[Response]]:
    operation = OPERATIONS[name]

    async def answer(request: Request) -> Response:
        try:
            body = await _parsed(request)
            model = model_of(body)
            return _write(operation(shelf_of(request).pick().surrogate, model, body))
        except UmBridgeError as error:
            return _write(error.as_json(), error.status)
        except MumacroError as error:  # no table, or a body over the limit
            kind = "InvalidInput" if isinstance(error, BodyTooLargeError) else "InvalidOutput"
            return umbridge_error(kind, str(error))
        except ClientDisconnect:
            raise
        except Exception:
            _errors.exception("unexpected error", extra={"fields": {"path": request.url.path}})
            return umbridge_error("InvalidOutput", "the request could not be answered; the log has the reason")

    return answer


for _name in OPERATIONS:
    router.add_api_route(f"/{_name}", _endpoint(_name), methods=["POST"], name=_name)
