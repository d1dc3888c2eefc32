"""Friction inside JAX programs: values by callback, first derivatives from the table.  Needs the extra ``jax``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mumacro.errors import MumacroError
from mumacro.extras import missing
from mumacro.interop.derivatives import NO_SECOND, DifferentiableFriction, Quantity

try:
    import jax
    import jax.numpy as jnp
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("jax", error), name=error.name) from None

__all__ = ["Friction"]


class Friction(DifferentiableFriction):
    """The table's quantities as JAX functions: ``jit``, ``vmap``, ``grad``, ``jvp``, ``jacfwd`` and ``jacrev`` work.

    Parameters
    ----------
    surrogate : Surrogate, optional
        The table; left out, the tightest one that comes with the library.

    Notes
    -----
    Arguments broadcast together; results are float64 of the broadcast shape, NaN where a case is illegal.  The table
    is read on the host, also from a program on another device.  Second derivatives raise NotImplementedError.  Where a
    slope is infinite (v0 = 0 at y~ = 1, and for rigid contact), ``jacfwd`` gives NaN along every input.

    Raises
    ------
    MumacroError
        When a function is called while JAX has no double precision.

    Examples
    --------
    >>> import jax
    >>> jax.config.update("jax_enable_x64", True)
    >>> friction = Friction()
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}
    >>> slope = jax.jit(jax.grad(lambda v0: friction.mu_macro(**case, v0=v0)))(0.01)
    >>> print(f"{slope:.6f}")
    1.325086
    """

    def _made(self, quantity: Quantity) -> Any:
        return _differentiable(quantity)

    def _call(self, quantity: Any, *arguments: Any) -> Any:
        if not jax.config.jax_enable_x64:
            raise MumacroError('mumacro.jax needs double precision: jax.config.update("jax_enable_x64", True)')
        return quantity(*jnp.broadcast_arrays(*(jnp.asarray(x, jnp.float64) for x in arguments)))


def _differentiable(quantity: Quantity) -> Any:
    """``quantity`` as a JAX function with a rule for its derivative."""

    def ask(function: Callable[..., Any], trailing: tuple[int, ...], arguments: tuple[Any, ...]) -> Any:
        def on_the_host(*given: Any) -> Any:
            found = function(*(np.asarray(x) for x in given))
            return np.moveaxis(found, 0, -1) if trailing else found  # axes of vmap come first, slopes last

        shape = jax.ShapeDtypeStruct((*jnp.shape(arguments[0]), *trailing), jnp.float64)
        return jax.pure_callback(on_the_host, shape, *arguments, vmap_method="broadcast_all")

    def no_second(*_: Any) -> Any:
        raise NotImplementedError(NO_SECOND)

    slopes = jax.custom_jvp(lambda *arguments: ask(quantity.slopes, (len(quantity.inputs),), arguments))
    slopes.defjvp(no_second)
    value = jax.custom_jvp(lambda *arguments: ask(quantity.value, (), arguments))

    def rule(primals: Any, tangents: Any) -> Any:
        gradient = slopes(*primals)
        moved = [
            gradient[..., i] * tangent
            for i, tangent in enumerate(tangents)
            if type(tangent) is not jax.custom_derivatives.SymbolicZero  # infinite slope times zero tangent is zero
        ]
        return value(*primals), sum(moved)

    value.defjvp(rule, symbolic_zeros=True)
    return value
