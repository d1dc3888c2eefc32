"""Pictures by matplotlib, which is loaded at the first of them.  They draw what they are given:
arrays, names and marks.

The methods ``plot`` of :class:`mumacro.Surrogate`, :class:`mumacro.Answer`, of a law and of
:class:`mumacro.Fit` fill in the numbers.  Each draws on ``axes`` of matplotlib, or new ones, and
returns them; MumacroError where it is not installed.  The colours, contours and ranges of the map
are those of the page, too.
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
#: the map: v~ from deep in creep to fast sliding [-], and y~ [-]; that of a normal force is below
#: 1, where the contact lifts off
V_RANGE, Y_RANGE, NORMAL_RANGE = (1e-4, 1e3), (1e-2, 1e3), (0.0, 0.999)
#: contours of mu~ on every map, and those with a number
LEVELS = (0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
LABELLED = (0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 0.99)
#: of every map, evenly from mu~ = 0 to 1; darker is slipperier, also without colour
COLOURS = ("#3f87b5", "#7fb9d3", "#c4e0e6", "#f2f2e2", "#fdf3d4")
INK, BLUE, RED, GREY = "#16202c", "#0b5cad", "#a3242b", "#6b7683"
_SYMBOLS = {
    "mu0": r"$\mu_0$",
    "Fz": "$F_z$",
    "k": "$k$",
    "y0": "$y_0$",
    "omega": r"$\omega$",
    "f": "$f$",
    "v0": "$v_0$",
    AMPLITUDE: r"$\hat F_z$",
}
# unit and its size [SI] in which a title shows an input, the largest first
_SHOWN = {
    "Fz": {"kN": 1e3, "N": 1.0, "mN": 1e-3},
    "k": {"N/µm": 1e6, "kN/m": 1e3, "N/m": 1.0},
    "y0": {"mm": 1e-3, "µm": 1e-6, "nm": 1e-9},
    "omega": {"kHz": 2e3 * math.pi, "Hz": 2.0 * math.pi},
    "v0": {"m/s": 1.0, "mm/s": 1e-3, "µm/s": 1e-6},
}
_SHOWN[AMPLITUDE] = _SHOWN["Fz"]
_LINES = {"border of reverse slip": "-.", "border of continuous sliding": "--"}
_REGIMES = {"continuous": "continuous sliding", "stick_slip": "stick and slip"}
_MARKS = "osD^vPX"  # of groups of cases: they differ without colour, too
_MOST_LABELS = 8  # of curves in a legend
_TO_BORDER = 0.4  # weight of a label's distance to the border beside that to another line
_SIDE = 0.05  # of the map, where no label stands
#: places where the map names the regime, in shares of its width and height
AREAS = ((0.14, 0.735), (0.8, 0.12))


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
        endings = f"one that ends in {', '.join(ENDINGS)}, or for the command in .csv"
        raise InputError("file name", str(path), endings)
    figure = _loaded("figure").Figure(
        figsize=(7.0 if panels == 1 else 5.0 * panels, 4.8), layout="constrained"
    )
    draw(figure.subplots(1, panels))
    figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)


def in_words(case: Mapping[str, Any], kind: Mapping[str, str] | None = None) -> str:
    """A case as the title of a picture: the inputs [SI], numbers or (low, high), and what it is.

    >>> in_words({"mu0": 0.3, "Fz": 10.0, "k": 1e6}, {"contact": "ball", "direction": "along"})
    '$\\\\mu_0$ = 0.3, $F_z$ = 10 N, $k$ = 1 N/µm; ball, along'
    """
    inputs = ", ".join(_quantity(name, value) for name, value in case.items())
    return "; ".join(part for part in (inputs, ", ".join((kind or {}).values())) if part)


def _quantity(name: str, value: Any) -> str:
    ends = [value] if np.ndim(value) == 0 else [*value]
    if isinstance(value, str) or math.isinf(ends[-1]):
        return f"{_SYMBOLS[name]} rigid"
    sizes = _SHOWN.get(name, {"": 1.0})
    unit, size = next(
        (one for one in sizes.items() if ends[-1] >= 0.1 * one[1]), [*sizes.items()][-1]
    )
    symbol = "$f$" if name == "omega" else _SYMBOLS[name]
    numbers = " to ".join(f"{end / size:.4g}" for end in ends)
    return f"{symbol} = {numbers} {unit}".rstrip()


def regime_words(name: str) -> str:
    """A regime as a picture names it."""
    return _REGIMES.get(name, name.replace("_", " "))


# --- curves of mu_macro ---------------------------------------------------------------------------


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
    title: str = "",
) -> Any:
    """mu_macro (n,) over values ``x`` (n,) of the input ``along``, with its static limit (n,).

    ``band`` are the least and the most mu_macro over an interval of k, (n,) each; ``borders``
    places on ``x`` with their names, such as "border of continuous sliding"; ``roots`` values of
    the input to mark, and ``target`` the mu_macro [-] that they give; ``title`` the other inputs.
    """
    axes = own(axes)
    axes.plot(x, mu_macro, color=BLUE, lw=2.0, label=r"$\mu_\mathrm{macro}$")
    if band:
        axes.fill_between(
            x, *band, color=BLUE, alpha=0.2, lw=0.0, label="for every $k$ of the interval"
        )
    axes.plot(x, mu_static, ":", color=GREY, label=r"static limit, $v_0 \to 0$")
    labelled = set[str]()
    for value, name in borders:
        label = None if name in labelled else name
        axes.axvline(value, ls=_LINES[name], lw=1.2, color=RED, label=label)
        labelled.add(name)
    if target is not None:
        axes.axhline(target, lw=0.8, color=INK, label=f"target {target:.6g}")
        axes.plot([*roots], [target] * len([*roots]), "o", color=INK, mec="white")
    if x[0] > 0.0 and x[-1] > 20.0 * x[0]:
        axes.set_xscale("log")
    axes.set(xlabel=_axis(along), ylabel=r"$\mu_\mathrm{macro}$ [-]", xlim=(x[0], x[-1]))
    axes.set_ylim(bottom=0.0)
    finish(axes, title)
    return axes


def plot_roots(
    name: str,
    x: Array,
    mean: Array,
    of: str,
    targets: Sequence[float],
    roots: Sequence[float],
    log: bool,
    axes: Any = None,
) -> Any:
    """A mean force ``of`` a motion (n,) over values ``x`` (n,) of an input, whose axis is ``name``,
    with targets and roots."""
    axes = own(axes)
    symbol = {"mu_macro": r"\mathrm{macro}", "mu_lateral": r"\mathrm{lateral}"}[of]
    axes.plot(x, mean, color=BLUE, lw=2.0, label=rf"$\mu_{symbol}$")
    for target in targets:
        axes.axhline(target, lw=0.8, color=GREY)
    for i, root in enumerate(roots):
        label = "target" if not i else None
        axes.plot(root, np.interp(root, x, mean), "o", color=RED, mec="white", label=label)
    if log:
        axes.set_xscale("log")
    axes.set(xlabel=name, ylabel=rf"$\mu_{symbol}$ [-]", xlim=(x[0], x[-1]))
    finish(axes, "")
    return axes


def plot_fit(along: str, curves: Sequence[Curve], title: str, axes: Any = None) -> Any:
    """Measured points, the fit and its band over the input ``along``; more than 8 curves have no
    legend."""
    axes = own(axes)
    colours = [BLUE] if len(curves) == 1 else [f"C{i}" for i in range(len(curves))]
    for i, (one, mark, color) in enumerate(
        zip(curves, _MARKS * len(curves), colours, strict=False)
    ):
        points, band = (None, None) if i else ("measured", "95 % band of the fit")
        looks = {"fmt": mark, "color": color, "mec": "white", "ms": 7.0}
        axes.errorbar(one.x, one.mu, one.bars, label=points, **looks)
        axes.plot(one.fine, one.model, color=color, label=one.label)
        ends = one.model - one.off, one.model + one.off
        axes.fill_between(one.fine, *ends, color=color, alpha=0.2, lw=0, label=band)
    x = np.concatenate([one.x for one in curves])
    low = x[x > 0.0].min(initial=math.inf)
    if low < x.max() / 10.0:
        if (x == 0.0).any():
            axes.set_xscale("symlog", linthresh=low)
        else:
            axes.set_xscale("log")
    axes.set(xlabel=_axis(along), ylabel=r"$\mu_\mathrm{macro}$ [-]")
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    finish(axes, title, legend=len(curves) <= _MOST_LABELS)
    return axes


def _axis(name: str) -> str:
    return f"{_SYMBOLS[name]} [{unit_of(name)}]"


def finish(axes: Any, title: str, legend: bool = True) -> None:
    """What all curves share.  The legend stands above the axes: it covers no curve."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(visible=True, color="0.92")
    axes.set_axisbelow(True)
    heading = axes.set_title(title, loc="left", fontsize="medium")
    if legend:
        count = len(axes.get_legend_handles_labels()[0])
        rows = -(-count // 3)
        heading.set_position((0.0, 1.0))
        axes.set_title(title, loc="left", fontsize="medium", pad=10.0 + 17.0 * rows)
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(-0.01, 1.0),
            ncols=3,
            frameon=False,
            fontsize="small",
            borderpad=0.2,
        )


