"""Balls, other directions and intervals of k over HTTP: every form gives the library's answer, bit for bit."""

import csv
import io
import json

import numpy as np
import pytest

PATH = "/v1/mu-macro"
BATCH = f"{PATH}/batch"
V0 = [0.0, 1e-3, 0.02, 0.26, 3.0]
RIG = {"mu0": 0.3, "Fz": 10.0, "omega": 1.3e5}
NORMAL = {"k": 1e6, "Fz_amplitude": 4.0}
ACROSS = {"k": 1e6, "y0": 2e-6}
INTERVAL = {"k_low": 0.8e6, "k_high": 1.3e6, "y0": 2e-6}
ASKED = {
    "spring": ({}, ACROSS),
    "ball": ({"contact": "ball"}, ACROSS),
    "rigid ball": ({"contact": "ball"}, {"k": "rigid", "y0": 2e-6}),
    "along": ({"direction": "along"}, ACROSS),
    "ball along": ({"contact": "ball", "direction": "along"}, ACROSS),
    "normal": ({"direction": "normal"}, NORMAL),
    "interval": ({}, INTERVAL),
    "interval of a ball": ({"contact": "ball"}, INTERVAL),
    "interval, normal": ({"direction": "normal"}, {"k_low": 0.8e6, "k_high": 1.3e6, "Fz_amplitude": 4.0}),
}
NUMBERS = ("mu_macro", "mu_ratio", "error_bound")
ENDS = ("mu_macro_low", "mu_macro_high")


@pytest.fixture(params=ASKED, ids=str)
def asked(request, surrogate):
    """The options, the inputs beside v0, and the library's answer over V0 by column."""
    options, inputs = ASKED[request.param]
    known = {**RIG, **{name: np.inf if value == "rigid" else value for name, value in inputs.items()}}
    found = surrogate.evaluate(**known, v0=np.array(V0), **options)
    names = (*NUMBERS, *(ENDS if "k_low" in inputs else ()))
    columns = {name: getattr(found, name).tolist() for name in names}
    return options, {**RIG, **inputs}, {**columns, "regime": list(found.regime), "source": list(found.source)}


def picked(answer, names):
    return {name: answer[name] for name in names}


def test_one_case(client, surrogate, asked):
    options, inputs, _ = asked
    v0 = V0[2]
    known = {name: np.inf if value == "rigid" else value for name, value in inputs.items()}
    one = surrogate.evaluate(**known, v0=v0, **options)
    body = {**inputs, "v0": v0, **options}
    query = {name: str(value) if isinstance(value, str) else repr(value) for name, value in body.items()}
    query = {name: value.strip("'") for name, value in query.items()}
    names = [*NUMBERS, "regime", "source"]
    if "k_low" in body:
        names += ENDS
        low, high = body.pop("k_low"), body.pop("k_high")
        body["k_range"] = [low, high]
        query["k"] = f"{query.pop('k_low')}..{query.pop('k_high')}"
    expected = {name: getattr(one, name) for name in names}
    answers = client.post(PATH, json=body).json(), client.get(PATH, params=query).json()
    for answer in answers:
        assert picked(answer, expected) == expected
        assert answer.keys() == {*expected, "table", "api_version"}
    text = client.get(f"{PATH}.txt", params=query).text
    assert float(text) == one.mu_macro


def test_json(client, asked):
    options, inputs, expected = asked
    columns = client.post(BATCH, json={**inputs, "v0": V0, **options}).json()
    assert picked(columns, expected) == expected
    rows = client.post(BATCH, json=[{**inputs, "v0": v0} for v0 in V0], params=options).json()["results"]
    assert {name: [row[name] for row in rows] for name in expected} == expected
    lines = [{**inputs, "v0": v0} for v0 in V0]
    answer = client.post(
        BATCH,
        content="\n".join(map(json.dumps, lines)),
        params=options,
        headers={"Content-Type": "application/x-ndjson"},
    )
    found = [json.loads(line) for line in answer.text.splitlines()]
    assert {name: [row[name] for row in found] for name in ("regime", "source")} == picked(
        expected, ("regime", "source")
    )
    assert [row["mu_macro"] for row in found] == expected["mu_macro"]


