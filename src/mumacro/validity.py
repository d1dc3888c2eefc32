"""How far the model holds for a case: the rows of docs/validity.md that apply to it, with the size
of each effect.

The error bound of an answer is the table's distance to the model.  How far the model is from a
contact is another question, and mostly the larger one.  Two assumptions cannot be judged from the
inputs of a case, and have no row here: quasi-static contact, which needs masses, and a stiff drive.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypedDict

import numpy as np

from mumacro.answer import BAND, Answer
from mumacro.contacts.stiffening import ROUGH, Stiffening
from mumacro.errors import InputError
from mumacro.inputs.doubts import FURTHEST, UNITS
from mumacro.inputs.fields import RAD_PER_CYCLE, RIGID
from mumacro.inputs.kind import AMPLITUDE, SPRINGS_OF, Kind, kind_of
from mumacro.inputs.numbers import plain
from mumacro.outputs.settling import REMAINING, decay_of_springs

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
K_UNCERTAINTY = (
    0.1  # relative uncertainty of k by default: materials and geometry give no better one
)
HARDLY = 20.0  # y~ from which on mu_macro hardly depends on k (docs/validity.md)
_RATE = 0.01  # a of mu0 + a ln(slip speed), rock, polymers and metals (docs/validity.md)
_TILT, _NORMAL = 0.01, 1.21  # misalignment; normal over tangential stiffness of steel on steel
# slip paths [m] between which a row is shown: friction follows a new slip speed after micrometres
_ADAPTS = 1e-7, 1e-4
_PERIODS, _WATTS = 100.0, 0.1  # above them there is a row on settling, and one on heat


class Evaluates(Protocol):
    """What answers cases: a :class:`mumacro.Surrogate`."""

    @property
    def evaluate(self) -> Callable[..., Any]:
        """The method of that name."""


class Row(TypedDict):
    """One row: its name in :data:`ROWS`, a sentence, and the relative change of mu_macro, or
    None where its size is unknown."""

    row: str
    text: str
    effect: float | None


def model_rows(
    surrogate: Evaluates,
    case: Mapping[str, Any],
    contact: str = "spring",
    direction: str = "across",
) -> list[Row]:
    """Evaluate a case, and return its :func:`rows_of`.

    ``case`` has inputs of :meth:`mumacro.Surrogate.evaluate`.

    Examples
    --------
    >>> from mumacro import Surrogate
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}
    >>> [k_row] = [row for row in model_rows(Surrogate.open(), case) if row["row"] == "k is known"]
    >>> k_row["text"]
    '10 % more or less of k changes mu_macro by 6 %: give k as an interval, or fit k'
    """
    return rows_of(_answer_to(surrogate, case, contact, direction))


def rows_of(answer: Answer[float], effect: float | None = None) -> list[Row]:
    """Return the rows of docs/validity.md that an evaluated case falls in.

    Of an interval of k the rows are those of its geometric middle.  Where k is an interval or has a
    deviation, there is no row of k: the answer shows what follows.  A contact without oscillation
    has no rows.  ``effect`` is :func:`effect_of` the answer, where it is there already.
    """
    cases, y = answer.cases, answer.y_tilde
    kind, inputs = cases.kind, cases.columns
    swing = inputs[AMPLITUDE if kind.normal else "y0"]
    if math.isinf(inputs["k"]) or inputs["omega"] == 0.0 or swing == 0.0:
        return []
    y = 0.0 if kind.normal else y
    if y > FURTHEST:  # no contact has such a y~: the remark on it stands alone
        doubts = [one for one in answer.remarks if one["row"] == UNITS]
        return [{"row": UNITS, "text": one["text"], "effect": None} for one in doubts]
    uncertain = cases.ends is not None or np.any(cases.std.get("k", 0.0))
    rows = [
        _row_of_other_contact(answer, kind),
        None
        if uncertain
        else _row_of_stiffness(effect_of(answer) if effect is None else effect, y),
        _row_of_tilt(float(inputs["mu0"]), y),
        *(() if kind.direction else _rows_of_cycle(answer, inputs)),
    ]
    return sorted((row for row in rows if row is not None), key=lambda row: ROWS.index(row["row"]))


def load_rows(
    unknown: str,
    case: Mapping[str, Any],
    contact: str = "spring",
    stiffening: Stiffening | None = None,
) -> list[Row]:
    """The row on k where Fz is swept or solved for, if there is one to add.

    ``case`` has the other five inputs, ``stiffening`` says how k grows, as in the result.

    Examples
    --------
    >>> case = {"mu0": 0.3, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}
    >>> [k_row] = load_rows("Fz", case, "ball", Stiffening(1 / 3, 10.0))
    >>> k_row["text"]
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
    return [{"row": "k is known", "text": text, "effect": None}]


def k_effect(
    surrogate: Evaluates,
    case: Mapping[str, Any],
    contact: str = "spring",
    direction: str = "across",
    uncertainty: float = K_UNCERTAINTY,
) -> float:
    """Evaluate a case, and return :func:`effect_of` its answer."""
    return effect_of(_answer_to(surrogate, case, contact, direction), uncertainty)