# --- the map of mu~ -------------------------------------------------------------------------------


def amplitudes(n: int, normal: bool = False) -> Array:
    """``n`` amplitudes from the foot of the map to its top [-], evenly as its axis is: logarithmic,
    linear for a ``normal`` force."""
    return np.linspace(*NORMAL_RANGE, n) if normal else np.geomspace(*Y_RANGE, n)


def speeds(n: int) -> Array:
    """``n`` speeds from the left of the map to its right [-]."""
    return np.geomspace(*V_RANGE, n)


def band_colours() -> list[str]:
    """The colour of each area between two contours, from below the lowest of ``LEVELS`` to above
    the highest, #rrggbb."""
    middles = 0.5 * (np.array([0.0, *LEVELS]) + np.array([*LEVELS, 1.0]))
    table = np.array([[int(one[i : i + 2], 16) for i in (1, 3, 5)] for one in COLOURS])
    even = np.linspace(0.0, 1.0, len(COLOURS))
    mixed = np.stack([np.interp(middles, even, column) for column in table.T], axis=1)
    return ["#" + "".join(f"{round(x):02x}" for x in one) for one in mixed.tolist()]


def heights(ratio: Array, level: float) -> Array:
    """How high mu~ falls below a level above each speed, in shares of the map's height, (n,) of
    ``ratio`` (m, n), whose rows are even on the map; 1 where it does not, 0 where it is below
    everywhere."""
    below = ratio < level
    first = np.where(below.any(axis=0), below.argmax(axis=0), len(ratio))
    at = np.clip(first, 1, len(ratio) - 1)
    over, under = (np.take_along_axis(ratio, i[None, :], axis=0)[0] for i in (at - 1, at))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (at - 1 + (over - level) / (over - under)) / (len(ratio) - 1)
    return np.where(first == 0, 0.0, np.where(first == len(ratio), 1.0, share))


