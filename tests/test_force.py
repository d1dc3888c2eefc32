"""Friction for time integration in C: the force at any velocity, the contact step by step, and a mass on a belt."""

import ctypes
import math

import numpy as np
import pytest

from builder.c.source import write_c
from comparing import close
from mumacro import Element, Surrogate

REST = 1e-4
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
#: below and above y~ = 1 and on it; without oscillation; rigid; creeping and fast at v_rest
CASES = [CASE, {**CASE, "y0": 3e-6}, {**CASE, "y0": 9e-6}, {**CASE, "y0": 0.0}, {**CASE, "omega": 0.0},
         {**CASE, "k": math.inf}, {**CASE, "omega": 1e9}, {**CASE, "omega": 1.0}]  # fmt: skip


@pytest.fixture(scope="module")
def table(tables_dir) -> Surrogate:
    """A table that is quick to compile."""
    return Surrogate.open(tables_dir / "mumacro-1e-4.nc", threads=1)


@pytest.fixture(scope="module")
def sources(table, tmp_path_factory):
    """The exported C sources."""
    folder = tmp_path_factory.mktemp("force")
    write_c(table.table, folder)
    return folder


@pytest.fixture(scope="module")
def library(sources, compilers):
    """The exported functions in a shared library."""
    options = ("-O1", "-std=c99", *compilers.STRICT, "-shared", "-fPIC")
    made = sources / "force.so"
    compilers.run(*compilers.compiler("gcc"), *options, *sorted(sources.glob("*.c")), "-o", made, "-lm")
    found = ctypes.CDLL(str(made))
    found.mumacro_force.restype = ctypes.c_double
    found.mumacro_force.argtypes = [ctypes.c_double] * 7
    pointer = ctypes.POINTER(ctypes.c_double)
    found.mumacro_element_step.argtypes = [ctypes.c_int, *[ctypes.c_double] * 5, pointer, pointer]
    found.mumacro_error_text.restype = ctypes.c_char_p
    return found


def force(library, v, rest=REST, **case):
    """The force at each velocity."""
    given = {**CASE, **case}
    return np.array([library.mumacro_force(float(x), rest, *given.values()) for x in np.atleast_1d(v)])


@pytest.mark.parametrize("case", CASES)
def test_the_force_is_odd_smooth_and_rises(library, table, case) -> None:
    v = np.concatenate([[0.0, 5e-324, 1e-300], np.linspace(0.0, 2.0 * REST, 401)[1:], np.geomspace(1e-3, 10.0, 50)])
    found = force(library, v, **case)
    assert np.array_equal(force(library, -v, **case), -found)
    assert found[0] == 0.0
    assert np.all(np.diff(found[3:]) >= -1e-4 * CASE["Fz"] * CASE["mu0"])  # as far as the table's tolerance reaches
    inside = np.diff(found[3:203])
    assert np.all(inside >= 0.0)
    # beyond v_rest it is the table's law, and meets it with the same slope
    law = table.evaluate(**case, v0=v[v >= REST]).mu_macro * case["Fz"]
    assert np.abs(found[v >= REST] / law - 1.0).max() < 1e-13
    below, above = force(library, np.nextafter(REST, [0.0, 1.0]), **case)
    assert below == close(above, rel=1e-12)
    step = 1e-5 * REST
    at, before = force(library, [REST, REST - step], **case)
    slope = table.evaluate(**case, v0=REST, gradient=True).gradient["v0"] * case["Fz"]
    assert (at - before) / step == close(slope, rel=1e-3, abs=1e-3 * at / REST)


def test_bad_input_gives_nan_and_nothing_else_does(library) -> None:
    for bad in ({"mu0": 0.0}, {"Fz": -1.0}, {"k": math.nan}, {"y0": math.inf}, {"omega": -1.0}):
        assert np.isnan(force(library, [0.0, 0.5 * REST, -1.0], **bad)).all()
    assert np.isnan(force(library, [math.nan, math.inf, -math.inf])).all()
    for rest in (0.0, -1.0, math.nan, math.inf):
        assert np.isnan(force(library, [0.0, 1.0], rest)).all()
    for rest in (5e-324, 1e-300, 1e300):
        found = force(library, [0.0, 5e-324, rest, -rest, 0.5 * rest], rest)
        assert np.isfinite(found).all()
        assert np.abs(found).max() <= 3.0


def test_steps_in_c_are_those_of_python(library) -> None:
    pointer = ctypes.POINTER(ctypes.c_double)
    rng = np.random.default_rng(5)
    for springs, contact in ((1, "spring"), (7, "ball")):
        mine, state, sums = Element(0.3, 10.0, 1e6, contact, springs), np.zeros((springs, 2)), np.zeros(2)
        for dx, dy in rng.normal(scale=2e-6, size=(50, 2)):
            error = library.mumacro_element_step(
                springs, 0.3, 10.0, 1e6, dx, dy, state.ctypes.data_as(pointer), sums.ctypes.data_as(pointer)
            )
            assert error == 0
            assert tuple(sums) == close(mine.step(dx, dy), rel=1e-14, abs=1e-15)
        assert state == close(mine.state, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(
    ("bad", "error"),
    [({"springs": 0}, -5), ({"dx": math.nan}, -5), ({"dy": math.inf}, -5), ({"mu0": -1.0}, 1), ({"Fz": -1.0}, 2),
     ({"Fz": math.inf}, 2), ({"k": math.inf}, 3), ({"k": math.nan}, 3)],
)  # fmt: skip
def test_a_bad_step_moves_nothing_and_says_why(library, bad, error) -> None:
    given = {"springs": 2, "mu0": 0.3, "Fz": 10.0, "k": 1e6, "dx": 1e-6, "dy": 0.0, **bad}
    held = (ctypes.c_double * 4)(*[1.0] * 4)
    sums = (ctypes.c_double * 2)(5.0, 6.0)
    assert library.mumacro_element_step(*given.values(), held, sums) == error
    assert (list(held), list(sums)) == ([1.0] * 4, [5.0, 6.0])
    assert library.mumacro_element_step(1, 0.3, 10.0, 1e6, 0.0, 0.0, None, sums) == -1
    said = library.mumacro_error_text(error).decode()
    assert said.startswith({-5: "dx and dy must be finite", 1: "mu0", 2: "Fz", 3: "k"}[error])
    assert library.mumacro_error_text(-6) == b"there is no such error"
    assert library.mumacro_error_text(-1) == b"there is no place for the answer"


def test_the_shaker_ends_stick_slip(sources, compilers, repository) -> None:
    """A mass on a belt swings without, and rests with transverse oscillation."""
    source = repository / "examples" / "c" / "mass_on_belt.c"
    assert len(source.read_text().splitlines()) <= 60
    made = sources / "mass_on_belt"
    words = [*compilers.compiler("gcc"), "-O2", "-std=c99", *compilers.STRICT, f"-I{sources}", source]
    compilers.run(*words, *sources.glob("*.c"), "-o", made, "-lm")
    swings = [float(line.split()[6]) for line in compilers.run(made).splitlines()]
    # between sticking to the belt and slipping back the spring is stretched by at most twice the fall of friction
    assert 0.5 < swings[0] < 1.5
    assert swings[1] < 1e-3
