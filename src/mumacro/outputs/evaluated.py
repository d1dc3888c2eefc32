"""Hold cases with their answer, as the functions of the outputs need them."""

import math
import sys
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from mumacro.inputs.cases import Cases
from mumacro.inputs.fields import POSITIVE
from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import Detail
from mumacro.outputs.tabulated import Tabulated


class Evaluated:
    """Hold cases with their answer: plain numbers for one case, columns (n,) for many.

    k is infinite for a rigid contact.  An illegal case has NaN and the source code -1.  The
    dimensionless columns exist for the details "groups" and "gradient", the derivatives for
    "gradient"; mu_macro_low and mu_macro_high for an interval of k.
    """

    v_tilde: Any
    y_tilde: Any
    length_scale: Any
    #: whether anything oscillates; whether the contact is elastic, too, with v~ and y~ within
    #: double range
    moving: Any
    usable: Any
    mu_macro_low: Any
    mu_macro_high: Any
    #: d mu_macro / d input and their bounds, by field
    gradient: dict[str, Any]
    gradient_bound: dict[str, Any]

    def __init__(self, tabulated: Tabulated, cases: Cases, detail: Detail = "values") -> None:
        self.tabulated, self.cases, self.kind = tabulated, cases, cases.kind
        self.columns = cases.columns
        one = not cases.shape
        detail = "groups" if one and detail == "values" else detail
        self._take: Callable[[Any], Any] = _item if one else np.ravel
        if one and not self.kind.direction:
            self._take = float
            row = tabulated.one([*self.columns.values()], detail == "gradient", self.kind.contact)
        else:
            row = tabulated.rows(cases, detail)
        take = self._take
        self.mu_macro, self.mu_ratio = take(row.mu_macro), take(row.mu_ratio)
        self.error_bound, self.source = take(row.error_bound), row.source
        if take is not float:
            self.source = take(row.source)
        if detail != "values":
            self.v_tilde, self.y_tilde = take(row.v_tilde), take(row.y_tilde)
            self.length_scale = take(row.length_scale)
            columns = self.columns
            self.moving = (columns[self.kind.amplitude] != 0.0) & (columns["omega"] != 0.0)
            self.usable = (self.y_tilde < math.inf) & self.moving
        if detail == "gradient":
            fields = self.kind.fields
            self.gradient = dict(zip(fields, map(take, row.gradient), strict=True))
            self.gradient_bound = dict(zip(fields, map(take, row.gradient_bound), strict=True))
        if cases.ends is not None:
            self._over_interval()

    def _over_interval(self) -> None:
        """Compute the smallest and largest mu_macro over the interval, and the largest bound in
        it."""
        low, high, bound = self.tabulated.extremes(self.cases)
        take = np.ravel if self.cases.shape else _item
        # an interval of one point, or a rigid contact, may have no result of the kernel
        self.mu_macro_low = take(np.fmin(self.mu_macro, low))
        self.mu_macro_high = take(np.fmax(self.mu_macro, high))
        self.error_bound = take(np.fmax(self.error_bound, bound))

    @property
    def rigid(self) -> Any:
        """Return whether the contact is rigid."""
        return self.columns["k"] == math.inf

    def quantity(self, name: str, v: Any, y: Any, kind: Any = None) -> tuple[Any, Any]:
        """Return a tabulated quantity at v~ and y~ in the shape of the cases, and its bound."""
        kind = self.kind if kind is None else kind
        if not self.cases.shape:
            return self.tabulated.value(name, v, y, kind)[:2]
        return self.tabulated.values(name, v, y, kind)[:2]

    def crit(self, y: Any) -> Any:
        """Return v~crit at amplitudes in the shape of the cases."""
        crit = self.tabulated.crit(np.atleast_1d(y), self.kind)
        return crit if self.cases.shape else _item(crit)

    @cached_property
    def deviating(self) -> dict[str, tuple[Any, Any]]:
        """Return by how much mu_macro changes if an uncertain input has one deviation more, and
        less, down to its smallest legal value; NaN where the contact then lifts off."""
        changes = {}
        for name, spread in self.cases.std.items():
            value, least = self.columns[name], sys.float_info.min if name in POSITIVE else 0.0
            ends = value + spread, np.maximum(value - spread, least)
            up, down = (self.replace(**{name: end}).mu_macro - self.mu_macro for end in ends)
            changes[name] = up, down
        return changes

    def replace(self, **columns: Any) -> "Evaluated":
        """Return the answers to the same cases with other values of some inputs, and with one k."""
        cases = self.cases._replace(columns={**self.columns, **columns}, ends=None)
        return Evaluated(self.tabulated, cases)


def _item(array: Array) -> float:
    number: float = array.item()
    return number


def where(condition: Any, one: Any, other: Any) -> Any:
    """Return ``np.where``, but without its microsecond for a single number."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, one, other)
    return one if condition else other
