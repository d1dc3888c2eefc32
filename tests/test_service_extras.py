"""Gradient, deviations, power, stick fraction and settling: their values in every format, and refusals."""

import json
import math

import pytest

from comparing import close
from mumacro.settling import settling

PATH = "/v1/mu-macro"
STD = {"mu0": 0.01, "Fz": 0.5, "k": 5e4, "y0": 1e-7, "omega": 1e3, "v0": 1e-3}


def ask(client, case, **options):
    response = client.post(PATH, json={**case, **options})
    assert response.status_code == 200, response.text
    return response.json()


@pytest.mark.parametrize("v0", [1e-4, 0.01, 0.3, 5.0])
def test_the_gradient_is_the_slope_of_the_answer(client, case, v0):
    at = {**case, "v0": v0}
    gradient = ask(client, at, include=["gradient"])["gradient"]
    for name, value in at.items():
        step = 1e-5 * value
        above, below = (ask(client, {**at, name: value + s})["mu_macro"] for s in (step, -step))
        assert gradient[name] == close((above - below) / (2 * step), rel=1e-5, abs=1e-7 / value)


def test_the_standard_deviation_is_the_root_of_squares(client, case):
    answer = ask(client, case, include=["gradient", "std"], std=STD)
    expected = math.sqrt(sum((answer["gradient"][name] * STD[name]) ** 2 for name in STD))
    assert answer["std"] == close(expected, rel=1e-12)
    only = ask(client, case, include=["std"], std={"mu0": 0.01})
    assert "gradient" not in only
    assert only["std"] == close(0.01 * abs(answer["gradient"]["mu0"]), rel=1e-12)
    assert ask(client, case, include=["std"], std={})["std"] == 0.0


def test_all_forms_give_the_same(client, case):
    options = {"include": ["gradient", "std"], "std": STD}
    single = ask(client, case, **options)
    query = {**case, "include": "gradient,std", **{f"std_{name}": value for name, value in STD.items()}}
    assert client.get(PATH, params=query).json() == single
    columns = client.post(f"{PATH}/batch", json={**case, "v0": [case["v0"], -1], **options}).json()
    assert columns["std"] == [close(single["std"], rel=1e-12), None]
    for name, slope in single["gradient"].items():
        assert columns["gradient"][name] == [close(slope, rel=1e-12), None]
    asked = {name: value for name, value in query.items() if name not in case}
    (row,) = client.post(f"{PATH}/batch", params=asked, json=[case]).json()["results"]
    assert row["std"] == close(single["std"], rel=1e-12)


def test_rigid_contact_has_no_slope_in_k(client, case):
    rigid = {**case, "k": None}
    answer = ask(client, rigid, include=["gradient", "std"], std=STD)
    assert answer["gradient"]["k"] is None
    expected = math.sqrt(sum((answer["gradient"][name] * STD[name]) ** 2 for name in STD if name != "k"))
    assert answer["std"] == close(expected, rel=1e-12)
    both = client.post(f"{PATH}/batch", json={**case, "k": [None, 1e6], "include": ["gradient"]}).json()
    assert [slope is None for slope in both["gradient"]["k"]] == [True, False]


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        ({"include": ["std"]}, "#/std"),
        ({"std": STD}, "#/std"),
        ({"include": ["groups"], "std": {}}, "#/std"),
        ({"include": ["std"], "std": {"mu0": -1}}, "#/std/mu0"),
        ({"include": ["std"], "std": {"mu0": "0.1"}}, "#/std/mu0"),
        ({"include": ["std"], "std": {"speed": 1}}, "#/std/speed"),
        ({"include": ["std"], "std": [1, 2]}, "#/std"),
    ],
)
def test_standard_deviations_are_given_if_and_only_if_std_is_included(client, case, problem, options, pointer):
    (fault,) = problem(client.post(PATH, json={**case, **options}), 422)["errors"]
    assert fault["pointer"] == pointer
    problem(client.post(f"{PATH}/batch", json={**case, "v0": [0.1, 0.2], **options}), 422)