def effect_of(answer: Answer[float], uncertainty: float = K_UNCERTAINTY) -> float:
    """Return by how much, relatively, mu_macro may differ [-] where k may by the factor 1 +
    ``uncertainty`` up or down; 0 if rigid.

    The largest of seven values of k counts, since mu_macro is no straight line in k.  Over an
    interval of k it is half the width.
    """
    if not 0.0 < uncertainty < math.inf:
        raise InputError("uncertainty", uncertainty, "finite and > 0")
    cases, kind, middle_mu = answer.cases, answer.cases.kind, answer.mu_macro
    v, y = answer.v_tilde, answer.y_tilde
    if cases.ends is not None:
        low, high = (getattr(answer, name) for name in BAND)
        half_width = 0.5 * (high - low)
    elif math.isinf(v) or math.isinf(y):  # rigid, or not shaken: k is no part of the answer
        return 0.0
    else:
        factors = np.geomspace(1.0 / (1.0 + uncertainty), 1.0 + uncertainty, 7)
        amplitudes = np.full(factors.size, y) if kind.normal else y * factors
        tabulated = answer._surrogate.tabulated
        ratios = tabulated.values("mu_ratio", v * factors, amplitudes, kind)[0]
        middle_mu = float(ratios[3])  # the middle one is k
        half_width = float(np.abs(ratios - ratios[3]).max())
    return 0.0 if half_width == 0.0 else half_width / middle_mu if middle_mu > 0.0 else math.inf


def digits(uncertainty: float, least: int = 4, most: int = 6) -> int:
    """Digits to show of a number that is known to ``uncertainty``, relatively: one beyond the first
    that it moves.

    >>> digits(0.06), digits(3e-5), digits(0.0)
    (4, 6, 6)
    """
    if not uncertainty >= 0.0:
        raise InputError("uncertainty", uncertainty, ">= 0")
    if uncertainty == 0.0 or math.isinf(uncertainty):
        return least if uncertainty else most
    return min(max(math.ceil(-math.log10(uncertainty)) + 1, least), most)


def _answer_to(
    surrogate: Evaluates, case: Mapping[str, Any], contact: str, direction: str
) -> Answer[float]:
    """Return the answer to one case; raise InputError for several."""
    answer: Answer[float] = surrogate.evaluate(case, contact=contact, direction=direction)
    if np.shape(answer.mu_macro):
        shapes = {name: np.shape(value) for name, value in case.items()}
        raise InputError("case", shapes, "one case: numbers")
    return answer


def _row_of_other_contact(answer: Answer[float], kind: Kind) -> Row | None:
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
    return {"row": "one spring", "text": text, "effect": change}


def _row_of_stiffness(effect: float, y: float) -> Row | None:
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
    return {"row": "k is known", "text": text, "effect": effect}


def _row_of_tilt(mu0: float, y: float) -> Row | None:
    effect = _NORMAL * mu0 * _TILT * y
    if not effect >= 0.01:
        return None
    text = (
        f"a surface that is tilted by {_TILT:g} rad changes Fz by "
        f"{plain(100.0 * min(effect, 1e3), 2)} % within each period"
    )
    return {"row": "constant normal force", "text": text, "effect": effect}


def _rows_of_cycle(answer: Answer[float], six: Mapping[str, Any]) -> list[Row]:
    """Rows that follow from the slip path of a period, taken from one spring."""
    groups = (np.array([x]) for x in (answer.v_tilde, answer.y_tilde))
    rate = float(decay_of_springs(answer._surrogate.tabulated, *groups).rate[0])
    slip = 2.0 * math.pi * rate  # over l0
    periods = 2.0 * math.log(1.0 / REMAINING) / slip if slip else math.inf
    force = six["mu0"] * six["Fz"]
    # [m], [Hz]
    slip_path, frequency = slip * force / six["k"], six["omega"] / RAD_PER_CYCLE
    watts, rows = force * slip_path * frequency, list[Row]()
    if math.isinf(periods):
        text = "nothing slips at rest: this is the largest force that the contact can hold"
        rows.append({"row": "steady cycle", "text": text, "effect": None})
    elif periods > _PERIODS:
        text = (
            f"creeping: a large disturbance falls to 1 % within {plain(periods, 3)} periods, "
            f"{plain(periods / frequency, 3)} s"
        )
        rows.append({"row": "steady cycle", "text": text, "effect": None})
    if _ADAPTS[0] < slip_path < _ADAPTS[1]:
        effect = _RATE * math.log(100.0) / six["mu0"]
        text = (
            f"the contact slips {plain(1e6 * slip_path, 3)} um a period; real friction adapts to a "
            "new speed only after micrometres of slip, and a speed 100 times higher changes mu0 by "
            f"about {plain(100.0 * effect, 2)} %"
        )
        rows.append({"row": "Coulomb friction", "text": text, "effect": effect})
    if watts > _WATTS:
        text = (
            f"the contact turns {plain(watts, 2)} W into heat and slips "
            f"{plain(slip_path * frequency, 2)} m per second"
        )
        rows.append({"row": "no wear, no heating", "text": text, "effect": None})
    return rows
