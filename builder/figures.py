"""The figures of Benad, Nakano, Popov, Popov (2018), Fig. 4 to 11, drawn from this project's solver and a table.

Axes are the paper's: v~ over y~ in Fig. 4 to 7, mu~ over v~ in Fig. 8, the normalised rise over v~/v~crit in Fig. 9,
mu~ over v~/y~ in Fig. 10, mu_macro over v0 in Fig. 11.  Lines come from the table, dots from fresh solves, crosses and
dashed lines from the paper's formulas.  Before them one cycle of each regime.  Needs matplotlib, the extra ``figures``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate, closed_forms
from mumacro.law import approximations, border_speeds, friction_law

from .cycle import draw_cycles
from .steady import border

__all__ = ["FIGURES", "FiguresError", "draw_figures"]

Array = NDArray[np.float64]
INK, SOFT, RED, BLUE, GREEN = "#1f2328", "#8c959f", "#c1272d", "#1f6fb4", "#2c8a57"
SIZE, DPI = (7.2, 4.6), 110
STYLE: dict[Any, Any] = {"font.size": 11, "axes.edgecolor": INK, "legend.framealpha": 0.9, "legend.fontsize": 10}
V, Y, MU = r"$\tilde v_0 = v_0/(l_0\omega)$", r"$\tilde y_0 = y_0/l_0$", r"$\tilde\mu_\mathrm{macro}$"


class FiguresError(RuntimeError):
    """matplotlib is not installed."""


def _solved(y: NDArray[Any]) -> tuple[Array, Array]:
    """v~crit and mu~ there at each amplitude, each a solve of the full model."""
    pairs = np.array([border(float(value)) for value in y])
    return pairs[:, 0], pairs[:, 1]


def _regions(s: Surrogate, axes: Any) -> None:
    """Fig. 4: the two regimes and the line between small and large angles."""
    y = np.linspace(0.0, 5.0, 401)
    crit = s.v_tilde_crit(y)
    axes.fill_between(y, crit, 2.5, color="#e8f1e4", lw=0)
    axes.fill_between(y, 0.0, crit, color="#f6e7df", lw=0)
    axes.plot(y, crit, color=INK, lw=3.0, label="border, exact")
    v = np.linspace(0.0, 2.5, 201)
    equality = r"(20) as an equality, $\tilde y = \sqrt{1+\tilde v^2}$"
    axes.plot(np.hypot(1.0, v), v, color=SOFT, lw=1.6, ls="--", label=equality)
    axes.text(1.75, 2.1, "continuous sliding", ha="right", fontsize=13)
    axes.text(4.1, 0.6, "stick and slip", ha="center", fontsize=13)
    axes.text(0.45, 0.75, "small angles", ha="center", color="#59636e")
    axes.text(3.6, 1.6, "large angles", ha="center", color="#59636e")
    _frame(axes, (5.0, Y), (2.5, V))


def _small_border(_: Surrogate, axes: Any) -> None:
    """Fig. 5: the border at small amplitudes with (24)."""
    y = np.linspace(0.0, 1.0, 201)
    dots = np.linspace(0.05, 1.0, 20)
    axes.plot(y, closed_forms.border_24(y), color=BLUE, lw=2.0, label="(24)")
    axes.plot(y, closed_forms.border_23(y), color=GREEN, lw=1.4, ls="--", label="(23), of which (24) is an expansion")
    axes.plot(dots, _solved(dots)[0], "o", color=INK, ms=5, label="exact, solved")
    _frame(axes, (1.02, Y), (0.4, V), "upper left")


def _whole_border(_: Surrogate, axes: Any) -> None:
    """Fig. 6: the border with (26) and (27)."""
    y = np.linspace(0.0, 10.0, 501)
    dots = np.concatenate([np.linspace(0.1, 1.0, 7), np.linspace(1.5, 10.0, 18)])
    axes.plot(y, closed_forms.border_26(y), color=RED, lw=1.6, ls="--", label="(26)")
    axes.plot(y, closed_forms.border_27(y), color=BLUE, lw=2.0, label="(27)")
    axes.plot(dots, _solved(dots)[0], "o", color=INK, ms=5, label="exact, solved")
    inset = axes.inset_axes((0.56, 0.13, 0.41, 0.42))
    wide = np.geomspace(0.03, 1e4, 401)
    exact = np.array([border(float(value))[0] for value in wide])
    for formula, colour, style in ((closed_forms.border_26, RED, "--"), (closed_forms.border_27, BLUE, "-")):
        inset.plot(wide, 100.0 * (formula(wide) / exact - 1.0), color=colour, ls=style, lw=1.5)
    inset.axhline(0.0, color=SOFT, lw=0.8)
    inset.set(xscale="log", xlim=(0.03, 1e4), ylim=(-6.0, 6.0))
    inset.set_xlabel(r"$\tilde y$", fontsize=9, labelpad=1)
    inset.set_title("formula over exact, less 1 [%]", fontsize=9, pad=3)
    inset.tick_params(labelsize=8)
    _frame(axes, (10.2, Y), (1.7, V), "upper left")


def _surface(s: Surrogate, axes: Any) -> None:
    """Fig. 7: mu~ over the plane."""
    from matplotlib.patheffects import withStroke

    y, v = np.linspace(0.0, 2.0, 241), np.linspace(0.0, 1.5, 181)
    mu = s.mu_ratio(v[:, None], y[None, :])
    shown = axes.contourf(y, v, mu, levels=np.linspace(0.0, 1.0, 41), cmap="YlGnBu_r")
    lines = axes.contour(y, v, mu, levels=np.arange(0.1, 1.0, 0.1), colors=INK, linewidths=0.7)
    # along two rays, clear of the border
    places = [(1.9, 0.11), (1.9, 0.245), (1.9, 0.45), (1.85, 0.72), (1.55, 1.0), (0.95, 0.95)]
    for text in axes.clabel(lines, levels=lines.levels[[1, 3, 5, 6, 7, 8]], fmt="%.1f", fontsize=9, manual=places):
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
    axes.plot(y, s.v_tilde_crit(y), color=RED, lw=3.0, label="border")
    bar = axes.figure.colorbar(shown, ax=axes, pad=0.02, ticks=np.linspace(0.0, 1.0, 11))
    bar.set_label(r"$\tilde\mu = \mu_\mathrm{macro}/\mu_0$")
    _frame(axes, (2.0, Y), (1.5, V), "upper left")


def _cuts(s: Surrogate, axes: Any) -> None:
    """Fig. 8: mu~ over v~ at 21 amplitudes."""
    v = np.linspace(0.0, 1.0, 801) ** 2 * 2.0
    amplitudes = np.arange(21) * 0.1
    for y in amplitudes:
        bold = abs(y - 1.0) < 1e-9
        axes.plot(v, s.mu_ratio(v, float(y)), color=INK if bold else BLUE, lw=2.8 if bold else 1.0)
    for y in (0.5, 1.0, 1.5, 2.0):
        label = r"$\tilde y$ = 0.5" if y == 0.5 else f"{y:g}"
        axes.text(2.02, float(s.mu_ratio(2.0, y)), label, va="center", fontsize=10, color=INK)
    at, top = _solved(amplitudes[1:])
    axes.plot(at, top, "o", color=RED, ms=5, label=r"border: $\tilde\mu(\tilde v_\mathrm{crit})$, solved")
    static = closed_forms.static_limit(amplitudes[:11])
    axes.plot(np.zeros(11), static, "s", color=GREEN, ms=5.5, clip_on=False, label="static value (16)")
    axes.plot([], [], color=INK, lw=2.8, label=r"$\tilde y = 1$")
    _frame(axes, (2.0, V), (1.03, MU))


def _master_curve(s: Surrogate, axes: Any) -> None:
    """Fig. 9: the rise from the static to the critical value, normalised."""
    x = np.linspace(0.0, 1.0, 601) ** 2 * 2.0
    for y in np.arange(1, 10) * 0.1:
        crit = float(s.v_tilde_crit(y))
        low, top = float(closed_forms.static_limit(y)), float(s.mu_ratio(crit, float(y)))
        rise = (s.mu_ratio(x * crit, float(y)) - low) / (top - low)
        axes.plot(x, rise, color=BLUE, lw=1.0, label=None if y > 0.15 else r"exact, $\tilde y$ = 0.1, 0.2, ..., 0.9")
    axes.text(0.3, float(np.interp(0.3, x, rise)) + 0.01, r"$\tilde y$ = 0.9", ha="right", va="bottom", fontsize=10)
    inside = np.linspace(0.0, 1.0, 201)
    limit = closed_forms.master_curve_limit(inside)
    axes.plot(inside, limit, color=INK, lw=2.2, ls=(0, (4, 2)), label=r"$N_0$, the limit $\tilde y \to 0$")
    crosses = np.linspace(0.0, 1.0, 21)
    axes.plot(crosses, closed_forms.master_curve(crosses), "x", color=RED, ms=7, mew=1.6, label="(28)")
    share = r"$(\tilde\mu - \tilde\mu_\mathrm{static})/(\tilde\mu_\mathrm{crit} - \tilde\mu_\mathrm{static})$"
    _frame(axes, (2.0, r"$\tilde v_0/\tilde v_{0,\mathrm{crit}}$"), (1.12, share))


def _large_amplitudes(s: Surrogate, axes: Any) -> None:
    """Fig. 10: mu~ over v~/y~ with (35)."""
    import matplotlib as mpl

    x = np.linspace(0.0, 1.0, 401) ** 2 * 2.0
    shades = mpl.colormaps["viridis_r"]
    for i in range(1, 101):
        y = 0.8 * i
        axes.plot(x, s.mu_ratio(x * y, y), color=shades(0.15 + 0.85 * i / 100.0), lw=0.7)
    axes.axhline(1.0, color=shades(0.1), lw=1.2)
    dots = 0.8 * np.array([1, 2, 3, 4, 6, 8, 12, 16, 25, 50, 100])
    fine = np.geomspace(0.01, 80.0, 400)
    crit = s.v_tilde_crit(fine)
    axes.plot(crit / fine, s.mu_ratio(crit, fine), color=INK, lw=0.9)
    at, top = _solved(dots)
    axes.plot(at / dots, top, "o", color=INK, ms=4.5, label="border, solved")
    crosses = np.concatenate([[0.01, 0.03, 0.06], np.arange(0.1, 2.01, 0.1)])
    axes.plot(crosses, closed_forms.outer(1.0 / crosses), "x", color=RED, ms=7, mew=1.6, label="(35)")
    for y, where in ((0.8, 0.9), (1.6, 0.9)):
        label = r"$\tilde y$ = 0.8" if y == 0.8 else f"{y:g}"
        axes.text(where, float(s.mu_ratio(where * y, y)) + 0.012, label, fontsize=10, ha="center", va="bottom")
    axes.text(0.75, float(s.mu_ratio(60.0, 80.0)) - 0.045, "80", fontsize=10)
    _frame(axes, (2.0, r"$\tilde v_0/\tilde y_0 = v_0/(\omega y_0)$"), (1.03, MU))


def _dimensional_law(s: Surrogate, axes: Any) -> None:
    """Fig. 11: mu_macro over v0 of one contact at two amplitudes, with the paper's laws."""
    v0 = np.linspace(0.0, 1.0, 601) ** 2 * 0.25
    contact = {"mu0": 0.5, "Fz": 10.0, "k": 5e6, "omega": 2.0 * np.pi * 20e3}  # l0 = 1 um
    for y0, colour in ((0.6e-6, BLUE), (4e-6, GREEN)):
        case: dict[str, float | None] = {**contact, "y0": y0}
        law = friction_law(s, "v0", v0, case)
        paper = approximations(s, law, case)
        axes.plot(v0, law.answer.mu_macro, color=colour, lw=2.2, label=f"exact, $y_0$ = {y0 * 1e6:g} $l_0$")
        if y0 < 1e-6:
            axes.plot(v0, paper["master_curve"], color=RED, lw=1.6, ls=(0, (3, 2)), label="(28) from (38) to (40)")
            mark = law.border[0]
            axes.plot([mark.value], [mark.mu_macro], "o", color=INK, ms=6)
            axes.plot([0.0], [law.mu_static[0]], "s", color=INK, ms=6, clip_on=False)
            at = float(border_speeds(s, law, case)["eq_24"][0])
            axes.plot([at], [paper["critical"][0]], "x", color=RED, ms=8, mew=2.0, label="(39), (40)")
            line = {"arrowstyle": "-", "color": SOFT}
            axes.annotate("border", (mark.value, mark.mu_macro), (0.045, 0.402), arrowprops=line)
            axes.annotate("static value (38)", (0.0, law.mu_static[0]), (0.018, 0.345), arrowprops=line)
        else:
            axes.plot(v0, paper["rigid"], color=RED, lw=1.6, ls=":", label="(37)")
    axes.axhline(0.5, color=SOFT, lw=0.9)
    axes.text(0.249, 0.504, r"$\mu_0$", ha="right", va="bottom")
    speed = r"$v_0$ [m/s]   ($l_0$ = 1 $\mu$m, $\omega$ = 2$\pi$ 20 kHz)"
    _frame(axes, (0.25, speed), (0.53, r"$\mu_\mathrm{macro}$"))


