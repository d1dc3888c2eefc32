"""The friction law: mu_macro over a range of v0, or of any one input, with its marks and the
paper's approximations."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mumacro import closed_forms
from mumacro.analysis.load import Stiffening, stiffening_of
from mumacro.analysis.rootfinding import Sweep
from mumacro.analysis.roots import Crossing, checked_case
from mumacro.analysis.solve_for import border_crossings
from mumacro.answer import BAND, Answer
from mumacro.errors import InputError
from mumacro.inputs.fields import FIELDS, POSITIVE
from mumacro.inputs.k_range import without_interval
from mumacro.inputs.kind import AMPLITUDE, SPRING, Kind, kind_of
from mumacro.kernel.arrays import Array
from mumacro.surrogate import Surrogate

SCALES = ("log", "linear")

#: column -> what it is and where it is given; NaN elsewhere.  Without an equation number it is this
#: project's own.
APPROXIMATIONS = {
    "static": "eqs. (16), (38), the limit v0 -> 0: mu0 sqrt(1 - y~^2), 0 for y~ >= 1",
    "creep": "slow sliding, first order: mu0 (sqrt(1 - y~^2) + pi v~ / (2 (1 - y~^2))), or mu0 "
    "C(y~) v~ for y~ > 1, C from the table; given up to mu0",
    "master_curve": "eq. (28), stick-slip at y~ << 1, between (38) at v0 = 0 and (40) at the "
    "border (27); given for y~ <= 1 up to that border",
    "master_curve_limit": "the limit of (28) for y~ -> 0, between (38) and the table's value at "
    "the table's border; given for y~ <= 1 up to the border",
    "critical": "eqs. (32), (40), the value at the border for y~ << 1: mu0 (1 - y~^2 / 4); given "
    "for y~ <= 1",
    "small_amplitude": "eq. (31), continuous sliding at y~ << 1: mu0 (1 - y~^2 / (4 (1 + v~^2))); "
    "given for y~ <= 1 in continuous sliding",
    "continuous": "mu0 (2/pi) K(i y~ / sqrt(1 + v~^2)), eqs. (31) and (35) in one; given in "
    "continuous sliding",
    "rigid": "eqs. (35), (37), fast sliding or rigid contact: mu0 (2/pi) K(i y~/v~)",
    "corner": "slow sliding near y~ = 1, root of mu~^3 + 2 (y~ - 1) mu~ = pi v~; given for |y~ - "
    "1| <= 0.5, mu~ <= 0.7",
}
#: v0 at which continuous sliding begins: column -> what it is and where it is given
BORDERS = {
    "exact": "the table's border",
    "eq_23": "l0 omega v~, v~ the root of y~^2 = 2 v~ (1 + v~^2)(sqrt(1 + v~^2) + v~); given for "
    "y~ <= 1",
    "eq_24": "eqs. (24), (39): (omega / 2)(sqrt(l0^2 + 2 y0^2) - l0); given for y~ <= 1",
    "eq_26": "l0 omega sqrt(y~ / 4.5); given for y~ >= 1",
    "eq_27": "l0 omega 0.47 y~^(5/2) / (y~^2 + 0.94 y~^(1/2) / (1 + y~^2))",
    "small_amplitude": "l0 omega (y~^2 / 2)(1 - 5 y~^2 / 12); given for y~ <= 1",
    "large_amplitude": "l0 omega sqrt(y~ / 4.402914), eq. (26) with the exact constant; given for "
    "y~ >= 1",
    "blend": "one formula for every y~, within 0.6 percent",
}
_CORNER_REACH, _CORNER_TOP = 0.5, 0.7
#: column of BORDERS -> formula, smallest and largest y~
_FORMULAS = {
    "eq_23": (closed_forms.border_23, 0.0, 1.0),
    "eq_24": (closed_forms.border_24, 0.0, 1.0),
    "eq_26": (closed_forms.border_26, 1.0, math.inf),
    "eq_27": (closed_forms.border_27, 0.0, math.inf),
    "small_amplitude": (closed_forms.border_small_amplitude, 0.0, 1.0),
    "large_amplitude": (closed_forms.border_large_amplitude, 1.0, math.inf),
    "blend": (closed_forms.border_blend, 0.0, math.inf),
}


@dataclass(frozen=True)
class Law:
    """A sweep of one input."""

    along: str  #: the swept input
    values: Array  #: its values [SI], ascending, shape (n,)
    #: the results, arrays (n,); of an interval of k those at its geometric middle, and the band
    answer: Answer[Any]
    #: static limit (v0 -> 0) of each case [-], of one spring across eq. (38), shape (n,)
    mu_static: Array
    #: where in the range continuous sliding, or along reverse slip, begins or ends
    border: tuple[Crossing, ...]
    case: dict[str, float]  #: the other five inputs [SI], checked; an interval of k by its middle
    kind: Kind = SPRING  #: contact and direction; ``kind.names`` has them in words
    #: how k grows along Fz; None where k is constant
    stiffening: Stiffening | None = None

    @property
    def inputs(self) -> dict[str, Any]:
        """All six inputs [SI]: ``case``, and the swept one (n,); k (n,), too, where it grows with
        Fz."""
        six = {**self.case, self.along: self.values}
        return six if self.stiffening is None else six | self.stiffening.scaled(six, self.values)

    @property
    def band(self) -> tuple[Array, Array] | None:
        """Smallest and largest mu_macro over an interval of k [-], (n,) each; None where k is one
        number."""
        low, high = (getattr(self.answer, name, None) for name in BAND)
        return None if low is None or high is None else (low, high)

    @property
    def columns(self) -> dict[str, Any]:
        """The law as a table: column -> values (n,), the swept input first."""
        names = ["mu_macro", *(BAND if self.band else ()), "regime", "error_bound", "source"]
        found = {name: getattr(self.answer, name) for name in names}
        k = {} if self.stiffening is None else {"k": self.inputs["k"]}
        return {self.along: self.values, **k, **found, "mu_static": self.mu_static}

    def plot(self, axes: Any = None) -> Any:
        """A picture, see ``mumacro.plotting.plot_law``; needs matplotlib."""
        from mumacro.plotting import plot_law

        return plot_law(self, axes)


def sweep_values(along: str, start: float, stop: float, points: int, scale: str) -> Array:
    """``points`` values from ``start`` to ``stop``, both included exactly, even on a ``scale``
    "log" or "linear".

    InputError for ends out of bounds or not ascending, a logarithmic range from 0, fewer than two
    points.
    """
    if along not in (*FIELDS, AMPLITUDE):
        raise InputError("along", along, f"one of {', '.join(FIELDS)}, {AMPLITUDE}")
    if scale not in SCALES:
        raise InputError("scale", scale, f"one of {', '.join(SCALES)}")
    if points < 2:
        raise InputError("points", points, ">= 2")
    positive = along in POSITIVE or scale == "log"
    if not (math.isfinite(start) and (start > 0.0 or (start == 0.0 and not positive))):
        told = " on a logarithmic scale" if scale == "log" else ""
        raise InputError("start", start, f"finite and > 0{told}" if positive else "finite and >= 0")
    if not (math.isfinite(stop) and stop > start):
        raise InputError("stop", stop, "finite and > start")
    if scale == "linear":
        return np.linspace(start, stop, points)
    # decades are exact
    values: Array = np.power(10.0, np.linspace(math.log10(start), math.log10(stop), points))
    values[0], values[-1] = start, stop
    return np.clip(values, start, stop)


def friction_law(
    surrogate: Surrogate,
    along: str,
    values: Array,
    case: Mapping[str, Any],
    *,
    contact: str = "spring",
    direction: str = "across",
    refine: bool = False,
    stiffness_exponent: float | None = None,
) -> Law:
    """The friction law: mu_macro over a range of one input.

    Parameters
    ----------
    surrogate : Surrogate
    along : str
        The swept input: mu0, Fz, k, y0, omega or v0; for direction normal Fz_amplitude in place of
        y0.
    values : ndarray
        Its values [SI], ascending, shape (n,), such as :func:`sweep_values` makes.
    case : mapping
        The other five inputs [SI]; ``k`` "rigid" or infinite is rigid contact; ``f`` [Hz] may stand
        for ``omega``; ``k_range``, lowest and highest stiffness, for ``k``: the law has a band, see
        :attr:`Law.band`.
    contact, direction : str
        As in :meth:`mumacro.Surrogate.evaluate`.
    refine : bool
        Also values where mu_macro bends, for pictures: at the borders, and where a straight line
        between neighbours would be wrong by more than a thousandth of the law's height.
    stiffness_exponent : float, optional
        Along Fz only, m in k = k_given (Fz/Fz_given)^m, from 0 to 1.  Fz_given, the load at which
        ``k`` holds, is ``Fz`` of the case.  Left out: 1/3 for a ball whose case has ``Fz``, else 0,
        a constant k, and the case has no ``Fz``.

    Raises
    ------
    InputError
        An input that is missing, out of bounds, or given twice; an interval of k where k is swept;
        an exponent without the load at which k holds, or along another input than Fz.

    Examples
    --------
    >>> import mumacro
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
    >>> law = friction_law(mumacro.open(), "v0", sweep_values("v0", 1e-4, 1.0, 3, "log"), case)
    >>> law.answer.mu_macro.round(4).tolist(), round(law.border[0].value, 5)
    ([0.2238, 0.24, 0.2957], 0.07105)
    """
    kind = kind_of(contact, direction)
    case, ends = without_interval(case, along)
    case, stiffening = stiffening_of(case, along, kind, stiffness_exponent)
    known = checked_case(case, along, kind)
    sweep = Sweep(surrogate, known, along, kind, stiffening)
    border = border_crossings(
        surrogate,
        along,
        known,
        float(values[0]),
        float(values[-1]),
        **kind.names,
        stiffening=stiffening,
    )
    if refine:
        values = sweep.refined(np.union1d(values, [mark.value for mark in border]))
    answer = sweep.answer(values, groups=True, illegal="raise")
    if ends:
        others = {name: value for name, value in known.items() if name != "k"}
        answer = Sweep(surrogate, {**others, **ends}, along, kind, stiffening).answer(
            values, groups=True, illegal="raise"
        )
    at_rest = sweep.answer(values, v0=0.0) if along != "v0" else sweep.answer(0.0)
    return Law(
        along,
        values,
        answer,
        np.broadcast_to(at_rest.mu_macro, values.shape),
        border,
        known,
        kind,
        sweep.stiffening,
    )


def approximations(surrogate: Surrogate, law: Law) -> dict[str, Array]:
    """The approximations of :data:`APPROXIMATIONS` along a law [-], (n,); NaN outside the stated
    range.

    InputError for a ball, and an oscillation along or normal: the article has one spring, across.
    """
    inputs = _of_one_spring(law)
    mu0, v, y = inputs["mu0"], law.answer.v_tilde, law.answer.y_tilde
    # rigid contact has no finite v~ and y~; eq. (37) is then the result
    elastic = np.isfinite(v) & np.isfinite(y)
    low, slides = elastic & (y <= 1.0), elastic & (law.answer.regime == "continuous")
    near = elastic & (np.abs(y - 1.0) <= _CORNER_REACH) & (v > 0.0) & (v < 1.0)
    # the tangent of mu_macro(v0) at v0 = 0; not finite where it is vertical (y~ = 1, rigid contact)
    at_rest = surrogate.evaluate({**inputs, "v0": np.zeros(law.values.shape)}, gradient=True)
    with np.errstate(all="ignore"):
        creep = law.mu_static + at_rest.gradient["v0"] * inputs["v0"]
        border, fit_border = surrogate.v_tilde_crit(y), closed_forms.border_27(y)
        # without oscillation there is no border, and every speed but 0 is infinitely far above it
        share, fit_share = (np.where(v > 0.0, v / at, 0.0) for at in (border, fit_border))
        static, critical, top = (
            closed_forms.static_limit(y),
            closed_forms.critical(y),
            surrogate.mu_ratio(border, y),
        )
        rigid = np.where(
            elastic, closed_forms.outer(np.where(v > 0.0, y / v, math.inf)), law.answer.mu_ratio
        )
        corner, limit = closed_forms.corner_root(v, y - 1.0), closed_forms.master_curve_limit(share)
        found = {
            "static": (law.mu_static, True),
            "creep": (creep, creep <= mu0),
            "master_curve": (
                mu0 * (static + (critical - static) * closed_forms.master_curve(fit_share)),
                low,
            ),
            "master_curve_limit": (mu0 * (static + (top - static) * limit), low & (v <= border)),
            "critical": (mu0 * critical, low),
            "small_amplitude": (mu0 * closed_forms.small_amplitude(v, y), low & slides),
            "continuous": (mu0 * closed_forms.continuous(v, y), slides),
            "rigid": (mu0 * rigid, True),
            "corner": (mu0 * corner, near & (corner <= _CORNER_TOP)),
        }
    return {name: np.where(given, column, np.nan) for name, (column, given) in found.items()}


def borders(y: Array) -> dict[str, Array]:
    """v~crit(y~) [-] by the formulas of :data:`BORDERS`, each an array like ``y``; NaN outside the
    stated range.

    >>> found = borders(np.array([0.5, 2.0]))
    >>> found["eq_24"].round(4).tolist(), found["eq_26"].round(4).tolist()
    ([0.1124, nan], [nan, 0.6667])
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return {
            name: np.where((y >= least) & (y <= most), formula(y), np.nan)
            for name, (formula, least, most) in _FORMULAS.items()
        }


def _of_one_spring(law: Law) -> dict[str, Any]:
    """The inputs of a law of one spring across."""
    if law.kind != SPRING:
        told = " ".join(law.kind.names.values())
        raise InputError("approximations", told, "left out: they are those of one spring, across")
    return law.inputs


def border_speeds(surrogate: Surrogate, law: Law) -> dict[str, Array]:
    """v0 [m/s] at which continuous sliding begins, for each case of a law, exact and as in
    :data:`BORDERS`; (n,).

    NaN where an approximation does not apply and where y~ is beyond double range; 0 for rigid
    contact and without oscillation, which never stick.  InputError as in :func:`approximations`.
    """
    inputs = _of_one_spring(law)
    y, omega = law.answer.y_tilde, inputs["omega"]
    never = (inputs["y0"] == 0.0) | (omega == 0.0) | np.isinf(inputs["k"])
    with np.errstate(all="ignore"):
        unit = np.where(np.isfinite(y), law.answer.length_scale * omega, np.nan)
        found = {"exact": surrogate.v_tilde_crit(y), **borders(y)}
        return {name: np.where(never, 0.0, unit * column) for name, column in found.items()}
