"""Time of mumacro.fit for 30 points, after its import: python benchmarks/fitting.py"""

from __future__ import annotations

import measuring

# isort: split

import time
import warnings

import numpy as np

import mumacro
from mumacro.contact import CONTACTS


def best(data: dict[str, np.ndarray], unknowns: tuple[str, ...], contact: str, **known: float) -> float:
    """The shortest of 20 fits [ms]."""
    times = []
    for _ in range(20):
        start = time.perf_counter()
        mumacro.fit(data, unknowns, contact=contact, **known)
        times.append(1e3 * (time.perf_counter() - start))
    return min(times)


def main() -> None:
    """One row for each contact."""
    s, rig = mumacro.open(), {"Fz": 10.0, "y0": 2e-6, "f": 20e3}
    v0 = np.geomspace(1e-3, 1.0, 30)
    rows = []
    for contact in CONTACTS:
        mu = np.asarray(s.evaluate(mu0=0.3, k=1e6, v0=v0, **rig, contact=contact).mu_macro)
        data = {"v0": v0, "mu_macro": mu + np.random.default_rng(0).normal(scale=1e-3, size=30)}
        cells = [best(data, ("k", "mu0"), contact, **rig), best(data, ("k",), contact, mu0=0.3, **rig)]
        rows.append([contact, *(f"{cell:.1f}" for cell in cells)])
    print(measuring.markdown(("contact", "k and mu0 [ms]", "k alone [ms]"), rows))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
