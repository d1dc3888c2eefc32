"""The numbers of docs/model.md: how fast each chart converges, and how far each limit holds.

    python benchmarks/model_facts.py [--write]

``--write`` replaces the sections between the markers of the page.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
import math
from collections.abc import Callable

import numpy as np
from measuring import ROOT, markdown, progress, quantity
from numpy.typing import NDArray

from builder.blocks import points_of, quantity_of
from builder.steady import border, solve
from builder.sweep import Sweep
from friction import Surrogate, tails
from friction.patches import chebyshev_coefficients, interpolation_matrix, nodes
from friction.regions import BLOCKS, CONTINUOUS, SOURCES, BlockSpec

Array = NDArray[np.float64]
PAGE = ROOT / "docs" / "model.md"
SIZES = (8, 16, 24, 32, 48)
POINTS = 1000


def g(x: float) -> str:
    """Two significant digits."""
    return quantity(float(x), 2)


def _block_error(spec: BlockSpec, n: int, s: Surrogate, sweep: Sweep) -> float:
    """Largest error of the n x n interpolant of what the block tabulates, on random points of its rectangle."""
    kind = "continuous" if spec.regime == CONTINUOUS else "full"

    def tabulated(a: Array, b: Array) -> Array:
        p = points_of(spec, a, b, s.border)
        solved = sweep.solve(kind, p.v, p.y, p.eta)
        return quantity_of(spec, p, solved["mu_ratio"], solved["deficit"])

    rng = np.random.default_rng(3)
    a, b = (rng.uniform(low + 1e-3 * (high - low), high, POINTS) for low, high in (spec.a, spec.b))
    b = np.minimum(b, spec.b[1] - 1e-3 * (spec.b[1] - spec.b[0]))
    grid = nodes(n, *spec.a), nodes(n, *spec.b)
    c = chebyshev_coefficients(tabulated(grid[0][:, None], grid[1][None, :]))
    left, right = (
        interpolation_matrix(n, (2.0 * x - low - high) / (high - low)) for x, (low, high) in ((a, spec.a), (b, spec.b))
    )
    return float(np.abs(np.einsum("pi,ij,pj->p", left, c, right) - tabulated(a, b)).max())


def blocks() -> str:
    """Error of every block's interpolant by the number of nodes."""
    s = Surrogate.open(ROOT / "tables" / "mumacro-1e-12.nc")
    rows = []
    with Sweep(1) as sweep:
        for spec in BLOCKS:
            progress(spec.name)
            rows.append([spec.name, *(g(_block_error(spec, n, s, sweep)) for n in SIZES)])
    return markdown(("block", *(f"{n} x {n}" for n in SIZES)), rows)


def limits() -> str:
    """The border against its limits."""
    rows = []
    for y in (1e-3, 1e-2, 0.1, 0.3, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5):
        crit, mu = border(y)
        small = abs(float(tails.border_small_amplitude(y)) / crit - 1.0)
        large = abs(float(tails.border_large_amplitude(y)) / crit - 1.0)
        ends = [g(x) if x < 0.5 else "-" for x in (small, large)]
        rows.append([f"{y:g}", f"{crit:.9e}", f"{mu:.9f}", *ends, f"{y / crit**2:.6f}" if y >= 1.0 else "-"])
    header = ("y~", "v~crit", "mu~ there", "rel error, small y~", "rel error, large y~", "y~/v~crit^2")
    return markdown(header, rows, 0)


def outer() -> str:
    """Eq. (35) alone, with the second term, and resummed, at large v~."""
    s = Surrogate.open(ROOT / "tables" / "mumacro-1e-12.nc")
    rows = []
    for v, y in ((100.0, 0.1), (100.0, 2.0), (100.0, 3.0), (1000.0, 30.0), (1000.0, 300.0), (1e4, 1e4), (1e5, 1e6)):
        mu = solve(v, y).mu_ratio
        first = float(tails.outer(y / v))
        both = first + float(tails.second_order(y / v)) / (v * v)
        here, _, source = s.ratio_with_bound(np.array([v]), np.array([y]))
        cells = [f"{v:g}", f"{y:g}", SOURCES[int(source[0])]]
        rows.append([*cells, *(g(abs(x - mu)) for x in (first, both, float(here[0])))])
    header = ("v~", "y~", "who answers", "eq. (35)", "with the second term", "the answer")
    return f"Absolute errors against the solver:\n\n{markdown(header, rows, 3)}"


def layer() -> str:
    """What is left beyond the outer solution at large y~, and how it depends on 1/y~."""
    rows = []
    for kappa in (0.1, 0.3, 0.47, 1.0, 3.0, 10.0):
        found = []
        for y in (1e4, 1e5, 2e5, 4e5, 1e14):
            v = kappa * math.sqrt(y)
            found.append((solve(v, y).mu_ratio - float(tails.outer(y / v))) * y / v)
        end = found[-1]
        slopes = [(t - end) * y for t, y in zip(found, (1e4, 1e5, 2e5), strict=False)]
        # a line through 1/y~ = 0 and 1e-5, at half and a quarter of the way
        off = max(abs(found[i] - end - (found[1] - end) * share) for i, share in ((2, 0.5), (3, 0.25)))
        rows.append([f"{kappa:g}", f"{end:.9f}", *(f"{x:.4g}" for x in slopes[:2]), g(off)])
    header = ("v~/sqrt(y~)", "T at y~ = 1e14", "(T - that) y~ at 1e4", "at 1e5", "off the line, y~ >= 1e5")
    return markdown(header, rows, 0)


def corner() -> str:
    """The corrections to the normal form, in polar coordinates."""
    rows = []
    for psi in (0.1, 0.3, 0.5, 0.7, 0.9):
        cells = []
        for radius in (0.3, 0.1, 0.03):
            phi = radius * math.sin(0.5 * math.pi * psi) / math.sqrt(2.0)
            s0 = math.sqrt(2.0) * radius * math.cos(0.5 * math.pi * psi)
            eta = 0.25 * s0 * s0 - 0.5 * phi * phi
            mu = solve(phi * s0 * s0 / (2.0 * math.pi), 1.0 + eta, eta).mu_ratio
            cells.append(f"{(mu / phi - 1.0) / radius**2:.4f}")
        rows.append([f"{psi:g}", *cells])
    return markdown(("2 psi/pi", "(mu~/phi - 1)/R^2 at R = 0.3", "0.1", "0.03"), rows, 0)


CASES: dict[str, Callable[[], str]] = {
    "blocks": blocks,
    "limits": limits,
    "outer": outer,
    "layer": layer,
    "corner": corner,
}


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=list(CASES), help="one section")
    parser.add_argument("--write", action="store_true", help="put the numbers into docs/model.md")
    given = parser.parse_args()
    progress(measuring.machine())
    for name, case in CASES.items():
        if given.only in (None, name):
            text = case()
            print(f"## {name}\n\n{text}\n", flush=True)
            if given.write:
                measuring.write_section(name, text, PAGE)


if __name__ == "__main__":
    main()
