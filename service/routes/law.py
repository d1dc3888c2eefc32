"""The friction law over a range of one input: ``POST /v1/law``, and ``GET /v1/law.csv`` for spreadsheets."""

import csv
import io
import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, Field, create_model, model_validator
from starlette.requests import Request
from starlette.responses import Response

from mumacro.contact import SPRING
from mumacro.inputs import BOUNDS, POSITIVE
from mumacro.law import APPROXIMATIONS, BORDERS, approximations, border_speeds, friction_law, sweep_values

from ..answers import INTERVAL, answer_columns, nested, parts_of
from ..case import Asked
from ..models import Answered, default, included
from ..options import NO_NULL, UNITS, NotNegative, Options, Positive, bounded, example, query_of, read_form, relation
from ..problems import FieldFault, refuse
from ..quantities import INCLUDES
from ..tables import LoadedTable
from ..wire.json import dump
from . import Endpoint, given_in_body, given_in_query, in_thread, reply
from .solve_for import FIVE, FIVE_QUERY, NAMES, Name, in_si, per_value

__all__ = ["ENDPOINTS"]

MAX_POINTS = 10_001
MAX_CURVES = 20
MAX_ALL_POINTS = 20_002
# JSON has one kind of number: 55.0 is an integer there, and in a JSON Schema.
_whole = BeforeValidator(lambda value: int(value) if isinstance(value, float) and value.is_integer() else value)
LawInclude: Any = Literal[("approximations", *INCLUDES)]
Points = Annotated[int, Field(ge=2, le=MAX_POINTS), _whole]
Family = dict[Name, Annotated[list[NotNegative], Field(min_length=1, max_length=MAX_CURVES)]]


class LawOptions(Options):
    """What is asked beside the five other inputs."""

    along: Name = bounded(f"one of {', '.join(NAMES)}", "The swept input", "v0")
    start: NotNegative = bounded("finite and >= 0", "First value [SI]; > 0 on a logarithmic scale", examples=[1e-4])
    stop: Positive = bounded("finite and > 0", "Last value [SI], > start", examples=[10.0])
    points: Points = bounded(f"a whole number from 2 to {MAX_POINTS}", "Number of values", 201)
    scale: Literal["log", "linear"] = bounded("log or linear", "Spacing of the values", "log")
    family: Annotated[Family, Field(min_length=1, max_length=1)] | None = bounded(
        f"an object with one input and 1 to {MAX_CURVES} values of it, finite and >= 0",
        "One input that is left out elsewhere: one curve per value", None,
    )  # fmt: skip
    include: Annotated[list[LawInclude], Field(max_length=2 + 2 * len(INCLUDES))] | None = bounded(
        f"a list of names from: approximations, {', '.join(INCLUDES)}", "More to compute at every value", None
    )

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        if "approximations" in (self.include or ()) and self.kind != SPRING:
            raise relation("include", "has approximations, which are those of one spring that oscillates across")
        if self.scale == "log" and self.start == 0.0:
            raise relation("start", "must be > 0 on a logarithmic scale; for a range from 0 set scale to linear")
        if not self.stop > self.start:
            raise relation("stop", f"must be > start, which is {self.start:g}")
        for name, values in (self.family or {}).items():
            if in_si(name) == in_si(self.along):
                raise relation("family", f"{name} is the swept input")
            if len(values) * self.points > MAX_ALL_POINTS:
                raise relation("points", f"all curves together may have up to {MAX_ALL_POINTS} points")
            if name in POSITIVE and min(values) <= 0.0:
                raise relation("family", f"{name} must be {BOUNDS[name]}")
        return self


def _read(given: Mapping[str, Any]) -> tuple[LawOptions, dict[str, float], Asked]:
    """The options and the other inputs; that of the family is asked for, too."""
    family = given.get("family")
    names = [given.get("along", "v0"), *(family if isinstance(family, dict) else ())]
    return read_form(LawOptions, given, [name for name in names if name in NAMES])


async def post_law(request: Request) -> Response:
    """Return the law in columns, with its static limit and its border; with ``family``, one curve per value."""
    form, case, asked = _read(await given_in_body(request))
    table = request.app.state.tables.pick(form.tolerance)
    return await in_thread(request, lambda: reply(dump(_answer(table, form, case, asked))))


async def get_law_csv(request: Request) -> Response:
    """Return the law as CSV (RFC 4180), one row per value; the head names the columns with their units."""
    given = given_in_query(request)
    if "family" in given:
        given["family"] = "no parameter of a query"
    form, case, asked = _read(given)
    if form.names():
        refuse(
            [FieldFault.of("include", "must be approximations; POST /v1/law has the other quantities", form.names()[0])]
        )
    table = request.app.state.tables.pick(form.tolerance)
    headers = {
        "Content-Disposition": f'attachment; filename="friction-law-{form.along}.csv"',
        "Cache-Control": "no-cache",
    }
    kind = "text/csv; charset=utf-8; header=present"
    return await in_thread(request, lambda: reply(_as_csv(_answer(table, form, case, asked)).encode(), headers, kind))


