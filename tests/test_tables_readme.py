"""tables/README.md agrees with the metadata of the committed tables."""

import re
from pathlib import Path

import pytest

from mumacro import Surrogate

NAMES = ("mumacro-1e-4.nc", "mumacro-1e-7.nc", "mumacro-1e-10.nc", "mumacro-1e-12.nc")


@pytest.fixture(scope="module")
def lines(tables_dir: Path) -> dict[str, list[list[str]]]:
    """Cells of every line of every table on the page, by the file in their first column."""
    found: dict[str, list[list[str]]] = {}
    for line in (tables_dir / "README.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip(" `") for cell in line.strip("|").split("|")]
        if cells[0].endswith(".nc") and len(cells) > 1:
            found.setdefault(cells[0], []).append(cells[1:])
    return found


def test_page_names_every_committed_table_and_no_other(tables_dir: Path, lines: dict[str, list[list[str]]]) -> None:
    assert {path.name for path in tables_dir.glob("*.nc")} == set(lines) == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_page_agrees_with_the_file(tables_dir: Path, lines: dict[str, list[list[str]]], name: str) -> None:
    s = Surrogate.open(tables_dir / name)
    (tolerance, solves, size, memory, absolute, relative, stick, power), (_, _, same, checksum) = lines[name]
    assert checksum == s.checksum
    assert float(tolerance) == s.tolerance
    assert (absolute, relative) == (f"{s.max_abs_error:.2e}", f"{s.max_rel_error:.2e}")
    said = (s.attributes["verified_max_stick_error"], s.attributes["verified_max_rel_power_error"])
    assert (stick, power) == tuple(f"{error:.2e}" for error in said)
    assert int(solves.replace(",", "")) == s.attributes["n_solves"]
    assert int(size.replace(",", "")) == (tables_dir / name).stat().st_size
    assert int(memory.replace(",", "")) == s.memory
    assert same in ("yes", "no")


@pytest.mark.parametrize("name", NAMES)
def test_page_shows_the_command_that_builds_the_table(tables_dir: Path, name: str) -> None:
    page = (tables_dir / "README.md").read_text(encoding="utf-8")
    found = re.search(rf"python -m builder build --tolerance (\S+) --out tables/{re.escape(name)}$", page, re.MULTILINE)
    assert found
    assert float(found.group(1)) == Surrogate.open(tables_dir / name).tolerance