def label_places(ratio: Array, border: Array) -> list[tuple[float, float, float]]:
    """Where the numbers of the contours stand: (level, share of the width, share of the height).

    Each where its line is farthest from the other lines, from the ``border`` (n,), a height at each
    speed, from the names of the regimes and from the numbers that stand already; none for a line
    that is not on the map.
    """
    across = np.linspace(0.0, 1.0, ratio.shape[1])
    words = [(u + aside, w) for u, w in AREAS for aside in (-0.12, 0.0, 0.12)]  # a name is wide
    lines = {level: heights(ratio, level) for level in LEVELS}
    placed: list[tuple[float, float, float]] = []
    for level in LABELLED:
        inside = (np.minimum(across, 1.0 - across) > _SIDE) & (
            np.abs(lines[level] - 0.5) < 0.5 - _SIDE
        )
        if not inside.any():
            continue
        x, y = across[inside], lines[level][inside]
        others = [line for other, line in lines.items() if other != level]
        apart = np.min([_distances(x, y, across, line) for line in others], axis=0)
        # the border is drawn thicker than a line, and a number beside it is hard to read
        apart = np.minimum(apart, _TO_BORDER * _distances(x, y, across, border))
        for u, w in [*words, *(at[1:] for at in placed)]:
            apart = np.minimum(apart, 0.5 * np.hypot(x - u, y - w))
        best = int(apart.argmax())
        placed.append((level, float(x[best]), float(y[best])))
    return placed


