"""The picture of the tabulated function: mu~ over speed and amplitude, with the border of
continuous sliding, as ``mumacro map`` draws it.

python benchmarks/surface.py [OUT]      (default: docs/img/surface.png)
"""

import sys
from pathlib import Path

from mumacro import Surrogate
from mumacro.plotting import save
from tests.support.measuring import IMAGES


def draw(surrogate: Surrogate, out: Path) -> None:
    """Write the picture, 900 x 600 pixels."""
    save(out, surrogate.plot, dpi=100, figsize=(9.0, 6.0))


if __name__ == "__main__":
    draw(Surrogate.open(1e-10), Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "surface.png")
