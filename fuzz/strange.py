"""Strange requests: valid ones with something changed, over every endpoint and every format.

    python fuzz/strange.py [--only strange_requests] [--share 0.001] [--write]

They go over sockets to a running service.  The seed of a share of the work is its number, so that a
failure can be reproduced: ``--again NUMBER`` sends one share and prints the failing requests.
"""

import gzip
import json
import random
import socket
import struct
import time
from collections import Counter
from collections.abc import Callable, Iterator
from http.client import HTTPException, HTTPResponse
from itertools import islice
from typing import Any, NamedTuple
from urllib.parse import quote, urlencode

import orjson

from mumacro.outputs import OUTPUTS
from mumacro.stiffness import AXES, GEOMETRIES
from tests.support.measuring import main, markdown, progress, sections
from tests.support.places import ROOT
from tests.support.serving import CASE, Server, serving

TABLE = ROOT / "tables" / "mumacro-1e-4.nc"
TOTAL, PART = 1_000_000, 1000  # requests; in a share of work
HANG_S = 1.0
FINE = frozenset({200, 206, 304, 400, 401, 404, 405, 408, 413, 415, 416, 422})
JSON = "application/json"
BATCH = "/v1/mu-macro/batch"


class Request(NamedTuple):
    method: str
    path: str
    query: bytes
    headers: list[tuple[bytes, bytes]]
    body: bytes


def case(chance: random.Random) -> dict[str, float]:
    """A random case inside the table's range or near it."""
    spans = {
        "mu0": (-1, 0),
        "Fz": (0, 3),
        "k": (4, 8),
        "y0": (-8, -4),
        "omega": (3, 6),
        "v0": (-5, 1),
    }
    return {name: 10.0 ** chance.uniform(*span) for name, span in spans.items()}


CONTACTS, DIRECTIONS = ("spring", "ball"), ("across", "along", "normal")
INCLUDED = (*OUTPUTS, "border")


def document(chance: random.Random) -> tuple[str, Any]:
    """A path that takes JSON, and a valid body for it."""
    one: dict[str, Any] = case(chance)
    if chance.random() < 0.3:
        one["include"] = chance.sample(INCLUDED, chance.randrange(4))
        if "std" in one["include"]:
            one["std"] = {"mu0": 0.01, "v0": 1e-4}
    if chance.random() < 0.1:
        one["f"] = one.pop("omega")
    one |= {} if chance.random() < 0.9 else {"k": chance.choice([None, "rigid"])}
    one |= {} if chance.random() < 0.9 else {"tolerance": 1e-3}
    one |= (
        {}
        if chance.random() < 0.7
        else {"contact": chance.choice(CONTACTS), "direction": chance.choice(DIRECTIONS)}
    )
    if one.get("direction") == "normal":
        del one["y0"]
        one["Fz_amplitude"] = one["Fz"] * chance.random()
    if chance.random() < 0.05 and isinstance(one["k"], float):
        k = one.pop("k")
        one |= {"k_low": k, "k_high": k * 10.0 ** chance.uniform(0, 2)}
    rest = {name: value for name, value in one.items() if name != "v0"}
    speeds = sorted(10.0 ** chance.uniform(-5, 1) for _ in range(chance.choice([1, 3, 6])))
    measured = {
        "Fz": 10.0,
        "omega": 6e5,
        "v0": speeds,
        "mu_macro": [0.3 * v / (v + 0.1) for v in speeds],
    }
    measured["y0"] = chance.choice([2e-6, [2e-6] * len(speeds)])
    half = {"unknowns": ["k"], "mu0": 0.3}
    geometry = chance.choice([*GEOMETRIES])
    bodies: dict[str, Any] = {
        "geometry": geometry,
        "radius": 5e-3,
        "Fz": 10.0,
        "E": 210e9,
        "nu": 0.3,
    }
    bodies |= {"length": 0.01, "oscillation": chance.choice(AXES)} if geometry == "cylinder" else {}
    return chance.choice(
        (
            ("/v1/mu-macro", one),
            (
                BATCH,
                {
                    **one,
                    "v0": [
                        10.0 ** chance.uniform(-5, 1)
                        for _ in range(chance.choice([0, 1, 2, 5, 300]))
                    ],
                },
            ),
            (BATCH, [case(chance) for _ in range(chance.choice([0, 1, 2, 5, 60]))]),
            (
                "/v1/solve-for",
                {**rest, "unknown": "v0", "target": chance.choice([0.1, 0.5, [0.01, 0.2]])},
            ),
            ("/v1/law", {**rest, "start": 1e-4, "stop": 1.0, "points": chance.choice([2, 5, 50])}),
            (
                "/v1/fit",
                {
                    **measured,
                    **({} if chance.random() < 0.5 else half),
                    "contact": chance.choice(CONTACTS),
                },
            ),
            ("/v1/stiffness", bodies),
            (
                "/v1/motion",
                {
                    **{name: x for name, x in one.items() if name != "y0"},
                    "x": chance.choice([0, 1e-6, [1e-6, 90.0]]),
                    "y": [{"harmonic": chance.choice([1, 2, 3.0]), "amplitude": 2e-6}],
                    "normal": chance.choice([0.0, [1e-3, 45]]),
                    "cycle": chance.random() < 0.1,
                },
            ),
        )
    )


