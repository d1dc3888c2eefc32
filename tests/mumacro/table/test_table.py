"""The table file: every number comes back, everything else is refused by name, and a failed write
loses nothing."""

import os
import shutil
import signal
import zlib
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
import pytest

from builder.tables.rounding import STEPS, bits, round_block, to_bits
from mumacro import Surrogate, TableError
from mumacro.table import atlas
from mumacro.table.atlas import BLOCK_NAMES, BORDER_PIECES, CHARTS
from mumacro.table.atomic import write_whole
from mumacro.table.blocks import INTERPOLATION_ERRORS, Block, Table
from mumacro.table.netcdf import (
    MOST_BYTES,
    MOST_CELLS,
    MOST_NUMBERS,
    MOST_PATCHES,
    read_table,
    write_table,
)
from mumacro.table.polynomials import nodes
from tests.support.cases import Array
from tests.support.places import ROOT
from tests.support.refusals import refused

SPRING_CHARTS = CHARTS["spring"]
Edit = Callable[..., object]
CORNER, BLOCK = BLOCK_NAMES.index("corner"), "border/spring/corner"
PLAIN = ("v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit")
TABLE = ROOT / "tables" / "mumacro-1e-4.nc"


@pytest.fixture
def sound() -> Table:
    return read_table(TABLE)


# --- refused files --------------------------------------------------------------------------------


def group_renamed(path: str) -> Edit:
    parent, _, last = path.rpartition("/")
    return lambda root: root[parent].renameGroup(last, "elsewhere")


def in_group(root: Any, path: str) -> Any:
    return root if path in {"", "/"} else root[path]


def stating(name: str, value: Any, group: str = BLOCK) -> Edit:
    return lambda root: in_group(root, group).setncattr(name, value)


def infinite(name: str) -> Edit:
    return lambda root: root[name].__setitem__((0,) * root[name].ndim, np.inf)


GROUPS = [
    *(f"border/{name}" for name, *_ in BORDER_PIECES),
    *(f"border/{name}" for name in CHARTS),
    *(f"border/{name}/{chart.name}" for name, charts in CHARTS.items() for chart in charts),
]
#: numbers that take part in an answer or its bound, of each variable one
NUMBERS: list[tuple[str, tuple[int, ...]]] = [
    *((name, ()) for name in PLAIN),
    *((f"border/{name}/value", ()) for name, *_ in BORDER_PIECES),
    *((f"{BLOCK}/{name}", ()) for name in ("radius", "value", "power", "stick")),
    *((f"border/{name}/{charts[-1].name}/value", (0, 0)) for name, charts in CHARTS.items()),
    *((f"border/{name}/cell_errors", (i, -1, i)) for name in CHARTS for i in range(3)),
]


