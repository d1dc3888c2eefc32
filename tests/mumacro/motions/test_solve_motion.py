"""Which value of one input of a motion gives a mean force: all roots, their widths, refusals."""

import json
import math
from typing import Any

import numpy as np
import pytest

import mumacro
from mumacro import InputError, solve_motion
from mumacro.cli.main import main
from mumacro.motions.solve_motion import UNKNOWNS, MotionCurve
from tests.support.comparing import close
from tests.support.refusals import refused

CONVEYOR: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e5, "f": 50.0, "x": 1e-4}


def random_problem(seed: int) -> tuple[str, dict[str, Any]]:
    rng = np.random.default_rng(seed)
    unknown = [name for name in UNKNOWNS if name != "omega"][seed % 11]
    case: dict[str, Any] = {"mu0": 0.3, "Fz": 1.0 / 0.3, "k": 1.0, "f": 1.0 / (2.0 * math.pi)}
    case["v0"] = float(10.0 ** rng.uniform(-2.5, 0.5))
    for part in ("x", "y"):
        case[part] = (float(10.0 ** rng.uniform(-0.7, 0.9)), float(rng.uniform(0.0, 360.0)))
    case["normal"] = (float(rng.uniform(0.1, 0.9)) * case["Fz"], float(rng.uniform(0.0, 360.0)))
    if "." not in unknown:
        del case[unknown]
        if unknown == "Fz":
            case["normal"] = 0.0
    return unknown, case


@pytest.mark.parametrize("seed", range(22))
def test_no_root_of_a_scan_is_missed_and_every_root_is_one(seed: int) -> None:
    unknown, case = random_problem(seed)
    x = mumacro.solve_motion(unknown, 1e9, **case).samples[0]
    fine = np.interp(np.linspace(0.0, 1.0, 300), np.linspace(0.0, 1.0, x.size), x)
    mean, _ = MotionCurve(unknown, "mu_macro", case).evaluate(fine)
    targets = np.nanquantile(mean, [0.2, 0.5, 0.8])
    solution = mumacro.solve_motion(unknown, targets, **case)
    for target, roots in zip(targets, solution.roots, strict=True):
        gap = mean - target
        for i in np.flatnonzero(gap[:-1] * gap[1:] < 0.0):
            assert any(root.low <= fine[i + 1] and root.high >= fine[i] for root in roots)
        for root in roots:
            assert abs(root.mean - target) <= 2.0 * root.error_estimate
            assert root.low <= root.value <= root.high
        assert [*roots] == sorted(roots)


def test_at_the_transport_speed_the_mean_force_is_zero() -> None:
    case = {**CONVEYOR, "normal": (8.0, -90.0)}
    speed = mumacro.solve_motion("v0", target=0.0, **case).value
    there = mumacro.motion(**case, v0=speed)
    assert abs(there.mu_macro) <= 2.0 * there.error_estimate
    # a conveyor twice as large in its way, its length l0 and its speed is the same one
    larger = {**case, "x": 2e-4, "k": 0.5e5}
    assert mumacro.solve_motion("v0", **larger).value == close(2.0 * speed, rel=1e-5)


def test_the_other_way_is_named_where_a_speed_would_be_negative() -> None:
    forward = mumacro.solve_motion("v0", **CONVEYOR, normal=(8.0, -90.0))
    backward = mumacro.solve_motion("v0", **CONVEYOR, normal=(8.0, 90.0))
    assert backward.roots == ((),)
    assert backward.other_way is not None
    assert backward.other_way.value == close(forward.value, rel=1e-5)
    assert backward.reach.mu_min > 0.0
    with pytest.raises(InputError):
        _ = backward.value


def test_lateral_friction_is_a_target_too() -> None:
    case: Any = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.02, "x": 2e-6}
    solution = mumacro.solve_motion("y.amplitude", -0.05, of="mu_lateral", **case)
    for root in solution.roots[0]:
        there = mumacro.motion(**case, y=root.value)
        assert there.mu_lateral == close(-0.05, abs=2.0 * there.error_estimate)
    assert solution.roots[0]


def test_a_whole_turn_counts_once() -> None:
    case = {**CONVEYOR, "v0": 0.005, "normal": 8.0}
    at_zero = mumacro.motion(**{**case, "normal": (8.0, 0.0)}).mu_macro
    roots = mumacro.solve_motion("normal.phase", at_zero, **case).roots[0]
    turns = [root.value % 360.0 for root in roots]
    near_zero = [turn for turn in turns if min(turn, 360.0 - turn) < 0.1]
    assert len(near_zero) == 1


def test_texts_and_ranges_are_read() -> None:
    case = {"mu0": "0.3", "Fz": "10 N", "k": "0.1 N/um", "f": "50 Hz", "x": "0.1 mm"}
    solution = mumacro.solve_motion("v0", within=("1 mm/s", "20 mm/s"), **case, normal="8N@-90deg")
    assert (solution.reach.low, solution.reach.high) == (1e-3, 0.02)
    expected = mumacro.solve_motion("v0", **CONVEYOR, normal=(8.0, -90.0)).value
    assert solution.value == close(expected, rel=1e-6)
    assert mumacro.solve_motion("v0", within=(0.02, 0.1), **case, normal="8N@-90deg").roots == ((),)


