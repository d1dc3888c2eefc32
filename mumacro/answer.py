"""The result of the surrogate for one case or many."""

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic

import numpy as np

from mumacro import plotting
from mumacro.errors import MumacroError
from mumacro.table.atlas import REGIME_OF_SOURCE, REGIMES, SOURCES

#: float for one case; for many an array of float64, or a labelled object in its place
if TYPE_CHECKING:
    from typing_extensions import TypeVar

    Number = TypeVar("Number", default=Any)
else:
    from typing import TypeVar

    Number = TypeVar("Number")

# by code; the last entry is that of -1, an illegal case
_REGIME_NAMES = np.array([*REGIMES, ""], dtype=object)
_SOURCE_NAMES = np.array([*SOURCES, ""], dtype=object)
BAND = ("mu_macro_low", "mu_macro_high")  # of an interval of k
GROUPS = ("v_tilde", "y_tilde", "length_scale")
_REGIME_CODES = np.append(REGIME_OF_SOURCE, np.int8(-1))


class Answer(Generic[Number]):
    """Macroscopic friction with its bound; floats and strings for a scalar call, arrays of the
    broadcast shape else.

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
        d mu_macro / d input by field name, where requested; infinite for v0 at v0 = 0 on y~ = 1.
    gradient_bound : dict of str to float or ndarray, or None
        Verified bounds of the absolute errors of ``gradient``.

    Examples
    --------
    >>> from mumacro import Surrogate
    >>> a = Surrogate.open().evaluate(mu0=0.3, Fz=10, k=1e6, y0=2e-6, f=20e3, v0=0.01)
    >>> f"{a.mu_macro:.6f} {a.regime} {a.source}"
    '0.240467 stick_slip stick_slip_low'
    """

    __slots__ = (
        "_border",
        "_certain",
        "_groups",
        "_look_up",
        "error_bound",
        "gradient",
        "gradient_bound",
        "mu_macro",
        "mu_ratio",
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
        certain: Callable[[Any, Any], Any] | None = None,
        look_up: Callable[[str, Any, Any], Any] | None = None,
        border: Callable[..., Any] | None = None,
    ) -> None:
        self.mu_macro = mu_macro
        self.mu_ratio = mu_ratio
        self.error_bound = error_bound
        self.source_code = source_code
        self._groups = groups
        self._certain = certain
        self._look_up = look_up
        self._border = border  # v~crit(y~) of this kind of contact
        self.gradient = self.gradient_bound = None

    def _group(self, place: int) -> Number:
        if self._groups is None:
            raise AttributeError(f"{GROUPS[place]} was not requested: evaluate(..., groups=True)")
        return self._groups[place]

    @property
    def v_tilde(self) -> Number:
        """Dimensionless speed v0 k/(mu0 Fz omega) [-]; of arrays only where groups or the gradient
        were requested."""
        return self._group(0)

    @property
    def y_tilde(self) -> Number:
        """Dimensionless amplitude y0 k/(mu0 Fz), for direction normal Fz_amplitude/Fz [-]; as
        v_tilde."""
        return self._group(1)

    @property
    def length_scale(self) -> Number:
        """l0 = mu0 Fz / k [m], eq. (5); 0 for rigid contact; as v_tilde."""
        return self._group(2)

    def _by_source(self, name: str, table: Any) -> Any:
        """``table`` (sources + 1,) looked up at the source code; its last entry is that of -1."""
        if self._look_up is not None and not isinstance(self.source_code, int):
            return self._look_up(name, table, self.source_code)
        return table[self.source_code]

    @property
    def regime_code(self) -> Any:
        """Index into :data:`mumacro.REGIMES`: int, or ndarray of int8; -1 for an illegal case."""
        codes = self._by_source("regime_code", _REGIME_CODES)
        return int(codes) if isinstance(self.source_code, int) else codes

    @property
    def regime(self) -> Any:
        """One of :data:`mumacro.REGIMES`: str, or ndarray of shared str.

        ``"continuous"``, ``"stick_slip"``, ``"static"`` (v0 = 0); ``"partial_slip"`` where some
        springs of a ball slide continuously and others do not; ``"reverse_slip"`` where an
        oscillation along slides backwards, too.
        """
        return self._by_source("regime", _REGIME_NAMES[_REGIME_CODES])

    @property
    def regime_certain(self) -> Any:
        """Whether the regime is the same for every v~crit within its bound: bool or ndarray of
        bool; as v_tilde."""
        if self._certain is None:
            raise AttributeError("regime_certain needs the groups: evaluate(..., groups=True)")
        return self._certain(self.v_tilde, self.y_tilde)

    @property
    def source(self) -> Any:
        """Name of the block or closed form that gave the value: str, or ndarray of shared str, made
        on request."""
        return self._by_source("source", _SOURCE_NAMES)

    def plot(self, axes: Any = None) -> Any:
        """The cases over (v~, y~), see ``mumacro.plotting.plot_cases``; of arrays only where groups
        or the gradient were requested; needs matplotlib."""
        v, y, code = (
            np.ravel(np.asarray(x)) for x in (self.v_tilde, self.y_tilde, self.regime_code)
        )
        regimes = {name: code == i for i, name in enumerate(REGIMES)}
        return plotting.plot_cases(v, y, regimes, self._border, axes)

    def columns(self) -> dict[str, Any]:
        """The results of each case by name: mu_macro first, then those that were requested beside
        it."""
        names = [
            "mu_macro",
            *(name for name in BAND if hasattr(self, name)),
            "mu_ratio",
            "regime",
            "error_bound",
        ]
        names += ["source", *(GROUPS if self._groups is not None else ())]
        slopes = {f"d_mu_macro_d_{name}": slope for name, slope in (self.gradient or {}).items()}
        return {**{name: getattr(self, name) for name in names}, **slopes}

    def to_frame(self) -> Any:
        """The columns as a DataFrame of pandas, one row a case, in the order of ``ravel``;
        MumacroError without pandas.

        >>> from mumacro import Surrogate
        >>> case = dict(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, f=20e3)
        >>> answer = Surrogate.open().evaluate(**case, v0=np.array([0.0, 0.01]))
        >>> answer.to_frame()["regime"].tolist()
        ['static', 'stick_slip']
        """
        try:
            import pandas
        except ModuleNotFoundError:
            raise MumacroError("pandas is not installed: pip install pandas") from None
        columns = self.columns().items()
        return pandas.DataFrame(
            {
                name: x if hasattr(x, "index") and hasattr(x, "dtype") else np.ravel(x)
                for name, x in columns
            }
        )

    def __repr__(self) -> str:
        names = ["mu_macro", "mu_ratio", "error_bound", "regime", "source"]
        names += [name for name in BAND if hasattr(self, name)]
        names += GROUPS if self._groups is not None else ()
        names += ["gradient", "gradient_bound"] if self.gradient is not None else []
        values = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"{type(self).__name__}({values})"


