"""Shared by the scripts that test the service: a server process on a loopback port, and its clients."""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import Any, NamedTuple

import reporting

__all__ = ["CASE", "FAULT", "Caller", "Question", "Reply", "Server", "open_files", "questions", "serving"]

START_S = 180.0
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
FAULT = (OSError, EOFError, asyncio.IncompleteReadError, ValueError)  # connection ended, or response not valid


def open_files(wanted: int) -> None:
    """Allow this process, and those that it starts, this number of open files."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(wanted, hard), hard))


# --- the server ---------------------------------------------------------------------------------------


class Server:
    """A service process; its log goes to a file."""

    def __init__(self, process: subprocess.Popen[bytes], log: Path) -> None:
        self.process, self.log = process, log
        deadline = time.monotonic() + START_S
        while (found := re.search(r"running on http://[^ ]+:(\d+) ", log.read_text())) is None:
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < deadline, "the service does not start"
            time.sleep(0.05)
        self.port = int(found[1])

    def ask(self, method: str, path: str, body: str | bytes | None = None, **headers: str) -> tuple[int, bytes]:
        """Status and body of the response, on a separate connection."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            named = {name.replace("_", "-"): value for name, value in headers.items()}
            connection.request(method, path, body, named)
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def wait(self, workers: int = 1) -> None:
        """Wait until this number of workers have loaded their tables and are ready."""
        deadline = time.monotonic() + START_S
        while self.log.read_text().count("tables are loaded") < workers or self.ask("GET", "/readyz")[0] != 200:
            assert time.monotonic() < deadline, self.log.read_text()[-2000:]
            time.sleep(0.05)

    def memory(self, what: str = "VmRSS") -> float:
        """Megabytes."""
        lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(what)) / 1024.0

    def busy(self) -> float:
        """Processor time used [s]."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def children(self) -> list[int]:
        """Its child processes."""
        number = self.process.pid
        return [int(child) for child in Path(f"/proc/{number}/task/{number}/children").read_text().split()]

    def errors(self) -> list[str]:
        """Lines of its log about unexpected errors."""
        return [line for line in self.log.read_text().splitlines() if '"logger": "mumacro.error"' in line]

    def stop(self, number: int = signal.SIGTERM) -> int:
        """Stop the process; returns the exit code."""
        self.process.send_signal(number)
        return self.process.wait(timeout=120)


@contextmanager
def serving(*words: str, workers: int = 1, **settings: object) -> Iterator[Server]:
    """A service on the committed tables, ready, until the context ends; settings without their prefix."""
    variables = {name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")}
    variables |= {"PYTHONPATH": str(reporting.ROOT), "MUMACRO_WORKERS": str(workers)}
    variables |= {f"MUMACRO_{name}": str(value) for name, value in settings.items()}
    command = [sys.executable, "-m", "service", *(words or ("--port", "0"))]
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.jsonl"
        with log.open("wb") as sink:
            process = subprocess.Popen(
                command, cwd=reporting.ROOT, env=variables, stdout=sink, stderr=sink, start_new_session=True
            )
        try:
            server = Server(process, log)
            server.wait(workers)
            yield server
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


# --- clients ------------------------------------------------------------------------------------------


class Reply(NamedTuple):
    """A response as received."""

    status: int
    headers: dict[bytes, bytes]
    body: bytes


class Caller:
    """One connection, opened for the first request and reopened after it was closed."""

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        self._place = host, port
        self._reader: asyncio.StreamReader | None = None
        self._writer: asyncio.StreamWriter | None = None

    @property
    def is_open(self) -> bool:
        """Whether the next request uses an existing connection."""
        return self._writer is not None

    async def ask(self, text: bytes) -> Reply:
        """Send the request, read the response; raises one of FAULT."""
        if self._writer is None:
            self._reader, self._writer = await asyncio.open_connection(*self._place)
        assert self._reader is not None
        try:
            self._writer.write(text)
            reply = await read_reply(self._reader)
        except BaseException:
            self.close()
            raise
        if reply.headers.get(b"connection") == b"close":
            self.close()
        return reply

    def close(self) -> None:
        """Close the connection."""
        if self._writer is not None:
            self._writer.close()
        self._reader = self._writer = None


async def read_reply(reader: asyncio.StreamReader) -> Reply:
    """The next response on a connection."""
    head = (await reader.readuntil(b"\r\n\r\n")).split(b"\r\n")
    headers = {}
    for line in head[1:-2]:
        name, _, value = line.partition(b": ")
        headers[name.lower()] = value
    status = int(head[0][9:12])
    if status in (204, 304):
        body = b""
    elif b"content-length" in headers:
        body = await reader.readexactly(int(headers[b"content-length"]))
    else:
        pieces = []
        while size := int(await reader.readline(), 16):
            pieces.append((await reader.readexactly(size + 2))[:-2])
        await reader.readexactly(2)
        body = b"".join(pieces)
    return Reply(status, headers, body)


class Question(NamedTuple):
    """A request and its kind."""

    kind: str
    text: bytes


def request(path: str, body: bytes | None = None, kind: str = "application/json") -> bytes:
    """A request as bytes."""
    if body is None:
        return f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode()
    head = f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n\r\n"
    return head.encode() + body


def case(chance: random.Random) -> dict[str, float]:
    """A random case inside the table's range or near it."""
    spans = {"mu0": (-1, 0), "Fz": (0, 3), "k": (4, 8), "y0": (-8, -4), "omega": (3, 6), "v0": (-5, 1)}
    return {name: 10.0 ** chance.uniform(*span) for name, span in spans.items()}


def questions(shares: dict[str, int], n: int, size: int, seed: int = 1) -> list[Question]:
    """``n`` random requests of these kinds, in proportion to the shares; batches have ``size`` cases.

    Kinds: "single", "batch", "stream", "inverse", "law", "page".
    """
    chance = random.Random(seed)  # noqa: S311
    made = []
    pages: Sequence[str] = ("/", "/static/page/main.js", "/v1/table", "/readyz", "/static/page/map.json")
    for kind in chance.choices(list(shares), list(shares.values()), k=n):
        one: dict[str, Any] = case(chance)
        if kind == "single" and chance.random() < 0.5:
            text = request("/v1/mu-macro?" + "&".join(f"{name}={value!r}" for name, value in one.items()))
        elif kind == "single":
            text = request("/v1/mu-macro", json.dumps(one).encode())
        elif kind == "batch":
            one["v0"] = [10.0 ** chance.uniform(-5, 1) for _ in range(size)]
            text = request("/v1/mu-macro/batch", json.dumps(one).encode())
        elif kind == "stream":
            lines = "".join(json.dumps(case(chance)) + "\n" for _ in range(max(1, size // 10)))
            text = request("/v1/mu-macro/batch", lines.encode(), "application/x-ndjson")
        elif kind == "inverse":
            del one["v0"]
            asked = {**one, "unknown": "v0", "quantity": "mu_ratio", "target": chance.uniform(0.1, 0.9)}
            text = request("/v1/solve-for", json.dumps(asked).encode())
        elif kind == "law":
            del one["v0"]
            law = {**one, "start": 1e-5, "stop": 10.0, "points": size, "include": ["power", "stick_fraction"]}
            text = request("/v1/law", json.dumps(law).encode())
        else:
            text = request(chance.choice(pages))
        made.append(Question(kind, text))
    return made
