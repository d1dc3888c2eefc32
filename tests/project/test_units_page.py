"""The page of units is the table of units."""

from mumacro.inputs.fields import INPUTS
from mumacro.inputs.units import QUANTITIES
from tests.support.places import ROOT


def lines() -> list[str]:
    """One line for each quantity: what it measures, its inputs, the units that are read."""
    rows = ["| what | inputs | units |", "| --- | --- | --- |"]
    for name, quantity in QUANTITIES.items():
        inputs = ", ".join(f"`{field.name}`" for field in INPUTS.values() if field.quantity == name)
        upper = dict.fromkeys(unit.partition("/")[0] for unit in quantity.units)
        lower = dict.fromkeys(unit.partition("/")[2] for unit in quantity.units)
        if (
            len(upper) * len(lower) in (len(quantity.units), len(quantity.units) + 4)
            and len(lower) > 2
        ):
            first, second = ("`, `".join(filter(None, part)) for part in (upper, lower))
            units = f"one of `{first}` over one of `{second}`"
        else:
            units = ", ".join(f"`{unit}`" for unit in quantity.units if unit)
        rows.append(f"| {name} | {inputs or 'angles of motions, materials'} | {units} |")
    return rows


def test_the_page_has_every_unit_of_the_table() -> None:
    page = (ROOT / "docs" / "units.md").read_text("utf-8")
    assert "\n".join(lines()) in page
