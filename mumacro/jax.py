"""Friction inside JAX programs: the compiled kernel, called by XLA itself.  Needs the extra ``jax``."""

from typing import Any

import numpy as np

from mumacro.charts import QUANTITY_NAMES
from mumacro.errors import MumacroError
from mumacro.extras import missing
from mumacro.interop.derivatives import NO_THIRD, DifferentiableFriction, slopes_by_groups
from mumacro.library import Data, open_for_xla, xla_handler
from mumacro.surrogate import Surrogate

try:
    import jax
    import jax.numpy as jnp
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("jax", error), name=error.name) from None

_OPENED: dict[int, Data] = {}


class Friction(DifferentiableFriction):
    """The table's quantities as JAX functions: ``jit``, ``vmap``, ``grad``, ``jvp``, ``hessian``, ``scan`` work.

    See :class:`mumacro.interop.derivatives.DifferentiableFriction` for arguments and accuracy.  Programs run on the
    CPU.  Where a slope is infinite (v0 = 0 at y~ = 1, and for rigid contact), ``jacfwd`` gives NaN along every input.
    A call raises MumacroError while JAX has no double precision.

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

    def _open(self, table: int, surrogate: Surrogate) -> None:
        if not _OPENED:
            jax.ffi.register_ffi_target("mumacro", jax.ffi.pycapsule(xla_handler()), platform="cpu")
        if table not in _OPENED:
            _OPENED[table] = open_for_xla(table, surrogate.prepared())
        slopes = [_slopes_of_plane(table, code) for code in range(len(QUANTITY_NAMES))]
        self._known = {name: _value(table, code, slopes[code]) for code, name in enumerate(QUANTITY_NAMES)}
        self._known["mu_macro"] = _value(table, 0, _slopes_of_six(table, self._known["mu_ratio"], slopes[0]))

    def _call(self, quantity: str, *arguments: Any) -> Any:
        if not jax.config.jax_enable_x64:
            raise MumacroError('mumacro.jax needs double precision: jax.config.update("jax_enable_x64", True)')
        return self._known[quantity](*jnp.broadcast_arrays(*(jnp.asarray(x, jnp.float64) for x in arguments)))


def _ask(table: int, code: int, order: int, results: int, arguments: tuple[Any, ...]) -> Any:
    shape = jax.ShapeDtypeStruct(jnp.shape(arguments[0]), jnp.float64)
    call = jax.ffi.ffi_call("mumacro", [shape] * results, vmap_method="broadcast_all")
    return call(*arguments, order=np.int64(order), quantity=np.int64(code), table=np.int64(table))


def _along(slopes: Any, tangents: Any) -> Any:
    """The derivative along tangents; an infinite slope times a zero tangent is zero."""
    zero = jax.custom_derivatives.SymbolicZero
    return sum(slope * tangent for slope, tangent in zip(slopes, tangents, strict=True) if type(tangent) is not zero)


def _value(table: int, code: int, slopes: Any) -> Any:
    value = jax.custom_jvp(lambda *arguments: _ask(table, code, 0, 1, arguments)[0])
    value.defjvp(lambda at, moved: (value(*at), _along(slopes(*at), moved)), symbolic_zeros=True)
    return value


def _slopes_of_plane(table: int, code: int) -> Any:
    """d/dv~ and d/dy~ of a quantity, with their derivatives."""

    def no_third(*_: Any) -> Any:
        raise NotImplementedError(NO_THIRD)

    def rule(at: Any, moved: Any) -> Any:
        vv, vy, yy = bends(*at)
        return slopes(*at), [_along((vv, vy), moved), _along((vy, yy), moved)]

    bends = jax.custom_jvp(lambda *point: _ask(table, code, 2, 3, point))
    bends.defjvp(no_third)
    slopes = jax.custom_jvp(lambda *point: _ask(table, code, 1, 2, point))
    slopes.defjvp(rule, symbolic_zeros=True)
    return slopes


def _slopes_of_six(table: int, ratio: Any, slopes_of_ratio: Any) -> Any:
    """d mu_macro / d input, with their derivatives by the chain rule."""

    def rule(at: Any, moved: Any) -> Any:
        _, bent = jax.jvp(lambda *six: slopes_by_groups(ratio, slopes_of_ratio, six), at, moved)
        return slopes(*at), list(bent)

    slopes = jax.custom_jvp(lambda *six: _ask(table, 0, 1, 6, six))
    slopes.defjvp(rule)
    return slopes
