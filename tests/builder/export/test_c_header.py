"""``--format c``: the kernel's sources compile everywhere, give the library's bits, and refuse bad
input."""

import ctypes
import functools
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.export.c import header_text, write_c
from builder.tables.draws import DRAWS
from mumacro import Surrogate
from mumacro.inputs.fields import BOUNDS, CONTACTS, DIRECTIONS, FIELDS, kind_of
from mumacro.kernel import binding
from mumacro.kernel.binding import kernels
from mumacro.table import atlas
from mumacro.table.netcdf import read_table
from tests.support import compilers
from tests.support.cases import PAIRS, every_pair, tables
from tests.support.comparing import close
from tests.support.nightly import nightly

pytestmark = pytest.mark.slow

DRIVER = Path(__file__).parent / "c" / "driver.c"
KERNEL = Path(binding.__file__).parent
CASE = (0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01)
MAIN = """\
#include <stdio.h>
#include "mumacro.h"
#include "mumacro.h"
double elsewhere(double v, double y); /* in other.c; below, names that the kernel has, too */
#define MU_PI 3.0
static double mu_min(double mu_ratio) { return mu_ratio; }
double mu_values(void) { return mu_min(MU_PI); }
int main(void) {
    mumacro_answer a;
    int error = mumacro_evaluate(0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01, &a);
    printf("%d %.17g %s %s %.17g\\n", error, a.mu_macro, mumacro_source_name(a.source),
           mumacro_checksum(), elsewhere(0.1, 0.5) - mumacro_mu_ratio(0.1, 0.5));
    return mu_values() != 3.0;
}
"""
OTHER = '#include "mumacro.h"\ndouble elsewhere(double v, double y);\n'
OTHER += "double elsewhere(double v, double y) { return mumacro_mu_ratio(v, y); }\n"
#: instruction levels of the library by the number of doubles that go together, and one double at a
#: time
AVX2 = ["-mavx2", "-mfma"]
LANES = {
    1: ["-DMUMACRO_ONE_LANE"],
    2: [],
    4: AVX2,
    8: [*AVX2, "-mavx512f", "-mavx512dq", "-mavx512vl"],
}
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror")
LANGUAGES = {
    "gcc": "-std=c99",
    "clang": "-std=c99",
    "zig cc": "-std=c99",
    "g++": "-std=c++17",
    "clang++": "-std=c++17",
}


