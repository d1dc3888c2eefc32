"""Compute the answer to cases: the one place where outputs are computed."""

import math
from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import Cases, check
from mumacro.inputs.fields import BALL, Kind
from mumacro.kernel.binding import Detail
from mumacro.outputs import OUTPUTS
from mumacro.outputs.answer import BAND, GROUPS, Answer
from mumacro.outputs.deviation import STD, rough
from mumacro.outputs.entry import Output, Values
from mumacro.outputs.evaluated import Evaluated
from mumacro.outputs.gradient import GRADIENT
from mumacro.outputs.tabulated import Tabulated

# times of contacts and directions, divided by that of one spring across with one k
_COSTS = {"ball": 2.0, "along": 10.0, "normal": 10.0}
_BALL_ALONG = 5.0  # a further factor, since a ball along is a sum over springs
_INTERVAL = 200.0


def names_in(include: Iterable[str] | str) -> list[str]:
    """Return the names of outputs in a list, or in a text with commas.  Raise InputError for an
    unknown name."""
    try:
        names = include.split(",") if isinstance(include, str) else [*include]
    except TypeError:
        raise _unknown(include) from None
    names = [name.strip() if isinstance(name, str) else name for name in names]
    for name in names:
        if not isinstance(name, str) or name not in OUTPUTS:
            raise _unknown(name)
    return names


def _unknown(name: Any) -> InputError:
    return InputError("include", name, f"one or more of {', '.join(OUTPUTS)}")


def chosen(
    include: Iterable[str] | str, cases: Cases, gradient: bool = False
) -> tuple[Output, ...]:
    """Return the outputs of these names (with ``gradient`` if asked for), each once, in the fixed
    order.  Add the outputs of deviations if the cases have deviations.

    Raise InputError for an unknown name, for an output that does not exist for the cases, and for
    std without a deviation.
    """
    names = () if type(include) is tuple and not include else names_in(include)
    if not names and not gradient and not cases.std:
        return ()
    return outputs_for(frozenset(names), cases.kind, bool(cases.std), bool(gradient))


@cache
def outputs_for(
    names: frozenset[str], kind: Kind, deviations: bool, gradient: bool = False
) -> tuple[Output, ...]:
    """Return the same from the properties of the cases on which it depends, ``deviations`` whether
    they have any."""
    if "std" in names and not deviations:
        bound = "without std where no input has a deviation: give one, such as std_k"
        raise InputError("include", "std", bound)
    wanted = {*names, *["gradient"] * gradient, *["std"] * deviations}
    outputs = tuple(output for name, output in OUTPUTS.items() if name in wanted)
    for output in outputs:
        for word in output.lacks.keys() & {*kind.names.values()}:
            bound = f"without {output.name} for {word}: {output.lacks[word]}"
            raise InputError("include", output.name, bound)
    return outputs


def paths_of(outputs: Iterable[Output], fields: tuple[str, ...]) -> tuple[str, ...]:
    """Return the paths of all values of the outputs, for cases with these inputs, in order."""
    return tuple(path for output in outputs for path in output.paths(fields))


def cost(outputs: Iterable[Output], cases: Cases) -> float:
    """Return the approximate time of one of the cases with these outputs, relative to mu_macro
    alone for one spring across."""
    ball = cases.kind.contact == BALL.contact
    costs = ((ball and output.cost_of_ball) or output.cost for output in outputs)
    over_interval = _INTERVAL if cases.ends is not None else 1.0
    return (1.0 + sum(costs)) * _cost_of(cases.kind) * over_interval


@cache
def _cost_of(kind: Kind) -> float:
    words = [*kind.names.values()]
    factor = _BALL_ALONG if words == ["ball", "along"] else 1.0
    return factor * math.prod(_COSTS.get(word, 1.0) for word in words)


def evaluate_cases(
    tabulated: Tabulated, cases: Cases, outputs: tuple[Output, ...] = (), groups: bool = False
) -> Answer[Any]:
    """Return the answer to cases with these outputs; ``groups`` adds v~, y~ and l0."""
    detail: Detail = "groups" if outputs or groups else "values"
    if outputs and [output for output in outputs if output.gradient]:
        detail = "gradient"
    if not cases.shape:
        return _of_one(Evaluated(tabulated, cases, detail), outputs)
    if not outputs and cases.ends is None:
        rows = tabulated.rows(cases, detail)  # the kernel's arrays are the answer
        group_values = (rows.v_tilde, rows.y_tilde, rows.length_scale) if groups else None
        numbers = rows.mu_macro, rows.mu_ratio, rows.error_bound
        return Answer(*numbers, rows.source, group_values, cases)
    return _of_many(tabulated, cases, outputs, detail)


def _of_one(case: Evaluated, outputs: tuple[Output, ...]) -> Answer[float]:
    """Return the answer to one case, in plain numbers.  Raise InputError for an illegal value."""
    if case.source < 0:
        check(case.columns, case.cases.f)
    values: Values = {}
    for output in outputs:
        values.update(output.compute(case))
    cases = case.cases
    answer: Answer[Any] = Answer(
        case.mu_macro,
        case.mu_ratio,
        case.error_bound,
        int(case.source),
        (case.v_tilde, case.y_tilde, case.length_scale),
        cases,
    )
    if cases.ends is not None:
        values = {name: getattr(case, name) for name in BAND} | values
    if values:
        answer.outputs = {path: float(value) for path, value in values.items()}
    if GRADIENT in outputs:
        answer.gradient, answer.gradient_bound = case.gradient, case.gradient_bound
    if STD in outputs:
        answer.notes_on_outputs = rough(case, answer.outputs["std"])
    return answer


def _of_many(
    tabulated: Tabulated, cases: Cases, outputs: tuple[Output, ...], detail: Detail
) -> Answer[Any]:
    """Return the answer to cases in columns, in their shape."""
    columns = _columns(Evaluated(tabulated, cases, detail), outputs)

    def shaped(name: str) -> Any:
        return columns[name].reshape(cases.shape)

    mu_macro, mu_ratio, error_bound = map(shaped, _ALWAYS[:3])
    answer: Answer[Any] = Answer(
        mu_macro,
        mu_ratio,
        error_bound,
        np.asarray(columns["source"], np.int8).reshape(cases.shape),
        None if detail == "values" else (*map(shaped, GROUPS),),
        cases,
    )
    band = () if cases.ends is None else BAND
    answer.outputs = {path: shaped(path) for path in (*band, *paths_of(outputs, cases.fields))}
    if GRADIENT in outputs:
        answer.gradient, answer.gradient_bound = (
            {field: shaped(f"{name} {field}") for field in cases.fields} for name in _SLOPES
        )
    return answer


# values that are not outputs, by the names of attributes
_ALWAYS = ("mu_macro", "mu_ratio", "error_bound", "source")
_SLOPES = ("gradient", "gradient_bound")


def _columns(evaluated: Evaluated, outputs: tuple[Output, ...]) -> Values:
    """Return all computed columns of cases: outputs by path, the other values by name; NaN where a
    case is illegal."""
    columns: Values = {}
    with np.errstate(all="ignore"):
        for output in outputs:
            columns |= output.compute(evaluated)
    illegal = evaluated.source < 0
    all_legal = not illegal.any()
    for path, x in columns.items():
        if not (all_legal and np.shape(x) == illegal.shape):
            columns[path] = np.where(illegal, math.nan, x)
    members = evaluated.__dict__
    columns |= {name: members[name] for name in (*_ALWAYS, *GROUPS, *BAND) if name in members}
    for name in _SLOPES:
        columns |= {f"{name} {field}": x for field, x in members.get(name, {}).items()}
    return columns
