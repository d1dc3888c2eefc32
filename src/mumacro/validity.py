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

from mumacro.contacts.stiffening import ROUGH, Stiffening
from mumacro.errors import InputError
from mumacro.inputs.cases import Cases, without_interval
from mumacro.inputs.doubts import FURTHEST, UNITS
from mumacro.inputs.fields import RAD_PER_CYCLE, RIGID
from mumacro.inputs.kind import SPRING, SPRINGS_OF, Kind, kind_of
from mumacro.inputs.numbers import plain
from mumacro.outputs.evaluated import Evaluated
from mumacro.outputs.settling import decay
from mumacro.outputs.tabulated import Tabulated

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


class Answers(Protocol):
    """What answers cases: a :class:`mumacro.Surrogate`."""

    tabulated: Tabulated

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
    surrogate: Answers,
    case: Mapping[str, Any],
    contact: str = "spring",
    direction: str = "across",
) -> list[Row]:
    """The rows of docs/validity.md that a case falls in.

    ``case`` has inputs of :meth:`mumacro.Surrogate.evaluate`, numbers in SI; for an interval of k
    the rows are those of its geometric middle, without the row of k.  A contact without oscillation
    has no rows.

    Examples
    --------
    >>> from mumacro import Surrogate
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}
    >>> [k_row] = [row for row in model_rows(Surrogate.open(), case) if row["row"] == "k is known"]
    >>> k_row["text"]
    '10 % more or less of k changes mu_macro by 6 %: give k as an interval, or fit k'
    """
    case, ends = without_interval(case)
    kind = kind_of(contact, direction)
    answer = surrogate.evaluate(**case, **kind.names)
    mu = answer.mu_macro
    inputs = _inputs_of(case, kind)
    six = {"y0": 0.0, **inputs}  # 0 for normal
    swing = six.get("Fz_amplitude", six["y0"])
    if math.isinf(six["k"]) or six["omega"] == 0.0 or swing == 0.0:
        return []
    y = 0.0 if kind.normal else answer.y_tilde
    if y > FURTHEST:  # no contact has such a y~: the remark on it stands alone
        doubts = [one for one in answer.remarks if one["row"] == UNITS]
        return [{"row": UNITS, "text": one["text"], "effect": None} for one in doubts]
    rows = [
        _row_of_other_contact(surrogate, case, mu, contact, direction),
        None if ends else _row_of_stiffness(surrogate, case, y, contact, direction),
        _row_of_tilt(six["mu0"], y),
        *(_rows_of_cycle(surrogate, six) if direction == "across" else ()),
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
    surrogate: Answers,
    case: Mapping[str, Any],
    contact: str = "spring",
    direction: str = "across",
    uncertainty: float = K_UNCERTAINTY,
) -> float:
    """By how much, relatively, mu_macro may differ [-] where k may by the factor 1 +
    ``uncertainty`` up or down; 0 if rigid.

    The largest of seven values of k, since mu_macro is no straight line in k.  Over an interval of
    k half the width.
    """
    if not 0.0 < uncertainty < math.inf:
        raise InputError("uncertainty", uncertainty, "finite and > 0")
    words = kind_of(contact, direction).names
    middle_case, ends = without_interval(case)
    k = _inputs_of(middle_case, kind_of(contact, direction))["k"]
    if math.isinf(k):
        return 0.0
    if ends:
        band = surrogate.evaluate(**case, **words)
        middle_mu, half_width = band.mu_macro, 0.5 * (band.mu_macro_high - band.mu_macro_low)
    else:
        stiffnesses = k * np.geomspace(
            1.0 / (1.0 + uncertainty), 1.0 + uncertainty, 7
        )  # the middle one is k
        samples = surrogate.evaluate(**{**case, "k": stiffnesses}, **words).mu_macro
        middle_mu, half_width = float(samples[3]), float(np.abs(samples - samples[3]).max())
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


def _inputs_of(case: Mapping[str, Any], kind: Kind) -> dict[str, float]:
    """The six inputs as numbers: omega from f, k infinite for a rigid contact."""
    cases = Cases.of(case, kind)
    if cases.shape:
        shapes = {name: np.shape(value) for name, value in case.items()}
        raise InputError("case", shapes, "one case: numbers")
    return {name: float(column) for name, column in cases.columns.items()}


def _row_of_other_contact(
    surrogate: Answers, case: Mapping[str, Any], mu: float, contact: str, direction: str
) -> Row | None:
    alternative = "ball" if contact == "spring" else "spring"
    try:
        alternative_mu = surrogate.evaluate(
            **case, **kind_of(alternative, direction).names
        ).mu_macro
    except InputError:  # a ball that oscillates along its normal is another model
        return None
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


def _row_of_stiffness(
    surrogate: Answers, case: Mapping[str, Any], y: float, contact: str, direction: str
) -> Row | None:
    effect = k_effect(surrogate, case, contact, direction)
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


def _rows_of_cycle(surrogate: Answers, six: dict[str, Any]) -> list[Row]:
    """Rows that follow from the slip path of a period, taken from one spring."""
    cases = Evaluated(surrogate.tabulated, Cases.of(six, SPRING), "groups")
    _, periods, _, slip, _ = decay(cases)
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
