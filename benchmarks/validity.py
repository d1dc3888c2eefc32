"""Effects of neglected partial slip; typical contacts on the map.

python benchmarks/validity.py [--write]
"""

from tests.support.measuring import FINEST, IMAGES, main, markdown, quantity, sections

# isort: split

import math
from typing import Any

import numpy as np

from mumacro import Surrogate
from mumacro.plotting import INK, save
from mumacro.stiffness import Material, ball_on_flat, flat_punch

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
        change = np.abs(s.quantity("mu_ratio", v, y, contact="ball")[0] - s.mu_ratio(v, y))
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
    s, rows = Surrogate.open(FINEST), []
    marks: dict[str, list[tuple[float, float]]] = {}
    for name, (force, contact) in CONTACTS.items():
        places = marks.setdefault(name, [])
        for y0, v0 in ((0.1e-6, 0.01), (5e-6, 0.01), (5e-6, 0.5)):
            case: Any = {
                "mu0": 0.3,
                "Fz": force,
                "k": contact.k,
                "y0": y0,
                "omega": 4e4 * math.pi,
                "v0": v0,
            }
            answer = s.evaluate(**case, include=("groups", "settling"))
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
            rows.append([name, *cells, *groups, f"{answer['settling.periods']:.2g}"])

    def draw(axes: Any) -> None:
        s.plot(axes)
        axes.get_legend().remove()
        for (name, places), shape in zip(marks.items(), "osD^", strict=True):
            axes.plot(*zip(*places, strict=True), shape, color=INK, mec="white", ms=9, label=name)
        axes.figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=9)

    save(IMAGES / "contacts.png", draw, dpi=100, figsize=(9.0, 6.0))
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
