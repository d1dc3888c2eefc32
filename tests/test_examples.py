"""The examples run and give the documented results, if their tools are installed."""

import csv
import importlib.util
import io
import os
import re
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import pytest

from mumacro import Surrogate
from tests.comparing import close
from tests.serving import CASE

pytestmark = pytest.mark.slow

EXAMPLES = {
    "README.md", "curl.sh", "client.py", "spreadsheet.md", "octave.m", "octave_mat.m", "modelica.md", "uncertainty.py",
    "least_power.py", "casadi_least_power.py", "openmdao_component.py", "quasi_monte_carlo.py", "umbridge_server.py",
    "mass_on_belt.py", "demo.py", "friction.ipynb", "c",
}  # fmt: skip


def run(repository: Path, *command: Any) -> Any:
    environment = {**os.environ, "PYTHONPATH": str(repository), "OPENMDAO_REPORTS": "0"}
    done = subprocess.run(
        [str(word) for word in command], cwd=repository, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def need(name: str | None, *modules: Any) -> None:
    """Skip unless a program, or Python packages, are installed."""
    if name is not None and shutil.which(name) is None:
        pytest.skip(f"{name} is not installed")
    for module in modules:
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"the Python package {module} is not installed")


def number(pattern: Any, text: str) -> Any:
    found = re.search(pattern, text)
    assert found, text
    return float(found[1])


def test_every_example_is_listed_and_tested(repository: Path) -> None:
    there = {path.name for path in (repository / "examples").iterdir() if not path.name.startswith(("_", "."))}
    assert there == EXAMPLES
    readme = (repository / "examples" / "README.md").read_text("utf-8")
    assert all(f"`{name}" in readme for name in EXAMPLES - {"README.md"})


def test_casadi_finds_the_least_power_that_openmdao_finds(repository: Path) -> None:
    need("cc", "casadi")
    out = run(repository, sys.executable, repository / "examples" / "casadi_least_power.py")
    assert number(r"y0 = (\S+) um", out) == close(3.6842, rel=1e-4)
    assert number(r"power (\S+) mW", out) == close(47.085, rel=1e-4)


def test_the_shaker_ends_the_stick_slip_of_a_mass_on_a_belt(repository: Path) -> None:
    need(None, "mujoco")
    out = run(repository, sys.executable, repository / "examples" / "mass_on_belt.py")
    assert number(r"y0 = 0\.0 um: swings by (\S+) mm", out) == close(1.1, rel=0.02)  # as examples/c/mass_on_belt.c
    assert number(r"y0 = 4\.0 um: swings by (\S+) mm", out) < 1e-3


def test_curl(repository: Path, live_server: Any, surrogate: Surrogate) -> None:
    need("curl")
    version = run(repository, "curl", "--version").split()[1]
    if tuple(map(int, version.split(".")[:2])) < (7, 82):
        pytest.skip(f"curl {version} has no --json, which came with 7.82")
    text = run(repository, "sh", "examples/curl.sh", live_server.url)
    expected = surrogate.evaluate(**CASE).mu_macro
    assert number(r'^\{"mu_macro":([0-9.e-]+)', text.split("\n", 1)[1]) == expected
    assert number(r'"roots":\[\{"value":([0-9.e-]+)', text) == close(2.857e-6, rel=1e-3)
    rows = [line for line in text.splitlines() if line.endswith(("_low", "corner"))]
    assert [float(row.split(",")[0]) for row in rows] == [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0]


def test_python(repository: Path, live_server: Any, surrogate: Surrogate) -> None:
    text = run(repository, sys.executable, "examples/client.py", live_server.url)
    assert number(r"mu_macro = ([\d.]+) \+-", text) == close(surrogate.evaluate(**CASE).mu_macro, abs=1e-6)
    for v0, mu in re.findall(r"v0 =\s+([\d.]+) m/s: mu_macro = ([\d.]+)", text):
        assert float(mu) == close(surrogate.evaluate(**{**CASE, "v0": float(v0)}).mu_macro, abs=1e-6)
    for target, y0 in re.findall(r"mu_macro = ([\d.]+) needs y0 = ([\d.]+) um", text):
        answer = surrogate.evaluate(**{**CASE, "y0": 1e-6 * float(y0)})
        assert answer.mu_macro == close(float(target), abs=2e-5)


