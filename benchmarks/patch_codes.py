"""Other ways to evaluate a patch than the kernel's: other degrees, Chebyshev polynomials, eight points at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from friction.patch_simd import _index, _multiply_add, _part, _splat, _vector

__all__ = ["chebyshev_code", "gathering_code", "power_code"]

_I32, _I64 = ir.IntType(32), ir.IntType(64)
LANES = 8


def _rows(context: Any, builder: Any, sig: Any, args: Any, shape: tuple[int, int]) -> Callable[[int], list[Any]]:
    """A function that loads one row of the patch, in vectors of a power of two lanes each, the shortest first."""
    data = context.make_array(sig.args[0])(context, builder, args[0]).data
    base = builder.gep(data, [builder.mul(args[1], ir.Constant(_I64, shape[0] * shape[1]))])
    first = builder.bitcast(base, ir.DoubleType().as_pointer())
    sizes = [2**k for k in range(4) if shape[1] & 2**k]

    def row(k: int) -> list[Any]:
        found, start = [], shape[1] * k
        for lanes in sizes:
            at = builder.bitcast(builder.gep(first, [ir.Constant(_I32, start)]), _vector(lanes).as_pointer())
            found.append(builder.load(at, align=8))
            start += lanes
        return found

    return row


def _widen(builder: Any, v: Any, lanes: int) -> Any:
    """``v`` behind as many zeros as make ``lanes`` of it."""
    n = v.type.count
    positions = [n + i % n for i in range(lanes - n)] + list(range(n))
    return builder.shuffle_vector(v, ir.Constant(v.type, None), _index(positions))


def power_code(rows: int, columns: int) -> Any:
    """:func:`friction.patch_simd.patch_value` for patches (patches, rows, columns); fewer than 16 columns."""

    @intrinsic  # type: ignore[untyped-decorator,unused-ignore]
    def patch(_typing: Any, coef: Any, _p: Any, _u: Any, _w: Any) -> Any:
        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            _, _, u, w = args
            row = _rows(context, builder, sig, args, (rows, columns))
            acc = row(0)
            for k in range(1, rows):
                acc = [
                    _multiply_add(builder, a, _splat(builder, w, a.type.count), r)
                    for a, r in zip(acc, row(k), strict=True)
                ]
            # the sum over powers of u: from vector to longer vector, then by halves
            powers = {1: u, 2: builder.fmul(u, u)}
            powers[4] = builder.fmul(powers[2], powers[2])
            powers[8] = builder.fmul(powers[4], powers[4])
            total = acc[0]
            for longer in acc[1:]:
                n = longer.type.count
                total = _multiply_add(builder, _widen(builder, total, n), _splat(builder, powers[n], n), longer)
            while total.type.count > 1:
                n = total.type.count // 2
                high, low = _part(builder, total, 0, n), _part(builder, total, n, n)
                total = _multiply_add(builder, high, _splat(builder, powers[n], n), low)
            return builder.extract_element(total, ir.Constant(_I32, 0))

        return types.float64(coef, types.int64, types.float64, types.float64), codegen

    return patch


def chebyshev_code() -> Any:
    """The same in rising Chebyshev polynomials, eight by eight: Clenshaw in w, T_(m+n) = 2 T_m T_n - T_(m-n) in u."""

    @intrinsic  # type: ignore[untyped-decorator,unused-ignore]
    def patch(_typing: Any, coef: Any, _p: Any, _u: Any, _w: Any) -> Any:
        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            _, _, u, w = args
            parts = _rows(context, builder, sig, args, (LANES, LANES))

            def row(k: int) -> Any:
                return parts(k)[0]

            def number(x: float) -> Any:
                return ir.Constant(ir.DoubleType(), x)

            def less(a: Any, b: Any) -> Any:
                return builder.fsub(a, b, flags=("contract",))

            double = _splat(builder, builder.fmul(w, number(2.0)), LANES)
            after, here = row(LANES - 1), _multiply_add(builder, double, row(LANES - 1), row(LANES - 2))
            for k in range(LANES - 3, 0, -1):
                after, here = here, _multiply_add(builder, double, here, less(row(k), after))
            acc = _multiply_add(builder, _splat(builder, w, LANES), here, less(row(0), after))
            twice = builder.fmul(u, number(2.0))
            t2 = less(builder.fmul(twice, u), number(1.0))
            t4 = less(builder.fmul(builder.fmul(t2, number(2.0)), t2), number(1.0))
            for lanes, t in ((4, t4), (2, t2)):
                low, high = _part(builder, acc, 0, lanes), _part(builder, acc, lanes, lanes)
                # sum over j < lanes of high_j T_(lanes + j): T_lanes for j = 0, 2 T_lanes T_j - T_(lanes - j) else
                factor = _splat(builder, builder.fmul(t, number(2.0)), lanes)
                factor = builder.insert_element(factor, t, ir.Constant(_I32, 0))
                zeros = ir.Constant(high.type, None)
                turned = builder.shuffle_vector(high, zeros, _index([lanes, *range(lanes - 1, 0, -1)]))
                acc = _multiply_add(builder, factor, high, less(low, turned))
            first, second = (builder.extract_element(acc, ir.Constant(_I32, i)) for i in (0, 1))
            return _multiply_add(builder, second, u, first)

        return types.float64(coef, types.int64, types.float64, types.float64), codegen

    return patch


def gathering_code(width: int) -> Any:
    """Horner for eight points in eight lanes, coefficients gathered: (coef, p, u, w, out, i) fills out[i:i+8]."""

    @intrinsic  # type: ignore[untyped-decorator,unused-ignore]
    def patches(_typing: Any, coef: Any, p: Any, u: Any, w: Any, out: Any, _i: Any) -> Any:
        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            data = [
                context.make_array(t)(context, builder, a).data for t, a in zip(sig.args[:5], args[:5], strict=True)
            ]
            i = args[5]

            def eight(array: Any, kind: Any) -> Any:
                at = builder.bitcast(builder.gep(array, [i]), kind.as_pointer())
                return builder.load(at, align=8)

            whole = ir.VectorType(_I64, LANES)
            patch, x, z = eight(data[1], whole), eight(data[2], _vector(LANES)), eight(data[3], _vector(LANES))
            first = builder.mul(patch, ir.Constant(whole, [width * width] * LANES))
            base = builder.ptrtoint(data[0], _I64)
            start = builder.add(
                builder.mul(first, ir.Constant(whole, [8] * LANES)),
                builder.shuffle_vector(
                    builder.insert_element(ir.Constant(whole, ir.Undefined), base, ir.Constant(_I32, 0)),
                    ir.Constant(whole, ir.Undefined), _index([0] * LANES),
                ),
            )  # fmt: skip
            pointers = ir.VectorType(ir.DoubleType().as_pointer(), LANES)
            mask = ir.VectorType(ir.IntType(1), LANES)
            kind = ir.FunctionType(_vector(LANES), [pointers, _I32, mask, _vector(LANES)])
            name = "llvm.masked.gather.v8f64.v8p0"
            gather = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)

            def column(k: int, j: int) -> Any:
                at = builder.add(start, ir.Constant(whole, [8 * (width * k + j)] * LANES))
                return builder.call(gather, [
                    builder.inttoptr(at, pointers), ir.Constant(_I32, 8), ir.Constant(mask, [1] * LANES),
                    ir.Constant(_vector(LANES), ir.Undefined),
                ])  # fmt: skip

            total = None
            for j in range(width):
                inner = column(0, j)
                for k in range(1, width):
                    inner = _multiply_add(builder, inner, z, column(k, j))
                total = inner if total is None else _multiply_add(builder, total, x, inner)
            at = builder.bitcast(builder.gep(data[4], [i]), _vector(LANES).as_pointer())
            builder.store(total, at, align=8)
            return context.get_dummy_value()

        return types.void(coef, p, u, w, out, types.int64), codegen

    return patches
