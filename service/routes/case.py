"""One case: ``GET`` and ``POST /v1/mu-macro``, and ``GET /v1/mu-macro.txt`` for spreadsheets."""

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from mumacro.analysis.validity import digits, k_effect, model_rows

from ..answers import answer_case
from ..models import CaseAnswer, model
from ..options import MODEL, CaseRequest, Options, bounded
from ..problems import FieldFault, refuse
from ..wire.json import dump
from . import Asking, Endpoint, Reply

PATH = "/v1/mu-macro"
_LARGE = 100  # cost from which one case is computed in a thread, in times of a plain one


class TextOptions(Options):
    """What is asked for one value as text."""

    value: str = bounded(
        "a name in the answer", "Such as mu_macro, regime or power.saved", "mu_macro"
    )


async def _answered(
    request: Request, asking: type[Options] = Options
) -> tuple[Any, dict[str, Any]]:
    """The options and the answer."""
    table, form, case, wanted = await Asking.of(request, asking, one=True)
    app, told = request.app, MODEL in (form.include or ())

    def answer() -> tuple[dict[str, Any], int]:
        values, source = answer_case(table.surrogate, case, wanted)
        if told:  # rows of docs/validity.md, and the digits that k supports
            words, surrogate = wanted.asked.kind.names, table.surrogate
            values["model"] = model_rows(surrogate, case, **words)
            values["digits"] = digits(k_effect(surrogate, case, **words))
        return values, source

    large = told or wanted.cost > _LARGE
    values, source = await app.work.question(answer) if large else answer()
    app.metrics.case(table, source)
    return form, {**values, **table.signature}


async def post_mu_macro(request: Request) -> Response:
    """Answer one case given as a JSON object; ``include`` adds quantities to the default answer."""
    return Reply(dump((await _answered(request))[1]))


async def get_mu_macro(request: Request) -> Response:
    """Answer one case given as a query.  The answer can be cached."""
    return Reply(dump((await _answered(request))[1]), request.app.settings.cache_fields)


async def get_mu_macro_text(request: Request) -> Response:
    """Answer one case with one value as text: ``mu_macro``, or the one that ``value`` names."""
    form, answer = await _answered(request, TextOptions)
    found: Any = answer
    for step in form.value.split("."):
        found = found.get(step) if isinstance(found, dict) else None
    if found is None or isinstance(found, dict):
        told = f"is not in the answer; there are: {', '.join(answer)}; more with include"
        refuse([FieldFault.of("value", told, form.value)])
    text = found.encode() if isinstance(found, str) else dump(found)
    return Reply(text, request.app.settings.cache_fields, "text/plain; charset=utf-8")


_KEPT = {"description": "How long, and by whom, it may be cached", "schema": {"type": "string"}}
_CACHED = {"headers": {"Cache-Control": _KEPT}}
_TEXT = {"content": {"text/plain": {"schema": {"type": "string"}}}, **_CACHED}
TextRequest = model(
    "TextRequest", "One case and the value that is wanted.", TextOptions, CaseRequest
)
ENDPOINTS = [
    Endpoint(
        PATH,
        "GET",
        get_mu_macro,
        "Macroscopic friction of one case",
        CaseRequest,
        CaseAnswer,
        content={200: _CACHED},
    ),
    Endpoint(
        PATH,
        "POST",
        post_mu_macro,
        "Macroscopic friction of one case, as JSON",
        CaseRequest,
        CaseAnswer,
    ),
    Endpoint(
        f"{PATH}.txt",
        "GET",
        get_mu_macro_text,
        "One value of one case, for spreadsheets (WEBSERVICE)",
        TextRequest,
        content={200: _TEXT},
    ),
]
