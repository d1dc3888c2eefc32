"""mumacro.h from Fortran, Octave and Abaqus: compiled by their tools and compared with Python."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.export.grid import export_table
from mumacro import Surrogate
from mumacro.inputs.fields import FIELDS
from tests.support import compilers
from tests.support.cases import Case, tables
from tests.support.comparing import close
from tests.support.serving import CASE

pytestmark = pytest.mark.slow

OBJECTS = ("mumacro.o", "mumacro_table.o")
V0 = [1e-6, 1e-3, 0.01, 0.0711, 0.5, 20.0]
table = tables(1e-4)

#: the Fortran compiler for code of Abaqus, whose dummy arguments are not all used
ABAQUS = (
    "-ffixed-line-length-none",
    "-Wall",
    "-Wno-unused-dummy-argument",
    "-Wno-unused-parameter",
    "-Werror",
)


@pytest.fixture(scope="module")
def folder(repository: Path, table: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The examples with the smallest table in three files, compiled, and in the folder ``one`` in
    one header."""
    root = tmp_path_factory.mktemp("languages")
    for place in (root, root / "one"):
        for source in ("examples/c", "tests/builder/export/c"):
            shutil.copytree(repository / source, place, dirs_exist_ok=True)
    for name in ("aba_param.inc", "vaba_param.inc"):
        (root / name).write_text("      implicit real*8(a-h,o-z)\n", "ascii")
    export_table(table.path, "c", root)
    export_table(table.path, "c", root / "one" / "mumacro.h")
    words = (*compilers.compiler("gcc"), "-O1", "-std=c99", *compilers.STRICT, "-fPIC", "-c")
    compilers.run(*words, "mumacro.c", "mumacro_table.c", cwd=root)
    return root


@pytest.fixture
def fortran(folder: Path) -> Any:
    """Compiles a program with the module mumacro, and asks it: rows of numbers for lines of
    input."""

    def program(name: str, *sources: Any, options: Any = ABAQUS) -> Any:
        words = (
            *compilers.compiler("gfortran"),
            *options,
            "mumacro.f90",
            *sources,
            *OBJECTS,
            "-o",
            name,
            "-lm",
        )
        compilers.run(*words, cwd=folder)
        return lambda *lines: numbers(
            compilers.run(
                folder / name,
                stdin="".join(" ".join(map(repr, map(float, line))) + "\n" for line in lines),
            )
        )

    return program


def numbers(text: str) -> Any:
    rows = [[float(word) for word in line.split()] for line in text.strip().splitlines()]
    return np.array(rows, dtype=object if len({len(row) for row in rows}) > 1 else float)


def test_fortran_has_the_same_answers(fortran: Any, table: Surrogate) -> None:
    ask = fortran(
        "friction",
        "friction.f90",
        options=("-std=f2008", "-Wall", "-Wextra", "-pedantic", "-Werror"),
    )
    rows = ask(*({**CASE, "v0": v0}.values() for v0 in V0))
    answer = table.evaluate({**CASE, "v0": np.array(V0)}, gradient=True)
    assert np.allclose(rows[:, 0], answer.mu_macro, rtol=1e-14, atol=0.0)
    assert np.allclose(rows[:, 1], answer.error_bound, rtol=1e-6, atol=0.0)
    for i, name in enumerate(FIELDS):
        assert np.allclose(rows[:, 2 + i], answer.gradient[name], rtol=1e-9, atol=0.0)
    unit = CASE["mu0"] * CASE["Fz"] * answer.length_scale * CASE["omega"]
    assert np.allclose(
        rows[:, 8], table.power(answer.v_tilde, answer.y_tilde) * unit, rtol=1e-13, atol=0.0
    )
    assert np.allclose(
        rows[:, 9], table.stick_fraction(answer.v_tilde, answer.y_tilde), rtol=1e-9, atol=0.0
    )


def test_octave_has_the_same_answers(folder: Path, table: Surrogate) -> None:
    octave = compilers.compiler("octave-cli")
    compilers.compiler("mkoctfile")
    text = compilers.run(*octave, "--norc", "friction.m", cwd=folder / "one")
    v0 = np.geomspace(1e-4, 10.0, 200)
    answer = table.evaluate({**CASE, "omega": 2 * np.pi * 20e3, "v0": v0}, gradient=True)
    shown = [float(word) for word in text.splitlines()[0].split() if word[0].isdigit()]
    assert shown == close([answer.mu_macro[0], 1e-4, answer.mu_macro[-1], 10.0], rel=1e-14)
    steepest = v0[np.argmax(answer.gradient["v0"] * v0)]
    begins = v0[np.flatnonzero(np.asarray(answer.regime) == "continuous")[0]]
    expected = f"continuous sliding from {begins:.4g} m/s; steepest near {steepest:.3g} m/s"
    assert text.splitlines()[1] == f"bound at most {answer.error_bound.max():.2g}; {expected}"
    wrong = (
        "a = mumacro_mex([0.3; 0.2], 10, Inf, 2e-6, 1.3e5, [0.01; -1]); printf('%.15g %d\\n', "
        "a(1), isnan(a(2)));for c = {{1, 2, 3}, {1, 2, 3, 4, 5, 'x'}, {[1 2 3], 1, 1, 1, 1, [1 "
        "2]}, {[1 2], 1, 1, 1, 1, [1; 2]}}; try; mumacro_mex(c{1}{:}); catch e; "
        "disp(e.identifier); end; end"
    )
    first, *identifiers = compilers.run(
        *octave, "--norc", "--eval", wrong, cwd=folder / "one"
    ).splitlines()
    rigid = table.evaluate({**CASE, "k": "rigid"}).mu_macro
    assert [float(word) for word in first.split()] == [close(rigid, rel=1e-14), 1.0]
    assert identifiers == ["mumacro:usage", "mumacro:type", "mumacro:size", "mumacro:size"]


