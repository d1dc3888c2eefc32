"""A client that openapi-python-client makes from ``/openapi.json`` is typed and gives the library's
answers."""

import importlib.util
import json
import sys
from pathlib import Path
from typing import Any

import pytest

from mumacro import Surrogate
from tests.support.cases import Case
from tests.support.comparing import close
from tests.support.compilers import run

pytestmark = [
    pytest.mark.peer,
    pytest.mark.skipif(
        importlib.util.find_spec("openapi_python_client") is None,
        reason="openapi-python-client of requirements/peers.txt is not installed",
    ),
]

PROGRAM = """
import json
import sys

from mumacro_client import Client
from mumacro_client.api.answers import (
    get_mu_macro, post_fit, post_mu_macro, post_mu_macro_batch, post_solve_for
)
from mumacro_client.models import (
    Case, CaseAnswer, CaseColumns, CaseRequest, CaseRequestIncludeItem, ColumnsAnswer, FitAnswer,
    FitRequest, Power, Problem, RowsAnswer, SolveForAnswer, SolveForRequest, SolveForRequestUnknown,
)

client = Client(base_url=sys.argv[1])
power = CaseRequestIncludeItem.POWER
one = post_mu_macro.sync(client=client, body=CaseRequest(
    mu0=0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01, include=[power]))
assert isinstance(one, CaseAnswer) and isinstance(one.power, Power)
mu: float = one.mu_macro
rigid = get_mu_macro.sync(
    client=client, mu0=0.3, fz=10.0, k="rigid", y0=2e-6, omega=1.3e5, v0=0.01)
assert isinstance(rigid, CaseAnswer)
refused = post_mu_macro.sync(client=client, body=CaseRequest(
    mu0=-0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01))
assert isinstance(refused, Problem) and refused.errors
columns = post_mu_macro_batch.sync(client=client, body=CaseColumns(
    mu0=0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=[0.0, 0.01]))
assert isinstance(columns, ColumnsAnswer)
rows = post_mu_macro_batch.sync(client=client, body=[
    Case(mu0=0.3, fz=10.0, k="rigid", y0=2e-6, omega=1.3e5, v0=0.01)])
assert isinstance(rows, RowsAnswer) and rows.results[0] is not None
solved = post_solve_for.sync(client=client, body=SolveForRequest(
    unknown=SolveForRequestUnknown.V0, target=mu, mu0=0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5))
assert isinstance(solved, SolveForAnswer)
fitted = post_fit.sync(client=client, body=FitRequest(  # docs/http.md
    v0=[0.001, 0.005, 0.02, 0.1], mu_macro=[0.069, 0.174, 0.247, 0.289], fz=10.0, y0=0.4e-6,
    f=20e3))
assert isinstance(fitted, FitAnswer)
assert isinstance(fitted.values.k, float) and fitted.values.k > 1e6
print(json.dumps([
    mu, one.power.saved, one.regime.value, rigid.mu_macro, refused.errors[0].field,
    columns.mu_macro, rows.results[0].mu_macro, solved.results[0].roots[0].value,
]))
"""


@pytest.fixture(scope="module")
def folder(live_server: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The client, and a program that uses it."""
    folder_of_client = tmp_path_factory.mktemp("client")
    (folder_of_client / "openapi.json").write_bytes(live_server.ask("GET", "/openapi.json")[2])
    (folder_of_client / "config.yaml").write_text(
        "content_type_overrides:\n  application/x-netcdf: application/octet-stream\n"
    )
    (folder_of_client / "program.py").write_text(PROGRAM)
    options = "--meta none --config config.yaml --path openapi.json --output-path mumacro_client"
    run(
        sys.executable,
        "-m",
        "openapi_python_client",
        "generate",
        *options.split(),
        cwd=folder_of_client,
    )
    return folder_of_client


def test_it_is_typed(folder: Path) -> None:
    options = "--strict --follow-imports silent --cache-dir cache program.py"
    run(sys.executable, "-m", "mypy", *options.split(), cwd=folder)


def test_its_answers_are_those_of_the_library(
    folder: Path, live_server: Any, surrogate: Surrogate
) -> None:
    case: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
    elastic = surrogate.evaluate(**case, v0=0.01)
    mu, regime = elastic.mu_macro, elastic.regime
    rigid = surrogate.evaluate(**{**case, "k": "rigid"}, v0=0.01).mu_macro
    rest = surrogate.evaluate(**case, v0=0.0).mu_macro
    *answers, v0 = json.loads(run(sys.executable, "program.py", live_server.url, cwd=folder))
    assert answers == [mu, (0.3 - mu) * 10.0 * 0.01, regime, rigid, "mu0", [rest, mu], rigid]
    assert v0 == close(0.01, rel=1e-9)
