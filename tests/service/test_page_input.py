"""The page in a browser: typed values, links, and the display while there is no response."""

import math
from typing import Any

import pytest

from mumacro import Surrogate
from tests.support.browser import START
from tests.support.comparing import close

pytestmark = pytest.mark.slow


def test_a_typed_value_applies_on_commit(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()

    def expect(**changed: Any) -> None:
        assert page.number() == page.rounded(surrogate.evaluate(**{**START, **changed}).mu_macro)

    page.type("#field-y0", "2.9", commit=False)
    expect()  # not while it is typed
    page.find("#field-Fz").click()  # but on leaving the field
    page.settle()
    expect(y0=2.9e-6)
    # a plain number keeps the unit of its field; all digits that were typed stay
    for field, typed, shown, changed in (
        ("y0", "0.0031mm", "0.0031 mm", {"y0": 3.1e-6}),
        ("y0", "0.0032", "0.0032 mm", {"y0": 3.2e-6}),
        ("omega", "1000 Hz", "1000 Hz", {"y0": 3.2e-6, "omega": 2000 * math.pi}),
    ):
        page.type(f"#field-{field}", typed)
        assert page.value(f"#field-{field}") == shown
        expect(**changed)


def test_a_bad_value_greys_the_result_and_gives_the_reason(
    open_page: Any, surrogate: Surrogate
) -> None:
    page = open_page()
    page.type("#field-Fz", "5 mm")
    assert page.is_old()
    assert page.find("#field-Fz").get_attribute("aria-invalid") == "true"
    assert page.text("#fault-Fz") == "Fz: “mm” is not a unit of Fz: give N, mN, kN."
    assert (
        page.text("#status") == f"{page.text('#fault-Fz')} Grey results belong to earlier values."
    )
    assert page.is_red("#status")
    before = page.number()
    # another field does not repair it, and no request is sent meanwhile
    page.type("#field-mu0", "0.4")
    assert (page.is_old(), page.number()) == (True, before)
    page.press("#field-Fz", "ESCAPE")
    assert not page.is_old()
    assert (page.text("#status"), page.text("#fault-Fz"), page.value("#field-Fz")) == (
        "",
        "",
        "10 N",
    )
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "mu0": 0.4}).mu_macro)
    # an empty field is no error, but there is no result for it
    page.type("#field-Fz", "")
    assert page.text("#status").startswith("Fz: give a number.")
    assert (page.is_old(), page.is_red("#status")) == (True, False)
    assert page.find("#field-Fz").get_attribute("aria-invalid") == "false"
    page.press("#field-Fz", "ESCAPE")
    # the slider of a field repairs it, too
    page.type("#field-v0", "fast")
    assert page.is_old()
    page.choose("#slider-v0", "-1000", "input")
    assert not page.is_old()
    assert page.number() == page.rounded(
        surrogate.evaluate(**{**START, "mu0": 0.4, "v0": 0.1}).mu_macro
    )
    assert page.text("#regime") == "continuous"
    assert page.find("#slider-v0").get_attribute("aria-valuetext") == "v₀ = 100 mm/s"


def test_a_contact_is_rigid_by_a_switch(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page("#k=5e5")
    page.click("#rigid")
    # no k to be known
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "k": "rigid"}).mu_macro, 6)
    assert not page.find("#field-k").is_enabled()
    assert "k=rigid" in page.address()
    assert (page.shown()["ṽ = v₀/(l₀ω)"], page.shown()["shaker power"]) == ("∞", "– (rigid)")
    assert page.text("#model").startswith("One model: rigid contact, oscillation across")
    assert "rigid contact has no point" in page.text("#map-out")
    page.touched("#map", 0.5, 0.5, click=True)
    assert page.value("#field-v0") == "10 mm/s"
    page.click("#rigid")
    assert page.value("#field-k") == "500000 N/m"  # the earlier value
    page.type("#field-k", "rigid")
    assert page.find("#rigid").is_selected()


