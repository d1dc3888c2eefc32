"""One value of one input is understood or refused by its name, whatever its type."""

import ast
import datetime
import decimal
import math
import re
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import constants

from mumacro import InputError
from mumacro.inputs.case import read
from mumacro.inputs.doubts import remarks
from mumacro.inputs.fields import INPUTS
from mumacro.inputs.numbers import read_number
from mumacro.inputs.units import QUANTITIES, Unit, canonical, parse_unit
from mumacro.motions.oscillation import read_oscillation
from tests.support.comparing import close
from tests.support.refusals import refused

TYPED = {
    ("y0", "2um"): 2e-6,
    ("y0", " 2 µm "): 2e-6,
    ("y0", "2 μm"): 2e-6,
    ("y0", "2,5um"): 2.5e-6,
    ("y0", "1.0D-3"): 1e-3,
    ("y0", "2×10⁻⁶ m"): 2e-6,
    ("y0", "10^-6"): 1e-6,
    ("y0", "2*10**-6 m"): 2e-6,
    ("y0", "２．５ ㎛"): 2.5e-6,
    ("y0", "\u200e2\u2009\u2060µm\ufeff"): 2e-6,
    ("y0", "2.5 um 0-p"): 2.5e-6,
    ("y0", "2.5 umpk"): 2.5e-6,
    ("y0", "2.5 um zero-to-peak"): 2.5e-6,
    ("y0", "1 mil"): 25.4e-6,
    ("y0", "1 ft"): 0.3048,
    ("y0", "2.5e−6"): 2.5e-6,
    ("Fz", "1.234,5 N"): 1234.5,
    ("Fz", "10 000 N"): 1e4,
    ("Fz", "1 kgf"): 9.80665,
    ("Fz", "1000 gf"): 9.80665,
    ("Fz", "5 µN"): 5e-6,
    ("k", "1N/um"): 1e6,
    ("k", "1 newton / micrometer"): 1e6,
    ("k", "1 N mm^-1"): 1e3,
    ("k", "1 N·mm⁻¹"): 1e3,
    ("k", "0.001 GN/m"): 1e6,
    ("k", "1200 newtons per millimetre"): 1.2e6,
    ("k", "1.2×10⁶"): 1.2e6,
    ("k", "1’200’000"): 1.2e6,
    ("k", "1 lbf/in"): 4.4482216152605 / 0.0254,
    ("Fz", "16 ozf"): 4.4482216152605,
    ("k", "Rigid"): math.inf,
    ("v0", "10 mm/sec"): 0.01,
    ("v0", "10 mm s^-1"): 0.01,
    ("v0", "36 km/h"): 10.0,
    ("v0", "36 kmh"): 10.0,
    ("v0", "10 ips"): 0.254,
    ("omega", "60 rpm"): 2.0 * math.pi,
    ("omega", "60 rad/min"): 1.0,
    ("omega", "180 deg/s"): math.pi,
    ("omega", "1 rev/s"): 2.0 * math.pi,
    ("omega", "3 mrad/s"): 3e-3,
    ("f", "1200 rpm"): 20.0,
    ("f", "1200 rev/min"): 20.0,
    ("f", "20 cycles/s"): 20.0,
    ("f", "20 kHz"): 2e4,
    ("mu0", "30 %"): 0.3,
    ("mu0", "250 ‰"): 0.25,
    ("phase", "90 deg"): 90.0,
    ("phase", "-1.5707963267948966 rad"): -90.0,
}


@pytest.mark.parametrize(("name", "text"), TYPED)
def test_a_text_is_read_as_a_person_types_it(name: str, text: str) -> None:
    value = read(name, text)
    assert value.si == close(TYPED[name, text], rel=1e-15) or value.si == TYPED[name, text]
    assert value.text == text


DEVIATIONS = {
    ("k", "1 ± 0.1 N/um"): (1e6, 1e5),
    ("k", "1N/um+-10%"): (1e6, 1e5),
    ("k", "1±10%N/um"): (1e6, 1e5),
    ("k", "(1 ± 10 %) N/um"): (1e6, 1e5),
    ("k", "1 N/um +/- 100 N/mm"): (1e6, 1e5),
    ("k", "(1.00 +/- 0.10) newton / micrometer"): (1e6, 1e5),
    ("mu0", "30 % ± 2 %"): (0.3, 0.02),
    ("mu0", "(30 ± 2) %"): (0.3, 0.02),
    ("mu0", "0.3 ± 10 %"): (0.3, 0.03),
}


