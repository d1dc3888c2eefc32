"""UM-Bridge 1.0 at the root: ``GET /Info`` and seven POSTs; the protocol itself is :mod:`service.umbridge`.

The C++ client fails with a path prefix, so the paths are at the root.  The body is read without a check of its
Content-Type: several clients send none for JSON.  Errors have the form of the protocol, never that of problem details.
"""

import json
import logging
from collections.abc import Awaitable, Callable
from typing import Any

from fastapi import APIRouter
from pydantic_core import from_json
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from mumacro.errors import MumacroError

from ..errors import BodyTooLargeError
from ..openapi import describe_umbridge, umbridge_body
from ..tables import tables_of
from ..umbridge import INFO, MODELS, OPERATIONS, UmBridgeError, model_of

__all__ = ["PATHS", "router", "umbridge_error"]

router = APIRouter(tags=["UM-Bridge 1.0"])

PATHS = frozenset({"/Info", *(f"/{name}" for name in OPERATIONS)})

_errors = logging.getLogger("mumacro.error")


def _write(content: dict[str, Any], status: int = 200) -> Response:
    return Response(json.dumps(content, allow_nan=False), status, media_type="application/json")


def umbridge_error(kind: str, message: str, status: int | None = None) -> Response:
    """An error in the protocol's form; ``status`` where HTTP has a better one (405)."""
    error = UmBridgeError(kind, message)
    return _write(error.as_json(), error.status if status is None else status)


@router.head("/Info", include_in_schema=False)
@router.get(
    "/Info", operation_id="Info", summary="The protocol's version and the models", response_class=Response,
    responses=describe_umbridge(INFO),
)  # fmt: skip
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
            return _write(operation(tables_of(request).pick().surrogate, model, body))
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


_POINT = {"input": [[0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01]]}
_WRT = {"outWrt": 0, "inWrt": 0}
#: operation -> what it does, the rest of an example's body
_DESCRIBED: dict[str, tuple[str, dict[str, Any]]] = {
    "ModelInfo": ("What the model supports", {}),
    "InputSizes": ("The sizes of its inputs: mu0, Fz, k, y0, omega, v0", {}),
    "OutputSizes": ("The sizes of its outputs: mu_macro", {}),
    "Evaluate": ("mu_macro", _POINT),
    "Gradient": ("Gradient of mu_macro, times sens", {**_WRT, **_POINT, "sens": [1.0]}),
    "ApplyJacobian": ("Jacobian of mu_macro, times vec", {**_WRT, **_POINT, "vec": [0.01, 0, 0, 0, 0, 0]}),
    "ApplyHessian": ("Not supported: always 400", {}),
}
for _name in OPERATIONS:
    _summary, _rest = _DESCRIBED[_name]
    router.add_api_route(
        f"/{_name}", _endpoint(_name), methods=["POST"], name=_name, operation_id=_name, summary=_summary,
        response_class=Response, openapi_extra=umbridge_body({"name": MODELS[0], **_rest}),
        responses=describe_umbridge(),
    )  # fmt: skip
