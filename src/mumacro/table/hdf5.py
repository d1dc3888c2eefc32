"""Read HDF5 files from unknown sources: the parts of a netCDF-4 file, by name, with a limit of
memory.

The netCDF library reads all of a file when it opens it, follows cyclic links until the stack is
full, and unpacks data beyond their declared size.  Here only the requested parts are read, sizes
are checked before memory is used, and numbers are unpacked up to their declared size.
"""

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5g, h5l, h5o, h5s, h5t, h5z

from mumacro.kernel.arrays import Array

MOST_ATTRIBUTES = 64  # limit of the attributes of a group
MOST_TEXT = 65_536  # limit of the bytes of an attribute
MOST_ITEMS = 64  # limit of the numbers of an attribute
_FILTERS = ((), (h5z.FILTER_DEFLATE,), (h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE))


class RefusedError(Exception):
    """Tell the reason why a file is refused."""


@dataclass(frozen=True)
class Group:
    """Hold the content of a group of a file, by name."""

    path: str
    #: texts, numbers, and vectors of numbers (n,) with n > 1, in the order of their creation,
    #: without the netCDF library's own attributes
    attributes: dict[str, Any] = field(default_factory=dict)
    arrays: dict[str, Array] = field(default_factory=dict)  #: finite float64
    groups: dict[str, "Group"] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """Name what to read of a group: variables and groups by name.  If the file does not have one,
    it is left out."""

    variables: tuple[str, ...] = ()
    groups: Mapping[str, "Part"] = field(default_factory=dict)


class File:
    """Read a file in memory.  Every method raises RefusedError if a part has another type or is too
    large."""

    def __init__(self, image: bytes, most: int, most_in_all: int) -> None:
        """Open the bytes of a file.  A variable may have up to ``most`` numbers, and everything
        that is read up to ``most_in_all``.

        Raise RefusedError if they are not HDF5.  Later reads may raise nearly any exception of
        h5py.
        """
        try:
            file = h5f.open_file_image(image)
        except Exception as error:
            reason = "damaged, such as by a copy that was cut off, or another kind of file"
            raise RefusedError(f"not a readable netCDF-4 table: {reason}") from error
        self._root, self._size = h5g.open(file, b"/"), len(image)
        self._most, self._rest = most, most_in_all

    def attributes(self) -> dict[str, Any]:
        """Return the attributes of the root, as in :class:`Group`."""
        return _attributes(self._root, "/")

    def read(self, part: Part) -> Group:
        """Return the root with the named parts."""
        return self._group(self._root, "/", part)

    def _group(self, handle: Any, path: str, part: Part) -> Group:
        group = Group(path, _attributes(handle, path))
        for name in part.variables:
            variable = _member(handle, path, name, h5d.DatasetID, "variable")
            if variable is not None:
                group.arrays[name] = self._array(variable, f"variable {name!r} in {path}")
        for name, inner in part.groups.items():
            inside = _member(handle, path, name, h5g.GroupID, "group")
            if inside is not None:
                group.groups[name] = self._group(inside, f"{path.rstrip('/')}/{name}", inner)
        return group

    def _array(self, dataset: Any, name: str) -> Array:
        """Return a variable of numbers as the netCDF library stores them."""
        space, creation = dataset.get_space(), dataset.get_create_plist()
        is_double = space.get_simple_extent_type() == h5s.SIMPLE and dataset.get_type().equal(
            h5t.IEEE_F64LE
        )
        count = math.prod(space.shape)
        if not is_double or count > self._most:
            raise RefusedError(f"{name} is no float64 array of at most {self._most} numbers")
        self._rest -= count
        if self._rest < 0:
            raise RefusedError(f"{name} is one of more numbers than a table has")
        layout = creation.get_layout()
        filters = tuple(creation.get_filter(i)[0] for i in range(creation.get_nfilters()))
        if layout == h5d.CHUNKED and filters in _FILTERS and creation.get_chunk() == space.shape:
            values = self._unpacked(dataset, name, filters)
        elif layout in (h5d.CONTIGUOUS, h5d.COMPACT) and not creation.get_external_count():
            values = np.empty(space.shape)
            dataset.read(h5s.ALL, h5s.ALL, values)
        else:
            raise RefusedError(f"{name} is stored in an unknown way")
        if not np.isfinite(values).all():
            raise RefusedError(f"{name} holds non-finite values")
        return values

    def _unpacked(self, dataset: Any, name: str, filters: tuple[int, ...]) -> Array:
        """Return the only chunk of a variable, unpacked here with a limit, because HDF5 has no
        limit."""
        size = 8 * math.prod(dataset.shape)
        if (
            dataset.get_num_chunks() != 1
            or (chunk := dataset.get_chunk_info(0)).size > self._size
            or chunk.filter_mask
        ):
            raise RefusedError(f"{name} is stored in an unknown way")
        data = dataset.read_direct_chunk(chunk.chunk_offset)[1]
        if h5z.FILTER_DEFLATE in filters:
            data = zlib.decompressobj().decompress(data, size + 1)
        if len(data) != size:
            raise RefusedError(f"{name} does not unpack to its size")
        raw = np.frombuffer(data, np.uint8)
        if h5z.FILTER_SHUFFLE in filters:
            raw = np.ascontiguousarray(raw.reshape(8, -1).T)
        return raw.view(np.dtype("<f8")).reshape(dataset.shape).astype(np.float64)


def _member(handle: Any, path: str, name: str, part_type: type, role: str) -> Any:
    """Return a variable or a group of this name in a group, or None if there is none."""
    links, key = handle.links, name.encode()
    # a link that is not a hard link may lead to another file
    if not links.exists(key) or links.get_info(key).type != h5l.TYPE_HARD:
        return None
    part = h5o.open(handle, key)
    if not isinstance(part, part_type):
        raise RefusedError(f"{name!r} in {path} is no {role}")
    return part


def _attributes(handle: Any, path: str) -> dict[str, Any]:
    count, by_age = h5a.get_num_attrs(handle), h5py.h5.INDEX_CRT_ORDER
    if count > MOST_ATTRIBUTES:
        raise RefusedError(f"{path} has more than {MOST_ATTRIBUTES} attributes")
    values = {}
    for i in range(count):
        attribute = h5a.open(handle, index=i, index_type=by_age)
        name = attribute.name.decode()
        if not name.startswith("_"):
            values[name] = _value(attribute, f"attribute {name!r} of {path}")
    return values


def _value(attribute: Any, name: str) -> Any:
    """Return the value of an attribute: a text, a number, or a vector of numbers."""
    hdf5_type, shape = attribute.get_type(), attribute.shape
    if attribute.get_storage_size() > MOST_TEXT or math.prod(shape) > MOST_ITEMS:
        raise RefusedError(f"{name} is too large")
    is_text = isinstance(hdf5_type, h5t.TypeStringID) and shape in ((), (1,))
    if not is_text and not isinstance(hdf5_type, (h5t.TypeFloatID, h5t.TypeIntegerID)):
        raise RefusedError(f"{name} is neither text nor numbers")
    values = np.empty(shape, hdf5_type.dtype if is_text else hdf5_type.dtype.newbyteorder("="))
    attribute.read(values)
    first = values.reshape(-1)[0] if values.size == 1 else values
    return first.decode() if isinstance(first, bytes) else str(first) if is_text else first
