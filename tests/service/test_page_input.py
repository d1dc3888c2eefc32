"""The page in a browser: what is typed, dragged, undone, linked, and what it shows while there is
no answer."""

import itertools
import math
import re
import shlex
import subprocess
import sys
from typing import Any

import pytest

from mumacro import Surrogate
from tests.support.browser import START
from tests.support.comparing import close
from tests.support.places import ROOT

pytestmark = pytest.mark.slow


def test_a_typed_value_applies_on_commit(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()

    def expect(**changed: Any) -> None:
        assert page.number() == page.rounded(surrogate.evaluate(**{**START, **changed}).mu_macro)

    page.type("#field-y0", "2.9", commit=False)
    expect()  # not while it is typed, which is told
    assert "Enter" in page.text("[for=field-y0]")
    page.find("#field-Fz").click()  # but on leaving the field; a plain number keeps its unit
    page.settle()
    expect(y0=2.9e-6)
    for field, typed, shown, changed in (
        ("y0", "0.0031mm", "0.0031mm", {"y0": 3.1e-6}),
        ("y0", "0.0032", "0.0032 mm", {"y0": 3.2e-6}),
        ("f", "1000 Hz", "1000 Hz", {"y0": 3.2e-6, "omega": 2000 * math.pi}),
        ("v0", "1e1 mm/s", "1e1 mm/s", {"y0": 3.2e-6, "omega": 2000 * math.pi}),
    ):
        page.type(f"#field-{field}", typed)
        assert page.value(f"#field-{field}") == shown
        assert "Enter" not in page.text(f"[for=field-{field}]")
        expect(**changed)


def read(page: Any, name: str) -> Any:
    """What the label of a field says that was understood."""
    return page.text(f"[for=field-{name}] small")


def test_what_was_understood_stands_in_the_label(open_page: Any) -> None:
    page = open_page()
    page.type("#field-k", "1 ± 10 % N/um")
    page.type("#field-k", "1 N/um ± 10 %")
    assert read(page, "k") == "± 0.1 N/µm"
    page.type("#field-k", "1 ± 0.1 N/um")  # it would say no more than the text
    assert read(page, "k") == ""
    page.type("#field-k", "800..1200 N/mm")
    assert read(page, "k") == ""
    page.type("#field-k", "1000 N/mm")
    page.type("#field-y0", "2e-6 m")
    assert read(page, "y0") == "read as 2 µm"
    page.type("#field-f", "0.0002")  # in the field of 20 kHz
    assert read(page, "f") == "read as 0.2 Hz"
    page.type("#field-y0", "2um")  # µ is typed as u
    assert read(page, "y0") == "half of peak to peak"


@pytest.mark.parametrize("width", [320, 768, 1280, 1920])
def test_what_was_understood_moves_no_field(open_page: Any, width: int) -> None:
    page = open_page(width=width, height=800)
    places = (
        "return [...document.querySelectorAll('#fields input, .field .ways')]"
        ".map((one) => one.getBoundingClientRect().y + scrollY);"
    )
    before = page.run(places)
    for name, text in (("mu0", "0.3 ± 5 %"), ("k", "0.9 N/um ± 10 %"), ("y0", "2e-6 m")):
        page.type(f"#field-{name}", text)
        assert read(page, name)
        assert page.run(places) == before, text


@pytest.mark.parametrize(
    ("address", "along", "up"),
    [
        ("v0=10 ± 6 mm/s", True, False),
        ("y0=2 ± 1.2 um", False, True),
        ("k=1 ± 0.6 N/um", True, True),  # which moves the point along both axes at once
        ("k=1 ± 0.6 N/um&y0=2 ± 1.2 um", True, True),
        ("direction=normal&Fz=10 ± 4 N", True, True),
    ],
)
def test_a_deviation_on_the_map_has_the_direction_of_its_cause(
    open_page: Any, address: str, along: bool, up: bool
) -> None:
    page = open_page(f"#{address}", width=1280, height=800)
    shape, box = page.run(
        "const one = document.querySelector('#map path.deviation');"
        "const { width, height } = one.getBBox();"
        "return [one.getAttribute('d'), [width, height]];"
    )
    assert [size > 12 for size in box] == [along, up]  # its caps have ten pixels
    assert ("A" in shape) is ("&y0" in address)  # two causes are an ellipse, one is a bar
    assert len(page.texts("#map .deviation")) == 1


def test_a_deviation_stands_beside_the_number(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page("#k=1 ± 0.1 N/um&mu0=0.3 ± 0.02")
    answer = surrogate.evaluate(**START, gradient=True)
    deviation = math.hypot(0.02 * answer.gradient["mu0"], 1e5 * answer.gradient["k"])
    assert float(page.text("#std").removeprefix(" ± ")) == close(deviation, rel=0.05)
    assert page.number() == close(answer.mu_macro, abs=10.0 ** math.floor(math.log10(deviation)))
    assert re.search("µ₀, .* k|k, .* µ₀", page.text("#advice"))
    assert len(page.texts("#law .deviation")) == 1
    # one that is not small is doubted, and its origin still told
    page.type("#field-Fz", "5 ± 6 N")
    doubts = [page.text("#advice"), *page.texts("#rows .doubt")]
    assert any("Standard deviation." in text for text in doubts)
    assert any("variance" in text and "Fz" in text for text in page.texts("#rows li"))
    bar, law = (page.find(f"#law {part}").rect for part in (".deviation", ".axis .domain"))
    assert bar["y"] + bar["height"] <= law["y"] + 2  # not below 0
    page.type("#field-Fz", "10 N")
    # which a drag keeps
    page.press("#field-k", "ARROW_UP")
    assert page.value("#field-k") == "1.05 N/µm ± 10 %"


def test_a_bad_value_greys_the_result_and_gives_the_services_reason(open_page: Any) -> None:
    page = open_page()
    before = page.number()
    page.type("#field-Fz", "5 mm")
    assert page.is_old("#number")
    assert page.find("#field-Fz").get_attribute("aria-invalid") == "true"
    assert page.find("#field-y0").get_attribute("aria-invalid") == "false"
    assert page.text("#note-Fz")
    assert page.text("#status") == "Check Fz. The number shown is that of Fz = 10 N."
    assert page.is_red("#status")
    assert page.run("return document.body.innerText;").count(page.text("#note-Fz")) == 1
    # another field does not repair it, and the last answer stays
    page.type("#field-mu0", "0.4")
    assert (page.is_old("#number"), page.number()) == (True, before)
    page.run("history.back();")
    page.settle()
    page.run("history.back(); await new Promise((next) => setTimeout(next, 100));")
    page.settle()
    assert (page.is_old("#number"), page.text("#status")) == (False, "")
    assert page.value("#field-Fz") == "10 N"
    # a drag of its label goes on from the last value that was understood
    page.type("#field-v0", "fast")
    assert page.is_old("#number")
    drag_label(page, "v0", 5, 20)
    assert not page.is_old("#number")
    assert page.value("#field-v0") == "12.2 mm/s"


def test_escape_takes_back_what_is_typed(open_page: Any) -> None:
    page = open_page()
    page.type("#field-Fz", "77 N", commit=False)
    page.press("#field-Fz", "ESCAPE")
    assert page.value("#field-Fz") == "10 N"
    assert "Enter" not in page.text("[for=field-Fz]")


#: whether all of a text is seen, and the fields that it covers
WHOLE = (
    "const one = document.querySelector('{}');"
    "return one.scrollHeight <= one.clientHeight && one.scrollWidth <= one.clientWidth;"
)
COVERED = (
    "const note = document.querySelector('#note-{0}').getBoundingClientRect();"
    "return [...document.querySelectorAll('.field')].filter((one) => {{"
    " const box = one.getBoundingClientRect();"
    " return !one.querySelector('#note-{0}') && box.left < note.right && note.left < box.right &&"
    " box.top < note.bottom - 1 && note.top < box.bottom - 1; }}).map((one) => one.textContent);"
)


@pytest.mark.parametrize("width", [360, 768, 1280, 1920])
def test_a_refusal_is_read_whole_and_covers_no_field(open_page: Any, width: int) -> None:
    page = open_page(width=width, height=800)
    for name, text in (("Fz", "5 apples"), ("k", "3 kg"), ("y0", "abc"), ("v0", "1 2 3 4")):
        page.type(f"#field-{name}", text)  # which keeps the focus
        assert page.find(f"#field-{name}").get_attribute("aria-invalid") == "true"
        assert page.run(WHOLE.format(f"#note-{name}")), name
        assert page.run(COVERED.format(name)) == [], name
        assert page.text("#law-status") == ""  # it is told once
        page.press(f"#field-{name}", "ESCAPE")
        page.click("#reset")
    page.type("#field-Fz", "5 apples")
    assert page.run(WHOLE.format("#status"))
    page.click("#tab-stiffness")
    page.type("#argument-radius", "3 parsec")
    page.click("#stiffness-form button")
    assert page.run(WHOLE.format("#about-radius"))
    page.click("#reset")
    page.type("#field-y0", "2")  # which is doubted
    assert page.run(COVERED.format("y0")) == []


def test_a_contact_is_rigid_by_a_choice(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page("#k=5e5 N/m")
    page.click("[name=contact][value=rigid]")
    rigid = surrogate.evaluate(**{**START, "k": "rigid"}).mu_macro
    assert page.number() == page.rounded(rigid)
    assert not page.find("#field-k").is_enabled()
    assert "k=rigid" in page.address()
    assert page.shown()["ṽ"] == page.shown()["ỹ"] == "– rigid contact"
    # it has no place on the map: the law has its room
    assert not page.find("#map").is_displayed()
    law, answer, side = (page.find(f"#{one}").rect for one in ("law-section", "answer", "side"))
    assert (law["x"], law["x"] + law["width"]) == (answer["x"], side["x"] + side["width"])
    page.click("[name=contact][value=spring]")
    assert page.value("#field-k") == "5e5 N/m"  # the earlier value
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "k": 5e5}).mu_macro)


