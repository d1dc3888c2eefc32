"""Cost of a request over HTTP: processor time of this server and of others.

    python benchmarks/service.py                                 prints the tables, takes about ten minutes
    python benchmarks/service.py --write                         and writes them, with the plot, to docs/
    python benchmarks/service.py --only waiting start            some of the independent parts
    python benchmarks/service.py --peers /path/to/other/python   an interpreter with umbridge or mlserver

Needs ``wrk``, ``curl``, ``nginx``, Linux, and two processors: one for the servers, one for the clients.  Servers run
in parallel and get requests in turn, so that other load slows all of them; figures are medians of the rounds.
"""

from __future__ import annotations

import argparse
import http.client
import json
import math
import os
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

# Before this folder, where this file has the name of the package.
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
import orjson
from measuring import IMAGES, ROOT, free_port, machine, markdown, progress, quantity, write_section
from service.evaluation import answer_batch
from service.formats import choose

from mumacro.inputs import FIELDS
from service.quantities import QUANTITIES
from service.tables import LoadedTable

CHOICES = ("single", "includes", "waiting", "streams", "once", "start", "replicas", "advice")
PAGE = ROOT / "docs" / "service.md"
PLACES = {"over-http": ROOT / "README.md"}  # all others are on the page
TABLE = ROOT / "tables" / "mumacro-1e-12.nc"
TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
SERVER_CORE, CLIENT_CORE = 0, 1
BATCH = "/v1/mu-macro/batch"
MANY_FROM = 1_000  # cases up to which many clients are needed to keep a server busy
SIZES = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000)
ENOUGH_S = 0.6  # smallest processor time for a figure: the clock ticks in hundredths
KINDS = {
    "columns": "application/json",
    "gzip": "application/json",
    "rows": "application/json",
    "lines": "application/x-ndjson",
    "arrow": "application/vnd.apache.arrow.stream",
}
AT_ONCE = (1, 4, 8)  # the last: as many as are answered in parallel
INCLUDED = tuple(name for name in QUANTITIES if name != "std")  # which needs deviations, too
WAITED_FOR = {100_000: 30, 1_000_000: 5}  # cases of the batches during which short requests are sent: their number
LABELS = {
    "columns": "JSON columns", "gzip": "JSON columns, answer in gzip", "rows": "JSON rows",
    "lines": "NDJSON, blocks of 1,000", "arrow": "Arrow",
}  # fmt: skip


# --- processes ----------------------------------------------------------------------------------------


@dataclass
class Server:
    """A server process that listens on ``port``."""

    name: str
    process: subprocess.Popen[bytes]
    port: int

    def cpu(self) -> float:
        """Processor time so far [s], all threads."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) * TICK_S

    def memory(self, key: str = "VmRSS") -> float:
        """Resident memory [MB]."""
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith(key):
                return int(line.split()[1]) / 1000.0
        raise ValueError(key)

    def forget_peak(self) -> float:
        """Reset the peak (VmHWM) to the resident memory, and return that [MB]."""
        Path(f"/proc/{self.process.pid}/clear_refs").write_text("5")
        return self.memory("VmHWM")

    def ask(self, method: str, path: str, body: bytes = b"", kind: str = "application/json") -> tuple[int, bytes]:
        """One exchange on a new connection; sends and reads at the same time, as needed for a stream."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=120) as raw:
            head = f"{method} {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n\r\n"
            sender = threading.Thread(target=raw.sendall, args=(head.encode() + body,))
            sender.start()
            reply = http.client.HTTPResponse(raw, method=method)
            reply.begin()
            received = reply.read()
            sender.join()
            return reply.status, received


class Caller:
    """A kept connection, as used by clients with many requests."""

    def __init__(self, port: int) -> None:
        self._raw = socket.create_connection(("127.0.0.1", port), timeout=120)
        self._raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def ask(self, path: str, body: bytes, kind: str, accept: str = "identity") -> int:
        """POST; sends and reads at the same time, as needed for a stream.  Return the status."""
        head = (
            f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n"
            f"Accept-Encoding: {accept}\r\n\r\n"
        )
        sender = threading.Thread(target=self._raw.sendall, args=(head.encode() + body,))
        sender.start()
        reply = http.client.HTTPResponse(self._raw, method="POST")
        reply.begin()
        while reply.read(1 << 20):
            pass
        sender.join()
        return reply.status


