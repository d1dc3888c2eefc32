"""Friction inside PyTorch programs: a custom operator on the compiled kernel.  Needs the extra ``torch``."""

from typing import Any

import numpy as np

from mumacro import batch
from mumacro.charts import QUANTITY_NAMES
from mumacro.extras import missing
from mumacro.interop.derivatives import NO_THIRD, DifferentiableFriction, slopes_by_groups
from mumacro.library import Data, kernels
from mumacro.surrogate import Surrogate

try:
    import torch
    from torch.autograd.forward_ad import unpack_dual
    from torch.compiler import is_compiling
    from torch.func import debug_unwrap
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("torch", error), name=error.name) from None

_TABLES: dict[int, tuple[Data, int]] = {}  # data and threads


class Friction(DifferentiableFriction):
    """The table's quantities in PyTorch: ``backward``, ``torch.func.grad``, ``vmap``, ``torch.compile`` work.

    See :class:`mumacro.interop.derivatives.DifferentiableFriction` for arguments and accuracy.  Results are on the
    device of the tensors.  Derivatives are taken backwards, also twice and in batches; forward mode (``jvp``) raises
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

    def _open(self, table: int, surrogate: Surrogate) -> None:
        _TABLES.setdefault(table, (surrogate.prepared(), surrogate.threads))

    def _call(self, quantity: str, *arguments: Any) -> Any:
        device = next((x.device for x in arguments if isinstance(x, torch.Tensor)), None)
        tensors = [torch.as_tensor(x, dtype=torch.float64, device=device) for x in arguments]
        if len({x.shape for x in tensors}) > 1:
            tensors = torch.broadcast_tensors(*tensors)
        code = 0 if quantity == "mu_macro" else QUANTITY_NAMES.index(quantity)
        return _derivatives(torch.stack(tensors), self._table, code, 0)


def _derivatives(x: Any, table: int, code: int, order: int) -> Any:
    """Of a quantity at x (2, ...), v~ and y~, or of mu_macro at x (6, ...): value, slopes, second derivatives."""
    if is_compiling() or x.requires_grad or debug_unwrap(x) is not x or unpack_dual(x).tangent is not None:
        return _Followed.apply(x, table, code, order)
    return _OPERATOR(x, table, code, order)


class _Followed(torch.autograd.Function):  # type: ignore[misc]
    """The operator where derivatives may be wanted; ``register_autograd`` knows no ``torch.func.grad``."""

    generate_vmap_rule = True

    @staticmethod
    def forward(x: Any, table: int, code: int, order: int) -> Any:
        return _OPERATOR(x, table, code, order)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Any) -> None:  # noqa: ARG004
        x, ctx.table, ctx.code, ctx.order = inputs
        ctx.save_for_backward(x)

    @staticmethod
    def backward(ctx: Any, cotangent: Any) -> tuple[Any, ...]:
        (x,), table, code = ctx.saved_tensors, ctx.table, ctx.code
        if ctx.order == 2:
            raise NotImplementedError(NO_THIRD)
        if ctx.order == 0:
            moved = _derivatives(x, table, code, 1) * cotangent
        elif len(x) == 2:
            (vv, vy, yy), (v, y) = _derivatives(x, table, code, 2), cotangent
            moved = torch.stack((vv * v + vy * y, vy * v + yy * y))
        else:
            (moved,) = torch.func.vjp(lambda six: _by_groups(six, table), x)[1](cotangent)
        return moved, None, None, None


def _by_groups(six: Any, table: int) -> Any:
    ratio, slopes = (lambda *x, i=i: _derivatives(torch.stack(x), table, 0, i) for i in (0, 1))
    return torch.stack(slopes_by_groups(ratio, slopes, six))


def _on_host(x: Any, table: int, code: int, order: int) -> Any:
    (data, threads), given = _TABLES[table], np.ascontiguousarray(x.numpy(force=True))
    shape, rows = given.shape[1:], given.reshape(len(given), -1)
    if len(rows) == 6:
        found, _ = batch.cases(data, list(rows), rows.shape[1], threads, 17 if order else 3)
        found = found[5:11] if order else found[0]
    elif order == 0:
        found = batch.alone(code, data, rows[0], rows[1], threads)
    else:
        found = kernels[-1].derivatives(data, code, rows[0], rows[1], order)
    return torch.from_numpy(found.reshape(found.shape[:-1] + shape)).to(x.device)


def _in_graph(x: Any, table: int, code: int, order: int) -> Any:  # noqa: ARG001
    return x.new_empty((*((), (len(x),), (3,))[order], *x.shape[1:]))


def _in_batch(info: Any, dims: Any, x: Any, table: int, code: int, order: int) -> tuple[Any, int]:  # noqa: ARG001
    return _OPERATOR(x.movedim(dims[0], 1), table, code, order), min(order, 1)


torch.library.define("mumacro::derivatives", "(Tensor x, int table, int code, int order) -> Tensor")
torch.library.impl("mumacro::derivatives", "CompositeExplicitAutograd")(_on_host)
# _derivatives has decided on autograd; asking again takes a third of a scalar call
torch.library.impl("mumacro::derivatives", "Autograd")(torch.library.fallthrough_kernel)
torch.library.register_fake("mumacro::derivatives")(_in_graph)
torch.library.register_vmap("mumacro::derivatives", _in_batch)
_OPERATOR = torch.ops.mumacro.derivatives.default
