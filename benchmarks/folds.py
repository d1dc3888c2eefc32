"""Where mu_macro folds as a function of k, Fz or mu0:  python benchmarks/folds.py [TABLE]

With r = y0 omega / v0 constant, y~ = r v~ grows with k and with 1/Fz and 1/mu0.  Prints the r at which the fold
first appears, the positions of minimum and maximum for larger r, whether mu0 folds (mu~ steeper in y~ than y~ itself),
and the y~ where such a ray is farthest inside stick-slip.
"""

import sys
from pathlib import Path

import numpy as np

from mumacro import Surrogate

TABLE = Path(__file__).resolve().parent.parent / "tables" / "mumacro-1e-12.nc"
y = np.geomspace(1e-6, 1e18, 240_001)


def turning_points(surrogate: Surrogate, r: float) -> list[tuple[float, float]]:
    """(y~, mu~) of the minima and maxima, where the slope along y~ changes its sign by more than rounding."""
    mu = surrogate.mu_ratio(y / r, y)
    slope = np.diff(np.log(mu))
    slope[np.abs(slope) < 1e-12] = -1e-300
    (at,) = np.nonzero(np.sign(slope[1:]) != np.sign(slope[:-1]))
    return [(float(y[i + 1]), float(mu[i + 1])) for i in at]


def main() -> None:
    """Print the figures."""
    surrogate = Surrogate.open(sys.argv[1] if len(sys.argv) > 1 else TABLE)
    low, high = 5.0, 20.0
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if turning_points(surrogate, middle) else (middle, high)
    print(f"the fold first appears at r = {high:.4f}\n")
    print("| r | minimum at y~ | mu~ | maximum at y~ | mu~ | y~ / r^2 | largest d ln mu~ / d ln y~ |")
    print("|---|---|---|---|---|---|---|")
    for r in (9.75, 10.0, 30.0, 100.0, 1e3, 1e4, 1e6, 1e8):
        points = turning_points(surrogate, r)
        mu = surrogate.mu_ratio(y / r, y)
        steepest = float(np.max(np.diff(np.log(mu)) / np.diff(np.log(y))))
        cells = [f"{y_at:.3g} | {mu_at:.4g}" for y_at, mu_at in points]
        print(f"| {r:g} | {' | '.join(cells)} | {points[-1][0] / r**2:.3f} | {steepest:.3f} |")
    print("\nmu0 folds only where the last column exceeds 1")
    near = np.geomspace(1.28, 1.30, 2001)
    step = 1e-3
    slope = np.log(surrogate.v_tilde_crit(near * (1 + step)) / surrogate.v_tilde_crit(near / (1 + step)))
    closest = near[int(np.argmin(np.abs(slope / (2 * np.log1p(step)) - 1.0)))]
    print(f"v~/v~crit is smallest on a ray at y~ = {closest:.4f}")


if __name__ == "__main__":
    main()
