"""Effects of neglected partial slip; typical contacts on the map.

python benchmarks/validity.py [--write]
"""

from __future__ import annotations

from benchmarks.measuring import FINEST, main, markdown, quantity  # isort: split

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mumacro import Surrogate
from mumacro.settling import settling
from mumacro.stiffness import Contact, Material, ball_on_flat, flat_punch

STEEL = Material(E=210e9, nu=0.3)
RANGES = ((0.01, 0.1), (0.1, 0.3), (0.3, 0.67), (0.67, 1.6), (1.6, 5.0), (5.0, 20.0), (20.0, 1000.0))


def partial_slip() -> str:
    """Largest change of mu~ between k and 2/3 k, by amplitude and regime."""
    s = Surrogate.open(FINEST)
    rows = []
    for low, high in RANGES:
        y = np.geomspace(low, high, 121)
        v = np.geomspace(1e-3, 1e3, 561)[:, None]
        change = np.abs(s.ratio_with_bound(v, y, contact="ball")[0] - s.mu_ratio(v, y))
        rows.append([f"{low:g} to {high:g}", quantity(float(change.max()))])
    return markdown(("y~", "largest difference of mu~, ball and one spring"), rows)


def contacts() -> Iterator[tuple[str, Contact, dict[str, Any]]]:
    """Contacts of the usual kind at 20 kHz, with assumed, not published, numbers: name, contact, the six inputs."""
    for name, force, contact in (
        ("steel ball, R = 5 mm", 1.0, ball_on_flat(5e-3, 1.0, STEEL, STEEL)),
        ("steel ball, R = 5 mm", 10.0, ball_on_flat(5e-3, 10.0, STEEL, STEEL)),
        ("steel ball, R = 5 mm", 100.0, ball_on_flat(5e-3, 100.0, STEEL, STEEL)),
        ("steel pin, flat, 1 mm radius", 100.0, flat_punch(1e-3, 100.0, STEEL, STEEL)),
    ):
        for y0, v0 in ((0.1e-6, 0.01), (5e-6, 0.01), (5e-6, 0.5)):
            omega = 2.0 * math.pi * 20e3
            yield name, contact, {"mu0": 0.3, "Fz": force, "k": contact.k, "y0": y0, "omega": omega, "v0": v0}


def rigs() -> str:
    """The positions of these contacts on the map."""
    s = Surrogate.open(FINEST)
    rows = []
    for name, contact, case in contacts():
        force, y0, v0 = case["Fz"], case["y0"], case["v0"]
        answer = s.evaluate(**case)
        found = settling(s, **case)
        l0 = contact.length_scale(case["mu0"], force)
        cells = [f"{contact.k:.2g}", f"{1e6 * l0:.3g}", f"{1e6 * y0:g}", f"{v0:g}"]
        groups = [f"{answer.v_tilde:.2g}", f"{answer.y_tilde:.2g}", f"{answer.mu_ratio:.3f}", answer.regime]
        rows.append([name, f"{force:g}", *cells, *groups, f"{found.periods:.2g}"])
    header = (
        "contact", "Fz [N]", "k [N/m]", "l0 [um]", "y0 [um]", "v0 [m/s]", "v~", "y~", "mu~", "regime", "periods to 1 %",
    )  # fmt: skip
    return markdown(header, rows)


SECTIONS: dict[str, Callable[[], str]] = {
    "partial_slip": partial_slip,
    "rigs": rigs,
}

if __name__ == "__main__":
    main(__doc__, SECTIONS)
