"""Reading HDF5 files from unknown sources: the parts of a netCDF-4 file, by name, with a limit of memory.

The netCDF library reads all of a file when it opens it, follows cyclic links until the stack is full, and
unpacks data beyond their declared size.  Here only the requested parts are read, sizes are checked before
memory is taken, and numbers are unpacked up to the size that they have.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5g, h5l, h5o, h5s, h5t, h5z
from numpy.typing import NDArray

__all__ = ["Group", "open_image"]

Array = NDArray[np.float64]
Refuse = Callable[[str], Exception]

MOST_ATTRIBUTES = 64  # of a group whose attributes are all read
MOST_TEXT = 65_536  # bytes of an attribute
MOST_ITEMS = 64  # numbers of an attribute
MOST_GROUPS = 256  # in a group whose groups are listed
_FILTERS = ((), (h5z.FILTER_DEFLATE,), (h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE))


def open_image(image: bytes, refuse: Refuse) -> Group:
    """The root of a file in memory.

    Parameters
    ----------
    image : bytes
        The whole file.
    refuse : callable
        Makes the exception to raise from a reason.

    Raises
    ------
    Exception
        What h5py raises where the bytes are no HDF5.
    """
    file = h5f.open_file_image(image)
    return Group(h5g.open(file, b"/"), "/", len(image), refuse)


class Group:
    """One group; its path for messages."""

    def __init__(self, found: Any, path: str, size: int, refuse: Refuse) -> None:
        self._id, self.path, self._size, self.refuse = found, path, size, refuse

    def _open(self, name: str, kind: type, what: str) -> Any:
        raw = name.encode()
        if not self._id.links.exists(raw) or self._id.links.get_info(raw).type != h5l.TYPE_HARD:
            # other links may lead to other files
            raise self.refuse(f"{what} {name!r} is missing in {self.path}")
        found = h5o.open(self._id, raw)
        if not isinstance(found, kind):
            raise self.refuse(f"{name!r} in {self.path} is no {what}")
        return found

    def group(self, name: str) -> Group:
        """A group in this one."""
        path = f"{self.path.rstrip('/')}/{name}"
        return Group(self._open(name, h5g.GroupID, "group"), path, self._size, self.refuse)

    def groups(self) -> list[str]:
        """The names of all members that are not variables."""
        if self._id.get_num_objs() > MOST_GROUPS:
            raise self.refuse(f"{self.path} holds more than {MOST_GROUPS} parts")
        return [name.decode() for name in self._id if h5o.get_info(self._id, name).type != h5o.TYPE_DATASET]

    # --- attributes ---------------------------------------------------------------------------------

    def has(self, name: str) -> bool:
        """Whether there is such an attribute."""
        return bool(h5a.exists(self._id, name.encode()))

    def attribute(self, name: str) -> Any:
        """Text, a number, or a vector of numbers (n,) with n > 1.

        Raises
        ------
        Exception
            Missing, of another kind, or too large.
        """
        if not self.has(name):
            raise self.refuse(f"attribute {name!r} of {self.path} is missing")
        return self._value(name, h5a.open(self._id, name.encode()))

    def attributes(self) -> dict[str, Any]:
        """All attributes but those of the netCDF library itself, in the order in which they were made."""
        count = h5a.get_num_attrs(self._id)
        if count > MOST_ATTRIBUTES:
            raise self.refuse(f"{self.path} has more than {MOST_ATTRIBUTES} attributes")
        by_age = h5py.h5.INDEX_CRT_ORDER
        found = [h5a.open(self._id, index=i, index_type=by_age) for i in range(count)]
        named = ((one.name.decode(), one) for one in found)
        return {name: self._value(name, one) for name, one in named if not name.startswith("_")}

    def _value(self, name: str, attribute: Any) -> Any:
        kind, shape = attribute.get_type(), attribute.shape
        if attribute.get_storage_size() > MOST_TEXT or math.prod(shape) > MOST_ITEMS:
            raise self.refuse(f"attribute {name!r} of {self.path} is too large")
        if isinstance(kind, h5t.TypeStringID) and shape in ((), (1,)):
            text = np.empty(shape, kind.dtype)
            attribute.read(text)
            value = text.reshape(-1)[0]
            return value.decode() if isinstance(value, bytes) else str(value)
        if not isinstance(kind, (h5t.TypeFloatID, h5t.TypeIntegerID)):
            raise self.refuse(f"attribute {name!r} of {self.path} is neither text nor numbers")
        numbers = np.empty(shape, kind.dtype.newbyteorder("="))
        attribute.read(numbers)
        return numbers.reshape(-1)[0] if numbers.size == 1 else numbers

    def has_variable(self, name: str) -> bool:
        """Whether there is such a variable."""
        return bool(self._id.links.exists(name.encode()))

    # --- numbers ------------------------------------------------------------------------------------

    def array(self, name: str, most: int) -> Array:
        """A variable of float64, of at most ``most`` numbers.

        Raises
        ------
        Exception
            Missing, of another type, too large, stored in another way than the netCDF library stores numbers.
        """
        found = self._open(name, h5d.DatasetID, "variable")
        space = found.get_space()
        shape = space.shape
        if (
            space.get_simple_extent_type() != h5s.SIMPLE
            or not found.get_type().equal(h5t.IEEE_F64LE)
            or math.prod(shape) > most
        ):
            raise self.refuse(f"variable {name!r} in {self.path} is no float64 array of at most {most} numbers")
        stored = found.get_create_plist()
        layout = stored.get_layout()
        filters = tuple(stored.get_filter(i)[0] for i in range(stored.get_nfilters()))
        if layout == h5d.CHUNKED and filters in _FILTERS and stored.get_chunk() == shape:
            return self._unpacked(found, name, shape, filters)
        if layout not in (h5d.CONTIGUOUS, h5d.COMPACT) or stored.get_external_count():
            raise self.refuse(f"variable {name!r} in {self.path} is stored in an unknown way")
        out = np.empty(shape)
        found.read(h5s.ALL, h5s.ALL, out)
        return out

    def _unpacked(self, found: Any, name: str, shape: tuple[int, ...], filters: tuple[int, ...]) -> Array:
        """The one chunk of a variable, unpacked here with a limit: HDF5 itself has none."""
        size = 8 * math.prod(shape)
        if found.get_num_chunks() != 1 or (chunk := found.get_chunk_info(0)).size > self._size or chunk.filter_mask:
            raise self.refuse(f"variable {name!r} in {self.path} is stored in an unknown way")
        data = found.read_direct_chunk(chunk.chunk_offset)[1]
        if h5z.FILTER_DEFLATE in filters:
            data = zlib.decompressobj().decompress(data, size + 1)
        if len(data) != size:
            raise self.refuse(f"variable {name!r} in {self.path} does not unpack to its size")
        raw = np.frombuffer(data, np.uint8)
        if h5z.FILTER_SHUFFLE in filters:
            raw = np.ascontiguousarray(raw.reshape(8, -1).T)
        return raw.view(np.dtype("<f8")).reshape(shape).astype(np.float64)
