"""Compilers used by tests of exports, if installed, and a function to call them."""

import functools
import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

STRICT = ("-Wall", "-Wextra", "-pedantic", "-Werror")


@functools.cache
def compiler(name: str) -> tuple[str, ...]:
    """The command of a compiler; skips the test if it is not installed."""
    if name.startswith("zig"):
        if importlib.util.find_spec("ziglang") is None:
            pytest.skip("zig is not installed (pip install ziglang)")
        return (sys.executable, "-m", "ziglang", name.removeprefix("zig "))
    result = shutil.which(name)
    if result is None:
        pytest.skip(f"{name} is not installed")
    return (result,)


def run(*command: object, cwd: Path | None = None, stdin: str = "") -> str:
    """The output of a command that must succeed."""
    words = [str(word) for word in command]
    done = subprocess.run(
        words, cwd=cwd, input=stdin, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    return done.stdout
