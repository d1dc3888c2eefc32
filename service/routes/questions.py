"""Questions about a range of one input: its friction law, ``/v1/law`` and ``/v1/law.csv``, and
``/v1/solve-for``."""

import csv
import io
import itertools
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from starlette.responses import Response

import mumacro
from mumacro.analysis.law import Law
from mumacro.analysis.load import Stiffening
from mumacro.analysis.solve_for import Solution
from mumacro.analysis.validity import load_rows
from mumacro.errors import InputError
from mumacro.inputs.fields import field_of, unit_of
from mumacro.kernel.arrays import Array

from ..answers import REGIME_NAMES, Part, answer_columns, nested
from ..models import Answered, ModelRow, default, included, many, model, optional, told
from ..options import MODEL, NAMES, Five, Name, NotNegative, Options, Positive, bounded, example
from ..wire.json import dump
from . import Asking, Endpoint, Reply, question

# --- friction law ---------------------------------------------------------------------------------

MAX_POINTS = 10_001
# JSON has one kind of number: 55.0 is an integer there, and in a JSON Schema.
_whole = BeforeValidator(
    lambda value: int(value) if isinstance(value, float) and value.is_integer() else value
)
_Points = Annotated[int, Field(ge=2, le=MAX_POINTS), _whole]
#: the column that belongs to a law beside those of its cases
_STATIC = Part("mu_static", "-", "Static limit (v0 -> 0) of each case")
_K = Part("k", "N/m", "Stiffness at each value, where it grows along Fz")
_MODEL = "Along Fz, or solved for it: what is said of k"
_Exponent = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
_exponent = bounded(
    "a number from 0 to 1",
    "For Fz only: k grows as Fz to this power, and Fz of the case is the load at which k holds; "
    "left out: 1/3 for a ball with Fz, else k is constant",
    None,
)


class LawOptions(Options):
    """What is asked beside the five other inputs."""

    along: Name = bounded(f"one of {', '.join(NAMES)}", "The swept input", "v0")
    start: NotNegative = bounded(
        "finite and >= 0", "First value [SI]; > 0 on a logarithmic scale", examples=[1e-4]
    )
    stop: Positive = bounded("finite and > 0", "Last value [SI], > start", examples=[10.0])
    points: _Points = bounded(f"a whole number from 2 to {MAX_POINTS}", "Number of values", 201)
    scale: Literal["log", "linear"] = bounded("log or linear", "Spacing of the values", "log")
    stiffness_exponent: _Exponent | None = _exponent

    @model_validator(mode="before")
    @classmethod
    def _without_approximations(cls, form: dict[str, Any]) -> dict[str, Any]:
        names = form.get("include")
        if isinstance(names, list) and "approximations" in names:
            raise InputError(
                "include",
                "approximations",
                "left out: the formulas of the paper are gone here; mumacro law --approximations "
                "prints them",
            )
        return form


def _law(found: Asking) -> tuple[Law, dict[Part, list[Any]]]:
    """The library's law and all columns beside the swept input."""
    (table, form, case, wanted), (along, per) = found, field_of(found.form.along)
    asked = wanted.asked
    law = mumacro.law(
        table.surrogate,
        along,
        start=form.start * per,
        stop=form.stop * per,
        points=form.points,
        scale=form.scale,
        stiffness_exponent=form.stiffness_exponent,
        **asked.kind.names,
        **case,
    )
    six = _columns(found, along, law.values, law.stiffening)
    answer, _ = answer_columns(table.surrogate, six, law.values.size, wanted)
    answer[_STATIC.path], parts = law.mu_static, [*wanted.parts, _STATIC]
    if law.stiffening is not None:
        answer[_K.path], parts = law.inputs["k"], [*parts, _K]
    return law, {part: part.values(answer[part.path]) for part in parts}


def _columns(
    found: Asking, unknown: str, values: Array, stiffening: Stiffening | None
) -> list[Array]:
    """The inputs of the cases at values of one of them, by column."""
    case = {**found.case, unknown: values}
    if stiffening is not None:
        case |= stiffening.scaled(found.case, values)
    return [np.atleast_1d(case[name]) for name in found.wanted.asked.fields]


def _said(found: Asking, unknown: str, stiffening: Stiffening | None) -> dict[str, Any]:
    """What is said of the model, if anything."""
    rows = load_rows(unknown, found.case, found.form.contact, stiffening)
    return {MODEL: rows} if rows else {}


