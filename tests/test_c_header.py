"""``--format c``: the header compiles everywhere, agrees with Python to the last digits, and refuses bad input."""

import ctypes
import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from builder.c.translate import Translator
from builder.c.types import FLOAT, Array, TranslationError, literal
from builder.export import export_table
from mumacro import Surrogate, charts
from mumacro.inputs import BOUNDS, FIELDS

pytestmark = pytest.mark.slow

SOURCES = Path(__file__).parent / "c"
CASE = (0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01)
MAIN = """\
#include <stdio.h>
#include "mumacro.h"
int main(void) {
    mumacro_answer a;
    int error = mumacro_evaluate(0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01, &a);
    printf("%d %.17g %s %s\\n", error, a.mu_macro, mumacro_source_name(a.source), MUMACRO_CHECKSUM);
    return 0;
}
"""


@pytest.fixture(scope="module")
def folder(tables_dir, tmp_path_factory):
    """A folder for every table, with its header and the programs that include it."""
    root = tmp_path_factory.mktemp("c")
    for tolerance in ("1e-4", "1e-7"):
        (root / tolerance).mkdir()
        export_table(tables_dir / f"mumacro-{tolerance}.nc", "c", root / tolerance / "mumacro.h")
        for source in SOURCES.iterdir():
            (root / tolerance / source.name).write_bytes(source.read_bytes())
        (root / tolerance / "main.c").write_text(MAIN, "ascii")
    return root


@pytest.fixture(scope="module")
def table(tables_dir):
    return Surrogate.open(tables_dir / "mumacro-1e-7.nc", threads=1)


def load(compilers, folder, *options):
    """The driver as a shared library."""
    out = folder / f"driver{len(list(folder.glob('driver*.so')))}.so"
    command = (
        *compilers.compiler("gcc"),
        "-O2",
        "-std=c99",
        *compilers.STRICT,
        *options,
        "-shared",
        "-fPIC",
        folder / "driver.c",
    )
    compilers.run(*command, "-o", out, "-lm")
    return ctypes.CDLL(str(out))


@pytest.fixture(scope="module")
def fused(folder, compilers):
    """With fused multiply-adds, as numba compiles on this processor; without them if the processor has none."""
    return load(compilers, folder / "1e-7", "-march=native", "-ffp-contract=fast")


@pytest.fixture(scope="module")
def plain(folder, compilers):
    """Every operation rounded separately, as in interpreted Python."""
    return load(compilers, folder / "1e-7", "-ffp-contract=off")


def ask(function, n, columns, *arrays):
    """``function`` of the driver over contiguous arrays."""
    out = np.empty((n, columns) if columns > 1 else n)
    pointer = ctypes.POINTER(ctypes.c_double)
    given = [a.ctypes.data_as(pointer) if isinstance(a, np.ndarray) else a for a in arrays]
    function(*given, n, out.ctypes.data_as(pointer))
    return out


def ulps(found, expected):
    """Distance in units of the last place of the expected value; 0 for equal infinities and NaN."""
    same = (found == expected) | (np.isnan(found) & np.isnan(expected))
    with np.errstate(all="ignore"):
        return np.where(same, 0.0, np.abs(found - expected) / np.spacing(np.abs(expected)))


def neighbours(x, most=3):
    """``x`` and the numbers next to it on either side."""
    x = np.asarray(x, dtype=np.float64)
    out, below, above = [x], x, x
    for _ in range(most):
        below, above = np.nextafter(below, 0.0), np.nextafter(above, np.inf)
        out += [below, above]
    return np.concatenate(out)