@contextmanager
def running(name: str, command: Sequence[str], port: int, path: str) -> Iterator[Server]:
    """Start a server on its core; yield it when ``path`` answers."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MUMACRO_")}
    environment |= {"MUMACRO_MAX_BATCH": "1000000", "MUMACRO_MAX_BODY_BYTES": str(2**30), "PYTHONPATH": str(ROOT)}
    words = ["taskset", "-c", str(SERVER_CORE), *command]
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(words, cwd=ROOT, env=environment, stdout=log, stderr=log)
        server = Server(name, process, port)
        try:
            deadline = time.monotonic() + 120
            while True:
                with suppress(OSError):
                    if server.ask("GET", path)[0] != 503:  # the port is open but the service is not ready
                        break
                if process.poll() is not None or time.monotonic() > deadline:
                    log.seek(0)
                    raise RuntimeError(f"{name} did not start: {log.read()[-2000:].decode()}")
                time.sleep(0.01)
            yield server
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                try:
                    process.wait(20)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


def ours() -> Any:
    """This service with one worker and default settings, with logs and counters."""
    port = free_port()
    command = [sys.executable, "-m", "service", "--port", str(port), "--tables", str(TABLE)]
    return running("mumacro", command, port, "/readyz")


def peer(name: str, python: str = sys.executable) -> Any:
    """One of benchmarks/service_peers.py."""
    port = free_port()
    command = [python, str(ROOT / "benchmarks" / "service_peers.py"), name, str(port)]
    return running(name, command, port, "/v2/health/live" if name == "mlserver" else "/Info")


def has(python: str, module: str) -> bool:
    """Whether that interpreter finds the module."""
    code = f"import importlib.util as u, sys; sys.exit(u.find_spec({module!r}) is None)"
    return subprocess.run([python, "-c", code], check=False).returncode == 0


# --- one case -----------------------------------------------------------------------------------------

_SCRIPT = """
local paths, bodies, n = {%s}, {%s}, 0
wrk.headers["Content-Type"] = "application/json"
request = function()
  n = n %% #paths + 1
  return wrk.format("%s", paths[n], nil, bodies[n])
