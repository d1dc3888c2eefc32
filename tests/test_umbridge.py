"""UM-Bridge 1.0: every endpoint, every error, and the protocol's own Python client against a live server."""

import json
import math
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from comparing import close
from mumacro.inputs import FIELDS
from service.app import create_app
from service.settings import Settings

pytestmark = pytest.mark.slow

POSTS = ("ModelInfo", "InputSizes", "OutputSizes", "Evaluate", "Gradient", "ApplyJacobian", "ApplyHessian")
MODELS = ("mu_macro", "mu_macro_log10")
POINT = [0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01]
LOG_POINT = [math.log10(value) for value in POINT]
WRT = {"outWrt": 0, "inWrt": 0}


def ask(client, endpoint, body, **options):
    return client.post(f"/{endpoint}", content=json.dumps(body).encode(), **options)


def refused(response, kind, status=400):
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/json"
    document = response.json()
    assert document.keys() == {"error"}
    assert document["error"].keys() == {"type", "message"}
    assert document["error"]["type"] == kind
    assert document["error"]["message"]
    assert "Traceback" not in response.text
    return document["error"]["message"]


def test_info(client):
    response = client.get("/Info")
    assert response.json() == {"protocolVersion": 1.0, "models": list(MODELS)}
    assert response.text.startswith('{"protocolVersion": 1.0')


