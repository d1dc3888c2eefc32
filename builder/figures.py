"""Draw the figures of Benad, Nakano, Popov, Popov (2018), Fig. 4 to 11, from this project's solver
and a table.

The axes are the paper's: v~ over y~ in Fig. 4 to 6, mu~ over v~ in Fig. 8, the normalised rise over
v~/v~crit in Fig. 9, mu~ over v~/y~ in Fig. 10, mu_macro over v0 in Fig. 11.  Only Fig. 7 is turned
like every map here, y~ over v~.  Lines come from the table, dots from fresh solves, crosses and
dashed lines from the paper's formulas.  A figure is a function that takes a table and returns what
is drawn; the first line of its docstring is the title.  One function draws them all.  It needs
matplotlib, the extra ``figures``.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from builder.approximations import approximations, border_speeds
from mumacro import MumacroError, Surrogate, closed_forms, motion, plotting
from mumacro.kernel.arrays import Array
from mumacro.questions.law import law as friction_law

from .solver.steady import border

SIZE, DPI = (7.2, 4.8), 110
# blue, orange, green, vermilion and grey that colour-blind people can distinguish (Okabe and Ito)
COLOURS = ["#0072b2", "#e69f00", "#009e73", "#d55e00", *["#6b7683"] * 4]
V, Y, MU = (
    r"$\tilde v_0 = v_0/(l_0\omega)$",
    r"$\tilde y_0 = y_0/l_0$",
    r"$\tilde\mu_\mathrm{macro}$",
)


#: (v~, y~) -> title
CASES = {
    (0.6, 0.8): "continuous sliding",
    (0.1, 0.8): r"stick-slip, $\tilde y < 1$",
    (0.1, 1.5): r"stick-slip, $\tilde y > 1$",
}


class Curve(NamedTuple):
    """Hold points (n,), how matplotlib marks them, and a label; with ``z`` (m, n) a map over axes
    ``x`` (n,) and ``y`` (m,)."""

    x: Array
    y: Array
    look: str
    label: str = ""
    z: Array | None = None


class Panel(NamedTuple):
    """Hold one pair of axes: name, start and end of each; curves; text at points; settings of
    matplotlib's axes."""

    x: tuple[str, float, float]
    y: tuple[str, float, float]
    curves: list[Curve]
    notes: dict[tuple[float, float], str] = {}  # noqa: RUF012 - nothing changes it
    settings: dict[str, Any] = {}  # noqa: RUF012


def _solve_border(y: NDArray[Any]) -> Array:
    """Return v~crit, and mu~ at v~crit, for each amplitude (2, n); each is a solve of the full
    model."""
    return np.array([border(float(value)) for value in y]).T


