"""Describe a contact as the builder sees it: its charts, its solver, and the error of the solver.

The differences between contacts are data of a :class:`SolvedContact`; the functions that build,
measure or verify ask for no name.  ``v`` and ``y`` belong to the charts everywhere: v~ and y~ of
one spring; for a ball v~/1.5 and y~/1.5 of its middle spring.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from mumacro import Surrogate
from mumacro.inputs.fields import BALL, CONTACTS, SPRING, SPRINGS_OF, Kind
from mumacro.kernel.arrays import Array, Codes
from mumacro.kernel.binding import kernels
from mumacro.table import atlas
from mumacro.table.atlas import Chart
from mumacro.table.blocks import TabulatedContact

from ..solver.ball import Ball, Springs, points_for
from ..solver.sweep import Sweep
from .draws import DRAWS, Draws
from .quantities import Sliding, solver_noise

#: tolerance of the springs over which a ball is integrated, whatever the tolerance of its table is
FINE = 1e-12
#: the smallest tolerance of a ball: near the ridge the ring misses 1e-11
BALL_TOLERANCE = 1e-10
#: possible error of a quadrature over such springs: of mu~ and of the stick fraction, absolute and
#: relative; of the power, relative
BALL_NOISE = 4e-14


class Solve(Protocol):
    """Solve a contact."""

    def __call__(
        self, v: Array, y: Array, eta: Array | None = None, *, continuous: bool = False
    ) -> dict[str, Array]:
        """Return results by name at points of the charts; ``continuous``: for the orbit that slides
        all the time."""
        ...


Noise = Callable[[str, Array, Array, dict[str, Array], Sliding], Array]


class SolvedContact(NamedTuple):
    """Hold one contact; ``noise`` as :func:`.quantities.solver_noise`."""

    kind: Kind
    solve: Solve
    noise: Noise
    #: the part of it that bounds contain in addition to the errors that a table states
    noise_in_bounds: Noise
    #: quantities whose derivatives a table gives
    slope_names: tuple[str, ...]
    #: whether it is integrated over springs: then the error of a quadrature is not a rounding error
    #: of the nodes, and mu~ next to 1 has its digits in 1 - mu~
    quadrature: bool
    #: tables of a smaller tolerance have the contact with this one
    least_tolerance: float
    #: solves v~crit, if the verification of this contact covers the stored border, too
    border: Sweep | None = None

    @property
    def name(self) -> str:
        """Return the name of its entry in a table."""
        return CONTACTS[self.kind.contact]

    @property
    def charts(self) -> tuple[Chart, ...]:
        """Return the geometry of its blocks."""
        return atlas.CHARTS[self.name]

    @property
    def draws(self) -> Draws:
        """Return where it is tested."""
        return draws_of(self.kind)

    def of(self, surrogate: Surrogate) -> TabulatedContact:
        """Return its entry in a table."""
        return surrogate.table.contacts[self.name]

    def as_asked(self, v: Array, y: Array) -> tuple[Array, Array]:
        """Return v~ and y~ that the evaluation makes from those of the contact as a whole, to the
        last digit, which matters in the corner."""
        scale = scale_of(self.kind)
        return scale * v / scale, scale * y / scale

    def places(self, surrogate: Surrogate, v: Array, y: Array) -> Codes:
        """Return the blocks of points (n,); their number if a closed form answers."""
        data = surrogate.tabulated.data("mu_ratio", self.kind)
        return kernels[-1].places(data, v, y, self.kind.contact)[0]

    def quantity(self, surrogate: Surrogate, name: str, v: Array, y: Array) -> Any:
        """Return value, bound and source of a table."""
        scale = scale_of(self.kind)
        return surrogate.quantity(name, scale * v, scale * y, **self.kind.names)

    def slopes(self, surrogate: Surrogate, name: str, v: Array, y: Array) -> Array:
        """Return value, derivatives and their bounds, rows (5, n)."""
        return slopes_of(surrogate, self.kind, name, v, y)


def scale_of(kind: Kind) -> float:
    """Return the ratio of v~ and y~ of a contact to those of its charts."""
    return SPRINGS_OF[CONTACTS[kind.contact]].middle_load


def draws_of(kind: Kind) -> Draws:
    """Return where a contact is tested."""
    return DRAWS[CONTACTS[kind.contact]]


def ratio_of(surrogate: Surrogate, kind: Kind, v: Array, y: Array) -> Array:
    """Return mu~ of a table at points of the charts."""
    scale = scale_of(kind)
    return np.asarray(surrogate.quantity("mu_ratio", scale * v, scale * y, **kind.names)[0])


def slopes_of(surrogate: Surrogate, kind: Kind, name: str, v: Array, y: Array) -> Array:
    """Return value, derivatives and their bounds at these points, rows (5, n)."""
    scale = scale_of(kind)
    return np.array(surrogate.tabulated.slopes(name, scale * v, scale * y, kind))


def spring(sweep: Sweep) -> SolvedContact:
    """Return one spring, which is solved again at every point."""

    def solve(
        v: Array, y: Array, eta: Array | None = None, *, continuous: bool = False
    ) -> dict[str, Array]:
        return sweep.solve("continuous" if continuous else "full", v, y, eta)

    return SolvedContact(
        SPRING,
        solve,
        noise=solver_noise,
        noise_in_bounds=solver_noise,
        slope_names=atlas.QUANTITY_NAMES,
        quadrature=False,
        least_tolerance=FINE,
        border=sweep,
    )


def ball(springs: Springs, tolerance: float = FINE, workers: int = 1) -> SolvedContact:
    """Return a ball, integrated over springs well below ``tolerance``."""
    integral = Ball(springs, points_for(tolerance), workers)

    def solve(
        v: Array, y: Array, eta: Array | None = None, *, continuous: bool = False
    ) -> dict[str, Array]:
        del continuous  # no block of a ball extends over the border
        return integral.solve(v, y, eta)

    return SolvedContact(
        BALL,
        solve,
        noise=_ball_noise,
        noise_in_bounds=_no_noise,
        slope_names=("mu_ratio",),
        quadrature=True,
        least_tolerance=BALL_TOLERANCE,
    )


def _ball_noise(
    name: str, v: Array, y: Array, solution: dict[str, Array], sliding: Sliding
) -> Array:
    del v, y, sliding
    value = solution[name]
    if name == "mu_ratio":
        return BALL_NOISE * np.minimum(1.0, 4.0 * value)
    # next to the border a spring's own stick fraction has half of its digits
    return 8.0 * BALL_NOISE * value if name == "power" else np.full(value.shape, 25.0 * BALL_NOISE)


def _no_noise(name: str, v: Array, y: Array, solution: dict[str, Array], sliding: Sliding) -> Array:
    """Return zero noise: the error of a quadrature is a part of the errors that a table of a ball
    states."""
    del y, solution, sliding, name
    return np.zeros_like(v)
