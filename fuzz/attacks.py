"""Every limit of the service at its maximum count: as many clients as are allowed do their worst at
the same time.

    python fuzz/attacks.py [--share 0.2] [--named fits] [--image localhost/mumacro:test] [--write]

With an image, which deploy/container.sh builds, the service runs in a container of podman with 512
MiB.  Without --named all attacks are made.

Beside each attack ``/livez`` is asked, one new connection after another, and another client asks
a case, a law, a motion and ``/metrics`` in turn.  Seen are the most memory of the process, the
longest of these waits, the most that the service computed meanwhile, and how soon it rests when the
attack is over.
"""

import io
import json
import resource
import threading
import time
import zipfile
from base64 import b64encode
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from http.client import HTTPConnection, HTTPException
from itertools import cycle
from multiprocessing import get_context
from typing import NamedTuple

from mumacro.outputs import OUTPUTS
from tests.support.measuring import main, markdown, sections
from tests.support.serving import (
    CASE,
    START_S,
    Server,
    Wait,
    asking,
    connect,
    head,
    serving,
    serving_image,
)

# the defaults; a few connections are left
CONNECTIONS, BATCHES, CASES, BODY = 990, 4, 100_000, 16 * 2**20
LOOK_S, IDLE = 0.5, 0.1  # it rests while it takes less than this share of a processor for so long
EVERYTHING = [name for name in OUTPUTS if name != "std"]


def hold_connections(
    server: Server, share: float, text: bytes, then: Callable[[], object] = lambda: time.sleep(3.0)
) -> None:
    """Send the same bytes on as many connections as are allowed, and hold these."""
    with ExitStack() as stack:
        for _ in range(round(CONNECTIONS * share)):
            with suppress(OSError):
                raw = stack.enter_context(connect(server))
                raw.settimeout(0.5)  # a server that reads no more
                raw.sendall(text)
        then()


def posted(server: Server, kind: str, *bodies: bytes, number: int = BATCHES) -> None:
    """Send the same batch on many connections at once, one body after the other."""

    def ask(body: bytes) -> None:
        with suppress(OSError, HTTPException):  # a server that reads no more
            server.ask("POST", "/v1/mu-macro/batch", body, {"Content-Type": kind})

    with ThreadPoolExecutor(number) as pool:
        for body in bodies:
            list(pool.map(ask, [body] * number))


def everything(server: Server, share: float) -> None:
    count, v0 = round(CASES * share), 0.0123456789012345
    columns = {**CASE, "v0": [v0] * count, "include": EVERYTHING}
    rows = f"[{','.join([json.dumps({**CASE, 'v0': v0})] * count)}]"
    posted(server, "application/json", rows.encode(), json.dumps(columns).encode())


def strange_words(server: Server, share: float) -> None:
    words = ("rigid", None, "x" * 40)
    columns = (json.dumps({**CASE, "k": [word] * round(CASES * share)}).encode() for word in words)
    posted(server, "application/json", *columns)


def motions(server: Server, share: float) -> None:
    """Many motions of a ball with high harmonics; a law is answered beside them."""
    terms = [
        {"harmonic": n, "amplitude": 3e-7 * (n % 5 + 1), "phase": 70 * n} for n in range(11, 21)
    ]
    rig = {name: value for name, value in CASE.items() if name != "y0"}
    ball = {**rig, "contact": "ball", "tolerance": 1e-4, "x": terms, "y": terms}
    law = {name: value for name, value in CASE.items() if name != "v0"} | {"start": 1e-4, "stop": 1}
    number = max(6, round(30 * share))
    with ThreadPoolExecutor(number) as pool:
        answers = [
            pool.submit(server.ask, "POST", "/v1/motion", json.dumps(ball)) for _ in range(number)
        ]
        statuses = [server.ask("POST", "/v1/law", json.dumps(law))[0] for _ in range(20)]
    assert statuses == [200] * 20, statuses
    assert {200} <= {answer.result()[0] for answer in answers} <= {200, 503}


def descriptions(server: Server, share: float) -> None:
    number = max(4, round(8 * share))
    with ThreadPoolExecutor(number) as pool:
        statuses = {
            answer[0]
            for answer in pool.map(lambda _: server.ask("GET", "/openapi.json"), range(number))
        }
    assert statuses == {200}, statuses


