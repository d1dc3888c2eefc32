"""Evaluate mu_macro as a curve over one input, with the other five constant."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mumacro.inputs.cases import Cases
from mumacro.inputs.fields import AMPLITUDE, SPRING, Kind
from mumacro.inputs.stiffening import Stiffening
from mumacro.kernel.arrays import Array
from mumacro.outputs.answer import Answer
from mumacro.surrogate import Surrogate

EVERYWHERE = ("v0", "y0", "omega", AMPLITUDE)  # inputs that are searched over all legal values


class InputCurve:
    """Evaluate mu_macro as a function of one input, ``unknown``.  ``case`` holds the other five; an
    infinite ``k`` is rigid.

    With a ``stiffening`` the unknown is Fz; then ``k`` holds at one load and grows with Fz.
    """

    costly = False

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

    def answer(self, x: Any, **replaced: Any) -> Answer[Any]:
        """Return the surrogate's answers at values ``x`` (n,) of the input [SI]; NaN for a value
        out of bounds.  ``replaced`` has other values for inputs of the case."""
        return self.surrogate.answer(self.cases(x, strict=False, **replaced))

    def cases(self, x: Any, strict: bool = True, **replaced: Any) -> Cases:
        """Return the cases of :meth:`answer`; ``replaced`` may also have deviations.  If
        ``strict``, raise InputError for a value out of bounds."""
        k = {} if self.stiffening is None else self.stiffening.scaled(self.case, x)
        return Cases.of({**self.case, **k, self.unknown: x, **replaced}, self.kind, strict)

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Return mu_macro [-] at ``x`` and its error bound, in the shape of ``x``."""
        answer = self.answer(x)
        return np.asarray(answer.mu_macro), np.asarray(answer.error_bound)

    def where(self, group: float) -> float:
        """Return the value of k, Fz or mu0 at which y~ (for normal: v~/z) is ``group``, within
        double range.  For a rigid contact return any value."""
        reference = self.answer(1.0 if self.stiffening is None else self.stiffening.load)
        reference_group = float(
            reference.v_tilde / reference.y_tilde if self.kind.normal else reference.y_tilde
        )
        scale = 1.0 if self.case.get("k") == math.inf else min(max(reference_group, 1e-300), 1e300)
        if self.stiffening is not None:
            return self.stiffening.place(group / scale)
        return group / scale if self.unknown == "k" else scale / group

    @property
    def proportional(self) -> bool:
        """Return whether k is proportional to Fz, so that Fz has no influence."""
        growth = self.stiffening
        return growth is not None and growth.exponent == 1.0 and not self.kind.normal
