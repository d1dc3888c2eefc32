"""The page in a browser: typed values, links, and the display while there is no response."""

import math

import pytest

from browser import KNOWING, START
from comparing import close

pytestmark = pytest.mark.slow


def test_a_typed_value_applies_on_commit(open_page, surrogate):
    page = open_page()
    first = page.rounded(surrogate.evaluate(**START).mu_macro)
    page.type("#field-y0", "2.9", commit=False)
    page.run("await new Promise((next) => setTimeout(next, 100));")
    assert page.number() == first  # not while it is typed
    page.find("#field-Fz").click()  # but on leaving the field
    page.settle()
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "y0": 2.9e-6}).mu_macro)
    page.type("#field-y0", "0.0031mm")
    assert page.value("#field-y0") == "0.0031 mm"
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "y0": 3.1e-6}).mu_macro)
    page.type("#field-y0", "0.0032")  # a plain number keeps the unit of its field
    assert page.value("#field-y0") == "0.0032 mm"
    page.type("#field-omega", "1000 Hz")
    expected = surrogate.evaluate(**{**START, "y0": 3.2e-6, "omega": 2000 * math.pi})
    assert page.number() == page.rounded(expected.mu_macro)
    page.type("#field-Fz", "9.123456789012 lbf")  # with all digits that were typed
    assert page.value("#field-Fz") == "9.123456789012 lbf"
    assert page.complaints() == []


def test_a_bad_value_greys_the_result_and_gives_the_reason(open_page, surrogate):
    from selenium.webdriver import Keys

    page = open_page()
    page.type("#field-Fz", "5 mm")
    assert page.is_old()
    assert page.find("#field-Fz").get_attribute("aria-invalid") == "true"
    assert page.text("#fault-Fz") == "Fz: “mm” is not a unit of Fz: give N, mN, kN."
    assert page.text("#status") == f"{page.text('#fault-Fz')} Grey results belong to earlier values."
    assert page.is_red("#status")
    before = page.number()
    # another field does not repair it, and no request is sent meanwhile
    page.type("#field-mu0", "0.4")
    assert page.is_old()
    assert page.number() == before
    page.find("#field-Fz").send_keys(Keys.ESCAPE)
    page.settle()
    assert not page.is_old()
    assert (page.text("#status"), page.text("#fault-Fz"), page.value("#field-Fz")) == ("", "", "10 N")
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "mu0": 0.4}).mu_macro)
    # an empty field is no error, but there is no result for it
    page.type("#field-Fz", "")
    assert page.text("#status").startswith("Fz: give a number.")
    assert page.is_old()
    assert not page.is_red("#status")
    assert page.find("#field-Fz").get_attribute("aria-invalid") == "false"
    page.find("#field-Fz").send_keys(Keys.ESCAPE)
    # the slider of a field repairs it, too
    page.type("#field-v0", "fast")
    assert page.is_old()
    page.choose("#slider-v0", "-1000", "input")
    assert not page.is_old()
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "mu0": 0.4, "v0": 0.1}).mu_macro)
    assert page.text("#regime") == "continuous sliding"
    assert page.find("#slider-v0").get_attribute("aria-valuetext") == "v₀ = 100 mm/s"
    assert page.complaints() == []


def test_a_contact_is_rigid_by_a_switch(open_page, surrogate):
    page = open_page("#k=5e5")
    page.click("#rigid")
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "k": None}).mu_macro, 6)  # no k to be known
    assert not page.find("#field-k").is_enabled()
    assert "k=rigid" in page.address()
    assert (page.text("#v-tilde"), page.text("#shaker")) == ("∞", "– (rigid)")
    assert page.text("#model").startswith("Model: rigid contact, oscillation across")
    assert "rigid contact has no point" in page.text("#map-out")
    page.touched("#map", 0.5, 0.5, click=True)
    page.wait_for("#map-read", "switch it off")
    assert page.value("#field-v0") == "10 mm/s"
    page.click("#rigid")
    assert page.value("#field-k") == "500000 N/m"  # the earlier value
    page.type("#field-k", "rigid")
    assert page.find("#rigid").is_selected()
    assert page.find("#rigid").get_attribute("role") == "switch"
    assert page.complaints() == []


def test_offline_the_result_is_grey_until_the_service_is_back(open_page, surrogate):
    page = open_page()
    before = page.number()
    try:
        page.offline(True)
        page.run("const slider = document.querySelector('#slider-v0'); slider.value = -1000;"
                 "slider.dispatchEvent(new Event('input'));")  # fmt: skip
        page.wait_for("#status", "^The service does not answer. Asking again by itself. Grey results belong to earlier")
        assert page.is_old()
        assert not page.is_red("#status")
        assert page.number() == before
    finally:
        page.offline(False)
    page.settle()
    assert not page.is_old()
    assert page.text("#status") == ""
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "v0": 0.1}).mu_macro)
    page.complaints()


@pytest.fixture
def answered_by(open_page):
    """Replaces the service's response; the page is reloaded afterwards."""

    def answer(page, script):
        page.run(f"window.real ??= window.fetch; window.fetch = {script};")

    yield answer
    open_page.shown = None