def _frame(axes: Any, x: tuple[float, str], y: tuple[float, str], legend: str = "lower right") -> None:
    """Axes from 0, ``x`` and ``y`` their ends and names, and the legend."""
    axes.set(xlim=(0.0, x[0]), ylim=(0.0, y[0]), xlabel=x[1], ylabel=y[1])
    axes.legend(loc=legend)


#: file name without suffix -> what draws it on given axes
FIGURES: dict[str, Callable[[Surrogate, Any], None]] = {
    "cycle": draw_cycles,
    "fig04_regions": _regions,
    "fig05_border_small_amplitude": _small_border,
    "fig06_border": _whole_border,
    "fig07_surface": _surface,
    "fig08_cuts": _cuts,
    "fig09_master_curve": _master_curve,
    "fig10_large_amplitude": _large_amplitudes,
    "fig11_friction_law": _dimensional_law,
}


def draw_figures(surrogate: Surrogate, folder: Path) -> list[Path]:
    """Write every figure of :data:`FIGURES` to ``folder`` as PNG, 792 x 506 pixels.

    Parameters
    ----------
    surrogate : Surrogate
        The table that the lines come from.
    folder : Path
        An existing folder.

    Returns
    -------
    list of Path
        What was written, the cycles first, then in the order of the paper.

    Raises
    ------
    FiguresError
        Without matplotlib.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise FiguresError(f"figures need the extra 'figures' (matplotlib): {error}") from error
    written = []
    with rc_context(STYLE):
        for name, draw in FIGURES.items():
            figure = Figure(figsize=SIZE, layout="constrained")
            FigureCanvasAgg(figure)
            draw(surrogate, figure.add_subplot())
            path = folder / f"{name}.png"
            # no version of the drawing library in the file: the same picture is the same bytes
            figure.savefig(path, dpi=DPI, metadata={"Software": None})
            written.append(path)
    return written
