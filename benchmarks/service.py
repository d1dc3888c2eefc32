"""Cost of a request over HTTP: processor time of this service and of others, waits beside batches,
start, memory.

    python benchmarks/service.py [--write]    takes about three minutes

Linux, two processors: one for the servers, one for the client.  Servers run at the same time and
get the same requests in turn, so that other load slows all of them; figures are medians of the
rounds.
"""

from tests.support.measuring import FINEST, main, markdown, sections  # isort: split

import http.client
import json
import math
import os
import socket
import statistics
import sys
import tempfile
import threading
import time
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from tests.support.serving import CASE, Server, asking, connect, head, running, serving

FIRST, CLIENT = ("taskset", "-c", "0"), {1}  # the processors of the servers and of the client
ROUNDS, REQUESTS, CLIENTS = 15, 800, 16
BATCH = "/v1/mu-macro/batch"


def post(case: dict[str, Any], path: str = "/v1/mu-macro") -> bytes:
    body = json.dumps(case).encode()
    return head(path, len(body)) + body


def get(case: dict[str, Any], path: str = "/v1/mu-macro") -> bytes:
    query = "&".join(f"{name}={value}" for name, value in case.items())
    return f"GET {path}?{query} HTTP/1.1\r\nHost: x\r\n\r\n".encode()


FORMS = {
    "POST": post(CASE),
    "GET": get(CASE),
    "POST, rigid": post({**CASE, "k": "rigid"}),
    "GET, rigid": get({**CASE, "k": "rigid"}),
    "POST, power": post({**CASE, "include": ["power"]}),
    "GET, power": get({**CASE, "include": "power"}),
    ".txt": get(CASE, "/v1/mu-macro.txt"),
}


def ask(server: Server, request: bytes, number: int, clients: int) -> None:
    """Send a request so many times on so many connections; every answer must be 200."""
    with ExitStack() as stack:
        connections = [stack.enter_context(connect(server)) for _ in range(clients)]
        for _ in range(number // clients):
            for raw in connections:
                raw.sendall(request)
            for raw in connections:
                read(raw)


def read(raw: socket.socket) -> None:
    answer = http.client.HTTPResponse(raw, method="POST")
    answer.begin()
    text = answer.read()
    if answer.status != 200:
        raise SystemExit(f"status {answer.status}: {text[:300]!r}")


def batch(server: Server, body: bytes) -> None:
    with connect(server) as raw:
        sending = threading.Thread(target=raw.sendall, args=(head(BATCH, len(body)) + body,))
        sending.start()
        read(raw)
        sending.join()


def peer(name: str, folder: str) -> AbstractContextManager[Server]:
    return running(
        [*FIRST, sys.executable, "-m", "benchmarks.service_peers", name], Path(folder) / name
    )


def single() -> str:
    os.sched_setaffinity(0, CLIENT)  # else it interrupts the servers whenever they answer
    times_of: dict[str, list[tuple[float, float]]] = {}
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(FINEST, before=FIRST) as own,
        peer("raw", folder) as raw,
        peer("fastapi", folder) as fast,
    ):
        requests = [(f"this service, {name}", own, text) for name, text in FORMS.items()]
        requests.append(("FastAPI, models in and out", fast, FORMS["POST"]))
        for _ in range(1 + ROUNDS):
            for name, server, text in requests:
                times = []
                for one, request in ((raw, FORMS["POST"]), (server, text)):
                    before = one.busy()
                    ask(one, request, REQUESTS, CLIENTS)
                    times.append((one.busy() - before) / REQUESTS * 1e6)
                times_of.setdefault(name, []).append((times[0], times[1]))
    times_of = {name: pairs[1:] for name, pairs in times_of.items()}
    rows = []
    for name, pairs in times_of.items():
        ratio = statistics.median(own / floor for floor, own in pairs)
        rows.append((name, f"{statistics.median(own for _, own in pairs):.0f}", f"{ratio:.2f}"))
    mean = math.exp(statistics.fmean(math.log(float(row[2])) for row in rows[: len(FORMS)]))
    floor = statistics.median(floor for pairs in times_of.values() for floor, _ in pairs)
    rows.append(("raw ASGI, nothing checked", f"{floor:.0f}", "1.00"))
    return (
        f"{markdown(('one case', 'processor time [us]', 'times raw ASGI'), rows)}\n\nGeometric "
        f"mean: {mean:.2f}."
    )


