"""What the solutions of both inverse problems share: their one value, their roots as columns and as
JSON."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mumacro.errors import InputError


def counts(roots: Sequence[Sequence[Any]]) -> str:
    """How many targets and roots there are.

    >>> counts([(1.0,), ()]), counts([(1.0, 2.0)])
    ('2 targets, 1 root', '1 target, 2 roots')
    """
    return f"{_counted(len(roots), 'target')}, {_counted(sum(map(len, roots)), 'root')}"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def one_value(roots: Sequence[Sequence[Any]], reason: Callable[[int], str]) -> float:
    """The value of the one root of one target; InputError where there are none or several."""
    every = [root for of_target in roots for root in of_target]
    if len(every) == len(roots) == 1:
        return float(every[0].value)
    if len(roots) != 1:
        bound = f"that of one target, and there are {len(roots)}: see .roots"
    elif every:
        values = ", ".join(f"{root.value:.6g}" for root in every)
        bound = f"that of one root, and there are {len(every)}, {values}: see .roots"
    else:
        bound = f"that of a root, and there is none: {reason(0)}"
    raise InputError("value", None, bound)


def results_of(
    targets: Sequence[float], roots: Sequence[Sequence[Any]], reason: Callable[[int], str]
) -> list[dict[str, Any]]:
    """Targets with their roots, and why there is none, as JSON has them."""
    return [
        {
            "target": target,
            "roots": [root._asdict() for root in of_target],
            **({} if of_target else {"reason": reason(i)}),
        }
        for i, (target, of_target) in enumerate(zip(targets, roots, strict=True))
    ]


def columns_of(
    root: Any, targets: Sequence[float], roots: Sequence[Sequence[Any]]
) -> dict[str, Any]:
    """Targets and their roots, which are tuples with the names of ``root``, as columns."""
    rows = [
        (target, *one)
        for target, of_target in zip(targets, roots, strict=True)
        for one in of_target
    ]
    names = ("target", *root._fields)
    columns = zip(*rows, strict=True) if rows else ([] for _ in names)
    return {name: np.array(column) for name, column in zip(names, columns, strict=True)}
