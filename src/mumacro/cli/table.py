"""``mumacro table``: the table in use and its errors."""

from collections.abc import Iterator, Sequence
from itertools import zip_longest

from mumacro.cli import common
from mumacro.cli.common import OneLineParser, as_json, in_columns, open_table
from mumacro.surrogate import Surrogate
from mumacro.table.bundled import bundled_tables


def run(words: Sequence[str]) -> str:
    """``mumacro table``."""
    parser = OneLineParser(
        prog="mumacro table",
        description="Name, path, tolerance, verified errors and checksum of the table in use.",
        epilog="example:\n  mumacro table --table 1e-7",
    )
    common.add_table(parser)
    options = parser.parse_args(words)
    surrogate = open_table(options.table)
    names = (
        "verified_max_abs_error",
        "verified_max_rel_error",
        "content_sha256",
        "format_version",
        "product_version",
    )
    properties = {name: surrogate.attributes.get(name) for name in names}
    properties["checksum"] = properties.pop("content_sha256")
    members = {
        **common.table_members(surrogate),
        "path": str(surrogate.path),
        **properties,
        "bytes": surrogate.path.stat().st_size,
    }
    bundled = [str(path) for path in bundled_tables()]
    if options.json:
        errors = surrogate.error_distribution
        return as_json({**members, "error_distribution": errors, "bundled": bundled})
    rows = [
        (name, f"{value:.3g}" if isinstance(value, float) else str(value))
        for name, value in members.items()
    ]
    text = in_columns([*rows, *zip_longest(["bundled"], bundled, fillvalue="")])
    return "\n\n".join([text, *_errors(surrogate)])


def _errors(surrogate: Surrogate) -> Iterator[str]:
    """How the verified errors are distributed, as text; nothing for a table without that."""
    distribution = surrogate.error_distribution
    if distribution:
        heads = [
            f"{100.0 * float(x):g} %" if x[0].isdigit() else x
            for x in next(iter(distribution.values()))
        ]
        rows = [
            (name, *(f"{value:.2g}" for value in part.values()))
            for name, part in distribution.items()
        ]
        text = (
            "Errors that a share of the verified points does not exceed; then how many\n"
            "times the error its bound is: 1 or more is a bound that holds."
        )
        yield f"{text}\n{in_columns([('', *heads), *rows])}"
