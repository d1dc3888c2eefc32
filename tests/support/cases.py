"""What tests of the library share: ordinary inputs, the committed tables, contacts with directions,
random numbers."""

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mumacro import Surrogate
from mumacro.inputs.fields import kind_of

Array = NDArray[np.float64]
Case = dict[str, Any]  # inputs by name
Capture = pytest.CaptureFixture[str]
CASE: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
# v~ = v0 and y~ = y0, to the last digit
UNIT: Case = {"mu0": 0.5, "Fz": 2.0, "k": 1.0, "omega": 1.0}
TOLERANCES = (1e-4, 1e-7, 1e-10, 1e-12)
#: every contact with every direction that it has
PAIRS = [
    ("spring", "across"),
    ("ball", "across"),
    ("spring", "along"),
    ("ball", "along"),
    ("spring", "normal"),
]
every_pair = pytest.mark.parametrize("pair", PAIRS, ids=" ".join)
opened = functools.cache(Surrogate.open)


def tables(*tolerances: float) -> Any:
    """A fixture: the committed tables of these tolerances, all of them if none is named, one after
    the other."""

    @pytest.fixture(scope="module", params=tolerances or TOLERANCES, ids=str)
    def table(request: pytest.FixtureRequest) -> Surrogate:
        return opened(request.param)

    return table


def without(case: Mapping[str, Any], *names: str) -> Case:
    """A case without some of its inputs."""
    return {name: value for name, value in case.items() if name not in names}


def flat(std: Mapping[str, Any]) -> Case:
    """Deviations by input as keywords: ``std_k`` and so on."""
    return {f"std_{name}": x for name, x in std.items()}


def as_kind(
    case: Mapping[str, Any], pair: tuple[str, str], share: float = 0.4
) -> tuple[Mapping[str, Any], Any, Case]:
    """The keywords of a pair, its fields, and ``case`` with Fz_amplitude = ``share`` Fz where the
    pair has it."""
    kind = kind_of(*pair)
    amplitude = {"Fz_amplitude": share * case["Fz"]} if kind.normal else {"y0": case["y0"]}
    return kind.names, kind.fields, {**without(case, "y0"), **amplitude}


def log_uniform(rng: np.random.Generator, low: float, high: float, n: int) -> Array:
    """Random numbers (n,) whose logarithms are uniform."""
    return 10.0 ** rng.uniform(np.log10(low), np.log10(high), n)