@pytest.mark.parametrize(
    ("query", "parameter"),
    [({"include": "std"}, "std_mu0"), ({"std_v0": 1}, "std_mu0"), ({"include": "std", "std_v0": -1}, "std_v0")],
)
def test_a_query_is_held_to_the_same(client, case, problem, query, parameter):
    (fault,) = problem(client.get(PATH, params={**case, **query}), 422)["errors"]
    assert fault["parameter"] == parameter
    problem(client.post(f"{PATH}/batch", params=query, json=[case]), 422)


@pytest.mark.parametrize("v0", [0, 1e-4, 0.01, 0.3, 5.0])
@pytest.mark.parametrize("y0", [1e-7, 2e-6, 1e-4])
def test_power_and_stick_fraction_are_the_surrogates(client, case, surrogate, v0, y0):
    at = {**case, "v0": v0, "y0": y0}
    answer = ask(client, at, include=["groups", "power", "stick_fraction", "limits"])
    v, y, l0 = (answer["groups"][name] for name in ("v_tilde", "y_tilde", "l0"))
    unit = case["mu0"] * case["Fz"] * l0 * case["omega"]
    shaker = answer["power"]["oscillation"]
    assert shaker == close(surrogate.power(v, y) * unit, rel=1e-12)
    assert answer["power"]["saved"] == close((case["mu0"] - answer["mu_macro"]) * case["Fz"] * v0, rel=1e-12)
    assert answer["stick_fraction"] == close(surrogate.stick_fraction(v, y), rel=1e-12)
    assert (answer["stick_fraction"] > 0) == (v0 < answer["limits"]["v0_crit"])
    assert answer["stick_fraction_bound"] == close(surrogate.stick_fraction_with_bound(v, y)[1], rel=1e-9)
    bounds = answer["power_bound"]["oscillation"], answer["power_bound"]["saved"]
    assert bounds[0] == close(surrogate.power_with_bound(v, y)[1] * unit, rel=1e-9)
    assert bounds[1] == close(answer["error_bound"] * case["Fz"] * v0, rel=1e-2, abs=1e-14)
    assert all(0.0 <= bound < 1e-6 for bound in bounds)
    # the work of both drives is dissipated in slip, so neither exceeds the maximum friction power
    speed = v0 + y0 * case["omega"]
    assert 0 <= shaker + v0 * answer["mu_macro"] * case["Fz"] <= case["mu0"] * case["Fz"] * speed * (1 + 1e-9)


@pytest.mark.parametrize(("change", "power"), [({"y0": 0}, 0.0), ({"omega": 0}, 0.0), ({"k": None}, None)])
def test_without_oscillation_or_stiffness_nothing_sticks(client, case, change, power):
    answer = ask(client, {**case, **change}, include=["power", "stick_fraction"])
    assert (answer["power"]["oscillation"], answer["stick_fraction"]) == (power, 0.0)
    assert answer["power"]["saved"] == close((0.3 - answer["mu_macro"]) * case["Fz"] * case["v0"], abs=1e-300)
    assert (answer["power_bound"]["oscillation"], answer["stick_fraction_bound"]) == (power, 0.0)
    assert 0.0 <= answer["power_bound"]["saved"] <= 2.0 * answer["error_bound"] * case["Fz"] * case["v0"] + 1e-15


def test_an_amplitude_below_double_range_leaves_the_stick_fraction_open(client, case):
    answer = ask(client, {**case, "Fz": 1e300, "k": 1e-20, "y0": 1e-200}, include=["groups", "stick_fraction"])
    assert answer["groups"]["y_tilde"] == 0.0
    assert answer["stick_fraction_bound"] == 1.0


def test_bounds_come_only_with_their_quantity(client, case):
    assert not {"stick_fraction", "stick_fraction_bound", "power"} & ask(client, case).keys()
    assert {"stick_fraction", "stick_fraction_bound"} <= ask(client, case, include=["stick_fraction"]).keys()


