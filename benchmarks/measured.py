"""Published measured friction beside the model: one pair of steel, dry and oiled, shaken along at
five speeds.

python benchmarks/measured.py [--only SECTION]     # also draws docs/img/measured.png

The points are the printed numbers of one open article, with their source in
tests/data/luo-2024.csv (dry) and luo-2024-oil.csv.  k is fitted by `mumacro.fit`; mu0 at each speed
is the force without shaking over the weight.  Forces do not depend on the weight: mu0 Fz and k
count alone.
"""

from tests.support.measuring import IMAGES, main, markdown, sections  # isort: split

import csv
import warnings
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro import Fit, Surrogate, fit, solve_for
from mumacro.plotting import BLUE, GREY, INK, RED, head, save
from tests.support.places import ROOT

Array = NDArray[np.float64]
DATA = ROOT / "tests" / "data"
FILES = {"dry": "luo-2024.csv", "oil": "luo-2024-oil.csv"}
FZ = 1.1 * 9.80665  # N, of the slider's weight; the article does not state the force
RIG: dict[str, Any] = {"Fz": FZ, "y0": 0.35e-6, "f": 26e3}
ALONG: dict[str, Any] = {"direction": "along"}
CONTACTS = ("spring", "ball")


class Points(NamedTuple):
    """Measured forces: of each speed, and the largest before sliding."""

    v0: Array  #: m/s, (5,)
    without: Array  #: N, (5,)
    shaken: Array  #: N, (5,)
    static_without: float  #: N
    static_shaken: float  #: N


@cache
def table() -> Surrogate:
    return Surrogate.open()


@cache
def points(surface: str = "dry") -> Points:
    with (DATA / FILES[surface]).open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    v0, without, shaken = (
        np.array([float(row[name]) for row in rows])
        for name in ("v0 [mm/s]", "force_without [N]", "force_with [N]")
    )
    return Points(1e-3 * v0[1:], without[1:], shaken[1:], float(without[0]), float(shaken[0]))


def fitted(contact: str, mu0: Any = None, unknowns: Any = None, surface: str = "dry") -> Fit:
    """k, with mu0 of each speed unless something else is given; ``unknowns`` as in ``fit``."""
    p = points(surface)
    columns = {"v0": p.v0, "mu_macro": p.shaken / FZ}
    if unknowns is None:
        columns["mu0"] = p.without / FZ if mu0 is None else mu0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they are in the result
        return fit(columns, unknowns, contact=contact, surrogate=table(), **ALONG, **RIG)


def force(contact: Any, k: Any, mu0: Any, v0: Any) -> Array:
    """Friction of the model [N]."""
    mu = table().evaluate(mu0=mu0, k=k, v0=v0, contact=contact, **ALONG, **RIG).mu_macro
    return np.asarray(FZ * mu)


def each_alone(contact: str, surface: str = "dry") -> Array:
    """k from each point alone [N/m]."""
    p = points(surface)
    return np.array(
        [
            solve_for(
                table(),
                "k",
                shaken / FZ,
                contact=contact,
                mu0=without / FZ,
                v0=v0,
                **ALONG,
                **RIG,
            )
            .roots[0][0]
            .value
            for v0, without, shaken in zip(p.v0, p.without, p.shaken, strict=True)
        ]
    )


def forces() -> str:
    """Each point beside the model: with the fitted k of a spring and a ball, and rigid."""
    p = points()
    mu0 = p.without / FZ
    spring, ball = (force(c, fitted(c).values["k"], mu0, p.v0) for c in CONTACTS)
    rigid = force("spring", "rigid", mu0, p.v0)
    rows = [
        [
            f"{1e3 * v0:g}",
            f"{without:.2f}",
            f"{shaken:.3f}",
            f"{a:.3f}",
            f"{b:.3f}",
            f"{c:.4f}",
            f"{shaken / c:.0f}",
        ]
        for v0, without, shaken, a, b, c in zip(
            p.v0, p.without, p.shaken, spring, ball, rigid, strict=True
        )
    ]
    header = (
        "v0 [mm/s]",
        "not shaken [N]",
        "shaken [N]",
        "spring [N]",
        "ball [N]",
        "rigid [N]",
        "shaken/rigid",
    )
    save(IMAGES / "measured.png", _draw, dpi=100, ncols=3, figsize=(12.0, 4.2))
    return markdown(header, rows, 0)


