"""Many points at once against one by one: the same bits, for all positions and numbers of
points."""

from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.inputs.fields import Kind
from mumacro.kernel import threads as slices
from mumacro.kernel.binding import CaseRows, Kernel, kernels
from mumacro.table import atlas
from mumacro.table.atlas import (
    CHARTS,
    RHO_MAX,
    SIGMA_CUT,
    Y_CONT,
    Y_HIGH,
    Y_MID,
    Y_STICK_LO,
    Y_TAIL,
)
from mumacro.table.polynomials import outer_cells
from tests.support.cases import Array, log_uniform, tables
from tests.support.comparing import close

SPRING_CHARTS = CHARTS["spring"]
CHUNK = 256  # points that the kernel's passes take together
table = tables(1e-4, 1e-12)


def one_by_one(table: Surrogate, v: Array, y: Array, name: str = "mu_ratio") -> list[Array]:
    """Value, bound, source, slopes and their bounds of points (n,), each an array of one."""
    data, code = table.tabulated.data(name), atlas.QUANTITY_NAMES.index(name)
    rows = []
    for i in range(v.size):
        one = slice(i, i + 1)
        rows.append(
            (
                *slices.values(code, data, v[one], y[one], 1),
                *slices.slopes(code, data, v[one], y[one], 1),
            )
        )
    return [np.concatenate(part) for part in zip(*rows, strict=True)]


def around(x: Array) -> Array:
    """``x`` and its neighbours among the doubles."""
    return np.concatenate([x, np.nextafter(x, 0.0), np.nextafter(x, np.inf)])


def same(table: Surrogate, v: Array, y: Array, name: str = "mu_ratio") -> None:
    value, bound, source, *slopes = one_by_one(table, v, y, name)
    for many, alone in zip(table.quantity(name, v, y), (value, bound, source), strict=True):
        np.testing.assert_array_equal(many, alone)
    points = [table.quantity(name, float(a), float(b)) for a, b in zip(v, y, strict=True)]
    for plain, alone in zip(zip(*points, strict=True), (value, bound, source), strict=True):
        np.testing.assert_array_equal(plain, alone)
    for many, alone in zip(table.slopes(v, y, name, bounds=True), slopes, strict=True):
        np.testing.assert_array_equal(many, alone)
    assert np.all((value >= 0.0) & (bound >= 0.0))
    if name == "mu_ratio":
        np.testing.assert_array_equal(table.mu_ratio(v, y), value)
        np.testing.assert_array_equal(
            [table.mu_ratio(float(a), float(b)) for a, b in zip(v, y, strict=True)], value
        )
        assert np.all(value <= 1.0)


@pytest.mark.parametrize("name", atlas.QUANTITY_NAMES)
def test_over_the_whole_quadrant_and_next_to_the_corner(table: Surrogate, name: str) -> None:
    rng, n = np.random.default_rng(5), 3000
    v = [log_uniform(rng, *ends, n) for ends in ((1e-14, 1e10), (1e-3, 1e3), (1e-8, 0.1))]
    y = [
        log_uniform(rng, 1e-10, 1e14, n),
        log_uniform(rng, 1e-3, 1e3, n),
        1.0 + rng.uniform(-0.25, 0.5, n),
    ]
    same(table, np.concatenate(v), np.concatenate(y), name)
    source = table.quantity(name, np.concatenate(v), np.concatenate(y))[2]
    assert np.unique(source).size >= len(SPRING_CHARTS) - 1
    assert np.count_nonzero(source == atlas.BLOCK_NAMES.index("corner")) > 500


def test_on_both_sides_of_every_seam(table: Surrogate) -> None:
    rng = np.random.default_rng(6)
    y = around(np.repeat([Y_STICK_LO, 1.0, Y_CONT, Y_MID, Y_HIGH, Y_TAIL], 50))
    same(table, 10.0 ** rng.uniform(-8.0, 6.0, y.size), y)
    y = 10.0 ** rng.uniform(-3.0, 6.0, 1000)
    for share in (1.0, 0.5, RHO_MAX, SIGMA_CUT**2):
        for v in np.split(around(table.v_tilde_crit(y) * share), 3):
            same(table, v, y)