def test_power_and_stick_fraction_come_in_batches(client, case):
    rows = [{**case, "v0": v0, "k": k} for v0 in (0, 1e-3, 0.1) for k in (1e6, "rigid")] + [17]
    query = {"include": "stick_fraction,power,gradient"}
    results = client.post(f"{PATH}/batch", params=query, json=rows).json()["results"]
    for row, result in zip(rows[:-1], results, strict=False):
        single = ask(client, row, include=["stick_fraction", "power"])
        assert result["stick_fraction"] == close(single["stick_fraction"], rel=1e-12)
        assert result["stick_fraction_bound"] == close(single["stick_fraction_bound"], rel=1e-12)
        for part in ("power", "power_bound"):
            for name, power in single[part].items():
                assert result[part][name] == (None if power is None else close(power, rel=1e-12))
    assert results[-1] is None


def test_bounds_of_power_and_stick_fraction_come_as_columns_lines_and_arrow(client, case):
    v0 = [1e-3, 0.01, 0.3]
    query = {"include": "stick_fraction,power"}
    rows = client.post(f"{PATH}/batch", params=query, json=[{**case, "v0": v} for v in v0]).json()["results"]
    columns = client.post(f"{PATH}/batch", params=query, json={**case, "v0": v0}).json()
    text = "".join(json.dumps({**case, "v0": v}) + "\n" for v in v0)
    headers = {"content-type": "application/x-ndjson"}
    lines = client.post(f"{PATH}/batch", params=query, content=text, headers=headers).text.splitlines()
    assert columns["stick_fraction_bound"] == [row["stick_fraction_bound"] for row in rows]
    assert columns["power"].keys() == rows[0]["power"].keys()
    for row, line in zip(rows, map(json.loads, lines), strict=True):
        assert line["stick_fraction_bound"] == row["stick_fraction_bound"] > 0.0 or row["stick_fraction"] == 0.0
        assert (line["power"], line["power_bound"]) == (row["power"], row["power_bound"])
    pa = pytest.importorskip("pyarrow")
    given = pa.record_batch({name: v0 if name == "v0" else [value] * len(v0) for name, value in case.items()})
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, given.schema) as writer:
        writer.write_batch(given)
    headers = {"content-type": "application/vnd.apache.arrow.stream"}
    answer = client.post(f"{PATH}/batch", params=query, content=sink.getvalue().to_pybytes(), headers=headers)
    found = pa.ipc.open_stream(answer.content).read_all().to_pydict()
    assert found["stick_fraction_bound"] == columns["stick_fraction_bound"]
    for part in ("power", "power_bound"):
        assert {key: found[f"{part}.{key}"] for key in columns[part]} == columns[part]


@pytest.mark.parametrize("v0", [1e-4, 0.01, 5.0])
@pytest.mark.parametrize("y0", [1e-7, 2e-6, 1e-4])
def test_settling_is_the_librarys(client, case, surrogate, v0, y0):
    at = {**case, "v0": v0, "y0": y0}
    answer, expected = ask(client, at, include=["settling"]), settling(surrogate, **at)
    found = answer["settling"]
    assert list(found.values()) == [expected.periods, expected.periods_any, expected.time, expected.slip_path]
    assert answer["settling_bound"] == {"periods": expected.error_bound}
    assert 0.0 < expected.error_bound < 1e-3 * found["periods"]
    batch = {**at, "v0": [v0, 0.3], "include": ["settling"]}
    columns = client.post(f"{PATH}/batch", json=batch).json()["settling"]
    assert {name: column[0] for name, column in columns.items()} == close(found, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "periods", "time"),
    [
        ({"k": None}, 0.0, 0.0),  # rigid: at once
        ({"v0": 0}, None, None),  # nothing slips: never
        ({"omega": 0}, 0.0, 3e-6 * math.log(100.0) / 0.01),  # dragged only: l0 ln(100) / v0
    ],
)
def test_settling_at_once_never_and_without_oscillation(client, case, change, periods, time):
    found = ask(client, {**case, **change}, include=["settling"])["settling"]
    assert found["periods"] == periods
    assert found["time"] == (time if time is None else close(time, rel=1e-14))
