"""Small tables for notebooks."""

import html
from collections.abc import Iterable


def html_table(
    head: Iterable[str], rows: Iterable[Iterable[object]], left_out: int = 0, notes: Iterable[str] = ()
) -> str:
    """A table with numbers to six digits, how many rows are left out, and lines below it.

    Examples
    --------
    >>> html_table(["a"], [[0.25]], 3)
    '<table><tr><th>a</th></tr><tr><td>0.25</td></tr></table><p>and 3 more</p>'
    """

    def row(cells: Iterable[object], tag: str) -> str:
        texts = (f"{cell:.6g}" if isinstance(cell, float) else str(cell) for cell in cells)
        return "<tr>" + "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in texts) + "</tr>"

    below = [*([f"and {left_out:,} more"] if left_out > 0 else []), *notes]
    first = [row(names, "th")] if (names := [*head]) else []
    lines = [*first, *(row(cells, "td") for cells in rows)]
    return f"<table>{''.join(lines)}</table>" + "".join(f"<p>{html.escape(text)}</p>" for text in below)
