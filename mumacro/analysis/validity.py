"""What an answer says about the model: the rows of docs/validity.md that a case falls in, with the
size of each effect.

The error bound of an answer is the table's distance to the model.  How far the model is from a
contact is another question, and mostly the larger one.  Two assumptions cannot be judged from the
inputs of a case, and have no row here: quasi-static contact, which needs masses, and a stiff drive.
"""

import math
from collections.abc import Mapping
from typing import Any, TypedDict

import numpy as np

from mumacro.analysis.load import EXPONENTS, ROUGH, Stiffening
from mumacro.analysis.measured_points import HARDLY
from mumacro.analysis.settling import settling
from mumacro.errors import InputError
from mumacro.inputs.cases import Cases, by_name, without_interval
from mumacro.inputs.fields import RAD_PER_CYCLE, RIGID
from mumacro.inputs.kind import Kind, kind_of
from mumacro.surrogate import Surrogate

#: names of the rows, as in the table of docs/validity.md
ROWS = (
    "one spring",
    "k is known",
    "units",
    "steady cycle",
    "Coulomb friction",
    "constant normal force",
    "no wear, no heating",
)
KNOWN = 0.1  # relative uncertainty of k, if not said: what materials and geometry give at best
_FAR = 1e4  # y~ that no contact has
_RATE = 0.01  # a of mu0 + a ln(slip speed), rock, polymers and metals (docs/validity.md)
_TILT, _NORMAL = 0.01, 1.21  # misalignment; normal over tangential stiffness of steel on steel
# slip paths [m] around the micrometres after which friction has adapted to a new speed
_ADAPTS = 1e-7, 1e-4
_PERIODS, _WATTS = 100.0, 0.1  # from which on settling and heat are told


class Row(TypedDict):
    """One row: its name in :data:`ROWS`, a sentence, and the relative change of mu_macro, None
    where none is known."""

    row: str
    text: str
    effect: float | None


def model_rows(
    surrogate: Surrogate,
    case: Mapping[str, Any],
    contact: str = "spring",
    direction: str = "across",
) -> list[Row]:
    """The rows of docs/validity.md that a case falls in.

    ``case`` has inputs of :meth:`mumacro.Surrogate.evaluate`, numbers in SI; of an interval of k
    its geometric middle is told, without the row of k.  Nothing is to be said of a contact without
    oscillation.

    Examples
    --------
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}
    >>> [found] = [row for row in model_rows(Surrogate.open(), case) if row["row"] == "k is known"]
    >>> found["text"]
    'k known to 10 % leaves mu_macro uncertain by 6 %: give k_range, or fit k'
    """
    case, ends = without_interval(case)
    kind = kind_of(contact, direction)
    answer = surrogate.evaluate(**case, **kind.names)
    mu = answer.mu_macro
    one = _one(case, kind)
    six = {"y0": 0.0, **one}  # 0 for normal
    swing = six.get("Fz_amplitude", six["y0"])
    if math.isinf(six["k"]) or six["omega"] == 0.0 or swing == 0.0:
        return []
    y = 0.0 if kind.normal else answer.y_tilde
    if y > _FAR:
        text = f"y~ = {y:.3g}; contacts have 0.1 to 100: is y0 = {six['y0']:.3g} in metres?"
        return [{"row": "units", "text": text, "effect": None}]
    rows = [
        _kind(surrogate, case, mu, contact, direction),
        None if ends else _stiffness(surrogate, case, y, contact, direction),
        _tilt(six["mu0"], y),
        *(_cycle(surrogate, six) if direction == "across" else ()),
    ]
    return sorted((row for row in rows if row is not None), key=lambda row: ROWS.index(row["row"]))


def load_rows(
    unknown: str,
    case: Mapping[str, Any],
    contact: str = "spring",
    stiffening: Stiffening | None = None,
) -> list[Row]:
    """What is to be said of k where Fz is swept or solved for, at most one row.

    ``case`` has the other five inputs, ``stiffening`` says how k grows, as in the result.

    Examples
    --------
    >>> case = {"mu0": 0.3, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}
    >>> [found] = load_rows("Fz", case, "ball", Stiffening(1 / 3, 10.0))
    >>> found["text"]
    'k grows as Fz^0.333 from its value at Fz = 10 N'
    """
    if unknown != "Fz" or case.get("k") in (math.inf, RIGID):
        return []
    if stiffening is not None:
        text = (
            f"k grows as Fz^{stiffening.exponent:.3g} from its value at Fz = {stiffening.load:g} N"
        )
    else:
        advice = "" if EXPONENTS[contact] else ", and a stiffness exponent"
        text = (
            "constant over Fz here; with the load k grows, as Fz^(1/3) for a ball, as "
            f"Fz^{ROUGH[0]:g} to Fz^{ROUGH[1]:g} for rough surfaces: give Fz at which k "
            f"holds{advice}"
        )
    return [{"row": "k is known", "text": text, "effect": None}]


