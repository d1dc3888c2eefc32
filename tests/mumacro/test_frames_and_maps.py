"""What a notebook shows: data frames, and the map by one call."""

import sys
from typing import Any

import numpy as np
import pytest

from mumacro import MumacroError, Surrogate
from tests.support.cases import Case
from tests.support.comparing import close

CASE: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3}
SPEEDS = np.geomspace(1e-3, 1.0, 30)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"gradient": True},
        {"include": "groups"},
        {"contact": "ball"},
        {"k_low": 0.8e6, "k_high": 1.2e6},
        {"v0": 0.01},
        {"v0": SPEEDS.reshape(5, 6)},
        {"v0": np.array([0.01, -1.0])},
    ],
)
def test_a_frame_has_one_row_a_case_with_what_was_requested(
    surrogate: Surrogate, more: Any
) -> None:
    pandas = pytest.importorskip("pandas")
    case = {name: value for name, value in CASE.items() if name != "k" or "k_low" not in more}
    answer = surrogate.evaluate(**{**case, "v0": SPEEDS, **more})
    frame = answer.to_frame()
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == np.size(answer.mu_macro)
    for name in ("mu_macro", "mu_ratio", "regime", "error_bound", "source"):
        np.testing.assert_array_equal(frame[name].to_numpy(), np.ravel(getattr(answer, name)))
    assert ("mu_macro_low" in frame) == ("k_low" in more)
    assert ("gradient.k" in frame) == ("gradient" in more)
    assert list(frame) == answer.paths


def test_the_map_of_a_normal_force_ends_where_it_lifts_off(surrogate: Surrogate) -> None:
    figure = pytest.importorskip("matplotlib.figure").Figure()
    normal = surrogate.plot(figure.add_subplot(), direction="normal")
    v, y = normal.lines[0].get_data()
    assert y[-1] == close(0.999, rel=1e-9)
    assert v.tolist() == close(y.tolist(), rel=1e-15)  # normal: the border is the amplitude itself


def test_without_pandas_a_frame_names_it(
    surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MumacroError, match="pip install pandas"):
        surrogate.evaluate(**CASE, v0=0.01).to_frame()