def test_the_ways_to_k_stand_below_its_field(open_page: Any) -> None:
    page = open_page(width=1280, height=800)
    for name, title in (("stiffness", "k from materials"), ("fit", "k from measured friction")):
        page.click(f"#tab-{name}")
        tool, plot = page.find("#tool").rect, page.find("#map").rect
        assert tool["x"] >= plot["x"] + plot["width"]  # beside the map, which stays
        assert tool["y"] < 100
        assert title in page.find("#tool").text
        page.click(f"#part-{name} [data-close]")
        assert not page.find("#tool").is_displayed()
        assert page.find("#law").is_displayed()
    page.type("#field-k", "1 N/um ± 30 %")
    page.click("#as-interval")
    assert page.value("#field-k") == "0.7..1.3 N/µm"
    assert not page.find("#as-interval").is_enabled()  # it would take the place of the interval
    page.type("#field-k", "1 N/um")
    page.click("#as-interval")
    assert page.value("#field-k") == "0.9..1.1 N/µm"
    assert re.match(r"0\.\d+ to 0\.\d+$", page.text("#mu"))
    assert "decides" not in page.text("#answer")
    assert page.text(".ways").strip().startswith("Find k: ")
    for width in (320, 768, 1280, 1920):
        page = open_page(width=width, height=800)
        assert len({one["y"] for one in page.rects(".field .ways > *")}) == 1, width