def test_csv(client, asked):
    options, inputs, expected = asked
    head = ["k_low [N/mm]" if name == "k_low" else name for name in (*inputs, "v0")]
    cells = [repr(value / 1e3) if name == "k_low" else str(value) for name, value in inputs.items()]
    text = "\n".join([",".join(head), *(",".join([*cells, repr(v0)]) for v0 in V0)])
    answer = client.post(BATCH, content=text, params=options, headers={"Content-Type": "text/csv"})
    assert answer.status_code == 200, answer.text
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    for name, column in expected.items():
        found = [row[name] for row in rows]
        assert (found if name in ("regime", "source") else list(map(float, found))) == column


def test_arrow(client, asked):
    pa = pytest.importorskip("pyarrow")
    options, inputs, expected = asked
    columns = {name: [np.inf if value == "rigid" else value] * len(V0) for name, value in inputs.items()}
    table = pa.table({**columns, "v0": V0})
    sink = io.BytesIO()
    with pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    kind = {"Content-Type": "application/vnd.apache.arrow.stream"}
    answer = client.post(BATCH, content=sink.getvalue(), params=options, headers=kind)
    assert answer.status_code == 200, answer.text
    found = pa.ipc.open_stream(answer.content).read_all()
    assert {name: found[name].to_pylist() for name in expected} == expected


def test_bad_rows_of_an_interval_spoil_only_themselves(client):
    given = {**RIG, "y0": 2e-6, "v0": 0.01, "k_low": [8e5, None, 2e6, 1e6], "k_high": [1e6, 1e6, 1e6, "rigid"]}
    answer = client.post(BATCH, json=given).json()
    assert [mu is None for mu in answer["mu_macro_low"]] == [False, True, True, True]
    assert [(fault["index"], fault["field"]) for fault in answer["errors"]] == [
        (1, "k_low"),
        (2, "k_low"),
        (3, "k_high"),
    ]


def test_lift_off_spoils_only_its_row(client):
    given = {**RIG, "k": 1e6, "v0": 0.01, "Fz_amplitude": [3.0, 10.0], "direction": "normal"}
    answer = client.post(BATCH, json=given).json()
    assert answer["mu_macro"][0] is not None
    (fault,) = answer["errors"]
    assert (fault["index"], fault["field"]) == (1, "Fz_amplitude")
    assert "lifts off" in fault["reason"]
    lines = "\n".join(json.dumps({**given, "Fz_amplitude": force}) for force in (10.0, 3.0))
    reply = client.post(BATCH, content=lines, headers={"Content-Type": "application/x-ndjson"})
    refused, good = map(json.loads, reply.text.splitlines())  # a bad line does not end the stream
    assert "lifts off" in refused["errors"][0]["reason"]
    assert good["mu_macro"] == answer["mu_macro"][0]


@pytest.mark.parametrize(
    ("changed", "field", "told"),
    [
        ({"contact": "cone"}, "contact", "spring, ball"),
        ({"direction": "up"}, "direction", "across, along, normal"),
        ({"contact": "ball", "direction": "normal"}, "direction", "contact radius"),
        ({"direction": "normal"}, "y0", "Fz_amplitude"),
        ({"direction": "normal", "y0": ..., "Fz_amplitude": 10.0}, "Fz_amplitude", "lifts off"),
        ({"Fz_amplitude": 1.0}, "Fz_amplitude", "amplitude is y0"),
        ({"k_range": [1e6, 2e6]}, "k", "interval"),
        ({"k": ..., "k_range": [2e6, 1e6]}, "k_range", "low <= high"),
        ({"k": ..., "k_range": [1e6]}, "k_range", "two stiffnesses"),
        ({"k": ..., "k_low": 1e6}, "k_high", "required"),
        ({"k": ..., "k_range": [1e6, "rigid"]}, "k_high", "number"),
        ({"y0": ..., "Fz_amplitude": 1.0, "direction": "normal", "include": ["power"]}, "include", "load"),
        ({"direction": "along", "include": ["settling"]}, "include", "across"),
        ({"k": ..., "k_range": [1e6, 2e6], "include": ["std"], "std": {"v0": 1e-3}}, "include", "one k"),
        ({"y0": ..., "Fz_amplitude": 1.0, "direction": "normal", "include": ["std"], "std": {"y0": 1e-6}}, "std", "y0"),
    ],
)
def test_what_does_not_belong_is_refused_by_name(client, problem, changed, field, told):
    case = {**RIG, **ACROSS, "v0": 0.01, **changed}
    document = problem(client.post(PATH, json={name: x for name, x in case.items() if x is not ...}), 422)
    assert any(fault["field"] == field and told in fault["reason"] for fault in document["errors"]), document


