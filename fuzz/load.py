"""The service under load: mixed traffic, overload, and many connections that are idle or slow.

    python fuzz/load.py [--only mixed_load] [--share 0.05] [--write]

The section large_bodies needs wrk.

Clients and service share this machine, so that "capacity" is that of both together.  Requests are sent at
random moments, whether or not earlier ones are answered (an open loop), and a wait is counted from the moment at which
a request should have been sent.
"""

from __future__ import annotations

import asyncio
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import reporting
from measuring import markdown
from serving import FAULT, Caller, Question, Reply, Server, open_files, questions, serving

MIXED = {"single": 76, "batch": 10, "stream": 5, "inverse": 5, "page": 4}  # per cent of the requests
HEAVY = {"single": 20, "law": 65, "batch": 5, "stream": 5, "inverse": 5}  # laws: much work in few bytes
CONNECTIONS = 64
IDLE, SLOW = 2000, 200
MIXED_S, BESIDE_S, OVERLOAD_S, CAPACITY_S = 600.0, 60.0, 60.0, 15.0
ROUNDS = 4  # of CAPACITY_S; the slowest counts as the capacity


# --- requests and expected responses ------------------------------------------------------------------


def answers(server: Server, asked: Sequence[Question]) -> dict[bytes, bytes]:
    """The response to each request when there is no other load."""

    async def ask_all() -> dict[bytes, bytes]:
        caller = Caller(server.port)
        found = {}
        for question in asked:
            reply = await caller.ask(question.text)
            assert reply.status == 200, (question.text[:200], reply.body[:500])
            found[question.text] = reply.body
        caller.close()
        return found

    return asyncio.run(ask_all())


class Seen:
    """What the clients received."""

    def __init__(self, expected: dict[bytes, bytes]) -> None:
        self.expected = expected
        self.waits: dict[str, list[float]] = {}  # of answered requests, by kind [s]
        self.longest = 0.0, 0.0  # wait, and when it ended [s]
        self.statuses: Counter[int] = Counter()
        self.wrong = self.broken = self.unexplained = 0
        self.faults: Counter[str] = Counter()

    def note(self, question: Question, wait: float, reply: Reply) -> None:
        """Count a response."""
        self.statuses[reply.status] += 1
        if reply.status == 200:
            self.waits.setdefault(question.kind, []).append(wait)
            self.longest = max(self.longest, (wait, time.perf_counter()))
            self.wrong += reply.body != self.expected[question.text]
        elif reply.status != 503 or b"retry-after" not in reply.headers:
            self.unexplained += 1

    def fault(self, error: BaseException) -> None:
        """Count a broken connection."""
        self.broken += 1
        self.faults[type(error).__name__] += 1

    @property
    def asked(self) -> int:
        """Requests."""
        return sum(self.statuses.values()) + self.broken

    @property
    def verdict(self) -> str:
        """The result: "held" if the only failures are refusals with 503 and Retry-After."""
        bad = self.wrong + self.broken + self.unexplained
        return "held" if not bad else f"FAILED: {bad} ({dict(self.faults)}, {dict(self.statuses)})"