#: texts that replace a value
NUMBERS = (
    "0",
    "-0",
    "-1",
    "1e308",
    "1e309",
    "-1e400",
    "5e-324",
    "1e-400",
    "0.1" + "0" * 400,
    "9" * 400,
    "1" + "0" * 5000,
    "NaN",
    "Infinity",
    "-Infinity",
    "nan",
    "0x10",
    "1_000",
    "01",
    "+1",
    ".5",
    "1.",
    "1e",
    "1e+",
    "--1",
    "1d5",
    "1,5",
)
VALUES = (
    "null",
    "true",
    "false",
    '""',
    '"rigid"',
    '"0.1"',
    '"NaN"',
    "[]",
    "{}",
    "[[]]",
    "[null]",
    '{"":1}',
    '"\\u0000"',
    '"\\ud800"',
    '"\\ud83d\\ude00"',
    "[1,[2,[3]]]",
    "[" * 300 + "]" * 300,
    '{"a":' * 200 + "1" + "}" * 200,
    '"' + "x" * 3000 + '"',
    "[" + "1," * 2000 + "1]",
    "/*1*/",
    "'1'",
    "undefined",
    "",
    ",",
    "\ufeff1",
    "\u2028",
)
NAMES = (
    *CASE,
    "f",
    "include",
    "std",
    "std_k",
    "tolerance",
    "target",
    "unknown",
    "points",
    "name",
    "input",
    "contact",
    "k_range",
    "k_low",
    "k_high",
    "geometry",
    "radius",
    "unknowns",
    "mu_macro",
    "mu_macro_std",
    "",
    "\u00e9",
    "__proto__",
    "mu0 ",
    "MU0",
    "constructor",
    "x" * 2000,
)


def text_of(value: Any, chance: random.Random, rate: float) -> str:
    """A value as JSON, with changes at about this rate per node."""
    if chance.random() < rate:
        return chance.choice(chance.choice([NUMBERS, VALUES]))
    space = " \t\r\n"[: chance.randrange(5)] if chance.random() < 0.02 else ""
    if isinstance(value, dict):
        members = []
        for name, inner in value.items():
            if chance.random() < rate / 3.0:
                continue
            called = chance.choice(NAMES) if chance.random() < rate / 2.0 else name
            members.append(f"{space}{json.dumps(called)}{space}:{text_of(inner, chance, rate)}")
            if chance.random() < rate / 3.0:
                members.append(members[-1])
        return "{" + ",".join(members) + space + "}"
    if isinstance(value, list):
        return (
            "["
            + ",".join(text_of(inner, chance, rate / (1 + len(value) / 8)) for inner in value)
            + space
            + "]"
        )
    return json.dumps(value)


def spoil(text: bytes, chance: random.Random) -> bytes:
    """Some bytes flipped, overwritten, removed, inserted, replaced by a wrong number, or
    doubled."""
    changed = bytearray(text)
    for _ in range(chance.choice([1, 1, 1, 2, 3, 8])):
        if not changed:
            break
        i, j = sorted((chance.randrange(len(changed)), chance.randrange(len(changed))))
        word, lie = (
            i - i % 4,
            chance.choice(
                [-1, 0, 1, 1 << 24, (1 << 31) - 1, -(1 << 31), chance.randrange(1 << 31)]
            ),
        )
        start, stop, new = chance.choice(
            (
                (i, i + 1, bytes([changed[i] ^ 1 << chance.randrange(8)])),
                (i, i + 1, bytes([chance.randrange(256)])),
                (i, i + chance.choice([1, 2, 10, j - i]), b""),
                (
                    i,
                    i,
                    chance.choice(
                        [b"\0", b"\xff", b'"', b"{", b"[", b",", b"\n", b"\r\n", b"\\", b"1e999"]
                    ),
                ),
                (word, word + 4, struct.pack("<i", lie)),
                (j, j, bytes(changed[i : min(j, i + 2000)])),
            )
        )
        changed[start:stop] = new
    return bytes(changed)


