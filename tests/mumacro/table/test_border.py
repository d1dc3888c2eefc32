"""The border of continuous sliding: solved, stored, and its two limits."""

import math

import numpy as np
import pytest

from builder.solver import steady
from builder.solver.sections import NOT_CONVERGED
from builder.solver.steady import border, solve
from builder.solver.sweep import Sweep
from mumacro import Surrogate
from mumacro.table.atlas import Y_CONT, Y_TAIL
from tests.support.cases import Array, tables
from tests.support.comparing import close
from tests.support.refusals import refused

table = tables()


def test_solved_border_meets_the_reference_to_the_last_digit(reference_border: Array) -> None:
    assert len(reference_border) == 17
    for y, crit, mu in reference_border:
        result, ratio = border(y)
        assert result == close(crit, rel=5e-16)
        assert ratio == close(mu, abs=3e-16)


@pytest.mark.slow
def test_solved_border_is_finite_and_rises_everywhere(sweep: Sweep) -> None:
    y = np.geomspace(1e-8, 1e8, 4_000)
    crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
    assert np.isfinite(crit).all()
    assert np.all(np.diff(crit) > 0.0)
    slope = np.diff(np.log(crit)) / np.diff(np.log(y))
    assert np.all((slope > 0.49) & (slope < 2.0 + 1e-9))


@pytest.mark.parametrize("y", [0.11012028129012316, 0.0002339104158737087, 0.0014321221280091054])
def test_border_does_not_divide_by_a_settled_secant(y: float) -> None:
    # two equal residuals at rounding level once gave NaN or infinity here, with status "success"
    crit, mu = border(y)
    assert crit == close(0.5 * y * y * (1.0 - 5.0 / 12.0 * y * y), rel=y**4 + 1e-13)
    assert solve(crit * (1.0 + 1e-9), y).mu_ratio == close(mu, abs=1e-11)


def test_border_that_cannot_be_found_is_an_error_with_advice(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(steady, "border_raw", lambda *_: (math.nan, math.nan, NOT_CONVERGED))
    with pytest.raises(
        ArithmeticError, match=r"border at y~ = 0.5: the section's root was not found"
    ):
        border(0.5)


# --- the stored curve -----------------------------------------------------------------------------


def test_stored_border_is_within_its_stated_error(
    table: Surrogate, reference_border: Array, sweep: Sweep
) -> None:
    y = np.concatenate([reference_border[:, 0], np.geomspace(1e-8, 1e8, 1000)])
    truth = sweep.solve("border", np.ones_like(y), y)["deficit"]
    error = np.abs(table.v_tilde_crit(y) / truth - 1.0)
    assert table.border.max_rel_error <= max(table.tolerance, 2e-14)
    assert error.max() <= table.border.max_rel_error + 2e-14
    assert np.abs(
        table.v_tilde_crit(reference_border[:, 0]) / reference_border[:, 1] - 1.0
    ).max() <= (table.border.max_rel_error + 1e-15)


def test_stored_border_rises_also_where_its_pieces_meet(table: Surrogate) -> None:
    for seam in (Y_CONT, Y_TAIL):
        below, above = (
            table.v_tilde_crit(seam * (1.0 - 1e-15)),
            table.v_tilde_crit(seam * (1.0 + 1e-15)),
        )
        assert below == close(above, rel=2.0 * table.border.max_rel_error + 1e-14)
    assert np.all(np.diff(table.v_tilde_crit(np.geomspace(1e-6, 1e9, 30_000))) > 0.0)


def test_stored_border_in_scalars_arrays_and_shapes(table: Surrogate) -> None:
    y = np.array([[0.0, 1e-3, 0.5], [1.5, 20.0, math.inf]])
    crit = table.v_tilde_crit(y)
    assert crit.shape == y.shape
    assert crit.ravel().tolist() == [table.v_tilde_crit(float(one)) for one in y.ravel()]
    assert (crit[0, 0], crit[1, 2], type(table.v_tilde_crit(0.5))) == (0.0, math.inf, float)
    assert table.v_tilde_crit([]).shape == (0,)
    assert table.v_tilde_crit(np.broadcast_to(0.5, (2, 3))).shape == (2, 3)
    assert table.v_tilde_crit(y[:, ::2]).tolist() == crit[:, ::2].tolist()


@pytest.mark.parametrize("bad", [-1.0, -1e-300, math.nan, -math.inf])
def test_stored_border_names_illegal_amplitudes(table: Surrogate, bad: float) -> None:
    with refused("y_tilde") as caught:
        table.v_tilde_crit(bad)
    assert caught.value.index is None
    many = table.v_tilde_crit([[1.0, 2.0], [3.0, bad]])
    assert np.isnan(many).tolist() == [[False, False], [False, True]]
    assert many[0].tolist() == [table.v_tilde_crit(1.0), table.v_tilde_crit(2.0)]
