"""Run ``mumacro table``: print the table in use and its errors."""

from collections.abc import Iterator, Sequence
from itertools import zip_longest

from mumacro.cli import common
from mumacro.cli.common import OneLineParser, as_json, in_columns, open_table
from mumacro.surrogate import Surrogate
from mumacro.table.bundled import bundled_tables


def run(words: Sequence[str]) -> str:
    """Run ``mumacro table``."""
    parser = OneLineParser(
        prog="mumacro table",
        description="Name, path, tolerance, verified errors and checksum of the table in use.",
        epilog="example:\n  mumacro table --table 1e-7",
    )
    common.add_options(parser, "table", "json")
    options = parser.parse_args(words)
    surrogate = open_table(options.table)
    members = {
        **common.members_of(surrogate),
        "path": str(surrogate.path),
        "verified_max_abs_error": surrogate.max_abs_error,
        "verified_max_rel_error": surrogate.max_rel_error,
        "checksum": surrogate.checksum,
        "format_version": surrogate.attributes["format_version"],
        "product_version": surrogate.attributes.get("product_version"),
        "bytes": surrogate.path.stat().st_size,
    }
    bundled = [str(path) for path in bundled_tables()]
    if options.json:
        errors = {
            "error_distribution": surrogate.error_distribution,
            "interpolation_errors": surrogate.table.interpolation_errors,
        }
        return as_json({**members, **errors, "bundled": bundled})
    rows = [
        (name, f"{value:.3g}" if isinstance(value, float) else str(value))
        for name, value in members.items()
    ]
    text = in_columns([*rows, *zip_longest(["bundled"], bundled, fillvalue="")])
    return "\n\n".join([text, *_errors(surrogate)])


def _errors(surrogate: Surrogate) -> Iterator[str]:
    """Yield lines of text: how the errors of the answers are distributed, and the errors of other
    programs that interpolate the plain grid."""
    yield (
        "Errors that a share of the verified points does not exceed; then how many\n"
        "times the error its bound is: 1 or more is a bound that holds.\n"
        f"{_by_share(surrogate.error_distribution)}"
    )
    yield (
        "The same of tools that interpolate the plain grid of the file over ln v_tilde\n"
        "and ln y_tilde, as mumacro does not.\n"
        f"{_by_share(surrogate.table.interpolation_errors)}"
    )


def _by_share(errors: dict[str, dict[str, float]]) -> str:
    """Return statistics by name in columns, with fractions of points as per cent."""
    heads = [
        f"{100.0 * float(name):g} %" if name[0].isdigit() else name
        for name in next(iter(errors.values()))
    ]
    rows = [(name, *(f"{value:.2g}" for value in part.values())) for name, part in errors.items()]
    return in_columns([("", *heads), *rows])
