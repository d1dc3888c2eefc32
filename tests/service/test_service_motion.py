"""Any periodic motion over HTTP: the library's answer, and what is refused at its place."""

import json
import math
import re
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

import mumacro
from service.models.motion import LEAST_OF_A_BALL, MAX_TERMS, MOST_OF_A_BALL
from tests.support.cases import Case
from tests.support.serving import asking

PATH = "/v1/motion"
RIG: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.01}
NUMBERS = (
    "mu_macro",
    "mu_lateral",
    "stick_fraction",
    "slip_path",
    "power",
    "power_drive",
    "error_estimate",
    "periods",
)
SCENES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "across": ({"y": 2e-6}, {"y": 2e-6}),
    "ellipse": ({"x": [1e-6, 90], "y": 2e-6}, {"x": (1e-6, 90.0), "y": 2e-6}),
    "texts": ({"x": ["1um", "90 deg"], "y": "2 µm"}, {"x": (1e-6, 90.0), "y": 2e-6}),
    "harmonics": (
        {"y": [{"amplitude": 2e-6}, {"harmonic": 3.0, "amplitude": 4e-7, "phase": 450}]},
        {"y": [(1, 2e-6, 0.0), (3, 4e-7, 450.0)]},
    ),
    "load": (
        {"x": 2e-6, "normal": [3, 45], "tolerance": 1e-4},
        {"x": 2e-6, "normal": (3.0, 45.0), "tolerance": 1e-4},
    ),
    "ball": (
        {"x": [1e-6, 90], "y": 2e-6, "contact": "ball", "tolerance": 1e-4},
        {"x": (1e-6, 90.0), "y": 2e-6, "contact": "ball", "tolerance": 1e-4},
    ),
    "drag alone": ({"y": []}, {}),
}
WHOLE = "whole number"


@pytest.mark.parametrize("name", SCENES)
def test_the_answer_is_the_librarys(client: Any, name: str) -> None:
    sent, same = SCENES[name]
    answer = client.post(PATH, json={**RIG, **sent})
    assert answer.status_code == 200, answer.text
    own = mumacro.motion(**RIG, **same)
    expected = {name: getattr(own, name) for name in NUMBERS}
    expected |= {"contact": same.get("contact", "spring"), "api_version": "1"}
    if own.remarks:  # of the drag alone
        expected["remarks"] = own.remarks
    assert answer.json() == expected


def test_every_amplitude_of_a_motion_is_doubted(client: Any) -> None:
    answer = client.post(PATH, json={**RIG, "x": "1m"}).json()
    assert [(one["row"], one["field"]) for one in answer["remarks"]] == [("units", "x")]
    refused = client.post(PATH, json={**RIG, "x": [1e-6, 90, 2]})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"].startswith("#/x")


@pytest.mark.parametrize(
    "question",
    [
        {"unknown": "v0", "target": [0.0], "x": [1e-4, 0], "normal": [8.0, -90]},
        {"unknown": "v0", "target": [0.0], "x": [1e-4, 0], "normal": [8.0, 90]},
        {"unknown": "x.phase", "target": [0.0, 0.1], "v0": 0.005, "x": 1e-4, "normal": 8.0},
    ],
)
def test_a_solution_over_a_motion_is_the_librarys(client: Any, question: Any) -> None:
    rig: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e5, "f": 50.0}
    answer = client.post("/v1/solve-for", json={**rig, **question})
    assert answer.status_code == 200, answer.text
    arguments: Any = {
        name: tuple(x) if name in ("x", "normal") and isinstance(x, list) else x
        for name, x in question.items()
    }
    own = mumacro.solve_motion(**rig, **arguments).to_dict()
    assert answer.json() == {**own, "quantity": "mu_macro", "api_version": "1"}


def test_across_is_the_tables_case(client: Any) -> None:
    answer = client.post(PATH, json={**RIG, "y": 2e-6}).json()
    table = client.post("/v1/mu-macro", json={**RIG, "y0": 2e-6}).json()
    assert abs(answer["mu_macro"] - table["mu_macro"]) <= answer["error_estimate"] < 1e-6


def test_a_cycle_is_added_where_it_is_requested(client: Any) -> None:
    sent, same = SCENES["ellipse"]
    cycle = client.post(PATH, json={**RIG, **sent, "cycle": True}).json()["cycle"]
    expected = mumacro.motion(**RIG, **same).cycle()
    assert cycle == {name: column.tolist() for name, column in expected._asdict().items()}


def test_what_never_slips_has_no_period_of_decay(client: Any) -> None:
    answer = client.post(PATH, json={**RIG, "v0": 0.0, "y": 1e-9}).json()
    assert mumacro.motion(**{**RIG, "v0": 0.0}, y=1e-9).periods == math.inf
    assert answer["periods"] is None
    assert answer["mu_macro"] == 0.0


