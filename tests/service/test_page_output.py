"""The page in a browser: the numbers, the map, the friction law, the panels, downloads, print."""

import base64
import csv
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from xml.etree import ElementTree

import numpy as np
import pytest

import mumacro
from mumacro import Surrogate, plotting
from mumacro.stiffness import contact_of
from service.routers.page import ASSETS
from tests.support.browser import RECORDED, START, plain
from tests.support.cases import Case
from tests.support.comparing import close

pytestmark = pytest.mark.slow
ODD, SEEN = (
    r"NaN|undefined|null|Infinity|\[object",
    "return document.querySelector('main').innerText;",
)
SKETCH = ("spring", "ball", "rigid", "across", "along", "normal")
AXIS = "return document.querySelector('#law > .title').textContent;"  # of the law


def test_it_loads_and_shows_the_known_value(
    open_page: Any, surrogate: Surrogate, live_server: Any
) -> None:
    page = open_page()
    answer = surrogate.evaluate(**START, gradient=True)
    assert page.number() == page.rounded(answer.mu_macro) == 0.2405
    assert page.text("#share") == "80 % of µ₀ is left"
    assert page.text("#regime") == "Stick and slip: sticks for 77 % of each period"
    assert page.text("#advice") == (
        "µ₀ decides most. 10 % of it changes µ by 16 %, 10 % of k by 6 %."
    )
    assert page.text("#validity") == "2 remarks on this case"
    assert not page.find("#rows").is_displayed()
    page.click("#assumes summary")
    assert page.find("#rows").is_displayed()
    assert len(page.texts("#rows li")) == 2
    stick = surrogate.stick_fraction(answer.v_tilde, answer.y_tilde)
    settled = surrogate.evaluate(**START, include=("settling",))
    limits = surrogate.evaluate(**START, include=("limits",))
    power = surrogate.power(answer.v_tilde, answer.y_tilde) * 0.3 * 10 * 3e-6 * START["omega"]
    expected = {
        "µ/µ₀": f"{answer.mu_ratio:.4g}",
        "ṽ": f"{answer.v_tilde:.4g}",
        "ỹ": f"{answer.y_tilde:.4g}",
        "l₀": "3 µm",
        "peak y₀ω": "251.3 mm/s",
        "sticks": f"{100 * stick:.4g} %",
        "shaker power": f"{1e3 * power:.4g} mW",
        "power saved": f"{1e3 * (0.3 - answer.mu_macro) * 0.1:.4g} mW",
        "critical speed": f"{1e3 * limits['limits.v0_crit']:.4g} mm/s",
        "periods to settle": f"{settled['settling.periods']:.4g}",
        "numerical error": f"≤ {answer.error_bound:.2g}",
    }
    assert expected.items() <= page.shown().items()
    page.click("#tab-bars")
    shares = [
        float(text.strip().replace("−", "-").removesuffix(" %"))
        for text in page.texts("#bars td:last-child")
    ]
    for share, (name, value) in zip(shares, START.items(), strict=True):
        assert share == round(answer.gradient[name] * value / answer.mu_macro, 2)
    # all digits are those that the table's bound supports
    page.click("#digits")
    assert page.number() == close(answer.mu_macro, abs=2 * float(answer.error_bound))
    assert len(page.text("#mu")) > 10
    loaded = page.run("return performance.getEntriesByType('resource').map((entry) => entry.name);")
    assert len(loaded) >= len(ASSETS)
    assert {urlsplit(address).netloc for address in loaded} == {urlsplit(live_server.url).netloc}


LEFT = {
    "#y0=0": "All of µ₀ is left",
    "#v0=0&contact=rigid": "Nothing of µ₀ is left",
    "#k=0.1..10 N/um": "12 to 99.9 % of µ₀ is left",
    "#k=1 ± 0.1 N/um": "About 80 % of µ₀ is left",
    "#k=1 ± 0.5 N/um": "About 50 to 96 % of µ₀ is left",
    "#y0=20um": "1.2 % of µ₀ is left",
    "#v0=2 m/s": "99.6 % of µ₀ is left",
}


@pytest.mark.parametrize("address", LEFT)
def test_what_is_left_is_said_in_words_below_the_number(open_page: Any, address: str) -> None:
    page = open_page(address)
    number, share, regime = (page.find(one).rect["y"] for one in ("#number", "#share", "#regime"))
    assert number < share < regime
    assert page.text("#share") == LEFT[address]


def test_what_holds_at_the_middle_of_an_interval_names_it(open_page: Any) -> None:
    page = open_page("#k=0.1..10 N/um")
    assert page.text("#number") == "0.035 to 0.300"
    assert page.text("#share") == "12 to 99.9 % of µ₀ is left"
    page.wait_for(
        "#regime", r"^Continuous sliding below k = 0\.1197 N/.?µm, stick and slip above it$"
    )
    assert "µ = 0.2405 at k = 1 N/" in page.text("#advice")
    assert "k = 1 N/" in page.text("#middle")
    assert page.text("#bars-of").endswith(", at k = 1 N/µm")
    page.type("#field-k", "0.9..1.1 N/um")
    page.wait_for("#regime", "^Stick and slip in the whole interval$")
    page.type("#field-k", "1 N/um")
    assert page.text("#middle") == ""


@pytest.mark.parametrize(
    ("address", "mu", "v"),
    [
        ("#k=1 ± 0.1 N/um&mu0=0.3 ± 0.02", "0.240 ± 0.028", "0.0265 ± 0.0032"),
        ("#k=1 ± 0.5 N/um", "0.149 to 0.287", "0.0265 ± 0.013"),
        ("#k=0.1..10 N/um", "0.035 to 0.300", "0.00265 to 0.265"),
    ],
)
def test_what_is_open_about_the_number_is_told_everywhere(
    open_page: Any, address: str, mu: str, v: str
) -> None:
    page = open_page(address)
    assert page.text("#number").removesuffix(" (1 std. dev.)") == mu
    for place in ("#middle", "#map-read", "#law-read"):
        assert f"µ = {mu}" in page.text(place), place
    assert f"ṽ = {v}" in page.text("#map-read")
    assert page.texts("#law .deviation") != []
    assert len(page.texts(".point.open")) == 2
    page.choose("#along", "k")
    where = "1 N/µm" if "±" in address else "0.1 N/µm to 10 N/µm"
    assert f"k = {where}, µ = {mu}" in page.text("#law-read")


DECIDING = ("", "#y0=2.9 um", "#k=100 N/um", "#y0=20 um", "#contact=ball&direction=along", "#v0=0")


@pytest.mark.parametrize("address", [*DECIDING, "#k=rigid"])
def test_what_decides_most_is_the_first_of_the_sensitivities(open_page: Any, address: str) -> None:
    page = open_page(address)
    page.click("#tab-bars")
    names = [name.strip() for name in page.texts("#bars th[scope=row]")]
    shares = [
        abs(float(text.strip().replace("−", "-").removesuffix(" %"))) if "%" in text else 0.0
        for text in page.texts("#bars .change")
    ]
    first = names[shares.index(max(shares))]
    page.click("#assumes summary")
    told = [page.text("#advice"), *page.texts("#rows li")]
    decides = [re.match(r"(.*) decides? most\.", text) for text in told]
    assert any(decides) is (address != "#k=rigid")
    assert all(first in match[1].split(" and ") for match in decides if match)
    assert (told[0].startswith("Rigid contact. The contact")) is (address == "#k=rigid")
    changes = [text.strip() for text in page.texts("#bars .change")]
    assert all(re.fullmatch(r"[+−]\d+\.\d\d %|– .*", text) for text in changes)


def test_what_is_advised_for_k_is_done_by_buttons(open_page: Any) -> None:
    page = open_page()
    give, fit = page.texts("#remedies button")
    assert (give, fit) == ("give k as 0.9 to 1.1 N/µm", "fit it")
    page.click("#remedies button:last-child")
    assert page.find("#part-fit").is_displayed()
    page.click("#give")
    assert page.value("#field-k") == "0.9..1.1 N/µm"
    assert page.texts("#remedies button") == []
    assert page.text("#advice").startswith("Interval. ")