@question(LawOptions, "along")
def post_law(found: Asking) -> Response:
    """Return the law in columns, with its static limit and its border."""
    law, columns = _law(found)
    along, per = found.form.along, field_of(found.form.along)[1]
    swept = {"along": along, "unit": unit_of(along), "values": law.values / per}
    border = [{"value": mark.value / per, "mu_macro": mark.mu_macro} for mark in law.border]
    answer = nested({part.path: column for part, column in columns.items()})
    said = _said(found, found.form.along, law.stiffening)
    return Reply(dump({**swept, **answer, "border": border, **said, **found.table.signature}))


@question(LawOptions, "along")
def get_law_csv(found: Asking) -> Response:
    """Return the law as CSV (RFC 4180), one row per value; the head names the columns with their
    units."""
    law, columns = _law(found)
    along, per = found.form.along, field_of(found.form.along)[1]
    heads = {f"{along} [{unit_of(along)}]": (law.values / per).tolist()}
    for part in sorted(columns, key=lambda part: bool(part.names)):  # texts last
        name = part.path
        shown = ["" if value != value else value for value in columns[part]]
        heads[name if part.names else f"{name} [{part.unit}]"] = shown
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(heads)
    writer.writerows(zip(*heads.values(), strict=True))
    headers = {
        "Content-Disposition": f'attachment; filename="friction-law-{along}.csv"',
        "Cache-Control": "no-cache",
    }
    return Reply(text.getvalue().encode(), headers, "text/csv; charset=utf-8; header=present")


# --- inverse --------------------------------------------------------------------------------------

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
        "mu_macro or mu_ratio",
        "What the target is; mu_ratio = mu_macro/mu0 (0.5 halves the friction)",
        "mu_macro",
    )
    range: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] | None = bounded(
        "two numbers, finite and >= 0, ascending",
        "Where to search [SI]; left out: wherever it changes mu_macro",
        None,
    )
    stiffness_exponent: _Exponent | None = _exponent

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        if self.quantity == "mu_ratio" and self.unknown == "mu0":
            raise InputError("quantity", self.quantity, "mu_macro where mu0 is the unknown")
        return self


@question(SolveForOptions, "unknown")
def post_solve_for(found: Asking) -> Response:
    """Return every root of every target.  A target out of reach has none; ``reachable`` is the
    range of mu_macro."""
    (table, form, case, wanted), (name, per) = found, field_of(found.form.unknown)
    unit = case["mu0"] if form.quantity == "mu_ratio" else 1.0
    within = (form.range[0] * per, form.range[1] * per) if form.range is not None else None
    solution = mumacro.solve_for(
        table.surrogate,
        name,
        [x * unit for x in form.target],
        within=within,
        stiffness_exponent=form.stiffness_exponent,
        **wanted.asked.kind.names,
        **case,
    )
    answer = {"unknown": form.unknown, "unit": unit_of(form.unknown), "quantity": form.quantity}
    answer |= _results(form, solution, _included(found, name, solution), unit, per)
    if solution.ends:
        ks = case["k_low"], case["k_high"]
        answer["ends"] = [
            {"k": k, **_results(form, end, None, unit, per)}
            for k, end in zip(ks, solution.ends, strict=True)
        ]
    answer |= _said(found, name, solution.stiffening)
    return Reply(dump({**answer, **table.signature}))


def _results(
    form: SolveForOptions,
    solution: Solution,
    included: list[dict[str, Any]] | None,
    unit: float,
    per: float,
) -> dict[str, Any]:
    """The roots of every target, what was searched, and what is reachable there."""
    reach, more = solution.reach, itertools.repeat({}) if included is None else iter(included)
    results: list[dict[str, Any]] = []
    for target, roots in zip(form.target, solution.roots, strict=True):
        in_unit = [
            root._replace(value=root.value / per, low=root.low / per, high=root.high / per)
            for root in roots
        ]
        results.append(
            {"target": target, "roots": [{**root._asdict(), **next(more)} for root in in_unit]}
        )
        if not roots:
            results[-1]["reason"] = _reason(form, target, solution, unit)
    reachable = {
        "min": reach.mu_min / unit,
        "max": reach.mu_max / unit,
        "min_included": reach.min_included,
        "max_included": reach.max_included,
    }
    searched = [reach.low / per, None if reach.high > _NO_LIMIT else reach.high / per]
    return {"results": results, "range": searched, "reachable": reachable}


