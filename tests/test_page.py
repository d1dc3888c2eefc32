"""The page: what it is served with, and what a browser makes of it (headless Chromium, where there is one)."""

import csv
import io
import math
import re
import shutil
import urllib.request
from urllib.parse import urljoin, urlsplit

import numpy as np
import pytest

from service.routes.page import ASSETS, POLICY

START = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


# --- without a browser --------------------------------------------------------------------------------


def test_the_page_comes_with_a_strict_policy(client):
    page = client.get("/")
    assert page.headers["content-type"].startswith("text/html")
    assert page.headers["content-security-policy"] == POLICY
    assert "unsafe" not in POLICY
    assert "default-src 'none'" in POLICY
    for name in ASSETS:
        assert name in page.text or name.endswith(".js")
    assert not re.search(r"<script(?![^>]*src=)|<style|style=|\son\w+=|https?:|//", page.text)


@pytest.mark.parametrize("name", ASSETS)
def test_every_part_is_served_and_names_no_other_host(client, name):
    part = client.get(f"/static/page/{name}")
    assert part.status_code == 200
    assert part.headers["content-type"].startswith(ASSETS[name])
    assert "://" not in part.text
    for imported in re.findall(r'from "\./([^"]+)"', part.text):
        assert imported in ASSETS


def test_the_map_is_the_surrogates(client, surrogate):
    response = client.get("/static/page/map.json")
    data = response.json()
    v, y = (np.geomspace(axis["start"], axis["stop"], axis["n"]) for axis in (data["v_tilde"], data["y_tilde"]))
    grid = data["unit"] * np.array(data["mu_ratio"]).reshape(y.size, v.size)
    assert np.max(np.abs(grid - surrogate.mu_ratio(v[None, :], y[:, None]))) <= 0.5001 * data["unit"]
    border = np.array(data["border"])
    assert border[:, 0] == pytest.approx(surrogate.v_tilde_crit(border[:, 1]), rel=1e-5)
    etag = response.headers["etag"]
    assert client.get("/static/page/map.json", headers={"If-None-Match": etag}).status_code == 304


def test_without_a_table_the_page_is_there_and_the_map_is_not(tmp_path, problem):
    from starlette.testclient import TestClient

    from service.app import create_app
    from service.settings import Settings

    with TestClient(create_app(Settings(tables=(tmp_path,)), wait=True)) as client:
        assert client.get("/").status_code == 200
        problem(client.get("/static/page/map.json"), 503)


# --- in a browser -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def open_page(live_server, tmp_path_factory):
    """Opens the page in a browser of its own that reaches nothing but this machine."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="the PyPI package selenium is not installed")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if chromium is None or driver is None:
        pytest.skip("there is no Chromium with its ChromeDriver on the PATH")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in (
        "headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage", "disable-quic", "no-first-run",
        "disable-background-networking", "disable-component-update", "disable-sync", "window-size=1400,1000",
        "host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
        f"user-data-dir={tmp_path_factory.mktemp('browser')}",
    ):  # fmt: skip
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))

    def start(address="", width=1400, height=1000, scheme="light", url=live_server.url, ready=r"^0(\.\d+)?$"):
        # another document: setting only the part behind "#" would not load the page anew
        browser.get("about:blank")
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500},
        )
        media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
        browser.get(url + "/" + address)
        return Page(browser, url, ready)

    yield start
    browser.quit()


class Page:
    """The page as a user sees it."""

    def __init__(self, browser, url, ready):
        self.browser, self.url = browser, url
        self.wait_for("#mu", ready)
        self.run("await new Promise((done) => setTimeout(done, 300))")

    def run(self, script, *arguments):
        return self.browser.execute_async_script(
            f"const done = arguments[arguments.length - 1]; (async () => {{ {script} }})().then(done);", *arguments
        )

    def text(self, selector):
        return self.run(
            "return document.querySelector(arguments[0]).textContent;".replace("arguments[0]", repr(selector))
        )

    def wait_for(self, selector, pattern):
        from selenium.webdriver.support.ui import WebDriverWait

        def found(_):
            return re.search(pattern, self.text(selector))

        return WebDriverWait(self.browser, 30).until(found, f"{selector} is {self.text(selector)!r}, not {pattern}")

    def find(self, selector):
        return self.browser.find_element("css selector", selector)

    def type(self, selector, text):
        from selenium.webdriver import Keys

        self.find(selector).send_keys(Keys.CONTROL + "a", Keys.NULL, text or Keys.DELETE)

    def choose(self, selector, value):
        self.run(
            f"const select = document.querySelector({selector!r}); select.value = {value!r};"
            "select.dispatchEvent(new Event('change'));"
        )

    def complaints(self):
        return [
            entry["message"] for entry in self.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")
        ]

    def touched(self, selector, x, y, click=False):
        """Move the pointer to a share of an element's width and height."""
        from selenium.webdriver import ActionChains

        element = self.find(selector)
        self.run(f"document.querySelector({selector!r}).scrollIntoView({{ block: 'center' }});")
        size = element.size
        offset = round((x - 0.5) * size["width"]), round((y - 0.5) * size["height"])
        actions = ActionChains(self.browser).move_to_element_with_offset(element, *offset)
        (actions.click() if click else actions).perform()


