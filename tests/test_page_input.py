"""The page in a browser: typed values, links, and the display while there is no response."""

import json
import math
import time
from urllib.parse import quote

import pytest

from comparing import close

pytestmark = pytest.mark.slow

READ = {  # (field, unit, text): SI value, or part of the message
    ("y0", "µm", "5 mm"): 5e-3,
    ("y0", "µm", "5mm"): 5e-3,
    ("y0", "µm", "2"): 2e-6,
    ("y0", "m", "2e-6"): 2e-6,
    ("y0", "m", "2·10⁻⁶"): 2e-6,
    ("y0", "m", "2 x 10^-6 mm"): 2e-9,
    ("y0", "µm", "2,9"): 2.9e-6,
    ("y0", "µm", "3 um"): 3e-6,
    ("y0", "µm", "0,500"): 0.5e-6,
    ("Fz", "N", "1 500"): 1500.0,
    ("Fz", "N", "1\u202f500,25"): 1500.25,
    ("Fz", "N", "1,500,000"): 1.5e6,
    ("Fz", "N", "1.500.000,5 mN"): 1500.0005,
    ("Fz", "N", "1'500"): 1500.0,
    ("Fz", "N", "0.000 001"): 1e-6,
    ("Fz", "kN", "3 [N]"): 3.0,
    ("k", "N/µm", "300 N/mm"): 3e5,
    ("k", "N/µm", "rigid"): "rigid",
    ("omega", "kHz", "20"): 2 * math.pi * 20e3,
    ("omega", "kHz", "130 krad/s"): 1.3e5,
    ("omega", "kHz", "6000 rpm"): 2 * math.pi * 100,
    ("mu0", "-", "30 %"): 0.3,
    ("v0", "mm/s", "0"): 0.0,
    ("v0", "mm/s", "−0"): 0.0,
    ("Fz", "N", "1,500"): "can be 1500 or 1.500",
    ("Fz", "N", "1 2"): "is not a number",
    ("Fz", "N", "1.2.3"): "is not a number",
    ("Fz", "N", "12 34"): "is not a number",
    ("Fz", "N", ""): "give a number",
    ("Fz", "N", "abc"): "is not a number",
    ("Fz", "N", "1e"): "“e” is not a unit of Fz: give N, mN, kN",
    ("Fz", "N", "5 mm"): "“mm” is not a unit of Fz",
    ("Fz", "N", "3 n"): "did you mean N?",
    ("Fz", "N", "1e999"): "too large",
    ("Fz", "N", "1e-999"): "too small",
    ("Fz", "N", "1e-324 mN"): "too small",
    ("Fz", "N", "-1"): "must be finite and > 0",
    ("Fz", "N", "0"): "must be finite and > 0",
    ("v0", "mm/s", "-1"): "must be finite and >= 0",
    ("k", "N/m", "1e308 N/µm"): "must be finite",
    ("omega", "kHz", "5 1/s"): "can be Hz or rad/s",
    ("mu0", "-", "3 N"): "leave it out",
    ("mu0", "-", "0.3 0.4"): "is not a number",
    ("y0", "µm", "5 mm 3"): "is not a unit",
    ("y0", "µm", "constructor"): "is not a number",
    ("y0", "µm", "5 constructor"): "is not a unit",
}


def test_what_is_typed_is_understood_as_a_whole_or_refused(open_page):
    page = open_page()
    found = page.run(
        "const { readValue } = await import('./static/page/read.js');"
        f"return {json.dumps(list(READ))}.map(([name, unit, text]) => readValue(name, text, unit));"
    )
    for (case, expected), answer in zip(READ.items(), found, strict=True):
        if isinstance(expected, float):
            assert answer.get("si") == close(expected, rel=1e-15), (case, answer)
        elif expected == "rigid":
            assert answer == {"rigid": True}
        else:
            assert expected in answer.get("fault", ""), (case, answer)
    # deviations: an empty field means none, per cent are relative to the value
    deviations = {"": 0.0, "5 %": 1e-7, "±0.1": 1e-7, "0.1 mm": 1e-4, "-1": None, "x": None, "1 N": None}
    found = page.run(
        "const { readDeviation } = await import('./static/page/read.js');"
        f"return {json.dumps(list(deviations))}.map((text) => readDeviation('y0', text, 'µm', 2e-6));"
    )
    for (text, expected), answer in zip(deviations.items(), found, strict=True):
        assert answer.get("si") == (None if expected is None else close(expected, rel=1e-15)), text
        assert ("fault" in answer) is (expected is None)


