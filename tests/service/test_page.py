"""The pages: their headers, whether they fit the screen, accessibility, and the API key."""

import base64
import hashlib
import itertools
import json
import os
import posixpath
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from mumacro import Surrogate, plotting
from mumacro.inputs.fields import CONTACTS, DIRECTIONS
from mumacro.inputs.units import UNITS_OF
from mumacro.stiffness import ARGUMENTS, BODIES, GEOMETRIES
from service.app import create_app
from service.settings import Settings
from tests.support.browser import START
from tests.support.comparing import close

pytestmark = pytest.mark.slow
KINDS = [
    (contact, direction)
    for contact in CONTACTS
    for direction in DIRECTIONS
    if (contact, direction) != ("ball", "normal")
]
AXE = "tests/data/axe-core/axe.min.js"


@pytest.mark.parametrize("kind", KINDS)
def test_the_map_is_the_surrogates(client: Any, surrogate: Surrogate, kind: Any) -> None:
    names = dict(zip(("contact", "direction"), kind, strict=True))
    address = f"/static/page/map.json?contact={kind[0]}&direction={kind[1]}"
    response = client.get(address)
    data = response.json()
    v, y = (
        (np.geomspace if axis["log"] else np.linspace)(axis["start"], axis["stop"], axis["n"])
        for axis in (data["v_tilde"], data["y_tilde"])
    )
    grid = data["unit"] * np.array(data["mu_ratio"]).reshape(y.size, v.size)
    ratio, _, _ = surrogate.quantity("mu_ratio", v[None, :], y[:, None], **names)
    assert np.max(np.abs(grid - ratio)) <= 0.5001 * data["unit"]
    border = np.array(data["border"])
    assert border[:, 0] == close(surrogate.v_tilde_crit(border[:, 1], **names), rel=1e-5, abs=1e-12)
    # a number stands on its line
    for level, along, up in data["labels"]:
        place = plotting.place(along, up, kind[1] == "normal")
        assert surrogate.quantity("mu_ratio", *place, **names)[0] == close(level, rel=0.06)
    assert len(data["labels"]) >= 7
    # every regime of the map has its name once, and the border of reverse slip is where it begins
    v_all, y_all = np.meshgrid(v[::10], y[1::10])
    amplitude = "Fz_amplitude" if kind[1] == "normal" else "y0"
    unit = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0}
    there = surrogate.evaluate({**unit, "v0": v_all.ravel(), amplitude: y_all.ravel()}, **names)
    assert sorted(words for _, _, words in data["areas"]) == sorted(
        plotting.REGIMES[one].words for one in {*there.regime}
    )
    reverse = np.array(data["reverse"]).reshape(-1, 2)
    assert (len(reverse) > 100) is (kind == ("spring", "along"))
    if len(reverse):  # from the left of the map to its top
        assert reverse[0, 0] == close(v[0], rel=1e-3)
        assert 0.99 * y[-1] < reverse[-1, 1] <= y[-1]
    for side, regime in ((0.999, "stick_slip"), (1.001, "reverse_slip")):
        near = {**unit, "v0": reverse[:, 0], amplitude: side * reverse[:, 1]}
        assert {*surrogate.evaluate(near, **names).regime} <= {regime}


def test_each_map_is_kept_by_a_tag_of_its_own(client: Any) -> None:
    addresses = ["/static/page/map.json?contact={}&direction={}".format(*kind) for kind in KINDS]
    tags = [client.get(address).headers["etag"] for address in addresses]
    assert len({*tags}) == len(KINDS)
    for address, tag in zip(addresses, tags, strict=True):
        assert client.get(address, headers={"If-None-Match": tag}).status_code == 304


def test_there_is_no_map_of_what_is_not_modelled(client: Any, problem: Any) -> None:
    path = "/static/page/map.json"
    assert (
        "contact radius"
        in problem(client.get(f"{path}?contact=ball&direction=normal"), 422)["detail"]
    )
    problem(client.get(f"{path}?contact=box"), 422)
    names = client.get("/static/page/names.json").json()
    assert [*names["impossible"]] == ["ball normal", "rigid any"]


