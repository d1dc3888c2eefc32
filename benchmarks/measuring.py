"""Imported first by every script here: one thread for every library, the source tree on the path; clock and tables.

``import measuring`` must stand before numpy, which reads the thread counts once, when it loads.
"""

from __future__ import annotations

import os
import platform
import socket
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter, process_time

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ[_name] = "1"

ROOT = Path(__file__).resolve().parent.parent
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

__all__ = [
    "CLOCKS",
    "IMAGES",
    "PAGE",
    "ROOT",
    "Timed",
    "best_of",
    "free_port",
    "machine",
    "markdown",
    "progress",
    "quantity",
    "read_section",
    "write_section",
]

PAGE = ROOT / "docs" / "benchmarks.md"
IMAGES = ROOT / "docs" / "img"


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    found = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    name = found.get("model name", platform.machine())
    if "cpu family" in found:
        name += f" (family {found['cpu family']}, model {found.get('model', '?')})"
    return name


def _version(package: str) -> str | None:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return None


def machine(*packages: str) -> str:
    """One line: processor, cores, system, Python, the relevant versions, and the load of the machine."""
    parts = [processor(), f"{os.cpu_count()} cores", f"{platform.system()} {platform.machine()}"]
    parts.append(f"Python {platform.python_version()}")
    parts += [text for text in map(_version, ("numpy", "numba", *packages)) if text]
    if hasattr(os, "getloadavg"):
        parts.append(f"load average {os.getloadavg()[0]:.1f}")
    return "Machine: " + ", ".join(parts) + "."


def progress(text: str) -> None:
    """Report progress on stderr; stdout is for the tables only."""
    print(text, file=sys.stderr, flush=True)


@dataclass(frozen=True)
class Timed:
    """Seconds of the best round of each function, the clock, and the share of wall-clock time on a processor."""

    best: dict[str, float]
    share: float
    clock: str

    def note(self) -> str:
        """One sentence about the clock and other load."""
        what = "wall clock" if self.clock == "wall" else "processor time"
        return f"Times are {what}; the process had a processor for {100.0 * self.share:.0f} % of the time it was timed."


#: processor time is for busy machines; it sums over threads, so use it for single-threaded code
CLOCKS: dict[str, Callable[[], float]] = {"wall": perf_counter, "processor": process_time}


def best_of(rounds: int, work: Mapping[str, Callable[[], object]], clock: str = "wall") -> Timed:
    """Time the best of ``rounds`` calls of each function, after one untimed call.

    The rounds are interleaved, so that other load slows all functions equally.
    """
    for call in work.values():
        call()
    best = dict.fromkeys(work, float("inf"))
    wall = own = 0.0
    for _ in range(rounds):
        for name, call in work.items():
            start, before = perf_counter(), process_time()
            call()
            seconds, busy = perf_counter() - start, process_time() - before
            wall, own = wall + seconds, own + min(seconds, busy)
            best[name] = min(best[name], seconds if clock == "wall" else busy)
    return Timed(best, own / wall, clock)


def free_port() -> int:
    """An unused port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def quantity(value: float, digits: int = 2) -> str:
    """``value`` with ``digits`` significant digits: plain between 0.01 and 1e5, else as a power of ten."""
    if value == 0.0:
        return "0"
    if 0.01 <= abs(value) < 1e5:
        rounded = float(f"{value:.{digits}g}")
        return f"{rounded:,.0f}" if abs(rounded) >= 10 ** (digits - 1) else f"{rounded:g}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """A Markdown table; the first ``text_columns`` columns are text, the rest numbers, set to the right."""
    widths = [max(len(header[i]), 3, *(len(row[i]) for row in rows)) for i in range(len(header))]

    def line(cells: Sequence[str]) -> str:
        padded = (
            c.ljust(w) if i < text_columns else c.rjust(w) for i, (c, w) in enumerate(zip(cells, widths, strict=True))
        )
        return "| " + " | ".join(padded) + " |"

    rule = ["-" * w if i < text_columns else "-" * (w - 1) + ":" for i, w in enumerate(widths)]
    return "\n".join([line(header), line(rule), *map(line, rows)])


def _parts(name: str, path: Path) -> tuple[str, str, str]:
    """The text before, between and after the markers of ``name``; the markers are in the outer parts."""
    page = path.read_text(encoding="utf-8")
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    if page.count(begin) != 1 or page.count(end) != 1:
        raise ValueError(f"{path} must hold {begin!r} and {end!r} once each")
    before, _, rest = page.partition(begin)
    between, _, after = rest.partition(end)
    return before + begin, between, end + after


def read_section(name: str, path: Path = PAGE) -> str:
    """The text between the markers of ``name`` on a page, by default docs/benchmarks.md.

    Raises
    ------
    ValueError
        When the page lacks one of the markers.
    """
    return _parts(name, path)[1]


def write_section(name: str, text: str, path: Path = PAGE) -> None:
    """Replace what :func:`read_section` reads; raises the same."""
    before, _, after = _parts(name, path)
    lines = text.strip("\n")  # newlines only: a first line may be indented
    path.write_text(f"{before}\n{lines}\n\n{after}", encoding="utf-8")
