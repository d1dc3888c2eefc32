"""What is wrong with a file of cases."""

from mumacro.errors import MumacroError


class FilesError(MumacroError):
    """A file of cases cannot be read, understood or written; one line that names it, the reason and
    the remedy."""
