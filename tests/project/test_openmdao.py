"""The example of an OpenMDAO component: partial derivatives checked by OpenMDAO, limits and illegal
cases."""

import importlib
import math
from typing import Any

import numpy as np
import pytest

from mumacro import InputError, Surrogate
from mumacro.inputs.fields import FIELDS
from tests.support.serving import CASE

om = pytest.importorskip(
    "openmdao.api", reason="openmdao of requirements/peers.txt is not installed"
)
pytestmark = pytest.mark.peer

# stick-slip, continuous sliding, creep below y~ = 1, large amplitude
POINTS = np.array([[0.1, 0.5], [2.0, 1.0], [1e-3, 0.7], [0.3, 30.0]])


@pytest.fixture
def component(repository: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(repository / "examples"))
    table = Surrogate.open(1e-10, threads=1)
    friction = importlib.import_module("openmdao_component").Friction

    def problem_of(**options: Any) -> Any:
        problem = om.Problem(reports=None)
        problem.model.add_subsystem(
            "friction", friction(surrogate=table, vec_size=4, **options), promotes=["*"]
        )
        problem.setup(force_alloc_complex=False)
        length = CASE["mu0"] * CASE["Fz"] / CASE["k"]
        v, y = POINTS.T
        for name, value in {**CASE, "v0": v * length * CASE["omega"], "y0": y * length}.items():
            problem.set_val(name, value)
        problem.run_model()
        return problem

    return problem_of


def test_openmdao_checks_the_partials(component: Any) -> None:
    problem = component(power=True)
    checked = problem.check_partials(
        out_stream=None, method="fd", form="central", step=1e-6, step_calc="rel_element"
    )
    (pairs,) = checked.values()
    assert len(pairs) == 2 * 6
    for (of, wrt), pair in pairs.items():
        scale = float(np.abs(pair["J_fd"]).max())
        np.testing.assert_allclose(
            pair["J_fwd"], pair["J_fd"], rtol=1e-5, atol=1e-7 * scale, err_msg=f"{of} {wrt}"
        )
    (v, y), table = POINTS.T, Surrogate.open(1e-10, threads=1)
    np.testing.assert_allclose(
        problem.get_val("mu_macro"), CASE["mu0"] * table.mu_ratio(v, y), rtol=1e-12
    )
    unit = (CASE["mu0"] * CASE["Fz"]) ** 2 / CASE["k"] * CASE["omega"]
    np.testing.assert_allclose(
        problem.get_val("oscillation_power"), unit * table.power(v, y), rtol=1e-12
    )


def test_openmdao_may_step_back_from_illegal_values(component: Any) -> None:
    problem = component()
    problem.set_val("k", math.inf)
    problem.run_model()
    assert np.all(problem.get_val("mu_macro") > 0.0)
    problem.set_val("y0", -1e-6)
    with pytest.raises(
        om.AnalysisError, match="y0 at index 0 must be finite and >= 0, got -1e-06"
    ) as caught:
        problem.run_model()
    assert isinstance(caught.value.__cause__, InputError)
    problem = component(power=True)
    problem.set_val("k", math.inf)
    with pytest.raises(om.AnalysisError, match="power of a rigid contact is not defined"):
        problem.run_model()


def test_openmdao_partials_at_the_edges_are_finite(component: Any) -> None:
    problem = component(power=True)
    problem.set_val("v0", [0.0, 0.01, 0.01, 0.0])
    problem.set_val("y0", [1e-6, 0.0, 2e-6, 0.0])
    problem.set_val("omega", [1.3e5, 1.3e5, 0.0, 1.3e5])
    problem.run_model()
    slopes = problem.compute_totals(of=["mu_macro", "oscillation_power"], wrt=list(FIELDS))
    for pair, slope in slopes.items():
        assert np.all(np.isfinite(slope)), pair
