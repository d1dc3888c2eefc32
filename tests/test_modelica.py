"""Modelica: the function around the C header.  The compiler is Rumoca (``pip install rumoca``)."""

import shutil
from pathlib import Path

import pytest


@pytest.fixture
def rumoca():
    return pytest.importorskip("rumoca", reason="the Modelica compiler rumoca is not installed")


def test_the_function_and_its_derivative_compile(rumoca, repository, tmp_path):
    source = Path(shutil.copy(repository / "examples" / "c" / "Mumacro.mo", tmp_path))
    assert [str(found) for found in rumoca.validate(str(source), model="Mumacro.SlidingMass")] == []
    model = rumoca.Session().load(str(source), model="Mumacro.SlidingMass")
    assert [one.name for one in model.states] == ["v"]
