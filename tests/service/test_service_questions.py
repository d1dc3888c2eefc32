"""Solve-for, law (JSON and CSV), stiffness and fit over HTTP: values and formats."""

import csv
import io
import json
import math
from base64 import b64encode
from gzip import compress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mumacro
from mumacro import Surrogate
from mumacro.outputs import MEMBERS, OUTPUTS
from mumacro.stiffness import contact_of
from tests.support.cases import Case
from tests.support.comparing import close
from tests.support.serving import CASE

SOLVE = {
    "unknown": "y0",
    "target": 0.15,
    **{name: value for name, value in CASE.items() if name != "y0"},
}
LAW = {
    "start": 1e-4,
    "stop": 10.0,
    "points": 33,
    **{name: value for name, value in CASE.items() if name != "v0"},
}


def answered(client: Any, path: Any, question: Any, **changed: Any) -> Any:
    question = {name: value for name, value in {**question, **changed}.items() if value is not ...}
    response = client.post(f"/v1/{path}", json=question)
    assert response.status_code == 200, response.text
    return json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


def test_a_frequency_is_solved_for_by_a_ratio_with_what_is_included(client: Any) -> None:
    ratio = {
        **SOLVE,
        "unknown": "f",
        "y0": 2e-6,
        "omega": ...,
        "target": 0.8,
        "quantity": "mu_ratio",
    }
    answer = answered(client, "solve-for", ratio, include=["power"])
    assert (answer["unit"], answer["quantity"]) == ("Hz", "mu_ratio")
    (root,) = answer["results"][0]["roots"]
    there = answered(client, "mu-macro", CASE, omega=..., f=root["value"], include=["power"])
    assert there["mu_ratio"] == close(0.8, rel=1e-14)
    assert root["power"] == close(there["power"], rel=1e-13)
    assert root["low"] < root["value"] < root["high"]


def test_targets_keep_their_order_and_unreachable_ones_have_a_reason(client: Any) -> None:
    targets = [0.25, 0.1, 0.29, 0.4]
    answer = answered(
        client, "solve-for", SOLVE, unknown="v0", target=targets, y0=CASE["y0"], v0=None
    )
    assert [result["target"] for result in answer["results"]] == targets
    assert [len(result["roots"]) for result in answer["results"]] == [1, 0, 1, 0]
    reach = answer["reachable"]
    assert reach["min"] == close(0.3 * math.sqrt(5) / 3, rel=1e-9)
    assert (reach["max"], reach["min_included"], reach["max_included"]) == (0.3, True, False)
    assert [result.get("reason", "")[:14] for result in answer["results"]] == [
        "",
        "mu_macro = 0.1",
        "",
        "mu_macro = 0.4",
    ]
    of_ratio = answered(
        client,
        "solve-for",
        SOLVE,
        unknown="v0",
        quantity="mu_ratio",
        target=[0.5],
        y0=CASE["y0"],
        v0=None,
    )
    assert of_ratio["results"][0]["reason"].startswith("mu_ratio = 0.5: mu_macro = 0.15 is out")
    assert of_ratio["reachable"]["max"] == 1.0
    (result,) = answered(client, "solve-for", SOLVE, unknown="v0", y0=0.0, v0=None)["results"]
    assert result["roots"] == []
    assert "no influence" in result["reason"]


def test_a_target_as_a_ratio_is_that_of_its_friction_also_at_the_ends_of_k(client: Any) -> None:
    case = {
        **SOLVE,
        "unknown": "v0",
        "y0": 2e-6,
        "v0": ...,
        "k": ...,
        "k_low": 8e5,
        "k_high": 1.25e6,
    }
    friction = answered(client, "solve-for", case, target=[0.24])
    ratio = answered(client, "solve-for", case, target=[0.8], quantity="mu_ratio")
    assert len(ratio["ends"]) == 2
    for mine, other in zip((ratio, *ratio["ends"]), (friction, *friction["ends"]), strict=True):
        (one,), (expected,) = mine["results"], other["results"]
        assert (one["target"], expected["target"]) == (0.8, 0.24)
        assert [root["value"] for root in one["roots"]] == close(
            [root["value"] for root in expected["roots"]], rel=1e-12
        )
        for end in ("min", "max"):
            assert mine["reachable"][end] == close(other["reachable"][end] / 0.3, rel=1e-12)