def test_units_and_geometries_are_the_librarys(client: Any) -> None:
    names = client.get("/static/page/names.json").json()
    expected = {**UNITS_OF, "Fz_amplitude": UNITS_OF["Fz"]}
    for name, one in names["inputs"].items():
        scales = {unit: list(scale) for unit, scale in expected[name].items()}
        assert scales.items() <= one["units"].items()
        typeset = {unit.replace("u", "µ"): scale for unit, scale in scales.items()}
        assert one["units"] == {**scales, **typeset}
        assert set(one["offered"]) <= set(one["units"])
        assert one["meaning"]
    assert names["start"].keys() == names["inputs"].keys() == expected.keys() - {"omega"}
    assert [list(words) for words in names["choices"].values()] == [
        [*CONTACTS, "rigid"],
        list(DIRECTIONS),
    ]
    assert {
        name: (one["meaning"], one["arguments"]) for name, one in names["geometries"].items()
    } == {name: (one.meaning, [*one.arguments, *BODIES]) for name, one in GEOMETRIES.items()}
    assert names["arguments"].keys() == ARGUMENTS.keys()
    # what is offered is what a request may hold, and the outputs are those that a kind has
    described = client.get("/openapi.json").json()
    fields = described["components"]["schemas"]["CaseRequest"]["properties"]
    assert {*names["inputs"], *names["choices"]} <= fields.keys()
    assert names["outputs"].keys() == {" ".join(kind) for kind in KINDS}
    # the documents are linked as they are written, where no guide is built
    assert (names["guide"], names["guide_ending"]) == ("documents/", ".md")


def test_the_start_and_the_materials_are_answered(client: Any) -> None:
    names = client.get("/static/page/names.json").json()
    for kind, outputs in names["outputs"].items():
        contact, direction = kind.split()
        amplitude = "y0" if direction == "normal" else "Fz_amplitude"
        case = {name: text for name, text in names["start"].items() if name != amplitude}
        body = {**case, "contact": contact, "direction": direction, "include": outputs}
        answer = client.post("/v1/mu-macro", json=body)
        assert answer.status_code == 200, answer.text
        assert answer.json().keys() >= {*outputs}
    assert len(names["materials"]["rows"]) >= 10
    for one in names["materials"]["rows"]:
        body = {"geometry": "ball", "radius": "5 mm", "Fz": "1 mN", "E": one["E"], "nu": one["nu"]}
        assert client.post("/v1/stiffness", json=body).json()["k"] > 0.0


def test_the_libraries_are_those_of_their_authors(client: Any, repository: Path) -> None:
    folder = repository / "service" / "static" / "lib"
    listed = dict(
        line.split()[::-1] for line in (folder / "checksums.txt").read_text().splitlines()
    )
    files = {path.name: path.read_bytes() for path in folder.glob("*.js")}
    assert {name: hashlib.sha256(data).hexdigest() for name, data in files.items()} == listed
    assert sum(map(len, files.values())) <= 180_000
    # in an order in which each finds what it needs
    script = client.get("/static/page/d3.js").text
    names = re.findall(r'^  "(.+)",$', script, re.MULTILINE)
    loaded = [f"d3-{name}.min.js" for name in names]
    assert {*loaded, "lit-html.js"} == files.keys()
    for i, name in enumerate(loaded):
        head = files[name].decode()[:700]
        needs = set(re.findall(r'require\("(d3-[^"]+)"\)', head))
        assert needs <= {one.removesuffix(".min.js") for one in loaded[:i]}, name


def test_the_page_begins_with_the_files_of_the_number(client: Any) -> None:
    page = client.get("/").text
    begun = re.findall(r'(?:rel="modulepreload" href|src)="([^"]+)"', page)
    needed = ["static/page/main.js"]
    for path in needed:
        names = re.findall(r'from "(.+)";$', client.get(f"/{path}").text, re.MULTILINE)
        paths = [posixpath.normpath(f"static/page/{name}") for name in names]
        needed += [path for path in dict.fromkeys(paths) if path not in needed]
    assert sorted(begun) == sorted(needed)


