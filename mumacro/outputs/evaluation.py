"""Cases become their answer: the one place where outputs are computed."""

import math
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, Literal

import numpy as np

from mumacro.answer import (
    BAND,
    GROUPS,
    Answer,
    AnswerWithGradient,
    IntervalAnswer,
    add,
)
from mumacro.errors import InputError
from mumacro.inputs.cases import Cases
from mumacro.inputs.doubts import Remark
from mumacro.inputs.kind import Kind
from mumacro.kernel.arrays import Bools
from mumacro.kernel.binding import Detail
from mumacro.outputs import OUTPUTS
from mumacro.outputs.deviation import bent
from mumacro.outputs.entry import Output, Values
from mumacro.outputs.evaluated import Evaluated
from mumacro.outputs.tabulated import Tabulated

# times of kinds, divided by that of one spring across at one k
_COSTS = {"ball": 2.0, "along": 10.0, "normal": 10.0}
_BALL_ALONG = 5.0  # a further factor: a ball along is a sum over springs
_INTERVAL = 200.0


def names_in(include: Iterable[str] | str) -> list[str]:
    """The names of outputs in a list, or in a text with commas; InputError for an unknown one."""
    bound = f"one or more of {', '.join(OUTPUTS)}"
    try:
        names = include.split(",") if isinstance(include, str) else [*include]
    except TypeError:
        raise InputError("include", include, bound) from None
    names = [name.strip() if isinstance(name, str) else name for name in names]
    for name in names:
        if not isinstance(name, str) or name not in OUTPUTS:
            raise InputError("include", name, bound)
    return names


def chosen(include: Iterable[str] | str, cases: Cases) -> tuple[Output, ...]:
    """The outputs of these names, each once, in their order; with those of deviations where the
    cases have some.

    InputError for an unknown name, one that all of the cases lack, and std without a deviation.
    """
    names = {*names_in(include)} if include else set()
    if not names and not cases.std:
        return ()
    if "std" in names and not cases.std:
        bound = "given if include has std: the deviation of at least one input"
        raise InputError("std", None, bound)
    if cases.std:
        names.add("std")
    outputs = tuple(output for name, output in OUTPUTS.items() if name in names)
    if cases.kind is not None:
        for output, word, why, where in _lacked(outputs, cases):
            if where is True:
                bound = f"without {output.name} for {word}: {why}"
                raise InputError("include", output.name, bound)
    return outputs


def paths_of(outputs: Iterable[Output], fields: tuple[str, ...]) -> tuple[str, ...]:
    """The paths of all values of outputs, for cases with these inputs, in order."""
    return _paths(tuple(output.name for output in outputs), fields)


