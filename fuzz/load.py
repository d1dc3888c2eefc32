"""The service under load: every form at once, more batches than slots, and restarts beside clients.

    python fuzz/load.py [--only mixed_load|overload|rolling_restart] [--minutes 5]

Every answer is compared with that of an idle service, byte for byte.
"""

import json
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from http.client import HTTPConnection, HTTPException
from itertools import cycle
from typing import NamedTuple
from urllib.parse import urlencode

import numpy as np

from tests.support.measuring import main, markdown, sections
from tests.support.places import ROOT
from tests.support.serving import CASE, Server, asking, serving

BATCH = "/v1/mu-macro/batch"
TABLE = ROOT / "tables" / "mumacro-1e-4.nc"
CLIENTS, SERVERS = 8, 2
RIG = {name: value for name, value in CASE.items() if name != "v0"}
SPEEDS = np.geomspace(1e-3, 1.0, 10_000).tolist()
ROWS = [{**CASE, "v0": v0} for v0 in SPEEDS[::10]]


class Question(NamedTuple):
    method: str
    path: str
    body: bytes | None = None


def posted(path: str, **fields: object) -> Question:
    return Question("POST", path, json.dumps(fields).encode())


SHORT = posted("/v1/mu-macro", **CASE, include=["gradient", "power"])
LONG = posted(BATCH, **CASE | {"v0": np.geomspace(1e-3, 1.0, 100_000).tolist()})
QUESTIONS = {
    "one case": SHORT,
    "one case by GET": Question("GET", f"/v1/mu-macro?{urlencode(CASE)}"),
    "one value as text": Question("GET", f"/v1/mu-macro.txt?{urlencode(CASE)}"),
    "a ball": posted("/v1/mu-macro", **CASE, contact="ball"),
    "10,000 cases as columns": posted(BATCH, **CASE | {"v0": SPEEDS}),
    "1,000 rows as JSON": Question("POST", BATCH, json.dumps(ROWS).encode()),
    "a law": posted("/v1/law", **RIG, start=1e-4, stop=1.0),
    "an inverse": posted("/v1/solve-for", **RIG, unknown="v0", target=0.1),
    "a motion": posted(
        "/v1/motion",
        **{name: x for name, x in CASE.items() if name != "y0"},
        x=[1e-6, 90.0],
        y=2e-6,
    ),
    "a fit": posted(
        "/v1/fit",
        mu0=0.3,
        unknowns=["k"],
        Fz=10.0,
        y0=2e-6,
        omega=1.3e5,
        v0=[0.01, 0.1],
        mu_macro=[0.05, 0.2],
    ),
}


def ask(connection: HTTPConnection, question: Question) -> tuple[int, bytes]:
    connection.request(
        question.method, question.path, question.body, {"Content-Type": "application/json"}
    )
    reply = connection.getresponse()
    return reply.status, reply.read()


def connected(server: Server) -> HTTPConnection:
    return HTTPConnection("127.0.0.1", server.port, timeout=60)


def expected(server: Server) -> dict[str, bytes]:
    """What an idle service answers."""
    replies = {name: ask(connected(server), question) for name, question in QUESTIONS.items()}
    assert {status for status, _ in replies.values()} == {200}, replies
    return {name: body for name, (_, body) in replies.items()}


@contextmanager
def clients(loop: Callable[[int, threading.Event], None], number: int = CLIENTS) -> Iterator[None]:
    """Many clients in loops of their own, until the context ends."""
    stop = threading.Event()
    with ThreadPoolExecutor(number) as pool:
        loops = [pool.submit(loop, i, stop) for i in range(number)]
        try:
            yield
        finally:
            stop.set()
        for one in loops:
            one.result()


