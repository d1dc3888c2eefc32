"""Files that are made to harm whoever opens them, and damaged ones: a part of what fuzz/tables.py opens."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent


def load(name: str) -> ModuleType:
    """A script of fuzz/ as a module, with its neighbours importable and the path as it was afterwards."""
    before = sys.path[:]
    sys.path.insert(0, str(ROOT / "fuzz"))
    try:
        return importlib.import_module(name)
    finally:
        sys.path[:] = before


tables = load("tables")
hostile = load("hostile_tables")
#: a table with other numbers and a checksum that fits them is another table; it may answer as it likes
ANOTHER = {
    "numbers of 1.7e308, checksum right", "random numbers of 1e100, checksum right",
    "amplitudes of 1e300, checksum right", "errors of 1e308, checksum right",
}  # fmt: skip
HARMLESS = {"a group that holds itself", "3,000 groups, one in the other"}


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, str, float, float]]:
    """Every hostile file, opened by one other process that may take 256 MB."""
    folder = tmp_path_factory.mktemp("hostile")
    for i, make in enumerate(hostile.HOSTILE.values()):
        make(folder / f"{i}.nc")
    outcomes, code = tables.in_other_process(*(str(folder / f"{i}.nc") for i in range(len(hostile.HOSTILE))))
    names = list(hostile.HOSTILE)
    assert len(outcomes) == len(names), f"died of: {names[len(outcomes)]}"
    assert code == 0
    return dict(zip(names, outcomes, strict=True))


@pytest.mark.parametrize("name", hostile.HOSTILE)
def test_a_hostile_file_is_refused_before_memory_is_taken(opened, name: str) -> None:
    found = opened[name]
    assert found.what == ("differs" if name in ANOTHER else "same" if name in HARMLESS else "refused"), found
    assert found.megabytes < 128.0


@pytest.mark.parametrize("change", tables.CHANGES)
def test_damaged_files_are_refused_or_answer_the_same(change: str) -> None:
    """One of a hundred places where the file is cut, and of those where a byte is another."""
    size = tables.SMALLEST.stat().st_size
    images = {}
    for start in range(0, size, 4096 if change == "cut" else 1200):
        images.update(tables.work(start, 1, change))
    assert len(images) > 30
    found = [tables.outcome(image, Path(f"{start}.nc")) for start, image in images.items()]
    assert {one.what for one in found} <= {tables.REFUSED, tables.SAME}, found
    assert sum(one.what == tables.REFUSED for one in found) > 0.7 * len(found)
