"""Cases become their answer: the one place where outputs are computed."""

import math
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np

from mumacro.answer import (
    BAND,
    GROUPS,
    Answer,
    AnswerWithGradient,
    IntervalAnswer,
    Remark,
)
from mumacro.errors import InputError
from mumacro.inputs.cases import Cases
from mumacro.inputs.kind import SPRING, Kind
from mumacro.kernel.arrays import Bools
from mumacro.kernel.binding import Detail
from mumacro.outputs import OUTPUTS
from mumacro.outputs.deviation import bent
from mumacro.outputs.entry import Output, Values
from mumacro.outputs.evaluated import Evaluated
from mumacro.outputs.tabulated import Tabulated

# in times of one spring, across, at one k
_COSTS = {"ball": 2.0, "along": 10.0, "normal": 10.0}
_BALL_ALONG = 5.0  # times both: a sum over springs
_INTERVAL = 200.0


def chosen(include: Iterable[str] | str, std: bool = False) -> tuple[Output, ...]:
    """The outputs of these names, each once, in their order; with those of deviations where there
    are some.

    InputError for an unknown name, and for ``std`` without a deviation.

    >>> [output.name for output in chosen("power, groups")]
    ['groups', 'power']
    """
    names = names_in(include)
    if "std" in names and not std:
        bound = "given if include has std: the deviation of at least one input"
        raise InputError("std", None, bound)
    wanted = {*names, "std"} if std else {*names}
    return tuple(output for name, output in OUTPUTS.items() if name in wanted)


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


def cost(outputs: Iterable[Output], cases: Cases) -> float:
    """The time of a case, about, in times of mu_macro alone for one spring across; of several kinds
    that of the slowest."""
    words = [kind.names for kind in kinds_of(cases)]
    factors = [
        math.prod(_COSTS.get(word, 1.0) for word in names.values())
        * (_BALL_ALONG if [*names.values()] == ["ball", "along"] else 1.0)
        for names in words
    ]
    interval = 1.0 if cases.ends is None else _INTERVAL
    return (1.0 + sum(output.cost for output in outputs)) * max(factors, default=1.0) * interval


def kinds_of(cases: Cases) -> list[Kind]:
    """The contacts and directions among cases."""
    if cases.kind is not None:
        return [cases.kind]
    return [part.kind for _, part in cases.by_kind() if part.kind is not None]


def evaluate(
    tabulated: Tabulated, cases: Cases, include: Iterable[str] | str = (), groups: bool = False
) -> Answer[Any]:
    """The answer to cases with the outputs of these names; ``groups`` keeps v~, y~ and l0, too.

    InputError for an output that none of the cases has.
    """
    outputs = chosen(include, bool(cases.std))
    gradient = any(output.gradient for output in outputs)
    detail: Detail = "gradient" if gradient else "groups" if outputs or groups else "values"
    remarks: list[Remark] = []
    if cases.codes is None:
        lacking = _lacking(outputs, cases, remarks)
        for output in outputs:
            if lacking.get(output.name) is True:
                raise InputError("include", output.name, f"left out: {remarks[0]['text']}")
        evaluated = Evaluated(tabulated, cases, detail)
        columns = _columns(evaluated, outputs, lacking)
        if cases.std and not cases.shape:
            remarks += bent(evaluated, columns["std"])
    else:
        columns = {}
        for where, part in cases.by_kind():
            evaluated = Evaluated(tabulated, part, detail)
            lacking = _lacking(outputs, part, remarks)
            for name, column in _columns(evaluated, outputs, lacking).items():
                none = -1 if name == "source" else math.nan
                columns.setdefault(name, np.full(cases.size, none))[where] = column
    return _answer(cases, columns, outputs, detail, remarks)


# what stands beside the outputs, by the names of attributes
_ALWAYS = ("mu_macro", "mu_ratio", "error_bound", "source")
_SLOPES = ("gradient", "gradient_bound")


def _columns(
    evaluated: Evaluated, outputs: tuple[Output, ...], lacking: Mapping[str, Any]
) -> Values:
    """All that is computed of cases of one kind: outputs by path, and what stands beside them by
    name; NaN where a case lacks an output, or is not legal."""
    columns: Values = {}
    with np.errstate(all="ignore"):
        for output in outputs:
            if (where := lacking.get(output.name)) is True:
                continue
            part = output.compute(evaluated)
            if where is not None:
                part = {path: np.where(where, math.nan, x) for path, x in part.items()}
            columns |= part
    if evaluated.cases.shape:
        illegal = evaluated.source < 0
        all_legal = not illegal.any()
        for path, x in columns.items():
            if not (all_legal and np.shape(x) == illegal.shape):
                columns[path] = np.where(illegal, math.nan, x)
    else:
        columns = {path: float(x) for path, x in columns.items()}
    own = evaluated.__dict__
    columns |= {name: own[name] for name in (*_ALWAYS, *GROUPS, *BAND) if name in own}
    for name in _SLOPES:
        columns |= {f"{name} {field}": x for field, x in own.get(name, {}).items()}
    return columns


def _lacking(
    outputs: tuple[Output, ...], cases: Cases, remarks: list[Remark]
) -> dict[str, Bools | Literal[True]]:
    """The outputs that cases of one kind lack, all of them or these, with remarks that say why."""
    kind = cases.kind or SPRING
    lacking: dict[str, Bools | Literal[True]] = {}
    for output in outputs:
        for word, why in output.lacks.items():
            where: Any = word in kind.names.values()
            if word == "k_range" and cases.ends is not None:
                low, high = cases.ends  # a number is an interval of itself
                where = low != high
                where = True if where.all() else where
            number = cases.size if where is True else int(np.count_nonzero(where))
            if number:
                lacking[output.name] = where
                text = f"there is no {output.name} for {word}: {why}"
                _remark(remarks, output.name, number, text)
    return lacking


def _remark(remarks: list[Remark], name: str, number: int, text: str) -> None:
    """Add a remark, or its cases to the same one."""
    for remark in remarks:
        if (remark["field"], remark["text"]) == (name, text):
            remark["cases"] += number
            return
    remarks.append({"row": "include", "field": name, "cases": number, "text": text})


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

    source = columns.get("source", np.full(cases.size, -1))
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
    paths = [path for output in outputs for path in output.paths(cases.fields)]
    answer.outputs = {path: shaped(path) for path in paths}
    answer.remarks_on_outputs = remarks
    return answer
