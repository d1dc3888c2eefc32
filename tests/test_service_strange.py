"""Strange requests: the response is always a result or a problem document, never a 500."""

import json

import orjson
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.quantities import INCLUDES

pytestmark = pytest.mark.slow

FIELDS = ("mu0", "Fz", "k", "y0", "omega", "v0", "include", "tolerance", "std")
POST_PATHS = ("/v1/mu-macro", "/v1/mu-macro/batch")

leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.just(0.5) | st.just(10**400)
values = st.recursive(
    leaves, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=2)
)
names = st.sampled_from(FIELDS) | st.text(max_size=4)
stds = st.dictionaries(st.sampled_from(["mu0", "k", "v0"]), st.just(0.5) | leaves)
objects = st.dictionaries(names, values, max_size=8)
likely = st.fixed_dictionaries(
    {name: st.just(1.0) | st.lists(st.floats() | leaves, min_size=2, max_size=2) for name in FIELDS[:6]},
    optional={"include": st.lists(st.sampled_from(INCLUDES)), "tolerance": leaves, "std": leaves | stds},
)
documents = values | objects | likely | st.lists(objects | likely | values, max_size=4)


def assert_answered(response):
    assert response.status_code in (200, 400, 404, 413, 415, 422), response.text
    kind = "application/json" if response.status_code == 200 else "application/problem+json"
    assert response.headers["content-type"] == kind
    json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


@pytest.mark.parametrize("path", POST_PATHS)
@settings(max_examples=400, deadline=None)
@given(document=documents)
def test_any_json_is_answered(client, path, document):
    assert_answered(client.post(path, content=json.dumps(document).encode()))


@pytest.mark.parametrize("path", POST_PATHS)
@settings(max_examples=200, deadline=None)
@given(body=st.binary(max_size=40))
def test_any_bytes_are_answered(client, path, body):
    assert_answered(client.post(path, content=body))


@pytest.mark.parametrize("path", ["/v1/mu-macro", "/v1/table"])
@settings(max_examples=300, deadline=None)
@given(pairs=st.lists(st.tuples(names | st.just("id"), st.text(max_size=6) | st.floats().map(repr)), max_size=8))
def test_any_query_is_answered(client, path, pairs):
    assert_answered(client.get(path, params=pairs))


@settings(max_examples=100, deadline=None)
@given(query=st.text(alphabet=st.characters(min_codepoint=33, max_codepoint=126, exclude_characters="#"), max_size=40))
def test_any_raw_query_is_answered(client, query):
    assert_answered(client.get(f"/v1/mu-macro?{query}"))


@pytest.mark.parametrize("path", [*POST_PATHS, "/v1/solve-for", "/v1/law"])
@pytest.mark.parametrize(
    "body", [r'"\ud800"', r'{"mu0":"\ud800"}', r'{"\ud800":1}', r'{"std":{"\ud800":1}}', r'["\udfff"]']
)
def test_half_of_a_surrogate_pair_is_refused_in_json_that_every_parser_reads(client, path, body):
    response = client.post(path, content=body.encode())
    assert response.status_code in (200, 400, 422)
    orjson.loads(response.content)  # a strict parser