def posted(path: str, kind: str, body: bytes, chance: random.Random, share: float = 0.3) -> Request:
    """A POST, whose body is spoiled in this share of all."""
    headers = [(b"host", b"x"), (b"content-type", kind.encode())]
    return Request(
        "POST", path, b"", headers, spoil(body, chance) if chance.random() < share else body
    )


def json_request(chance: random.Random) -> Request:
    path, value = document(chance)
    text = text_of(value, chance, chance.choice([0.0, 0.05, 0.2])).encode("utf-8", "surrogatepass")
    return posted(path, JSON, text, chance)


def of_table(chance: random.Random) -> list[tuple[str, str]]:
    return [chance.choice([("id", "mumacro-1e-4"), ("tolerance", "1e-3"), ("id", "../x")])][
        : chance.randrange(2)
    ]


def of_case(chance: random.Random) -> list[tuple[str, str]]:
    return [(name, repr(value)) for name, value in case(chance).items()]


def of_law(chance: random.Random) -> list[tuple[str, str]]:
    return [
        *of_case(chance)[:5],
        ("start", "1e-4"),
        ("stop", "1"),
        ("points", chance.choice(["2", "20"])),
    ]


GETS = {
    "/v1/mu-macro": of_case,
    "/v1/mu-macro.txt": of_case,
    "/v1/law.csv": of_law,
    "/v1/table": of_table,
    "/v1/table.nc": of_table,
}


def query_request(chance: random.Random) -> Request:
    path = chance.choice([*GETS])
    pairs = GETS[path](chance)
    if chance.random() < 0.3:
        pairs.append(("include", ",".join(chance.sample(INCLUDED, chance.randrange(3)))))
    for _ in range(chance.choice([0, 0, 1, 2]) if pairs else 0):
        i, wrong = (
            chance.randrange(len(pairs)),
            chance.choice(chance.choice([NUMBERS, VALUES]))[:2000],
        )
        pairs[i] = (chance.choice([pairs[i][0], chance.choice(NAMES)]), wrong)
        pairs += chance.sample(pairs, chance.random() < 0.3)
    raw = urlencode(pairs, errors="replace").encode("ascii")
    if chance.random() < 0.1:
        raw = bytes(byte for byte in spoil(raw, chance) if 32 < byte < 127 and byte != 35)
    return Request(chance.choice(["GET", "GET", "GET", "HEAD"]), path, raw, [(b"host", b"x")], b"")


FIELDS = (
    (b"accept", (b"text/plain", b"text/csv", b"*/*", b"application/json;q=0", b"\xff")),
    (b"accept-encoding", (b"gzip", b"gzip;q=0", b"*", b"br;q=nan", b",,,")),
    (
        b"range",
        (
            b"bytes=0-10",
            b"bytes=-5",
            b"bytes=9-1",
            b"bytes=0-0,5-9",
            b"bytes=99999999999999999999-",
            b"x",
        ),
    ),
    (b"if-none-match", (b"*", b'"x"', b'W/"x", "y"', b"\xff", b"," * 1000)),
    (b"if-range", (b'"x"', b"Sun, 22 Nov 2026 10:00:00 GMT", b"yesterday")),
    (b"x-request-id", (b"abc", b"\xff", b"a" * 500, b"a b")),
    (b"x-forwarded-for", (b"1.2.3.4", b'a"b', b"\xff", b",", b"::1")),
    (
        b"content-type",
        (b"application/json", b"text/csv", b"\xff", b"application/json; charset=utf-16", b"", b";"),
    ),
    (b"content-encoding", (b"gzip", b"identity", b"")),
    (b"authorization", (b"Bearer x", b"Basic =", b"\xff")),
    (b"origin", (b"https://a.example", b"null", b"\xff")),
    (b"expect", (b"x",)),
)
PATHS = (
    *GETS,
    "/",
    "/docs",
    "/livez",
    "/readyz",
    "/healthz",
    "/metrics",
    "/openapi.json",
    "/Info",
    "/nowhere",
    "/v1/",
    "//",
    "/static/page/main.js",
    "/static/page/map.json",
    "/static/page/../x",
    "/v1/mu-macro/batch/csv",
    "/%00",
    "/\u00e9",
)


def head_request(chance: random.Random) -> Request:
    headers = [(b"host", b"x")]
    for name, values in chance.sample(FIELDS, chance.randrange(5)):
        headers.append((name, chance.choice(values)))
        if chance.random() < 0.1:
            headers.append(headers[-1])
    method = chance.choice(["GET", "GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH"])
    return Request(
        method,
        chance.choice(PATHS),
        chance.choice([b"", b"", b"mu0=1", b"?", b"&&&", b"%"]),
        headers,
        b"",
    )


