"""How the bytes of a connection are divided into requests, compared with h11, over sockets.

    python fuzz/framing.py [--share 0.01] [--write]

A service that sees a request which another reader of the connection does not see lets a client hide one behind another
(request smuggling).  The seed of a text is its number.
"""

import json
import random
import re
import socket
from collections import Counter
from contextlib import suppress
from functools import cache

import h11

from benchmarks.measuring import ROOT, main, markdown, sections
from tests.serving import CASE, Server, chunk, connect, serving, to_end

TABLE = ROOT / "tables" / "mumacro-1e-4.nc"
TOTAL = 200_000
PATH, BODY = b"/v1/mu-macro", json.dumps(CASE).encode()
_POST = b"POST " + PATH + b" HTTP/1.1\r\nHost: x\r\n"
_GET = b"GET /v1/mu-macro?" + "&".join(f"{name}={value}" for name, value in CASE.items()).encode() + b" HTTP/1.1\r\n"
_LENGTH = b"Content-Length: %d\r\n" % len(BODY)
SECOND = b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n"
TEXTS = [
    _POST + _LENGTH + b"\r\n" + BODY,
    _POST + b"Transfer-Encoding: chunked\r\n\r\n" + chunk(BODY[:20]) + chunk(BODY[20:]) + chunk(b""),
    _POST + _LENGTH + b"Transfer-Encoding: chunked\r\n\r\n" + chunk(BODY) + chunk(b""),
    _GET + b"Host: x\r\n\r\n",
]
_PIECES = [bytes([byte]) for byte in b" \t\r\n\0:;,x05-+/\x0b\x7f\xff"] + [
    b"\r\n", b"chunked", _LENGTH, b"Content-Length: 5\r\n", b"Transfer-Encoding: chunked\r\n", b"Host: x\r\n",
    b"0\r\n\r\n", b"HTTP/1.1", b"5;a=b\r\n", b"fffffffffffffffff\r\n", b"Transfer-Encoding: gzip, chunked\r\n",
]  # fmt: skip
Request = tuple[bytes, bytes, bytes | None]  # method, target, body


def changed(text: bytes, chance: random.Random) -> bytes:
    """With up to three changes."""
    for _ in range(chance.randrange(4)):
        place, length = chance.randrange(1, len(text)), chance.choice((0, 0, 1, 2))
        text = text[:place] + chance.choice([*_PIECES, b""]) + text[place + length :]
    return text


def by_h11(text: bytes) -> list[Request]:
    """The requests that h11 reads; the last one without a body where that is not whole.

    Before, what RFC 9112 (2.2, 3) and RFC 9110 (5.6.1) let a server ignore is removed: empty lines before a request,
    more than one space in its first line, empty elements of a list.
    """
    found: list[Request] = []
    with suppress(h11.RemoteProtocolError):
        while text:
            line, end, rest = text.lstrip(b"\r\n").partition(b"\n")
            rest = re.sub(rb"(?im)^(Transfer-Encoding:)[ \t]*,[ \t,]*", rb"\1 ", rest)
            connection, body = h11.Connection(h11.SERVER), b""
            connection.receive_data(re.sub(rb" +", b" ", line) + end + rest)
            connection.receive_data(b"")
            request = connection.next_event()
            if not isinstance(request, h11.Request):
                break
            found.append((request.method, request.target, None))
            while isinstance(event := connection.next_event(), h11.Data):
                body += event.data
            if not isinstance(event, h11.EndOfMessage):
                break
            found[-1] = request.method, request.target, body
            text = b"" if connection.their_state is h11.MUST_CLOSE else connection.trailing_data[0]
    return found


def sent(server: Server, text: bytes, chance: random.Random) -> list[tuple[int, bytes]]:
    """Status and body of every answer to a text that is sent in pieces."""
    cuts = sorted(chance.randrange(len(text)) for _ in range(chance.randrange(3)))
    with connect(server) as raw:
        with suppress(OSError):  # it is closed already
            for start, end in zip([0, *cuts], [*cuts, len(text)], strict=True):
                raw.sendall(text[start:end])
            raw.shutdown(socket.SHUT_WR)
        got = to_end(raw)
    answers = re.split(rb"(?=HTTP/1\.1 \d{3} )", got)[1:]
    return [(int(answer[9:12]), without_id(answer.partition(b"\r\n\r\n")[2])) for answer in answers]


def without_id(answer: bytes) -> bytes:
    """A problem has the id of its request."""
    return re.sub(rb'"request_id":"[^"]*"', b"", answer)


def compared(server: Server, seed: int) -> str:
    """How a text was read here and by h11."""
    chance = random.Random(seed)  # noqa: S311
    text = changed(chance.choice(TEXTS), chance) + chance.choice((b"", SECOND))
    expected, count = by_h11(text), 0
    for status, body in sent(server, text, chance):
        if status in (408, 431) or b":malformed-http" in body:
            break
        known = expected[count] if count < len(expected) else None
        early = known and known[0] == b"POST" and known[2] is None and status < 400
        if known is None or early or (status, body) != answer_to(server, known):
            return f"OTHER {seed}: {text!r} has the answer {status} {body[:100]!r}, h11 reads {expected}"
        count += 1
    return "the same" if count == len(expected) else "fewer here"


@cache
def answer_to(server: Server, request: Request) -> tuple[int, bytes]:
    """What is answered to a request that is sent plainly."""
    method, target, body = request
    status, _, answer = server.ask(method.decode(), target.decode(), body)
    return status, without_id(answer)


def framing(share: float) -> str:
    """Requests with changes in their framing, often a second one behind them."""
    with serving(TABLE) as server:
        found = Counter(compared(server, seed) for seed in range(round(TOTAL * share)))
        errors, code = server.errors(), server.stop()
    other = [name for name in found if name.startswith("OTHER")]
    rows = [("the same requests", found["the same"]), ("fewer here", found["fewer here"]), ("others here", len(other))]
    text = f"{len(errors)} unexpected errors in the log, exit code {code}."
    if other or errors or code:
        text += f" FAILED: {other[:5]} {errors[:3]}"
    return f"{markdown(('read as', 'texts'), [(name, f'{number:,}') for name, number in rows])}\n\n{text}"


if __name__ == "__main__":
    main(__doc__, sections(framing), share=1.0)
