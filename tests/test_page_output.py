"""The page in a browser: the numbers, the map, the friction law, solving for an input, downloads."""

import csv
import re
from urllib.parse import urlsplit

import numpy as np
import pytest

from comparing import close
from mumacro.closed_forms import border_23, border_24, border_26, border_27
from mumacro.law import APPROXIMATIONS
from service.routes.page import ASSETS

pytestmark = pytest.mark.slow


def test_it_loads_and_shows_the_known_value(open_page, surrogate, live_server, case):
    page = open_page(new=True)
    expected = surrogate.evaluate(**case, gradient=True)
    assert float(page.text("#mu")) == page.rounded(expected.mu_macro) == 0.240012
    assert float(page.text("#ratio")) == page.rounded(expected.mu_ratio)
    assert page.text("#regime") == "stick–slip"
    assert float(page.text("#v-tilde")) == page.rounded(expected.v_tilde, 5)
    assert page.text("#peak-speed") == "260 mm/s"
    stick = surrogate.stick_fraction(expected.v_tilde, expected.y_tilde)
    assert page.text("#stick") == f"{100 * stick:.4g} %"
    power = surrogate.power(expected.v_tilde, expected.y_tilde) * 0.3 * 10 * 3e-6 * 1.3e5
    assert page.text("#shaker") == f"{1e3 * power:.4g} mW"
    assert page.text("#saved") == f"{1e3 * (0.3 - expected.mu_macro) * 10 * 0.01:.4g} mW"
    # the source of the number is in a section that is closed by default
    assert not page.find("#bound").is_displayed()
    assert float(page.text("#bound").removeprefix("± ")) == page.rounded(expected.error_bound, 2)
    assert (page.text("#source"), page.text("#table")) == (expected.source, surrogate.id)
    for name, value in case.items():
        text = page.text(f"#bar-{name}").replace("−", "-").removesuffix(" %")
        assert float(text) == close(expected.gradient[name] * value / expected.mu_macro, abs=6e-4)
    loaded = page.run("return performance.getEntriesByType('resource').map((entry) => entry.name);")
    assert len(loaded) >= len(ASSETS)
    assert {urlsplit(address).netloc for address in loaded} == {urlsplit(live_server.url).netloc}
    assert page.complaints() == []


def test_solving_for_an_input(open_page, surrogate, case):
    page = open_page()
    page.find("#solve-form button").click()  # which amplitude halves the friction?
    found = page.wait_for("#roots", r"y₀ = (\S+) µm: µ = 0.15, stick–slip, shaker (\S+) mW")
    root = surrogate.evaluate(**{**case, "y0": float(found[1]) * 1e-6})
    assert root.mu_ratio == close(0.5, abs=1e-5)
    page.find("#roots button").click()
    page.settle()
    assert float(page.text("#ratio")) == 0.5
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
    page.run("document.querySelector('#target').value = '0.5';"
             "document.querySelector('#target').dispatchEvent(new Event('input'));")  # fmt: skip
    assert page.text("#solve-status") == ""
    assert page.complaints() == []


def test_the_map_is_read_and_moved_on(open_page, surrogate, case):
    from selenium.webdriver import Keys

    page = open_page()
    page.touched("#map", 0.6, 0.4)
    read = page.wait_for("#map-read", r"ṽ = (\S+), ỹ = (\S+): µ/µ₀ = (\S+), (\S+)")
    v, y, ratio = (float(read[i]) for i in (1, 2, 3))
    # three digits of the position are shown
    assert ratio == close(surrogate.mu_ratio(v, y), abs=0.02 * surrogate.mu_ratio(v, y))
    page.touched("#map", 0.6, 0.4, click=True)
    page.settle()
    assert float(page.text("#ratio")) == close(ratio, rel=0.01)
    assert float(page.text("#v-tilde")) == close(v, rel=0.01)
    assert float(page.text("#y-tilde")) == close(y, rel=0.01)
    assert page.complaints() == []
    page = open_page()
    page.find("#map").send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP)
    page.settle()
    expected = surrogate.evaluate(**{**case, "v0": 0.0105, "y0": 2.1e-6})
    assert float(page.text("#mu")) == page.rounded(expected.mu_macro)
    assert f"speed {page.rounded(expected.v_tilde, 3)}" in page.find("#map").get_attribute("aria-label")
    page.find("#law").send_keys(Keys.ARROW_LEFT)
    page.settle()
    assert float(page.text("#mu")) == page.rounded(surrogate.evaluate(**{**case, "y0": 2.1e-6}).mu_macro)
    assert page.complaints() == []


