"""How a table is laid out in its file: netCDF-4 through h5py, for the sake of the file's size.

The netCDF library writes the structures of HDF5 1.8, in which each of some seventy small variables costs more bytes
than its numbers.  HDF5 1.10 has smaller ones; h5py can ask for them, and every netCDF library that is linked with
HDF5 1.10 or newer reads them.  Coordinates are dimension scales and are attached to what stands on them: all that
netCDF-4 asks of an HDF5 file, with links in order of creation, so that the netCDF library can also change it.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from h5py import h5f, h5p

from friction import regions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from friction.table import Table

__all__ = ["file_image"]

FEW = 24  # numbers: fewer are stored as they are, since the filters' own entry is longer than what they save
_ROOT_ATTRIBUTES = 64  # of the root that stand in its header; by default more than 8 go to a heap, which is larger

_LONG = {
    "mu_ratio": "macroscopic friction coefficient over Coulomb friction coefficient, mu_macro/mu0",
    "stick_fraction": "share of the period during which the contact sticks",
    "error_estimate": "estimated absolute error of mu_ratio",
    "v_tilde_crit": "border of continuous sliding: smallest dimensionless speed without stick",
    "v_tilde": "dimensionless sliding speed, v0 k/(mu0 Fz omega)",
    "y_tilde": "dimensionless oscillation amplitude, y0 k/(mu0 Fz)",
}
_COORDINATES = {
    "y_squared": "square of the dimensionless amplitude",
    "v_squared_share": "v_tilde^2/(1 + v_tilde^2)",
    "ln_y": "natural logarithm of y_tilde",
    "ln_rho": "natural logarithm of v_tilde/v_tilde_crit",
    "ln_kappa": "natural logarithm of v_tilde/sqrt(y_tilde)",
    "inverse_y": "1/y_tilde",
    "s": "s with v_tilde = v_tilde_crit sin^2(pi s/2)",
    "y": "dimensionless amplitude y_tilde",
    "radius": "distance R from the corner y_tilde = 1, v_tilde = 0 in normal-form coordinates",
    "angle": "polar angle of the normal form, 2 psi/pi",
}
_COMPANIONS = {
    "power": "mean power of the shaker over mu0 Fz l0 omega, scaled as in friction.companions",
    "stick": "stick fraction, scaled as in friction.companions",
}
_QUANTITIES = {
    "deficit_low": "(1 - mu_ratio) 4 (1 + v_tilde^2)/y_tilde^2",
    "hypotenuse": "mu_ratio sqrt(1 + y_tilde^2/v_tilde^2)",
    "layer": "(mu_ratio - outer) y_tilde/v_tilde, outer = 1/AGM(1, sqrt(1 + y_tilde^2/v_tilde^2))",
    "layer_log": "(mu_ratio - outer) y_tilde/v_tilde - (2/pi) ln(v_tilde/sqrt(y_tilde))",
    "deficit": "(1 - mu_ratio)/y_tilde^2",
    "mu_ratio": "mu_ratio",
    "normal_form": "mu_ratio/phi, phi^3 + 2 (y_tilde - 1) phi = pi v_tilde",
    "slope": "mu_ratio y_tilde/v_tilde",
}


def _describe(target: Any, attributes: dict[str, Any]) -> None:
    for name, value in attributes.items():
        # text of fixed length stands beside its name; h5py's own choice, of variable length, goes to a heap
        target.attrs.create(name, np.bytes_(value.encode()) if isinstance(value, str) else value)


def _put(
    group: Any, name: str, data: NDArray[np.float64], long_name: str, axes: tuple[Any, ...] = (), **attributes: str
) -> Any:
    """A float64 variable over the coordinates ``axes``; without them it is a coordinate itself."""
    filters = {"chunks": data.shape, "compression": "gzip", "compression_opts": 9, "shuffle": True}
    extra = filters if data.size > FEW else {}
    variable = group.create_dataset(name, data=data, dtype="<f8", track_order=False, fill_time="never", **extra)
    if not axes:
        variable.make_scale()
        del variable.attrs["NAME"]  # optional, and the name of the variable says it
    _describe(variable, {"long_name": long_name, "units": "1", **attributes})
    for dimension, axis in zip(variable.dims, axes, strict=bool(axes)):
        dimension.attach_scale(axis)
    return variable


def _group(parent: Any, name: str) -> Any:
    group = h5py.h5g.create(parent.id, name.encode(), gcpl=_ordered(h5p.create(h5p.GROUP_CREATE)))
    return h5py.Group(group)


def _ordered(creation: Any) -> Any:
    """Without times, so that the same numbers give the same bytes; the netCDF library writes to ordered groups only."""
    creation.set_link_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    creation.set_obj_track_times(False)
    return creation


def _create(buffer: io.BytesIO) -> Any:
    creation = _ordered(h5p.create(h5p.FILE_CREATE))
    creation.set_attr_phase_change(_ROOT_ATTRIBUTES, 0)
    creation.set_attr_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    access = h5p.create(h5p.FILE_ACCESS)
    access.set_libver_bounds(h5f.LIBVER_V110, h5f.LIBVER_V110)  # not the newest: older libraries must read the file
    access.set_fileobj_driver(h5py.h5fd.fileobj_driver, buffer)
    return h5py.File(h5f.create(b"table", h5f.ACC_TRUNC, creation, access))


def file_image(table: Table) -> bytes:
    """The file that holds ``table``, its attributes included.

    In memory: a write that fails at the end, on a full disc, HDF5 does not report as an error that can be caught.
    """
    buffer = io.BytesIO()
    with _create(buffer) as root:
        _fill(root, table)
    return buffer.getvalue()


def _fill(root: Any, table: Table) -> None:
    _describe(root, table.attributes)
    v = _put(root, "v_tilde", table.v_tilde, _LONG["v_tilde"])
    y = _put(root, "y_tilde", table.y_tilde, _LONG["y_tilde"])
    _put(root, "mu_ratio", table.mu_ratio, _LONG["mu_ratio"], (v, y), ancillary_variables="error_estimate")
    _put(root, "stick_fraction", table.stick_fraction, _LONG["stick_fraction"], (v, y))
    _put(root, "error_estimate", table.error_estimate, _LONG["error_estimate"], (v, y))
    _put(root, "v_tilde_crit", table.v_tilde_crit, _LONG["v_tilde_crit"], (y,))
    border = _group(root, "border")
    for (name, coordinate, _, quantity), piece in zip(regions.BORDER_PIECES, table.border, strict=True):
        group = _group(border, name)
        axis = _put(group, coordinate, piece.nodes, _COORDINATES[coordinate])
        _put(group, "value", piece.values, quantity, (axis,))
        _describe(group, {"cells": np.int32(piece.cells), "max_rel_error": piece.max_rel_error})
    # inside the border, which they are fitted to: with a second group at the root the CF checker looks for "time"
    blocks = _group(border, "blocks")
    for spec, block in zip(regions.BLOCKS, table.blocks, strict=True):
        group = _group(blocks, spec.name)
        axes = (
            _put(group, spec.a_name, block.a, _COORDINATES[spec.a_name]),
            _put(group, spec.b_name, block.b, _COORDINATES[spec.b_name]),
        )
        _put(group, "value", block.values, _QUANTITIES[spec.quantity], axes)
        for name, nodes in (("power", block.power), ("stick", block.stick)):
            if nodes.size:
                _put(group, name, nodes, _COMPANIONS[name], axes)
        measured = {"power_error": block.power_error, "stick_error": block.stick_error}
        _describe(
            group,
            {
                "regime": regions.REGIMES[spec.regime],
                "quantity": spec.quantity,
                "cells": np.array(block.cells, dtype=np.int32),
                "quantity_error": block.quantity_error,
                "verified_max_abs_error": block.max_abs_error,
                "verified_max_rel_error": block.max_rel_error,
                **{name: error for name, error in measured.items() if error is not None},
            },
        )