def _distances(x: Array, y: Array, across: Array, line: Array) -> Array:
    """How far points (m,) are from a line of heights (n,) at ``across`` (n,); (m,)."""
    return np.asarray(np.hypot(x[:, None] - across, y[:, None] - line).min(axis=1))


def plot_map(
    ratio: Array,
    v_crit: Array,
    axes: Any = None,
    *,
    point: tuple[float, float] | None = None,
    normal: bool = False,
    areas: Sequence[str] = (),
    title: str = "",
) -> Any:
    """mu~ (m, n) over :func:`speeds` and :func:`amplitudes`, with the border of continuous sliding
    ``v_crit`` (m,) and a ``point`` (v~, y~); ``normal``: y~ is that of the normal force; ``areas``
    are the regimes at :data:`AREAS`."""
    axes = own(axes)
    v, y = speeds(ratio.shape[1]), amplitudes(len(ratio), normal)
    levels = [0.0, *LEVELS, 1.0]
    axes.contourf(v, y, np.clip(ratio, 0.0, 1.0 - 1e-12), levels, colors=band_colours())
    lines = axes.contour(v, y, ratio, LEVELS, colors=INK, linewidths=0.6, alpha=0.75)
    _plane(axes, v_crit, y, normal)
    axes.set(xlim=V_RANGE, ylim=(y[0], y[-1]))
    axes.figure.draw_without_rendering()  # labels are turned along the lines as they are then
    shown = np.interp(np.log(v), np.log(np.maximum(v_crit, 1e-300)), np.linspace(0.0, 1.0, len(y)))
    places = label_places(ratio, shown)
    halo = [_loaded("patheffects").withStroke(linewidth=2.5, foreground="white")]
    manual = [place(u, w, normal) for _, u, w in places]
    for text in axes.clabel(
        lines, levels=LABELLED, manual=manual, fmt="%g", fontsize=9.0, inline_spacing=3, colors=INK
    ):
        text.set_path_effects(halo)
    for (u, w), name in zip(AREAS, areas, strict=False):
        axes.annotate(
            regime_words(name),
            (u, w),
            xycoords="axes fraction",
            ha="center",
            color=RED,
            fontsize=11.0,
            path_effects=halo,
        )
    if point is not None and all(math.isfinite(x) and x > 0.0 for x in point):
        axes.plot(*point, "o", color=INK, ms=10.0, mec="white", mew=2.0, zorder=5)
    axes.set_title(title or r"$\mu_\mathrm{macro} / \mu_0$", loc="left", fontsize="medium")
    axes.legend(loc="lower right", bbox_to_anchor=(1.01, 1.0), frameon=False, fontsize="small")
    return axes


def place(u: float, w: float, normal: bool = False) -> tuple[float, float]:
    """(v~, y~) at shares of the map's width and height."""
    v = V_RANGE[0] * (V_RANGE[1] / V_RANGE[0]) ** u
    return v, NORMAL_RANGE[1] * w if normal else Y_RANGE[0] * (Y_RANGE[1] / Y_RANGE[0]) ** w


