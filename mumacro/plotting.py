"""Pictures of a law, of the map of mu~ and of answers, by matplotlib, which is loaded at the first
of them."""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from mumacro.analysis.law import Law
from mumacro.analysis.roots import Crossing
from mumacro.answer import Answer
from mumacro.errors import InputError, MumacroError
from mumacro.extras import missing
from mumacro.inputs.fields import unit_of
from mumacro.inputs.kind import AMPLITUDE, Kind, kind_of
from mumacro.surrogate import Surrogate
from mumacro.table.atlas import REGIMES

ENDINGS = (".png", ".svg", ".pdf")
V_RANGE, Y_RANGE = (1e-4, 1e3), (1e-2, 1e3)  # of the map [-]: from deep in creep to fast sliding
_SYMBOLS = {
    "mu0": r"$\mu_0$",
    "Fz": "$F_z$",
    "k": "$k$",
    "y0": "$y_0$",
    "omega": r"$\omega$",
    "v0": "$v_0$",
    AMPLITUDE: r"$\hat F_z$",
}
_MARKS = {
    "reverse_slip": ("-.", "border of reverse slip"),
    "continuous": ("--", "border of continuous sliding"),
}


def _loaded(name: str) -> Any:
    import importlib

    try:
        return importlib.import_module(f"matplotlib.{name}")
    except ModuleNotFoundError as error:
        raise MumacroError(missing("plot", error)) from None


def own(axes: Any) -> Any:
    """The axes of matplotlib that were given, or new ones."""
    return _loaded("pyplot").subplots(layout="constrained")[1] if axes is None else axes


def save(path: str | Path, draw: Callable[[Any], Any]) -> None:
    """Write a picture; ``draw`` gets its axes.  InputError where the name does not end in one of
    :data:`ENDINGS`."""
    path = Path(path)
    if path.suffix not in ENDINGS:
        told = f"a name that ends in {', '.join(ENDINGS)}, or for the command in .csv"
        raise InputError("file name", str(path), told)
    figure = _loaded("figure").Figure(figsize=(7.0, 4.5), layout="constrained")
    draw(figure.subplots())
    figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)


def plot_law(
    law: Law, axes: Any = None, *, roots: Iterable[float] = (), target: float | None = None
) -> Any:
    """mu_macro along one input, with the static limit, the borders, the band of k_range, and roots
    of a target.

    ``roots`` are values of the input [SI] to mark, and ``target`` the mu_macro [-] that they give.
    As all pictures this draws on ``axes`` of matplotlib, or new ones, and returns them;
    MumacroError where it is not installed.
    """
    axes, x = own(axes), law.values
    axes.plot(x, law.answer.mu_macro, label=r"$\mu_\mathrm{macro}$")
    if law.band:
        axes.fill_between(x, *law.band, alpha=0.25, lw=0.0, label="for every $k$ of the interval")
    axes.plot(x, law.mu_static, ":", color="grey", label="static limit")
    told = set[str]()
    for crossing in law.border:
        line, label = mark_of(crossing)
        axes.axvline(
            crossing.value, ls=line, lw=1.0, color="grey", label=None if label in told else label
        )
        told.add(label)
    if target is not None:
        axes.axhline(target, lw=0.8, color="tab:red", label=f"target {target:.6g}")
        axes.plot([*roots], [target] * len([*roots]), "o", color="tab:red")
    if x[0] > 0.0 and x[-1] > 20.0 * x[0]:
        axes.set_xscale("log")
    axes.set(
        xlabel=f"{_SYMBOLS[law.along]} [{unit_of(law.along)}]", ylabel=r"$\mu_\mathrm{macro}$ [-]"
    )
    axes.set_ylim(bottom=0.0)
    axes.legend()
    return axes


def mark_of(crossing: Crossing) -> tuple[str, str]:
    """The line that marks a border, and what it is."""
    return next(_MARKS[name] for name in ("continuous", "reverse_slip") if name in crossing.regimes)


def y_range(kind: Kind) -> tuple[float, float]:
    """Amplitudes of the map [-]; that of a normal force is below 1, where the contact lifts off."""
    return (Y_RANGE[0], 0.999) if kind.normal else Y_RANGE


def plot_map(
    surrogate: Surrogate, axes: Any = None, *, point: tuple[float, float] | None = None, **kind: str
) -> Any:
    """mu~ over the dimensionless speed and amplitude, with the border of continuous sliding and a
    ``point`` (v~, y~).

    ``contact`` and ``direction`` as in :meth:`mumacro.Surrogate.quantity`.
    """
    axes, chosen = own(axes), kind_of(**kind)
    ends = y_range(chosen)
    v, y = np.geomspace(*V_RANGE, 281), np.geomspace(*ends, 201)
    ratio = surrogate.quantity("mu_ratio", v, y[:, None], **kind)[0]
    found = axes.contourf(v, y, ratio, np.linspace(0.0, 1.0, 21), cmap="viridis")
    axes.figure.colorbar(found, ax=axes, label=r"$\mu_\mathrm{macro} / \mu_0$ [-]")
    _plane(axes, surrogate.v_tilde_crit(y, **kind), y)
    if chosen.normal:
        axes.set_ylabel(r"$\tilde y = \hat F_z / F_z$")
    if point is not None and all(math.isfinite(x) and x > 0.0 for x in point):
        axes.plot(*point, "o", color="tab:red", markeredgecolor="white")
    axes.set(xlim=V_RANGE, ylim=ends)
    return axes


def plot_answer(answer: Answer[Any], axes: Any = None) -> Any:
    """The cases of an answer over (v~, y~), one colour a regime; of arrays the groups must have
    been requested."""
    from mumacro.closed_forms import border_blend  # an answer has no table

    axes = own(axes)
    v, y, codes = (
        np.ravel(np.asarray(x)) for x in (answer.v_tilde, answer.y_tilde, answer.regime_code)
    )
    for code, name in enumerate(REGIMES):
        shown = (codes == code) & (v > 0.0) & (y > 0.0) & np.isfinite(v) & np.isfinite(y)
        if shown.any():
            axes.plot(v[shown], y[shown], "o", ms=4.0, label=name)
    inside = y[(y > 0.0) & np.isfinite(y)]
    ends = (0.5 * float(inside.min()), 2.0 * float(inside.max())) if inside.size else Y_RANGE
    heights = np.geomspace(*ends, 201)
    _plane(axes, border_blend(heights), heights)
    return axes


def _plane(axes: Any, v_crit: Any, y: Any) -> None:
    axes.plot(v_crit, y, "--", color="tab:grey", label="border of continuous sliding")
    axes.set(xscale="log", yscale="log", xlabel=r"$\tilde v = v_0 k / (\mu_0 F_z \omega)$")
    axes.set_ylabel(r"$\tilde y = y_0 k / (\mu_0 F_z)$")
    axes.legend()