end
"""


@dataclass
class Question:
    """A kind of request, with some variants."""

    method: str
    paths: list[str]
    bodies: list[str]

    def script(self, folder: Path) -> Path:
        """The request as a script for wrk."""
        quote = json.dumps
        text = _SCRIPT % (", ".join(map(quote, self.paths)), ", ".join(map(quote, self.bodies)), self.method)
        path = folder / f"{abs(hash(text))}.lua"
        path.write_text(text)
        return path


def cases(n: int = 64) -> list[dict[str, float]]:
    """Cases around a piezo actuator on steel."""
    return [
        {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": round(1e-3 * (i + 1) + 1.23e-4, 6)}
        for i in range(n)
    ]


def post(path: str = "/v1/mu-macro", **options: Any) -> Question:
    """One case in a body."""
    return Question("POST", [path] * 64, [json.dumps({**case, **options}) for case in cases()])


def get() -> Question:
    """One case in a query."""
    paths = ["/v1/mu-macro?" + "&".join(f"{k}={v}" for k, v in case.items()) for case in cases()]
    return Question("GET", paths, [""] * 64)


def umbridge_question() -> Question:
    """The same numbers in the protocol of UM-Bridge."""
    bodies = [json.dumps({"name": "mu_macro", "input": [list(case.values())], "config": {}}) for case in cases()]
    return Question("POST", ["/Evaluate"] * 64, bodies)


def mlserver_question() -> Question:
    """The same numbers in the Open Inference Protocol."""
    bodies = [
        json.dumps({"inputs": [{"name": "x", "shape": [1, 6], "datatype": "FP64", "data": list(case.values())}]})
        for case in cases()
    ]
    return Question("POST", ["/v2/models/mu_macro/infer"] * 64, bodies)


def load(
    server: Server, script: Path, seconds: int, connections: int = 16, by: Server | None = None
) -> tuple[float, float]:
    """Processor time [us] a request, and requests a second, with connections that send without pause.

    ``by`` is a proxy that gets the requests; its own time does not count.
    """
    before = server.cpu()
    command = ["taskset", "-c", str(CLIENT_CORE), "wrk", "-t1", f"-c{connections}", f"-d{seconds}s", "-s", str(script)]
    done = subprocess.run(
        [*command, f"http://127.0.0.1:{(by or server).port}"], capture_output=True, text=True, check=True
    ).stdout
    spent = server.cpu() - before
    if "Non-2xx" in done or "Socket errors" in done:
        raise RuntimeError(f"{server.name}: {done}")
    words = done.split()
    requests = int(words[words.index("requests") - 1])
    return 1e6 * spent / requests, float(words[words.index("Requests/sec:") + 1])


def measure_single(options: argparse.Namespace, folder: Path) -> dict[str, tuple[float, float]]:
    """Median processor time [us] and rate for every server and kind of request."""
    rounds, seconds = options.rounds, options.seconds
    peers = {
        name: python
        for python in [sys.executable, *options.peers]
        for name in ("umbridge", "mlserver")
        if has(python, name)
    }
    asked: dict[str, list[tuple[str, Question]]] = {
        "mumacro": [("POST", post()), ("GET", get())],
        "raw": [("POST", post()), ("GET", get())],
        "inside": [("POST", post())],
        "fastapi": [("POST", post())],
        "fastapi_sync": [("POST", post())],
        "umbridge": [("POST", umbridge_question())],
        "mlserver": [("POST", mlserver_question())],
    }
    found: dict[str, list[tuple[float, float]]] = {}
    contexts = [ours(), peer("raw"), peer("inside"), peer("fastapi"), peer("fastapi_sync")]
    contexts += [peer(name, python) for name, python in peers.items()]
    with _all(contexts) as servers:
        scripts: list[tuple[Server, str, Path, Server | None]] = [
            (server, f"{server.name} {name}", question.script(folder), None)
            for server in servers
            for name, question in asked[server.name]
        ]
        proxied = servers[:2]
        with _all([nginx([server], folder) for server in proxied]) as proxies:
            scripts += [
                (server, f"{server.name} POST behind nginx", post().script(folder), proxy)
                for server, proxy in zip(proxied, proxies, strict=True)
            ]
            for server, _, script, proxy in scripts:
                load(server, script, 1, by=proxy)
            for number in range(rounds):
                progress(f"single cases, round {number + 1} of {rounds}")
                for server, name, script, proxy in scripts:
                    found.setdefault(name, []).append(load(server, script, seconds, by=proxy))
    return {name: tuple(map(statistics.median, zip(*values, strict=True))) for name, values in found.items()}  # type: ignore[misc]


@contextmanager
def _all(contexts: list[Any]) -> Iterator[list[Server]]:
    if not contexts:
        yield []
        return
    with contexts[0] as first, _all(contexts[1:]) as rest:
        yield [first, *rest]


# --- batches ------------------------------------------------------------------------------------------


def columns(n: int) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
    """n random cases, all inputs different in every case, with all digits."""
    rng = np.random.default_rng(n)
    return {
        "mu0": rng.uniform(0.1, 0.9, n),
        "Fz": 10 ** rng.uniform(0, 2, n),
        "k": 10 ** rng.uniform(5, 7, n),
        "y0": 10 ** rng.uniform(-8, -4, n),
        "omega": 10 ** rng.uniform(4, 6, n),
        "v0": 10 ** rng.uniform(-4, 1, n),
    }


def body_of(form: str, n: int) -> bytes:
    """n cases as sent over HTTP."""
    table = columns(n)
    if form in ("columns", "gzip"):
        return orjson.dumps(table, option=orjson.OPT_SERIALIZE_NUMPY)
    if form == "rows":
        return orjson.dumps(
            [dict(zip(FIELDS, row, strict=True)) for row in zip(*(table[f].tolist() for f in FIELDS), strict=True)]
        )
    if form == "lines":
        blocks = ({name: column[start : start + 1000] for name, column in table.items()} for start in range(0, n, 1000))
        return b"".join(orjson.dumps(block, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n" for block in blocks)
    import pyarrow as pa

    sink = pa.BufferOutputStream()
    batch = pa.record_batch(table)
    with pa.ipc.new_stream(sink, batch.schema) as writer:
        writer.write_batch(batch)
    return bytes(sink.getvalue())


def accepted(form: str) -> str:
    """The Accept-Encoding of a client."""
    return "gzip" if form == "gzip" else "identity"


def measure_batches(rounds: int, folder: Path) -> dict[str, dict[int, float]]:
    """Million cases a second of processor time by form and size; small ones with clients that send without pause."""
    rates: dict[str, dict[int, float]] = {form: {} for form in (*KINDS, "fastapi")}
    with ours() as server, peer("fastapi") as plain:
        for n in SIZES:
            progress(f"batches of {n}")
            for form in KINDS:
                rates[form][n] = _rate(server, body_of(form, n), KINDS[form], n, rounds, folder, accepted(form))
            if n <= 100_000:
                rates["fastapi"][n] = _rate(plain, body_of("rows", n), KINDS["rows"], n, rounds, folder)
    return rates


_FILE_SCRIPT = """
local file = io.open(%s, "rb")
wrk.method, wrk.body = "POST", file:read("*a")
wrk.headers["Content-Type"], wrk.headers["Accept-Encoding"] = "%s", "%s"
wrk.path = "%s"
"""


def _rate(server: Server, body: bytes, kind: str, n: int, rounds: int, folder: Path, accept: str = "identity") -> float:
    caller = Caller(server.port)
    time.sleep(0.5)  # until batches that earlier clients left unread are released
    status = caller.ask(BATCH, body, kind, accept)  # the first batch in Arrow loads pyarrow
    if status != 200:
        raise RuntimeError(f"{server.name}: {status}")
    if n <= MANY_FROM:
        # with one client that waits for each response the server would sleep and wake up in between
        (folder / "body").write_bytes(body)
        script = folder / "body.lua"
        script.write_text(_FILE_SCRIPT % (json.dumps(str(folder / "body")), kind, accept, BATCH))
        found = []
        for _ in range(rounds):
            time.sleep(0.5)
            found.append(n / load(server, script, 1, AT_ONCE[-1])[0])
        return statistics.median(found)
    found = []
    for _ in range(rounds):
        before, asked = server.cpu(), 0
        while server.cpu() - before < ENOUGH_S:
            caller.ask(BATCH, body, kind, accept)
            asked += 1
        found.append(asked * n / (server.cpu() - before) / 1e6)
    return statistics.median(found)


def parts(rounds: int) -> dict[str, float]:
    """Million cases a second of the single steps, in this process, one thread: parsing, evaluating, writing."""
    n = 100_000
    table = LoadedTable.open(TABLE)
    bodies = {form: body_of(form, n) for form in ("columns", "rows")}
    forms = {form: choose("application/json", memoryview(body)) for form, body in bodies.items()}
    batch, _ = forms["columns"].read(bytearray(bodies["columns"]), n)
    answers = answer_batch(table, batch, (), {})
    work: dict[str, Callable[[], object]] = {
        "evaluation": lambda: answer_batch(table, batch, (), {}),
        "writing columns": lambda: sum(map(len, forms["columns"].write(answers, {}))),
        "writing rows": lambda: sum(map(len, forms["rows"].write(answers, {}))),
    }
    for form, body in bodies.items():
        for name, read in readers(form, body, n).items():
            work[f"{name}, {form}"] = read
    found: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(rounds + 1):
        for name, call in work.items():
            before = time.process_time()
            call()
            found[name].append(n / (time.process_time() - before) / 1e6)
    return {name: statistics.median(values[1:]) for name, values in found.items()}


def readers(form: str, body: bytes, n: int) -> dict[str, Callable[[], object]]:
    """Methods from the text of a batch to six arrays, and two that stop at Python objects."""
    from pydantic import BaseModel, ConfigDict, TypeAdapter

    class Columns(BaseModel):
        model_config = ConfigDict(strict=True)
        mu0: list[float]
        Fz: list[float]
        k: list[float]
        y0: list[float]
        omega: list[float]
        v0: list[float]

    class Row(BaseModel):
        model_config = ConfigDict(strict=True)
        mu0: float
        Fz: float
        k: float
        y0: float
        omega: float
        v0: float

    def arrays(values: Any, get: Callable[[Any, str], Any]) -> object:
        if form == "rows":
            return [np.array([get(row, name) for row in values]) for name in FIELDS]
        return [np.array(get(values, name)) for name in FIELDS]

    item: Callable[[Any, str], Any] = lambda value, name: value[name]  # noqa: E731
    adapter: TypeAdapter[Any] = TypeAdapter(list[Row] if form == "rows" else Columns)
    found: dict[str, Callable[[], object]] = {
        "this service": lambda: choose("application/json", memoryview(body)).read(bytearray(body), n),
        "orjson, objects only": lambda: orjson.loads(body),
        "orjson and numpy": lambda: arrays(orjson.loads(body), item),
        "json and numpy": lambda: arrays(json.loads(body), item),
        "pydantic and numpy": lambda: arrays(adapter.validate_json(body), getattr),
    }
    if has(sys.executable, "msgspec"):
        import msgspec

        fields = [(name, float if form == "rows" else list[float]) for name in FIELDS]
        struct: Any = msgspec.defstruct("Batch", fields)
        decoder = msgspec.json.Decoder(list[struct] if form == "rows" else struct)
        found["msgspec, objects only"] = lambda: decoder.decode(body)
        found["msgspec and numpy"] = lambda: arrays(decoder.decode(body), getattr)
    if has(sys.executable, "simdjson") and form == "columns":
        import simdjson

        def flat() -> object:
            document = simdjson.Parser().parse(body)
            return [np.frombuffer(document[name].as_buffer(of_type="d")) for name in FIELDS]

        found["simdjson, flattened"] = flat
    return found


# --- the rest -----------------------------------------------------------------------------------------


def measure_includes(rounds: int, folder: Path) -> list[list[str]]:
    """Added time for each included name, for one case and for a case of a batch."""
    std = {"mu0": 0.01, "v0": 1e-4}
    wanted: dict[str, dict[str, Any]] = {
        "nothing": {},
        **{name: {"include": [name]} for name in INCLUDED},
        "std": {"include": ["std"], "std": std},
    }
    n = 100_000
    table = {name: column.tolist() for name, column in columns(n).items()}
    rows = []
    with ours() as server:
        for name, options in wanted.items():
            progress(f"include {name}")
            script = post(**options).script(folder)
            load(server, script, 1)
            single = statistics.median(load(server, script, 2)[0] for _ in range(rounds))
            rate = _rate(server, orjson.dumps({**table, **options}), "application/json", n, rounds, folder)
            rows.append([name, quantity(single, 3), quantity(1e3 / rate, 3)])
    return rows


def measure_start(rounds: int) -> list[list[str]]:
    """Seconds until ready, and memory then and after work."""
    forms = {"columns": "as columns", "rows": "then as rows", "lines": "then as lines", "arrow": "then as Arrow"}
    bodies = {form: body_of(form, 100_000) for form in forms}
    names = ["ready after [s]", "memory when ready [MB]"]
    names += ["of it its own; the rest is files, which all workers share [MB]", "most memory during the start [MB]"]
    names += [f"memory two seconds after five batches of 100,000 {form} [MB]" for form in forms.values()]
    found = []
    for _ in range(rounds):
        started = time.monotonic()
        with ours() as server:
            row = [time.monotonic() - started, *map(server.memory, ("VmRSS", "RssAnon", "VmHWM"))]
            for form, body in bodies.items():
                for _ in range(5):
                    server.ask("POST", BATCH, body, KINDS[form])
                time.sleep(2.0)  # memory is released a second after the last
                row.append(server.memory())
            found.append(row)
    middle = map(statistics.median, zip(*found, strict=True))
    return [[name, quantity(value, 3)] for name, value in zip(names, middle, strict=True)]


def measure_waiting() -> list[list[str]]:
    """Waits for short requests while large batches run, compared with those of an idle server."""
    rows = []
    case = json.dumps(cases(1)[0]).encode()
    path = get().paths[0]
    with ours() as server, peer("raw") as idle:
        asked = {
            "livez": (server, "GET", "/livez", b""), "case": (server, "POST", "/v1/mu-macro", case),
            "idle": (idle, "GET", path, b""),
        }  # fmt: skip
        for n, form in product(WAITED_FOR, KINDS):
            progress(f"short requests beside {n} cases as {form}")
            body = body_of(form, n)
            waits: dict[str, list[float]] = {name: [] for name in asked}
            for _ in range(WAITED_FOR[n]):
                with ThreadPoolExecutor(1) as pool:
                    large = pool.submit(_in_another_process, server.port, body, form)
                    while not large.done():
                        for name, (other, method, target, content) in asked.items():
                            begun = time.perf_counter()
                            other.ask(method, target, content)
                            waits[name].append(time.perf_counter() - begun)
                    large.result()
            short = waits["livez"] + waits["case"]
            rows.append([
                f"{n:,}", LABELS[form], str(len(short)), *_distribution(short), *_distribution(waits["idle"])
            ])  # fmt: skip
    return rows


def _distribution(waits: list[float]) -> list[str]:
    """Median, 99 of 100, 999 of 1000 and longest [ms]."""
    ranked = sorted(waits)
    return [quantity(1e3 * ranked[min(len(ranked) - 1, int(part * len(ranked)))]) for part in (0.5, 0.99, 0.999, 1.0)]


def measure_at_once() -> list[list[str]]:
    """Peak memory above the start with this number of concurrent batches of 100,000 cases."""
    rows = []
    kinds = [(form, LABELS[form], BATCH) for form in ("columns", "rows", "arrow")]
    kinds.append(("rows", "JSON rows, all of `include` but `std`", f"{BATCH}?include={','.join(INCLUDED)}"))
    for form, label, path in kinds:
        body = body_of(form, 100_000)
        row = [label, quantity(len(body) / 1e6, 3)]
        for number in AT_ONCE:
            progress(f"{number} batches as {form} at once")
            with ours() as server:
                server.ask("POST", path, body_of(form, 1000), KINDS[form])
                base = server.forget_peak()
                statuses: list[int] = []

                given = (statuses, server, path, body, KINDS[form])
                threads = [threading.Thread(target=_note, args=given) for _ in range(number)]
                for thread in threads:
                    thread.start()
                for thread in threads:
                    thread.join()
                if statuses != [200] * number:
                    raise RuntimeError(f"{form}: {statuses}")
                row.append(quantity(server.memory("VmHWM") - base, 3))
        rows.append(row)
    return rows


def _note(statuses: list[int], server: Server, path: str, body: bytes, kind: str) -> None:
    statuses.append(server.ask("POST", path, body, kind)[0])


def _in_another_process(port: int, body: bytes, form: str) -> None:
    """Send from another process: threads of one process would wait for each other, not for the server."""
    with tempfile.NamedTemporaryFile() as file:
        file.write(body)
        file.flush()
        command = ["curl", "--silent", "--show-error", "--fail", "--output", os.devnull, "--noproxy", "*"]
        headers = (f"Content-Type: {KINDS[form]}", f"Accept-Encoding: {accepted(form)}", "Expect:")
        command += [*(word for header in headers for word in ("--header", header)), "--data-binary", f"@{file.name}"]
        subprocess.run(["taskset", "-c", str(CLIENT_CORE), *command, f"http://127.0.0.1:{port}{BATCH}"], check=True)


def send_chunks(server: Server, line: bytes, count: int) -> None:
    """A stream of ``count`` equal lines in chunks; reads the answer meanwhile, and keeps none of it."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=120) as raw:
        head = f"POST {BATCH} HTTP/1.1\r\nHost: x\r\nContent-Type: {KINDS['lines']}\r\n"

        def send() -> None:
            raw.sendall(head.encode() + b"Transfer-Encoding: chunked\r\nConnection: close\r\n\r\n")
            for _ in range(count):
                raw.sendall(b"%x\r\n%b\r\n" % (len(line), line))
            raw.sendall(b"0\r\n\r\n")

        sender = threading.Thread(target=send)
        sender.start()
        reply = http.client.HTTPResponse(raw, method="POST")
        reply.begin()
        found = 0
        while piece := reply.read(1 << 20):
            found += piece.count(b"\n")
        sender.join()
        if (reply.status, found) != (200, count):
            raise RuntimeError(f"{found} of {count} lines were answered, status {reply.status}")


