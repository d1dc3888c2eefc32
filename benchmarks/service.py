"""Cost of a request over HTTP: processor time of this service and of others, waits beside batches, start, memory.

    python benchmarks/service.py            prints the tables, takes about three minutes
    python benchmarks/service.py --write    and writes them to docs/service.md

Linux, two processors: one for the servers, one for the client.  Servers run at the same time and get the same requests
in turn, so that other load slows all of them; figures are medians of the rounds.
"""

from __future__ import annotations

import argparse
import http.client
import json
import math
import os
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # before this folder, which has a "service", too

import numpy as np
import orjson
from measuring import ROOT, free_port, machine, markdown, progress, write_section

PAGE = ROOT / "docs" / "service.md"
TABLE = ROOT / "tables" / "mumacro-1e-12.nc"
BATCH = "/v1/mu-macro/batch"
CASE: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
ROUNDS, REQUESTS, CLIENTS = 5, 800, 16
KINDS = {
    "columns": "application/json", "rows": "application/json", "lines": "application/x-ndjson", "csv": "text/csv",
    "arrow": "application/vnd.apache.arrow.stream",
}  # fmt: skip


def post(case: dict[str, Any], path: str = "/v1/mu-macro") -> bytes:
    """A request."""
    body = json.dumps(case).encode()
    head = f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
    return head.encode() + body


def get(case: dict[str, Any], path: str = "/v1/mu-macro") -> bytes:
    """The same as a query."""
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


