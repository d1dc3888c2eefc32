"""Cases written as text."""

import csv
import io
from collections.abc import Sequence
from typing import Any

Row = dict[str, Any]


def as_csv(rows: Sequence[Row]) -> str:
    """A head with the names of the first row, and the rows; None is an empty cell."""
    text = io.StringIO()
    csv.writer(text).writerows(
        [list(rows[0]), *(["" if x is None else x for x in row.values()] for row in rows)]
    )
    return text.getvalue()
