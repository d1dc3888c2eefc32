"""A computation that another thread can end: a flag that it looks at between its pieces of work,
and the kernel at every step of a motion.

>>> stop = Stop()
>>> with stop.of_this_thread():
...     look()
...     stop.set()
...     look()
Traceback (most recent call last):
mumacro.stopping.StopError: the computation was ended
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np

from mumacro.errors import MumacroError


class StopError(MumacroError):
    """The computation was ended by another thread."""


class Stop:
    """A flag; once it is set, what looks at it ends."""

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.int32)  # which the kernel reads, too

    def set(self) -> None:
        """Ask what looks at it to end."""
        self.flag[0] = 1

    def look(self) -> None:
        """Raise StopError where the flag is set."""
        if self.flag[0]:
            raise StopError("the computation was ended")

    @contextmanager
    def of_this_thread(self) -> Iterator[None]:
        """Let the computations of this thread look at the flag, until the context ends."""
        token = _CURRENT.set(self)
        try:
            yield
        finally:
            _CURRENT.reset(token)


_CURRENT = ContextVar("mumacro.stop", default=Stop())  # noqa: B039  (never set)


def current() -> Stop:
    """Return the flag that computations of this thread look at."""
    return _CURRENT.get()


def look() -> None:
    """Raise StopError where the computation of this thread is to end."""
    _CURRENT.get().look()
