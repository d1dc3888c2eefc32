"""Put the answer to one case into words, as the command prints it and a notebook shows it."""

from collections.abc import Mapping
from typing import Any

from mumacro.answer import Answer
from mumacro.inputs.fields import MEASURED_AS, PER_UNIT, Kind
from mumacro.inputs.units import choose_unit, format_number, known, suit_unit, tidy_zeros
from mumacro.outputs import MEMBERS
from mumacro.results import Note, Rows
from mumacro.validity import notes_of

REGIMES = {
    "continuous": "slips all the time",
    "stick_slip": "sticks during a part of each period",
    "static": "at rest: the limit v0 -> 0",
    "partial_slip": "the rim of the contact slips all the time, its middle sticks during a part of "
    "each period",
    "reverse_slip": "slips forwards and backwards in each period",
}
#: rows of validity.ROWS that have another name for a contact
_CALLED = {("one spring", "ball"): "a ball"}
_SHOWN = ("std", "std_share", "gradient")  # these are shown in their own rows


def of_one_case(
    answer: Answer[Any], units: Mapping[str, str] | None = None
) -> tuple[Rows, Rows, str]:
    """Return three things: rows of name, value, unit and meaning; what the answer assumes and its
    remarks, each with its type; and the numerical error.

    Numbers have their significant digits, and the unit that ``units`` has for their input, or else
    a suitable unit.
    """
    kind, case = answer.cases.kind, answer.cases.columns
    said = notes_of(answer, units)
    rows = _rows_of(answer, kind, said.digits, units or {})
    notes: Rows = [(one.word, in_words(one, kind, case).about) for one in said.notes]
    return rows, notes, f"numerical error  {answer.error_bound:.2g}"


def in_words(note: Note, kind: Kind, case: Mapping[str, Any]) -> Note:
    """Return a note on a case in the words of its contact (a ball is not one spring), with a value
    to type as advice.

    >>> from mumacro.inputs.fields import kind_of
    >>> in_words(Note("assumes", "...", "one spring"), kind_of("ball"), {"k": 1.0}).row
    'a ball'
    """
    unit = suit_unit("N/m", case["k"])
    k = unit.scale.of_si(case["k"])
    advice = f"give k={0.9 * k:.3g}..{1.1 * k:.3g}{unit.symbol}"
    row = _CALLED.get((note.row, kind.names["contact"]), note.row)
    return note._replace(row=row, text=note.text.replace("give k as an interval", advice))


#: paths that have the unit of an input
_UNIT_OF = {"limits.v0_crit": "v0", "groups.l0": "y0"}


def _stiffness(k: float, units: Mapping[str, str]) -> str:
    """Return a stiffness that was given, or the middle of an interval."""
    unit = choose_unit("k", k, units)
    return f"{tidy_zeros(format_number(k, unit, 6))} {unit.symbol}"


def _rows_of(answer: Any, kind: Kind, count: int, units: Mapping[str, str]) -> Rows:
    """Return an answer as rows of name, value, unit, meaning."""
    surrogate, cases = answer._surrogate, answer.cases
    std = answer["std"] if "std" in answer.paths else 0.0

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
    if "std" in answer.paths:
        shares = {name: answer[f"std_share.{name}"] for name in kind.fields}
        parts = ", ".join(f"{name} {100.0 * x:.3g} %" for name, x in shares.items() if x > 0.0)
        meaning = f"standard deviation; {parts}" if parts else "standard deviation"
        rows[0] = ("mu_macro", f"{rows[0][1]} ± {known(std, 2)}", "[-]", meaning)
    for name, slope in (answer.gradient or {}).items():
        per = PER_UNIT[MEASURED_AS.get(name, name)]
        error = answer.gradient_bound[name]
        rows.append((f"slope {name}", number(slope, error), f"[{per}]", f"d mu_macro / d {name}"))
    for path, value in answer.outputs.items():
        if path.partition(".")[0] in _SHOWN or "_bound" in path:
            continue
        name, dot, member = path.partition(".")
        error = answer.outputs.get(f"{name}_bound{dot}{member}", 0.0)
        typed = _UNIT_OF.get(path, "")
        if typed in units:
            unit = choose_unit(typed, value, units)
        else:
            unit = suit_unit(MEMBERS[path].unit, value)
        text = format_number(value, unit, count, error)
        rows.append((path, text, f"[{unit.symbol}]", MEMBERS[path].meaning))
    return rows
