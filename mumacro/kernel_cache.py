"""How kernels are compiled, and where the compiled code is kept between runs.

numba compiles a kernel at its first call and stores the result on disk.  numba's own index looks at the file of a
kernel only, not at the files of the kernels it calls; after an update it would run old code.  So the folder is named
after a digest of all sources.  The folder must belong to this user: stored code is run as it is.
"""

from __future__ import annotations

import functools
import hashlib
import os
import stat
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, overload

import numba

__all__ = ["cache_folder", "kernel", "kernels_are_cached", "part", "source_digest"]

Function = TypeVar("Function", bound=Callable[..., Any])
_HERE = Path(__file__).resolve().parent


def source_digest(*folders: Path) -> str:
    """Digest of every source file of the library and of ``folders``: another digest may mean other numbers."""
    h = hashlib.sha256()
    for folder in (_HERE, *folders):
        for source in sorted(folder.glob("*.py")):
            h.update(source.name.encode())
            h.update(source.read_bytes())
    return h.hexdigest()[:16]


def _private(folder: Path) -> bool:
    """Make ``folder`` and say whether nobody but this user, or the system's administrator, can write to it."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError:
        return False
    if hasattr(os, "getuid"):
        foreign = status.st_uid not in (os.getuid(), 0)  # 0: an image's cache, compiled when it was built
        if foreign or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return False
    return os.access(folder, os.R_OK | os.X_OK)


@functools.cache
def cache_folder(*folders: Path) -> Path | None:
    """The folder for the library's kernels; with ``folders``, for kernels whose sources stand there.

    ``NUMBA_CACHE_DIR`` says where it lies; else the user's cache.  None where neither is a folder that this user alone
    can write to: kernels are then compiled anew in every process.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        base = Path(chosen)
    else:
        try:
            base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mumacro"
        except RuntimeError:  # no home
            return None
    folder = base / f"kernels-{source_digest(*folders)}"
    if _private(folder):
        return folder
    print(f"mumacro: kernels are not kept between runs: {folder} is not this user's alone to write to", file=sys.stderr)
    return None


def kernels_are_cached() -> bool:
    """Whether compiled kernels of these sources are at hand."""
    folder = cache_folder()
    return folder is not None and any(folder.rglob("*.nbi"))


_naming_the_folder = threading.Lock()


@overload
def kernel(function: Function) -> Function: ...


@overload
def kernel(*, fuse: bool = True, beside: Path | None = None) -> Callable[[Function], Function]: ...


def kernel(function: Callable[..., Any] | None = None, *, fuse: bool = True, beside: Path | None = None) -> Any:
    """Compile a function at its first call; keep the machine code in :func:`cache_folder`.

    Parameters
    ----------
    function : callable
        Scalars and arrays of float64 and int64 in and out; raises nothing.
    fuse : bool
        Allow fused multiply-add, which changes the last digit and nothing else.
    beside : Path, optional
        A folder whose sources the function depends on, too.

    Returns
    -------
    callable
        The compiled function; it runs without the interpreter's lock.
    """
    if function is None:
        return functools.partial(kernel, fuse=fuse, beside=beside)
    compiled = numba.njit(**_options(fuse))(function)
    folder = cache_folder(*(() if beside is None else (beside,)))
    if folder is not None and hasattr(compiled, "enable_caching"):  # absent where numba is switched off
        config: Any = numba.config
        with _naming_the_folder:  # numba reads the folder here and never again; other packages keep theirs
            before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
            try:
                compiled.enable_caching()
            finally:
                config.CACHE_DIR = before
    return compiled


@overload
def part(function: Function) -> Function: ...


@overload
def part(*, inline: bool = False, fuse: bool = True) -> Callable[[Function], Function]: ...


def part(function: Callable[..., Any] | None = None, *, inline: bool = False, fuse: bool = True) -> Any:
    """Compile a function that kernels call: it becomes part of their code, and is not kept by itself.

    With ``inline`` it is placed into every caller.  For small functions that return tuples: numba returns those
    through memory.
    """
    if function is None:
        return functools.partial(part, inline=inline, fuse=fuse)
    return numba.njit(forceinline=inline, **_options(fuse))(function)


def _options(fuse: bool) -> dict[str, Any]:
    return {"error_model": "numpy", "nogil": True, **({"fastmath": {"contract"}} if fuse else {})}
