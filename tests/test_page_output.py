"""The page in a browser: the numbers, the map, the friction law, solving for an input, downloads."""

import csv
import math
import re
from urllib.parse import urlsplit

import numpy as np
import pytest

from browser import START
from comparing import close
from mumacro.closed_forms import border_23, border_24, border_26, border_27
from mumacro.law import APPROXIMATIONS
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
    read = page.wait_for("#map-read", r"ṽ = (\S+), ỹ = (\S+): µ/µ₀ = (\S+), (\S+)")
    v, y, ratio = (float(read[i]) for i in (1, 2, 3))
    assert ratio == page.rounded(surrogate.mu_ratio(v, y))
    page.touched("#map", 0.6, 0.4, click=True)
    page.settle()
    assert page.number("#ratio") == close(ratio, rel=0.01)
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
        ("#k=rigid", (0, 1), "Rigid contact"),
        ("#k=rigid&v0=100", (1, 0), "Rigid contact"),
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


def test_the_map_has_its_colours(open_page, surrogate):
    page = open_page()
    bar = page.run("return [...document.querySelectorAll('#map > rect')].map((one) => one.getAttribute('fill'));")
    shades = [[int(part) for part in re.findall(r"\d+", fill)] for fill in bar]
    assert (shades[0], shades[-1]) == (close([68, 1, 84], abs=8), close([253, 231, 37], abs=8))  # viridis
    # the picture of the map at a place has the colour of its value on the bar
    v, y = 1.0, 10.0
    x_share, y_share = (math.log10(v) + 4) / 7, (math.log10(y) + 2) / 5
    found = page.run(
        "const image = new Image(); image.src = document.querySelector('#map image').getAttribute('href');"
        "await image.decode();"
        "const context = new OffscreenCanvas(image.width, image.height).getContext('2d');"
        "context.drawImage(image, 0, 0);"
        f"const place = [Math.round({x_share} * image.width), Math.round({1 - y_share} * image.height), 1, 1];"
        "return [...context.getImageData(...place).data];"
    )
    expected = shades[int(surrogate.mu_ratio(v, y) * len(shades))]
    assert found[:3] == close(expected, abs=12)


def test_the_law_is_in_the_units_of_its_field(open_page, surrogate):
    page = open_page()
    page.touched("#law", 0.5, 0.5)
    read = page.wait_for("#law-read", r"v₀ = (\S+) mm/s: µ = (\S+),")
    expected = surrogate.evaluate(**{**START, "v0": float(read[1]) * 1e-3}).mu_macro
    assert float(read[2]) == close(expected, rel=1e-3)
    rows = page.run(
        "return [...document.querySelectorAll('#law-table tbody tr')]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent));"
    )
    assert len(rows) == 13
    for value, mu, _ in rows:
        expected = surrogate.evaluate(**{**START, "v0": 1e-3 * float(value)}).mu_macro
        assert float(mu) == close(expected, rel=1e-3)
    assert page.text("#law-input") == "v₀ [mm/s]"
    page.type("#field-v0", "0.01 m/s")
    assert page.text("#law-input") == "v₀ [m/s]"
    page.choose("#along", "omega")
    assert page.text("#law-input") == "f [kHz]"
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
    page = open_page(f"#along={along}&approximations=1&scale={'linear' if linear else 'log'}")
    head = {"mu0": "µ₀", "Fz": "Fz [N]", "k": "k [N/µm]", "y0": "y₀ [µm]", "omega": "f [kHz]"}[along]
    assert page.text("#law-input") == head
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
        "#k=rigid&along=k&mu0.std=0.1",
        "#y0=1e300&omega=1e200&along=omega",
        "#mu0=1e-300&Fz=1e-10&along=mu0&scale=linear",
        "#v0=0&y0=3e-6&y0.std=1e-9",
    ],
)
def test_the_ends_of_every_range_are_answered(open_page, address):
    page = open_page(address)
    assert page.number() >= 0
    assert (page.text("#status"), page.text("#law-status")) == ("", "")
    shown = page.run("return document.querySelector('main').innerText;")
    assert not re.search(r"NaN|undefined|null|Infinity|\[object", shown)
    assert page.complaints() == []


def legend_of(page, name="legend"):
    return page.run(f"return [...document.querySelectorAll('#{name} li')].map((item) => item.textContent);")


def borders_told(page):
    """The border by the paper's formulas, from the legend: equations -> values."""
    told = {}
    for text in legend_of(page):
        found = re.fullmatch(r"border by (.+): (.+)", text)
        if found:
            told[found[1]] = [float(part.split()[0]) for part in found[2].split(" and ")]
    return told