def test_a_typed_value_applies_on_commit(open_page, surrogate, case):
    page = open_page()
    page.type("#field-y0", "2,9", commit=False)
    time.sleep(0.1)
    assert page.text("#mu") == "0.240012"  # not while it is typed
    page.find("#field-Fz").click()  # but on leaving the field
    page.settle()
    assert float(page.text("#mu")) == page.rounded(surrogate.evaluate(**{**case, "y0": 2.9e-6}).mu_macro)
    page.type("#field-y0", "0.0031 mm")
    assert (page.value("#field-y0"), page.value("#unit-y0")) == ("0.0031", "mm")
    assert float(page.text("#mu")) == page.rounded(surrogate.evaluate(**{**case, "y0": 3.1e-6}).mu_macro)
    page.choose("#unit-y0", "nm")
    assert page.value("#field-y0") == "3100"
    page.type("#field-omega", "1000 Hz")
    assert page.value("#unit-omega") == "Hz"
    expected = surrogate.evaluate(**{**case, "y0": 3.1e-6, "omega": 2000 * math.pi})
    assert float(page.text("#mu")) == page.rounded(expected.mu_macro)
    page.type("#field-Fz", "1 lbf")  # a unit that is not in the list
    assert (page.value("#field-Fz"), page.value("#unit-Fz")) == ("1", "lbf")
    page.type("#field-Fz", "9.123456789012 N")
    assert page.value("#field-Fz") == "9.123456789012"  # with all digits that were typed
    assert page.complaints() == []


def test_a_bad_value_greys_the_result_and_gives_the_reason(open_page, surrogate, case):
    from selenium.webdriver import Keys

    page = open_page()
    page.type("#field-Fz", "5 mm")
    assert page.is_old()
    assert page.find("#field-Fz").get_attribute("aria-invalid") == "true"
    assert page.text("#fault-Fz") == "Fz: “mm” is not a unit of Fz: give N, mN, kN."
    assert page.text("#status") == f"{page.text('#fault-Fz')} Grey results belong to earlier values."
    # another field does not repair it, and no request is sent meanwhile
    page.type("#field-mu0", "0.4")
    assert page.is_old()
    assert page.text("#mu") == "0.240012"
    page.find("#field-Fz").send_keys(Keys.ESCAPE)
    page.settle()
    assert not page.is_old()
    assert (page.text("#status"), page.text("#fault-Fz"), page.value("#field-Fz")) == ("", "", "10")
    assert float(page.text("#mu")) == page.rounded(surrogate.evaluate(**{**case, "mu0": 0.4}).mu_macro)
    # the slider of a field repairs it, too; a bad uncertainty has the same effect
    page.type("#field-v0", "fast")
    page.type("#std-k", "many")
    page.choose("#slider-v0", "-1000", "input")
    assert page.is_old()
    assert "± of k: “many” is not a number." in page.text("#status")
    page.type("#std-k", "")
    assert not page.is_old()
    assert float(page.text("#mu")) == page.rounded(surrogate.evaluate(**{**case, "mu0": 0.4, "v0": 0.1}).mu_macro)
    assert page.text("#regime") == "continuous sliding"
    assert page.find("#slider-v0").get_attribute("aria-valuetext") == "100 mm/s"
    assert page.complaints() == []


def test_a_contact_is_rigid_by_a_switch(open_page, surrogate, case):
    page = open_page("#k=5e5")
    page.click("#rigid")
    assert float(page.text("#mu")) == page.rounded(surrogate.evaluate(**{**case, "k": None}).mu_macro)
    assert not page.find("#field-k").is_enabled()
    assert "k=rigid" in page.find("#link").get_attribute("href")
    assert (page.text("#v-tilde"), page.text("#shaker")) == ("∞", "– (rigid)")
    assert "Rigid contact" in page.text("#map-out")
    page.touched("#map", 0.5, 0.5, click=True)
    page.wait_for("#map-read", "switch it off")
    assert page.value("#field-v0") == "10"
    page.click("#rigid")
    assert page.value("#field-k") == "0.5"  # the earlier value
    page.type("#field-k", "rigid")
    assert page.find("#rigid").is_selected()
    assert page.find("#rigid").get_attribute("role") == "switch"
    assert page.complaints() == []


def test_uncertainties_and_their_shares(open_page, surrogate, case):
    page = open_page()
    page.type("#std-mu0", "0.01")
    page.type("#std-y0", "5 %")
    assert page.value("#std-y0") == "0.1"
    slopes = surrogate.evaluate(**case, gradient=True).gradient
    parts = {"mu0": 0.01 * slopes["mu0"], "y0": 1e-7 * slopes["y0"]}
    std = math.hypot(*parts.values())
    page.wait_for("#uncertainty", f"^± {std:.3g} \\(one standard deviation\\)$")
    for name in case:
        assert page.text(f"#share-{name}") == f"{100 * (parts.get(name, 0) / std) ** 2:.1f} %"
    # at the corner slopes are useless: samples are used
    page.type("#field-y0", "3 µm")
    page.type("#field-v0", "1e-6")
    page.type("#std-y0", "0.3")
    assert "from samples; first order, " in page.text("#uncertainty")
    link = page.find("#link").get_attribute("href")
    assert "mu0.std=0.01" in link
    page.type("#std-mu0", "")
    page.type("#std-y0", "0")
    assert not page.find("#uncertainty").is_displayed()
    assert page.complaints() == []