def stiffness() -> str:
    """The fitted k, what single points give, and where the points are."""
    p, rows = points(), []
    for contact in CONTACTS:
        solution = fitted(contact)
        k, (low, high) = solution.values["k"], solution.interval["k"]
        each = each_alone(contact)
        y = k * RIG["y0"] / p.without
        rows.append(
            [
                contact,
                f"{k / 1e6:.2f} ± {solution.std['k'] / 1e6:.2f}",
                f"{low / 1e6:.2f} to {high / 1e6:.2f}",
                f"{np.sqrt(solution.reduced_chi2):.4f}",
                f"{each.min() / 1e6:.2f} to {each.max() / 1e6:.2f}",
                f"{100.0 * np.abs(each / k - 1.0).max():.1f}",
                f"{y.min():.2f} to {y.max():.2f}",
            ]
        )
    header = (
        "contact",
        "k [N/µm]",
        "95 %",
        "scatter of mu",
        "each point alone",
        "off by at most [%]",
        "y0/l0",
    )
    return markdown(header, rows)


def trends() -> str:
    """What speaks against the model: friction at the slowest over that at the fastest speed, and
    the largest force before sliding."""
    p = points()
    mu0 = p.without / FZ
    slope, start = np.polyfit(np.log(p.v0), mu0, 1)
    rows = [
        [
            "measured",
            *[f"{p.shaken[0] / p.shaken[-1]:.2f}"] * 2,
            *[f"{p.static_shaken:.2f}"] * 2,
        ]
    ]

    def ratio(contact: str, k: float, at: Any) -> str:
        mu = force(contact, k, at, p.v0)
        return f"{mu[0] / mu[-1]:.2f}"

    cells = [ratio(c, fitted(c).values["k"], mu0) for c in CONTACTS]
    static = [
        f"{float(force(c, fitted(c).values['k'], p.static_without / FZ, 0.0)):.2f}"
        for c in CONTACTS
    ]
    rows.append(["mu0 of each speed", *cells, *static])
    # a spring here never slips backwards: its path of slip is v0 times a period
    case = {**RIG, "mu0": mu0, "k": fitted("spring").values["k"], "v0": p.v0}
    answer = table().evaluate(case, include="groups", **ALONG)
    stick = table().quantity("stick_fraction", answer.v_tilde, answer.y_tilde, **ALONG)[0]
    at = start + slope * np.log(p.v0 / (1.0 - stick))
    cell = ratio("spring", fitted("spring", at).values["k"], at)
    rows.append(["mu0 at the mean speed of slip", cell, "-", "-", "-"])
    one = np.full(p.v0.size, mu0.mean())
    cells = [ratio(c, fitted(c, one).values["k"], one) for c in CONTACTS]
    rows.append(["one mu0", *cells, "-", "-"])
    header = (
        "mu0",
        "slowest/fastest, spring",
        "ball",
        "before sliding [N], spring",
        "ball",
    )
    text = markdown(header, rows)
    k_static = [
        solve_for(
            table(),
            "k",
            p.static_shaken / FZ,
            contact=c,
            **ALONG,
            **{**RIG, "mu0": p.static_without / FZ, "v0": 0.0},
        )
        .roots[0][0]
        .value
        for c in CONTACTS
    ]
    more = [
        f"{100.0 * (a / fitted(c).values['k'] - 1.0):.0f}"
        for a, c in zip(k_static, CONTACTS, strict=True)
    ]
    spring, ball = k_static
    off = p.without - p.shaken
    free = [fitted(c, unknowns=("k", "mu0")) for c in CONTACTS]
    return " ".join(
        [
            f"{text}\n\nNot shaken less shaken is {off.min():.2f} to {off.max():.2f} N while it",
            f"slides, {p.static_without - p.static_shaken:.2f} N before. The force before sliding",
            f"asks for k = {spring / 1e6:.2f} N/µm (spring), {ball / 1e6:.2f} N/µm (ball):",
            f"{more[0]} % and {more[1]} % more. With k and mu0 both unknown the fit says:",
            f"{free[0].warnings[0]} (spring); {free[1].warnings[0]} (ball).",
        ]
    )


