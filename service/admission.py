"""Decide what one process takes on at the same time, here and nowhere else.

A request passes three gates. *Before its body is read*, the bytes of all bodies are counted as they
arrive. *Before it is computed*, when its cost is known, it needs a slot: it waits a short time for
one, or is refused with the time after which to ask again. *While it is computed*, in its own
thread, three things end it: its time limit, a client that has gone, and the stop of the service.

One client has at most half of the bytes, slots and places in the queue while another client has
asked in the last ten seconds.  It never has the last part of them, so that the next client finds
some.  A client is the holder of a key, or else the address that trusted proxies report.

A *cost*, here and in the models and routers, is the time of a computation divided by the time of
mu_macro of one spring that is shaken across, one case of a long column.
"""

import _thread
import asyncio
import logging
import math
import os
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from ipaddress import ip_network
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

from fastapi import Request
from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope

from mumacro.kernel.threads import Stop, StopError

from .problems import TICKET, ProblemKind, RequestError, path_in
from .settings import Settings

T = TypeVar("T")
#: largest cost that is computed at once, without a slot: less than half a millisecond
AT_ONCE = 4000.0
#: largest cost that is not long, about 50 ms; long work has half of the slots
LONG = 100.0 * AT_ONCE
WAIT_S = 2.0  # longest wait for a slot
_MOST_WAITING = 64  # largest number of requests that wait for a slot
_RECENTLY_S = 10.0  # for this time a client that has asked counts as another one
# added to the niceness of a thread with long work, so that short requests are answered first
_NICENESS = 5
_LOOK_EVERY_S = 0.01  # between two looks whether all threads have ended
_log = logging.getLogger("mumacro.admission")


class Thread(Generic[T]):
    """Do work in its own thread, which does not keep the process alive.  Raise RuntimeError if no
    thread can start.

    ``threading.Thread`` would let the loop wait until the new thread runs, behind all others.
    """

    alive: ClassVar[set["Thread[Any]"]] = set()

    def __init__(self, work: Callable[[], T], niceness: int = 0) -> None:
        self.stop, self._loop = Stop(), asyncio.get_running_loop()
        #: result of the work: its return value or its exception
        self.done: asyncio.Future[T] = self._loop.create_future()
        self.alive.add(self)
        try:
            _thread.start_new_thread(self._run, (work, niceness))
        except RuntimeError:
            self.alive.discard(self)
            raise

    def _run(self, work: Callable[[], T], niceness: int) -> None:
        if niceness and sys.platform == "linux":  # on Linux niceness belongs to the thread
            os.nice(niceness)
        try:
            with self.stop.of_this_thread():
                outcome = work()
            end = partial(self.done.set_result, outcome)
        except BaseException as error:
            end = partial(self.done.set_exception, error)
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._end, end)
        self.alive.discard(self)

    def _end(self, tell: Callable[[], None]) -> None:
        tell()
        self.done.exception()  # perhaps nobody waits for it any more


async def threads_end(seconds: float) -> bool:
    """Wait up to this time until all work has ended, and return whether it has."""
    end = time.monotonic() + seconds
    while Thread.alive and time.monotonic() < end:
        await asyncio.sleep(_LOOK_EVERY_S)
    return not Thread.alive


class _Waiting(NamedTuple):
    """Hold a request that waits for a slot."""

    client: str
    is_long: bool
    admitted: asyncio.Future[None]


