"""Shared by the scripts here: the source tree on the path, and docs/reliability.md, which contains their results."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]  # in this order: both hold a module "service"

import measuring  # noqa: E402 (found by the lines above)

__all__ = ["PAGE", "ROOT", "NotTriedError", "report", "took", "tried"]

PAGE = ROOT / "docs" / "reliability.md"


def report(text: str, sections: Mapping[str, Callable[[float], str]], arguments: list[str] | None = None) -> None:
    """The command line of a script: run its sections, print them, and with ``--write`` write them to the page.

    A section takes a share of the full run, from 0 to 1, and returns Markdown.
    """
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=list(sections), help="one section")
    parser.add_argument("--share", type=float, default=1.0, help="of the full run; default: all of it")
    parser.add_argument("--write", action="store_true", help="put the figures into docs/reliability.md")
    given = parser.parse_args(arguments)
    for name, section in sections.items():
        if given.only in (None, name):
            measuring.progress(f"{name} ...")
            found = section(given.share)
            print(f"## {name}\n\n{found}\n", flush=True)
            if given.write:
                measuring.write_section(name, found, PAGE)


class NotTriedError(Exception):
    """A trial cannot be made here; the message says why."""


def tried(trial: Callable[[], str]) -> tuple[str, str]:
    """Result of a trial ("held" if it passed), and what was seen."""
    try:
        return "held", trial()
    except NotTriedError as reason:
        return "not tried", str(reason)
    except AssertionError as error:
        return "FAILED", " ".join(str(error).split())[:300]


def took(started: float, *packages: str) -> str:
    """The last line of a section: how long it took, and where."""
    return f"Took {(time.perf_counter() - started) / 60.0:.1f} min. {measuring.machine(*packages)}"
