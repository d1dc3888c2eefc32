"""The answer to cases: the default outputs, and what ``include`` can add.

Each is one function here, a member of ``models/answers.py`` with its unit and meaning, and a name
in ``models/options.py``.  It takes one case in plain numbers, or many in columns, and gives its
outputs by path: ``power.saved`` is ``saved`` within ``power``.  Equation numbers are those of
Benad, Nakano, Popov, Popov, "Active control of friction by transverse oscillations" (Friction,
2018).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from mumacro import Surrogate
from mumacro.analysis.settling import settling as decay
from mumacro.errors import InputError
from mumacro.inputs.cases import Cases, by_name
from mumacro.inputs.kind import SPRING, Kind
from mumacro.kernel.arrays import Array, Codes
from mumacro.table.atlas import REGIME_OF_SOURCE, REGIMES, ROUNDING
from mumacro.table.atlas import SOURCES as _SOURCES
from mumacro.validity import digits, k_effect, model_rows

from .models.options import MODEL

SOURCES = tuple(_SOURCES)
#: name of the regime of every source code
REGIME_OF = tuple(REGIMES[code] for code in REGIME_OF_SOURCE)
Outputs = dict[str, Any]  # by path
#: outputs that are codes of a source
CODED = ("regime", "source")


@dataclass
class Answered:
    """Cases with their answer, for which more is computed: plain numbers, or columns (n,).

    k = inf is rigid contact.  The slopes are there if what is included needs them.  What is not
    legal is NaN.
    """

    surrogate: Surrogate
    kind: Kind
    columns: Mapping[str, Any]
    answer: Any
    std: Mapping[str, float]

    def __post_init__(self) -> None:
        self.mu_macro, self.error_bound = self.answer.mu_macro, self.answer.error_bound
        self.v_tilde, self.y_tilde = self.answer.v_tilde, self.answer.y_tilde
        self.length_scale = self.answer.length_scale
        amplitude = self.columns["Fz_amplitude" if self.kind.normal else "y0"]
        self.moving = (amplitude != 0.0) & (self.columns["omega"] != 0.0)
        self.rigid = self.columns["k"] == math.inf
        #: elastic, oscillating, with groups within double range
        self.usable = (self.y_tilde < math.inf) & self.moving
        self.words: dict[str, Any] = self.kind.names

    def at_speed(self, v0: Any) -> Array:
        """mu_macro at another v0, in the same shape; NaN where that is not legal."""
        columns = {
            name: np.atleast_1d(column) for name, column in {**self.columns, "v0": v0}.items()
        }
        mu_macro = self.surrogate.evaluate(columns, **self.words).mu_macro
        shape = np.shape(self.mu_macro)
        return np.broadcast_to(mu_macro, shape or (1,)).reshape(shape)

    def slopes(self) -> tuple[Outputs, Outputs]:
        """d mu_macro / d input and the bounds, NaN along k where contact is rigid."""
        no_slope = where(self.rigid, np.nan, 0.0)
        slopes, bounds = self.answer.gradient, self.answer.gradient_bound
        return {**slopes, "k": slopes["k"] + no_slope}, {**bounds, "k": bounds["k"] + no_slope}


def where(condition: Any, one: Any, other: Any) -> Any:
    """``np.where``, which takes a microsecond for a single number."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, one, other)
    return one if condition else other


class Includable(NamedTuple):
    """One name that ``include`` may hold."""

    compute: Callable[[Answered], Outputs]
    cost: float  # time of a case, in times of a plain answer
    slopes: bool  # whether it needs the gradient
    lacks: Mapping[str, str]  # direction or k_range that it cannot be computed for -> why


INCLUDABLE: dict[str, Includable] = {}


def includable(cost: float, slopes: bool = False, **lacks: str) -> Callable[[Any], Any]:
    """Register the decorated function under its name."""

    def register(compute: Callable[[Answered], Outputs]) -> Callable[[Answered], Outputs]:
        INCLUDABLE[compute.__name__] = Includable(compute, cost, slopes, lacks)
        return compute

    return register


@includable(cost=2)
def groups(cases: Answered) -> Outputs:
    """Dimensionless groups."""
    return {
        "groups.v_tilde": cases.v_tilde,
        "groups.y_tilde": cases.y_tilde,
        "groups.l0": cases.length_scale,
    }