def test_without_a_table_the_page_is_there_and_the_map_is_not(tmp_path: Path, problem: Any) -> None:
    with TestClient(create_app(Settings(tables=(tmp_path,)))) as client:
        assert client.get("/").status_code == 200
        problem(client.get("/static/page/map.json"), 503)


def test_built_documentation_is_served_if_named(
    tmp_path: Path, tables_dir: Path, client: Any, problem: Any
) -> None:
    (tmp_path / "how-to").mkdir()
    (tmp_path / "index.html").write_text("<h1>Guide</h1>")
    (tmp_path / ".hidden").write_text("secret")
    (tmp_path / "scripts.html").write_text("<script>one()</script><script src=two.js></script>")
    (tmp_path / "how-to" / "index.html").write_text("<h1>How to</h1>")
    settings = Settings(tables=(tables_dir,), guide=tmp_path, api_key="open-sesame")
    with TestClient(create_app(settings)) as guided:  # it needs no key
        assert (
            guided.get("/guide/").text == guided.get("/guide/index.html").text == "<h1>Guide</h1>"
        )
        assert guided.get("/guide/how-to/").text == "<h1>How to</h1>"
        assert guided.get("/guide").url.path == "/guide/"
        named = guided.get("/static/page/names.json").json()
        assert (named["guide"], named["guide_ending"]) == ("guide/", ".html")
        for path in ("/guide/none.html", "/guide/..%2Fsecret", "/guide/.hidden"):
            problem(guided.get(path), 404)
        policy = guided.get("/guide/scripts.html").headers["content-security-policy"]
        digest = base64.b64encode(hashlib.sha256(b"one()").digest()).decode()
        assert f"script-src 'self' 'sha256-{digest}';" in policy
        assert "frame-ancestors 'none'" in policy
        moved = guided.get("/guide/how-to", follow_redirects=False)
        assert moved.headers["location"] == "how-to/"  # a proxy with TLS has another scheme
        problem(guided.post("/guide/", headers={"X-API-Key": "open-sesame"}), 405)
    for path in ("/guide", "/guide/", "/guide/tutorial.html"):  # says how to get it
        assert "python3 dev.py serve builds it" in problem(client.get(path), 404)["detail"]
    assert "no such path" in problem(client.get("/guided"), 404)["detail"]


def test_every_page_that_is_linked_is_there_without_a_guide(
    open_page: Any, client: Any, problem: Any
) -> None:
    page = open_page("#panel=fit")
    links = page.run("return [...document.links].map((one) => new URL(one.href).pathname);")
    documents = {one for one in links if one.startswith("/documents/")}
    assert documents >= {f"/documents/{one}.md" for one in ("page", "validity", "how-to/loop")}
    for path in documents:
        answer = client.get(path)
        assert answer.headers["content-type"].startswith("text/plain"), path
        assert answer.text.startswith("# "), path
    for path in ("/documents/none.md", "/documents/../pyproject.toml", "/documents/conf.py"):
        problem(client.get(path), 404)


