"""The examples run and give the documented results, if their tools are installed."""

import csv
import importlib
import importlib.util
import io
import math
import os
import re
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate, motion
from tests.support.comparing import close
from tests.support.serving import CASE as SERVED

CASE = {**SERVED, "omega": 2 * math.pi * 20e3}

pytestmark = pytest.mark.slow


def run(repository: Path, *command: Any) -> Any:
    environment = {**os.environ, "PYTHONPATH": str(repository), "OPENMDAO_REPORTS": "0"}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=repository,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def need(name: str | None, *modules: Any) -> None:
    if name is not None and shutil.which(name) is None:
        pytest.skip(f"{name} is not installed")
    for module in modules:
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"the Python package {module} is not installed")


def number(pattern: Any, text: str) -> Any:
    match = re.search(pattern, text)
    assert match, text
    return float(match[1])


def test_every_example_is_listed_and_tested(repository: Path) -> None:
    there = {
        path.name
        for path in (repository / "examples").iterdir()
        if not path.name.startswith(("_", "."))
    }
    readme = (repository / "examples" / "README.md").read_text("utf-8")
    tests = "".join(path.read_text("utf-8") for path in (repository / "tests").rglob("*.py"))
    assert [name for name in there - {"README.md"} if f"`{name}" not in readme] == []
    assert [name for name in there - {"README.md"} if Path(name).stem not in tests] == []


def test_the_demo_prints_the_answer_of_the_readme(repository: Path) -> None:
    text = run(repository, sys.executable, "dev.py", "demo")  # examples/demo.py
    readme = (repository / "README.md").read_text("utf-8")
    stated = number(r'^\{"mu_macro":([0-9.]+)', readme[readme.index('{"mu_macro":') :])
    # the README has ten digits: the last ones of a double depend on the processor
    assert number(r'"mu_macro": ([0-9.]+)', text) == close(stated, abs=5e-11)
    assert number(r"Answer: +mu_macro = ([0-9.]+) ", text) == close(stated, abs=5e-11)
    # what comes next is what the README says
    for step in ("python3 dev.py serve", "open http://127.0.0.1:8000"):
        assert step in text
        assert step in readme.replace("<", "").replace(">", "")


def test_curl(repository: Path, live_server: Any, surrogate: Surrogate) -> None:
    need("curl")
    version = run(repository, "curl", "--version").split()[1]
    if tuple(map(int, version.split(".")[:2])) < (7, 82):
        pytest.skip(f"curl {version} has no --json, which came with 7.82")
    text = run(repository, "sh", "examples/curl.sh", live_server.url)
    expected = surrogate.evaluate(**CASE).mu_macro
    assert number(r'^\{"mu_macro":([0-9.e-]+)', text.split("\n", 1)[1]) == expected
    assert number(r'"roots":\[\{"value":([0-9.e-]+)', text) == close(2.8656e-6, rel=1e-4)
    ellipse = motion(**{name: CASE[name] for name in CASE if name != "y0"}, x=(1e-6, 90.0), y=2e-6)
    assert number(r'"mu_macro":([0-9.e-]+),"mu_lateral"', text) == ellipse.mu_macro
    rows = [line for line in text.splitlines() if line.endswith(("_low", "corner"))]
    assert [float(row.split(",")[0]) for row in rows] == [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0]


def test_python(repository: Path, live_server: Any, surrogate: Surrogate) -> None:
    text = run(repository, sys.executable, "examples/client.py", live_server.url)
    assert number(r"mu_macro = ([\d.]+) \(numerical error", text) == close(
        surrogate.evaluate(**CASE).mu_macro, abs=1e-6
    )
    for v0, mu in re.findall(r"v0 =\s+([\d.]+) m/s: mu_macro = ([\d.]+)", text):
        assert float(mu) == close(
            surrogate.evaluate(**{**CASE, "v0": float(v0)}).mu_macro, abs=1e-6
        )
    for target, y0 in re.findall(r"mu_macro = ([\d.]+) needs y0 = ([\d.]+) um", text):
        answer = surrogate.evaluate(**{**CASE, "y0": 1e-6 * float(y0)})
        assert answer.mu_macro == close(float(target), abs=2e-5)


def test_the_spreadsheets_addresses(
    repository: Path, live_server: Any, surrogate: Surrogate
) -> None:
    text = (repository / "docs" / "how-to" / "spreadsheet.md").read_text("utf-8")
    addresses = re.findall(r"^ {4}(http://127\.0\.0\.1:8000/\S+)$", text, re.MULTILINE)
    joined = re.search(r'address = "([^"]+)" & y0', text)
    assert joined
    addresses.append(joined[1] + "2E-06")
    assert len(addresses) == 3
    for address in addresses:
        with urllib.request.urlopen(
            address.replace("http://127.0.0.1:8000", live_server.url), timeout=60
        ) as response:
            header, *rows = csv.reader(io.StringIO(response.read().decode()))
        assert len(rows) == 50
        along = header[0].split(" ")[0]
        for row in rows[::7]:
            expected = surrogate.evaluate(**{**CASE, along: float(row[0])}).mu_macro
            assert float(row[1]) == close(expected, rel=1e-14)
    for column in re.findall(r'\{"([^"]+)", type number\}', text):
        assert column in ("v0 [m/s]", "mu_macro [-]")
    number_of, word_of = re.findall(r'WEBSERVICE\("http://127\.0\.0\.1:8000(/\S+)"&A1\)', text)
    for y0 in (2e-6, 2e-5):
        answer = surrogate.evaluate(**{**CASE, "y0": y0})
        shown = [live_server.ask("GET", f"{path}{y0}")[2].decode() for path in (number_of, word_of)]
        assert shown == [repr(answer.mu_macro), answer.regime]
    assert live_server.ask("GET", f"{number_of}-1")[0] == 422