def test_the_border_by_the_papers_equations(open_page):
    page = open_page("#approximations=1")
    speed = 1e3 * 3e-6 * START["omega"]  # l0 omega [mm/s]
    small = {"(23)": border_23, "(24), (39)": border_24, "(27)": border_27}
    found = borders_told(page)
    assert found.keys() == small.keys()  # (26) is meant for y~ >= 1
    for numbers, formula in small.items():
        assert found[numbers] == close([speed * float(formula(2 / 3))], rel=1e-3)
    assert legend_of(page, "map-legend") == [f"border by {one}" for one in ("(23)", "(24), (39)", "(26)", "(27)")]
    page = open_page("#approximations=1&y0=6e-6&scale=linear")  # y~ = 2, outside the range of (23) and (24)
    found = borders_told(page)
    assert found.keys() == {"(26)", "(27)"}
    for numbers, formula in (("(26)", border_26), ("(27)", border_27)):
        assert found[numbers] == close([speed * float(formula(2.0))], rel=1e-3)
    # along the amplitude: at the border v0 = 10 mm/s; l0 = 3 um
    page = open_page("#approximations=1&along=y0")
    for numbers, formula in small.items():
        (amplitude,) = borders_told(page)[numbers]
        assert speed * float(formula(amplitude / 3)) == close(10.0, rel=2e-3)
    page.click("#approximations")
    assert legend_of(page) == legend_of(page, "map-legend") == []
    assert page.complaints() == []


def test_the_papers_borders_are_drawn(open_page):
    assert open_page().run("return document.querySelectorAll('#map [class^=eq_], #law .mark').length;") == 2
    page = open_page("#approximations=1")
    # (26) is given for y~ >= 1: the upper three fifths of the frame
    frame, line = page.run(
        "return ['image', '.eq_26'].map((one) => document.querySelector(`#map ${one}`).getBoundingClientRect())"
        ".map(({ top, bottom }) => [top, bottom]);"
    )
    assert line[1] == close(frame[0] + 0.6 * (frame[1] - frame[0]), abs=6)
    # (27), (24) and (23) are marked in the law beside the border
    assert page.run("return [...document.querySelectorAll('#law text.mark')].map((one) => one.textContent);") == [
        "border", "(23)", "(24), (39)", "(27)",
    ]  # fmt: skip


def test_curves_approximations_and_downloads(open_page, surrogate, tmp_path):
    page = open_page("#approximations=1")
    # every column of the service's response has a line in the legend, with the paper's equations
    legend = legend_of(page)
    assert "master curve (28)" in legend
    assert "critical (32), (40)" in legend
    curves = [text for text in legend if not text.startswith("border")]
    assert len(curves) == 8 == len(APPROXIMATIONS) - 1  # the corner approximation does not apply here
    page.choose("#family", "y0")
    assert page.value("#curves") == "1 µm; 2 µm; 4 µm"
    page.type("#curves", "1; 2 mm")
    assert page.text("#law-status").startswith("curves: give a unit to every value or to none.")
    page.type("#curves", "500 nm; 0.0025 mm")
    assert page.value("#curves") == "500 nm; 0.0025 mm"
    text = page.download("#csv", tmp_path, "friction-law-v0.csv").read_text("utf-8")
    header, *rows = csv.reader(text.splitlines())
    assert header[:4] == ["v₀ [mm/s]", "mu_macro [-]", "mu_static [-]", "regime"]
    assert header[-2:] == ["mu_macro [-] at y₀ = 0.5 µm", "mu_macro [-] at y₀ = 2.5 µm"]
    assert "master_curve [-]" in header
    border = {float(row[header.index("border_eq_24 [m/s]")]) for row in rows}
    assert list(border) == close([3e-6 * START["omega"] * border_24(2 / 3)], rel=1e-14)
    assert len(rows) == 301
    v0 = 1e-3 * np.array([float(row[0]) for row in rows])
    for column, y0 in ((1, 2e-6), (-2, 0.5e-6), (-1, 2.5e-6)):
        mu = np.array([float(row[column]) for row in rows])
        assert mu == close(surrogate.evaluate(**{**START, "y0": y0, "v0": v0}).mu_macro, rel=1e-12)
    for button, name in (("#law-image", "friction-law-v0.png"), ("#map-image", "friction-map.png")):
        picture = page.download(button, tmp_path, name).read_bytes()
        assert picture.startswith(b"\x89PNG")
        width, height = (int.from_bytes(picture[at : at + 4], "big") for at in (16, 20))
        assert min(width, height) >= 600
    assert "family=y0&curves=" in page.find("#link").get_attribute("href")
    page.choose("#along", "y0")  # an input is either along the axis or a curve
    assert page.value("#family") == ""
    assert page.complaints() == []
