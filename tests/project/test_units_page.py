"""The page of units is the table of units; that of outputs has every output, and so has the help of
``evaluate``."""

from collections.abc import Iterable

from mumacro import Surrogate
from mumacro.inputs.fields import INPUTS
from mumacro.inputs.units import QUANTITIES
from mumacro.outputs import OUTPUTS
from tests.support.places import ROOT

PAGE = ROOT / "docs" / "units.md"
NAMED = ("mu0", "Fz", "k", "y0", "f", "v0", "Fz_amplitude")

#: what has the units of a quantity that no input has
_OTHERS = {"angle": "phases", "pressure": "moduli"}


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
        rows.append(f"| {name} | {inputs or _OTHERS[name]} | {units} |")
    return rows


def test_the_page_has_every_unit_of_the_table() -> None:
    assert "\n".join(lines()) in PAGE.read_text("utf-8")


def _cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.strip("|").split("|")]


def test_the_page_has_the_usual_ranges() -> None:
    head, _, ranges = next(
        part for part in PAGE.read_text("utf-8").split("\n\n") if "| 0.001 to 2 |" in part
    ).splitlines()
    shown = dict(zip(_cells(head), _cells(ranges), strict=True))
    assert shown == {_code(name): "{:g} to {:g}".format(*INPUTS[name].usual) for name in NAMED}


def test_the_page_of_outputs_has_every_output() -> None:
    page = (ROOT / "docs" / "outputs.md").read_text("utf-8")
    assert ", ".join(OUTPUTS) in " ".join(str(Surrogate.evaluate.__doc__).split())
    for name, output in OUTPUTS.items():
        assert f"| `{name}` |" in page
        tops = {path.partition(".")[0] for path in output.members}
        assert [top for top in tops if f"`{top}" not in page] == []
