"""Find where the cycles of a recorded motion begin and end."""

from typing import NamedTuple

import numpy as np

from mumacro.kernel.arrays import Array

_TURN = 0.5  # the motion has turned once it has gone back by this fraction of its range
_STEPS = 1.5  # a cycle is closed if its ends are at most this many steps apart


class Cycles(NamedTuple):
    """The whole cycles among samples (n,)."""

    begins: tuple[int, ...]  #: the first sample of each cycle, then the end of the last one
    goes_on: bool  #: whether part of a cycle follows the last whole one

    @property
    def number(self) -> int:
        """Return the number of whole cycles."""
        return len(self.begins) - 1


def cycles_of(x: Array) -> Cycles:
    """Return the whole cycles of a motion.  A cycle ends where the motion is back at its first
    position and moves in its first direction.

    >>> cycles_of(np.sin(np.linspace(0.0, 6.0 * np.pi, 301)))
    Cycles(begins=(0, 100, 200, 301), goes_on=False)
    """
    turns, direction = _turns(x)
    begins, last = [0], x.size - 1
    step = _STEPS * float(np.abs(np.diff(x)).max())
    while True:
        second = 2 * len(begins) - 1  # the second turn of this cycle
        if second >= len(turns):
            break
        here = turns[second]
        until = turns[second + 1] if second + 1 < len(turns) else last
        passed = np.flatnonzero(direction * (x[here : until + 1] - x[0]) >= 0.0)
        end = here + int(passed[0]) if passed.size else until
        if end == last and direction * (x[last] - x[0]) < -step:
            break
        begins.append(last + 1 if end == last else end)
        if end == last:
            return Cycles(tuple(begins), False)
    # The second turn is the end of the cycle, or the end comes just before the first position.
    if len(turns) >= 2 * len(begins) - 1 and abs(x[last] - x[0]) <= step and last - begins[-1] > 2:
        begins.append(last + 1)
        return Cycles(tuple(begins), False)
    return Cycles(tuple(begins), begins[-1] <= last)


def _turns(x: Array) -> tuple[list[int], int]:
    """Return the samples at which a motion has turned back by half of its range, and its first
    direction: 1 or -1."""
    span = _TURN * float(np.ptp(x))
    turns: list[int] = []
    direction, least, most = 0, 0, 0
    values = x.tolist()
    for i, value in enumerate(values):
        if value > values[most]:
            most = i
        if value < values[least]:
            least = i
        if direction >= 0 and value < values[most] - span:
            if direction or most > 0:
                turns.append(most)
            direction, least = -1, i
        elif direction <= 0 and value > values[least] + span:
            if direction or least > 0:
                turns.append(least)
            direction, most = 1, i
    first = direction * (-1) ** len(turns)
    return turns, first or (1 if values[-1] >= values[0] else -1)
