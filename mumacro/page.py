"""What the interactive page is told: the inputs, the geometries of a contact, and the map of mu~ over (v~, y~).

The service serves it, and ``python -m builder.export_page`` writes it into a folder; the page itself is in
``service/static/page``.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mumacro.contact import AMPLITUDE
from mumacro.geometries import ARGUMENTS, BODIES, GEOMETRIES
from mumacro.inputs import BOUNDS, POSITIVE, SI, UNITS_OF, Scale, refusal
from mumacro.surrogate import Surrogate

#: the content security policy of the page: no inline script, no inline style, nothing from another host
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

# The range of the map [-]: from deep in creep to fast sliding, twenty points per decade.
_PER_DECADE = 20
_V_DECADES, _Y_DECADES = (-4, 3), (-2, 3)
_UNIT = 1e-4  # of the map's integers: a shade of colour is a hundred times coarser


def names(knows: Iterable[str] = ()) -> dict[str, Any]:
    """``names.json``: inputs, units, bounds, geometries with arguments, and what the page's host ``knows``.

    The page shows what needs them only if they are there: ``service`` (what is computed by the service only),
    ``guide``, ``stiffness`` and ``fit``; ``contact``, ``direction`` and ``k_range``, fields of a case.
    """
    inputs = {
        name: {
            "unit": SI[name][0], "bound": refusal(name, -1.0).removeprefix("must be "), "positive": name in POSITIVE,
            "units": _scales(known),
        }
        for name, known in UNITS_OF.items()
    }  # fmt: skip
    inputs[AMPLITUDE] = {**inputs["Fz"], "bound": BOUNDS["y0"], "positive": False}
    geometries = {
        name: {"meaning": one.meaning, "arguments": [*one.arguments, *BODIES]} for name, one in GEOMETRIES.items()
    }
    arguments = {name: {**one._asdict(), "units": _scales(one.units)} for name, one in ARGUMENTS.items()}
    return {"inputs": inputs, "geometries": geometries, "arguments": arguments, "knows": list(knows)}


def map_of(surrogate: Surrogate) -> dict[str, Any]:
    """``map.json``: mu~ on a grid in whole numbers, rows of constant y~ from below, and the border."""
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
