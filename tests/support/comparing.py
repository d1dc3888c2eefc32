"""Comparison of numbers within stated tolerances only."""

from typing import Any

import pytest


# the names of pytest
def close(expected: Any, *, rel: float = 0.0, abs: float = 0.0) -> Any:  # noqa: A002
    """``pytest.approx`` with no tolerance but the stated ones; given ``rel`` alone, pytest adds
    abs=1e-12."""
    assert rel > 0.0 or abs > 0.0, "state a tolerance"
    return pytest.approx(expected, rel=rel, abs=abs)


def title_of(axes: Any) -> str:
    """Return the title of axes, with plain spaces: lines are broken only between its parts."""
    return str(axes.get_title(loc="left").replace("\N{NO-BREAK SPACE}", " "))
