"""Pictures by matplotlib, which is loaded at the first of them.  They draw what they are given:
arrays, names and marks.

The methods ``plot`` of :class:`mumacro.Surrogate`, :class:`mumacro.Answer`, of a law and of
:class:`mumacro.Fit` fill in the numbers.  Each draws on ``axes`` of matplotlib, or new ones, and
returns them; MumacroError where it is not installed.
"""

import importlib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError, MumacroError, missing
from mumacro.inputs.fields import unit_of
from mumacro.inputs.kind import AMPLITUDE
from mumacro.kernel.arrays import Array, Bools

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
_LINES = {"border of reverse slip": "-.", "border of continuous sliding": "--"}
_MOST_LABELS = 8  # of curves in a legend


class Curve(NamedTuple):
    """Measured points at one set of the other inputs, and the fit there."""

    label: str  #: the inputs in which the set differs from others
    x: Array  #: of the points (n,)
    mu: Array  #: measured mu_macro [-], (n,)
    bars: Array | None  #: standard deviations of ``mu`` [-], (n,), where known
    fine: Array  #: places of the curve (m,)
    model: Array  #: mu_macro of the fit there [-], (m,)
    off: Array  #: half the width of its band [-], (m,)


def _loaded(name: str) -> Any:
    try:
        return importlib.import_module(f"matplotlib.{name}")
    except ModuleNotFoundError as error:
        raise MumacroError(missing("plot", error)) from None


def own(axes: Any) -> Any:
    """The axes of matplotlib that were given, or new ones."""
    return _loaded("pyplot").subplots(layout="constrained")[1] if axes is None else axes


def save(path: str | Path, draw: Callable[[Any], Any], panels: int = 1) -> None:
    """Write a picture; ``draw`` gets its axes, of several panels an array of them.  InputError
    where the name does not end in one of ``ENDINGS``."""
    path = Path(path)
    if path.suffix not in ENDINGS:
        endings = f"a name that ends in {', '.join(ENDINGS)}, or for the command in .csv"
        raise InputError("file name", str(path), endings)
    figure = _loaded("figure").Figure(
        figsize=(7.0 if panels == 1 else 5.0 * panels, 4.5), layout="constrained"
    )
    draw(figure.subplots(1, panels))
    figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)


def plot_law(
    along: str,
    x: Array,
    mu_macro: Array,
    mu_static: Array,
    axes: Any = None,
    *,
    band: tuple[Array, Array] | None = None,
    borders: Iterable[tuple[float, str]] = (),
    roots: Iterable[float] = (),
    target: float | None = None,
) -> Any:
    """mu_macro (n,) over values ``x`` (n,) of the input ``along``, with its static limit (n,).

    ``band`` are the least and the most mu_macro over an interval of k, (n,) each; ``borders``
    places on ``x`` with their names, such as "border of continuous sliding"; ``roots`` values of
    the input to mark, and ``target`` the mu_macro [-] that they give.
    """
    axes = own(axes)
    axes.plot(x, mu_macro, label=r"$\mu_\mathrm{macro}$")
    if band:
        axes.fill_between(x, *band, alpha=0.25, lw=0.0, label="for every $k$ of the interval")
    axes.plot(x, mu_static, ":", color="grey", label="static limit")
    labelled = set[str]()
    for value, name in borders:
        label = None if name in labelled else name
        axes.axvline(value, ls=_LINES[name], lw=1.0, color="grey", label=label)
        labelled.add(name)
    if target is not None:
        axes.axhline(target, lw=0.8, color="tab:red", label=f"target {target:.6g}")
        axes.plot([*roots], [target] * len([*roots]), "o", color="tab:red")
    if x[0] > 0.0 and x[-1] > 20.0 * x[0]:
        axes.set_xscale("log")
    axes.set(xlabel=f"{_SYMBOLS[along]} [{unit_of(along)}]", ylabel=r"$\mu_\mathrm{macro}$ [-]")
    axes.set_ylim(bottom=0.0)
    axes.legend()
    return axes


def y_range(normal: bool) -> tuple[float, float]:
    """Amplitudes of the map [-]; that of a ``normal`` force is below 1, where the contact lifts
    off."""
    return (Y_RANGE[0], 0.999) if normal else Y_RANGE


