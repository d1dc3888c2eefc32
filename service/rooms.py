"""Memory for the texts of large bodies, used again: new memory costs more than reading what is put into it.

The system hands out memory page by page, each cleared and accounted for when it is first touched: a quarter of what
answering an Arrow stream takes.  So what one body leaves is kept for the next until large bodies have stopped coming,
but no more than one body may have in all.
"""

import mmap
import sys
import weakref
from typing import Any

import numpy as np

from service.compiled.digits import PADDING, Bytes
from service.memory import Mapped

__all__ = ["Rooms"]

_MAPPED_FROM = 1024 * 1024
_PRIVATE: dict[str, Any] = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if sys.platform != "win32" else {}


class Rooms:
    """Gives room for texts.

    Parameters
    ----------
    most : int
        Bytes that are kept, in all.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._kept: list[_Room] = []

    def take(self, length: int) -> Bytes:
        """Room for a text of so many bytes, with the 0 bytes behind it that stop every scan.

        It is free again when nobody has it or a view of it.  Large ones are mapped: numpy would ask for huge pages, and
        while the system gathers one of those, which can take many milliseconds, the thread that fills the room answers
        nobody.
        """
        need = length + PADDING
        text = np.empty(need, dtype=np.uint8) if need < _MAPPED_FROM else self._mapped(need)
        text[length:] = 0
        return text

    def _mapped(self, need: int) -> Bytes:
        fitting = (room for room in self._kept if room.free and room.size >= need)
        room = min(fitting, key=lambda room: room.size, default=None)
        if room is None:
            room = _Room(-(-need // _MAPPED_FROM) * _MAPPED_FROM)
            if sum(other.size for other in self._kept) + need <= self._most + _MAPPED_FROM:
                self._kept.append(room)
        return room.lend(need)

    def empty(self) -> None:
        """Let go of what nobody has."""
        self._kept = [room for room in self._kept if not room.free]


class _Room:
    """A piece of mapped memory, and who has it."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._memory = Mapped(-1, size, **_PRIVATE)
        self._user: weakref.ref[Any] | None = None

    @property
    def free(self) -> bool:
        return self._user is None

    def lend(self, need: int) -> Bytes:
        text = np.frombuffer(self._memory, dtype=np.uint8, count=need)
        self._user = weakref.ref(text.base, self._returned)  # every view of the text holds the same base
        return text

    def _returned(self, _user: object) -> None:
        self._user = None
