"""The one fitted number of the closed forms: the parameter of the border's blend.

    python benchmarks/approximations.py

``python benchmarks/validation.py`` has the errors of all formulas.
"""

from benchmarks.measuring import FINEST, main  # isort: split

import numpy as np
from scipy.optimize import minimize_scalar

from mumacro import Surrogate, closed_forms


def blend() -> str:
    """The parameter with the smallest largest relative error over y~ from 1e-4 to 1e8, and that error."""
    y = np.geomspace(1e-4, 1e8, 4001)
    exact = Surrogate.open(FINEST).v_tilde_crit(y)
    c = (closed_forms.BORDER_CONSTANT / 4.0) ** (2.0 / 3.0)

    def worst(d: float) -> float:
        w = y * y
        formula = 0.5 * w * ((1.0 + (5.0 / 9.0 + d) * w + c * d * w * w) / (1.0 + d * w)) ** -0.75
        return float(np.abs(formula / exact - 1.0).max())

    found = minimize_scalar(worst, bounds=(0.05, 5.0), method="bounded")
    return f"The blend is best with d = {found.x:.4f}: {found.fun:.2%} off at the most."


if __name__ == "__main__":
    main(__doc__, {"approximations": blend})
