"""A contact as the builder sees it: its charts, its solver, and what that may be wrong by.

``v`` and ``y`` are those of the charts everywhere: v~ and y~ of one spring; of a ball v~/1.5 and
y~/1.5, those of its middle spring.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from mumacro import Surrogate
from mumacro.inputs.kind import BALL, SPRING, Kind
from mumacro.kernel import threads as shared_out
from mumacro.kernel.arrays import Array, Codes
from mumacro.kernel.binding import kernels
from mumacro.table import atlas
from mumacro.table.atlas import MIDDLE, Chart
from mumacro.table.blocks import Block, Table

from ..solver.ball import Ball, Springs, points_for
from ..solver.sweep import Sweep
from .quantities import Sliding, solver_noise

#: tolerance of the springs that a ball is integrated over, whatever that of its table
FINE = 1e-12
#: what a quadrature over such springs may be wrong by: of mu~ and of the stick fraction, absolute
#: and relative; of the power, relative
BALL_NOISE = 4e-14


class Solve(Protocol):
    """What solves a contact."""

    def __call__(
        self, v: Array, y: Array, eta: Array | None = None, *, continuous: bool = False
    ) -> dict[str, Array]:
        """Results by name at points of the charts' groups; ``continuous``: of the orbit that slides
        all the time."""
        ...


Noise = Callable[[str, Array, Array, dict[str, Array], Sliding], Array]


class SolvedContact(NamedTuple):
    """One contact; ``noise`` as :func:`.quantities.solver_noise`."""

    kind: Kind
    charts: Sequence[Chart]
    solve: Solve
    noise: Noise
    #: the part of it that bounds allow for beside the errors that a table states
    allowed: Noise
    #: quantities whose slopes a table gives
    sloped: tuple[str, ...]
    #: times those of the charts: v~ and y~ of the contact as a whole
    scale: float

    def blocks(self, table: Table) -> list[Block]:
        """Its blocks in a table."""
        return table.ball if self.kind == BALL else table.blocks

    def with_blocks(self, table: Table, blocks: list[Block]) -> Table:
        """The table with other blocks of this contact."""
        if self.kind == BALL:
            return dataclasses.replace(table, ball=blocks)
        return dataclasses.replace(table, blocks=blocks)

    def as_asked(self, v: Array, y: Array) -> tuple[Array, Array]:
        """The groups that evaluation makes of those of the contact as a whole, to the last digit,
        which counts in the corner."""
        return self.scale * v / self.scale, self.scale * y / self.scale

    def places(self, surrogate: Surrogate, v: Array, y: Array) -> Codes:
        """The blocks of points (n,), their number where a closed form answers."""
        data = surrogate.tabulated.data("mu_ratio", self.kind)
        return kernels[-1].places(data, v, y, self.kind.contact)[0]

    def quantity(self, surrogate: Surrogate, name: str, v: Array, y: Array) -> Any:
        """Value, bound and source of a table."""
        return surrogate.quantity(name, self.scale * v, self.scale * y, **self.kind.names)

    def slopes(self, surrogate: Surrogate, name: str, v: Array, y: Array) -> Array:
        """Value, slopes and their bounds, rows (5, n)."""
        return slopes_of(surrogate, self.kind, name, v, y)


def ratio_of(surrogate: Surrogate, kind: Kind, v: Array, y: Array) -> Array:
    """mu~ of a table at points of the charts' groups."""
    if kind == SPRING:
        return np.asarray(surrogate.mu_ratio(v, y))
    return np.asarray(surrogate.quantity("mu_ratio", MIDDLE * v, MIDDLE * y, **kind.names)[0])


def slopes_of(surrogate: Surrogate, kind: Kind, name: str, v: Array, y: Array) -> Array:
    """Value, slopes and their bounds there, rows (5, n)."""
    if kind == SPRING:
        return np.array(surrogate.slopes(v, y, name, bounds=True))
    code, data = atlas.QUANTITY_NAMES.index(name), surrogate.tabulated.data(name, kind)
    return np.array(shared_out.slopes(code, data, MIDDLE * v, MIDDLE * y, None, kind.contact))


def spring(sweep: Sweep) -> SolvedContact:
    """One spring, solved anew at every point."""

    def solve(
        v: Array, y: Array, eta: Array | None = None, *, continuous: bool = False
    ) -> dict[str, Array]:
        return sweep.solve("continuous" if continuous else "full", v, y, eta)

    return SolvedContact(
        SPRING, atlas.CHARTS, solve, solver_noise, solver_noise, atlas.QUANTITY_NAMES, 1.0
    )


def ball(springs: Springs, tolerance: float = FINE, workers: int = 1) -> SolvedContact:
    """A ball, integrated over springs well below ``tolerance``."""
    integral = Ball(springs, points_for(tolerance), workers)

    def solve(
        v: Array, y: Array, eta: Array | None = None, *, continuous: bool = False
    ) -> dict[str, Array]:
        del continuous  # no block of a ball reaches over the border
        return integral.solve(v, y, eta)

    return SolvedContact(
        BALL,
        atlas.BALL_CHARTS,
        solve,
        _ball_noise,
        _no_noise,
        ("mu_ratio",),
        MIDDLE,
    )


def _ball_noise(name: str, v: Array, y: Array, solved: dict[str, Array], sliding: Sliding) -> Array:
    del v, y, sliding
    value = solved[name]
    if name == "mu_ratio":
        return BALL_NOISE * np.minimum(1.0, 4.0 * value)
    # next to the border a spring's own stick fraction has half of its digits
    return 8.0 * BALL_NOISE * value if name == "power" else np.full(value.shape, 25.0 * BALL_NOISE)


def _no_noise(name: str, v: Array, y: Array, solved: dict[str, Array], sliding: Sliding) -> Array:
    """A quadrature's own error is a part of the errors that a table of a ball states."""
    del y, solved, sliding, name
    return np.zeros_like(v)
