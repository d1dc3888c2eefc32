"""Answer questions about a range of one input: its friction law, ``/v1/law`` and ``/v1/law.csv``,
and ``/v1/solve-for``."""

import csv
import io
from typing import Annotated, Any

import numpy as np
from fastapi import Query, Request, Response

import mumacro
from mumacro.errors import InputError
from mumacro.inputs.case import read_one
from mumacro.inputs.cases import Cases
from mumacro.inputs.stiffening import Stiffening
from mumacro.inputs.units import unit_of
from mumacro.kernel.arrays import Array
from mumacro.outputs import MEMBERS
from mumacro.outputs.answer import TEXTS, Answer, nested
from mumacro.outputs.evaluation import chosen
from mumacro.questions.law import Law
from mumacro.questions.solve_for import TableSolution

from .. import API_VERSION
from ..admission import compute
from ..bodies import understood_in
from ..json_text import Json, words
from ..models.answers import LawAnswer, SolveForAnswer, SolveMotionAnswer
from ..models.motion import MOTIONS_OF_A_SEARCH, cost_of
from ..models.options import MODEL
from ..models.questions import LawRequest, SolveForRequest
from ..problems import with_members
from ..tables import LoadedTable, Tables
from ..understood import UNDERSTOOD
from . import GET_PROBLEMS, POST_PROBLEMS, router_of

router = router_of("answers")


# --- friction law ---------------------------------------------------------------------------------


def _law(question: LawRequest, table: LoadedTable) -> tuple[Law, dict[str, list[Any]]]:
    """Return the library's law, and all its columns except the swept input."""
    case, along, (start, stop) = question.inputs, question.along, question.ends
    _refuse_model(question)
    law = mumacro.law(
        table.surrogate,
        along,
        start=start,
        stop=stop,
        points=question.points,
        scale=question.scale,
        stiffness_exponent=question.stiffness_exponent,
        **question.kind.names,
        **case,
        **question.deviations,
    )
    cases = law.answer.cases
    answer = table.surrogate.answer(cases, chosen(question.outputs, cases))
    columns = {
        path: words(column) if path in TEXTS else column.tolist()
        for path, column in {**answer.columns, **law.columns}.items()
        if path != along
    }
    return law, columns


def _refuse_model(question: Any) -> None:
    if question.model:
        raise InputError("include", MODEL, f"without {MODEL}, which is for one case: /v1/mu-macro")


def _answer_at(
    question: Any,
    table: LoadedTable,
    unknown: str,
    values: Array,
    stiffening: Stiffening | None,
) -> Answer[Any]:
    """Return the answers at values of one input, with the included outputs."""
    inputs = {name: value for name, value in question.inputs.items() if value is not None}
    inputs[unknown] = values
    if stiffening is not None:
        stiffnesses = stiffening.scaled(question.inputs, values)
        inputs = {name: value for name, value in inputs.items() if name != "k"} | stiffnesses
    cases = Cases.of(inputs | question.words | question.deviations)
    return table.surrogate.answer(cases, chosen(question.outputs, cases))


@router.post(
    "/law",
    responses={200: {"model": LawAnswer}, **POST_PROBLEMS},
    summary="mu_macro over a range of one input",
)
async def post_law(request: Request, question: LawRequest) -> Response:
    """Return the law in columns, with its static limit and its border."""
    members = await understood_in(request, question.understood)

    def answer() -> Response:
        table = request.app.state.tables.pick(question.tolerance)
        law, columns = _law(question, table)
        along = question.along
        axis = {"along": along, "unit": unit_of(along), "values": law.values}
        border = [{"value": mark.value, "mu_macro": mark.mu_macro} for mark in law.border]
        model = {MODEL: [note.as_row for note in law.notes]} if law.notes else {}
        said = {**model, **members}
        return Json({**axis, **nested(columns), "border": border, **said, **table.signature})

    with with_members(**members):
        return await compute(request, answer)


_CSV = {"description": "The law", "content": {"text/csv": {"schema": {"type": "string"}}}}


@router.get(
    "/law.csv",
    response_class=Response,
    responses={200: _CSV, **GET_PROBLEMS},
    summary="mu_macro over a range of one input, as a table",
)
async def get_law_csv(request: Request, question: Annotated[LawRequest, Query()]) -> Response:
    """Return the law as CSV (RFC 4180), one row per value; the header names the columns with their
    units."""

    def answer() -> Response:
        if question.understood:
            raise InputError("include", UNDERSTOOD, f"without {UNDERSTOOD}, which JSON has")
        law, columns = _law(question, request.app.state.tables.pick(question.tolerance))
        along = question.along
        heads = {f"{along} [{unit_of(along)}]": law.values.tolist()}
        for path in sorted(columns, key=lambda path: path in TEXTS):  # texts last
            row = ["" if value != value else value for value in columns[path]]
            heads[path if path in TEXTS else f"{path} [{unit_at(path)}]"] = row
        text = io.StringIO()
        writer = csv.writer(text)
        writer.writerow(heads)
        writer.writerows(zip(*heads.values(), strict=True))
        headers = {
            "Content-Disposition": f'attachment; filename="friction-law-{along}.csv"',
            "Cache-Control": "no-cache",
        }
        kind = "text/csv; charset=utf-8; header=present"
        return Response(text.getvalue(), media_type=kind, headers=headers)

    return await compute(request, answer)


