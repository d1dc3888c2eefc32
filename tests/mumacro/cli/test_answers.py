"""Answers in the terms of the question: its units, the digits that are known, the case first, and
what was perhaps meant."""

import json
import math
import re
from typing import Any

import numpy as np
import pytest

import mumacro
from mumacro.cli.main import main
from mumacro.inputs.fields import INPUTS, QUANTITY_OF
from mumacro.inputs.units import QUANTITIES, scale_of, unit_of
from tests.support.comparing import close

CASE = {"mu0": "0.3", "Fz": "10N", "k": "1N/um", "y0": "2um", "f": "20kHz", "v0": "10mm/s"}
CONVEYOR = "mu0=0.3 Fz=10N k=0.1N/um f=50Hz"
PARTS = ("--x", "0.1mm", "--normal", "8N@-90deg")


def words(*without: str, **more: str) -> str:
    case = {**CASE, **more}
    return " ".join(f"{name}={x}" for name, x in case.items() if name not in without)


def output(capsys: Any, *arguments: str, code: int = 0) -> str:
    assert main([*arguments]) == code
    captured = capsys.readouterr()
    return str(captured.out if code == 0 else captured.err)


def table(text: str, head: str) -> list[dict[str, str]]:
    """The rows below the line that begins with a head, by column."""
    lines = text.splitlines()
    i = next(i for i, line in enumerate(lines) if line.startswith(head))
    names = re.split(r"  +", lines[i])
    rows = [re.split(r"  +", line) for line in lines[i + 1 :]]
    return [dict(zip(names, row, strict=True)) for row in rows if len(row) == len(names)]


# --- units ----------------------------------------------------------------------------------------

