"""What the interactive page is told: the inputs, the geometries of a contact, and the map of mu~
over (v~, y~).

The service serves it; the page itself is in ``service/static/page``.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from mumacro.contacts.geometries import ARGUMENTS, BODIES, GEOMETRIES
from mumacro.inputs.fields import BOUNDS, LIKE, POSITIVE, RAD_PER_CYCLE, unit_of
from mumacro.inputs.kind import AMPLITUDE
from mumacro.inputs.units import UNITS_OF, Scale
from mumacro.surrogate import Surrogate

#: the content security policy of the page: no inline script, no inline style, nothing from another
#: host
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src "
    "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

# label, symbol, offered units, decimal exponents of the slider [SI], start value
_INPUTS = {
    "mu0": ("friction µ₀", "µ₀", ["-"], [-2, 0.5], "0.3 -"),
    "Fz": ("force Fz", "Fz", ["N", "mN", "kN"], [-3, 5], "10 N"),
    "k": ("stiffness k", "k", ["N/µm", "kN/m", "N/m"], [2, 10], "1 N/µm"),
    "y0": ("amplitude y₀", "y₀", ["µm", "nm", "mm", "m"], [-10, -3], "2 µm"),
    AMPLITUDE: ("force ΔFz", "ΔFz", ["N", "mN", "kN"], [-3, 5], "5 N"),
    "omega": ("frequency", "ω", ["kHz", "Hz", "rad/s"], [0, 7], "20 kHz"),
    "v0": ("speed v₀", "v₀", ["mm/s", "µm/s", "m/s"], [-7, 2], "10 mm/s"),
}
# what may be chosen, with its part of the model line; the first is the usual one
_CHOICES = {
    "contact": {
        "spring": "one spring of stiffness k",
        "ball": "a ball (Hertz) with the initial stiffness k",
    },
    "direction": {
        "across": "oscillation across the sliding direction",
        "along": "oscillation along the sliding direction",
        "normal": "an oscillating normal force",
    },
}
# The range of the map [-]: from deep in creep to fast sliding, twenty points per decade.
_PER_DECADE = 20
_V_DECADES, _Y_DECADES = (-4, 3), (-2, 3)
_UNIT = 1e-4  # of the map's integers: a shade of colour is a hundred times coarser


def names(guide: bool) -> dict[str, Any]:
    """``names.json``: inputs, choices, geometries with arguments, and whether a ``guide`` is
    served."""
    inputs: dict[str, dict[str, Any]] = {
        name: {
            "label": label,
            "symbol": symbol,
            "offered": offered,
            "range": slider,
            "start": start,
            "unit": unit_of(name),
            "units": _scales(UNITS_OF[LIKE.get(name, name)]),
            "bound": BOUNDS[name],
            "positive": name in POSITIVE,
        }
        for name, (label, symbol, offered, slider, start) in _INPUTS.items()
    }
    # a frequency f stands for omega = 2 pi f; a unit of both (1/s) says neither
    angular = inputs["omega"]["units"]
    for unit, (times, over) in UNITS_OF["f"].items():
        angular[unit] = None if unit in angular else [RAD_PER_CYCLE * times, over]
    geometries = {
        name: {"meaning": one.meaning, "arguments": [*one.arguments, *BODIES]}
        for name, one in GEOMETRIES.items()
    }
    arguments = {
        name: {**one._asdict(), "units": _scales(one.units)} for name, one in ARGUMENTS.items()
    }
    return {
        "inputs": inputs,
        "choices": _CHOICES,
        "geometries": geometries,
        "arguments": arguments,
        "guide": guide,
    }


def map_of(surrogate: Surrogate) -> dict[str, Any]:
    """``map.json``: mu~ on a grid in whole numbers, rows of constant y~ from below, and the
    border."""
    axes = {}
    for name, (low, high) in {"v_tilde": _V_DECADES, "y_tilde": _Y_DECADES}.items():
        axes[name] = {"start": 10.0**low, "stop": 10.0**high, "n": _PER_DECADE * (high - low) + 1}
    v, y = (np.geomspace(axis["start"], axis["stop"], int(axis["n"])) for axis in axes.values())
    ratio = surrogate.mu_ratio(v[None, :], y[:, None])
    amplitudes = np.geomspace(y[0], y[-1], 4 * y.size)
    rounded = np.rint(ratio / _UNIT).astype(int).ravel().tolist()
    border = np.column_stack((surrogate.v_tilde_crit(amplitudes), amplitudes)).tolist()
    border = [[float(f"{x:.6g}") for x in place] for place in border]
    return {**axes, "unit": _UNIT, "mu_ratio": rounded, "border": border}


def _scales(units: Mapping[str, Scale]) -> dict[str, list[float]]:
    """The factor and the divisor of each unit."""
    return {unit: [scale.times, scale.over] for unit, scale in units.items()}
