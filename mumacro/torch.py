"""Friction inside PyTorch programs: values and first derivatives from the table.  Needs the extra ``torch``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mumacro.extras import missing
from mumacro.interop.derivatives import NO_SECOND, DifferentiableFriction, Quantity

try:
    import torch
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("torch", error), name=error.name) from None

__all__ = ["Friction"]


class Friction(DifferentiableFriction):
    """The table's quantities as PyTorch functions: ``backward``, ``torch.func`` (grad, jvp, jacfwd, jacrev, vmap) work.

    Parameters
    ----------
    surrogate : Surrogate, optional
        The table; left out, the tightest one that comes with the library.

    Notes
    -----
    Arguments, tensors or numbers, broadcast together; results are float64 of the broadcast shape, on the device of the
    tensors, NaN where a case is illegal.  The table is evaluated on the host.  Second derivatives raise
    NotImplementedError.

    Examples
    --------
    >>> import torch
    >>> friction = Friction()
    >>> v0 = torch.tensor(0.01, dtype=torch.float64, requires_grad=True)
    >>> friction.mu_macro(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=v0).backward()
    >>> print(f"{v0.grad:.6f}")
    1.325086
    """

    def _call(self, quantity: Quantity, *arguments: Any) -> Any:
        device = next((x.device for x in arguments if isinstance(x, torch.Tensor)), None)
        tensors = (torch.as_tensor(x, dtype=torch.float64, device=device) for x in arguments)
        return _Value.apply(quantity, *torch.broadcast_tensors(*tensors))


def _ask(function: Callable[..., Any], tensors: tuple[Any, ...]) -> Any:
    found = function(*(x.detach().cpu().numpy() for x in tensors))
    return torch.from_numpy(np.asarray(found, order="C")).to(tensors[0].device)


def _batched(function: Any, size: int, dims: tuple[Any, ...], quantity: Quantity, tensors: tuple[Any, ...]) -> Any:
    """``function`` of tensors with a further axis, brought to the front; it works point by point."""
    front = [
        x.expand(size, *x.shape) if dim is None else x.movedim(dim, 0) for x, dim in zip(tensors, dims[1:], strict=True)
    ]
    return function.apply(quantity, *front)


class _Slopes(torch.autograd.Function):  # type: ignore[misc]
    """The slopes along the inputs, (inputs, *shape)."""

    @staticmethod
    def forward(quantity: Quantity, *tensors: Any) -> Any:
        return _ask(quantity.slopes, tensors)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:
        """Stores nothing: there is no further derivative."""

    @staticmethod
    def backward(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(NO_SECOND)

    @staticmethod
    def jvp(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(NO_SECOND)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], quantity: Quantity, *tensors: Any) -> tuple[Any, int]:
        return _batched(_Slopes, info.batch_size, in_dims, quantity, tensors), 1


class _Value(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(quantity: Quantity, *tensors: Any) -> Any:
        return _ask(quantity.value, tensors)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:  # noqa: ARG004
        ctx.quantity, *tensors = inputs
        ctx.save_for_backward(*tensors)
        ctx.save_for_forward(*tensors)

    @staticmethod
    def backward(ctx: Any, *cotangents: Any) -> Any:
        slopes = _Slopes.apply(ctx.quantity, *ctx.saved_tensors)
        needed = ctx.needs_input_grad[1:]
        return None, *(slope * cotangents[0] if need else None for slope, need in zip(slopes, needed, strict=True))

    @staticmethod
    def jvp(ctx: Any, _: Any, *tangents: Any) -> Any:
        slopes = _Slopes.apply(ctx.quantity, *ctx.saved_tensors)
        moved = [slope * tangent for slope, tangent in zip(slopes, tangents, strict=True) if tangent is not None]
        return torch.stack(moved).sum(0)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[Any, ...], quantity: Quantity, *tensors: Any) -> tuple[Any, int]:
        return _batched(_Value, info.batch_size, in_dims, quantity, tensors), 0