@pytest.mark.parametrize("address", ["", "#v0=100 m/s", "#y0=2", "#k=0.9..1.1 N/um", "#k=rigid"])
def test_the_remarks_on_a_case_are_counted(open_page: Any, address: str) -> None:
    page = open_page(address)
    told = page.text("#validity")
    page.click("#assumes summary")
    rows = [one for one in page.texts("#rows li") if "decides" not in one and "decide" not in one]
    count = len([one for one in rows if not one.startswith(("Interval", "Uncertainty"))])
    more = " more" if "doubt" in page.find("#advice").get_attribute("class") else ""
    plural = "" if count == 1 else "s"
    assert told == f"{count or 'No'}{more} remark{plural} on this case"
    # they stand before what is always assumed
    text = page.find("#assumes").text
    assert all(text.index(one[:20]) < text.index("Always.") for one in rows)
    assert "Coulomb friction" in page.text("#assumes summary")


@pytest.mark.parametrize("direction", ["across", "along"])
@pytest.mark.parametrize("width", [320, 1280])
def test_the_lines_of_the_map_have_a_key(open_page: Any, direction: str, width: int) -> None:
    page = open_page(f"#direction={direction}", width=width, height=800)
    names = ["critical speed"] + (["reverse slip"] if direction == "along" else [])
    assert page.texts("#map .key text") == names


def test_the_pointer_has_a_cross_on_the_map(open_page: Any) -> None:
    page = open_page()
    page.touched("#map", 0.6, 0.4)
    assert len(page.texts("#map .cross")) == 1
    page.touched("#law", 0.6, 0.4)
    assert page.texts("#map .cross") == []


def test_what_is_smaller_than_the_point_makes_it_a_ring(open_page: Any) -> None:
    page = open_page("#k=1 ± 0.1 N/um")
    assert page.texts("#map .deviation") == []
    assert len(page.texts("#map .point.open")) == 1


@pytest.mark.parametrize("width", [320, 1280])
@pytest.mark.parametrize("target", ["0.5", "0.1234", "0.05"])
def test_the_number_of_a_target_is_in_the_frame(open_page: Any, width: int, target: str) -> None:
    page = open_page(f"#side=target&target={target}", width=width, height=800)
    [text], [frame] = page.rects("#map .target-number"), page.rects("#map rect.shade")
    assert frame["left"] <= text["left"] < text["right"] <= frame["right"]


def test_inputs_that_reach_a_target_are_offered_where_one_cannot(open_page: Any) -> None:
    page = open_page("#side=target&target=0.05&unknown=f")
    page.wait_for("#solve-result", "No value of f gives that")
    page.until(lambda: page.texts("[data-try]"), lambda: "no input is offered")
    assert [one.strip() for one in page.texts("[data-try]")] == ["try y₀"]
    page.click("[data-try=y0]")
    page.wait_for("#solve-result", r"y₀ = \S+ µm: µ = 0\.015")
    assert page.value("#unknown") == "y0"


def test_a_target_follows_a_drag_and_others_are_asked_for_at_its_end(open_page: Any) -> None:
    with open_page.faked(RECORDED, "#side=target&target=0.05&unknown=f") as page:
        page.until(lambda: page.texts("[data-try]"), lambda: "no input is offered")
        asked = "return window.asked.filter(([path]) => path === 'v1/solve-for').length;"
        page.drag_begins("[for=field-Fz]", 0.3, 0.5)
        page.drag_moves(6, 0)  # from where it is a drag
        for _ in range(4):
            before = page.run(asked)
            page.drag_moves(6, 0)
            page.settle()
            assert page.run(asked) - before == 1
        page.drag_ends()
        assert page.run(asked) - before >= 6
        assert page.texts("[data-try]") != []


LABELS = """
const law = document.querySelector('#law');
const boxes = [...law.querySelectorAll('.mark, .note')].map((one) =>
  [one.textContent, one.getBoundingClientRect()]);
const found = [];
for (const curve of law.querySelectorAll('.curve, .still, .rule'))
  for (let at = 0; at <= curve.getTotalLength(); at += 1) {
    const { x, y } = curve.getPointAtLength(at).matrixTransform(curve.getScreenCTM());
    for (const [words, box] of boxes)
      if (x > box.left && x < box.right && y > box.top + 2 && y < box.bottom - 2)
        found.push(words);
  }
return [boxes.map(([words]) => words), [...new Set(found)]];
"""
LAWS = {
    "": {"critical speed", "y₀ω"},
    "direction=along": {"critical speed = y₀ω"},
    "along=k": {"← sliding all", "the time"},
    "along=Fz": {"sliding all", "the time →"},
    "along=y0": {"← sliding all", "the time"},
    "along=y0&scale=linear&axis=zero": {"← sliding"},
    "direction=along&along=k": {"reverse slip"},
    "direction=normal&along=f": {"sliding"},
}


@pytest.mark.parametrize("address", LAWS)
@pytest.mark.parametrize("width", [375, 1280, 1920])
def test_what_begins_at_a_border_is_named_beside_the_curve(
    open_page: Any, address: str, width: int
) -> None:
    page = open_page(f"#{address}", width=width, height=800)
    names, covering = page.run(LABELS)
    assert covering == []
    told = " ".join(names)
    if width == 1280:
        assert all(one in told for one in LAWS[address]), names
    side = re.search("[←→]", told)
    assert (side is None) is ("along=" not in address.replace("direction=along", ""))


REFUSED = {
    "#Fz=5 apples": "Fz",
    "#mu0=-1&k=5 N/um": "µ₀",
    "#direction=normal&Fz=1 N&Fz_amplitude=2 N": "ΔFz",
    "#k=rigid&y0=wet": "y₀",
}


@pytest.mark.parametrize("address", REFUSED)
@pytest.mark.parametrize("width", [375, 1280])
def test_a_link_that_is_refused_shows_another_number_and_says_whose(
    open_page: Any, address: str, width: int
) -> None:
    page = open_page(address, width=width, height=800)
    assert page.text("#status").startswith(f"Check {REFUSED[address]}. The number shown is that of")
    assert page.is_old("#number")
    assert page.number() > 0
    note = page.text(".field.bad .note")
    assert page.run("return document.body.innerText;").count(note) == 1
    assert len(page.texts("#law.old .curve")) == 1
    assert (page.texts("#map.old .point") != []) is ("rigid" not in address)
    assert "There is no" not in page.text("#main")
    assert page.text("#law-read").startswith("Your case: ")


def test_a_case_that_is_not_shaken_has_no_group_that_is_infinite(open_page: Any) -> None:
    page = open_page("#y0=0")
    assert page.shown()["ṽ"] == "– not shaken"
    assert page.shown()["ỹ"] == "0"
    assert "∞" not in page.text("#map-read")
    # its mark stands at its speed, below the map, whose own axis keeps a unit that reads
    titles = page.texts("#map .axis ~ .title")
    assert "y₀ [µm]" in titles


def test_no_sentence_has_two_colons(open_page: Any) -> None:
    for address in ("", "#k=0.9..1.1 N/um", "#mu0=0.3±0.02", "#contact=rigid", "#mu0=-1"):
        page = open_page(address)
        for part in ("#regime", "#advice", "#status", "#map-read", "#law-read"):
            for sentence in page.text(part).split(". "):
                assert sentence.count(":") <= 1, (address, part, sentence)
        assert page.value("#copy-text").count(": ") <= 1


