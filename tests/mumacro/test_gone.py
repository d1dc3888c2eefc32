"""What is gone says in one line what to use instead."""

import importlib
import subprocess
import sys

import pytest

import mumacro
from mumacro import MumacroError, Surrogate
from mumacro.moved import MOVED


@pytest.mark.parametrize("name", ["jax", "torch"])
def test_the_bindings_that_are_gone_name_the_recipe(name: str) -> None:
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module(f"mumacro.{name}")
    assert str(caught.value).startswith(
        f"mumacro.{name} is gone: use evaluate(gradient=True) inside {name}."
    )
    assert str(caught.value).endswith("docs/how-to/embed.md shows")


@pytest.mark.parametrize("name", MOVED)
def test_a_former_path_names_its_replacement_in_one_line(name: str) -> None:
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module(name)
    assert str(caught.value) == f"{name} is gone: use {MOVED[name]}"
    assert "\n" not in str(caught.value)


def test_modules_of_the_face_are_imported_by_its_names() -> None:
    for name in ("closed_forms", "plotting", "stiffness", "validity"):
        assert importlib.import_module(f"mumacro.{name}") is getattr(mumacro, name)


def test_the_face_is_what_users_need() -> None:
    assert {name for name in dir(mumacro) if not name.startswith("__")} == {
        *("open", "Surrogate", "Answer", "Fit", "Element", "Motion"),
        *("law", "solve_for", "settling", "fit", "motion"),
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


def test_importing_the_library_loads_no_optional_package() -> None:
    heavy = "matplotlib", "pandas", "scipy", "xarray", "dask", "pyarrow", "netCDF4"
    code = f"import sys, mumacro; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


def test_derivatives_names_slopes_and_gradient() -> None:
    with pytest.raises(
        MumacroError, match=r"is gone: slopes\(.*, evaluate\(\.\.\., gradient=True\)"
    ) as caught:
        Surrogate.open().derivatives(0.1, 0.5, order=2)
    assert "\n" not in str(caught.value)