@pytest.mark.parametrize(("name", "text"), DEVIATIONS)
def test_a_deviation_is_that_of_its_value(name: str, text: str) -> None:
    value = read(name, text)
    assert (value.si, value.std) == close(DEVIATIONS[name, text], rel=1e-14)


def test_an_interval_has_its_ends_and_their_geometric_middle() -> None:
    for text in ("0.8..1.2 N/um", "0.8N/um..1200N/mm", "8e5..1.2e6"):
        value = read("k", text)
        assert (value.low, value.high) == close((0.8e6, 1.2e6), rel=1e-15)
        assert value.si == close(math.sqrt(0.8e6 * 1.2e6), rel=1e-15)
    for k in (2.0, 3.0, 10.0, 1e300):  # squares of their roots lie beside them
        assert read("k", f"{k!r}..{k!r}")[:4] == (k, None, k, k)


REFUSED = {
    "y0": [
        "2 N",
        "4umpp",
        "1,000 um",
        "1000nm..2000nm",
        "",
        "x",
        "2um,90",
        "1..2",
        "5 g",
        "2 um rms",
        "2 um peak to peak",
        "2 µmss",
        "½ um",
        "2₀ um",
        "٢ um",
        "2 dB",
        "2026-11-27",
        "2um 3um",
        "2_0 um",
        "2(1) um",
        "2 um^0",
        "true",
    ],
    "Fz": ["+-nan", "inf-", "--inf", "100 g", "10 N/m", "1,000", "10 dBm"],
    "k": [
        "rigid ± 1",
        "0.8..1.2 ± 0.1",
        "(1 ± 10) %",
        "(1 ± 10) % N/um",
        "2..1",
        "1e999",
        "1e305 N/um",
        "1 ± 1e305 N/um",
        "1 ± 0.1e305 N/um",
        "1..1e305 N/um",
        "0.8-1.2N/um",
        "soft",
        "1 ± -0.1",
        "210 GPa",
        "1.00(10)",
        "1 N/um m^-0",
        *("∞", "~1.2e6", "0.8–1.2 N/um", "1.2M", " "),
    ],
    "omega": ["20 kHz"],
    "f": ["20 rad/s", "20 khz", "20 mhz"],
    "v0": ["1200 rpm", "10 m", "10 mm/s peak", "fast", "<0.01", "1+2j"],
    "mu0": ["0_3", "0x1", "30 ± 2 %", "0.2-0.3", "-10 dB", "1/4"],
}


@pytest.mark.parametrize(("name", "text"), [(n, t) for n, ts in REFUSED.items() for t in ts])
def test_what_is_not_understood_names_its_input_and_what_was_given(name: str, text: str) -> None:
    with refused(name) as caught:
        read(name, text)
    assert caught.value.value == text


_SAYS = ("give", "as", "mean", "be")  # before it
#: what is typed -> what its refusal says to give, and the value of that
ADVICE = {
    ("y0", "4umpp"): 2e-6,
    ("y0", "4 um p-p"): 2e-6,
    ("y0", "2 um rms"): math.sqrt(2.0) * 2e-6,
    ("Fz", "100 g"): 0.980665,
    ("Fz", "1 kg"): 9.80665,
    ("y0", "5 µm ss"): 2.5e-6,
    ("f", "20 khz"): 2e4,
    ("f", "20k"): 2e4,
    ("k", "1.2M"): 1.2e6,
    ("k", "1.00(10) N/um"): 1e6,
    ("mu0", "30 ± 2 %"): 0.3,
    ("k", "1 n/m"): 1.0,
    ("k", "0.8-1.2N/um"): math.sqrt(0.8e6 * 1.2e6),
    ("x", "2um,90"): (1, 2e-6, 90.0),
}


@pytest.mark.parametrize(("name", "text"), ADVICE)
def test_advice_leads_to_the_right_number(name: str, text: str) -> None:
    reader: Any = read_oscillation if name == "x" else read
    with pytest.raises(InputError) as refused:
        reader(name, text)
    words = refused.value.bound.replace("?", " ").split()
    given = next(
        (" ".join(words[i + 1 :]) for i, x in enumerate(words) if x in _SAYS),
        "",
    )
    given = re.split(", |;", given)[0]
    if name == "x":
        assert reader(name, given) == [ADVICE[name, text]]
    else:
        assert read(name, given).si == close(ADVICE[name, text], rel=1e-11)