def shown(value, digits=6):
    return float(f"{value:.{digits - 1}e}")


def test_it_loads_and_shows_the_known_value(open_page, surrogate):
    page = open_page()
    expected = surrogate.evaluate(**START)
    assert float(page.text("#mu")) == shown(expected.mu_macro) == 0.240012
    assert float(page.text("#ratio")) == shown(expected.mu_ratio)
    assert page.text("#regime") == "stick–slip"
    assert float(page.text("#bound").removeprefix("± ")) == shown(expected.error_bound, 2)
    assert page.text("#source") == expected.source
    assert page.text("#table") == surrogate.id
    assert float(page.text("#v-tilde")) == shown(expected.v_tilde, 5)
    assert page.complaints() == []


def test_it_asks_nobody_else(open_page, live_server):
    page = open_page()
    loaded = page.run("return performance.getEntriesByType('resource').map((entry) => entry.name);")
    assert len(loaded) >= 9
    assert {urlsplit(address).netloc for address in loaded} == {urlsplit(live_server.url).netloc}


def test_the_bars_are_relative_sensitivities(open_page, surrogate):
    page = open_page()
    answer = surrogate.evaluate(**START, gradient=True)
    for name, value in START.items():
        text = page.wait_for(f"#bar-{name}", r"%$").string.replace("−", "-").removesuffix(" %")
        assert float(text) == pytest.approx(answer.gradient[name] * value / answer.mu_macro, abs=6e-4)


def test_typing_and_units_change_the_answer(open_page, surrogate):
    page = open_page()
    page.type("#field-y0", "2,9")  # a decimal comma, micrometres
    expected = surrogate.evaluate(**{**START, "y0": 2.9e-6})
    page.wait_for("#mu", re.escape(str(shown(expected.mu_macro))))
    page.run(
        "const unit = document.querySelector('#unit-y0'); unit.value = 'nm'; unit.dispatchEvent(new Event('change'));"
    )
    assert page.find("#field-y0").get_property("value") == "2900"
    page.choose("#unit-omega", "Hz")
    assert float(page.find("#field-omega").get_property("value")) == pytest.approx(1.3e5 / (2 * math.pi), rel=1e-6)
    page.type("#field-omega", "1000")
    expected = surrogate.evaluate(**{**START, "y0": 2.9e-6, "omega": 2000 * math.pi})
    page.wait_for("#mu", re.escape(str(shown(expected.mu_macro))))
    assert page.complaints() == []