def one_digit_more(path: str, *place: int) -> Edit:
    def change(root: Any) -> None:
        variable = root[path]
        at = place or tuple(size // 2 for size in variable.shape)
        variable[at] = np.nextafter(variable[at], np.inf)

    return change


def another_error(place: int) -> Edit:
    def change(root: Any) -> None:
        errors = root[BLOCK].errors
        errors[place] = 0.123
        root[BLOCK].errors = errors

    return change


OF_BLOCK = ("cells", "errors", "verified_max_abs_error", "verified_max_rel_error")
#: what is changed in the file, without a new checksum -> why it is refused
EDITS: dict[str, tuple[Edit, str]] = {
    **{
        f"no group {path}": (group_renamed(path), r"group '\w+' is missing in /border")
        for path in GROUPS
    },
    **{
        f"no {name}": (
            lambda root, name=name: root.renameVariable(name, "renamed"),
            f"variable '{name}' (is missing in /|in / is no float64 array)",
        )
        for name in PLAIN
    },
    "no value of the border": (
        lambda root: root["border/low"].renameVariable("value", "values"),
        "'value' is missing",
    ),
    **{
        f"infinite {name}": (infinite(name), "holds non-finite values")
        for name in ("mu_ratio", "border/mid/value", f"{BLOCK}/stick", "border/ball/cell_errors")
    },
    **{
        f"twice {name}": (
            lambda root, name=name: root[BLOCK].setncattr(
                name, 2 * np.asarray(root[BLOCK].getncattr(name))
            ),
            r"the shape of 'cell_errors' is \(3, 40, 3\)" if name == "cells" else "checksum",
        )
        for name in OF_BLOCK
    },
    "an error that is not finite": (
        stating(OF_BLOCK[2], np.nan),
        f"'{OF_BLOCK[2]}' of /{BLOCK} is not 1 finite",
    ),
    **{
        f"no attribute {name}": (
            lambda root, name=name: root[BLOCK].delncattr(name),
            f"attribute '{name}' of /{BLOCK} is missing",
        )
        for name in OF_BLOCK
    },
    **{
        f"{name} = {value}": (
            stating(name, value),
            f"'{name}' of /{BLOCK} is not|cells must be|'errors' is negative",
        )
        for name in ("cells", "errors")
        for value in ("many", 1.5, [1.0, 2.0, 3.0], np.nan, -1.0)
    },
    "cells that are not whole": (stating("cells", [1.5, 2.0]), "cells must be whole numbers"),
    **{
        f"quantities {names}": (
            stating("quantities", names, ""),
            "'quantities' is .*this program knows mu_ratio, power",
        )
        for names in ("power mu_ratio", "mu_ratio mu_ratio", "mu_ratio warmth")
    },
    "no quantities": (
        stating("quantities", "", ""),
        "'quantities' is .*this program knows mu_ratio, power",
    ),
    "no attribute quantities": (
        lambda root: root.delncattr("quantities"),
        "'quantities' is .*program knows mu_ratio",
    ),
    "no cell_errors": (
        lambda root: root["border/spring"].renameVariable("cell_errors", "gone"),
        "is missing in",
    ),
    **{
        f"version {version}": (
            stating("format_version", version, ""),
            r"format version .*, this program reads 2: build the table anew",
        )
        for version in (np.int32(0), np.int32(1), np.int32(99), "two", np.array([2, 3]))
    },
    **{
        f"no {name}": (
            lambda root, name=name: root.delncattr(name),
            f"attribute '{name}' of / is missing",
        )
        for name in INTERPOLATION_ERRORS
    },
    **{
        f"an error of interpolation = {value}": (
            stating(INTERPOLATION_ERRORS[0], value, ""),
            f"'{INTERPOLATION_ERRORS[0]}' (of / is not 1 finite numbers|is negative)",
        )
        for value in ("small", np.nan, -1e-3, [1e-3, 1e-3])
    },
    **{
        f"{name} = {value}": (
            stating(name, value, "border/ball"),
            f"'{name}' of /border/ball (has a negative number|is not)",
        )
        for name in ("verified_error_quantiles", "verified_bound_over_error")
        for value in ("many", [1.0, 2.0], np.full(64, -1.0))
    },
    "a negative error among the shares": (
        stating("verified_error_quantiles", np.full(24, -1.0), "border/spring"),
        "'verified_error_quantiles' of /border/spring has a negative number",
    ),
    "shares of errors without the shares": (
        lambda root: root["border/ball"].delncattr("verified_quantiles"),
        "'verified_quantiles' of /border/ball is missing",
    ),
    **{
        f"no {name} of {group}": (
            lambda root, name=name, group=group: in_group(root, group).delncattr(name),
            f"attribute '{name}' of {group} is missing",
        )
        for name in ("tolerance", "verified_max_abs_error", "verified_max_rel_error")
        for group in ("/border/spring", "/border/ball")
    },
    **{
        f"{name} of zero": (
            stating(name, 0.0, "border/ball"),
            f"attribute '{name}' of /border/ball must be > 0",
        )
        for name in ("tolerance", "verified_max_abs_error", "verified_max_rel_error")
    },
    "no version": (lambda root: root.delncattr("format_version"), "not a mumacro table"),
    **{
        f"one digit more of {path} {place}": (one_digit_more(path, *place), "checksum")
        for path, place in NUMBERS
    },
    **{f"another error {place}": (another_error(place), "checksum") for place in range(9)},
    **{
        f"another {name} of the border": (stating(name, value, "border/mid"), "checksum")
        for name, value in (("cells", np.int32(7)), ("max_rel_error", 1e-3))
    },
    "a smaller tolerance": (stating("tolerance", 1e-15, "border/ball"), "checksum"),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_file_is_told_by_what_was_edited(tmp_path: Path, name: str) -> None:
    change, reason = EDITS[name]
    path = Path(shutil.copy(TABLE, tmp_path / "copy.nc"))
    with netCDF4.Dataset(str(path), "a") as root:
        change(root)
    with pytest.raises(TableError, match=reason) as caught:
        Surrogate.open(path)
    assert str(path) in str(caught.value)


#: a variable of the plain grid, stored in another way -> why it is refused
STORED: dict[str, tuple[str, Callable[[Any], Any], dict[str, Any], str]] = {
    "an axis of two dimensions": (
        "v_tilde",
        lambda values: values.reshape(-1, 1),
        {},
        "variable 'v_tilde' in / is no axis",
    ),
    "two chunks": (
        "mu_ratio",
        lambda values: values,
        {"chunks": (16, 31), "compression": "gzip", "shuffle": True},
        "'mu_ratio' in / is stored in an unknown way",
    ),
    "a chunk that is larger": (
        "mu_ratio",
        lambda values: values,
        {"chunks": (32, 31), "maxshape": (None, 31), "compression": "gzip", "shuffle": True},
        "'mu_ratio' in / is stored in an unknown way",
    ),
}


@pytest.mark.parametrize("name", STORED)
def test_a_variable_is_stored_in_one_way_alone(tmp_path: Path, name: str) -> None:
    variable, shaped, storage, reason = STORED[name]
    path = Path(shutil.copy(TABLE, tmp_path / "copy.nc"))
    with h5py.File(path, "r+") as root:
        values = shaped(root[variable][()])
        del root[variable]
        root.create_dataset(variable, data=values, **storage)
    with pytest.raises(TableError, match=reason):
        read_table(path)


def test_a_chunk_that_left_a_filter_out_is_refused(tmp_path: Path) -> None:
    path = Path(shutil.copy(TABLE, tmp_path / "copy.nc"))
    with h5py.File(path, "r+") as root:
        values = root["mu_ratio"][()]
        del root["mu_ratio"]
        variable = root.create_dataset(
            "mu_ratio", values.shape, "f8", chunks=values.shape, compression="gzip", shuffle=True
        )
        plain = zlib.compress(values.tobytes())  # not shuffled
        variable.id.write_direct_chunk((0, 0), plain, filter_mask=1)
    with h5py.File(path) as root:
        assert np.array_equal(root["mu_ratio"][()], values)
    with pytest.raises(TableError, match="'mu_ratio' in / is stored in an unknown way"):
        read_table(path)


def test_no_link_leads_out_of_the_file(tmp_path: Path) -> None:
    path = Path(shutil.copy(TABLE, tmp_path / "copy.nc"))
    for link in (h5py.ExternalLink(TABLE, "/mu_ratio"), h5py.SoftLink("/error_estimate")):
        with h5py.File(path, "r+") as root:
            del root["mu_ratio"]
            root["mu_ratio"] = link
            assert root["mu_ratio"].size > 1
        with pytest.raises(TableError, match="variable 'mu_ratio' is missing in /"):
            read_table(path)


def test_a_file_of_more_numbers_than_a_table_is_refused_while_it_is_read(tmp_path: Path) -> None:
    """Each variable has as many as one may have, of some bytes each."""
    path, size = Path(shutil.copy(TABLE, tmp_path / "copy.nc")), (400, MOST_NUMBERS // 400)
    with h5py.File(path, "r+") as root:
        for chart in SPRING_CHARTS:
            block = root[f"border/spring/{chart.name}"]
            del block["value"]
            block.create_dataset("value", size, "f8", np.ones(size), chunks=size, compression=9)
    assert path.stat().st_size < 500_000
    with pytest.raises(TableError, match=r"'value' in .* is one of more numbers than a table has"):
        read_table(path)


def block_of(table: Table, index: int, contact: str = "spring") -> Block:
    return table.contacts[contact].blocks[index]


def of_axis(index: int, axis: str) -> Edit:
    # the last digit may be that of another mathematical library
    geometry = getattr(SPRING_CHARTS[index], axis)
    off = 2e-15 * max(abs(geometry.low), abs(geometry.high))
    return lambda table: getattr(block_of(table, index), axis).__setitem__(
        0, getattr(block_of(table, index), axis)[0] + off
    )


CELLS = f"cells must be whole numbers from 1 to {MOST_CELLS}"
#: what is changed before the file is written with a checksum that fits -> why it is refused
SIGNED: dict[str, tuple[Edit, str]] = {
    **{
        f"{axis} of {chart.name}": (
            of_axis(i, axis),
            f"{chart.name}: the nodes of '{getattr(chart, axis).name}' are not those of this "
            "program's",
        )
        for i, chart in enumerate(SPRING_CHARTS)
        for axis in ("a", "b")
    },
    **{
        f"nodes of the border {name}": (
            lambda table, i=i: table.border[i].nodes.__imul__(1.0 + 2e-14),
            r"the nodes of .* are not those of this",
        )
        for i, (name, *_) in enumerate(BORDER_PIECES)
    },
    **{
        f"{cells} cells of the border": (
            lambda table, n=cells: setattr(table.border[1], "cells", n),
            CELLS,
        )
        for cells in (0, -1, 5000, 10**9)
    },
    **{
        f"{cells} cells of a block": (
            lambda table, n=cells: setattr(block_of(table, CORNER), "cells", (2, n)),
            CELLS,
        )
        for cells in (0, -1, 5000, 10**9)
    },
    "10,000 cells of a block": (
        lambda table: setattr(block_of(table, CORNER), "cells", (100, 100)),
        f"corner: has more than {MOST_PATCHES} cells",
    ),
    "a negative error": (
        lambda table: block_of(table, CORNER).cell_errors["power"].__setitem__((0, 1), -1e-300),
        "an error in 'cell_errors' is negative",
    ),
}


@pytest.mark.parametrize("name", SIGNED)
def test_a_checksum_that_fits_does_not_make_a_foreign_table_ours(
    tmp_path: Path, sound: Table, name: str
) -> None:
    change, reason = SIGNED[name]
    change(sound)
    write_table(sound, tmp_path / "foreign.nc")
    with pytest.raises(TableError, match=reason):
        read_table(tmp_path / "foreign.nc")


MID = SPRING_CHARTS[BLOCK_NAMES.index("stick_slip_mid")]
#: a chart of another release -> what this one says of its table
ATLASES = {
    "moved seam": (
        replace(MID, a=replace(MID.a, high=MID.a.high * 1.25)),
        "stick_slip_mid: range_of_a is",
    ),
    "another quantity": (
        replace(MID, quantity="mu_ratio^2"),
        "stick_slip_mid: quantity is 'mu_ratio.2'",
    ),
    "another regime": (
        replace(MID, regime=1 - MID.regime),
        "stick_slip_mid: regime is 'continuous'",
    ),
    "another name": (
        replace(MID, name="middle"),
        "group 'stick_slip_mid' is missing in /border/spring",
    ),
    "another axis": (replace(MID, b=replace(MID.b, name="inverse_y")), "variable .* is missing"),
}


@pytest.mark.parametrize("change", [*ATLASES, "another border"])
def test_the_table_of_another_atlas_is_told_by_the_difference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sound: Table, change: str
) -> None:
    """A release with other charts writes a table that is valid there; this one refuses it and names
    the difference."""
    path, index = tmp_path / "other.nc", SPRING_CHARTS.index(MID)
    new, stated = ATLASES.get(change, (MID, "high: range is"))
    part, (name, axis, quantity) = block_of(sound, index), BORDER_PIECES[2]
    for arrays in (part.nodes, part.cell_errors):  # the stick fraction, in stick-slip only
        if not new.holds(atlas.QUANTITIES[2]):
            del arrays["stick_fraction"]
    part.a, part.b = (
        nodes(x.size, axis.low, axis.high) for x, axis in ((part.a, new.a), (part.b, new.b))
    )
    with monkeypatch.context() as other:
        charts = (*SPRING_CHARTS[:index], new, *SPRING_CHARTS[index + 1 :])
        other.setattr(atlas, "CHARTS", {**CHARTS, "spring": charts})
        if change == "another border":
            wider = replace(axis, high=2.0 * axis.high)
            sound.border[2].nodes = nodes(sound.border[2].nodes.size, wider.low, wider.high)
            other.setattr(atlas, "BORDER_PIECES", (*BORDER_PIECES[:2], (name, wider, quantity)))
        checksum = write_table(sound, path)
        assert read_table(path).attributes["content_sha256"] == checksum
    with pytest.raises(TableError, match=stated):
        read_table(path)


def test_what_is_no_table_is_told_for_what_it_is(tmp_path: Path) -> None:
    kinds: Any = (("foreign.nc", "NETCDF4"), ("classic.nc", "NETCDF3_CLASSIC"))
    for name, kind in kinds:
        with netCDF4.Dataset(str(tmp_path / name), "w", format=kind) as root:
            root.createDimension("x", 2)
    whole = (ROOT / "tables" / "mumacro-1e-4.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.nc").write_text("mu_macro,0.3\n")
    with (tmp_path / "large.nc").open("wb") as stream:
        stream.truncate(MOST_BYTES + 1)
    for name, reason in (
        ("text.nc", "not a readable netCDF-4 table: .* another kind of file"),
        ("cut.nc", "not a readable netCDF-4 table: damaged, such as by a copy that was cut off"),
        ("foreign.nc", "not a mumacro table"),
        ("no.nc", "no such file"),
        ("", "no such file"),
        ("classic.nc", "not a (mumacro|readable netCDF-4) table"),
        ("large.nc", "more than any"),
    ):
        with pytest.raises(TableError, match=reason):
            Surrogate.open(tmp_path / name)


def test_a_corrected_title_is_no_other_table(tmp_path: Path, sound: Table) -> None:
    path = Path(shutil.copy(TABLE, tmp_path / "copy.nc"))
    with netCDF4.Dataset(str(path), "a") as root:
        root.title = "a corrected title"
    assert read_table(path).attributes == {**sound.attributes, "title": "a corrected title"}


def test_tables_with_fewer_quantities_open(tmp_path: Path, sound: Table) -> None:
    fewer = deepcopy(sound)
    fewer.attributes["quantities"] = "mu_ratio stick_fraction"
    for block in (block for contact in fewer.contacts.values() for block in contact.blocks):
        del block.nodes["power"], block.cell_errors["power"]
    rng, now = np.random.default_rng(4), Surrogate.open(TABLE)
    v, y = 10.0 ** rng.uniform(-6.0, 4.0, 3000), 10.0 ** rng.uniform(-4.0, 6.0, 3000)
    write_table(fewer, tmp_path / "other.nc")
    opened = Surrogate.open(tmp_path / "other.nc")
    assert opened.table.quantities == ["mu_ratio", "stick_fraction"]
    for name in opened.table.quantities:
        for ours, theirs in zip(opened.quantity(name, v, y), now.quantity(name, v, y), strict=True):
            np.testing.assert_array_equal(ours, theirs)
        np.testing.assert_array_equal(
            opened.slopes(v, y, name, bounds=True), now.slopes(v, y, name, bounds=True)
        )
    with refused("name"):
        opened.power(0.1, 0.5)
    with refused("of"):
        opened.slopes(0.1, 0.5, of="power")


# --- writing --------------------------------------------------------------------------------------


def test_every_number_comes_back_and_the_same_numbers_give_the_same_bytes(
    tmp_path: Path, sound: Table
) -> None:
    one, two = tmp_path / "one.nc", tmp_path / "two.nc"
    before = sound.attributes["content_sha256"]
    assert write_table(sound, one) == before
    assert write_table(read_table(TABLE), two) == before
    assert one.read_bytes() == two.read_bytes()
    # with the checksum, which covers every number, see above
    np.testing.assert_equal(read_table(one).attributes, sound.attributes)
    assert one.stat().st_mode & 0o777 == 0o644


def test_a_write_that_fails_half_way_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, sound: Table
) -> None:
    """A limit on file sizes simulates a full disk."""
    resource = pytest.importorskip("resource")
    path = tmp_path / "table.nc"
    path.write_bytes(b"before")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(TableError, match=r"table\.nc: cannot be (made|written)"):
            write_table(sound, path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert [(one.name, one.read_bytes()) for one in tmp_path.iterdir()] == [("table.nc", b"before")]


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_an_interrupted_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    write_whole(tmp_path / "a", b"old")
    with monkeypatch.context() as patch:
        patch.setattr(os, call, stop)
        with pytest.raises(KeyboardInterrupt):
            write_whole(tmp_path / "a", b"new")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a", b"old")]


def test_where_no_table_can_be_written_nothing_is_left(tmp_path: Path, sound: Table) -> None:
    (tmp_path / "taken.nc").mkdir()
    for out in ("taken.nc", "no/such/table.nc"):
        with pytest.raises(TableError, match="cannot be written"):
            write_table(sound, tmp_path / out)
    assert [path.name for path in tmp_path.rglob("*")] == ["taken.nc"]


# --- rounding -------------------------------------------------------------------------------------


@pytest.fixture
def values() -> Array:
    rng = np.random.default_rng(3)
    return np.concatenate(
        [rng.uniform(-6.0, 6.0, 500), 10.0 ** rng.uniform(-9.0, 0.0, 500), [0.0, 1.0, -1.0]]
    )


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 3.3e-8, 1e-12])
def test_steps_are_powers_of_two_within_the_tolerance(
    sound: Table, values: Array, tolerance: float
) -> None:
    def rounded_to_steps(values: Array) -> Array:
        block = replace(block_of(sound, CORNER), nodes={"power": values})
        return round_block(block, tolerance).nodes["power"]

    step = 2.0 ** -bits(tolerance)
    assert step <= tolerance / STEPS < 2.0 * step
    rounded = rounded_to_steps(values)
    assert np.abs(rounded - values).max() <= 0.5 * step
    assert np.all(rounded / step == np.rint(rounded / step))
    assert np.array_equal(rounded_to_steps(-rounded), -rounded)


@pytest.mark.parametrize("digits", [3, 22, 48])
def test_digits_are_kept_at_every_size(values: Array, digits: int) -> None:
    near, above = to_bits(values, digits), to_bits(values, digits, away_from_zero=True)
    size = np.abs(values)
    assert np.all(np.abs(near - values) <= 2.0**-digits * size)
    assert np.all((np.abs(above) >= size) & (np.abs(above) <= size * (1.0 + 2.0 ** (1 - digits))))
    assert np.all(np.sign(above) == np.sign(values))
    for rounded in (near, above):
        mantissa = np.ldexp(np.frexp(rounded)[0], digits)
        assert np.array_equal(mantissa, np.rint(mantissa))
    assert np.all(np.diff(near[np.argsort(values)]) >= 0.0)
