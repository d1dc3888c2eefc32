"""The example server speaks UM-Bridge 1.0: what its models answer, and how they refuse."""

import json
import urllib.error
import urllib.request
from typing import Any

import pytest

from tests.support.serving import CASE

pytestmark = pytest.mark.slow
POINT, LONG = [list(CASE.values())], [[*CASE.values(), 1.0]]
WAYS: dict[str, dict[str, Any]] = {
    "Evaluate": {},
    "Gradient": {"outWrt": 0, "inWrt": 0, "sens": [0.0]},
    "ApplyJacobian": {"outWrt": 0, "inWrt": 0, "vec": POINT[0]},
}


def ask(bridge: str, path: str, **body: Any) -> tuple[int, Any]:
    data = json.dumps(body).encode() if body else None
    try:
        with urllib.request.urlopen(
            urllib.request.Request(f"{bridge}/{path}", data), timeout=60
        ) as reply:
            return reply.status, json.load(reply)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


def test_every_way_of_asking_has_the_shape_of_the_sizes(bridge: Any) -> None:
    status, about = ask(bridge, "Info")
    assert status == 200
    for name in about["models"]:
        support = ask(bridge, "ModelInfo", name=name)[1]["support"]
        assert support == {
            "Evaluate": True,
            "Gradient": True,
            "ApplyJacobian": True,
            "ApplyHessian": False,
        }
        assert ask(bridge, "InputSizes", name=name) == (200, {"inputSizes": [6]})
        assert ask(bridge, "OutputSizes", name=name) == (200, {"outputSizes": [1]})
    for way, shape in (("Evaluate", [1]), ("Gradient", 6), ("ApplyJacobian", 1)):
        status, answer = ask(bridge, way, name="mu_macro", input=POINT, config={}, **WAYS[way])
        assert status == 200
        assert list(answer) == ["output"]
        result = answer["output"]
        assert ([len(part) for part in result] if way == "Evaluate" else len(result)) == shape


@pytest.mark.parametrize(
    ("way", "change", "kind"),
    [
        ("Evaluate", {"name": "wrong"}, "ModelNotFound"),
        *((way, {"input": LONG}, "InvalidInput") for way in WAYS),
        *(
            (way, {which: 1}, "InvalidInput")
            for way in ("Gradient", "ApplyJacobian")
            for which in ("inWrt", "outWrt")
        ),
        ("ApplyHessian", {}, "UnsupportedFeature"),
    ],
)
def test_a_refusal_is_400_with_its_type_and_a_message(
    bridge: Any, way: str, change: Any, kind: str
) -> None:
    request = {"name": "mu_macro", "input": POINT, "config": {}, **WAYS.get(way, {}), **change}
    status, answer = ask(bridge, way, **request)
    assert (status, answer["error"]["type"]) == (400, kind)
    assert set(answer) == {"error"}
    assert set(answer["error"]) == {"type", "message"}