@pytest.mark.parametrize("text", ["", "abc", "-1", "0", "1e", "1 2"])
def test_a_bad_number_is_marked_and_not_asked(open_page, text):
    page = open_page()
    before = page.text("#mu")
    page.type("#field-mu0", text)
    assert page.find("#field-mu0").get_attribute("aria-invalid") == "true"
    assert "µ₀ must be a number > 0" in page.text("#status")
    page.run("await new Promise((done) => setTimeout(done, 200))")
    # each keystroke of "1e" and "1 2" counts: the 1 was a number
    assert page.text("#mu") == before or text.startswith("1")
    assert page.complaints() == []


def test_a_slider_moves_the_answer_and_the_point(open_page, surrogate):
    page = open_page()
    page.run(
        "const slider = document.querySelector('#slider-v0');"
        "slider.value = -1000; slider.dispatchEvent(new Event('input'));"
    )
    expected = surrogate.evaluate(**{**START, "v0": 0.1})
    page.wait_for("#mu", re.escape(str(shown(expected.mu_macro))))
    assert page.text("#regime") == "continuous sliding"
    label = page.find("#map").get_attribute("aria-label")
    assert f"speed {shown(expected.v_tilde, 3)}" in label
    assert page.find("#slider-v0").get_attribute("aria-valuetext") == "100 mm/s"


def test_hovering_the_map_reads_it(open_page, surrogate):
    page = open_page()
    page.touched("#map", 0.6, 0.4)
    read = page.wait_for("#map-read", r"ṽ = (\S+), ỹ = (\S+): µ/µ₀ = (\S+), (\S+)")
    v, y, ratio = (float(read[i]) for i in (1, 2, 3))
    # three digits of the place are shown
    slack = 0.02 * surrogate.mu_ratio(v, y)
    assert ratio == pytest.approx(surrogate.mu_ratio(v, y), abs=slack)


def test_clicking_the_map_moves_the_point_there(open_page):
    page = open_page()
    page.touched("#map", 0.6, 0.4)
    read = page.wait_for("#map-read", r"ṽ = (\S+), ỹ = (\S+): µ/µ₀ = (\S+),")
    page.touched("#map", 0.6, 0.4, click=True)
    page.wait_for("#ratio", re.escape(read[3][:5]))
    assert float(page.text("#v-tilde")) == pytest.approx(float(read[1]), rel=0.01)
    assert float(page.text("#y-tilde")) == pytest.approx(float(read[2]), rel=0.01)


def test_arrow_keys_move_the_point(open_page, surrogate):
    from selenium.webdriver import Keys

    page = open_page()
    canvas = page.find("#map")
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP)
    expected = surrogate.evaluate(**{**START, "v0": 0.0105, "y0": 2.1e-6})
    page.wait_for("#mu", re.escape(str(shown(expected.mu_macro))))
    page.find("#law").send_keys(Keys.ARROW_LEFT)
    expected = surrogate.evaluate(**{**START, "y0": 2.1e-6})
    page.wait_for("#mu", re.escape(str(shown(expected.mu_macro))))
    assert page.complaints() == []


def test_the_law_is_read_by_hovering_and_as_a_table(open_page, surrogate):
    page = open_page()
    page.touched("#law", 0.5, 0.5)
    read = page.wait_for("#law-read", r"v₀ = (\S+) (\S+): µ = (\S+),")
    factor = {"m/s": 1.0, "mm/s": 1e-3, "µm/s": 1e-6}[read[2]]
    expected = surrogate.evaluate(**{**START, "v0": float(read[1]) * factor}).mu_macro
    assert float(read[3]) == pytest.approx(expected, rel=1e-3)
    rows = page.run(
        "return [...document.querySelectorAll('#law-table tbody tr')]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent));"
    )
    assert len(rows) == 13
    for value, mu, _ in rows:
        assert float(mu) == pytest.approx(surrogate.evaluate(**{**START, "v0": float(value)}).mu_macro, rel=1e-3)


