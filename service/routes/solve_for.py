"""The inverse problem: ``POST /v1/solve-for``."""

import itertools
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, Field, create_model, model_validator
from starlette.requests import Request
from starlette.responses import Response

from mumacro.contact import AMPLITUDE
from mumacro.inputs import RAD_PER_CYCLE
from mumacro.inverse import Solution, solve_for

from ..answers import DEFAULT, REGIME_NAMES, answer_columns, nested, parts_of
from ..case import INPUTS, Asked
from ..models import Answered, included
from ..options import UNITS, NotNegative, Options, bounded, example, input_fields, read_form, relation
from ..tables import LoadedTable
from ..wire.json import dump
from . import Endpoint, given_in_body, in_thread, reply

__all__ = ["ENDPOINTS", "FIVE", "FIVE_QUERY", "NAMES", "Name", "in_si", "per_value"]

MAX_TARGETS = 10_000
_NO_LIMIT = 1e300
NAMES = (*INPUTS, AMPLITUDE)
Name: Any = Literal[NAMES]
FIVE_QUERY: Any = input_fields(optional=INPUTS, null=False, shown=["k"], query=True)
FIVE: Any = create_model("_Five", **input_fields(optional=INPUTS, shown=[name for name in example if name != "v0"]))
Targets = Annotated[list[NotNegative], Field(min_length=1, max_length=MAX_TARGETS)]
_listed = BeforeValidator(lambda value: value if isinstance(value, list) else [value])


class SolveForOptions(Options):
    """What is asked beside the five known inputs."""

    unknown: Name = bounded(f"one of {', '.join(NAMES)}", "The input to solve for")
    target: Annotated[Targets, _listed] = bounded(
        f"a number, finite and >= 0, or a list of 1 to {MAX_TARGETS} of them", "Wanted value [-]"
    )
    quantity: Literal["mu_macro", "mu_ratio"] = bounded(
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
    given = await given_in_body(request)
    form, case, _ = read_form(SolveForOptions, given, [given["unknown"]] if given.get("unknown") in NAMES else [])
    table = request.app.state.tables.pick(form.tolerance)
    return await in_thread(request, lambda: reply(dump(_answer(table, form, case))))


def in_si(name: str) -> str:
    """The field of an input: omega for f."""
    return "omega" if name == "f" else name


def per_value(name: str) -> float:
    """Factor from a value of this name to its field: omega [rad/s] from f [Hz]."""
    return RAD_PER_CYCLE if name == "f" else 1.0


def _answer(table: LoadedTable, form: SolveForOptions, case: dict[str, float]) -> dict[str, Any]:
    per = per_value(form.unknown)
    unit = case["mu0"] if form.quantity == "mu_ratio" else 1.0
    within = (form.range[0] * per, form.range[1] * per) if form.range is not None else None
    names = form.kind.names
    if "k_low" in case:  # which is refused, by the name that the user gave
        case = {**case, "k_range": (case["k_low"], case["k_high"])}
    solution = solve_for(table.surrogate, in_si(form.unknown), [x * unit for x in form.target], case, within, **names)
    more = _included(table, form, solution, case)
    results: list[dict[str, Any]] = []
    for target, roots in zip(form.target, solution.roots, strict=True):
        told = [
            {**root._asdict(), "value": root.value / per, "low": root.low / per, "high": root.high / per, **next(more)}
            for root in roots
        ]
        results.append({"target": target, "roots": told})
        if not roots:
            results[-1]["reason"] = _reason(form, target, solution, unit)
    reach = solution.reach
    return {
        "unknown": form.unknown,
        "unit": UNITS[form.unknown],
        "quantity": form.quantity,
        "range": [reach.low / per, None if reach.high > _NO_LIMIT else reach.high / per],
        "reachable": {
            "min": reach.mu_min / unit, "max": reach.mu_max / unit,
            "min_included": reach.min_included, "max_included": reach.max_included,
        },
        "results": results,
        **table.signature,
    }  # fmt: skip


def _included(
    table: LoadedTable, form: SolveForOptions, solution: Solution, case: dict[str, float]
) -> Iterator[dict[str, Any]]:
    """The included quantities of every root, in order."""
    values = np.array([root.value for roots in solution.roots for root in roots])
    asked = Asked(form.kind)
    parts = parts_of(form.names(), asked)[len(DEFAULT) :]
    if not parts or values.size == 0:
        return itertools.repeat({})
    six = [values if name == in_si(form.unknown) else np.array([case[name]]) for name in asked.fields]
    found, _ = answer_columns(table.surrogate, six, values.size, form.names(), form.deviations(), asked)
    rows = zip(*(part.values(found[part.path]) for part in parts), strict=True)
    return (nested(dict(zip((part.path for part in parts), row, strict=True))) for row in rows)


def _reason(form: SolveForOptions, target: float, solution: Solution, unit: float) -> str:
    reach = solution.reach
    low, high = reach.mu_min / unit, reach.mu_max / unit
    if solution.constant:
        return f"{form.unknown} has no influence here: {form.quantity} is {low!r} for every value in the range"
    left, right = "[" if reach.min_included else "(", "]" if reach.max_included else ")"
    return f"{target!r} is not in the reachable range {left}{low!r}, {high!r}{right}"


# --- models -------------------------------------------------------------------------------------------

_target: Any = (
    NotNegative | Targets,
    Field(description=f"Wanted value [-], finite and >= 0: one, or a list of up to {MAX_TARGETS}"),
)
SolveForRequest: Any = create_model(
    "SolveForRequest", __base__=(SolveForOptions, FIVE), __doc__="Which value of one input gives a wanted mu_macro.",
    target=_target,
)  # fmt: skip
SolveForRequest.model_config["json_schema_extra"] = {
    "examples": [{name: value for name, value in example.items() if name != "y0"} | {"unknown": "y0", "target": 0.15}]
}


class _Root(BaseModel):
    """One value of the unknown, and the answer there."""

    value: float = Field(description="The unknown [SI]")
    low: float = Field(description="From low ...")
    high: float = Field(description="... to high, mu_macro is the target within the table's error bound")
    mu_macro: float = Field(description="Value of the table there [-]")
    regime: Literal[tuple(dict.fromkeys(REGIME_NAMES))]


Root: Any = create_model("Root", __base__=_Root, __doc__=_Root.__doc__, **included(False))


class TargetAnswer(BaseModel):
    """All values that give one target."""

    target: float
    roots: list[Root] = Field(description="Ascending; more than one where mu_macro is not monotonic (k, Fz, mu0)")
    reason: str | None = Field(None, description="Why there is no root")


class Reachable(BaseModel):
    """Range of mu_macro for all values of the unknown in its range."""

    min: float
    max: float
    min_included: bool = Field(description="false: approached, never reached")
    max_included: bool


class SolveForAnswer(Answered):
    """Answer to the inverse problem."""

    unknown: Name
    unit: str
    quantity: Literal["mu_macro", "mu_ratio"]
    range: list[float | None] = Field(description="The searched range [SI]; null: without limit")
    reachable: Reachable
    results: list[TargetAnswer] = Field(description="One per target, in order")


ENDPOINTS = [
    Endpoint(
        "/v1/solve-for", "POST", post_solve_for,
        "The value of one input that gives a wanted mu_macro",
        body=SolveForRequest, model=SolveForAnswer,
    )
]  # fmt: skip