def k_effect(
    surrogate: Surrogate,
    case: Mapping[str, Any],
    contact: str = "spring",
    direction: str = "across",
    known: float = KNOWN,
) -> float:
    """By how much, relatively, mu_macro may differ [-] where k may by the factor 1 + ``known`` up
    or down; 0 if rigid.

    The largest of seven values of k, since mu_macro is no straight line in k.  Over an interval of
    k half the width.
    """
    if not 0.0 < known < math.inf:
        raise InputError("known", known, "finite and > 0")
    words = kind_of(contact, direction).names
    one, ends = without_interval(case)
    found = _one(one, kind_of(contact, direction))["k"]
    if math.isinf(found):
        return 0.0
    if ends:
        over = surrogate.evaluate(**case, **words)
        at, apart = over.mu_macro, 0.5 * (over.mu_macro_high - over.mu_macro_low)
    else:
        k = found * np.geomspace(1.0 / (1.0 + known), 1.0 + known, 7)  # the middle one is k
        mu = surrogate.evaluate(**{**case, "k": k}, **words).mu_macro
        at, apart = float(mu[3]), float(np.abs(mu - mu[3]).max())
    return 0.0 if apart == 0.0 else apart / at if at > 0.0 else math.inf


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


def _one(case: Mapping[str, Any], kind: Kind) -> dict[str, float]:
    """The six inputs as numbers: omega from f, k infinite for a rigid contact."""
    one = Cases.of(by_name(None, case, kind), kind)
    if one.shape:
        shapes = {name: np.shape(value) for name, value in case.items()}
        raise InputError("case", shapes, "one case: numbers")
    return {name: float(column) for name, column in one.columns.items()}


def _kind(
    surrogate: Surrogate, case: Mapping[str, Any], mu: float, contact: str, direction: str
) -> Row | None:
    other = "ball" if contact == "spring" else "spring"
    try:
        found = surrogate.evaluate(**case, **kind_of(other, direction).names).mu_macro
    except InputError:  # a ball that oscillates along its normal is another model
        return None
    off = (found - mu) / mu if mu else math.copysign(math.inf, found) if found else 0.0
    if abs(off) < 1e-4:
        return None
    names = {"ball": "a ball on a flat", "spring": "a contact that slips as one"}
    text = f"{names[other]} with the same k has mu_macro = {found:.4g} in place of {mu:.4g}"
    return {"row": "one spring", "text": text, "effect": off}


def _stiffness(
    surrogate: Surrogate, case: Mapping[str, Any], y: float, contact: str, direction: str
) -> Row | None:
    effect = k_effect(surrogate, case, contact, direction)
    known, off = f"{100.0 * KNOWN:g} %", f"{100.0 * effect:.2g} %"
    if effect >= 1e-3:
        text = f"k known to {known} leaves mu_macro uncertain by {off}: give k_range, or fit k"
    elif y > HARDLY:
        text = (
            f"y~ = {y:.3g}, above {HARDLY:g}: k off by {known} moves mu_macro by {off}; "
            "measured points hardly tell k"
        )
    else:
        return None
    return {"row": "k is known", "text": text, "effect": effect}


def _tilt(mu0: float, y: float) -> Row | None:
    effect = _NORMAL * mu0 * _TILT * y
    if not effect >= 0.01:
        return None
    text = (
        f"a misalignment of {_TILT:g} changes Fz by {100.0 * min(effect, 1e3):.2g} % within "
        "each period"
    )
    return {"row": "constant normal force", "text": text, "effect": effect}


def _cycle(surrogate: Surrogate, six: dict[str, Any]) -> list[Row]:
    """Rows that the slip path of a period tells, taken from one spring."""
    found = settling(surrogate, **six)
    force = six["mu0"] * six["Fz"]
    # [m], [Hz]
    way, frequency = float(found.slip_path) * force / six["k"], six["omega"] / RAD_PER_CYCLE
    watts, rows = force * way * frequency, list[Row]()
    if math.isinf(found.periods):
        text = "nothing slips at rest: this is the largest force that the contact can hold"
        rows.append({"row": "steady cycle", "text": text, "effect": None})
    elif found.periods > _PERIODS:
        text = (
            f"creeping: a disturbance falls to 1 % within {found.periods:.3g} periods, "
            f"{found.time:.3g} s"
        )
        rows.append({"row": "steady cycle", "text": text, "effect": None})
    if _ADAPTS[0] < way < _ADAPTS[1]:
        effect = _RATE * math.log(100.0) / six["mu0"]
        text = (
            f"slip path {way:.2g} m a period, near the micrometres in which friction adapts to "
            "speed; "
        )
        text += f"a factor of 100 in slip speed changes mu0 by {100.0 * effect:.2g} %"
        rows.append({"row": "Coulomb friction", "text": text, "effect": effect})
    if watts > _WATTS:
        text = (
            f"the contact turns {watts:.2g} W into heat, over a slip path of "
            f"{way * frequency:.2g} m/s"
        )
        rows.append({"row": "no wear, no heating", "text": text, "effect": None})
    return rows
