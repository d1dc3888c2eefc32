"""Write files that are either complete or absent."""

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
    """Yield a file that is written within the block.  At the end of the block it is complete on the
    disk, and replaces an older one.

    After an exception nothing is left, and an older file stays.  On Linux the new file has no name
    before its end, so a killed process leaves nothing, either.
    """
    name = path.with_name(f".{path.name}.{os.urandom(4).hex()}.growing")
    handle = _without_name(path.parent)
    stream: BinaryIO = name.open("xb") if handle is None else os.fdopen(handle, "wb")
    try:
        with stream:
            yield stream
            to_disk(stream)
            if handle is not None:
                # Python follows the link because its source is a descriptor
                os.link(f"/proc/self/fd/{handle}", name, src_dir_fd=handle)
        os.replace(name, path)
    except BaseException:
        name.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def _without_name(folder: Path) -> int | None:
    """Return a new file without a name in a folder, or None if the system or its disk cannot do
    this."""
    if not hasattr(os, "O_TMPFILE") or not Path("/proc/self/fd").is_dir():
        return None
    try:
        return os.open(folder, os.O_TMPFILE | os.O_WRONLY, 0o666)
    except OSError:  # also an error of the folder itself: opening by name will report it
        return None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that it is complete or absent.

    After OSError nothing is left, and an older file stays.
    """
    with growing(path) as stream:
        stream.write(content)