@pytest.mark.parametrize(
    ("sent", "pointer", "reason"),
    [
        ({"y": 2e-6, "k": None}, "#/k", "rigid"),
        ({"y": 2e-6, "k": ...}, "#/k", "required"),
        ({"y": 2e-6, "f": ...}, "#/omega", "Hz"),
        ({"y": 2e-6, "omega": 1.3e5}, "#/omega", "exactly one"),
        ({"y": 2e-6, "normal": 10}, "#/normal", "lifts off"),
        ({"y": "2 kN"}, "#/y", "metres"),
        ({"y": True}, "#/y", "number"),
        ({"y": [2e-6]}, "#/y/1", "required"),
        ({"y": [2e-6, "90 N"]}, "#/y/1", "degrees"),
        ({"y": [2e-6, 0, 1]}, "#/y", "2 entries"),
        ({"y": [{"amplitude": 2e-6, "harmonic": 1.5}]}, "#/y/0/harmonic", WHOLE),
        ({"y": [{"amplitude": 2e-6, "harmonic": True}]}, "#/y/0/harmonic", WHOLE),
        ({"y": [{"amplitude": 2e-6, "angle": 3}]}, "#/y/0/angle", "allowed: harmonic, amplitude"),
        ({"y": [{"amplitude": 2e-6}, {"phase": 3}]}, "#/y/1/amplitude", "required"),
        ({"y": [{"amplitude": 2e-6}, 3]}, "#/y/1", "object"),
        ({"y": [{"amplitude": 1e-9}] * (MAX_TERMS + 1)}, "#/y", f"{MAX_TERMS} entries"),
        ({"y0": 2e-6}, "#/y0", "allowed: .* y,"),
        ({"y": 2e-6, "tolerance": 1e-10}, "#/tolerance", "1e-09"),
        ({"y": 2e-6, "tolerance": LEAST_OF_A_BALL / 2, "contact": "ball"}, "#/tolerance", "ball"),
        (
            {"y": [{"amplitude": 1e-6, "harmonic": MOST_OF_A_BALL + 1}], "contact": "ball"},
            "#/y",
            "ball",
        ),
        ({"y": 1e9}, "#", "speed must be at most"),
        ({"y": 2e-6, "mu0": 1e-300, "Fz": 1e-300}, "#", "mu0 Fz / k must be a length"),
    ],
)
def test_a_fault_has_its_place(client: Any, sent: Any, pointer: str, reason: str) -> None:
    body = {name: value for name, value in {**RIG, **sent}.items() if value is not ...}
    answer = client.post(PATH, json=body)
    assert answer.status_code == 422, answer.text
    (fault,) = answer.json()["errors"]
    assert fault["pointer"] == pointer
    assert re.search(reason, fault["reason"])


def test_numbers_beyond_the_range_and_members_given_twice_have_their_place(client: Any) -> None:
    body = json.dumps({**RIG, "y": 2e-6})
    for text, pointer in (
        (body.replace("2e-06", "1e999"), "#/y"),
        (body.replace("2e-06", "[1e-6, NaN]"), "#/y/1"),
        (body.replace("1000000.0", "1e999"), "#/k"),
        (body.replace('"y"', '"v0": 0.01, "y"'), "#/v0"),
    ):
        answer = client.post(PATH, content=text, headers={"Content-Type": "application/json"})
        assert answer.status_code == 422, text
        assert [fault["pointer"] for fault in answer.json()["errors"]] == [pointer]
    assert client.get(PATH).status_code == 405


HARD = [{"harmonic": n, "amplitude": 2e-6, "phase": 70.0 * n} for n in range(11, 21)]


@pytest.mark.slow
def test_probes_are_answered_beside_many_hard_motions(live_server: Any) -> None:
    """Real ones, which compute without Python's lock: probes do not wait for their end."""
    body = json.dumps({**RIG, "contact": "ball", "tolerance": 1e-4, "x": HARD[:3], "y": HARD[:3]})
    probes_before_an_answer = list[int]()

    def motion() -> int:
        status, *_ = live_server.ask("POST", PATH, body)
        if status == 200:
            probes_before_an_answer.append(len(waits))
        return int(status)

    with ThreadPoolExecutor(8) as clients, asking(live_server, 0.002) as waits:
        statuses = {answer.result() for answer in [clients.submit(motion) for _ in range(24)]}
    assert {200} <= statuses <= {200, 503}  # those that wait long are refused
    # one that waits for the first motion to end is the only one before its answer
    assert probes_before_an_answer[0] > 10


def test_all_faults_are_reported_at_once(client: Any) -> None:
    answer = client.post(PATH, json={**RIG, "mu0": 0, "x": -1, "y": [{"phase": 1}]}).json()
    assert [fault["pointer"] for fault in answer["errors"]] == ["#/mu0", "#/x", "#/y/0/amplitude"]