def test_every_trouble_of_the_service_has_its_own_message(
    open_page: Any, surrogate: Surrogate
) -> None:
    answer = (
        "new Response(JSON.stringify({ detail: 'too many cases' }), { status: %s, headers: { "
        "'Retry-After': '1' } })"
    )
    with open_page.faked("(...all) => (window.reply ?? real)(...all)") as page:
        before = page.number()
        for reply, message, red in (
            (
                f"async () => {answer % 503}",
                "^The service cannot answer now: too many cases. Asking again by its",
                False,
            ),
            (
                f"async () => {answer % 422}",
                "^The service refuses this: too many cases. Grey results belong to e",
                True,
            ),
            (
                "async () => new Response('<html>', { status: 200 })",
                "^The response of the service cannot be read .status 200.. Asking again by itself",
                False,
            ),
            (
                "(...all) => new Promise((done) => (window.late ??= []).push(() => "
                "done(real(...all))))",
                "^Waiting for the service. Grey results belong to earlier values.$",
                False,
            ),
        ):
            page.run(f"window.reply = {reply}; document.querySelector('#rigid').click();")
            page.wait_for("#status", message)
            assert (page.is_old(), page.is_red("#status"), page.number()) == (True, red, before)
        page.run("delete window.reply; window.late.forEach((answer) => answer());")
        page.settle()
        page.run(
            "window.reply = () => Promise.reject(new TypeError()); "
            "document.querySelector('#rigid').click();"
        )
        page.wait_for(
            "#status",
            "^The service does not answer. Asking again by itself. Grey results belong to earlier",
        )
        page.run("delete window.reply; dispatchEvent(new Event('online'));")
        page.settle()
        assert page.number() == page.rounded(
            surrogate.evaluate(**{**START, "k": "rigid"}).mu_macro, 6
        )
        assert (page.is_old(), page.text("#status")) == (False, "")


def test_the_start_is_calm_while_the_service_is_not_ready(
    open_page: Any, surrogate: Surrogate
) -> None:
    unready = (
        "async (path, options) => (window.ready || path.includes('names.json') ? real(path, "
        'options) : new Response(\'{"detail": "the tables are not loaded yet"}\', { status: 503, '
        "headers: { 'Retry-After': '1' } }))"
    )
    with open_page.faked(unready, wait=False) as page:
        message = (
            "^The service cannot answer now: the tables are not loaded yet. Asking again by "
            "itself.$"
        )
        page.wait_for("#status", message)  # no word of earlier values: there are none
        assert not page.is_red("#status")
        assert page.text("#law-status") == page.text("#solve-status") == ""
        assert len(page.texts("[aria-invalid=true]")) == 0
        assert (page.text("#mu"), page.is_old()) == ("…", True)
        page.run("window.ready = true;")
        page.settle()
        assert page.text("#status") == ""
        assert page.number() == page.rounded(surrogate.evaluate(**START).mu_macro)


def test_a_link_reproduces_the_state(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page("#Fz=12.5&along=y0&v0=0.01m/s&range=1e-7..1e-5&digits=all")
    before = [page.text("#mu"), page.find("#law").get_attribute("aria-label")]
    again = open_page("#" + page.address(), new=True)
    assert [again.text("#mu"), again.find("#law").get_attribute("aria-label")] == before
    expected = surrogate.evaluate(**{**START, "Fz": 12.5})
    assert float(before[0]) == close(expected.mu_macro, abs=2 * expected.error_bound)
    shown = [again.value(f"#{field}") for field in ("field-Fz", "along", "field-v0", "range")]
    assert shown == ["12.5 N", "y0", "0.01 m/s", "1e-7..0.00001 m"]
    assert not again.find("#notice").is_displayed()
    again.click("#reset")
    assert again.number() == again.rounded(surrogate.evaluate(**START).mu_macro)
    bad = open_page("#mu0=-1&k=rigid")
    assert "mu0 = -1 (must be finite and > 0)" in bad.text("#notice-text")
    bad.click("#notice-close")
    assert not bad.find("#notice").is_displayed()
