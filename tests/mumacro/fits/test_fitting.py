"""mumacro.fit: inputs recovered within their covariance, what points do not tell, bad input."""

import itertools
import math
import warnings
from typing import Any

import numpy as np
import pytest

from mumacro import InputError, Surrogate, fit
from mumacro.inputs.fields import CONTACTS
from tests.support.cases import Case
from tests.support.comparing import close
from tests.support.fits import least_chi2, random_points
from tests.support.nightly import nightly
from tests.support.refusals import refused
from tests.support.scripts import script

fit_coverage = script("benchmarks.fit_coverage")

RIG: Case = {"Fz": 10.0, "y0": 2e-6, "f": 20e3}
V0 = np.geomspace(1e-3, 1.0, 20)


@pytest.fixture(autouse=True)
def quiet() -> Any:
    """Warnings are looked at in the result."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        yield


def friction(surrogate: Surrogate, contact: Any = "spring", **inputs: Any) -> Any:
    """mu_macro of a contact that is known."""
    return np.asarray(
        surrogate.evaluate(**{"mu0": 0.3, "k": 1e6, **RIG, **inputs}, contact=contact).mu_macro
    )


def noisy(surrogate: Surrogate, spread: Any, seed: int = 0, **inputs: Any) -> Any:
    """Points with noise, and their standard deviations."""
    mu = friction(surrogate, **inputs)
    return mu + np.random.default_rng(seed).normal(scale=spread, size=mu.shape)


@pytest.mark.slow
@pytest.mark.parametrize("draws", [50, nightly(200)])
@pytest.mark.parametrize("has_std", [True, False], ids=["std", "scatter"])
@pytest.mark.parametrize("unknowns", [("k", "mu0"), ("k",), ("mu0",)], ids=" ".join)
@pytest.mark.parametrize("contact", CONTACTS)
def test_inputs_lie_within_their_covariance(
    surrogate: Surrogate, contact: Any, unknowns: Any, has_std: Any, draws: int
) -> None:
    """In 95 % of the draws, by the binomial distribution (99.9 %); so are the intervals, each for
    itself."""
    from scipy.stats import binom, chi2
    from scipy.stats import f as fisher

    truth: Case = {"k": 1e6, "mu0": 0.3}
    v0, y0, spread = np.tile(V0, 2), np.repeat([1e-6, 2.5e-6], 20), 2e-3
    inputs = {name: value for name, value in truth.items() if name not in unknowns}
    n = len(unknowns)
    inside: Any = 0
    intervals: Any = np.zeros(n, dtype=int)
    clean = friction(surrogate, contact, v0=v0, y0=y0)
    for seed in range(draws):
        mu = clean + np.random.default_rng(seed).normal(scale=spread, size=40)
        data = {"v0": v0, "y0": y0, "mu_macro": mu} | ({"std": spread} if has_std else {})
        estimate = fit(data, unknowns, contact=contact, Fz=10.0, f=20e3, **inputs)
        off = np.array([estimate.values[name] - truth[name] for name in unknowns])
        limit = chi2.ppf(0.95, n) if has_std else n * fisher.ppf(0.95, n, 40 - n)
        inside += off @ np.linalg.solve(estimate.covariance, off) <= limit
        intervals += [
            estimate.interval[name][0] <= truth[name] <= estimate.interval[name][1]
            for name in unknowns
        ]
        assert len(estimate.solutions) == 1
        assert estimate.reduced_chi2 * (1.0 if has_std else spread**-2) == close(1.0, abs=1.0)
    low, high = (float(binom.ppf(level, draws, 0.95)) for level in (0.0005, 0.9995))
    assert low <= inside <= high
    assert np.all((low <= intervals) & (intervals <= high))


def test_the_variance_is_that_of_the_scatter_over_the_degrees_of_freedom(
    surrogate: Surrogate,
) -> None:
    # without oscillation mu_macro is mu0: its mean, and the deviation of a mean
    mu = [0.28, 0.31, 0.3, 0.29]
    estimate = fit({"v0": np.ones(4), "mu_macro": mu}, "mu0", k=1e6, **{**RIG, "y0": 0.0})
    assert estimate.values["mu0"] == close(np.mean(mu), rel=1e-8)
    assert estimate.std["mu0"] == close(np.std(mu, ddof=1) / 2.0, rel=1e-8)
    both = fit({"v0": V0[::4], "mu_macro": noisy(surrogate, 3e-3, v0=V0[::4])}, **RIG)
    case: Case = {**both.values, **RIG, "v0": V0[::4]}
    slopes: Any = surrogate.evaluate(case, gradient=True).gradient
    rows = np.stack([slopes["k"], slopes["mu0"]])
    assert both.covariance == close(both.chi2 / (5 - 2) * np.linalg.inv(rows @ rows.T), rel=1e-6)


def test_exact_points_that_hardly_tell_k_give_it(surrogate: Surrogate) -> None:
    rig: Case = {"Fz": 10.0, "y0": 0.004 * 3.0 / 3e4, "f": 20e3}  # y~ = 0.004
    v0 = np.geomspace(1e-3, 3.0, 20) * 1e-4 * 2.0 * math.pi * 20e3
    questions: list[tuple[str, Case]] = [("k mu0", {}), ("k", {"mu0": 0.3})]
    for names, inputs in questions:
        mu = np.asarray(surrogate.evaluate(mu0=0.3, k=3e4, v0=v0, **rig).mu_macro)
        estimate = fit({"v0": v0, "mu_macro": mu}, names.split(), **{**rig, **inputs})
        assert estimate.values["k"] == close(3e4, rel=1e-7)
        assert estimate.interval["k"][0] <= 3e4 <= estimate.interval["k"][1]


def test_mu0_may_be_known_at_each_point(surrogate: Surrogate) -> None:
    mu0 = np.linspace(0.35, 0.25, V0.size)
    points = {"v0": V0, "mu0": mu0, "mu_macro": friction(surrogate, v0=V0, mu0=mu0)}
    for unknowns in (None, "k"):
        assert fit(points, unknowns, **RIG).values == {"k": close(1e6, rel=1e-8)}
    for name, both in (("mu0", ["mu0"]), ("k", ["k", "mu0"]), ("k", ["k"])):
        with refused(name):
            fit({**points, "k": 1e6}, both, **RIG)


def test_every_input_may_vary(surrogate: Surrogate) -> None:
    rng = np.random.default_rng(1)
    columns: Case = {
        "v0": rng.uniform(1e-3, 1.0, 30),
        "Fz": rng.uniform(5.0, 20.0, 30),
        "y0": rng.uniform(0.0, 5e-6, 30),
        "omega": rng.uniform(1e4, 2e5, 30),
    }
    mu = np.asarray(surrogate.evaluate(mu0=0.3, k=1e6, **columns).mu_macro)
    estimate = fit({**columns, "mu_macro": mu})
    assert estimate.values == {"k": close(1e6, rel=1e-8), "mu0": close(0.3, rel=1e-9)}
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({**columns, "mu_macro": mu, "std": 1e-3, "remark": "x"})
    assert fit(frame).values == {"k": close(1e6, rel=1e-6), "mu0": close(0.3, rel=1e-7)}


def test_weights_are_the_standard_deviations(surrogate: Surrogate) -> None:
    mu, std = noisy(surrogate, 1e-4, v0=V0), np.full(20, 1e-4)
    mu[3], std[3] = 0.9, 1e6
    estimate = fit({"v0": V0, "mu_macro": mu, "std": std}, **RIG)
    assert estimate.values["k"] == close(1e6, rel=2e-3)
    assert estimate.warnings == []
    assert any(
        "scatter by more than their std" in text
        for text in fit({"v0": V0, "mu_macro": mu, "std": 1e-5}, **RIG).warnings
    )


def test_the_order_of_the_unknowns_does_not_matter(surrogate: Surrogate) -> None:
    points = {"v0": V0, "mu_macro": noisy(surrogate, 1e-3, v0=V0)}
    one, other = (fit(points, names, **RIG) for names in (("k", "mu0"), ("mu0", "k")))
    assert one.to_dict() == other.to_dict()


def test_the_band_covers_the_fit_and_its_slope_is_the_covariance(surrogate: Surrogate) -> None:
    estimate = fit({"v0": V0, "mu_macro": noisy(surrogate, 1e-3, v0=V0), "std": 1e-3}, **RIG)
    mu, off = estimate.predict(v0=0.05)
    both = np.linalg.cholesky(estimate.covariance)
    drawn = both @ np.random.default_rng(2).normal(size=(2, 4000)) + np.array(
        [[x] for x in estimate.values.values()]
    )
    each = surrogate.evaluate(k=drawn[0], mu0=drawn[1], v0=0.05, **RIG).mu_macro
    assert mu == close(each.mean(), abs=3.0 * off / 60.0)
    assert off == close(each.std(), rel=0.05)


def test_a_fit_predicts_at_other_inputs_by_name(surrogate: Surrogate) -> None:
    found = fit({"v0": V0, "mu_macro": noisy(surrogate, 1e-3, v0=V0)}, **RIG)
    at_points = found.predict()
    assert at_points.mu_macro == close(found.points["mu_macro"] - found.residuals, rel=1e-14)
    new: Case = {"v0": np.array([0.02, 0.04]), "f": 10e3, "y0": [[1e-6], [3e-6], [5e-6]]}
    mu, std = found.predict(**new)
    assert mu.shape == std.shape == (3, 2)
    expected = surrogate.evaluate({**RIG, **new, **found.values}).mu_macro
    assert mu == close(np.asarray(expected), rel=1e-14)
    assert np.all(std > 0.0)
    assert isinstance(found.predict(v0=0.02).mu_macro, float)


@pytest.mark.parametrize(
    ("inputs", "field"),
    [
        ({"k": 1e6}, "k"),
        ({"vo": 0.1}, "vo"),
        ({"v0": -1.0}, "v0"),
        ({"v0": 0.1, "f": 1e4, "omega": 1e4}, "omega"),
        ({"Fz_amplitude": 1.0}, "Fz_amplitude"),
        ({"v0": [0.1, 0.2]}, "mu0"),  # it differs between the points
        ({"f": 1e4}, "v0"),
    ],
)
def test_predictions_that_would_be_misread_name_their_input(
    surrogate: Surrogate, inputs: Any, field: str
) -> None:
    mu0 = np.linspace(0.35, 0.25, V0.size)
    found = fit({"v0": V0, "mu0": mu0, "mu_macro": friction(surrogate, v0=V0, mu0=mu0)}, **RIG)
    with refused(field):
        found.predict(**({"mu0": 0.3} if field != "mu0" else {}), **inputs)


def test_a_fit_reads_texts_and_units_like_every_answer(surrogate: Surrogate) -> None:
    mu = friction(surrogate, v0=V0)
    plain = fit({"v0": V0, "mu_macro": mu, "std": 1e-3}, **RIG)
    texts = fit(
        {"v0 [mm/s]": 1e3 * V0, "mu_macro": mu, "std": "0.1 %"},
        Fz="10N",
        y0="2 um",
        f="20kHz",
    )
    assert texts.values == {name: close(x, rel=1e-9) for name, x in plain.values.items()}
    there = plain.predict(v0=0.02, f=10e3)
    again = plain.predict(v0="20 mm/s", f="10 kHz")
    assert list(again) == close(list(there), rel=1e-12)


def test_an_input_in_a_wrong_unit_is_remarked_on(surrogate: Surrogate) -> None:
    [remark] = fit({"v0": V0, "mu_macro": friction(surrogate, v0=V0)}, **{**RIG, "Fz": 1e7}).remarks
    assert (remark["row"], remark["field"]) == ("units", "Fz")


def test_friction_that_looks_like_per_cent_is_remarked_on(surrogate: Surrogate) -> None:
    mu = friction(surrogate, v0=V0)
    assert fit({"v0": V0, "mu_macro": mu}, **RIG).remarks == []
    [remark] = fit({"v0": V0, "mu_macro": 100.0 * mu}, **RIG).remarks
    assert (remark["row"], remark["field"], remark["cases"]) == ("units", "mu_macro", 20)
    assert "mu_macro [%]" in remark["text"]


# --- the least chi2 -------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", ["across", "along"])
@pytest.mark.parametrize("contact", CONTACTS)
def test_exact_points_of_any_contact_give_it(
    surrogate: Surrogate, contact: Any, direction: Any
) -> None:
    chance = np.random.default_rng(7)
    words: Any = {"contact": contact, "direction": direction}
    for _ in range(25):
        truth, v0 = fit_coverage.random_contact(chance)
        mu = np.asarray(surrogate.evaluate(**truth, v0=v0, **words).mu_macro)
        rig = {name: truth[name] for name in ("Fz", "y0", "f")}
        found = fit({"v0": v0, "mu_macro": mu}, **rig, **words)
        assert found.values == {
            "k": close(truth["k"], rel=1e-6),
            "mu0": close(truth["mu0"], rel=1e-6),
        }
        for name, (low, high) in found.interval.items():
            assert low <= found.values[name] <= high


def test_slow_points_at_the_corner_along_give_the_contact() -> None:
    # rounded to four digits, of k = 7.52e6 N/m, mu0 = 0.31; chi2 is 8.5e-4 for a rigid contact
    points = {
        "v0": [1e-4, 2e-4, 4e-4, 7e-4, 1.4e-3, 2.7e-3, 5.2e-3, 0.01],
        "mu_macro": [0.011, 0.0128, 0.0162, 0.0212, 0.0323, 0.0514, 0.0844, 0.1377],
    }
    found = fit(points, Fz=10.0, y0=4e-7, f=20e3, direction="along")
    assert found.chi2 < 3.3e-9
    assert found.values == {"k": close(7.52e6, rel=1e-3), "mu0": close(0.31, rel=1e-3)}


@pytest.mark.parametrize("direction", ["across", "along"])
@pytest.mark.parametrize("contact", CONTACTS)
def test_no_contact_fits_better_and_the_intervals_end_where_chi2_says(
    surrogate: Surrogate, contact: Any, direction: Any
) -> None:
    """Beside a dense scan of k/mu0, with the best mu0 of each."""
    chance = np.random.default_rng(11)
    words: Any = {"contact": contact, "direction": direction}
    p = np.geomspace(1e-4, 1e5, 4001)[:, None]  # of y~
    for _ in range(4):
        truth, v0 = fit_coverage.random_contact(chance)
        rig = {name: truth[name] for name in ("Fz", "y0", "f")}
        spread = 0.01 * truth["mu0"]
        clean = np.asarray(surrogate.evaluate(**truth, v0=v0, **words).mu_macro)
        mu = clean + chance.normal(scale=spread, size=v0.size)
        found = fit({"v0": v0, "mu_macro": mu, "std": spread}, **rig, **words)
        ratio = np.asarray(
            surrogate.evaluate(mu0=1.0, k=p * rig["Fz"] / rig["y0"], v0=v0, **rig, **words).mu_macro
        )
        square = (ratio**2).sum(axis=1)
        mu0 = np.maximum(ratio @ mu, 0.0) / square
        chi2 = ((mu - mu0[:, None] * ratio) ** 2).sum(axis=1) / spread**2
        assert found.chi2 <= chi2.min() + 1e-9
        spare = found.chi2 + 1.959964**2 - chi2
        inside = spare > 0.0
        off = np.sqrt(spare[inside] * spread**2 / square[inside])
        low, high = found.interval["mu0"]
        assert low == close((mu0[inside] - off).clip(0.0).min(), abs=0.02 * spread)
        assert high == close((mu0[inside] + off).max(), abs=0.02 * spread)
        k = (p[:, 0] * rig["Fz"] / rig["y0"])[inside]
        low, high = found.interval["k"]
        assert low == 0.0 or low == close((k * (mu0[inside] - off)).min(), rel=0.01)
        assert high == math.inf or high == close((k * (mu0[inside] + off)).max(), rel=0.01)


@pytest.mark.slow
def test_intervals_of_the_set_ups_of_the_benchmark_hold_the_truth() -> None:
    """In 95 % of 40 set-ups with 10 draws each, by the binomial distribution (99.9 %); in full by
    benchmarks/fit_coverage.py."""
    from scipy.stats import binom

    held = asked = 0
    for index, set_up in enumerate(fit_coverage.SET_UPS):
        clean = fit_coverage.clean_friction(set_up)
        for draw in range(10):
            noise = np.random.default_rng([index, draw]).normal(
                scale=set_up.spread, size=clean.size
            )
            found = fit_coverage.fitted(set_up, clean + noise)
            for name, (low, high) in found.interval.items():
                assert low <= found.values[name] <= high
                held += low <= getattr(set_up, name) <= high
                asked += 1
    low, high = (float(binom.ppf(level, asked, 0.95)) for level in (0.0005, 0.9995))
    assert low <= held <= high


# --- what points do not tell ----------------------------------------------------------------------


def test_stiff_contacts_have_a_lower_bound_only_soft_ones_an_upper_one(
    surrogate: Surrogate,
) -> None:
    def measured(k: Any, spread: float = 3e-3) -> Any:
        return fit(
            {"v0": V0, "mu_macro": noisy(surrogate, spread, v0=V0, k=k), "std": spread}, **RIG
        )

    with pytest.warns(UserWarning, match="only a lower bound"):
        stiff = measured(1e9)
    low, high = stiff.interval["k"]
    assert 1e7 < low < 1e9 < high == math.inf
    assert stiff.interval["mu0"][0] < 0.3 < stiff.interval["mu0"][1]
    rigid = fit({"v0": V0, "mu_macro": friction(surrogate, v0=V0, k=math.inf)}, **RIG)
    assert rigid.values == {"k": math.inf, "mu0": close(0.3, rel=1e-9)}
    assert rigid.std["k"] == rigid.interval["k"][1] == math.inf
    soft, large = measured(1e3), measured(5e7, 1e-4)
    assert soft.interval["k"][0] == 0.0 < 1e3 < soft.interval["k"][1] < 2e6
    assert large.interval["k"][0] < 5e7 < large.interval["k"][1]
    for estimate, message in (
        (stiff, "only a lower bound"),
        (soft, "only an upper bound"),
        (large, "above 20"),
    ):
        assert any(message in text for text in estimate.warnings)
    assert not any("inf" in text for text in rigid.warnings)


def test_all_solutions_are_found(surrogate: Surrogate) -> None:
    """mu_macro is not monotone in k: three stiffnesses give this friction."""
    v0 = 2e-6 * 0.57 / 10.9 * 2.0 * math.pi * 20e3
    k = np.geomspace(1e4, 1e10, 100_000)
    mu = friction(surrogate, v0=v0, k=k)
    rising = np.flatnonzero(np.diff(mu) > 0.0)
    target = float(mu[rising].mean())
    expected = k[:-1][np.diff(np.sign(mu - target)) != 0.0]
    assert expected.size == 3
    for std in ({}, {"std": 1e-4}):
        estimate = fit({"v0": [v0], "mu_macro": [target], **std}, "k", mu0=0.3, **RIG)
        assert sorted(one["k"] for one in estimate.solutions) == [
            close(one, rel=1e-3) for one in expected
        ]
        assert any("3 solutions" in text for text in estimate.warnings)
    # any of which may be the truth
    for draw in np.random.default_rng(0).normal(scale=1e-5, size=10):
        estimate = fit({"v0": [v0], "mu_macro": [target + draw], "std": 1e-5}, "k", mu0=0.3, **RIG)
        assert estimate.interval["k"][0] < expected[0] < expected[-1] < estimate.interval["k"][1]
        assert any(
            "3 solutions fit within 95 %, the interval covers them all" in text
            for text in estimate.warnings
        )
    # with the scatter of a usual measurement the three are one
    assert (
        len(fit({"v0": [v0], "mu_macro": [target], "std": 0.02}, "k", mu0=0.3, **RIG).solutions)
        == 1
    )


def test_as_many_points_as_unknowns_have_no_error_without_std(surrogate: Surrogate) -> None:
    v0 = np.array([0.002, 0.1])
    estimate = fit({"v0": v0, "mu_macro": friction(surrogate, v0=v0)}, **RIG)
    assert estimate.values["k"] == close(1e6, rel=1e-6)
    assert math.isinf(estimate.std["k"])
    assert math.isnan(estimate.reduced_chi2)
    assert any("no measure of the error" in text for text in estimate.warnings)
    with_std = fit({"v0": v0, "mu_macro": friction(surrogate, v0=v0), "std": 1e-3}, **RIG)
    assert 0.0 < with_std.std["k"] < 1e5


@pytest.mark.parametrize(
    ("k", "mu0", "scale"), [(1e-3, 0.3, 1e-9), (1e15, 0.3, 1e9), (1e6, 1e-3, 1.0), (1e6, 30.0, 1.0)]
)
def test_units_and_sizes_do_not_matter(surrogate: Surrogate, k: Any, mu0: Any, scale: Any) -> None:
    """Stiffness over force, and amplitude over l0, are what counts."""
    rig = {"Fz": 10.0 * scale, "y0": 2.0 * mu0 * 10.0 * scale / k, "f": 20e3}
    v0 = rig["y0"] * 1.3e5 * np.geomspace(0.01, 3.0, 20)
    mu = surrogate.evaluate(mu0=mu0, k=k, v0=v0, **rig).mu_macro
    assert fit({"v0": v0, "mu_macro": mu}, **rig).values == {
        "k": close(k, rel=1e-7),
        "mu0": close(mu0, rel=1e-8),
    }


@pytest.mark.parametrize("along", ["v0", "y0"])
def test_the_picture_has_points_fit_and_band(surrogate: Surrogate, along: Any) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    x = {"v0": np.append(0.0, V0), "y0": np.geomspace(1e-7, 1e-5, 21)}[along]
    case = {**RIG, "v0": 0.05, along: x}
    estimate = fit(
        {along: x, "mu_macro": friction(surrogate, **case), "std": 1e-3},
        **{name: value for name, value in case.items() if name != along},
    )
    axes, below = estimate.plot().figure.axes
    assert below.get_xlabel() == {"v0": "$v_0$ [m/s]", "y0": "$y_0$ [m]"}[along]
    assert axes.get_ylabel() == r"$\mu_\mathrm{macro}$ [-]"
    points, curve = axes.lines[0], axes.lines[-1]
    assert np.array_equal(points.get_xdata(), x)
    assert np.interp(x, curve.get_xdata(), curve.get_ydata()) == close(points.get_ydata(), abs=1e-3)
    edges = axes.collections[-1].get_paths()[0].vertices[:, 1]
    assert edges.min() < curve.get_ydata().min() < curve.get_ydata().max() < edges.max()
    assert below.lines[0].get_ydata() == close(estimate.residuals, rel=1e-15)
    matplotlib.pyplot.close("all")


# --- bad input ------------------------------------------------------------------------------------

POINTS: Case = {"v0": [0.01, 0.1, 1.0], "mu_macro": [0.2, 0.25, 0.3]}
LIFTED: Case = {"Fz": 10.0, "f": 20e3, "direction": "normal"}


@pytest.mark.parametrize(
    ("data", "inputs", "message"),
    [
        (POINTS, {**RIG, "unknowns": ("k", "y0")}, 'unknowns must be one or both of "k" and "mu0"'),
        (POINTS, {**RIG, "contact": "cube"}, "contact must be one of"),
        (POINTS, {**RIG, "k": 1e6}, "k must be left out, or taken from unknowns"),
        (POINTS, {**RIG, "unknowns": "k"}, "mu0 must be given"),
        (POINTS, {**RIG, "omga": 1.0}, "omga must be .* did you mean omega"),
        (POINTS, {**RIG, "v0": 1.0}, "v0 must be given once: as a column or as a keyword"),
        (POINTS, {"Fz": 10.0, "f": 2e4}, r"y0 must be given \[m\]"),
        (POINTS, {"Fz": 10.0, "y0": 2e-6}, "omega must be given, or f"),
        (POINTS, {**RIG, "y0": -1.0}, "y0 must be finite and >= 0"),
        ({"v0": [0.1, 0.2]}, RIG, "mu_macro must be a column of the data"),
        ([0.1, 0.2], RIG, "data must be a mapping, DataFrame"),
        ({**POINTS, "vo": [0.01, 0.1, 1.0]}, RIG, "vo must be one of"),
        ({**POINTS, "vo [mm/s]": [1.0, 2.0, 3.0]}, RIG, "must be one of"),
        (
            {"v0": [0.1, 0.1, 0.1], "mu_macro": [0.2, 0.21, 0.2]},
            RIG,
            "points at 2 different inputs or more",
        ),
        (
            {"v0": [0.1, 0.2, 0.3], "mu_macro": [0.2, 0.21]},
            RIG,
            "data must be columns of one length",
        ),
        (
            {"v0": [0.1, 0.2], "mu_macro": [0.2, math.nan]},
            RIG,
            "mu_macro at index 1 must be finite and >= 0",
        ),
        (
            {"v0": [0.1, 0.2], "mu_macro": [0.2, -0.1]},
            RIG,
            "mu_macro at index 1 must be finite and >= 0",
        ),
        ({"v0": [0.1, math.nan], "mu_macro": [0.2, 0.1]}, RIG, "v0 at index 1 must be finite"),
        (
            {"v0": [0.1, 0.2], "mu_macro": [0.0, 0.0]},
            RIG,
            "mu_macro must be > 0 in at least one point",
        ),
        ({**POINTS, "std": [1e-3, 0.0, 1e-3]}, RIG, "std at index 1 must be finite and > 0"),
        (POINTS, {**RIG, "y0": 0.0}, "points with y0 > 0 and omega > 0"),
        (
            POINTS,
            {**RIG, "unknowns": "k", "mu0": 0.28},
            "mu_macro at index 2 must be <= mu0, within 5 %; give std",
        ),
        (
            {**POINTS, "std": 1e-3},
            {**RIG, "unknowns": "k", "mu0": 0.28},
            "mu_macro at index 2 must be <= mu0",
        ),
        ({"v0": [0.1, 0.2], "mu_macro": ["0.2", "dry"]}, RIG, "mu_macro must be a column of num"),
        ({"v0": [0.1, 0.2], "mu_macro": [0.2, "dry"]}, RIG, "mu_macro at index 1"),
        (POINTS, {**RIG, "Fz": "10 ± 1 N"}, "without a deviation"),
        (POINTS, {**RIG, "Fz": "9..11 N"}, "Fz must be"),
        (POINTS, {**RIG, "Fz": "10 mm"}, "Fz must be"),
        *(
            (POINTS, {**LIFTED, "Fz_amplitude": force}, "Fz_amplitude must be")
            for force in (-1.0, 10.0, 20.0)
        ),
        ({"v0": np.ones(10_001), "mu_macro": np.ones(10_001)}, RIG, "average them"),
    ],
)
def test_bad_input_is_named_with_the_remedy(data: Any, inputs: Any, message: Any) -> None:
    with pytest.raises(InputError, match=message):
        fit(data, **inputs)


def test_points_that_do_not_depend_on_k_are_no_data() -> None:
    data = {"v0": [0.0, 0.1], "y0": [2e-6, 0.0], "mu_macro": [0.0, 0.3]}
    with refused("data"):
        fit({**data, "y0": [0.0, 1e-15], "v0": [0.1, 1e6], "mu_macro": [0.3, 0.3]}, Fz=10.0, f=2e4)
    # noise may lie on the other side of what is possible, if it is said
    within = {"v0": [0.01, 0.1, 1.0], "mu_macro": [0.2, 0.25, 0.301], "std": 1e-3}
    assert fit(within, "k", mu0=0.3, **RIG).values["k"] > 0.0
    assert (
        fit({"v0": [1e-3, 0.1, 1.0], "mu_macro": [-1e-4, 0.1, 0.3], "std": 1e-3}, **RIG).values["k"]
        > 0.0
    )


@pytest.mark.parametrize("seed", range(2))
def test_extreme_points_give_a_reason_or_no_nan(seed: int) -> None:
    """One number of an ordinary measurement is replaced by one of any size."""
    chance = np.random.default_rng(seed)
    sizes = [0.0, 5e-324, 1.7e308, 1e20, *10.0 ** chance.uniform(-307, 308, 3)]
    columns = {"v0": V0[::5], "mu_macro": np.array([0.02, 0.1, 0.2, 0.3])}
    columns |= {"y0": np.full(4, 2e-6), "std": np.full(4, 0.01)}
    for name, size, scattered in itertools.product(columns, sizes, (True, False)):
        data = {key: x.copy() for key, x in columns.items() if key != "std" or not scattered}
        data.setdefault(name, columns[name].copy())[chance.integers(4)] = size
        try:
            estimate = fit(data, Fz=10.0, f=20e3)
        except InputError:
            continue
        numbers = [
            *estimate.values.values(),
            *estimate.std.values(),
            *sum(estimate.interval.values(), ()),
            *estimate.covariance.flat,
        ]
        assert not np.isnan([*numbers, estimate.chi2, *estimate.residuals]).any(), (name, size)
        assert min(low for low, _ in estimate.interval.values()) >= 0.0


def test_a_minimum_where_the_curve_bends_is_found(surrogate: Surrogate) -> None:
    """chi2 falls towards a place between two samples at which its slope jumps."""
    points = {
        "v0": [0.2731185, 0.0693925, 2.2318e-4, 4.9130e-4, 0.4362558],
        "mu_macro": [0.2829535, 0.2846352, 0.00841034, 0.00632732, 0.2851833],
        "std": [0.00385934, 0.00209501, 0.00678778, 0.00274079, 0.0125773],
    }
    rig: Case = {"Fz": 10.0, "omega": 1.2e5, "y0": 4e-7, "direction": "along"}
    found = fit(points, **rig, surrogate=surrogate)
    arrays = {name: np.array(values) for name, values in points.items()}
    assert found.chi2 <= least_chi2(surrogate, arrays, rig) * (1.0 + 1e-6)


@pytest.mark.slow
def test_a_fit_has_the_least_chi2(surrogate: Surrogate) -> None:
    tried = 0
    for seed in range(60):
        points, rig = random_points(surrogate, seed)
        try:
            found = fit(points, **rig, surrogate=surrogate)
        except InputError:
            continue
        tried += 1
        assert found.chi2 <= least_chi2(surrogate, points, rig) * (1.0 + 1e-6), seed
    assert tried > 40