def test_the_download_is_the_law(open_page, surrogate):
    page = open_page()
    address = urljoin(page.url, page.find("#csv").get_attribute("href"))
    with urllib.request.urlopen(address, timeout=60) as response:
        header, *rows = csv.reader(io.StringIO(response.read().decode()))
    assert header[:2] == ["v0 [m/s]", "mu_macro [-]"]
    assert len(rows) == 301
    v0, mu = (np.array([float(row[i]) for row in rows]) for i in (0, 1))
    assert mu == pytest.approx(surrogate.evaluate(**{**START, "v0": v0}).mu_macro, rel=1e-14)


@pytest.mark.parametrize("along", ["mu0", "Fz", "k", "y0", "omega"])
def test_the_law_goes_along_every_input(open_page, along):
    page = open_page(f"#along={along}&approximations=1&scale={'linear' if along in ('k', 'y0') else 'log'}")
    page.wait_for("#law-input", rf"^{along} \[")
    assert "Macroscopic friction from" in page.find("#law").get_attribute("aria-label")
    assert page.text("#status") == ""
    assert page.complaints() == []


def test_a_link_reproduces_the_state(open_page):
    page = open_page()
    page.type("#field-Fz", "12.5")
    page.choose("#along", "y0")
    page.choose("#unit-v0", "m/s")
    page.run("await new Promise((done) => setTimeout(done, 500));")
    before = page.text("#mu")
    link = page.find("#link").get_attribute("href")
    assert page.browser.current_url == link
    again = open_page(link.removeprefix(page.url + "/"))
    assert again.text("#mu") == before != "0.240012"
    assert again.find("#field-Fz").get_property("value") == "12.5"
    assert again.find("#along").get_property("value") == "y0"
    assert again.find("#field-v0").get_property("value") == "0.01"


def test_nonsense_in_the_address_falls_back_on_the_start_values(open_page):
    page = open_page("#mu0=-1&Fz=abc&k=&y0=1e999&along=constructor&y0.unit=toString&scale=%3Cscript%3E")
    assert page.text("#mu") == "0.240012"
    assert page.complaints() == []


@pytest.mark.parametrize(("width", "height"), [(390, 844), (320, 640), (800, 600), (1920, 1080)])
def test_it_fits_the_screen(open_page, width, height):
    page = open_page(width=width, height=height)
    sizes = page.run(
        "return ['map', 'law'].map((id) => document.getElementById(id).getBoundingClientRect().width)"
        ".concat(document.documentElement.scrollWidth);"
    )
    assert sizes[2] <= width
    assert min(sizes[:2]) >= 0.2 * width


def test_dark_is_dark(open_page):
    def lightness():
        colour = page.run("return getComputedStyle(document.body).backgroundColor;")
        return sum(map(int, re.findall(r"\d+", colour)[:3]))

    page = open_page(scheme="light")
    assert lightness() > 600
    page = open_page(scheme="dark")
    assert lightness() < 120
    assert page.complaints() == []


def test_the_plots_are_painted(open_page):
    page = open_page()
    for name in ("map", "law"):
        colours = page.run(
            f"const canvas = document.getElementById('{name}');"
            "const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;"
            "const seen = new Set(); for (let i = 0; i < data.length; i += 400) "
            "seen.add(`${data[i]},${data[i + 1]},${data[i + 2]},${data[i + 3]}`); return seen.size;"
        )
        assert colours > (100 if name == "map" else 5), name


def test_everything_that_takes_input_has_a_name(open_page):
    page = open_page()
    unnamed = page.run(
        "return [...document.querySelectorAll('input, select, button, canvas, a')].filter((element) => "
        "!(element.labels?.length || element.getAttribute('aria-label') || element.textContent.trim()))"
        ".map((element) => element.outerHTML);"
    )
    assert unnamed == []
    reached = page.run(
        "return ['field-mu0', 'slider-v0', 'map', 'law', 'along', 'csv', 'link'].filter((id) => "
        "document.getElementById(id).tabIndex < 0);"
    )
    assert reached == []


