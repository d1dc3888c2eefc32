"""The page in a browser: the numbers, the map, the friction law, solving for an input, downloads."""

import csv
import re
from urllib.parse import urlsplit
from xml.etree import ElementTree

import numpy as np
import pytest

from browser import KNOWING, START
from comparing import close
from mumacro.geometries import contact_of
from service.routes.page import ASSETS

pytestmark = pytest.mark.slow


def test_it_loads_and_shows_the_known_value(open_page, surrogate, live_server):
    page = open_page(new=True)
    answer = surrogate.evaluate(**START, gradient=True)
    assert page.number() == page.rounded(answer.mu_macro) == 0.2405
    assert page.number("#ratio") == page.rounded(answer.mu_ratio)
    assert page.text("#regime") == "stick–slip"
    assert page.text("#model") == (
        "Model: one spring of stiffness k, oscillation across the sliding direction; not compared with measured points."
    )
    assert page.number("#v-tilde") == page.rounded(answer.v_tilde)
    assert page.text("#peak-speed") == "251.3 mm/s"
    stick = surrogate.stick_fraction(answer.v_tilde, answer.y_tilde)
    assert page.text("#stick") == f"{100 * stick:.4g} %"
    power = surrogate.power(answer.v_tilde, answer.y_tilde) * 0.3 * 10 * 3e-6 * START["omega"]
    assert page.text("#shaker") == f"{1e3 * power:.4g} mW"
    assert page.text("#saved") == f"{1e3 * (0.3 - answer.mu_macro) * 10 * 0.01:.4g} mW"
    # the source of the number is in a section that is closed by default
    assert not page.find("#bound").is_displayed()
    assert float(page.text("#bound").removeprefix("± ")) == page.rounded(answer.error_bound, 2)
    assert page.text("#source") == answer.source
    assert page.text("#table") == f"{surrogate.id}, tolerance {surrogate.tolerance:g}"
    for name, value in START.items():
        text = page.text(f"#bar-{name}").replace("−", "-").removesuffix(" %")
        assert float(text) == close(answer.gradient[name] * value / answer.mu_macro, abs=6e-4)
    # all digits are those that the table's bound supports
    page.click("#digits")
    assert page.number() == close(answer.mu_macro, abs=answer.error_bound)
    assert len(page.text("#mu")) > 10
    loaded = page.run("return performance.getEntriesByType('resource').map((entry) => entry.name);")
    assert len(loaded) >= len(ASSETS)
    assert {urlsplit(address).netloc for address in loaded} == {urlsplit(live_server.url).netloc}
    assert page.complaints() == []


def test_solving_for_an_input(open_page, surrogate):
    page = open_page()
    page.find("#solve-form button").click()  # which amplitude halves the friction?
    found = page.wait_for("#roots", r"y₀ = (\S+) µm: µ = 0.15, stick–slip, shaker (\S+) mW")
    root = surrogate.evaluate(**{**START, "y0": float(found[1]) * 1e-6})
    assert root.mu_ratio == close(0.5, abs=1e-5)
    page.find("#roots button").click()
    page.settle()
    assert page.number("#ratio") == 0.5
    assert page.text("#shaker") == f"{found[2]} mW"
    assert page.text("#roots") != ""
    page.type("#field-Fz", "12")  # the root was that of another case
    assert page.text("#roots") == ""
    page.choose("#unknown", "k", "input")
    page.type("#target", "99.9 %")
    assert len(page.find("#roots").find_elements("css selector", "li")) >= 1 or page.wait_for("#roots", "k =")
    page.type("#target", "2")
    page.wait_for("#solve-status", r"^No value of k gives that: µ/µ₀ can be from \S+ to \S+ here.$")
    for text, said in (("half", "not a number"), ("0.5 N", "no unit of friction"), ("-1", "must be >= 0")):
        page.type("#target", text)
        page.wait_for("#solve-status", said)
        assert page.find("#target").get_attribute("aria-invalid") == "true"
    page.choose("#target", "0.5", "input")
    assert page.text("#solve-status") == ""
    assert page.complaints() == []


