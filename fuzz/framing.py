"""How the bytes of a connection are divided into requests, compared with h11, over sockets.

    python fuzz/framing.py [--share 0.01] [--write]

A request that another reader does not see could hide behind one (request smuggling).  A text's seed
is its number.
"""

import json
import random
import re
import socket
from collections import Counter
from contextlib import suppress
from functools import cache

import h11

from tests.support.measuring import main, markdown, sections
from tests.support.places import ROOT
from tests.support.serving import CASE, Server, chunk, connect, serving, to_end

TABLE, TOTAL = ROOT / "tables" / "mumacro-1e-4.nc", 200_000
BODY = json.dumps(CASE).encode()
LENGTH, CHUNKED = b"Content-Length: %d\r\n" % len(BODY), b"Transfer-Encoding: chunked\r\n"
POST, SECOND = (
    b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\n",
    b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n",
)
TEXTS = [
    POST + LENGTH + b"\r\n" + BODY,
    POST + LENGTH + CHUNKED + b"\r\n" + chunk(BODY) + chunk(b""),
    POST + CHUNKED + b"\r\n" + chunk(BODY[:20]) + chunk(BODY[20:]) + chunk(b""),
    b"GET /v1/mu-macro?mu0=0.3&Fz=10&k=1e6&y0=2e-6&omega=1e5&v0=0.01 HTTP/1.1\r\nHost: x\r\n\r\n",
]
PIECES = [
    *(bytes([byte]) for byte in b" \t\r\n\0:;,x05-+/\x0b\x7f\xff"),
    b"",
    b"\r\n",
    b"chunked",
    LENGTH,
    CHUNKED,
    b"Content-Length: 5\r\n",
    b"Host: x\r\n",
    b"0\r\n\r\n",
    b"HTTP/1.1",
    b"5;a=b\r\n",
    b"fffffffffffffffff\r\n",
    b"Transfer-Encoding: gzip, chunked\r\n",
]
Request = tuple[bytes, bytes, bytes | None]  # method, target, body


def changed(text: bytes, chance: random.Random) -> bytes:
    """With up to three changes."""
    for _ in range(chance.randrange(4)):
        place, length = chance.randrange(1, len(text)), chance.choice((0, 0, 1, 2))
        text = text[:place] + chance.choice(PIECES) + text[place + length :]
    return text


def by_h11(text: bytes) -> list[Request]:
    """The requests that h11 reads; the last one without a body where that is not whole.

    Without what RFC 9112 (2.2, 3) and RFC 9110 (5.6.1) let a server ignore: empty lines, spaces,
    elements of a list.
    """
    requests: list[Request] = []
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
            requests.append((request.method, request.target, None))
            while isinstance(event := connection.next_event(), h11.Data):
                body += event.data
            if not isinstance(event, h11.EndOfMessage):
                break
            requests[-1] = request.method, request.target, body
            text = b"" if connection.their_state is h11.MUST_CLOSE else connection.trailing_data[0]
    return requests


def answers(server: Server, text: bytes, chance: random.Random) -> list[tuple[int, bytes]]:
    """Status and body of every answer to a text that is sent in pieces."""
    cuts = sorted(chance.randrange(len(text)) for _ in range(chance.choice((0, 1, 2, 50))))
    with connect(server) as raw:
        with suppress(OSError):  # it is closed already
            for start, end in zip([0, *cuts], [*cuts, len(text)], strict=True):
                raw.sendall(text[start:end])
            raw.shutdown(socket.SHUT_WR)
        replies = re.split(rb"(?=HTTP/1\.1 \d{3} )", to_end(raw))[1:]
    return [(int(answer[9:12]), answer.partition(b"\r\n\r\n")[2]) for answer in replies]


@cache
def answer_to(server: Server, request: Request) -> tuple[int, bytes]:
    """What is answered to a request that is sent plainly."""
    return server.ask(request[0].decode(), request[1].decode(), request[2])[::2]


def compared(server: Server, seed: int) -> str:
    """How a text was read here and by h11."""
    chance = random.Random(seed)  # noqa: S311
    text = changed(chance.choice(TEXTS), chance) + chance.choice((b"", SECOND))
    expected, count = by_h11(text), 0
    for status, body in answers(server, text, chance):
        if status in (408, 431) or b":malformed-http" in body:
            break
        request = expected[count] if count < len(expected) else (b"", b"", None)
        plain = answer_to(server, request) if request[0] else (0, b"")
        early = request[0] == b"POST" and request[2] is None and status < 400
        # a problem has the id of its request
        if early or status != plain[0] or (status < 400 and body != plain[1]):
            return (
                f"OTHER {seed}: {text!r} has the answer {status} {body[:100]!r}, h11 reads "
                f"{expected}"
            )
        count += 1
    return "the same" if count == len(expected) else "fewer here"


def framing(share: float) -> str:
    """Requests with changes in their framing, often a second one behind them."""
    with serving(TABLE) as server:
        counts = Counter(compared(server, seed) for seed in range(round(TOTAL * share)))
        errors, code = server.errors(), server.stop()
    rows = [(name[:1000], f"{count:,}") for name, count in counts.most_common(5)]
    failed = " FAILED" if errors or code or counts.keys() - {"the same", "fewer here"} else ""
    return (
        f"{markdown(('requests', 'texts'), rows)}\n\n{len(errors)} errors in the log, exit "
        f"code {code}.{failed}"
    )


if __name__ == "__main__":
    main(__doc__, sections(framing), share=1.0)
