"""Simulate the contact in the time domain: for programs with dynamics, soft drives, any motion of
the upper point.

A step is a straight line, and the normal force changes along it linearly.  Then the force after the
step has a closed form, eqs. (9) to (12): the spring sticks up to the limit mu0 Fz, and from there
the angle psi between force and motion falls by tan(psi/2) -> tan(psi/2) exp(-k s/(mu0 Fz)) over the
path s.  So only a curved motion needs small steps.  A ball is many independent springs by the
method of dimensionality reduction.  Their limits are 3/2 (1 - xi^2) times the mean limit, with xi =
0 (middle) to 1 (rim).  The kernel computes the steps, ``mumacro/kernel/element.c``; in C they are
``mumacro_element_step``.

References
----------
V. L. Popov, M. Hess, "Method of Dimensionality Reduction in Contact Mechanics and Friction",
Springer (2015).
"""

import math
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import check, real
from mumacro.inputs.fields import Numbers, kind_of
from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels

SPRINGS, MOST_SPRINGS = 32, 100_000  # number of springs of a ball: default and largest
_ROUNDED = 1e-12  # a state may be this much beyond its limit, relatively
_KERNEL = kernels[-1]


class Element:
    """Move one contact, or an array of contacts, step by step.

    Parameters
    ----------
    mu0 : array_like
        Coulomb friction coefficient of the contact [-], > 0.
    Fz : array_like
        Normal force [N], > 0.
    k : array_like
        Tangential stiffness of the contact [N/m], finite and > 0; for a ball the stiffness of full
        stick, 8 a G*.
    contact : str
        "spring", or "ball" under a constant normal force.
    springs : int, optional
        Springs of a ball, 32 by default, up to 100,000.  The mean friction of 32 springs differs
        from the ball's by at most 1.1e-3 mu0 (at very slow drag), by 1e-6 mu0 in the median; with
        128 springs by 6.3e-5 and 7e-8.

    Raises
    ------
    InputError
        If a value is out of bounds, shapes do not broadcast, the contact is unknown, or a "spring"
        has more than one spring.

    Notes
    -----
    Straight steps are exact.  The error of a curved motion falls with the square of the number n of
    steps in a period, and grows with the square root of large amplitudes.  Mean forces are within
    max(6, 2 sqrt(y0 k/(mu0 Fz)))/n^2 of mu0 Fz for all of 4,000 random sines across (v~ from 0.03
    to 30, amplitudes up to 3e4 mu0 Fz/k).  400 steps give 4e-5 up to an amplitude of 9 mu0 Fz/k,
    and 1.3e-4 at 100.

    Examples
    --------
    Pulled by 1 um against 3 um that it can stretch, then far away:

    >>> contact = Element(mu0=0.3, Fz=10.0, k=1e6)
    >>> contact.step(1e-6, 0.0)
    (1.0, 0.0)
    >>> contact.step(1.0, 0.0)
    (3.0, 0.0)
    """

    def __init__(
        self,
        mu0: Numbers,
        Fz: Numbers,
        k: Numbers,
        contact: str = "spring",
        springs: int | None = None,
    ) -> None:
        usual, most = (SPRINGS, MOST_SPRINGS) if kind_of(contact).contact else (1, 1)
        springs = usual if springs is None else springs
        if not (type(springs) is int and 1 <= springs <= most):
            raise InputError(
                "springs", springs, f"a whole number from 1 to {most} for contact={contact!r}"
            )
        columns = {"mu0": real("mu0", mu0), "Fz": real("Fz", Fz), "k": real("k", k)}
        check(columns)
        if np.isinf(columns["k"]).any():
            raise InputError(
                "k", math.inf, "finite: a rigid contact has no elongation that could be stepped"
            )
        try:
            mu0_, Fz_, k_ = np.broadcast_arrays(*columns.values())
        except ValueError as error:
            shapes = {name: column.shape for name, column in columns.items()}
            raise InputError("inputs", shapes, "arrays whose shapes broadcast together") from error
        self.contact, self.springs, self.shape = contact, springs, k_.shape
        self._mu0, self._k = mu0_.ravel(), k_.ravel()
        self._limit = self._limits(Fz_)
        self._forces = np.zeros((self._k.size, springs, 2))

    def step(self, dx: Numbers, dy: Numbers, Fz: Numbers | None = None) -> tuple[Any, Any]:
        """Move the upper point, and return the force that holds it there.

        Parameters
        ----------
        dx, dy : array_like
            The motion during this step [m], finite, of the contacts' shape or broadcast to it.
        Fz : array_like, optional
            The normal force at the end of this step [N], finite and >= 0; it keeps this value until
            it is given again.  It changes linearly along the step.  At 0 the contact is open and
            its force zero.  Only for one spring: the radius of a ball would change with it.

        Returns
        -------
        Fx, Fy : float, or ndarray of the contacts' shape
            Force after the step [N]; Fx > 0 if the contact is dragged along x.  If InputError is
            raised, nothing has moved.

        Examples
        --------
        The mean over a period is mu_macro Fz; the table has 2.7246 N for this case:

        >>> contact, omega, n = Element(mu0=0.3, Fz=10.0, k=1e6), 1.3e5, 200
        >>> dt = 2 * np.pi / omega / n
        >>> dy = 2e-6 * np.diff(np.sin(omega * dt * np.arange(n + 1)))
        >>> periods = [[contact.step(0.1 * dt, float(way))[0] for way in dy] for _ in range(5)]
        >>> f"{np.mean(periods[-1]):.4f}"
        '2.7246'
        """
        limit = self._limit
        if Fz is not None:
            if self.contact != "spring":
                raise InputError(
                    "Fz", Fz, "left out for a ball, whose contact radius would change with it"
                )
            limit = self._limits(self._per_contact(Fz, "Fz"))
        along, across = self._per_contact(dx, "dx"), self._per_contact(dy, "dy")
        before, self._limit, sums = self._limit, limit, np.empty((self._k.size, 2))
        _KERNEL.element_steps(before, limit, self._k, along, across, self._forces, sums)
        return self._pair(sums)

    @property
    def force(self) -> tuple[Any, Any]:
        """Return Fx and Fy [N] after the last step."""
        return self._pair(self._forces.sum(axis=1))

    @property
    def state(self) -> Array:
        """Return the forces of the springs [N], a copy of shape ``(*contacts, springs, 2)``.  It
        can be assigned; no force may be beyond the limit of its spring."""
        return self._forces.reshape(*self.shape, self.springs, 2).copy()

    @state.setter
    def state(self, forces: Numbers) -> None:
        array, shape = real("state", forces), (*self.shape, self.springs, 2)
        if array.shape != shape:
            raise InputError("state", array.shape, f"of the shape {shape}")
        if not np.isfinite(array).all():
            raise InputError("state", forces, "finite")
        array = array.reshape(self._forces.shape)
        size, limit = np.hypot(array[..., 0], array[..., 1]), self._limits_of_springs()
        beyond = np.argwhere(size > limit * (1.0 + _ROUNDED))
        if beyond.size:
            index, spring = beyond[0]
            bound = f"at most the limit of its spring, {limit[index, spring]:.6g} N"
            raise InputError("state", float(size[index, spring]), bound, int(index))
        self._forces = array.copy()

    def __repr__(self) -> str:
        springs = f", {self.springs} springs" if self.contact == "ball" else ""
        if self.shape:
            contacts = f"{self._k.size} contacts of shape {self.shape}"
            return f"<Element {self.contact}{springs}, {contacts}>"
        return f"<Element {self.contact}{springs}, force {self.force}>"

    def _limits(self, Fz: Array) -> Array:
        """Return mu0 Fz [N] of every contact."""
        flat = Fz.reshape(-1)
        with np.errstate(over="ignore"):
            limit = self._mu0 * flat
        bad = ~((flat >= 0.0) & np.isfinite(limit))
        if bad.any():
            index = int(np.flatnonzero(bad)[0])
            raise InputError(
                "Fz", float(flat[index]), "finite and >= 0, with mu0 Fz below 1.8e308", index
            )
        return limit

    def _limits_of_springs(self) -> Array:
        """Return the limits of the springs [N], (n, springs): their forces if all of them slip."""
        forces, sums = np.zeros_like(self._forces), np.empty((self._k.size, 2))
        stiff = np.full(self._k.size, 4.0 * self.springs)
        still = np.zeros(self._k.size)
        _KERNEL.element_steps(self._limit, self._limit, stiff, self._limit, still, forces, sums)
        return forces[..., 0]

    def _per_contact(self, value: Numbers, name: str) -> Array:
        """Return ``value`` for every contact, finite, (n,) and contiguous."""
        if type(value) is float and math.isfinite(value):
            return np.full(self._k.size, value)
        numbers = real(name, value)
        try:
            array = np.broadcast_to(numbers, self.shape).ravel()
        except ValueError as error:
            raise InputError(
                name, numbers.shape, f"of a shape that broadcasts to the contacts' {self.shape}"
            ) from error
        if not np.isfinite(array).all():
            raise InputError(name, value, "finite")
        return array

    def _pair(self, sums: Array) -> tuple[Any, Any]:
        if not self.shape:
            return float(sums[0, 0]), float(sums[0, 1])
        return sums[:, 0].reshape(self.shape), sums[:, 1].reshape(self.shape)