async def closed_loop(port: int, asked: Sequence[Question], seen: Seen, seconds: float, connections: int) -> float:
    """Every client sends its next request after the response; returns responses per second."""
    end, done = 0.0, 0

    async def ask_on(first: int, caller: Caller) -> None:
        nonlocal done
        i = first
        while (begun := time.perf_counter()) < end:
            question = asked[i % len(asked)]
            i += connections
            try:
                reply = await caller.ask(question.text)
            except FAULT as error:
                seen.fault(error)
                continue
            seen.note(question, time.perf_counter() - begun, reply)
            done += reply.status == 200
        caller.close()

    callers = [Caller(port) for _ in range(connections)]
    for caller in callers:  # one after the other, so that all workers accept some
        await caller.ask(b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n")
    end = time.perf_counter() + seconds
    await asyncio.gather(*(ask_on(*pair) for pair in enumerate(callers)))
    return done / seconds


async def open_loop(port: int, asked: Sequence[Question], seen: Seen, seconds: float, rate: float) -> float:
    """Requests at random moments, ``rate`` a second on average; each takes a free connection, or opens one.

    Ends when all are answered; returns the time at which sending ended.
    """
    chance = random.Random(2)  # noqa: S311
    free: list[Caller] = []
    tasks: set[asyncio.Task[None]] = set()

    async def ask(question: Question, due: float) -> None:
        caller = free.pop() if free else Caller(port)
        try:
            reply = await caller.ask(question.text)
        except FAULT as error:
            seen.fault(error)
        else:
            seen.note(question, time.perf_counter() - due, reply)
            free.append(caller)

    begun = due = time.perf_counter()
    while (due := due + chance.expovariate(rate)) < begun + seconds:
        wait = due - time.perf_counter()
        if wait > 0.0:
            await asyncio.sleep(wait)
        task = asyncio.create_task(ask(chance.choice(asked), due))
        tasks.add(task)
        task.add_done_callback(tasks.discard)
        if len(tasks) % 256 == 255:
            await asyncio.sleep(0.0)  # responses are read even if this loop is late
    await asyncio.gather(*tasks)
    for caller in free:
        caller.close()
    return begun + seconds


async def idle(port: int, count: int, lost: Counter[str]) -> None:
    """Connections that send one request and then wait; ``lost`` counts those that are closed at the end."""
    callers = [Caller(port) for _ in range(count)]
    for caller in callers:
        await caller.ask(b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n")
    try:
        await asyncio.Event().wait()
    finally:
        for caller in callers:
            lost["idle"] += caller._writer is None or caller._writer.is_closing()
            caller.close()


async def slow(port: int, count: int, cut: Counter[str]) -> None:
    """Connections that send single bytes of heads and bodies slowly, and reconnect when they are closed."""
    starts = (
        b"GET /livez HTTP/1.1\r\nX-Slow: ",
        b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nContent-Length: 5000\r\n\r\n",
        b"POST /v1/mu-macro/batch HTTP/1.1\r\nHost: x\r\nContent-Length: 5000\r\n\r\n",
    )

    async def drip(start: bytes) -> None:
        while True:
            with suppress(*FAULT):
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.write(start)
                end = asyncio.ensure_future(reader.read())
                while not end.done():
                    writer.write(b" ")
                    await asyncio.wait([end], timeout=1.0)
                writer.close()
                end.exception()  # how it was closed makes no difference
                cut["slow"] += 1

    await asyncio.gather(*(drip(starts[i % len(starts)]) for i in range(count)))


# --- tables -------------------------------------------------------------------------------------------

WAITS = ("p50 [ms]", "p99 [ms]", "p99.9 [ms]", "longest [ms]")


def waits(found: Sequence[float]) -> list[str]:
    """Percentiles in milliseconds."""
    values = 1e3 * np.array(found if len(found) else [np.nan])
    return [f"{x:,.1f}" for x in (*np.percentile(values, [50, 99, 99.9]), values.max())]


def slope(samples: Sequence[tuple[float, float, float]]) -> float:
    """Growth of memory in megabytes per hour, over the second half of the samples."""
    half = np.array(samples[len(samples) // 2 :])
    return float(np.polyfit(half[:, 0], half[:, 1], 1)[0] * 3600.0) if len(half) > 2 else float("nan")


def fixed_loop() -> float:
    """Processor time of a fixed loop in milliseconds: it shows how fast the machine is at this moment."""
    begun = time.thread_time()
    for _ in range(20_000):
        pass
    return 1e3 * (time.thread_time() - begun)


def speed(samples: Sequence[tuple[float, float, float]], seen: Seen) -> str:
    """How fast the machine was, and how fast while the longest wait lasted."""
    taken = np.array(samples)
    wait, end = seen.longest
    then = taken[(taken[:, 0] > end - wait - 10.0) & (taken[:, 0] < end), 2]
    low, middle, high = np.percentile(taken[:, 2], [5, 50, 95])
    return (
        f"A fixed loop, once a second, took {middle:.2f} ms in the median, {low:.2f} to {high:.2f} in 90 % of the "
        f"samples; {then.mean() if then.size else np.nan:.2f} on average in the longest wait and the 10 s before it."
    )


async def watched(server: Server, work: Any) -> list[tuple[float, float, float]]:
    """Time, memory and :func:`fixed_loop`, once a second during the work."""
    samples = []

    async def watch() -> None:
        while True:
            samples.append((time.perf_counter(), server.memory(), fixed_loop()))
            await asyncio.sleep(1.0)

    task = asyncio.create_task(watch())
    await work
    task.cancel()
    return samples


def mixed_load(share: float) -> str:
    """Mixed traffic at four fifths of capacity, alone and beside idle and slow connections."""
    started = time.perf_counter()
    open_files(2 * (IDLE + SLOW) + 1000)
    asked = questions(MIXED, 2000, 100)
    beside = max(BESIDE_S * share, 3.0)
    rows = []
    with serving(MAX_CONNECTIONS=2 * (IDLE + SLOW), CLIENT_TIMEOUT_S=10, KEEP_ALIVE_S=600, MAX_BATCHES=128) as server:
        expected = answers(server, asked)
        first = Seen(expected)
        round_s = max(CAPACITY_S * share, 2.0)
        rounds = [asyncio.run(closed_loop(server.port, asked, first, round_s, CONNECTIONS)) for _ in range(ROUNDS)]
        capacity, alone = min(rounds), Seen(expected)
        load = open_loop(server.port, asked, alone, MIXED_S * share, 0.8 * capacity)
        before = server.busy(), time.process_time(), time.perf_counter()
        samples = asyncio.run(watched(server, load))
        elapsed = time.perf_counter() - before[2]
        busy, own = (server.busy() - before[0]) / elapsed, (time.process_time() - before[1]) / elapsed
        among, counts = Seen(expected), Counter[str]()

        async def with_others() -> None:
            others = [asyncio.create_task(idle(server.port, IDLE, counts))]
            others += [asyncio.create_task(slow(server.port, SLOW, counts))]
            await asyncio.sleep(max(2.0, 5.0 * share))
            await open_loop(server.port, asked, among, beside, 0.4 * capacity)
            for task in others:
                task.cancel()
            await asyncio.gather(*others, return_exceptions=True)

        asyncio.run(with_others())
        peak = server.memory("VmHWM")
        code = server.stop()
    for name, seen in (("alone", alone), (f"beside {IDLE:,} idle and {SLOW} slow connections", among)):
        for kind in (*MIXED, "all"):
            chosen = [w for k, found in seen.waits.items() if kind in (k, "all") for w in found]
            rows.append([name, kind, f"{len(chosen):,}", *waits(chosen)])
    verdicts = {"capacity": first.verdict, "alone": alone.verdict, "beside": among.verdict}
    bad = {name: verdict for name, verdict in verdicts.items() if verdict != "held"}
    refused = alone.statuses[503] + among.statuses[503]
    text = (
        f"Capacity {capacity:,.0f} requests a second, the lowest of {ROUNDS} rounds of {round_s:.0f} s (the highest: "
        f"{max(rounds):,.0f}); {alone.asked:,} requests were sent at 80 % of it in "
        f"{MIXED_S * share / 60.0:.3g} min (the service used {busy:.0%} of a processor, the "
        f"clients {own:.0%}), then {among.asked:,} at 40 % of it beside the others in {beside:.0f} s. "
        f"{alone.broken + among.broken} connections broken, {alone.wrong + among.wrong} responses with other bits, "
        f"{refused} requests refused, exit code {code}. "
        f"Memory grew by {slope(samples):.1f} MB an hour over the second half, to at most {peak:.0f} MB with the "
        f"others. {speed(samples, alone)} "
        f"{counts['idle']} of {IDLE:,} idle connections were lost, slow ones closed {counts['slow']} times."
    )
    if bad or code or counts["idle"]:
        text += f" FAILED: {bad}"
    head = ("traffic", "kind", "responses", *WAITS)
    return f"{markdown(head, rows, 2)}\n\n{text}\n\n{reporting.took(started)}"


def overload(share: float) -> str:
    """Three times the capacity."""
    started = time.perf_counter()
    open_files(20_000)
    asked = questions(HEAVY, 120, 10_000)
    with serving(CLIENT_TIMEOUT_S=30) as server:
        expected = answers(server, asked)

        async def rounds() -> float:
            """Seconds until each kind of request is answered once, one after the other."""
            begun, caller = time.perf_counter(), Caller(server.port)
            for kind in HEAVY:
                question = next(one for one in asked if one.kind == kind)
                reply = await caller.ask(question.text)
                if reply.status != 200 or reply.body != expected[question.text]:
                    return float("inf")
            caller.close()
            return time.perf_counter() - begun

        quiet = min(asyncio.run(rounds()) for _ in range(10))
        first, seen = Seen(expected), Seen(expected)
        capacity = asyncio.run(closed_loop(server.port, asked, first, max(CAPACITY_S * share, 2.0), 8))
        recovery = float("inf")

        async def too_much() -> None:
            nonlocal recovery
            ended = await open_loop(server.port, asked, seen, max(OVERLOAD_S * share, 2.0), 3.0 * capacity)
            while time.perf_counter() - ended < 60.0:
                if await rounds() < 2.0 * quiet + 0.01:
                    recovery = time.perf_counter() - ended
                    return

        asyncio.run(too_much())
        peak, code = server.memory("VmHWM"), server.stop()
    rows = [[kind, f"{len(found):,}", *waits(found)] for kind, found in sorted(seen.waits.items())]
    rest = seen.statuses[503]
    text = (
        f"Capacity {capacity:,.0f} requests a second, two thirds of them laws of 10,000 points; {seen.asked:,} "
        f"were sent at three times that rate in {max(OVERLOAD_S * share, 2.0):.0f} s. {seen.statuses[200]:,} were "
        f"answered, {seen.wrong} of them with other bits; {rest:,} were refused with 503 and Retry-After, "
        f"{seen.unexplained} in another way; {seen.broken} connections broke. {recovery:.2f} s after the last request "
        "every kind of request was answered as fast as before (twice the time at most). Memory at most "
        f"{peak:.0f} MB, exit code {code}."
    )
    if seen.verdict != "held" or first.wrong or not rest or recovery > 5.0 or code:
        text += f" FAILED: {seen.verdict}"
    return f"{markdown(('kind', 'responses', *WAITS), rows)}\n\n{text}\n\n{reporting.took(started)}"


_WRK = """
local file = io.open("%s", "rb")
wrk.method, wrk.path, wrk.body = "POST", "/v1/mu-macro/batch", file:read("*a")
wrk.headers["Content-Type"] = "application/json"
"""


async def probe(port: int, question: Question, seen: Seen) -> tuple[float, float]:
    """Request ``/livez``, then a batch, on a new connection; seconds of each."""
    client, begun = Caller(port), time.perf_counter()
    alive = float("inf")
    try:
        await client.ask(b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n")
        alive = time.perf_counter() - begun
        seen.note(question, 0.0, await client.ask(question.text))
    except FAULT as error:
        seen.fault(error)
    client.close()
    return alive, time.perf_counter() - begun - alive


async def probe_beside(process: subprocess.Popen[str], port: int, question: Question, seen: Seen) -> list[float]:
    """Seconds of requests of ``/livez`` while the process runs."""
    waits = []
    while process.poll() is None:
        waits.append((await probe(port, question, seen))[0])
        await asyncio.sleep(0.02)
    return waits


def large_bodies(share: float) -> str:
    """Large bodies from many connections that never pause.  wrk sends them: Python would be slower than the service."""
    started = time.perf_counter()
    seconds = max(OVERLOAD_S * share, 3.0)
    sent, checked = questions({"batch": 1}, 2, 20_000)
    body = sent.text.partition(b"\r\n\r\n")[2]
    rows, bad = [], []
    with tempfile.TemporaryDirectory() as folder, serving(CLIENT_TIMEOUT_S=30) as server:
        script, file = Path(folder) / "large.lua", Path(folder) / "body"
        file.write_bytes(body)
        script.write_text(_WRK % file)
        expected = answers(server, [checked])
        quiet = min(asyncio.run(probe(server.port, checked, Seen(expected)))[1] for _ in range(10))
        for connections in (8, 32, 200):
            words = ["wrk", "-t1", f"-c{connections}", f"-d{seconds:.0f}s", "--timeout", "30s", "-s", str(script)]
            words.append(f"http://127.0.0.1:{server.port}")
            wrk = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            seen = Seen(expected)
            waits = asyncio.run(probe_beside(wrk, server.port, checked, seen))
            ended, recovery = time.perf_counter(), float("inf")
            while recovery == float("inf") and time.perf_counter() - ended < 60.0:
                after = Seen(expected)
                took = asyncio.run(probe(server.port, checked, after))[1]
                if after.statuses[200] and after.verdict == "held" and took < 2.0 * quiet + 0.01:
                    recovery = time.perf_counter() - ended
            text = wrk.communicate()[0]
            counts = [re.search(f"{words}", text) for words in (r"(\d+) requests in", r"3xx responses: (\d+)")]
            everything, refused = (int(found[1]) if found else 0 for found in counts)
            faults = re.search(r"Socket errors: (.*)", text)
            rows.append([
                str(connections), f"{(everything - refused) / seconds:,.0f}", f"{refused / seconds:,.0f}",
                faults[1] if faults else "none", f"{seen.statuses[200] - seen.wrong} / {seen.wrong}",
                f"{1e3 * np.median(waits):,.0f} / {1e3 * max(waits):,.0f}", f"{recovery:.2f}",
            ])  # fmt: skip
            if faults or seen.verdict != "held" or recovery > 5.0 or not everything:
                bad.append(f"{connections} connections: {seen.verdict}")
        peak, code = server.memory("VmHWM"), server.stop()
    head = (
        "connections", "answered [1/s]", "refused with 503 [1/s]", "connections broken", "batches right / wrong",
        "/livez, median / longest [ms]", "recovery [s]",
    )  # fmt: skip
    text = f"Bodies of {len(body) / 1e3:.0f} kB. Memory at most {peak:.0f} MB, exit code {code}."
    if bad or code:
        text += f" FAILED: {bad}"
    return f"{markdown(head, rows)}\n\n{text}\n\n{reporting.took(started)}"


def attacks(share: float) -> str:
    """The longest wait for ``/livez`` during each attack, measured by tests/test_service_attacks.py."""
    started = time.perf_counter()
    path = reporting.ROOT / "tests" / "test_service_attacks.py"
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-m", "", str(path), f"--junitxml={report}"]
        words += ["-o", "junit_family=xunit1"]  # it records properties of single tests
        if share < 1.0:
            words += ["-k", "head_has_a_limit or blank_lines"]
        subprocess.run(words, cwd=reporting.ROOT, check=False, capture_output=True)
        rows = []
        for found in ElementTree.parse(report).iter("testcase"):  # noqa: S314  (written a moment ago by pytest)
            measured = {one.get("name"): one.get("value") for one in found.iter("property")}
            failed = found.find("failure") is not None or found.find("error") is not None
            if failed or "livez_s" in measured:
                name = str(found.get("name")).removeprefix("test_").replace("_", " ")
                wait, memory = float(measured.get("livez_s") or "nan"), measured.get("peak_mib", "")
                rows.append([name, "FAILED" if failed else "held", f"{1e3 * wait:.0f}", str(memory)])
    head = ("attack", "result", "longest wait for /livez [ms]", "memory so far [MiB]")
    return f"{markdown(head, rows, 2)}\n\n{reporting.took(started)}"


SECTIONS = {"mixed_load": mixed_load, "overload": overload, "large_bodies": large_bodies, "attacks": attacks}

if __name__ == "__main__":
    reporting.report(__doc__ or "", SECTIONS)