def test_the_spreadsheets_query_with_a_key(repository: Path, surrogate: Surrogate) -> None:
    from fastapi.testclient import TestClient

    from service.app import create_app
    from service.settings import Settings

    text = (repository / "docs" / "how-to" / "spreadsheet.md").read_text("utf-8")
    (query,) = re.findall(r"Query = \[(.+?)\],\s+Headers", text, re.DOTALL)
    params = dict(re.findall(r'(\w+) = "([^"]+)"', query)) | {"y0": "2E-06"}
    assert "y0 = Number.ToText" in query
    (path,) = re.findall(r'RelativePath = "([^"]+)"', text)
    (header,) = re.findall(r'Headers = \[#"([^"]+)" =', text)
    settings = Settings(tables=(repository / "tables",), api_key="open-sesame")
    with TestClient(create_app(settings)) as client:
        assert client.get(f"/{path}", params=params).status_code == 401
        answer = client.get(f"/{path}", params=params, headers={header: "open-sesame"})
    head, first, *_ = csv.reader(io.StringIO(answer.text))
    assert {"v0 [m/s]", "mu_macro [-]"} <= {*head}
    expected = surrogate.evaluate(**{**CASE, "v0": float(first[0])}).mu_macro
    assert float(first[1]) == close(expected, rel=1e-14)


def test_octave(repository: Path, live_server: Any, surrogate: Surrogate) -> None:
    need("octave-cli")
    text = run(repository, "octave-cli", "--norc", "examples/octave.m", live_server.url)
    assert number(r"mu_macro = ([\d.]+), stick_slip", text) == close(
        surrogate.evaluate(**CASE).mu_macro, abs=1e-6
    )
    for pattern, v0 in ((r"from ([\d.]+) at 0.0001 m/s", 1e-4), (r"to ([\d.]+) at 10 m/s", 10.0)):
        assert number(pattern, text) == close(
            surrogate.evaluate(**{**CASE, "v0": v0}).mu_macro, abs=1e-6
        )
    assert 0.02 < number(r"steepest near ([\d.]+) m/s", text) < 0.04


def test_the_umbridge_server_answers_as_the_library_and_outlives_an_error(
    bridge: Any, surrogate: Surrogate
) -> None:
    model, point = (
        importlib.import_module("umbridge").HTTPModel(bridge, "mu_macro"),
        list(CASE.values()),
    )
    expected = surrogate.evaluate(CASE, gradient=True)
    slopes = [expected.gradient[name] for name in CASE]
    with pytest.raises(Exception, match=r"."):
        model([[-0.3, *point[1:]]])
    assert (model.get_input_sizes(), model.get_output_sizes()) == ([6], [1])
    assert model([point])[0] == close([expected.mu_macro], rel=1e-13)
    assert model.gradient(0, 0, [point], [2.0]) == close(
        [2.0 * slope for slope in slopes], rel=1e-13
    )
    assert model.apply_jacobian(0, 0, [point], [0.0, 0.0, 0.0, 0.0, 0.0, 3.0]) == close(
        [3.0 * slopes[5]], rel=1e-13
    )


def test_uncertainty(repository: Path, bridge: Any, surrogate: Surrogate) -> None:
    text = run(repository, sys.executable, "examples/uncertainty.py", bridge)
    sampled = number(r"points: mean [\d.]+, standard deviation ([\d.]+)", text)
    first_order = number(r"first order: standard deviation ([\d.]+)", text)
    gradient = surrogate.evaluate(**CASE, gradient=True).gradient
    spreads = {"mu0": 1.03, "Fz": 1.02, "y0": 1.05}
    expected = (
        sum((gradient[name] * CASE[name] * np.log(spread)) ** 2 for name, spread in spreads.items())
        ** 0.5
    )
    assert first_order == close(expected, abs=1e-5)
    assert sampled == close(first_order, rel=0.02)


@pytest.mark.peer
def test_least_power(repository: Path, tables_dir: Path) -> None:
    need(None, "openmdao")
    table = tables_dir / "mumacro-1e-10.nc"
    text = run(repository, sys.executable, "examples/least_power.py", table)
    assert number(r"mu_macro = ([\d.]+)", text) == close(0.15, abs=1e-6)
    assert number(r"power ([\d.]+) mW", text) == close(47.085, rel=1e-4)  # as by CasADi with Ipopt