def _included(found: Asking, unknown: str, solution: Solution) -> list[dict[str, Any]]:
    """The included quantities of every root, in order."""
    table, _, _, wanted = found
    values = np.array([root.value for roots in solution.roots for root in roots])
    if not wanted.include or not values.size:
        return [{}] * values.size
    six = _columns(found, unknown, values, solution.stiffening)
    answer, _ = answer_columns(table.surrogate, six, values.size, wanted)
    rows = zip(*(answer[path].tolist() for path in wanted.more), strict=True)
    return [nested(dict(zip(wanted.more, row, strict=True))) for row in rows]


def _reason(form: SolveForOptions, target: float, solution: Solution, unit: float) -> str:
    reach = solution.reach
    low, high = reach.mu_min / unit, reach.mu_max / unit
    if solution.constant:
        return (
            f"{form.unknown} has no influence here: {form.quantity} is {low!r} for every value "
            "in the range"
        )
    left, right = "[" if reach.min_included else "(", "]" if reach.max_included else ")"
    return f"{target!r} is not in the reachable range {left}{low!r}, {high!r}{right}"


# --- models ---------------------------------------------------------------------------------------

_EXAMPLE = {**example, "along": "v0", "start": 1e-4, "stop": 10.0, "points": 5}
del _EXAMPLE["v0"]
LawRequest = model(
    "LawRequest", "mu_macro over a range of one input.", LawOptions, Five, example=_EXAMPLE
)
BorderMark = model(
    "BorderMark",
    "Where continuous sliding begins or ends.",
    value=told(float, "The swept input [SI]"),
    mu_macro=told(float, "[-]"),
)
LawAnswer = model(
    "LawAnswer",
    "A friction law in columns.",
    Answered,
    along=Name,
    unit=str,
    values=told(list[float], "The swept input [SI]"),
    **default(True),
    **included(True),
    mu_static=told(list[float], _STATIC.described),
    k=optional(list[float], _K.described),
    model=optional(many(ModelRow), _MODEL),
    border=told(many(BorderMark), "Up to two points inside the range"),
)
_CSV = {"description": "The law", "content": {"text/csv": {"schema": {"type": "string"}}}}
_INVERSE = {**example, "unknown": "y0", "target": 0.15}
del _INVERSE["y0"]
SolveForRequest = model(
    "SolveForRequest",
    "Which value of one input gives a wanted mu_macro.",
    SolveForOptions,
    Five,
    example=_INVERSE,
    target=told(
        NotNegative | _Targets,
        f"Wanted value [-], finite and >= 0: one, or a list of up to {MAX_TARGETS}",
    ),
)
Root = model(
    "Root",
    "One value of the unknown, and the answer there.",
    value=told(float, "The unknown [SI]"),
    low=told(float, "From low ..."),
    high=told(float, "... to high, mu_macro is the target within the table's error bound"),
    mu_macro=told(float, "Value of the table there [-]"),
    regime=Literal[tuple(dict.fromkeys(REGIME_NAMES))],
    **included(False),
)
TargetAnswer = model(
    "TargetAnswer",
    "All values that give one target.",
    target=float,
    roots=told(many(Root), "Ascending; more than one where mu_macro is not monotonic (k, Fz, mu0)"),
    reason=optional(str, "Why there is no root"),
)
Reachable = model(
    "Reachable",
    "Range of mu_macro for all values of the unknown in its range.",
    min=float,
    max=float,
    min_included=told(bool, "false: approached, never reached"),
    max_included=bool,
)
_solved: dict[str, Any] = {
    "results": told(many(TargetAnswer), "One per target, in order"),
    "range": told(list[float | None], "The searched range [SI]; null: without limit"),
    "reachable": Reachable,
}
SolveForEnd = model(
    "SolveForEnd", "The same for one end of an interval of k.", k=told(float, "[N/m]"), **_solved
)
SolveForAnswer = model(
    "SolveForAnswer",
    "Answer to the inverse problem.",
    Answered,
    unknown=Name,
    unit=str,
    quantity=_Quantity,
    **_solved,
    ends=optional(
        many(SolveForEnd), "Only with k_range: for k_low and k_high; the rest is for the middle"
    ),
    model=optional(many(ModelRow), _MODEL),
)
ENDPOINTS = [
    Endpoint(
        "/v1/law", "POST", post_law, "mu_macro over a range of one input", LawRequest, LawAnswer
    ),
    Endpoint(
        "/v1/law.csv",
        "GET",
        get_law_csv,
        "mu_macro over a range of one input, as a table",
        LawRequest,
        content={200: _CSV},
    ),
    Endpoint(
        "/v1/solve-for",
        "POST",
        post_solve_for,
        "The value of one input that gives a wanted mu_macro",
        SolveForRequest,
        SolveForAnswer,
    ),
]
