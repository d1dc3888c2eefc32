"""The inverse problem: ``POST /v1/solve-for``."""

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from starlette.requests import Request
from starlette.responses import Response

from mumacro.inputs import field_of, unit_of
from mumacro.inverse import Solution, solve_for

from ..answers import DEFAULT, REGIME_NAMES, answer_columns, nested, parts_of
from ..models import Answered, included, many, model, optional, told
from ..options import NAMES, Five, Name, NotNegative, Options, bounded, example, relation
from ..wire.json import dump
from . import Asking, Endpoint, in_thread, reply

__all__ = ["ENDPOINTS"]

MAX_TARGETS = 10_000
_NO_LIMIT = 1e300
_Targets = Annotated[list[NotNegative], Field(min_length=1, max_length=MAX_TARGETS)]
_Quantity = Literal["mu_macro", "mu_ratio"]
_listed = BeforeValidator(lambda value: value if isinstance(value, list) else [value])


class SolveForOptions(Options):
    """What is asked beside the five known inputs."""

    unknown: Name = bounded(f"one of {', '.join(NAMES)}", "The input to solve for")
    target: Annotated[_Targets, _listed] = bounded(
        f"a number, finite and >= 0, or a list of 1 to {MAX_TARGETS} of them", "Wanted value [-]"
    )
    quantity: _Quantity = bounded(
        "mu_macro or mu_ratio", "What the target is; mu_ratio = mu_macro/mu0 (0.5 halves the friction)", "mu_macro"
    )
    range: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] | None = bounded(
        "two numbers, finite and >= 0, ascending", "Where to search [SI]; left out: wherever it changes mu_macro", None
    )

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        if self.quantity == "mu_ratio" and self.unknown == "mu0":
            raise relation("quantity", "must be mu_macro where mu0 is the unknown")
        return self


async def post_solve_for(request: Request) -> Response:
    """Return every root of every target.  A target out of reach has none; ``reachable`` is the range of mu_macro."""
    found = await Asking.of(request, SolveForOptions, "unknown")
    return await in_thread(request, lambda: reply(dump(_answer(found))))


def _answer(found: Asking) -> dict[str, Any]:
    (table, form, case, asked), (name, per) = found, field_of(found.form.unknown)
    unit = case["mu0"] if form.quantity == "mu_ratio" else 1.0
    within = (form.range[0] * per, form.range[1] * per) if form.range is not None else None
    if asked.interval:  # which is refused, by the name that the user gave
        case = {**case, "k_range": (case["k_low"], case["k_high"])}
    solution = solve_for(table.surrogate, name, [x * unit for x in form.target], case, within, **asked.kind.names)
    reach, more = solution.reach, iter(_included(found, name, solution))
    results: list[dict[str, Any]] = []
    for target, roots in zip(form.target, solution.roots, strict=True):
        in_unit = ({key: getattr(root, key) / per for key in ("value", "low", "high")} for root in roots)
        shown = [{**root._asdict(), **ends, **next(more)} for root, ends in zip(roots, in_unit, strict=True)]
        results.append(
            {"target": target, "roots": shown} | ({} if roots else {"reason": _reason(form, target, solution, unit)})
        )
    return {
        "unknown": form.unknown,
        "unit": unit_of(form.unknown),
        "quantity": form.quantity,
        "range": [reach.low / per, None if reach.high > _NO_LIMIT else reach.high / per],
        "reachable": {
            "min": reach.mu_min / unit, "max": reach.mu_max / unit,
            "min_included": reach.min_included, "max_included": reach.max_included,
        },
        "results": results,
        **table.signature,
    }  # fmt: skip


def _included(found: Asking, unknown: str, solution: Solution) -> list[dict[str, Any]]:
    """The included quantities of every root, in order."""
    (table, form, case, asked), include = found, found.form.names()
    values = np.array([root.value for roots in solution.roots for root in roots])
    if not include or not values.size:
        return [{}] * values.size
    six = [values if name == unknown else np.array([case[name]]) for name in asked.fields]
    answer, _ = answer_columns(table.surrogate, six, values.size, include, form.deviations(), asked)
    paths = [part.path for part in parts_of(include, asked)[len(DEFAULT) :]]
    rows = zip(*(answer[path].tolist() for path in paths), strict=True)
    return [nested(dict(zip(paths, row, strict=True))) for row in rows]


def _reason(form: SolveForOptions, target: float, solution: Solution, unit: float) -> str:
    reach = solution.reach
    low, high = reach.mu_min / unit, reach.mu_max / unit
    if solution.constant:
        return f"{form.unknown} has no influence here: {form.quantity} is {low!r} for every value in the range"
    left, right = "[" if reach.min_included else "(", "]" if reach.max_included else ")"
    return f"{target!r} is not in the reachable range {left}{low!r}, {high!r}{right}"


# --- models -------------------------------------------------------------------------------------------

SolveForRequest = model(
    "SolveForRequest", "Which value of one input gives a wanted mu_macro.", SolveForOptions, Five,
    target=told(NotNegative | _Targets, f"Wanted value [-], finite and >= 0: one, or a list of up to {MAX_TARGETS}"),
)  # fmt: skip
SolveForRequest.model_config["json_schema_extra"] = {
    "examples": [{name: value for name, value in example.items() if name != "y0"} | {"unknown": "y0", "target": 0.15}]
}
Root = model(
    "Root", "One value of the unknown, and the answer there.", value=told(float, "The unknown [SI]"),
    low=told(float, "From low ..."),
    high=told(float, "... to high, mu_macro is the target within the table's error bound"),
    mu_macro=told(float, "Value of the table there [-]"), regime=Literal[tuple(dict.fromkeys(REGIME_NAMES))],
    **included(False),
)  # fmt: skip
TargetAnswer = model(
    "TargetAnswer", "All values that give one target.", target=float,
    roots=told(many(Root), "Ascending; more than one where mu_macro is not monotonic (k, Fz, mu0)"),
    reason=optional(str, "Why there is no root"),
)  # fmt: skip
Reachable = model(
    "Reachable", "Range of mu_macro for all values of the unknown in its range.", min=float, max=float,
    min_included=told(bool, "false: approached, never reached"), max_included=bool,
)  # fmt: skip
SolveForAnswer = model(
    "SolveForAnswer", "Answer to the inverse problem.", Answered, unknown=Name, unit=str, quantity=_Quantity,
    range=told(list[float | None], "The searched range [SI]; null: without limit"), reachable=Reachable,
    results=told(many(TargetAnswer), "One per target, in order"),
)  # fmt: skip
ENDPOINTS = [
    Endpoint(
        "/v1/solve-for", "POST", post_solve_for, "The value of one input that gives a wanted mu_macro",
        SolveForRequest, SolveForAnswer,
    )
]  # fmt: skip
