"""The page without a service: a folder that computes in the browser and continues when its host is stopped."""

import functools
import http.server
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.c.source import ExportError
from builder.c.wasm import compiler
from builder.export import export_table
from builder.export_page import main, write_page
from mumacro import Surrogate
from mumacro.inputs import FIELDS
from tests.browser import START
from tests.cases import Capture
from tests.comparing import close

pytestmark = pytest.mark.slow
OFFERED_BY_A_SERVICE = ("#solve", "#stiffness", "#fit", "#contact", "nav a[href='docs']", "nav a[href='guide/']")


@pytest.fixture(scope="module")
def table(tables_dir: Path) -> Any:
    return Surrogate.open(tables_dir / "mumacro-1e-7.nc", threads=1)


@pytest.fixture(scope="module")
def folder(table: Surrogate, tmp_path_factory: pytest.TempPathFactory) -> Any:
    if compiler() is None:
        pytest.skip("neither zig nor clang with lld is installed")
    root = tmp_path_factory.mktemp("alone")
    export_table(table.path, "wasm", root / "mumacro.wasm")
    assert main([str(table.path), str(root / "mumacro.wasm"), str(root / "page")]) == 0
    return root / "page"


@contextmanager
def hosted(folder: Path) -> Any:
    """The address of a static host on a loopback port."""

    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture(scope="module")
def host(folder: Path) -> Any:
    with hosted(folder) as url:
        yield url


def test_the_module_is_small_and_is_of_its_table(
    folder: Path, table: Surrogate, tables_dir: Path, tmp_path: Path, capsys: Capture
) -> None:
    path, other = folder / "static" / "page" / "mumacro.wasm", tables_dir / "mumacro-1e-4.nc"
    module = path.read_bytes()
    assert module[:4] == b"\0asm"
    assert len(module) < 320_000
    assert table.checksum.encode() in module
    with pytest.raises(ExportError, match="not exported from"):
        write_page(other, path, tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert (main([str(other), str(path), str(tmp_path)]), main([])) == (1, 2)
    assert "not exported from" in capsys.readouterr().err


def test_it_answers_and_goes_on_when_its_host_is_gone(open_page: Any, folder: Path, table: Surrogate) -> None:
    with hosted(folder) as url:
        page = open_page("", url=url, new=True).settle()
    told = page.text("#alone")
    for part in (table.id, f"tolerance {table.tolerance:g}", table.checksum[:12], "Not offered here"):
        assert part in told
    expected = table.evaluate(**START)
    assert page.number() == page.rounded(expected.mu_macro)
    assert page.shown()["answered by block"] == expected.source
    assert table.checksum[:12] in page.shown()["of table"]
    page.type("#field-v0", "200 mm/s")
    assert page.number() == page.rounded(table.evaluate(**{**START, "v0": 0.2}).mu_macro)
    page.click("#rigid")
    assert page.number() == page.rounded(table.evaluate(**{**START, "k": "rigid", "v0": 0.2}).mu_macro)
    page.choose("#along", "y0")
    assert "at y₀ = " in page.find("#law").get_attribute("aria-label")
    assert page.text("#law-status") == page.text("#status") == ""
    assert not page.is_old()
    assert not any(page.find(hidden).is_displayed() for hidden in OFFERED_BY_A_SERVICE)


def test_its_numbers_are_pythons(open_page: Any, host: Any, table: Surrogate) -> None:
    """Some thousand cases of every regime."""
    rng = np.random.default_rng(13)
    n = 20_000
    v, y = 10.0 ** rng.uniform(-4.0, 4.0, (2, n))
    cases = {"mu0": rng.uniform(0.05, 1.5, n), "Fz": 10.0 ** rng.uniform(-2, 4, n), "k": 10.0 ** rng.uniform(3, 9, n)}
    length = cases["mu0"] * cases["Fz"] / cases["k"]
    cases |= {"y0": y * length, "omega": 10.0 ** rng.uniform(1, 6, n)}
    cases["v0"] = v * length * cases["omega"]
    answer = table.evaluate(cases, gradient=True)
    page = open_page("", url=host, new=True).settle()
    found = np.array(page.run(
        f"const cases = {list(map(list, zip(*(cases[name].tolist() for name in FIELDS), strict=True)))};"
        "const { evaluate } = await import('./static/page/service.js');"
        f"const names = {list(FIELDS)};"
        "return cases.map((row) => { const a = evaluate(Object.fromEntries(names.map((name, i) => [name, row[i]])));"
        " return [a.mu_macro, a.error_bound, ...names.map((name) => a.gradient[name])]; });"
    ))  # fmt: skip
    # the same operations as interpreted Python; compiled Python fuses products and sums
    assert np.all(np.abs(found[:, 0] - answer.mu_macro) <= answer.error_bound)
    ulp = np.abs(found[:, 0] - answer.mu_macro) / np.spacing(answer.mu_macro)
    assert np.mean(ulp > 4.0) < 5e-3
    for i, name in enumerate(FIELDS):
        assert np.all(np.abs(found[:, 2 + i] - answer.gradient[name]) <= answer.gradient_bound[name])


def both(open_page: Any, host: Any, client: Any, path: Any, asked: Any) -> Any:
    page = open_page("", url=host)
    found = page.run(f"return (await import('./static/page/service.js')).post('{path}', {asked});")["found"]
    return found, client.post(f"/{path}", json={**asked, "tolerance": 1e-7}).json()


@pytest.mark.parametrize("along", FIELDS)
@pytest.mark.parametrize("scale", ["log", "linear"])
def test_its_laws_are_the_services(open_page: Any, host: Any, client: Any, along: Any, scale: Any) -> None:
    ends = {"start": 0.1 * START[along], "stop": 50.0 * START[along], "points": 101}
    given = {name: value for name, value in START.items() if name != along}
    found, expected = both(open_page, host, client, "v1/law", {**given, **ends, "along": along, "scale": scale})
    for name in ("values", "mu_macro", "mu_static"):
        assert found[name] == close(expected[name], rel=1e-12), name
    assert found["regime"] == expected["regime"]
    [mine], [theirs] = found["border"], expected["border"]
    assert mine == {name: close(theirs[name], rel=1e-9) for name in ("value", "mu_macro")}


@pytest.mark.parametrize("name", ["", "k=rigid", "y0=0", "omega=0", "v0=0", "y0=5e-6", "v0=30"])
def test_its_readout_is_the_services(open_page: Any, host: Any, client: Any, name: str) -> None:
    changed = {name: x if x == "rigid" else float(x) for name, _, x in [name.partition("=")] if x}
    include = ["groups", "limits", "stick_fraction", "power", "gradient"]
    found, expected = both(open_page, host, client, "v1/mu-macro", {**START, **changed, "include": include})
    assert (found["regime"], found["source"]) == (expected["regime"], expected["source"])
    groups = ("groups", "limits", "power", "gradient")
    mine, theirs = (
        {name: one[name] for name in ("mu_macro", "mu_ratio", "stick_fraction")}
        | {name: number for group in groups for name, number in one[group].items()}
        for one in (found, expected)
    )
    for name, number in mine.items():
        assert number == (None if theirs[name] is None else close(theirs[name], rel=1e-9)), name