class AnswerWithGradient(Answer[Number]):
    """An answer with the slopes by input, see :class:`Answer`."""

    __slots__ = ()

    gradient: dict[str, Number]
    gradient_bound: dict[str, Number]


class IntervalAnswer(AnswerWithGradient[Number]):
    """An answer for an interval of stiffnesses: mu_macro and all beside it at the geometric middle.

    Attributes
    ----------
    mu_macro_low, mu_macro_high : float or ndarray
        Smallest and largest mu_macro over the interval [-]; ``error_bound`` holds for them, too.
    """

    __slots__ = BAND

    mu_macro_low: Number
    mu_macro_high: Number


def single(answer: Answer[Any]) -> Answer[float]:
    """The answer of one case that an answer of arrays with one element holds."""
    out = copy.copy(answer)
    for name in ("mu_macro", "mu_ratio", "error_bound", *BAND):
        if hasattr(out, name):
            setattr(out, name, getattr(out, name).item())
    out.source_code = int(out.source_code.item())
    if out._groups is not None:
        v, y, length = out._groups
        out._groups = v.item(), y.item(), length.item()
    for name in ("gradient", "gradient_bound"):
        if (slopes := getattr(out, name)) is not None:
            setattr(out, name, {field: slope.item() for field, slope in slopes.items()})
    return out