@pytest.mark.parametrize(
    "case",
    [
        {"target": [0.15, 0.4]},
        {"k": ..., "k_low": 8e5, "k_high": 1.25e6},
        {"contact": "ball", "target": [0.25]},
        {"unknown": "k", "y0": 2e-6, "v0": 1e-4, "target": 0.3 * 0.0023, "k": ...},  # three roots
        {"unknown": "Fz", "y0": 2e-6, "target": 0.2, "contact": "ball"},
        {"unknown": "v0", "v0": ..., "y0": 0.0},
        {"unknown": "Fz", "y0": 2e-6, "target": 0.25, "stiffness_exponent": 0.5},
    ],
)
def test_a_solution_is_the_librarys(client: Any, surrogate: Surrogate, case: Any) -> None:
    question = {name: x for name, x in {**SOLVE, **case}.items() if x is not ...}
    answer = answered(client, "solve-for", question)
    unknown, target = question.pop("unknown"), question.pop("target")
    own = mumacro.solve_for(surrogate, unknown, target, **question).to_dict()
    interval = [question[name] for name in ("k_low", "k_high") if name in question]
    for k, end in zip(interval, own.get("ends", ()), strict=True):
        end["k"] = k
    beside = {"quantity", "table", "api_version", *({"model"} if unknown == "Fz" else ())}
    assert answer.keys() == {*own, *beside}
    assert {name: answer[name] for name in own} == own


@pytest.mark.parametrize(
    "case",
    [
        {},
        {"f": 2e4, "omega": ...},
        {"along": "Fz", "v0": 0.01, "start": 1.0, "stop": 20.0, "contact": "ball"},
        {"along": "f", "v0": 0.01, "start": 1.0, "stop": 1e5, "omega": ..., "scale": "linear"},
        {"points": 33.0},  # an integer may be written so
        {"along": "Fz", "v0": 0.01, "start": 1.0, "stop": 100.0, "stiffness_exponent": 0.5},
        {"k": "0.8..1.2 N/um"},
        {"k": "1 ± 0.1 N/um", "mu0": "0.3 ± 0.02"},
    ],
)
def test_a_law_is_the_librarys(client: Any, surrogate: Surrogate, case: Any) -> None:
    question = {name: x for name, x in {**LAW, **case}.items() if x is not ...}
    answer = answered(client, "law", question)
    question["points"] = 33
    own = mumacro.law(surrogate, question.pop("along", "v0"), **question).to_dict()
    assert {*own} <= answer.keys()
    for name, column in own.items():
        assert answer[name] == (close(column, rel=1e-14) if name == "mu_macro" else column)


@pytest.mark.parametrize("k", [1e6, "rigid"])  # a rigid contact has no power of the shaker
def test_the_table_for_spreadsheets_is_the_law(client: Any, k: Any) -> None:
    law = answered(client, "law", LAW, k=k, y0=1e-5, include=["gradient"])
    assert (None in law["gradient"]["k"]) is (k == "rigid")
    response = client.get("/v1/law.csv", params={**LAW, "k": k, "y0": 1e-5, "include": "gradient"})
    assert response.headers["content-type"].startswith("text/csv")
    assert 'filename="friction-law-v0.csv"' in response.headers["content-disposition"]
    columns = {
        "v0 [m/s]": law["values"],
        **{f"{name} [-]": law[name] for name in ("mu_macro", "mu_ratio", "error_bound")},
        **{
            f"{name}.{part} [{MEMBERS[f'{name}.{part}'].unit}]": law[name][part]
            for name in ("gradient", "gradient_bound")
            for part in law[name]
        },
        "mu_static [-]": law["mu_static"],
        "regime": law["regime"],
        "source": law["source"],
    }
    header, *rows = csv.reader(io.StringIO(response.text))
    assert header == list(columns)
    for name, cells in zip(header, zip(*rows, strict=True), strict=True):
        assert cells == tuple(
            "" if x is None else x if isinstance(x, str) else repr(x) for x in columns[name]
        )
    assert response.text.count("\r\n") == 34


def test_a_table_for_spreadsheets_has_a_unit_in_every_head_of_numbers(client: Any) -> None:
    for direction, amplitude in (("across", "y0"), ("normal", "Fz_amplitude")):
        names = ",".join(name for name, one in OUTPUTS.items() if direction not in one.lacks)
        rest = {name: x for name, x in LAW.items() if name != "y0"} | {amplitude: 1e-6}
        query = {**rest, "direction": direction, "std_mu0": 0.01, "include": names}
        header, *_ = csv.reader(io.StringIO(client.get("/v1/law.csv", params=query).text))
        assert [name for name in header if not name.endswith("]")] == ["regime", "source"]
    head = client.head("/v1/law.csv", params=LAW)
    assert (head.status_code, head.content) == (200, b"")