@cache
def _paths(names: tuple[str, ...], fields: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(path for name in names for path in OUTPUTS[name].paths(fields))


def cost(outputs: Iterable[Output], cases: Cases) -> float:
    """The time of one of the cases with these outputs, about, in times of mu_macro alone for one
    spring across; of several kinds that of the slowest."""
    slowest = max(map(_cost_of, cases.kinds), default=1.0)
    each = 1.0 + sum(output.cost for output in outputs)
    return each * slowest * (_INTERVAL if cases.ends is not None else 1.0)


@cache
def _cost_of(kind: Kind) -> float:
    words = [*kind.names.values()]
    factor = _BALL_ALONG if words == ["ball", "along"] else 1.0
    return factor * math.prod(_COSTS.get(word, 1.0) for word in words)


def answer(
    tabulated: Tabulated, cases: Cases, outputs: tuple[Output, ...] = (), groups: bool = False
) -> Answer[Any]:
    """The answer to cases with these outputs; ``groups`` keeps v~, y~ and l0, too.

    In a column of several kinds an output is NaN where a kind does not have it, with a remark.
    """
    gradient = any(output.gradient for output in outputs)
    detail: Detail = "gradient" if gradient else "groups" if outputs or groups else "values"
    plain = cases.codes is None and cases.ends is None
    if cases.shape and plain and not outputs:
        rows = tabulated.rows(cases, detail)  # the kernel's arrays are the answer
        group_values = (rows.v_tilde, rows.y_tilde, rows.length_scale) if groups else None
        numbers = rows.mu_macro, rows.mu_ratio, rows.error_bound
        return Answer(*numbers, rows.source, group_values, cases)
    remarks: list[Remark] = []
    columns: Values = {}
    if cases.codes is None:
        evaluated = Evaluated(tabulated, cases, detail)
        columns = _columns(evaluated, outputs, remarks)
        if cases.std and not cases.shape:
            remarks += bent(evaluated, columns["std"])
    else:
        for where, part in cases.by_kind():
            evaluated = Evaluated(tabulated, part, detail)
            for name, column in _columns(evaluated, outputs, remarks).items():
                none = -1 if name == "source" else math.nan
                columns.setdefault(name, np.full(cases.size, none))[where] = column
    return _answer(cases, columns, outputs, detail, remarks)


# what stands beside the outputs, by the names of attributes
_ALWAYS = ("mu_macro", "mu_ratio", "error_bound", "source")
_SLOPES = ("gradient", "gradient_bound")


def _columns(evaluated: Evaluated, outputs: tuple[Output, ...], remarks: list[Remark]) -> Values:
    """All that is computed of cases of one kind: outputs by path, and what stands beside them by
    name; NaN where a case lacks an output, or is not legal."""
    gaps: dict[str, Any] = {}
    for output, word, why, where in _lacked(outputs, evaluated.cases):
        gaps[output.name] = where
        number = evaluated.cases.size if where is True else int(np.count_nonzero(where))
        text = f"there is no {output.name} for {word}: {why}"
        add(remarks, {"row": "include", "field": output.name, "cases": number, "text": text})
    columns: Values = {}
    with np.errstate(all="ignore"):
        for output in outputs:
            absent = gaps.get(output.name)
            if absent is True:
                continue
            part = output.compute(evaluated)
            if absent is not None:
                part = {path: np.where(absent, math.nan, x) for path, x in part.items()}
            columns |= part
    if evaluated.cases.shape:
        illegal = evaluated.source < 0
        all_legal = not illegal.any()
        for path, x in columns.items():
            if not (all_legal and np.shape(x) == illegal.shape):
                columns[path] = np.where(illegal, math.nan, x)
    else:
        columns = {path: float(x) for path, x in columns.items()}
    members = evaluated.__dict__
    columns |= {name: members[name] for name in (*_ALWAYS, *GROUPS, *BAND) if name in members}
    for name in _SLOPES:
        columns |= {f"{name} {field}": x for field, x in members.get(name, {}).items()}
    return columns


def _lacked(
    outputs: tuple[Output, ...], cases: Cases
) -> Iterator[tuple[Output, str, str, Bools | Literal[True]]]:
    """The outputs that cases of one kind lack, for which direction or interval, why, and which
    cases do: all of them, or these."""
    words = cases.one_kind.names.values()
    for output in outputs:
        for word, why in output.lacks.items():
            if word in words:
                yield output, word, why, True
            elif word == "k_range" and cases.ends is not None:
                low, high = cases.ends
                wide = np.asarray(low != high)  # a number is an interval of itself
                if wide.any():
                    yield output, word, why, True if wide.all() else wide


def _answer(
    cases: Cases,
    columns: Values,
    outputs: tuple[Output, ...],
    detail: Detail,
    remarks: list[Remark],
) -> Answer[Any]:
    """The answer in the shape of the cases."""
    shape = cases.shape

    def shaped(name: str) -> Any:
        if not shape:
            return columns[name]
        return columns[name].reshape(shape) if name in columns else np.full(shape, math.nan)

    source = columns["source"] if columns else np.full(cases.size, -1)
    source = np.asarray(source, np.int8).reshape(shape) if shape else int(source)
    groups = None
    if detail != "values" or not shape:
        groups = (shaped(GROUPS[0]), shaped(GROUPS[1]), shaped(GROUPS[2]))
    asked_for_slopes = any(output.name == "gradient" for output in outputs)
    of_type: Any = Answer
    if cases.ends is not None:
        of_type = IntervalAnswer
    elif asked_for_slopes:
        of_type = AnswerWithGradient
    answer: Answer[Any] = of_type(*map(shaped, _ALWAYS[:3]), source, groups, cases)
    if cases.ends is not None:
        for name in BAND:
            setattr(answer, name, shaped(name))
    if asked_for_slopes:
        for name in _SLOPES:
            setattr(answer, name, {field: shaped(f"{name} {field}") for field in cases.fields})
    answer.outputs = {path: shaped(path) for path in paths_of(outputs, cases.fields)}
    answer.remarks_on_outputs = remarks
    return answer
