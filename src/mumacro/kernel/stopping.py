"""Let another thread end a computation: it checks a flag between its pieces of work, and the kernel
checks it at every step of a motion.

>>> stop = Stop()
>>> with stop.of_this_thread():
...     look()
...     stop.set()
...     look()
Traceback (most recent call last):
mumacro.kernel.stopping.StopError: the computation was ended
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np

from mumacro.errors import MumacroError


class StopError(MumacroError):
    """Report that another thread ended the computation."""


class Stop:
    """Hold a flag; once it is set, every computation that checks it ends."""

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.int32)  # the kernel reads it, too

    def set(self) -> None:
        """Ask the computations that check this flag to end."""
        self.flag[0] = 1

    def look(self) -> None:
        """Raise StopError if the flag is set."""
        if self.flag[0]:
            raise StopError("the computation was ended")

    @contextmanager
    def of_this_thread(self) -> Iterator[None]:
        """Let the computations of this thread check the flag, until the context ends."""
        token = _CURRENT.set(self)
        try:
            yield
        finally:
            _CURRENT.reset(token)


_CURRENT = ContextVar("mumacro.stop", default=Stop())  # noqa: B039  (never set)


def current() -> Stop:
    """Return the flag that computations of this thread check."""
    return _CURRENT.get()


def look() -> None:
    """Raise StopError if the computation of this thread must end."""
    _CURRENT.get().look()
