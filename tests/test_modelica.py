"""Modelica: the function around the C header, and a friction law as the table of SupportFriction.

The compiler is Rumoca (``pip install rumoca``); the Modelica Standard Library is looked for in MODELICAPATH's folders.
"""

import math
import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from comparing import close
from mumacro import InputError, closed_forms

LAW = Path(__file__).parent.parent / "examples" / "modelica_law.py"
straight_pieces = runpy.run_path(str(LAW))["straight_pieces"]

UNIT = {"mu0": 0.25, "Fz": 1.0, "k": 4.0, "omega": 3.0}  # l0 = 1/16 m
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
TOLERANCE = 1e-3
MODEL = """
model Pulled "a mass on a support, pulled by a force that rises from 0 to 4 N in 1 s"
  Modelica.Mechanics.Translational.Components.Mass mass(m = 1, s(start = 0, fixed = true), v(start = 0, fixed = true));
  Modelica.Mechanics.Translational.Components.SupportFriction friction({table});
  Modelica.Mechanics.Translational.Components.Fixed fixed;
  Modelica.Mechanics.Translational.Sources.Force force;
  Modelica.Blocks.Sources.Ramp ramp(height = 4, duration = 1);
equation
  connect(ramp.y, force.f);
  connect(force.flange, mass.flange_a);
  connect(mass.flange_b, friction.flange_a);
  connect(friction.support, fixed.flange);
end Pulled;
"""


WORDS = [f"{name}={value!r}" for name, value in CASE.items()]


def law(*words, code=0):
    """What the program prints."""
    done = subprocess.run([sys.executable, LAW, *words], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return done.stdout if code == 0 else done.stderr


@pytest.fixture
def rumoca():
    return pytest.importorskip("rumoca", reason="the Modelica compiler rumoca is not installed")


def test_the_function_and_its_derivative_compile(rumoca, repository, tmp_path):
    source = Path(shutil.copy(repository / "examples" / "c" / "Mumacro.mo", tmp_path))
    assert [str(found) for found in rumoca.validate(str(source), model="Mumacro.SlidingMass")] == []
    model = rumoca.Session().load(str(source), model="Mumacro.SlidingMass")
    assert [one.name for one in model.states] == ["v"]


def test_support_friction_follows_the_law(rumoca, surrogate, tmp_path):
    folders = (Path(name) for name in os.environ.get("MODELICAPATH", "").split(os.pathsep) if name)
    library = next((folder for folder in folders if (folder / "Modelica" / "package.mo").is_file()), None)
    if library is None:
        pytest.skip("no folder of MODELICAPATH holds the Modelica Standard Library")
    (tmp_path / "Pulled.mo").write_text(MODEL.format(table=law(*WORDS, "--within", repr(TOLERANCE))), "utf-8")
    roots = [str(path) for name in ("Modelica", "ModelicaServices", "Complex.mo") if (path := library / name).exists()]
    model = rumoca.Session(roots=roots).load(str(tmp_path / "Pulled.mo"), model="Pulled")
    found = model.simulate(t=(0.0, 1.0), dt=0.002)
    speed, force, pull = (np.asarray(found[name]) for name in ("mass.v", "friction.f", "ramp.y"))
    static = CASE["Fz"] * surrogate.evaluate(**CASE, v0=0.0).mu_macro
    held = pull < static
    assert 100 < held.sum() < held.size - 100
    assert np.abs(speed[held]).max() == 0.0
    assert force[held] == close(pull[held], abs=1e-9)
    moves = speed > 0.0
    assert moves.sum() > 100
    expected = CASE["Fz"] * surrogate.evaluate(**CASE, v0=speed[moves]).mu_macro
    assert np.abs(force[moves] - expected).max() <= TOLERANCE * CASE["mu0"] * CASE["Fz"]


def test_the_program_prints_force_or_torque(surrogate):
    tables = {}
    for name, words in (("f_pos", ()), ("tau_pos", ("--radius", "0.02"))):
        text = law(*WORDS, *words)
        matrix = re.search(rf"^{name} = \[([^\]]*)\]$", text, re.MULTILINE)[1]
        tables[name] = np.array([[float(x) for x in row.split(",")] for row in matrix.split(";")])
        assert all(line.startswith("//") for line in text.split(name)[0].splitlines())
    speeds, force = tables["f_pos"].T
    expected = CASE["Fz"] * surrogate.evaluate(**CASE, v0=speeds[:-1]).mu_macro
    assert force[:-1] == close(expected, rel=1e-11)  # the tables' tolerances differ
    assert (speeds[0], force[-1]) == (0.0, force[-2])
    assert tables["tau_pos"] == close(tables["f_pos"] * [50.0, 0.02], rel=1e-14)
    for words, part in ((("--radius", "0"), "no radius"), (("--within", "0"), "within must be > 0"), (("v0=1",), "v0")):
        assert part in law(*WORDS, *words, code=2)


@pytest.mark.parametrize("tolerance", [0.1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("y", [1e-3, 0.3, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 3.0, 1e3, math.inf])
def test_straight_pieces_are_as_near_as_they_promise_at_every_speed(surrogate, y, tolerance) -> None:
    case = {**UNIT, "y0": 0.0625 * y} if math.isfinite(y) else {**UNIT, "k": None, "y0": 0.1}
    v0, mu = straight_pieces(surrogate, case, tolerance)
    assert v0[0] == 0.0
    assert mu[0] == surrogate.evaluate(**case, v0=0.0).mu_macro == 0.25 * closed_forms.static_limit(y)
    assert mu[-1] == mu[-2]
    assert (np.diff(v0) > 0.0).all()
    rng = np.random.default_rng(5)
    tried = np.concatenate((v0, np.geomspace(v0[-1] * 1e-24, v0[-1] * 1e6, 20_011), rng.uniform(0.0, v0[-1], 20_011)))
    error = np.abs(np.interp(tried, v0, mu) - surrogate.evaluate(**case, v0=tried).mu_macro)
    assert error.max() <= tolerance * case["mu0"]
    assert v0.size <= 8 + 4 / math.sqrt(tolerance)


def test_straight_pieces_without_vibration_and_with_bad_inputs(surrogate) -> None:
    for still in ({"y0": 0.0}, {"y0": 1.0, "omega": 0.0}):
        v0, mu = straight_pieces(surrogate, {**UNIT, **still}, 1e-3)
        assert (v0.tolist(), mu.tolist()) == ([0.0, 1.0], [0.25, 0.25])
    for wrong in ({"y0": 1e-200, "omega": 1e-200}, {"y0": 1e300}, {"y0": -1.0}):
        with pytest.raises(InputError):
            straight_pieces(surrogate, {**UNIT, **wrong}, 1e-3)
    for tolerance in (0.0, 0.2, math.nan):
        with pytest.raises(InputError, match="within"):
            straight_pieces(surrogate, {**UNIT, "y0": 1.0}, tolerance)
