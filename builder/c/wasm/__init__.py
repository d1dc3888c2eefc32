"""``--format wasm``: a table as a WebAssembly module for a web page, made of the C header.

It needs no C library and imports nothing.  Exported are ``memory`` and the functions of ``module.c``.
"""

import shutil
from pathlib import Path

from mumacro.table import Table

from ..source import ExportError, compiled, header_text, zig

_HERE = Path(__file__).parent
_OPTIONS = (
    "-Oz", "-std=c99", "-ffreestanding", "-nostdlib", "-fno-math-errno", "-ffp-contract=off", "-mbulk-memory",
    "-isystem", str(_HERE / "include"), "-Wl,--no-entry", "-Wl,--strip-all", "-Wl,-z,stack-size=262144",
)  # fmt: skip


def compiler() -> list[str] | None:
    """The command of a compiler for WebAssembly: zig, else clang with wasm-ld; None without one."""
    clang = ["clang", "--target=wasm32"] if shutil.which("clang") and shutil.which("wasm-ld") else None
    return zig("wasm32-freestanding") or clang


def wasm(table: Table) -> bytes:
    """The module for ``table``.

    Raises
    ------
    ExportError
        No compiler is installed, or it fails.
    """
    command = compiler()
    if command is None:
        raise ExportError("WebAssembly needs zig (pip install ziglang), or clang with lld; neither is installed")
    return compiled({"mumacro.h": header_text(table)}, [*command, *_OPTIONS, str(_HERE / "module.c")])