def test_a_doubtful_unit_is_told_beside_the_number_and_the_field(open_page: Any) -> None:
    page = open_page("#y0=2")
    assert page.text("#advice").startswith("Check the units. ")
    assert "doubt" in page.find("#advice").get_attribute("class")
    assert "y" in page.text("#note-y0")
    assert "doubt" in page.run(
        "return document.querySelector('#field-y0').closest('.field').className;"
    )
    page.type("#field-y0", "2 um")
    assert "units" not in page.text("#advice")


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("#f=20000 kHz", "is f = 20000 kHz right?"),
        ("#y0=20000 um", "is y₀ = 20000 µm right?"),
        ("#y0=2", "is it in metres?"),
    ],
)
def test_a_value_is_doubted_as_it_was_typed(open_page: Any, address: str, words: str) -> None:
    page = open_page(address)
    assert page.text("#advice").endswith(words)
    assert "omega" not in page.text("#advice")
    assert not re.search(r"\de\+?\d", page.text("#rows"))  # 20600 periods


@pytest.mark.parametrize("address", ["#k=rigid", "#v0=100 m/s", "#y0=1 nm", "#v0=1 m/s"])
def test_the_number_has_four_digits_at_most(open_page: Any, address: str) -> None:
    page = open_page(address)
    assert len(page.text("#mu").removeprefix("0.").lstrip("0")) <= 4


@pytest.mark.parametrize("speed", ["20 mm/s", "500 mm/s", "20000 mm/s", "5 m/s", "3 um/s"])
def test_the_law_has_a_unit_in_which_its_ends_read(open_page: Any, speed: str) -> None:
    page = open_page(f"#v0={speed}")
    hints = [page.find(f"#{name}").get_attribute("placeholder") for name in ("from", "to")]
    ends = [hint.removeprefix("auto: ") for hint in hints]
    assert all(re.fullmatch(r"[\d.]{1,7} [mµ]?m/s", end) for end in ends), ends
    assert page.run(AXIS) == f"v₀ [{ends[0].split()[1]}]"
    assert not re.search(r"[1-9]\d{5}", " ".join([page.text("#law-read"), *ends]))


def test_bars_and_sentence_have_the_same_shares_of_the_variance(open_page: Any) -> None:
    page = open_page("#mu0=0.3 ± 0.02&k=1 ± 0.1 N/um&f=20 ± 4 kHz")
    page.click("#tab-bars")
    told = page.text("#advice").removeprefix("Uncertainty. ").partition(";")[0]
    parts = [part.split(" % from ") for part in told.replace(" of the variance", "").split(", ")]
    sentence = {name: share for share, name in parts}
    names = [name.strip() for name in page.texts("#bars tbody th")]
    bars = dict(zip(names, page.texts("#bars .variance"), strict=True))
    told_by_bars = {name: text.removesuffix(" %") for name, text in bars.items() if text != "–"}
    assert told_by_bars == sentence
    assert page.texts("#bars thead th") == ["change", "variance"]
    page = open_page()
    page.click("#tab-bars")
    assert page.texts("#bars .variance") == []


def test_the_line_of_a_target_strikes_out_no_text(open_page: Any) -> None:
    page = open_page(width=1280, height=800)
    page.click("#tab-target")
    rows = {page.find(f"#solve-form {one}").rect["y"] for one in ("select", "input")}
    assert max(rows) - min(rows) < 5  # one line
    order = page.run(
        "return [...document.querySelectorAll('#map :is(.target, .tag, .area, .point)')]"
        ".map((one) => one.classList[0]);"
    )
    assert (order[0], order[-1]) == ("target", "point")
    assert page.texts("#map .target-number") == ["0.5"]
    assert {*order[1:-1]} == {"tag", "area"}


