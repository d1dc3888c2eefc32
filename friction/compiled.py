"""Where compiled kernels are kept between runs: a folder named after the sources they were compiled from.

numba's own index looks only at the file that a kernel stands in, not at the kernels it calls in other files; after an
update it would go on running old code.  So the folder's name holds a digest of every source file of the project.
Imported first by the package; ``NUMBA_CACHE_DIR`` still says where the folder lies.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

import numba

__all__ = ["cache_folder", "source_digest"]


def source_digest() -> str:
    """Digest of every source file of solver and core: another digest may mean other numbers."""
    h = hashlib.sha256()
    root = Path(__file__).resolve().parent.parent
    for package in ("friction", "builder", "service/compiled"):
        for source in sorted((root / package).glob("*.py")):
            h.update(source.name.encode())
            h.update(source.read_bytes())
    return h.hexdigest()[:16]


def cache_folder() -> Path:
    """The folder for these sources: below NUMBA_CACHE_DIR, else in the user's cache, else in the temporary folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen) / f"mumacro-{source_digest()}"
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "mumacro" / source_digest()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.gettempdir()) / f"mumacro-{os.getuid() if hasattr(os, 'getuid') else 0}" / source_digest()


setattr(numba.config, "CACHE_DIR", str(cache_folder()))  # noqa: B010 (an attribute that numba's types do not know)
