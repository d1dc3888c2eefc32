"""How loops are compiled, and machine instructions that numba has no name for.

Half a product, zeros at either end, eight bytes in or out.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

__all__ = [
    "inlined",
    "leading_zeros",
    "load_eight",
    "loop",
    "multiply_high",
    "other_than_digits",
    "store_eight",
    "trailing_zeros",
]

Function = TypeVar("Function", bound=Callable[..., Any])


def loop(function: Function) -> Function:
    """Compile as everything in this folder is: kept on disk, without the interpreter's lock, without a handler for
    division by zero, and without counting references to arrays.

    No loop here makes an array, and the caller holds those that it gives; counting them would cost an atomic
    instruction per array with every call from loop to loop.
    """
    return _compiled(function, False)


def inlined(function: Function) -> Function:
    """Compile as :func:`loop` does, into the callers."""
    return _compiled(function, True)


def _compiled(function: Function, inline: bool) -> Function:
    options: Any = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False, "forceinline": inline}
    made: Function = njit(**options)(function)
    return made


_I64, _I128 = ir.IntType(64), ir.IntType(128)
_BYTES = ir.VectorType(ir.IntType(8), 32)


@intrinsic
def multiply_high(_typing: Any, _a: Any, _b: Any) -> Any:
    """Upper 64 bits of the product of two uint64."""
    signature = types.uint64(types.uint64, types.uint64)

    def codegen(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        a, b = (builder.zext(value, _I128) for value in args)
        return builder.trunc(builder.lshr(builder.mul(a, b), ir.Constant(_I128, 64)), _I64)

    return signature, codegen


@intrinsic
def leading_zeros(_typing: Any, _w: Any) -> Any:
    """Zero bits above the highest set one of a uint64; 64 for 0."""
    signature = types.int64(types.uint64)

    def codegen(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return builder.ctlz(args[0], ir.Constant(ir.IntType(1), 0))

    return signature, codegen


@intrinsic
def trailing_zeros(_typing: Any, _w: Any) -> Any:
    """Zero bits below the lowest set one of a uint64; 64 for 0."""
    signature = types.int64(types.uint64)

    def codegen(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 0))

    return signature, codegen


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, index: Any, pointed: Any = _I64) -> Any:
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), pointed.as_pointer())


@intrinsic
def load_eight(_typing: Any, text: Any, _index: Any) -> Any:
    """The eight bytes of a uint8 array from an index on, as a little-endian uint64.  They must all be there."""
    signature = types.uint64(text, types.int64)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_pointer(context, builder, sig.args[0], args[0], args[1]), align=1)

    return signature, codegen


@intrinsic
def other_than_digits(_typing: Any, text: Any, _index: Any) -> Any:
    """Bit j set where byte j from an index on is no digit, for 32 bytes that must all be there; all bits above, too."""
    signature = types.uint64(text, types.int64)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = builder.load(_pointer(context, builder, sig.args[0], args[0], args[1], _BYTES), align=1)
        others = builder.icmp_unsigned(
            ">", builder.sub(data, ir.Constant(_BYTES, [48] * 32)), ir.Constant(_BYTES, [9] * 32)
        )
        mask = builder.zext(builder.bitcast(others, ir.IntType(32)), _I64)
        return builder.or_(mask, ir.Constant(_I64, 0xFFFFFFFF << 32))

    return signature, codegen


@intrinsic
def store_eight(_typing: Any, out: Any, _index: Any, _word: Any) -> Any:
    """Put a uint64 into a uint8 array, little-endian, from an index on.  There must be room for all eight bytes."""
    signature = types.void(out, types.int64, types.uint64)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[2], _pointer(context, builder, sig.args[0], args[0], args[1]), align=1)
        return context.get_dummy_value()

    return signature, codegen
