"""The bundled tables: inside the package when installed, in ``tables/`` of a checkout."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent.parent


def bundled_tables() -> list[Path]:
    """The table files that come with the library, by name: of the installed wheel, else of the
    checkout.

    >>> sorted(path.name for path in bundled_tables())[0]
    'mumacro-1e-10.nc'
    """
    # A folder "tables" beside the package may belong to another project; this project's are
    # mumacro-*.nc.
    for folder in (_PACKAGE / "data", _PACKAGE.parent / "tables"):
        paths = sorted(folder.glob("mumacro-*.nc"))
        if paths:
            return paths
    return []
