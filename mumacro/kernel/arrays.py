"""The types of arrays."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Codes = NDArray[np.int8]  # of sources
Places = NDArray[np.intp]