def steady_cycle(v: float, y: float, steps: int = 2000) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the steady cycle at v~ = ``v``, y~ = ``y`` [-], by :func:`mumacro.motion`.

    Parameters
    ----------
    v, y : float
        Dimensionless speed and amplitude [-].
    steps : int
        Equal steps in a period.

    Returns
    -------
    tau : ndarray
        Phase at the end of each step [rad], shape (steps,), to 2 pi.
    u : ndarray
        Force of the spring over mu0 Fz [-], along and across the sliding direction, shape (steps,
        2).
    sticks : ndarray of bool
        Whether the contact point rests there, shape (steps,).

    Examples
    --------
    >>> tau, u, sticks = steady_cycle(0.1, 0.8)
    >>> round(float(u[:, 0].mean()), 4), round(float(sticks.mean()), 2)  # mu~, stick fraction
    (0.8064, 0.57)
    """
    cycle = motion(mu0=1.0, Fz=1.0, k=1.0, omega=1.0, v0=v, y=y, tolerance=1e-9).cycle(points=steps)
    u = np.stack([cycle.Fx, cycle.Fy], axis=1)[1:]
    return cycle.t[1:], u, np.hypot(*u.T) < 1.0 - 1e-9


def _cycle(_: Surrogate) -> list[Panel]:
    """Return one cycle of each regime: the force in the friction circle, and its components."""
    discs, traces, turn = [], [], np.linspace(0.0, 2.0 * np.pi, 361)
    for (v, y), title in CASES.items():
        tau, u, sticks = steady_cycle(v, y)
        (slip_x, slip_y), (stick_x, stick_y) = (
            np.where(mask[:, None], u, np.nan).T for mask in (~sticks, sticks)
        )
        mean = float(u[:, 0].mean())
        disc = [
            Curve(np.cos(turn), np.sin(turn), "0.6"),
            Curve(slip_x, slip_y, "k-", "slip"),
            Curve(stick_x, stick_y, "C3--", "stick"),
            Curve(np.array([mean]), np.zeros(1), "C0o", r"mean: $\tilde\mu$"),
        ]
        title = f"{title}\n$\\tilde v$ = {v:g}, $\\tilde y$ = {y:g}: $\\tilde\\mu$ = {mean:.3f}"
        trace = [
            Curve(tau, u[:, 0], "C0-", "$u_x$, along"),
            Curve(tau, u[:, 1], "C1-", "$u_y$, across"),
            Curve(tau, np.where(sticks, -1.05, np.nan), "C3-", "stick, below"),
        ]
        axes, settings = ("$u_x$, along", -1.1, 1.1), {"aspect": "equal", "title": title}
        discs.append(Panel(axes, ("$u_y$, across", -1.1, 1.1), disc, {}, settings))
        traces.append(Panel((r"$\tau = \omega t$", 0.0, 6.2832), ("", -1.1, 1.1), trace))
    return discs + traces


def _regions(s: Surrogate) -> list[Panel]:
    """Fig. 4: the two regimes and the line between small and large angles."""
    y, v = np.linspace(0.0, 5.0, 401), np.linspace(0.0, 2.5, 201)
    equality = r"(20) as an equality, $\tilde y = \sqrt{1+\tilde v^2}$"
    curves = [
        Curve(y, s.v_tilde_crit(y), "k-", "border, exact"),
        Curve(np.hypot(1.0, v), v, "C7--", equality),
    ]
    notes = {
        (1.0, 2.1): "continuous sliding",
        (4.1, 0.6): "stick and slip",
        (0.45, 0.75): "small angles",
        (3.6, 1.6): "large angles",
    }
    return [Panel((Y, 0.0, 5.0), (V, 0.0, 2.5), curves, notes)]


def _small_border(_: Surrogate) -> list[Panel]:
    """Fig. 5: the border at small amplitudes with (24)."""
    y, dots = np.linspace(0.0, 1.0, 201), np.linspace(0.05, 1.0, 20)
    curves = [
        Curve(y, closed_forms.border_24(y), "C0-", "(24)"),
        Curve(y, closed_forms.border_23(y), "C2--", "(23), of which (24) is an expansion"),
        Curve(dots, _solve_border(dots)[0], "ko", "exact, solved"),
    ]
    return [Panel((Y, 0.0, 1.02), (V, 0.0, 0.4), curves)]


def _whole_border(_: Surrogate) -> list[Panel]:
    """Fig. 6: the border with (26) and (27), and how far these are off."""
    y, dots, wide = (
        np.linspace(0.0, 10.0, 501),
        np.linspace(0.4, 10.0, 25),
        np.geomspace(0.03, 1e4, 401),
    )
    exact = _solve_border(wide)[0]
    formulas = ((closed_forms.border_26, "C3--", "(26)"), (closed_forms.border_27, "C0-", "(27)"))
    curves = [Curve(y, formula(y), look, label) for formula, look, label in formulas]
    deviations = [
        Curve(wide, 100.0 * (formula(wide) / exact - 1.0), look, label)
        for formula, look, label in formulas
    ]
    return [
        Panel(
            (Y, 0.0, 10.2),
            (V, 0.0, 1.7),
            [*curves, Curve(dots, _solve_border(dots)[0], "ko", "exact, solved")],
        ),
        Panel(
            (Y, 0.03, 1e4),
            ("formula over exact, less 1 [%]", -6.0, 6.0),
            deviations,
            {},
            {"xscale": "log"},
        ),
    ]


def _surface(s: Surrogate) -> list[Panel]:
    """Fig. 7: mu~ over the plane."""
    y, v = np.linspace(0.0, 2.0, 241), np.linspace(0.0, 1.5, 181)
    curves = [
        Curve(v, y, "", MU, s.mu_ratio(v, y[:, None])),
        Curve(s.v_tilde_crit(y), y, "C3--", "border of continuous sliding"),
    ]
    return [Panel((V, 0.0, 1.5), (Y, 0.0, 2.0), curves)]


def _cuts(s: Surrogate) -> list[Panel]:
    """Fig. 8: mu~ over v~ at 21 amplitudes."""
    v, amplitudes = np.linspace(0.0, 1.0, 801) ** 2 * 2.0, np.arange(21) * 0.1
    looks = ["k-" if i == 10 else "C0-" for i in range(21)]
    curves = [Curve(v, s.mu_ratio(v, y), look) for y, look in zip(amplitudes, looks, strict=True)]
    curves[0] = curves[0]._replace(label=r"exact, $\tilde y$ = 0 (top), 0.1, ..., 2 (bottom)")
    curves[10] = curves[10]._replace(label=r"exact, $\tilde y = 1$")
    crit, top = _solve_border(amplitudes[1:])
    curves.append(Curve(crit, top, "C3o", r"border: $\tilde\mu(\tilde v_\mathrm{crit})$, solved"))
    curves.append(
        Curve(np.zeros(11), closed_forms.static_limit(amplitudes[:11]), "C2s", "static value (16)")
    )
    return [Panel((V, 0.0, 2.0), (MU, 0.0, 1.03), curves)]


def _master_curve(s: Surrogate) -> list[Panel]:
    """Fig. 9: the rise from the static to the critical value, normalised."""
    x, inside, curves = np.linspace(0.0, 1.0, 601) ** 2 * 2.0, np.linspace(0.0, 1.0, 201), []
    for y in np.arange(1, 10) * 0.1:
        crit, low = float(s.v_tilde_crit(y)), float(closed_forms.static_limit(y))
        curves.append(
            Curve(x, (s.mu_ratio(x * crit, y) - low) / (s.mu_ratio(crit, y) - low), "C0-")
        )
    curves[0] = curves[0]._replace(label=r"exact, $\tilde y$ = 0.1, 0.2, ..., 0.9")
    curves.append(
        Curve(
            inside,
            closed_forms.master_curve_limit(inside),
            "k--",
            r"$N_0$, the limit $\tilde y \to 0$",
        )
    )
    curves.append(Curve(inside[::10], closed_forms.master_curve(inside[::10]), "C3x", "(28)"))
    share = (
        r"$(\tilde\mu - \tilde\mu_\mathrm{static})/(\tilde\mu_\mathrm{crit} - "
        r"\tilde\mu_\mathrm{static})$"
    )
    return [
        Panel((r"$\tilde v_0/\tilde v_{0,\mathrm{crit}}$", 0.0, 2.0), (share, 0.0, 1.12), curves)
    ]


def _large_amplitudes(s: Surrogate) -> list[Panel]:
    """Fig. 10: mu~ over v~/y~ with (35)."""
    x, dots = (
        np.linspace(0.0, 1.0, 401) ** 2 * 2.0,
        0.8 * np.array([1, 2, 3, 4, 6, 8, 12, 16, 25, 50, 100]),
    )
    curves = [Curve(x, s.mu_ratio(x * y, y), "C0-") for y in 0.8 * np.arange(1, 101)]
    curves[0] = curves[0]._replace(label=r"exact, $\tilde y$ = 0.8 (top), 1.6, ..., 80 (bottom)")
    crosses, (crit, top) = (
        np.concatenate([[0.01, 0.03, 0.06], np.arange(0.1, 2.01, 0.1)]),
        _solve_border(dots),
    )
    curves.append(Curve(crit / dots, top, "ko", "border, solved"))
    curves.append(Curve(crosses, closed_forms.outer(1.0 / crosses), "C3x", "(35)"))
    return [
        Panel(
            (r"$\tilde v_0/\tilde y_0 = v_0/(\omega y_0)$", 0.0, 2.0),
            (MU, 0.0, 1.03),
            curves,
        )
    ]


def _dimensional_law(s: Surrogate) -> list[Panel]:
    """Fig. 11: mu_macro over v0 of one contact at two amplitudes, with the paper's laws."""
    v0, curves = np.linspace(0.0, 1.0, 601) ** 2 * 0.25, []
    for y0, look in ((0.6e-6, "C0-"), (4e-6, "C2-")):
        case: dict[str, Any] = {
            "mu0": 0.5,
            "Fz": 10.0,
            "k": 5e6,
            "omega": 2.0 * np.pi * 20e3,
            "y0": y0,
        }
        law = friction_law(s, values=v0, **case)
        paper = approximations(s, law)
        curves.append(Curve(v0, law.answer.mu_macro, look, f"exact, $y_0$ = {y0 * 1e6:g} $l_0$"))
        if y0 > 1e-6:
            curves.append(Curve(v0, paper["rigid"], "C3:", "(37)"))
            continue
        curves.append(Curve(v0, paper["master_curve"], "C3--", "(28) from (38) to (40)"))
        x, y = np.array([[mark.value, mark.mu_macro] for mark in law.border]).T
        curves += [
            Curve(x, y, "ko", "border"),
            Curve(np.zeros(1), law.mu_static[:1], "ks", "static value (38)"),
        ]
        curves.append(
            Curve(border_speeds(s, law)["eq_24"][:1], paper["critical"][:1], "C3x", "(39), (40)")
        )
    speed = r"$v_0$ [m/s]   ($l_0$ = 1 $\mu$m, $\omega$ = 2$\pi$ 20 kHz)"
    return [Panel((speed, 0.0, 0.25), (r"$\mu_\mathrm{macro}$", 0.0, 0.53), curves)]