def test_every_trouble_of_the_service_has_its_own_message(open_page, answered_by):
    page = open_page()
    said = "new Response(JSON.stringify({ detail: 'too many cases' }), { status: %s, headers: { 'Retry-After': '1' } })"
    for reply, message, red in (
        (f"async () => {said % 503}", "^The service cannot answer now: too many cases. Asking again by itself.", False),
        (f"async () => {said % 422}", "^The service refuses this: too many cases. Grey results belong to earlie", True),
        ("async () => new Response('<html>', { status: 200 })",
         "^The response of the service cannot be read .status 200.. Asking again by itself", False),
        ("(...all) => new Promise((done) => (window.late ??= []).push(() => done(window.real(...all))))",
         "^Waiting for the service. Grey results belong to earlier values.$", False),
    ):  # fmt: skip
        answered_by(page, reply)
        page.run("document.querySelector('#rigid').click();")
        page.wait_for("#status", message)
        assert page.is_old()
        assert page.is_red("#status") is red
    page.run("window.fetch = window.real; window.late.forEach((answer) => answer());")
    page.settle()
    assert not page.is_old()
    assert page.text("#status") == ""


def test_the_start_is_calm_while_the_service_is_not_ready(open_page, surrogate):
    unready = (
        "async (path, options) => (window.ready || path.includes('names.json') ? real(path, options) : new Response("
        "'{\"detail\": \"the tables are not loaded yet\"}', { status: 503, headers: { 'Retry-After': '1' } }))"
    )
    with open_page.faked(unready) as page:
        said = "^The service cannot answer now: the tables are not loaded yet. Asking again by itself.$"
        page.wait_for("#status", said)  # no word of earlier values: there are none
        assert not page.is_red("#status")
        assert page.text("#law-status") == page.text("#solve-status") == ""
        assert page.run("return document.querySelectorAll('[aria-invalid=true]').length;") == 0
        assert (page.text("#mu"), page.is_old()) == ("…", True)
        page.run("window.ready = true;")
        page.settle()
        assert page.text("#status") == ""
        assert page.number() == page.rounded(surrogate.evaluate(**START).mu_macro)


def test_contact_and_direction_are_offered_where_the_service_knows_them(open_page, surrogate):
    with open_page.faked(KNOWING) as page:
        page.settle()
        assert "contact" not in page.asked("v1/mu-macro")
        assert page.text("#rows") == "k is known: k known to 10 % leaves mu_macro uncertain by 6 %."
        assert page.number() == page.rounded(surrogate.evaluate(**START).mu_macro, 6)
        for choice in ("contact", "direction"):
            assert page.find(f"fieldset[data-needs={choice}]").is_displayed()
        page.click("[name=contact][value=ball]")
        page.click("[name=direction][value=normal]")
        for path in ("v1/mu-macro", "v1/law"):
            asked = page.asked(path)
            assert (asked["contact"], asked["direction"], asked["Fz_amplitude"]) == ("ball", "normal", 5)
            assert "y0" not in asked
        assert page.text("#model").startswith(
            "Model: a ball (Hertz) with the initial stiffness k, an oscillating normal"
        )
        assert page.find("#field-Fz_amplitude").is_displayed()
        assert not page.find("#field-y0").is_displayed()
        assert "does not hold" in page.text("#map-out")
        address = page.address()
        assert "contact=ball&direction=normal" in address
        assert "Fz_amplitude=5N" in address
        page.click("[name=direction][value=along]")
        page.find("#solve-form button").click()
        page.wait_for("#roots", "y₀ = ")
        assert page.asked("v1/solve-for")["direction"] == "along"
        page.click("#reset")
        assert (page.text("#map-out"), page.find("#field-y0").is_displayed()) == ("", True)
        assert page.complaints() == []


def test_an_interval_of_the_stiffness_gives_an_interval_of_friction(open_page, surrogate):
    with open_page.faked(KNOWING) as page:
        page.settle()
        page.type("#field-k", "0.8..1.2 N/um")
        assert page.value("#field-k") == "0.8..1.2 N/µm"
        assert page.asked("v1/mu-macro")["k_range"] == close([8e5, 1.2e6], rel=1e-15)
        ends = sorted(float(surrogate.evaluate(**{**START, "k": k}).mu_macro) for k in (8e5, 1.2e6))
        page.wait_for("#interval", rf"^{ends[0]:.3f} to {ends[1]:.3f} for k = 0.8..1.2 N/µm$")
        assert page.text("#mu") == f"{sum(ends) / 2:.3f}"
        assert page.asked("v1/law")["k_range"] == page.asked("v1/mu-macro")["k_range"]
        assert page.run("return document.querySelectorAll('#law .band').length;") == 1
        assert "k=0.8..1.2N/um" in page.address()
        page.choose("#along", "k")
        assert "k_range" not in page.asked("v1/law")
        page.type("#field-k", "1.2..0.8")
        assert page.text("#fault-k") == "k: must go up: write low..high."
        assert page.complaints() == []


def test_a_link_reproduces_the_state(open_page, surrogate):
    page = open_page("#Fz=12.5&along=y0&v0=0.01m/s&range=1e-7..1e-5&digits=all")
    link = page.address()
    before = [page.text("#mu"), page.find("#law").get_attribute("aria-label")]
    again = open_page("#" + link, new=True)
    assert [again.text("#mu"), again.find("#law").get_attribute("aria-label")] == before
    expected = surrogate.evaluate(**{**START, "Fz": 12.5})
    assert float(before[0]) == close(expected.mu_macro, abs=2 * expected.error_bound)
    assert (again.value("#field-Fz"), again.value("#along")) == ("12.5 N", "y0")
    assert (again.value("#field-v0"), again.value("#range")) == ("0.01 m/s", "1e-7..0.00001 m")
    assert not again.find("#notice").is_displayed()
    again.click("#reset")
    assert again.number() == again.rounded(surrogate.evaluate(**START).mu_macro)
    bad = open_page("#mu0=-1&k=rigid")
    assert "mu0 = -1 (must be finite and > 0)" in bad.text("#notice-text")
    bad.find("#notice-close").click()
    assert not bad.find("#notice").is_displayed()
    assert bad.complaints() == []
