"""The scripts of benchmarks/ and fuzz/, whose parts some tests run on a small scale."""

import importlib
from typing import Any


def script(name: str) -> Any:
    """The script ``benchmarks.NAME`` or ``fuzz.NAME`` as a module."""
    return importlib.import_module(name)