class Admission:
    """Hold what the requests of one process use together: bytes, slots, places in the queue."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.held_bytes, self.refused = 0, 0
        self.begun = 0  # how often work has begun in a slot
        self._bytes_of, self._slots_of = Counter[str](), Counter[str]()
        self._long_of = Counter[str]()
        self.queue: list[_Waiting] = []
        self.running: set[Thread[Any]] = set()
        self.is_stopping = False
        self.stops_at = math.inf  # the end of the grace period, on the loop's clock
        #: number of open connections, as our own server reports it
        self.connections: Callable[[], int] = lambda: 0
        self._seconds = 0.1  # mean time for which the last slots were held
        # the client that asked last, and the last client that was a different one, each with the
        # time
        self._last = self._before = ("", -math.inf)

    @property
    def slots(self) -> int:
        """Return how many slots are taken."""
        return self._slots_of.total()

    def see(self, client: str) -> None:
        """Remember that a client has asked."""
        if client != self._last[0]:
            self._before = self._last
        self._last = client, asyncio.get_running_loop().time()

    def _share(self, client: str, whole: int) -> int:
        """Return how much of a whole one client may have."""
        _, moment = self._before if self._last[0] == client else self._last
        is_alone = asyncio.get_running_loop().time() - moment > _RECENTLY_S
        return max(1, whole - max(1, whole // 8) if is_alone else whole // 2)

    # --- bytes ------------------------------------------------------------------------------------

    def weigh(self, client: str, added: int) -> None:
        """Refuse a body if there is no room for its bytes."""
        most = self.settings.max_held_bytes
        if self.held_bytes + added > most:
            part = f"all requests together may have {most} bytes"
        elif self._bytes_of[client] + added > (share := self._share(client, most)):
            part = f"one client may have {share} bytes at the same time"
        else:
            return
        raise self._overloaded(f"the bodies of {part}, and this one is too much beside the others")

    def hold(self, client: str, added: int) -> None:
        """Count bytes that were received (or, with a negative number, released)."""
        self.held_bytes += added
        self._bytes_of[client] += added
        if not self._bytes_of[client]:
            del self._bytes_of[client]

    # --- slots ------------------------------------------------------------------------------------

    def _is_room(self, client: str, is_long: bool) -> bool:
        most = self.settings.max_computations
        if self.slots >= most or self._slots_of[client] >= self._share(client, most):
            return False
        half = max(1, most // 2)
        return not is_long or (
            self._long_of.total() < half and self._long_of[client] < self._share(client, half)
        )

    def _count(self, client: str, is_long: bool, added: int) -> None:
        for counter in (self._slots_of, self._long_of)[: 1 + is_long]:
            counter[client] += added
            if not counter[client]:
                del counter[client]

    async def take(self, client: str, is_long: bool) -> None:
        """Take a slot; wait a short time for one."""
        if self.is_stopping:
            raise RequestError(ProblemKind.OVERLOADED, "the service stops")
        if self._is_room(client, is_long):
            self._count(client, is_long, 1)
            return
        of_client = sum(one.client == client for one in self.queue)
        if len(self.queue) >= _MOST_WAITING or of_client >= self._share(client, _MOST_WAITING):
            raise self._overloaded("too many requests wait to be computed already")
        waiting = _Waiting(client, is_long, asyncio.get_running_loop().create_future())
        self.queue.append(waiting)
        try:
            await asyncio.wait([waiting.admitted], timeout=WAIT_S)
        except asyncio.CancelledError:
            if waiting.admitted.done():
                self.give_back(client, is_long)
            raise
        finally:
            if not waiting.admitted.done():
                self.queue.remove(waiting)
        if not waiting.admitted.done():
            raise self._overloaded(f"no computation has ended within {WAIT_S:g} s")

    def give_back(self, client: str, is_long: bool, seconds: float | None = None) -> None:
        """Give a slot back that was held for some seconds.  It goes to the clients with the fewest
        slots, and among their requests to the one that has waited longest."""
        self._count(client, is_long, -1)
        if seconds is not None:
            self._seconds += 0.1 * (seconds - self._seconds)
        while self.queue and self.slots < self.settings.max_computations:
            first: dict[tuple[str, bool], _Waiting] = {}  # the oldest of each client
            for one in self.queue:
                first.setdefault(one[:2], one)
            ready = [one for kind, one in first.items() if self._is_room(*kind)]
            if not ready:
                break
            one = min(ready, key=lambda waiting: self._slots_of[waiting.client])
            self.queue.remove(one)
            self._count(one.client, one.is_long, 1)
            one.admitted.set_result(None)

    def _overloaded(self, detail: str) -> RequestError:
        """Return the refusal, with the time after which there will be room: the work that waits and
        runs has then ended, if it takes as long as the last computations."""
        self.refused += 1
        rounds = 1 + len(self.queue) / self.settings.max_computations
        seconds = min(max(1, math.ceil(rounds * self._seconds)), self.settings.compute_limit_s)
        return RequestError(ProblemKind.OVERLOADED, detail, headers={"Retry-After": str(seconds)})

    # --- the end ----------------------------------------------------------------------------------

    def begin_stop(self) -> None:
        """Refuse new work, and end the running work when the grace period is over."""
        if not self.is_stopping:
            self.is_stopping, loop = True, asyncio.get_running_loop()
            self.stops_at = loop.time() + self.settings.shutdown_grace_s
            loop.call_at(self.stops_at, self.end)

    def end(self) -> None:
        """Ask all running work to end."""
        for thread in self.running:
            thread.stop.set()


class Ticket:
    """Hold what one request uses until it is answered: the bytes of its body, and a slot."""

    def __init__(self, scope: Scope) -> None:
        self.admission: Admission = scope["app"].state.admission
        self.client, self._bytes, self._scope = client_of(scope), 0, scope
        self._slot: bool | None = None  # whether it is a slot of long work
        self._since = 0.0
        self._left: float = self.admission.settings.compute_limit_s
        self.admission.see(self.client)

    def weigh(self, size: int) -> None:
        """Refuse a body of this size if there is no room for it."""
        self.admission.weigh(self.client, size - self._bytes)

    def hold(self, size: int) -> None:
        """Hold a body of this size; 0 releases it."""
        self.admission.hold(self.client, size - self._bytes)
        self._bytes = size

    async def _take(self, is_long: bool) -> None:
        if self._slot is None or (is_long and not self._slot):
            self.leave()
            await self.admission.take(self.client, is_long)
            self.admission.begun += 1
            self._slot, self._since = is_long, asyncio.get_running_loop().time()
            if is_long:
                fields = {"request_id": self._scope.get("request_id"), "bytes": self._bytes}
                fields |= {"path": path_in(self._scope), "client": self.client[:64]}
                _log.info("a long request begins", extra={"fields": fields})

    def leave(self) -> None:
        """Give the slot back."""
        if self._slot is not None:
            seconds = asyncio.get_running_loop().time() - self._since
            self.admission.give_back(self.client, self._slot, seconds)
            self._slot = None

    async def run(self, work: Callable[[], T], cost: float, receive: Receive) -> T:
        """Do work in a thread, with a slot.  The request keeps the slot.

        The time limit, or a client that has gone, ends the work; the slot is given back when the
        work has ended.
        """
        await self._take(cost > LONG)
        loop, admission = asyncio.get_running_loop(), self.admission
        started = loop.time()
        try:
            thread = Thread(work, _NICENESS if cost > LONG else 0)
        except RuntimeError:
            raise RequestError(ProblemKind.OVERLOADED, "no thread can start") from None
        if started >= admission.stops_at:  # it waited for its slot until the end
            thread.stop.set()
        admission.running.add(thread)
        thread.done.add_done_callback(lambda _: admission.running.discard(thread))
        gone = asyncio.ensure_future(_gone(receive))
        try:
            ends: set[asyncio.Future[Any]] = {thread.done, gone}
            await asyncio.wait(ends, timeout=self._left, return_when=asyncio.FIRST_COMPLETED)
            self._left -= loop.time() - started
            if thread.done.done():
                return thread.done.result()
        except StopError:
            raise RequestError(ProblemKind.TOOK_TOO_LONG, "the service stops") from None
        finally:
            gone.cancel()
            if not thread.done.done():
                thread.stop.set()
                client, slot, self._slot = self.client, self._slot is True, None
                thread.done.add_done_callback(lambda _: admission.give_back(client, slot))
        if gone.done() and not gone.cancelled():
            raise ClientDisconnect
        limit = admission.settings.compute_limit_s
        detail = f"computing may take up to {limit} s: ask for less at a time"
        raise RequestError(ProblemKind.TOOK_TOO_LONG, detail, headers={"Retry-After": str(limit)})


async def _gone(receive: Receive) -> None:
    """Wait until the client has gone; its body has already been received."""
    while (await receive())["type"] != "http.disconnect":
        pass


def client_of(scope: Scope) -> str:
    """Return who asks: the holder of a key, or else an address; for IPv6 the network that one site
    has."""
    if holder := scope.get("key_holder"):
        return f"key {holder}"
    address = str((scope.get("client") or ("",))[0])
    if ":" in address:
        with suppress(ValueError):
            return str(ip_network(f"{address}/64", strict=False))
    return address[:64]


def ticket_of(scope: Scope) -> Ticket:
    """Return the ticket of a request; :class:`~service.middleware.Failures` takes it back."""
    ticket: Ticket | None = scope.get(TICKET)
    if ticket is None:
        ticket = scope[TICKET] = Ticket(scope)
    return ticket


async def compute(request: Request, work: Callable[[], T], cost: float = 0.0) -> T:
    """Do the work of a request in a thread, if its cost is too large to do it at once."""
    ticket = ticket_of(request.scope)
    try:
        return await ticket.run(work, cost, request.receive)
    finally:
        ticket.leave()
