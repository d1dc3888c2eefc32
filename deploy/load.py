#!/usr/bin/env python3
"""Send a service the largest batches it takes, from three times as many clients as it has slots.

    python3 deploy/load.py URL [--workers 4] [--seconds 20]

Among them are bodies that are refused.  Every request must be answered: with 200 and all its
cases, with the status of its fault, or with 503.  Prints one line of counts and the largest
answer.  Exit code 1 if a request has no answer or another one.  Needs nothing but Python.
"""

import argparse
import itertools
import random
import sys
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from http.client import HTTPConnection, HTTPException
from urllib.parse import urlsplit

CASES, SLOTS = 100_000, 4  # MUMACRO_MAX_BATCH, half of MUMACRO_MAX_COMPUTATIONS
LARGEST = 16 * 2**20  # MUMACRO_MAX_BODY_BYTES
NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
BATCH = "/v1/mu-macro/batch"
#: of the bodies that are refused
STATUS = {"too many rows": 413, "unknown names": 422, "nesting": 413, "a long text": 422}


def texts() -> list[tuple[str, ...]]:
    """Values of all cases, with so many digits that the rows fill a body."""
    chosen = random.Random(1)  # noqa: S311 (test data)
    low, high = (0.1, 1.0, 1e5, 1e-7, 1e4, 1e-3), (0.9, 99.0, 9e6, 9e-6, 9e5, 1.0)
    bounds = tuple(zip(low, high, strict=True))
    return [tuple(f"{chosen.uniform(a, b):.16g}" for a, b in bounds) for _ in range(CASES)]


def bodies() -> dict[str, bytes]:
    """Name of a form -> its body."""
    rows = texts()
    whole = [
        "{" + ",".join(f'"{n}":{v}' for n, v in zip(NAMES, row, strict=True)) + "}" for row in rows
    ]
    columns = ",".join(
        f'"{n}":[{",".join(c)}]' for n, c in zip(NAMES, zip(*rows, strict=True), strict=True)
    )
    padding = (LARGEST - sum(map(len, whole)) - CASES - 2) // CASES  # spaces are read too
    padded = f",{' ' * padding}".join(whole)
    empty, long = LARGEST // len("{},") - 1, LARGEST - 100
    names = ",".join(f'"n{i}":0' for i in range(LARGEST // 13))
    forms = {
        "rows": f"[{padded}]",
        "columns": "{" + columns + "}",
        "rows of nothing": f"[{'{},' * (CASES - 1)}{{}}]",
        "too many rows": f"[{'{},' * empty}{{}}]",
        "nulls": "{" + ",".join(f'"{n}":[{"null," * (CASES - 1)}null]' for n in NAMES) + "}",
        "unknown names": "{" + names + "}",
        "nesting": "[" * long,
        "a long text": '{"k":"' + "x" * long + '"}',
    }
    return {name: text.encode() for name, text in forms.items()}


def ask(address: str, query: str, body: bytes) -> tuple[int, int]:
    """Status and length of an answer; the service may answer 503 before it has read the body."""
    connection = HTTPConnection(address, timeout=120)
    try:
        with suppress(BrokenPipeError, ConnectionResetError):
            connection.request("POST", BATCH + query, body, {"Content-Type": "application/json"})
        reply = connection.getresponse()
        return reply.status, len(reply.read())
    finally:
        connection.close()


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("url")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=20.0)
    chosen = parser.parse_args()
    address, forms = urlsplit(chosen.url).netloc, bodies()
    counts, largest = Counter[str](), [0]
    questions = itertools.cycle(
        itertools.product(forms, ("", "?include=gradient,power,stick_fraction"))
    )
    lock, stop = threading.Lock(), time.monotonic() + chosen.seconds

    def client() -> None:
        refused = False
        while time.monotonic() < stop:
            if not refused:
                with lock:
                    name, query = next(questions)
            try:
                status, length = ask(address, query, forms[name])
                outcome = f"{name} {status}" if status != 503 else "503"
            except (OSError, HTTPException) as error:
                outcome, length = f"{name} lost ({type(error).__name__})", 0
            with lock:
                counts[outcome] += 1
                largest[0] = max(largest[0], length)
            if refused := outcome == "503":
                time.sleep(0.2)

    clients = 3 * SLOTS * chosen.workers
    with ThreadPoolExecutor(clients) as pool:
        for one in [pool.submit(client) for _ in range(clients)]:
            one.result()
    right = {"503", *(f"{name} {STATUS.get(name, 200)}" for name in forms)}
    sizes = ", ".join(f"{name} {len(body) / 1e6:.1f} MB" for name, body in forms.items())
    totals = ", ".join(f"{name}: {n}" for name, n in sorted(counts.items()))
    print(
        f"{clients} clients; bodies: {sizes}; largest answer {largest[0] / 1e6:.1f} MB; answers: "
        f"{totals}"
    )
    return 0 if counts.keys() <= right and len(counts) > 1 else 1


if __name__ == "__main__":
    sys.exit(main())
