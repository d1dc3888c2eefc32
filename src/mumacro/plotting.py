"""Draw pictures with matplotlib, which is loaded for the first picture.

The functions draw what they get: arrays, names and marks.

The methods ``plot`` of :class:`mumacro.Surrogate`, :class:`mumacro.Answer`, of a law, of solutions,
motions and fits fill in the numbers.  Each draws on ``ax``: matplotlib axes of the caller, or new
ones.  For a picture with two panels ``ax`` is an array of two axes, or one, which then shows only
the first panel.  Each method returns the axes of its first panel, whose ``figure`` is the whole
picture.  It raises MumacroError if matplotlib is not installed.  Sizes, lines, grids and the
colours of curves follow the user's style.  The map has its own colours, the same as on the page,
and each regime has one colour everywhere.
"""

import importlib
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro.errors import InputError, MumacroError, missing
from mumacro.inputs.fields import AMPLITUDE, RAD_PER_CYCLE
from mumacro.inputs.units import format_number, suit_unit, tidy_zeros, unit_of
from mumacro.kernel.arrays import Array

ENDINGS = (".png", ".svg", ".pdf")
#: ranges of the map: v~ from very slow drag to fast sliding [-], and y~ [-]; for a normal force y~
#: is below 1, where the contact lifts off
V_RANGE, Y_RANGE, NORMAL_RANGE = (1e-4, 1e3), (1e-2, 1e3), (0.0, 0.999)
#: contours of mu~ on every map, and the ones with a number
LEVELS = (0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
LABELLED = (0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 0.99)
#: colours of every map, evenly spaced over the areas between two contours; darker means less
#: friction, also in black and white
COLOURS = ("#14285c", "#2f6aa8", "#4a9dbd", "#86c9b7", "#c6e5b3", "#fff9d6")
INK, BLUE, RED, GREY = "#16202c", "#0b5cad", "#a3242b", "#6b7683"
#: colour of all borders, readable on light and on dark paper
BORDER = "#c8323c"
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
_LINES = {"border of reverse slip": "-.", "border of continuous sliding": "--"}


class Look(NamedTuple):
    """Define how every picture shows a regime."""

    words: str
    colour: str
    mark: str  #: regimes differ without colour, too


#: regime -> its look in all pictures
REGIMES = {
    "continuous": Look("continuous sliding", "#c2410c", "o"),
    "stick_slip": Look("stick and slip", "#1d63c4", "s"),
    "partial_slip": Look("partial slip", "#00805a", "D"),
    "reverse_slip": Look("reverse slip", "#a33a8f", "^"),
    "static": Look("at rest", "#6b7683", "v"),
}
_MARKS = "osD^vPX"  # marks of the sets of measured points
_MOST_LABELS = 8  # limit of the curves in a legend
_MOST_RANGES = 20  # limit of the intervals of k on a map
_MANY = 1000  # from this number on, cases on a map are drawn as small dots
# weight of a label's distance to the border, relative to its distance to another line
_TO_BORDER = 0.4
_SIDE = 0.05  # part of the map at each side without labels
_LEGEND_WIDTH = 72  # characters of a legend above its axes
_ARROWS = 16  # number of arrows of the force along a path
#: places where the map names the regime, as fractions of its width and height, unless an earlier
#: one has it
AREAS = ((0.14, 0.735), (0.8, 0.12), (0.19, 0.25))


#: the panels of a picture, as ``subplots`` of matplotlib takes them: forces and path; curves and
#: residuals
OF_CYCLE: dict[str, Any] = {"ncols": 2, "figsize": (10.0, 5.0)}
OF_FIT: dict[str, Any] = {
    "nrows": 2,
    "figsize": (6.4, 5.6),
    "sharex": True,
    "height_ratios": (3.0, 1.0),
}


class MeasuredCurve(NamedTuple):
    """Hold measured points that have the same values of the other inputs, and the fit for them."""

    label: str  #: the inputs in which these points differ from the other sets
    x: Array  #: values of the points (n,)
    mu: Array  #: measured mu_macro [-], (n,)
    bars: Array | None  #: standard deviations of ``mu`` [-], (n,), if known
    residuals: Array  #: ``mu`` minus the fit [-], (n,)
    fine: Array  #: values of the curve (m,)
    model: Array  #: mu_macro of the fit at these values [-], (m,)
    off: Array  #: half the width of its band [-], (m,)


class Marks(NamedTuple):
    """Hold cases on a map."""

    v: Array  #: v~ (n,); infinite if the contact is rigid
    y: Array  #: y~ (n,); infinite if the contact is rigid
    ray: Array  #: y0 omega / v0 (n,): y~/v~, also where both are infinite
    regimes: NDArray[Any]  #: names (n,); empty for an illegal case
    words: NDArray[Any]  #: (n,); why a case is at an edge, empty for a case on the map
    #: for intervals of k: the softest and the stiffest k, divided by the k that is marked, (n,)
    ends: tuple[Array, Array] | None = None


def _loaded(name: str) -> Any:
    try:
        return importlib.import_module(f"matplotlib.{name}" if name else "matplotlib")
    except ModuleNotFoundError as error:
        raise MumacroError(missing("plot", error)) from None


def axes_for(ax: Any, **panels: Any) -> Any:
    """Return the matplotlib axes of the caller, or new ones; ``panels`` as :data:`OF_FIT`."""
    if ax is not None:
        return ax
    _, axes = _loaded("pyplot").subplots(layout="constrained", **panels)
    return axes


def _two_panels(ax: Any, panels: Mapping[str, Any]) -> tuple[Any, Any]:
    """Return two axes of the caller, or new ones.  The second is None if the caller has one."""
    axes = axes_for(ax, **panels)
    return tuple(axes) if np.ndim(axes) else (axes, None)


def style() -> AbstractContextManager[None]:
    """Return the style of this project's own pictures: those of the command and of the
    documents."""
    matplotlib = _loaded("")
    looks = {
        "axes.prop_cycle": matplotlib.cycler(color=[BLUE, RED, "#00805a", "#a33a8f", GREY, INK]),
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": "0.92",
        "lines.linewidth": 2.0,
    }
    context: AbstractContextManager[None] = matplotlib.rc_context(looks)
    return context


def save(path: str | Path, draw: Callable[[Any], Any], dpi: int = 150, **panels: Any) -> None:
    """Write a picture in the style of this project; ``draw`` gets its axes (several panels: an
    array of them).  Raise InputError if the name does not end in one of ``ENDINGS``."""
    path = Path(path)
    if path.suffix not in ENDINGS:
        endings = f"one that ends in {', '.join(ENDINGS)}, or for the command in .csv"
        raise InputError("file name", str(path), endings)
    # the same picture has the same bytes
    metadata = {".svg": {"Date": None}, ".png": {"Software": None}}.get(path.suffix)
    with style():
        size = panels.pop("figsize", (7.0, 4.8))
        figure = _loaded("figure").Figure(figsize=size, layout="constrained")
        draw(figure.subplots(**panels))
        figure.savefig(path, dpi=dpi, metadata=metadata)


# --- words ----------------------------------------------------------------------------------------


def case_title(case: Mapping[str, Any], kind: Mapping[str, str] | None = None) -> str:
    """Return the title of a picture of a case: the inputs [SI], numbers or (low, high), with
    contact and direction.

    >>> case_title({"mu0": 0.3, "Fz": 10.0, "k": 1e6}, {"contact": "ball", "direction": "along"})
    '$\\\\mu_0$ = 0.3, $F_z$ = 10 N, $k$ = 1 N/µm; ball, along'
    """
    inputs = ", ".join(quantity_words(name, value) for name, value in case.items())
    return "; ".join(part for part in (inputs, ", ".join((kind or {}).values())) if part)


def quantity_words(name: str, value: Any) -> str:
    """Return an input [SI], a number or (low, high), with its symbol and a suitable unit."""
    ends = [value] if np.ndim(value) == 0 else [*value]
    if isinstance(value, str) or math.isinf(ends[-1]):
        return f"{_SYMBOLS[name]} rigid"
    if name == "omega":
        name, ends = "f", [end / RAD_PER_CYCLE for end in ends]
    return f"{_SYMBOLS[name]} = {_in_suited_unit(unit_of(name), *ends)}"


def _in_suited_unit(si: str, *values: float) -> str:
    """Return numbers in an SI unit, in the unit that suits the last of them."""
    unit = suit_unit(si, values[-1])
    numbers = " to ".join(tidy_zeros(format_number(value, unit, 4)) for value in values)
    unit_text = unit.symbol.replace("um", "µm").replace("uN", "µN").removeprefix("-")
    return f"{numbers} {unit_text}".rstrip()


def motion_words(parts: Mapping[str, Iterable[tuple[int, float, float]]]) -> str:
    """Return a motion in words from the harmonics of its parts, their amplitudes in SI and their
    phases in degrees; a part that has no amplitude is left out.

    >>> motion_words({"x": [(1, 2e-6, 90.0), (3, 4e-7, 0.0)], "y": [(1, 0.0, 0.0)]})
    '$x$: 2 µm at 90°, 3rd harmonic 0.4 µm'
    """
    texts = []
    for name, terms in parts.items():
        symbol, unit = ("$F_z$", "N") if name == "normal" else (f"${name}$", "m")
        words = [_term_words(unit, *term) for term in terms if term[1] > 0.0]
        texts += [f"{symbol}: {', '.join(words)}"] if words else []
    return "; ".join(texts)


def _term_words(unit: str, harmonic: int, amplitude: float, degrees: float) -> str:
    last = 0 if harmonic // 10 % 10 == 1 else harmonic % 10
    ending = {1: "st", 2: "nd", 3: "rd"}.get(last, "th")
    order = "" if harmonic == 1 else f"{harmonic}{ending} harmonic "
    phase = math.remainder(degrees, 360.0)  # whole turns have no effect
    behind = f" at {phase:.4g}°" if abs(phase) > 1e-9 else ""
    return f"{order}{_in_suited_unit(unit, amplitude)}{behind}"


def _axis(name: str) -> str:
    return f"{_SYMBOLS.get(name, name)} [{unit_of(name)}]"


def head(ax: Any, title: str, legend: bool = True) -> None:
    """Write the title of axes in as many lines as it needs, and below it their legend, so that it
    covers no curve."""
    pad = 6.0
    handles, labels = ax.get_legend_handles_labels()
    if legend and labels:
        columns = min(3, len(labels), max(1, _LEGEND_WIDTH // (max(map(len, labels)) + 6)))
        em = _loaded("font_manager").FontProperties(size="small").get_size_in_points()
        pad += 1.7 * em * -(-len(labels) // columns)
        ax.legend(
            handles,
            labels,
            loc="lower left",
            bbox_to_anchor=(-0.01, 1.0),
            ncols=columns,
            frameon=False,
            fontsize="small",
            borderpad=0.2,
        )
    if title:
        unbroken = re.sub(r"(?<![,;]) ", "\N{NO-BREAK SPACE}", title)
        ax.set_title(unbroken, loc="left", fontsize="medium", pad=pad, wrap=True)


# --- curves of mu_macro ---------------------------------------------------------------------------


def plot_law(
    along: str,
    x: Array,
    mean: Array,
    ax: Any = None,
    *,
    of: str = "mu_macro",
    static: Array | None = None,
    band: tuple[Array, Array] | None = None,
    band_of: str = "k",
    borders: Iterable[tuple[float, str]] = (),
    roots_of: Mapping[float, Iterable[float]] = MappingProxyType({}),
    title: str = "",
) -> Any:
    """Draw a mean friction ``of`` a contact (n,) over values ``x`` (n,) of the input ``along``,
    with its ``static`` limit (n,).

    ``band`` are the smallest and the largest mu_macro over an interval of k, (n,) each, or with
    ``band_of`` "std" one deviation of the inputs up and down.  ``borders`` are places on ``x`` with
    their names, such as "border of continuous sliding". ``roots_of`` are values of the input to
    mark, by the mean [-] that they give.  ``title`` names the other inputs.
    """
    ax, ink = axes_for(ax), _ink()
    symbol = rf"$\mu_\mathrm{{{of.removeprefix('mu_')}}}$"
    ax.plot(x, mean, color="C0", label=symbol)
    if band:
        words = {"k": "for every $k$ of the interval", "std": "inputs one deviation up or down"}[
            band_of
        ]
        ax.fill_between(x, *band, color="C0", alpha=0.2, lw=0.0, label=words)
    if static is not None:
        ax.plot(x, static, ":", color=ink, alpha=0.7, label=r"static limit, $v_0 \to 0$")
    legend_names = set[str]()
    for value, name in borders:
        label = None if name in legend_names else name
        ax.axvline(value, ls=_LINES[name], lw=1.2, color=BORDER, label=label)
        legend_names.add(name)
    for target, roots in roots_of.items():
        places = [*roots]
        ax.axhline(target, lw=0.8, color=ink, label=f"target {target:.6g}")
        ax.plot(places, [target] * len(places), "o", color=ink, mec="white")
    if x[0] > 0.0 and x[-1] > 20.0 * x[0]:
        ax.set_xscale("log")
    ax.set(xlabel=_axis(along), ylabel=f"{symbol} [-]", xlim=(x[0], x[-1]))
    if static is not None:
        ax.set_ylim(bottom=0.0)
    head(ax, title)
    return ax


def plot_fit(along: str, curves: Sequence[MeasuredCurve], title: str, ax: Any = None) -> Any:
    """Draw measured points, the fit and its band over the input ``along``, and below them the
    residuals; more than 8 curves have no legend.

    ``ax`` is a pair of axes, or one (then no residuals are drawn), or None for new ones.  The upper
    axes are returned.
    """
    upper, lower = _two_panels(ax, OF_FIT)
    paper = _loaded("").rcParams["axes.facecolor"]
    for i, (one, mark) in enumerate(zip(curves, _MARKS * len(curves), strict=False)):
        points, band = (None, None) if i else ("measured", "95 % band of the fit")
        looks = {"fmt": mark, "color": f"C{i}", "mec": paper, "ms": 7.0}
        upper.errorbar(one.x, one.mu, one.bars, label=points, **looks)
        upper.plot(one.fine, one.model, color=f"C{i}", label=one.label)
        ends = one.model - one.off, one.model + one.off
        upper.fill_between(one.fine, *ends, color=f"C{i}", alpha=0.2, lw=0, label=band)
        if lower is not None:
            lower.errorbar(one.x, one.residuals, one.bars, **looks)
    x = np.concatenate([one.x for one in curves])
    low = x[x > 0.0].min(initial=math.inf)
    if low < x.max() / 10.0:
        scale = {"value": "symlog", "linthresh": low} if 0.0 in x else {"value": "log"}
        for ax in filter(None, (upper, lower)):
            ax.set_xscale(**scale)
    upper.set(ylabel=r"$\mu_\mathrm{macro}$ [-]")
    upper.set_ylim(bottom=min(0.0, upper.get_ylim()[0]))
    (upper if lower is None else lower).set_xlabel(_axis(along))
    if lower is not None:
        lower.axhline(0.0, lw=0.8, color=_ink())
        lower.set_ylabel("residual [-]")
        reach = 1.15 * max(map(abs, lower.get_ylim()))
        lower.set_ylim(-reach, reach)
    head(upper, title, legend=len(curves) <= _MOST_LABELS)
    return upper


def plot_loop(x: Array, force: Array, fitted: Array, title: str, ax: Any = None) -> Any:
    """Draw a measured loop, force [N] over displacement [m], and the loop of the model, and below
    them the residuals; ``ax`` as for :func:`plot_fit`."""
    upper, lower = _two_panels(ax, OF_FIT)
    unit, x = _in_one_unit(x)
    upper.plot(x, force, ".", color="C0", ms=4.0, label="measured")
    upper.plot(x, fitted, color="C1", lw=1.5, label="model")
    upper.set(ylabel=r"$F_t$ [N]")
    (upper if lower is None else lower).set_xlabel(f"displacement [{unit}]")
    if lower is not None:
        lower.plot(x, force - fitted, ".", color="C0", ms=4.0)
        lower.axhline(0.0, lw=0.8, color=_ink())
        lower.set_ylabel("residual [N]")
    head(upper, title)
    return upper


def _in_one_unit(*lengths: Array) -> tuple[Any, ...]:
    """Return the unit that suits the largest range of lengths [m], and the lengths in it."""
    unit, scale = suit_unit("m", float(max(map(np.ptp, lengths))))
    return unit.replace("um", "µm"), *(x * scale.over / scale.times for x in lengths)


def _ink() -> str:
    """Return the colour of text in the user's style."""
    return str(_loaded("").rcParams["text.color"])


# --- the map of mu~ -------------------------------------------------------------------------------


def amplitudes(n: int, normal: bool = False) -> Array:
    """Return ``n`` amplitudes from the bottom of the map to its top [-], evenly spaced on its axis:
    logarithmic, or linear for a ``normal`` force."""
    return np.linspace(*NORMAL_RANGE, n) if normal else np.geomspace(*Y_RANGE, n)


def speeds(n: int) -> Array:
    """Return ``n`` speeds from the left of the map to its right [-]."""
    return np.geomspace(*V_RANGE, n)


def band_colours() -> list[str]:
    """Return the colour of each area between two contours as #rrggbb, from below the lowest of
    ``LEVELS`` to above the highest."""
    # evenly spaced over the areas, not over mu~: below 0.1 and above 0.9 they would have nearly the
    # same colour
    areas = np.linspace(0.0, 1.0, len(LEVELS) + 1)
    table = np.array([[int(one[i : i + 2], 16) for i in (1, 3, 5)] for one in COLOURS])
    even = np.linspace(0.0, 1.0, len(COLOURS))
    channels = np.stack([np.interp(areas, even, column) for column in table.T], axis=1)
    return ["#" + "".join(f"{round(x):02x}" for x in one) for one in channels.tolist()]


def heights(ratio: Array, level: float) -> Array:
    """Return the height at which mu~ falls below a level above each speed, as a fraction of the
    map's height, (n,).  ``ratio`` (m, n) has rows that are evenly spaced on the map.  The height is
    1 where mu~ never falls below the level, 0 where it is below everywhere."""
    below = ratio < level
    first = np.where(below.any(axis=0), below.argmax(axis=0), len(ratio))
    row = np.clip(first, 1, len(ratio) - 1)
    over, under = (np.take_along_axis(ratio, i[None, :], axis=0)[0] for i in (row - 1, row))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (row - 1 + (over - level) / (over - under)) / (len(ratio) - 1)
    return np.where(first == 0, 0.0, np.where(first == len(ratio), 1.0, share))


def label_places(
    ratio: Array, border: Array, areas: Iterable[tuple[float, float]] = AREAS
) -> list[tuple[float, float, float]]:
    """Return the places of the numbers of the contours: (level, fraction of the width, fraction of
    the height).

    A number is at the point of its line that is farthest from the other lines, from the ``border``
    (n,) (a height at each speed), from the names of the regimes at ``areas`` and from the numbers
    that are already there.  A line that is not on the map has no number.
    """
    across = np.linspace(0.0, 1.0, ratio.shape[1])
    words = [(u + aside, w) for u, w in areas for aside in (-0.12, 0.0, 0.12)]  # a name is wide
    lines = {level: heights(ratio, level) for level in LEVELS}
    places: list[tuple[float, float, float]] = []
    for level in LABELLED:
        inside = (np.minimum(across, 1.0 - across) > _SIDE) & (
            np.abs(lines[level] - 0.5) < 0.5 - _SIDE
        )
        if not inside.any():
            continue
        x, y = across[inside], lines[level][inside]
        apart = np.min(
            [_distances(x, y, across, line) for i, line in lines.items() if i != level], axis=0
        )
        # the border is thicker than a line, and a number next to it is hard to read
        apart = np.minimum(apart, _TO_BORDER * _distances(x, y, across, border))
        for u, w in [*words, *(label[1:] for label in places)]:
            apart = np.minimum(apart, 0.5 * np.hypot(x - u, y - w))
        best = int(apart.argmax())
        places.append((level, float(x[best]), float(y[best])))
    return places


def _distances(x: Array, y: Array, across: Array, line: Array) -> Array:
    """Return the distances of points (m,) from a line of heights (n,) at ``across`` (n,)."""
    return np.asarray(np.hypot(x[:, None] - across, y[:, None] - line).min(axis=1))


def bands(ax: Any, x: Array, y: Array, ratio: Array) -> tuple[Any, Any]:
    """Draw mu~ (m, n) over ``x`` (n,) and ``y`` (m,) in the colours of the map, with its contours.
    Return the areas and lines of matplotlib."""
    levels = [0.0, *LEVELS, 1.0]
    areas = ax.contourf(x, y, np.clip(ratio, 0.0, 1.0 - 1e-12), levels, colors=band_colours())
    return areas, ax.contour(x, y, ratio, LEVELS, colors=INK, linewidths=0.6, alpha=0.75)


def plot_map(
    ratio: Array,
    v_crit: Array,
    ax: Any = None,
    *,
    marks: Marks | None = None,
    direction: str = "across",
    areas: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    reverse: tuple[Array, Array] | None = None,
    title: str = "",
) -> Any:
    """Draw mu~ (m, n) over :func:`speeds` and :func:`amplitudes`, with the border of continuous
    sliding ``v_crit`` (m,), and with cases as ``marks``.

    ``direction`` is the direction of the oscillation; ``areas`` are the regimes with the places of
    their names, of :data:`AREAS`; ``reverse`` are (v~, y~) of the border of reverse slip.
    """
    ax, normal = axes_for(ax), direction == "normal"
    v, y = speeds(ratio.shape[1]), amplitudes(len(ratio), normal)
    filled_areas, lines = bands(ax, v, y, ratio)
    halo = [_loaded("patheffects").withStroke(linewidth=2.5, foreground="white")]
    ax.plot(
        v_crit,
        y,
        "--",
        color=BORDER,
        lw=2.0,
        label="border of continuous sliding",
        path_effects=[_loaded("patheffects").withStroke(linewidth=3.5, foreground="white")],
    )
    if reverse is not None:
        ax.plot(*reverse, _LINES["border of reverse slip"], color=BORDER, path_effects=halo)
    ax.grid(visible=False)
    ax.set(xscale="log", yscale="linear" if normal else "log", xlim=V_RANGE, ylim=(y[0], y[-1]))
    speed = r"$\tilde v = v_0 k / (\mu_0 F_z \omega)$"
    ax.set_xlabel(f"dimensionless speed {speed}\nfaster sliding $\\longrightarrow$")
    ax.set_ylabel(f"{_AMPLITUDES[direction]}\nlarger amplitude $\\longrightarrow$")
    bar = ax.figure.colorbar(filled_areas, ax=ax, ticks=[0.0, *LEVELS, 1.0], format="%g", pad=0.02)
    bar.set_label(r"$\mu_\mathrm{macro} / \mu_0$ [-]")
    bar.ax.tick_params(labelsize="small")
    if marks is not None:
        _mark(ax, marks, normal, halo)
    head(ax, title)
    # labels are turned along the lines as they are at this moment
    ax.figure.draw_without_rendering()
    border_heights = np.interp(
        np.log(v), np.log(np.maximum(v_crit, 1e-300)), np.linspace(0.0, 1.0, len(y))
    )
    places = label_places(ratio, border_heights, areas.values())
    manual = [place(u, w, normal) for _, u, w in places]
    for text in ax.clabel(
        lines, levels=LABELLED, manual=manual, fmt="%g", fontsize=9.0, inline_spacing=3, colors=INK
    ):
        text.set_path_effects(halo)
    for name, (u, w) in areas.items():
        ax.annotate(
            REGIMES[name].words,
            (u, w),
            xycoords="axes fraction",
            ha="center",
            color=REGIMES[name].colour,
            fontsize=11.0,
            path_effects=halo,
        )
    return ax


_AMPLITUDES = {
    "across": r"amplitude across $\tilde y = y_0 k / (\mu_0 F_z)$",
    "along": r"amplitude along $\tilde y = y_0 k / (\mu_0 F_z)$",
    "normal": r"amplitude of the load $\tilde y = \hat F_z / F_z$",
}


def place(u: float, w: float, normal: bool = False) -> tuple[float, float]:
    """Return (v~, y~) at fractions of the map's width and height."""
    v = V_RANGE[0] * (V_RANGE[1] / V_RANGE[0]) ** u
    return v, NORMAL_RANGE[1] * w if normal else Y_RANGE[0] * (Y_RANGE[1] / Y_RANGE[0]) ** w


def on_map(v: Array, y: Array, ray: Array, normal: bool = False) -> tuple[Array, Array]:
    """Return where cases are drawn: (v~, y~) on the map, or at its edge.

    Far outside the map mu~ depends only on y~/v~.  So a case outside is drawn where its ray, on
    which this ratio is constant, leaves the map.  This is also right for rigid contacts.

    >>> on_map(*np.array([[0.1, np.inf], [0.5, np.inf], [5.0, 10.0]]))
    (array([  0.1, 100. ]), array([5.e-01, 1.e+03]))
    """
    v, y = np.asarray(v, np.float64), np.asarray(y, np.float64)
    if normal:
        return np.clip(v, *V_RANGE), np.clip(y, *NORMAL_RANGE)
    with np.errstate(all="ignore"):
        rigid = np.isinf(v) & np.isinf(y)
        ray = np.where(rigid, ray, y / v)
        # the corner where the ray leaves the map
        leaves = np.minimum(V_RANGE[1], Y_RANGE[1] / ray), np.minimum(Y_RANGE[1], ray * V_RANGE[1])
        out = rigid | ((y > Y_RANGE[1]) & (v > 1.0)) | ((v > V_RANGE[1]) & (y > 1.0))
        out &= np.isfinite(leaves[0]) & np.isfinite(leaves[1])
        v, y = np.where(out, leaves[0], v), np.where(out, leaves[1], y)
    return np.clip(v, *V_RANGE), np.clip(y, *Y_RANGE)


def _mark(ax: Any, marks: Marks, normal: bool, halo: Any) -> None:
    """Mark cases by regime.  Cases outside the map are at its edge, and one of them has the word
    that says why."""
    v, y = on_map(marks.v, marks.y, marks.ray, normal)
    regimes = np.asarray(marks.regimes, object)
    count = v.size
    looks: dict[str, Any] = {"ms": 10.0 if count == 1 else 7.0, "mec": "white", "mew": 1.5}
    if count > _MANY:
        looks = {"ms": 2.0, "mew": 0.0, "rasterized": True}
    if marks.ends is not None and count <= _MOST_RANGES:
        for i in range(count):
            shares = np.geomspace(marks.ends[0][i], marks.ends[1][i], 50)
            path = on_map(
                shares * marks.v[i], shares * marks.y[i], np.full(50, marks.ray[i]), normal
            )
            label = None if i else "the interval of $k$"
            ax.plot(*path, color=INK, lw=4.0, alpha=0.45, solid_capstyle="round", label=label)
    for name, look in REGIMES.items():
        here = regimes == name
        if here.any():
            ax.plot(
                v[here],
                y[here],
                look.mark,
                color=look.colour,
                label=look.words,
                zorder=5,
                clip_on=False,
                **looks,
            )
    words = np.asarray(marks.words, object)
    for word in dict.fromkeys(words[words != ""].tolist()):
        which = np.flatnonzero(words == word)
        number = f" ({which.size} cases)" if which.size > 1 else ""
        first = int(which[0])
        across = np.log(v[first] / V_RANGE[0]) / np.log(V_RANGE[1] / V_RANGE[0])
        right = bool(across > 0.5)
        _, middle = place(0.5, 0.5, normal)
        above = bool(y[first] > middle)
        ax.annotate(
            word + number,
            (v[first], y[first]),
            (-10.0 if right else 10.0, -12.0 if above else 12.0),
            textcoords="offset points",
            ha="right" if right else "left",
            va="top" if above else "bottom",
            color=INK,
            path_effects=halo,
            zorder=6,
        )


# --- a steady cycle -------------------------------------------------------------------------------


def plot_cycle(
    t: Array,
    x: Array,
    y: Array,
    Fx: Array,
    Fy: Array,
    Fz: Array,
    mu0: float,
    title: str = "",
    ax: Any = None,
) -> Any:
    """Draw the forces of one period over time, with the limit mu0 Fz, and the path of the upper
    point with the force at 16 moments; all (n,), in SI.

    ``ax`` is a pair of axes, or one (then no path is drawn), or None for new ones.  The axes of the
    forces are returned.
    """
    (forces, path), ink = _two_panels(ax, OF_CYCLE), _ink()
    share = (t - t[0]) / (t[-1] - t[0])
    forces.plot(share, Fx, color="C0", label="$F_x$, along the drag")
    forces.plot(share, Fy, color="C1", label="$F_y$, across")
    forces.plot(share, mu0 * Fz, ":", color=ink, alpha=0.7, label=r"$\pm\mu_0 F_z$")
    forces.plot(share, -mu0 * Fz, ":", color=ink, alpha=0.7)
    mean = float(np.sum((Fx[1:] + Fx[:-1]) * np.diff(share)) / 2.0)
    forces.axhline(mean, lw=0.8, color="C0", ls="--", label="mean of $F_x$")
    forces.set(xlabel="share of the period [-]", ylabel="force [N]", xlim=(0.0, 1.0))
    head(forces, title)
    if path is not None:
        _draw_path(path, x, y, Fx, Fy)
    return forces


def _draw_path(path: Any, x: Array, y: Array, Fx: Array, Fy: Array) -> None:
    """Draw the path of the upper point on its axes, with the force at 16 moments."""
    unit, x, y = _in_one_unit(x, y)
    path.plot(x, y, color=_ink(), label="upper point")
    path.plot(x[0], y[0], "o", color="C0", label="start of the period")
    moments = np.linspace(0, x.size - 1, _ARROWS + 1).astype(int)[:-1]
    # the longest arrow is a fifth of the path's extent
    length = 0.2 * max(np.ptp(x), np.ptp(y)) / max(float(np.hypot(Fx, Fy).max()), 1e-300)
    tips = np.stack([x[moments] + length * Fx[moments], y[moments] + length * Fy[moments]], axis=1)
    path.quiver(
        x[moments],
        y[moments],
        length * Fx[moments],
        length * Fy[moments],
        angles="xy",
        scale_units="xy",
        scale=1.0,
        width=0.004,
        color="C1",
        label="force",
        zorder=3,
    )
    path.update_datalim(tips)
    path.margins(0.08)
    path.set(xlabel=f"$x$ [{unit}]", ylabel=f"$y$ [{unit}]", aspect="equal", adjustable="datalim")
    path.autoscale_view()
    head(path, "")