@pytest.mark.parametrize("text", ["2 dB", "10 dBm", "-10 dB re 1 N", "3 decibels", "1 Neper"])
def test_a_level_is_told_that_its_reference_is_not_known(text: str) -> None:
    with pytest.raises(InputError, match="the reference of a level in dB is not known"):
        read("Fz", text)


def test_thousands_and_decimal_signs_are_read_where_they_are_clear() -> None:
    for text in ("1,234,567.5", "1.234.567,5", "1 234 567.5", "1'234'567,5"):
        assert read_number(text) == 1234567.5
    assert read_number("1.000", ",") == read_number("1,000", ".") == 1000.0
    with pytest.raises(ValueError, match=r"1000 or 1\.0"):
        read_number("1,000")


@pytest.mark.parametrize("number", [0.1, 1e-300, 12345.678, 1e22, 5e-324])
def test_a_number_that_python_writes_is_read_to_the_last_bit(number: float) -> None:
    assert read_number(repr(number)) == number
    assert read("y0", repr(number)).si == number


def test_every_unit_of_the_table_is_read_and_is_its_own_name() -> None:
    for name, quantity in QUANTITIES.items():
        for unit, scale in quantity.units.items():
            assert parse_unit(name, unit) == Unit(unit, scale)
            if unit not in ("", "1", "-"):
                assert quantity.units.get(canonical(unit)) == scale
        assert quantity.units[quantity.unit].si(1.0) == 1.0


PREFIXES = {"p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "d": -1}
PREFIXES |= {"da": 1, "k": 3, "M": 6, "G": 9, "T": 12}
BASES = {
    **dict.fromkeys(("m", "N", "s", "Hz", "Pa", "m2", "rad", "1", "-", ""), 1.0),
    "Å": constants.angstrom,
    "in": constants.inch,
    "ft": constants.foot,
    "mil": constants.mil,
    "kgf": constants.kgf,
    "gf": constants.kgf / 1e3,
    "dyn": constants.dyn,
    "lbf": constants.lbf,
    "ozf": constants.lbf / 16.0,
    "mph": constants.mph,
    "min": 60.0,
    "h": 3600.0,
    "mm2": 1e-6,
    "bar": constants.bar,
    "psi": constants.psi,
    "ksi": 1e3 * constants.psi,
    "%": 1e-2,
    "‰": 1e-3,
    "deg": math.pi / 180.0,
    "°": math.pi / 180.0,
}
#: sizes of what turns, by quantity
TURNS = {
    "angular frequency": {"rev": math.tau, "rpm": math.tau / 60.0, "1/min": math.tau / 60.0},
    "frequency": {"rev": 1.0, "rpm": 1.0 / 60.0},
}


def size(unit: str, bases: dict[str, float]) -> float:
    """The size of a unit in SI by the definitions of its parts."""
    if unit in bases:
        return bases[unit]
    upper, _, lower = unit.partition("/")
    if lower:
        return size(upper, bases) / size(lower, bases)
    prefix = next(one for one in PREFIXES if unit.removeprefix(one) in bases)
    return 10.0 ** PREFIXES[prefix] * bases[unit.removeprefix(prefix)]


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_every_unit_has_the_size_of_its_definition(quantity: str) -> None:
    units, bases = QUANTITIES[quantity].units, {**BASES, **TURNS.get(quantity, {})}
    of_si = size(QUANTITIES[quantity].unit, bases)
    for unit, scale in units.items():
        assert scale.si(1.0) == close(size(unit, bases) / of_si, rel=1e-15), unit


@pytest.mark.parametrize(
    "value", [decimal.Decimal("0.5"), np.float32(0.5), np.ma.array(0.5), np.array(0.5), np.int8(1)]
)
def test_numbers_of_any_type_are_numbers(value: Any) -> None:
    assert read("mu0", value).si == float(value)


@pytest.mark.parametrize(
    "value",
    [
        *(None, 1j, b"1", {}, {1}, object(), np.datetime64("2026-01-01"), pd.NA, pd.NaT),
        *(True, np.bool_(True), np.array(True), bytearray(b"1"), np.array(b"1"), np.ma.masked),
        *(datetime.date(2026, 11, 27), datetime.timedelta(1), np.timedelta64(1, "s")),
        *((x for x in (1.0,)), float, np.zeros((), [("a", float)]), [1.0], (1.0, 2.0)),
        *(10**400, decimal.Decimal("1e400"), np.longdouble(1e300) * 1e300, np.ones(2)),
    ],
)
def test_what_is_no_number_names_its_input(value: Any) -> None:
    with refused("y0"):
        read("y0", value)


def test_every_input_has_an_example_that_is_usual() -> None:
    for name, field in INPUTS.items():
        least, most = field.usual
        assert least <= read(name, field.example).si <= most
        assert ast.literal_eval(repr(field.example)) == field.example


CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 2e4 * 2.0 * math.pi, "v0": 0.01}
DOUBTED = {
    "mu0": (30.0, 1e-4),
    "Fz": (1e7, 1e-7),
    "k": (1.0, 1e13, 0.5),
    "y0": (2.0, 1e-13, 0.03, 1e-3),  # the last has a peak speed of 126 m/s
    "omega": (1e-4, 1e10, 1.2e8),
    "v0": (301.0,),
}


