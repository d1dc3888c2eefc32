"""What is left out at a start, and given back after it: nothing that is missed."""

import asyncio
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from service import memory
from service.memory import Mapped, clean_mappings, trim

_GIVEN_BACK = """
from service.memory import give_back
import numpy as np
import kernel

result = [kernel.total(np.arange(4.0))]
give_back()
result.append(kernel.total(np.arange(4.0)))
result.append(kernel.total(np.arange(5)))      # of a type that nothing was compiled for
print(result, sum(kernel.total.stats.cache_hits.values()))
"""

_KERNEL = """
import numba

@numba.njit(cache=True)
def total(values):
    found = 0.0
    for value in values.copy():
        found += value
    return found
"""

_FIELDS = "Rss: 8 kB\nShared_Dirty: 0 kB\nPrivate_Dirty: {dirty} kB\nAnonymous: {own} kB\nSwap: 0 kB\nLocked: 0 kB\n"
_MAPPED = "{range} {rights} 00001000 08:01 77    {path}\n" + _FIELDS + "VmFlags: rd mr mw me\n"


@pytest.fixture
def apart(tmp_path: Path, repository: Path) -> dict[str, str]:
    """The variables of a process with a cache of its own, beside a module with a compiled function."""
    (tmp_path / "kernel.py").write_text(_KERNEL)
    return {
        **os.environ,
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": f"{tmp_path}{os.pathsep}{repository}",
    }


def _run(code: str, variables: dict[str, str]) -> str:
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=variables, capture_output=True, text=True, check=True).stdout.strip()


def test_code_runs_loads_and_compiles_after_pages_were_given_back(apart):
    assert _run(_GIVEN_BACK, apart) == "[6.0, 6.0, 10.0] 0"
    assert _run(_GIVEN_BACK, apart) == "[6.0, 6.0, 10.0] 2"


@pytest.mark.parametrize(
    ("rights", "path", "dirty", "own", "given_back"),
    [
        ("r-xp", "/x/site-packages/llvmlite/binding/libllvmlite.so", 0, 0, True),
        ("r--p", "/x/my packages/netcdf4.libs/libhdf5-1.so.320.2", 0, 0, True),
        ("rw-p", "/x/site-packages/llvmlite/binding/libllvmlite.so", 0, 0, False),
        ("r--s", "/x/site-packages/llvmlite/binding/libllvmlite.so", 0, 0, False),
        ("r--p", "/x/site-packages/llvmlite/binding/libllvmlite.so", 4, 0, True),  # the file was just written
        ("r--p", "/x/site-packages/llvmlite/binding/libllvmlite.so", 0, 4, False),
        ("r-xp", "/x/site-packages/numpy/_core/_multiarray_umath.so", 0, 0, False),
        ("r-xp", "/x/site-packages/llvmlite/binding/libllvmlite.so (deleted)", 0, 0, False),
        ("r--p", "/x/llvmlite/data.txt", 0, 0, False),
        ("r--p", "", 0, 0, False),
    ],
)
def test_only_clean_pages_of_certain_libraries_are_left(rights, path, dirty, own, given_back):
    other = _MAPPED.format(range="7f00-7f10", rights="r-xp", path="/usr/lib/libc.so.6", dirty=0, own=0)
    text = other + _MAPPED.format(range="7f1000-7f3000", rights=rights, path=path, dirty=dirty, own=own) + other
    assert list(clean_mappings(text)) == ([(0x7F1000, 0x2000)] if given_back else [])


def test_a_mapping_that_is_not_told_about_is_left_alone():
    whole = _MAPPED.format(range="7f1000-7f3000", rights="r-xp", path="/x/llvmlite/x.so", dirty=0, own=0)
    assert len(list(clean_mappings(whole))) == 1
    for name in ("Anonymous", "Swap", "Locked"):
        assert not list(clean_mappings(re.sub(rf"{name}:.*\n", "", whole))), name
    assert not list(clean_mappings(""))


@pytest.mark.skipif(sys.platform != "linux", reason="tells what is mapped on Linux only")
def test_a_service_does_not_hold_what_loaded_its_code(serving, surrogate):
    with serving(surrogate.path) as server:
        smaps = Path(f"/proc/{server.process.pid}/smaps").read_text()
        found = re.findall(r"r-xp [^\n]*libllvmlite[^\n]*\nSize: +(\d+) .*?\nRss: +(\d+) kB", smaps, re.DOTALL)
        sizes = [(int(size), int(resident)) for size, resident in found]
        assert sizes
        assert all(resident < size / 4 for size, resident in sizes)
        assert server.ask("GET", "/readyz")[0] == 200


def test_what_comes_later_is_given_back_again(monkeypatch):
    pages = iter([1000, 1010, 9000, 1200, 5200, 5297, 1300])
    seen, given = [], []

    def look():
        seen.append(next(pages))
        return seen[-1]

    async def run(work):
        assert work is memory.give_back
        given.append(len(seen))

    monkeypatch.setattr(memory, "_file_pages", look)
    monkeypatch.setattr(memory, "_LOOK_EVERY_S", 0.0)
    with pytest.raises(RuntimeError, match="StopIteration"):  # no more numbers
        asyncio.run(memory.keep_lean(run))
    assert given == [3, 6]  # when there were 9000, and again at 5297, 1200 having been left


def test_a_room_is_given_back_with_the_last_who_looks_into_it():
    room = np.frombuffer(Mapped(-1, 3_000_001), dtype=np.uint8)
    room[:] = 7
    start, end = room[:1], room[-1:]
    assert isinstance(room.base.obj, Mapped)
    del room
    assert (start[0], end[0]) == (7, 7)
    del start, end
    left = Mapped(-1, 100)
    left[:3] = b"abc"
    left.close()
    del left


def test_handing_memory_back_changes_nothing():
    kept = [bytes([number]) * 5000 for number in range(100)]
    trim()
    assert kept == [bytes([number]) * 5000 for number in range(100)]