def test_a_ball_whose_load_oscillates_cannot_be_chosen(open_page: Any) -> None:
    page = open_page("#contact=ball")
    normal, ball = (page.find(f"[value={name}]") for name in ("normal", "ball"))
    assert not normal.is_enabled()
    height = page.find("#chosen").rect["height"]
    page.find("label:has(> [value=normal])").click()
    assert "radius" in page.text("#chosen")  # why it cannot, in the place of the words
    assert page.find("#chosen").rect["height"] == height
    page.click("[name=contact][value=spring]")
    assert normal.is_enabled()
    page.click("[name=direction][value=normal]")
    assert not ball.is_enabled()


def test_a_rigid_contact_has_no_any_motion_and_says_why(open_page: Any) -> None:
    page = open_page("#k=rigid")
    assert not page.find("[value=any]").is_enabled()
    page.find("label:has(> [value=any])").click()
    assert "limit of a large k" in page.text("#chosen")
    page.click("[name=contact][value=spring]")
    page.click("[name=direction][value=any]")
    assert not page.find("[value=rigid]").is_enabled()
    assert "limit of a large k" in page.find("label:has(> [value=rigid])").get_attribute("title")
    # a link to both leads out again
    page = open_page("#k=rigid&motion=any")
    page.click("[name=contact][value=spring]")
    assert (page.number("#motion-mu"), page.text("#motion-status")) == (0.2405, "")


def test_all_that_k_from_materials_lacks_is_marked_at_once(open_page: Any) -> None:
    page = open_page("#panel=stiffness")
    page.click("#stiffness-form button")
    marked = page.run(
        "return [...document.querySelectorAll('#stiffness-form [aria-invalid=true]')]"
        ".map((one) => one.id);"
    )
    assert marked == ["argument-radius", "argument-E", "argument-nu"]
    page.type("#argument-radius", "5 mm")
    page.choose("#material-1", "steel")
    use = page.text("#stiffness-result button").strip()
    assert use == "Use, as a ball"
    k = page.text("#stiffness-result b")
    page.click("#stiffness-result button")
    assert f"k = {page.value('#field-k')}" == k  # with the digits of the list


def test_what_an_interval_would_be_is_said_before_it_is_tried(open_page: Any) -> None:
    page = open_page()
    button = page.find("#as-interval")
    assert button.text == "± 10 %"
    assert button.get_attribute("title") == "Try k from 0.9 to 1.1 N/µm"
    ways = page.text(".field .ways")
    assert re.search(r"materials\s+·\s+points\s+·\s+loop \(guide\)", ways)
    page.type("#field-k", "1 N/um ± 30 %")
    assert button.get_attribute("title") == "Try k from 0.7 to 1.3 N/µm"


def test_the_case_is_written_alike_in_its_field_and_below_the_law(open_page: Any) -> None:
    page = open_page(width=1280, height=800)
    page.type("#field-v0", "20 m/s")
    page.type("#field-v0", "20340 mm/s")  # where the axis is in m/s
    assert "v₀ [m/s]" in page.texts("#law .title")
    page.press("#field-v0", "ARROW_UP")
    speed = page.value("#field-v0")
    assert speed == "21360 mm/s"
    assert page.text("#law-read").startswith(f"Your case: v₀ = {speed}, ")


# --- the history ----------------------------------------------------------------------------------


def back(page: Any, steps: int = -1) -> None:
    page.run(f"history.go({steps}); await new Promise((next) => setTimeout(next, 150));")
    page.settle()


def test_back_and_forward_go_through_the_inputs(open_page: Any) -> None:
    page = open_page()
    page.type("#field-y0", "3 um")
    page.type("#field-mu0", "0.2")
    page.click("[name=contact][value=ball]")

    def values() -> tuple[str, str]:
        return page.value("#field-y0"), page.value("#field-mu0")

    back(page)
    assert page.find("[name=contact][value=spring]").is_selected()
    assert values() == ("3 um", "0.2")
    back(page)
    assert values() == ("3 um", "0.3")
    back(page, 2)
    assert page.find("[name=contact][value=ball]").is_selected()
    # the example can be undone
    page.click("#reset")
    assert values() == ("2 µm", "0.3")
    back(page)
    assert values() == ("3 um", "0.2")


def test_a_drag_is_one_step_and_the_map_stays_where_it_is(open_page: Any) -> None:
    page = open_page(width=1280, height=800)
    page.run(
        "window.steps = 0; const push = history.pushState.bind(history);"
        "history.pushState = (...all) => { window.steps += 1; push(...all); };"
    )
    place = "return document.querySelector('#map').getBoundingClientRect().toJSON();"
    before = page.run(place)
    amplitudes = []
    page.drag_begins("#map", 0.5, 0.6)
    for i in range(1, 13):
        page.drag_moves(0, -4)
        page.settle()
        number, unit = page.value("#field-y0").split()
        amplitudes.append(float(number) * {"nm": 1e-3, "µm": 1.0, "um": 1.0, "mm": 1e3}[unit])
        assert page.run(place) == before, i
        assert page.text("#map-read").startswith("At the pointer")
    page.drag_ends()
    # each step is the same factor
    ratios = [b / a for a, b in itertools.pairwise(amplitudes)]
    assert min(ratios) > 1.0
    assert ratios == [close(ratios[0], rel=0.01)] * len(ratios)
    assert page.run("return window.steps;") == 1
    back(page)
    assert page.value("#field-y0") == "2 µm"