STEEL = {"E": 210e9, "nu": 0.3, "Fz": 10.0}
BODIES = [
    ("ball", {"radius": 5e-3}),
    ("flat", {"radius": 1e-3}),
    ("ball", {"radius": 5e-3, "E2": "rigid"}),
    ("ball", {"radius": 5e-3, "E": 1e6}),  # so soft that a warning comes with it
    ("cylinder", {"radius": 5e-3, "length": 1e-2, "oscillation": "along"}),
]


@pytest.mark.parametrize(("geometry", "arguments"), BODIES)
def test_a_stiffness_is_the_librarys(client: Any, geometry: Any, arguments: Any) -> None:
    own = contact_of(
        geometry,
        **STEEL | {name: np.inf if x == "rigid" else x for name, x in arguments.items()},
    )
    answer = answered(client, "stiffness", {"geometry": geometry, **STEEL, **arguments})
    assert answer == {"geometry": geometry, **own.to_dict(), "api_version": "1"}
    assert bool(answer["warnings"]) == ("E" in arguments)


def test_a_fit_is_the_librarys(client: Any, surrogate: Surrogate) -> None:
    v0 = np.geomspace(1e-3, 1.0, 20)
    mu = surrogate.evaluate({**CASE, "v0": v0}, contact="ball").mu_macro + 1e-3 * np.cos(
        17.0 * np.arange(20)
    )
    rig: Case = {"Fz": 10.0, "y0": 2e-6, "omega": 1.3e5}
    own = mumacro.fit({"v0": v0, "mu_macro": mu}, contact="ball", surrogate=surrogate, **rig)
    body = {"v0": v0.tolist(), "mu_macro": mu.tolist(), **rig, "contact": "ball"}
    answer = answered(client, "fit", body)
    assert (answer["values"], answer["std"], answer["chi2"]) == (
        own.values,
        own.std,
        own.chi2,
    )
    assert {**own.to_dict(), "table": answer["table"], "api_version": "1"} == answer
    curve = answer["curve"]
    assert (curve["v0"][0], curve["v0"][-1]) == (v0[0], v0[-1])
    assert all(
        low < mid < high
        for low, mid, high in zip(curve["low"], curve["mu_macro"], curve["high"], strict=True)
    )
    assert answered(client, "fit", body, unknowns=["k"], mu0=0.3, std=1e-3)["values"].keys() == {
        "k"
    }
    assert answered(client, "fit", body, Fz=[10.0] * 19 + [11.0])["curve"] is None


RIG = {"Fz": 10.0, "y0": 0.4e-6, "f": 20e3}
FITTED = {  # tests/data/rigs, each with the case that its points lack
    "amplifier.asc": RIG,
    "excel_de.csv": RIG,
    "labview.lvm": RIG,
    "preamble.csv": {"y0": 0.4e-6, "f": 20e3},
    "rheometer_utf16.csv": RIG,
    "windows_1252.csv": RIG,
}


@pytest.mark.parametrize("name", FITTED)
def test_the_file_of_a_rig_is_fitted(client: Any, repository: Path, name: str) -> None:
    data = (repository / "tests" / "data" / "rigs" / name).read_bytes()
    body = {**FITTED[name], "points_base64": b64encode(data).decode()}
    answer = answered(client, "fit", body)
    assert answer["values"]["k"] == close(8899923.56587856, rel=1e-6)
    assert answer["points"]["v0"] == close(
        [1e-3 * x for x in (1, 2, 5, 10, 20, 50, 100, 200)], rel=1e-12
    )
    assert answer["read_as"]


def test_pasted_points_are_read_without_a_fit(client: Any) -> None:
    pasted = "Rig 7\n\nv0\tmu_macro\tnote\nmm/s\t%\n1,5\t7\ta\n# no\n2,5\t9\tb\n".replace(
        "%\n", "%\t\n"
    )
    answer = answered(client, "fit", {"points": pasted, "read_only": True})
    assert answer["columns"] == {"v0": [1.5, 2.5], "mu_macro": [7.0, 9.0]}
    assert answer["units"] == {"v0": "mm/s", "mu_macro": "%"}
    assert (answer["lines"], answer["skipped_lines"]) == ([5, 7], [1, 6])
    assert answer["read_as"].startswith(
        "tab, decimal comma, header in line 3, units in line 4; v0 ["
    )
    fitted = answered(
        client, "fit", {**RIG, "points": "v0 [mm/s];mu0;mu_macro\n1;0,31;0,069\n5;0,31;0,174\n"}
    )
    assert [*fitted["values"]] == ["k"]  # mu0 is one of its columns