@pytest.fixture(scope="module")
def folder(tables_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """``one``: all in one header, ``three``: three files; each with a program of two files that
    include mumacro.h."""
    root = tmp_path_factory.mktemp("c")
    (root / "one").mkdir()
    for place, out in (("one", "one/mumacro.h"), ("three", "three")):
        write_c(read_table(tables_dir / "mumacro-1e-4.nc"), root / out)
        (root / place / "main.c").write_text(MAIN, "ascii")
        (root / place / "other.c").write_text(OTHER, "ascii")
    return root


table = tables(1e-7)


@pytest.fixture(scope="module")
def build(table: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The driver with the 1e-7 table as a shared library: a function of the compiler and its
    options."""
    root = tmp_path_factory.mktemp("drivers")
    write_c(table.table, root)

    @functools.cache
    def compiled(name: str, *options: Any) -> Any:
        out = root / f"driver{len(list(root.glob('*.so')))}.so"
        words = (*compilers.compiler(name), *options, "-shared", "-fPIC", f"-I{root}", DRIVER)
        compilers.run(*words, root / "mumacro.c", root / "mumacro_table.c", "-o", out, "-lm")
        return ctypes.CDLL(str(out))

    return compiled


@pytest.fixture(scope="module")
def flags(repository: Path) -> Any:
    """The options with which the library's kernels are compiled, by level."""
    module = runpy.run_path(str(repository / "hatch_build.py"))
    levels = module["levels"](module["own_platform"]())
    return {
        level: ["-O2", "-std=c99", "-ffp-contract=off", *words] for level, words in levels.items()
    }


@pytest.fixture(scope="module")
def best(build: Any, flags: Any) -> Any:
    """The driver at the level that the library has chosen on this processor."""
    return build("gcc", *flags[kernels[-1].level])


def ask(function: Any, n: int, columns: Any, *arrays: Any) -> Any:
    """``function`` of the driver over contiguous arrays."""
    out = np.empty((n, columns) if columns > 1 else n)
    pointer = ctypes.POINTER(ctypes.c_double)
    inputs = [a.ctypes.data_as(pointer) if isinstance(a, np.ndarray) else a for a in arrays]
    function(*inputs, n, out.ctypes.data_as(pointer))
    return out


def same(numbers: Any, expected: Any) -> Any:
    """Whether two arrays hold the same numbers."""
    return np.array_equal(numbers, expected, equal_nan=True)


def neighbours(x: Any, most: int = 3) -> Any:
    """``x`` and the numbers next to it on either side."""
    out = below = above = [np.asarray(x, dtype=np.float64)]
    for _ in range(most):
        below, above = [np.nextafter(below[0], 0.0)], [np.nextafter(above[0], np.inf)]
        out = [*out, *below, *above]
    return np.concatenate(out)


def drawn(table: Surrogate, n: int, seed: int) -> Any:
    """``n`` points of every kind, shape (2, kinds n)."""
    return np.concatenate(
        [DRAWS["spring"].draw(case, n, table, seed) for case in DRAWS["spring"].cases], axis=1
    )


def points(table: Surrogate, n: int, seed: int) -> Any:
    """Drawn points; both sides of every seam of blocks, cells, the border and the closed forms; and
    the extremes."""
    edges = [
        atlas.Y_STICK_LO,
        1.0,
        atlas.Y_CONT,
        atlas.Y_MID,
        atlas.Y_HIGH,
        atlas.Y_TAIL,
        1e-150,
        1e150,
    ]
    y = np.concatenate([neighbours(edges), np.geomspace(1e-8, 1e8, 60)])
    crit = table.v_tilde_crit(y)
    half = crit * np.sin(0.5 * np.pi * atlas.S_CUT) ** 2
    speeds = [
        crit,
        half,
        0.5 * crit,
        atlas.RHO_MAX * crit,
        atlas.FAST_KAPPA * np.sqrt(y),
        crit * 1e-9,
        crit * 1e9,
    ]
    v = np.concatenate([neighbours(speed) for speed in speeds])
    extremes = np.array(
        [0.0, 5e-324, 1e-310, 1e-290, 1e-150, 1.0, 1e150, 1e290, 1.7e308, np.inf, -1.0, np.nan]
    )
    grid = np.stack(np.meshgrid(extremes, np.concatenate([extremes, neighbours([1.0])]))).reshape(
        2, -1
    )
    seams = np.stack([v, np.tile(y, v.size // y.size)])
    return np.concatenate([drawn(table, n, seed), seams, grid], axis=1)


# --- the text -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("form", "name", "lanes"),
    [
        *(("three", name, 2) for name in ("gcc", "clang", "g++")),
        ("one", "gcc", 2),
        # zig is clang, and clang++ finds what clang and g++ do, but for a rare thing
        *(nightly("three", name, 2) for name in ("zig cc", "clang++")),
        *(nightly("one", name, 2) for name in LANGUAGES if name != "gcc"),
        # one compiler of each family, one of each language
        *(("three", name, n) for name in ("gcc", "clang++") for n in LANES if n != 2),
        *(nightly("three", name, n) for name in ("clang", "g++") for n in LANES if n != 2),
    ],
)
def test_no_compiler_warns(
    folder: Path, tables_dir: Path, form: Any, name: str, lanes: Any, tmp_path: Path
) -> None:
    language = ("-x", "c++") if name.endswith("++") else ()
    sources = ["main.c", "other.c", *(["mumacro.c", "mumacro_table.c"] if form == "three" else [])]
    words = [*compilers.compiler(name), *language, LANGUAGES[name], "-O1", *STRICT, *LANES[lanes]]
    if lanes != 2 and name != "gcc":
        # clang finds all its warnings before it makes code, and g++ optimizes as gcc; that code is
        # tried below, by its bits
        compilers.run(*words, "-fsyntax-only", *sources, cwd=folder / form)
        return
    compilers.run(*words, *sources, "-o", tmp_path / "main", "-lm", cwd=folder / form)
    if lanes == 8 and kernels[-1].level != "avx512":
        return  # this processor cannot run it
    surrogate = Surrogate.open(tables_dir / "mumacro-1e-4.nc")
    answer = surrogate.evaluate(dict(zip(FIELDS, CASE, strict=True)))
    error, mu, source, checksum, difference = compilers.run(tmp_path / "main").split()
    assert (error, source, checksum, difference) == ("0", answer.source, surrogate.checksum, "0")
    assert abs(float(mu) - answer.mu_macro) <= 4.0 * np.spacing(answer.mu_macro)


@pytest.mark.parametrize(
    "option",
    ["-ffast-math", "-funsafe-math-optimizations", "-ffinite-math-only", "-D_M_FP_FAST"],
)
@pytest.mark.parametrize("name", ["gcc", "clang"])
def test_arithmetic_that_breaks_bounds_does_not_compile(
    folder: Path, name: str, option: Any
) -> None:
    command = [*compilers.compiler(name), "-std=c99", "-O1", option, "-fsyntax-only"]
    macros = [*compilers.compiler(name), "-O1", "-dM", "-E", "-x", "c", os.devnull]
    if compilers.run(*macros) == compilers.run(*macros, option):
        # a program cannot see it, as docs/c.md says
        assert (name, option) == ("clang", "-funsafe-math-optimizations")
        return
    for source in ("one/main.c", "three/mumacro.c"):
        done = subprocess.run(
            [*command, folder / source], capture_output=True, text=True, check=False
        )
        assert done.returncode != 0
        assert "compile without -ffast-math" in done.stderr


def test_names_of_the_declarations_are_the_kernels() -> None:
    text = (KERNEL / "mumacro.h").read_text("ascii")
    for prefix, names in (("SOURCE_", atlas.SOURCES), ("REGIME_", atlas.REGIMES)):
        assert re.findall(rf"MUMACRO_{prefix}(\w+)", text) == [name.upper() for name in names]
    expected = ", ".join(f"MUMACRO_{name.upper()}" for name in atlas.QUANTITY_NAMES)
    assert f"enum {{ {expected}, MUMACRO_QUANTITIES }};" in text
    code = (KERNEL / "interface.c").read_text("ascii")
    words = [
        f"{name} must be {BOUNDS[name]}" + (", or infinite" if name == "k" else "")
        for name in FIELDS
    ]
    assert re.findall(r'"(\w+ must be .*?)"', code) == words


def test_a_header_has_no_names_of_the_kernel_of_its_own(table: Surrogate) -> None:
    text = re.sub(r'/\*.*?\*/|"[^"]*"', "", header_text(table.table), flags=re.DOTALL)
    # members of structs
    assert set(re.findall(r"\b(?:mu|MU)_\w+", text)) == {"mu_macro", "mu_ratio"}


@pytest.mark.parametrize(
    ("out", "files"), [("mumacro.h", []), ("made", ["mumacro.c", "mumacro.h", "mumacro_table.c"])]
)
def test_the_command_needs_no_extra(repository: Path, tmp_path: Path, out: Any, files: Any) -> None:
    program = (
        "import sys\nfor name in ('rich', 'scipy', 'netCDF4', 'xarray', 'numba'): "
        "sys.modules[name] = None\n"
        "from mumacro.cli.main import main\nsys.exit(main(['export', '--format', 'c', '--out', "
        "sys.argv[1]]))"
    )
    command = [sys.executable, "-c", program, str(tmp_path / out)]
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "mumacro-1e-7.nc" in done.stdout
    assert sorted(path.name for path in (tmp_path / out).glob("*")) == files
    assert files or (tmp_path / out).read_text("ascii").startswith("/*")


# --- the same bits --------------------------------------------------------------------------------


LEVELS = {kernel.level: kernel for kernel in kernels}
BEST = kernels[-1].level


@pytest.mark.parametrize(
    ("words", "level"),
    [
        *(("gcc", level) for level in LEVELS),
        *((words, BEST) for words in ("clang", "gcc -DMUMACRO_ONE_LANE")),
        *(nightly(words, one) for words in ("clang", "gcc -DMUMACRO_ONE_LANE") for one in LEVELS),
    ],
)
def test_every_level_gives_the_librarys_bits(
    build: Any, flags: Any, table: Surrogate, words: str, level: str
) -> None:
    """Also with one double at a time, as MSVC compiles it."""
    kernel: Any = LEVELS[level]
    driver = build(*words.split(), *flags[level])
    v, y = points(table, 4000, 1)
    expected, bound, source = np.empty(v.size), np.empty(v.size), np.empty(v.size, dtype=np.int8)
    for code, quantity in enumerate(atlas.QUANTITY_NAMES):
        data, rows = table.tabulated.data(quantity), np.empty((5, v.size))
        kernel.values(data, code, v, y, expected, bound, source)
        kernel.slopes(data, code, v, y, rows)
        result = ask(driver.points, v.size, 9, code, v, y).T
        assert same(result[0], expected)
        assert same(result[8], expected)
        assert same(result[1], bound)
        assert same(result[6], source)
        assert same(result[2:6], rows[1:])
        assert same(ask(driver.values, v.size, 2, code, v, y).reshape(2, -1), [expected, bound])
        assert np.array_equal(result[7] == 0, source >= 0)
        assert np.array_equal(result[7] == 1, ~(v >= 0.0))
    assert set(source) >= {-1, *range(atlas.SOURCES.index("rigid"))}
    assert same(ask(driver.borders, y.size, 1, y), kernel.border(table.tabulated.data(), y))


@pytest.mark.parametrize(
    ("options", "apart"),
    # without a standard gcc contracts products and sums
    [(("-O3", "-march=native"), 4), (("-O2",), 10)],
)
def test_other_options_move_the_last_digits_alone(
    build: Any, table: Surrogate, options: Any, apart: Any
) -> None:
    """Off the border, where rounding does not decide the side; docs/c.md states the figures."""
    v, y = drawn(table, 15_000, 3)
    with np.errstate(all="ignore"):
        away = np.abs(v / table.v_tilde_crit(y) - 1.0) > 1e-8
    mu, bound, _ = table.quantity("mu_ratio", v, y)
    rows = ask(build("gcc", *options).ratio_array, v.size, 1, v, y)
    assert np.all(np.abs(rows - mu) <= 2.0 * bound)
    assert (np.abs(rows - mu)[away] / np.spacing(mu[away])).max() <= apart


def cases(n: int) -> Any:
    """Cases of every kind, (6, n): ordinary, with zeros, rigid, extreme, illegal."""
    rng = np.random.default_rng(5)
    x = 10.0 ** rng.uniform([-2, -2, 3, -9, 0, -6], [0, 4, 9, -3, 6, 2], (n, 6))
    special = np.array([0.0, -0.0, np.inf, 1e-320, 1e-200, 1e200, 1e308, -1.0, np.nan])
    drawn = rng.random((n, 6)) < 0.1
    return np.ascontiguousarray(np.where(drawn, rng.choice(special, (n, 6)), x).T)


def bad(name: str, value: Any) -> Any:
    positive, finite = BOUNDS[name].endswith("> 0"), name != "k"
    return not (value > 0.0 if positive else value >= 0.0) or (finite and value == np.inf)


def first_fault(case: Any, normal: bool) -> int:
    """The number of the first bad input; 7 where the normal force would lift off; 0 if all are
    legal."""
    for i, (name, value) in enumerate(zip(FIELDS, case, strict=True), 1):
        if normal and name == "y0":
            if not 0.0 <= value < case[1]:
                return 7
        elif bad(name, value):
            return i
    return 0


@every_pair
def test_cases_of_every_contact_and_direction_are_the_librarys(
    best: Any, table: Surrogate, pair: Any
) -> None:
    kind, plain = kind_of(*pair), pair == PAIRS[0]
    codes = CONTACTS.index(pair[0]), DIRECTIONS.index(pair[1])
    x = cases(20_000 if plain else 1000)
    answer = table.evaluate(dict(zip(kind.fields, x, strict=True)), gradient=True, **kind.names)
    rows = ask(best.cases, x.shape[1], 21, *codes, x).T
    source, legal = answer.source_code, answer.source_code >= 0
    assert 0.15 < legal.mean() < 0.85
    expected = [
        answer.mu_macro,
        answer.mu_ratio,
        answer.error_bound,
        answer.v_tilde,
        answer.y_tilde,
        source,
    ]
    expected += [np.where(legal, atlas.REGIME_OF_SOURCE[source], -1)]
    assert same(rows[:7], expected)
    assert same(rows[7], [first_fault(case, kind.normal) for case in x.T])
    assert same(rows[8:14], list(answer.gradient.values()))
    assert same(rows[14:20], list(answer.gradient_bound.values()))
    if plain:
        assert same(rows[20], answer.mu_macro)
        assert same(ask(best.case_arrays, x.shape[1], 2, x).reshape(2, -1), expected[:3:2])


def test_a_contact_or_direction_that_is_not_there_has_no_answer(best: Any) -> None:
    best.mumacro_error_text.restype = ctypes.c_char_p
    for kind, error, about in (
        ((1, 2), -4, b"radius"),
        ((2, 0), -3, b"no such"),
        ((0, -1), -3, b"no such"),
    ):
        rows = ask(best.cases, 1, 21, *kind, np.ones((6, 1)))
        assert rows[0, 7] == error
        assert np.isnan(rows[0, :5]).all()
        assert about in best.mumacro_error_text(error)
    assert b"lifts off" in best.mumacro_error_text(7)


def test_cycles_are_the_librarys(best: Any, table: Surrogate) -> None:
    x = cases(5000)
    result = ask(best.cycles, x.shape[1], 6, x).T
    with np.errstate(all="ignore"):
        answer = table.evaluate(dict(zip(FIELDS, x, strict=True)), include="groups")
        v, y, length = answer.v_tilde, answer.y_tilde, answer.length_scale
        mu0, load, stiffness, y0, omega, _ = x
        legal = answer.source_code >= 0
        moving = (
            legal
            & (y0 > 0.0)
            & (omega > 0.0)
            & np.isfinite(v)
            & np.isfinite(y)
            & np.isfinite(stiffness)
        )
        power, bound = table.quantity("power", v, y)[:2]
        unit = mu0 * load * (length * omega)
        stick, stick_bound = table.quantity("stick_fraction", v, y)[:2]
        rows = np.array([length * table.v_tilde_crit(y) * omega, unit * power, unit * bound])
    assert moving.sum() > 1000
    assert same(result[:3, moving], rows[:, moving])
    assert same(result[3, legal], stick[legal])
    positive = legal & ~((y == 0.0) & (v < np.inf) & (y0 > 0.0) & (omega > 0.0))
    assert same(result[4, positive], stick_bound[positive])
    assert np.all(result[4, legal & ~positive] == 1.0)
    still = legal & ((y0 == 0.0) | (omega == 0.0))
    assert np.all(result[:3, still] == 0.0)
    rigid = legal & np.isinf(stiffness) & ~still
    assert rigid.any()
    assert np.all(result[0, rigid] == 0.0)
    of_rigid = {name: column[rigid] for name, column in zip(FIELDS, x, strict=True)}
    expected = table.evaluate(of_rigid, include="power")["power.oscillation"]
    plain = (expected > 1e-250) & (expected < 1e250)
    assert plain.sum() > 10
    assert result[1, rigid][plain] == close(expected[plain], rel=1e-12)
    assert np.all(np.isnan(result[:5, ~legal]))


def test_only_the_documented_functions_of_the_library_are_called(
    folder: Path, tmp_path: Path
) -> None:
    words = [
        *compilers.compiler("gcc"),
        "-std=c99",
        "-O0",
        "-c",
        "mumacro.c",
        "-o",
        tmp_path / "mumacro.o",
    ]
    compilers.run(*words, cwd=folder / "three")
    symbols = compilers.run(
        *compilers.compiler("nm"), "--undefined-only", tmp_path / "mumacro.o"
    ).split()[1::2]
    assert set(symbols) - {"_GLOBAL_OFFSET_TABLE_"} <= {
        "sqrt",
        "fabs",
        "memcpy",
        "mumacro_table",
        "memset",
    }
