"""Collect the data of the interactive page: the inputs, the contacts and directions, the geometries
of a contact, an example of measured points, and for each contact and direction the map of mu~ over
(v~, y~).

The service serves these data; the page itself is in ``service/static/page``.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import plotting
from mumacro.errors import InputError
from mumacro.inputs.fields import (
    AMPLITUDE,
    CONTACTS,
    DIRECTIONS,
    INPUTS,
    MEASURED_AS,
    SPRINGS_OF,
    kind_of,
)
from mumacro.inputs.units import UNITS_OF, Scale
from mumacro.outputs import OUTPUTS
from mumacro.stiffness import ARGUMENTS, BODIES, GEOMETRIES, MATERIALS, SOURCE_OF_MATERIALS
from mumacro.surrogate import Surrogate
from mumacro.table.atlas import REGIMES

from . import __version__

#: the content security policy of the page: no inline script, no inline style, nothing from another
#: host
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src "
    "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

_HALF = "half of peak to peak"
# label, offered units, decimal exponents of the usual range [SI], text at the start, a note
_INPUTS = {
    "mu0": ("friction", ["-"], [-2, 0.5], "0.3", ""),
    "Fz": ("load", ["N", "mN", "kN"], [-3, 5], "10 N", ""),
    "k": ("stiffness", ["N/µm", "kN/m", "N/m"], [2, 10], "1 N/µm", ""),
    "y0": ("amplitude", ["µm", "nm", "mm", "m"], [-10, -3], "2 µm", _HALF),
    AMPLITUDE: ("amplitude", ["N", "mN", "kN"], [-3, 5], "5 N", _HALF),
    "f": ("frequency", ["kHz", "Hz", "MHz"], [0, 7], "20 kHz", ""),
    "v0": ("speed", ["mm/s", "µm/s", "m/s"], [-7, 2], "10 mm/s", ""),
}
# the choices, with their part of the set-up in words; the first one is the default
_CHOICES = {
    "contact": {name: springs.meaning for name, springs in SPRINGS_OF.items()}
    | {"rigid": "rigid contact"},
    "direction": {
        "across": "shaken across the sliding direction",
        "along": "shaken along the sliding direction",
        "normal": "under an oscillating load",
    },
}
# published points of steel on steel, docs/how-to/fit.md: the case as an address, the columns
_EXAMPLE = {
    "case": "mu0=0.3&Fz=10.79 N&k=10 N/µm&y0=0.35 µm&f=26 kHz&v0=0.2 mm/s&contact=ball"
    "&direction=along",
    "unknowns": "k",
    "points": "v0 [mm/s]\tmu0\tmu_macro\n0.05\t0.3031\t0.04662\n0.1\t0.2994\t0.04374\n"
    "0.2\t0.2836\t0.03957\n0.5\t0.2716\t0.03068\n1\t0.2651\t0.02753\n",
}
_MATERIALS = {
    "source": SOURCE_OF_MATERIALS,
    "rows": [
        {"name": name, "E": f"{1e-9 * modulus:g} GPa", "nu": f"{ratio:g}"}
        for name, (modulus, ratio) in MATERIALS.items()
    ],
}
_WIDTH, _HEIGHT = 141, 101  # points of the map's grid, twenty a decade
_UNIT = 1e-4  # unit of the map's integers; a shade of colour is a hundred times coarser


_RIGID_ANY = (
    "Any motion of a rigid contact is the limit of a large k: raise k until µ stays the same."
)


def _impossible(contact: str, direction: str) -> str:
    """Return why a contact cannot have a direction, or an empty text if it can."""
    try:
        kind_of(contact, direction)
    except InputError:
        return "A ball under an oscillating load is not modelled: its contact radius would change."
    return ""


def names(built: bool) -> dict[str, Any]:
    """Return ``names.json``: inputs, choices, geometries with arguments, materials, an example of
    measured points, the version, and the place of the documents: the guide, if it was ``built``,
    otherwise the text files."""
    inputs: dict[str, dict[str, Any]] = {
        name: {
            "label": label,
            "symbol": INPUTS[name].symbol,
            "meaning": INPUTS[name].meaning,
            "offered": offered,
            "range": exponents,
            "usual": INPUTS[name].usual,
            "note": note,
            "units": _scales(UNITS_OF[MEASURED_AS.get(name, name)]),
        }
        for name, (label, offered, exponents, _, note) in _INPUTS.items()
    }
    geometries = {
        name: {"meaning": one.meaning, "arguments": [*one.arguments, *BODIES]}
        for name, one in GEOMETRIES.items()
    }
    arguments = {
        name: {"unit": one.unit, "meaning": one.meaning, "choices": one.choices}
        for name, one in ARGUMENTS.items()
    }
    kinds = [(contact, direction) for contact in CONTACTS for direction in DIRECTIONS]
    reasons = {kind: _impossible(*kind) for kind in kinds}
    return {
        "inputs": inputs,
        "start": {name: text for name, (*_, text, _) in _INPUTS.items()},
        "titles": {"contact": "Contact", "direction": "Oscillation"},
        "contacts": {name: name for name in _CHOICES["contact"]},
        "directions": {name: name for name in _CHOICES["direction"]},
        "choices": _CHOICES,
        "impossible": {" ".join(kind): reason for kind, reason in reasons.items() if reason}
        | {"rigid any": _RIGID_ANY},
        "outputs": {" ".join(kind): _outputs_of(kind) for kind in kinds if not reasons[kind]},
        "lacks": {" ".join(kind): _lacks(kind) for kind in kinds if not reasons[kind]},
        "regimes": {name: plotting.REGIMES[name].words for name in REGIMES},
        "geometries": geometries,
        "arguments": arguments,
        "materials": _MATERIALS,
        "example": _EXAMPLE,
        "version": __version__,
        "guide": "guide/" if built else "documents/",
        "guide_ending": ".html" if built else ".md",
    }


def _outputs_of(kind: tuple[str, str]) -> list[str]:
    """Return the outputs that the page requests, as far as this contact and direction have them."""
    return [
        name
        for name in ("groups", "limits", "gradient", "stick_fraction", "power", "settling")
        if name not in _lacks(kind)
    ]


def _lacks(kind: tuple[str, str]) -> dict[str, str]:
    """Return the outputs that a contact and direction do not have, each with the reason."""
    return {
        name: next(reason for word, reason in output.lacks.items() if word in kind)
        for name, output in OUTPUTS.items()
        if output.lacks.keys() & {*kind}
    }


@lru_cache(maxsize=2 * len(CONTACTS) * len(DIRECTIONS))  # computed once for each table
def map_of(
    surrogate: Surrogate, contact: str = "spring", direction: str = "across"
) -> dict[str, Any]:
    """Return ``map.json``: mu~ on a grid in whole numbers for a contact and direction, rows of
    constant y~ from below, its borders, and what the page draws: levels, colours, places of numbers
    and regimes."""
    kind = kind_of(contact, direction)
    ratio, v_crit = surrogate.map_of(kind, _WIDTH, _HEIGHT)
    v, y = plotting.speeds(_WIDTH), plotting.amplitudes(_HEIGHT, kind.normal)
    fine = plotting.amplitudes(4 * _HEIGHT, kind.normal)
    border = np.column_stack((surrogate.v_tilde_crit(fine, **kind.names), fine))
    on_map = np.interp(v, v_crit, np.linspace(0.0, 1.0, _HEIGHT))
    areas = surrogate.regimes_on_map(kind)
    reverse = surrogate.reverse_slip_on_map(kind, _WIDTH)
    return {
        "v_tilde": {"start": v[0], "stop": v[-1], "n": _WIDTH, "log": True},
        "y_tilde": {"start": y[0], "stop": y[-1], "n": _HEIGHT, "log": not kind.normal},
        "unit": _UNIT,
        "mu_ratio": np.rint(ratio / _UNIT).astype(int).ravel().tolist(),
        "border": _written(border),
        "reverse": [] if reverse is None else _written(np.column_stack(reverse)),
        "levels": plotting.LEVELS,
        "colours": plotting.band_colours(),
        "labels": plotting.label_places(ratio, on_map, areas.values()),
        "areas": [[*place, plotting.REGIMES[name].words] for name, place in areas.items()],
    }


def _written(places: NDArray[np.float64]) -> list[list[float]]:
    """Return places (n, 2) in six digits."""
    return [[float(f"{x:.6g}") for x in place] for place in places.tolist()]


def _scales(units: Mapping[str, Scale]) -> dict[str, list[float]]:
    """Return the factor and the divisor of each unit, also in its typeset form, with µ."""
    scales = {unit: [scale.times, scale.over] for unit, scale in units.items()}
    return scales | {unit.replace("u", "µ"): scale for unit, scale in scales.items() if "u" in unit}
