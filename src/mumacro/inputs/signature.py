"""What functions take, for type checkers and in their signatures: numbers, an oscillation; one case
of ``evaluate``, one case with an interval of k, many."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Literal, Required, TypedDict

from numpy.typing import ArrayLike

from mumacro.inputs.kind import ContactName, DirectionName

if TYPE_CHECKING:
    Numbers = ArrayLike
    Oscillation = Any
else:  # a signature shows the name, in place of a union of twenty lines

    class Numbers:
        """A number in SI, a text with a unit such as "2um", a quantity, or an array of these."""

    class Oscillation:
        """An amplitude, a text such as "2um@90deg", (amplitude, phase in degrees), or a list of
        (harmonic, amplitude, phase): see :func:`mumacro.motion`."""


_Value = float | str  # a text is read as a person types it


class _Options(TypedDict, total=False):
    include: Iterable[str]
    std: Mapping[str, Any] | None
    groups: bool
    illegal: Literal["nan", "raise"]


class _One(_Options, total=False):
    mu0: Required[_Value]
    Fz: Required[_Value]
    y0: _Value
    Fz_amplitude: _Value
    omega: _Value
    f: _Value
    v0: Required[_Value]
    contact: ContactName
    direction: DirectionName


class OneCase(_One):
    """One case."""

    k: _Value


class OneInterval(_One):
    """One case whose k is an interval."""

    k_range: tuple[float, float]


class ManyCases(_Options, total=False):
    """Cases as arrays, or names that stand beside a mapping."""

    mu0: ArrayLike
    Fz: ArrayLike
    k: ArrayLike
    k_range: ArrayLike
    k_low: ArrayLike
    k_high: ArrayLike
    y0: ArrayLike
    Fz_amplitude: ArrayLike
    omega: ArrayLike | None
    f: ArrayLike | None
    v0: ArrayLike
    contact: ArrayLike
    direction: ArrayLike


class AnyCases(TypedDict, total=False):
    """The same of any type, such as labelled arrays or quantities with units."""

    mu0: Any
    Fz: Any
    k: Any
    k_range: Any
    k_low: Any
    k_high: Any
    y0: Any
    Fz_amplitude: Any
    omega: Any
    f: Any
    v0: Any
    contact: Any
    direction: Any
    include: Any
    std: Any
    gradient: bool
    groups: bool
    illegal: str