def test_included_quantities_are_the_librarys(client, surrogate):
    include = ["groups", "limits", "gradient", "stick_fraction", "std"]
    for options, inputs in ASKED.values():
        if "k_low" in inputs or inputs["k"] == "rigid":
            continue
        case = {**RIG, **inputs, "v0": 0.02}
        answer = client.post(PATH, json={**case, **options, "include": include, "std": {"k": 1e4}}).json()
        found = surrogate.evaluate(**case, **options, gradient=True)
        assert answer["gradient"] == found.gradient
        assert answer["groups"] == {"v_tilde": found.v_tilde, "y_tilde": found.y_tilde, "l0": found.length_scale}
        fraction, _ = surrogate.stick_fraction_with_bound(found.v_tilde, found.y_tilde, **options)
        assert answer["stick_fraction"] == fraction
        limits = answer["limits"]
        if options:
            assert limits["mu_static"] == surrogate.evaluate(**{**case, "v0": 0.0}, **options).mu_macro
            assert limits["mu_crit"] == surrogate.evaluate(**{**case, "v0": limits["v0_crit"]}, **options).mu_macro
        batch = client.post(BATCH, json={**case, "v0": [0.02], **options, "include": include, "std": {"k": 1e4}}).json()
        assert batch["limits"] == {name: [value] for name, value in limits.items()}
        assert batch["std"] == [answer["std"]]
        assert batch["gradient"] == {name: [value] for name, value in answer["gradient"].items()}


def test_what_the_model_leaves_out(client, problem, surrogate):
    from mumacro.validity import digits, k_effect, model_rows

    case = {**RIG, **ACROSS, "v0": 0.02}
    answer = client.post(PATH, json={**case, "contact": "ball", "include": ["model"]}).json()
    assert answer["model"] == model_rows(surrogate, case, contact="ball")
    assert answer["digits"] == digits(k_effect(surrogate, case, contact="ball"))
    (fault,) = problem(client.post(BATCH, json={**case, "include": ["model"]}), 422)["errors"]
    assert "one case" in fault["reason"]
    told = {**RIG, "y0": 2e-6, "k_range": [8e5, 1.2e6], "v0": 0.02, "include": ["model"]}
    assert "k is known" not in [row["row"] for row in client.post(PATH, json=told).json()["model"]]


def test_a_law_has_a_band_and_an_inverse_its_contact(client, problem, surrogate):
    asked = {**RIG, "y0": 2e-6, "contact": "ball"}
    sweep = {"start": 1e-3, "stop": 1.0, "points": 5}
    law = client.post("/v1/law", json={**asked, "k_range": [8e5, 1.2e6], **sweep}).json()
    found = surrogate.evaluate(**asked, k_range=(8e5, 1.2e6), v0=np.array(law["values"]))
    assert law["mu_macro_low"] == found.mu_macro_low.tolist()
    assert law["mu_macro_high"] == found.mu_macro_high.tolist()
    target = {"unknown": "v0", "target": 0.26}
    answer = client.post("/v1/solve-for", json={**asked, "k": 1e6, **target}).json()
    (root,) = answer["results"][0]["roots"]
    assert surrogate.evaluate(**asked, k=1e6, v0=root["value"]).mu_macro == root["mu_macro"]
    refused = problem(client.post("/v1/solve-for", json={**asked, "k_range": [8e5, 1e6], **target}), 422)
    assert refused["errors"][0]["field"] == "k_range"
    normal = {**RIG, "k": 1e6, "v0": 0.01, "direction": "normal", "along": "Fz_amplitude", "start": 0.1, "stop": 9.0}
    law = client.post("/v1/law", json={**normal, "points": 3}).json()
    assert (law["unit"], len(law["mu_macro"])) == ("N", 3)