def mixed_load(minutes: float) -> str:
    """Clients with open connections ask everything in turn; a refused batch is asked again."""
    counts: Counter[tuple[str, str]] = Counter()
    with serving(TABLE) as server:
        right = expected(server)

        def loop(number: int, stop: threading.Event) -> None:
            connection, names = (
                connected(server),
                cycle([*QUESTIONS][number:] + [*QUESTIONS][:number]),
            )
            while not stop.is_set():
                name = next(names)
                status, body = ask(connection, QUESTIONS[name])
                counts[
                    name,
                    "refused" if status == 503 else "right" if body == right[name] else "wrong",
                ] += 1

        with asking(server) as waits, clients(loop):
            time.sleep(6.0 * minutes)
            before = server.memory()
            time.sleep(54.0 * minutes)
            grown = server.memory() - before
        assert not server.errors(), server.errors()[:1]
        code = server.stop()
    rows = [
        [name, *(f"{counts[name, what]:,}" for what in ("right", "refused", "wrong"))]
        for name in QUESTIONS
    ]
    table = markdown(("question", "right", "refused (503)", "wrong"), rows)
    return (
        f"{table}\n\nLongest wait of /livez {1e3 * max(waits).seconds:.0f} ms; {grown:.0f} MB more "
        f"at the end than after a tenth of the time; exit code {code}."
    )


def overload(minutes: float) -> str:
    """Four times as many clients with large batches as there are slots; one with short requests
    beside them."""
    counts: Counter[tuple[str, str]] = Counter()
    waits = list[float]()
    with serving(TABLE) as server:
        right = expected(server) | {"LONG": ask(connected(server), LONG)[1]}

        def loop(number: int, stop: threading.Event) -> None:
            name, question = ("one case", SHORT) if number == 0 else ("LONG", LONG)
            while not stop.is_set():
                started = time.perf_counter()
                status, headers, body = server.ask(question.method, question.path, question.body)
                if number == 0:
                    waits.append(time.perf_counter() - started)
                refused = status == 503 and int(headers["retry-after"]) >= 1
                counts[
                    name, "refused" if refused else "right" if body == right[name] else "wrong"
                ] += 1

        with clients(loop, 17):
            time.sleep(60.0 * minutes)
        most, code = server.memory("VmHWM"), server.stop()
    totals = "; ".join(f"{name}, {what}: {n:,}" for (name, what), n in sorted(counts.items()))
    return (
        f"{totals}. Longest wait of one case {1e3 * max(waits):.0f} ms, most memory {most:.0f} "
        f"MB, exit code {code}."
    )


def rolling_restart(minutes: float) -> str:
    """One of two services after the other is replaced beside clients, who ask the other one again
    if one closes."""
    counts: Counter[str] = Counter()
    with ExitStack() as stack:
        servers = [stack.enter_context(serving(TABLE)) for _ in range(SERVERS)]
        right = expected(servers[0])["one case"]

        def loop(number: int, stop: threading.Event) -> None:
            connections: dict[int, HTTPConnection] = {}
            while not stop.is_set():
                for server in [*servers[number % 2 :], *servers[: number % 2]] * 2:
                    try:
                        status, body = ask(
                            connections.setdefault(server.port, connected(server)), SHORT
                        )
                    except (OSError, HTTPException):  # the service has closed before it answered
                        connections.pop(server.port).close()
                        counts["asked again"] += 1
                        continue
                    counts["right" if (status, body) == (200, right) else f"wrong: {status}"] += 1
                    break
                else:
                    counts["lost"] += 1

        started = time.monotonic()
        with clients(loop):
            for i in cycle(range(SERVERS)):
                new = stack.enter_context(serving(TABLE))
                counts["restarts"] += 1
                counts["exit code not 0"] += servers[i].stop() != 0  # clients still ask it
                servers[i] = new
                if time.monotonic() > started + 60.0 * minutes:
                    break
    return "; ".join(f"{what}: {n:,}" for what, n in sorted(counts.items())) + "."


if __name__ == "__main__":
    main(__doc__, sections(mixed_load, overload, rolling_restart), minutes=5.0)
