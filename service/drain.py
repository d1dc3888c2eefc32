"""Stopping in order: first the service says that it is not ready, a while later it stops listening."""

import asyncio
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from service.shelf import Shelf

__all__ = ["draining"]


@contextmanager
def draining(shelf: Shelf, seconds: float) -> Iterator[None]:
    """Between SIGTERM and what the server does about it, answer as before for so long, but not ``/readyz``.

    A second SIGTERM, or any other signal, is the server's at once.
    """
    usual = signal.getsignal(signal.SIGTERM)
    if seconds <= 0 or not callable(usual) or threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()

    def stop(number: int, frame: FrameType | None) -> None:
        if shelf.draining:
            usual(number, frame)
        else:
            shelf.draining = True
            loop.call_soon_threadsafe(loop.call_later, seconds, usual, number, None)

    signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGTERM) is stop:
            signal.signal(signal.SIGTERM, usual)
