"""What builder and service agree on: dimensionless groups, tails, the border, the table file, the surrogate."""

from friction import compiled as _compiled  # noqa: F401 (first: it says where kernels are cached)
from friction.errors import InputError, MumacroError, TableError
from friction.surrogate import Answer, Surrogate

__all__ = ["Answer", "InputError", "MumacroError", "Surrogate", "TableError"]