@pytest.mark.parametrize("model", MODELS)
def test_the_description_of_a_model(client, model):
    support = {"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False}
    assert ask(client, "ModelInfo", {"name": model}).json() == {"support": support}
    assert ask(client, "InputSizes", {"name": model}).json() == {"inputSizes": [6]}
    assert ask(client, "OutputSizes", {"name": model, "config": {}}).json() == {"outputSizes": [1]}


def test_the_value_is_the_surrogates(client, surrogate):
    expected = surrogate.evaluate(**dict(zip(FIELDS, POINT, strict=True))).mu_macro
    assert ask(client, "Evaluate", {"name": "mu_macro", "input": [POINT]}).json() == {"output": [[expected]]}
    ((logarithmic,),) = ask(client, "Evaluate", {"name": "mu_macro_log10", "input": [LOG_POINT]}).json()["output"]
    assert logarithmic == close(expected, rel=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_all_ones_is_valid(client, surrogate, model):
    value = 1.0 if model == "mu_macro" else 10.0
    expected = surrogate.evaluate(dict.fromkeys(FIELDS, value)).mu_macro
    request = {"name": model, "input": [[1] * 6], "config": {}}
    assert ask(client, "Evaluate", request).json() == {"output": [[expected]]}
    assert len(ask(client, "Gradient", {**request, **WRT, "sens": [1.0]}).json()["output"]) == 6


@pytest.mark.parametrize("config", [{}, None, [], {"unknown": 1}])
@pytest.mark.parametrize("endpoint", ["InputSizes", "OutputSizes", "Evaluate"])
def test_any_config_will_do(client, endpoint, config):
    request = {"name": "mu_macro", "input": [POINT]}
    assert ask(client, endpoint, {**request, "config": config}).json() == ask(client, endpoint, request).json()


@pytest.mark.parametrize("content_type", [None, "text/plain", "application/x-www-form-urlencoded", "application/json"])
def test_the_content_type_does_not_matter(client, content_type):
    headers = {} if content_type is None else {"Content-Type": content_type}
    response = ask(client, "Evaluate", {"name": "mu_macro", "input": [POINT]}, headers=headers)
    assert response.status_code == 200
    assert response.json().keys() == {"output"}


@pytest.mark.parametrize("model", MODELS)
def test_the_gradient_is_the_difference_quotient(client, model):
    point = POINT if model == "mu_macro" else LOG_POINT
    request = {"name": model, "input": [point], **WRT}
    slopes = ask(client, "Gradient", {**request, "sens": [1.0]}).json()["output"]
    for i, slope in enumerate(slopes):
        h = 1e-4 * abs(point[i])
        low, high = ([*point[:i], point[i] + sign * h, *point[i + 1 :]] for sign in (-1, 1))
        values = [ask(client, "Evaluate", {"name": model, "input": [p]}).json()["output"][0][0] for p in (low, high)]
        quotient = (values[1] - values[0]) / (2 * h)
        assert slope == close(quotient, rel=1e-4), FIELDS[i]
    vec = [0.5 * value for value in point]
    (product,) = ask(client, "ApplyJacobian", {**request, "vec": vec}).json()["output"]
    assert product == close(sum(a * b for a, b in zip(slopes, vec, strict=True)), rel=1e-12)


def test_a_scalar_is_used_for_every_component(client):
    request = {"name": "mu_macro", "input": [POINT], **WRT}
    slopes = ask(client, "Gradient", {**request, "sens": [2.5]}).json()
    assert ask(client, "Gradient", {**request, "sens": 2.5}).json() == slopes
    whole = ask(client, "ApplyJacobian", {**request, "vec": [2.0] * 6}).json()
    assert ask(client, "ApplyJacobian", {**request, "vec": 2}).json() == whole


@pytest.mark.parametrize("endpoint", POSTS)
@pytest.mark.parametrize("name", ["nobody", "", "MU_MACRO", None, 7, ["mu_macro"], {"a": 1}])
def test_the_name_is_judged_first(client, endpoint, name):
    body = {"name": name, "input": "nonsense", "outWrt": 9, "sens": None}
    assert "mu_macro_log10" in refused(ask(client, endpoint, body), "ModelNotFound")


@pytest.mark.parametrize("endpoint", POSTS)
def test_a_missing_name_is_a_model_not_found(client, endpoint):
    refused(ask(client, endpoint, {}), "ModelNotFound")


@pytest.mark.parametrize("body", [b"", b"{", b"\xff", b"[1]", b"3", b"null", b'"mu_macro"'])
@pytest.mark.parametrize("endpoint", POSTS)
def test_a_body_that_is_not_an_object_is_invalid_input(client, endpoint, body):
    refused(client.post(f"/{endpoint}", content=body), "InvalidInput")


def test_hessians_are_not_offered(client):
    body = {"name": "mu_macro", "input": [POINT], "outWrt": 0, "inWrt1": 0, "inWrt2": 0, "sens": [1], "vec": [1] * 6}
    refused(ask(client, "ApplyHessian", body), "UnsupportedFeature")


@pytest.mark.parametrize("endpoint", ["Evaluate", "Gradient", "ApplyJacobian"])
@pytest.mark.parametrize(
    "vectors",
    [None, [], POINT, [POINT, POINT], [POINT[:5]], [[*POINT, 1.0]], [[]], {"0": POINT}, [dict(enumerate(POINT))],
     ["0.3"], [[*POINT[:5], "0.01"]], [[*POINT[:5], True]], [[*POINT[:5], None]], [[*POINT[:5], [0.01]]],
     [[0, *POINT[1:]]], [[-0.3, *POINT[1:]]], [[*POINT[:5], -1e-9]], [[*POINT[:5], 10**400]]],
)  # fmt: skip
def test_an_invalid_input_is_reported(client, endpoint, vectors):
    body = {"name": "mu_macro", "input": vectors, **WRT, "sens": [1.0], "vec": [1.0] * 6}
    refused(ask(client, endpoint, body), "InvalidInput")


@pytest.mark.parametrize("bad", ["NaN", "Infinity", "-Infinity", "1e999"])
@pytest.mark.parametrize("model", MODELS)
def test_numbers_that_are_none_are_invalid_input(client, model, bad):
    body = f'{{"name": "{model}", "input": [[0.3, 10, 1, 1, 1, {bad}]]}}'
    refused(client.post("/Evaluate", content=body.encode()), "InvalidInput")


@pytest.mark.parametrize("logarithm", [308.3, 1e9, -400.0])
def test_a_logarithm_beyond_double_range_is_invalid_input(client, logarithm):
    body = {"name": "mu_macro_log10", "input": [[logarithm, *LOG_POINT[1:]]]}
    refused(ask(client, "Evaluate", body), "InvalidInput")


@pytest.mark.parametrize("wrong", [1, -1, 0.5, "0", None, True, [0]])
@pytest.mark.parametrize("index", ["outWrt", "inWrt"])
@pytest.mark.parametrize("endpoint", ["Gradient", "ApplyJacobian"])
def test_an_index_beyond_the_only_one_is_invalid_input(client, endpoint, index, wrong):
    body = {"name": "mu_macro", "input": [POINT], **WRT, "sens": [1.0], "vec": [1.0] * 6, index: wrong}
    assert index in refused(ask(client, endpoint, body), "InvalidInput")


@pytest.mark.parametrize("wrong", [None, [], [1.0, 1.0], ["1"], "1", [[1.0]], {}, True])
def test_a_wrong_sens_or_vec_is_invalid_input(client, wrong):
    body = {"name": "mu_macro", "input": [POINT], **WRT}
    refused(ask(client, "Gradient", {**body, "sens": wrong}), "InvalidInput")
    refused(ask(client, "ApplyJacobian", {**body, "vec": wrong}), "InvalidInput")
    refused(ask(client, "Gradient", body), "InvalidInput")
    refused(ask(client, "ApplyJacobian", body), "InvalidInput")


def test_an_infinite_slope_is_invalid_output(client):
    # y~ = 1 to the last bit: mu_macro grows with the cube root of the speed
    body = {"name": "mu_macro", "input": [[1.0, 1.0, 1.0, 1.0, 1.0, 0.0]]}
    assert ask(client, "Evaluate", body).json() == {"output": [[0.0]]}
    refused(ask(client, "Gradient", {**body, **WRT, "sens": [1.0]}), "InvalidOutput", 500)


values = st.floats(min_value=-1e308, max_value=1e308) | st.sampled_from([0.0, 1.0, 5e-324, 1e-308, 1.7e308])


@settings(max_examples=300, deadline=None)
@given(vector=st.lists(values, min_size=6, max_size=6), model=st.sampled_from(MODELS))
def test_an_answer_is_finite_or_an_error_of_the_protocol(client, vector, model):
    body = {"name": model, "input": [vector], **WRT, "sens": [1.0], "vec": [1.0] * 6}
    for endpoint in ("Evaluate", "Gradient", "ApplyJacobian"):
        response = ask(client, endpoint, body)
        document = json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
        if response.status_code == 200:
            assert document.keys() == {"output"}
        else:
            assert response.status_code in (400, 500)
            assert document["error"]["type"] in ("InvalidInput", "InvalidOutput")


@pytest.mark.parametrize("path", ["/Info", *(f"/{name}" for name in POSTS)])
def test_a_wrong_method_is_reported_in_the_protocols_form(client, path):
    response = client.request("DELETE", path)
    refused(response, "UnsupportedFeature", 405)
    assert response.headers["allow"] == ("GET, HEAD" if path == "/Info" else "POST")


def test_without_a_table_the_error_is_the_protocols(tmp_path):
    (tmp_path / "damaged.nc").write_bytes(b"damaged")
    with TestClient(create_app(Settings(tables=(tmp_path,)), wait=True)) as client:
        message = refused(ask(client, "Evaluate", {"name": "mu_macro", "input": [POINT]}), "InvalidOutput", 500)
        assert "damaged.nc" in message
        refused(ask(client, "Evaluate", {"name": "nobody"}), "ModelNotFound")


def test_a_body_over_the_limit_without_a_length_is_invalid_input(tables_dir):
    with TestClient(create_app(Settings(tables=(tables_dir,), max_body_bytes=1024), wait=True)) as client:
        refused(client.post("/Evaluate", content=iter([b" " * 600] * 4)), "InvalidInput")


def test_an_unforeseen_error_is_the_protocols_too(tables_dir):
    app = create_app(Settings(tables=(tables_dir,)), wait=True)

    def fail(*_args):
        raise RuntimeError("secret detail")

    app.state.tables.pick = fail
    message = refused(ask(TestClient(app), "Evaluate", {"name": "mu_macro", "input": [POINT]}), "InvalidOutput", 500)
    assert "secret" not in message


# --- the PyPI client ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def live(live_server):
    umbridge = pytest.importorskip("umbridge", reason="the PyPI package umbridge is not installed")
    return umbridge, live_server.url


def test_the_python_client_works_unchanged(live, surrogate):
    umbridge, url = live
    assert umbridge.supported_models(url) == list(MODELS)
    for name, point in (("mu_macro", POINT), ("mu_macro_log10", LOG_POINT)):
        model = umbridge.HTTPModel(url, name)
        assert (model.get_input_sizes(), model.get_output_sizes()) == ([6], [1])
        assert model.supports_evaluate()
        assert model.supports_gradient()
        assert model.supports_apply_jacobian()
        assert not model.supports_apply_hessian()
        ((value,),) = model([point])
        case = dict(zip(FIELDS, POINT, strict=True))
        assert value == close(surrogate.evaluate(**case).mu_macro, rel=1e-13)
        slopes = model.gradient(0, 0, [point], [1.0])
        step = [0.01 * p for p in point]
        (change,) = model.apply_jacobian(0, 0, [point], step)
        assert change == close(sum(a * b for a, b in zip(slopes, step, strict=True)), rel=1e-12)


def test_the_python_client_reads_our_errors(live):
    umbridge, url = live
    model = umbridge.HTTPModel(url, "mu_macro")
    with pytest.raises(Exception, match=r"InvalidInput: .*mu0"):
        model([[-0.3, *POINT[1:]]])
    with pytest.raises(Exception, match=r"InvalidInput: .*Expected 6 but got 5"):
        model([POINT[:5]])
    with pytest.raises(Exception, match="not supported by server"):
        umbridge.HTTPModel(url, "nobody")


def test_the_python_client_falls_back_from_shared_memory(live, capsys):
    umbridge, url = live
    model = umbridge.HTTPModel(url, "mu_macro", use_shmem=True)
    assert not model.supports_shmem()
    assert "Using HTTP" in capsys.readouterr().out
    assert model([POINT]) == umbridge.HTTPModel(url, "mu_macro")([POINT])


def test_many_clients_at_once(live):
    umbridge, url = live
    model = umbridge.HTTPModel(url, "mu_macro")
    points = [[*POINT[:5], 1e-3 * (1 + i)] for i in range(64)]
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda point: model([point])[0][0], points))
    assert answers == sorted(answers)
    assert answers == [model([point])[0][0] for point in points]
