"""What is refused: which input, and which value of an array; the wording is no promise."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from mumacro import InputError


@contextmanager
def refused(place: str) -> Iterator[pytest.ExceptionInfo[InputError]]:
    """The block raises :class:`InputError` for this input: ``"v0"``, or ``"v0[1]"`` for one value
    of an array, ``"v0[*]"`` for it or any of its values."""
    with pytest.raises(InputError) as caught:
        yield caught
    error = caught.value
    told = error.field + ("" if error.index is None else f"[{error.index}]")
    assert place in (told, f"{error.field}[*]"), error
