"""Define the exceptions of the project, independent of HTTP, and say what to install if a package
is missing."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

_FAULTS_SHOWN = 5  # that one line of a message names
_OURS = ("mumacro", "builder", "service")


class MumacroError(Exception):
    """Report any error that this project raises on purpose; every such error is a subclass."""


class InputError(MumacroError, ValueError):
    """Report an input value that is outside the range of the model."""

    def __init__(self, field: str, value: object, bound: str, index: int | None = None) -> None:
        self.field = field  #: name of the input, e.g. ``"mu0"``
        self.value = value  #: value as the caller gave it
        self.bound = bound  #: what the value must satisfy, e.g. ``"finite and > 0"``
        self.index = index  #: position in the flattened, broadcast input; None for a scalar call
        where = "" if index is None else f" at index {index}"
        missing = value is None and bound.startswith(("given", "that of"))
        value_shown = "" if missing else f", got {_shown(value)}"
        super().__init__(f"{field}{where} must be {bound}{value_shown}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Rebuild the error from its parts, because an error in a worker process must reach the
        calling process."""
        return type(self), (self.field, self.value, self.bound, self.index)


class TextError(MumacroError, ValueError):
    """Report a table as text that cannot be read, in one line with the fault, its place and the
    remedy."""

    faults: Sequence[str] = ()  #: one for each line, if there are several

    @classmethod
    def of(cls, faults: Sequence[str]) -> "TextError":
        """Return an error that names the first faults."""
        rest = f"; and {len(faults) - _FAULTS_SHOWN:,} more" if len(faults) > _FAULTS_SHOWN else ""
        error = cls("; ".join(faults[:_FAULTS_SHOWN]) + rest)
        error.faults = faults
        return error


class TableError(MumacroError):
    """Report a table file that cannot be used."""

    def __init__(self, path: str | Path, reason: str) -> None:
        self.path = Path(path)  #: the file
        #: why it is refused: missing, another format version, a wrong checksum, ...
        self.reason = reason
        super().__init__(f"{self.path}: {reason}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Rebuild the error from its parts."""
        return type(self), (self.path, self.reason)


def _shown(value: object) -> str:
    """Return the value as text of bounded length."""
    text = repr(value)
    return text if len(text) <= 200 else text[:197] + "..."


def missing(extra: str, error: ImportError) -> str:
    """Return in one line what to install after an import raised ``error``; ``extra`` is empty for
    the library itself.

    Raise ``error`` itself if one of the project's own modules is missing, because this fault must
    not be hidden.

    >>> missing("files", ModuleNotFoundError("No module named 'pyarrow'", name="pyarrow"))
    'pyarrow is not installed: pip install "mumacro[files]" (in a checkout: pip install -e
    ".[files]")'
    """
    if error.name is None:  # our own error with its own sentence: the compiled kernel is missing
        return str(error)
    package = error.name.partition(".")[0]
    if package in _OURS:
        raise error
    brackets = f"[{extra}]" if extra else ""
    return (
        f'{package} is not installed: pip install "mumacro{brackets}" (in a checkout: pip '
        f'install -e ".{brackets}")'
    )
