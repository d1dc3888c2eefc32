"""The face of the library: its names, and what is imported before they are used."""

import importlib
import subprocess
import sys

import pytest

import mumacro


def test_modules_of_the_face_are_imported_by_its_names() -> None:
    for name in ("closed_forms", "plotting", "stiffness", "validity"):
        assert importlib.import_module(f"mumacro.{name}") is getattr(mumacro, name)


def test_the_face_is_what_users_need() -> None:
    assert {name for name in dir(mumacro) if not name.startswith("__")} == {
        *("open", "Surrogate", "Answer", "Fit", "Element", "Motion", "MotionSolution"),
        *("law", "solve_for", "fit", "motion", "solve_motion"),
        *("harmonics", "Harmonics", "fit_loop", "LoopFit"),
        *("stiffness", "closed_forms", "validity", "plotting"),
        *("InputError", "MumacroError", "TableError", "REGIMES", "SOURCES"),
    }
    assert set(mumacro.__all__) <= set(dir(mumacro))
    assert [name for name in mumacro.__all__ if not hasattr(mumacro, name)] == []


def test_a_method_of_a_surrogate_is_not_one_of_the_module_and_says_so() -> None:
    with pytest.raises(
        AttributeError, match=r"'evaluate': use mumacro\.open\(\)\.evaluate\("
    ) as caught:
        getattr(mumacro, "evaluate")  # noqa: B009 (a type checker refuses the name itself)
    assert caught.value.name == "evaluate"
    with pytest.raises(AttributeError, match=r"no attribute 'nothing'$"):
        getattr(mumacro, "nothing")  # noqa: B009


def loaded_by(code: str) -> set[str]:
    """The modules that a process has loaded after this code."""
    program = f"import sys\n{code}\nprint(*sys.modules)"
    return {*subprocess.check_output([sys.executable, "-c", program], text=True).split()}


OPTIONAL = {"matplotlib", "pandas", "scipy", "xarray", "dask", "pyarrow", "netCDF4", "rich"}


def test_the_library_loads_what_is_asked_of_it_and_no_more() -> None:
    assert loaded_by("import mumacro").isdisjoint({"numpy", *OPTIONAL})
    case = "mu0=0.3, Fz=10, k=1e6, y0=2e-6, f=20e3, v0=0.01"
    one_answer = loaded_by(f"import mumacro\nmumacro.open().evaluate({case}).mu_macro")
    rooms = {"mumacro.questions", "mumacro.motions", "mumacro.fits"}
    unused = {*rooms, "mumacro.validity", "mumacro.stiffness"}
    # declarations of C are parsed when the kernel is compiled
    assert one_answer.isdisjoint({*OPTIONAL, *unused, "cffi", "pycparser", "concurrent.futures"})


@pytest.mark.parametrize("name", mumacro.__all__)
def test_every_public_name_is_found_by_itself(name: str) -> None:
    code = f"import mumacro\nvalue = mumacro.{name}\nfrom mumacro import {name} as again\n"
    assert "mumacro" in loaded_by(f"{code}assert value is again and '{name}' in dir(mumacro)")


def test_no_module_hides_a_public_name() -> None:
    """Importing every module of mumacro sets names in the package; the public ones stay theirs."""
    code = """
import importlib, pkgutil, types, mumacro
before = {name: getattr(mumacro, name) for name in mumacro.__all__}
skipped = ("mumacro.__main__", "mumacro._")  # the command; a library of C, a hook
for module in pkgutil.walk_packages(mumacro.__path__, "mumacro."):
    if not module.name.startswith(skipped):
        importlib.import_module(module.name)
for name, value in before.items():
    assert getattr(mumacro, name) is value, name
called = {name for name, value in before.items() if isinstance(value, types.FunctionType)}
case = dict(mu0=0.3, Fz=10.0, k=1e6, f=20e3)
surrogate = mumacro.open()
mumacro.law(surrogate, along="v0", start=1e-3, stop=1.0, y0=2e-6, **case)
mumacro.solve_for(surrogate, "v0", 0.2, y0=2e-6, **case)
mumacro.motion(v0=0.01, y=2e-6, **case)
mumacro.solve_motion("v0", 0.2, y=2e-6, **case)
mumacro.harmonics([0.0, 1.0, 0.0, -1.0] * 4, most=3)
points = {"mu_macro": [0.1, 0.2], "v0": [0.005, 0.02]}
mumacro.fit({**points, "mu0": 0.3, "Fz": 10.0, "y0": 2e-6, "f": 20e3}, unknowns=["k"])
x = [0.0, 1e-6, 3e-6, 5e-6, 0.0, -5e-6, 0.0, 5e-6]
mumacro.fit_loop(x, [0.0, 1.0, 3.0, 3.0, -2.0, -3.0, 2.0, 3.0], Fz=10.0)
print(sorted(called))
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(
        ["fit", "fit_loop", "harmonics", "law", "motion", "solve_for", "solve_motion"]
    )
