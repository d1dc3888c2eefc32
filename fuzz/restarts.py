"""Processes of the service that end, on purpose or not, under load: the effect on clients.

    python fuzz/restarts.py [--only restarts] [--share 0.1] [--write]

The rolling restart needs nginx.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path

import reporting
from load import Seen, answers, closed_loop
from measuring import markdown
from serving import CASE, FAULT, Caller, Server, questions, serving

CONNECTIONS = 16


def workers_of(server: Server) -> list[int]:
    """The worker processes."""
    lines = {child: Path(f"/proc/{child}/cmdline").read_bytes() for child in server.children()}
    return [child for child, line in lines.items() if b"spawn_main" in line]


def counted(server: Server) -> float:
    """Single cases that the service has counted as answered with 200."""
    text = server.ask("GET", "/metrics")[1].decode()
    lines = re.findall(r"^mumacro_requests_total\{(.*)\} (\S+)$", text, re.MULTILINE)
    return sum(float(n) for labels, n in lines if 'route="/v1/mu-macro"' in labels and 'status="200"' in labels)


def killed_worker(share: float) -> str:
    """One of two worker processes is killed under load."""
    asked = questions({"single": 1}, 500, 1)
    with serving(workers=2) as server:
        expected = answers(server, asked)
        before = counted(server)
        seen = Seen(expected)
        first = workers_of(server)
        assert len(first) == 2, first
        seconds = max(20.0 * share, 4.0)

        def kill() -> None:
            time.sleep(seconds / 4.0)
            os.kill(first[0], signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        rate = asyncio.run(closed_loop(server.port, asked, seen, seconds, CONNECTIONS))
        killer.join()
        server.wait(3)
        assert len(workers_of(server)) == 2
        answered = seen.statuses[200]
        time.sleep(0.5)  # each worker writes its counters four times a second
        missed = answered - (counted(server) - before)
        assert set(seen.statuses) <= {200, 503}, seen.statuses  # a new worker returns 503 until its tables are loaded
        assert not seen.wrong
        assert not seen.unexplained
        assert seen.broken <= CONNECTIONS, seen.faults
        assert missed >= -CONNECTIONS, missed
        assert missed <= rate * 0.5 + CONNECTIONS, missed
        assert server.stop() == 0
    return (
        f"{seen.asked:,} requests: {seen.broken} of {CONNECTIONS} connections, those of the killed worker, broke; "
        f"{seen.statuses[503]} refused while the new worker started; all others correct; {missed:.0f} requests that "
        "the killed worker had answered last are not counted; two workers again"
    )


def stopped_while_busy(share: float) -> str:
    """SIGTERM while requests, batches and streams are in progress."""
    del share
    asked = questions({"single": 8, "batch": 2}, 200, 2000)
    line = json.dumps(CASE).encode() + b"\n"
    lines = 60
    told: list[str] = []
    with serving(DRAIN_S=1, SHUTDOWN_GRACE_S=20) as server:
        expected = answers(server, asked)
        seen, stopped, late = Seen(expected), threading.Event(), 0

        async def busy(first: int) -> None:
            nonlocal late
            caller, i = Caller(server.port), first
            while True:
                used = caller.is_open
                try:
                    reply = await caller.ask(asked[i % len(asked)].text)
                except ConnectionRefusedError:
                    return  # the port is closed
                except FAULT as error:
                    if stopped.is_set() and not used:
                        late += 1  # a new connection, while the port was being closed
                        return
                    seen.fault(error)
                    return
                seen.note(asked[i % len(asked)], 0.0, reply)
                i += 1

        async def stream() -> int:
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            head = "POST /v1/mu-macro/batch HTTP/1.1\r\nHost: x\r\nContent-Type: application/x-ndjson\r\n"
            writer.write(head.encode() + b"Transfer-Encoding: chunked\r\nConnection: close\r\n\r\n")
            text = b""
            with suppress(OSError):
                for _ in range(lines):
                    writer.write(b"%x\r\n%b\r\n" % (len(line), line))
                    await asyncio.sleep(0.1)
                writer.write(b"0\r\n\r\n")
                while piece := await reader.read(65536):
                    text += piece
            writer.close()
            return text.count(b'"mu_macro"')

        async def look() -> None:
            while True:
                try:
                    said = str((await Caller(server.port).ask(b"GET /readyz HTTP/1.1\r\nHost: x\r\n\r\n")).status)
                except OSError:
                    said = "closed"
                if told[-1:] != [said]:
                    told.append(said)
                if said == "closed":
                    return
                await asyncio.sleep(0.02)

        async def all_at_once() -> list[int]:
            tasks = [asyncio.create_task(busy(i)) for i in range(CONNECTIONS)]
            tasks.append(asyncio.create_task(look()))
            streams = [asyncio.create_task(stream()) for _ in range(8)]
            await asyncio.sleep(2.0)
            stopped.set()
            server.process.send_signal(signal.SIGTERM)
            await asyncio.gather(*tasks)
            return list(await asyncio.gather(*streams))

        found = asyncio.run(all_at_once())
        code = server.process.wait(timeout=60)
        assert code == 0, code
        assert seen.verdict == "held", seen.verdict
        assert found == 8 * [lines], found
        assert told == ["200", "503", "closed"], told
    return (
        f"{seen.asked:,} requests and 8 streams of {lines} lines, which continued for seconds after SIGTERM: all "
        f"answered; {late} of {CONNECTIONS} clients that opened a new connection at the end were refused; /readyz "
        "returned 503 before the port was closed; exit code 0"
    )


def free_port() -> int:
    """An unused port."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


