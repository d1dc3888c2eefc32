"""The plot of speed against error: these tables in red, the peers in other colours."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

__all__ = ["plot"]

RED, INK, GRID = "#c1272d", "#222222", "#e4e4e4"
LABELS = {
    "scipy RegularGridInterpolator linear": ("RegularGridInterpolator linear", "#7f7f7f", "o"),
    "scipy RectBivariateSpline.ev k=3": ("RectBivariateSpline k=3", "#1f5fa8", "s"),
    "scipy RectBivariateSpline.ev k=5": ("RectBivariateSpline k=5", "#1f5fa8", "D"),
    "scipy NdBSpline k=3": ("NdBSpline k=3", "#5aa0d8", "^"),
    "scipy NdBSpline k=5": ("NdBSpline k=5", "#5aa0d8", "v"),
    "scipy map_coordinates order 1": ("map_coordinates order 1", "#2e7d4f", "o"),
    "scipy map_coordinates order 3": ("map_coordinates order 3", "#2e7d4f", "s"),
    "scipy map_coordinates order 5": ("map_coordinates order 5", "#2e7d4f", "D"),
    "xarray interp linear": ("xarray interp linear", "#a6761d", "o"),
    "interpolation (numba) k=1": ("interpolation (numba) k=1", "#7b4fa3", "o"),
    "interpolation (numba) k=3": ("interpolation (numba) k=3", "#7b4fa3", "s"),
    "baobzi": ("baobzi, adaptive", "#e08214", "P"),
}


class RowLike(Protocol):
    """The fields of a row used in the plot."""

    @property
    def kind(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def size(self) -> str: ...
    @property
    def ns(self) -> float: ...
    @property
    def max_abs(self) -> float: ...


def plot(rows: Sequence[RowLike], path: Path) -> None:
    """Write the plot of ``rows`` to ``path``: solvers in the upper panel, tables and interpolators in the lower."""
    plt.rcParams.update({"font.size": 10.5, "axes.edgecolor": INK, "axes.labelcolor": INK})
    figure, (top, low) = plt.subplots(2, 1, sharex=True, figsize=(9.5, 7.2), height_ratios=(1, 2.6))
    lines: dict[str, list[RowLike]] = defaultdict(list)
    for row in rows:
        if row.kind == "peer":
            lines["baobzi" if row.name.startswith("baobzi") else row.name].append(row)
    for name, members in lines.items():
        if name in LABELS:
            label, colour, marker = LABELS[name]
            x, y = [r.max_abs for r in members], [r.ns for r in members]
            low.plot(x, y, marker=marker, color=colour, lw=1.0, ms=6, alpha=0.85, label=label)
        elif name.startswith("eq. (35)"):
            low.plot(members[0].max_abs, members[0].ns, "*", color=INK, ms=11, label="eq. (35), rigid contact")
    ours = [r for r in rows if r.kind == "ours" and "threads" not in r.size]
    x, y = [r.max_abs for r in ours], [r.ns for r in ours]
    low.plot(x, y, "o-", color=RED, lw=2.2, ms=10, label="this table, 1 thread", zorder=5)
    for r in ours:
        low.annotate(
            r.name.removeprefix("mumacro-"), (r.max_abs, r.ns), (0, -19), textcoords="offset points",
            ha="center", color=RED, weight="bold",
        )  # fmt: skip
    for row in rows:
        if row.kind == "exact" and row.max_abs == row.max_abs:
            own = "direct" in row.name
            top.plot(row.max_abs, row.ns, "o", color=RED if own else INK, ms=10 if own else 8)
            text = "our direct solve" if own else "solve_ivp, marched to the steady cycle"
            top.annotate(text, (row.max_abs, row.ns), (11, -4), textcoords="offset points", color=RED if own else INK)
    _dress(top, low)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _dress(top: Any, low: Any) -> None:
    for axes in (top, low):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.grid(True, which="major", color=GRID, lw=0.8)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    top.set_ylim(1e4, 1e9)
    low.set_ylim(9, 2000)
    low.set_xlim(2e-17, 3)
    low.set_xticks([10.0**e for e in range(-16, 1, 2)])
    low.set_xlabel(r"largest error of $\tilde\mu$ over $\tilde v$, $\tilde y$ from 0.001 to 1000")
    low.set_ylabel("ns per point, one thread")
    top.set_ylabel("ns per point")
    top.set_title("Left and down is better: time per point against largest error", loc="left", color=INK)
    note = "plain grids: 64², 256², 1024² nodes from right to left"
    low.legend(fontsize=9, ncols=2, loc="upper left", frameon=True, framealpha=1.0, edgecolor=GRID, title=note)
    top.figure.tight_layout()