def test_on_every_edge_of_every_cell(table: Surrogate) -> None:
    """Where rounding decides which of two cells is used."""
    rng = np.random.default_rng(7)
    axes = [
        (chart.a, block.cells[0])
        for chart, block in zip(SPRING_CHARTS, table.table.contacts["spring"].blocks, strict=True)
    ]
    axes += [
        (axis, p.cells)
        for (_, axis, _), p in zip(atlas.BORDER_PIECES, table.table.border, strict=True)
    ]
    ends = []
    for axis, cells in axes:
        edges = np.linspace(axis.low, axis.high, cells + 1)
        if axis.name != "radius":
            ends.append(axis.amplitude(edges[edges > 0.0]))
    y = around(np.concatenate(ends))
    y = y[y > 0.0]
    for _ in range(3):
        v = table.v_tilde_crit(y) * 10.0 ** rng.uniform(-3.0, 3.0, y.size)
        same(table, v, y)


@pytest.mark.parametrize("n", [0, 1, 2, 7, 8, 9, CHUNK - 1, CHUNK, CHUNK + 1, 3 * CHUNK + 5])
def test_any_number_of_points_at_any_position(table: Surrogate, n: int) -> None:
    rng = np.random.default_rng(n)
    v, y, order = log_uniform(rng, 1e-3, 1e3, n), log_uniform(rng, 1e-3, 1e3, n), rng.permutation(n)
    expected = np.array([table.mu_ratio(float(a), float(b)) for a, b in zip(v, y, strict=True)])
    np.testing.assert_array_equal(table.mu_ratio(v, y), expected)
    np.testing.assert_array_equal(table.mu_ratio(v[order], y[order]), expected[order])
    np.testing.assert_array_equal(table.mu_ratio(v[3:], y[3:]), expected[3:])


# --- the arithmetic behind it ---------------------------------------------------------------------


@pytest.mark.parametrize("kernel", kernels, ids=lambda kernel: kernel.level)
def test_the_logarithm_is_close_to_the_libraries_and_never_falls(
    table: Surrogate, kernel: Kernel
) -> None:
    """Where ln y~ is the coordinate: the logarithm of any y~, and of neighbouring doubles."""
    for start in (3.5, 4.0, 8.0, 16.0, 31.0, 1e3, 1e5):
        y = np.unique(start * (1.0 + np.arange(-2000, 2000) * 1e-15))
        _, a, _ = kernel.places(table.tabulated.data(), 0.3 * table.v_tilde_crit(y), y)
        assert np.all(np.abs(a - np.log(y)) <= 4.5e-16 * np.maximum(1.0, np.log(y)))
        assert np.all(np.diff(a) >= -2.3e-16 * np.log(start))
    y = np.geomspace(3.0 + 1e-9, 131_072.0, 20_000)
    _, a, _ = kernel.places(table.tabulated.data(), 0.3 * table.v_tilde_crit(y), y)
    assert np.all(np.abs(a - np.log(y)) <= 4.5e-16 * np.maximum(1.0, np.log(y)))


def test_cells_of_the_limit_of_large_speed_are_the_closed_form() -> None:
    cells, top = kernels[-1].atlas.outer_cells, kernels[-1].atlas.outer_log_max
    x = np.concatenate([np.linspace(0.0, top * (1.0 - 1e-12), 3000), np.geomspace(1e-15, 1.0, 200)])
    f, g, slope, _, _ = kernels[-1].outer_expansion(np.sqrt(np.expm1(x))).T
    cell = np.minimum((x * cells / top).astype(int), cells - 1)
    u = 2.0 * (x * cells / top - cell) - 1.0
    first, rest = (
        np.sum(outer_cells()[cell, term] * u[:, None] ** np.arange(7, -1, -1), axis=1)
        for term in (0, 1)
    )
    assert first == close(f, abs=1e-15)
    # taken times 1 / (1 + v~^2) < 1e-3, and not known better in closed form
    assert rest == close(g + 0.5 * slope, abs=1e-14)


