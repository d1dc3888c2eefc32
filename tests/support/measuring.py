"""Shared by every script of benchmarks/ and fuzz/: clock, machine, tables, and the command line
that stores results.

Imported before numpy: it sets one thread for every numerical library, and numpy reads that once,
when it loads.
"""

import argparse
import os
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from time import perf_counter, process_time

from tests.support.documents import PAGES
from tests.support.places import ROOT

for _name in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
):
    os.environ[_name] = "1"

RESULTS = ROOT / "build" / "results"
IMAGES = ROOT / "docs" / "img"
PACKAGES = ("numpy", "scipy", "numba", "h5py", "pyarrow", "dask", "xarray", "uvicorn")
FINEST = ROOT / "tables" / "mumacro-1e-12.nc"


def sections(*each: Callable[..., str]) -> dict[str, Callable[..., str]]:
    """Sections for :func:`main` by the names of their functions."""
    return {section.__name__: section for section in each}


def main(
    text: str | None, sections: Mapping[str, Callable[..., str]], **options: float | str
) -> None:
    """The command line of a script: run its sections, print them, and with ``--write`` store them.

    A section returns Markdown; it receives the ``options``, each with its default, as keywords.  A
    line about the machine is added; the exit code is 1 where one says FAILED.  ``--write`` stores
    it as build/results/SCRIPT-SECTION.md, and between its markers where a document of :data:`PAGES`
    has them.
    """
    parser = argparse.ArgumentParser(
        description=text, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", choices=list(sections), help="one section")
    parser.add_argument(
        "--write", action="store_true", help="store the results in build/results, and in documents"
    )
    for name, default in options.items():
        if isinstance(default, bool):
            parser.add_argument(f"--{name}", action="store_true")
        else:
            parser.add_argument(
                f"--{name}", type=type(default), default=default, help=f"default: {default}"
            )
    arguments, failed = parser.parse_args(), False
    if arguments.write and (
        getattr(arguments, "quick", False) or getattr(arguments, "share", 1.0) < 1.0
    ):
        parser.error("--write stores full runs only")
    for name, section in sections.items():
        if arguments.only in (None, name):
            progress(f"{name} ...")
            started = perf_counter()
            report = section(**{option: getattr(arguments, option) for option in options})
            report += f"\n\nTook {(perf_counter() - started) / 60.0:.1f} min. {machine()}"
            print(f"## {name}\n\n{report}\n", flush=True)
            failed |= "FAILED" in report
            if arguments.write:
                write(Path(sys.argv[0]).stem, name, report)
    if failed:
        raise SystemExit(1)


def write(script: str, section: str, text: str) -> None:
    RESULTS.mkdir(parents=True, exist_ok=True)
    name = "-".join(dict.fromkeys((script, section)))
    (RESULTS / f"{name}.md").write_text(f"{text}\n", "utf-8")
    table = "\n".join(line for line in text.splitlines() if line.startswith("|"))
    for path in PAGES:
        page = path.read_text("utf-8")
        for shown, what, of in ((text, section, section), (table, f"{name}, table", name)):
            begin, end = f"<!-- begin {what} -->\n", f"<!-- end {of} -->"
            if begin in page:
                before, _, rest = page.partition(begin)
                page = f"{before}{begin}\n{shown}\n\n{end}{rest.partition(end)[2]}"
                path.write_text(page, "utf-8")


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    properties = {
        key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)
    }
    name = properties.get("model name", platform.machine())
    if "cpu family" in properties:
        name += f" (family {properties['cpu family']}, model {properties.get('model', '?')})"
    return name


def machine() -> str:
    """One line: processor, cores, system, Python, packages in use, and the load."""
    parts = [processor(), f"{os.cpu_count()} cores", f"{platform.system()} {platform.machine()}"]
    parts.append(f"Python {platform.python_version()}")
    parts += [f"{name} {version(name)}" for name in PACKAGES if name in sys.modules]
    if hasattr(os, "getloadavg"):
        parts.append(f"load average {os.getloadavg()[0]:.1f}")
    return "Machine: " + ", ".join(parts) + "."


def progress(text: str) -> None:
    """Report progress on stderr; stdout is for the tables only."""
    print(text, file=sys.stderr, flush=True)


def best_of(rounds: int, work: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """Processor seconds of the best of ``rounds`` calls of each function, after one untimed call;
    for one thread.

    The rounds are interleaved, so that other load slows all functions equally.
    """
    for call in work.values():
        call()
    best = dict.fromkeys(work, float("inf"))
    for _ in range(rounds):
        for name, call in work.items():
            start = process_time()
            call()
            best[name] = min(best[name], process_time() - start)
    return best


def quantity(value: float, digits: int = 2) -> str:
    """``value`` with ``digits`` significant digits: plain between 0.01 and 1e5, else as a power of
    ten."""
    if value == 0.0:
        return "0"
    if 0.01 <= abs(value) < 1e5:
        rounded = float(f"{value:.{digits}g}")
        return f"{rounded:,.0f}" if abs(rounded) >= 10 ** (digits - 1) else f"{rounded:g}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """A Markdown table; the first ``text_columns`` columns are text, the rest numbers, set to the
    right."""
    widths = [max(len(header[i]), 3, *(len(row[i]) for row in rows)) for i in range(len(header))]

    def line(cells: Sequence[str]) -> str:
        sized = enumerate(zip(cells, widths, strict=True))
        return (
            "| "
            + " | ".join(c.ljust(w) if i < text_columns else c.rjust(w) for i, (c, w) in sized)
            + " |"
        )

    rule = ["-" * w if i < text_columns else "-" * (w - 1) + ":" for i, w in enumerate(widths)]
    return "\n".join([line(header), line(rule), *map(line, rows)])