@pytest.mark.parametrize(("name", "value"), [(n, v) for n, vs in DOUBTED.items() for v in vs])
def test_what_is_unusual_is_remarked_on_for_one_case_and_in_columns(
    name: str, value: float
) -> None:
    [one] = remarks({**CASE, name: value})
    assert (one.row, one.field, one.cases) == ("units", name, 1)
    column = np.array([CASE[name], value, math.nan, value])
    [many] = remarks({**CASE, name: column})
    assert (many.row, many.field, many.cases) == ("units", name, 2)


def test_usual_cases_zero_and_gaps_are_not_doubted() -> None:
    assert remarks(CASE) == []
    for name in ("y0", "omega", "v0"):
        expected = [] if name == "v0" else [("model", name, 1)]
        for value in (0.0, np.array([0.0, CASE[name], math.nan])):
            found = remarks({**CASE, name: value})
            assert [(one.row, one.field, one.cases) for one in found] == expected
    assert remarks({name: np.zeros(0) for name in CASE}) == []


@pytest.mark.parametrize(
    ("changed", "row"),
    [
        ({"y0": 0.0, "omega": 0.0}, "model"),
        ({"k": 1e8, "y0": 1e-7, "omega": 1.0, "v0": 100.0}, "units"),  # v~ = 3e9
        ({"k": 1e12, "y0": 1e-2}, "units"),  # y~ = 3e9
    ],
)
def test_a_case_gets_one_remark(changed: dict[str, float], row: str) -> None:
    assert [one.row for one in remarks({**CASE, **changed})] == [row]


def test_all_cases_with_a_remark_on_one_input_are_counted_by_it() -> None:
    """Whether k itself is unusual or the length that it gives."""
    [remark] = remarks({**CASE, "k": np.array([0.5, 1e6, 2.0, 1e13])})
    assert (remark.field, remark.cases) == ("k", 3)


def test_a_rigid_contact_is_told_what_it_assumes() -> None:
    [remark] = remarks({**CASE, "k": math.inf})
    assert (remark.row, remark.field) == ("k is known", "k")
    assert "1.5e+06 N/m" in remark.text
    [largest] = remarks({**CASE, "k": math.inf, "y0": np.array([2e-6, 1e-6, 3e-6])})
    assert "3e+06 N/m" in largest.text


@pytest.mark.parametrize("k", [math.inf, 0.5, 1e6, 2e12])
@pytest.mark.parametrize("y0", [0.0, 1e-13, 2e-6, 0.1])
@pytest.mark.parametrize("omega", [0.0, 1e-5, 1.3e5, 1e10])
@pytest.mark.parametrize("v0", [0.0, 0.01, 400.0])
def test_one_case_has_the_remarks_of_a_column_of_one(
    k: float, y0: float, omega: float, v0: float
) -> None:
    case = {**CASE, "k": k, "y0": y0, "omega": omega, "v0": v0}
    assert remarks(case) == remarks({**case, "k": np.array([k])})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        (name, value)
        for name in ("mu0", "Fz", "k", "y0", "omega", "v0")
        for value in (-1.0, -0.0, 0.0, -math.inf, math.inf, math.nan)
        if (name, value) != ("k", math.inf)  # a rigid contact is legal
    ],
)
def test_what_is_not_legal_is_not_doubted(name: str, value: float) -> None:
    found = remarks({**CASE, name: np.array([CASE[name], value])})
    still = value == 0.0 and name in ("y0", "omega")  # legal, and it needs no model
    assert [one.row for one in found] == ["model"] * still
