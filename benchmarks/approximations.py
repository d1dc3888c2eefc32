"""Accuracy of the closed forms in a response of ``/v1/law``:  python benchmarks/approximations.py [TABLE]

Prints the largest relative error of the formulas for the border, with the best parameter of the blend, and the
largest error of each approximation of mu_macro/mu0 over its range.
"""

from __future__ import annotations

import sys

from measuring import ROOT, markdown, quantity  # isort: skip

import numpy as np
from scipy.optimize import minimize_scalar

from mumacro import Surrogate, closed_forms
from mumacro.law import APPROXIMATIONS, BORDERS, approximations, border_speeds, friction_law

TABLE = ROOT / "tables" / "mumacro-1e-12.nc"
RANGES = ((1e-4, 0.1), (0.1, 0.3), (0.3, 1.0), (1.0, 10.0), (10.0, 1e3), (1e3, 1e6))


def border(surrogate: Surrogate) -> str:
    """Largest relative errors of the border's formulas, by range of y~, each within its range in a law."""
    names = [name for name in BORDERS if name != "exact"]
    rows = []
    for low, high in (*RANGES, (1e-4, 1e6)):
        y = np.geomspace(low, high, 2001)
        case: dict[str, float | None] = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0, "v0": 1.0}
        found = border_speeds(surrogate, friction_law(surrogate, "y0", y, case))
        miss = [np.abs(found[name] / found["exact"] - 1.0) for name in names]
        cells = ["-" if np.isnan(x).all() else quantity(float(np.nanmax(x))) for x in miss]
        rows.append([f"{low:g} to {high:g}", *cells])
    return markdown(["y~", *names], rows)


def best_blend(surrogate: Surrogate) -> tuple[float, float]:
    """The parameter of the blend with the smallest largest relative error, and that error."""
    y = np.geomspace(1e-4, 1e8, 4001)
    exact = surrogate.v_tilde_crit(y)
    c = (closed_forms.BORDER_CONSTANT / 4.0) ** (2.0 / 3.0)

    def worst(d: float) -> float:
        w = y * y
        blend = 0.5 * w * ((1.0 + (5.0 / 9.0 + d) * w + c * d * w * w) / (1.0 + d * w)) ** -0.75
        return float(np.abs(blend / exact - 1.0).max())

    found = minimize_scalar(worst, bounds=(0.05, 5.0), method="bounded")
    return float(found.x), float(found.fun)


def ratios(surrogate: Surrogate) -> str:
    """Absolute errors of mu_macro/mu0 by regime, and the positions of the large ones."""
    v = np.geomspace(1e-6, 1e3, 181)
    worst: dict[tuple[str, str], tuple[float, float, float]] = {}
    for y in np.geomspace(1e-2, 1e3, 101).tolist():
        case: dict[str, float | None] = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "y0": y, "omega": 1.0}
        law = friction_law(surrogate, "v0", v, case)
        for name, column in approximations(surrogate, law).items():
            for regime in ("continuous", "stick_slip"):
                miss = np.abs(column - law.answer.mu_macro)
                miss[(law.answer.regime != regime) | np.isnan(miss)] = -1.0
                i = int(np.argmax(miss))
                if miss[i] >= 0.0 and miss[i] > worst.get((name, regime), (-1.0, 0.0, 0.0))[0]:
                    worst[name, regime] = (float(miss[i]), float(v[i]), y)
    rows = []
    for name in APPROXIMATIONS:
        cells = [name]
        for regime in ("continuous", "stick_slip"):
            found = worst.get((name, regime))
            cells += ["-", "-"] if found is None else [quantity(found[0]), f"{found[1]:.2g}, {found[2]:.2g}"]
        rows.append(cells)
    return markdown(["approximation", "continuous, off by", "at v~, y~", "stick-slip, off by", "at v~, y~"], rows)


def main() -> None:
    """Print the figures."""
    surrogate = Surrogate.open(sys.argv[1] if len(sys.argv) > 1 else TABLE)
    print("Largest relative error of v~crit:\n")
    print(border(surrogate))
    print("\nThe blend is best with d = {:.4f}: {:.2%} off at the most\n".format(*best_blend(surrogate)))
    print("Largest error of mu_macro/mu0, where given, over v~ from 1e-6 to 1e3 and y~ from 0.01 to 1000:\n")
    print(ratios(surrogate))


if __name__ == "__main__":
    main()