_BESIDE = {"mu_static": "-", "k": "N/m"}


def unit_at(path: str) -> str:
    """Return the unit of a column of a law."""
    return _BESIDE[path] if path in _BESIDE else MEMBERS[path].unit


# --- inverse --------------------------------------------------------------------------------------


@router.post(
    "/solve-for",
    responses={200: {"model": SolveForAnswer | SolveMotionAnswer}, **POST_PROBLEMS},
    summary="The value of one input that gives a wanted mu_macro",
)
async def post_solve_for(request: Request, question: SolveForRequest) -> Response:
    """Return every root of every target.  A target out of reach has no root; ``reachable`` is the
    range of mu_macro.  With ``x``, ``y`` or ``normal`` the question is about any motion."""
    members = await understood_in(request, question.understood)
    with with_members(**members):
        if question.is_motion:
            one = cost_of(question.contact, question.x, question.y, question.normal)
            cost = len(question.target) * MOTIONS_OF_A_SEARCH * one
            return await compute(request, lambda: Json(_solved_motion(question) | members), cost)
        tables: Tables = request.app.state.tables
        return await compute(request, lambda: Json(_solved(question, tables) | members))


def _solved_motion(question: SolveForRequest) -> dict[str, Any]:
    """Return the roots for a motion; no table is needed."""
    motion, of = question.motion, question.of or "mu_macro"
    unit = _unit_of_target(question)
    solution = mumacro.solve_motion(
        question.unknown,
        [x * unit for x in question.target],
        of=of,
        within=None if question.range is None else (question.range[0], question.range[1]),
        **motion,
    )
    answer = _in_quantity(question, solution.to_dict(), unit)
    if "other_way" in answer:
        _with_targets(question, answer["other_way"])
    return {**answer, "quantity": question.quantity, "api_version": API_VERSION}


def _unit_of_target(question: SolveForRequest) -> float:
    """Return the factor of a target: mu0, or 1."""
    if question.quantity == "mu_macro":
        return 1.0
    if question.unknown == "mu0" or question.mu0 is None:
        bound = "mu_macro where mu0 is the unknown or is left out"
        raise InputError("quantity", question.quantity, bound)
    return read_one("mu0", question.mu0)


def _solved(question: SolveForRequest, tables: Tables) -> dict[str, Any]:
    table, case = tables.pick(question.tolerance), question.inputs
    _refuse_model(question)
    name = question.unknown
    unit = _unit_of_target(question)
    within = None if question.range is None else (question.range[0], question.range[1])
    solution = mumacro.solve_for(
        table.surrogate,
        name,
        [x * unit for x in question.target],
        within=within,
        stiffness_exponent=question.stiffness_exponent,
        **question.kind.names,
        **case,
    )
    answer = _in_quantity(question, solution.to_dict(), unit)
    included = iter(_included(question, table, name, solution))
    for result in answer["results"]:
        result["roots"] = [root | next(included) for root in result["roots"]]
    for one, end in zip(solution.ends or (), answer.get("ends", ()), strict=True):
        end |= {"k": one.curve.case["k"], **_in_quantity(question, end, unit)}
    answer |= {"quantity": question.quantity}
    return {**answer, **table.signature}


def _in_quantity(question: SolveForRequest, answer: dict[str, Any], unit: float) -> dict[str, Any]:
    """Return the library's answer, with targets and reachable values in the quantity that the
    request asks for."""
    _with_targets(question, answer["results"])
    reach = answer["reachable"]
    return answer | {"reachable": reach | {end: reach[end] / unit for end in ("min", "max")}}


def _with_targets(question: SolveForRequest, results: list[dict[str, Any]]) -> None:
    for target, result in zip(question.target, results, strict=True):
        result["target"] = target
        if "reason" in result and question.quantity != "mu_macro":
            result["reason"] = f"{question.quantity} = {target:.6g}: {result['reason']}"


def _included(
    question: SolveForRequest, table: LoadedTable, unknown: str, solution: TableSolution
) -> list[dict[str, Any]]:
    """Return the included quantities of every root, in order."""
    values = np.array([root.value for roots in solution.roots for root in roots])
    if not (question.outputs or question.deviations) or not values.size:
        return [{}] * values.size
    outputs = _answer_at(question, table, unknown, values, solution.curve.stiffening).outputs
    rows = zip(*(column.tolist() for column in outputs.values()), strict=True)
    return [nested(dict(zip(outputs, row, strict=True))) for row in rows]
