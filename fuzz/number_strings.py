"""Number strings: what ``mumacro eval`` reads from CSV and NDJSON against Python's ``float``, bit by bit.

    python fuzz/number_strings.py [--share 0.01] [--write]

Strings are drawn from doubles of every bit pattern, printed exactly, shortly and with random digits; from points half
way between two doubles; from the ends of the range; and from text that is no number.
"""

from __future__ import annotations

import json
import math
import random
import tempfile
from collections.abc import Callable, Iterator
from decimal import Decimal, getcontext
from pathlib import Path
from struct import pack, unpack

import numpy as np
from numpy.typing import NDArray

from benchmarks.measuring import main, markdown
from mumacro.files.answering import find_columns, numbers
from mumacro.files.reading import TextSource

NAMES = ("mu0", "Fz", "y0", "omega", "v0")  # k may be rigid: text that is no number is valid there
TOTAL = 10_000_000
PLAIN = 50  # records of plain numbers before the others: they name the columns and the decimal sign
WRONG = (
    *("", " ", "-", "+", ".", "e5", "1e", "1e+", "0x10", "1_000", "1,5", "1.2.3", "--1", "1e5.5", "one", "1 2", "١٢"),
    *("∞", "1f", "1d5", "0b1", "1e1e1", "½", "1%", "$1", "true", "null", "[1]", "+-1", "'1'", "1-"),
)

getcontext().prec = 1200


def a_double(chance: random.Random) -> float:
    """Any finite double, by its bits."""
    while True:
        x = float(unpack("<d", pack("<Q", chance.getrandbits(64)))[0])
        if math.isfinite(x):
            return x


def between(x: float) -> str:
    """The point half way to the next double, with all its digits."""
    after = math.nextafter(x, math.inf)
    return str((Decimal(x) + Decimal(after)) / 2) if math.isfinite(after) else "1.8e308"


def digits(chance: random.Random) -> str:
    """Random digits with a random exponent."""
    whole = str(chance.randrange(10 ** chance.randrange(1, 30)))
    fraction = "." + "".join(chance.choices("0123456789", k=chance.randrange(1, 30))) if chance.random() < 0.7 else ""
    exponent = f"{chance.choice('eE')}{chance.choice(('', '+', '-'))}{chance.randrange(340)}"
    return chance.choice(("", "-")) + whole + fraction + (exponent if chance.random() < 0.7 else "")


KINDS: dict[str, Callable[[random.Random], str]] = {
    "shortest digits of any double": lambda chance: repr(a_double(chance)),
    "17 digits of any double": lambda chance: f"{a_double(chance):.16e}",
    "random digits and exponents": digits,
    "half way between two doubles": lambda chance: between(a_double(chance)),
    "a digit beyond half way": lambda chance: between(abs(a_double(chance))).replace("E", "1E"),
    "denormal numbers": lambda chance: repr(unpack("<d", pack("<Q", chance.getrandbits(chance.randrange(1, 53))))[0]),
    "beyond the range": lambda chance: (
        f"{chance.choice(('', '-'))}{chance.randrange(1, 9**9)}e{chance.randrange(309, 5000)}"
    ),
    "no numbers": lambda chance: chance.choice(WRONG),
}
SHARES = (0.3, 0.15, 0.3, 0.05, 0.05, 0.08, 0.05, 0.02)


def expected(text: str) -> float:
    """The value that Python reads; NaN if it refuses."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def drawn(n: int, seed: int, kind: str) -> list[str]:
    """``n`` strings of one kind."""
    chance = random.Random(seed)  # noqa: S311
    return [KINDS[kind](chance) for _ in range(n)]


def read(path: Path, kind: str) -> Iterator[list[NDArray[np.float64]]]:
    """Columns of doubles as eval reads them, NaN for refused values and rows."""
    source = TextSource([path], "," if kind == "csv" else "", ".", verbatim=True)
    places, _ = find_columns(source.schema.names, rigid=True)
    for block in source.blocks(0, 0, [places[name][0] for name in NAMES]):
        yield [numbers(block.batch.column(places[name][0]), name)[0] for name in NAMES]


def compare(texts: list[str], kind: str, folder: Path) -> tuple[int, int, int]:
    """How many strings give the bits of ``float``, are refused, or give another value."""
    texts = texts[: len(texts) // len(NAMES) * len(NAMES)]
    rows = [texts[i : i + len(NAMES)] for i in range(0, len(texts), len(NAMES))]
    path = folder / f"cases.{kind}"
    with path.open("w", encoding="utf-8", newline="") as stream:
        if kind == "csv":
            stream.write(",".join(NAMES) + "\n" + PLAIN * "1.5,1.5,1.5,1.5,1.5\n")
            quoted = (",".join(f'"{cell}"' if "," in cell else cell.replace('"', "") for cell in row) for row in rows)
            stream.writelines(line + "\n" for line in quoted)
        else:
            stream.write(PLAIN * (json.dumps(dict.fromkeys(NAMES, 1.5)) + "\n"))
            for row in rows:
                stream.write("{" + ", ".join(f'"{n}": {cell}' for n, cell in zip(NAMES, row, strict=True)) + "}\n")
    wanted = np.array([[expected(cell.replace('"', "") if kind == "csv" else cell) for cell in row] for row in rows])
    found = np.concatenate([np.stack(columns, axis=1) for columns in read(path, kind)])[PLAIN:]
    refused = np.isnan(found)
    with np.errstate(invalid="ignore"):
        # JSON's "-0" is an integer, and an integer zero has no sign
        same = ~refused & ((found.view(np.uint64) == wanted.view(np.uint64)) | ((found == 0.0) & (wanted == 0.0)))
    return int(same.sum()), int(refused.sum()), int((~same & ~refused).sum())


def number_strings(share: float) -> str:
    """Every kind through both readers."""
    rows, piece = [], 200_000
    with tempfile.TemporaryDirectory() as folder:
        for name, part in zip(KINDS, SHARES, strict=True):
            total = max(1000, int(TOTAL / 2 * part * share))  # half of the strings through each reader
            for kind, title in (("csv", "CSV"), ("ndjson", "NDJSON")):
                sums = np.zeros(3, np.int64)
                for low in range(0, total, piece):
                    sums += compare(drawn(min(piece, total - low), low + len(kind), name), kind, Path(folder))
                rows.append([name, title, f"{sums.sum():,}", *(f"{n:,}" for n in sums)])
    head = ("strings", "reader", "tried", "bits of Python's float", "refused", "another value")
    return markdown(head, rows, 2)


SECTIONS = {"number_strings": number_strings}

if __name__ == "__main__":
    main(__doc__, SECTIONS, share=1.0)
