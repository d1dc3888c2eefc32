"""Numbers rounded to the tolerance of their table: the rounding step, and the rounded values in files."""

import json
from pathlib import Path

import numpy as np
import pytest

from builder.rounding import STEPS, bits, round_block, to_bits, to_step
from mumacro.table import Block, read_table

TABLES = sorted((Path(__file__).parent.parent / "tables").glob("*.nc"))
TOLERANCES = (1e-2, 1e-4, 3.3e-8, 1e-12)


@pytest.fixture
def values() -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.concatenate([rng.uniform(-6.0, 6.0, 500), 10.0 ** rng.uniform(-9.0, 0.0, 500), [0.0, 1.0, -1.0]])


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_steps_are_powers_of_two_within_the_tolerance(values: np.ndarray, tolerance: float) -> None:
    step = 2.0 ** -bits(tolerance)
    assert step <= tolerance / STEPS < 2.0 * step
    rounded = to_step(values, tolerance)
    assert np.abs(rounded - values).max() <= 0.5 * step
    assert np.all(rounded / step == np.rint(rounded / step))
    assert np.array_equal(to_step(rounded, tolerance), rounded)
    assert np.array_equal(to_step(-values, tolerance), -rounded)


@pytest.mark.parametrize("digits", [3, 22, 48])
def test_digits_are_kept_at_every_size(values: np.ndarray, digits: int) -> None:
    near, above = to_bits(values, digits), to_bits(values, digits, up=True)
    size = np.abs(values)
    assert np.all(np.abs(near - values) <= 2.0**-digits * size)
    assert np.all((np.abs(above) >= size) & (np.abs(above) <= size * (1.0 + 2.0 ** (1 - digits))))
    assert np.all(np.sign(above) == np.sign(values))
    for rounded in (near, above):
        mantissa = np.ldexp(np.frexp(rounded)[0], digits)
        assert np.array_equal(mantissa, np.rint(mantissa))
    order = np.argsort(values)
    assert np.all(np.diff(near[order]) >= 0.0)


def test_a_block_without_stick_fraction_keeps_none() -> None:
    nodes = {"mu_ratio": np.full((2, 1), 1.0 / 3.0), "power": np.full((2, 1), 2.0 / 3.0)}
    block = Block(np.zeros(2), np.zeros(1), (1, 2), nodes)
    block.errors["power"] = np.array([0.5, 0.0, 0.25])
    rounded = round_block(block, 1e-3)
    assert rounded.nodes.keys() == nodes.keys()
    assert rounded.cells == (1, 2)
    assert rounded.errors == block.errors
    assert all(np.all(rounded.nodes[name] != block.nodes[name]) for name in nodes)


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_committed_nodes_are_rounded_to_what_their_block_was_built_for(path: Path) -> None:
    table = read_table(path)
    targets = json.loads(table.attributes["builder_options"])["block_targets"]
    for block, target in zip(table.blocks, targets, strict=True):
        for nodes in block.nodes.values():
            assert np.array_equal(nodes, to_step(nodes, target))