def oiled() -> str:
    """The oiled contact beside the model with the k that fits best, and k from each point alone."""
    p = points("oil")
    mu0 = p.without / FZ
    fits = [fitted(c, surface="oil") for c in CONTACTS]
    models = [force(c, f.values["k"], mu0, p.v0) for c, f in zip(CONTACTS, fits, strict=True)]
    alone = [each_alone(c, "oil") / 1e6 for c in CONTACTS]
    rows = [
        [f"{1e3 * v0:g}", f"{without:.2f}", f"{shaken:.3f}"]
        + [f"{column[i]:.2f}" for column in (*models, *alone)]
        for i, (v0, without, shaken) in enumerate(zip(p.v0, p.without, p.shaken, strict=True))
    ]
    header = (
        "v0 [mm/s]",
        "not shaken [N]",
        "shaken [N]",
        "spring [N]",
        "ball [N]",
        "k of a spring [N/µm]",
        "k of a ball [N/µm]",
    )
    ends = [
        f"{f.values['k'] / 1e6:.1f} N/µm ({c}, 95 %: "
        f"{f.interval['k'][0] / 1e6:.1f} to {f.interval['k'][1] / 1e6:.1f})"
        for c, f in zip(CONTACTS, fits, strict=True)
    ]
    off = [np.abs(model - p.shaken).max() for model in models]
    return " ".join(
        [
            f"{markdown(header, rows, 0)}\n\nThe k that fits best is {', '.join(ends)}. It is off",
            f"by up to {off[0]:.2f} N (spring), {off[1]:.2f} N (ball). From each point alone k is",
            f"{alone[0].min():.1f} to {alone[0].max():.1f} N/µm (spring),",
            f"{alone[1].min():.1f} to {alone[1].max():.1f} N/µm (ball).",
        ]
    )


def _draw(axes_of_all: Any) -> None:
    """docs/img/measured.png: all dry forces on logarithmic axes, the shaken ones alone, and the
    oiled contact."""
    p = points()
    v0 = np.geomspace(p.v0[0], p.v0[-1], 201)
    mu0 = np.interp(np.log(v0), np.log(p.v0), p.without / FZ)
    spring, ball = (force(c, fitted(c).values["k"], mu0, v0) for c in CONTACTS)
    mean = np.full(p.v0.size, p.without.mean() / FZ)
    one = force("spring", fitted("spring", mean).values["k"], mean[0], v0)
    oil = points("oil")
    mu0_oil = np.interp(np.log(v0), np.log(oil.v0), oil.without / FZ)
    oiled = [force(c, fitted(c, surface="oil").values["k"], mu0_oil, v0) for c in CONTACTS]
    left, middle, right = axes_of_all
    figure = left.figure
    for axes, curves in ((left, (spring, ball)), (middle, (spring, ball)), (right, oiled)):
        axes.plot(1e3 * v0, curves[0], color=BLUE, lw=2.0, label="one spring, $k$ fitted")
        axes.plot(1e3 * v0, curves[1], color=BLUE, lw=2.0, ls="--", label="ball, $k$ fitted")
        axes.set_xscale("log")
        axes.set_xticks(1e3 * p.v0, [f"{1e3 * x:g}" for x in p.v0], minor=False)
        axes.set_xticks([], minor=True)
        axes.set_xlabel(r"$v_0$ [mm/s]")
    rigid = force("spring", "rigid", mu0, v0)
    left.plot(1e3 * v0, rigid, color=GREY, lw=2.0, label="rigid contact")
    left.plot(1e3 * p.v0, p.without, "o", mfc="white", color=INK, label="measured, not shaken")
    left.plot(1e3 * p.v0, p.shaken, "o", color=INK, label="measured, shaken")
    left.set(yscale="log", ylabel="friction [N]", ylim=(1e-3, 6.0))
    left.set_yticks([0.001, 0.01, 0.1, 1.0], ["0.001", "0.01", "0.1", "1"])
    middle.plot(1e3 * v0, one, color=RED, lw=1.6, ls=":", label=r"one spring, one $\mu_0$")
    middle.plot(1e3 * p.v0, p.shaken, "o", color=INK)
    middle.set(ylabel="friction [N]", ylim=(0.0, 0.65))
    right.plot(1e3 * oil.v0, oil.without, "o", mfc="white", color=INK)
    right.plot(1e3 * oil.v0, oil.shaken, "o", color=INK)
    right.set(ylabel="friction [N]", ylim=(0.0, 4.0))
    head(left, "dry", legend=False)
    head(middle, "dry, shaken alone", legend=False)
    head(right, "oiled: not described", legend=False)
    figure.suptitle(
        f"Steel on steel, shaken along: $f$ = 26 kHz, $x_0$ = 0.35 µm, $F_z$ = {FZ:.4g} N",
        fontsize="medium",
    )
    handles = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
    handles |= dict(zip(*reversed(middle.get_legend_handles_labels()), strict=True))
    figure.legend(
        list(handles.values()), list(handles), loc="outside lower center", ncols=3, frameon=False
    )


SECTIONS = sections(forces, stiffness, trends, oiled)

if __name__ == "__main__":
    main(__doc__, SECTIONS)
