"""Answer one case: ``GET`` and ``POST /v1/mu-macro``, and ``GET /v1/mu-macro.txt`` for
spreadsheets."""

from functools import partial
from typing import Annotated, Any

from fastapi import Query, Request, Response
from starlette.responses import PlainTextResponse

from mumacro import Answer
from mumacro.errors import InputError
from mumacro.inputs.cases import Cases
from mumacro.outputs.evaluation import chosen, cost
from mumacro.validity import digits, effect_of, rows_of

from ..admission import compute
from ..json_text import Json, dump
from ..models.answers import CaseAnswer
from ..models.options import MODEL, CaseRequest, TextQuery
from ..problems import of_input
from ..understood import UNDERSTOOD, understood
from . import GET_PROBLEMS, POST_PROBLEMS, router_of

router = router_of("answers")
#: members of a case that asks only for the default answer
_PLAIN = frozenset(("mu0", "Fz", "k", "y0", "omega", "f", "v0", "tolerance", "value"))
_LARGE = 100  # cost, see service/admission.py, from which one case is computed in a thread
_CACHED: Any = {
    "model": CaseAnswer,
    "headers": {
        "Cache-Control": {
            "description": "How long, and by whom, it may be cached",
            "schema": {"type": "string"},
        }
    },
}


async def _answered(request: Request, case: CaseRequest) -> dict[str, Any]:
    """Return the answer to a case."""
    state, inputs = request.app.state, case.inputs
    table = state.tables.pick(case.tolerance)
    members: dict[str, Any] = {}
    wanted = case.include or ()
    if UNDERSTOOD in wanted:
        members = {UNDERSTOOD: understood(case.model_dump(warnings=False))}
    try:
        if case.model_fields_set <= _PLAIN and "k_low" not in inputs:
            answer = table.surrogate.evaluate(**inputs)
        else:
            cases = Cases.of(inputs | case.deviations, case.kind)
            outputs = chosen(case.outputs, cases)
            work = partial(table.surrogate.answer, cases, outputs)
            large = cost(outputs, cases) > _LARGE
            answer = await compute(request, work) if large else work()
        if MODEL in wanted:
            work = partial(_of_model, answer)
            members |= await compute(request, work)
    except InputError as error:  # the same as with_members, without the call of a function
        raise of_input(error, **members) from None
    state.metrics.case(table, answer.source_code)
    return {**answer.to_dict(), **members, **table.signature}


def _of_model(answer: Answer[float]) -> dict[str, Any]:
    """Return the rows of docs/validity.md for this case, and the number of digits that the
    uncertainty of k supports."""
    effect = effect_of(answer)
    return {MODEL: rows_of(answer, effect), "digits": digits(effect)}


@router.get(
    "/mu-macro",
    responses={200: _CACHED, **GET_PROBLEMS},
    summary="Macroscopic friction of one case",
)
async def get_mu_macro(request: Request, case: Annotated[CaseRequest, Query()]) -> Response:
    """Answer one case in a query.  The answer can be cached."""
    answer = await _answered(request, case)
    return Json(answer, headers=request.app.state.settings.cache_fields)


@router.post(
    "/mu-macro",
    responses={200: {"model": CaseAnswer}, **POST_PROBLEMS},
    summary="Macroscopic friction of one case, as JSON",
)
async def post_mu_macro(request: Request, case: CaseRequest) -> Response:
    """Answer one case in a JSON object; ``include`` adds quantities to the default answer."""
    return Json(await _answered(request, case))


@router.get(
    "/mu-macro.txt",
    response_class=PlainTextResponse,
    responses={200: {"headers": _CACHED["headers"]}, **GET_PROBLEMS},
    summary="One value of one case, for spreadsheets (WEBSERVICE)",
)
async def get_mu_macro_text(request: Request, case: Annotated[TextQuery, Query()]) -> Response:
    """Answer one case with one value as text: ``mu_macro``, or the one that ``value`` names."""
    answer: Any = await _answered(request, case)
    value = answer
    for step in case.value.split("."):
        value = value.get(step) if isinstance(value, dict) else None
    if value is None or isinstance(value, dict):
        raise InputError("value", case.value, f"one of {', '.join(answer)}; more with include")
    text = value.encode() if isinstance(value, str) else dump(value)
    headers = request.app.state.settings.cache_fields
    return Response(text, media_type="text/plain; charset=utf-8", headers=headers)