@pytest.mark.parametrize(
    ("unknown", "changed", "field"),
    [
        ("y0", {}, "unknown"),
        ("v0", {"v0": 0.1}, "v0"),
        ("f", {"v0": 0.1}, "f"),
        ("x.phase", {"v0": 0.1, "x": [(1, 1e-4, 0.0), (2, 1e-5, 0.0)]}, "x"),
        ("y.phase", {"v0": 0.1}, "y"),
        ("v0", {"x": 0.0}, "x"),
        ("v0", {"mu0": None}, "mu0"),
        ("v0", {"mu0": [0.3, 0.4]}, "mu0"),
        ("v0", {"within": (2.0, 1.0)}, "within"),
        ("v0", {"within": 3.0}, "within"),
        ("v0", {"target": math.nan}, "target"),
        ("v0", {"of": "power"}, "of"),
        ("v0", {"normal": (12.0, 0.0)}, "normal"),
        ("v0", {"normal": (1.0, 90.0, 2.0)}, "normal"),
    ],
)
def test_what_cannot_be_solved_names_its_field(unknown: str, changed: Any, field: str) -> None:
    with refused(field):
        mumacro.solve_motion(unknown, **{**CONVEYOR, "normal": 8.0, **changed})


def test_the_command_gives_the_librarys_roots(capsys: Any) -> None:
    words = ["solve-for", "normal.phase", "mu0=0.3 Fz=10N k=0.1N/um f=50Hz v0=5mm/s"]
    words += ["--x", "0.1mm", "--normal", "8N", "--target", "0"]
    assert main([*words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    expected = mumacro.solve_motion("normal.phase", **CONVEYOR, v0=0.005, normal=8.0).roots[0]
    assert [root["value"] for root in answer["results"][0]["roots"]] == [
        root.value for root in expected
    ]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + len(expected)
    assert lines[2].split()[-1] == "0"  # a mean within its estimate of 0
    words[1] = "v0"
    words[2] = "mu0=0.3 Fz=10N k=0.1N/um f=50Hz"
    assert main([*words[:-4], "--normal", "8N@90deg", "--target", "0"]) == 1
    assert "180 degrees" in capsys.readouterr().err


def test_many_targets_have_the_roots_of_each() -> None:
    case = {name: x for name, x in CONVEYOR.items() if name != "v0"}
    targets = np.linspace(-0.2, 0.4, 31)
    for unknown, more in (("v0", {"normal": (8.0, -90.0)}), ("normal.phase", {"v0": 5e-3})):
        motion = {**case, "normal": 8.0, **more}
        together = mumacro.solve_motion(unknown, targets, **motion)
        most = max(map(len, together.roots))
        assert most == {"v0": 1, "normal.phase": 2}[unknown]
        for target, roots in zip(targets, together.roots, strict=True):
            (alone,) = mumacro.solve_motion(unknown, target, **motion).roots
            assert len(alone) == len(roots)
            for one, other in zip(alone, roots, strict=True):
                assert one.value == close(other.value, abs=one.high - one.low + 1e-9 * one.value)


def test_a_range_in_which_the_mean_is_the_target_is_one_root() -> None:
    """In continuous sliding along, the mean force is mu0 at every speed."""
    case = {name: x for name, x in CONVEYOR.items() if name != "v0"}
    (root,) = mumacro.solve_motion("v0", 0.3, **case, within=(1e-3, 1.0)).roots[0]
    swing = CONVEYOR["x"] * 2.0 * math.pi * CONVEYOR["f"]
    assert root.value == close(swing, rel=0.1)
    assert root.high == close(1.0, rel=1e-3)
    # within it there is nothing to look for: it took 60 s, 72,000 motions
    beside = mumacro.solve_motion("v0", np.linspace(-0.2, 0.4, 31), **case, normal=(8.0, -90.0))
    assert [len(roots) for roots in beside.roots[24:27]] == [1, 1, 0]
    assert beside.samples[0].size < 1000


def test_the_width_of_a_flat_root_holds_all_places_where_the_mean_crosses_the_target() -> None:
    """On a stiff contact mu_macro hardly changes with k: it comes within its estimate of this
    target at 46 N/m, and crosses it at 398 N/m."""
    case: dict[str, Any] = {
        "mu0": 0.3,
        "Fz": 1.0 / 0.3,
        "f": 0.5 / math.pi,
        "v0": 1.3733873377118634,
        "x": (0.2641164538616952, 69.51471276643943),
        "y": (0.5583226423845976, 311.3349616995049),
        "normal": (1.4567703249872974, 172.28669302959773),
    }
    target = 0.28897534219814974
    k = np.geomspace(300.0, 500.0, 50)
    mean, _ = MotionCurve("k", "mu_macro", case).evaluate(k)
    crossings = k[:-1][np.diff(np.sign(mean - target)) != 0.0]
    assert crossings.size
    roots = mumacro.solve_motion("k", target, **case).roots[0]
    for place in crossings:
        assert any(root.low <= place <= root.high for root in roots)


@pytest.mark.parametrize(
    ("unknown", "target", "within", "case"),
    [
        ("v0", 0.3, (0.15, 1.0), {"x": 1e-6}),  # it never slides back: mu0 at every speed
        ("x.phase", 0.3, None, {"x": 1e-9, "v0": 1.0}),
        ("x.amplitude", 0.3, (0.0, 1e-6), {"v0": 1.0}),
        ("y.amplitude", 0.2, None, {"v0": 0.02}),
    ],
)
def test_widths_stay_in_the_range_that_is_searched(
    unknown: str, target: float, within: Any, case: dict[str, Any]
) -> None:
    rig: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3}
    solution = solve_motion(unknown, target, within=within, **rig, **case)
    roots = solution.roots[0]
    assert roots
    for root in roots:
        assert solution.reach.low <= root.low <= root.value <= root.high <= solution.reach.high
