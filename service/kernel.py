"""The service's interface to the library: only this module uses internal parts of mumacro.

Routes, formats and quantities also import names of inputs, units, bounds and codes from here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate
from mumacro.charts import REGIME_OF_SOURCE, REGIMES, ROUNDING, SOURCES
from mumacro.inputs import BOUNDS as BOUNDS_OF_FIELDS
from mumacro.inputs import FIELDS, MOST_HZ, POSITIVE, RAD_PER_CYCLE, SI, scale_of, suggestion
from mumacro.inputs import NAMES as INPUTS

__all__ = [
    "BOUNDS", "FIELDS", "INPUTS", "MOST_HZ", "POSITIVE", "RAD_PER_CYCLE", "REGIMES", "REGIME_NAMES",
    "REGIME_OF_SOURCE", "ROUNDING", "SI", "SOURCES", "STATIC", "UNITS", "Array", "Details", "Kernel", "scale_of",
    "suggestion",
]  # fmt: skip

Array = NDArray[np.float64]
Codes = NDArray[np.int8]

#: what an input must be, and its unit: those of the six fields, and of f in place of omega
BOUNDS = {**BOUNDS_OF_FIELDS, "f": f"{BOUNDS_OF_FIELDS['omega']}, and so must be omega = 2 pi f"}
UNITS = {name: unit for name, (unit, _) in SI.items()}
#: name of the regime of every source code
REGIME_NAMES = tuple(REGIMES[code] for code in REGIME_OF_SOURCE)
STATIC = REGIMES.index("static")


@dataclass(frozen=True)
class Details:
    """Groups and slopes of n legal cases.

    Attributes
    ----------
    v_tilde, y_tilde : ndarray
        Dimensionless speed and amplitude [-], (n,).
    length_scale : ndarray
        l0 = mu0 Fz/k [m], (n,); 0 for rigid contact.
    gradient, gradient_bound : dict of str to ndarray
        d mu_macro / d input and the bound of its absolute error, (n,) by name of the input; empty if not requested.
        NaN: no such slope (k of rigid contact), or no bound in this table.
    """

    v_tilde: Array
    y_tilde: Array
    length_scale: Array
    gradient: dict[str, Array]
    gradient_bound: dict[str, Array]


class Kernel:
    """One table's evaluation."""

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate = surrogate

    def case(
        self, mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float
    ) -> tuple[float, float, float, int]:
        """(mu_macro, mu_macro/mu0, error_bound [-], source code) of one legal case; k = inf is rigid."""
        return self.surrogate.evaluate_case(mu0, Fz, k, y0, omega, v0)

    def columns(self, n: int, columns: Sequence[Array]) -> tuple[Array, Array, Array, Codes]:
        """(mu_macro, mu_ratio, error_bound [-], source code) of n cases in six columns of shape (n,) or (1,).

        Illegal cases give NaN and -1.  Runs on the calling thread without the interpreter's lock.
        """
        mu0, fz, k, y0, omega, v0 = columns
        return self.surrogate.evaluate_columns(mu0, fz, k, y0, omega, v0, n=n)

    def details(self, columns: Mapping[str, Array], gradient: bool) -> Details:
        """Groups and, if requested, slopes of legal cases; six columns (n,), k = inf is rigid."""
        one = columns["k"].size == 1  # the library answers plain floats ten times faster than arrays of one
        given: dict[str, Any] = {name: column.item() if one else column for name, column in columns.items()}
        answer = self.surrogate.evaluate(**given, gradient=gradient, groups=True)
        slopes, bounds = (
            {name: np.atleast_1d(slope) for name, slope in (found or {}).items()}
            for found in (answer.gradient, answer.gradient_bound)
        )
        if gradient:  # a rigid contact has no slope along k
            rigid = np.isinf(columns["k"])
            slopes["k"], bounds["k"] = (np.where(rigid, np.nan, part["k"]) for part in (slopes, bounds))
        v, y, length = (np.atleast_1d(group) for group in (answer.v_tilde, answer.y_tilde, answer.length_scale))
        return Details(v, y, length, slopes, bounds)

    @property
    def checksum(self) -> str:
        """Checksum of everything that answers depend on."""
        return self.surrogate.checksum

    @property
    def border_error(self) -> float:
        """Largest relative error of v~crit(y~) in this table [-]."""
        return float(self.surrogate.border.max_rel_error + ROUNDING)
