"""What the classes for JAX and PyTorch share: the quantities by name, open tables, mu_macro as a function of groups."""

import math
from collections.abc import Callable, Sequence
from threading import Lock
from typing import Any

from mumacro.surrogate import Surrogate

NO_THIRD = "third derivatives are not tabulated: take differences of the second ones"
_OPENING = Lock()


class DifferentiableFriction:
    """The quantities of a table as functions of tensors.

    Parameters
    ----------
    surrogate : Surrogate, optional
        The table; left out, the tightest one that comes with the library.

    Notes
    -----
    Arguments, tensors or numbers, broadcast together; results are float64 of the broadcast shape, NaN where a case is
    illegal.  The table is evaluated on the host.  First derivatives are those of the table, second ones differences of
    them: right to 1e-5 of the largest one with the tables 1e-12 and 1e-10, to 1e-2 with 1e-7; NaN at v~ = 0, and for
    mu_macro where v~ or y~ is zero or infinite.  Third ones raise NotImplementedError.
    """

    def __init__(self, surrogate: Surrogate | None = None) -> None:
        opened = Surrogate.open() if surrogate is None else surrogate
        #: the number by which compiled programs, which may outlive this object, find the table: from its checksum
        self._table = int(opened.checksum[:15], 16)
        with _OPENING:
            self._open(self._table, opened)

    #: keeps a table for programs, if it is not kept yet: (number, surrogate)
    _open: Callable[[int, Surrogate], None]
    _call: Callable[..., Any]

    def mu_macro(self, mu0: Any, Fz: Any, k: Any, y0: Any, omega: Any, v0: Any) -> Any:
        """mu_macro [-] from SI inputs, see :meth:`mumacro.Surrogate.evaluate`; k None or inf is rigid contact."""
        return self._call("mu_macro", mu0, Fz, math.inf if k is None else k, y0, omega, v0)

    def mu_ratio(self, v_tilde: Any, y_tilde: Any) -> Any:
        """mu~ = mu_macro/mu0 [-], see :meth:`mumacro.Surrogate.mu_ratio`."""
        return self._call("mu_ratio", v_tilde, y_tilde)

    def power(self, v_tilde: Any, y_tilde: Any) -> Any:
        """Mean power of the shaker [-], see :meth:`mumacro.Surrogate.power`."""
        return self._call("power", v_tilde, y_tilde)

    def stick_fraction(self, v_tilde: Any, y_tilde: Any) -> Any:
        """Share of the period that sticks [-], see :meth:`mumacro.Surrogate.stick_fraction`."""
        return self._call("stick_fraction", v_tilde, y_tilde)


def slopes_by_groups(value: Callable[..., Any], slopes: Callable[..., Any], six: Sequence[Any]) -> tuple[Any, ...]:
    """d mu_macro / d input by the chain rule, from mu~ and its slopes as functions of v~ and y~, eqs. (6) and (8).

    Differentiated once more it gives the second derivatives of mu_macro.
    """
    mu0, Fz, k, y0, omega, v0 = six
    v, y = v0 * k / (mu0 * Fz * omega), y0 * k / (mu0 * Fz)
    by_v, by_y = slopes(v, y)
    along_v, along_y = v * by_v, y * by_y
    both = along_v + along_y
    return (
        value(v, y) - both, -mu0 * both / Fz, mu0 * both / k, mu0 * along_y / y0, -mu0 * along_v / omega,
        mu0 * along_v / v0,
    )  # fmt: skip