class Server:
    """A process on the first processor."""

    def __init__(self, *words: str, **settings: str) -> None:
        self.port = free_port()
        variables = {name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")}
        command = ["taskset", "-c", "0", sys.executable, *words, str(self.port)]
        self.started = time.monotonic()
        self.process = subprocess.Popen(
            command, cwd=ROOT, env={**variables, **settings}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def wait(self, request: bytes) -> float:
        """Seconds from the start to the first answer."""
        while True:
            try:
                self.ask(request, 1, 1)
                return time.monotonic() - self.started
            except OSError:
                if self.process.poll() is not None:
                    raise
                time.sleep(0.02)

    def busy(self) -> float:
        """Processor time of all threads [s]."""
        tasks = Path(f"/proc/{self.process.pid}/task")
        return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks.iterdir()) / 1e9

    def memory(self, what: str) -> float:
        """Megabytes."""
        lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(what)) / 1024.0

    def ask(self, request: bytes, number: int, clients: int) -> None:
        """Send a request so many times on so many connections; every answer must be 200."""
        made = [socket.create_connection(("127.0.0.1", self.port), timeout=60) for _ in range(clients)]
        try:
            for _ in range(number // clients):
                for raw in made:
                    raw.sendall(request)
                for raw in made:
                    answer = http.client.HTTPResponse(raw)
                    answer.begin()
                    answer.read()
                    if answer.status != 200:
                        raise SystemExit(f"status {answer.status} for {request[:200]!r}")
        finally:
            for raw in made:
                raw.close()

    def batch(self, kind: str, body: bytes) -> None:
        """Send one batch and read the answer."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=120) as raw:
            head = f"POST {BATCH} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n\r\n"
            sending = threading.Thread(target=raw.sendall, args=(head.encode() + body,))
            sending.start()
            answer = http.client.HTTPResponse(raw, method="POST")
            answer.begin()
            if answer.status != 200:
                raise SystemExit(f"status {answer.status}: {answer.read(300)!r}")
            answer.read()
            sending.join()


@contextmanager
def servers(*made: Server) -> Iterator[None]:
    """End them at the end."""
    try:
        yield
    finally:
        for server in made:
            server.process.terminate()
            server.process.wait()


def service(**settings: str) -> Server:
    """This service with its defaults: checked, logged, counted."""
    return Server("-m", "service", "--tables", str(TABLE), "--port", **settings)


def peer(name: str) -> Server:
    """Another one."""
    return Server("benchmarks/service_peers.py", name)


def single() -> str:
    """The seven forms and the peers, beside raw ASGI."""
    raw, own, fast, bridge = peer("raw"), service(), peer("fastapi"), peer("umbridge")
    bridged = post({"name": "mu_macro", "input": [[*CASE.values()]], "config": {}}, "/Evaluate")
    asked = [(f"this service, {name}", own, text) for name, text in FORMS.items()]
    asked += [("FastAPI, models in and out", fast, FORMS["POST"]), ("UM-Bridge's server, a constant", bridge, bridged)]
    found: dict[str, list[tuple[float, float]]] = {}
    with servers(raw, own, fast, bridge):
        raw.wait(FORMS["POST"])
        for _, server, text in asked:
            server.wait(text)
        for _ in range(ROUNDS):
            for name, server, text in asked:
                times = []
                for one, request in ((raw, FORMS["POST"]), (server, text)):
                    before = one.busy()
                    one.ask(request, REQUESTS, CLIENTS)
                    times.append((one.busy() - before) / REQUESTS * 1e6)
                found.setdefault(name, []).append((times[0], times[1]))
    rows = []
    for name, pairs in found.items():
        ratio = statistics.median(own / floor for floor, own in pairs)
        rows.append((name, f"{statistics.median(own for _, own in pairs):.0f}", f"{ratio:.2f}"))
    mean = math.exp(statistics.fmean(math.log(float(row[2])) for row in rows[: len(FORMS)]))
    floor = statistics.median(floor for pairs in found.values() for floor, _ in pairs)
    rows.append(("raw ASGI, nothing checked", f"{floor:.0f}", "1.00"))
    return f"{markdown(('one case', 'processor time [us]', 'times raw ASGI'), rows)}\n\nGeometric mean: {mean:.2f}."


def body_of(form: str, n: int) -> bytes:
    """A batch with all digits."""
    import pyarrow as pa

    random = np.random.default_rng(n)
    table = {
        "mu0": random.uniform(0.1, 0.9, n), "Fz": 10 ** random.uniform(0, 2, n), "k": 10 ** random.uniform(5, 7, n),
        "y0": 10 ** random.uniform(-8, -4, n), "omega": 10 ** random.uniform(4, 6, n),
        "v0": 10 ** random.uniform(-4, 1, n),
    }  # fmt: skip
    if form == "columns":
        return orjson.dumps(table, option=orjson.OPT_SERIALIZE_NUMPY)
    if form == "lines":
        parts = ({name: column[i : i + 1000] for name, column in table.items()} for i in range(0, n, 1000))
        return b"".join(orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n" for part in parts)
    if form == "arrow":
        sink, batch = pa.BufferOutputStream(), pa.record_batch(table)
        with pa.ipc.new_stream(sink, batch.schema) as writer:
            writer.write_batch(batch)
        return bytes(sink.getvalue())
    rows = zip(*(column.tolist() for column in table.values()), strict=True)
    if form == "csv":
        return "\r\n".join([",".join(table), *(",".join(map(repr, row)) for row in rows)]).encode()
    return orjson.dumps([dict(zip(table, row, strict=True)) for row in rows])


def batches() -> str:
    """Speed of 100,000 cases, and the waits of short requests beside them and beside a million."""
    roomy = {"MUMACRO_MAX_BODY_BYTES": "1000000000", "MUMACRO_MAX_BATCH": "1000000"}
    own = service(**roomy)
    rows = []
    with servers(own):
        own.wait(FORMS["POST"])
        for form, kind in KINDS.items():
            body = body_of(form, 100_000)
            own.batch(kind, body)
            speeds = []
            for _ in range(ROUNDS):
                before = own.busy()
                own.batch(kind, body)
                speeds.append(0.1 / (own.busy() - before))
            waits = [longest(own, kind, body, 5)]
            waits.append(longest(own, kind, body_of(form, 1_000_000), 1) if form != "csv" else math.nan)
            rows.append(
                (
                    form,
                    f"{statistics.median(speeds):.2g}",
                    *("-" if math.isnan(wait) else f"{1e3 * wait:.0f}" for wait in waits),
                )
            )
    head = ("as", "million cases per processor second", "longest wait [ms]", "beside a million cases [ms]")
    return markdown(head, rows)


def longest(server: Server, kind: str, body: bytes, number: int) -> float:
    """The longest of the waits for ``/livez`` on new connections while batches are answered [s]."""
    waits: list[float] = []
    stop = threading.Event()

    def ask() -> None:
        while not stop.wait(0.002):
            started = time.perf_counter()
            server.ask(b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n", 1, 1)
            waits.append(time.perf_counter() - started)

    thread = threading.Thread(target=ask)
    thread.start()
    for _ in range(number):
        server.batch(kind, body)
    stop.set()
    thread.join()
    return max(waits)


def start() -> str:
    """Time to the first ready answer, and memory."""
    ready = b"GET /readyz HTTP/1.1\r\nHost: x\r\n\r\n"
    times, idle = [], 0.0
    for _ in range(3):
        own = service()
        with servers(own):
            times.append(own.wait(ready))
            time.sleep(1.0)
            idle = own.memory("VmRSS")
    rows = [("ready after [s]", f"{statistics.median(times):.2f}"), ("memory of an idle process [MB]", f"{idle:.0f}")]
    return markdown(("one worker, one table", ""), rows)


SECTIONS = {"single": single, "batches": batches, "start": start}


def main() -> None:
    """Print the tables; with ``--write`` put them on the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the tables into docs/service.md")
    parser.add_argument("--only", choices=list(SECTIONS), help="one table")
    given = parser.parse_args()
    for name, section in SECTIONS.items():
        if given.only in (None, name):
            progress(f"{name} ...")
            found = f"{section()}\n\n{machine('starlette', 'uvicorn', 'orjson', 'msgspec', 'pysimdjson')}"
            print(found, flush=True)
            if given.write:
                write_section(name, found, PAGE)


if __name__ == "__main__":
    main()
