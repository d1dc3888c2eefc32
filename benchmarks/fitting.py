"""Time of mumacro.fit for 30 points, after its import: python benchmarks/fitting.py"""

from __future__ import annotations

from benchmarks.measuring import main, markdown  # isort: split

import time
import warnings
from typing import Any

import numpy as np

import mumacro
from mumacro.contact import CONTACTS


def best(data: dict[str, Any], unknowns: tuple[str, ...], **known: Any) -> float:
    """The shortest of 20 fits [ms]."""
    times = []
    for _ in range(20):
        start = time.perf_counter()
        mumacro.fit(data, unknowns, **known)
        times.append(1e3 * (time.perf_counter() - start))
    return min(times)


def fitting() -> str:
    """One row for each contact."""
    warnings.simplefilter("ignore")
    s = mumacro.open()
    rig: dict[str, Any] = {"Fz": 10.0, "y0": 2e-6, "f": 20e3}
    v0 = np.geomspace(1e-3, 1.0, 30)
    rows = []
    for contact in CONTACTS:
        mu = np.asarray(s.evaluate(mu0=0.3, k=1e6, v0=v0, **rig, contact=contact).mu_macro)
        data = {"v0": v0, "mu_macro": mu + np.random.default_rng(0).normal(scale=1e-3, size=30)}
        given = {**rig, "contact": contact}
        cells = [best(data, ("k", "mu0"), **given), best(data, ("k",), mu0=0.3, **given)]
        rows.append([contact, *(f"{cell:.1f}" for cell in cells)])
    return markdown(("contact", "k and mu0 [ms]", "k alone [ms]"), rows)


if __name__ == "__main__":
    main(__doc__, {"fitting": fitting})
