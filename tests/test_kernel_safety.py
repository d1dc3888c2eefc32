"""The kernel under sanitizers: no input and no table makes it read or write out of bounds, or do what C leaves open."""

import platform
from pathlib import Path

import pytest

from builder.c.source import files
from mumacro import library
from mumacro.table import read_table

KERNEL = Path(library.__file__).parent / "kernel"
DRIVER = Path(__file__).parent / "c" / "sanitized.c"
CHECKS = ("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")
#: instructions that the compiler may use, and by how many doubles at a time the kernel then computes
NATIVE = {"base": 2, "avx2": 4, "avx512": 8}


SLOW = [
    pytest.param((), id="base", marks=pytest.mark.slow),
    pytest.param(("-DMUMACRO_ONE_LANE",), id="one", marks=pytest.mark.slow),
]


@pytest.mark.parametrize("options", [pytest.param(("-march=native",), id="best"), *SLOW])
def test_sanitizers_are_silent(compilers, tables_dir, tmp_path, options):
    """300,000 random and 172,800 nasty cases, and 1000 tables of nonsense, through every entry."""
    (tmp_path / "table.c").write_text(files(read_table(tables_dir / "mumacro-1e-4.nc"))["mumacro_table.c"], "ascii")
    words = (*compilers.compiler("gcc"), "-std=c99", "-O1", "-g", "-ffp-contract=off", *compilers.STRICT, *CHECKS)
    out = tmp_path / "sanitized"
    compilers.run(*words, *options, f"-I{KERNEL}", DRIVER, tmp_path / "table.c", "-o", out, "-lm")
    told = compilers.run(out, 300_000, 172_800, 1000).split()
    random, nasty, tables, lanes = (int(word) for word in told[1::2])
    assert (random >= 300_000, nasty >= 172_800, tables) == (True, True, 1000)
    if platform.machine() == "x86_64":
        expected = {(): 2, ("-march=native",): NATIVE[library.kernels[-1].level]}.get(options, 1)
        assert lanes == expected