@includable(cost=8)
def limits(cases: Answered) -> Outputs:
    """Marks on the friction law."""
    if cases.words["direction"] == "along":  # where the contact begins to slide backwards
        speed = cases.columns["y0"] * cases.columns["omega"]
    else:  # rigid contact is the limit y~ -> inf: l0 omega v~crit = 0.477 omega sqrt(y0 l0) -> 0
        crit = cases.surrogate.v_tilde_crit(where(cases.usable, cases.y_tilde, 0.0), **cases.words)
        speed = where(cases.usable, cases.length_scale * crit * cases.columns["omega"], np.nan)
        speed = where(cases.moving, where(cases.rigid, 0.0, speed), 0.0)
    return {
        "limits.mu_static": cases.at_speed(0.0),
        "limits.v0_crit": speed,
        "limits.mu_crit": cases.at_speed(speed),
    }


@includable(cost=6, slopes=True)
def gradient(cases: Answered) -> Outputs:
    """d mu_macro / d input, with bounds."""
    slopes, bounds = cases.slopes()
    fields = cases.kind.fields
    return {f"gradient.{name}": slopes[name] for name in fields} | {
        f"gradient_bound.{name}": bounds[name] for name in fields
    }


@includable(
    cost=8,
    slopes=True,
    k_range="it needs one k: give k with its standard deviation, or k_range without std",
)
def std(cases: Answered) -> Outputs:
    """Standard deviation of mu_macro from independent standard deviations of the inputs."""
    spreads = {name: cases.std.get(name, 0.0) for name in cases.kind.fields}
    # k has no effect where contact is rigid, nor has an infinite slope where the input is exact
    exact = {
        name: (cases.rigid & (name == "k")) | (spread == 0.0) for name, spread in spreads.items()
    }
    terms, doubts = (
        [where(exact[name], 0.0, slopes[name] * spread) for name, spread in spreads.items()]
        for slopes in cases.slopes()
    )
    with np.errstate(all="ignore"):
        total, doubt = (reduce(np.hypot, parts) for parts in (terms, doubts))
        shares = [where(total > 0.0, (term / total) ** 2, 0.0) for term in terms]
    outputs = {"std": total, "std_bound": doubt}
    return outputs | {
        f"std_share.{name}": share for name, share in zip(spreads, shares, strict=True)
    }


@includable(cost=4)
def stick_fraction(cases: Answered) -> Outputs:
    """Share of the period during which the contact sticks."""
    value, bound = cases.surrogate.stick_fraction_with_bound(
        cases.v_tilde, cases.y_tilde, **cases.words
    )
    # y~ below double range: the groups do not show whether such a contact sticks
    lost = (cases.y_tilde == 0.0) & (cases.v_tilde < np.inf) & cases.moving
    return {"stick_fraction": value, "stick_fraction_bound": where(lost, 1.0, bound)}


@includable(cost=5, normal="how far the load moves is not modelled")
def power(cases: Answered) -> Outputs:
    """Mean powers of the shaker and of the drive."""
    mu0, load, omega, v0 = (cases.columns[name] for name in ("mu0", "Fz", "omega", "v0"))
    unit = where(cases.usable, mu0 * load * (cases.length_scale * omega), np.nan)
    v, y = (where(cases.usable, group, 1.0) for group in (cases.v_tilde, cases.y_tilde))
    with_bound = cases.surrogate.power_with_bound(v, y, **cases.words)
    shaker, bound = (where(cases.moving, number * unit, 0.0) for number in with_bound)
    saved = (mu0 - cases.mu_macro) * load * v0
    return {
        "power.oscillation": shaker,
        "power.saved": saved,
        "power_bound.oscillation": bound,
        "power_bound.saved": cases.error_bound * load * v0 + ROUNDING * abs(saved),
    }


_DERIVED = "how a disturbance decays is derived for across only"


@includable(cost=5, along=_DERIVED, normal=_DERIVED)
def settling(cases: Answered) -> Outputs:
    """Periods until a disturbed contact is within 1 % of its steady cycle."""
    settled = decay(cases.surrogate, **cases.columns, **cases.words)
    return {
        "settling.periods": settled.periods,
        "settling.periods_any": settled.periods_any,
        "settling.time": settled.time,
        "settling.slip_path": settled.slip_path,
        "settling_bound.periods": settled.error_bound,
    }


# --- what is computed -----------------------------------------------------------------------------

# in times of one spring, across, at one k
_COSTS = {"ball": 2.0, "along": 10.0, "normal": 10.0, "k_range": 200.0}
_BALL_ALONG = 5.0  # times both: a sum over springs
_INTERVAL = frozenset(("k_range", "k_low", "k_high"))


