"""A friction law as the table of Modelica's SupportFriction, or of BearingFriction with a radius, in straight pieces.

    python examples/modelica_law.py mu0=0.3 Fz=10 k=1e6 y0=2e-6 omega=1.3e5 --within 0.01 [--radius 0.02] [--table ...]

Rows go from v0 = 0, the static limit, to the plateau; between them the simulator interpolates, and the force is within
that share of mu0 Fz of the table's at every speed.
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np
from numpy.typing import NDArray

from mumacro import InputError, Surrogate
from mumacro.command import UsageError, open_table, read_case
from mumacro.inverse import border_crossings, checked_case

Array = NDArray[np.float64]
# the pieces are fitted to so many values; below the first of them mu_macro / mu0 has risen by 1e-6 at the most
SAMPLES, FIRST_SHARE, LEAST_SPEED = 9001, 1e-18, 1e-280


def straight_pieces(surrogate: Surrogate, case: dict[str, float], within: float) -> tuple[Array, Array]:
    """v0 [m/s] and mu_macro [-], both (n,): ``case`` [SI] over v0 in few straight pieces, right to ``within`` mu0.

    The last two rows have one value, so that a simulator that extrapolates through them stays on the plateau: there
    mu_macro is within half of that of mu0, by (2/pi) K(iq) >= 1 - q^2 / 4 with q = y0 omega / v0, eq. (37).
    """
    if not 0.0 < within <= 0.1:
        raise InputError("within", within, "> 0 and <= 0.1")
    known = checked_case(case, "v0")
    if known["y0"] == 0.0 or known["omega"] == 0.0:
        return np.array([0.0, 1.0]), np.full(2, known["mu0"])
    peak = known["y0"] * known["omega"]
    end = peak / math.sqrt(2.0 * within)
    if not (LEAST_SPEED < end < 1.0 / LEAST_SPEED):
        raise InputError("omega", known["omega"], f"such that y0 omega = {peak:.3g} m/s is a speed in double range")
    v0 = np.concatenate(([0.0], np.geomspace(FIRST_SHARE * end, end, SAMPLES)))
    v0 = np.union1d(v0, [c.value for c in border_crossings(surrogate, "v0", known, 0.0, end)])
    mu = surrogate.evaluate({**known, "v0": v0}).mu_macro
    kept, pieces = {0, v0.size - 1}, [(0, v0.size - 1)]
    while pieces:
        first, last = pieces.pop()
        inner = slice(first + 1, last)
        gap = np.abs(mu[inner] - np.interp(v0[inner], v0[[first, last]], mu[[first, last]]))
        if gap.size and gap.max() > 0.5 * within * known["mu0"]:
            worst = first + 1 + int(np.argmax(gap))
            kept.add(worst)
            pieces += [(first, worst), (worst, last)]
    rows = sorted(kept)
    return np.append(v0[rows], 2.0 * end), np.append(mu[rows], mu[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("words", nargs="+", metavar="name=value", help="the five inputs but v0")
    parser.add_argument("--within", type=float, default=1e-3, help="largest error, as a share of mu0 Fz; default: 1e-3")
    parser.add_argument("--radius", type=float, help="print tau_pos of a BearingFriction of that radius [m]")
    parser.add_argument("--table", help="a tolerance or a path; default: the tightest table")
    chosen = parser.parse_args()
    if chosen.radius is not None and not 0.0 < chosen.radius < math.inf:
        parser.error(f"--radius {chosen.radius:g} is no radius [m] > 0")
    try:
        case, surrogate = read_case(chosen.words, "v0"), open_table(chosen.table)
        v0, mu = straight_pieces(surrogate, case, chosen.within)
    except (UsageError, InputError) as error:
        parser.error(str(error))
    radius = chosen.radius or 1.0
    name, heading = ("f_pos", "v [m/s], f [N]") if chosen.radius is None else ("tau_pos", "w [rad/s], tau [N.m]")
    rows = zip((v0 / radius).tolist(), (mu * (case["Fz"] * radius)).tolist(), strict=True)
    sys.stdout.write(
        f"// {' '.join(chosen.words)}; {surrogate.id}; within {chosen.within:g} mu0 Fz at every speed\n"
        f"// {heading}; the first row is the static limit, the last two lie on the plateau\n"
        f"{name} = [\n" + ";\n".join(f"  {x!r}, {y!r}" for x, y in rows) + "]\n"
    )


if __name__ == "__main__":
    main()