UNITS = [
    (name, unit)
    for name in ("Fz", "k", "y0", "omega", "f", "v0")
    for units in [[*QUANTITIES[QUANTITY_OF[name]].units]]
    for unit in units[:: 1 + len(units) // 15]  # there are 154 stiffnesses
]


@pytest.mark.parametrize(("name", "unit"), UNITS)
def test_a_law_is_in_the_unit_that_was_typed(capsys: Any, name: str, unit: str) -> None:
    scale = scale_of(name, unit)
    assert scale is not None
    usual = {"Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "f": 2e4, "v0": 0.01}[name]
    ends = [f"{scale.of_si(x):.6g} {unit}" for x in (usual, 4.0 * usual)]
    left_out = ("f", "omega") if name in ("f", "omega") else (name,)
    text = output(
        capsys, "law", words(*left_out), "--along", name, *ends, "--points", "3", "--scale",
        "linear",
    )  # fmt: skip
    rows = table(text, f"{name} [{unit}]")
    first, last = (float(end.partition(" ")[0]) for end in ends)
    expected = np.linspace(first, last, 3)
    assert [float(row[f"{name} [{unit}]"]) for row in rows] == close(expected.tolist(), rel=1e-5)


@pytest.mark.parametrize(("name", "unit"), [x for x in UNITS if x[0] in ("y0", "v0", "k")])
def test_roots_are_in_the_unit_that_was_typed(capsys: Any, name: str, unit: str) -> None:
    scale, ends = scale_of(name, unit), {"y0": (1e-9, 1e-3), "v0": (1e-3, 1.0), "k": (1e5, 1e8)}
    assert scale is not None
    between = [f"{scale.of_si(x):.9g} {unit}" for x in ends[name]]
    target = "0.25" if name == "v0" else "0.2"
    arguments = ("solve-for", name, words(name), "--target", target, "--between", *between)
    (row,) = table(output(capsys, *arguments), f"{name} [{unit}]")
    answer = json.loads(output(capsys, *arguments, "--json"))
    assert answer["unit"] == unit_of(name)
    in_si = answer["results"][0]["roots"][0]["value"]
    assert scale.si(float(row[f"{name} [{unit}]"])) == close(in_si, rel=6e-4)


@pytest.mark.parametrize(
    ("name", "unit", "target"), [("y0", "um", "0.2"), ("k", "N/um", "0.2"), ("v0", "mm/s", "0.25")]
)
def test_without_a_typed_unit_the_prefix_suits(
    capsys: Any, name: str, unit: str, target: str
) -> None:
    text = output(capsys, "solve-for", name, words(name), "--target", target)
    (row,) = table(text, f"{name} [{unit}]")
    assert 0.1 <= float(row[f"{name} [{unit}]"]) < 1000.0


def test_outputs_have_the_prefix_that_suits_and_json_is_in_si(capsys: Any) -> None:
    arguments = (words(), "--include", "limits,power,settling,groups")
    rows = {line.split()[0]: line.split() for line in output(capsys, *arguments).splitlines()}
    answer = json.loads(output(capsys, *arguments, "--json"))
    sizes = {"[um]": 1e-6, "[us]": 1e-6, "[mW]": 1e-3, "[ms]": 1e-3, "[mm/s]": 1e-3}
    for path in ("groups.l0", "limits.v0_crit", "power.oscillation", "settling.time"):
        name, _, member = path.partition(".")
        _, number, unit, *_ = rows[path]
        assert float(number) * sizes[unit] == close(answer[name][member], rel=1e-3)


def test_a_motion_is_answered_in_typed_units(capsys: Any) -> None:
    arguments = ("solve-for", "v0", CONVEYOR, *PARTS, "--target", "0")
    (row,) = table(output(capsys, *arguments), "v0 [mm/s]")
    (typed,) = table(output(capsys, *arguments, "--between", "1um/s", "1m/s"), "v0 [um/s]")
    assert float(typed["v0 [um/s]"]) == close(1e3 * float(row["v0 [mm/s]"]), rel=1e-5)
    phase = ("solve-for", "normal.phase", f"{CONVEYOR} v0=5mm/s", "--x", "0.1mm", "--normal", "8N")
    (degrees, _) = table(output(capsys, *phase, "--target", "0"), "normal.phase [deg]")
    (radians, _) = table(
        output(capsys, *phase, "--target", "0", "--between", "0rad", "6.2831rad"),
        "normal.phase [rad]",
    )
    assert math.degrees(float(radians["normal.phase [rad]"])) == close(
        float(degrees["normal.phase [deg]"]), rel=1e-5
    )


# --- digits ---------------------------------------------------------------------------------------


def test_a_mean_within_its_error_of_0_is_0(capsys: Any) -> None:
    for tolerance in ("1e-4", "1e-6", "1e-8"):
        text = output(
            capsys, "motion", words("y0"), "--y", "2um", "--tolerance", tolerance
        )  # fmt: skip
        (lateral,) = [line.split() for line in text.splitlines() if "mu_lateral" in line]
        assert lateral[:2] == ["mu_lateral", "0"]
    text = output(capsys, "solve-for", "v0", CONVEYOR, *PARTS, "--target", "0")
    (row,) = table(text, "v0 [mm/s]")
    assert row["mu_macro [-]"] == "0"


def test_no_digit_is_below_the_deviation(capsys: Any) -> None:
    for deviation in ("0.0001", "0.002", "0.03"):
        text = output(capsys, words(mu0=f"0.3±{deviation}"))
        (row,) = [line.split() for line in text.splitlines() if line.startswith("mu_macro")]
        assert row[2] == "±"
        last = 10.0 ** -len(row[1].partition(".")[2])
        assert last >= 0.99 * 10.0 ** math.floor(math.log10(float(row[3])) - 1.0)


@pytest.mark.parametrize(
    ("case", "line", "headline"),
    [
        ({}, "k = 1 N/um", "0.2405"),
        ({"k": "1±0.1N/um"}, "k = 1 ± 0.1 N/um", "0.240 ± 0.014"),
        ({"k": "1N/um±10%"}, "k = 1 ± 0.1 N/um", "0.240 ± 0.014"),
        ({"k": "0.8..1.2N/um"}, "k = 0.8 to 1.2 N/um", "0.2095 to 0.2640"),
        ({"k": "rigid"}, "k rigid", "0.0350245"),
    ],
)
def test_one_case_says_how_it_was_understood_and_how_uncertain_it_is(
    capsys: Any, case: Any, line: str, headline: str
) -> None:
    first, second, *_, last = output(capsys, words(**case)).splitlines()
    assert first.endswith("; spring, across")
    assert line in first.replace(";", ",").split(", ")
    name, value = second.partition("[-]")[0].split(maxsplit=1)
    assert (name, value.strip()) == ("mu_macro", headline)
    assert last.startswith("numerical error  ")


def test_no_digit_is_below_the_numerical_error(capsys: Any) -> None:
    text = output(capsys, "motion", words("y0"), "--y", "2um", "--tolerance", "1e-2")
    (row,) = [line.split() for line in text.splitlines() if line.startswith("mu_macro")]
    error = float(text.split()[-1])
    last = 10.0 ** -len(row[1].partition(".")[2])
    assert last >= 0.99 * 10.0 ** math.floor(math.log10(error))
    motion = mumacro.motion(
        mu0=0.3, Fz=10.0, k=1e6, f=20e3, v0=0.01, y=2e-6, tolerance=1e-2
    )  # fmt: skip
    assert float(row[1]) == close(motion.mu_macro, abs=10.0 * error)


# --- the case first, and what was meant -----------------------------------------------------------


FIRST = "mu0 = 0.3, Fz = 10 N, k = 1 N/um, y0 = 2 um, f = 20 kHz; spring, across"


@pytest.mark.parametrize(
    ("arguments", "first"),
    [
        (("law", words("v0"), "--along", "v0", "1mm/s", "1m/s", "--points", "3"), FIRST),
        (("solve-for", "v0", words("v0"), "--target", "0.25"), FIRST),
        (
            ("solve-for", "v0", words("v0", k="800..1200 N/mm"), "--target", "0.25"),
            FIRST.replace("1 N/um", "800 to 1200 N/mm"),
        ),
        (
            ("solve-for", "v0", words("v0", k="rigid", y0="2000nm"), "--target", "0.25"),
            FIRST.replace("k = 1 N/um", "k rigid").replace("2 um", "2000 nm"),
        ),
        (
            ("solve-for", "v0", CONVEYOR, *PARTS, "--target", "0"),
            "mu0 = 0.3, Fz = 10 N, k = 0.1 N/um, f = 50 Hz, x = 0.1mm, normal = 8N@-90deg; spring",
        ),
        (
            ("motion", words("y0"), "--y", "2um", "--contact", "ball"),
            "mu0 = 0.3, Fz = 10 N, k = 1 N/um, f = 20 kHz, v0 = 10 mm/s, y = 2um; ball",
        ),
    ],
)
def test_the_case_comes_first_in_the_units_that_were_typed(
    capsys: Any, arguments: Any, first: str
) -> None:
    assert output(capsys, *arguments).splitlines()[0] == first


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("amplitude", "y0"),
        ("frequency", "f"),
        ("speed", "v0"),
        ("stiffness", "k"),
        ("load", "Fz"),
        ("friction_coefficient", "mu0"),
        ("Fz_amp", "Fz_amplitude"),
        ("x.phas", "x.phase"),
        *((name.upper(), name) for name in INPUTS if name in ("k", "y0", "v0", "omega", "mu0")),
    ],
)
def test_another_name_of_an_unknown_is_understood(capsys: Any, typed: str, meant: str) -> None:
    with pytest.raises(SystemExit) as end:
        main(["solve-for", typed, words(), "--target", "0.2"])
    assert end.value.code == 2
    assert f"did you mean {meant}?" in capsys.readouterr().err


def test_a_target_out_of_reach_hints_at_the_ratio_and_back(capsys: Any) -> None:
    arguments = ("solve-for", "y0", words("y0"), "--target")
    assert "add --ratio" in output(capsys, *arguments, "0.5", code=1)
    assert "ratio" not in output(capsys, *arguments, "3", code=1)
    large = ("solve-for", "y0", words("y0", mu0="2"), "--target", "1.5", "--ratio")
    assert "leave out --ratio" in output(capsys, *large, code=1)
    motion = ("solve-for", "v0", CONVEYOR, *PARTS, "--target")
    assert "add --ratio" in output(capsys, *motion, "0.9", code=1)
    assert "ratio" not in output(capsys, *motion, "5", code=1)
