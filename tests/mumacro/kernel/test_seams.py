"""At the doubles beside a seam, where cells, blocks or the halves of a coordinate meet, answers are
those of its two sides."""

from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.inputs.fields import BALL, SPRING, Kind
from tests.support.cases import opened, tables
from tests.support.seams import beyond_both_sides, doubles_at_every_seam

table = tables()


@pytest.mark.parametrize("kind", [SPRING, BALL], ids=["spring", "ball"])
def test_an_answer_at_a_seam_is_between_those_of_its_two_sides(
    table: Surrogate, kind: Kind
) -> None:
    for points in doubles_at_every_seam(table, kind, lines=12, samples=400):
        assert points[0].size > 500
        for name, beyond in beyond_both_sides(table, kind, points):
            assert beyond.max() <= 1.0, name


@pytest.mark.parametrize(
    ("v0", "y0"), [(0.055962335412442395, 0.6), (0.014748719910038153, 0.3)], ids=str
)
def test_the_gradient_of_a_ball_is_right_where_a_coordinate_is_folded(
    table: Surrogate, v0: float, y0: float
) -> None:
    steps = 2.0**-8 * np.array([-2.0, -1.0, 1.0, 2.0])
    case: dict[str, Any] = {
        "mu0": 1.0,
        "Fz": 1.0,
        "k": 1.0,
        "omega": 1.0,
        "y0": y0,
        "contact": "ball",
    }
    finest = opened(1e-12).evaluate(**case, v0=v0 * np.exp(steps))
    # v0 d mu_macro / d v0, of the fifth order in the step
    slope = finest.mu_macro @ np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * 2.0**-8)
    near = v0 + np.spacing(v0) * np.arange(-10, 11)
    answer = table.evaluate(**case, v0=near, gradient=True)
    error = np.abs(near * answer.gradient["v0"] - slope)
    assert np.all(error <= near * answer.gradient_bound["v0"] + 2e-9)
