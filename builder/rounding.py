"""Rounding of node values to the tolerance of their table: bits below it are zero, which zlib compresses.

Values are rounded before the errors are measured, so these are the errors of the numbers in the file.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from mumacro.table import Block

__all__ = ["STEPS", "bits", "round_block", "to_bits", "to_step"]

#: steps of rounding in one tolerance; with 64, mu~ of the coarsest table is no longer monotone to rounding
STEPS = 256
Array = NDArray[np.float64]


def bits(tolerance: float) -> int:
    """Binary digits after the point of which the last one is at most ``tolerance``/:data:`STEPS`."""
    return math.ceil(math.log2(STEPS / tolerance))


def to_step(values: Array, tolerance: float) -> Array:
    """``values`` at multiples of a power of two; none moves by more than half of ``tolerance``/:data:`STEPS`."""
    return np.asarray(np.ldexp(np.round(np.ldexp(values, bits(tolerance))), -bits(tolerance)))


def to_bits(values: Array, digits: int, up: bool = False) -> Array:
    """``values`` with ``digits`` binary digits each, to the nearest or, with ``up``, away from zero."""
    mantissa, exponent = np.frexp(values)
    scaled = np.ldexp(mantissa, digits)
    whole = np.copysign(np.ceil(np.abs(scaled)), scaled) if up else np.round(scaled)
    return np.asarray(np.ldexp(whole, exponent - digits))


def round_block(block: Block, tolerance: float) -> Block:
    """``block`` with its node values rounded.

    All that a block tabulates is of order one, and mu~ changes by at most about as much as what is tabulated: a step
    that is the same for all values of a block suits the relative error of mu~ too.
    """
    return dataclasses.replace(block, nodes={name: to_step(x, tolerance) for name, x in block.nodes.items()})
