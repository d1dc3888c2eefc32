"""Friction inside PyTorch programs: custom operators on the compiled kernel.  Needs the extra ``torch``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from threading import Lock
from typing import Any

from mumacro import batch
from mumacro.charts import QUANTITY_NAMES
from mumacro.extras import missing
from mumacro.inputs import FIELDS
from mumacro.interop.derivatives import NO_THIRD, DifferentiableFriction, slopes_by_groups
from mumacro.library import Data
from mumacro.surrogate import Surrogate

try:
    import torch
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("torch", error), name=error.name) from None

__all__ = ["Friction"]

_TABLES: list[
    tuple[Surrogate, Data]
] = []  # by the number that operators get; compiled programs may outlive every Friction
_OPENING = Lock()


class Friction(DifferentiableFriction):
    """The table's quantities as PyTorch operators: ``backward``, ``vmap``, ``torch.compile`` work.

    Parameters
    ----------
    surrogate : Surrogate, optional
        The table; left out, the tightest one that comes with the library.

    Notes
    -----
    Arguments, tensors or numbers, broadcast together; results are float64 of the broadcast shape, on the device of the
    tensors, NaN where a case is illegal.  The table is evaluated on the host.  Derivatives are taken backwards, also
    twice and in batches (``torch.autograd``, ``vmap``); operators of PyTorch know no ``torch.func.grad``.  First
    derivatives are those of the table; second ones are differences of them, see :mod:`mumacro.jax`; third ones raise
    an error.

    Examples
    --------
    >>> import torch
    >>> friction = Friction()
    >>> v0 = torch.tensor(0.01, dtype=torch.float64, requires_grad=True)
    >>> friction.mu_macro(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=v0).backward()
    >>> print(f"{v0.grad:.6f}")
    1.325086
    """

    def __init__(self, surrogate: Surrogate | None = None) -> None:
        surrogate = Surrogate.open() if surrogate is None else surrogate
        with _OPENING:
            same = (i for i, (known, _) in enumerate(_TABLES) if known.checksum == surrogate.checksum)
            self._table = next(same, len(_TABLES))
            if self._table == len(_TABLES):
                _TABLES.append((surrogate, surrogate.prepared()))

    def _call(self, quantity: str, *arguments: Any) -> Any:
        device = next((x.device for x in arguments if isinstance(x, torch.Tensor)), None)
        tensors = [torch.as_tensor(x, dtype=torch.float64, device=device) for x in arguments]
        if len({x.shape for x in tensors}) > 1:
            tensors = torch.broadcast_tensors(*tensors)
        if quantity == "mu_macro":
            return _CASES(*tensors, self._table, 0)
        return _POINTS(*tensors, self._table, QUANTITY_NAMES.index(quantity))


def _evaluated(table: int, code: int, order: int, arrays: list[Any]) -> Iterable[Any]:
    """Of cases mu_macro or its gradient; of points the value, the slopes, or d2/dv~2, d2/dv~ dy~, d2/dy~2."""
    surrogate, data = _TABLES[table]
    if len(arrays) == len(FIELDS):
        answer = surrogate.evaluate(dict(zip(FIELDS, arrays, strict=True)), gradient=order == 1)
        return answer.gradient.values() if order else [answer.mu_macro]
    v, y = arrays
    if order == 0:
        return [batch.alone(code, data, v, y, surrogate.threads)]
    return batch.derivatives(code, data, v, y, order)


def _operator(name: str, inputs: int, results: int, order: int, rule: Callable[..., Any]) -> Any:
    """Register ``mumacro::name``: tensors of one shape, the table, the quantity -> derivatives of an order.

    ``rule(tensors, table, code, cotangents)`` gives the cotangents of the tensors.
    """
    given, made = (", ".join(f"Tensor {letter}{i}" for i in range(n)) for letter, n in (("x", inputs), ("y", results)))
    torch.library.define(f"mumacro::{name}", f"({given}, int table, int code) -> ({made})")
    operator = getattr(torch.ops.mumacro, name).default

    def packed(found: Iterable[Any]) -> Any:
        return tuple(found) if results > 1 else next(iter(found))

    def host(*arguments: Any) -> Any:
        *tensors, table, code = arguments
        arrays = [x.detach().cpu().contiguous().view(-1).numpy() for x in tensors]
        found = _evaluated(table, code, order, arrays)
        return packed(torch.from_numpy(x).view(tensors[0].shape).to(tensors[0].device) for x in found)

    def empty(*arguments: Any) -> Any:
        return packed(arguments[0].new_empty(arguments[0].shape) for _ in range(results))

    def batched(info: Any, in_dims: tuple[Any, ...], *arguments: Any) -> Any:
        *tensors, table, code = arguments
        front = [
            x.expand(info.batch_size, *x.shape) if dim is None else x.movedim(dim, 0)
            for x, dim in zip(tensors, in_dims[:-2], strict=True)
        ]
        return operator(*front, table, code), packed([0] * results)

    def remember(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:  # noqa: ARG001 (PyTorch gives it by name)
        *tensors, ctx.table, ctx.code = inputs
        ctx.save_for_backward(*tensors)

    def backward(ctx: Any, *cotangents: Any) -> Any:
        return *rule(ctx.saved_tensors, ctx.table, ctx.code, cotangents), None, None

    torch.library.impl(f"mumacro::{name}", "CompositeExplicitAutograd")(host)
    torch.library.register_fake(f"mumacro::{name}")(empty)
    torch.library.register_vmap(f"mumacro::{name}", batched)
    torch.library.register_autograd(f"mumacro::{name}", backward, setup_context=remember)
    return operator


def _no_third(*_: Any) -> Any:
    raise NotImplementedError(NO_THIRD)


def _by_bends(point: Any, table: int, code: int, cotangents: Any) -> Any:
    vv, vy, yy = _BENDS(*point, table, code)
    return vv * cotangents[0] + vy * cotangents[1], vy * cotangents[0] + yy * cotangents[1]


def _by_groups(six: Any, table: int, _: int, cotangents: Any) -> Any:
    with torch.enable_grad():
        leaves = [x.detach().requires_grad_() for x in six]
        found = slopes_by_groups(lambda v, y: _POINTS(v, y, table, 0), lambda v, y: _SLOPES(v, y, table, 0), leaves)
    return torch.autograd.grad(found, leaves, cotangents)


def _by(slopes: Any) -> Callable[..., Any]:
    return lambda tensors, table, code, cotangents: (x * cotangents[0] for x in slopes(*tensors, table, code))


_BENDS = _operator("bends", 2, 3, 2, _no_third)
_SLOPES = _operator("slopes", 2, 2, 1, _by_bends)
_POINTS = _operator("points", 2, 1, 0, _by(_SLOPES))
_GRADIENT = _operator("gradient", 6, 6, 1, _by_groups)
_CASES = _operator("cases", 6, 1, 0, _by(_GRADIENT))