class Plan(NamedTuple):
    """What is computed of cases: their kind, what is included beside the default outputs, and
    deviations for ``std``."""

    kind: Kind = SPRING
    interval: bool = False  # whether k is one
    include: tuple[str, ...] = ()
    std: Mapping[str, float] = {}
    model: bool = False  # whether remarks on the model are included, for one case only
    cost: float = 1.0  # time of a case, in times of a plain answer

    @classmethod
    def of(cls, options: Any, inputs: Mapping[str, Any]) -> "Plan":
        """What options ask of such inputs; InputError where the cases do not have it."""
        kind, interval = options.kind, not _INTERVAL.isdisjoint(inputs)
        if kind == SPRING and not interval and not options.include:
            return _PLAIN
        names = options.include or ()
        include = tuple(name for name in INCLUDABLE if name in names)  # once, in order
        words = (*kind.names.values(), *(["k_range"] if interval else []))
        for word in words:
            for name in include:
                if why := INCLUDABLE[name].lacks.get(word):
                    raise InputError("include", name, f"without {name} for {word}: {why}")
        std = options.std.by_field if include and options.std is not None else {}
        cost = 1.0 + sum(INCLUDABLE[name].cost for name in include)
        if {"ball", "along"} <= {*words}:
            cost *= _BALL_ALONG
        cost *= math.prod(_COSTS.get(word, 1.0) for word in words)
        return cls(kind, interval, include, std, MODEL in names, cost)


_PLAIN = Plan()


def answer_case(surrogate: Surrogate, inputs: Mapping[str, Any], plan: Plan) -> tuple[Outputs, int]:
    """The answer to one case in plain numbers as JSON nests it, and the code of its source;
    InputError where the case is not legal."""
    if plan.include or plan.interval:
        outputs, codes = _answer(surrogate, inputs, plan)
        code = int(codes)
        outputs |= {"regime": REGIME_OF[code], "source": SOURCES[code]}
        values = nested(
            {path: x if isinstance(x, str) else float(x) for path, x in outputs.items()}
        )
    else:
        answer: Any = surrogate.evaluate(**inputs, **plan.kind.names)
        code = answer.source_code
        values = {
            "mu_macro": answer.mu_macro,
            "mu_ratio": answer.mu_ratio,
            "regime": REGIME_OF[code],
            "error_bound": answer.error_bound,
            "source": SOURCES[code],
        }
    if plan.model:  # rows of docs/validity.md, and the digits that k supports
        words = plan.kind.names
        values[MODEL] = model_rows(surrogate, inputs, **words)
        values["digits"] = digits(k_effect(surrogate, inputs, **words))
    return values, code


def answer_columns(
    surrogate: Surrogate, columns: Mapping[str, Any], plan: Plan
) -> tuple[Outputs, Codes]:
    """The outputs of many cases by path, and their source codes: NaN and -1 for a case that is not
    legal.  Regime and source are codes, too."""
    with np.errstate(all="ignore"):
        outputs, codes = _answer(surrogate, columns, plan)
    legal = codes >= 0
    for path, column in outputs.items():
        if path not in CODED:
            outputs[path] = np.where(legal, column, np.nan)
    return outputs, codes


def _answer(surrogate: Surrogate, columns: Mapping[str, Any], plan: Plan) -> tuple[Outputs, Any]:
    kind, include = plan.kind, plan.include
    slopes = any(INCLUDABLE[name].slopes for name in include)
    answer: Any = surrogate.evaluate(**columns, **kind.names, gradient=slopes, groups=bool(include))
    codes = answer.source_code
    outputs = {
        "mu_macro": answer.mu_macro,
        "mu_ratio": answer.mu_ratio,
        "regime": codes,
        "error_bound": answer.error_bound,
        "source": codes,
    }
    if plan.interval:
        outputs |= {"mu_macro_low": answer.mu_macro_low, "mu_macro_high": answer.mu_macro_high}
    if include:
        if plan.interval or "f" in columns:
            columns = Cases.of(by_name(None, columns, kind), kind).columns
        answered = Answered(surrogate, kind, columns, answer, plan.std)
        for name in include:
            outputs |= INCLUDABLE[name].compute(answered)
    return outputs, codes


def nested(outputs: Outputs) -> dict[str, Any]:
    """Outputs by path as JSON has them: ``power.saved`` becomes ``power: {saved: ...}``."""
    tree: dict[str, Any] = {}
    for path, value in outputs.items():
        name, _, member = path.partition(".")
        if member:
            tree.setdefault(name, {})[member] = value
        else:
            tree[name] = value
    return tree


def names_of(path: str, codes: Codes) -> list[str | None]:
    """The names of regimes or sources by source code; None for -1."""
    names = np.array((*(REGIME_OF if path == "regime" else SOURCES), None))
    return list(names[codes].tolist())


def listed(outputs: Outputs) -> dict[str, list[Any]]:
    """Outputs of many cases as JSON lists them; NaN is written as null."""
    return {path: names_of(path, x) if path in CODED else x.tolist() for path, x in outputs.items()}
