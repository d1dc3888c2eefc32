"""Compute the friction law: mu_macro over a range of v0, or of any other input, with its static
limit and borders."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from mumacro import plotting
from mumacro.errors import InputError
from mumacro.inputs.case import read_one
from mumacro.inputs.cases import case_around
from mumacro.inputs.columns import to_si
from mumacro.inputs.fields import (
    AMPLITUDE,
    ENDS,
    NAMES,
    POSITIVE,
    QUANTITY_OF,
    SPRING,
    Kind,
    field_of,
    kind_of,
)
from mumacro.inputs.stiffening import Stiffening, stiffening_of
from mumacro.inputs.units import unit_of
from mumacro.kernel.arrays import Array
from mumacro.outputs.answer import BAND, Answer
from mumacro.outputs.evaluation import chosen
from mumacro.questions.borders import Crossing, border_crossings
from mumacro.questions.input_curve import InputCurve
from mumacro.results import Note, Result
from mumacro.surrogate import Surrogate
from mumacro.validity import digits, effect_of, load_notes

SCALES = ("log", "linear")
DRAWN = 2000  # points of a law in a picture, where it may be steep


@dataclass(frozen=True, repr=False)
class Law(Result):
    """Hold a sweep of one input."""

    along: str  #: the swept input as the caller named it: omega [rad/s] or f [Hz]
    values: Array  #: its values [SI], ascending, shape (n,)
    #: the results, arrays (n,).  With an interval of k: the results at its geometric middle, and
    #: the band.  With deviations of inputs: also the deviation of mu_macro
    answer: Answer[Any]
    #: static limit (v0 -> 0) of each case [-], for one spring across eq. (38), shape (n,)
    mu_static: Array
    #: the values in the range where continuous sliding (along: reverse slip) begins or ends
    border: tuple[Crossing, ...]
    case: dict[str, float]  #: the other five inputs [SI], checked; k is the middle of its interval
    kind: Kind = SPRING  #: contact and direction; ``kind.names`` has them in words
    #: how k grows along Fz; None where k is constant
    stiffening: Stiffening | None = None
    k_ends: tuple[float, float] | None = None  #: ends of the interval of k [N/m]; None for one k

    @property
    def inputs(self) -> dict[str, Any]:
        """Return all six inputs [SI]: ``case``, and the swept input (n,); omega if the swept input
        is f.  If k grows with Fz, it is an array (n,), too."""
        name, per = field_of(self.along)
        six = {**self.case, name: per * self.values}
        return six if self.stiffening is None else six | self.stiffening.scaled(six, self.values)

    @property
    def band(self) -> tuple[Array, Array] | None:
        """Return the smallest and the largest mu_macro [-], (n,) each, over an interval of k, or
        one deviation up and down of the uncertain inputs.  Return None if no input is uncertain."""
        low, high = (self.answer.outputs.get(name) for name in BAND)
        return None if low is None or high is None else (low, high)

    @property
    def std(self) -> Array | None:
        """Return the standard deviation of mu_macro at each value [-], (n,), or None if no input
        has one."""
        outputs = self.answer.outputs
        return np.asarray(outputs["std"]) if "std" in outputs else None

    @property
    def columns(self) -> dict[str, Any]:
        """Return the law as a table: column -> values (n,), the swept input first."""
        k = {} if self.stiffening is None else {"k": self.inputs["k"]}
        std = {} if self.std is None else {"std": self.std}
        band = {} if self.band is None else dict(zip(BAND, self.band, strict=True))
        return {
            self.along: self.values,
            **k,
            "mu_macro": self.answer.mu_macro,
            **std,
            **band,
            **{name: self.answer[name] for name in ("regime", "error_bound", "source")},
            "mu_static": self.mu_static,
        }

    def _members(self) -> dict[str, Any]:
        columns = {name: x for name, x in self.columns.items() if name != self.along}
        border = [{"value": mark.value, "mu_macro": mark.mu_macro} for mark in self.border]
        members = {"along": self.along, "unit": unit_of(self.along), "values": self.values}
        model = {"model": [note.as_row for note in self.notes]} if self.notes else {}
        return {**members, **columns, "border": border, **model}

    def _heading(self) -> str:
        unit, kind = unit_of(self.along), ", ".join(self.kind.names.values())
        low, high = self.values[0], self.values[-1]
        return f"<Law over {self.along} from {low:.6g} to {high:.6g} {unit}: {kind}>"

    @property
    def digits(self) -> int:
        """Return the number of digits that the uncertainty of k supports, at the middle value."""
        return digits(effect_of(self.answer, place=self.values.size // 2))

    @property
    def notes(self) -> list[Note]:
        """Return the notes about k, if Fz is swept."""
        return load_notes(self.along, self.case, self.kind.names["contact"], self.stiffening)

    def _below(self) -> list[str]:
        unit = unit_of(self.along)
        marks = [f"{mark.name} at {self.along} = {mark.value:.6g} {unit}" for mark in self.border]
        return [*marks, *super()._below()]

    def plot(
        self, ax: Any = None, *, roots_of: Mapping[float, Iterable[float]] = MappingProxyType({})
    ) -> Any:
        """Draw mu_macro over the swept input with its static limit and borders.  ``roots_of`` maps
        each target to the roots that are marked.

        ``ax`` are matplotlib axes, or None for new ones.  They are returned.
        """
        return plotting.plot_law(
            self.along,
            self.values,
            self.answer.mu_macro,
            ax,
            static=self.mu_static,
            band=self.band,
            band_of="k" if self.std is None else "std",
            borders=[(crossing.value, crossing.name) for crossing in self.border],
            roots_of=roots_of,
            title=plotting.case_title(
                self.case if self.k_ends is None else {**self.case, "k": self.k_ends},
                self.kind.names,
            ),
        )


def sweep_values(along: str, start: float, stop: float, points: int, scale: str) -> Array:
    """Return ``points`` values from ``start`` to ``stop``, including both ends exactly, evenly
    spaced on a ``scale`` "log" or "linear".

    Raise InputError if the ends are out of bounds or not ascending, if a logarithmic range begins
    at 0, or if there are fewer than two points.
    """
    if scale not in SCALES:
        raise InputError("scale", scale, f"one of {', '.join(SCALES)}")
    if isinstance(points, bool) or not isinstance(points, (int, np.integer)) or points < 2:
        raise InputError("points", points, "a whole number >= 2")
    positive = along in POSITIVE or scale == "log"
    if not (math.isfinite(start) and (start > 0.0 or (start == 0.0 and not positive))):
        where = " on a logarithmic scale" if scale == "log" else ""
        bound = f"finite and > 0{where}" if positive else "finite and >= 0"
        raise InputError("start", start, bound)
    if not (math.isfinite(stop) and stop > start):
        raise InputError("stop", stop, "finite and > start")
    if scale == "linear":
        return np.linspace(start, stop, points)
    # powers of ten are exact
    values: Array = np.power(10.0, np.linspace(math.log10(start), math.log10(stop), points))
    values[0], values[-1] = start, stop
    return np.clip(values, start, stop)


def _end(along: str, name: str, value: Any) -> float:
    """Return one end of the range of an input as a float."""
    if value is None:
        raise InputError(name, None, "given [SI]: the range goes from start to stop")
    return read_one(name, value, QUANTITY_OF[along])


def _ascending(along: str, values: Any) -> Array:
    """Return the values of the swept input, (n,), after a check that they ascend."""
    x = np.asarray(to_si("values", values, QUANTITY_OF[along]))
    if x.ndim != 1 or not x.size or not np.all(np.diff(x) >= 0.0):
        raise InputError("values", values, "one-dimensional and ascending")
    return x


@np.errstate(all="ignore")
def law(
    surrogate: Surrogate,
    along: str = "v0",
    *,
    start: Any = None,
    stop: Any = None,
    points: int = 201,
    scale: str = "log",
    values: Any = None,
    contact: str = "spring",
    direction: str = "across",
    stiffness_exponent: float | None = None,
    **case: Any,
) -> Law:
    """Return the friction law: mu_macro over a range of one input.

    Parameters
    ----------
    surrogate : Surrogate
    along : str
        The swept input: mu0, Fz, k, y0, omega, f or v0; for direction normal Fz_amplitude instead
        of y0.
    start, stop : float
        Its first and its last value [SI], or with a unit as in "1mm/s"; both included.
    points, scale : int, str
        The number of values, evenly spaced on a scale "log" or "linear".
    values : array_like
        The values themselves [SI], ascending, shape (n,), instead of ``start`` and ``stop``.
    contact, direction : str
        As in :meth:`mumacro.Surrogate.evaluate`.
    stiffness_exponent : float, optional
        Along Fz only: m in k = k_given (Fz/Fz_given)^m, from 0 to 1.  Fz_given, the load at which
        ``k`` holds, is ``Fz`` of the case.  Default: 1/3 for a ball whose case has ``Fz``,
        otherwise 0, a constant k; then the case has no ``Fz``.
    **case : float
        The other five inputs [SI].  ``k`` "rigid" or infinite is a rigid contact.  ``f`` [Hz] may
        replace ``omega``; ``k_low`` and ``k_high`` may replace ``k``: then the law has a band, see
        :attr:`mumacro.questions.law.Law.band`.  It also has a band if inputs have a standard
        deviation: "1 ± 0.1 N/um", or ``std_k`` and so on; the deviation of a k that grows with Fz
        grows in the same way.

    Raises
    ------
    InputError
        If an input is missing, out of bounds, or given twice; if k is swept and has an interval; if
        the swept input has a deviation; if the range is out of bounds; if an exponent is given
        without the load at which k holds, or along another input than Fz.

    Examples
    --------
    >>> import mumacro
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3}
    >>> sweep = mumacro.law(mumacro.open(), start=1e-4, stop=1.0, points=3, **case)
    >>> sweep.answer.mu_macro.round(4).tolist(), round(sweep.border[0].value, 5)
    ([0.2238, 0.2405, 0.296], 0.06868)
    """
    if along not in QUANTITY_OF:
        raise InputError("along", along, f"one of {', '.join(NAMES)}, {AMPLITUDE}")
    if values is None:
        range_ends = (_end(along, "start", start), _end(along, "stop", stop))
        axis = sweep_values(along, *range_ends, points, scale)
    elif start is None and stop is None:
        axis = _ascending(along, values)
    else:
        raise InputError("values", "an array", "left out beside start and stop")
    name, per = field_of(along)
    kind, x = kind_of(contact, direction), per * axis
    remaining, stiffening = stiffening_of(case, name, kind, stiffness_exponent)
    one = case_around(remaining, along, kind)
    inputs = {field: float(value) for field, value in one.columns.items() if field != name}
    curve = InputCurve(surrogate, inputs, name, kind, stiffening)
    border = border_crossings(curve, float(x[0]), float(x[-1]))
    whole, k_ends = curve, None
    if one.ends is not None:
        k_ends = float(one.ends[0]), float(one.ends[1])
        interval = {field: value for field, value in inputs.items() if field != "k"}
        interval |= dict(zip(ENDS, k_ends, strict=True))
        whole = InputCurve(surrogate, interval, name, kind, stiffening)
    deviations: dict[str, Any] = {f"std_{field}": deviation for field, deviation in one.std.items()}
    if stiffening is not None and "k" in one.std:  # it grows in the same way as k
        relative = one.std["k"] / inputs["k"]
        deviations["std_k"] = stiffening.stiffness(inputs["k"], x) * relative
    cases = whole.cases(x, **deviations)
    answer = surrogate.answer(cases, chosen((), cases), groups=True)
    at_rest = curve.answer(x, v0=0.0) if name != "v0" else curve.answer(0.0)
    mu_static = np.broadcast_to(at_rest.mu_macro, x.shape)
    marks = tuple(replace(crossing, value=crossing.value / per) for crossing in border)
    return Law(along, axis, answer, mu_static, marks, inputs, kind, curve.stiffening, k_ends)