def test_a_wheel_holds_the_built_documents_where_there_are_any(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import hatch_build
    from service import settings

    monkeypatch.setattr(hatch_build, "ROOT", tmp_path)
    assert hatch_build.guide() == {}
    site = tmp_path / "build" / "docs"
    for name in (
        "index.html",
        "how-to/index.html",
        "_static/a.css",
        "_static/a.css.map",
        ".doctrees/index.doctree",
        "_sources/index.md.txt",
        "objects.inv",
        ".buildinfo",
    ):
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text(name)
    places = {"index.html", "how-to/index.html", "_static/a.css"}
    assert hatch_build.guide() == {
        str(site / name): f"mumacro/service/guide/{name}" for name in places
    }
    # the service looks for it where it is built, and first where it is installed
    monkeypatch.setattr(settings, "__file__", str(tmp_path / "service" / "settings.py"))
    assert settings.Settings().guide == site
    installed = tmp_path / "service" / "guide"
    installed.parent.mkdir()
    site.rename(installed)
    assert settings.Settings().guide == installed
    (installed / "index.html").unlink()
    assert settings.Settings().guide is None


def test_an_empty_guide_is_none_and_not_the_folder_of_the_service(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from service.settings import Settings

    monkeypatch.setenv("MUMACRO_GUIDE", "")
    assert Settings().guide is None


def test_numbers_and_addresses_without_a_browser(
    client: Any, repository: Path, tmp_path: Path
) -> None:
    """The tests of the modules in node: numbers, addresses."""
    node = shutil.which("node")
    if node is None or tuple(
        map(int, re.findall(r"\d+", subprocess.check_output([node, "-v"], text=True)))
    ) < (20, 19):
        pytest.skip("node 20.19 or newer is not installed")
    file = tmp_path / "names.json"
    file.write_text(json.dumps(client.get("/static/page/names.json").json()))
    done = subprocess.run(
        [node, "--test", "tests/service/page"],
        cwd=repository,
        env={**os.environ, "PAGE_NAMES": str(file)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert int(re.findall(r"^(?:#|ℹ) pass (\d+)$", done.stdout, re.MULTILINE)[0]) > 25


WIDTHS = (320, 360, 390, 480, 600, 768, 800, 1024, 1180, 1280, 1440, 1920)
#: the longest of what the cards may hold
LONGEST = "#mu0=0.3±0.02&k=0.912345 ± 0.1 N/um&v0=1e6&digits=all&bad=1"


@pytest.mark.parametrize("address", ["", LONGEST, "#k=rigid&y0=2"])
def test_it_fits_every_width(open_page: Any, address: str) -> None:
    page = open_page(address, width=WIDTHS[0], height=800)
    for width in WIDTHS:
        page.pixel_ratio(1, width, 800)
        fits(page, width)


def fits(page: Any, width: int) -> None:
    assert page.run("return document.documentElement.scrollWidth;") <= width
    # the number stands on one line, inside of its card
    box, card = (page.find(one).rect for one in ("#number", "#answer"))
    lines = page.run(
        "const range = document.createRange(); range.selectNodeContents(document.querySelector"
        "('#number')); return new Set([...range.getClientRects()].filter((one) => one.width > 1)"
        ".map((one) => Math.round(one.bottom / 12))).size;"
    )
    assert lines <= 2  # a deviation is set smaller, on the same line
    assert box["x"] + box["width"] <= card["x"] + card["width"]
    hint = page.find("header .hint").rect
    assert hint["width"] > hint["height"]  # it is a line, and no column of single words
    # no card lies on another
    overlaps = page.run(
        "const all = [...document.querySelectorAll('section, header, .notice')]"
        ".map((one) => one.getBoundingClientRect()).filter(({ width }) => width > 0);"
        "return all.flatMap((a, i) => all.slice(i + 1).filter((b) => a.left < b.right && b.left < "
        "a.right && a.top < b.bottom && b.top < a.bottom)).length;"
    )
    assert overlaps == 0
    # controls are large enough for a finger
    small = page.run(
        "return [...document.querySelectorAll('input, select, button, nav a')].map((element) =>"
        " [element.id || element.outerHTML, (element.closest('.switch, .choice label, .button') ??"
        " element).getBoundingClientRect().height])"
        ".filter(([, height]) => height > 0 && height < 38);"
    )
    assert small == [] or width > 760


#: the texts that are not seen whole: their own box, or one around it that hides or scrolls, is
#: smaller than they are
CUT = """
const unseen = 'option, script, style, svg, .choice input';
const cut = (box, text) => text.bottom > box.bottom + 1 || text.right > box.right + 1 ||
  text.top < box.top - 1 || text.left < box.left - 1;
const found = [];
const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walk.nextNode()) {
  const [node, range] = [walk.currentNode, document.createRange()];
  range.selectNodeContents(node);
  const text = range.getBoundingClientRect();
  if (!node.data.trim() || !text.width || node.parentElement.closest(unseen)) continue;
  let box = node.parentElement;
  while (/^inline$|contents/.test(getComputedStyle(box).display)) box = box.parentElement;
  if (box.scrollHeight > box.clientHeight || box.scrollWidth > box.clientWidth)
    found.push(`${node.data.trim()} in ${box.tagName} #${box.id} .${box.className}`);
  for (; box !== document.body; box = box.parentElement)
    if (getComputedStyle(box).overflow !== 'visible' && cut(box.getBoundingClientRect(), text))
      found.push(`${node.data.trim()} below ${box.tagName} #${box.id}`);
}
for (const field of document.querySelectorAll('textarea'))
  if (field.scrollHeight > field.clientHeight || field.scrollWidth > field.clientWidth)
    if (field.value) found.push(`${field.value} in the field #${field.id}`);
return [...new Set(found)];
"""
#: the first view, the longest texts, and what is told where something is doubted or refused
STATES = (
    "",
    LONGEST,
    "#k=1 ± 0.1 N/um&mu0=0.3 ± 0.02&Fz=10 ± 1 N&y0=2 ± 0.2 um",
    "#k=0.8..1.2 N/um&contact=ball&direction=along",
    "#k=rigid&y0=2",
    "#direction=normal&Fz_amplitude=9.99 N",
    "#f=20000 kHz&mu0=30&Fz=5 apples&v0=0",
    "#mu0=-1&from=0&along=Fz",
    "#motion=any&x=2 parsec&y=2&normal=3 N @ 45 deg",
    "#motion=any&y=2 um&k=1 ± 0.1 N/um",
    "#panel=fit",
)


@pytest.mark.parametrize("address", STATES)
def test_every_box_holds_its_text(open_page: Any, address: str) -> None:
    page = open_page(address, width=WIDTHS[0], height=800)
    page.click("#assumes summary")
    for scheme, ratios in (("light", (1, 2, 3)), ("dark", (1,))):
        page.scheme(scheme)
        for width, ratio in itertools.product(WIDTHS, ratios):
            page.pixel_ratio(ratio, width, 800)
            assert page.run(CUT) == [], (width, ratio, scheme)
    page.scheme("light")


#: texts of the plots that lie on each other
COVERED = """
const found = [];
for (const plot of document.querySelectorAll('.plot')) {
  const all = [...plot.querySelectorAll('text:not(.covered)')]
    .map((one) => [one.textContent, one.getBoundingClientRect()])
    .filter(([words, { width }]) => words && width);
  all.forEach(([name, a], i) => all.slice(i + 1).forEach(([other, b]) => {
    if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&
        Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 3)
      found.push(`${plot.id}: ${name} and ${other}`);
  }));
  // all are seen whole
  const svg = plot.getBoundingClientRect();
  for (const [name, box] of all)
    if (box.left < svg.left - 1 || box.right > svg.right + 1 || box.top < svg.top - 1 ||
        box.bottom > svg.bottom + 1)
      found.push(`${plot.id}: ${name} is cut`);
  // and none has a bar or the point on it
  const frame = plot.querySelector('clipPath rect')?.getBBox();
  const within = (one, box) => one.x >= box.x && one.x <= box.x + box.width &&
    one.y >= box.y && one.y <= box.y + box.height;
  for (const mark of plot.querySelectorAll('.deviation, .point'))
    for (let at = 0; at <= mark.getTotalLength(); at += 4) {
      const place = mark.getPointAtLength(at);
      if (mark.matches('.deviation') && !within(place, frame)) continue;
      const seen = place.matrixTransform(mark.getScreenCTM());
      for (const [name, box] of all)
        if (within(seen, box)) found.push(`${plot.id}: ${mark.getAttribute('class')} on ${name}`);
    }
}
return found;
"""


@pytest.mark.parametrize("width", [320, 375, 768, 1280, 1920])
def test_no_text_of_a_plot_lies_on_another(open_page: Any, width: int) -> None:
    kinds = ("", "contact=ball&direction=along", "direction=normal", "k=rigid", "k=0.1..10 N/um")
    for kind in kinds:
        for law in ("", "&along=Fz", "&along=k&scale=linear", "&along=y0&v0=1e3"):
            page = open_page(f"#{kind}{law}&motion=any", width=width, height=800)
            assert page.run(COVERED) == [], (kind, law)


@pytest.mark.parametrize(
    "address",
    [
        "",
        LONGEST,
        "#motion=any",
        "#motion=any&x=2 um @ 90 deg&y=12.5 um @ 45 deg&normal=5 N @ -90 deg",
        "#contact=ball&k=0.1..10 N/um",
    ],
)
def test_every_box_holds_its_text_on_paper(open_page: Any, address: str) -> None:
    page = open_page(address, width=1280, height=800)
    with page.paper():
        assert page.run(CUT) == []
        assert page.run(COVERED) == []
        cut = page.run(
            "return [...document.querySelectorAll('.field input')].filter((one) =>"
            " one.scrollWidth > one.clientWidth).map((one) => one.value);"
        )
        assert cut == []
        for plot in page.rects(".plot:not(#fit-plot)"):
            assert plot["width"] >= 1.4 * plot["height"]  # none is squeezed
        # no number is parted from its unit
        heights = {round(one["height"]) for one in page.rects("#values dd, #motion-values dd")}
        assert len(heights - {0}) == 1


def test_every_level_and_regime_of_the_map_is_named(open_page: Any) -> None:
    page = open_page(width=WIDTHS[0], height=800)
    levels = [f"{level:g}" for level in (0.0, *plotting.LEVELS, 1.0)]
    for width in WIDTHS:
        page.pixel_ratio(1, width, 800)
        assert page.texts("#map .legend text") == ["µ/µ₀", *levels]
        names = page.run(
            "return [...document.querySelectorAll('#map .area:not(.covered)')].map((one) =>"
            " one.textContent.replaceAll(' ', ''));"
        )
        assert names == ["stickandslip", "continuoussliding"], width


def test_links_have_one_look_and_buttons_another(open_page: Any) -> None:
    page = open_page("#panel=fit")
    looks = page.run(
        "const look = (one) => { const seen = getComputedStyle(one); return [seen.color,"
        " seen.backgroundColor, seen.textDecorationLine].join(' '); };"
        "const of = (all) => [...new Set([...document.querySelectorAll(all)].map(look))];"
        "return [of('a'), of('button:enabled:not([role=tab]), .button')];"
    )
    assert [len(one) for one in looks] == [1, 1]
    assert "underline" in looks[0][0]
    assert "underline" not in looks[1][0]


def test_the_choices_have_their_names_before_them(open_page: Any) -> None:
    for width in (320, 1280):
        page = open_page(width=width, height=800)
        for name, title in (("contact", "Contact"), ("direction", "Oscillation")):
            label, words = page.find(f"#{name}-title"), page.find(f"#{name}")
            assert label.text == title
            assert label.rect["x"] + label.rect["width"] <= words.rect["x"]


def test_a_clamp_is_found(open_page: Any) -> None:
    page = open_page(width=1280, height=800)
    page.run(
        "Object.assign(document.querySelector('#advice').style,"
        " { height: '9.59px', overflow: 'hidden' });"
    )
    assert any("#advice" in one for one in page.run(CUT))


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (1440, 900), (1920, 1080)])
def test_one_screen_holds_inputs_number_and_map(open_page: Any, width: int, height: int) -> None:
    page = open_page(width=width, height=height)
    for name in ("inputs", "answer", "map-section", "law-section", "side", "copy"):
        box = page.find(f"#{name}").rect
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= height, name
    field, card = page.find("#copy-text").rect, page.find("#copy").rect
    assert card["y"] + card["height"] - field["y"] - field["height"] <= 14  # and no blank below it


def inaccessible(page: Any, repository: Path) -> Any:
    """Violations found by axe-core, in the light and dark schemes: rules and elements."""
    violations = {}
    page.browser.execute_script((repository / AXE).read_text("utf-8"))
    for scheme, rules in (("light", "{}"), ("dark", "{ runOnly: ['color-contrast'] }")):
        page.scheme(scheme)
        broken = page.run(
            f"const found = await axe.run(document, {{ resultTypes: ['violations'], ...{rules} }});"
            "return found.violations.map((one) => [one.id, one.nodes.map((node) => "
            "node.target.join(' '))]);"
        )
        violations.update({(scheme, rule): places[:5] for rule, places in broken})
    page.scheme("light")
    return violations


@pytest.mark.parametrize("width", [1440, 390])
def test_the_page_is_accessible(open_page: Any, repository: Path, width: Any) -> None:
    page = open_page("#bad=1&v0=1e6&digits=all", width=width)
    assert inaccessible(page, repository) == {}
    page = open_page("#contact=ball&direction=along&k=0.8..1.2N/um&along=Fz", width=width)
    page.click("#tab-target")
    page.click("#tab-stiffness")
    for name, text in (("radius", "5 mm"), ("E", "210 GPa"), ("nu", "0.3")):
        page.type(f"#argument-{name}", text)
    page.click("#stiffness-form button")
    assert inaccessible(page, repository) == {}
    page.click("#tab-fit")
    page.choose("#points", "v0 mu_macro\n0.001 0.1\n0.1 0.2")
    page.click("#fit-button")
    assert inaccessible(page, repository) == {}
    page.click("[name=direction][value=any]")
    page.click("#motion-target-form button")
    assert inaccessible(page, repository) == {}
    page.click("[name=direction][value=across]")
    page.click("[data-meanings=values]")
    assert inaccessible(page, repository) == {}
    page.click("#meanings button")
    page.click("#assumes summary")
    assert inaccessible(page, repository) == {}
    assert page.run("return document.documentElement.scrollWidth;") <= width


def test_the_description_is_accessible_and_leads_back(
    open_page: Any, repository: Path, surrogate: Surrogate
) -> None:
    page = open_page(path="docs")
    page.wait_for("#swagger-ui", "The value of one input that gives a wanted mu_macro")
    assert not page.find("#key-form").is_displayed()
    # with one GET and one POST operation open
    page.run(
        "for (const call of ['get', 'post'])"
        " document.querySelector(`.opblock-${call} .opblock-summary-control`).click();"
    )
    page.wait_for("#swagger-ui", "Coulomb friction coefficient of the contact")
    assert inaccessible(page, repository) == {}
    # the body of a batch stands above its options; "Try it out" answers as it opens
    batch = "#operations-answers-post_mu_macro_batch"
    page.find(f"{batch} .opblock-summary-control").click()
    page.wait_for(batch, "Standard deviation")
    top = "return document.querySelector(arguments[0]).getBoundingClientRect().top;"
    body, options = (
        page.browser.execute_script(top, f"{batch} {part}")
        for part in (".opblock-section-request-body", ".parameters-container")
    )
    assert body < options
    page.find(f"{batch} .try-out__btn").click()
    page.find(f"{batch} .execute").click()
    page.wait_for(f"{batch} .live-responses-table", '"mu_macro"')
    page.find("#back").click()
    page.settle()
    assert page.number() == page.rounded(surrogate.evaluate(**START).mu_macro)


def test_the_pages_ask_for_the_key_and_use_it(
    open_page: Any, serving: Any, tables_dir: Path, tmp_path: Path
) -> None:
    def enter(key: Any) -> None:
        page.type("#key", key, commit=False)
        page.find("#key-form button").click()

    with serving(tables_dir, MUMACRO_API_KEY="open-sesame") as server:
        page = open_page(url=server.url, path="docs")
        page.until(page.find("#key-form").is_displayed, lambda: "#key-form")
        enter("open-sesame")
        page.wait_for("#swagger-ui", "mu_macro over a range of one input")
        assert not page.find("#key-form").is_displayed()
        page.find("#back").click()  # the tab keeps the key until it is deleted
        page.wait_for("#mu", r"^0\.\d+$")
        page.find("#forget").click()
        page.wait_for("#mu", "^…$")
        page.until(page.find("#key-form").is_displayed, lambda: "#key-form")
        assert page.run("return sessionStorage.length;") == 0
        for wrong, reason in (("two words", "no spaces"), ("nonsense", "not the key")):
            enter(wrong)
            page.wait_for("#key-status", reason)
            assert page.text("#mu") == "…"
        enter("open-sesame")
        page.wait_for("#mu", r"^0\.\d+$")
        page.settle()
        assert not page.find("#key-form").is_displayed()
        assert "sesame" not in page.browser.current_url
        assert len(page.download("#csv", tmp_path, "friction-law-v0.csv")) > 10_000
        page.run("sessionStorage.clear();")
