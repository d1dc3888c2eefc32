"""``--format wasm``: a table as a WebAssembly module for a web page, made of the C header.

It is compiled by zig or, where that is not installed, by clang with wasm-ld; it needs no C library and imports nothing.
Exported are ``memory`` and the functions of ``module.c``.
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import BinaryIO

from mumacro.errors import MumacroError
from mumacro.table import Table

from ..source import header_text

__all__ = ["WasmError", "compiler", "write_wasm"]

_HERE = Path(__file__).parent
_OPTIONS = (
    "-Oz", "-std=c99", "-ffreestanding", "-nostdlib", "-fno-math-errno", "-ffp-contract=off", "-mbulk-memory",
    "-isystem", str(_HERE / "include"), "-Wl,--no-entry", "-Wl,--strip-all", "-Wl,-z,stack-size=262144",
)  # fmt: skip


class WasmError(MumacroError):
    """There is no compiler for WebAssembly, or it refuses the source; the text states which."""


def compiler() -> list[str] | None:
    """The command of a compiler for WebAssembly; None without one."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-freestanding"]
    clang = shutil.which("clang")
    return [clang, "--target=wasm32"] if clang and shutil.which("wasm-ld") else None


def write_wasm(table: Table, out: BinaryIO) -> None:
    """Write the module for ``table``.

    Raises
    ------
    WasmError
        No compiler is installed, or it fails.
    """
    command = compiler()
    if command is None:
        raise WasmError("WebAssembly needs zig (pip install ziglang), or clang with lld; neither is installed")
    with tempfile.TemporaryDirectory(prefix="mumacro-") as name:
        folder = Path(name)
        (folder / "mumacro.h").write_text(header_text(table), "ascii")
        words = [*command, *_OPTIONS, str(_HERE / "module.c"), "-I.", "-o", "mumacro.wasm"]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
        if done.returncode != 0:
            raise WasmError(f"{' '.join(words)}: {done.stderr.strip()[-2000:]}")
        out.write((folder / "mumacro.wasm").read_bytes())
