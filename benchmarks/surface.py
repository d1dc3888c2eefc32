"""The picture of the tabulated function: mu~ over speed and amplitude, with the border of
continuous sliding, as ``mumacro map`` draws it.

python benchmarks/surface.py [OUT]      (default: docs/img/surface.png)
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

from mumacro import Surrogate
from tests.support.measuring import IMAGES


def draw(surrogate: Surrogate, out: Path) -> None:
    """Write the picture, 900 x 600 pixels."""
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    surrogate.plot(figure.subplots())
    figure.savefig(out, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    draw(Surrogate.open(1e-10), Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "surface.png")
