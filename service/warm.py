"""Everything compiled is loaded, or compiled, before the first request.

``python -m service.warm TABLES...`` does it for an image that is being built.
"""

import gc
import json
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np

from friction.regions import SOURCES
from service.answers import Answers, answer_cases
from service.codecs import columns_text, read_batch, rows_text, terminated
from service.compiled.block import count_codes
from service.errors import RequestError
from service.intake import Options
from service.memory import give_back
from service.shelf import Shelf
from service.streams import LineAnswers, Lines

__all__ = ["prepare", "settle_memory"]

_CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
_TEXTS = (
    [_CASE, {**_CASE, "v0": "x", "y": [1, {}]}, 1, {"v0": 12345678901234567890123}],
    {**_CASE, "v0": [0.01, True, None], "k": [1e6, None, 0.0]},
    True,
)
_INCLUDE = ("groups", "limits", "gradient", "stick_fraction", "power")


def prepare(shelf: Shelf) -> None:
    """Load the tables, then answer a batch of every form once."""
    shelf.load()
    if not shelf.tables:
        return
    table = shelf.tables[0]
    for value in _TEXTS:
        try:
            cases, _ = read_batch(terminated(json.dumps(value).encode()), len(_TEXTS) + 10)
        except RequestError:
            continue  # read, and found to be no batch, as it should be
        answers = answer_cases(table, cases, _INCLUDE)
        for write in (columns_text, rows_text):
            b"".join(write(replace(answers), {}))  # a writer lets go of the cases
    lines = Lines()
    lines.put(json.dumps(_TEXTS[1] | {"v0": [0.01], "k": [1e6]}).encode())
    stream = LineAnswers(shelf, Options(), 1, lambda _text: iter(()), lambda _table, answers, _bad: _count(answers))
    b"".join(stream.pieces(lines, lines.take(1, last=True), 0))


def _count(answers: Answers) -> None:
    count_codes(answers.source, np.zeros(len(SOURCES) + 1, dtype=np.int64))


def settle_memory() -> None:
    """Give back what only the start needed, and tell the collector that the rest stays.

    It would walk through a hundred thousand objects of libraries again and again, for some fifty milliseconds, and
    nobody is answered meanwhile.  Only where the process is the service and nothing else.
    """
    if threading.current_thread() is threading.main_thread():
        gc.collect()
        give_back()
        gc.freeze()
        gc.enable()


if __name__ == "__main__":
    chosen = Shelf([Path(name) for name in sys.argv[1:]])
    prepare(chosen)
    sys.exit(chosen.fault)
