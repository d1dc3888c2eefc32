"""Find the borders that a sweep crosses: where continuous sliding (along: reverse slip) begins or
ends."""

import math
from dataclasses import dataclass

import numpy as np

from mumacro.kernel.arrays import Array, Bools, Places
from mumacro.questions.input_curve import EVERYWHERE, InputCurve
from mumacro.questions.search import TINY, last_double
from mumacro.table.atlas import STEEPEST_Y

#: regime -> the border at which it begins or ends
BORDER_NAMES = {
    "continuous": "border of continuous sliding",
    "reverse_slip": "border of reverse slip",
}


@dataclass(frozen=True)
class Crossing:
    """Hold a value of the swept input at which the regime changes, mu_macro there, and the regimes
    below and above."""

    value: float
    mu_macro: float
    regimes: tuple[str, str]

    @property
    def name(self) -> str:
        """Return the name of the border."""
        return next(name for regime, name in BORDER_NAMES.items() if regime in self.regimes)


def border_crossings(curve: InputCurve, low: float, high: float) -> tuple[Crossing, ...]:
    """Return the values of the unknown in a range where continuous sliding or (along) reverse slip
    begins or ends, ascending.

    The border of continuous sliding is crossed at most once, or twice (across, over mu0, Fz or k).
    The list is empty without oscillation, and for a rigid contact, unless it is shaken along: it
    never sticks.
    """
    rigid = curve.case.get("k") == math.inf and not curve.kind.direction
    if rigid or 0.0 in curve.case.values() or curve.proportional:
        return ()
    low = max(low, TINY)  # at 0 there is no oscillation or no sliding
    # On a ray v~/v~crit(y~) is smallest at STEEPEST_Y, where d ln v~crit / d ln y~ = 1.  The
    # derivative falls strictly from 2 to 1/2 (20,001 samples from 1e-6 to 1e12), so each side of
    # STEEPEST_Y crosses the border at most once.
    middle = low
    if curve.unknown not in EVERYWHERE and not curve.kind.direction:
        middle = curve.where(STEEPEST_Y)
    edges = np.array([low, middle, high] if low < middle < high else [low, high])
    pairs = []
    for regime in BORDER_NAMES:
        state = curve.answer(edges).regime == regime
        i = np.flatnonzero(state[1:] != state[:-1])

        def height(x: Array, rows: Places, regime: str = regime, states: Bools = state[i]) -> Array:
            agrees = (curve.answer(x).regime == regime) == states[rows]
            return np.where(agrees, -1.0, 1.0)

        cuts = last_double(height, edges[i], edges[i + 1])
        pairs += [*zip(*(cut.tolist() for cut in cuts), strict=True)]
    below, first = np.array(sorted(set(pairs))).reshape(-1, 2).T
    after = curve.answer(first)
    regimes = zip(curve.answer(below).regime.tolist(), after.regime.tolist(), strict=True)
    return tuple(map(Crossing, first.tolist(), after.mu_macro.tolist(), regimes))
