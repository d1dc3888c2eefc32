"""How kernels are compiled, and where the compiled code is stored.

numba compiles a kernel at its first call; the result is kept in a file.  Stored code is run as it is.  So its folder
must belong to this user, and is named after a digest of all sources: after an update, old code would run.  And every
file has a digest of its content: a damaged kernel is compiled again.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import pickle
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, overload

import llvmlite
import numba
from numba.core.caching import CompileResultCacheImpl
from numba.core.serialize import dumps

from mumacro.writing import write_whole

__all__ = ["cache_folder", "kernel", "kernels_are_cached", "part", "source_digest"]

Function = TypeVar("Function", bound=Callable[..., Any])
_HERE = Path(__file__).resolve().parent
_SUFFIX = ".kernel"
_DIGEST = 32  # bytes in front of a file's content
_log = logging.getLogger("mumacro.kernels")
# How numba serializes a compiled function and rebuilds it; its constructor would look for a folder of numba's.
_form: Any = CompileResultCacheImpl.__new__(CompileResultCacheImpl)


def source_digest(*folders: Path) -> str:
    """Digest of every source file of the library and of ``folders``: another digest may mean other numbers."""
    h = hashlib.sha256()
    for folder in (_HERE, *folders):
        for source in sorted(folder.glob("*.py")):
            h.update(source.name.encode())
            h.update(source.read_bytes())
    return h.hexdigest()[:16]


def _private(folder: Path) -> bool:
    """Make ``folder``; True where only this user and the system's administrator can write to it."""
    try:
        for missing in [folder, *folder.parents][::-1]:
            missing.mkdir(mode=0o700, exist_ok=True)
        folder = folder.resolve(strict=True)
        if hasattr(os, "getuid"):
            status = folder.stat()
            if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH) or not _trusted(status):
                return False
            # a user who can rename a folder above it can replace it
            for above in map(Path.stat, folder.parents):
                free = above.st_mode & stat.S_IWOTH and not above.st_mode & stat.S_ISVTX
                if free or (above.st_uid != _UNMAPPED and not _trusted(above)):
                    return False
    except OSError:
        return False
    return os.access(folder, os.R_OK | os.X_OK)


_UNMAPPED = 65534  # the owner, as seen in a container, of files from outside


def _trusted(status: os.stat_result) -> bool:
    return status.st_uid in (os.getuid(), 0)  # 0: an image's cache, compiled when it was built


@functools.cache
def cache_folder(*folders: Path) -> Path | None:
    """The folder for the library's kernels; with ``folders``, for kernels whose sources stand there.

    ``NUMBA_CACHE_DIR`` sets its place; else the user's cache.  None where neither is a folder that this user alone
    can write to: then every process compiles the kernels again.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    try:
        base = Path(chosen) if chosen else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mumacro"
    except RuntimeError:
        print("mumacro: compiled kernels are not stored: this user has no home folder", file=sys.stderr)
        return None
    folder = base.absolute() / f"kernels-{source_digest(*folders)}"
    if _private(folder):
        return folder
    print(f"mumacro: compiled kernels are not stored: others can write to {folder}", file=sys.stderr)
    return None


def kernels_are_cached() -> bool:
    """Whether compiled kernels of these sources are in the cache."""
    folder = cache_folder()
    return folder is not None and any(folder.glob(f"*{_SUFFIX}"))


class _Stored:
    """The compiled code of one kernel on the disk, a file for every signature and processor.

    Takes the place of numba's own store, which keeps an index of its files beside them, raises on a file that is empty
    or cut, runs one that is damaged, mixes up what several processes write at once, and runs no kernel that
    cannot be saved.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self.cache_path = str(folder)
        code = function.__code__
        self._name = f"{function.__name__}-{code.co_firstlineno}"
        self._what = (function.__module__, function.__qualname__, self._name, hashlib.sha256(code.co_code).hexdigest(),
                      numba.__version__, llvmlite.__version__, sys.implementation.cache_tag)  # fmt: skip

    def _place(self, signature: Any, codegen: Any) -> tuple[Path, bytes]:
        """The file of a signature, and what it is the file of."""
        what = repr((*self._what, signature, codegen.magic_tuple())).encode()
        return Path(self.cache_path, f"{self._name}-{hashlib.sha256(what).hexdigest()[:16]}{_SUFFIX}"), what

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled kernel, or None where there is none that is whole."""
        target.refresh()
        path, what = self._place(signature, target.codegen())
        try:
            data = path.read_bytes()
        except OSError:
            return None
        content = data[_DIGEST:]
        if data[:_DIGEST] != hashlib.sha256(what + content).digest():
            return None
        parts = pickle.loads(content)  # noqa: S301 (ours: see _private)
        return _form.rebuild(target, parts)

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Store a kernel if possible; it runs in any case."""
        if compiled.lifted or compiled.library.has_dynamic_globals:  # such code is of this process alone
            return
        path, what = self._place(signature, compiled.codegen)
        content = dumps(_form.reduce(compiled))  # type: ignore[no-untyped-call]
        try:
            write_whole(path, hashlib.sha256(what + content).digest() + content)
        except OSError as error:
            _say_once(self.cache_path, error.strerror or str(error))

    def flush(self) -> None:
        """Delete the stored code of this kernel."""
        for path in Path(self.cache_path).glob(f"{self._name}-*{_SUFFIX}"):
            path.unlink(missing_ok=True)


@functools.cache
def _say_once(folder: str, reason: str) -> None:
    _log.warning("compiled kernels cannot be stored in %s: %s", folder, reason)


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
    compiled: Any = numba.njit(**_options(fuse))(function)
    folder = cache_folder(*(() if beside is None else (beside,)))
    # A switched-off numba gives the function back; what a closure holds is no part of a file's name.
    if folder is not None and hasattr(compiled, "enable_caching") and function.__closure__ is None:
        compiled._cache = _Stored(function, folder)  # numba has no other place to set this
    return compiled


@overload
def part(function: Function) -> Function: ...


@overload
def part(*, inline: bool = False, fuse: bool = True) -> Callable[[Function], Function]: ...


def part(function: Callable[..., Any] | None = None, *, inline: bool = False, fuse: bool = True) -> Any:
    """Compile a function that kernels call: it becomes part of their code, and is not stored separately.

    With ``inline`` it is placed into every calling kernel.  For small functions that return tuples: numba returns those
    through memory.
    """
    if function is None:
        return functools.partial(part, inline=inline, fuse=fuse)
    return numba.njit(forceinline=inline, **_options(fuse))(function)


def _options(fuse: bool) -> dict[str, Any]:
    return {"error_model": "numpy", "nogil": True, **({"fastmath": {"contract"}} if fuse else {})}