def seams(surrogate):
    """Points on both sides of every seam: blocks, cells, the border's pieces, the closed forms."""
    edges = [charts.Y_STICK_LO, 1.0, charts.Y_CONT, charts.Y_MID, charts.Y_HIGH, charts.Y_TAIL, 1e-150, 1e150]
    y = np.concatenate([neighbours(edges), np.geomspace(1e-8, 1e8, 60)])
    crit = surrogate.v_tilde_crit(y)
    half = crit * np.sin(0.5 * np.pi * charts.S_CUT) ** 2
    speeds = [crit, half, 0.5 * crit, charts.RHO_MAX * crit, charts.FAST_KAPPA * np.sqrt(y), crit * 1e-9, crit * 1e9]
    v = np.concatenate([neighbours(speed) for speed in speeds])
    y = np.tile(np.repeat(y[None, :], 7, axis=0).ravel(), len(speeds))
    extremes = np.array([0.0, 5e-324, 1e-310, 1e-290, 1e-150, 1.0, 1e150, 1e290, 1.7e308, np.inf, -1.0, np.nan])
    grid = np.meshgrid(extremes, np.concatenate([extremes, neighbours([1.0])]))
    return np.concatenate([v, grid[0].ravel()]), np.concatenate([y, grid[1].ravel()])


def drawn(surrogate, n, seed):
    """Points over all blocks, many near the border and near the corner."""
    rng = np.random.default_rng(seed)
    y = 10.0 ** np.where(rng.random(n) < 0.3, rng.uniform(-0.3, 0.3, n), rng.uniform(-6.0, 9.0, n))
    v = 10.0 ** rng.uniform(-9.0, 6.0, n)
    crit = surrogate.v_tilde_crit(y)
    way = rng.random(n)
    v = np.where(way < 0.5, crit * 10.0 ** rng.uniform(-3.0, 3.0, n), v)
    side = rng.choice([-1.0, 1.0], n)
    return np.where(way < 0.1, crit * (1.0 + side * 10.0 ** rng.uniform(-16.0, -1.0, n)), v), y


@pytest.mark.parametrize("name", ["gcc", "clang", "zig cc", "g++", "clang++"])
@pytest.mark.parametrize("tolerance", ["1e-4"])
def test_compilers_give_no_warning(compilers, folder, tables_dir, name, tolerance):
    where = folder / tolerance
    standard = ("-x", "c++", "-std=c++11") if name.endswith("++") else ("-std=c99",)
    out = where / name.replace(" ", "-")
    compilers.run(*compilers.compiler(name), *standard, "-O1", *compilers.STRICT, where / "main.c", "-o", out, "-lm")
    surrogate = Surrogate.open(tables_dir / f"mumacro-{tolerance}.nc")
    answer = surrogate.evaluate(dict(zip(FIELDS, CASE, strict=True)))
    error, mu, source, checksum = compilers.run(out).split()
    assert (error, source, checksum) == ("0", answer.source, surrogate.checksum)
    assert ulps(float(mu), answer.mu_macro) <= 4.0