def brackets(server: Server, share: float) -> None:
    units = (b"[],", b"0,", b'{"":0},')
    posted(
        server,
        "application/json",
        *(b"[" + u * round((BODY - 100) / len(u) * share) + b"0]" for u in units),
        number=2 * BATCHES,
    )


Attack = Callable[[Server, float], None]


def holding(text: bytes, factor: float = 1.0) -> Attack:
    return lambda server, share: hold_connections(server, factor * share, text)


def batches_of(*bodies: Callable[[float], bytes]) -> Attack:
    """As many clients as there are slots send the same body, one body after the other."""
    return lambda server, share: posted(
        server, "application/json", *(body(share) for body in bodies)
    )


def repeated(start: bytes, unit: bytes, end: bytes, most: int = BODY) -> Callable[[float], bytes]:
    """A body as long as one may be, of so many units at most."""
    number = min(most, (BODY - 1000) // len(unit))
    return lambda share: start + unit * (round(number * share) - 1) + end


def unknown_names(share: float) -> bytes:
    names = (f'"n{i}":0' for i in range(round(BODY / 13 * share)))
    return f"{json.dumps(CASE)[:-1]},{','.join(names)}}}".encode()


def nulls(share: float) -> bytes:
    return json.dumps({name: [None] * round(CASES * share) for name in CASE}).encode()


def fits(number: int, body: Callable[[int], bytes]) -> Attack:
    """So many clients ask for a fit at the same time, with bodies of 1 MiB and of 64 KiB."""

    def ask(server: Server, share: float) -> None:
        def one(body: bytes) -> None:
            with suppress(OSError, HTTPException):  # a server that reads no more
                server.ask("POST", "/v1/fit", body, {"Content-Type": "application/json"})

        for size in (2**20, 2**16):
            with ThreadPoolExecutor(clients := max(2, round(number * share))) as pool:
                list(pool.map(one, [body(size)] * clients))

    return ask


def table_of_brackets(size: int) -> bytes:
    return b'{"points": "v0 mu_macro ' + b"[" * (size - 30) + b'"}'


def workbook(_: int) -> bytes:
    """The smallest workbook that openpyxl opens, with very many equal styles."""
    pieces, kinds = io.BytesIO(), "application/vnd.openxmlformats-officedocument.spreadsheetml."
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    links = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    style = '<xf numFmtId="0" fontId="0" fillId="0" borderId="0" xfId="0"/>'
    styles = f'<styleSheet xmlns="{main}"><cellXfs>{style * (30 * 2**20 // len(style))}</cellXfs>'
    package = "http://schemas.openxmlformats.org/package/2006"
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{package}/content-types">'
        f'<Override PartName="/xl/workbook.xml" ContentType="{kinds}sheet.main+xml"/></Types>',
        "xl/workbook.xml": f'<workbook xmlns="{main}" xmlns:r="{links}">'
        '<sheets><sheet name="a" sheetId="1" r:id="r1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{package}/relationships">'
        f'<Relationship Id="r1" Type="{links}/worksheet" Target="/xl/worksheets/a.xml"/>'
        "</Relationships>",
        "xl/worksheets/a.xml": f'<worksheet xmlns="{main}"><sheetData/></worksheet>',
        "xl/styles.xml": f"{styles}</styleSheet>",
    }
    with zipfile.ZipFile(pieces, "w", zipfile.ZIP_DEFLATED) as book:
        for name, text in parts.items():
            book.writestr(name, text)
    return json.dumps({"points_base64": b64encode(pieces.getvalue()).decode()}).encode()


def at_once(number: int, path: str, body: bytes) -> Attack:
    """One client asks the same on so many connections at the same time."""

    def ask(server: Server, share: float) -> None:
        def one(_: int) -> None:
            with suppress(OSError, HTTPException):  # a server that reads no more
                server.ask("POST", path, body, {"Content-Type": "application/json"})

        with ThreadPoolExecutor(clients := max(2, round(number * share))) as pool:
            list(pool.map(one, range(clients)))

    return ask


def fit_of(points: int) -> bytes:
    v0 = [round(1e-3 * 1.005**i, 7) for i in range(points)]
    rig = {"Fz": 10.0, "y0": 4e-7, "f": 2e4, "unknowns": ["k"], "mu0": 0.3}
    mu = [round(0.3 * min(1.0, 20.0 * v) ** 0.4, 5) for v in v0]
    return json.dumps({**rig, "v0": v0, "mu_macro": mu}, separators=(",", ":")).encode()


