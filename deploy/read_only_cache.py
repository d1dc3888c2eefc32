"""Lets numba load compiled kernels from a directory that cannot be written.

numba tries to write into its cache directory before it so much as reads from it, and a program that finds no
writable one stops with "no locator available".  In the image the kernels are compiled at build time and the
root file system is read-only afterwards, so this locator takes the directory as it is.  It is named in
``NUMBA_CACHE_LOCATOR_CLASSES`` (see the Dockerfile) and is part of nothing else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numba.core import config
from numba.core.caching import UserProvidedCacheLocator

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["ReadOnlyCacheLocator"]


class ReadOnlyCacheLocator(UserProvidedCacheLocator):
    """The directory in ``NUMBA_CACHE_DIR``, writable (while the image is built) or not (ever after)."""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> ReadOnlyCacheLocator | None:
        return cls(py_func, py_file) if config.CACHE_DIR else None  # type: ignore[attr-defined]  # set at run time

    def ensure_cache_path(self) -> None:
        """Called only to save a fresh compilation, which in a finished image means that one was forgotten."""
        try:
            super().ensure_cache_path()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise RuntimeError(
                f"a kernel of {self._py_file} was not compiled for this call when the image was built, "
                "and its cache is read-only now: extend Surrogate.warm_up"
            ) from error
