"""k and mu0 from a loop: exact loops give them back, noisy ones within their intervals; what a loop
leaves open; the command."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mumacro import Element, InputError, LoopFit, fit_loop
from mumacro.cli.main import main
from mumacro.fits.cycles import cycles_of
from tests.support.cases import Array, Capture
from tests.support.comparing import close
from tests.support.nightly import nightly
from tests.support.refusals import refused
from tests.support.scripts import script

pytest.importorskip("scipy")
benchmark = script("benchmarks.loops")
K, MU0, FZ = 1e6, 0.3, 10.0


def forces(contact: str, x: Array, k: float = K, before: int = 0) -> Array:
    return np.asarray(benchmark.forces(contact, x, k, before))


def sine(samples: int, cycles: float, size: float = 6e-6) -> Array:
    return size * np.sin(2.0 * math.pi * cycles * np.linspace(0.0, 1.0, samples))


def noise(x: Array, seed: int = 1, size: float = 0.05) -> Array:
    return size * np.random.default_rng(seed).normal(size=x.size)


# --- the model ------------------------------------------------------------------------------------


def test_the_force_of_a_spring_is_that_of_the_time_domain() -> None:
    random = np.random.default_rng(5)
    x, load = np.cumsum(random.normal(size=300)) * 2e-6, random.uniform(2.0, 10.0, 300)
    contact = Element(mu0=MU0, Fz=float(load[0]), k=K)
    stepped = [
        contact.step(float(way), 0.0, float(Fz))[0]
        for way, Fz in zip(np.diff(x, prepend=x[0]), load, strict=True)
    ]
    kernel = benchmark.kernels[-1]
    rows, _ = kernel.loop_forces(0, np.array([K / MU0]), x, load)
    assert MU0 * rows[0] == close(np.array(stepped), abs=1e-13)


def test_the_force_of_a_ball_is_the_limit_of_many_springs() -> None:
    """Its memory of reversals, too: of any walk."""
    x = np.cumsum(np.random.default_rng(6).normal(size=200)) * 1.5e-6
    x -= x[0]
    contact = Element(mu0=MU0, Fz=FZ, k=K, contact="ball", springs=4000)
    stepped = [contact.step(float(way), 0.0)[0] for way in np.diff(x, prepend=0.0)]
    assert forces("ball", x) == close(np.array(stepped), abs=2e-6)


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_slopes_of_the_force_are_those_of_differences(contact: str) -> None:
    x = np.cumsum(np.random.default_rng(7).normal(size=100)) * 1e-6
    p = K / MU0 * np.exp([-1e-6, 0.0, 1e-6])
    rows, slopes = benchmark.kernels[-1].loop_forces(
        int(contact == "ball"), p, x, np.full(x.size, FZ)
    )
    straight = (rows[2] - rows[0]) / 2e-6
    # but where slip begins between the differences
    assert np.count_nonzero(np.abs(straight - slopes[1]) > 1e-4) <= 2


# --- cycles ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("start", np.linspace(0.0, 6.2, 9))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_cycles_are_counted_from_any_start(start: float, sign: float) -> None:
    tau = np.linspace(0.0, 2.0 * math.pi, 101)
    for number, goes_on in ((1.0, False), (2.6, True), (3.0, False), (0.7, True)):
        found = cycles_of(sign * np.sin(start + number * tau))
        assert (found.number, found.goes_on) == (int(number), goes_on)
        lengths = np.diff(found.begins)
        assert np.abs(lengths - 100 / number).max(initial=0.0) <= 2.0


# --- exact loops ----------------------------------------------------------------------------------

_TRIANGLE = np.array([0, 1, 2, 3, 2, 1, 0, -1, -2, -3, -2, -1]) / 3.0


@pytest.mark.parametrize("contact", ["spring", "ball"])
@pytest.mark.parametrize("share", [0.15, 0.4, 0.7, 0.95])
@pytest.mark.parametrize("cycles", [1, 2, 4])
def test_straight_steps_with_three_samples_in_each_branch_give_k_and_mu0(
    contact: str, share: float, cycles: int
) -> None:
    size = (1.5 if contact == "ball" else 1.0) * MU0 * FZ / K / share
    x = size * np.append(np.tile(_TRIANGLE, cycles), 0.0)
    drift = 1e-3 * np.arange(x.size) if cycles > 1 else 0.0
    force = forces(contact, x, before=x.size if cycles == 1 else 0) + 0.37 + drift
    found = fit_loop(x, force, FZ, contact)
    if share > 1.0 / 3.0:
        assert found.values["k"] == close(K, rel=1e-9)
    else:  # no sample lies within the stick
        assert found.interval["k"] == (close(found.interval["k"][0], rel=1.0), math.inf)
    assert found.values["mu0"] == close(MU0, rel=1e-9)
    if cycles > 1:
        assert found.values["drift"] == close(1e-3, abs=1e-9)
    assert found.interval["mu0"][0] <= found.values["mu0"] <= found.interval["mu0"][1]


def test_a_loop_of_a_load_that_varies() -> None:
    x = sine(400, 2.0)
    load = FZ * (1.0 + 0.3 * np.sin(np.linspace(0.0, 40.0, 400)))
    rows, _ = benchmark.kernels[-1].loop_forces(0, np.array([K / MU0]), x, load)
    found = fit_loop(x, MU0 * rows[0] + 1.0, load)
    assert found.values["k"] == close(K, rel=1e-9)
    assert found.values["mu0"] == close(MU0, rel=1e-9)


def test_less_than_a_cycle_begins_with_the_measured_force() -> None:
    x = np.linspace(0.0, 6e-6, 60)
    found = fit_loop(x, np.minimum(1.0 + K * x, 3.0), FZ)
    assert found.values == close({"k": K, "mu0": MU0}, rel=1e-9)
    assert math.isnan(found.energy)
    assert any("less than one cycle" in note.text for note in found.notes)
    with refused("displacement"):
        fit_loop(x, np.minimum(K * x, 3.0), FZ, "ball")


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_the_other_sign_of_the_force_is_turned_and_noted(contact: str) -> None:
    x = sine(300, 2.5)
    force = forces(contact, x) + noise(x)
    plain, turned = fit_loop(x, force, FZ, contact), fit_loop(x, -force, FZ, contact)
    assert turned.values["k"] == close(plain.values["k"], rel=1e-12)
    assert [note for note in turned.notes if "sign" in note.text]
    assert not [note for note in plain.notes if "sign" in note.text]


def test_a_first_cycle_from_rest_is_noted() -> None:
    x = sine(200, 1.0)
    notes = [fit_loop(x, forces("spring", x, before=n) + noise(x), FZ).notes for n in (0, 200)]
    assert any("from rest" in note.text for note in notes[0])
    assert notes[1] == ()


def test_cycles_are_chosen() -> None:
    x = sine(601, 6.0)
    force = forces("spring", x) + noise(x)
    force[:200] += 5.0  # run-in
    found = fit_loop(x, force, FZ, cycles=(3, 5))
    assert found.residuals.size == 200
    assert found.cycles == 3
    assert found.values["mu0"] == close(MU0, rel=0.01)
    for wrong in ((0, 2), (3, 7), (4, 3), (1.0, 2), "3..8", (True, 2)):
        with refused("cycles"):
            fit_loop(x, force, FZ, cycles=wrong)  # type: ignore[arg-type]


# --- noisy loops ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("loops", [100, nightly(400)])
def test_intervals_of_noisy_loops_hold_the_truth(loops: int) -> None:
    """In 95 % of them, by the binomial distribution (99.9 %); that of 2,000 is in the documents."""
    from scipy.stats import binom

    results = [benchmark.judged(loop) for loop in benchmark.random_loops(loops, seed=3)]
    low, high = (binom.ppf(level, loops, 0.95) for level in (0.0005, 0.9995))
    for name in ("k", "mu0"):
        assert low <= sum(one[name] for one in results) <= high
    notes = [note for one in results for note in one["notes"] if "bound" not in note.text]
    assert len(notes) <= 4


@pytest.mark.slow
@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_residuals_that_are_alike_widen_the_intervals(contact: str) -> None:
    x = sine(1500, 3.0)
    held = 0
    for seed in range(60):
        white = noise(x, seed, 0.03)
        red = np.zeros_like(white)
        for i in range(1, red.size):
            red[i] = 0.9 * red[i - 1] + white[i]
        found = fit_loop(x, forces(contact, x) + red, FZ, contact)
        held += found.interval["mu0"][0] <= MU0 <= found.interval["mu0"][1]
    assert held >= 50


# --- what a loop leaves open ----------------------------------------------------------------------


def test_a_loop_that_never_slips_bounds_mu0_from_below() -> None:
    x = sine(500, 3.0, 2e-6)
    found = fit_loop(x, K * x + noise(x), FZ)
    assert found.values["mu0"] > found.interval["mu0"][0]
    assert found.interval["mu0"][0] == close(0.2, rel=0.03)
    assert found.interval["mu0"][1] == math.inf
    assert found.interval["k"][0] < K < found.interval["k"][1]
    assert any("lower bound" in note.text for note in found.notes)
    assert json.loads(json.dumps(found.to_dict()))["interval"]["mu0"][1] is None


def test_a_loop_that_never_sticks_leaves_k_open() -> None:
    x = sine(500, 3.0)
    found = fit_loop(x, forces("spring", x, 1e10) + noise(x), FZ)
    assert found.interval["k"][0] < min(found.values["k"], 1e10)
    assert found.interval["k"][1] == math.inf
    assert found.values["mu0"] == close(MU0, rel=0.01)
    assert any("k has only" in note.text for note in found.notes)


def of_two_stiffnesses(x: Array, up: float, down: float) -> Array:
    force, now = np.zeros(x.size), 0.0
    for i in range(1, x.size):
        way = x[i] - x[i - 1]
        now = min(max(now + (up if way > 0.0 else down) * way, -MU0 * FZ), MU0 * FZ)
        force[i] = now
    return force


def test_what_speaks_against_the_model_is_noted() -> None:
    x = sine(1200, 3.0)
    plain, speed = forces("spring", x), np.abs(np.gradient(x))
    loops = {
        "different slopes": of_two_stiffnesses(x, 1.15 * K, 0.85 * K),
        "speed": plain * (1.0 + 0.3 * speed / speed.max()),
        "place": plain * (1.0 + 0.2 * x / 6e-6),
    }
    for word, force in loops.items():
        notes = fit_loop(x, force + noise(x, size=0.01), FZ).notes
        assert any(word in note.text for note in notes), (word, notes)
    assert fit_loop(x, plain + noise(x, size=0.01), FZ).notes == ()


# --- refusals, results, command -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"displacement": np.zeros(100)}, "displacement"),
        ({"force": np.zeros(100)}, "force"),
        ({"force": [math.nan] * 100}, "force[0]"),
        ({"displacement": [0.0, 1.0]}, "displacement"),
        ({"displacement": sine(60, 2.0)}, "force"),
        ({"Fz": -1.0}, "Fz"),
        ({"Fz": math.inf}, "Fz"),
        ({"Fz": [10.0] * 50}, "force"),
        ({"Fz": [10.0] * 99 + [0.0]}, "Fz[99]"),
        ({"Fz": [10.0] * 100, "contact": "ball"}, "Fz"),
        ({"contact": "cube"}, "contact"),
        ({"displacement": np.zeros(60_000)}, "displacement"),
    ],
)
def test_what_is_no_loop_names_its_column(change: dict[str, Any], field: str) -> None:
    x = sine(100, 2.0)
    with refused(field):
        fit_loop(**{"displacement": x, "force": forces("spring", x), "Fz": FZ, **change})


def measured_loop() -> tuple[Array, Array, LoopFit]:
    x = sine(400, 3.0)
    force = forces("spring", x) + noise(x)
    return x, force, fit_loop(x, force, FZ)


def test_a_result_is_text_a_dict_a_frame_and_a_picture() -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pytest.importorskip("pandas")
    x, _, found = measured_loop()
    assert len(repr(found).splitlines()) <= 16
    assert "<table>" in found._repr_html_()
    assert found.to_frame().shape == (found.residuals.size, 5)
    area = 4.0 * MU0 * FZ * (6e-6 - MU0 * FZ / K)
    assert found.energy == close(area, rel=0.01)
    upper = found.plot()
    assert len(upper.lines) == 2
    assert found.plot(pyplot.subplots()[1]).lines
    pyplot.close("all")
    assert x.size > found.residuals.size


def test_the_command_fits_a_file(capsys: Capture, tmp_path: Path) -> None:
    x, force, found = measured_loop()
    path = tmp_path / "loop.csv"
    rows = [f"{1e6 * way!r},{one!r},10.0" for way, one in zip(x.tolist(), force.tolist())]  # noqa: B905
    path.write_text("\n".join(["x [um],Ft [N],Fn [N]", *rows]))
    words = ["fit-loop", str(path), "--displacement", "x", "--force", "Ft"]
    assert main([*words, "Fz=10N", "--json"]) == 0
    members = json.loads(capsys.readouterr().out)
    assert members["values"] == close(found.values, rel=1e-6)
    assert main([*words, "--load", "Fn", "--cycles", "2..3"]) == 0
    assert "2 cycles" in capsys.readouterr().out
    out = tmp_path / "out.csv"
    assert main([*words, "Fz=10N", "--plot", str(out)]) == 0
    assert out.read_text().startswith("displacement [m],force [N]")
    capsys.readouterr()
    for code, wrong in (
        (2, [*words]),
        (2, [*words, "Fz=10N", "--load", "Fn"]),
        (2, [*words, "k=1"]),
        (2, [*words[:-1], "x", "Fz=10N"]),
        (1, [*words, "Fz=10N", "--cycles", "2..9"]),
        (1, [*words[:-1], "F", "Fz=10N"]),
    ):
        assert main(wrong) == code
        assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_an_error_says_which_input() -> None:
    x = sine(100, 2.0)
    with pytest.raises(InputError, match="contact radius"):
        fit_loop(x, forces("ball", x), np.full(100, FZ), "ball")
