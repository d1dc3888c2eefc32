"""Steps of a stop: ``/readyz`` answers 503; after ``drain_s`` the service closes the port; then the process ends."""

import asyncio
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from .settings import Settings
from .tables import Tables

__all__ = ["draining", "end_with_parent"]

_MARGIN_S = 2.0  # for the server to end, after drain and grace


def end_with_parent() -> None:
    """Stop this worker process when its parent has ended; else it would keep the port."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def wait() -> None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=wait, daemon=True, name="parent").start()


@contextmanager
def draining(tables: Tables, settings: Settings) -> Iterator[None]:
    """After SIGTERM, answer requests for ``drain_s``, but ``/readyz`` with 503; then stop the server.

    In that time each answer closes its connection.  A second SIGTERM, or any other signal, stops the server at once.
    The process ends when drain and grace are over, even if a thread still runs.
    """
    usual = signal.getsignal(signal.SIGTERM)
    if not callable(usual) or threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()

    def stop(number: int, frame: FrameType | None) -> None:
        if tables.draining or settings.drain_s <= 0:
            usual(number, frame)
        else:
            loop.call_soon_threadsafe(loop.call_later, settings.drain_s, usual, number, None)
        if not tables.draining:
            tables.draining = True
            last = threading.Timer(settings.drain_s + settings.shutdown_grace_s + _MARGIN_S, os._exit, (0,))
            last.daemon = True
            last.start()

    signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGTERM) is stop:
            signal.signal(signal.SIGTERM, usual)
