"""What is gone says in one line what to use instead."""

import importlib

import pytest

from mumacro import MumacroError, Surrogate


@pytest.mark.parametrize("name", ["jax", "torch"])
def test_the_bindings_that_are_gone_name_the_recipe(name: str) -> None:
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module(f"mumacro.{name}")
    assert str(caught.value).startswith(
        f"mumacro.{name} is gone: use evaluate(gradient=True) inside {name}."
    )
    assert str(caught.value).endswith("docs/how-to/embed.md shows")


def test_derivatives_names_slopes_and_gradient() -> None:
    with pytest.raises(
        MumacroError, match=r"is gone: slopes\(.*, evaluate\(\.\.\., gradient=True\)"
    ) as caught:
        Surrogate.open().derivatives(0.1, 0.5, order=2)
    assert "\n" not in str(caught.value)