NGINX = """
{user}
daemon off;
worker_processes 1;
pid {folder}/nginx.pid;
error_log {folder}/error.log warn;
events {{ worker_connections 1024; }}
http {{
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    upstream mumacro {{
        server 127.0.0.1:{ports[0]} max_fails=0;
        server 127.0.0.1:{ports[1]} max_fails=0;
        keepalive 32;
    }}
    server {{
        listen 127.0.0.1:{port};
        location / {{
            proxy_pass http://mumacro;
            proxy_http_version 1.1;
            proxy_set_header Connection "";
            proxy_next_upstream error timeout http_503 non_idempotent;
        }}
    }}
}}
"""


@contextmanager
def proxy(ports: list[int]) -> Iterator[int]:
    """nginx in front of these ports; yields its own port."""
    program = shutil.which("nginx", path=os.environ.get("PATH", "") + ":/usr/sbin")
    if program is None:
        raise reporting.NotTriedError("nginx is not installed")
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "nginx.conf"
        user = "user root;" if os.getuid() == 0 else ""
        path.write_text(NGINX.format(user=user, folder=folder, ports=ports, port=port))
        process = subprocess.Popen([program, "-e", f"{folder}/error.log", "-c", str(path)], stderr=subprocess.DEVNULL)
        try:
            deadline = time.monotonic() + 30.0
            while True:
                with suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                    break
                assert process.poll() is None, (Path(folder) / "error.log").read_text()
                assert time.monotonic() < deadline
                time.sleep(0.05)
            yield port
        finally:
            process.terminate()
            process.wait(timeout=30)


def rolling_restart(share: float, total: int = 100_000) -> str:
    """Two replicas behind nginx are restarted one after the other, repeatedly, under load."""
    total = max(1000, round(total * share))
    asked = questions({"single": 9, "batch": 1}, 500, 100)
    ports = [free_port(), free_port()]
    made, chance, over = 0, random.Random(3), threading.Event()  # noqa: S311
    errors: list[str] = []
    with ExitStack() as stack:

        def replica(port: int) -> tuple[ExitStack, Server]:
            own = ExitStack()
            server = own.enter_context(serving("--port", str(port), DRAIN_S=1))
            return own, server

        running = [replica(port) for port in ports]
        stack.callback(lambda: [own.close() for own, _ in running])
        port = stack.enter_context(proxy(ports))
        expected = answers(running[0][1], asked)
        seen = Seen(expected)

        def ask_on() -> None:
            while seen.asked < total or made < 2:
                asyncio.run(closed_loop(port, asked, seen, 2.0, CONNECTIONS))
                if seen.verdict != "held":
                    break
            over.set()

        caller = threading.Thread(target=ask_on)
        caller.start()
        try:
            while not over.wait(chance.uniform(0.5, 2.0)):
                which = made % 2
                own, server = running[which]
                assert server.stop() == 0
                errors.extend(server.errors())
                own.close()
                running[which] = replica(ports[which])
                made += 1
        finally:
            over.wait(300)
            caller.join()
        assert not errors, errors[0][-1000:]
        assert seen.verdict == "held", seen.verdict
        assert set(seen.statuses) == {200}, seen.statuses
    return f"{seen.asked:,} requests during {made} restarts, 0 failed, all responses correct to the bit"


RESTARTS: dict[str, Callable[[float], str]] = {
    "SIGKILL of one of two workers": killed_worker,
    "SIGTERM with requests, batches and streams in progress": stopped_while_busy,
    "rolling restart of two replicas behind nginx": rolling_restart,
}


def restarts(share: float) -> str:
    """Every trial once."""
    started = time.perf_counter()
    rows = [[name, *reporting.tried(partial(trial, share))] for name, trial in RESTARTS.items()]
    return f"{markdown(('event', 'result', 'what was seen'), rows, 3)}\n\n{reporting.took(started)}"


SECTIONS = {"restarts": restarts}

if __name__ == "__main__":
    reporting.report(__doc__ or "", SECTIONS)
