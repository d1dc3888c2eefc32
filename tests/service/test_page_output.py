"""The page in a browser: the numbers, the map, the friction law, the panels, downloads."""

import csv
import re
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from xml.etree import ElementTree

import numpy as np
import pytest

from mumacro import Surrogate, plotting
from mumacro.contacts.geometries import contact_of
from service.routers.page import ASSETS
from tests.support.browser import RECORDED, START
from tests.support.comparing import close

pytestmark = pytest.mark.slow
ODD, SEEN = (
    r"NaN|undefined|null|Infinity|\[object",
    "return document.querySelector('main').innerText;",
)
SKETCH = ("spring", "ball", "rigid", "across", "along", "normal")
# of the law's axis
HEADING = "return document.querySelector('#law > .upright').previousSibling.textContent;"


def test_it_loads_and_shows_the_known_value(
    open_page: Any, surrogate: Surrogate, live_server: Any
) -> None:
    page = open_page(new=True)
    answer = surrogate.evaluate(**START, gradient=True)
    assert page.number() == page.rounded(answer.mu_macro) == 0.2405
    assert page.text("#regime") == "stick slip"
    assert page.text("#model") == (
        "One model: one spring of stiffness k, oscillation across the sliding direction. It was "
        "compared with two published sets of points, shaken along: it describes the dry contact, "
        "not the oiled one."
    )
    assert page.text("#known").startswith("10\xa0% more or less of k changes µ by")
    assert page.find("#known").is_displayed()
    assert "one spring: a ball on a flat with the same k has µ = " in page.text("#rows")
    assert page.find("#rows").is_displayed()
    stick = surrogate.stick_fraction(answer.v_tilde, answer.y_tilde)
    power = surrogate.power(answer.v_tilde, answer.y_tilde) * 0.3 * 10 * 3e-6 * START["omega"]
    expected = {
        "µ/µ₀": f"{answer.mu_ratio:.4g}",
        "ṽ = v₀/(l₀ω)": f"{answer.v_tilde:.4g}",
        "ỹ = y₀/l₀": f"{answer.y_tilde:.4g}",
        "peak speed y₀ω": "251.3 mm/s",
        "stick fraction": f"{100 * stick:.4g} %",
        "shaker power": f"{1e3 * power:.4g} mW",
        "power saved": f"{1e3 * (0.3 - answer.mu_macro) * 0.1:.4g} mW",
        "answered by block": answer.source,
        "of table": f"{surrogate.id}, tolerance {surrogate.tolerance:g}",
        "numerical error of µ": f"≤ {answer.error_bound:.2g}".replace("e-0", "e-"),
    }
    assert expected.items() <= page.shown().items()
    assert not page.find("#origin").is_displayed()  # closed by default
    shares = [
        float(text.replace("−", "-").removesuffix(" %"))
        for text in page.texts("#bars td:last-child")
    ]
    for share, (name, value) in zip(shares, START.items(), strict=True):
        assert share == close(answer.gradient[name] * value / answer.mu_macro, abs=6e-4)
    # all digits are those that the table's bound supports
    page.click("#digits")
    assert page.number() == close(answer.mu_macro, abs=float(answer.error_bound))
    assert len(page.text("#mu")) > 10
    loaded = page.run("return performance.getEntriesByType('resource').map((entry) => entry.name);")
    assert len(loaded) >= len(ASSETS)
    assert {urlsplit(address).netloc for address in loaded} == {urlsplit(live_server.url).netloc}


def test_units_that_no_contact_has_are_told_beside_the_number(open_page: Any) -> None:
    page = open_page("#y0=2")
    assert re.fullmatch(r"Check the units: ỹ = .*: is y₀ = 2 in metres\?", page.text("#units"))
    assert page.find("#units").is_displayed()
    assert page.text("#rows") == ""
    page.type("#field-y0", "2 um")
    assert page.text("#units") == ""


