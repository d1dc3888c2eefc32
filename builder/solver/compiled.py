"""How the solver is compiled, and the digest of everything that its results depend on."""

import hashlib
import platform
from pathlib import Path

import llvmlite
import numba

import mumacro

#: Compiles a function at its first call in a process; it runs without the interpreter's lock and
#: without fused multiply-add.  Nothing is stored: see docs/decisions.md.
solver_kernel = numba.njit(error_model="numpy", nogil=True)

_LIBRARY = Path(mumacro.__file__).resolve().parent
SOURCES = (
    (Path(__file__).resolve().parent.parent, "*.py"),
    (_LIBRARY, "*.py"),
    (_LIBRARY / "kernel", "*.[ch]"),
)


def source_digest() -> str:
    """Digest of the sources of builder and evaluation and of the compiler: where it differs,
    numbers may differ."""
    compiler = (
        numba.__version__,
        llvmlite.__version__,
        platform.python_version(),
        platform.machine(),
    )
    h = hashlib.sha256(repr(compiler).encode())
    for folder, pattern in SOURCES:
        # folders too: what is moved into one still counts
        for source in sorted(folder.rglob(pattern)):
            h.update(source.relative_to(folder).as_posix().encode())
            h.update(source.read_bytes())
    return h.hexdigest()[:16]
