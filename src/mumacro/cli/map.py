"""Run ``mumacro map``: draw the map of mu~, with a case on it."""

from collections.abc import Sequence

import numpy as np

from mumacro import plotting
from mumacro.cli import common
from mumacro.cli.common import UsageError, open_table, read_case
from mumacro.inputs.fields import kind_of


def run(words: Sequence[str]) -> str:
    """Run ``mumacro map``."""
    description = (
        "The map of mu~ = mu_macro/mu0 over the dimensionless speed and amplitude, with a case "
        "on it."
    )
    epilog = f"{common.ABOUT_INPUTS}\nexample:\n  mumacro map -o map.png"
    parser = common.question("map", description, epilog, "a case to mark, if any", "*")
    options = parser.parse_intermixed_args(words)
    if options.out is None:
        raise UsageError("a map is written to a file: give -o map.png")
    kind, surrogate = kind_of(options.contact, options.direction), open_table(options.table)
    answer = None
    if options.words:
        answer = surrogate.evaluate(read_case(options.words, kind).inputs, **kind.names)
    grid = np.meshgrid(plotting.speeds(141), plotting.amplitudes(101, kind.normal))
    v, y = (x.ravel() for x in grid)
    ranges = ((v[0], v[-1]), (y[0], y[-1]))
    columns = {
        "v_tilde": v,
        "y_tilde": y,
        "mu_ratio": surrogate.quantity("mu_ratio", v, y, **kind.names)[0],
    }
    text = common.write_result(
        options.out,
        columns,
        (lambda ax: surrogate.plot(ax, **kind.names)) if answer is None else answer.plot,
    )
    if answer is None:
        return text
    point = answer.v_tilde, answer.y_tilde
    if not all(low <= x <= high for x, (low, high) in zip(point, ranges, strict=True)):
        text += (
            f"\nthe case lies outside the map, at its edge: v~ = {point[0]:.6g}, "
            f"y~ = {point[1]:.6g}"
        )
    return text
