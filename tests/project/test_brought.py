"""What people bring, as in ``tests/data/cases``: the right value, or a refusal that names what it
refuses."""

import ast
import http.client
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

import mumacro
from tests.support.comparing import close
from tests.support.places import ROOT

FOLDER = ROOT / "tests" / "data" / "cases"
BASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}
BROUGHT = json.loads((FOLDER / "cases.json").read_text("utf-8"))


_PEERS = {"astropy", "pint", "unyt", "uncertainties"}


def of(*ways: str) -> pytest.MarkDecorator:
    """The cases that are tried in one of these ways; those with values of other packages are marked
    peer."""
    cases = [
        pytest.param(
            case,
            id=case["id"],
            marks=pytest.mark.peer if _PEERS & {*case.get("needs", ())} else (),
        )
        for case in BROUGHT
        if case["how"] in ways
    ]
    return pytest.mark.parametrize("case", cases)


@of("python")
def test_a_value_in_python_is_understood_or_named(case: Any) -> None:
    for package in case["needs"]:
        reason = f"{package} of requirements/peers.txt is not installed"
        pytest.importorskip(package, reason=reason)
    tree = ast.parse(case["code"])
    last = ast.Expression(tree.body.pop().value)
    space: dict[str, Any] = {"mumacro": mumacro, "s": mumacro.open(), "case": dict(BASE)}
    exec(compile(tree, "case", "exec"), space)  # noqa: S102 - the code of our own cases
    if "refused" in case:
        with pytest.raises(mumacro.InputError) as refused:
            eval(compile(last, "case", "eval"), space)  # noqa: S307
        assert all(word in str(refused.value) for word in case["refused"])
        return
    got = eval(compile(last, "case", "eval"), space)  # noqa: S307
    np.testing.assert_allclose(np.ravel(got), np.ravel(case["value"]), rtol=1e-6)


@of("doubt", "no-doubt")
def test_a_doubtful_case_is_answered_with_a_remark(case: Any, tmp_path: Path) -> None:
    done = _run(case["argv"], tmp_path)
    remarks = json.loads(done.stdout).get("remarks", [])
    doubts = [remark for remark in remarks if remark["row"] == "units"]
    assert bool(doubts) == (case["how"] == "doubt")


@of("http")
def test_a_body_as_clients_send_it_is_answered(live_server: Any, case: Any) -> None:
    connection = http.client.HTTPConnection(urlsplit(live_server.url).netloc, timeout=30)
    headers = {"Content-Type": "application/json", **case.get("headers", {})}
    connection.request("POST", "/v1/mu-macro", case["body"].encode(), headers)
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    assert answer.status == 200
    assert json.loads(text)["mu_macro"] == close(case["value"], rel=1e-12)


def _run(words: list[str], where: Path) -> Any:
    for word in words:
        if (FOLDER / "files" / word).is_file():
            shutil.copy(FOLDER / "files" / word, where)
    return subprocess.run(
        [sys.executable, "-m", "mumacro", *words],
        cwd=where,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
