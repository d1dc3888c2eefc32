"""Hold the results of a fit to a loop: :class:`LoopFit`, from :func:`mumacro.fit_loop`."""

import math
from dataclasses import dataclass, field
from typing import Any

from mumacro import plotting
from mumacro.inputs.units import unit_of
from mumacro.kernel.arrays import Array
from mumacro.results import NOTE, Note, Result, Rows, texts_of

_UNITS = {"offset": "N", "drift": "N/sample"}


@dataclass(frozen=True, repr=False)
class LoopFit(Result):
    """k and mu0 of a contact, fitted to a measured loop.

    Attributes
    ----------
    values : dict
        k [N/m], mu0 [-].  With whole cycles also ``offset``, the force at the first sample that
        counts [N]; with two cycles or more also ``drift`` [N per sample].  k is infinite if the
        loop never sticks, mu0 if it never slips.
    interval : dict of tuple
        Their 95 % intervals (low, high), with the correlation of neighbouring residuals; high = inf
        if there is no bound.
    residuals : ndarray
        Measured force minus force of the model [N], at the samples that count.
    scatter : float
        Standard deviation of the force about the model [N].
    energy : float
        Work of the measured force over a cycle [J]; NaN for less than a cycle.
    cycles : int
        Number of whole cycles.
    notes : tuple of Note
        What was changed in the loop, what it does not determine, and what contradicts the model.
    contact : str
        "spring" or "ball".
    loop : dict of ndarray
        The samples that count: displacement [m], force [N], Fz [N] and ``fitted``, the force of the
        model [N].
    """

    values: dict[str, float]
    interval: dict[str, tuple[float, float]]
    residuals: Array
    scatter: float
    energy: float
    cycles: int
    notes: tuple[Note, ...] = field()
    contact: str
    loop: dict[str, Array]

    def plot(self, ax: Any = None) -> Any:
        """Plot the measured loop and the loop of the model, and below them the residuals.

        ``ax`` is a pair of matplotlib axes, or one (then no residuals are drawn), or None for new
        ones.  The upper axes are returned.
        """
        k, mu0 = self.values["k"], self.values["mu0"]
        title = f"k = {k:.4g} N/m, mu0 = {mu0:.4g}; {self.contact}"
        x, force, fitted = (self.loop[name] for name in ("displacement", "force", "fitted"))
        return plotting.plot_loop(x, force, fitted, title, ax)

    def _members(self) -> dict[str, Any]:
        names = ("values", "interval", "scatter", "energy", "cycles")
        notes = texts_of(self.notes, NOTE)
        rest = {"contact": self.contact, "loop": self.loop, "residuals": self.residuals}
        return {**{name: getattr(self, name) for name in names}, "notes": notes, **rest}

    @property
    def columns(self) -> dict[str, Array]:
        """Return the samples that count, with the residuals."""
        return {**self.loop, "residual": self.residuals}

    def _rows(self) -> Rows:
        """Return name, value, unit and interval of each value as text, and the energy."""
        rows: Rows = []
        for name, value in self.values.items():
            low, high = self.interval[name]
            unit = _UNITS.get(name) or unit_of(name)
            ends = f"95 %: {low:.5g} to {high:.5g}"
            rows.append((name, f"{value:.5g}", f"[{unit}]", ends))
        if math.isfinite(self.energy):
            rows.append(("energy", f"{self.energy:.4g}", "[J]", "of a cycle"))
        rows.append(("scatter", f"{self.scatter:.2g}", "[N]", "of the force about the model"))
        return rows

    def _heading(self) -> str:
        count = f"{self.residuals.size} samples, {self.cycles} cycles"
        return f"<LoopFit of a {self.contact}: {count}>"
