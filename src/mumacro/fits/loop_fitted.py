"""What a fit of a loop says: :class:`LoopFit`, from :func:`mumacro.fit_loop`."""

import math
from dataclasses import dataclass, field
from typing import Any

from mumacro import plotting
from mumacro.inputs.units import unit_of
from mumacro.kernel.arrays import Array
from mumacro.notes import NOTE, Note, texts_of
from mumacro.results import Result, Rows

_UNITS = {"offset": "N", "drift": "N/sample"}


@dataclass(frozen=True, repr=False)
class LoopFit(Result):
    """k and mu0 of a contact, fitted to a measured loop.

    Attributes
    ----------
    values : dict
        k [N/m], mu0 [-]; of whole cycles ``offset`` of the force at the first sample that counts
        [N], of two cycles or more its ``drift`` [N a sample].  k is infinite where the loop never
        sticks, mu0 where it never slips.
    interval : dict of tuple
        Their 95 % intervals (low, high), which take into account that residuals beside each other
        are alike; high = inf where there is no bound.
    residuals : ndarray
        Measured force minus that of the model [N], of the samples that count.
    scatter : float
        Standard deviation of the force about the model [N].
    energy : float
        Work of the measured force over a cycle [J]; NaN for less than a cycle.
    cycles : int
        How many whole cycles there are.
    notes : tuple of Note
        What was done to the loop, what it leaves open, and what speaks against the model.
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
        """Return the measured loop and that of the model, and below them the residuals.

        ``ax`` are two axes of matplotlib, or one, which gets no residuals, or new ones; the upper
        ones are returned.
        """
        title = f"{', '.join(self._texts()[:2])}; {self.contact}"
        x, force, fitted = (self.loop[name] for name in ("displacement", "force", "fitted"))
        return plotting.plot_loop(x, force, fitted, title, ax)

    def _members(self) -> dict[str, Any]:
        names = ("values", "interval", "scatter", "energy", "cycles")
        notes = texts_of(self.notes, NOTE)
        rest = {"contact": self.contact, "loop": self.loop, "residuals": self.residuals}
        return {**{name: getattr(self, name) for name in names}, "notes": notes, **rest}

    @property
    def columns(self) -> dict[str, Array]:
        """The samples that count, with the residuals."""
        return {**self.loop, "residual": self.residuals}

    def _rows(self) -> Rows:
        """Name, value, unit and interval of each value as text, and the energy."""
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

    def _texts(self) -> list[str]:
        units = {"k": " N/m", "mu0": ""} | {name: f" {unit}" for name, unit in _UNITS.items()}
        return [f"{name} = {value:.4g}{units[name]}" for name, value in self.values.items()]

    def _heading(self) -> str:
        count = f"{self.residuals.size} samples, {self.cycles} cycles"
        return f"<LoopFit of a {self.contact}: {count}>"
