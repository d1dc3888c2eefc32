"""Hold the result of the surrogate for one case or many."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Generic

import numpy as np

from mumacro import plotting
from mumacro.inputs.cases import Cases
from mumacro.inputs.doubts import remarks as doubts
from mumacro.inputs.fields import AMPLITUDE, Kind
from mumacro.results import Note, Result, Rows, cell
from mumacro.table.atlas import REGIME_OF_SOURCE, REGIMES, SOURCES

#: a float for one case, an array of float64 for many
if TYPE_CHECKING:
    from typing_extensions import TypeVar

    Number = TypeVar("Number", default=Any)
else:
    from typing import TypeVar

    Number = TypeVar("Number")

# by source code; the last entry is for -1, an illegal case
_SOURCE_NAMES = np.array([*SOURCES, ""], dtype=object)
BAND = ("mu_macro_low", "mu_macro_high")  # for an interval of k, and for deviations
GROUPS = ("v_tilde", "y_tilde", "length_scale")
#: the paths of the default answer
DEFAULT = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
TEXTS = ("regime", "source")
_REGIME_CODES = np.append(REGIME_OF_SOURCE, np.int8(-1))
_REGIME_NAMES = np.array([*REGIMES, ""], dtype=object)[_REGIME_CODES]


class Answer(Result, Generic[Number]):
    """Hold macroscopic friction with its bound: floats and texts for one case, otherwise arrays of
    the broadcast shape.

    ``answer["power.saved"]`` is an output by the path that it has in the JSON of one case: an
    output of the default answer, or one that ``include`` asked for.

    Attributes
    ----------
    mu_macro : float or ndarray
        Macroscopic friction coefficient [-]; NaN at an illegal case of an array.
    mu_ratio : float or ndarray
        mu_macro / mu0 [-].
    error_bound : float or ndarray
        Verified bound of the absolute error of ``mu_macro`` [-].
    source_code : int or ndarray of int8
        Block or closed form that gave the value, index into :data:`mumacro.SOURCES`; -1 for an
        illegal case.
    gradient : dict of str to float or ndarray, or None
        d mu_macro / d input by field name, if requested; infinite for v0 at v0 = 0 on y~ = 1, 0 for
        k if the contact is rigid.
    gradient_bound : dict of str to float or ndarray, or None
        Verified bounds of the absolute errors of ``gradient``.
    mu_macro_low, mu_macro_high : float or ndarray
        Only for an interval of k: smallest and largest mu_macro over it [-]; all other values are
        for its geometric middle, and ``error_bound`` holds for these two as well.  For deviations
        of inputs: mu_macro one deviation up and down.
    outputs : dict of str to float or ndarray
        The outputs that ``include`` asked for, and those of an interval or of deviations, by path
        [SI]; NaN at an illegal case of an array, and where the output does not exist.

    Examples
    --------
    >>> from mumacro import Surrogate
    >>> a = Surrogate.open().evaluate(
    ...     mu0=0.3, Fz=10, k=1e6, y0=2e-6, f=20e3, v0=0.01, include=("power",)
    ... )
    >>> f"{a.mu_macro:.6f} {a.regime} {a.source}"
    '0.240467 stick_slip stick_slip_low'
    >>> f"{a['power.oscillation']:.5f} W"
    '0.01340 W'
    """

    __slots__ = (
        "_cases",
        "_groups",
        "_plain",
        "_surrogate",
        "error_bound",
        "gradient",
        "gradient_bound",
        "mu_macro",
        "mu_ratio",
        "notes_on_outputs",
        "outputs",
        "source_code",
    )

    gradient: dict[str, Number] | None
    gradient_bound: dict[str, Number] | None

    def __init__(
        self,
        mu_macro: Number,
        mu_ratio: Number,
        error_bound: Number,
        source_code: Any,
        groups: tuple[Number, Number, Number] | None = None,
        cases: Any = None,
        surrogate: Any = None,
    ) -> None:
        self.mu_macro = mu_macro
        self.mu_ratio = mu_ratio
        self.error_bound = error_bound
        self.source_code = source_code
        self._groups = groups
        self._cases: Cases | None = cases
        #: instead of cases, which are made when they are looked at: contact and direction, the
        #: names of the six inputs, and the inputs as numbers or arrays of doubles
        self._plain: tuple[Kind, tuple[str, ...], tuple[Any, ...]]
        self._surrogate = surrogate
        self.gradient = self.gradient_bound = None
        self.outputs: Mapping[str, Any] = _NOTHING
        #: where an output is missing or doubtful
        self.notes_on_outputs: list[Note] = []

    # --- by name ----------------------------------------------------------------------------------

    def __getattr__(self, name: str) -> Any:
        """Return an end of the band.  Raise AttributeError that says how to ask for an output of
        another name."""
        if name in BAND:
            if name in self.outputs:
                return self.outputs[name]
            ask = "an interval of k, evaluate(k_low=, k_high=), or deviations, evaluate(std_k=)"
            raise AttributeError(f"{name} is there for {ask}")
        if hasattr(type(self), name):  # a property without a value gives its own reason
            return object.__getattribute__(self, name)
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no {name}")
        asked = any(path.partition(".")[0] == name for path in self.outputs)
        ask = "" if asked else f'evaluate(..., include=("{name}",)), then '
        raise AttributeError(f'{name} is no attribute; an output is {ask}answer["{name}"]')

    def _group(self, place: int) -> Number:
        if self._groups is None:
            raise AttributeError(
                f'{GROUPS[place]} was not requested: evaluate(..., include="groups")'
            )
        return self._groups[place]

    @property
    def v_tilde(self) -> Number:
        """Return the dimensionless speed v0 k/(mu0 Fz omega) [-]; for arrays only if groups or the
        gradient were requested."""
        return self._group(0)

    @property
    def y_tilde(self) -> Number:
        """Return the dimensionless amplitude y0 k/(mu0 Fz), for direction normal Fz_amplitude/Fz
        [-]; for arrays as v_tilde."""
        return self._group(1)

    @property
    def length_scale(self) -> Number:
        """Return l0 = mu0 Fz / k [m], eq. (5); 0 for a rigid contact; for arrays as v_tilde."""
        return self._group(2)

    @property
    def regime_code(self) -> Any:
        """Return the index into :data:`mumacro.REGIMES`: int, or ndarray of int8; -1 for an illegal
        case."""
        codes: Any = _REGIME_CODES[self.source_code]
        return int(codes) if isinstance(self.source_code, int) else codes

    @property
    def regime(self) -> Any:
        """Return one of :data:`mumacro.REGIMES`: str, or ndarray of shared str.

        ``"continuous"``, ``"stick_slip"``, ``"static"`` (v0 = 0); ``"partial_slip"`` if some
        springs of a ball slide continuously and others do not; ``"reverse_slip"`` if an oscillation
        along also slides backwards.
        """
        return _REGIME_NAMES[self.source_code]

    @property
    def source(self) -> Any:
        """Return the name of the block or closed form that gave the value: str, or ndarray of
        shared str.  It is made on request."""
        return _SOURCE_NAMES[self.source_code]

    @property
    def regime_certain(self) -> Any:
        """Return whether the regime is the same for every v~crit within its bound: bool or ndarray
        of bool; for arrays as v_tilde."""
        if self._groups is None:
            raise AttributeError('regime_certain needs the groups: evaluate(..., include="groups")')
        certain = self._surrogate.tabulated.certain(*self._groups[:2], self.cases.kind)
        return certain if self._shape else bool(certain)

    @property
    def paths(self) -> list[str]:
        """Return the paths of all outputs, in the order of the JSON of one case."""
        return [*DEFAULT, *self.outputs]

    def __getitem__(self, path: str) -> Any:
        """Return an output by its path.  Raise KeyError with the remedy for an output that was not
        asked for."""
        if path in self.outputs:
            return self.outputs[path]
        if path in DEFAULT:
            return getattr(self, path)
        within = {
            name.removeprefix(f"{path}."): x
            for name, x in self.outputs.items()
            if name.startswith(f"{path}.")
        }
        if not within:
            raise KeyError(f"{path}: there is {', '.join(self.paths)}; more with include=(...)")
        return within

    # --- what was asked ---------------------------------------------------------------------------

    @property
    def cases(self) -> Cases:
        """Return the cases that were evaluated."""
        if self._cases is None:
            kind, names, six = self._plain
            if self._shape:
                self._cases = Cases.of(dict(zip(names, six, strict=True)), kind)
            else:
                self._cases = Cases.of_numbers(names, six, kind)
        return self._cases

    @property
    def notes(self) -> list[Note]:
        """Return the remarks on the cases, and on outputs that are missing or doubtful.  For one
        case, ``mumacro.validity.notes_of`` also has what the model leaves out."""
        return self.notes_in({})

    def notes_in(self, units: Mapping[str, str]) -> list[Note]:
        """Return :attr:`notes` with values in the units that were typed; ``units`` has the unit of
        each input."""
        cases = self.cases
        on_inputs = doubts(cases.columns, cases.f is not None, {**cases.units, **units})
        return [*on_inputs, *self.notes_on_outputs]

    # --- other forms ------------------------------------------------------------------------------

    def plot(self, ax: Any = None) -> Any:
        """Draw the cases on the map of mu~ of their contact and direction, by regime, with the
        border of continuous sliding.  Matplotlib is needed.

        A rigid contact, or any other case outside the map, is drawn at its edge with a word that
        says why.  An interval of k is a line through its middle.  ``ax`` are matplotlib axes, or
        None for new ones.  They are returned.
        """
        kind = self.cases.kind
        title = ", ".join(kind.names.values()) if self.cases.shape else self._title()
        return self._surrogate.draw_map(ax, kind, title, marks=self._on_map())

    def _title(self) -> str:
        """Return the answer to one case with the digits of a picture, and the case."""
        cases, case = self.cases, dict[str, Any](self.cases.columns)
        if cases.ends is not None:
            case["k"] = [*cases.ends]
        low, high = (getattr(self, name, None) for name in BAND)
        band = "" if low is None or high is None else f" ({low:.4g} to {high:.4g})"
        words = plotting.case_title(case, cases.kind.names)
        return rf"$\mu_\mathrm{{macro}}$ = {self.mu_macro:.4g}{band}; {words}"

    def _on_map(self) -> plotting.Marks:
        """Return the cases as marks of the map."""
        cases = self.cases
        groups = self._groups or self._surrogate.answer(cases, groups=True)._groups
        v, y = (np.ravel(np.asarray(x, np.float64)) for x in groups[:2])
        ends = None
        if cases.ends is not None:
            k = np.broadcast_to(cases.columns["k"], v.size)
            with np.errstate(all="ignore"):
                low, high = (np.broadcast_to(np.ravel(end), v.size) / k for end in cases.ends)
            ends = low, high
        amplitude = cases.kind.amplitude
        return plotting.Marks(
            v,
            y,
            _ray(cases.columns, amplitude, v.size),
            np.ravel(np.asarray(self.regime, object)),
            _edge_words(cases.columns, amplitude, v, y),
            ends,
        )

    @property
    def columns(self) -> dict[str, Any]:
        """Return the outputs by path, in the shape of the cases; for a frame one row for each case,
        in the order of ``ravel``.

        >>> from mumacro import Surrogate
        >>> case = dict(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, f=20e3)
        >>> answer = Surrogate.open().evaluate(**case, v0=np.array([0.0, 0.01]))
        >>> answer.to_frame()["regime"].tolist()
        ['static', 'stick_slip']
        """
        return {**{path: getattr(self, path) for path in DEFAULT}, **self.outputs}

    def _members(self) -> dict[str, Any]:
        """Return the JSON of one case: ``power.saved`` is ``saved`` within ``power``.

        >>> from mumacro import Surrogate
        >>> case = dict(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, f=20e3, v0=0.01)
        >>> [*Surrogate.open().evaluate(**case, include=("groups",)).to_dict()]
        ['mu_macro', 'mu_ratio', 'regime', 'error_bound', 'source', 'groups']
        """
        members = {path: getattr(self, path) for path in DEFAULT}
        if self.outputs:
            members |= nested(self.outputs)
        if said := self.remarks:
            members["remarks"] = said
        return members

    def _kind_words(self) -> str:
        return f": {', '.join(self.cases.kind.names.values())}"

    def _heading(self) -> str:
        shape = self._shape
        cases = f"{math.prod(shape)} cases of shape {shape}" if shape else "one case"
        return f"<{type(self).__name__} to {cases}{self._kind_words()}>"

    @property
    def _shape(self) -> tuple[int, ...]:
        mu: Any = self.mu_macro
        return np.shape(mu)

    def _is_one(self) -> bool:
        return not self._shape

    def _rows(self) -> Rows | None:
        return [(path, cell(x)) for path, x in self.columns.items()] if self._is_one() else None

    def _in_full(self) -> tuple[str, Rows | None, list[str]]:
        """Return what the command prints for one case."""
        if not self._is_one():
            return super()._in_full()
        rows, notes, error = self._surrogate.in_words(self)
        return "", rows, [*map(" ".join, notes), error]


_NOTHING: dict[str, Any] = {}


def _ray(columns: Mapping[str, Any], amplitude: str, size: int) -> Any:
    """Return y0 omega / v0, (size,), which is y~/v~, also for a rigid contact."""
    with np.errstate(all="ignore"):
        ratio = columns[amplitude] * np.asarray(columns["omega"]) / columns["v0"]
    return np.broadcast_to(ratio, size)


def _edge_words(columns: Mapping[str, Any], amplitude: str, v: Any, y: Any) -> Any:
    """Return why cases (n,) are at the edge of the map; empty texts for cases on the map."""
    with np.errstate(invalid="ignore"):
        at_v, at_y = plotting.on_map(v, y, np.ones_like(v), amplitude == AMPLITUDE)
        beyond = (at_v != v) | (at_y != y)
    words = np.where(beyond, "beyond the map", "").astype(object)
    for name, value, word in (
        ("v0", 0.0, "$v_0$ = 0"),
        ("omega", 0.0, "not shaken"),
        (amplitude, 0.0, "not shaken"),
        ("k", math.inf, "rigid"),
    ):
        words[beyond & np.broadcast_to(columns[name] == value, v.shape)] = word
    return words


if TYPE_CHECKING:

    class AnswerWithGradient(Answer[Number]):
        """Show a type checker an answer that has derivatives."""

        gradient: dict[str, Number]
        gradient_bound: dict[str, Number]

    class IntervalAnswer(AnswerWithGradient[Number]):
        """Show a type checker an answer over an interval of k, or with deviations."""

        mu_macro_low: Number
        mu_macro_high: Number


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by path in the nested form of JSON.

    >>> nested({"mu_macro": 0.2, "power.saved": 1.0, "power.oscillation": 2.0})
    {'mu_macro': 0.2, 'power': {'saved': 1.0, 'oscillation': 2.0}}
    """
    tree: dict[str, Any] = {}
    for path, value in values.items():
        name, _, member = path.partition(".")
        if member:
            tree.setdefault(name, {})[member] = value
        else:
            tree[name] = value
    return tree
