"""Tell how far the model holds for a case, and put its answer into words, as the command prints it
and a notebook shows it.

How far the model holds is said by the rows of docs/validity.md that apply to the case, with the
size of each effect; the digits of the answer follow from it.

The error bound of an answer is the distance of the table from the model.  The distance of the model
from a real contact is another question, and usually it is larger.  Two assumptions cannot be
checked with the inputs of a case and have no row here: a quasi-static contact, which needs masses,
and a stiff drive.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.doubts import FURTHEST, UNITS
from mumacro.inputs.fields import (
    MEASURED_AS,
    PER_UNIT,
    RAD_PER_CYCLE,
    RIGID,
    SPRINGS_OF,
    Kind,
    kind_of,
)
from mumacro.inputs.stiffening import ROUGH, Stiffening
from mumacro.inputs.units import choose_unit, format_number, known, plain, suit_unit, tidy_zeros
from mumacro.outputs import MEMBERS
from mumacro.outputs.answer import BAND, Answer
from mumacro.outputs.settling import REMAINING, decay_of_springs
from mumacro.outputs.tabulated import Tabulated
from mumacro.results import ASSUMES, Note, Row, Rows

#: names of the rows, as in the table of docs/validity.md
ROWS = (
    "one spring",
    "k is known",
    UNITS,
    "steady cycle",
    "Coulomb friction",
    "constant normal force",
    "no wear, no heating",
)
K_UNCERTAINTY = 0.1  # default relative uncertainty of k: materials and geometry give no better one
HARDLY = 20.0  # y~ from which on mu_macro hardly depends on k (docs/validity.md)
_RATE = 0.01  # a of mu0 + a ln(slip speed) for rock, polymers and metals (docs/validity.md)
_TILT, _NORMAL = 0.01, 1.21  # misalignment; normal over tangential stiffness of steel on steel
# slip paths [m] between which a row is shown, since friction follows a new slip speed after
# micrometres
_ADAPTS = 1e-7, 1e-4
_PERIODS, _WATTS = 100.0, 0.1  # above these there is a row on settling, and one on heat
REGIMES = {
    "continuous": "slips all the time",
    "stick_slip": "sticks during a part of each period",
    "static": "at rest: the limit v0 -> 0",
    "partial_slip": "the rim of the contact slips all the time, its middle sticks during a part of "
    "each period",
    "reverse_slip": "slips forwards and backwards in each period",
}
#: rows of :data:`ROWS` that have another name for a contact
_CALLED = {("one spring", "ball"): "a ball"}
_SHOWN = ("std", *BAND, "std_share", "gradient")  # these are shown in their own rows
#: paths that have the unit of an input
_UNIT_OF = {"limits.v0_crit": "v0", "groups.l0": "y0"}


class Said(NamedTuple):
    """Hold the notes on one case, and the number of digits that it supports."""

    notes: list[Note]
    digits: int


def notes_of(answer: Answer[float], units: Mapping[str, str] | None = None) -> Said:
    """Return the notes on an evaluated case: what the model leaves out, with the size of each
    effect; what is doubtful; and how many digits the uncertainty of k supports.

    Other values of the table are needed only for comparison: with the other contact, and with seven
    values of k up to 10 % away.  ``units`` are the units that were typed, by input.

    Examples
    --------
    >>> from mumacro import Surrogate
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}
    >>> said = notes_of(Surrogate.open().evaluate(case))
    >>> [note.text for note in said.notes if note.row == "k is known"], said.digits
    (['10 % more or less of k changes mu_macro by 6 %: give k as an interval, or fit k'], 4)
    """
    effect = effect_of(answer)
    doubts = answer.notes_in(units or {})
    return Said([*_assumptions(answer, effect), *doubts], digits(effect))


def rows_of(answer: Answer[float], effect: float | None = None) -> list[Row]:
    """Return the rows of docs/validity.md that apply to an evaluated case, as JSON has them.

    If no contact has the case's y~, the remark on this is the only row.  ``effect`` is
    :func:`effect_of` the answer, if it is already known.
    """
    effect = effect_of(answer) if effect is None else effect
    if _is_beyond(answer):
        return [note.as_row for note in answer.notes if note.row == UNITS]
    return [note.as_row for note in _assumptions(answer, effect)]


def _is_elastic(answer: Answer[float]) -> bool:
    """Return whether a contact is elastic and shaken."""
    inputs = answer.cases.columns
    swing = inputs[answer.cases.kind.amplitude]
    return not (math.isinf(inputs["k"]) or inputs["omega"] == 0.0 or swing == 0.0)


def _is_beyond(answer: Answer[float]) -> bool:
    """Return whether a case is elastic and shaken, but no contact has its y~."""
    return _is_elastic(answer) and not answer.cases.kind.normal and answer.y_tilde > FURTHEST


def _assumptions(answer: Answer[float], effect: float) -> list[Note]:
    """Return what the model leaves out in a case; for an interval of k at its geometric middle.

    If k is an interval or has a deviation, there is no note on k, because the answer shows the
    effect.
    """
    if not _is_elastic(answer) or _is_beyond(answer):
        return []
    cases, kind = answer.cases, answer.cases.kind
    inputs, y = cases.columns, 0.0 if kind.normal else answer.y_tilde
    uncertain = cases.ends is not None or np.any(cases.std.get("k", 0.0))
    notes = [
        _on_other_contact(answer, kind),
        None if uncertain else _on_stiffness(effect, y),
        _on_tilt(float(inputs["mu0"]), y),
        *(() if kind.direction else _on_cycle(answer, inputs)),
    ]
    return sorted((note for note in notes if note is not None), key=lambda one: ROWS.index(one.row))


def load_notes(
    unknown: str,
    case: Mapping[str, Any],
    contact: str = "spring",
    stiffening: Stiffening | None = None,
) -> list[Note]:
    """Return the note on k if Fz is swept or solved for, as a list that may be empty.

    ``case`` has the other five inputs, ``stiffening`` says how k grows, as in the result.

    Examples
    --------
    >>> case = {"mu0": 0.3, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}
    >>> [note] = load_notes("Fz", case, "ball", Stiffening(1 / 3, 10.0))
    >>> note.text
    'k grows as Fz^0.333 from its value at Fz = 10 N'
    """
    if unknown != "Fz" or case.get("k") in (math.inf, RIGID):
        return []
    if stiffening is not None:
        text = (
            f"k grows as Fz^{stiffening.exponent:.3g} from its value at Fz = {stiffening.load:g} N"
        )
    else:
        advice = "" if SPRINGS_OF[contact].exponent else ", and a stiffness exponent"
        text = (
            "constant over Fz here; with the load k grows, as Fz^(1/3) for a ball, as "
            f"Fz^{ROUGH[0]:g} to Fz^{ROUGH[1]:g} for rough surfaces: give Fz at which k "
            f"holds{advice}"
        )
    return [Note(ASSUMES, text, "k is known")]


def effect_of(
    answer: Answer[Any], uncertainty: float = K_UNCERTAINTY, place: int | None = None
) -> float:
    """Return how much mu_macro may differ, relatively [-], if k may differ by the factor 1 +
    ``uncertainty`` up or down; 0 if rigid.

    It is the largest difference for seven values of k, because mu_macro is not a straight line in
    k.  Over an interval of k it is half the width.  For many cases it is that of the case at
    ``place`` of the flattened arrays, which must have groups; without ``place`` InputError is
    raised.
    """
    if place is None and np.shape(answer.mu_macro):
        raise InputError("answer", np.shape(answer.mu_macro), "that to one case")
    v, y, mu = (
        float(np.ravel(x)[place or 0]) for x in (answer.v_tilde, answer.y_tilde, answer.mu_macro)
    )
    cases = answer.cases
    if cases.ends is None:
        return effect_of_groups(answer._surrogate.tabulated, cases.kind, v, y, uncertainty)
    low, high = (float(np.ravel(getattr(answer, name))[place or 0]) for name in BAND)
    return _share(0.5 * (high - low), mu)


def effect_of_groups(
    tabulated: Tabulated, kind: Kind, v: float, y: float, uncertainty: float = K_UNCERTAINTY
) -> float:
    """Return :func:`effect_of` a case with one k, from its v~ and y~."""
    if not 0.0 < uncertainty < math.inf:
        raise InputError("uncertainty", uncertainty, "finite and > 0")
    if math.isinf(v) or math.isinf(y):  # rigid, or not shaken: k has no influence
        return 0.0
    factors = np.geomspace(1.0 / (1.0 + uncertainty), 1.0 + uncertainty, 7)
    amplitudes = np.full(factors.size, y) if kind.normal else y * factors
    ratios = tabulated.values("mu_ratio", v * factors, amplitudes, kind)[0]
    # the middle one is k
    return _share(float(np.abs(ratios - ratios[3]).max()), float(ratios[3]))


def _share(half_width: float, middle: float) -> float:
    return 0.0 if half_width == 0.0 else half_width / middle if middle > 0.0 else math.inf


def digits(uncertainty: float, least: int = 4, most: int = 6) -> int:
    """Return how many digits to show of a number with the relative uncertainty ``uncertainty``: one
    more than the first digit that it changes.

    >>> digits(0.06), digits(3e-5), digits(0.0)
    (4, 6, 6)
    """
    if not uncertainty >= 0.0:
        raise InputError("uncertainty", uncertainty, ">= 0")
    if uncertainty == 0.0 or math.isinf(uncertainty):
        return least if uncertainty else most
    return min(max(math.ceil(-math.log10(uncertainty)) + 1, least), most)


def _on_other_contact(answer: Answer[float], kind: Kind) -> Note | None:
    alternative = "spring" if kind.contact else "ball"
    try:
        alternative_kind = kind_of(alternative, kind.names["direction"])
    except InputError:  # a ball that oscillates along its normal is another model
        return None
    mu, groups = answer.mu_macro, (answer.v_tilde, answer.y_tilde)
    ratio = answer._surrogate.tabulated.value("mu_ratio", *groups, alternative_kind)[0]
    alternative_mu = answer.cases.columns["mu0"] * ratio
    change = (
        (alternative_mu - mu) / mu
        if mu
        else math.copysign(math.inf, alternative_mu)
        if alternative_mu
        else 0.0
    )
    if abs(change) < 1e-4:
        return None
    names = {"ball": "a ball on a flat", "spring": "a flat contact"}
    text = (
        f"{names[alternative]} with the same k has mu_macro = {alternative_mu:.4g} in place of "
        f"{mu:.4g}"
    )
    return Note(ASSUMES, text, "one spring", effect=change)


def _on_stiffness(effect: float, y: float) -> Note | None:
    margin, change = f"{100.0 * K_UNCERTAINTY:g} %", f"{plain(100.0 * effect, 2)} %"
    if effect >= 1e-3:
        advice = "give k as an interval, or fit k"
        text = f"{margin} more or less of k changes mu_macro by {change}: {advice}"
    elif y > HARDLY:
        text = (
            f"y~ = {plain(y, 3)}, above {HARDLY:g}: {margin} more or less of k changes mu_macro by "
            f"{change}; measured points hardly determine k"
        )
    else:
        return None
    return Note(ASSUMES, text, "k is known", effect=effect)


def _on_tilt(mu0: float, y: float) -> Note | None:
    effect = _NORMAL * mu0 * _TILT * y
    if not effect >= 0.01:
        return None
    text = (
        f"a surface that is tilted by {_TILT:g} rad changes Fz by "
        f"{plain(100.0 * min(effect, 1e3), 2)} % within each period"
    )
    return Note(ASSUMES, text, "constant normal force", effect=effect)


def _on_cycle(answer: Answer[float], six: Mapping[str, Any]) -> list[Note]:
    """Return the notes that follow from the slip path of a period, computed for one spring."""
    groups = (np.array([x]) for x in (answer.v_tilde, answer.y_tilde))
    rate = float(decay_of_springs(answer._surrogate.tabulated, *groups).rate[0])
    slip = 2.0 * math.pi * rate  # over l0
    periods = 2.0 * math.log(1.0 / REMAINING) / slip if slip else math.inf
    force = six["mu0"] * six["Fz"]
    # [m], [Hz]
    slip_path, frequency = slip * force / six["k"], six["omega"] / RAD_PER_CYCLE
    watts, notes = force * slip_path * frequency, list[Note]()
    if math.isinf(periods):
        text = "nothing slips at rest: this is the largest force that the contact can hold"
        notes.append(Note(ASSUMES, text, "steady cycle"))
    elif periods > _PERIODS:
        text = (
            f"creeping: a large disturbance falls to 1 % within {plain(periods, 3)} periods, "
            f"{plain(periods / frequency, 3)} s"
        )
        notes.append(Note(ASSUMES, text, "steady cycle"))
    if _ADAPTS[0] < slip_path < _ADAPTS[1]:
        effect = _RATE * math.log(100.0) / six["mu0"]
        text = (
            f"the contact slips {plain(1e6 * slip_path, 3)} um a period; real friction adapts to a "
            "new speed only after micrometres of slip, and a speed 100 times higher changes mu0 by "
            f"about {plain(100.0 * effect, 2)} %"
        )
        notes.append(Note(ASSUMES, text, "Coulomb friction", effect=effect))
    if watts > _WATTS:
        text = (
            f"the contact turns {plain(watts, 2)} W into heat and slips "
            f"{plain(slip_path * frequency, 2)} m per second"
        )
        notes.append(Note(ASSUMES, text, "no wear, no heating"))
    return notes


# --- in words -------------------------------------------------------------------------------------


def in_words(answer: Answer[Any], units: Mapping[str, str] | None = None) -> tuple[Rows, Rows, str]:
    """Return the answer to one case in three parts: rows of name, value, unit and meaning; what the
    answer assumes and its remarks, each with its type; and the numerical error.

    Numbers have their significant digits, and the unit that ``units`` has for their input, or else
    a suitable unit.
    """
    said = notes_of(answer, units)
    rows = _rows_in_words(answer, said.digits, units or {})
    cases: Any = answer.cases
    contact, k = cases.kind.names["contact"], cases.columns["k"]
    unit = suit_unit("N/m", k)
    size = unit.scale.of_si(k)
    advice = f"give k={0.9 * size:.3g}..{1.1 * size:.3g}{unit.symbol}"
    notes: Rows = []
    for note in said.notes:
        row = _CALLED.get((note.row, contact), note.row)
        text = note.text.replace("give k as an interval", advice)
        notes.append((note.word, note._replace(row=row, text=text).about))
    return rows, notes, f"numerical error  {answer.error_bound:.2g}"


def _stiffness(k: float, units: Mapping[str, str]) -> str:
    """Return a stiffness that was given, or the middle of an interval."""
    unit = choose_unit("k", k, units)
    return f"{tidy_zeros(format_number(k, unit, 6))} {unit.symbol}"


def _rows_in_words(answer: Any, count: int, units: Mapping[str, str]) -> Rows:
    """Return an answer as rows of name, value, unit, meaning."""
    surrogate, cases, outputs = answer._surrogate, answer.cases, answer.outputs
    kind, std = cases.kind, outputs.get("std", 0.0)

    def number(value: float, error: float = 0.0, deviation: float = 0.0) -> str:
        return known(value, count, error, deviation)

    error, mu0 = answer.error_bound, cases.columns["mu0"]
    groups = "Fz_amplitude / Fz" if kind.normal else "y0 k / (mu0 Fz)"
    ratio = number(answer.mu_ratio, error / mu0, std / mu0)
    rows: Rows = [
        ("mu_macro", number(answer.mu_macro, error, std), "[-]", ""),
        ("mu_ratio", ratio, "[-]", "mu_macro / mu0"),
        ("regime", answer.regime, "", REGIMES[answer.regime]),
        ("v_tilde", number(answer.v_tilde), "[-]", "v0 k / (mu0 Fz omega)"),
        ("y_tilde", number(answer.y_tilde), "[-]", groups),
        ("source", answer.source, "", f"of {surrogate.id}, tolerance {surrogate.tolerance:g}"),
    ]
    if cases.ends is not None:
        low, high = (_stiffness(float(end), units) for end in cases.ends)
        middle = _stiffness(cases.columns["k"], units)
        least, most = (number(x, error) for x in (answer.mu_macro_low, answer.mu_macro_high))
        meaning = f"for k from {low} to {high}; {rows[0][1]} at {middle}, the geometric middle"
        rows[0] = ("mu_macro", f"{least} to {most}", "[-]", meaning)
    if "std" in outputs:
        shares = {name: outputs[f"std_share.{name}"] for name in kind.fields}
        parts = ", ".join(f"{name} {100.0 * x:.3g} %" for name, x in shares.items() if x > 0.0)
        least, most = (known(outputs[name], 2) for name in BAND)
        meaning = f"standard deviation; one deviation up and down: {least} to {most}"
        meaning += f"; {parts}" if parts else ""
        rows[0] = ("mu_macro", f"{rows[0][1]} ± {known(std, 2)}", "[-]", meaning)
    for name, slope in (answer.gradient or {}).items():
        per = PER_UNIT[MEASURED_AS.get(name, name)]
        error = answer.gradient_bound[name]
        rows.append((f"slope {name}", number(slope, error), f"[{per}]", f"d mu_macro / d {name}"))
    for path, value in outputs.items():
        if path.partition(".")[0] in _SHOWN or "_bound" in path:
            continue
        name, dot, member = path.partition(".")
        error = outputs.get(f"{name}_bound{dot}{member}", 0.0)
        typed = _UNIT_OF.get(path, "")
        if typed in units:
            unit = choose_unit(typed, value, units)
        else:
            unit = suit_unit(MEMBERS[path].unit, value)
        text = format_number(value, unit, count, error)
        rows.append((path, text, f"[{unit.symbol}]", MEMBERS[path].meaning))
    return rows
