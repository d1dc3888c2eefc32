"""Many cases at once: ``POST /v1/mu-macro/batch``, JSON columns or JSON rows."""

from collections.abc import Callable
from typing import Any

import anyio.to_thread
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from service.answers import answer_batch, signature
from service.codecs import columns_from_json, encode_columns, encode_rows, rows_from_json
from service.errors import FieldFault, InvalidFieldsError, OverloadedError
from service.intake import Options, options_from, options_from_query, parse_json, read_body
from service.openapi import describe_json, option_parameters
from service.shelf import LoadedTable, shelf_of

__all__ = ["router"]

router = APIRouter(tags=["answers"])

# A batch up to this size takes less time than a thread's round trip is worth.
_SMALL_BATCH = 256
_MAX_WAITING = 32


@router.post(
    "/v1/mu-macro/batch",
    operation_id="post_mu_macro_batch",
    summary="Macroscopic friction of many cases",
    response_class=Response,
    openapi_extra={
        "parameters": option_parameters(),
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {
                    "schema": {
                        "oneOf": [
                            {"$ref": "#/components/schemas/BatchColumns"},
                            {"type": "array", "items": {"$ref": "#/components/schemas/Case"}},
                        ]
                    }
                }
            },
        },
    },
    responses=describe_json(("ColumnsAnswer", "RowsAnswer"), 400, 401, 413, 415, 422, 503),
)
async def post_batch(request: Request) -> Response:
    """Answer in the form that was asked in, order kept.  A bad case has the result null and an entry in ``errors``."""
    options = options_from_query(request)
    body = await parse_json(await read_body(request))
    place = "parameter"
    if isinstance(body, dict):
        options, place = _merged(options, body)
    elif not isinstance(body, list):
        fault = FieldFault("body", "must be an object of columns or a list of rows", body, path=())
        raise InvalidFieldsError("the body must be an object of columns or a list of rows", [fault])
    table = shelf_of(request).pick(options.tolerance, place)
    max_batch: int = request.app.state.settings.max_batch
    content = await _run(request, _size(body), lambda: _answer(table, body, options, max_batch))
    return Response(content, media_type="application/json")


def _merged(query: Options, body: dict[str, Any]) -> tuple[Options, str]:
    own = options_from(body, "pointer")
    given = {"include": query.include, "tolerance": query.tolerance}
    twice = [name for name, value in given.items() if value and body.get(name) is not None]
    if twice:
        faults = [FieldFault(name, "is given in the query and in the body", body[name]) for name in twice]
        raise InvalidFieldsError(f"{twice[0]} is given in the query and in the body", faults)
    place = "pointer" if query.tolerance is None else "parameter"
    return Options(own.include or query.include, own.tolerance or query.tolerance), place


def _size(body: Any) -> int:
    if isinstance(body, list):
        return len(body)
    return max((len(column) for column in body.values() if isinstance(column, list)), default=1)


def _answer(table: LoadedTable, body: Any, options: Options, max_batch: int) -> bytes:
    if isinstance(body, list):
        batch, write = rows_from_json(body, max_batch), encode_rows
    else:
        batch, write = columns_from_json(body, max_batch), encode_columns
    answers = answer_batch(table.surrogate, batch, options.include)
    return write(answers, batch, signature(table))


async def _run(request: Request, size: int, work: Callable[[], bytes]) -> bytes:
    """Run a large batch in a worker thread, so that short requests are not kept waiting behind it."""
    if size <= _SMALL_BATCH:
        return work()
    limiter = request.app.state.batch_limiter
    waiting = limiter.statistics().tasks_waiting
    if waiting >= _MAX_WAITING:
        raise OverloadedError(f"{waiting} large batches are waiting already")
    return await anyio.to_thread.run_sync(work, limiter=limiter)
