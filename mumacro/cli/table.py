"""``mumacro table``: the table in use and its errors."""

from collections.abc import Sequence
from itertools import zip_longest

from mumacro.cli import common
from mumacro.cli.common import OneLineParser, as_json, in_columns, open_table
from mumacro.table.bundled import bundled_tables


def run(words: Sequence[str]) -> str:
    """``mumacro table``."""
    parser = OneLineParser(
        prog="mumacro table",
        description="Name, path, tolerance, verified errors and checksum of the table in use.",
        epilog="example:\n  mumacro table --table 1e-7",
    )
    common.add_table(parser)
    chosen = parser.parse_args(words)
    surrogate = open_table(chosen.table)
    names = (
        "verified_max_abs_error",
        "verified_max_rel_error",
        "content_sha256",
        "format_version",
        "product_version",
    )
    told = {name: surrogate.attributes.get(name) for name in names}
    told["checksum"] = told.pop("content_sha256")
    found = {
        **common.about(surrogate),
        "path": str(surrogate.path),
        **told,
        "bytes": surrogate.path.stat().st_size,
    }
    bundled = [str(path) for path in bundled_tables()]
    if chosen.json:
        return as_json({**found, "bundled": bundled})
    rows = [
        (name, f"{value:.3g}" if isinstance(value, float) else str(value))
        for name, value in found.items()
    ]
    return in_columns([*rows, *zip_longest(["bundled"], bundled, fillvalue="")])