def test_fast_arithmetic_is_refused(compilers, folder):
    command = [*compilers.compiler("gcc"), "-std=c99", "-O1", "-ffast-math", "-fsyntax-only", "main.c"]
    done = subprocess.run(command, cwd=folder / "1e-4", capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "compile without -ffast-math" in done.stderr


def test_values_are_pythons_to_four_units_of_the_last_place(fused, table):
    on_seams = seams(table)
    v, y = (np.ascontiguousarray(np.concatenate(pair)) for pair in zip(drawn(table, 100_000, 1), on_seams, strict=True))
    mu, bound, source = table.ratio_with_bound(v, y)
    found = ask(fused.points, v.size, 8, 0, v, y)
    assert np.array_equal(found[:, 6], source)
    assert ulps(found[:, 0], mu).max() <= 4.0
    assert ulps(ask(fused.ratios, v.size, 1, v, y), mu).max() <= 4.0
    assert np.array_equal(found[:, 7] == 0, source >= 0)
    assert set(source) >= set(range(-1, charts.RIGID))
    # a bound is a sum of terms, some of which are roots of a rounding error
    assert np.allclose(found[:, 1], bound, rtol=1e-6, atol=0.0, equal_nan=True)
    assert ulps(ask(fused.borders, y.size, 1, y), table.v_tilde_crit(y)).max() <= 4.0


def close(found, expected, allowed, digits):
    """Equal, or within the allowed difference and some units of the last place."""
    with np.errstate(all="ignore"):
        near = np.abs(found - expected) <= allowed + digits * np.spacing(np.abs(expected))
    return near | (found == expected) | (np.isnan(found) & np.isnan(expected))


@pytest.mark.parametrize("quantity", range(3), ids=charts.QUANTITIES)
def test_every_quantity_and_slope_is_pythons(fused, table, quantity):
    v, y = (np.ascontiguousarray(np.concatenate(p)) for p in zip(drawn(table, 20_000, 2), seams(table), strict=True))
    found = ask(fused.points, v.size, 8, quantity, v, y)
    value, *slopes = table.slopes(v, y, charts.QUANTITIES[quantity], bounds=True)
    digits = 72.0 if quantity == charts.POWER else 4.0  # its bound includes 1.6e-14 for terms that cancel
    if quantity == charts.STICK:  # near the border the root of a rounding error
        with np.errstate(all="ignore"):
            assert np.all(close(found[:, 0] ** 2, value**2, 4e-15 * np.minimum(1.0, 1.0 / y), 8.0))
            away = ~(np.abs(v / table.v_tilde_crit(y) - 1.0) < 1e-6)
        v, y, found, slopes = v[away], y[away], found[away], [slope[away] for slope in slopes]
    of = (lambda *at: table.ratio_with_bound(*at)[:2], table.power_with_bound, table.stick_fraction_with_bound)
    bound = of[quantity](v, y)[1]
    assert np.all(close(found[:, 1], bound, 1e-6 * bound, 0.0))
    if quantity != charts.STICK:
        assert np.all(close(found[:, 0], value, 1e-2 * bound if quantity else 0.0, digits))
    for i in (0, 1):  # a twentieth of the bound
        assert np.all(close(found[:, 2 + i], slopes[i], 5e-2 * slopes[2 + i], digits))
        assert np.all(close(found[:, 4 + i], slopes[2 + i], 1e-6 * slopes[2 + i], 0.0))


def cases(n):
    """Cases of every kind: ordinary, with zeros, rigid, extreme, illegal."""
    rng = np.random.default_rng(5)
    x = 10.0 ** rng.uniform([-2, -2, 3, -9, 0, -6], [0, 4, 9, -3, 6, 2], (n, 6))
    special = np.array([0.0, -0.0, np.inf, 1e-320, 1e-200, 1e200, 1e308, -1.0, np.nan])
    drawn = rng.random((n, 6)) < 0.1
    return np.where(drawn, rng.choice(special, (n, 6)), x)


def test_dimensional_cases_are_pythons(fused, table):
    x = cases(20_000)
    columns = dict(zip(FIELDS, np.ascontiguousarray(x.T), strict=True))
    answer = table.evaluate(columns, gradient=True)
    found = ask(fused.cases, len(x), 20, x)
    legal = answer.source_code >= 0
    assert 3000 < legal.sum() < 17_000
    assert np.array_equal(found[:, 5], answer.source_code)
    assert np.array_equal(found[legal, 6], charts.REGIME_OF_SOURCE[answer.source_code[legal]])
    assert np.all(found[~legal, 6] == -1)
    for column, expected in ((0, answer.mu_macro), (1, answer.mu_ratio), (3, answer.v_tilde), (4, answer.y_tilde)):
        assert ulps(found[legal, column], expected[legal]).max() <= 4.0
    assert np.all(np.isnan(found[~legal, 0]))
    assert np.array_equal(ask(fused.values, len(x), 1, x), found[:, 0], equal_nan=True)
    for i, name in enumerate(FIELDS):
        slope, bound = answer.gradient[name][legal], answer.gradient_bound[name][legal]
        assert np.all(close(found[legal, 8 + i], slope, 5e-2 * bound, 4.0))
        kept = x[legal, 0] > 1e-100  # with a smaller mu0 the bound of columns loses its digits
        assert np.all(close(found[legal, 14 + i], bound, 1e-6 * bound + 1e-300, 1.0)[kept])
    faults = np.array([next((i for i, n in enumerate(FIELDS, 1) if bad(n, c[i - 1])), 0) for c in x])
    assert np.array_equal(found[:, 7], faults)


def bad(name, value):
    positive, finite = BOUNDS[name].endswith("> 0"), name != "k"
    return not (value > 0.0 if positive else value >= 0.0) or (finite and value == np.inf)


def test_cycles_are_pythons(fused, table):
    x = cases(5000)
    found = ask(fused.cycles, len(x), 6, x)
    with np.errstate(all="ignore"):
        answer = table.evaluate(dict(zip(FIELDS, np.ascontiguousarray(x.T), strict=True)), groups=True)
        v, y, length = answer.v_tilde, answer.y_tilde, answer.length_scale
        mu0, load, stiffness, y0, omega, _ = x.T
        legal = answer.source_code >= 0
        moving = legal & (y0 > 0.0) & (omega > 0.0) & np.isfinite(v) & np.isfinite(y) & np.isfinite(stiffness)
        power, bound = table.power_with_bound(v, y)
        unit = mu0 * load * length * omega
        stick, stick_bound = table.stick_fraction_with_bound(v, y)
        crit = table.v_tilde_crit(y) * length * omega
        expectations = [(0, crit), (1, power * unit), (2, bound * unit)]
        plain = moving & (unit > 1e-290) & np.isfinite(power * unit) & (crit > 1e-300)
    assert plain.sum() > 1000
    for column, expected in expectations:
        assert np.allclose(found[plain, column], expected[plain], rtol=1e-6 if column == 2 else 1e-14, atol=0.0)
    assert np.allclose(found[legal, 3], stick[legal], rtol=1e-9, atol=0.0)
    told = legal & (y > 0.0)
    assert np.allclose(found[told, 4], stick_bound[told], rtol=1e-6, atol=0.0)
    still = legal & ((y0 == 0.0) | (omega == 0.0))
    assert np.all(found[still, :3] == 0.0)
    rigid = legal & np.isinf(stiffness) & ~still
    assert rigid.any()
    assert np.all(found[rigid, 0] == 0.0)
    assert np.all(np.isnan(found[rigid, 1:3]))
    lost = legal & ~still & (y == 0.0) & (v < np.inf)
    assert np.all(found[lost, 4] == 1.0)


INTERPRETED = """
import json, sys
from mumacro import Surrogate
from mumacro.evaluate import answer, answer_with_slopes
table, v, y = json.load(sys.stdin)
s = Surrogate.open(table, threads=1)
of = [s._of(quantity) for quantity in range(3)]
print(json.dumps([
    [(answer(quantity, *at, *data)[0], *answer_with_slopes(quantity, *at, *data)[1:3]) for at in zip(v, y)]
    for quantity, data in enumerate(of)
]))
"""


def test_without_fused_operations_it_is_interpreted_python(plain, table, tables_dir, repository):
    v, y = (np.concatenate(pair) for pair in zip(drawn(table, 600, 3), seams(table), strict=True))
    keep = np.random.default_rng(4).permutation(v.size)[:1200]
    v, y = np.ascontiguousarray(v[keep]), np.ascontiguousarray(y[keep])
    given = json.dumps([str(tables_dir / "mumacro-1e-7.nc"), v.tolist(), y.tolist()])
    done = subprocess.run(
        [sys.executable, "-c", INTERPRETED], input=given, cwd=repository, capture_output=True, text=True, check=False,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(repository)}, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for quantity, points in enumerate(np.array(json.loads(done.stdout))):
        rows = points.T
        found = ask(plain.points, v.size, 8, quantity, v, y)
        assert quantity or ulps(found[:, 0], rows[0]).max() <= 4.0
        for i, column in (
            (0, 0),
            (1, 2),
            (2, 3),
        ):  # the same bits, except where a cube root or hypotenuse differs in the last one
            assert np.mean(ulps(found[:, column], rows[i]) == 0.0) > 0.95, (quantity, i)


def test_without_fused_operations_the_bounds_still_hold(plain, table):
    v, y = drawn(table, 50_000, 6)
    mu, bound, _ = table.ratio_with_bound(v, y)
    found = ask(plain.points, v.size, 8, 0, v, y)
    assert np.all(np.abs(found[:, 0] - mu) <= bound + found[:, 1])
    assert np.mean(ulps(found[:, 0], mu) <= 4.0) > 0.999


def test_hostile_input_is_refused_without_a_fault(compilers, folder):
    checks = "-fsanitize=address,undefined,float-cast-overflow"
    out = folder / "1e-4" / "hostile"
    gcc = (*compilers.compiler("gcc"), "-O1", "-g", "-std=c99", *compilers.STRICT)
    if platform.machine() not in ("x86_64", "aarch64"):
        pytest.skip("sanitizers are not everywhere")
    compilers.run(*gcc, checks, "-fno-sanitize-recover=all", folder / "1e-4" / "hostile.c", "-o", out, "-lm")
    answered, refused = (int(word) for word in compilers.run(out).split()[1::2])
    assert answered > 10_000
    assert refused > 100_000


def test_only_the_documented_functions_of_the_library_are_called(compilers, folder):
    out = folder / "1e-4" / "driver.o"
    compilers.run(*compilers.compiler("gcc"), "-O0", "-std=c99", "-c", folder / "1e-4" / "driver.c", "-o", out)
    called = {line.split()[-1] for line in compilers.run(*compilers.compiler("nm"), "-u", out).splitlines()}
    assert called <= {"sqrt", "log", "exp", "fabs", "memcpy", "_GLOBAL_OFFSET_TABLE_"}


def test_the_same_header_from_the_command(folder, tmp_path, repository):
    command = [sys.executable, "-m", "mumacro", "export", "--format", "c", "--table", "1e-4"]
    environment = {**os.environ, "PYTHONPATH": str(repository)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "mumacro.h").read_bytes() == (folder / "1e-4" / "mumacro.h").read_bytes()


# --- the translator -------------------------------------------------------------------------------------


def test_kernels_become_readable_c():
    into = Translator()
    name, result = into.call(chosen, [FLOAT, "int64_t"])
    text = into.functions[name]
    assert text.startswith("/* A function with what kernels use. */\nstatic inline mumacro_in_di mumacro_in_chosen(")
    assert "    total = total + x * x / (n + i);" in text
    assert "int small_;" in text  # a name that windows.h defines
    assert result == into.structs["mumacro_in_di"]


def chosen(x: float, n: int):
    """A function with what kernels use.

    Nothing below the first paragraph is copied.
    """
    total, small = 0.0, x < 1.0
    for i in range(1, 4):
        total += x * x / (n + i)
        if total > 5.0 and not small:
            break
    return total, n


def loops(x: float):
    while x > 1.0:
        x = 0.5 * x
    return x


def strange(x: float):
    return x**3


def longer(coef: Array):
    row = coef[0]
    row = row[1:] + row[:1]
    return row[0]


@pytest.mark.parametrize(
    ("function", "types", "said"),
    [(loops, [FLOAT], "loops, line 2: no translation of: while"), (strange, [FLOAT], "line 2: only squares"),
     (longer, [Array((2, 4))], "line 3"), (loops, [], "takes 1 arguments, not 0")],
)  # fmt: skip
def test_what_has_no_translation_is_named(function, types, said):
    with pytest.raises(TranslationError, match=said):
        Translator().call(function, types)


def test_numbers_are_exact_through_text():
    rng = np.random.default_rng(7)
    for x in [*rng.standard_normal(100) * 10.0 ** rng.uniform(-300, 300, 100), 5e-324, 1.7976931348623157e308, -0.0]:
        assert float(literal(float(x)).strip("()")) == x
    assert literal(1 << 52) == "INT64_C(4503599627370496)"
