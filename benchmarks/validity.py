"""Effects of neglected partial slip; typical contacts on the map.

python benchmarks/validity.py [--write]
"""

from benchmarks.measuring import FINEST, IMAGES, main, markdown, quantity, sections  # isort: split

import math
from typing import Any

import numpy as np

from mumacro import Surrogate
from mumacro.analysis.settling import settling
from mumacro.contacts.stiffness import Material, ball_on_flat, flat_punch

STEEL = Material(E=210e9, nu=0.3)
RANGES = (
    (0.01, 0.1),
    (0.1, 0.3),
    (0.3, 0.67),
    (0.67, 1.6),
    (1.6, 5.0),
    (5.0, 20.0),
    (20.0, 1000.0),
)


def partial_slip() -> str:
    """Largest difference of mu~ between a ball and one spring, by amplitude."""
    s = Surrogate.open(FINEST)
    rows = []
    for low, high in RANGES:
        y = np.geomspace(low, high, 121)
        v = np.geomspace(1e-3, 1e3, 561)[:, None]
        change = np.abs(s.ratio_with_bound(v, y, contact="ball")[0] - s.mu_ratio(v, y))
        rows.append([f"{low:g} to {high:g}", quantity(float(change.max()))])
    return markdown(("y~", "largest difference of mu~, ball and one spring"), rows)


CONTACTS = {
    **{
        f"steel ball, R = 5 mm, {force} N": (force, ball_on_flat(5e-3, force, STEEL, STEEL))
        for force in (1, 10, 100)
    },
    "steel pin, flat, 1 mm radius, 100 N": (100, flat_punch(1e-3, 100, STEEL, STEEL)),
}


def rigs() -> str:
    """The positions on the map of usual contacts at 20 kHz, with assumed, not published, numbers;
    and the picture."""
    from matplotlib.figure import Figure

    s, rows = Surrogate.open(FINEST), []
    v, y = np.geomspace(0.02, 200.0, 241), np.geomspace(0.05, 200.0, 241)
    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log", xlim=(v[0], v[-1]), ylim=(y[0], y[-1]))
    axes.set(
        xlabel=r"$\tilde v = v_0 k/(\mu_0 F_z \omega)$", ylabel=r"$\tilde y = y_0 k/(\mu_0 F_z)$"
    )
    levels = (0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)
    lines = axes.contour(
        v, y, s.mu_ratio(v, y[:, None]), levels=levels, colors="#8c959f", linewidths=0.8
    )
    axes.clabel(lines, fmt="%g", fontsize=9)
    axes.plot(s.v_tilde_crit(y), y, color="#c1272d", lw=2.4, label="border of continuous sliding")
    for (name, (force, contact)), shape in zip(CONTACTS.items(), "osD^", strict=True):
        places = []
        for y0, v0 in ((0.1e-6, 0.01), (5e-6, 0.01), (5e-6, 0.5)):
            case: Any = {
                "mu0": 0.3,
                "Fz": force,
                "k": contact.k,
                "y0": y0,
                "omega": 4e4 * math.pi,
                "v0": v0,
            }
            answer, found = s.evaluate(**case), settling(s, **case)
            places.append((answer.v_tilde, answer.y_tilde))
            cells = [
                f"{contact.k:.2g}",
                f"{1e6 * contact.length_scale(0.3, force):.3g}",
                f"{1e6 * y0:g}",
                f"{v0:g}",
            ]
            groups = [
                f"{answer.v_tilde:.2g}",
                f"{answer.y_tilde:.2g}",
                f"{answer.mu_ratio:.3f}",
                answer.regime,
            ]
            rows.append([name, *cells, *groups, f"{found.periods:.2g}"])
        axes.plot(*zip(*places, strict=True), shape, color="#1f6fb4", ms=8, label=name)
    axes.legend(loc="lower right", fontsize=9)
    figure.savefig(IMAGES / "contacts.png", dpi=100, metadata={"Software": None})
    header = (
        "contact",
        "k [N/m]",
        "l0 [um]",
        "y0 [um]",
        "v0 [m/s]",
        "v~",
        "y~",
        "mu~",
        "regime",
        "periods to 1 %",
    )
    return markdown(header, rows)


SECTIONS = sections(partial_slip, rigs)

if __name__ == "__main__":
    main(__doc__, SECTIONS)
