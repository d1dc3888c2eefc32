"""Files that are either complete or absent, and folders that one process has locked."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mumacro.errors import MumacroError

try:
    import fcntl
except ImportError:  # Windows: two processes are not distinguished
    fcntl = None  # type: ignore[assignment]


class BusyError(MumacroError):
    """Another process is writing the same output."""


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk, if the system can."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def put(growing: Path, path: Path) -> None:
    """Bring a whole file to the disk, then give it its name."""
    with growing.open("r+b") as stream:
        os.fsync(stream.fileno())
    os.replace(growing, path)
    sync_folder(path.parent)


def write_whole(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Write a file under another name beside its place, to the disk, and rename it.

    OSError leaves nothing behind, and an older file stays.
    """
    import tempfile  # only writing needs it: reading a table starts sooner without

    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".growing")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        Path(name).chmod(mode)
        put(Path(name), path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Make a folder and have it to oneself, or BusyError; one that is empty at the end goes away.

    The system releases it when the process ends, in any way.
    """
    while True:
        folder.mkdir(exist_ok=True)
        if fcntl is None:
            handle = None
            break
        handle = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            raise BusyError(
                f"{folder}: another process is at work here; wait for it, or stop it"
            ) from None
        except OSError:  # a file system without locks
            break
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), folder.stat()):
                break
        os.close(handle)  # its owner has removed it since
    try:
        yield
    finally:
        with suppress(OSError):
            folder.rmdir()
        if handle is not None:
            os.close(handle)
