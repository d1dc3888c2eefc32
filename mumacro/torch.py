"""Friction inside PyTorch programs, see :class:`Friction`.  Needs the extra ``torch``."""

from mumacro.extras import missing

try:
    from mumacro.interop.torch import Friction
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("torch", error), name=error.name) from None

__all__ = ["Friction"]
