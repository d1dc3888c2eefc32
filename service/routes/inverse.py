"""The inverse question: ``POST /v1/solve-for``."""

from typing import Any

import anyio.to_thread
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from friction.inverse import Reach, solve_for
from friction.nondim import UNITS
from service.answers import signature
from service.codecs import encode
from service.forms import SolveForRequest, read_form
from service.intake import read_body, refuse_query
from service.openapi import describe_json, json_body
from service.shelf import LoadedTable, shelf_of

__all__ = ["router"]

router = APIRouter(tags=["answers"])


@router.post(
    "/v1/solve-for",
    operation_id="post_solve_for",
    summary="The value of one input that gives a wanted mu_macro",
    response_class=Response,
    openapi_extra=json_body("SolveForRequest"),
    responses=describe_json("SolveForAnswer", 400, 401, 413, 415, 422, 503),
)
async def post_solve_for(request: Request) -> Response:
    """Return every root of every target.  A target that cannot be had has none; ``reachable`` says what can."""
    refuse_query(request)
    form = read_form(SolveForRequest, await read_body(request))
    case = form.inputs(form.unknown)
    table = shelf_of(request).pick(form.tolerance)
    content = await anyio.to_thread.run_sync(lambda: _answer(table, form, case))
    return Response(content, media_type="application/json")


def _answer(table: LoadedTable, form: SolveForRequest, case: dict[str, float | None]) -> bytes:
    targets = form.target if isinstance(form.target, list) else [form.target]
    within = (form.range[0], form.range[1]) if form.range is not None else None
    solution = solve_for(table.surrogate, form.unknown, targets, case, within)
    reach = solution.reach
    results = []
    for target, roots in zip(solution.targets, solution.roots, strict=True):
        result: dict[str, Any] = {
            "target": target,
            "roots": [
                {"value": r.value, "low": r.low, "high": r.high, "mu_macro": r.mu_macro, "regime": r.regime}
                for r in roots
            ],
        }
        if not roots:
            result["reason"] = _reason(form.unknown, target, reach, solution.constant)
        results.append(result)
    return encode(
        {
            "unknown": form.unknown,
            "unit": UNITS[form.unknown],
            "range": [reach.low, reach.high],
            "reachable": {
                "min": reach.mu_min,
                "max": reach.mu_max,
                "min_included": reach.min_included,
                "max_included": reach.max_included,
            },
            "results": results,
            **signature(table),
        }
    )


def _reason(unknown: str, target: float, reach: Reach, constant: bool) -> str:
    if constant:
        return f"{unknown} has no influence here: mu_macro is {reach.mu_min!r} for every value in the range"
    left, right = "[" if reach.min_included else "(", "]" if reach.max_included else ")"
    return f"{target!r} is not in the reachable range {left}{reach.mu_min!r}, {reach.mu_max!r}{right}"
