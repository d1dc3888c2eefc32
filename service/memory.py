"""Memory is given back to the system: what only a start needs when it is over, what a body took when it is read.

On Linux; elsewhere, and wherever anything looks unusual, nothing happens.
"""

import asyncio
import ctypes
import mmap
import re
import sys
from collections.abc import Awaitable, Callable, Iterator
from functools import cache
from pathlib import Path

__all__ = ["Mapped", "clean_mappings", "give_back", "keep_lean", "trim"]

# Libraries that load compiled code and read tables, but take no part in answering; mapped, and not to be written to.
_ONLY_TO_START = re.compile(
    r"^([0-9a-f]+)-([0-9a-f]+) r-[-x]p [^/\n]*/[^\n]*"
    r"/(?:llvmlite|netCDF4|netcdf4\.libs)/[^\n]*\.so[^\n/ ]*$",
    re.MULTILINE,
)
# What a process writes to a page of a file that it maps for itself becomes a page of its own: Anonymous, or Swap.
# Dirty alone says that the file has not reached the disk yet, as in an image that has just been unpacked.
_NONE_OF = ("Anonymous", "Swap", "Locked")
_MADV_DONTNEED = 4
_LOOK_EVERY_S = 5.0
_MANY_PAGES = 4096  # worth looking for what to give back, which takes some milliseconds


class Mapped(mmap.mmap):
    """Mapped memory whose end keeps nobody waiting.

    To unmap a hundred megabytes takes ten milliseconds, and Python does it with the interpreter's lock.  Here the pages
    are gone before that, without the lock.
    """

    def __del__(self) -> None:
        """Leave the pages; nobody looks at them any more."""
        if sys.platform == "linux" and not self.closed:
            first = ctypes.c_char.from_buffer(self)
            _system().madvise(ctypes.c_void_p(ctypes.addressof(first)), ctypes.c_size_t(len(self)), _MADV_DONTNEED)


@cache
def _system() -> ctypes.CDLL:
    return ctypes.CDLL(None)  # calls leave the lock


def give_back() -> None:
    """Leave the pages of libraries that are not needed any more, and hand free memory back.

    LLVM's code is mapped from its file.  Its pages count as this process's memory as long as it maps them, though they
    are the file's, in the system's cache.  Leaving those that nobody wrote to loses nothing: what is asked for again,
    say to compile after all, is mapped again.
    """
    if sys.platform != "linux":
        return
    try:
        system = _system()
        for start, size in clean_mappings(Path("/proc/self/smaps").read_text()):
            system.madvise(ctypes.c_void_p(start), ctypes.c_size_t(size), _MADV_DONTNEED)
    except (OSError, ValueError, AttributeError):
        pass  # memory is all that it was about
    trim()


async def keep_lean(run: Callable[[Callable[[], None]], Awaitable[None]]) -> None:
    """Give back again, for ever, what kernels that are loaded later bring in; ``run`` does it in another thread."""
    known = _file_pages()
    while True:
        await asyncio.sleep(_LOOK_EVERY_S)
        if _file_pages() > known + _MANY_PAGES:
            await run(give_back)
            known = _file_pages()


def _file_pages() -> int:
    """Resident pages that are mapped from files; 0 where nobody tells."""
    try:
        return int(Path("/proc/self/statm").read_bytes().split()[2])
    except (OSError, ValueError, IndexError):
        return 0


def trim() -> None:
    """Hand free memory back: every thread's heap keeps what its largest batch took."""
    if sys.platform == "linux" and hasattr(_system(), "malloc_trim"):  # of glibc
        _system().malloc_trim(ctypes.c_size_t(0))


def clean_mappings(smaps: str) -> Iterator[tuple[int, int]]:
    """Yield address and size of what is mapped from those libraries and was never written to."""
    # Nobody can write to such a page between this look and what follows, so nothing can be lost.
    for head in _ONLY_TO_START.finditer(smaps):
        counted = smaps[head.end() : smaps.index("VmFlags:", head.end())]
        if all(re.search(rf"^{name}: +0 kB$", counted, re.MULTILINE) for name in _NONE_OF):
            start, end = (int(address, 16) for address in head.groups())
            yield start, end - start
