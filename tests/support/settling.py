"""What the output ``settling`` has, for any share of a disturbance that is left."""

from typing import Any, NamedTuple

import numpy as np

from mumacro import Surrogate
from mumacro.inputs.cases import Cases, named
from mumacro.outputs.evaluated import Evaluated
from mumacro.outputs.settling import REMAINING, decay


class Decay(NamedTuple):
    """How fast a disturbance decays, in the shape of the cases."""

    periods: Any
    periods_any: Any
    time: Any
    slip_path: Any
    error_bound: Any


@np.errstate(all="ignore")
def settling(surrogate: Surrogate, remaining: float = REMAINING, **inputs: Any) -> Decay:
    """Return the periods until a disturbance has decayed to ``remaining`` of its size."""
    cases = Cases.of(named(None, inputs))
    values = decay(Evaluated(surrogate.tabulated, cases, "groups"), remaining)
    return Decay(*(x.reshape(cases.shape) if cases.shape else x for x in values))