#: file name without suffix -> the panels of that figure, three in a row
FIGURES: dict[str, Callable[[Surrogate], list[Panel]]] = {
    "cycle": _cycle,
    "fig04_regions": _regions,
    "fig05_border_small_amplitude": _small_border,
    "fig06_border": _whole_border,
    "fig07_surface": _surface,
    "fig08_cuts": _cuts,
    "fig09_master_curve": _master_curve,
    "fig10_large_amplitude": _large_amplitudes,
    "fig11_friction_law": _dimensional_law,
}


def _draw(panel: Panel, axes: Any) -> None:
    for curve in panel.curves:
        if curve.z is None:
            axes.plot(curve.x, curve.y, curve.look, label=curve.label or None, ms=5, lw=1.4)
        else:
            _, lines = plotting.bands(axes, curve.x, curve.y, curve.z)
            axes.clabel(lines, fmt="%g", fontsize="small")
    for (x, y), text in panel.notes.items():
        axes.text(x, y, text, ha="center", va="bottom")
    (x_name, *x_ends), (y_name, *y_ends) = panel.x, panel.y
    axes.set(xlabel=x_name, ylabel=y_name, xlim=x_ends, ylim=y_ends, **panel.settings)
    axes.title.set_fontsize("small")
    axes.spines[["top", "right"]].set_visible(False)


