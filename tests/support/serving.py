"""A server process on a loopback port, for tests, benchmarks and fuzz."""

import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from http.client import HTTPConnection
from pathlib import Path
from typing import Any, NamedTuple

from tests.support.places import ROOT

CASE: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
START_S = 180.0


class Server:
    """A process and its log.  Its port is the one that the log names; the service's own settings
    are left out."""

    def __init__(
        self, command: Sequence[str], log: Path, cwd: Path = ROOT, **environment: str
    ) -> None:
        variables = {
            name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")
        }
        variables |= {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1", **environment}
        self.log, self._lines, self.started = log, list[str](), time.monotonic()
        with log.open("wb") as sink:
            self.process = subprocess.Popen(
                command,
                cwd=cwd,
                env=variables,
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        #: the process that serves, which in a container is another one
        self.pid = self.process.pid
        while (
            address := re.search(r"(?i)running on http://[^ ]+:(\d+)[ /]", log.read_text("utf-8"))
        ) is None:
            assert self.process.poll() is None, log.read_text("utf-8")
            self.in_time()
        self.port = int(address[1])
        self.url = f"http://127.0.0.1:{self.port}"

    def in_time(self, pause: float = 0.02) -> None:
        """Wait a little, unless the start has already taken too long."""
        assert time.monotonic() < self.started + START_S, self.log.read_text("utf-8")
        time.sleep(pause)

    @property
    def lines(self) -> list[str]:
        """The lines of the log so far; all of them, where the process was ended here."""
        if self.log.exists():
            # only at "\n"
            self._lines = [line for line in self.log.read_text("utf-8").split("\n") if line]
        return self._lines

    def ask(
        self,
        method: str,
        path: str,
        body: Any = None,
        headers: dict[str, str] | None = None,
        **options: Any,
    ) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body of a response, on a connection of its own."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(method, path, body, headers or {}, **options)
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def wait_until_ready(self, workers: int = 1) -> float:
        """Wait until every worker can answer, or refuses for good because of its tables; seconds
        from the start."""
        while True:
            with suppress(OSError):  # with several workers the log names the port before it is open
                status, _, body = self.ask("GET", "/readyz")
                refused = status != 200 and b"not loaded yet" not in body
                if refused or (
                    status == 200
                    and sum("tables are loaded" in line for line in self.lines) >= workers
                ):
                    return time.monotonic() - self.started
            self.in_time()

    def memory(self, what: str = "VmRSS") -> float:
        """Megabytes."""
        lines = Path(f"/proc/{self.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(what)) / 1024.0

    def busy(self) -> float:
        """Processor time of all threads [s]; the clock's number is that of clock_getcpuclockid(3)
        on Linux."""
        return time.clock_gettime(~self.pid << 3 | 2)

    def errors(self) -> list[str]:
        return [line for line in self.lines if re.search(r'"logger": ?"mumacro.error"', line)]

    def stop(self, number: int = signal.SIGTERM) -> int:
        self.process.send_signal(number)
        return self.wait()

    def wait(self) -> int:
        return self.process.wait(timeout=120)

    def kill(self) -> None:
        """End the process and its workers."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        self._lines = self.lines


@contextmanager
def serving(
    tables: Path = ROOT / "tables",
    *arguments: str,
    ready: bool = True,
    before: Sequence[str] = (),
    **environment: str,
) -> Iterator[Server]:
    """A service until the context ends, without the guide, which a checkout may have or not;
    ``before`` stands before its command, as ``taskset`` does."""
    environment = {"MUMACRO_GUIDE": "", **environment}
    command = [
        *before,
        sys.executable,
        "-m",
        "service",
        "--port",
        "0",
        "--tables",
        str(tables),
        *arguments,
    ]
    with (
        tempfile.TemporaryDirectory() as folder,
        running(command, Path(folder) / "log.jsonl", ROOT, **environment) as server,
    ):
        if ready:
            server.wait_until_ready()
        yield server


@contextmanager
def serving_image(image: str) -> Iterator[Server]:
    """The service of an image by podman, as in production with 512 MiB, until the context ends."""
    with tempfile.TemporaryDirectory() as folder:
        number = Path(folder, "pid")
        command = ["podman", "run", "--rm", "--network=host", f"--pidfile={number}"]
        command += ["--memory=512m", "--memory-swap=512m", "--read-only", "--cap-drop=all"]
        command += ["--security-opt=no-new-privileges", "--env=MUMACRO_HOST=127.0.0.1"]
        with running([*command, "--env=MUMACRO_PORT=0", image], Path(folder, "log")) as server:
            server.pid = int(number.read_text())
            try:
                server.wait_until_ready()
                yield server
            finally:
                with suppress(ProcessLookupError):
                    os.kill(server.pid, signal.SIGKILL)
                server.wait()


@contextmanager
def running(
    command: Sequence[str], log: Path, cwd: Path = ROOT, **environment: str
) -> Iterator[Server]:
    """Any server until the context ends."""
    server = Server(command, log, cwd, **environment)
    try:
        yield server
    finally:
        server.kill()


class Wait(NamedTuple):
    """How long a client waited: on the clock, and by the processor time that the service took
    meanwhile, which no other program lengthens."""

    seconds: float
    busy: float


@contextmanager
def asking(server: Server, pause: float = 0.02) -> Iterator[list[Wait]]:
    """Ask ``/livez`` on new connections until the context ends; it must always answer 200.  The
    waits."""
    stop, waits = threading.Event(), list[Wait]()

    def ask() -> None:
        while not waits or not stop.wait(pause):
            started, before = time.perf_counter(), server.busy()
            assert server.ask("GET", "/livez")[0] == 200
            waits.append(Wait(time.perf_counter() - started, server.busy() - before))

    with ThreadPoolExecutor(1) as pool:
        loop = pool.submit(ask)
        try:
            yield waits
        finally:
            stop.set()
        loop.result()


def connect(server: Server, receive_buffer: int | None = None) -> socket.socket:
    raw = socket.socket()
    if receive_buffer is not None:
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    raw.settimeout(60)
    raw.connect(("127.0.0.1", server.port))
    return raw


def head(path: str, length: int | None, kind: str = "application/json", extra: str = "") -> bytes:
    """The head of a POST; without a length the body comes in chunks."""
    size = "Transfer-Encoding: chunked" if length is None else f"Content-Length: {length}"
    return (
        f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\n{size}\r\n{extra}\r\n".encode()
    )


def chunk(piece: bytes) -> bytes:
    """A piece of a body without a length; the empty one is its end."""
    return b"%x\r\n%b\r\n" % (len(piece), piece)


def to_end(raw: socket.socket) -> bytes:
    """All bytes until the server closes."""
    received = b""
    with suppress(ConnectionResetError):
        while piece := raw.recv(65536):
            received += piece
    return received