ORANGE = (194, 51, 10)  # colour of the user's point


def point_on(page, name):
    """Where the user's point is drawn, as shares of the canvas: left to right, top to bottom."""
    pixels = page.pixels(name)
    rows, columns = np.nonzero(np.all(pixels[..., :3] == ORANGE, axis=-1))
    return columns.mean() / pixels.shape[1], rows.mean() / pixels.shape[0]


@pytest.mark.parametrize(
    ("address", "side", "said"),
    [
        ("#v0=100", (1, 0), "ṽ = 256"),
        ("#v0=1e6", (1, 0), "ṽ = 2.56e6"),
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
    inside = said == "ṽ = 256"
    assert page.find("#map-out").is_displayed() is not inside
    assert inside or said in page.text("#map-out")
    x, y = point_on(page, "map")
    if side[0] and not inside:
        assert x > 0.8 if side[0] > 0 else x < 0.2
    if side[1]:
        assert y < 0.1 if side[1] > 0 else y > 0.8
    assert page.text("#status") == ""
    assert page.complaints() == []


def test_the_map_has_a_colour_bar(open_page):
    pixels = open_page().pixels("map")
    bar = pixels[12:-50, -45, :3].astype(int)  # from 1 at the top to 0
    assert bar[0] == close([253, 231, 37], abs=12)
    assert bar[-1] == close([68, 1, 84], abs=12)
    assert len({tuple(colour) for colour in bar.tolist()}) > 100
    law = open_page().pixels("law").reshape(-1, 4)
    assert len(np.unique(law[::50], axis=0)) > 5


def test_the_law_is_in_the_units_of_its_field(open_page, surrogate, case):
    page = open_page()
    page.touched("#law", 0.5, 0.5)
    read = page.wait_for("#law-read", r"v₀ = (\S+) mm/s: µ = (\S+),")
    expected = surrogate.evaluate(**{**case, "v0": float(read[1]) * 1e-3}).mu_macro
    assert float(read[2]) == close(expected, rel=1e-3)
    rows = page.run(
        "return [...document.querySelectorAll('#law-table tbody tr')]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent));"
    )
    assert len(rows) == 13
    for value, mu, _ in rows:
        expected = surrogate.evaluate(**{**case, "v0": 1e-3 * float(value)}).mu_macro
        assert float(mu) == close(expected, rel=1e-3)
    assert page.text("#law-input") == "v₀ [mm/s]"
    page.choose("#unit-v0", "m/s")
    assert page.text("#law-input") == "v₀ [m/s]"
    page.choose("#along", "omega")
    assert page.text("#law-input") == "f [kHz]"
    # a click selects the value at the pointer, in that unit
    page.touched("#law", 0.5, 0.5)
    at = float(page.wait_for("#law-read", r"f = (\S+) kHz")[1])
    page.touched("#law", 0.5, 0.5, click=True)
    page.settle()
    assert float(page.value("#field-omega")) == close(at, rel=0.05)
    assert page.complaints() == []


def test_the_range_of_the_law_is_chosen(open_page):
    page = open_page()
    assert page.find("#start").get_attribute("placeholder") == "0.1"
    page.type("#start", "5")
    page.type("#stop", "2 m/s")
    assert "at v₀ = 5 mm/s to" in page.find("#law").get_attribute("aria-label")
    assert "at v₀ = 2000 mm/s" in page.find("#law").get_attribute("aria-label")
    page.type("#stop", "1")  # below the start: the service reports the error
    page.wait_for("#law-status", "refuses this: .*stop.* Grey results")
    assert page.is_old("#law-section")
    assert not page.is_old()
    page.type("#stop", "x")
    assert page.text("#law-status") == "stop: “x” is not a number."
    page.type("#stop", "")
    assert not page.is_old("#law-section")
    page.choose("#scale", "linear")
    page.type("#start", "0")
    assert page.text("#law-status") == ""
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
    assert float(page.text("#mu")) >= 0
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
    speed = 1e3 * 3e-6 * 1.3e5  # l0 omega [mm/s]
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


@pytest.mark.parametrize("name", ["law", "map"])
def test_the_papers_borders_are_drawn(open_page, name):
    without = open_page().pixels(name)
    page = open_page("#approximations=1")
    assert not np.array_equal(page.pixels(name), without)
    if name == "map":
        colour = (0xB8, 0x4D, 0xFF)  # of (26), which is given for y~ >= 1: the upper three fifths of the frame
        rows, _ = np.nonzero(np.all(page.pixels(name)[..., :3] == colour, axis=-1))
        frame = page.pixels(name).shape[0] - 56
        assert rows.max() == close(10 + 0.6 * frame, abs=6)


def test_curves_approximations_and_downloads(open_page, surrogate, tmp_path, case):
    page = open_page("#approximations=1")
    # every column of the service's response has a line in the legend, with the paper's equations
    legend = legend_of(page)
    assert "master curve (28)" in legend
    assert "critical (32), (40)" in legend
    curves = [text for text in legend if not text.startswith("border")]
    assert len(curves) == 8 == len(APPROXIMATIONS) - 1  # the corner approximation does not apply here
    page.choose("#family", "y0")
    assert page.value("#curves") == "1; 2; 4"
    page.type("#curves", "1; 2 mm")
    assert page.text("#law-status") == "Curves: give a unit to every value or to none."
    page.type("#curves", "500 nm; 0.0025 mm")
    assert page.value("#curves") == "0.5; 2.5"
    text = page.download("#csv", tmp_path, "friction-law-v0.csv").read_text("utf-8")
    header, *rows = csv.reader(text.splitlines())
    assert header[:4] == ["v₀ [mm/s]", "mu_macro [-]", "mu_static [-]", "regime"]
    assert header[-2:] == ["mu_macro [-] at y₀ = 0.5 µm", "mu_macro [-] at y₀ = 2.5 µm"]
    assert "master_curve [-]" in header
    assert {row[header.index("border_eq_24 [m/s]")] for row in rows} == {str(3e-6 * 1.3e5 * border_24(2 / 3))}
    assert len(rows) == 301
    v0 = 1e-3 * np.array([float(row[0]) for row in rows])
    for column, y0 in ((1, 2e-6), (-2, 0.5e-6), (-1, 2.5e-6)):
        mu = np.array([float(row[column]) for row in rows])
        assert mu == close(surrogate.evaluate(**{**case, "y0": y0, "v0": v0}).mu_macro, rel=1e-12)
    for button, name in (("#law-image", "friction-law-v0.png"), ("#map-image", "friction-map.png")):
        picture = page.download(button, tmp_path, name).read_bytes()
        assert picture.startswith(b"\x89PNG")
        width, height = (int.from_bytes(picture[at : at + 4], "big") for at in (16, 20))
        assert min(width, height) >= 600
    assert "family=y0&curves=" in page.find("#link").get_attribute("href")
    page.choose("#along", "y0")  # an input is either along the axis or a curve
    assert page.value("#family") == ""
    assert page.complaints() == []