# --- the levels of the processor ------------------------------------------------------------------


@pytest.mark.parametrize("name", atlas.QUANTITY_NAMES)
def test_every_level_with_fused_multiply_add_gives_the_same_bits(
    table: Surrogate, name: str
) -> None:
    rng, n = np.random.default_rng(12), 20_000
    v, y = log_uniform(rng, 1e-9, 1e6, n), log_uniform(rng, 1e-6, 1e8, n)
    code, data = atlas.QUANTITY_NAMES.index(name), table.tabulated.data(name)

    def rows_of(kernel: Kernel) -> list[Any]:
        rows: list[Any] = [np.empty(n), np.empty(n), np.empty(n, np.int8), np.empty((5, n))]
        kernel.values(data, code, v, y, *rows[:3])
        kernel.slopes(data, code, v, y, rows[3])
        return rows

    best = rows_of(kernels[-1])
    for kernel in kernels[:-1]:
        rows = rows_of(kernel)
        if kernel.level != "base":
            for ours, theirs in zip(rows, best, strict=True):
                np.testing.assert_array_equal(ours, theirs)
            continue
        # without fused multiply-add: within the allowance for rounding that both bounds contain
        same = (rows[2] == best[2]) & (np.abs(v / table.v_tilde_crit(y) - 1.0) > 1e-6)
        assert np.mean(rows[2] == best[2]) > 0.9999
        off = np.abs(rows[0] - best[0])
        assert np.all((off <= 1e-13 * (1.0 + np.abs(best[0])))[same] & (off <= 2.0 * rows[1])[same])
        assert np.all((np.abs(rows[3][1:3] - best[3][1:3]) <= 2.0 * rows[3][3:])[:, same])


@pytest.mark.parametrize(
    "kind", [(1, 0), (0, 1), (1, 1), (0, 2)], ids=["ball", "along", "ball-along", "normal"]
)
def test_contacts_and_directions_have_the_same_bits(
    table: Surrogate, kind: tuple[int, int]
) -> None:
    """On every level with fused multiply-add, in an array and alone: all rows, of cases and
    their neighbours."""
    rng, n = np.random.default_rng(13), 1500
    six = [
        10.0 ** rng.uniform(low, high, n)
        for low, high in ((-1, 0), (0, 2), (4, 9), (-9, -2), (1, 6), (-7, 2))
    ]
    if kind[1] == 2:
        six[3] = six[1] * rng.uniform(0.0, 1.0, n)
    six[5][:20], six[3][20:40], six[2][40:60] = 0.0, 0.0, np.inf
    data = table.tabulated.data("mu_ratio", Kind(*kind))

    def numbers_of(kernel: Kernel, part: slice) -> list[Any]:
        columns = [np.ascontiguousarray(column[part]) for column in six]
        answers = CaseRows(columns[0].shape, "gradient")
        kernel.cases(data, columns, answers, slice(0, columns[0].size), kind)
        return [answers.numbers, answers.source]

    best = numbers_of(kernels[-1], slice(None))
    assert np.unique(best[1]).size >= 4
    for kernel in kernels[1:] or kernels:
        for ours, theirs in zip(numbers_of(kernel, slice(None)), best, strict=True):
            np.testing.assert_array_equal(ours, theirs)
        for i in range(0, n, 5):
            alone = numbers_of(kernel, slice(i, i + 1))
            np.testing.assert_array_equal(alone[0][:, 0], best[0][:, i])
            assert alone[1][0] == best[1][i]
