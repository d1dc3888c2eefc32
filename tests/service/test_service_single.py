"""One case over HTTP: its answer, and all that ``include`` adds to it; all forms are in
test_service_contacts.py."""

import asyncio
import json
import math
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mumacro import Surrogate
from service import bodies
from tests.support.cases import Case
from tests.support.comparing import close

DEFAULT = {"mu_macro", "mu_ratio", "regime", "error_bound", "source", "table", "api_version"}
REMARKS = ("remarks",)  # only where something is doubtful
PATH = "/v1/mu-macro"

positive = st.floats(min_value=5e-324, max_value=1.7e308) | st.floats(1e-6, 1e6)
not_negative = st.just(0.0) | positive
cases = st.fixed_dictionaries(
    {
        "mu0": positive,
        "Fz": positive,
        "k": positive | st.just("rigid"),
        "y0": not_negative,
        "omega": not_negative,
        "v0": not_negative,
    }
)


def ask(client: Any, case: Case, **options: Any) -> Any:
    response = client.post(PATH, json={**case, **options})
    assert response.status_code == 200, response.text
    return json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


@settings(max_examples=200)
@given(one_case=cases)
def test_the_answer_is_the_surrogates_and_always_json(
    client: Any, surrogate: Surrogate, one_case: Any
) -> None:
    answer = ask(client, one_case, include=["groups", "limits", "stick_fraction"])
    expected = surrogate.evaluate(**one_case)
    assert answer["error_bound"] == (
        expected.error_bound if math.isfinite(expected.error_bound) else None
    )
    for name in ("mu_macro", "mu_ratio", "regime", "source"):
        assert answer[name] == getattr(expected, name)
    assert 0.0 <= answer["mu_ratio"] <= 1.0
    assert list(answer["groups"]) == ["v_tilde", "y_tilde", "l0"]
    assert list(answer["limits"]) == ["mu_static", "v0_crit", "mu_crit"]
    if answer["groups"]["y_tilde"] == 0.0 < one_case["y0"] * one_case["omega"]:
        assert answer["stick_fraction_bound"] == 1.0  # the groups do not show whether it sticks
    plain = {name: answer[name] for name in (*DEFAULT, *REMARKS) if name in answer}
    assert ask(client, one_case) == plain
    query = {name: value if value == "rigid" else repr(value) for name, value in one_case.items()}
    assert client.get(PATH, params=query).json() == plain


@pytest.mark.parametrize(
    "include", ["groups,limits", "limits, groups,groups", "groups&include=limits"]
)
@pytest.mark.parametrize("k", ["1e+6", "1000000", "rigid", "Rigid"])
def test_a_query_may_have_other_words(
    client: Any, case: Case, surrogate: Surrogate, include: Any, k: Any
) -> None:
    expected = ask(
        client, {**case, "k": 1e6 if "1" in k else "rigid"}, include=["limits", "groups"]
    )
    assert expected["table"] == {"id": surrogate.id, "tolerance": surrogate.tolerance}
    query = "&".join(
        f"{name}={value}" for name, value in {**case, "k": k, "include": include}.items()
    )
    assert client.get(f"{PATH}?{query}&tolerance={surrogate.tolerance}").json() == expected
    assert "1" in k or ask(client, {**case, "k": k}, include=["groups", "limits"]) == expected


def test_a_query_that_says_nothing_stands_beside_a_body(client: Any, case: Case) -> None:
    assert client.post(f"{PATH}?&&&", json=case).json() == ask(client, case)


def test_a_frequency_and_its_deviation_are_given_in_either_unit(client: Any, case: Case) -> None:
    by_omega = ask(client, case, include=["std"], std_omega=2e3 * math.pi)
    named = {**case, "f": case["omega"] / (2 * math.pi)}
    del named["omega"]
    by_f = ask(client, named, include=["std"], std_f=1e3)
    assert by_f["mu_macro"] == close(by_omega["mu_macro"], rel=1e-13)
    assert by_f["std"] == close(by_omega["std"], rel=1e-12)
    assert client.get(PATH, params={**named, "include": "std", "std_f": 1e3}).json() == by_f


def test_one_value_is_returned_as_text_and_answers_may_be_cached(client: Any, case: Case) -> None:
    answer = ask(client, case, include=["power"])
    plain = client.get(f"{PATH}.txt", params=case)
    assert (float(plain.text), plain.headers["content-type"]) == (
        answer["mu_macro"],
        "text/plain; charset=utf-8",
    )
    query = {**case, "include": "power", "value": "power.saved"}
    assert float(client.get(f"{PATH}.txt", params=query).text) == answer["power"]["saved"]
    assert client.get(f"{PATH}.txt", params={**case, "value": "regime"}).text == "stick_slip"
    head, get = client.head(PATH, params=case), client.get(PATH, params=case)
    assert (head.status_code, head.content, head.headers["content-length"]) == (
        200,
        b"",
        str(len(get.content)),
    )
    assert get.headers["cache-control"] == plain.headers["cache-control"] == "public, max-age=3600"


def test_one_name_stands_in_place_of_a_list_of_one(client: Any, case: Case) -> None:
    for name in ("power", "inputs"):
        assert ask(client, case, include=name) == ask(client, case, include=[name])


@pytest.mark.parametrize(("mu0", "f"), [("0,3", "20.000"), ("0,3", "20.000 Hz"), ("0,25", "1.300")])
def test_texts_of_a_case_agree_on_their_signs(client: Any, case: Case, mu0: str, f: str) -> None:
    del case["omega"]
    response = client.post(PATH, json={**case, "mu0": mu0, "f": f})
    (fault,) = response.json()["errors"]
    assert (response.status_code, fault["field"]) == (422, "f")
    assert mu0 in fault["reason"]
    assert client.post(PATH, json={**case, "mu0": mu0, "f": "20000,0"}).status_code == 200
    assert client.post(PATH, json={**case, "mu0": mu0.replace(",", "."), "f": f}).status_code == 200


def test_an_endpoint_answers_a_case_by_five_functions(client: Any, case: Case) -> None:
    """What a reader follows from the endpoint to its answer, beside the library's own functions."""
    text = json.dumps(case).encode()
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": "POST",
        "scheme": "http",
        "path": PATH,
        "query_string": b"",
        "headers": [(b"host", b"here"), (b"content-type", b"application/json")],
    }
    statuses, called, depth = list[int](), set[str](), 0
    service = str(Path(bodies.__file__).parent)

    async def receive() -> Any:
        return {"type": "http.request", "body": text}

    async def send(message: Any) -> None:
        statuses.append(message.get("status", 0))

    def note(frame: Any, event: str, _: Any) -> None:
        nonlocal depth
        code = frame.f_code
        if not code.co_filename.startswith(service) or code.co_name.startswith("<"):
            return
        begins = code.co_name == "post_mu_macro" or depth
        if event == "call" and begins:
            called.add(code.co_qualname)
            depth += 1
        elif event == "return" and depth:
            depth -= 1

    async def answered() -> None:
        sys.setprofile(note)
        try:
            await client.app(scope, receive, send)
        finally:
            sys.setprofile(None)

    asyncio.run(answered())
    assert statuses[0] == 200
    assert len(called - {"post_mu_macro"}) == 5, sorted(called)
