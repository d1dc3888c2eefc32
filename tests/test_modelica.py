"""Modelica: the function around the C header, and a friction law as the table of SupportFriction.

The compiler is Rumoca (``pip install rumoca``); the Modelica Standard Library is looked for in MODELICAPATH's folders.
"""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from comparing import close
from mumacro.__main__ import main

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


@pytest.fixture
def rumoca():
    return pytest.importorskip("rumoca", reason="the Modelica compiler rumoca is not installed")


def test_the_function_and_its_derivative_compile(rumoca, repository, tmp_path):
    source = Path(shutil.copy(repository / "examples" / "c" / "Mumacro.mo", tmp_path))
    assert [str(found) for found in rumoca.validate(str(source), model="Mumacro.SlidingMass")] == []
    model = rumoca.Session().load(str(source), model="Mumacro.SlidingMass")
    assert [one.name for one in model.states] == ["v"]


def test_support_friction_follows_the_law(rumoca, surrogate, capsys, tmp_path):
    folders = (Path(name) for name in os.environ.get("MODELICAPATH", "").split(os.pathsep) if name)
    library = next((folder for folder in folders if (folder / "Modelica" / "package.mo").is_file()), None)
    if library is None:
        pytest.skip("no folder of MODELICAPATH holds the Modelica Standard Library")
    words = " ".join(f"{name}={value!r}" for name, value in CASE.items())
    assert main(["law", words, "--modelica", repr(TOLERANCE)]) == 0
    (tmp_path / "Pulled.mo").write_text(MODEL.format(table=capsys.readouterr().out), "utf-8")
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
    law = CASE["Fz"] * surrogate.evaluate(**CASE, v0=speed[moves]).mu_macro
    assert np.abs(force[moves] - law).max() <= TOLERANCE * CASE["mu0"] * CASE["Fz"]