def measure_streams() -> list[list[str]]:
    """Memory of the server over the length of a stream."""
    rows = []
    with ours() as server:
        line = body_of("lines", 1000)
        send_chunks(server, line, 10)
        for blocks in (100, 1000, 5000):
            progress(f"streams of {blocks} blocks")
            base = server.forget_peak()
            send_chunks(server, line, blocks)
            chunked = server.memory("VmHWM") - base
            server.ask("POST", BATCH, line * blocks, KINDS["lines"])
            sized = server.memory("VmHWM") - base
            rows.append([f"{1000 * blocks:,}", f"{chunked:.1f}", quantity(sized, 3)])
    return rows


# --- replicas and advice ------------------------------------------------------------------------------

_NGINX = """
daemon off; master_process off; pid {folder}/pid; error_log {folder}/error.log warn;
events {{ worker_connections 1024; }}
http {{
  access_log off; client_max_body_size 1g; proxy_http_version 1.1; proxy_set_header Connection "";
  proxy_set_header X-Forwarded-For $proxy_add_x_forwarded_for; proxy_set_header X-Forwarded-Proto $scheme;
  client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy; fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi; scgi_temp_path {folder}/scgi;
  upstream replicas {{ {servers} keepalive 64; }}
  server {{ listen 127.0.0.1:{port}; location / {{ proxy_pass http://replicas; }} }}
}}
"""


