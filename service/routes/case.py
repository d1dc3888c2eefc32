"""One case: ``GET`` and ``POST /v1/mu-macro``, and ``GET /v1/mu-macro.txt`` for spreadsheets."""

from collections.abc import Mapping
from typing import Any

from pydantic import Field, create_model
from starlette.requests import Request
from starlette.responses import Response

from mumacro import Surrogate
from mumacro.interval import ENDS, middle
from mumacro.validity import digits, k_effect, model_rows

from ..answers import answer_case, cost_of
from ..case import Asked
from ..models import CaseAnswer
from ..options import MODEL, CaseQuery, CaseRequest, Options, read_form
from ..problems import FieldFault, refuse
from ..wire.json import dump
from . import Endpoint, given_in_body, given_in_query, reply

__all__ = ["ENDPOINTS"]

PATH = "/v1/mu-macro"
_LARGE = 100  # cost from which one case is computed in a thread, in times of a plain one


async def _answered(request: Request, given: Mapping[str, Any]) -> dict[str, Any]:
    options, case, asked = read_form(Options, given, one=True)
    state = request.app.state
    table = state.tables.pick(options.tolerance)
    include, std = options.names(), options.deviations()
    model = MODEL in (options.include or ())

    def answer() -> tuple[dict[str, Any], int]:
        values, source = answer_case(table.surrogate, case, include, std, asked)
        return {**values, **_about_model(table.surrogate, case, asked)} if model else values, source

    large = model or cost_of(include, asked) > _LARGE
    values, source = await state.work.question(answer) if large else answer()
    state.metrics.case(table, source)
    return {**values, **table.signature}


def _about_model(surrogate: Surrogate, case: dict[str, Any], asked: Asked) -> dict[str, Any]:
    """Rows of docs/validity.md, and the digits that k supports."""
    names: Any = asked.kind.names
    if not asked.interval:
        effect = k_effect(surrogate, case, **names)
        return {"model": model_rows(surrogate, case, **names), "digits": digits(effect)}
    found = surrogate.evaluate(**case, **names)
    ends = {name: case[name] for name in ENDS}
    at_middle = {name: value for name, value in case.items() if name not in ENDS} | {
        "k": float(middle(ends, "raise")[2])
    }
    rows = [row for row in model_rows(surrogate, at_middle, **names) if row["row"] != "k is known"]
    spread = 0.5 * (found.mu_macro_high - found.mu_macro_low)
    return {"model": rows, "digits": digits(spread / found.mu_macro if spread else 0.0)}


async def post_mu_macro(request: Request) -> Response:
    """Answer one case given as a JSON object; ``include`` adds quantities to the default answer."""
    return reply(dump(await _answered(request, await given_in_body(request))))


async def get_mu_macro(request: Request) -> Response:
    """Answer one case given as a query.  The answer can be cached."""
    answer = await _answered(request, given_in_query(request))
    return reply(dump(answer), request.app.state.settings.cache_fields)


async def get_mu_macro_text(request: Request) -> Response:
    """Answer one case with one value as text: ``mu_macro``, or the one that ``value`` names."""
    given = given_in_query(request)
    name = str(given.pop("value", "mu_macro"))
    answer = await _answered(request, given)
    found: Any = answer
    for step in name.split("."):
        found = found.get(step) if isinstance(found, dict) else None
    if found is None or isinstance(found, dict):
        reason = f"is not in the answer; there are: {', '.join(answer)}; more with include"
        refuse([FieldFault.of("value", reason, name)])
    text = found.encode() if isinstance(found, str) else dump(found)
    return reply(text, request.app.state.settings.cache_fields, "text/plain; charset=utf-8")


_CACHED = {
    "headers": {
        "Cache-Control": {"description": "How long, and by whom, it may be cached", "schema": {"type": "string"}}
    }
}
_value: Any = (str, Field("mu_macro", description="Name in the answer, such as mu_macro, regime or power.saved"))
ValueQuery: Any = create_model("ValueQuery", __base__=CaseQuery, value=_value)
ENDPOINTS = [
    Endpoint(
        PATH, "GET", get_mu_macro, "Macroscopic friction of one case",
        query=CaseQuery, model=CaseAnswer, content={200: _CACHED},
    ),
    Endpoint(
        PATH, "POST", post_mu_macro, "Macroscopic friction of one case, as JSON",
        body=CaseRequest, model=CaseAnswer,
    ),
    Endpoint(
        f"{PATH}.txt", "GET", get_mu_macro_text,
        "One value of one case, for spreadsheets (WEBSERVICE)", query=ValueQuery,
        content={200: {"content": {"text/plain": {"schema": {"type": "string"}}}, **_CACHED}},
    ),
]  # fmt: skip
