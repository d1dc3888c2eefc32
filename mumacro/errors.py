"""The exceptions of the project.  They are independent of HTTP."""

from pathlib import Path
from typing import Any


class MumacroError(Exception):
    """Root of every error that this project raises on purpose."""


class InputError(MumacroError, ValueError):
    """One input value is outside the range of the model.

    Attributes
    ----------
    field : str
        Name of the input, e.g. ``"mu0"``.
    value : object
        The value as it was given.
    bound : str
        What the value must satisfy, e.g. ``"finite and > 0"``.
    index : int or None
        Position in the flattened, broadcast input; None for a scalar call.
    """

    def __init__(self, field: str, value: object, bound: str, index: int | None = None) -> None:
        self.field = field
        self.value = value
        self.bound = bound
        self.index = index
        where = "" if index is None else f" at index {index}"
        super().__init__(f"{field}{where} must be {bound}, got {_shown(value)}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Rebuild from the parts: an error that a worker process raises must reach the calling process."""
        return type(self), (self.field, self.value, self.bound, self.index)


class TableError(MumacroError):
    """A table file cannot be used.

    Attributes
    ----------
    path : Path
        The file.
    reason : str
        Why it is refused: missing, another format version, a wrong checksum, ...
    """

    def __init__(self, path: str | Path, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{self.path}: {reason}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Rebuild from the parts."""
        return type(self), (self.path, self.reason)


def _shown(value: object) -> str:
    """The value as text of bounded length."""
    text = repr(value)
    return text if len(text) <= 200 else text[:197] + "..."
