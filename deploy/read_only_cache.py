"""Lets numba use compiled kernels that lie in a directory which cannot be written.

numba wants to write into its cache directory before it so much as reads from it: a program that finds no writable
one stops with "no locator available", and one that compiles something new stops when it cannot save that.  In the
image the kernels are compiled at build time and the root file system is read-only afterwards.  There the directory
is taken as it is, and a kernel that was forgotten costs seconds and a warning instead of the answer.

Named in ``NUMBA_CACHE_LOCATOR_CLASSES`` (see the Dockerfile); part of nothing else.
"""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, Any

from numba.core import config
from numba.core.caching import IndexDataCacheFile, UserProvidedCacheLocator

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["ReadOnlyCacheLocator"]

_log = logging.getLogger("mumacro.kernels")
_save = IndexDataCacheFile.save


class ReadOnlyCacheLocator(UserProvidedCacheLocator):
    """The directory in ``NUMBA_CACHE_DIR``, writable (while the image is built) or not (ever after)."""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> ReadOnlyCacheLocator | None:
        return cls(py_func, py_file) if config.CACHE_DIR else None  # type: ignore[attr-defined]  # set at run time

    def ensure_cache_path(self) -> None:
        """Make the directory if that is possible; if not, :func:`_save_if_possible` has the last word."""
        try:
            super().ensure_cache_path()  # type: ignore[no-untyped-call]
        except OSError:
            return


def _save_if_possible(self: IndexDataCacheFile, key: Any, data: Any) -> None:
    try:
        _save(self, key, data)  # type: ignore[no-untyped-call]
    except OSError as error:
        name = os.path.basename(self._index_path)
        _log.warning("kernel %s was compiled while serving: extend Surrogate.warm_up (%s)", name, error)


# numba offers no hook here, only a locator; the lock file pins the version that this was written for.
IndexDataCacheFile.save = _save_if_possible  # type: ignore[method-assign]