def test_solving_for_an_input(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()
    page.click("#solve-form button")  # which amplitude halves the friction?
    match = page.wait_for("#solve-result", r"y₀ = (\S+) µm: µ = 0.15, stick slip, shaker (\S+) mW")
    assert surrogate.evaluate(**{**START, "y0": float(match[1]) * 1e-6}).mu_ratio == close(
        0.5, abs=1e-5
    )
    page.click("#solve-result button")
    assert (page.shown()["µ/µ₀"], page.shown()["shaker power"]) == ("0.5", f"{match[2]} mW")
    assert not page.is_old("#solve")
    page.type("#field-Fz", "12")  # the root was that of another case
    assert page.is_old("#solve")
    assert page.text("#solve-status").startswith("This was asked with other values.")
    page.choose("#unknown", "k", "input")
    page.type("#target", "99.9 %")
    page.wait_for("#solve-result", r"k = \S+ N/µm: µ = 0.29")
    page.type("#target", "2")
    page.wait_for("#solve-result", r"^No value gives that: here it can be \S+ to \S+\.$")
    for text, message in (
        ("half", "not a number"),
        ("0.5 N", "is not a unit"),
        ("-1", "refuses this: target.*>= 0"),
    ):
        page.type("#target", text)
        page.wait_for("#solve-status", message)
    page.choose("#target", "2", "input")
    assert not page.is_old("#solve")


def test_the_map_is_read_and_moved_on(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()
    page.touched("#map", 0.6, 0.4)
    read = page.wait_for("#map-read", r"ṽ = (\S+), ỹ = (\S+): µ/µ₀ ≈ (\S+)$")
    v, y, ratio = (float(read[i]) for i in (1, 2, 3))
    assert ratio == close(surrogate.mu_ratio(v, y), abs=0.01)
    page.touched("#map", 0.6, 0.4, click=True)
    shown = [float(page.shown()[name]) for name in ("µ/µ₀", "ṽ = v₀/(l₀ω)", "ỹ = y₀/l₀")]
    assert shown == [close(ratio, abs=0.01), close(v, rel=0.01), close(y, rel=0.01)]
    page = open_page()
    page.press("#map", "ARROW_RIGHT", "ARROW_UP")
    expected = surrogate.evaluate(**{**START, "v0": 0.0105, "y0": 2.1e-6})
    assert page.number() == page.rounded(expected.mu_macro)
    assert f"speed {page.rounded(expected.v_tilde, 3)}" in page.find("#map").get_attribute(
        "aria-label"
    )
    page.press("#law", "ARROW_LEFT")
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "y0": 2.1e-6}).mu_macro)


OUTSIDE = (
    ("#v0=100", (0, 0), "^$"),
    ("#v0=1e6", (1, 0), "ṽ = 2.65e6"),
    ("#v0=0", (-1, 0), "ṽ = 0"),
    ("#y0=1", (0, 1), "ỹ = 3.33e5"),
    ("#y0=0", (0, -1), "ỹ = 0"),
    ("#omega=0", (1, 0), "ṽ = ∞"),
    ("#v0=1e6&y0=1e-12", (1, -1), "ỹ = 3.33e-7"),
)


@pytest.mark.parametrize(("address", "side", "words"), OUTSIDE)
def test_a_point_outside_of_the_map_is_marked_on_its_frame(
    open_page: Any, address: Any, side: Any, words: Any
) -> None:
    page = open_page(address)
    assert re.search(words, page.text("#map-out"))
    x, y = page.run(
        "const [plot, point] = ['#map', '#map .point'].map((one) =>"
        " document.querySelector(one).getBoundingClientRect());"
        "return [(point.x + point.width / 2 - plot.x) / plot.width,"
        " (point.y + point.height / 2 - plot.y) / plot.height];"
    )
    sides = (x > 0.8) - (x < 0.2), (y < 0.1) - (y > 0.8)
    assert all(one in (0, at) for one, at in zip(side, sides, strict=True))
    assert page.text("#status") == ""