def _legend(figure: Any) -> None:
    """Draw one legend for all panels below them, so that it covers no curve."""
    handles: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside lower center",
        ncols=3,
        frameon=False,
        fontsize="small",
    )


def draw_figures(surrogate: Surrogate, folder: Path) -> list[Path]:
    """Write every figure of :data:`FIGURES` to the existing ``folder`` as PNG, 792 x 528 pixels;
    return the paths.

    ``surrogate`` is the table for the lines.  The same picture has the same bytes.

    Raises
    ------
    MumacroError
        If matplotlib is not installed.
    """
    try:
        from cycler import cycler
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MumacroError(f"figures need the extra 'figures' (matplotlib): {error}") from error
    paths = []
    with rc_context({"axes.prop_cycle": cycler(color=COLOURS)}):
        for name, panels_of in FIGURES.items():
            panels, figure = panels_of(surrogate), Figure(figsize=SIZE, layout="constrained")
            FigureCanvasAgg(figure)
            axes_grid = figure.subplots(-(-len(panels) // 3), min(len(panels), 3), squeeze=False)
            for panel, axes in zip(panels, axes_grid.flat, strict=True):
                _draw(panel, axes)
            title = (panels_of.__doc__ or "").splitlines()[0].rstrip(".")
            figure.suptitle(title, x=0.01, ha="left", fontsize="medium")
            _legend(figure)
            paths.append(folder / f"{name}.png")
            # without the version of the drawing library
            figure.savefig(paths[-1], dpi=DPI, metadata={"Software": None})
    return paths