def test_a_stiffness_is_the_librarys(client, problem):
    from mumacro.geometries import contact_of

    steel = {"E": 210e9, "nu": 0.3}
    asked = {
        "ball": {"radius": 5e-3, "Fz": 10.0},
        "flat": {"radius": 1e-3, "Fz": 10.0},
        "cylinder": {"radius": 5e-3, "length": 1e-2, "Fz": 10.0, "oscillation": "along"},
    }
    for geometry, given in asked.items():
        found = contact_of(geometry, **given, **steel)
        answer = client.post("/v1/stiffness", json={"geometry": geometry, **given, **steel}).json()
        assert {name: answer[name] for name in vars(found)} == vars(found)
    rigid = client.post("/v1/stiffness", json={"geometry": "ball", **asked["ball"], **steel, "E2": "rigid"}).json()
    assert rigid["k"] == contact_of("ball", **asked["ball"], **steel, E2=np.inf).k
    for changed, field in (({"radius": -1.0}, "radius"), ({"nu": 0.7}, "nu"), ({"E": "210GPa"}, "E"), ({"a": 1}, "a"),
                           ({"geometry": "cone"}, "geometry"), ({"Fz": None}, "Fz")):  # fmt: skip
        body = {"geometry": "ball", **asked["ball"], **steel, **changed}
        assert problem(client.post("/v1/stiffness", json=body), 422)["errors"][0]["field"] == field


def test_a_fit_is_the_librarys(client, problem, surrogate):
    import mumacro

    v0 = np.geomspace(1e-3, 1.0, 20)
    mu = surrogate.evaluate(**RIG, k=1e6, y0=2e-6, v0=v0, contact="ball").mu_macro + 1e-3 * np.cos(17.0 * np.arange(20))
    rig = {"Fz": 10.0, "y0": 2e-6, "omega": 1.3e5}
    found = mumacro.fit({"v0": v0, "mu_macro": mu}, contact="ball", surrogate=surrogate, **rig)
    body = {"v0": v0.tolist(), "mu_macro": mu.tolist(), **rig, "contact": "ball"}
    answer = client.post("/v1/fit", json=body).json()
    assert answer["values"] == found.values
    assert answer["std"] == found.std
    assert answer["covariance"] == found.covariance.tolist()
    assert answer["residuals"] == found.residuals.tolist()
    curve = answer["curve"]
    assert (curve["v0"][0], curve["v0"][-1]) == (v0[0], v0[-1])
    assert all(low < mid < high for low, mid, high in zip(curve["low"], curve["mu_macro"], curve["high"], strict=True))
    one = client.post("/v1/fit", json={**body, "unknowns": ["k"], "mu0": 0.3, "std": 1e-3}).json()
    assert one["values"].keys() == {"k"}
    varied = client.post("/v1/fit", json={**body, "Fz": [10.0] * 19 + [11.0]}).json()
    assert varied["curve"] is None
    for changed, field in (({"mu_macro": [0.2]}, "data"), ({"y0": "2um"}, "y0"), ({"include": ["power"]}, "include"),
                           ({"v0": [*v0[:-1].tolist(), None]}, "v0"), ({"contact": "cone"}, "contact"),
                           ({"mu0": 0.3}, "mu0"), ({"v0": [0.1] * 1001}, "v0")):  # fmt: skip
        errors = problem(client.post("/v1/fit", json={**body, **changed}), 422)["errors"]
        assert field in [fault["field"] for fault in errors] or errors[0]["pointer"].startswith(f"#/{field}"), errors


def test_stiff_points_fit_a_rigid_contact_in_words(client, surrogate):
    v0 = np.geomspace(0.05, 2.0, 12)
    mu = surrogate.evaluate(**RIG, k=None, y0=2e-6, v0=v0).mu_macro
    body = {"v0": v0.tolist(), "mu_macro": mu.tolist(), "Fz": 10.0, "y0": 2e-6, "omega": 1.3e5}
    answer = client.post("/v1/fit", json=body).json()
    assert answer["interval"]["k"][1] == "rigid"
    assert answer["warnings"]


def test_the_page_knows_what_the_service_can(client):
    assert {"contact", "direction", "k_range"} <= set(client.get("/static/page/names.json").json()["knows"])
