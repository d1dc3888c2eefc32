"""Reading HDF5 files from unknown sources: the parts of a netCDF-4 file, by name, with a limit of
memory.

The netCDF library reads all of a file when it opens it, follows cyclic links until the stack is
full, and unpacks data beyond their declared size.  Here only the requested parts are read, sizes
are checked before memory is taken, and numbers are unpacked up to the size that they have.
"""

import math
import zlib
from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5g, h5l, h5o, h5s, h5t, h5z

from mumacro.kernel.arrays import Array

Refuse = Callable[[str], Exception]

MOST_ATTRIBUTES = 64  # attributes of a group, at most, where all of them are read
MOST_TEXT = 65_536  # bytes of an attribute, at most
MOST_ITEMS = 64  # numbers of an attribute, at most
_FILTERS = ((), (h5z.FILTER_DEFLATE,), (h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE))


class Group:
    """One group; every method raises what ``refuse`` makes where a part is missing, of another kind
    or too large."""

    def __init__(self, handle: Any, path: str, size: int, refuse: Refuse) -> None:
        self._id, self.path, self._size, self.refuse = handle, path, size, refuse

    def holds(self, name: str) -> bool:
        """Return whether there is a group or variable of this name."""
        return bool(self._id.links.exists(name.encode()))

    def _open(self, name: str, part_type: type, role: str) -> Any:
        if not self.holds(name) or self._id.links.get_info(name.encode()).type != h5l.TYPE_HARD:
            # other links may lead to other files
            raise self.refuse(f"{role} {name!r} is missing in {self.path}")
        part = h5o.open(self._id, name.encode())
        if not isinstance(part, part_type):
            raise self.refuse(f"{name!r} in {self.path} is no {role}")
        return part

    def group(self, name: str) -> "Group":
        """Return a group in this one."""
        path = f"{self.path.rstrip('/')}/{name}"
        return Group(self._open(name, h5g.GroupID, "group"), path, self._size, self.refuse)

    # --- attributes -------------------------------------------------------------------------------

    def has(self, name: str) -> bool:
        """Return whether there is such an attribute."""
        return bool(h5a.exists(self._id, name.encode()))

    def attribute(self, name: str) -> Any:
        """Return text, a number, or a vector of numbers (n,) with n > 1."""
        if not self.has(name):
            raise self.refuse(f"attribute {name!r} of {self.path} is missing")
        return self._value(name, h5a.open(self._id, name.encode()))

    def attributes(self) -> dict[str, Any]:
        """Return all attributes but those of the netCDF library itself, in the order in which they
        were made."""
        count, by_age = h5a.get_num_attrs(self._id), h5py.h5.INDEX_CRT_ORDER
        if count > MOST_ATTRIBUTES:
            raise self.refuse(f"{self.path} has more than {MOST_ATTRIBUTES} attributes")
        handles = (h5a.open(self._id, index=i, index_type=by_age) for i in range(count))
        handle_by_name = {handle.name.decode(): handle for handle in handles}
        return {
            name: self._value(name, handle)
            for name, handle in handle_by_name.items()
            if not name.startswith("_")
        }

    def numbers(self, name: str, count: int) -> Array:
        """Return an attribute of ``count`` finite numbers."""
        values = np.atleast_1d(np.asarray(self.attribute(name)))
        if (
            values.dtype.kind not in "fi"
            or values.shape != (count,)
            or not np.all(np.isfinite(values))
        ):
            raise self.refuse(f"attribute {name!r} of {self.path} is not {count} finite numbers")
        return values.astype(np.float64)

    def _value(self, name: str, attribute: Any) -> Any:
        hdf5_type, shape = attribute.get_type(), attribute.shape
        if attribute.get_storage_size() > MOST_TEXT or math.prod(shape) > MOST_ITEMS:
            raise self.refuse(f"attribute {name!r} of {self.path} is too large")
        is_text = isinstance(hdf5_type, h5t.TypeStringID) and shape in ((), (1,))
        if not is_text and not isinstance(hdf5_type, (h5t.TypeFloatID, h5t.TypeIntegerID)):
            raise self.refuse(f"attribute {name!r} of {self.path} is neither text nor numbers")
        values = np.empty(shape, hdf5_type.dtype if is_text else hdf5_type.dtype.newbyteorder("="))
        attribute.read(values)
        first = values.reshape(-1)[0] if values.size == 1 else values
        return first.decode() if isinstance(first, bytes) else str(first) if is_text else first

    # --- numbers ----------------------------------------------------------------------------------

    def array(self, name: str, most: int, shape: tuple[int, ...] | None = None) -> Array:
        """Return a variable of finite float64, of at most ``most`` numbers, as the netCDF library
        stores numbers."""
        dataset = self._open(name, h5d.DatasetID, "variable")
        space, creation = dataset.get_space(), dataset.get_create_plist()
        is_double = space.get_simple_extent_type() == h5s.SIMPLE and dataset.get_type().equal(
            h5t.IEEE_F64LE
        )
        if not is_double or math.prod(space.shape) > most:
            raise self.refuse(
                f"variable {name!r} in {self.path} is no float64 array of at most {most} numbers"
            )
        if shape is not None and space.shape != shape:
            raise self.refuse(f"{self.path}: the shape of {name!r} is {space.shape}, not {shape}")
        layout = creation.get_layout()
        filters = tuple(creation.get_filter(i)[0] for i in range(creation.get_nfilters()))
        if layout == h5d.CHUNKED and filters in _FILTERS and creation.get_chunk() == space.shape:
            values = self._unpack(dataset, name, filters)
        elif layout in (h5d.CONTIGUOUS, h5d.COMPACT) and not creation.get_external_count():
            values = np.empty(space.shape)
            dataset.read(h5s.ALL, h5s.ALL, values)
        else:
            raise self.refuse(f"variable {name!r} in {self.path} is stored in an unknown way")
        if not np.all(np.isfinite(values)):
            raise self.refuse(f"variable {name!r} in {self.path} holds non-finite values")
        return values

    def _unpack(self, dataset: Any, name: str, filters: tuple[int, ...]) -> Array:
        """Return the one chunk of a variable, unpacked here with a limit: HDF5 itself has none."""
        size = 8 * math.prod(dataset.shape)
        if (
            dataset.get_num_chunks() != 1
            or (chunk := dataset.get_chunk_info(0)).size > self._size
            or chunk.filter_mask
        ):
            raise self.refuse(f"variable {name!r} in {self.path} is stored in an unknown way")
        data = dataset.read_direct_chunk(chunk.chunk_offset)[1]
        if h5z.FILTER_DEFLATE in filters:
            data = zlib.decompressobj().decompress(data, size + 1)
        if len(data) != size:
            raise self.refuse(f"variable {name!r} in {self.path} does not unpack to its size")
        raw = np.frombuffer(data, np.uint8)
        if h5z.FILTER_SHUFFLE in filters:
            raw = np.ascontiguousarray(raw.reshape(8, -1).T)
        return raw.view(np.dtype("<f8")).reshape(dataset.shape).astype(np.float64)


def open_image(image: bytes, refuse: Refuse) -> Group:
    """Return the root of a file in memory; ``refuse`` makes the exception that is raised from a
    reason.

    h5py raises nearly any exception where the bytes are no HDF5.
    """
    try:
        file = h5f.open_file_image(image)
    except Exception as error:
        reason = "damaged, such as by a copy that was cut off, or another kind of file"
        raise refuse(f"not a readable netCDF-4 table: {reason}") from error
    return Group(h5g.open(file, b"/"), "/", len(image), refuse)