def nginx(replicas: Sequence[Server], folder: Path) -> Any:
    """A proxy of one process in front of some servers, on their core."""
    port = free_port()
    home = folder / f"nginx-{port}"
    home.mkdir(exist_ok=True)
    servers = " ".join(f"server 127.0.0.1:{replica.port};" for replica in replicas)
    (home / "nginx.conf").write_text(_NGINX.format(folder=home, servers=servers, port=port))
    program = shutil.which("nginx", path=f"{os.environ['PATH']}:/usr/sbin")
    if program is None:
        raise SystemExit("nginx is not installed")
    return running("nginx", [program, "-p", str(home), "-c", str(home / "nginx.conf")], port, "/readyz")


def measure_replicas(rounds: int, seconds: int, folder: Path) -> str:
    """Requests a second and processor time of one and two replicas, directly and through nginx.

    Replicas, proxy and client share two processors, so requests a second cannot double here; the growth
    with a core for each process follows from the processor time of each.
    """
    script, rows, cost = post().script(folder), [], {}
    with ours() as first, ours() as second:
        os.sched_setaffinity(second.process.pid, {CLIENT_CORE})
        for thread in Path(f"/proc/{second.process.pid}/task").iterdir():
            os.sched_setaffinity(int(thread.name), {CLIENT_CORE})
        for server in (first, second):
            load(server, script, 1)
        for label, replicas, proxied in (("one, direct", [first], False), ("one behind nginx", [first], True),
                                         ("two behind nginx", [first, second], True)):  # fmt: skip
            progress(label)
            with nginx(replicas, folder) if proxied else nullcontext(first) as asked:
                runs = []
                for _ in range(rounds):
                    before = [server.cpu() for server in (first, second)]
                    spent, rate = load(asked, script, seconds)
                    one, two = (server.cpu() - old for server, old in zip((first, second), before, strict=True))
                    a_request = 1e6 * (one + two) / (rate * seconds)
                    runs.append((rate, a_request, spent if proxied else 0.0, two / (one + two)))
                rate, service, proxy, share = map(statistics.median, zip(*runs, strict=True))
                cost[label] = (service, proxy)
                shown = quantity(proxy) if proxied else "-"
                rows.append([label, quantity(rate), quantity(service), shown, f"{share:.2f}"])
    service, proxy = cost["two behind nginx"]
    head = ["replicas", "requests/s", "service [us] a request", "nginx [us] a request", "share of the second"]
    note = (
        f"With a core for each process one replica answers {quantity(1e6 / service)} requests a second, and one "
        f"process of nginx passes {quantity(1e6 / proxy)} on: the rate grows with the number of replicas up to "
        f"{max(1, int(service / proxy))} for each process of nginx."
    )
    return markdown(head, rows) + "\n\n" + note


