"""One polynomial patch as eight-lane vector code: plain Python to read and to test, LLVM vectors when compiled.

LLVM does not turn eight scalar Horner chains into one vector chain by itself; written out, it is twice as
fast (benchmarks/kernel.py), on any processor: LLVM splits the vectors where the hardware has shorter ones.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

__all__ = ["patch_value"]

WIDTH = 8
_I32 = ir.IntType(32)


def patch_value(coef: Any, p: int, u: float, w: float) -> float:
    """Value of patch ``p`` of ``coef`` (patches, 8, 8) at local coordinates u, w in [-1, 1].

    Rows hold falling powers of w, columns falling powers of u.
    """
    row = [float(c) for c in coef[p, 0]]
    for k in range(1, WIDTH):
        row = [r * w + float(c) for r, c in zip(row, coef[p, k], strict=True)]
    out = row[0]
    for c in row[1:]:
        out = out * u + c
    return out


def _vector(n: int) -> ir.VectorType:
    return ir.VectorType(ir.DoubleType(), n)


def _index(positions: list[int]) -> ir.Constant:
    return ir.Constant(ir.VectorType(_I32, len(positions)), positions)


def _splat(builder: Any, x: Any, n: int) -> Any:
    undefined = ir.Constant(_vector(n), ir.Undefined)
    return builder.shuffle_vector(
        builder.insert_element(undefined, x, ir.Constant(_I32, 0)), undefined, _index([0] * n)
    )


def _part(builder: Any, v: Any, start: int, n: int) -> Any:
    return builder.shuffle_vector(v, ir.Constant(v.type, ir.Undefined), _index(list(range(start, start + n))))


def _multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    return builder.fadd(builder.fmul(a, b, flags=("contract",)), c, flags=("contract",))


@intrinsic
def _patch_vector(_typing: Any, coef: Any, _p: Any, _u: Any, _w: Any) -> Any:
    signature = types.float64(coef, types.int64, types.float64, types.float64)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        array, p, u, w = args
        data = context.make_array(sig.args[0])(context, builder, array).data
        base = builder.gep(data, [builder.mul(p, ir.Constant(ir.IntType(64), WIDTH * WIDTH))])
        rows = builder.bitcast(base, _vector(WIDTH).as_pointer())

        def row(k: int) -> Any:
            return builder.load(builder.gep(rows, [ir.Constant(_I32, k)]), align=8)

        wide = _splat(builder, w, WIDTH)
        acc = row(0)
        for k in range(1, WIDTH):
            acc = _multiply_add(builder, acc, wide, row(k))
        # the sum over powers of u by halves: u^4, u^2, u
        u2 = builder.fmul(u, u)
        u4 = builder.fmul(u2, u2)
        four = _multiply_add(builder, _part(builder, acc, 0, 4), _splat(builder, u4, 4), _part(builder, acc, 4, 4))
        two = _multiply_add(builder, _part(builder, four, 0, 2), _splat(builder, u2, 2), _part(builder, four, 2, 2))
        high = builder.extract_element(two, ir.Constant(_I32, 0))
        low = builder.extract_element(two, ir.Constant(_I32, 1))
        return _multiply_add(builder, high, u, low)

    return signature, codegen


@overload(patch_value, inline="always")
def _compiled_patch_value(coef: Any, p: Any, u: Any, w: Any) -> Any:  # noqa: ARG001 (numba reads the signature)
    def body(coef: Any, p: Any, u: Any, w: Any) -> Any:
        return _patch_vector(coef, p, u, w)  # type: ignore[call-arg]  # numba supplies the typing context

    return body