def plot_map(
    v: Array,
    y: Array,
    ratio: Array,
    v_crit: Array,
    axes: Any = None,
    *,
    point: tuple[float, float] | None = None,
    normal: bool = False,
) -> Any:
    """mu~ (m, n) over the dimensionless speed ``v`` (n,) and amplitude ``y`` (m,), with the border
    of continuous sliding ``v_crit`` (m,) and a ``point`` (v~, y~); ``normal``: y~ is that of the
    normal force."""
    axes = own(axes)
    areas = axes.contourf(v, y, ratio, np.linspace(0.0, 1.0, 21), cmap="viridis")
    axes.figure.colorbar(areas, ax=axes, label=r"$\mu_\mathrm{macro} / \mu_0$ [-]")
    _plane(axes, v_crit, y)
    if normal:
        axes.set_ylabel(r"$\tilde y = \hat F_z / F_z$")
    if point is not None and all(math.isfinite(x) and x > 0.0 for x in point):
        axes.plot(*point, "o", color="tab:red", markeredgecolor="white")
    axes.set(xlim=(v[0], v[-1]), ylim=(y[0], y[-1]))
    return axes


def plot_cases(
    v: Array,
    y: Array,
    groups: Mapping[str, Bools],
    border: Callable[[Array], Array],
    axes: Any = None,
) -> Any:
    """Cases (n,) over (v~, y~), one colour for each name of ``groups``, which says whether a case
    belongs to it (n,); ``border`` gives v~crit(y~)."""
    axes = own(axes)
    for name, belongs in groups.items():
        shown = belongs & (v > 0.0) & (y > 0.0) & np.isfinite(v) & np.isfinite(y)
        if shown.any():
            axes.plot(v[shown], y[shown], "o", ms=4.0, label=name)
    inside = y[(y > 0.0) & np.isfinite(y)]
    ends = (0.5 * float(inside.min()), 2.0 * float(inside.max())) if inside.size else Y_RANGE
    heights = np.geomspace(*ends, 201)
    _plane(axes, border(heights), heights)
    return axes


def _plane(axes: Any, v_crit: Any, y: Any) -> None:
    axes.plot(v_crit, y, "--", color="tab:grey", label="border of continuous sliding")
    axes.set(xscale="log", yscale="log", xlabel=r"$\tilde v = v_0 k / (\mu_0 F_z \omega)$")
    axes.set_ylabel(r"$\tilde y = y_0 k / (\mu_0 F_z)$")
    axes.legend()


def plot_fit(along: str, curves: Sequence[Curve], title: str, axes: Any = None) -> Any:
    """Measured points, the fit and its band over the input ``along``; more than 8 curves have no
    legend."""
    axes = own(axes)
    for one in curves:
        color = axes.errorbar(one.x, one.mu, one.bars, fmt="o")[0].get_color()
        axes.plot(one.fine, one.model, color=color, label=one.label)
        band = one.model - one.off, one.model + one.off
        axes.fill_between(one.fine, *band, color=color, alpha=0.25, lw=0)
    x = np.concatenate([one.x for one in curves])
    low = x[x > 0.0].min(initial=math.inf)
    if low < x.max() / 10.0:
        if (x == 0.0).any():
            axes.set_xscale("symlog", linthresh=low)
        else:
            axes.set_xscale("log")
    axes.set(xlabel=f"{along} [{unit_of(along)}]", ylabel="mu_macro [-]", title=title)
    if len(curves) <= _MOST_LABELS:
        axes.legend()
    return axes


def plot_cycle(
    t: Array, x: Array, y: Array, Fx: Array, Fy: Array, Fz: Array, mu0: float, axes: Any = None
) -> Any:
    """Forces of one period over time, with the limit mu0 Fz, and the path of the upper point with
    the force's direction at 16 moments; all (n,), in SI.  ``axes`` are two, or new ones."""
    if axes is None:
        _, axes = _loaded("pyplot").subplots(1, 2, figsize=(10.0, 4.5), layout="constrained")
    forces, path = axes
    share = (t - t[0]) / (t[-1] - t[0])
    forces.plot(share, Fx, label="$F_x$, along the drag")
    forces.plot(share, Fy, label="$F_y$, across")
    forces.plot(share, mu0 * Fz, ":", color="grey", label=r"$\pm\mu_0 F_z$")
    forces.plot(share, -mu0 * Fz, ":", color="grey")
    mean = float(np.sum((Fx[1:] + Fx[:-1]) * np.diff(share)) / 2.0)
    forces.axhline(mean, lw=0.8, color="tab:blue", ls="--", label="mean of $F_x$")
    forces.set(xlabel="share of the period [-]", ylabel="force [N]")
    forces.legend(fontsize="small")
    micro = 1e6
    path.plot(micro * x, micro * y, label="upper point")
    path.plot(micro * x[0], micro * y[0], "o", color="tab:blue", label="start of the period")
    places = np.linspace(0, t.size - 1, 17).astype(int)[:-1]
    path.quiver(
        micro * x[places],
        micro * y[places],
        Fx[places],
        Fy[places],
        angles="xy",
        width=0.004,
        color="tab:red",
        label="force",
    )
    path.margins(0.15)
    path.set(xlabel=r"$x$ [µm]", ylabel=r"$y$ [µm]", aspect="equal", adjustable="datalim")
    path.legend(fontsize="small")
    return axes
