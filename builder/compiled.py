"""How the solver's kernels are compiled: without fused multiply-add, and stored beside a digest of these sources."""

from __future__ import annotations

from pathlib import Path

from mumacro.kernel_cache import kernel

__all__ = ["SOURCES", "solver_kernel"]

SOURCES = Path(__file__).resolve().parent
solver_kernel = kernel(fuse=False, beside=SOURCES)
