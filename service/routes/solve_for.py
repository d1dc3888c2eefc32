"""The inverse problem: ``POST /v1/solve-for``."""

import math
from typing import Any

import numpy as np
from fastapi import APIRouter, Depends
from starlette.requests import Request
from starlette.responses import Response

from mumacro.inverse import Reach, Solution, solve_for

from ..errors import accepts
from ..evaluation import Batch, answer_batch
from ..formats.columns import dump
from ..formats.rows import objects
from ..kernel import FIELDS, RAD_PER_CYCLE, UNITS
from ..openapi import problems
from ..questions import SolveForAnswer, SolveForRequest
from ..schemas import canonical, deviations
from ..tables import LoadedTable, TablesDep, signature
from . import JsonRoute, no_query

__all__ = ["router"]

router = APIRouter(tags=["answers"], route_class=JsonRoute)
_NO_LIMIT = 1e300
accepts("/v1/solve-for", SolveForRequest.model_fields)


@router.post(
    "/v1/solve-for",
    operation_id="post_solve_for",
    summary="The value of one input that gives a wanted mu_macro",
    response_model=SolveForAnswer,
    responses=problems(400, 401, 413, 415, 422, 503),
    dependencies=[Depends(no_query)],
)
async def post_solve_for(form: SolveForRequest, tables: TablesDep, request: Request) -> Response:
    """Return every root of every target.  A target out of reach has none; ``reachable`` is the range of mu_macro."""
    table = tables.pick(form.tolerance)
    content = await request.app.state.work.run_in_place(lambda: dump(_answer(table, form)))
    return Response(content, media_type="application/json")


def _answer(table: LoadedTable, form: SolveForRequest) -> dict[str, Any]:
    case = form.inputs()
    unknown = "omega" if form.unknown == "f" else form.unknown
    per_value = RAD_PER_CYCLE if form.unknown == "f" else 1.0
    unit = float(case["mu0"]) if form.quantity == "mu_ratio" else 1.0
    targets = form.target if isinstance(form.target, list) else [form.target]
    within = (form.range[0] * per_value, form.range[1] * per_value) if form.range is not None else None
    solution = solve_for(table.surrogate, unknown, [target * unit for target in targets], case, within)
    more = _included(table, form, solution, unknown, case)
    results = []
    for target, roots in zip(targets, solution.roots, strict=True):
        result: dict[str, Any] = {
            "target": target,
            "roots": [
                {
                    "value": root.value / per_value, "low": root.low / per_value, "high": root.high / per_value,
                    "mu_macro": root.mu_macro, "regime": root.regime, **next(more, {}),
                }
                for root in roots
            ],
        }  # fmt: skip
        if not roots:
            result["reason"] = _reason(form, target, solution.reach, solution.constant, unit)
        results.append(result)
    reach = solution.reach
    return {
        "unknown": form.unknown,
        "unit": UNITS[form.unknown],
        "quantity": form.quantity,
        "range": [reach.low / per_value, None if reach.high > _NO_LIMIT else reach.high / per_value],
        "reachable": {
            "min": reach.mu_min / unit,
            "max": reach.mu_max / unit,
            "min_included": reach.min_included,
            "max_included": reach.max_included,
        },
        "results": results,
        **signature(table),
    }


def _included(table: LoadedTable, form: SolveForRequest, solution: Solution, unknown: str, case: dict[str, Any]) -> Any:
    """The included quantities of every root, in order."""
    include = canonical(form.include)
    values = np.array([root.value for roots in solution.roots for root in roots])
    if not include or values.size == 0:
        return iter(())
    full = {"k": math.inf, **{name: math.inf if value is None else value for name, value in case.items()}}
    columns = [values if name == unknown else np.array([full[name]]) for name in FIELDS]
    answers = answer_batch(table, Batch(values.size, columns), include, deviations(form.std))
    return iter([entry or {} for entry in objects(answers, 0, values.size)])


def _reason(form: SolveForRequest, target: float, reach: Reach, constant: bool, unit: float) -> str:
    low, high = reach.mu_min / unit, reach.mu_max / unit
    if constant:
        return f"{form.unknown} has no influence here: {form.quantity} is {low!r} for every value in the range"
    left, right = "[" if reach.min_included else "(", "]" if reach.max_included else ")"
    return f"{target!r} is not in the reachable range {left}{low!r}, {high!r}{right}"
