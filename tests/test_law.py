"""The approximations in a law, by equation number: their ranges and values."""

import math

import numpy as np
import pytest

from comparing import close
from mumacro import closed_forms
from mumacro.inputs import FIELDS
from mumacro.law import (
    APPROXIMATIONS,
    BORDERS,
    EQUATIONS,
    approximations,
    border_speeds,
    friction_law,
    sweep_values,
)

UNIT = {"mu0": 0.25, "Fz": 1.0, "k": 4.0, "omega": 3.0}  # l0 = 1/16 m
LENGTH = 0.0625


def columns(surrogate, y, v):
    """Law, approximations and borders (as v~) at the amplitude y~ over v~ = ``v``."""
    case = {**UNIT, "y0": y * LENGTH}
    law = friction_law(surrogate, "v0", np.asarray(v) * LENGTH * 3.0, case)
    borders = border_speeds(surrogate, law)
    return law, approximations(surrogate, law), {name: x / (LENGTH * 3.0) for name, x in borders.items()}


def test_every_equation_number_names_a_column() -> None:
    for number, name in EQUATIONS.items():
        text = {**BORDERS, **APPROXIMATIONS}[name]
        assert f"({number})" in text or name == f"eq_{number}"


@pytest.mark.parametrize("y", [1e-3, 0.1, 0.5, 0.99, 1.0])
def test_formulas_of_continuous_sliding_are_nan_in_stick_slip(surrogate, y) -> None:
    crit = float(surrogate.v_tilde_crit(y))
    law, found, _ = columns(surrogate, y, crit * np.geomspace(1e-6, 1e6, 241))
    sliding = law.answer.regime == "continuous"
    for name in ("small_amplitude", "continuous"):
        assert (np.isfinite(found[name]) == sliding).all()
    # within their ranges they have the stated accuracy
    assert np.nanmax(np.abs(found["continuous"] - law.answer.mu_macro)) < 0.0401 * UNIT["mu0"]
    assert np.nanmax(np.abs(found["small_amplitude"] - law.answer.mu_macro)) <= 0.08 * y**4 * UNIT["mu0"] + 1e-13


def test_the_papers_law_of_small_amplitudes(surrogate) -> None:
    y = 0.4
    law, found, borders = columns(surrogate, y, np.linspace(0.0, 0.2, 201))
    v = np.linspace(0.0, 0.2, 201)
    low, top = math.sqrt(1.0 - y * y), 1.0 - 0.25 * y * y
    crit = 0.47 * y**2.5 / (y * y + 0.94 * y**0.5 / (1.0 + y * y))
    x = v / crit
    printed = low + (top - low) * (1.0 - (0.75 * (x - 1.0) ** 2 + 0.25 * (x - 1.0) ** 4))
    inside = x <= 1.0
    assert found["master_curve"][inside] == close(0.25 * printed[inside], rel=1e-13)
    assert np.isnan(found["master_curve"][~inside]).all()
    assert found["critical"] == close(0.25 * top, rel=1e-15)
    assert found["static"] == close(0.25 * low, rel=1e-15)
    assert borders["eq_27"] == close(crit, rel=1e-13)
    # eq. (39) as it is printed, in metres and seconds
    l0, y0, omega = LENGTH, y * LENGTH, 3.0
    assert borders["eq_24"] * l0 * omega == close(0.5 * omega * (math.sqrt(l0 * l0 + 2.0 * y0 * y0) - l0), rel=1e-13)
    # the limit of the master curve is more accurate, and both agree with the law's ends
    miss = {
        name: np.nanmax(np.abs(found[name] - law.answer.mu_macro)) for name in ("master_curve", "master_curve_limit")
    }
    assert miss["master_curve_limit"] < 0.2 * miss["master_curve"]
    assert miss["master_curve"] < 3e-3 * 0.25


def test_every_formula_is_given_in_its_stated_range(surrogate) -> None:
    for y in (0.3, 1.0, 3.0):
        _, found, borders = columns(surrogate, y, np.geomspace(1e-3, 10.0, 31))
        assert found.keys() == APPROXIMATIONS.keys()
        assert borders.keys() == BORDERS.keys()
        for name in ("master_curve", "master_curve_limit", "critical", "small_amplitude"):
            assert np.isfinite(found[name]).any() == (y <= 1.0)
        for name in ("eq_23", "eq_24", "small_amplitude"):
            assert np.isfinite(borders[name]).all() == (y <= 1.0)
        for name in ("eq_26", "large_amplitude"):
            assert np.isfinite(borders[name]).all() == (y >= 1.0)
        for name in ("exact", "eq_27", "blend"):
            assert np.isfinite(borders[name]).all()


@pytest.mark.parametrize("along", FIELDS)
def test_extreme_inputs_give_numbers_or_nan_and_no_warning(surrogate, along) -> None:
    case = {"mu0": 0.3, "Fz": 1e-200, "k": 1e200, "y0": 1e-300, "omega": 1e150, "v0": 1e-150}
    values = sweep_values(along, 1e-300 if along != "v0" else 0.0, 1e300, 41, "log" if along != "v0" else "linear")
    others = {name: value for name, value in case.items() if name != along}
    law = friction_law(surrogate, along, values, others)
    for column in (*approximations(surrogate, law).values(), *border_speeds(surrogate, law).values()):
        assert column.shape == values.shape
    top = law.values if along == "mu0" else 0.3
    assert (law.answer.mu_macro <= top).all()


def test_rigid_contact_is_given_as_none_or_infinity(surrogate) -> None:
    values = sweep_values("v0", 1e-3, 10.0, 5, "log")
    r = 2e-6 * 1.3e5 / values
    for stiffness in (None, math.inf):
        case = {"mu0": 0.3, "Fz": 10.0, "k": stiffness, "y0": 2e-6, "omega": 1.3e5}
        law = friction_law(surrogate, "v0", values, case)
        assert (border_speeds(surrogate, law)["exact"] == 0.0).all()
        assert approximations(surrogate, law)["rigid"] == close(0.3 * closed_forms.outer(r), rel=1e-14)