def test_a_target_is_reached_and_drawn(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page("#digits=all")
    page.click("#tab-target")  # which amplitude halves the friction?
    match = page.wait_for(
        "#solve-result", r"y₀ = (\S+) µm: µ = 0.1500, stick and slip, shaker (\S+) mW"
    )
    assert surrogate.evaluate(**{**START, "y0": float(match[1]) * 1e-6}).mu_ratio == close(
        0.5, abs=1e-5
    )
    assert len(page.texts("#map .target")) == 1
    assert page.text("#map-read").endswith("Dash-dotted line: µ/µ₀ = 0.5.")
    page.choose("#along", "y0")
    assert page.texts("#law .target-number") == ["target 0.15"]
    page.click("#digits")
    page.click("#tab-bars")  # the line is there while its tab is open
    assert page.texts("#map .target") == []
    page.click("#tab-target")
    assert len(page.texts("#map .target")) == 1
    page.click("#solve-result button")
    assert (page.shown()["µ/µ₀"], page.shown()["shaker power"]) == ("0.5", f"{match[2]} mW")
    page.type("#field-Fz", "12 N")  # another case has another root at once
    page.wait_for("#solve-result", r"y₀ = \d\.\d{3} µm")
    page.click("#digits")
    other = page.wait_for("#solve-result", r"y₀ = (\d\.\d{5}) µm")
    page.click("#digits")
    case = {**START, "Fz": 12.0, "y0": float(other[1]) * 1e-6}
    assert surrogate.evaluate(**case).mu_ratio == close(0.5, abs=1e-5)
    page.choose("#unknown", "k")
    page.type("#target", "99.9 %")
    page.wait_for("#solve-result", r"k = \S+ N/µm: µ = 0.29")
    page.type("#target", "2")
    page.wait_for("#solve-result", r"No value of k gives that: here it can be \S+ to \S+\.")
    assert not page.texts("#map .target")
    assert "Dash-dotted" not in page.text("#map-read")
    for text in ("half", "0.5 N", "-1"):
        page.type("#target", text)
        page.wait_for("#solve-status", "target")


#: what stands below the map at the pointer: the place in the units of the case, then without unit
AT_POINTER = r"^At the pointer: v₀ = .+; ṽ = (\S+), ỹ = (\S+), µ/µ₀ ≈ (\S+)$"


def test_the_map_is_read_and_moved_on(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()
    for x, up in ((0.3, 0.35), (0.45, 0.5), (0.55, 0.3), (0.5, 0.4)):
        page.touched("#map", x, up)
        read = page.wait_for("#map-read", AT_POINTER)
        v, y, ratio = (float(read[i]) for i in (1, 2, 3))
        assert ratio == close(surrogate.mu_ratio(v, y), abs=4e-3)
    page.touched("#map", 0.5, 0.4, click=True)
    shown = [float(page.shown()[name]) for name in ("ṽ", "ỹ")]
    assert shown == [close(v, rel=0.01), close(y, rel=0.01)]
    assert page.number() == close(0.3 * surrogate.mu_ratio(*shown), abs=2e-3)
    # on the user's point it is the number, which is no reading of the map
    assert page.text("#map-read").startswith("Your case: ")
    assert page.text("#map-read").endswith(f"µ/µ₀ = {page.shown()['µ/µ₀']}")


@pytest.mark.parametrize("plot", ["#map", "#law"])
def test_a_step_of_the_keys_is_read_at_the_point(open_page: Any, plot: str) -> None:
    page = open_page()
    page.touched(plot, 0.7, 0.4)
    page.wait_for(f"{plot}-read", "^At the pointer: ")
    page.press(plot, "ARROW_RIGHT")
    assert page.value("#field-v0") == "10.5 mm/s"
    assert page.text(f"{plot}-read").startswith("Your case: ")


def test_what_is_said_of_a_rigid_contact_and_of_k_is_no_more_than_it_means(open_page: Any) -> None:
    page = open_page("#contact=rigid&direction=normal")
    assert page.text("#advice") == "Rigid contact. The contact does not stretch before it slips."
    assert "doubt" not in page.find("#advice").get_attribute("class")
    limit = open_page("#contact=rigid")
    assert "doubt" in limit.find("#advice").get_attribute("class")
    assert "µ₀\u00a0Fz\u00a0/\u2060\u00a0y₀\u00a0=\u00a01.5\u00a0N" in limit.run(
        "return document.querySelector('#advice').textContent;"
    )
    stiff = open_page("#k=20 N/um")  # nothing is to be done about it
    assert "k" not in stiff.text("#advice")
    assert stiff.texts("#remedies button") == []


def test_another_direction_is_chosen_while_the_pointer_is_on_the_map(open_page: Any) -> None:
    page = open_page()
    page.touched("#map", 0.5, 0.4)
    page.wait_for("#map-read", "y₀ = ")
    page.click("[name=direction][value=normal]")
    page.wait_for("#map-read", "ΔFz = ")


OUTSIDE = (
    ("#v0=1e6 m/s", (1, 0), "ṽ = 2653000"),
    ("#v0=0", (-1, 0), "ṽ = 0, ỹ = 0.6667, µ/µ₀ = 0.7454"),
    ("#y0=1 m", (0, 1), "ỹ = 333300"),
    ("#y0=0", (0, -1), "ỹ = 0"),
    ("#f=0", (1, 0), "ṽ = ∞"),
)


@pytest.mark.parametrize(("address", "side", "words"), OUTSIDE)
def test_a_point_outside_of_the_map_is_marked_on_its_frame(
    open_page: Any, address: Any, side: Any, words: Any
) -> None:
    page = open_page(address)  # the pointer of another test may be on the map
    assert words in page.text("#map-read")
    assert page.text("#map-read").startswith("Your case, outside of this map: ")
    x, y = page.run(
        "const [plot, point] = ['#map', '#map .point'].map((one) =>"
        " document.querySelector(one).getBoundingClientRect());"
        "return [(point.x + point.width / 2 - plot.x) / plot.width,"
        " (point.y + point.height / 2 - plot.y) / plot.height];"
    )
    sides = (x > 0.8) - (x < 0.2), (y < 0.2) - (y > 0.8)
    assert all(one in (0, at) for one, at in zip(side, sides, strict=True))
    assert page.text("#status") == ""


def test_the_map_has_a_colour_between_two_levels(open_page: Any, surrogate: Surrogate) -> None:
    page = open_page()
    levels = plotting.LEVELS
    v, y = (
        one.ravel() for one in np.meshgrid(np.geomspace(2e-4, 5e2, 30), np.geomspace(2e-2, 5e2, 30))
    )
    # places that lie clear of a level: the picture is interpolated
    around = [surrogate.mu_ratio(v * 1.03**i, y * 1.03**j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    bands = np.searchsorted(levels, around, side="right")
    clear = np.all(bands == bands[0], axis=0)
    x_share, y_share = (np.log10(v) + 4) / 7, 1 - (np.log10(y) + 2) / 5
    colours = page.run(
        "const plot = document.querySelector('#map'); plot.scrollIntoView();"
        "plot.querySelectorAll('.shade').forEach((one) => { one.style.pointerEvents = 'auto'; });"
        "const { x: left, y: top, width, height } = "
        "plot.querySelector('rect.shade').getBoundingClientRect(); return "
        f"{np.column_stack((x_share, y_share)).tolist()}.map(([x, y]) => "
        "document.elementsFromPoint(left + x * width, top + y * height).find((one) => "
        "one.matches('.shade')).style.fill);"
    )
    painted = {
        (band, colour) for band, colour, good in zip(bands[0], colours, clear, strict=True) if good
    }
    assert len(painted) == len({band for band, _ in painted}) > 10
    shades = [colour for _, colour in sorted(painted)]
    written = ["#" + "".join(f"{int(x):02x}" for x in re.findall(r"\d+", one)) for one in shades]
    assert written == plotting.band_colours()
    # the legend has the same colours
    fills = page.run(
        "return [...document.querySelectorAll('#map .legend rect')].map((one) => one.style.fill);"
    )
    assert [re.findall(r"\d+", one) for one in fills] == [
        [str(int(one[i : i + 2], 16)) for i in (1, 3, 5)] for one in plotting.band_colours()
    ]


def test_the_law_is_read_in_the_units_of_its_field_over_a_range(
    open_page: Any, surrogate: Surrogate
) -> None:
    page = open_page()
    page.touched("#law", 0.5, 0.5)
    read = page.wait_for("#law-read", r"v₀ = (\S+) mm/s, µ = (\S+),")
    expected = surrogate.evaluate(**{**START, "v0": float(read[1]) * 1e-3}).mu_macro
    assert float(read[2]) == close(expected, rel=1e-3)
    ticks = page.texts("#law .axis text")
    assert {"10⁻¹", "10³", "0.22", "0.30"} <= {*ticks}
    # the axis of µ begins a little below the curve, and says so
    assert "0.00" not in ticks
    assert "friction µ, axis from 0.21" in page.texts("#law .title")
    assert len(page.texts("#law .cut")) == 1
    page.click("#axis")
    assert {"0.00", "0.30"} <= {*page.texts("#law .axis text")}
    assert "friction µ" in page.texts("#law .title")
    assert page.texts("#law .cut") == []
    page.type("#from", "5mm/s")
    page.type("#to", "2m/s")
    assert re.search(
        "at v₀ = 5 mm/s to.*at v₀ = 2000 mm/s", page.find("#law").get_attribute("aria-label")
    )
    page.type("#from", "0")
    page.wait_for("#law-status", "^from:? ")  # on a logarithmic scale
    assert (page.is_old("#law"), page.is_old("#number")) == (True, False)
    page.choose("#scale", "linear")
    assert page.text("#law-status") == ""
    page.type("#from", "x")
    page.wait_for("#law-status", "^from:? ")
    page.type("#from", "5")
    assert page.value("#from") == "5 mm/s"
    page.type("#from", "")
    assert not page.is_old("#law")
    page.choose("#scale", "log")
    page.choose("#along", "f")
    assert page.run(AXIS) == "f [kHz]"
    # a click selects the value at the pointer, in that unit
    page.touched("#law", 0.5, 0.5)
    at = float(page.wait_for("#law-read", r"f = (\S+) kHz")[1])
    page.touched("#law", 0.5, 0.5, click=True)
    assert float(page.value("#field-f").removesuffix(" kHz")) == close(at, rel=0.05)


def test_k_grows_with_the_load_along_fz(
    open_page: Any, surrogate: Surrogate, tmp_path: Path
) -> None:
    with open_page.faked(RECORDED) as page:
        assert not page.find("#exponent").is_displayed()
        page.choose("#along", "Fz")
        assert page.find("#exponent").is_displayed()
        assert "Fz" not in page.question("v1/law")  # k stays as it is
        page.type("#exponent", "0.5")
        question = page.question("v1/law")
        assert (question["Fz"], question["stiffness_exponent"]) == ("10 N", "0.5")
        rows = [
            *csv.DictReader(page.download("#csv", tmp_path, "friction-law-Fz.csv").splitlines())
        ]
        for row in rows[:: len(rows) // 5]:
            load, k = float(row["Fz [N]"]), float(row["k [N/m]"])
            assert k == close(1e6 * (load / 10.0) ** 0.5, rel=1e-9)
            grown = {**START, "Fz": load, "k": k}
            assert float(row["mu_macro [-]"]) == close(
                surrogate.evaluate(**grown).mu_macro, rel=1e-9
            )
        page.type("#exponent", "1.5")
        page.wait_for("#law-status", "^m:? ")
        page.type("#exponent", "half")
        page.wait_for("#law-status", "^m:? ")
        page.type("#exponent", "")
        page.click("[name=contact][value=ball]")
        question = page.question("v1/law")
        assert "stiffness_exponent" not in question  # the service knows that of a ball
        assert question["Fz"] == "10 N"


ENDS = {
    "#direction=normal&along=Fz": "Fz [N]",
    "#direction=normal&along=Fz_amplitude&scale=linear": "ΔFz [N]",
    "#direction=normal&along=Fz_amplitude": "ΔFz [N]",
    "#contact=ball&along=Fz": "Fz [N]",
    "#k=0.8..1.2N/um&along=Fz&exponent=1": "Fz [N]",
    "#k=rigid&along=Fz&contact=ball": "Fz [N]",
    "#along=mu0": "µ₀",
    "#along=Fz": "Fz [N]",
    "#along=k&scale=linear": "k [N/µm]",
    "#along=f": "f [kHz]",
    "#along=y0&scale=linear": "y₀ [µm]",
    "#v0=1e307 m/s": "v₀ [m/s]",
    "#v0=1e-310 m/s&along=v0": "v₀ [m/s]",
    "#k=1e300 N/m&along=k": "k [N/m]",
    "#y0=0&f=0&v0=0": "v₀",
    "#k=rigid&y0=0&v0=0": "v₀",
    "#k=rigid&along=k": "k",
    "#mu0=1e-300&Fz=1e-10 N&along=mu0&scale=linear": "µ₀",
    "#v0=0&y0=3e-6": "v₀",
}


@pytest.mark.parametrize("address", ENDS)
def test_every_law_and_the_ends_of_every_range_are_answered(open_page: Any, address: str) -> None:
    page = open_page(address)
    assert float(page.text("#mu").split(" to ")[0]) >= 0
    assert page.run(AXIS).startswith(ENDS[address])
    assert "Friction law from" in page.find("#law").get_attribute("aria-label")
    assert (page.text("#status"), page.text("#law-status")) == ("", "")
    assert not re.search(ODD, page.run(SEEN))


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
    page = open_page()
    page.click(f"[name=contact][value={contact}]")
    page.click(f"[name=direction][value={direction}]")
    normal = direction == "normal"
    fields = page.run("return [...document.querySelectorAll('#fields [name]')].map((x) => x.name);")
    assert fields == ["mu0", "Fz", "k", "Fz_amplitude" if normal else "y0", "f", "v0"]
    for one in SKETCH:
        shown = page.find(f"#sketch .{one}").is_displayed()
        assert shown is (one in (contact, direction))
    page.type("#field-k", "0.8..1.2 N/um")
    swing = {"y0": None, "Fz_amplitude": 5.0} if normal else {}
    case = {name: x for name, x in {**START, **swing, "k": None}.items() if x is not None}
    expected = surrogate.evaluate(
        **case, contact=contact, direction=direction, k_low=8e5, k_high=1.2e6
    )
    assert page.text("#advice").startswith("Interval. k from 0.8 N/µm to 1.2 N/µm; ")
    match = page.wait_for("#mu", r"^(\S+) to (\S+)$")
    ends = [expected.mu_macro_low, expected.mu_macro_high]
    assert [float(match[1]), float(match[2])] == close(ends, abs=0.02 * (ends[1] - ends[0]) + 1e-9)
    assert len(page.texts("#law .band")) == 1
    # the map is that of this contact, with the point on it
    assert len(page.texts("#map .point")) == 1
    page.touched("#map", 0.4, 0.6)
    read = page.wait_for("#map-read", AT_POINTER)
    v, y, ratio = (float(read[i]) for i in (1, 2, 3))
    exact, _, _ = surrogate.quantity("mu_ratio", v, y, contact=contact, direction=direction)
    assert ratio == close(exact, abs=0.03)
    page.choose("#along", "k")
    assert not re.search(ODD, page.run(SEEN))
    assert page.text("#status") == page.text("#law-status") == ""
    page.touched("#map", 0.4, 0.6, click=True)
    assert [float(page.shown()[name]) for name in "ṽỹ"] == close([v, y], rel=0.02)
    page.click("#reset")
    assert page.value("#field-k") == "1 N/µm"


# --- panels ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("width", [1280, 1920])
def test_a_body_is_one_row(open_page: Any, width: int) -> None:
    page = open_page("#panel=stiffness", width=width, height=800)
    for body in (("E", "nu"), ("E2", "nu2")):
        assert len({page.find(f"#argument-{name}").rect["y"] for name in body}) == 1, body


def test_k_from_materials(open_page: Any) -> None:
    with open_page.faked(RECORDED, "#panel=stiffness") as page:
        page.click("#stiffness-form button")  # what is missing is named beside its field
        assert page.find("#argument-E").get_attribute("aria-invalid") == "true"
        assert "required" in page.text("#about-nu")
        assert page.text("#stiffness-status") == ""  # the fields tell it
        page.type("#argument-radius", "5 mm")
        page.choose("#material-1", "steel")
        page.type("#argument-E2", "rigid")
        page.click("#stiffness-form button")
        assert page.question("v1/stiffness") == {
            "geometry": "ball",
            "radius": "5 mm",
            "Fz": "10 N",
            "E": "210 GPa",
            "nu": "0.3",
            "E2": "rigid",
            "include": ["inputs"],
        }
        contact = contact_of("ball", radius=5e-3, Fz=10.0, E=210e9, nu=0.3, E2=np.inf)
        assert page.text("#stiffness-result").strip().startswith(f"k = {contact.k / 1e6:.4g} N/µm")
        page.click("#stiffness-result button")
        assert page.find("[name=contact][value=ball]").is_selected()
        k = float(page.value("#field-k").removesuffix(" N/µm"))
        assert k == float(f"{contact.k / 1e6:.4g}")
        page.choose("#geometry", "cylinder")
        assert page.value("#argument-radius") == "5 mm"  # what two geometries share stays
        page.type("#argument-length", "10 parsec")
        page.click("#stiffness-form button")
        assert "must be in metres" in page.text("#about-length")
        assert page.text("#stiffness-status") == ""
        assert page.find("#argument-length").get_attribute("aria-invalid") == "true"


def test_a_length_without_a_unit_is_told_and_doubted(open_page: Any) -> None:
    page = open_page("#panel=stiffness")
    page.choose("#argument-radius", "5")
    assert page.text("#about-radius") == "read as 5 m"
    assert page.find("#argument-E").get_attribute("aria-invalid") == "false"  # not typed yet
    page.choose("#material-1", "steel")
    assert "is it 5 mm?" in page.text("#about-radius")
    assert page.text("#stiffness-result").strip().startswith("k = ")
    page.type("#argument-radius", "5 mm")
    assert "read as" not in page.text("#about-radius")  # it says no more than the text
    assert "doubt" not in page.run(
        "return document.querySelector('#argument-radius').closest('.field').className;"
    )
    k = page.text("#stiffness-result b")
    # the text stays where the diameter is chosen, and means another ball
    page.choose("#size", "diameter")
    assert page.value("#argument-diameter") == "5 mm"
    assert page.text("#stiffness-result b") != k
    page.type("#argument-diameter", "10 mm")
    assert page.text("#stiffness-result b") == k
    page.type("#argument-diameter", "-1 mm")
    assert page.find("#argument-diameter").get_attribute("aria-invalid") == "true"


def test_the_measured_example_is_read_and_fitted(open_page: Any) -> None:
    page = open_page()
    page.click("#tab-fit")
    assert not page.find("#fit-image").is_displayed()  # there is no picture yet
    page.click("#fit-example")
    assert page.value("#field-Fz") == "10.79 N"
    assert page.find("[value=along]").is_selected()
    assert page.texts("#points-read th") == ["v0 [mm/s]", "mu0", "mu_macro"]
    # docs/how-to/fit.md; it is fitted at once
    page.wait_for("#fit-lines", r"k = 9.97 N/µm \(95 %: 9.77 to 10.19 N/µm\)")
    assert len(page.texts("#fit-plot circle.measured")) == 10  # and the residuals below
    # each point has its own mu0, so there is no line, and none is spoken of
    assert (len(page.texts("#fit-plot circle.fitted")), page.texts("#fit-plot .curve")) == (5, [])
    notes = page.texts("#fit-plot .note")
    assert notes == ["measured", "fit, at µ₀ of each point", "residuals"]
    page.browser.back()
    page.settle()
    assert page.value("#field-Fz") == "10 N"


def test_before_the_points_stands_what_they_are(open_page: Any) -> None:
    page = open_page("#panel=fit", width=1280, height=800)
    assert page.find("#fit-hint").is_displayed()
    assert not page.find("#fit-plot").is_displayed()
    page.choose("#points", "v0 mu_macro\n0.001 0.22\n0.1 0.27")
    assert (page.find("#fit-hint").is_displayed(), page.find("#fit-plot").is_displayed()) == (
        False,
        True,
    )
    page.click("#fit-button")
    assert page.texts("#fit-plot .note") == ["measured", "fit, 95 % band", "residuals"]


GERMAN = "v0 [mm/s];mu_macro;std\n{}\n"


def test_a_german_table_is_pasted_read_and_fitted(
    open_page: Any, surrogate: Surrogate, tmp_path: Path
) -> None:
    v0 = np.geomspace(1e-3, 1.0, 9)
    mu = surrogate.evaluate(**{**START, "k": 1.3e6, "v0": v0}).mu_macro
    rows = [f"{1e3 * x:.9g};{y!r};0.001" for x, y in zip(v0, mu.tolist(), strict=True)]
    page = open_page()
    page.click("#tab-fit")
    page.choose("#unknowns", "k mu0")
    page.choose("#points", GERMAN.format("\n".join(rows).replace(".", ",")))
    assert len(page.texts("#points-read tbody tr")) == 6
    assert "9 points" in page.text("#points-read")
    page.click("#fit-button")
    lines = page.texts("#fit-lines li")
    found = r"k = (1\.30*) N/µm \(95 %: .* to .* N/µm\); µ₀ = 0.30* \(95 %: .* to .*\)"
    assert re.search(found, lines[0])
    assert re.search("reduced χ² = ", lines[1])
    assert len(page.texts("#fit-plot [clip-path] > :is(.band, .curve)")) == 2
    assert "k = 1.3" in page.download("#fit-image", tmp_path, "friction-fit.svg")
    page.click("#fit-lines button")
    assert float(page.value("#field-k").removesuffix(" N/µm")) == close(1.3, rel=1e-5)
    # what cannot be read is refused in the service's words, and nothing is fitted
    page.choose("#points", "speed\n1\n2\n")
    assert page.is_red("#fit-status")
    assert not page.find("#fit-button").is_enabled()


def test_a_file_of_an_instrument_is_dropped(
    open_page: Any, surrogate: Surrogate, tmp_path: Path
) -> None:
    v0 = np.geomspace(1e-3, 1.0, 9)
    mu = surrogate.evaluate(**{**START, "k": 1.3e6, "v0": v0}).mu_macro
    rows = "\r\n".join(f"{1e6 * x:.9g}\t{y!r}" for x, y in zip(v0, mu.tolist(), strict=True))
    text = f"Rig viewer 1.0\r\nOperator\tunknown\r\n\r\nv0 [µm/s]\tmu_macro\r\n{rows}\r\n"
    file = tmp_path / "run 1.txt"
    file.write_bytes(text.encode("cp1252"))
    page = open_page()
    page.click("#tab-fit")
    page.find("#points-file").send_keys(str(file))
    page.wait_for("#points-read", "9 points")
    page.settle()
    assert "run 1.txt" in page.text("#file-name")
    assert "header in line 4" in page.text("#points-read")
    assert "skipped" in page.text("#points-read")
    page.click("#fit-button")
    assert re.search(r"k = 1.30* N/µm", page.texts("#fit-lines li")[0])


@pytest.mark.parametrize(
    "points",
    [
        "1\t0.29\n10\t0.2995\n100\t0.29995",  # k has an upper bound
        "1\t0.001\n10\t0.01\n100\t0.09",  # every k fits
        "0.05\t0.226\n10\t0.24\n100\t0.28",
    ],
)
def test_a_fit_has_one_unit_for_k_and_one_form_of_its_spread(open_page: Any, points: str) -> None:
    page = open_page("#panel=fit&k=300 N/mm")
    page.choose("#unknowns", "k mu0")
    page.choose("#points", f"v0 [mm/s]\tmu_macro\n{points}\n")
    page.click("#fit-button")
    lines = page.texts("#fit-lines li")
    assert len({*re.findall(r"(?<=\d )\S*N/\S*m\b", " ".join(lines))}) == 1
    assert re.search(r"k = [\d.]+ N/µm \(95 %: \S+ (N/µm )?to .*\); µ₀ = .* \(95 %", lines[0])
    assert "±" not in " ".join(lines)


def test_a_column_that_is_missing_is_named_as_it_is_typed(open_page: Any) -> None:
    page = open_page("#panel=fit")
    page.choose("#points", "speed\n1\n2\n")
    status = page.text("#fit-status")
    assert status.startswith("line 1: ")  # of the file, or the text
    assert "v0 [m/s]" in status
    assert "mu_macro" in status
    page.choose("#points", "v0\tmu_macro\n1\twet\n")
    assert "mu_macro" in page.text("#fit-status")
    assert not re.search("[₀µ]", page.text("#fit-status"))
    assert page.text("#fit-status").startswith("line 2: ")
    assert not page.find("#fit-caption").is_displayed()  # there is nothing to save


def test_a_remedy_is_one_of_the_page(open_page: Any) -> None:
    page = open_page()
    for field, text in (("k", "5 psi"), ("Fz", "5 kg"), ("y0", "2 g"), ("v0", "30 rpm")):
        page.type(f"#field-{field}", text)
        assert page.text(f"#note-{field}").startswith("must be ")
        assert not re.search(r"--\w|mumacro ", page.text(f"#note-{field}"))
    page.type("#field-f", "20 foo")
    assert page.text("#note-f") == "must be in hertz, such as Hz, kHz, MHz, rpm"
    page.type("#field-k", "5 psi")
    assert page.text("#part-stiffness h2") in page.text("#note-k")


def test_a_motion_says_that_it_has_no_deviation(open_page: Any) -> None:
    page = open_page("#motion=any&x=1 um&k=1 ± 0.1 N/um&mu0=0.3 ± 0.02")
    assert "without the standard deviation (±) of µ₀, k" in page.text("#motion-doubt")
    page.type("#field-k", "1 N/um")
    page.type("#field-mu0", "0.3")
    assert page.text("#motion-doubt") == ""


def test_the_number_of_any_motion_is_the_large_one(open_page: Any) -> None:
    page = open_page(width=1280, height=800)
    page.click("[name=direction][value=any]")
    assert page.value("#motion-y") == "2 µm"
    assert page.number("#motion-mu") == 0.2405
    assert page.text("#motion-share") == "80 % of µ₀ is left"
    # what belongs to one oscillation is not there
    for one in ("mu", "advice", "field-y0", "map", "law", "values"):
        assert page.run(f"return !document.querySelector('#{one}')?.checkVisibility();"), one
    # and what belongs to the motion is on the first screen
    for one in ("motion-mu", "motion-x", "motion-y", "motion-normal", "forces", "path", "motion"):
        box = page.find(f"#{one}").rect
        assert 0 < box["y"] < 800, one
    page.type("#motion-y", "wet")
    assert page.text("#motion-status") == "Check y. The number shown is that of y = 2 µm."
    assert page.is_old("#motion-number")
    page.click("[name=direction][value=along]")
    assert page.find("#field-y0").is_displayed()
    assert page.find("#mu").is_displayed()
    assert not page.find("#motion-mu").is_displayed()


@pytest.mark.parametrize(
    ("address", "case"),
    [("y=wet", "y = 2 µm"), ("Fz=5 apples", "Fz = 10 N"), ("x=5 apples", "x = none")],
)
def test_a_link_to_a_motion_that_is_refused_shows_another_one(
    open_page: Any, address: str, case: str
) -> None:
    page = open_page(f"#motion=any&{address}", width=1280, height=800)
    name = address.partition("=")[0]
    told = f"Check {name}. The number shown is that of {case}."
    assert page.text("#motion-status") == told
    assert page.number("#motion-mu") == 0.2405
    assert page.is_old("#motion-number")
    assert len(page.texts("#forces.old .curve")) == 3
    note = page.text(".field.bad .note")
    assert note
    assert page.run("return document.body.innerText;").count(note) == 1


@pytest.mark.parametrize(
    ("direction", "part", "text"),
    [
        ("across&y0=1 um ± 10 %", "y", "1 µm"),
        ("along&contact=ball&mu0=0.2", "x", "2 µm"),
        ("normal&Fz_amplitude=3 N&k=1..2 N/um", "normal", "3 N"),
    ],
)
def test_any_motion_begins_with_the_case_and_asks_what_halves_its_friction(
    open_page: Any, direction: str, part: str, text: str
) -> None:
    page = open_page(f"#direction={direction}")
    before = page.run("return document.querySelector('#short').textContent;")
    page.click("[name=direction][value=any]")
    texts = {name: page.value(f"#motion-{name}") for name in ("x", "y", "normal")}
    assert texts == {"x": "", "y": "", "normal": "", part: text}
    page.click("#motion-target-form button")
    mu0 = float(page.value("#field-mu0"))
    assert page.value("#motion-target") == f"{mu0 / 2:g}"
    page.wait_for("#motion-roots", "^\\s*(x|y|ΔFz) amplitude = ")
    assert ("k = 1.414 N/µm, the middle of the interval" in page.text("#motion-doubt")) is (
        "k=1..2" in direction
    )
    if "±" not in direction and "k=1..2" not in direction:
        assert page.text("#motion-mu") in before


def test_the_example_of_a_conveyor_answers_its_question(open_page: Any) -> None:
    page = open_page("#motion=any&mu0=0.1&contact=ball")
    page.click("#conveyor")
    assert page.number("#motion-mu") == -0.02776
    assert page.text("#motion-share") == "The motion drives the body forward"
    page.click("#motion-target-form button")
    root = page.wait_for("#motion-roots", r"v₀ = (\S+) mm/s")
    case: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 1e-3 * float(root[1])}
    conveyor = mumacro.motion(**case, x=(2e-6, 90.0), normal=(5.0, -90.0))
    assert conveyor.mu_macro == close(0.0, abs=1e-5)


def test_a_motion_has_its_remarks(open_page: Any) -> None:
    page = open_page("#motion=any&y=")
    assert page.texts("#motion-doubt li") == ["Nothing oscillates: µ is µ₀"]
    page.type("#motion-x", "50 mm")
    assert page.text("#motion-note-x").endswith("is it in metres?")
    page.type("#motion-x", "2 um")
    assert page.texts("#motion-doubt li") == []
    page.click("[name=contact][value=ball]")  # whose load cannot oscillate
    assert not page.find("#motion-normal").is_enabled()
    assert page.text("#motion-status") == ""
    assert "radius" in page.find("#motion-normal").get_attribute("title")


@pytest.mark.parametrize(
    "address", ["#k=1 ± 0.1 N/um", "#mu0=0.3 ± 5 %&Fz=10 ± 1 N", "#k=0.1..10 N/um"]
)
@pytest.mark.parametrize("along", ["v0", "Fz", "k", "y0"])
def test_what_is_uncertain_is_a_band_of_the_law(open_page: Any, address: str, along: str) -> None:
    page = open_page(f"{address}&along={along}")
    assert page.text("#law-status") == ""
    swept = along == "k" and address.startswith("#k")  # which has no deviation itself
    assert len(page.texts("#law .band")) == (0 if swept else 1)


def test_any_motion_is_computed_drawn_and_solved(open_page: Any) -> None:
    page = open_page("#motion=any&digits=all&x=1 um @ 90 deg")
    page.type("#motion-y", "0.002 mm")
    assert page.text("[for=motion-y] small") == "2 µm at 0°"
    assert page.text("[for=motion-x] small") == ""  # it would say no more than the text
    case: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.01}
    motion = mumacro.motion(**case, x=(1e-6, 90.0), y=2e-6)
    shown = dict(zip(page.texts("#motion-values dt"), page.texts("#motion-values dd"), strict=True))
    assert float(shown["µ"]) == close(motion.mu_macro, rel=1e-5, abs=1e-6)
    assert shown["sticks"] == f"{100 * motion.stick_fraction:.4g} %"
    assert float(shown["drag force"].removesuffix(" N")) == page.rounded(10 * motion.mu_macro)
    assert len(page.texts("#forces .curve")) == 3
    assert len(page.texts("#path .curve")) >= 1
    page.type("#motion-y", "2 parsec")
    assert page.find("#motion-y").get_attribute("aria-invalid") == "true"
    assert page.is_old("#motion-values")
    page.type("#motion-y", "2")  # metres, which is doubted
    assert "metres?" in page.text("#motion-note-y")
    page.type("#motion-y", "2 um")
    page.choose("#motion-unknown", "v0")
    page.type("#motion-target", "0.2", commit=False)
    page.click("#motion-target-form button")
    root = page.wait_for("#motion-roots", r"v₀ = (\S+) (\S?)m/s")
    speed = float(root[1]) * {"": 1.0, "m": 1e-3, "µ": 1e-6}[root[2]]
    there = mumacro.motion(**{**case, "v0": speed}, x=(1e-6, 90.0), y=2e-6)
    assert there.mu_macro == close(0.2, abs=1e-4)
    page.click("#motion-roots button")
    assert page.number("#motion-values dd") == close(0.2, abs=1e-5)
    # and over a part of the motion: its other half stays
    page.choose("#motion-unknown", "x.amplitude")
    assert page.is_old("#motion-roots")
    page.type("#motion-target", "0.15")
    page.wait_for("#motion-roots", "x amplitude = ")
    assert not page.is_old("#motion-roots")
    page.click("#motion-roots button")
    assert page.value("#motion-x").endswith(" @ 90 deg")
    assert page.number("#motion-values dd") == close(0.15, abs=1e-5)


def test_the_path_of_a_motion_fills_its_frame(open_page: Any) -> None:
    for motion in ("x=2 um&y=2 um", "x=0.1 um&y=2 um @ 90 deg", "x=2 um&y=0.1 um @ 90 deg"):
        page = open_page(f"#motion=any&normal=&{motion}", width=1280, height=800)
        shares = page.run(
            "const boxes = [...document.querySelectorAll('#path .curve')]"
            ".map((one) => one.getBBox());"
            "const frame = document.querySelector('#path clipPath rect').getBBox();"
            "const size = (at, wide) => Math.max(...boxes.map((one) => one[at] + one[wide])) -"
            " Math.min(...boxes.map((one) => one[at]));"
            "return [size('x', 'width') / frame.width, size('y', 'height') / frame.height];"
        )
        assert 0.75 <= max(shares) <= 1.0, motion


def test_a_path_in_one_direction_is_small_and_one_without_motion_is_words(open_page: Any) -> None:
    page = open_page("#motion=any&x=2 um&y=2 um", width=1280, height=800)
    full, narrow = page.find("#path").rect, page.find("#forces").rect
    for motion, axis in (("x=2 um&y=", "x − v₀t [µm]"), ("y=2 um&normal=3 N", "y [µm]")):
        page = open_page(f"#motion=any&{motion}", width=1280, height=800)
        assert page.find("#path").rect["height"] < 0.3 * full["height"]
        assert page.find("#forces").rect["width"] > 1.5 * narrow["width"]
        assert axis in page.texts("#path .title")
        assert len(page.texts("#path .start")) == 2  # a dot and an arrow
    page = open_page("#motion=any&y=&normal=1 N", width=1280, height=800)
    assert not page.find("#path").is_displayed()
    assert page.find("#path-none").is_displayed()
    assert page.texts("#path text") == []


STICKING = ("y=2 um", "x=1 um @ 90 deg&y=2 um", "y=0.1 um", "y=5 um&v0=0")


@pytest.mark.parametrize("motion", STICKING)
def test_what_sticks_is_shaded_in_the_forces_and_pale_in_the_path(
    open_page: Any, motion: str
) -> None:
    page = open_page(f"#motion=any&{motion}", width=1280, height=800)
    shaded = sum(one["width"] for one in page.rects("#forces .sticking"))
    frame = page.run("return document.querySelector('#forces clipPath rect').getBBox().width;")
    share = shaded / frame
    told = dict(zip(page.texts("#motion-values dt"), page.texts("#motion-values dd"), strict=True))
    sticks = float(told["sticks"].removesuffix(" %")) / 100.0
    assert share == close(sticks, abs=0.01)
    assert (page.texts("#path .sticks") != []) is (sticks > 0.0)
    assert page.find("#path-hint").is_displayed() is (sticks > 0.0)
    ball = open_page(f"#motion=any&{motion}&contact=ball")  # of which a part sticks
    assert ball.texts("#forces .sticking") == ball.texts("#path .sticks") == []


@pytest.mark.parametrize("y", ["0.5 um@90", "40 nm"])  # forces that end together, long numbers
def test_no_text_of_the_plots_of_a_motion_covers_another(open_page: Any, y: str) -> None:
    case = "contact=ball&Fz=20 N&k=10.6 N/um&f=40 kHz&v0=5 mm/s"
    page = open_page(f"#motion=any&x=0.2 um&y={y}&{case}", width=1280, height=800)
    assert {"Fx", "Fy", "Fz"} <= {*page.texts("#forces text")}
    covered = page.run(
        "const all = [...document.querySelectorAll('#path text, #forces text')].map((one) =>"
        " [one.textContent, one.getBoundingClientRect()]);"
        "return all.flatMap(([name, a], i) => all.slice(i + 1).filter(([, b]) =>"
        " Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&"
        " Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 3)"
        ".map(([other]) => `${name} and ${other}`));"
    )
    assert covered == []


@pytest.mark.parametrize("kind", ["spring", "ball", "rigid"])
def test_what_is_assumed_and_what_slips_is_that_of_the_contact(open_page: Any, kind: str) -> None:
    page = open_page(f"#contact={kind}&k=1 N/um" if kind != "rigid" else "#k=rigid")
    page.click("#assumes summary")
    words = page.find("#answer").text
    assert ("foot" in words) is (kind == "spring")
    assert ("One spring" in words) is (kind == "spring")
    if kind == "rigid":
        return
    page.click("[name=direction][value=any]")
    page.click("[data-meanings=motion-values]")
    assert ("foot" in page.find("#meanings").text) is (kind == "spring")
    page.click("#meanings button")


NONE = {
    "#direction=along": ["periods to settle"],
    "#direction=normal": ["peak y₀ω", "shaker power", "power saved", "periods to settle"],
    "#direction=along&k=rigid": ["sticks", "periods to settle", "ṽ", "ỹ"],
    "#k=rigid": ["ṽ", "ỹ"],
    "#f=0": [],
    "#y0=0&v0=0": [],
}


@pytest.mark.parametrize("address", NONE)
def test_a_number_that_is_missing_has_its_reason_beside_it(open_page: Any, address: str) -> None:
    page = open_page(address)
    missing = {name: text for name, text in page.shown().items() if text.startswith("–")}
    assert [*missing] == NONE[address]
    assert all(re.search(r"\w+ \w+", text) for text in missing.values())
    # and in the meanings, which the keyboard reaches
    page.press("[data-meanings=values]", "ENTER")
    told = page.find("#meanings").text
    assert re.search(r"All are from the block \w+ of the table mumacro", told)
    assert told.count("None: ") == len(missing)
    assert "from this speed on the contact slides all the time" in told
    page.press("#meanings button", "ENTER")
    assert not page.find("#meanings").is_displayed()
    page.click("#tab-bars")
    bars = page.texts("#bars td:last-child")
    assert all(re.search(r"\d|rigid|kink", text) for text in bars)


def test_the_numbers_are_one_stop_of_the_tab_key(open_page: Any) -> None:
    page = open_page()
    stops = page.run(
        "return [...document.querySelectorAll('#part-values *')]"
        ".filter((one) => one.tabIndex >= 0).map((one) => one.textContent);"
    )
    assert stops == ["Meanings"]


@pytest.mark.parametrize("width", [1280, 390])
def test_a_field_shows_the_whole_of_a_usual_text(open_page: Any, width: int) -> None:
    page = open_page("#direction=normal", width=width, height=800)
    overlaps = page.run(
        "return [...document.querySelectorAll('#fields .field')].filter((one) => {"
        "const ends = [...one.querySelectorAll('.symbol, .label, input')]"
        ".map((part) => part.getBoundingClientRect());"
        "return ends.some((part, i) => i && part.left < ends[i - 1].right - 0.5); })"
        ".map((one) => one.textContent);"
    )
    assert overlaps == []
    texts = ("1.25±0.12 N/µm", "1.25 ± 0.12 N/µm", "0.8..1.2 N/µm", "912.345 N/mm")
    for text in texts:
        page = open_page(f"#k={text}", width=width, height=800)
        inner, outer = page.run(
            "const one = document.querySelector('#field-k');"
            "return [one.scrollWidth, one.clientWidth];"
        )
        assert inner <= outer, text


# --- downloads and print --------------------------------------------------------------------------


def test_downloads(open_page: Any, surrogate: Surrogate, tmp_path: Path) -> None:
    page = open_page()
    header, *rows = csv.reader(page.download("#csv", tmp_path, "friction-law-v0.csv").splitlines())
    assert header == ["v₀ [mm/s]", "mu_macro [-]", "mu_static [-]", "regime"]
    v0, mu = (np.array([float(row[i]) for row in rows]) for i in (0, 1))
    assert mu == close(surrogate.evaluate(**{**START, "v0": 1e-3 * v0}).mu_macro, rel=1e-12)
    for button, name in (("#law-image", "friction-law-v0.svg"), ("#map-image", "friction-map.svg")):
        text = page.download(button, tmp_path, name)
        picture = ElementTree.fromstring(text)  # noqa: S314 - our own file
        assert min(float(picture.attrib[side]) for side in ("width", "height")) >= 300
        # it looks the same without the page's style sheet
        assert all(
            "fill:" in one.attrib["style"]
            for one in picture.iter("{http://www.w3.org/2000/svg}path")
        )


LONG = "mu0=0.3 ± 0.03&Fz=20 ± 0.5 N&k=10.6114 ± 1 N/µm&y0=0.5 ± 0.05 µm&f=40 kHz&v0=5 mm/s"


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("#k=1 ± 0.1 N/um", []),
        (f"#{LONG}&contact=ball&direction=along", ["reverse slip", "565"]),
        (f"#{LONG}&contact=ball&motion=any&x=0.2 um&y=0.5 um@90", ["Any motion", "drag force"]),
        ("#motion=any", ["Any motion", "drag force"]),
        ("#panel=fit", []),
        ("#panel=stiffness&side=target&digits=all", ["shaker power"]),
        ("#k=0.1..10 N/um", ["0.035 to 0.300"]),
        ("#k=rigid&y0=2", ["Check the units"]),
        (
            "#panel=fit&example",
            ["k from measured friction", "9.97 N/µm", "residuals"],
        ),
    ],
)
def test_it_prints_on_one_page(
    open_page: Any, tmp_path: Path, address: str, words: list[str]
) -> None:
    page = open_page(address.removesuffix("&example"))
    if address.endswith("example"):
        page.click("#fit-example")
        page.wait_for("#fit-lines", "9.97")
        page.settle()
    options = {"printBackground": True, "preferCSSPageSize": True}
    data = page.browser.execute_cdp_cmd("Page.printToPDF", options)["data"]
    pdf = base64.b64decode(data)
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) == 1
    if shutil.which("pdftotext"):
        (tmp_path / "page.pdf").write_bytes(pdf)
        text = plain(subprocess.check_output(["pdftotext", tmp_path / "page.pdf", "-"], text=True))
        assert page.text("#mu") in text
        assert all(word not in text for word in ("Example", "Reset", "Find", "Close"))
        assert all(one in text for one in words)
        assert ("Any motion" in text) is ("motion=any" in address)
        assert ("k from measured friction" in text) is ("example" in address)
