"""Define the types of arrays, and make arrays as the kernel takes them: of one shape, flat and
contiguous."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Codes = NDArray[np.int8]  # of sources
Places = NDArray[np.intp]


def common_shape(arrays: Iterable[Array]) -> tuple[int, ...]:
    """Return the shape to which arrays broadcast.  Raise ValueError if they do not."""
    shapes = {array.shape for array in arrays}
    shapes.discard(())
    if len(shapes) > 1:
        return np.broadcast_shapes(*shapes)
    return shapes.pop() if shapes else ()


def flat(array: Array, shape: tuple[int, ...]) -> Array:
    """Return ``array`` broadcast to ``shape``, then made flat, contiguous and aligned."""
    if array.shape != shape:
        array = np.broadcast_to(array, shape)
    if not array.flags.carray:
        array = np.require(array, requirements=["C", "A"])
    return array if len(shape) == 1 else array.reshape(-1)
