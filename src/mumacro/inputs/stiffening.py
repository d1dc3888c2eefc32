"""Compute the stiffness of a contact whose load changes: k = k_given (Fz/Fz_given)^m.

The area of a contact grows with its load, and k with it: m = 1/3 for a ball (Hertz), 0.5 to 1 for
rough surfaces, 0 for a flat punch.  This matters if Fz is swept or solved for.  Across and along
only k/Fz counts, which is proportional to Fz^(m-1).  So the friction law over Fz keeps its shape
and is stretched over ln Fz by 1/(1 - m).  For m = 1 it does not depend on Fz.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mumacro.errors import InputError
from mumacro.inputs.case import read, read_one
from mumacro.inputs.cases import check, real
from mumacro.inputs.fields import CONTACTS, ENDS, SPRINGS_OF, Kind
from mumacro.kernel.arrays import Array

EXPONENT = "stiffness_exponent"
ROUGH = 0.5, 1.0  # exponents of rough surfaces (docs/how-to/stiffness.md)
_BOUND = "one number from 0 to 1: 1/3 for a ball, 0.5 to 1 for rough surfaces, 0 for constant k"
_FAR = 1e300  # larger stiffnesses and loads, or smaller ones than its inverse, are not searched


class Stiffening(NamedTuple):
    """Compute k = k_given (Fz/load)^exponent."""

    exponent: float  #: m, > 0 and <= 1
    load: float  #: Fz_given [N], the load of k_given

    def stiffness(self, k: float, load: ArrayLike) -> Array:
        """Return k [N/m] at loads [N], (n,), for a contact that has ``k`` at :attr:`load`.  Raise
        InputError if the result is not a double > 0."""
        loads = np.asarray(load, dtype=np.float64)
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            stiffnesses = np.asarray(k * (loads**self.exponent / self.load**self.exponent))
        # a load that is itself out of bounds is refused later, by its own check
        illegal = (
            (loads > 0.0) & (loads < math.inf) & ~((stiffnesses > 0.0) & (stiffnesses < math.inf))
        )
        if illegal.any() and k < math.inf:
            i = int(np.flatnonzero(illegal.ravel())[0])
            bound = f"such that k = {k:g} N/m (Fz/{self.load:g} N)^{self.exponent:.3g} is a number"
            raise InputError("Fz", float(loads.flat[i]), bound, i if loads.ndim else None)
        return stiffnesses

    def scaled(self, case: Mapping[str, Any], load: ArrayLike) -> dict[str, Array]:
        """Return the stiffnesses of a case at loads [N], (n,): k, or both ends of its interval."""
        if "k" not in case:
            stiffness = {name: read(name, case[name]).si for name in ENDS if name in case}
        elif (one := read("k", case["k"])).low is not None and one.high is not None:
            stiffness = dict(zip(ENDS, (one.low, one.high), strict=True))
        else:
            stiffness = {"k": one.si}
        return {name: self.stiffness(float(k), load) for name, k in stiffness.items()}

    def place(self, ratio: float) -> float:
        """Return the load [N] at which k/Fz is ``ratio`` times its value at :attr:`load`; for m <
        1."""
        power = math.log(self.load) - math.log(ratio) / (1.0 - self.exponent)
        return math.exp(min(max(power, -690.0), 690.0))

    def range(self, k: float) -> tuple[float, float]:
        """Return the range of loads [N] in which both the load and k are well within double
        range."""
        log_k, log_far = math.log(k), math.log(_FAR)
        low, high = (
            math.log(self.load) + (side * log_far - log_k) / self.exponent for side in (-1.0, 1.0)
        )
        return math.exp(max(low, -log_far)), math.exp(min(high, log_far))


def stiffening_of(
    case: Mapping[str, Any], unknown: str, kind: Kind, exponent: float | None
) -> tuple[Mapping[str, Any], Stiffening | None]:
    """Return the case without the load at which k holds, and how k grows if Fz is swept or solved
    for.

    The load at which k holds is ``Fz`` of the case.  Without it k is constant, and an exponent > 0
    is refused.  For a spring without an exponent this load is refused, too.  The second value is
    None if k is constant.
    """
    if exponent is not None:
        power = read_one(EXPONENT, exponent)
        if not 0.0 <= power <= 1.0:
            raise InputError(EXPONENT, exponent, _BOUND)
        if unknown != "Fz":
            bound = f"left out where {unknown} is the unknown or swept: k is that of the one load"
            raise InputError(EXPONENT, exponent, bound)
    load = case.get("Fz")
    if unknown != "Fz" or (load is None and not exponent):
        return case, None
    if load is None:
        bound = "given [N] beside a stiffness exponent: the load at which k holds"
        raise InputError("Fz", None, bound)
    if exponent is None:
        power = SPRINGS_OF[CONTACTS[kind.contact]].exponent
    if exponent is None and not power:
        bound = (
            "left out, because Fz is the unknown or swept; beside a stiffness exponent it is the "
            "load at which k holds"
        )
        raise InputError("Fz", load, bound)
    loads = real("Fz", load)
    if loads.size != 1:
        raise InputError("Fz", load, "one number: the load at which k holds")
    check({"Fz": loads})
    rest = {name: value for name, value in case.items() if name != "Fz"}
    return rest, Stiffening(power, float(loads.item())) if power else None