def test_offline_the_result_is_grey_until_the_service_is_back(open_page, surrogate, case):
    page = open_page()
    try:
        page.offline(True)
        page.run("const slider = document.querySelector('#slider-v0'); slider.value = -1000;"
                 "slider.dispatchEvent(new Event('input'));")  # fmt: skip
        page.wait_for("#status", "^The service does not answer. Grey results belong to earlier values. Asking again")
        assert page.is_old()
        assert page.text("#mu") == "0.240012"
    finally:
        page.offline(False)
    page.settle()
    assert not page.is_old()
    assert page.text("#status") == ""
    assert float(page.text("#mu")) == page.rounded(surrogate.evaluate(**{**case, "v0": 0.1}).mu_macro)
    page.complaints()


@pytest.fixture
def answered_by(open_page):
    """Replaces the service's response; the page is reloaded afterwards."""

    def answer(page, script):
        page.run(f"window.real ??= window.fetch; window.fetch = {script};")

    yield answer
    open_page.shown = None


def test_a_busy_a_refusing_and_a_slow_service_have_their_own_messages(open_page, answered_by):
    page = open_page()
    said = "new Response(JSON.stringify({ detail: 'too many cases' }), { status: %s, headers: { 'Retry-After': '1' } })"
    answered_by(page, f"async () => {said % 503}")
    page.run("document.querySelector('#rigid').click();")
    page.wait_for("#status", "^The service cannot answer now: too many cases. Grey results .* Asking again by itself")
    assert page.is_old()
    answered_by(page, f"async () => {said % 422}")
    page.wait_for("#status", "^The service refuses this: too many cases. Grey results belong to earlier values.$")
    assert page.is_old()
    answered_by(page, "(...all) => new Promise((done) => { window.late = () => done(window.real(...all)); })")
    page.run("document.querySelector('#rigid').click();")
    page.wait_for("#status", "^Waiting for the service. Grey results belong to earlier values.$")
    assert page.is_old()
    page.run("window.fetch = window.real; window.late();")
    page.settle()
    assert not page.is_old()
    assert page.text("#status") == ""


def test_an_unreadable_response_is_requested_again(open_page, answered_by):
    page = open_page()
    answered_by(page, "async () => new Response('<html>', { status: 200 })")
    page.run("document.querySelector('#rigid').click();")
    page.wait_for("#status", "^The response of the service cannot be read .status 200.. .* Asking again by itself.$")
    page.run("window.fetch = window.real;")
    page.settle()
    assert not page.is_old()
    assert page.text("#status") == ""


def test_a_link_reproduces_the_state(open_page):
    page = open_page("#Fz=12.5&along=y0&v0.unit=m/s&Fz.std=0.5&start=1e-7&family=v0&curves=0.01;0.02")
    time.sleep(0.2)  # the address follows the sliders with a delay
    link = page.find("#link").get_attribute("href")
    assert page.browser.current_url == link
    before = [page.text("#mu"), page.text("#uncertainty"), page.find("#law").get_attribute("aria-label")]
    again = open_page("#" + link.partition("#")[2], new=True)
    assert [again.text("#mu"), again.text("#uncertainty"), again.find("#law").get_attribute("aria-label")] == before
    assert before[0] != "0.240012"
    assert (again.value("#field-Fz"), again.value("#std-Fz"), again.value("#along")) == ("12.5", "0.5", "y0")
    assert (again.value("#field-v0"), again.value("#start"), again.value("#curves")) == ("0.01", "0.1", "0.01; 0.02")
    assert not again.find("#notice").is_displayed()
    again.find("#reset").click()
    again.settle()
    assert again.text("#mu") == "0.240012"
    f = open_page("#f=20690.1426&k=rigid")
    assert float(f.value("#field-omega")) == close(20.6901426, rel=1e-6)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("mu0=-1", "mu0 = -1 (must be finite and > 0)"),
        ("Fz=abc", "Fz = abc (“abc” is not a number)"),
        ("k=", "k = nothing (give a number)"),
        ("y0=1e999", "y0 = 1e999 (“1e999” is too large)"),
        ("v0=5 mm", "v0 = 5 mm (“mm” is not a unit of v₀"),
        ("along=constructor&y0.unit=toString", "y0.unit = toString (not a unit of it); along = constructor"),
        ("scale=<script>", "scale = <script> (must be one of log, linear)"),
        ("omega=1&f=1", "f = 1 (omega is given, too)"),
        ("family=y0&curves=1;x", "curves = 1;x"),
        ("std_mu0=1&start=z", "start = z (“z” is not a number); std_mu0 = 1 (unknown)"),
    ],
)
def test_a_link_with_bad_values_is_reported(open_page, address, said):
    page = open_page("#" + quote(address, safe="=&"))
    assert said in page.text("#notice-text")
    assert page.find("#notice").is_displayed()
    assert page.text("#mu") == ("0.240012" if "omega" not in address else "0.299976") or "omega" in address
    page.find("#notice-close").click()
    assert not page.find("#notice").is_displayed()
    assert page.complaints() == []
