"""The friction law over a range of one input: ``POST /v1/law``, and ``GET /v1/law.csv`` for spreadsheets."""

import csv
import io
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from starlette.requests import Request
from starlette.responses import Response

from mumacro.contact import SPRING
from mumacro.inputs import field_of, unit_of
from mumacro.law import APPROXIMATIONS, BORDERS, Law, approximations, border_speeds, friction_law, sweep_values

from ..answers import Part, answer_columns, nested, parts_of
from ..models import Answered, default, grouped, included, many, model, told
from ..options import NAMES, Five, Name, NotNegative, Options, Positive, bounded, example, includes, relation
from ..wire.json import dump
from . import Asking, Endpoint, in_thread, reply

__all__ = ["ENDPOINTS"]

MAX_POINTS = 10_001
# JSON has one kind of number: 55.0 is an integer there, and in a JSON Schema.
_whole = BeforeValidator(lambda value: int(value) if isinstance(value, float) and value.is_integer() else value)
_Points = Annotated[int, Field(ge=2, le=MAX_POINTS), _whole]
_APPROXIMATIONS, _SPEEDS = "approximations", "border_speeds"
#: the columns that belong to a law beside those of its cases
_STATIC = Part("mu_static", "-", "Static limit (v0 -> 0) of each case")
_MORE = (
    *(Part(f"{_APPROXIMATIONS}.{name}", "-", f"{text}; null: outside that") for name, text in APPROXIMATIONS.items()),
    *(Part(f"{_SPEEDS}.{name}", "m/s", f"{text}; null: outside that") for name, text in BORDERS.items()),
)
_more: Any = model("_LawInclude", "", include=includes(_APPROXIMATIONS, "those of the paper beside the exact values"))


class LawOptions(_more, Options):  # type: ignore[misc]
    """What is asked beside the five other inputs."""

    along: Name = bounded(f"one of {', '.join(NAMES)}", "The swept input", "v0")
    start: NotNegative = bounded("finite and >= 0", "First value [SI]; > 0 on a logarithmic scale", examples=[1e-4])
    stop: Positive = bounded("finite and > 0", "Last value [SI], > start", examples=[10.0])
    points: _Points = bounded(f"a whole number from 2 to {MAX_POINTS}", "Number of values", 201)
    scale: Literal["log", "linear"] = bounded("log or linear", "Spacing of the values", "log")

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        if _APPROXIMATIONS in (self.include or ()) and self.kind != SPRING:
            raise relation("include", "has approximations, which are those of one spring that oscillates across")
        if self.scale == "log" and self.start == 0.0:
            raise relation("start", "must be > 0 on a logarithmic scale; for a range from 0 set scale to linear")
        if not self.stop > self.start:
            raise relation("stop", f"must be > start, which is {self.start:g}")
        return self


async def post_law(request: Request) -> Response:
    """Return the law in columns, with its static limit and its border."""
    found = await Asking.of(request, LawOptions, "along")
    return await in_thread(request, lambda: reply(_as_json(found)))


async def get_law_csv(request: Request) -> Response:
    """Return the law as CSV (RFC 4180), one row per value; the head names the columns with their units."""
    found = await Asking.of(request, LawOptions, "along")
    name = f'attachment; filename="friction-law-{found.form.along}.csv"'
    headers = {"Content-Disposition": name, "Cache-Control": "no-cache"}
    kind = "text/csv; charset=utf-8; header=present"
    return await in_thread(request, lambda: reply(_as_csv(found), headers, kind))


def _law(found: Asking) -> tuple[Law, dict[Part, list[Any]]]:
    """The library's law and all columns beside the swept input."""
    (table, form, case, asked), (along, per) = found, field_of(found.form.along)
    values = sweep_values(along, form.start * per, form.stop * per, form.points, form.scale)
    law = friction_law(table.surrogate, along, values, case, **asked.kind.names)
    six = [values if name == along else np.array([case[name]]) for name in asked.fields]
    answer, _ = answer_columns(table.surrogate, six, values.size, form.names(), form.deviations(), asked)
    answer[_STATIC.path], parts = law.mu_static, [*parts_of(form.names(), asked), _STATIC]
    if _APPROXIMATIONS in (form.include or ()):
        for group, made in ((_APPROXIMATIONS, approximations), (_SPEEDS, border_speeds)):
            answer |= {f"{group}.{name}": column for name, column in made(table.surrogate, law).items()}
        parts += _MORE
    return law, {part: part.values(answer[part.path]) for part in parts}


def _as_json(found: Asking) -> bytes:
    law, columns = _law(found)
    along, per = found.form.along, field_of(found.form.along)[1]
    swept = {"along": along, "unit": unit_of(along), "values": law.values / per}
    border = [{"value": mark.value / per, "mu_macro": mark.mu_macro} for mark in law.border]
    answer = nested({part.path: column for part, column in columns.items()})
    return dump({**swept, **answer, "border": border, **found.table.signature})


def _as_csv(found: Asking) -> bytes:
    """The columns in order, texts last, with the path as their name."""
    law, columns = _law(found)
    per = field_of(found.form.along)[1]
    heads = {f"{found.form.along} [{unit_of(found.form.along)}]": (law.values / per).tolist()}
    for part in sorted(columns, key=lambda part: bool(part.names)):
        name = part.path.removeprefix(f"{_APPROXIMATIONS}.").replace(f"{_SPEEDS}.", "border_")
        shown = ["" if value != value else value for value in columns[part]]
        heads[name if part.names else f"{name} [{part.unit}]"] = shown
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(heads)
    writer.writerows(zip(*heads.values(), strict=True))
    return text.getvalue().encode()


# --- models -------------------------------------------------------------------------------------------

LawRequest = model("LawRequest", "mu_macro over a range of one input.", LawOptions, Five)
_swept = {"along": "v0", "start": 1e-4, "stop": 10.0, "points": 5}
LawRequest.model_config["json_schema_extra"] = {
    "examples": [{name: value for name, value in example.items() if name != "v0"} | _swept]
}
BorderMark = model(
    "BorderMark", "Where continuous sliding begins or ends.", value=told(float, "The swept input [SI]"),
    mu_macro=told(float, "[-]"),
)  # fmt: skip
LawAnswer = model(
    "LawAnswer", "A friction law in columns.", Answered,
    along=Name, unit=str, values=told(list[float], "The swept input [SI]"),
    **default(True), **included(True), **grouped(_MORE, True, "Beside the exact values"),
    mu_static=told(list[float], _STATIC.described), border=told(many(BorderMark), "Up to two points inside the range"),
)  # fmt: skip
_CSV = {"description": "The law", "content": {"text/csv": {"schema": {"type": "string"}}}}
ENDPOINTS = [
    Endpoint("/v1/law", "POST", post_law, "mu_macro over a range of one input", LawRequest, LawAnswer),
    Endpoint(
        "/v1/law.csv", "GET", get_law_csv, "mu_macro over a range of one input, as a table", LawRequest,
        content={200: _CSV},
    ),
]  # fmt: skip