def test_abaqus_gets_the_coefficient_and_its_derivatives(fortran: Any, table: Surrogate) -> None:
    call = fortran("fric_coef", "fric_coef.f", "fric_coef_driver.f90")
    # the driver's properties: mu0 = 0.3, k per area, y0 = 2 um, omega = 1.3e5 rad/s
    stiffness = 1e10
    cases = [
        (v0, p, a, w)
        for v0 in (1e-3, 0.02, 0.4)
        for p in (3e4, 1e5)
        for a, w in ((1.0, 1.0), (0.5, 2.0))
    ]
    result = call(*cases)
    for row, (v0, p, a, w) in zip(result, cases, strict=True):
        case: Case = {
            "mu0": 0.3,
            "Fz": p,
            "k": stiffness,
            "y0": 2e-6 * a,
            "omega": 1.3e5 * w,
            "v0": v0,
        }
        answer = table.evaluate(case, gradient=True)
        assert row[0] == close(answer.mu_macro, rel=1e-14)
        assert row[1:] == close([answer.gradient["v0"], answer.gradient["Fz"]], rel=1e-9)
    # without pressure: rigid contact; at rest with y~ = 1, where the slope is infinite: no slope
    rigid, corner = call((0.01, 0.0, 1.0, 1.0), (0.0, 2e-6 * stiffness / 0.3, 1.0, 1.0))
    assert rigid[0] == close(table.evaluate({**CASE, "k": "rigid"}).mu_macro, rel=1e-14)
    assert rigid[2] == 0.0
    assert np.all(np.isfinite(corner))


def test_abaqus_gets_the_shear_stress_its_derivatives_and_the_force_of_nodes(
    fortran: Any, table: Surrogate
) -> None:
    call = fortran("fric", "fric.f", "vfric.f", "fric_driver.f90")
    case: Case = {"mu0": 0.3, "Fz": 1e5, "k": 1e10, "y0": 2e-6, "omega": 1.3e5}

    def stress(*line: Any) -> Any:
        return call(line)[0][:2]

    dt, gamma, step = 1e-3, np.array([3e-5, -4e-5]), 1e-4  # 0.05 m/s, above v_rest; 5e-4 m/s, below
    # differences of values: as near as the table's slopes there
    for scale, near in ((1.0, 1e-4), (0.01, 1e-6)):
        p, slip = 1e5, scale * gamma
        row = call((p, dt, *slip))[0]
        if scale == 1.0:
            law, way = table.evaluate(**case, v0=0.05, gradient=True), np.array([0.6, -0.8])
            np.testing.assert_allclose(row[:2], law.mu_macro * p * way, rtol=1e-14)
            across, along = law.mu_macro * p / 0.05, law.gradient["v0"] * p
            by_rate = across * np.eye(2) + (along - across) * np.outer(way, way)
            np.testing.assert_allclose(row[2:6].reshape(2, 2), by_rate / dt, rtol=1e-9)
            np.testing.assert_allclose(
                row[6:8], (law.mu_macro + p * law.gradient["Fz"]) * way, rtol=1e-9
            )
        assert row[8] == close(row[:2] @ slip, rel=1e-14)
        assert row[9] == 0.0
        by_slip = [
            (stress(p, dt, *(slip + move)) - stress(p, dt, *(slip - move)))
            / (2.0 * step * 5e-5 * scale)
            for move in step * 5e-5 * scale * np.eye(2)
        ]
        np.testing.assert_allclose(
            row[2:6].reshape(2, 2), by_slip, rtol=near, atol=near * abs(row[2])
        )
        by_load = (stress(p * (1 + step), dt, *slip) - stress(p * (1 - step), dt, *slip)) / (
            2.0 * step * p
        )
        np.testing.assert_allclose(row[6:8], by_load, rtol=max(near, 1e-5))
    assert np.all(stress(0.0, dt, *gamma) == 0.0)
    at_rest, nodes = map(np.array, call((1e5, dt, 0.0, 0.0)))
    assert np.all(at_rest[:2] == 0.0)
    assert at_rest[2] > 0.0
    assert at_rest[2:6] == close([at_rest[2], 0.0, 0.0, at_rest[2]], rel=1e-14)
    free = table.evaluate(**{**case, "Fz": 10.0, "k": 1e10 * 2e-4}, v0=0.01).mu_macro * 10.0
    assert nodes == close([-free, 0.0, -0.01, 0.0, 0.0, 0.0], rel=1e-14)


def test_the_files_compile_to_one_library(folder: Path) -> None:
    compilers.run(
        *compilers.compiler("gcc"), "-shared", *OBJECTS, "-o", "libm.so", "-lm", cwd=folder
    )
    table = compilers.run(*compilers.compiler("nm"), "-D", "--defined-only", "libm.so", cwd=folder)
    public = {line.split()[-1] for line in table.splitlines()}
    declared = re.findall(
        r"MUMACRO_API .*?(mumacro_\w+)\(", (folder / "mumacro.h").read_text("ascii")
    )
    assert len(declared) == 20
    assert public == {*declared, "mumacro_table"}