@pytest.mark.parametrize("width", [320, 375, 761, 1024, 1181, 1280, 1500, 1920])
@pytest.mark.parametrize(
    "address",
    ["", "#k=1 ± 0.1 N/um&mu0=0.3 ± 0.02", "#k=0.1..10 N/um", "#k=0.1..10 N/um&digits=all"],
)
def test_nothing_that_is_pointed_at_moves(open_page: Any, width: int, address: str) -> None:
    page = open_page(address, width=width, height=800)
    place = (
        "const [a, b] = ['#map', '#law'].map((one) => document.querySelector(one)"
        ".getBoundingClientRect()); return [a, b].map(({ x, y, width, height }) =>"
        " [x, y + scrollY, width, height]);"
    )
    before = page.run(place)
    for plot in ("#map", "#law"):
        for x in (0.3, 0.5, 0.7):
            page.touched(plot, x, 0.5)
            assert page.run(place) == before, (plot, x)
        page.drag_begins(plot, 0.5, 0.5)
        for step in (30, 30, -90):
            page.drag_moves(step, 0)
            page.settle()
            assert page.run(place) == before, (plot, step)
        page.drag_ends()
        before = page.run(place)  # at the end of a drag, the texts are those of the new case


@pytest.mark.parametrize("width", [320, 375, 768, 1280, 1920])
def test_other_advice_at_the_end_of_a_drag_moves_no_map(open_page: Any, width: int) -> None:
    page = open_page(width=width, height=800)
    place = "return document.querySelector('#map').getBoundingClientRect().y + scrollY;"
    before = page.run(place), page.text("#advice"), page.texts("#remedies button")
    for x, y in ((0.75, 0.4), (0.3, 0.5)):
        page.touched("#map", x, y, click=True)
        after = page.run(place), page.text("#advice"), page.texts("#remedies button")
        assert after[0] == before[0], (x, y)
        assert after[1] != before[1]
    assert before[2] != []


def test_a_step_of_a_drag_draws_the_point_and_its_end_the_rest(open_page: Any) -> None:
    page = open_page(width=1280, height=800)
    page.run(
        "window.drawn = 0; new MutationObserver(() => { window.drawn += 1; })"
        ".observe(document.querySelector('#map'), { childList: true });"
    )
    place = "return document.querySelector('#map .point').getAttribute('transform');"
    page.drag_begins("#map", 0.5, 0.6)
    places = {page.run(place)}
    for _ in range(4):
        page.drag_moves(0, -8)
        page.settle()
        places.add(page.run(place))
        amplitude = page.value("#field-y0").replace(" ", "")
        assert f"y0={amplitude} " in page.value("#copy-text")
    assert len(places) == 5
    assert page.run("return window.drawn;") == 0  # the map below the point stays
    assert page.is_old("#advice")  # its words wait for the end of the drag
    page.drag_ends()
    assert not page.is_old("#advice")
    law = page.find("#law").get_attribute("aria-label")
    again = open_page("#" + page.address(), width=1280, height=800)
    assert again.find("#law").get_attribute("aria-label") == law


@pytest.mark.parametrize("plot", ["#map", "#law"])
def test_a_finger_drags_the_point_and_scrolls_elsewhere(open_page: Any, plot: str) -> None:
    page = open_page(width=390, height=844)
    with page.by_touch():
        page.run(f"document.querySelector({plot!r}).scrollIntoView({{block: 'center'}});")
        start = page.value("#field-v0")
        point = page.run(
            f"const [a, b] = [{plot!r}, {plot!r} + ' .point'].map("
            "(one) => document.querySelector(one).getBoundingClientRect());"
            "return [b.x + b.width / 2 - a.x, b.y + b.height / 2 - a.y];"
        )
        page.swipes(plot, point[0] + 60, point[1] + 70, *[(0, -6)] * 8)
        assert page.value("#field-v0") == start  # the page scrolled
        page.rests()
        page.run(f"document.querySelector({plot!r}).scrollIntoView({{block: 'center'}});")
        page.swipes(plot, *point, *[(5, 0)] * 8)
        assert page.value("#field-v0") != start
        moved = page.run(
            f"const [a, b] = [{plot!r}, {plot!r} + ' .point'].map("
            "(one) => document.querySelector(one).getBoundingClientRect());"
            "return b.x + b.width / 2 - a.x;"
        )
        assert moved == close(point[0] + 40, abs=3)


def test_arrow_keys_move_a_step_that_is_seen(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()
    page.press("#map", "ARROW_RIGHT", "ARROW_UP")
    expected = surrogate.evaluate(**{**START, "v0": 0.0105, "y0": 2.1e-6})
    assert page.number() == page.rounded(expected.mu_macro)
    page.press("#law", "ARROW_LEFT")
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "y0": 2.1e-6}).mu_macro)


def drag_label(page: Any, name: str, *steps: int) -> None:
    """Drag the label of a field to the right by steps of so many pixels."""
    page.drag_begins(f"[for=field-{name}]", 0.3, 0.5)
    for step in steps:
        page.drag_moves(step, 0)
        page.settle()
    page.drag_ends()


