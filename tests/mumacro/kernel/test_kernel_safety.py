"""The kernel under sanitizers: no input and no table makes it read or write out of bounds, or do
what C leaves open."""

import platform
from pathlib import Path
from typing import Any

import pytest

from builder.export.c import files
from mumacro.kernel import binding
from mumacro.table.netcdf import read_table
from tests.support import compilers
from tests.support.nightly import nightly
from tests.support.places import ROOT

pytestmark = pytest.mark.slow

KERNEL = Path(binding.__file__).parent
DRIVER = ROOT / "tests" / "builder" / "export" / "c" / "sanitized.c"
CHECKS = ("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")
#: instructions that the compiler may use, and by how many doubles at a time the kernel then
#: computes
NATIVE = {"base": 2, "avx2": 4, "avx512": 8}[binding.kernels[-1].level]
#: random and nasty cases, and tables of nonsense
MANY, FEWER = (100_000, 172_800, 300), (50_000, 57_600, 100)


@pytest.mark.parametrize(
    ("option", "lanes", "numbers"),
    [
        ("-march=native", NATIVE, FEWER),
        ("-O1", 2, FEWER),
        nightly("-march=native", NATIVE, MANY),
        # as MSVC compiles it; test_c_header.py compares its bits in every run
        nightly("-DMUMACRO_ONE_LANE", 1, FEWER),
    ],
)
def test_sanitizers_are_silent(
    tables_dir: Path, tmp_path: Path, option: Any, lanes: Any, numbers: Any
) -> None:
    """Random and nasty cases, and tables of nonsense, through every entry."""
    (tmp_path / "table.c").write_text(
        files(read_table(tables_dir / "mumacro-1e-4.nc"))["mumacro_table.c"], "ascii"
    )
    words = (
        *compilers.compiler("gcc"),
        "-std=c99",
        "-O1",
        "-g1",  # lines of what is found; the places of variables take as long as the rest
        "-ffp-contract=off",
        *compilers.STRICT,
        *CHECKS,
    )
    out = tmp_path / "sanitized"
    compilers.run(*words, option, f"-I{KERNEL}", DRIVER, tmp_path / "table.c", "-o", out, "-lm")
    stated = [int(word) for word in compilers.run(out, *numbers).split()[1::2]]
    assert [*map(min, stated, numbers)] == [*numbers]
    assert platform.machine() != "x86_64" or stated[3] == lanes
