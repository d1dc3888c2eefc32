"""Time and memory to the first answer of a new process; that of the service: benchmarks/service.py."""

import os
import statistics
import subprocess
import sys
import time

from benchmarks.measuring import ROOT, main, markdown, progress, quantity

CASE = "mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01"
COMMANDS = {
    "`import numpy`, for comparison": ["-c", "import numpy"],
    "`import mumacro`": ["-c", "import mumacro"],
    "one case, `s.evaluate(...)`": ["-c", f"import mumacro; mumacro.open().evaluate({CASE})"],
    "`mumacro 'mu0=0.3 ...'`, one case": ["-m", "mumacro", CASE.replace(",", "")],
    "`python -m builder solve`": ["-m", "builder", "solve", "--v", "0.1", "--y", "2"],
}


def measured(arguments: list[str]) -> tuple[float, float, float]:
    """Seconds from start to end, seconds of processor time, MB of memory at most, of a process."""
    started = time.perf_counter()
    process = subprocess.Popen([sys.executable, *arguments], cwd=ROOT, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{arguments} ended with {os.waitstatus_to_exitcode(status)}")
    return time.perf_counter() - started, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def cold_start(rounds: int, quick: bool) -> str:
    rows = []
    for name, arguments in list(COMMANDS.items())[: 4 if quick else None]:
        progress(name)
        found = [measured(arguments) for _ in range(1 if quick else rounds)]
        rows.append([name, *(quantity(statistics.median(one)) for one in zip(*found, strict=True))])
    head = ["a new process", "time [s]", "processor time [s]", "memory [MB]"]
    return f"Median of {rounds} rounds.\n\n{markdown(head, rows)}"


if __name__ == "__main__":
    main(__doc__, {"cold_start": cold_start}, rounds=5, quick=False)
