"""Time to the first answer: before the kernels are compiled, and in later processes.

Every row is a separate process, timed from start to end (the service: to its first ready response).  "empty" has an
empty folder of kernels, as after an installation; "kept" is the same process again.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

from measuring import ROOT, free_port, machine, markdown, progress, quantity, write_section

CASE = "mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5"
OPEN = "import numpy as np, mumacro; s = mumacro.open(); "
MANY = f"s.evaluate({CASE}, v0=np.geomspace(1e-3, 1.0, 1000))"
SOLVE = f"from mumacro.inverse import solve_for; solve_for(s, 'v0', 0.25, dict({CASE}))"
SCRIPTS = {
    "`import mumacro`": "import mumacro",
    "`mumacro.open()`": OPEN,
    "one case, `s.evaluate(...)`": OPEN + f"s.evaluate({CASE}, v0=0.01)",
    "1,000 cases, `s.evaluate(...)`": OPEN + MANY,
    "1,000 cases, some with v0 = 0": OPEN
    + MANY.replace("np.geomspace(1e-3, 1.0, 1000)", "np.linspace(0.0, 1.0, 1000)"),
    "one case with its gradient": OPEN + f"s.evaluate({CASE}, v0=0.01, gradient=True)",
    "one power, `s.power(v, y)`": OPEN + "s.power(0.1, 2.0)",
    "one root, `solve_for(...)`": OPEN + SOLVE,
}
COMMANDS = {
    "`mumacro 'mu0=0.3 ...'`, one case": ["-m", "mumacro", "mu0=0.3 Fz=10 k=1e6 y0=2e-6 omega=1.3e5 v0=0.01"],
    "`python -m builder solve`": ["-m", "builder", "solve", "--v", "0.1", "--y", "2"],
}  # fmt: skip
SERVICE = "`python -m service` until `/readyz` answers 200"


def seconds_of(arguments: list[str], environment: dict[str, str]) -> float:
    """From the start of a process to its end."""
    started = time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], cwd=ROOT, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{arguments}: {done.stderr}")
    return time.perf_counter() - started


def seconds_until_ready(environment: dict[str, str]) -> float:
    """From the start of the service to its first ready response."""
    port = free_port()
    started = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "service", "--port", str(port)],
        cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        while process.poll() is None:
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=5):
                    return time.perf_counter() - started
            except (urllib.error.URLError, OSError):
                time.sleep(0.02)
    finally:
        process.terminate()
        process.wait()
    raise SystemExit("the service ended before it was ready")


def works() -> dict[str, Callable[[dict[str, str]], float]]:
    """The timed processes."""
    arguments = {name: ["-c", script] for name, script in SCRIPTS.items()} | COMMANDS
    timed: dict[str, Callable[[dict[str, str]], float]] = {
        name: (lambda environment, words=words: seconds_of(words, environment)) for name, words in arguments.items()
    }
    return timed | {SERVICE: seconds_until_ready}


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="one round of one line")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    if options.quick and options.write:
        parser.error("--quick cannot be combined with --write")
    timed = dict(list(works().items())[2:3]) if options.quick else works()
    rows = []
    for name, work in timed.items():
        progress(name)
        empty, kept, size = [], [], 0
        for _ in range(1 if options.quick else options.rounds):
            with tempfile.TemporaryDirectory() as folder:
                environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
                empty.append(work(environment))
                kept.append(work(environment))
                size = sum(path.stat().st_size for path in Path(folder).rglob("*.kernel"))
        rows.append([name, *(quantity(statistics.median(times)) for times in (empty, kept)), quantity(size / 1e6)])
    head = ["a new process", "empty [s]", "kept [s]", "kernels [MB]"]
    note = f"{machine('llvmlite', 'fastapi')} Median of {options.rounds} rounds."
    text = note + "\n\n" + markdown(head, rows)
    print(text)
    if options.write:
        write_section("cold_start", text)


if __name__ == "__main__":
    main()
