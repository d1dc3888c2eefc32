"""How an answer is sent: in pieces worth a message, packed if that is wanted, within the time that there is."""

import asyncio
import math
import zlib
from collections.abc import Awaitable, Iterator
from typing import TypeVar

from service.errors import SlowClientError, TookTooLongError
from service.settings import Settings

__all__ = ["CLOSE", "Budget", "Packer", "gather", "wants_gzip"]

T = TypeVar("T")

#: what an answer says when the rest of its question is not read
CLOSE = {"Connection": "close"}

_GRACE_S = 1.0  # that a caller is waited for before it can be called slow
_PIECE = 256 * 1024  # bytes that are handed to the connection at a time


class Budget:
    """Time that is left for one request, and for the caller's next move; and how fast the caller has been."""

    def __init__(self, settings: Settings) -> None:
        self._loop = asyncio.get_running_loop()
        self._total = settings.time_limit_s
        self._end = self._loop.time() + self._total
        self.client_s = settings.client_timeout_s
        self._least_rate = settings.least_rate
        self._moved = 0
        self._waited = 0.0
        self._since = 0.0
        self._patience: asyncio.Timeout | None = None
        self._gave_way = False

    async def client(self, move: Awaitable[T], deadline: float | None = None) -> T:
        """Wait for the caller's move, until ``deadline`` or for as long as a caller may take."""
        self._since = self._loop.time()
        try:
            async with asyncio.timeout_at(min(self._end, deadline or self.deadline())) as self._patience:
                made = await move
        except TimeoutError:
            if self._gave_way:
                raise self._too_slow() from None
            if self._loop.time() >= self._end:
                raise TookTooLongError(f"a batch may take up to {self._total} s", headers=CLOSE) from None
            raise SlowClientError(f"a caller may take up to {self.client_s} s", headers=CLOSE) from None
        finally:
            self._patience = None
            self._waited += self._loop.time() - self._since
        if self._gave_way:  # the move was made in the very moment
            raise self._too_slow()
        return made

    def deadline(self) -> float:
        """Until when a move that begins now has to be made."""
        return self._loop.time() + self.client_s

    def note(self, size: int) -> None:
        """Count bytes that the caller sent or took."""
        self._moved += size

    def rate(self) -> float:
        """Bytes a second that the caller moved while it was waited for; infinite if it is not, or not for long."""
        waited = self._waited + self._loop.time() - self._since
        return math.inf if self._patience is None or waited < _GRACE_S else self._moved / waited

    @property
    def is_slow(self) -> bool:
        """Whether the caller may have to give way to others."""
        return self.rate() < self._least_rate

    def give_way(self) -> None:
        """End the wait for the caller now: somebody else needs what it holds."""
        self._gave_way = True
        if self._patience is not None and not self._patience.expired():
            self._patience.reschedule(self._loop.time())

    def _too_slow(self) -> SlowClientError:
        rate = f"who moves less than {self._least_rate} bytes a second"
        return SlowClientError(f"all places are taken, and {rate} gives way to others", headers=CLOSE)


class Packer:
    """gzip, at the level that costs least."""

    def __init__(self) -> None:
        self._packer = zlib.compressobj(1, zlib.DEFLATED, 31)

    def pack(self, piece: bytes, *, last: bool = False, flush: bool = False) -> bytes:
        """Return what can be sent after this piece."""
        packed = self._packer.compress(piece)
        if last or flush:
            packed += self._packer.flush(zlib.Z_FINISH if last else zlib.Z_SYNC_FLUSH)
        return packed


def wants_gzip(offers: str) -> bool:
    """Whether who sent these words as Accept-Encoding takes gzip."""
    for offer in offers.lower().split(","):
        name, _, parameters = offer.partition(";")
        if name.strip() in ("gzip", "*"):
            return parameters.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00", "q=0.000")
    return False


def gather(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """The same bytes in pieces of a size that is worth a message; what is one already is not copied."""
    gathered: list[bytes] = []
    size = 0
    for piece in pieces:
        gathered.append(piece)
        size += len(piece)
        if size >= _PIECE:
            yield b"".join(gathered)
            gathered, size = [], 0
    if size:
        yield b"".join(gathered)