KINDS: dict[str, tuple[int, Callable[[random.Random], Request]]] = {
    "JSON": (75, json_request),
    "queries": (15, query_request),
    "methods, paths and headers": (10, head_request),
}


def work(seed: int, count: int) -> Iterator[tuple[str, Request]]:
    chance = random.Random(seed)  # noqa: S311
    names, weights = list(KINDS), [weight for weight, _ in KINDS.values()]
    for _ in range(count):
        name = chance.choices(names, weights)[0]
        yield name, KINDS[name][1](chance)


def wire(request: Request) -> bytes:
    target = quote(request.path, safe="/%.") + (
        "?" + request.query.decode("latin-1") if request.query else ""
    )
    lines = [f"{request.method} {target} HTTP/1.1".encode("latin-1", "replace")]
    lines += [name + b": " + value for name, value in request.headers]
    return (
        b"\r\n".join([*lines, b"content-length: %d" % len(request.body), b"", b""]) + request.body
    )


def exchange(raw: socket.socket, request: Request) -> tuple[int, bool, str]:
    """Status, whether the connection stays open, and what is wrong with the response, empty if
    nothing is."""
    try:
        raw.sendall(wire(request))
        reply = HTTPResponse(raw, method=request.method)
        reply.begin()
        body, kind = reply.read(), (reply.getheader("content-type") or "").split(";")[0]
        if reply.getheader("content-encoding") == "gzip" and body:
            body = gzip.decompress(body)
        if request.method != "HEAD" and kind in (JSON, "application/problem+json"):
            orjson.loads(body)
    except (OSError, HTTPException, ValueError) as error:
        return 0, False, f"{type(error).__name__}: {error}"
    return (
        reply.status,
        not reply.will_close,
        "" if reply.status in FINE else f"status {reply.status}",
    )


class Tally:
    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.statuses: Counter[int] = Counter()
        # processor time of the service [s], of those whose answer took longer by the clock
        self.slowest = 0.0
        self.bad: list[tuple[str, str]] = []

    def ask(self, server: Server, seed: int, count: int) -> None:
        """One share of the work, on one connection as long as the service keeps it."""
        requests = work(seed, count)
        while batch := list(islice(requests, 100)):
            while batch:
                with socket.create_connection(("127.0.0.1", server.port), timeout=60) as raw:
                    keeps = True
                    while batch and keeps:
                        name, request = batch.pop()
                        started, busy = time.perf_counter(), server.busy()
                        status, keeps, fault = exchange(raw, request)
                        # what a first request of its kind imports takes long, too
                        if time.perf_counter() - started > HANG_S and self.counts.total() >= PART:
                            self.slowest = max(self.slowest, server.busy() - busy)
                            fault = fault or (
                                f"took {self.slowest:.1f} s" if self.slowest > HANG_S else ""
                            )
                        self.counts[name] += 1
                        self.statuses[status] += 1
                        if fault:
                            self.bad.append((f"seed {seed}: {fault}", repr(request)[:4000]))


def strange_requests(share: float, again: int = 0) -> str:
    """All kinds over sockets to one service; or one share ``again``."""
    total, tally, before = max(200, round(TOTAL * share)), Tally(), 0.0
    with serving(TABLE) as server:
        for seed in [again] if again else range(1, 1 + -(-total // PART)):
            tally.ask(server, seed, min(PART, total))
            before = before or server.memory()
        grown = server.memory() - before
        assert server.ask("GET", "/readyz")[0] == 200
        errors, code = server.errors(), server.stop()
    for fault, text in tally.bad[:50]:
        progress(f"{fault}: {text}")
    statuses = ", ".join(f"{status}: {count:,}" for status, count in sorted(tally.statuses.items()))
    text = (
        f"Statuses: {statuses}. Wrong responses, crashes and responses that took more than "
        f"{HANG_S:.0f} s: {len(tally.bad)}. The service took {grown:.0f} MB more than after its "
        f"first thousand; {len(errors)} unexpected errors in its log, exit code {code}."
    )
    if tally.bad or errors or code:
        text += f" FAILED: {Counter(fault for fault, _ in tally.bad)} {errors[:3]}"
    rows = [[name, f"{tally.counts[name]:,}"] for name in KINDS]
    return f"{markdown(('what is changed', 'requests'), rows)}\n\n{text}"


if __name__ == "__main__":
    main(__doc__, sections(strange_requests), share=1.0, again=0)