def search(targets: int) -> bytes:
    rig = {"mu0": 0.3, "Fz": 10.0, "f": 2e4, "v0": 0.01, "contact": "ball", "unknown": "k"}
    wanted = [round(0.01 + 0.28 * i / targets, 5) for i in range(targets)]
    shaken = {"harmonic": 20, "amplitude": 1e-6}
    return json.dumps({**rig, "x": shaken, "target": wanted}).encode()


def _term(harmonic: int, amplitude: float, phase: float) -> dict[str, float]:
    return {"harmonic": harmonic, "amplitude": amplitude, "phase": phase}


# one to three seconds of processor time: the slowest of a ball in minutes of random motions
SLOW_RIG = {"mu0": 0.637, "Fz": 9.55, "k": 1.293e4, "f": 1.167, "v0": 0.3666}
SLOW_PARTS = {
    "x": [_term(1, 1.09e-4, 247.7), _term(20, 0.2727, 225.9), _term(1, 3.042, 335.8)],
    "y": [_term(20, 0.124, 147.7), _term(20, 2.502, 271.4), _term(20, 0.3452, 220.8)],
    "contact": "ball",
    "tolerance": 1e-7,
}
SLOW = json.dumps({**SLOW_RIG, **SLOW_PARTS}).encode()
ROW = json.dumps(CASE).encode()
TYPED = ROW.replace(b"1000000.0", b'"' + b"x" * 60 + b'"')
STRANGE_ROW = ROW[:-1] + b"".join(b',"%c":0' % (97 + i) for i in range(12)) + b"}"

ATTACKS: dict[str, Attack] = {
    # before any other, so that it is the first time of a service that all attacks share
    "Many at once ask for /openapi.json for the first time": descriptions,
    "Heads without an end, of 64 KB of the smallest fields": holding(
        b"GET /livez HTTP/1.1\r\nHost: x\r\n" + b"a:b\r\n" * 13_000
    ),
    "16 KB of the smallest requests on each connection, whose answers are not read": holding(
        b"GET /x HTTP/1.1\r\nHost:x\r\n\r\n" * 600
    ),
    "More connections without a byte than are allowed": holding(b"", 1.5),
    "Bodies of 64 KB that lack their last byte": holding(
        head("/v1/mu-macro", 65_000) + b" " * 64_999
    ),
    "Fits of 1 MiB that lack their last byte": holding(
        head("/v1/fit", 2**20) + b" " * (2**20 - 1), 600 / CONNECTIONS
    ),
    "Fits of 64 KiB that lack their last byte": holding(
        head("/v1/fit", 2**16) + b" " * (2**16 - 1), 600 / CONNECTIONS
    ),
    "Heads of tables with as many brackets as a body has room for": fits(60, table_of_brackets),
    "A workbook whose styles unpack to 30 MiB": fits(4, workbook),
    "200 batches of rows without a member, 64 KiB each": at_once(
        200, "/v1/mu-macro/batch", b"[" + b"{}," * 21_000 + b"{}]"
    ),
    "200 fits of 1,000 points": at_once(200, "/v1/fit", fit_of(1000)),
    "Searches with 1,000 targets over a ball, on 50 connections": at_once(
        50, "/v1/solve-for", search(1000)
    ),
    "The same on 4 connections": at_once(4, "/v1/solve-for", search(1000)),
    "The slowest motions of a ball that were found, on 50 connections": at_once(
        50, "/v1/motion", SLOW
    ),
    "Rows without a member": batches_of(
        repeated(b"[", b"{},", b"{}]", CASES), repeated(b"[", b"{},", b"{}]")
    ),
    "Columns of nulls": batches_of(nulls),
    "Unknown names, of columns and of rows": batches_of(
        unknown_names, repeated(b"[", STRANGE_ROW + b",", STRANGE_ROW + b"]", CASES)
    ),
    "The deepest nesting": batches_of(repeated(b"", b"[", b"["), repeated(b"", b'{"a":', b"")),
    "The longest text, name and rows of texts": batches_of(
        repeated(b'{"k":"', b"x", b'"}'),
        repeated(b'{"k":"', b'\\"', b'"}'),
        repeated(b'{"', b"x", b'":1}'),
        repeated(b"[", TYPED + b",", TYPED + b"]", CASES),
    ),
    "JSON of the smallest values and lists": brackets,
    "As many rows, and as long columns, as are allowed, with everything included": everything,
    "Columns of words and of nulls, which Python reads one by one": strange_words,
    "Motions of a ball with high harmonics; a law is answered beside them": motions,
}