# --- with an API key in force -------------------------------------------------------------------------


def test_the_page_is_open_where_the_numbers_are_not(tables_dir, problem):
    from starlette.testclient import TestClient

    from service.app import create_app
    from service.routes import docs, page
    from service.settings import Settings

    with TestClient(create_app(Settings(tables=(tables_dir,), api_key="sesame"), wait=True)) as client:
        for path in page.OPEN_PATHS | docs.OPEN_PATHS:
            assert client.get(path).status_code == 200, path
        for path in ("/static/page/map.json", "/v1/mu-macro", "/openapi.json", "/v1/law.csv", "/Info", "/static/page/"):
            problem(client.get(path), 401)
        assert client.get("/static/page/map.json", headers={"X-API-Key": "sesame"}).status_code == 200


@pytest.fixture(scope="module")
def closed(serving, tables_dir):
    with serving(tables_dir, MUMACRO_API_KEY="open-sesame") as server:
        yield f"http://127.0.0.1:{server.port}"


def test_the_page_asks_for_the_key_and_uses_it(open_page, closed, surrogate, tmp_path):
    page = open_page(url=closed, ready="^…$")
    page.wait_for("#key-form", "asks for an API key")
    assert page.find("#key-form").is_displayed()
    for wrong, said in (("two words", "no spaces"), ("nonsense", "not the key")):
        page.type("#key", wrong)
        page.find("#key-form button").click()
        page.wait_for("#key-status", said)
        assert page.text("#mu") == "…"
    page.type("#key", "open-sesame")
    page.find("#key-form button").click()
    page.wait_for("#mu", "^0.240012$")
    page.wait_for("#bar-v0", "%$")
    page.run("await new Promise((done) => setTimeout(done, 500));")
    assert not page.find("#key-form").is_displayed()
    assert page.find("#forget").is_displayed()
    assert "sesame" not in page.browser.current_url + page.find("#link").get_attribute("href")
    # the download, which no plain link could make
    page.browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    page.find("#csv").click()
    found = tmp_path / "friction-law-v0.csv"
    for _ in range(100):
        if found.exists():
            break
        page.run("await new Promise((done) => setTimeout(done, 100));")
    header, *rows = csv.reader(io.StringIO(found.read_text()))
    assert header[0] == "v0 [m/s]"
    assert float(rows[0][1]) == surrogate.evaluate(**{**START, "v0": float(rows[0][0])}).mu_macro
    # loaded anew, the tab still has the key; forgotten, it has not
    page.browser.refresh()
    page.wait_for("#mu", "^0.240012$")
    page.find("#forget").click()
    page.wait_for("#mu", "^…$")
    page.wait_for("#key-form", "asks for an API key")
    assert page.run("return sessionStorage.length;") == 0
    # a browser writes down every answer of 401; nothing else may be there
    assert [entry for entry in page.complaints() if "401" not in entry] == []


def test_the_description_asks_for_the_key_too(open_page, closed):
    page = open_page(url=closed, ready="^…$")
    page.browser.get(closed + "/docs")
    page.wait_for("#key-form", "asks for an API key")
    page.type("#key", "open-sesame")
    page.find("#key-form button").click()
    page.wait_for("#swagger-ui", "mu_macro over a range of one input")
    assert [entry for entry in page.complaints() if "401" not in entry] == []
    page.run("sessionStorage.clear();")


def test_without_a_key_the_description_is_shown_at_once(open_page, live_server):
    page = open_page()
    page.browser.get(live_server.url + "/docs")
    page.wait_for("#swagger-ui", "The value of one input that gives a wanted mu_macro")
    assert not page.find("#key-form").is_displayed()
    assert page.complaints() == []
