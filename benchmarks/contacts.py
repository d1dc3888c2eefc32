"""Cost of a ball and of oscillation along and normal beside one spring: nanoseconds a point, one
thread, log-uniform points.

python benchmarks/contacts.py
"""

from tests.support.measuring import main, markdown, sections  # isort: split

import functools
import timeit

import numpy as np

from mumacro import Surrogate
from mumacro.inputs.fields import Kind
from mumacro.kernel import threads as slices

TOLERANCES = (1e-4, 1e-7, 1e-10, 1e-12)
KINDS = {"spring": (0, 0), "ball": (1, 0), "along": (0, 1), "normal": (0, 2), "ball along": (1, 1)}


def costs() -> str:
    """Beside one spring, per kind and table: v~ from 1e-6 to 1e4, y~ from 1e-4 to 1e4."""
    rng, rows = np.random.default_rng(1), []
    v, y = 10.0 ** rng.uniform(-6, 4, 20_000), 10.0 ** rng.uniform(-4, 4, 20_000)
    for tolerance in TOLERANCES:
        s = Surrogate.open(tolerance, threads=1)
        spring = 0.0
        for name, kind in KINDS.items():
            amplitude = np.minimum(y, 0.99) if name == "normal" else y
            data = s.tabulated.data("mu_ratio", Kind(*kind))
            ask = functools.partial(slices.values, 0, data, v, amplitude, threads=1, kind=kind)
            each = min(timeit.repeat(ask, number=1, repeat=7)) / v.size
            spring = spring or each
            rows.append((name, f"{tolerance:g}", f"{1e9 * each:.0f}", f"{each / spring:.1f}"))
    return markdown(("contact", "table", "ns", "springs"), rows)


if __name__ == "__main__":
    main(__doc__, sections(costs))
