"""Friction inside JAX programs, see :class:`Friction`.  Needs the extra ``jax``."""

from mumacro.extras import missing

try:
    from mumacro.interop.jax import Friction
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("jax", error), name=error.name) from None

__all__ = ["Friction"]
