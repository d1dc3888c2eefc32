"""What the interactive page is told: the inputs, the contacts and directions, the geometries of a
contact, an example of measured points, and the map of mu~ over (v~, y~) of each kind of contact.

The service serves it; the page itself is in ``service/static/page``.
"""

from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from mumacro import plotting
from mumacro.contacts.geometries import ARGUMENTS, BODIES, GEOMETRIES
from mumacro.errors import InputError
from mumacro.inputs.fields import BOUNDS, LIKE, POSITIVE, QUANTITY_OF, RAD_PER_CYCLE, unit_of
from mumacro.inputs.kind import AMPLITUDE, CONTACTS, DIRECTIONS, SPRINGS_OF, kind_of
from mumacro.inputs.units import QUANTITIES, UNITS_OF, Scale
from mumacro.surrogate import Surrogate

from . import __version__

#: the content security policy of the page: no inline script, no inline style, nothing from another
#: host
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src "
    "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

_HALF = "half of peak to peak"
# label, symbol, offered units, decimal exponents of the slider [SI], start value, a note
_INPUTS = {
    "mu0": ("friction µ₀", "µ₀", ["-"], [-2, 0.5], "0.3 -", ""),
    "Fz": ("force Fz", "Fz", ["N", "mN", "kN"], [-3, 5], "10 N", ""),
    "k": ("stiffness k", "k", ["N/µm", "kN/m", "N/m"], [2, 10], "1 N/µm", ""),
    "y0": ("amplitude y₀", "y₀", ["µm", "nm", "mm", "m"], [-10, -3], "2 µm", _HALF),
    AMPLITUDE: ("amplitude ΔFz", "ΔFz", ["N", "mN", "kN"], [-3, 5], "5 N", _HALF),
    "omega": ("frequency f", "ω", ["kHz", "Hz", "rad/s"], [0, 7], "20 kHz", ""),
    "v0": ("speed v₀", "v₀", ["mm/s", "µm/s", "m/s"], [-7, 2], "10 mm/s", ""),
}
# what may be chosen, with its part of the model line; the first is the usual one
_CHOICES = {
    "contact": {name: springs.meaning for name, springs in SPRINGS_OF.items()},
    "direction": {
        "across": "oscillation across the sliding direction",
        "along": "oscillation along the sliding direction",
        "normal": "an oscillating normal force",
    },
}
# published points of steel on steel, docs/how-to/fit.md: the case as an address, the columns
_EXAMPLE = {
    "label": "steel on steel, shaken along at 26 kHz (published)",
    "case": "mu0=0.3&Fz=10.79N&k=10N/um&y0=0.35um&f=26kHz&v0=0.2mm/s&contact=ball&direction=along",
    "points": "v0 [mm/s]\tmu0\tmu_macro\n0.05\t0.3031\t0.04662\n0.1\t0.2994\t0.04374\n"
    "0.2\t0.2836\t0.03957\n0.5\t0.2716\t0.03068\n1\t0.2651\t0.02753",
}
_WIDTH, _HEIGHT = 141, 101  # of the map's grid: twenty points a decade
_UNIT = 1e-4  # of the map's integers: a shade of colour is a hundred times coarser


def _impossible(contact: str, direction: str) -> str:
    """Why a contact has no such direction; empty where it has."""
    try:
        kind_of(contact, direction)
    except InputError:
        return "A ball under an oscillating force is not modelled: its contact radius would change."
    return ""


def names(guide: bool) -> dict[str, Any]:
    """``names.json``: inputs, choices, geometries with arguments, an example of measured points,
    the version, and whether a ``guide`` is served."""
    inputs: dict[str, dict[str, Any]] = {
        name: {
            "label": label,
            "symbol": symbol,
            "offered": offered,
            "range": slider,
            "start": start,
            "note": note,
            "unit": unit_of(name),
            "units": _scales(UNITS_OF[LIKE.get(name, name)]),
            "bound": BOUNDS[name],
            "positive": name in POSITIVE,
        }
        for name, (label, symbol, offered, slider, start, note) in _INPUTS.items()
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
        name: {
            **one._asdict(),
            "units": _scales(QUANTITIES[QUANTITY_OF[name]].units) if one.unit else {},
        }
        for name, one in ARGUMENTS.items()
    }
    return {
        "inputs": inputs,
        "choices": _CHOICES,
        "impossible": {
            f"{contact} {direction}": reason
            for contact in CONTACTS
            for direction in DIRECTIONS
            if (reason := _impossible(contact, direction))
        },
        "exponents": {name: _fraction(springs.exponent) for name, springs in SPRINGS_OF.items()},
        "geometries": geometries,
        "arguments": arguments,
        "example": _EXAMPLE,
        "version": __version__,
        "guide": guide,
    }


@lru_cache(maxsize=2 * len(CONTACTS) * len(DIRECTIONS))  # computed once for each table
def map_of(
    surrogate: Surrogate, contact: str = "spring", direction: str = "across"
) -> dict[str, Any]:
    """``map.json``: mu~ of a kind of contact on a grid in whole numbers, rows of constant y~ from
    below, its border, and what is drawn: levels, colours, places of numbers and regimes."""
    kind = kind_of(contact, direction)
    ratio, v_crit = surrogate.map_of(kind, _WIDTH, _HEIGHT)
    v, y = plotting.speeds(_WIDTH), plotting.amplitudes(_HEIGHT, kind.normal)
    fine = plotting.amplitudes(4 * _HEIGHT, kind.normal)
    border = np.column_stack((surrogate.v_tilde_crit(fine, **kind.names), fine)).tolist()
    on_map = np.interp(v, v_crit, np.linspace(0.0, 1.0, _HEIGHT))
    regimes = zip(plotting.AREAS, surrogate.regimes_on_map(kind), strict=True)
    return {
        "v_tilde": {"start": v[0], "stop": v[-1], "n": _WIDTH, "log": True},
        "y_tilde": {"start": y[0], "stop": y[-1], "n": _HEIGHT, "log": not kind.normal},
        "unit": _UNIT,
        "mu_ratio": np.rint(ratio / _UNIT).astype(int).ravel().tolist(),
        "border": [[float(f"{x:.6g}") for x in place] for place in border],
        "levels": plotting.LEVELS,
        "colours": plotting.band_colours(),
        "labels": plotting.label_places(ratio, on_map),
        "areas": [[*place, plotting.regime_words(name)] for place, name in regimes],
    }


def _fraction(exponent: float) -> str:
    """An exponent as a person writes it, such as 1/3."""
    return str(Fraction(exponent).limit_denominator(9))


def _scales(units: Mapping[str, Scale]) -> dict[str, list[float]]:
    """The factor and the divisor of each unit."""
    return {unit: [scale.times, scale.over] for unit, scale in units.items()}
