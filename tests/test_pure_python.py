"""The compiled code as plain Python: with NUMBA_DISABLE_JIT=1 debuggers work, and the results are the same."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from builder.steady import border, solve
from comparing import close
from mumacro import Surrogate
from mumacro.charts import QUANTITIES

POINTS = [(0.1, 0.5), (2.0, 1.0), (1e-6, 1.0), (0.05, 3.0), (30.0, 400.0), (1e-9, 0.3), (300.0, 200.0)]
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}

SCRIPT = """
import json, sys, numba
from builder.model import slip
from builder.steady import border, solve
from mumacro import Surrogate
from mumacro.charts import QUANTITIES
points, case, table = json.load(sys.stdin)
assert numba.config.DISABLE_JIT
assert not hasattr(slip, "py_func")
s = Surrogate.open(table)
v, y = [p[0] for p in points], [p[1] for p in points]
answer = s.evaluate(**case, gradient=True)
print(json.dumps({
    "solved": [(a.mu_ratio, a.stick_fraction, a.power, a.status) for a in (solve(*p) for p in points)],
    "border": border(0.5),
    "scalar": [float(s.mu_ratio(*p)) for p in points],
    "array": s.mu_ratio(v, y).tolist(),
    "bound": s.ratio_with_bound(v, y)[1].tolist(),
    "slopes": [x.tolist() for of in QUANTITIES for x in s.slopes(v, y, of, bounds=True)],
    "power": s.power(v, y).tolist(),
    "stick": s.stick_fraction(v, y).tolist(),
    "crit": s.v_tilde_crit(y).tolist(),
    "macro": float(answer.mu_macro),
    "gradient": answer.gradient,
    "gradient_bound": answer.gradient_bound,
    "certain": answer.regime_certain,
}))
"""


@pytest.mark.slow
def test_plain_python_equals_the_compiled_code(repository: Path) -> None:
    table = repository / "tables" / "mumacro-1e-10.nc"
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], input=json.dumps([POINTS, CASE, str(table)]), cwd=repository,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(repository)},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    plain = json.loads(done.stdout)

    compiled = [solve(*point) for point in POINTS]
    for one, two in zip(plain["solved"], compiled, strict=True):
        assert one[:2] == close([two.mu_ratio, two.stick_fraction], rel=2e-15, abs=2e-15)
        assert one[2] == close(two.power, rel=1e-13)
        assert one[3] == two.status == 0
    assert plain["border"] == close(border(0.5), rel=1e-15)

    s = Surrogate.open(table)
    v, y = [point[0] for point in POINTS], [point[1] for point in POINTS]
    for name, expected in {
        "scalar": s.mu_ratio(v, y),
        "array": s.mu_ratio(v, y),
        "bound": s.ratio_with_bound(v, y)[1],
        "power": s.power(v, y),
        "stick": s.stick_fraction(v, y),
        "crit": s.v_tilde_crit(y),
    }.items():
        assert plain[name] == close(expected.tolist(), rel=1e-13, abs=1e-15), name
    for one, two in zip(
        plain["slopes"], (x for of in QUANTITIES for x in s.slopes(v, y, of, bounds=True)), strict=True
    ):
        assert one == close(two.tolist(), rel=1e-7, abs=1e-12)
    answer = s.evaluate(**CASE, gradient=True)
    assert plain["macro"] == close(answer.mu_macro, rel=1e-14)
    assert plain["gradient"] == close(answer.gradient, rel=1e-9)
    assert plain["gradient_bound"] == close(answer.gradient_bound, rel=1e-6)
    assert plain["certain"] is answer.regime_certain is True
