"""Write remarks on inputs that probably have a wrong unit or a wrong order of magnitude, for one
case and for many.

A value outside its usual range (:attr:`mumacro.inputs.fields.Field.usual`) is answered with a
remark, never refused.  The same holds for a length l0 = mu0 Fz / k, a v~ or y~, or a peak speed y0
omega that no contact has.  A rigid contact is answered with its assumption.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mumacro.inputs.fields import INPUTS, RAD_PER_CYCLE
from mumacro.inputs.units import Unit, parse_unit, plain, quantity_of, suit_unit
from mumacro.kernel.arrays import Array, Bools
from mumacro.results import REMARK, Note

UNITS, STIFFNESS = "units", "k is known"  # rows of docs/validity.md
MODEL = "model"  # the row of a case that needs no model
LONGEST = 1e-2  # l0 [m]; no contact has more
FURTHEST = 1e4  # v~ and y~; no contact has more
# y0 omega [m/s]: a resonant bar of titanium yields at about 40 (stress over density and speed of
# sound), shaken contacts have less
FASTEST = 100.0
# shaken contacts have less
_LARGE = {"k": 1e9, "y0": 1e-4, "v0": 1.0, "omega": 1e6}
_SMALL_LOAD = 1e-2  # [N]
_USUAL = {name: INPUTS[name].usual for name in ("mu0", "Fz", "k", "y0", "omega", "v0")}
_USUAL["Fz_amplitude"] = INPUTS["Fz_amplitude"].usual


def remarks(
    columns: Mapping[str, Any],
    frequency: bool = False,
    units: Mapping[str, str] | None = None,
    names: Mapping[str, str] | None = None,
) -> list[Note]:
    """Return the remarks on cases, at most one for each input, and remarks on contacts that are not
    shaken, or are rigid.

    Parameters
    ----------
    columns : mapping
        The six inputs in SI by name, numbers or arrays that broadcast.  An input that a case does
        not have, such as y0 if the normal force oscillates, is left out, or NaN.
    frequency : bool
        Whether the inputs had ``f`` instead of ``omega``; then the remark names it.
    units : mapping
        The units that were typed, by input; a remark shows a value in its own unit.
    names : mapping
        Other names of inputs, such as those of the parts of a motion.

    Examples
    --------
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
    >>> remarks(case)
    []
    >>> [remark] = remarks({**case, "k": 1.0})
    >>> remark.field, remark.text
    ('k', 'l0 = mu0 Fz / k = 3 m, above 1 cm: is k = 1 in N/m?')
    >>> remarks({**case, "k": 1.0}, units={"k": "N/mm"})[0].text
    'l0 = mu0 Fz / k = 3 m, above 1 cm: is k = 0.001 N/mm right?'
    >>> remarks({**case, "mu0": 30.0}, units={"mu0": "-"})[0].text
    'mu0 = 30, usual is 0.001 to 2: is it right?'
    """
    if _usual(columns):
        rigid = columns["k"] == math.inf
        return [_of_rigid(columns["mu0"] * columns["Fz"] / columns["y0"])] if rigid else []
    arrays = {name: np.asarray(column, np.float64) for name, column in columns.items()}
    shape = np.broadcast_shapes(*(column.shape for column in arrays.values()))
    six = dict.fromkeys(_USUAL, np.broadcast_to(math.nan, shape)) | {
        name: np.broadcast_to(column, shape) for name, column in arrays.items()
    }
    typed = {
        name: unit
        for name, text in (units or {}).items()
        if (unit := parse_unit(quantity_of(name), text)) is not None
    }
    by_field: dict[str, Note] = {}
    has_reason: Bools = np.zeros(shape, np.bool_)
    with np.errstate(all="ignore"):
        oscillates = ((six["y0"] > 0.0) | (six["Fz_amplitude"] > 0.0)) & (six["omega"] > 0.0)
        for field, where in _outside(six, oscillates):
            new = np.asarray(where & ~has_reason)  # one reason for each case
            if not new.any():
                continue
            has_reason |= new
            first = int(np.flatnonzero(new)[0])
            case = {name: float(column.flat[first]) for name, column in six.items()}
            name, text = _sentence(field, case, frequency, typed, names or {})
            cases = int(np.count_nonzero(new))
            if name in by_field:
                earlier = by_field[name]
                by_field[name] = earlier._replace(cases=earlier.cases + cases)
            else:
                by_field[name] = Note(REMARK, text, UNITS, name, cases=cases)
        still = _of_still(six, frequency)
        rigid = np.asarray(np.isposinf(six["k"]) & oscillates)
        if not rigid.any():
            return [*by_field.values(), *still]
        stiffest = float(np.fmax.reduce((six["mu0"] * six["Fz"] / six["y0"])[rigid]))
        return [*by_field.values(), *still, _of_rigid(stiffest, int(np.count_nonzero(rigid)))]


def remarks_on_motion(
    columns: Mapping[str, Any], amplitudes: Mapping[str, Any], frequency: bool = False
) -> list[Note]:
    """Return the remarks on motions, with each amplitude checked as y0, and on motions in which
    nothing moves.

    Parameters
    ----------
    columns : mapping
        mu0, Fz, k, omega and v0 in SI, (n,) each.
    amplitudes : mapping
        The largest amplitude of x and y [m] and of normal [N], (n,) each.
    frequency : bool
        As in :func:`remarks`.

    Examples
    --------
    >>> columns = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5, "v0": 0.01}
    >>> one = {name: np.array([value]) for name, value in columns.items()}
    >>> for size in (1.0, 0.0):
    ...     [remark] = remarks_on_motion(one, {"x": np.array([size])})
    ...     remark.row, remark.field, remark.text
    ('units', 'x', 'x = 1 m, usual is 1 pm to 20 mm: is it in metres?')
    ('model', 'x', 'nothing oscillates: mu_macro is mu0')
    """
    found: list[Note] = []
    for name, size in amplitudes.items():
        input_ = "Fz_amplitude" if name == "normal" else "y0"
        amplitude = np.where(size > 0.0, size, math.nan)  # a part without motion is another remark
        for one in remarks({**columns, input_: amplitude}, frequency, names={input_: name}):
            if one.field not in {other.field for other in found}:
                found.append(one)
    legal = np.ones_like(columns["mu0"], np.bool_)
    for name in ("mu0", "Fz", "k", "omega", "v0"):
        legal &= np.isfinite(columns[name]) & (columns[name] > 0.0)
    still = legal & np.all([size == 0.0 for size in amplitudes.values()], axis=0)
    if still.any():
        text = "nothing oscillates: mu_macro is mu0"
        count = int(np.count_nonzero(still))
        found.append(Note(REMARK, text, MODEL, next(iter(amplitudes)), cases=count))
    return found


def _of_still(six: Mapping[str, Array], frequency: bool) -> list[Note]:
    """Return the remarks on legal contacts that are not shaken, by the input that is 0."""
    legal = (six["mu0"] > 0.0) & (six["Fz"] > 0.0) & (six["k"] > 0.0) & (six["v0"] >= 0.0)
    legal &= np.isfinite(six["mu0"]) & np.isfinite(six["Fz"]) & np.isfinite(six["v0"])
    found: list[Note] = []
    for name in ("y0", "Fz_amplitude", "omega"):
        still = np.asarray(legal & (six[name] == 0.0))
        if still.any():
            legal &= ~still  # one remark for each case
            word = "f" if name == "omega" and frequency else name
            text = f"{word} = 0: the contact is not shaken, mu_macro is mu0"
            found.append(Note(REMARK, text, MODEL, word, cases=int(np.count_nonzero(still))))
    return found


def _usual(columns: Mapping[str, Any]) -> bool:
    """Return whether one case in plain numbers oscillates across or along, with all values in their
    usual ranges.  This takes a microsecond."""
    mu0, load, k, y0, omega, v0 = map(columns.get, ("mu0", "Fz", "k", "y0", "omega", "v0"))
    if not (type(mu0) is type(load) is type(k) is type(y0) is type(omega) is type(v0) is float):
        return False
    force = mu0 * load
    return bool(
        1e-3 <= mu0 <= 2.0
        and 1e-6 <= load <= 1e6
        and 0.0 < y0 <= 2e-2
        and y0 >= 1e-12
        and _USUAL["omega"][0] <= omega <= _USUAL["omega"][1]
        and y0 * omega <= FASTEST
        and 0.0 <= v0 <= 300.0
        and (
            k == math.inf
            or (
                1.0 <= k <= 1e12
                and force <= LONGEST * k
                and y0 * k <= FURTHEST * force
                and v0 * k <= FURTHEST * force * omega
            )
        )
    )


def _outside(six: Mapping[str, Array], oscillates: Bools) -> Iterator[tuple[str, Bools]]:
    """Yield every input with the cases in which it is outside its usual range, then l0, y~, v~ and
    the peak speed with the legal contacts for which no contact has such a value.

    A rigid contact, a legal zero and an illegal value are not outside.
    """
    for name, (least, most) in _USUAL.items():
        column = six[name]
        yield name, ((column < least) | (column > most)) & np.isfinite(column) & (column > 0.0)
    length = six["mu0"] * six["Fz"] / six["k"]
    elastic = (length > 0.0) & (six["Fz"] > 0.0) & (six["k"] > 0.0)
    elastic &= np.isfinite(six["mu0"]) & np.isfinite(six["Fz"])
    moves = oscillates & elastic
    yield "l0", (length > LONGEST) & elastic
    yield "y~", (six["y0"] / length > FURTHEST) & moves & np.isfinite(six["y0"])
    fast = six["v0"] / six["omega"] / length > FURTHEST
    yield "v~", fast & moves & np.isfinite(six["v0"])
    speed = six["y0"] * six["omega"]
    yield "y0 omega", (speed > FASTEST) & np.isfinite(speed)


def _sentence(
    what: str,
    case: Mapping[str, float],
    frequency: bool,
    units: Mapping[str, Unit],
    names: Mapping[str, str],
) -> tuple[str, str]:
    """Return the input of one case that may be wrong, and why."""
    length = case["mu0"] * case["Fz"] / case["k"] if case["k"] else math.inf
    swing = names.get("y0", "y0")

    def doubted(name: str, formula: str, value: float) -> tuple[str, str]:
        word = names.get(name, name)
        return word, f"{formula}: {_is(name, word, value, units)}"

    if what == "l0":
        formula = f"l0 = mu0 Fz / k = {plain(length, 3)} m, above 1 cm"
        return doubted("k", formula, case["k"])
    if what == "y~":
        name = _stiff_or(case, "y0")
        formula = f"y~ = {swing} k / (mu0 Fz) = {plain(case['y0'] / length, 3)}, {_CONTACTS}"
        return doubted(name, formula, case[name])
    if what == "v~":
        name = _stiff_or(case, "v0")
        group = plain(case["v0"] / case["omega"] / length, 3)
        return doubted(name, f"v~ = v0 k / (mu0 Fz omega) = {group}, {_CONTACTS}", case[name])
    if what == "y0 omega":
        name, speed = _largest(case, "y0", "omega"), case["y0"] * case["omega"]
        value = case[name]
        if name == "omega" and frequency:
            name, value = "f", value / RAD_PER_CYCLE
        formula = f"the peak speed {swing} omega = {plain(speed, 3)} m/s, above {FASTEST:g} m/s"
        return doubted(name, formula, value)
    value, name = case[what], what
    if what == "omega" and frequency:
        value, name = value / RAD_PER_CYCLE, "f"
    field = INPUTS[name]
    if name in units:
        typed, question = units[name], "is it right"
    else:
        typed = Unit("" if field.unit == "-" else field.unit)
        question = f"is it in {field.words}" if typed.symbol else "is it a number, not per cent"
    least, most = (
        _quantity(bound, typed if field.unit == "-" else suit_unit(field.unit, bound))
        for bound in field.usual
    )
    usual = f"{least} to {most}" if field.usual[0] else f"up to {most}"
    word = names.get(name, name)
    return word, f"{word} = {_quantity(value, typed)}, usual is {usual}: {question}?"


_CONTACTS = "contacts have 0.01 to 100"


def _is(name: str, word: str, value: float, units: Mapping[str, Unit]) -> str:
    """Return the question whether the value of an input is right; ``word`` describes it.  For a
    number without a unit, ask whether it is in SI."""
    if name in units:
        return f"is {word} = {_quantity(value, units[name])} right?"
    return f"is {word} = {plain(value, 6)} in {INPUTS[name].unit}?"


def _quantity(value: float, unit: Unit) -> str:
    """Return a value in SI in a unit; a ratio has none."""
    symbol = "" if unit.symbol in ("-", "1") else unit.symbol
    return f"{plain(unit.scale.of_si(value), 6)} {symbol}".rstrip()


def _largest(case: Mapping[str, float], *names: str) -> str:
    """Return the input among ``names`` that is furthest above the values of real contacts."""
    return max(names, key=lambda name: case[name] / _LARGE[name])


def _stiff_or(case: Mapping[str, float], other: str) -> str:
    """Return the input that makes v~ or y~ large: of k and ``other``, the one that is furthest from
    the values of real contacts."""
    name = _largest(case, other, "k")
    lightness = _SMALL_LOAD / case["Fz"]
    return "Fz" if lightness > case[name] / _LARGE[name] else name


def _of_rigid(stiffness: float, cases: int = 1) -> Note:
    """Return the assumption of a rigid contact, with the stiffness that must be far exceeded for it
    [N/m]; for many cases the largest one."""
    text = "rigid: the contact does not stretch before it slips"
    if math.isfinite(stiffness):
        text += (
            f"; this holds for k far above mu0 Fz / y0 = {stiffness:.3g} N/m, a softer contact has "
            "another friction"
        )
    return Note(REMARK, text, STIFFNESS, "k", cases=cases)