def test_a_label_is_dragged_by_a_per_cent_a_pixel(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page(width=1280, height=800)
    page.run(
        "window.steps = 0; const push = history.pushState.bind(history);"
        "history.pushState = (...all) => { window.steps += 1; push(...all); };"
    )
    places = (
        "return ['#map', '#law', '[for=field-k]'].map((one) =>"
        " document.querySelector(one).getBoundingClientRect().toJSON());"
    )
    before = page.run(places)
    page.drag_begins("[for=field-k]", 0.3, 0.5)
    page.drag_moves(10, 0)  # from where it becomes a drag
    start = page.value("#field-k")
    assert start == "1 N/µm"
    for i in range(1, 61):
        page.drag_moves(1, 0)
        page.settle()
        assert page.value("#field-k") == f"{float(f'{1.01**i:.4g}'):g} N/µm"
        assert page.run(places) == before, i
    # the copy goes with it
    assert f"k={page.value('#field-k').replace(' ', '')}" in page.value("#copy-text")
    page.drag_ends()
    k = float(page.value("#field-k").removesuffix(" N/µm")) * 1e6
    assert page.number() == page.rounded(surrogate.evaluate(**{**START, "k": k}).mu_macro)
    assert page.run("return window.steps;") == 1  # of the history
    assert page.run("return document.activeElement.tagName;") == "BODY"  # it was no click
    back(page)
    assert page.value("#field-k") == "1 N/µm"
    page.drag_begins("[for=field-k]", 0.3, 0.5)
    page.drag_moves(2, 20)  # down is no drag
    page.drag_moves(0, 20)
    page.drag_ends()
    assert page.value("#field-k") == "1 N/µm"
    page.find("[for=field-k]").click()
    assert page.run("return document.activeElement.id;") == "field-k"


@pytest.mark.parametrize("address", ["#k=rigid", "#y0=0"])
def test_a_label_without_a_number_to_start_from_is_not_dragged(
    open_page: Any, address: str
) -> None:
    page = open_page(address)
    name = address[1:].partition("=")[0]
    before = page.value(f"#field-{name}")
    assert page.find(f"[for=field-{name}]").value_of_css_property("cursor") != "ew-resize"
    drag_label(page, name, 5, 20)
    assert page.value(f"#field-{name}") == before


@pytest.mark.parametrize("name", ["mu0", "k", "v0"])
def test_a_swipe_that_starts_on_a_label_scrolls_and_changes_nothing(
    open_page: Any, name: str
) -> None:
    page = open_page(width=390, height=600)
    with page.by_touch():
        page.run(f"document.querySelector('#field-{name}').scrollIntoView({{block: 'end'}});")
        before, scrolled = page.value(f"#field-{name}"), page.run("return scrollY;")
        label = f"[for=field-{name}]"
        page.swipes(label, 20, 20, *[(1, -12)] * 10)
        page.rests()
        assert page.value(f"#field-{name}") == before
        assert page.run("return scrollY;") > scrolled + 60
        page.run(f"document.querySelector('#field-{name}').scrollIntoView({{block: 'center'}});")
        page.swipes(label, 20, 20, *[(6, 0)] * 8)  # sideways it is a drag
        assert page.value(f"#field-{name}") != before
        assert page.run("return document.activeElement.tagName;") == "BODY"


def test_arrow_keys_in_a_field_go_on_from_each_other(open_page: Any) -> None:
    page = open_page()
    page.press("#field-y0", *["ARROW_UP"] * 3)
    assert page.value("#field-y0") == "2.315 µm"
    page.press("#field-y0", "SHIFT", "ARROW_DOWN")
    assert page.value("#field-y0") == "2.304 µm"
    page.type("#field-y0", "7", commit=False)
    page.press("#field-y0", "ARROW_UP")  # not while a text is typed
    assert page.value("#field-y0") == "7"
    page.press("#field-y0", "ESCAPE")
    assert page.value("#field-y0") == "2.304 µm"


def test_a_number_without_a_unit_takes_that_of_its_field(open_page: Any) -> None:
    page = open_page()
    for name, texts in {
        "f": {"20": "20 kHz", "25": "25 kHz", "300 Hz": "300 Hz", "40": "40 Hz"},
        "k": {"2 ± 0.1": "2 ± 0.1 N/µm", "2 ± 5 %": "2 N/µm ± 5 %", "1..3": "1..3 N/µm"},
        "mu0": {"0.25": "0.25"},
    }.items():
        for typed, shown in texts.items():
            page.type(f"#field-{name}", typed)
            assert page.value(f"#field-{name}") == shown
            assert page.text("#status") == ""
    page = open_page("#f=20000")  # a link is in SI
    page.type("#field-f", "30000")
    assert page.value("#field-f") == "30000 Hz"


def test_a_ring_stands_around_what_keys_have_reached(open_page: Any) -> None:
    page = open_page()
    ring = "return getComputedStyle(document.activeElement).outlineStyle;"
    for plot in ("#map", "#law"):
        page.touched(plot, 0.5, 0.5, click=True)
        assert page.run(ring) == "none", plot
    page.find("#field-Fz").click()
    assert page.run(ring) == "none"
    page.type("#field-Fz", "12 N")
    assert page.run(ring) == "none"
    page.press("#field-Fz", "TAB")
    assert page.run("return document.activeElement.id;") == "field-k"
    assert page.run(ring) == "solid"
    page.find("#map").click()
    assert page.run(ring) == "none"


# --- links and copies -----------------------------------------------------------------------------


def test_a_link_reproduces_the_state(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page("#Fz=12.5 N&along=y0&v0=0.01m/s&from=1e-7 m&to=1e-5 m&digits=all")
    before = [page.text("#mu"), page.find("#law").get_attribute("aria-label")]
    page.type("#field-mu0", "0.3")
    again = open_page("#" + page.address())
    assert [again.text("#mu"), again.find("#law").get_attribute("aria-label")] == before
    expected = surrogate.evaluate(**{**START, "Fz": 12.5})
    assert float(before[0]) == close(expected.mu_macro, abs=2 * expected.error_bound)
    shown = [again.value(f"#{field}") for field in ("field-Fz", "along", "field-v0", "from")]
    assert shown == ["12.5 N", "y0", "0.01m/s", "1e-7 m"]
    assert not again.find("#notice").is_displayed()
    again.click("#tab-bars")
    assert open_page("#" + again.address()).find("#part-bars").is_displayed()
    bad = open_page("#mu0=-1&k=rigid&bad=1")
    assert "bad=1" in bad.text("#notice-text")
    assert bad.find("#field-mu0").get_attribute("aria-invalid") == "true"
    bad.click("#notice-close")
    assert not bad.find("#notice").is_displayed()


def copied(page: Any, name: str) -> str:
    """What the page gives to copy."""
    page.click(f"#copy-row [data-copy={name}]")
    return str(page.value("#copy-text"))


def output(*words: str, text: str | None = None) -> str:
    """What a program prints that is run from the root of the source tree."""
    done = subprocess.run(words, input=text, cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout


@pytest.mark.parametrize(
    "address",
    [
        "#y0=2.5 um&k=0.8 N/um",
        "#contact=ball&direction=along&v0=5 mm/s",
        "#direction=normal&Fz_amplitude=3 N",
        "#k=rigid&mu0=25 %",
        "#k=0.8..1.2 N/um",
        "#mu0=0.3 ± 0.02&k=1 N/um ± 10 %",
    ],
)
def test_every_copy_of_a_case_gives_the_number_of_the_page(open_page: Any, address: str) -> None:
    page = open_page(f"{address}&digits=all")
    number = float(page.text("#mu").split(" to ")[0])  # the value, or the lower end
    page_text = page.text("#mu")
    path = "mu_macro_low" if " to " in page_text else "mu_macro"

    python = output(sys.executable, "-", text=copied(page, "python"))
    assert float(re.findall(rf"{path} +(\S+)", python)[0]) == close(number, rel=1e-5)
    assert ("std " in python) is ("±" in address)
    words = shlex.split(copied(page, "command"))
    command = output(sys.executable, "-m", *words, "--json")
    assert float(re.findall(rf'"{path}": ([^,\s]+)', command)[0]) == close(number, rel=1e-8)
    curl = output(*shlex.split(copied(page, "curl")))
    assert float(re.findall(rf'"{path}":([^,\s]+)', curl)[0]) == close(number, rel=1e-8)
    link = open_page("#" + copied(page, "link").partition("#")[2])
    assert link.text("#mu") == page_text


def test_what_is_copied_breaks_after_commas_and_holds_what_was_typed(open_page: Any) -> None:
    page = open_page("#motion=any&k=0.5 .. 2 N/um")
    for name in ("python", "curl"):
        page.click(f"[data-copy={name}]")
        text = page.value("#copy-text")
        assert "1 N/µm" in text
        assert not re.search(r"\d{7}", text.partition(" -d ")[2] if name == "curl" else text)
        lines = text.split("\n")
        assert len(lines) > 3
        assert all(one.count('"') % 2 == 0 for one in lines), name  # no string is broken
        assert all(one.endswith(",") for one in lines[2 if name == "python" else 1 : -1])
    rows = page.run(
        "const field = document.querySelector('#copy-text');"
        "return field.clientHeight / parseFloat(getComputedStyle(field).lineHeight);"
    )
    assert rows <= len(page.value("#copy-text").split("\n")) + 3  # with its first line in two


def test_what_is_said_of_a_copy_goes_and_moves_nothing(open_page: Any) -> None:
    for width in (320, 1280):
        page = open_page(width=width, height=800)
        place = "return ['#print', '#copy-row'].map((one) => document.querySelector(one)" + (
            ".getBoundingClientRect().toJSON());"
        )
        page.run(
            "Object.defineProperty(navigator, 'clipboard', { configurable: true,"
            " value: { writeText: async () => { if (!window.allowed) throw new Error(); } } });"
        )
        before = page.run(place)
        for allowed, words in (("false", "Now copy it."), ("true", "Copied.")):
            page.run(f"window.allowed = {allowed};")
            page.click("[data-copy=command]")
            page.wait_for("#copy-status", words)
            assert page.run(place) == before, (width, words)
        page.wait_for("#copy-status", "^$")


MOTIONS = [
    "",
    "&y=2 um&normal=3 N @ 45 deg",
    "&contact=ball&direction=along&x=2um, 3:0.4um@90deg",
    "&k=1.2 ± 0.1 N/um&mu0=0.3 ± 10 %&x=1.5 um",
]


@pytest.mark.parametrize("address", MOTIONS)
def test_every_copy_of_a_motion_gives_the_number_of_the_page(open_page: Any, address: str) -> None:
    page = open_page(f"#motion=any{address}")
    number = page.number("#motion-values dd")

    python = float(output(sys.executable, "-", text=copied(page, "python")))
    digits = len(page.text("#motion-values dd").partition(".")[2])
    assert number == round(python, digits)  # which are those within its error
    command = output(sys.executable, "-m", *shlex.split(copied(page, "command")), "--json")
    assert float(re.findall(r'"mu_macro": ([^,\s]+)', command)[0]) == close(python, rel=1e-9)
    curl = output(*shlex.split(copied(page, "curl")))
    assert float(re.findall(r'"mu_macro":([^,\s]+)', curl)[0]) == close(python, rel=1e-9)
    link = open_page("#" + copied(page, "link").partition("#")[2])
    assert link.number("#motion-values dd") == number
    # a motion has no deviation, and says so
    assert ("±" in address) is ("deviation (±)" in page.text("#motion-doubt"))


def test_a_motion_is_in_the_address_and_the_history(open_page: Any) -> None:
    page = open_page()
    page.click("[name=direction][value=any]")
    page.run(
        "window.steps = 0; const push = history.pushState.bind(history);"
        "history.pushState = (...all) => { window.steps += 1; push(...all); };"
    )
    page.type("#motion-y", "2 um")
    first = page.number("#motion-values dd")
    page.type("#motion-y", "3 um @ 30 deg")
    page.choose("#motion-unknown", "k")
    assert page.run("return window.steps;") == 3
    assert "y=3+um+%40+30+deg" in page.address()
    assert "motion=any" in page.address()
    assert page.text("[for=motion-y] small") == ""  # it would say no more than the text
    back(page, -2)
    assert page.value("#motion-y") == "2 um"
    assert page.value("#motion-unknown") == "y.amplitude"
    assert page.number("#motion-values dd") == first
    back(page)
    assert page.value("#motion-y") == "2 µm"
    assert page.find("#motion").is_displayed()
    back(page, 3)
    assert (page.value("#motion-y"), page.value("#motion-unknown")) == ("3 um @ 30 deg", "k")


@pytest.mark.parametrize(
    ("address", "words", "field"),
    [("", "f=20kHz v0=10mm/s", "field-mu0"), ("#motion=any", "--y 2µm", "motion-y")],
)
def test_what_has_no_number_has_no_copy_but_its_link(
    open_page: Any, address: str, words: str, field: str
) -> None:
    page = open_page(address)

    def marked() -> list[str]:
        return [one.strip() for one in page.texts("#copy-row [aria-pressed=true]")]

    assert words in page.value("#copy-text")
    assert marked() == ["Command"]
    page.click("[data-copy=curl]")
    assert marked() == ["curl"]
    before = page.value(f"#{field}")
    page.type(f"#{field}", "wet")
    assert [one.strip() for one in page.texts("#copy-row :disabled")] == [
        "curl",
        "Python",
        "Command",
    ]
    assert marked() == ["Link"]
    assert "=wet" in page.value("#copy-text")
    page.type(f"#{field}", before)
    assert page.texts("#copy-row :disabled") == []
    assert marked() == ["curl"]  # the one that was chosen
    assert page.value("#copy-text").startswith("curl -s ")


# --- while there is no answer ---------------------------------------------------------------------


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
            (f"async () => {answer % 503}", "cannot answer now: too many cases. Retrying", False),
            (f"async () => {answer % 422}", "^too many cases", True),
            (
                "async () => new Response('<html>', { status: 200 })",
                "cannot be read .status 200.. Retrying automatically",
                False,
            ),
            (
                "(...all) => new Promise((done) => (window.late ??= []).push(() => "
                "done(real(...all))))",
                "^Waiting for the service",
                False,
            ),
        ):
            page.run(f"window.reply = {reply};")
            other = "rigid" if page.find("[value=spring]").is_selected() else "spring"
            page.run(f"document.querySelector('[value={other}]').click();")
            page.wait_for("#status", message)
            assert (page.is_old("#number"), page.is_red("#status")) == (True, red)
            assert page.number() == before
        page.run("delete window.reply; window.late.forEach((answer) => answer());")
        page.settle()
        page.run(
            "window.reply = () => Promise.reject(new TypeError());"
            "document.querySelector('[value=rigid]').click();"
        )
        page.wait_for("#status", "^No answer from the service. Retrying automatically.")
        # what the grey number is for
        assert re.search(r"shown is that of k = 1 N/.?µm\.$", page.text("#status"))
        page.run("delete window.reply; dispatchEvent(new Event('online'));")
        page.settle()
        rigid = surrogate.evaluate(**{**START, "k": "rigid"}).mu_macro
        assert page.number() == page.rounded(rigid)
        assert (page.is_old("#number"), page.text("#status")) == (False, "")


def test_the_start_is_calm_while_the_service_is_not_ready(
    open_page: Any, surrogate: Surrogate
) -> None:
    unready = (
        "async (path, options) => (window.ready || path.includes('names.json') ? real(path, "
        'options) : new Response(\'{"detail": "the tables are not loaded yet"}\', { status: 503, '
        "headers: { 'Retry-After': '1' } }))"
    )
    with open_page.faked(unready, wait=False) as page:
        page.wait_for("#status", "the tables are not loaded yet. Retrying automatically.$")
        assert not page.is_red("#status")
        assert page.text("#law-status") == page.text("#solve-status") == ""
        assert len(page.texts("[aria-invalid=true]")) == 0
        assert page.text("#mu") == "…"
        assert "There is no" not in page.text("#main")
        page.run("window.ready = true;")
        page.settle()
        assert page.text("#status") == ""
        assert page.number() == page.rounded(surrogate.evaluate(**START).mu_macro)


def test_a_file_that_is_not_loaded_is_told_and_the_number_stays(
    open_page: Any, surrogate: Surrogate
) -> None:
    blocked = {"urls": ["*/d3-shape.min.js"]}
    open_page.browser.execute_cdp_cmd("Network.enable", {})
    open_page.browser.execute_cdp_cmd("Network.setBlockedURLs", blocked)
    try:
        page = open_page(wait=False)
        page.wait_for("#status", "^The map and the law were not loaded: reload the page.$")
        assert page.is_red("#status")
        assert page.number() == page.rounded(surrogate.evaluate(**START).mu_macro)
    finally:
        open_page.browser.execute_cdp_cmd("Network.setBlockedURLs", {"urls": []})
    page = open_page()
    assert page.text("#status") == ""
    assert len(page.texts("#law .curve")) == 1


def test_a_phone_shows_the_number_wherever_the_page_is(open_page: Any) -> None:
    page = open_page(width=360, height=740)
    height = page.find("#now").rect["height"]
    for place in ("#field-mu0", "#copy"):
        page.run(f"document.querySelector('{place}').scrollIntoView();")
        scrolled = page.run("return scrollY;")
        assert page.find("#now").rect["y"] == close(scrolled, abs=0.5)
        assert page.find(place).rect["y"] - scrolled >= height  # covers nothing that is sought
    page.type("#field-y0", "0")
    assert page.text("#now") == "µ = 0.3000, 100 % left"
    assert page.find("#from").rect["x"] == page.find("#to").rect["x"]
    page.type("#field-y0", "2 µm ± 5 %")
    assert re.fullmatch(r"µ = \S+ ± \S+, about \d+ % left", page.text("#now"))
    assert not open_page(width=1280, height=800).find("#now").is_displayed()


def test_the_service_gone_has_one_colour_and_no_number_on_a_phone(open_page: Any) -> None:
    with open_page.faked(
        "(...all) => (window.gone ? Promise.reject(new TypeError()) : real(...all))"
    ) as page:
        page.click("#tab-target")
        page.run("window.gone = true;")
        page.run(
            "for (const [id, text] of [['field-y0', '3 um'], ['target', '0.4']]) {"
            "const field = document.getElementById(id); field.value = text;"
            "field.dispatchEvent(new Event('change', { bubbles: true })); }"
        )
        page.wait_for("#status", "^No answer from the service")
        assert page.texts("#main .bad") == []
        assert page.text("#short") == "µ = –, no answer"
        page.run("window.gone = false; dispatchEvent(new Event('online'));")
        page.settle()
        assert page.text("#short").startswith("µ = 0.1")
        page.run("window.gone = true;")
        page.run(
            "const field = document.getElementById('target'); field.value = '0.3';"
            "field.dispatchEvent(new Event('change', { bubbles: true }));"
        )
        page.wait_for("#solve-status", "^No answer from the service")
        assert page.texts("#main .bad") == []
        page.run("document.querySelector('[value=any]').click();")
        page.wait_for("#motion-status", "^No answer from the service")
        assert page.texts("#main .bad") == []
        assert page.text("#short") == "µ = –, no answer"


@pytest.mark.parametrize("width", [320, 375])
def test_a_phone_has_room_for_labels_links_and_the_map(open_page: Any, width: int) -> None:
    for address in ("", "#motion=any&x=2 um @ 90 deg&normal=5 N @ -90 deg"):
        page = open_page(address, width=width, height=700)
        heights = page.run(
            "return [...document.querySelectorAll('#inputs .field .label')].map((one) =>"
            " { const range = document.createRange(); range.selectNodeContents(one);"
            " return new Set([...range.getClientRects()].map((box) => Math.round(box.y / 8)))"
            ".size; });"
        )
        assert max(heights) <= 2
        cut = page.run(
            "return [...document.querySelectorAll('#inputs .field label')].filter((one) =>"
            " one.scrollWidth > one.clientWidth).map((one) => one.textContent);"
        )
        assert cut == []
        words = page.texts("#jump button:not([hidden])")
        assert (words[0], words[-1]) == ("Inputs", "Copy")
        assert len({one["y"] for one in page.rects("#jump button:not([hidden])")}) == 1
    page = open_page(width=width, height=700)
    assert "y₀ [µm]" not in page.texts("#map .title")
    frame, plot = page.rects("#map rect.shade")[0], page.rects("#map")[0]
    assert frame["width"] > 0.7 * plot["width"]
    assert 4 <= len(page.texts("#map .tag:not(.covered)")) <= 6


def test_keys_reach_the_map_at_once(open_page: Any) -> None:
    page = open_page()
    page.find("body").send_keys("")
    page.run("document.querySelector('#skip').focus();")
    page.press("#skip", "ENTER")
    assert page.run("return document.activeElement.id;") == "map"
    assert not open_page("#k=rigid").find("#skip").is_displayed()


@pytest.mark.parametrize("width", [768, 900, 1024, 1280, 1440, 1920])
def test_no_message_moves_the_cards_beside_it(open_page: Any, width: int) -> None:
    page = open_page(width=width, height=800)
    places = (
        "return ['answer', 'map', 'law', 'side'].map((id) =>"
        " document.getElementById(id).getBoundingClientRect().toJSON());"
    )
    before = page.run(places)
    for text in ("5 mm", "", "abc", "1e9", "12", "10 ± 1 N"):
        page.type("#field-Fz", text)
        assert page.run(places) == before, text
    if width < 1280:
        return
    for name in ("ball", "along", "spring", "normal", "across"):
        page.click(f"[type=radio][value={name}]")
        assert page.run(places)[:2] == before[:2], name
    for address in ("#y0=2", "#k=0.8..1.2 N/um", "#k=1 ± 0.1 N/um", "#digits=all", "#v0=1e300"):
        page = open_page(address, width=width, height=800)
        assert page.run(places)[:2] == before[:2], address


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (1920, 1080), (2560, 1440)])
@pytest.mark.parametrize("address", ["", "#k=0.9..1.1 N/um", "#direction=normal&contact=spring"])
def test_the_inputs_fill_their_card(open_page: Any, width: int, height: int, address: str) -> None:
    page = open_page(address, width=width, height=height)
    card, last = (page.find(one).rect for one in ("#inputs", "#fields .field:last-child"))
    assert card["y"] + card["height"] - last["y"] - last["height"] <= 14
    ends = [page.find(one).rect for one in ("#map-section", "#side")]
    feet = [one["y"] + one["height"] for one in ends]
    assert max(feet) - min(feet) <= 1


@pytest.mark.parametrize("width", [360, 390])
def test_the_head_of_a_phone_is_one_row(open_page: Any, width: int) -> None:
    page = open_page(width=width, height=740)
    title, links = page.find("h1 .name").rect, page.find("nav").rect
    assert links["y"] < title["y"] + title["height"]
    assert links["x"] >= title["x"] + title["width"]
    # the words that lead to the cards begin where they do, and no keys are spoken of
    words = page.run(
        "const range = document.createRange();"
        "range.selectNodeContents(document.querySelector('#jump button'));"
        "return range.getBoundingClientRect().x;"
    )
    assert words == page.find("#inputs").rect["x"]
    assert not page.find(".by-keys").is_displayed()
