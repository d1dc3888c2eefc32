"""Every limit of the service at its maximum count: as many clients as are allowed do their worst at the same time.

    python fuzz/attacks.py [--only attacks] [--share 0.2] [--write]

Beside each attack another client asks ``/livez``, one new connection after another.  Seen are the most memory of the
process, and the longest of these waits.
"""

from __future__ import annotations

import json
import resource
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from http.client import HTTPException
from typing import Any

from benchmarks.measuring import main, markdown
from tests.serving import CASE, Server, connect, head, serving

CONNECTIONS, BATCHES, CASES, BODY = 990, 4, 100_000, 16 * 2**20  # the defaults; a few connections are left
BATCH = "/v1/mu-macro/batch"
EVERYTHING = ["groups", "limits", "regime_certain", "gradient", "stick_fraction", "power", "settling"]


def held(server: Server, number: int, text: bytes, seconds: float = 3.0) -> None:
    """Send the same bytes on many connections, and hold these."""
    with ExitStack() as stack:
        for _ in range(number):
            with suppress(OSError):
                raw = stack.enter_context(connect(server))
                raw.settimeout(0.5)  # a server that reads no more
                raw.sendall(text)
        time.sleep(seconds)


def posted(server: Server, number: int, kind: str, body: bytes) -> set[int]:
    """Send the same batch on many connections at once; the statuses."""
    found: set[int] = set()

    def ask() -> None:
        with connect(server) as raw:
            threading.Thread(target=sent, args=(raw, head(BATCH, len(body), kind) + body)).start()
            text = b""
            with suppress(OSError):
                while piece := raw.recv(1 << 16):
                    text = text or piece
                    if b"\r\n0\r\n\r\n" in piece[-16:]:
                        break
                    if b"content-length" in text[:600].lower():
                        break
            found.add(int(text[9:12] or 0))

    threads = [threading.Thread(target=ask) for _ in range(number)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return found


def sent(raw: socket.socket, text: bytes) -> None:
    """Send what the other side takes."""
    with suppress(OSError):
        raw.sendall(text)


def tiny_fields(server: Server, share: float) -> None:
    """Heads without an end, of 64 KB of the smallest fields."""
    held(server, round(CONNECTIONS * share), b"GET /livez HTTP/1.1\r\nHost: x\r\n" + b"a:b\r\n" * 13_000)


def pipelined(server: Server, share: float) -> None:
    """16 KB of the smallest requests on each connection, whose answers are not read."""
    held(server, round(CONNECTIONS * share), b"GET /x HTTP/1.1\r\nHost:x\r\n\r\n" * 600)


def silent(server: Server, share: float) -> None:
    """More connections without a byte than are allowed."""
    held(server, round(1.5 * CONNECTIONS * share), b"")


def waiting_bodies(server: Server, share: float) -> None:
    """Bodies of 64 KB that lack their last byte."""
    text = head("/v1/mu-macro", 65_000) + b" " * 64_999
    held(server, round(CONNECTIONS * share), text)


def long_head_of_csv(server: Server, share: float) -> None:
    """A CSV whose first line is as long as a body may be."""
    posted(server, 2 * BATCHES, "text/csv", b"a," * round(BODY * share / 2))


def blank_lines(server: Server, share: float) -> None:
    """A CSV of blank lines."""
    posted(server, 2 * BATCHES, "text/csv", b"mu0,Fz,k,y0,omega,v0\n" + b"\n" * round((BODY - 100) * share))


def brackets(server: Server, share: float) -> None:
    """JSON of the smallest values and lists."""
    for unit in (b"[],", b"0,", b'{"":0},'):
        posted(server, 2 * BATCHES, "application/json", b"[" + unit * round((BODY - 100) / len(unit) * share) + b"0]")


def everything(server: Server, share: float) -> None:
    """As many rows, and as long columns, as are allowed, with everything included."""
    count = round(CASES * share)
    row = json.dumps({**CASE, "v0": 0.0123456789012345})
    posted(server, BATCHES, "application/json", f"[{','.join([row] * count)}]".encode())
    columns = {**CASE, "v0": [0.0123456789012345] * count, "include": EVERYTHING}
    posted(server, BATCHES, "application/json", json.dumps(columns).encode())


def strange_words(server: Server, share: float) -> None:
    """Columns of words and of nulls, which Python reads one by one."""
    for word in ("rigid", None, "x" * 40):
        body = json.dumps({**CASE, "k": [word] * round(CASES * share)}).encode()
        posted(server, BATCHES, "application/json", body)


def idle_streams(server: Server, share: float) -> None:
    """Streams without a line; the question of a person is answered beside them."""
    text = head(BATCH, None, "application/x-ndjson")
    with ExitStack() as stack:
        for _ in range(round(CONNECTIONS * share)):
            stack.enter_context(connect(server)).sendall(text)
        given = {name: value for name, value in CASE.items() if name != "v0"}
        status, _, _ = server.ask("POST", "/v1/law", json.dumps({**given, "start": 1e-4, "stop": 1.0}))
        assert status == 200, f"/v1/law: {status}"


def descriptions(server: Server, share: float) -> None:
    """Many at once ask for /openapi.json for the first time."""
    statuses: list[int] = []
    threads = [
        threading.Thread(target=lambda: statuses.append(server.ask("GET", "/openapi.json")[0]))
        for _ in range(max(4, round(8 * share)))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(statuses) == {200}, statuses


ATTACKS: tuple[Callable[[Server, float], None], ...] = (
    tiny_fields, pipelined, silent, waiting_bodies, long_head_of_csv, blank_lines, brackets, everything, strange_words,
    idle_streams, descriptions,
)  # fmt: skip


@contextmanager
def asking(server: Server, waits: list[float]) -> Iterator[None]:
    """Ask ``/livez`` again and again until the context ends; it must always answer 200."""
    stop = threading.Event()
    refused: list[Any] = []

    def ask() -> None:
        while True:
            started = time.perf_counter()
            try:
                status = server.ask("GET", "/livez")[0]
            except (OSError, HTTPException) as error:
                status = repr(error)  # type: ignore[assignment]
            waits.append(time.perf_counter() - started)
            if status != 200:
                refused.append(status)
            if stop.wait(0.02):
                return

    thread = threading.Thread(target=ask)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
    assert not refused, f"/livez: {refused[:3]}"


def tried(attack: Callable[[Server, float], None], share: float) -> tuple[float, float]:
    """The most memory [MB] and the longest wait [s] of one attack on a new service; it must serve afterwards."""
    waits: list[float] = []
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(8192, most), most))
    with serving() as server:
        with asking(server, waits):
            attack(server, share)
        assert server.ask("POST", "/v1/mu-macro", json.dumps(CASE))[0] == 200
        assert not server.errors(), server.errors()[:1]
        return server.memory("VmHWM"), max(waits)


def attacks(share: float) -> str:
    """All of them."""
    rows = []
    for attack in ATTACKS:
        memory, wait = tried(attack, share)
        rows.append((str(attack.__doc__).rstrip("."), f"{memory:.0f}", f"{1e3 * wait:.0f}"))
    return markdown(("attack", "most memory [MB]", "longest wait of /livez [ms]"), rows)


SECTIONS = {"attacks": attacks}

if __name__ == "__main__":
    main(__doc__, SECTIONS, share=1.0)
