"""Time and memory to the first answer of a new process; the service: to its first ready response."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time

from benchmarks.measuring import ROOT, main, markdown, progress, quantity
from tests.serving import serving

CASE = "mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5"
OPEN = "import numpy as np, mumacro; s = mumacro.open(); "
SOLVE = f"from mumacro.inverse import solve_for; solve_for(s, 'v0', 0.25, dict({CASE}))"
COMMANDS = {
    "`import numpy`, for comparison": ["-c", "import numpy"],
    "`import mumacro`": ["-c", "import mumacro"],
    "one case, `s.evaluate(...)`": ["-c", OPEN + f"s.evaluate({CASE}, v0=0.01)"],
    "1,000 cases with gradients": ["-c", OPEN + f"s.evaluate({CASE}, v0=np.linspace(0.0, 1.0, 1000), gradient=True)"],
    "one power, `s.power(v, y)`": ["-c", OPEN + "s.power(0.1, 2.0)"],
    "one root, `solve_for(...)`": ["-c", OPEN + SOLVE],
    "`mumacro 'mu0=0.3 ...'`, one case": ["-m", "mumacro", "mu0=0.3 Fz=10 k=1e6 y0=2e-6 omega=1.3e5 v0=0.01"],
    "`python -m builder solve`": ["-m", "builder", "solve", "--v", "0.1", "--y", "2"],
}  # fmt: skip
SERVICE = "`python -m service` until `/readyz` answers 200"


def measured(arguments: list[str]) -> tuple[float, float, float]:
    """Seconds from start to end, seconds of processor time, MB of memory at most, of a process."""
    started = time.perf_counter()
    process = subprocess.Popen([sys.executable, *arguments], cwd=ROOT, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{arguments} ended with {os.waitstatus_to_exitcode(status)}")
    return time.perf_counter() - started, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def ready() -> tuple[float, float, float]:
    """The same for the service, from the start to its first ready response."""
    with serving(ready=False) as server:
        return server.wait_until_ready(), server.busy(), server.memory("VmHWM")


def cold_start(rounds: int, quick: bool) -> str:
    """A line for every way to start."""
    rows = []
    for name in list(COMMANDS)[1:2] if quick else [*COMMANDS, SERVICE]:
        progress(name)
        found = [ready() if name == SERVICE else measured(COMMANDS[name]) for _ in range(1 if quick else rounds)]
        rows.append([name, *(quantity(statistics.median(one)) for one in zip(*found, strict=True))])
    head = ["a new process", "time [s]", "processor time [s]", "memory [MB]"]
    return f"Median of {rounds} rounds.\n\n{markdown(head, rows)}"


if __name__ == "__main__":
    main(__doc__, {"cold_start": cold_start}, rounds=5, quick=False)