@pytest.mark.parametrize(
    ("body", "pointer", "parts"),
    [
        ({"points": "v0 [um/s]\tmu_macro [%]\n1.000\t7\n"}, "#/points", ("line 2", "1 or 1000")),
        ({"points": "v0,mu_macro\nx,1\n1,y\n"}, "#/points", ("line 2", "v0")),
        ({"points": "v0,mu_macro\n1,0.2\n2,-3\n"}, "#/points", ("line 3", "mu_macro")),
        ({"points": ""}, "#/points", ("line 1",)),
        ({"points": "v0,mu_macro\n" + "1,0.2\n" * 1001}, "#/points", ("line 1002", "1,000")),
        ({"points_base64": "no base64!"}, "#/points_base64", ("base64",)),
        ({"points_base64": b64encode(b"PK\x03\x04").decode()}, "#/points_base64", ("as CSV",)),
        ({"points_base64": b64encode(compress(b"v0")).decode()}, "#/points_base64", ("unpack it",)),
        ({"points_base64": b64encode(b"\0" * 99).decode()}, "#/points_base64", ("zero byte",)),
        ({"points": "a", "points_base64": "YQ=="}, "#/points_base64", ("points",)),
        ({"points": "v0,mu_macro\n1,0.2\n", "v0": [1.0]}, "#/v0", ("given once",)),
        ({"points": "v0,mu_macro\n1,0.2\n", "encoding": "utf-16"}, "#/encoding", ("points",)),
        ({"points_base64": "YQ==", "encoding": "idna"}, "#/points_base64", ("encoding",)),
        ({"v0": [1.0], "mu_macro": [0.2], "decimal": ","}, "#/decimal", ("points",)),
        ({"v0": [1.0]}, "#/mu_macro", ("given",)),
        ({"points": "v0,mu_macro\n1,0.2\n", "sep": "x"}, "#/sep", ()),
        ({"points": "v0,mu_macro\n1,0.2\n", "skip": -1}, "#/skip", ()),
    ],
)
def test_points_that_cannot_be_read_are_told_by_line(
    client: Any, body: Any, pointer: str, parts: tuple[str, ...]
) -> None:
    response = client.post("/v1/fit", json={**RIG, **body})
    assert response.status_code == 422, response.text
    fault = response.json()["errors"][0]
    assert fault["pointer"] == pointer
    assert all(part in fault["reason"] for part in parts), fault
    assert "--" not in fault["reason"]  # no options of a command


def test_a_table_is_limited_before_it_is_taken_apart(client: Any) -> None:
    wide, cell = [f"x{i}" for i in range(199)], "x" * 201
    for table, reason in (
        (["v0", "mu_macro", *wide], "line 1: there may be up to 200 columns"),
        (["v0", "mu_macro", "[ " * 201], "line 1: there may be up to 200 columns"),
        (["v0", "mu_macro", cell], "line 1: a cell may have up to 200 characters"),
        (["v0", f"mu_macro\n1,0.2\n2,{cell}"], "line 3: a cell may have up to 200 characters"),
    ):
        response = client.post("/v1/fit", json={**RIG, "points": ",".join(table)})
        assert response.status_code == 422
        assert response.json()["errors"][0]["reason"] == reason
    rows = f"{','.join(['v0', 'mu_macro', *wide[1:]])}\n0.01,0.2{',' * 198}\n"
    assert len(answered(client, "fit", {"points": rows, "read_only": True})["lines"]) == 1
    most = {"points": "x" * 2**16}
    for path in ("fit", "law", "motion", "solve-for", "stiffness", "mu-macro"):
        assert client.post(f"/v1/{path}", json=most).status_code == 413


def test_stiff_points_fit_a_rigid_contact_in_words(client: Any, surrogate: Surrogate) -> None:
    v0 = np.geomspace(0.05, 2.0, 12)
    mu = surrogate.evaluate({**CASE, "k": np.inf, "v0": v0}).mu_macro
    body = {"v0": v0.tolist(), "mu_macro": mu.tolist(), "Fz": 10.0, "y0": 2e-6, "omega": 1.3e5}
    answer = answered(client, "fit", body)
    assert answer["interval"]["k"][1] == "rigid"
    assert answer["warnings"]