def _answer(table: LoadedTable, form: LawOptions, case: dict[str, float], asked: Asked) -> dict[str, Any]:
    per = per_value(form.along)
    values = sweep_values(in_si(form.along), form.start * per, form.stop * per, form.points, form.scale)
    swept = {"along": form.along, "unit": UNITS[form.along], "values": (values / per).tolist()}
    if not form.family:
        return {**swept, **_curve(table, form, values, case, asked), **table.signature}
    ((name, listed),) = form.family.items()
    curves = [
        {"value": value, **_curve(table, form, values, {**case, in_si(name): value * per_value(name)}, asked)}
        for value in listed
    ]
    return {**swept, "family": name, "family_unit": UNITS[name], "curves": curves, **table.signature}


def _curve(table: LoadedTable, form: LawOptions, values: Any, case: dict[str, float], asked: Asked) -> dict[str, Any]:
    along = in_si(form.along)
    law = friction_law(table.surrogate, along, values, case, **asked.kind.names)
    include = form.names()
    six = [values if name == along else np.array([case[name]]) for name in asked.fields]
    found, _ = answer_columns(table.surrogate, six, values.size, include, form.deviations(), asked)
    answer = nested({part.path: part.values(found[part.path]) for part in parts_of(include, asked)})
    answer["mu_static"] = law.mu_static.tolist()
    answer["border"] = [{"value": mark.value / per_value(form.along), "mu_macro": mark.mu_macro} for mark in law.border]
    if "approximations" in (form.include or ()):
        for name, columns in (("approximations", approximations), ("border_speeds", border_speeds)):
            answer[name] = {key: column.tolist() for key, column in columns(table.surrogate, law).items()}
    return answer


def _as_csv(answer: dict[str, Any]) -> str:
    """The columns of the law; those that ``include`` adds, in order, with the path as their name."""
    columns: dict[str, list[Any]] = {f"{answer['along']} [{answer['unit']}]": answer["values"]}
    for name in (
        "mu_macro",
        *(part.path for part in INTERVAL if part.path in answer),
        "mu_ratio",
        "error_bound",
        "mu_static",
    ):
        columns[f"{name} [-]"] = answer[name]
    for group, prefix, unit in (("approximations", "", "-"), ("border_speeds", "border_", "m/s")):
        for name, column in answer.get(group, {}).items():
            columns[f"{prefix}{name} [{unit}]"] = ["" if math.isnan(value) else value for value in column]
    columns.update(regime=answer["regime"], source=answer["source"])
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


# --- models -------------------------------------------------------------------------------------------

LawRequest: Any = create_model(
    "LawRequest", __base__=(LawOptions, FIVE),
    __doc__="mu_macro over a range of one input; a list for one more input gives a family of curves.",
)  # fmt: skip
LawRequest.model_config["json_schema_extra"] = {
    "examples": [
        {name: value for name, value in example.items() if name != "v0"}
        | {"along": "v0", "start": 1e-4, "stop": 10.0, "points": 5}
    ]
}
_only: Any = (
    Annotated[list[Literal["approximations"]], Field(max_length=4)] | NO_NULL,
    Field(None, description="approximations: those of the paper beside the exact values"),
)
LawQuery: Any = query_of("LawQuery", LawRequest, include=_only, k=FIVE_QUERY["k"])


class BorderMark(BaseModel):
    """Where continuous sliding begins or ends."""

    value: float = Field(description="The swept input [SI]")
    mu_macro: float = Field(description="[-]")


def _listed(columns: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {text}" for name, text in columns.items())


class _More(BaseModel):
    mu_static: list[float] = Field(description="Static limit (v0 -> 0) of each case [-]")
    border: list[BorderMark] = Field(description="Up to two points inside the range")
    approximations: dict[str, list[float | None]] | None = Field(
        None, description=f"Only if requested [-]; null: outside the range of the formula. {_listed(APPROXIMATIONS)}"
    )
    border_speeds: dict[str, list[float | None]] | None = Field(
        None,
        description="Only with approximations [m/s]: v0 at which continuous sliding begins for each case; null: "
        f"outside the range of the formula. {_listed(BORDERS)}",
    )


_made: Any = create_model
Curve: Any = _made("Curve", __base__=_More, __doc__="A friction law in columns.", **default(True), **included(True))


class _Swept(Answered):
    along: Name
    unit: str
    values: list[float] = Field(description="The swept input [SI]")


class FamilyCurve(Curve):  # type: ignore[misc]
    """One curve of a family."""

    value: float = Field(description="The family's input [SI]")


LawAnswer: Any = _made("LawAnswer", __base__=(_Swept, Curve), __doc__="A friction law in columns.")


class LawFamilyAnswer(_Swept):
    """Friction laws for several values of one more input."""

    family: Name
    family_unit: str
    curves: list[FamilyCurve]


ENDPOINTS = [
    Endpoint(
        "/v1/law", "POST", post_law, "mu_macro over a range of one input",
        body=LawRequest, model=LawAnswer | LawFamilyAnswer,
    ),
    Endpoint(
        "/v1/law.csv", "GET", get_law_csv, "mu_macro over a range of one input, as a table",
        query=LawQuery,
        content={200: {"description": "The law", "content": {"text/csv": {"schema": {"type": "string"}}}}},
    ),
]  # fmt: skip