def body_of(form: str, n: int) -> bytes:
    random = np.random.default_rng(n)
    table = {
        "mu0": random.uniform(0.1, 0.9, n),
        "Fz": 10 ** random.uniform(0, 2, n),
        "k": 10 ** random.uniform(5, 7, n),
        "y0": 10 ** random.uniform(-8, -4, n),
        "omega": 10 ** random.uniform(4, 6, n),
        "v0": 10 ** random.uniform(-4, 1, n),
    }
    if form == "columns":
        return orjson.dumps(table, option=orjson.OPT_SERIALIZE_NUMPY)
    columns = (column.tolist() for column in table.values())
    return orjson.dumps([dict(zip(table, row, strict=True)) for row in zip(*columns, strict=True)])


def batches() -> str:
    """Speed of 100,000 cases, also beside orjson and six arrays of the same body, and of the same
    cases in columns; the waits of short requests beside them and beside a million; the largest
    memory."""
    rows, columns = [], body_of("columns", 100_000)
    settings = dict.fromkeys(("MUMACRO_MAX_BODY_BYTES", "MUMACRO_MAX_HELD_BYTES"), "1000000000")
    settings["MUMACRO_MAX_BATCH"] = "1000000"
    with serving(FINEST, before=FIRST, ready=True, **settings) as own:
        for form in ("columns", "rows"):
            body = body_of(form, 100_000)
            batch(own, body)
            speeds, ratios, of_columns = [], [], []
            for _ in range(ROUNDS):
                before = own.busy()
                batch(own, body)
                took = own.busy() - before
                speeds.append(0.1 / took)
                ratios.append(took / arrays_of(body))
                of_columns.append(took / arrays_of(columns))
            waits = [f"{1e3 * longest(own, body, 5):.0f}"]
            waits.append(f"{1e3 * longest(own, body_of(form, 1_000_000), 1):.0f}")
            beside = [f"{statistics.median(each):.2f}" for each in (ratios, of_columns)]
            memory = f"{own.memory('VmHWM'):.0f}"
            rows.append((form, f"{statistics.median(speeds):.2g}", *beside, *waits, memory))
    head = (
        "as",
        "million cases per processor second",
        "times orjson and six arrays",
        "the same of columns",
        "longest wait [ms]",
        "beside a million cases [ms]",
        "largest memory so far [MB]",
    )
    return markdown(head, rows)


def arrays_of(body: bytes) -> float:
    """Processor time of reading columns or rows by orjson into arrays, and nothing else [s]."""
    before = time.process_time()
    cases = orjson.loads(body)
    if isinstance(cases, dict):
        columns = [*cases.values()]
    else:
        columns = [[row[name] for row in cases] for name in cases[0]]
    for values in columns:
        np.array(values, np.float64)
    return time.process_time() - before


def longest(server: Server, body: bytes, number: int) -> float:
    """The longest of the waits for ``/livez`` on new connections while batches are answered [s]."""
    with asking(server, 0.002) as waits:
        for _ in range(number):
            batch(server, body)
    return max(waits).seconds


def start() -> str:
    times, idle = [], 0.0
    for _ in range(3):
        with serving(FINEST, ready=False, before=FIRST) as own:
            times.append(own.wait_until_ready())
            time.sleep(1.0)
            idle = own.memory()
    rows = [
        ("ready after [s]", f"{statistics.median(times):.2f}"),
        ("memory of an idle process [MB]", f"{idle:.0f}"),
    ]
    return markdown(("one worker, one table", ""), rows)


if __name__ == "__main__":
    main(__doc__, sections(single, batches, start))