_LIBRARY = """
import time
import numpy as np
import mumacro
from mumacro.inputs import FIELDS
s = mumacro.open()
case = dict(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01)
s.evaluate(**case)
columns = {name: np.full(100_000, value) for name, value in case.items()}
s.on_one_thread().evaluate_columns(*columns.values())
ready = time.perf_counter()
for _ in range(10_000): s.evaluate(**case)
one = (time.perf_counter() - ready) / 1e4
ready = time.perf_counter()
s.on_one_thread().evaluate_columns(*columns.values())
print(one, (time.perf_counter() - ready) / 1e5)
"""


def measure_advice(rounds: int) -> str:
    """Time for the client by each method, and the number of cases from which it is faster."""
    with ours() as server:
        case = json.dumps(cases(1)[0]).encode()
        caller = Caller(server.port)

        def wait(ask: Callable[[], object], times: int) -> float:
            """Seconds for one, best of the rounds."""
            found = []
            for _ in range(rounds):
                begun = time.perf_counter()
                for _ in range(times):
                    ask()
                found.append((time.perf_counter() - begun) / times)
            return min(found)

        new = wait(lambda: server.ask("POST", "/v1/mu-macro", case), 200)
        kept = wait(lambda: caller.ask("/v1/mu-macro", case, KINDS["columns"]), 200)
        ways = [("one case, new connection", 0.0, new), ("one case, connection kept", 0.0, kept)]
        for form in ("columns", "arrow"):
            small, large = body_of(form, 1), body_of(form, 100_000)
            fixed = wait(lambda small=small, form=form: caller.ask(BATCH, small, KINDS[form]), 200)  # type: ignore[misc]
            whole = wait(lambda large=large, form=form: caller.ask(BATCH, large, KINDS[form]), 3)  # type: ignore[misc]
            ways.append((f"batch, {LABELS[form]}", fixed, (whole - fixed) / 1e5))
    bare, whole, single, array = [], [], [], []
    for _ in range(rounds):
        begun = time.perf_counter()
        subprocess.run([sys.executable, "-c", "pass"], check=True)
        bare.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        words = [sys.executable, "-c", _LIBRARY]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
        one, each = map(float, done)
        whole.append(time.perf_counter() - begun - 1e4 * one - 1e5 * each)
        single.append(one)
        array.append(each)
    start = min(whole) - min(bare)
    ways += [("library, a call a case", start, min(single)), ("library, arrays", start, min(array))]
    rows = []
    for name, fixed, each in ways:
        # number of cases from which this method is faster than one case at a time on a kept connection
        against = "-" if kept <= each else f"{math.ceil(fixed / (kept - each)) or 1:,}"
        rows.append([name, quantity(1e3 * fixed), quantity(1e6 * each), against])
    head = ["method", "once [ms]", "each case [us]", "faster than requests on a kept connection from [cases]"]
    return markdown(head, rows)


