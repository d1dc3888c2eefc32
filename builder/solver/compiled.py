"""Compile the solver and keep the result; compute a digest of everything on which its results
depend."""

import hashlib
import os
import platform
import sys
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

import llvmlite
import numba

import mumacro

_LIBRARY = Path(mumacro.__file__).resolve().parent
SOURCES = (
    (Path(__file__).resolve().parent.parent, "*.py"),
    (_LIBRARY, "*.py"),
    (_LIBRARY / "kernel", "*.[ch]"),
)


def source_digest() -> str:
    """Return a digest of the sources of builder and evaluation and of the compiler.  If it differs,
    numbers may differ."""
    compiler = (
        numba.__version__,
        llvmlite.__version__,
        platform.python_version(),
        platform.machine(),
    )
    h = hashlib.sha256(repr(compiler).encode())
    for folder, pattern in SOURCES:
        # folders too, because a file that is moved into one still counts
        for source in sorted(folder.rglob(pattern)):
            h.update(source.relative_to(folder).as_posix().encode())
            h.update(source.read_bytes())
    return h.hexdigest()[:16]


def _store() -> Path | None:
    """Return the folder of the functions that are compiled from these sources, or None if no folder
    can be written.

    numba's own store does not see a change in a function that another one calls.  So each digest of
    the sources has a folder, in ``NUMBA_CACHE_DIR`` or else in the user's folder for caches.
    """
    if setting := os.environ.get("NUMBA_CACHE_DIR"):
        caches = Path(setting)
    elif sys.platform == "win32":
        caches = Path(os.environ.get("LOCALAPPDATA") or Path.home()) / "mumacro"
    else:
        caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mumacro"
    folder = caches / source_digest()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


_STORE = _store()
P = ParamSpec("P")
R = TypeVar("R")


def solver_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function at its first call, once for all processes if the result can be kept.

    It runs without the interpreter's lock and without fused multiply-add.
    """
    settings = vars(numba.config)
    usual = settings["CACHE_DIR"]
    settings["CACHE_DIR"] = str(_STORE or "")
    try:
        compiled: Callable[P, R] = numba.njit(
            error_model="numpy", nogil=True, cache=_STORE is not None
        )(function)
    finally:
        settings["CACHE_DIR"] = usual
    return compiled
