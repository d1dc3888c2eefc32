"""A sweep: mu_macro as a function of one input, the other five constant."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mumacro.analysis.load import Stiffening
from mumacro.answer import Answer
from mumacro.errors import InputError
from mumacro.inputs.fields import as_columns, check_inputs, unknown_name
from mumacro.inputs.k_range import ENDS
from mumacro.inputs.kind import AMPLITUDE, SPRING, Kind
from mumacro.kernel.arrays import Array
from mumacro.surrogate import Surrogate

EVERYWHERE = ("v0", "y0", "omega", AMPLITUDE)  # inputs that are searched over all their values
_CHORD, _HALVINGS = 1e-3, 8  # of a refined sweep: error of a straight line over the height, rounds


def checked_case(case: Mapping[str, Any], without: str, kind: Kind = SPRING) -> dict[str, float]:
    """The five known inputs [SI], each one legal number, by the names of ``kind.fields``; an
    infinite ``k`` is rigid.

    ``f`` [Hz] may stand for ``omega`` [rad/s], the word ``rigid`` for an infinite ``k``.
    """
    if without not in kind.fields:
        raise InputError("unknown", without, f"one of {', '.join(kind.fields)}")
    for name in ("k_range", *ENDS):
        if case.get(name) is not None:
            told = (
                "left out: over an interval of k a target has an interval of roots; solve for "
                "both ends of it"
            )
            raise InputError(name, case[name], told)
    names = [*kind.columns, *({"y0", AMPLITUDE} - {*kind.columns})]
    for name in case.keys() - {*names, *ENDS, "k_range"}:
        bound = f"one of {', '.join(kind.columns)}; {unknown_name(name, kind.columns)}"
        raise InputError(name, case[name], bound)
    given = {
        name: value for name, value in case.items() if value is not None or name == "k" != without
    }
    for name in given.keys() & ({"omega", "f"} if without == "omega" else {without}):
        raise InputError(name, given[name], f"left out, because {without} is the unknown")
    given = kind.as_six({**given, without: 1.0})
    try:
        six = as_columns(given)
        columns = kind.as_given(six)
        for name, column in columns.items():
            if column.size != 1:
                raise InputError(name, given.get(name, given.get("f")), "one number")
        check_inputs(six, given.get("f"))
        if kind.normal and without not in ("Fz", AMPLITUDE):
            kind.check_lift_off(six["y0"], six["Fz"])
    except InputError as error:
        raise kind.refused(error) from error.__cause__
    return {name: float(column.item()) for name, column in columns.items() if name != without}


class Sweep:
    """mu_macro as a function of one input, ``unknown``; ``case`` holds the other five, an infinite
    ``k`` is rigid.

    With a ``stiffening`` the unknown is Fz, and ``k`` is that at one load and grows with Fz.
    """

    def __init__(
        self,
        surrogate: Surrogate,
        case: Mapping[str, Any],
        unknown: str,
        kind: Kind = SPRING,
        stiffening: Stiffening | None = None,
    ) -> None:
        self.surrogate, self.case, self.unknown, self.kind = surrogate, case, unknown, kind
        self.stiffening = None if case.get("k") == math.inf else stiffening

    def answer(self, x: Any, **more: Any) -> Answer[Any]:
        """The surrogate's results at the values ``x`` (n,) of the input [SI]; ``more`` as in
        ``evaluate``."""
        k = {} if self.stiffening is None else self.stiffening.scaled(self.case, x)
        answer: Answer[Any] = self.surrogate.evaluate(
            **{**self.case, **k, self.unknown: x, **self.kind.names, **more}
        )
        return answer

    def mu(self, x: Array) -> Array:
        """mu_macro [-] at ``x`` (n,)."""
        return np.asarray(self.answer(x).mu_macro)

    def with_slope(self, x: Array) -> tuple[Answer[Any], Array]:
        """The results and d mu_macro / d ln x [-] at ``x`` (n,); the slope may be infinite or NaN
        at an edge."""
        answer = self.answer(x, gradient=True)
        with np.errstate(over="ignore", invalid="ignore"):
            slope = x * answer.gradient[self.unknown]  # type: ignore[index]
            if self.stiffening is not None:
                k = self.stiffening.stiffness(self.case["k"], x)
                slope = slope + self.stiffening.exponent * k * answer.gradient["k"]  # type: ignore[index]
            return answer, slope

    def refined(self, values: Array) -> Array:
        """``values`` and more between them, where chords of mu_macro differ from it."""
        mu = self.mu(values)
        for _ in range(_HALVINGS):
            low, high = values[:-1], values[1:]
            middle = np.where(low > 0.0, np.sqrt(low) * np.sqrt(high), 0.5 * high)
            inside = self.mu(middle)
            bent = np.abs(inside - 0.5 * (mu[:-1] + mu[1:])) > _CHORD * np.ptp(mu)
            at = np.flatnonzero(bent & (middle > low) & (middle < high))
            if not at.size:
                break
            values, mu = np.insert(values, at + 1, middle[at]), np.insert(mu, at + 1, inside[at])
        return values

    def where(self, place: float) -> float:
        """Value of k, Fz or mu0 at which y~, for normal v~/z, is ``place``, within double range; of
        a rigid contact any."""
        one = self.answer(1.0 if self.stiffening is None else self.stiffening.load)
        at_one = float(one.v_tilde / one.y_tilde if self.kind.normal else one.y_tilde)
        scale = 1.0 if self.case.get("k") == math.inf else min(max(at_one, 1e-300), 1e300)
        if self.stiffening is not None:
            return self.stiffening.place(place / scale)
        return place / scale if self.unknown == "k" else scale / place

    @property
    def proportional(self) -> bool:
        """Whether k grows in proportion to Fz, so that Fz has no influence."""
        growth = self.stiffening
        return growth is not None and growth.exponent == 1.0 and not self.kind.normal
