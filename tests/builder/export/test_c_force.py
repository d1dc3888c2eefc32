"""Friction for time integration in C: the force at any velocity, the contact step by step, and a
mass on a belt."""

import ctypes
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.export.c import write_c
from mumacro import Element, Surrogate
from mumacro.inputs.fields import CONTACTS, DIRECTIONS
from tests.support import compilers
from tests.support.cases import Case, every_pair, tables
from tests.support.comparing import close

pytestmark = pytest.mark.slow

REST = 1e-4
CASE: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
#: below and above y~ = 1 and on it; without oscillation; rigid; creeping and fast at v_rest
CASES = [
    CASE,
    {**CASE, "y0": 3e-6},
    {**CASE, "y0": 9e-6},
    {**CASE, "y0": 0.0},
    {**CASE, "omega": 0.0},
    {**CASE, "k": math.inf},
    {**CASE, "omega": 1e9},
    {**CASE, "omega": 1.0},
]
NUMBER, WHOLE, ARRAY = ctypes.c_double, ctypes.c_int, ctypes.POINTER(ctypes.c_double)
table = tables(1e-4)


@pytest.fixture(scope="module")
def sources(table: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The exported C sources."""
    folder = tmp_path_factory.mktemp("force")
    write_c(table.table, folder)
    return folder


@pytest.fixture(scope="module")
def library(sources: Any) -> Any:
    """The exported functions in a shared library."""
    options = ("-O1", "-std=c99", *compilers.STRICT, "-shared", "-fPIC")
    library_file = sources / "force.so"
    compilers.run(
        *compilers.compiler("gcc"),
        *options,
        *sorted(sources.glob("*.c")),
        "-o",
        library_file,
        "-lm",
    )
    loaded = ctypes.CDLL(str(library_file))
    loaded.mumacro_force.restype, loaded.mumacro_force.argtypes = NUMBER, [NUMBER] * 7
    loaded.mumacro_evaluate_force.argtypes = [WHOLE, WHOLE, *[NUMBER] * 7, ARRAY, ARRAY]
    loaded.mumacro_element_step.argtypes = [WHOLE, *[NUMBER] * 5, ARRAY, ARRAY]
    loaded.mumacro_error_text.restype = ctypes.c_char_p
    return loaded


def force(library: Any, v: Any, rest: Any = REST, **case: Any) -> Any:
    """The force at each velocity."""
    inputs = {**CASE, **case}
    return np.array(
        [library.mumacro_force(float(x), rest, *inputs.values()) for x in np.atleast_1d(v)]
    )


def with_slopes(library: Any, pair: Any, v: Any, rest: Any, case: Case) -> Any:
    """What mumacro_evaluate_force returns, the force, and its derivatives by mu0, Fz, k, y0, omega,
    v0."""
    value, slopes = NUMBER(7.0), (NUMBER * 6)(*[7.0] * 6)
    codes = CONTACTS.index(pair[0]), DIRECTIONS.index(pair[1])
    error = library.mumacro_evaluate_force(*codes, v, rest, *case.values(), value, slopes)
    return error, value.value, np.array(slopes)


@pytest.mark.parametrize("case", CASES)
def test_the_force_is_odd_smooth_and_rises(library: Any, table: Surrogate, case: Case) -> None:
    v = np.concatenate(
        [[0.0, 5e-324, 1e-300], np.linspace(0.0, 2.0 * REST, 401)[1:], np.geomspace(1e-3, 10.0, 50)]
    )
    forces = force(library, v, **case)
    assert np.array_equal(force(library, -v, **case), -forces)
    assert forces[0] == 0.0
    # as far as the table's tolerance reaches
    assert np.all(np.diff(forces[3:]) >= -1e-4 * CASE["Fz"] * CASE["mu0"])
    assert np.all(np.diff(forces[3:203]) >= 0.0)
    # beyond v_rest it is the table's law, and meets it with the same slope
    law = table.evaluate(**case, v0=v[v >= REST]).mu_macro * case["Fz"]
    assert np.abs(forces[v >= REST] / law - 1.0).max() < 1e-13
    below, above = force(library, np.nextafter(REST, [0.0, 1.0]), **case)
    assert below == close(above, rel=1e-12)
    step = 1e-5 * REST
    at, before = force(library, [REST, REST - step], **case)
    slope = table.evaluate(**case, v0=REST, gradient=True).gradient["v0"] * case["Fz"]
    assert (at - before) / step == close(slope, rel=1e-3, abs=1e-3 * at / REST)


@every_pair
@pytest.mark.parametrize("share", [0.0, 0.3, -0.7, 20.0, -500.0])
def test_the_force_of_every_contact_has_its_derivatives(
    library: Any, table: Surrogate, pair: Any, share: Any
) -> None:
    amplitude = {"Fz_amplitude": 4.0} if pair[1] == "normal" else {"y0": CASE["y0"]}  # [N], [m]
    case = {name: x for name, x in CASE.items() if name != "y0"} | amplitude
    speed = abs(share) if abs(share) > 1.0 else 0.5 + 0.5 * share * share
    law = table.evaluate(
        {**case, "v0": speed * REST}, contact=pair[0], direction=pair[1], gradient=True
    )
    six = {name: case.get(name, 4.0) for name in CASE} | {"v0": share * REST}

    def at(**moved: Any) -> Any:
        *five, v0 = {**six, **moved}.values()
        return with_slopes(library, pair, v0, REST, dict(zip(CASE, five, strict=True)))

    error, value, slopes = at()
    assert error == 0
    assert value == close(
        math.copysign(min(1.0, abs(share) / speed), share) * law.mu_macro * 10.0,
        rel=1e-13,
        abs=1e-300,
    )
    if pair == ("spring", "across"):
        assert value == close(force(library, share * REST)[0], rel=1e-13, abs=1e-300)
    for (name, x), slope, bound in zip(
        six.items(), slopes, law.gradient_bound.values(), strict=True
    ):
        step = 1e-5 * (x or REST)
        difference = (at(**{name: x + step})[1] - at(**{name: x - step})[1]) / (2.0 * step)
        assert slope == close(difference, rel=2e-6, abs=10.0 * bound), name


@pytest.mark.parametrize(
    ("bad", "error", "says"),
    [
        ({"mu0": 0.0}, 1, "mu0"),
        ({"Fz": -1.0}, 2, "Fz"),
        ({"k": math.nan}, 3, "k"),
        ({"y0": math.inf}, 4, "y0"),
        ({"omega": -1.0}, 5, "omega"),
        ({"v0": math.nan}, -6, "for a force v0"),
        ({"v0": -math.inf}, -6, "for a force v0"),
        *[
            ({"rest": x}, -6, "for a force v0 must be finite, and v_rest")
            for x in (0.0, -1.0, math.nan, math.inf)
        ],
    ],
)
def test_bad_input_gives_nan_and_the_reason(library: Any, bad: Any, error: Any, says: Any) -> None:
    case = {**CASE, **{name: x for name, x in bad.items() if name in CASE}}
    for v0 in (0.0, 0.5 * REST, -1.0):
        v0, rest = bad.get("v0", v0), bad.get("rest", REST)
        assert np.isnan(force(library, v0, rest, **case)).all()
        result, value, slopes = with_slopes(library, ("spring", "across"), v0, rest, case)
        assert (result, math.isnan(value), np.isnan(slopes).all()) == (error, True, True)
    assert library.mumacro_error_text(error).decode().startswith(says)


def test_the_ends_of_v_rest_are_legal(library: Any) -> None:
    for rest in (5e-324, 1e-300, 1e300):
        forces = force(library, [0.0, 5e-324, rest, -rest, 0.5 * rest], rest)
        assert np.isfinite(forces).all()
        assert np.abs(forces).max() <= 3.0
    assert with_slopes(library, ("ball", "normal"), 1.0, REST, CASE)[0] == -4
    assert (
        library.mumacro_evaluate_force(0, 0, 1.0, REST, *CASE.values(), None, (NUMBER * 6)()) == -1
    )
    assert library.mumacro_evaluate_force(0, 0, 1.0, REST, *CASE.values(), NUMBER(), None) == -1


def test_steps_in_c_are_those_of_python(library: Any) -> None:
    rng = np.random.default_rng(5)
    for springs, contact in ((1, "spring"), (7, "ball")):
        mine, state, sums = (
            Element(0.3, 10.0, 1e6, contact, springs),
            np.zeros((springs, 2)),
            np.zeros(2),
        )
        pointers = [array.ctypes.data_as(ARRAY) for array in (state, sums)]
        for dx, dy in rng.normal(scale=2e-6, size=(50, 2)):
            assert library.mumacro_element_step(springs, 0.3, 10.0, 1e6, dx, dy, *pointers) == 0
            assert tuple(sums) == close(mine.step(dx, dy), rel=1e-14, abs=1e-15)
        assert state == close(mine.state, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(
    ("bad", "error", "says"),
    [
        ({"springs": 0}, -5, "dx and dy"),
        ({"dx": math.nan}, -5, "dx and dy"),
        ({"dy": math.inf}, -5, "dx and dy"),
        ({"mu0": -1.0}, 1, "mu0"),
        ({"Fz": -1.0}, 2, "Fz"),
        ({"Fz": math.inf}, 2, "Fz"),
        ({"k": math.inf}, 3, "k"),
        ({"k": math.nan}, 3, "k"),
    ],
)
def test_a_bad_step_moves_nothing_and_says_why(
    library: Any, bad: Any, error: Any, says: Any
) -> None:
    inputs = {"springs": 2, "mu0": 0.3, "Fz": 10.0, "k": 1e6, "dx": 1e-6, "dy": 0.0, **bad}
    state, sums = (NUMBER * 4)(*[1.0] * 4), (NUMBER * 2)(5.0, 6.0)
    assert library.mumacro_element_step(*inputs.values(), state, sums) == error
    assert (list(state), list(sums)) == ([1.0] * 4, [5.0, 6.0])
    assert library.mumacro_error_text(error).decode().startswith(says)
    assert library.mumacro_element_step(1, 0.3, 10.0, 1e6, 0.0, 0.0, None, sums) == -1
    assert library.mumacro_error_text(-7) == b"there is no such error"
    assert library.mumacro_error_text(-1) == b"there is no place for the answer"


def test_the_shaker_ends_stick_slip(sources: Any, repository: Path) -> None:
    """A mass on a belt swings without, and rests with transverse oscillation."""
    source, program = repository / "examples" / "c" / "mass_on_belt.c", sources / "mass_on_belt"
    assert len(source.read_text().splitlines()) <= 60
    words = [
        *compilers.compiler("gcc"),
        "-O2",
        "-std=c99",
        *compilers.STRICT,
        f"-I{sources}",
        source,
    ]
    compilers.run(*words, *sources.glob("*.c"), "-o", program, "-lm")
    swings = [float(line.split()[6]) for line in compilers.run(program).splitlines()]
    # between sticking to the belt and slipping back the spring is stretched by at most twice the
    # fall of friction
    assert 0.5 < swings[0] < 1.5
    assert swings[1] < 1e-3