def test_the_map_is_read_and_moved_on(open_page, surrogate):
    from selenium.webdriver import Keys

    page = open_page()
    page.touched("#map", 0.6, 0.4)
    read = page.wait_for("#map-read", r"ṽ = (\S+), ỹ = (\S+): µ/µ₀ ≈ (\S+)$")
    v, y, ratio = (float(read[i]) for i in (1, 2, 3))
    assert ratio == close(surrogate.mu_ratio(v, y), abs=0.01)
    page.touched("#map", 0.6, 0.4, click=True)
    page.settle()
    assert page.number("#ratio") == close(ratio, abs=0.01)
    assert page.number("#v-tilde") == close(v, rel=0.01)
    assert page.number("#y-tilde") == close(y, rel=0.01)
    assert page.complaints() == []
    page = open_page()
    page.find("#map").send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP)
    page.settle()
    expected = surrogate.evaluate(**{**START, "v0": 0.0105, "y0": 2.1e-6})
    assert page.number() == page.rounded(expected.mu_macro)
    assert f"speed {page.rounded(expected.v_tilde, 3)}" in page.find("#map").get_attribute("aria-label")
    page.find("#law").send_keys(Keys.ARROW_LEFT)
    page.settle()
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "y0": 2.1e-6}).mu_macro)
    assert page.complaints() == []


@pytest.mark.parametrize(
    ("address", "side", "said"),
    [
        ("#v0=100", (0, 0), ""),
        ("#v0=1e6", (1, 0), "ṽ = 2.65e6"),
        ("#v0=0", (-1, 0), "ṽ = 0"),
        ("#y0=1", (0, 1), "ỹ = 3.33e5"),
        ("#y0=0", (0, -1), "ỹ = 0"),
        ("#omega=0", (1, 0), "ṽ = ∞"),
        ("#v0=1e6&y0=1e-12", (1, -1), "ỹ = 3.33e-7"),
    ],
)
def test_a_point_outside_of_the_map_is_marked_on_its_frame(open_page, address, side, said):
    page = open_page(address)
    assert said in page.text("#map-out")
    assert bool(said) is bool(page.text("#map-out"))
    x, y = page.place("map")
    if side[0]:
        assert x > 0.8 if side[0] > 0 else x < 0.2
    if side[1]:
        assert y < 0.1 if side[1] > 0 else y > 0.8
    assert page.text("#status") == ""
    assert page.complaints() == []


