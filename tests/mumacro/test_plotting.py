"""Pictures: what they show, on which axes, in every style, with nothing cut off."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import mumacro
from mumacro import Surrogate, plotting
from mumacro.fits.fitted import Fit
from mumacro.inputs.fields import KINDS, Kind, kind_of
from mumacro.questions.law import Law
from tests.support.cases import Case
from tests.support.comparing import close, title_of

pyplot = pytest.importorskip("matplotlib.pyplot")
pyplot.switch_backend("agg")

CASE: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}
SPEEDS = np.geomspace(1e-4, 10.0, 9)
RIG: Case = {"Fz": 10.0, "f": 20e3}
kinds = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: "-".join(kind.names.values()))


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    """No figure outlives its test, and none of another file is there."""
    pyplot.close("all")
    yield
    pyplot.close("all")


def case_of(kind: Kind, **more: Any) -> dict[str, Any]:
    """The usual case of a kind of contact, with some inputs replaced; None leaves one out."""
    case: dict[str, Any] = {**CASE, **kind.names}
    if kind.normal:
        del case["y0"]
        case["Fz_amplitude"] = 4.0
    case |= more
    return {name: x for name, x in case.items() if x is not None}


def a_fit(sets: int, own_mu0: bool = False) -> Fit:
    """A fit of points at several amplitudes."""
    s = Surrogate.open(1e-7)
    v0 = np.tile(np.geomspace(1e-3, 0.3, 7), sets)
    y0 = np.repeat(4e-7 * np.arange(1, sets + 1), 7)
    mu0 = 0.3 + 0.01 * np.sin(np.arange(v0.size)) if own_mu0 else np.full(v0.size, 0.3)
    mu = s.evaluate(mu0=mu0, k=1e7, y0=y0, v0=v0, **RIG).mu_macro
    noise = 2e-3 * np.cos(17.0 * np.arange(v0.size))
    columns = {"v0": v0, "y0": y0, "mu_macro": mu + noise} | ({"mu0": mu0} if own_mu0 else {})
    return mumacro.fit(columns, ["k"] if own_mu0 else None, surrogate=s, **RIG)


def a_law(surrogate: Surrogate) -> Law:
    return mumacro.law(surrogate, start=1e-4, stop=1.0, **case_of(KINDS[0], v0=None))


MOTION: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e5, "f": 50.0, "v0": 0.01}
PICTURES: dict[str, Callable[[Surrogate], Any]] = {
    "one case": lambda s: s.evaluate(**CASE),
    "rigid": lambda s: s.evaluate(**{**CASE, "k": "rigid"}),
    "interval": lambda s: s.evaluate(**case_of(KINDS[0], k=None, k_low=3e5, k_high=3e6)),
    "array": lambda s: s.evaluate(**{**CASE, "v0": SPEEDS}, direction="along"),
    "normal": lambda s: s.evaluate(**case_of(Kind(0, 2), v0=SPEEDS)),
    "map": lambda s: s,
    "law": a_law,
    "motion": lambda _: mumacro.motion(
        **MOTION, x=[(1, 1e-4, 0.0), (3, 2e-5, 45.0)], y=2e-5, normal=(8.0, -90.0)
    ),
    "solution": lambda s: mumacro.solve_for(s, "y0", [0.1, 0.2], **case_of(KINDS[0], y0=None)),
    "solution over f": lambda s: mumacro.solve_for(
        s, "f", 0.2, within=("1kHz", "1MHz"), **case_of(KINDS[0], f=None)
    ),
    "solution of an interval": lambda s: mumacro.solve_for(
        s, "v0", 0.2, **case_of(KINDS[0], v0=None, k=None, k_low=8e5, k_high=1.2e6)
    ),
    "solution over a load that stiffens": lambda s: mumacro.solve_for(
        s, "Fz", 0.2, contact="ball", **CASE
    ),
    "solution without a root": lambda s: mumacro.solve_for(
        s, "y0", 0.5, **case_of(KINDS[0], y0=None)
    ),
    "solution of a motion": lambda _: mumacro.solve_motion(
        "v0", [0.0, 0.1], **{name: x for name, x in MOTION.items() if name != "v0"}, x=1e-4,
        normal=(8.0, -90.0),
    ),
    "fit": lambda _: a_fit(1),
    "fit of sets": lambda _: a_fit(3),
    "fit of points with their own mu0": lambda _: a_fit(1, own_mu0=True),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "style"),
    # where the texts stand does not depend on colours: another style needs one of each form
    [(name, "default") for name in PICTURES]
    + [(name, "dark_background") for name in ("map", "law", "motion", "fit of sets")],
)
def test_nothing_is_cut_off_and_the_style_stays(
    surrogate: Surrogate, name: str, style: str
) -> None:
    drawn = PICTURES[name](surrogate)
    with pyplot.style.context(style):
        before = dict(pyplot.rcParams)
        figure = drawn.plot().figure
        assert dict(pyplot.rcParams) == before
        for one in figure.axes:
            # the paper is that of the style, and so is what is written beside it
            paper = pyplot.matplotlib.colors.to_rgba(pyplot.rcParams["axes.facecolor"])
            assert one.get_facecolor() == paper
            assert one.xaxis.label.get_color() == pyplot.rcParams["axes.labelcolor"]
        for dpi in (100, 200):
            figure.set_dpi(dpi)
            figure.canvas.draw()
            ends = figure.get_tightbbox().extents  # of all that is drawn [inches]
            assert (ends[:2] > -0.01).all(), (dpi, ends)
            assert (ends[2:] < figure.get_size_inches() + 0.01).all(), (dpi, ends)


@pytest.mark.parametrize(
    ("name", "panels"),
    [(name, 1) for name in PICTURES]
    + [(name, 2) for name in PICTURES if name.startswith(("motion", "fit"))],
)
def test_axes_that_are_given_are_drawn_on_and_the_first_are_returned(
    surrogate: Surrogate, name: str, panels: int
) -> None:
    drawn = PICTURES[name](surrogate)
    figure = pyplot.figure(layout="constrained")
    axes = figure.subplots(1, panels)
    assert drawn.plot(ax=axes) is np.ravel(axes)[0]
    assert all(one.has_data() for one in np.ravel(axes))
    assert pyplot.get_fignums() == [figure.number]


# --- cases on the map -----------------------------------------------------------------------------


@kinds
@pytest.mark.parametrize("v0", [0.01, SPEEDS])
def test_cases_stand_on_the_map_of_their_kind_though_no_groups_were_asked_for(
    surrogate: Surrogate, kind: Kind, v0: Any
) -> None:
    case = case_of(kind, v0=v0)
    axes = surrogate.evaluate(**case).plot()
    grouped = surrogate.evaluate(**case, include="groups")
    looks = {look.words: look for look in plotting.REGIMES.values()}
    places = {(x, y) for line in axes.lines if line.get_label() in looks for x, y in data(line)}
    expected = zip(np.ravel(grouped.v_tilde), np.ravel(grouped.y_tilde), strict=True)
    assert places == {*expected}
    (border,) = [line for line in axes.lines if "border" in line.get_label()]
    v, y = border.get_data()
    np.testing.assert_array_equal(v, surrogate.v_tilde_crit(y, **kind.names))
    assert not kind.normal or y[-1] == close(0.999, rel=1e-9)  # where the contact lifts off
    words = {"across": "amplitude across", "along": "amplitude along", "normal": "of the load"}
    assert words[kind.names["direction"]] in axes.get_ylabel()
    assert (r"\hat F_z / F_z" in axes.get_ylabel()) == kind.normal
    assert len(axes.figure.axes) == 2  # the second explains the colours


def data(line: Any) -> list[tuple[float, float]]:
    return [*zip(*line.get_data(), strict=True)]


@kinds
def test_a_regime_has_one_colour_and_mark_in_all_pictures(surrogate: Surrogate, kind: Kind) -> None:
    answer = surrogate.evaluate(**case_of(kind, v0=np.append(0.0, SPEEDS)))
    axes = answer.plot()
    regimes = {*answer.regime}
    shown = {line.get_label(): line for line in axes.lines}
    for name in regimes:
        look = plotting.REGIMES[name]
        assert (shown[look.words].get_color(), shown[look.words].get_marker()) == look[1:]
    of_words = {look.words: look.colour for look in plotting.REGIMES.values()}
    on_map = [text for text in axes.texts if text.get_text() in of_words]
    assert {text.get_text() for text in on_map} >= {
        plotting.REGIMES[name].words for name in regimes - {"static"}
    }
    assert len(on_map) == (3 if kind == kind_of("spring", "along") else 2)
    for text in on_map:
        assert text.get_color() == of_words[text.get_text()]


def test_the_looks_of_the_regimes_differ() -> None:
    assert {*plotting.REGIMES} == {*mumacro.REGIMES}
    for column in zip(*plotting.REGIMES.values(), strict=True):
        assert len({*column}) == len(plotting.REGIMES)


@pytest.mark.parametrize(
    ("kind", "more", "word"),
    [
        (KINDS[0], {"k": "rigid"}, "rigid"),
        (KINDS[1], {"k": math.inf}, "rigid"),
        (Kind(0, 1), {"k": "rigid"}, "rigid"),
        (Kind(0, 2), {"k": "rigid"}, "rigid"),
        (KINDS[0], {"k": "rigid", "v0": 0.0}, "rigid"),
        (KINDS[0], {"v0": 0.0}, "$v_0$ = 0"),
        (KINDS[0], {"y0": 0.0}, "not shaken"),
        (KINDS[0], {"f": 0.0}, "not shaken"),
        (KINDS[0], {"y0": 0.0, "v0": 0.0}, "not shaken"),
        (KINDS[0], {"k": 1e30}, "beyond the map"),
        (KINDS[0], {"k": ["rigid", 1e6, "rigid"]}, "rigid (2 cases)"),
    ],
)
def test_what_lies_beyond_the_map_stands_at_its_edge_with_a_word(
    surrogate: Surrogate, kind: Kind, more: Any, word: str
) -> None:
    axes = surrogate.evaluate(**case_of(kind, **more)).plot()
    assert word in [text.get_text() for text in axes.texts]
    v_ends, y_ends = axes.get_xlim(), axes.get_ylim()
    looks = {look.words for look in plotting.REGIMES.values()}
    places = [place for line in axes.lines if line.get_label() in looks for place in data(line)]
    assert all(v_ends[0] <= v <= v_ends[1] and y_ends[0] <= y <= y_ends[1] for v, y in places)
    assert any(v in v_ends or y in y_ends for v, y in places)


def test_a_rigid_case_stands_where_its_ray_leaves_the_map(surrogate: Surrogate) -> None:
    """There the friction of the map is that of the rigid contact, but for what is beyond."""
    for v0 in (1e-3, 0.1, 0.3, 10.0):
        answer = surrogate.evaluate(**{**CASE, "k": "rigid", "v0": v0})
        (place,) = data(answer.plot().lines[-1])
        assert place[1] / place[0] == close(2e-6 * 2.0 * math.pi * 20e3 / v0, rel=1e-12)
        assert surrogate.mu_ratio(*place) == close(answer.mu_ratio, abs=1e-3)


def test_an_interval_of_k_is_a_line_on_the_map(surrogate: Surrogate) -> None:
    ends = (3e5, 3e6)
    answer = surrogate.evaluate(**case_of(KINDS[0], k=None, k_low=ends[0], k_high=ends[1]))
    axes = answer.plot()
    (line,) = [line for line in axes.lines if "interval" in line.get_label()]
    places = data(line)
    for place, k in zip((places[0], places[-1]), ends, strict=True):
        one = surrogate.evaluate(**{**CASE, "k": k})
        assert place == close((one.v_tilde, one.y_tilde), rel=1e-12)
    assert f"{answer.mu_macro_low:.4g} to {answer.mu_macro_high:.4g}" in title_of(axes)


def test_a_million_cases_are_drawn_as_dots(surrogate: Surrogate) -> None:
    answer = surrogate.evaluate(**{**CASE, "v0": np.geomspace(1e-4, 10.0, 10**6)})
    sizes = {line.get_markersize() for line in answer.plot().lines[1:]}
    assert sizes == {2.0}


# --- the map, a law, a motion, a fit --------------------------------------------------------------


def test_a_law_draws_its_numbers_and_borders(surrogate: Surrogate) -> None:
    law = a_law(surrogate)
    axes = law.plot()
    np.testing.assert_array_equal(
        axes.lines[0].get_xydata(), np.column_stack((law.values, law.answer.mu_macro))
    )
    assert [line.get_xdata()[0] for line in axes.lines[2:]] == [one.value for one in law.border]


def test_a_motion_names_its_amplitudes_and_phases_and_shows_every_arrow() -> None:
    forces, path = (
        mumacro.motion(
            **MOTION, x=[(1, 1e-4, 0.0), (3, 2e-5, 45.0)], y=(3e-6, 450.0), normal=(8.0, -90.0)
        )
        .plot()
        .figure.axes
    )
    title = title_of(forces)
    for part in (
        "$x$: 0.1 mm, 3rd harmonic 20 µm at 45°",
        "$y$: 3 µm at 90°",
        "$F_z$: 8 N at -90°",
    ):
        assert part in title
    path.figure.canvas.draw()
    (arrows,) = path.collections
    tips = arrows.XY + np.column_stack([arrows.U, arrows.V])
    (x_low, x_high), (y_low, y_high) = path.get_xlim(), path.get_ylim()
    assert x_low < tips[:, 0].min() <= tips[:, 0].max() < x_high
    assert y_low < tips[:, 1].min() <= tips[:, 1].max() < y_high


@pytest.mark.parametrize("amplitude", [3e-9, 2e-6, 4e-3])
def test_a_path_is_drawn_in_the_unit_that_suits_it(amplitude: float) -> None:
    fast: Case = {"mu0": 0.3, "Fz": 10.0, "k": 3.0 / amplitude, "f": 100.0, "v0": amplitude}
    _, path = mumacro.motion(**fast, y=amplitude).plot().figure.axes
    unit, number = {3e-9: ("nm", 3.0), 2e-6: ("µm", 2.0), 4e-3: ("mm", 4.0)}[amplitude]
    assert path.get_ylabel() == f"$y$ [{unit}]"
    assert path.lines[0].get_ydata().max() == close(number, rel=1e-9)


@pytest.mark.parametrize("sets", [1, 3])
def test_a_fit_has_units_in_its_legend_and_residuals_below(sets: int) -> None:
    fit = a_fit(sets)
    axes, below = fit.plot().figure.axes
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    amplitudes = ["$y_0$ = 0.4 µm", "$y_0$ = 0.8 µm", "$y_0$ = 1.2 µm"]
    assert [word for word in words if "y_0" in word] == (amplitudes if sets > 1 else [])
    shown = np.concatenate([line.get_ydata() for line in below.lines[:sets]])
    assert shown == close(fit.residuals, rel=1e-12)
    assert below.get_shared_x_axes().joined(axes, below)
    alone = fit.plot(pyplot.figure().subplots())
    assert alone.get_xlabel() == below.get_xlabel() == "$v_0$ [m/s]"


@pytest.mark.parametrize(
    ("style", "curve"), [("default", "#1f77b4"), ("dark_background", "#8dd3c7")]
)
def test_curves_have_the_colours_of_the_style(surrogate: Surrogate, style: str, curve: str) -> None:
    law = a_law(surrogate)
    with pyplot.style.context(style):
        line = law.plot().lines[0]
        assert pyplot.matplotlib.colors.to_hex(line.get_color()) == curve
        assert line.get_linewidth() == pyplot.rcParams["lines.linewidth"]


def contrast(one: str, other: str) -> float:
    """Of two colours #rrggbb, by WCAG 2.2."""

    def luminance(colour: str) -> float:
        parts = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("paper", ["#ffffff", "#000000"])
