"""Time and memory to the first answer of a new process; the service: to its first ready response."""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
import urllib.error
import urllib.request

from measuring import ROOT, free_port, machine, markdown, progress, quantity, write_section

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


def until_ready(port: int) -> None:
    """Wait for the service's first ready response."""
    for _ in range(3000):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=5):
                return
        except (urllib.error.URLError, OSError):
            time.sleep(0.02)
    raise SystemExit("the service was not ready within a minute")


def measured(arguments: list[str], port: int = 0) -> tuple[float, float, float]:
    """Seconds from start to end (or ready), seconds of processor time, MB of memory at most, of a process."""
    started = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *arguments], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    if port:
        until_ready(port)
        waited = time.perf_counter() - started
        process.terminate()
    _, status, used = os.wait4(process.pid, 0)
    if status and not port:
        raise SystemExit(f"{arguments} ended with {os.waitstatus_to_exitcode(status)}")
    seconds = waited if port else time.perf_counter() - started
    return seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="one round of one line")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    if options.quick and options.write:
        parser.error("--quick cannot be combined with --write")
    rows = []
    names = ["`import mumacro`"] if options.quick else [*COMMANDS, SERVICE]
    for name in names:
        progress(name)
        found = []
        for _ in range(1 if options.quick else options.rounds):
            port = free_port() if name == SERVICE else 0
            found.append(measured(COMMANDS.get(name) or ["-m", "service", "--port", str(port)], port))
        rows.append([name, *(quantity(statistics.median(one)) for one in zip(*found, strict=True))])
    head = ["a new process", "time [s]", "processor time [s]", "memory [MB]"]
    text = f"{machine('h5py', 'fastapi')} Median of {options.rounds} rounds.\n\n{markdown(head, rows)}"
    print(text)
    if options.write:
        write_section("cold_start", text)


if __name__ == "__main__":
    main()
