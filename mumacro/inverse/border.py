"""Where a sweep of one input crosses the border of continuous sliding."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mumacro.inverse.results import Crossing, checked_case
from mumacro.inverse.rootfinding import Sweep, last_double
from mumacro.inverse.solve import MONOTONE, Y_CLOSEST, scale_of
from mumacro.surrogate import Surrogate

__all__ = ["border_crossings"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


def border_crossings(
    surrogate: Surrogate, along: str, case: Mapping[str, float | None], low: float, high: float
) -> tuple[Crossing, ...]:
    """Where in ``low <= along <= high`` continuous sliding begins or ends: none, one, or (mu0, Fz, k) two places.

    ``case`` holds the other five inputs.  None for rigid contact (never any stick) and without oscillation.
    """
    known = checked_case(case, along)
    sweep = Sweep(surrogate, known, along)
    if sweep.case["k"] is None and along != "k":
        return ()
    if any(known.get(name) == 0.0 for name in ("y0", "omega", "v0") if name != along):
        return ()
    edges = [low, high]
    if along not in MONOTONE:
        scale = scale_of(known, along)
        middle = scale * Y_CLOSEST if along == "k" else scale / Y_CLOSEST
        if low < middle < high:
            edges.insert(1, middle)

    def slides(x: Array) -> Bools:
        out: Bools = np.asarray(sweep.answer(x).regime) == "continuous"
        return out

    state = slides(np.array(edges))
    found = []
    for a, b, here, there in zip(edges[:-1], edges[1:], state[:-1], state[1:], strict=True):
        if here != there:
            wanted = bool(here)
            _, first = last_double(lambda x, wanted=wanted: slides(x) == wanted, np.array([a]), np.array([b]))  # type: ignore[misc]
            found.append(Crossing(float(first[0]), sweep.at(float(first[0]))))
    return tuple(found)