def test_the_map_has_a_colour_between_two_levels(open_page, surrogate, repository):
    page = open_page()
    script = (repository / "service/static/page/map.js").read_text("utf-8")
    levels = [float(one) for one in re.search(r"LEVELS = \[(.*)\]", script)[1].split(",")]
    v, y = (low.ravel() for low in np.meshgrid(np.geomspace(2e-4, 5e2, 30), np.geomspace(2e-2, 5e2, 30)))
    # places that lie clear of a level: the picture is interpolated
    around = [surrogate.mu_ratio(v * 1.02**i, y * 1.02**j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    bands = np.searchsorted(levels, around, side="right")
    clear = np.all(bands == bands[0], axis=0)
    x_share, y_share = (np.log10(v) + 4) / 7, 1 - (np.log10(y) + 2) / 5
    colours = page.run(
        "const image = new Image(); image.src = document.querySelector('#map image').getAttribute('href');"
        "await image.decode();"
        "const context = new OffscreenCanvas(image.width, image.height).getContext('2d', { willReadFrequently: true });"
        "context.drawImage(image, 0, 0);"
        f"return {np.column_stack((x_share, y_share)).tolist()}.map(([x, y]) => [...context.getImageData("
        "Math.floor(x * image.width), Math.floor(y * image.height), 1, 1).data].slice(0, 3));"
    )
    told = {(band, tuple(colour)) for band, colour, good in zip(bands[0], colours, clear, strict=True) if good}
    assert len(told) == len({band for band, _ in told}) == len({colour for _, colour in told}) > 10
    shades = [colour for _, colour in sorted(told)]
    assert (shades[0], shades[-1]) == ((68, 1, 84), (253, 231, 37))  # viridis


def heading(page):
    """The title of the law's axis."""
    return page.run("return document.querySelector('#law > text[transform]').previousSibling.textContent;")


def test_the_law_is_in_the_units_of_its_field(open_page, surrogate):
    page = open_page()
    page.touched("#law", 0.5, 0.5)
    read = page.wait_for("#law-read", r"v₀ = (\S+) mm/s: µ = (\S+),")
    expected = surrogate.evaluate(**{**START, "v0": float(read[1]) * 1e-3}).mu_macro
    assert float(read[2]) == close(expected, rel=1e-3)
    page.type("#field-v0", "0.01 m/s")
    assert heading(page) == "v₀ [m/s]"
    page.choose("#along", "omega")
    assert heading(page) == "f [kHz]"
    # a click selects the value at the pointer, in that unit
    page.touched("#law", 0.5, 0.5)
    at = float(page.wait_for("#law-read", r"f = (\S+) kHz")[1])
    page.touched("#law", 0.5, 0.5, click=True)
    page.settle()
    assert float(page.value("#field-omega").removesuffix(" kHz")) == close(at, rel=0.05)
    assert page.complaints() == []


def test_the_range_of_the_law_is_chosen(open_page):
    page = open_page()
    assert page.find("#range").get_attribute("placeholder") == "0.1..10000 mm/s"
    page.type("#range", "5mm/s..2m/s")
    assert "at v₀ = 5 mm/s to" in page.find("#law").get_attribute("aria-label")
    assert "at v₀ = 2000 mm/s" in page.find("#law").get_attribute("aria-label")
    page.type("#range", "0..100")
    page.wait_for("#law-status", "refuses this: .*start.* > 0.* Grey results")  # on a logarithmic scale
    assert page.is_old("#law-section")
    assert not page.is_old()
    page.choose("#scale", "linear")
    assert page.text("#law-status") == ""
    page.type("#range", "5..x")
    assert page.text("#law-status").startswith("range: “x” is not a number.")
    page.type("#range", "")
    assert not page.is_old("#law-section")
    page.complaints()  # a refusal is logged by the browser


@pytest.mark.parametrize("along", ["mu0", "Fz", "k", "y0", "omega"])
def test_the_law_goes_along_every_input(open_page, along):
    linear = along in ("k", "y0")
    page = open_page(f"#along={along}&scale={'linear' if linear else 'log'}")
    head = {"mu0": "µ₀", "Fz": "Fz [N]", "k": "k [N/µm]", "y0": "y₀ [µm]", "omega": "f [kHz]"}[along]
    assert heading(page) == head
    assert "Macroscopic friction from" in page.find("#law").get_attribute("aria-label")
    assert (page.text("#status"), page.text("#law-status")) == ("", "")
    assert page.complaints() == []


@pytest.mark.parametrize(
    "address",
    [
        "#v0=1e307",
        "#v0=1e-310&along=v0",
        "#k=1e300&along=k",
        "#y0=0&omega=0&v0=0",
        "#k=rigid&y0=0&v0=0",
        "#k=rigid&along=k",
        "#y0=1e300&omega=1e200&along=omega",
        "#mu0=1e-300&Fz=1e-10&along=mu0&scale=linear",
        "#v0=0&y0=3e-6",
    ],
)
def test_the_ends_of_every_range_are_answered(open_page, address):
    page = open_page(address)
    assert page.number() >= 0
    assert (page.text("#status"), page.text("#law-status")) == ("", "")
    shown = page.run("return document.querySelector('main').innerText;")
    assert not re.search(r"NaN|undefined|null|Infinity|\[object", shown)
    assert page.complaints() == []


def test_downloads(open_page, surrogate, tmp_path):
    page = open_page()
    text = page.download("#csv", tmp_path, "friction-law-v0.csv").read_text("utf-8")
    header, *rows = csv.reader(text.splitlines())
    assert header == ["v₀ [mm/s]", "mu_macro [-]", "mu_static [-]", "regime"]
    assert len(rows) == 301
    v0, mu = (np.array([float(row[i]) for row in rows]) for i in (0, 1))
    assert mu == close(surrogate.evaluate(**{**START, "v0": 1e-3 * v0}).mu_macro, rel=1e-12)
    for button, name in (("#law-image", "friction-law-v0.svg"), ("#map-image", "friction-map.svg")):
        text = page.download(button, tmp_path, name).read_text("utf-8")
        picture = ElementTree.fromstring(text)  # noqa: S314 - our own file
        words = [one.text for one in picture.iter("{http://www.w3.org/2000/svg}text")]
        assert words[-1].startswith("µ₀ = 0.3, Fz = 10 N, k = 1 N/µm, y₀ = 2 µm, f = 20 kHz")
        assert min(float(picture.get(side)) for side in ("width", "height")) >= 300
        # it looks the same without the page's style sheet
        assert all("fill:" in one.get("style") for one in picture.iter("{http://www.w3.org/2000/svg}path"))
    assert page.complaints() == []


@pytest.mark.parametrize("direction", ["across", "along", "normal"])
@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_every_contact_and_direction_is_answered(open_page, surrogate, contact, direction):
    page = open_page(f"#contact={contact}&direction={direction}&k=0.8..1.2N/um")
    if (contact, direction) == ("ball", "normal"):
        page.wait_for("#status", "refuses this: .*(ball|contact)")
        page.complaints()
        return
    swing = {"y0": None, "Fz_amplitude": 5.0} if direction == "normal" else {}
    case = {name: x for name, x in {**START, **swing, "k": None}.items() if x is not None}
    expected = surrogate.evaluate(**case, contact=contact, direction=direction, k_range=(8e5, 1.2e6))
    told = page.wait_for("#interval", r"^(\S+) to (\S+) for k = 0.8..1.2 N/µm$")
    ends = [expected.mu_macro_low, expected.mu_macro_high]
    assert [float(told[1]), float(told[2])] == close(ends, abs=0.02 * (ends[1] - ends[0]) + 1e-9)
    assert page.run("return document.querySelectorAll('#law .band').length;") == 1
    assert (page.text("#rows") != "") is (direction != "normal")
    assert not re.search(r"NaN|undefined|null|\[object", page.run("return document.querySelector('main').innerText;"))
    assert page.text("#status") == page.text("#law-status") == ""
    assert page.complaints() == []


def test_the_panels_answer(open_page, surrogate):
    page = open_page("#contact=ball&mu0=0.3", new=True)
    page.run("document.querySelectorAll('details').forEach((one) => { one.open = true; });")
    for name, text in (("radius", "5 mm"), ("E", "210 GPa"), ("nu", "0.3")):
        page.type(f"#argument-{name}", text, commit=False)
    page.click("#stiffness-form button")
    found = contact_of("ball", radius=5e-3, Fz=10.0, E=210e9, nu=0.3)
    assert page.text("#stiffness-found") == f"k = {found.k / 1e6:.4g} N/µm at Fz = 10 N; contact: ball (Hertz)"
    v0 = np.geomspace(1e-3, 1.0, 9)
    mu = surrogate.evaluate(**{**START, "k": 1.3e6, "v0": v0}, contact="ball").mu_macro
    rows = "".join(
        rf"{1e3 * speed!r};{friction!r};0.001\n" for speed, friction in zip(v0.tolist(), mu.tolist(), strict=True)
    )
    page.run(f"document.querySelector('#points').value = 'v0 [mm/s];mu;std\\n{rows}';")
    page.click("#fit-form button")
    assert page.text("#fit-status") == ""
    assert page.text("#fit-found").startswith("k = 1.3 N/µm ± ")
    assert page.run("return document.querySelectorAll('#fit-plot :is(.measured, .band, .curve)').length;") == 11
    page.click("#fit-use")
    assert float(page.value("#field-k").removesuffix(" N/µm")) == close(1.3, rel=1e-5)
    page.type("#argument-nu", "0.7", commit=False)
    page.click("#stiffness-form button")
    page.wait_for("#stiffness-status", "refuses this: nu")
    page.complaints()  # a refusal is logged by the browser


def test_the_panels_ask_and_fill_the_form(open_page, tmp_path):
    with open_page.faked(KNOWING) as page:
        page.settle()
        page.run("document.querySelectorAll('details').forEach((one) => { one.open = true; });")
        for name, text in (("radius", "5 mm"), ("E", "210 GPa"), ("nu", "0.3"), ("E2", "rigid")):
            page.type(f"#argument-{name}", text, commit=False)
        page.click("#stiffness-form button")
        assert page.asked("v1/stiffness") == {
            "geometry": "ball", "Fz": 10, "radius": close(5e-3, rel=1e-15), "E": 210e9, "nu": 0.3, "E2": "rigid",
        }  # fmt: skip
        assert page.text("#stiffness-found") == "k = 13.07 N/µm at Fz = 10 N; contact: ball (Hertz)"
        page.choose("#geometry", "cylinder")
        assert page.value("#argument-radius") == "5 mm"  # what two geometries share stays
        page.type("#argument-length", "10 parsec", commit=False)
        page.click("#stiffness-form button")
        page.wait_for("#stiffness-status", "^length: “parsec” is not a unit of length: give m, .*Grey results belong")
        page.click("#stiffness-use")
        assert (page.value("#field-k"), page.find("[name=contact][value=ball]").is_selected()) == ("13.07 N/µm", True)
        page.run(
            "document.querySelector('#points').value = 'v0 [mm/s]\\tmu\\tstd\\n1\\t0.1\\t0.01\\n100\\t0.2\\t0.01';"
        )
        page.click("#fit-form button")
        asked = page.asked("v1/fit")
        assert asked == {
            "Fz": 10, "y0": close(2e-6, rel=1e-15), "omega": close(START["omega"], rel=1e-15), "contact": "ball",
            "unknowns": ["k", "mu0"], "v0": close([1e-3, 0.1], rel=1e-15), "mu_macro": [0.1, 0.2], "std": [0.01, 0.01],
        }  # fmt: skip
        assert page.run("return [...document.querySelectorAll('#fit-found li')].map((one) => one.textContent);") == [
            "k = 1.3 N/µm ± 0.02 N/µm (95 %: 1.26 N/µm to ∞)", "µ₀ = 0.29 not determined (95 %: 0.28 to 0.3)",
            "the points allow as well: k = rigid, µ₀ = 0.3", "reduced χ² = 1.25",
        ]  # fmt: skip
        assert page.text("#fit-warnings") == "mu0 is not determined"
        assert page.run("return document.querySelectorAll('#fit-plot .measured').length;") == 2
        assert page.run("return document.querySelectorAll('#fit-plot .band').length;") == 1
        assert "k = 1.3 N/µm" in page.download("#fit-image", tmp_path, "friction-fit.svg").read_text("utf-8")
        page.click("#fit-use")
        assert (page.value("#field-k"), page.value("#field-mu0")) == ("1.3 N/µm", "0.29")
        page.type("#points", "1 2 3 4", commit=False)
        assert page.is_old("#fit")  # the result is that of other points
        page.click("#fit-form button")
        page.wait_for("#fit-status", "^needs two or three columns: v0, mu_macro, std. Grey")
        assert page.complaints() == []