class Cost(NamedTuple):
    """What an attack took: the most memory of the service so far [MB], waits of others [s], and how
    long its work went on after it [s]."""

    memory: float
    livez: float
    metrics: float
    other: float  #: the longest wait of another client's case, law or motion
    refused: int  #: how many of these were not answered with 200
    busy: float  #: the most processor time of the service in a wait of the first two [s]
    after: float


OTHER = "127.0.0.2"  # the address of another client
LAW = {name: value for name, value in CASE.items() if name != "v0"} | {"start": 1e-4, "stop": 1}
MOTION = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 2e4, "v0": 0.01, "x": [1e-6, 90.0], "y": 2e-6}
QUESTIONS = (
    ("POST", "/v1/mu-macro", CASE),
    ("POST", "/v1/law", LAW),
    ("POST", "/v1/motion", MOTION),
    ("GET", "/metrics", None),
)


@contextmanager
def neighbour(server: Server) -> Iterator[list[tuple[str, int, Wait]]]:
    """Another client, which asks in turn until the context ends: path, status and wait."""
    stop, seen = threading.Event(), list[tuple[str, int, Wait]]()

    def ask() -> None:
        for method, path, question in cycle(QUESTIONS):
            if stop.wait(0.05) and seen:
                return
            body = None if question is None else json.dumps(question)
            started, before, status = time.perf_counter(), server.busy(), 0
            with suppress(OSError, HTTPException):
                connection = HTTPConnection("127.0.0.1", server.port, 60, source_address=(OTHER, 0))
                connection.request(method, path, body)
                status = connection.getresponse().status
                connection.close()
            wait = Wait(time.perf_counter() - started, server.busy() - before)
            seen.append((path, status, wait))

    with ThreadPoolExecutor(1) as pool:
        loop = pool.submit(ask)
        try:
            yield seen
        finally:
            stop.set()
        loop.result()


def rest(server: Server) -> float:
    """Wait until the service rests; the time that took [s]."""
    begun, before = time.monotonic(), server.busy()
    while time.monotonic() < begun + START_S:
        time.sleep(LOOK_S)
        taken, before = server.busy() - before, server.busy()
        if taken < IDLE * LOOK_S:
            return time.monotonic() - begun - LOOK_S
    raise AssertionError("the work of the attack has no end")


def cost_of(attack: Attack, share: float, server: Server) -> Cost:
    """What an attack on a service takes, which must serve afterwards."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(8192, most), most))
    with asking(server) as waits, neighbour(server) as seen:
        # in a process of its own, so that its clients delay no wait that is measured
        attacker = get_context("fork").Process(target=attack, args=(server, share))
        attacker.start()
        attacker.join()
    assert attacker.exitcode == 0
    after = rest(server)
    assert server.ask("POST", "/v1/mu-macro", json.dumps(CASE))[0] == 200
    assert not server.errors(), server.errors()[:1]
    metrics = [wait for path, _, wait in seen if path == "/metrics"]
    others = [wait for path, _, wait in seen if path != "/metrics"]
    refused = sum(status != 200 for _, status, _ in seen)
    livez, probed, other = (
        max([0.0, *(wait.seconds for wait in each)]) for each in (waits, metrics, others)
    )
    busy = max(wait.busy for wait in (*waits, *metrics))
    return Cost(server.memory("VmHWM"), livez, probed, other, refused, busy, after)


def attacks(share: float, named: str, image: str) -> str:
    rows = []
    for name, attack in ATTACKS.items():
        if named not in name:
            continue
        with serving_image(image) if image else serving() as server:
            cost = cost_of(attack, share, server)
        waits = (f"{1e3 * wait:.0f}" for wait in (cost.livez, cost.metrics, cost.other))
        rows.append(
            (
                name,
                f"{cost.memory:.0f}",
                *waits,
                f"{cost.refused}",
                f"{1e3 * cost.busy:.0f}",
                f"{cost.after:.1f}",
            )
        )
    head = (
        "attack",
        "most memory [MB]",
        "longest wait of /livez [ms]",
        "of /metrics",
        "of another client",
        "of these not 200",
        "processor time in a wait of the first two [ms]",
        "time until it rests [s]",
    )
    return markdown(head, rows)


if __name__ == "__main__":
    main(__doc__, sections(attacks), share=1.0, named="", image="")