def plot(rates: dict[str, dict[int, float]], alone: dict[str, float], path: Path) -> None:
    """Million cases and requests a second over the size of a batch."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    colours = {
        "columns": "#c1272d",
        "gzip": "#e8898d",
        "rows": "#e08214",
        "lines": "#7b4fa3",
        "arrow": "#1f5fa8",
        "fastapi": "#7f7f7f",
    }
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
    for form, values in rates.items():
        sizes = np.array(list(values))
        cases_a_second = 1e6 * np.array(list(values.values()))
        label = LABELS.get(form, "FastAPI, list of models")
        left.loglog(sizes, cases_a_second / sizes, "o-", color=colours[form], label=label, ms=4)
        right.loglog(sizes, cases_a_second / 1e6, "o-", color=colours[form], label=label, ms=4)
    for name, style in (("orjson, objects only, columns", ":"), ("evaluation", "--")):
        right.axhline(alone[name], color="#222222", ls=style, lw=1, label=f"{name} alone")
    left.set_ylabel("requests per second of processor time")
    right.set_ylabel("million cases per second of processor time")
    for axes in (left, right):
        axes.set_xlabel("cases in a batch")
        axes.grid(True, color="#e4e4e4")
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
    plt.close(figure)


NAMES = {
    "mumacro POST": "mumacro, `POST`, checked, logged, counted",
    "mumacro GET": "mumacro, `GET`, the same, with entity tag",
    "mumacro POST behind nginx": "mumacro, `POST`, behind nginx",
    "raw POST behind nginx": "raw ASGI and orjson, `POST`, behind nginx",
    "raw POST": "raw ASGI and orjson, `POST`, nothing checked",
    "raw GET": "raw ASGI and orjson, `GET`, nothing checked",
    "inside POST": "the same as a middleware of FastAPI, `POST`",
    "fastapi POST": "FastAPI, models in and out, `async def`",
    "fastapi_sync POST": "FastAPI, models in and out, `def`",
    "umbridge POST": "UM-Bridge's Python server, a constant",
    "mlserver POST": "MLServer, its first input",
}


def single_table(single: dict[str, tuple[float, float]]) -> str:
    """One case: every server beside the floor that gets the same requests in the same way."""
    table = []
    for name, (spent, rate) in single.items():
        floor = single.get(f"raw {name.partition(' ')[2]}", single["raw POST"])[0]
        table.append([NAMES[name], quantity(spent, 3), quantity(rate, 3), f"{floor / spent:.2f}"])
    return markdown(["one case", "processor time [us]", "requests/s", "floor / this"], table)


def overview(single: dict[str, tuple[float, float]], rates: dict[str, dict[int, float]]) -> str:
    """The table of the README."""
    ours, floor, plain = (quantity(single[f"{name} POST"][0]) for name in ("mumacro", "raw", "fastapi"))
    rows = [["one case [us]", ours, plain, floor]]
    rows += [[f"{n} cases in JSON rows [us]", *(quantity(n / rates[name][n]) for name in ("rows", "fastapi")), "-"]
             for n in (10, 1_000)]  # fmt: skip
    for form, label in LABELS.items():
        peer = quantity(100 / rates["fastapi"][100_000]) if form == "rows" else "-"
        rows.append([f"100,000 cases, {label} [ms]", quantity(100 / rates[form][100_000]), peer, "-"])
    head = ("processor time of a request", "mumacro", "FastAPI, models in and out", "bare ASGI, computes nothing")
    return machine("fastapi", "uvicorn") + "\n\n" + markdown(head, rows)


def others(options: argparse.Namespace, folder: Path) -> dict[str, Callable[[], str]]:
    """The sections that are measured separately."""
    spread = ("median", "99 %", "99.9 %", "longest")
    waiting = ["[ms] beside batches of", "as", "requests", *spread, *(f"idle server: {name}" for name in spread)]
    return {
        "includes": lambda: markdown(
            ["include", "one case [us]", "a case of 100,000 in columns [ns]"], measure_includes(options.rounds, folder)
        ),
        "waiting": lambda: markdown(waiting, measure_waiting()),
        "streams": lambda: markdown(
            ["cases in a stream", "sent in chunks [MB]", "sent with a Content-Length [MB]"], measure_streams()
        ),
        "once": lambda: markdown(
            ["batches of 100,000 at once", "one body [MB]", *(f"{n} [MB]" for n in AT_ONCE)], measure_at_once()
        ),
        "start": lambda: markdown(["one worker, one table", ""], measure_start(options.rounds)),
        "replicas": lambda: measure_replicas(options.rounds, options.seconds, folder),
        "advice": lambda: measure_advice(options.rounds),
    }


def report(
    options: argparse.Namespace, folder: Path
) -> tuple[dict[str, str], dict[str, dict[int, float]], dict[str, float]]:
    """Measure everything; return the sections of the page."""
    single = measure_single(options, folder)
    sections = {"single": single_table(single)}
    rates = measure_batches(options.rounds, folder)
    alone = parts(options.rounds)
    rows = [
        [
            LABELS.get(form, "FastAPI, list of models in and out"),
            *(quantity(rates[form][n]) if n in rates[form] else "-" for n in SIZES),
        ]
        for form in rates
    ]
    sections["batches"] = markdown(["million cases/s", *(f"{n:,}" for n in SIZES)], rows)
    sections["alone"] = markdown(
        ["alone, in one thread", "million cases/s"], [[k, quantity(v)] for k, v in alone.items()]
    )
    for name, measure in others(options, folder).items():
        sections[name] = measure()
    sections["over-http"] = overview(single, rates)
    note = machine("fastapi", "uvicorn", "orjson", "pydantic", "pyarrow")
    sections["machine"] = note
    return sections, rates, alone


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=int, default=3)
    parser.add_argument("--peers", nargs="*", default=[], metavar="PYTHON")
    parser.add_argument("--only", nargs="*", default=[], choices=CHOICES)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    for program in ("wrk", "taskset", "curl"):
        if shutil.which(program) is None:
            raise SystemExit(f"{program} is not installed")
    os.sched_setaffinity(0, {CLIENT_CORE})
    with tempfile.TemporaryDirectory() as name:
        if options.only:
            measures = others(options, Path(name))
            measures["single"] = lambda: single_table(measure_single(options, Path(name)))
            sections: dict[str, str] = {chosen: measures[chosen]() for chosen in options.only}
        else:
            sections, rates, alone = report(options, Path(name))
    for text in sections.values():
        print(text, end="\n\n")
    if options.write:
        for name, text in sections.items():
            write_section(name, text, PLACES.get(name, PAGE))
        if not options.only:
            plot(rates, alone, IMAGES / "service.png")


if __name__ == "__main__":
    main()