def test_the_spreadsheets_addresses(repository: Path, live_server: Any, surrogate: Surrogate) -> None:
    text = (repository / "examples" / "spreadsheet.md").read_text("utf-8")
    addresses = re.findall(r"^ {4}(http://127\.0\.0\.1:8000/\S+)$", text, re.MULTILINE)
    joined = re.search(r'address = "([^"]+)" & y0', text)
    assert joined
    addresses.append(joined[1] + "2E-06")
    assert len(addresses) == 3
    for address in addresses:
        with urllib.request.urlopen(address.replace("http://127.0.0.1:8000", live_server.url), timeout=60) as response:
            header, *rows = csv.reader(io.StringIO(response.read().decode()))
        assert len(rows) == 50
        along = header[0].split(" ")[0]
        for row in rows[::7]:
            expected = surrogate.evaluate(**{**CASE, along: float(row[0])}).mu_macro
            assert float(row[1]) == close(expected, rel=1e-14)
    for column in re.findall(r'\{"([^"]+)", type number\}', text):
        assert column in ("v0 [m/s]", "mu_macro [-]")


def test_libreoffice_calc(repository: Path, live_server: Any, surrogate: Surrogate, tmp_path: Path) -> None:
    """The formulas and the linked table of spreadsheet.md, entered into a sheet, and the values of its cells."""
    need("soffice")
    text = (repository / "examples" / "spreadsheet.md").read_text("utf-8")
    text = text.replace("http://127.0.0.1:8000", live_server.url)
    formulas = re.findall(r"^ {4}(=.*WEBSERVICE.*)$", text, re.MULTILINE)
    (address,) = re.findall(r"^ {4}(http://\S+along=Fz\S+)$", text, re.MULTILINE)
    assert len(formulas) == 2
    cells = {"A1": "2e-6", "B1": formulas[0], "C1": formulas[1]}
    cells |= {f"{x}2": cells[f"{x}1"].replace("A1", "A2") for x in "BC"} | {"A2": "2e-5"}
    cells |= {"A3": "-1", "B3": formulas[0].replace("A1", "A3")}
    found = in_calc(cells, address, 5, tmp_path)
    for row, y0 in zip(found[:2], (2e-6, 2e-5), strict=True):
        answer = surrogate.evaluate(**{**CASE, "y0": y0})
        assert float(row[1]) == close(answer.mu_macro, rel=1e-14)
        assert row[2] == answer.regime
    assert found[2][:2] == ["-1", "#VALUE!"]
    header, *law = found[5:]
    assert header[:2] == ["Fz [N]", "mu_macro [-]"]
    assert len(law) == 50
    expected = surrogate.evaluate(**{**CASE, "Fz": np.array([float(row[0]) for row in law])}).mu_macro
    assert [float(row[1]) for row in law] == close(expected, rel=1e-14)


def in_calc(cells: Any, link: Any, below: Any, folder: Path) -> Any:
    """The sheet of LibreOffice Calc, as rows of text, with cells entered and a table linked below some rows."""
    profile, out = folder / "profile", folder / "shown.csv"

    def quoted(text: str) -> Any:
        return '"' + text.replace('"', '""') + '"'

    typed = "\n".join(f"s.getCellRangeByName({quoted(at)}).FormulaLocal = {quoted(text)}" for at, text in cells.items())
    macro = f"""Sub Main()
        Dim hidden(0) As New com.sun.star.beans.PropertyValue
        hidden(0).Name = "Hidden" : hidden(0).Value = True
        doc = StarDesktop.loadComponentFromURL("private:factory/scalc", "_blank", 0, hidden())
        s = doc.Sheets.getByIndex(0)
        {typed}
        Dim at As New com.sun.star.table.CellAddress
        at.Row = {below}
        csv = "Text - txt - csv (StarCalc)"
        doc.AreaLinks.insertAtPosition(at, {quoted(link)}, "CSV_all", csv, "44,34,UTF-8,1,,1033")
        Dim how(1) As New com.sun.star.beans.PropertyValue
        how(0).Name = "FilterName" : how(0).Value = csv
        how(1).Name = "FilterOptions" : how(1).Value = "44,34,UTF-8,1,,1033,false,false"
        doc.storeToURL({quoted(out.as_uri())}, how())
        doc.close(True)
        StarDesktop.terminate()
        End Sub"""
    module = (
        '<?xml version="1.0" encoding="UTF-8"?><s:module xmlns:s="http://openoffice.org/2000/script" s:name="Module1" '
        f's:language="StarBasic">{escape(macro)}</s:module>'
    )
    office = ["soffice", f"-env:UserInstallation={profile.as_uri()}", "--headless", "--norestore"]
    subprocess.run([*office, "--terminate_after_init"], capture_output=True, timeout=300, check=True)  # its presets
    (profile / "user" / "basic" / "Standard" / "Module1.xba").write_text(module, "utf-8")
    start = [*office, "macro:///Standard.Module1.Main()"]
    done = subprocess.run(start, capture_output=True, text=True, timeout=300, check=False)
    assert out.exists(), done.stdout + done.stderr
    with out.open(newline="", encoding="utf-8") as stream:
        return list(csv.reader(stream))


