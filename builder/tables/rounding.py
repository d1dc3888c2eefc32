"""Round numbers of a file: bits below the tolerance become zeros, which zlib compresses.

Errors are those of the rounded numbers.
"""

import dataclasses
import math

import numpy as np

from mumacro.kernel.arrays import Array
from mumacro.table.blocks import Block

#: steps of rounding in one tolerance; with 64, mu~ of the coarsest table is no longer monotone to
#: rounding
STEPS = 256
ERROR_BITS = 3  # digits of the errors of the plain grid and of cells


def bits(tolerance: float) -> int:
    """Return the number of binary digits after the point for which the last digit is at most
    ``tolerance``/:data:`STEPS`."""
    return math.ceil(math.log2(STEPS / tolerance))


def to_step(values: Array, tolerance: float) -> Array:
    """Return ``values`` at multiples of a power of two; no value moves by more than half of
    ``tolerance``/:data:`STEPS`."""
    return np.asarray(np.ldexp(np.round(np.ldexp(values, bits(tolerance))), -bits(tolerance)))


def to_bits(values: Array, digits: int, away_from_zero: bool = False) -> Array:
    """Return ``values`` with ``digits`` binary digits each, to the nearest or away from zero."""
    mantissa, exponent = np.frexp(values)
    multiple = np.ldexp(mantissa, digits)
    whole = (
        np.copysign(np.ceil(np.abs(multiple)), multiple) if away_from_zero else np.round(multiple)
    )
    return np.asarray(np.ldexp(whole, exponent - digits))


def round_block(block: Block, tolerance: float) -> Block:
    """Return ``block`` with its node values rounded.

    Every tabulated function is of order one, and mu~ changes by about as much as it.  So one step
    for all values of a block is also right for the relative error of mu~.
    """
    return dataclasses.replace(
        block, nodes={name: to_step(x, tolerance) for name, x in block.nodes.items()}
    )
