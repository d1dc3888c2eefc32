"""What functions take, for type checkers and in their signatures: numbers, an oscillation; one case
of ``evaluate``, one case with an interval of k, many."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal, Required, TypedDict

from numpy.typing import ArrayLike

from mumacro.inputs.kind import ContactName, DirectionName

if TYPE_CHECKING:
    Numbers = ArrayLike
    Oscillation = Any
else:  # a signature shows the name, in place of a union of twenty lines

    class Numbers:
        """A number in SI, a text with a unit such as "2um", a quantity, or an array of numbers."""

    class Oscillation:
        """An amplitude, a text such as "2um@90deg", (amplitude, phase in degrees), or a list of
        (harmonic, amplitude, phase): see :func:`mumacro.motion`."""


_Value = float | str  # a text is read as a person types it


class _Options(TypedDict, total=False):
    include: Iterable[str]
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
    std_mu0: _Value
    std_Fz: _Value
    std_k: _Value
    std_y0: _Value
    std_Fz_amplitude: _Value
    std_omega: _Value
    std_f: _Value
    std_v0: _Value


class OneCase(_One):
    """One case."""

    k: _Value


class OneInterval(_One):
    """One case whose k is an interval."""

    k_low: Required[_Value]
    k_high: Required[_Value]


class ManyCases(_Options, total=False):
    """Cases as arrays, or names that stand beside a mapping."""

    mu0: ArrayLike
    Fz: ArrayLike
    k: ArrayLike
    k_low: ArrayLike
    k_high: ArrayLike
    y0: ArrayLike
    Fz_amplitude: ArrayLike
    omega: ArrayLike | None
    f: ArrayLike | None
    v0: ArrayLike
    contact: ArrayLike
    direction: ArrayLike
    std_mu0: ArrayLike
    std_Fz: ArrayLike
    std_k: ArrayLike
    std_y0: ArrayLike
    std_Fz_amplitude: ArrayLike
    std_omega: ArrayLike
    std_f: ArrayLike
    std_v0: ArrayLike


class AnyCases(TypedDict, total=False):
    """The same of any type, such as labelled arrays or quantities with units."""

    mu0: Any
    Fz: Any
    k: Any
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
    std_mu0: Any
    std_Fz: Any
    std_k: Any
    std_y0: Any
    std_Fz_amplitude: Any
    std_omega: Any
    std_f: Any
    std_v0: Any
    gradient: bool
    illegal: str
