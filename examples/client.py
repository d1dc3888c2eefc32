"""Ask the service from Python, with nothing but the standard library:  python examples/client.py
[ADDRESS]"""

import json
import sys
from typing import Any
from urllib.parse import urlencode
from urllib.request import Request, urlopen

BASE = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8000"
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}  # SI units


def get(path: str, **query: Any) -> Any:
    with urlopen(f"{BASE}{path}?{urlencode(query)}", timeout=30) as response:
        return json.load(response)


def post(path: str, body: dict[str, Any]) -> Any:
    request = Request(
        f"{BASE}{path}", json.dumps(body).encode(), {"Content-Type": "application/json"}
    )
    with urlopen(request, timeout=30) as response:
        return json.load(response)


answer = get("/v1/mu-macro", **CASE, include="limits")
print(
    f"mu_macro = {answer['mu_macro']:.6f} (numerical error {answer['error_bound']:.0e}), "
    f"{answer['regime']}"
)
print(f"slides without sticking from v0 = {answer['limits']['v0_crit']:.4g} m/s on")

speeds = [0.001, 0.01, 0.1, 1.0]
batch = post("/v1/mu-macro/batch", {**CASE, "v0": speeds})
for v0, mu in zip(speeds, batch["mu_macro"], strict=True):
    print(f"v0 = {v0:5g} m/s: mu_macro = {mu:.6f}")

case = {name: value for name, value in CASE.items() if name != "y0"}
for result in post("/v1/solve-for", {"unknown": "y0", "target": [0.2, 0.1], **case})["results"]:
    (root,) = result["roots"]
    print(f"mu_macro = {result['target']} needs y0 = {1e6 * root['value']:.4f} um")