def plot_cases(
    v: Array,
    y: Array,
    groups: Mapping[str, Bools],
    border: Callable[[Array], Array] | None = None,
    axes: Any = None,
) -> Any:
    """Cases (n,) over (v~, y~), one mark for each name of ``groups``, which says whether a case
    belongs to it (n,); ``border`` gives v~crit(y~), NaN where the contact lifts off."""
    axes = own(axes)
    for (name, belongs), mark in zip(groups.items(), _MARKS, strict=False):
        shown = belongs & (v > 0.0) & (y > 0.0) & np.isfinite(v) & np.isfinite(y)
        if shown.any():
            axes.plot(v[shown], y[shown], mark, ms=5.0, label=regime_words(name))
    inside = y[(y > 0.0) & np.isfinite(y)]
    ends = (0.5 * float(inside.min()), 2.0 * float(inside.max())) if inside.size else Y_RANGE
    places = np.geomspace(*ends, 201)
    _plane(axes, np.full(201, np.nan) if border is None else border(places), places)
    finish(axes, "")
    return axes


def _plane(axes: Any, v_crit: Any, y: Any, normal: bool = False) -> None:
    axes.plot(v_crit, y, "--", color=RED, lw=2.0, label="border of continuous sliding")
    axes.set(xscale="log", yscale="linear" if normal else "log")
    speed = r"$\tilde v = v_0 k / (\mu_0 F_z \omega)$"
    size = r"$\tilde y = \hat F_z / F_z$" if normal else r"$\tilde y = y_0 k / (\mu_0 F_z)$"
    axes.set_xlabel(f"dimensionless speed {speed}\nfaster sliding $\\longrightarrow$")
    axes.set_ylabel(f"dimensionless amplitude {size}\nlarger amplitude $\\longrightarrow$")


# --- a steady cycle -------------------------------------------------------------------------------


def plot_cycle(
    t: Array,
    x: Array,
    y: Array,
    Fx: Array,
    Fy: Array,
    Fz: Array,
    mu0: float,
    title: str,
    axes: Any = None,
) -> Any:
    """Forces of one period over time, with the limit mu0 Fz, and the path of the upper point with
    the force's direction at 16 moments; all (n,), in SI.  ``axes`` are two, or new ones."""
    if axes is None:
        _, axes = _loaded("pyplot").subplots(1, 2, figsize=(10.0, 4.5), layout="constrained")
    forces, path = axes
    share = (t - t[0]) / (t[-1] - t[0])
    forces.plot(share, Fx, color=BLUE, label="$F_x$, along the drag")
    forces.plot(share, Fy, color=RED, label="$F_y$, across")
    forces.plot(share, mu0 * Fz, ":", color=GREY, label=r"$\pm\mu_0 F_z$")
    forces.plot(share, -mu0 * Fz, ":", color=GREY)
    mean = float(np.sum((Fx[1:] + Fx[:-1]) * np.diff(share)) / 2.0)
    forces.axhline(mean, lw=0.8, color=BLUE, ls="--", label="mean of $F_x$")
    forces.set(xlabel="share of the period [-]", ylabel="force [N]")
    finish(forces, title)
    micro = 1e6
    path.plot(micro * x, micro * y, color=INK, label="upper point")
    path.plot(micro * x[0], micro * y[0], "o", color=BLUE, label="start of the period")
    places = np.linspace(0, t.size - 1, 17).astype(int)[:-1]
    path.quiver(
        micro * x[places],
        micro * y[places],
        Fx[places],
        Fy[places],
        angles="xy",
        width=0.004,
        color=RED,
        label="force",
    )
    path.margins(0.15)
    path.set(xlabel=r"$x$ [µm]", ylabel=r"$y$ [µm]", aspect="equal", adjustable="datalim")
    finish(path, "")
    return axes
