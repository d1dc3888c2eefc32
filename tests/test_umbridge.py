"""The example server for UM-Bridge, asked by the client of the package."""

from typing import Any

import pytest

from mumacro import Surrogate
from mumacro.inputs import FIELDS
from tests.comparing import close

umbridge = pytest.importorskip("umbridge", reason="the PyPI package umbridge is not installed")

POINT = [0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01]


@pytest.fixture(scope="module")
def model(bridge: Any) -> Any:
    return umbridge.HTTPModel(bridge, "mu_macro")


def test_values_and_slopes_are_those_of_the_library(model: Any) -> None:
    expected = Surrogate.open().evaluate(dict(zip(FIELDS, POINT, strict=True)), gradient=True)
    assert (model.get_input_sizes(), model.get_output_sizes()) == ([6], [1])
    assert model([POINT])[0] == close([expected.mu_macro], rel=1e-13)
    slopes = [expected.gradient[name] for name in FIELDS]
    assert model.gradient(0, 0, [POINT], [2.0]) == close([2.0 * slope for slope in slopes], rel=1e-13)
    assert model.apply_jacobian(0, 0, [POINT], [0.0, 0.0, 0.0, 0.0, 0.0, 3.0]) == close([3.0 * slopes[5]], rel=1e-13)


def test_an_illegal_value_is_an_error_and_the_server_lives_on(model: Any) -> None:
    with pytest.raises(Exception, match=r"."):
        model([[-0.3, *POINT[1:]]])
    assert model([POINT])[0][0] > 0.0
