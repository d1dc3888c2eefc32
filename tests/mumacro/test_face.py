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
    unused = {"mumacro.analysis", "mumacro.validity", "mumacro.stiffness"}
    # declarations of C are parsed when the kernel is compiled
    assert one_answer.isdisjoint({*OPTIONAL, *unused, "cffi", "pycparser", "concurrent.futures"})


@pytest.mark.parametrize("name", mumacro.__all__)
def test_every_public_name_is_found_by_itself(name: str) -> None:
    code = f"import mumacro\nvalue = mumacro.{name}\nfrom mumacro import {name} as again\n"
    assert "mumacro" in loaded_by(f"{code}assert value is again and '{name}' in dir(mumacro)")