def test_octave(repository: Path, live_server: Any, surrogate: Surrogate) -> None:
    need("octave-cli")
    text = run(repository, "octave-cli", "--norc", "examples/octave.m", live_server.url)
    assert number(r"mu_macro = ([\d.]+), stick_slip", text) == close(surrogate.evaluate(**CASE).mu_macro, abs=1e-6)
    low, high = surrogate.evaluate(**{**CASE, "v0": np.array([1e-4, 10.0])}).mu_macro
    assert number(r"from ([\d.]+) at 0.0001 m/s", text) == close(low, abs=1e-6)
    assert number(r"to ([\d.]+) at 10 m/s", text) == close(high, abs=1e-6)
    assert 0.02 < number(r"steepest near ([\d.]+) m/s", text) < 0.04


def test_uncertainty(repository: Path, bridge: Any, surrogate: Surrogate) -> None:
    need(None, "umbridge", "scipy")
    text = run(repository, sys.executable, "examples/uncertainty.py", bridge)
    sampled = number(r"points: mean [\d.]+, standard deviation ([\d.]+)", text)
    first_order = number(r"first order: standard deviation ([\d.]+)", text)
    gradient = surrogate.evaluate(**CASE, gradient=True).gradient
    spreads = {"mu0": 1.03, "Fz": 1.02, "y0": 1.05}
    expected = sum((gradient[name] * CASE[name] * np.log(spread)) ** 2 for name, spread in spreads.items()) ** 0.5
    assert first_order == close(expected, abs=1e-5)
    assert sampled == close(first_order, rel=0.02)


def test_quasi_monte_carlo(repository: Path, bridge: Any, surrogate: Surrogate) -> None:
    need(None, "qmcpy", "umbridge")
    text = run(repository, sys.executable, "examples/quasi_monte_carlo.py", bridge)
    # the same inputs by plain sampling of the table itself
    mean = np.log10(list(CASE.values()))
    spread = np.log10([1.03, 1.02, 1.05, 1.05, 1.001, 1.02])
    drawn = 10.0 ** (mean + spread * np.random.default_rng(3).standard_normal((400_000, 6)))
    sampled = surrogate.evaluate(dict(zip(CASE, drawn.T, strict=True))).mu_macro
    assert number(r"mean of mu_macro ([\d.]+)", text) == close(sampled.mean(), abs=2e-5 + 1e-4)
    assert number(r"\nstandard deviation ([\d.]+)", text) == close(sampled.std(), rel=0.01)
    gradient = surrogate.evaluate(**CASE, gradient=True).gradient
    slopes = np.log(10.0) * np.array([gradient[name] * value for name, value in CASE.items()])
    expected = np.sqrt(np.sum((slopes * spread) ** 2))
    assert number(r"first order: standard deviation ([\d.]+)", text) == close(expected, abs=1e-5)


def test_least_power(repository: Path, tables_dir: Path) -> None:
    need(None, "openmdao", "scipy")
    table = tables_dir / "mumacro-1e-10.nc"
    text = run(repository, sys.executable, "examples/least_power.py", table)
    assert number(r"mu_macro = ([\d.]+)", text) == close(0.15, abs=1e-6)
    found = number(r"power ([\d.]+) mW", text)
    script = (
        "import sys; sys.path.insert(0, 'examples'); import least_power as example; from mumacro import Surrogate;"
        "from mumacro.inverse import solve_for; import numpy as np;"
        "s = Surrogate.open(sys.argv[1]); p = example.optimise(s);"
        "checked = p.check_partials(out_stream=None, method='fd', form='central', step=1e-6, step_calc='rel');"
        "print('WORST', max(np.max(np.abs(pair['J_fwd'] - pair['J_fd']) / (1e-300 + np.abs(pair['J_fd'])))"
        " for part in checked.values() for pair in part.values() if np.max(np.abs(pair['J_fd'])) > 0));"
        "case = {n: v for n, v in example.INPUTS.items() if n not in ('y0', 'omega')};"
        "total = lambda c: (p.set_val('omega', c['omega']), p.set_val('y0', c['y0']), p.run_model(),"
        " p.get_val('total')[0])[-1];"
        "amplitude = lambda w: solve_for(s, 'y0', example.TARGET, {**case, 'omega': w}).roots[0][0].value;"
        "grid = [total({'omega': w, 'y0': amplitude(w)}) for w in np.geomspace(1e3, 1e6, 400)];"
        "print('GRID', 1e3 * min(grid))"
    )
    text = run(repository, sys.executable, "-c", script, table)
    assert number(r"WORST ([\d.e-]+)", text) < 1e-4
    # the best of 400 frequencies, each with the amplitude that meets the target exactly
    assert found == close(number(r"GRID ([\d.e-]+)", text), rel=1e-4)
