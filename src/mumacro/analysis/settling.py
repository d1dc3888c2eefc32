"""How many periods until a disturbed contact is steady again; the physics is in
:mod:`mumacro.outputs.settling`."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import ABSENT, Cases, named
from mumacro.inputs.kind import kind_of
from mumacro.inputs.reading import NO_DEVIATION
from mumacro.outputs.evaluated import Evaluated
from mumacro.outputs.settling import REMAINING, decay
from mumacro.shown import frame_of, html_of, members_of, text_of
from mumacro.surrogate import Surrogate


@dataclass(frozen=True, repr=False)
class Settling:
    """How fast a disturbance decays; floats for scalar inputs, arrays of the broadcast shape
    otherwise."""

    #: periods [-] until a small disturbance has fallen to ``remaining``
    periods: Any
    #: periods [-] after which any disturbance has, whatever its size
    periods_any: Any
    time: Any  #: ``periods`` in seconds; finite without oscillation, too
    #: path of the foot per period [l0], of a ball that of its middle spring [1.5 l0]; in
    #: continuous sliding exp(-slip_path) is the multiplier of a small disturbance per period, in
    #: stick-slip it is smaller
    slip_path: Any
    error_bound: Any  #: bound of the error of ``periods`` that comes from the table [-]

    @property
    def columns(self) -> dict[str, Any]:
        """The numbers by name, each in the shape of the cases."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def to_dict(self) -> dict[str, Any]:
        """The numbers by name: arrays as lists, None where one is not finite."""
        return members_of(self.columns)

    def to_frame(self) -> Any:
        """The numbers as a DataFrame of pandas, one row a case."""
        return frame_of(self.columns)

    def __repr__(self) -> str:
        if shape := np.shape(self.periods):
            return text_of(f"<Settling of cases of shape {shape}>", self.columns)
        return f"<Settling: {self.periods:.6g} periods, {self.time:.6g} s>"

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        return html_of("<Settling>", self.columns)


@np.errstate(all="ignore")
def settling(
    surrogate: Surrogate,
    *,
    mu0: Any = ABSENT,
    Fz: Any = ABSENT,
    k: Any = ABSENT,
    y0: Any = ABSENT,
    v0: Any = ABSENT,
    omega: Any = None,
    f: Any = None,
    remaining: float = REMAINING,
    contact: str = "spring",
    direction: str = "across",
) -> Settling:
    """Periods until a disturbance of the contact has decayed to ``remaining`` of its size.

    Parameters
    ----------
    surrogate : Surrogate
    mu0, Fz, k, y0, v0, omega or f : array_like
        The case [-, N, N/m, m, m/s, rad/s or Hz], as in :meth:`mumacro.Surrogate.evaluate`.
    remaining : float
        Share of the disturbance that is left [-], 0 < remaining < 1.
    contact : str
        "spring"; or "ball", for which the periods are those of its slowest spring.
    direction : str
        "across" only, else InputError: the decay is not derived for the other directions.

    Returns
    -------
    Settling
        Infinite where nothing slips (v0 = 0 with y~ <= 1, or with omega = 0): a disturbance stays.
        Zero for rigid contact, whose friction follows at once.  NaN at an illegal case of an array.

    Notes
    -----
    The force averaged over period n differs from the steady one by at most mu0 Fz abs(d) of that
    period.  Source: this project; the paper (Sec. 8) names the kinetics as open.

    Examples
    --------
    >>> from mumacro import Surrogate
    >>> s = Surrogate.open("tables/mumacro-1e-10.nc")
    >>> result = settling(s, mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, f=20e3, v0=0.01)
    >>> round(result.periods, 2), round(result.slip_path, 3)
    (1.75, 0.208)
    """
    if not 0.0 < remaining < 1.0:
        raise InputError("remaining", remaining, "> 0 and < 1")
    kind = kind_of(contact, direction)
    if kind.direction:
        raise InputError(
            "direction", direction, "across: how a disturbance decays is derived for no other"
        )
    case = {"mu0": mu0, "Fz": Fz, "k": k, "y0": y0, "omega": omega, "f": f, "v0": v0}
    present = {
        name: value
        for name, value in case.items()
        if value is not ABSENT and (value is not None or name == "k")
    }
    cases = Cases.of(named(None, present), kind)
    for name in cases.std:
        raise InputError(name, case[name], NO_DEVIATION)
    values = decay(Evaluated(surrogate.tabulated, cases, "groups"), remaining)
    return Settling(*(x.reshape(cases.shape) if cases.shape else x for x in values))
