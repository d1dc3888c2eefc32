"""The page of units is the table of units."""

from collections.abc import Iterable

from mumacro.inputs.fields import INPUTS
from mumacro.inputs.units import QUANTITIES
from tests.support.places import ROOT


def _code(unit: str) -> str:
    return f"`{unit}`"


def _listed(units: Iterable[str]) -> str:
    return ", ".join(map(_code, units))


def lines() -> list[str]:
    """One line for each quantity: what it measures, its inputs, the units that are read."""
    rows = ["| what | inputs | units |", "| --- | --- | --- |"]
    for name, quantity in QUANTITIES.items():
        inputs = ", ".join(f"`{field.name}`" for field in INPUTS.values() if field.quantity == name)
        parts = [unit.partition("/") for unit in quantity.units if unit]
        upper, lower = (dict.fromkeys(part[i] for part in parts if part[1]) for i in (0, 2))
        if len(upper) > 4 and len(lower) > 4:
            alone = [unit for unit in quantity.units if "/" not in unit]
            units = f"{_listed(upper)} over {_listed(lower)}" + ", ".join(["", *map(_code, alone)])
        else:
            units = _listed(filter(None, quantity.units))
        rows.append(f"| {name} | {inputs or 'phases, moduli'} | {units} |")
    return rows


def test_the_page_has_every_unit_of_the_table() -> None:
    page = (ROOT / "docs" / "units.md").read_text("utf-8")
    assert "\n".join(lines()) in page
