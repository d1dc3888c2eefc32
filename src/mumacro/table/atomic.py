"""Files that are either complete or absent."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk, if the system can."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def to_disk(stream: BinaryIO) -> None:
    """Flush a file to the disk."""
    stream.flush()
    os.fsync(stream.fileno())


@contextmanager
def growing(path: Path) -> Iterator[BinaryIO]:
    """Yield a file to be written within the block; at its end it is on the disk, whole, and takes
    the place of an older one.

    An exception leaves nothing behind, and an older file stays.  On Linux the new file has no name
    before its end: a killed process leaves nothing, either.
    """
    name = path.with_name(f".{path.name}.{os.urandom(4).hex()}.growing")
    handle = _without_name(path.parent)
    stream: BinaryIO = name.open("xb") if handle is None else os.fdopen(handle, "wb")
    try:
        with stream:
            yield stream
            to_disk(stream)
            if handle is not None:
                # a descriptor of the source, whichever it is, makes Python follow the link
                os.link(f"/proc/self/fd/{handle}", name, src_dir_fd=handle)
        os.replace(name, path)
    except BaseException:
        name.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def _without_name(folder: Path) -> int | None:
    """Return a new file without a name in a folder; None where the system or its disk has none."""
    if not hasattr(os, "O_TMPFILE") or not Path("/proc/self/fd").is_dir():
        return None
    try:
        return os.open(folder, os.O_TMPFILE | os.O_WRONLY, 0o666)
    except OSError:  # of the folder itself, too: opening by name tells it
        return None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file that is complete or absent.

    OSError leaves nothing behind, and an older file stays.
    """
    with growing(path) as stream:
        stream.write(content)
