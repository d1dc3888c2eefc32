"""A client that openapi-python-client makes from ``/openapi.json`` is typed and gives the library's answers."""

import json
import os
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest

from comparing import close

pytestmark = pytest.mark.slow

pytest.importorskip("openapi_python_client")

PROGRAM = '''
"""Ask every operation with a JSON body, as a user of the generated client does."""

import json
import sys

from mumacro_client import Client
from mumacro_client.api.answers import (
    get_mu_macro, post_law, post_mu_macro, post_mu_macro_batch, post_solve_for,
)
from mumacro_client.models import (
    Case, CaseAnswer, CaseColumns, CaseRequest, CaseRequestIncludeType0Item, ColumnsAnswer, LawAnswer, LawRequest,
    Power, Problem, RowsAnswer, SolveForAnswer, SolveForRequest, SolveForRequestUnknown,
)

client = Client(base_url=sys.argv[1])
found: dict[str, object] = {}

one = post_mu_macro.sync(client=client, body=CaseRequest(
    mu0=0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01, include=[CaseRequestIncludeType0Item.POWER]))
assert isinstance(one, CaseAnswer) and isinstance(one.power, Power)
mu: float = one.mu_macro
found.update(post=mu, saved=one.power.saved, regime=one.regime.value)

rigid = get_mu_macro.sync(client=client, mu0=0.3, fz=10.0, k="rigid", y0=2e-6, omega=1.3e5, v0=0.01)
assert isinstance(rigid, CaseAnswer)
found.update(get=rigid.mu_macro)

refused = post_mu_macro.sync(client=client, body=CaseRequest(mu0=-0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01))
assert isinstance(refused, Problem) and refused.errors
found.update(refused=refused.errors[0].field)

columns = post_mu_macro_batch.sync(
    client=client, body=CaseColumns(mu0=0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=[0.0, 0.01]))
assert isinstance(columns, ColumnsAnswer)
found.update(columns=columns.mu_macro)

rows = post_mu_macro_batch.sync(
    client=client, body=[Case(mu0=0.3, fz=10.0, k="rigid", y0=2e-6, omega=1.3e5, v0=0.01)])
assert isinstance(rows, RowsAnswer) and rows.results[0] is not None
found.update(rows=rows.results[0].mu_macro)

law = post_law.sync(client=client, body=LawRequest(
    start=1e-3, stop=1.0, points=7, mu0=0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5))
assert isinstance(law, LawAnswer)
found.update(law=law.mu_macro)

solved = post_solve_for.sync(client=client, body=SolveForRequest(
    unknown=SolveForRequestUnknown.V0, target=mu, mu0=0.3, fz=10.0, k=1e6, y0=2e-6, omega=1.3e5))
assert isinstance(solved, SolveForAnswer)
found.update(solved=solved.results[0].roots[0].value)
print(json.dumps(found))
'''


@pytest.fixture(scope="module")
def folder(live_server, tmp_path_factory):
    """A folder with the generated package and the program that uses it."""
    made = tmp_path_factory.mktemp("client")
    with urllib.request.urlopen(f"{live_server.url}/openapi.json", timeout=60) as reply:
        (made / "openapi.json").write_bytes(reply.read())
    (made / "config.yaml").write_text("content_type_overrides:\n  application/x-netcdf: application/octet-stream\n")
    command = [sys.executable, "-m", "openapi_python_client", "generate", "--meta", "none", "--config", "config.yaml",
               "--path", "openapi.json", "--output-path", "mumacro_client"]  # fmt: skip
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        command, cwd=made, env=environment, capture_output=True, text=True, timeout=300, check=False
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (made / "program.py").write_text(PROGRAM)
    return made


def test_it_is_typed(folder):
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports", "silent", "--cache-dir", "cache",
               "program.py"]  # fmt: skip
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_its_answers_are_those_of_the_library(folder, live_server, surrogate):
    command = [sys.executable, "program.py", live_server.url]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(done.stdout)
    case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
    elastic, rigid = surrogate.evaluate(**case, v0=0.01), surrogate.evaluate(**{**case, "k": None}, v0=0.01)
    rest = surrogate.evaluate(**case, v0=0.0)
    assert found["post"] == elastic.mu_macro
    assert found["saved"] == (0.3 - elastic.mu_macro) * 10.0 * 0.01
    assert found["regime"] == elastic.regime
    assert found["get"] == found["rows"] == rigid.mu_macro
    assert found["columns"] == [rest.mu_macro, elastic.mu_macro]
    assert found["refused"] == "mu0"
    assert found["law"] == surrogate.evaluate(**case, v0=np.geomspace(1e-3, 1.0, 7)).mu_macro.tolist()
    assert found["solved"] == close(0.01, rel=1e-9)