def test_colours_that_no_style_chooses_are_seen_on_light_and_dark_paper(paper: str) -> None:
    for colour in [plotting.BORDER, *(look.colour for look in plotting.REGIMES.values())]:
        assert contrast(colour, paper) >= 3.0  # WCAG 2.2, 1.4.11: graphical objects


#: how colours are seen [linear light]: Machado, Oliveira and Fernandes, IEEE TVCG 15 (2009) 1291
SEEN = {
    "by most": np.eye(3),
    "without red": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "without green": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "without blue": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}


@pytest.mark.parametrize("seen", SEEN)
def test_neighbours_on_the_map_are_told_apart_by_everyone(seen: str) -> None:
    colours = plotting.band_colours()
    assert len(colours) == len(plotting.LEVELS) + 1
    assert (colours[0], colours[-1]) == (plotting.COLOURS[0], plotting.COLOURS[-1])
    coded = np.array([[int(one[i : i + 2], 16) / 255 for i in (1, 3, 5)] for one in colours])
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    light = np.clip(linear @ SEEN[seen].T, 0.0, 1.0) @ np.array([0.2126, 0.7152, 0.0722])
    lightness = 116.0 * np.cbrt(light) - 16.0  # L* of CIE 1976
    assert np.diff(lightness).min() > 2.5
    assert np.diff(lightness)[:2].min() > 8.0  # dark ones look more alike than pale ones
