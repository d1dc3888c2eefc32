"""Find the bundled tables: inside the package when installed, in ``tables/`` of a checkout."""

from pathlib import Path

from mumacro.errors import InputError, TableError

_PACKAGE = Path(__file__).resolve().parent.parent
_CHECKOUT = _PACKAGE.parent.parent  # folder of a checkout, whose library is in src/mumacro


def bundled_tables() -> list[Path]:
    """Return the table files that come with the library, by name: those of the installed wheel, or
    else those of the checkout.

    >>> sorted(path.name for path in bundled_tables())[0]
    'mumacro-1e-10.nc'
    """
    # A folder "tables" may belong to another project; the files of this project are mumacro-*.nc.
    for folder in (_PACKAGE / "data", _CHECKOUT / "tables"):
        paths = sorted(folder.glob("mumacro-*.nc"))
        if paths:
            return paths
    return []


def bundled_table(tolerance: float | None) -> Path:
    """Return the tightest bundled table, or the smallest one that meets ``tolerance``."""
    tables = {float(path.stem.removeprefix("mumacro-")): path for path in bundled_tables()}
    if not tables:
        raise TableError("mumacro-*.nc", "no table is bundled with this installation; name a file")
    if tolerance is None:
        return tables[min(tables)]
    if (
        isinstance(tolerance, bool)
        or not isinstance(tolerance, (int, float))
        or not tolerance > 0.0
    ):
        raise InputError("tolerance", tolerance, "a path, a tolerance > 0, or None")
    sufficient = [candidate for candidate in tables if candidate <= tolerance]
    if not sufficient:
        raise InputError(
            "tolerance",
            tolerance,
            f">= {min(tables):g}, the tightest bundled table, or the path of another",
        )
    return tables[max(sufficient)]