def test_the_map_has_a_colour_between_two_levels(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()
    levels = plotting.LEVELS
    v, y = (
        low.ravel() for low in np.meshgrid(np.geomspace(2e-4, 5e2, 30), np.geomspace(2e-2, 5e2, 30))
    )
    # places that lie clear of a level: the picture is interpolated
    around = [surrogate.mu_ratio(v * 1.02**i, y * 1.02**j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    bands = np.searchsorted(levels, around, side="right")
    clear = np.all(bands == bands[0], axis=0)
    x_share, y_share = (np.log10(v) + 4) / 7, 1 - (np.log10(y) + 2) / 5
    colours = page.run(
        "const plot = document.querySelector('#map'); plot.scrollIntoView();"
        "const { x: left, y: top, width, height } = "
        "plot.querySelector('.shade').getBoundingClientRect();"
        "const line = 0.25; return "  # half of its width, around the area
        f"{np.column_stack((x_share, y_share)).tolist()}.map(([x, y]) => "
        "document.elementsFromPoint(left + line + x * (width - 2 * line),"
        " top + line + y * (height - 2 * line)).find((one) => "
        "one.matches('.shade')).style.fill);"
    )
    painted = {
        (band, colour) for band, colour, good in zip(bands[0], colours, clear, strict=True) if good
    }
    assert (
        len(painted)
        == len({band for band, _ in painted})
        == len({colour for _, colour in painted})
        > 10
    )
    shades = [colour for _, colour in sorted(painted)]
    written = ["#" + "".join(f"{int(x):02x}" for x in re.findall(r"\d+", one)) for one in shades]
    assert written == plotting.band_colours()


def test_the_law_is_read_in_the_units_of_its_field_over_a_range(
    open_page: Any, surrogate: Surrogate
) -> None:
    page = open_page()
    page.touched("#law", 0.5, 0.5)
    read = page.wait_for("#law-read", r"v₀ = (\S+) mm/s: µ = (\S+),")
    expected = surrogate.evaluate(**{**START, "v0": float(read[1]) * 1e-3}).mu_macro
    assert float(read[2]) == close(expected, rel=1e-3)
    assert page.find("#range").get_attribute("placeholder") == "0.1..10000 mm/s"
    assert page.texts("#law .tick")[:6] == ["10⁻¹", "10⁰", "10¹", "10²", "10³", "10⁴"]
    assert {"0", "0.1", "0.2", "0.3"} <= set(page.texts("#law .tick"))
    page.type("#range", "5mm/s..2m/s")
    assert re.search(
        "at v₀ = 5 mm/s to.*at v₀ = 2000 mm/s", page.find("#law").get_attribute("aria-label")
    )
    page.type("#range", "0..100")
    # on a logarithmic scale
    page.wait_for("#law-status", "refuses this: .*start.* > 0.* Grey results")
    assert (page.is_old("#law-section"), page.is_old()) == (True, False)
    page.choose("#scale", "linear")
    assert page.text("#law-status") == ""
    page.type("#range", "5..x")
    assert page.text("#law-status").startswith("range: “x” is not a number.")
    page.type("#range", "")
    assert not page.is_old("#law-section")
    page.choose("#scale", "log")
    page.choose("#along", "omega")
    assert page.run(HEADING) == "f [kHz]"
    # a click selects the value at the pointer, in that unit
    page.touched("#law", 0.5, 0.5)
    at = float(page.wait_for("#law-read", r"f = (\S+) kHz")[1])
    page.touched("#law", 0.5, 0.5, click=True)
    assert float(page.value("#field-omega").removesuffix(" kHz")) == close(at, rel=0.05)


M_OF = {
    "law": "#law-section [name=stiffness_exponent]",
    "solve": "#solve [name=stiffness_exponent]",
}


def test_k_grows_with_the_load_along_fz(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page(new=True)
    fields = [page.find(selector) for selector in M_OF.values()]
    assert [field.is_displayed() for field in fields] == [False, False]
    page.choose("#along", "Fz")
    page.choose("#unknown", "Fz", "input")
    assert [field.is_displayed() for field in fields] == [True, True]
    assert [field.get_attribute("placeholder") for field in fields] == ["0", "0"]
    page.type(M_OF["law"], "1/2")
    assert page.value(M_OF["solve"]) == "1/2"
    page.touched("#law", 0.7, 0.5)
    read = page.wait_for("#law-read", r"Fz = (\S+) N: µ = (\S+),")
    load = float(read[1])
    grown = {**START, "Fz": load, "k": START["k"] * (load / 10.0) ** 0.5}
    assert float(read[2]) == close(surrogate.evaluate(**grown).mu_macro, rel=1e-2)
    # the point moves along the law, and k with it
    page.touched("#law", 0.7, 0.5, click=True)
    load = float(page.value("#field-Fz").removesuffix(" N"))
    k = START["k"] * (load / 10.0) ** 0.5
    assert 1e6 * float(page.value("#field-k").removesuffix(" N/µm")) == close(k, rel=1e-5)
    page.click("#reset")
    page.choose("#along", "Fz")
    page.choose("#unknown", "Fz", "input")
    page.type(M_OF["solve"], "0.5")
    page.click("#solve-form button")
    page.wait_for("#solve-result", r"^Fz = \S+ N: µ = 0.15, stick slip")
    page.click("#solve-result button")
    assert page.number() == 0.15
    assert not page.is_old("#solve")  # the same growth, from another load
    # the service says what it refuses, beside both fields
    page.type(M_OF["law"], "1.5")
    page.click("#solve-form button")
    for status in ("#law-status", "#solve-status"):
        page.wait_for(status, "stiffness_exponent: must be less than or equal to 1")
    page.type(M_OF["law"], "half")
    page.wait_for("#law-status", "^m: “half” is not a number")
    page.press(M_OF["law"], "ESCAPE")
    assert page.value(M_OF["law"]) == "1.5"
    page.choose("#along", "v0")
    assert (fields[0].is_displayed(), page.text("#law-status")) == (False, "")


def test_a_ball_under_another_load_is_stiffer_unless_it_is_said_otherwise(
    open_page: Any, tmp_path: Path
) -> None:
    with open_page.faked(RECORDED, "#contact=ball&along=Fz") as page:
        question = page.question("v1/law")
        assert (question["Fz"], question["stiffness_exponent"]) == (10, close(1.0 / 3.0, rel=1e-15))
        assert page.find(M_OF["law"]).get_attribute("placeholder") == "1/3"
        rows = [
            *csv.DictReader(page.download("#csv", tmp_path, "friction-law-Fz.csv").splitlines())
        ]
        for row in rows[:: len(rows) // 5]:
            assert float(row["k [N/m]"]) == close(
                1e6 * (float(row["Fz [N]"]) / 10) ** (1 / 3), rel=1e-9
            )
        page.type(M_OF["law"], "0")
        assert "Fz" not in page.question("v1/law")


@pytest.mark.parametrize("width", [390, 1280, 1440, 1920])
def test_the_exponent_appears_without_a_jump(open_page: Any, width: int) -> None:
    page = open_page(width=width)
    places = (
        "return ['field-v0', 'along', 'scale', 'range', 'law-image', 'solve', 'readout']"
        ".map((id) => document.getElementById(id).getBoundingClientRect().y + scrollY);"
    )
    before = page.run(places)
    page.choose("#along", "Fz")
    assert page.run(places) == before
    assert page.find(M_OF["law"]).is_displayed()
    page.choose("#unknown", "Fz", "input")
    assert page.run(places) == before
    assert page.run("return document.documentElement.scrollWidth;") <= width


ENDS = {
    "#direction=normal&along=Fz": "Fz [N]",
    "#direction=normal&along=Fz_amplitude&scale=linear": "ΔFz [N]",
    "#direction=normal&along=Fz_amplitude": "ΔFz [N]",
    "#contact=ball&along=Fz": "Fz [N]",
    "#k=0.8..1.2N/um&along=Fz&stiffness_exponent=1": "Fz [N]",
    "#k=rigid&along=Fz&contact=ball": "Fz [N]",
    "#along=mu0": "µ₀",
    "#along=Fz": "Fz [N]",
    "#along=k&scale=linear": "k [N/µm]",
    "#along=omega": "f [kHz]",
    "#along=y0&scale=linear": "y₀ [µm]",
    "#v0=1e307": "v₀ [m/s]",
    "#v0=1e-310&along=v0": "v₀ [m/s]",
    "#k=1e300&along=k": "k [N/m]",
    "#y0=0&omega=0&v0=0": "v₀ [m/s]",
    "#k=rigid&y0=0&v0=0": "v₀ [m/s]",
    "#k=rigid&along=k": "k [N/µm]",
    "#y0=1e300&omega=1e200&along=omega": "ω [rad/s]",
    "#mu0=1e-300&Fz=1e-10&along=mu0&scale=linear": "µ₀",
    "#v0=0&y0=3e-6": "v₀ [m/s]",
}


@pytest.mark.parametrize("address", ENDS)
def test_every_law_and_the_ends_of_every_range_are_answered(open_page: Any, address: str) -> None:
    page = open_page(address)
    assert page.number() >= 0
    assert page.run(HEADING) == ENDS[address]
    assert "Macroscopic friction from" in page.find("#law").get_attribute("aria-label")
    assert (page.text("#status"), page.text("#law-status")) == ("", "")
    assert not re.search(ODD, page.run(SEEN))


def test_downloads(open_page: Any, surrogate: Surrogate, tmp_path: Path) -> None:
    page = open_page()
    header, *rows = csv.reader(page.download("#csv", tmp_path, "friction-law-v0.csv").splitlines())
    assert header == ["v₀ [mm/s]", "mu_macro [-]", "mu_static [-]", "regime"]
    assert len(rows) == 301
    v0, mu = (np.array([float(row[i]) for row in rows]) for i in (0, 1))
    assert mu == close(surrogate.evaluate(**{**START, "v0": 1e-3 * v0}).mu_macro, rel=1e-12)
    for button, name in (("#law-image", "friction-law-v0.svg"), ("#map-image", "friction-map.svg")):
        picture = ElementTree.fromstring(page.download(button, tmp_path, name))  # noqa: S314 - our own file
        words = [one.text or "" for one in picture.iter("{http://www.w3.org/2000/svg}text")]
        assert words[-1].startswith("µ₀ = 0.3, Fz = 10 N, k = 1 N/µm, y₀ = 2 µm, f = 20 kHz")
        assert min(float(picture.attrib[side]) for side in ("width", "height")) >= 300
        # it looks the same without the page's style sheet
        assert all(
            "fill:" in one.attrib["style"]
            for one in picture.iter("{http://www.w3.org/2000/svg}path")
        )


@pytest.mark.parametrize(
    ("contact", "direction"),
    [
        ("spring", "across"),
        ("spring", "along"),
        ("spring", "normal"),
        ("ball", "across"),
        ("ball", "along"),
    ],
)
def test_all_contacts_and_directions_answer(
    open_page: Any, surrogate: Surrogate, contact: Any, direction: Any
) -> None:
    with open_page.faked(RECORDED) as page:
        page.click(f"[name=contact][value={contact}]")
        page.click(f"[name=direction][value={direction}]")
        normal = direction == "normal"
        there = {"#field-Fz_amplitude": normal, "#field-y0": not normal}
        there |= {f"#sketch .{one}": one in (contact, direction) for one in SKETCH}
        for selector, shown in there.items():
            assert page.find(selector).is_displayed() is shown
        page.type("#field-k", "0.8..1.2 N/um")
        assert (f"contact={contact}" in page.address()) is (contact != "spring")
        swing = {"y0": None, "Fz_amplitude": 5.0} if normal else {}
        case = {name: x for name, x in {**START, **swing, "k": None}.items() if x is not None}
        expected = surrogate.evaluate(
            **case, contact=contact, direction=direction, k_range=(8e5, 1.2e6)
        )
        match = page.wait_for("#interval", r"^(\S+) to (\S+) for k = 0.8..1.2 N/µm$")
        ends = [expected.mu_macro_low, expected.mu_macro_high]
        assert [float(match[1]), float(match[2])] == close(
            ends, abs=0.02 * (ends[1] - ends[0]) + 1e-9
        )
        assert len(page.texts("#law .band")) == 1
        assert (page.text("#rows") != "") is not normal
        # the map is that of this contact, with the point on it
        assert (page.text("#map-out"), len(page.texts("#map .point"))) == ("", 1)
        page.touched("#map", 0.4, 0.7)
        read = page.wait_for("#map-read", r"ṽ = (\S+), ỹ = (\S+): µ/µ₀ ≈ (\S+)$")
        v, y, ratio = (float(read[i]) for i in (1, 2, 3))
        exact, _, _ = surrogate.quantity("mu_ratio", v, y, contact=contact, direction=direction)
        assert ratio == close(exact, abs=0.02)
        assert page.question("v1/law")["k_range"] == close([8e5, 1.2e6], rel=1e-15)
        page.choose("#along", "k")
        assert "k_range" not in page.question("v1/law")
        assert not re.search(ODD, page.run(SEEN))
        assert page.text("#status") == page.text("#law-status") == ""
        page.touched("#map", 0.4, 0.7, click=True)
        groups = [float(page.shown()[name]) for name in page.shown() if name[0] in "ṽỹ"]
        assert groups == close([v, y], rel=0.01)
        page.click("#reset")
        assert (page.text("#map-out"), page.value("#field-k")) == ("", "1 N/µm")


def test_a_ball_whose_load_oscillates_cannot_be_chosen(open_page: Any) -> None:
    page = open_page("#contact=ball")
    normal, ball = (page.find(f"[value={name}]") for name in ("normal", "ball"))
    assert not normal.is_enabled()
    assert "not modelled" in page.text("#chosen")
    page.click("[name=contact][value=spring]")
    assert normal.is_enabled()
    page.click("[name=direction][value=normal]")
    assert not ball.is_enabled()
    assert "not modelled" in page.text("#chosen")
    page = open_page("#contact=ball&direction=normal")
    assert "direction = normal (not for a ball)" in page.text("#notice-text")
    assert page.find("[value=ball]").is_selected()


def test_no_message_moves_the_form(open_page: Any) -> None:
    page = open_page()
    places = (
        "return ['field-v0', 'answer', 'map', 'law'].map((id) =>"
        " document.getElementById(id).getBoundingClientRect().y);"
    )
    before = page.run(places)
    for text in ("5 mm", "", "abc", "12"):
        page.type("#field-Fz", text)
        assert page.run(places) == before
    for name in ("ball", "along", "spring", "normal", "across"):
        page.click(f"[type=radio][value={name}]")
        assert page.run(places)[0] == before[0]


def test_the_measured_example_is_loaded_and_fitted(open_page: Any) -> None:
    page = open_page()
    page.run("document.querySelectorAll('details').forEach((one) => { one.open = true; });")
    page.click("#example")
    assert page.value("#field-Fz") == "10.79 N"
    assert page.find("[value=along]").is_selected()
    page.run("[...document.querySelectorAll('#fit-form button')].at(-1).click();")
    page.wait_for("#fit-lines", r"^k = 9.974 N/µm ± 0.076 N/µm")  # docs/how-to/fit.md
    assert len(page.texts("#fit-plot :is(circle.measured, path.curve)")) == 6


def test_the_panels_ask_and_fill_the_form(
    open_page: Any, surrogate: Surrogate, tmp_path: Path
) -> None:
    with open_page.faked(RECORDED, "#contact=ball") as page:
        page.run("document.querySelectorAll('details').forEach((one) => { one.open = true; });")
        for name, text in (("radius", "5 mm"), ("E", "210 GPa"), ("nu", "0.3"), ("E2", "rigid")):
            page.type(f"#argument-{name}", text, commit=False)
        page.click("#stiffness-form button")
        arguments = {
            "radius": close(5e-3, rel=1e-15),
            "Fz": 10,
            "E": 210e9,
            "nu": 0.3,
            "E2": "rigid",
        }
        assert page.question("v1/stiffness") == {"geometry": "ball", **arguments}
        contact = contact_of("ball", radius=5e-3, Fz=10.0, E=210e9, nu=0.3, E2=np.inf)
        assert (
            page.text("#stiffness-result")
            == f"k = {contact.k / 1e6:.4g} N/µm at Fz = 10 N; contact: ball (Hertz)Use"
        )
        page.click("[name=contact][value=spring]")
        page.click("#stiffness-result button")
        assert page.value("#field-k") == f"{contact.k / 1e6:.6g} N/µm"
        assert page.find("[name=contact][value=ball]").is_selected()
        page.choose("#geometry", "cylinder", "input")
        assert page.value("#argument-radius") == "5 mm"  # what two geometries share stays
        for text, message in (
            (
                "10 parsec",
                "^length: “parsec” is not a unit of length: give m, .*Grey results belong",
            ),
            ("-1 mm", "refuses this: length"),
        ):
            page.type("#argument-length", text)
            page.wait_for("#stiffness-status", message)
        v0 = np.geomspace(1e-3, 1.0, 9)
        mu = surrogate.evaluate(**{**START, "k": 1.3e6, "v0": v0}, contact="ball").mu_macro
        rows = [
            f"{1e3 * speed!r};{friction!r};0.001"
            for speed, friction in zip(v0.tolist(), mu.tolist(), strict=True)
        ]
        page.choose("#points", "\n".join(["v0 [mm/s];mu;std", *rows]), "input")
        page.click("#fit-form button:not([type])")
        question = page.question("v1/fit")
        assert (question["v0"], question["mu_macro"]) == (
            close(v0.tolist(), rel=1e-14),
            mu.tolist(),
        )
        assert (question["contact"], question["unknowns"], "k" in question) == (
            "ball",
            ["k", "mu0"],
            False,
        )
        lines = page.texts("#fit-lines li")
        for line, pattern in zip(
            lines, ("k = 1.3 N/µm ± .*; µ₀ = 0.3 ± .*Use", "reduced χ² = .*"), strict=True
        ):
            assert re.fullmatch(pattern, line)
        assert len(page.texts("#fit-plot :is(circle.measured, .band, .curve)")) == 11
        assert "k = 1.3 N/µm" in page.download("#fit-image", tmp_path, "friction-fit.svg")
        page.click("#fit-lines button")
        assert float(page.value("#field-k").removesuffix(" N/µm")) == close(1.3, rel=1e-5)
        assert not page.is_old("#fit")
        page.choose("#points", "1 2 3 4", "input")
        assert page.is_old("#fit")  # the result is that of other points
        page.click("#fit-form button:not([type])")
        page.wait_for("#fit-status", "^needs two or three columns: v0, mu_macro, std; .*Grey")


def test_the_fit_takes_decimal_commas_and_a_column_mu0(
    open_page: Any, surrogate: Surrogate
) -> None:
    v0, mu0 = np.geomspace(1e-3, 1.0, 9), np.linspace(0.28, 0.32, 9)
    mu = surrogate.evaluate(**{**START, "k": 1.3e6, "v0": v0, "mu0": mu0}).mu_macro
    rows = [
        ";".join(f"{value!r}" for value in row).replace(".", ",")
        for row in zip((1e3 * v0).tolist(), mu.tolist(), mu0.tolist(), strict=True)
    ]
    with open_page.faked(RECORDED) as page:
        page.run("document.querySelectorAll('details').forEach((one) => { one.open = true; });")
        page.choose("#points", "\n".join(["v0 [mm/s];mu_macro;mu0", *rows]), "input")
        page.click("#fit-form button:not([type])")
        question = page.question("v1/fit")
        assert (question["v0"], question["mu_macro"]) == (
            close(v0.tolist(), rel=1e-14),
            mu.tolist(),
        )
        assert (question["mu0"], question["unknowns"]) == (mu0.tolist(), ["k"])
        (line,) = page.texts("#fit-lines li")
        assert re.fullmatch("k = 1.3 N/µm ± .*Use", line)
        assert page.text("#fit-status") == ""
        page.choose("#unknowns", "mu0", "input")
        page.click("#fit-form button:not([type])")
        page.wait_for("#fit-status", "^µ₀ is a column of the points: choose k as the unknown")
