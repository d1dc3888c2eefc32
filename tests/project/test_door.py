"""Kinds of values by entrances: every cell is the right number, or a refusal that names what it
refuses."""

import datetime
import decimal
import functools
import importlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest

import mumacro
from mumacro import InputError
from mumacro.cli.main import main
from tests.support.cases import Capture, opened
from tests.support.comparing import close

BASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}
Read = dict[str, Any]


@functools.cache
def package(name: str) -> Any:
    return importlib.import_module(name)


def pint(number: Any, unit: str) -> Any:
    return _registry().Quantity(number, unit)


@functools.cache
def _registry() -> Any:
    return package("pint").UnitRegistry()


# --- kinds: a change of the usual case, and the same in SI numbers, or the name that is refused ---

Kind = tuple[Callable[[], Read], "Read | str"]
#: one of each sort: what is understood of a text is listed in test_case.py
TEXTS: dict[str, Kind] = {
    "number": (lambda: {"y0": 2.5e-6}, {"y0": 2.5e-6}),
    "text with a unit": (lambda: {"y0": "2.5um", "v0": "12 mm/s"}, {"y0": 2.5e-6, "v0": 0.012}),
    "decimal comma": (lambda: {"y0": "2,5 um"}, {"y0": 2.5e-6}),
    "wrong dimension": (lambda: {"y0": "2 N"}, "y0"),
    "peak to peak": (lambda: {"y0": "4umpp"}, "y0"),
    "ambiguous": (lambda: {"Fz": "1,000"}, "Fz"),
    "interval of another input": (lambda: {"y0": "1um..2um"}, "y0"),
    "misspelt name": (lambda: {"vo": 0.02}, "vo"),
    "name with a unit": (lambda: {"v0 [mm/s]": 20}, "v0 [mm/s]"),
    "negative": (lambda: {"v0": "-1 mm/s"}, "v0"),
    "blank": (lambda: {"k": " "}, "k"),
}
#: deviations and intervals, which evaluate and its forms take: mu_macro, its deviation, its least
SPREADS: dict[str, tuple[Read, Read]] = {
    "deviation": ({"k": "1 ± 0.1 N/um"}, {"std_k": 1e5}),
    "percentage points": ({"mu0": "30 % ± 2 %"}, {"std_mu0": 0.02}),
    "of a frequency": ({"f": "20 ± 1 kHz"}, {"std_f": 1e3}),
    "interval": ({"k": "0.8..1.2 N/um"}, {"k_low": 0.8e6, "k_high": 1.2e6}),
}
#: what has no text, one of each sort: numbers of any type are in test_case.py
OBJECTS: dict[str, Kind] = {
    "Decimal": (lambda: {"y0": decimal.Decimal("2.5e-6")}, {"y0": 2.5e-6}),
    "truth": (lambda: {"mu0": True}, "mu0"),
    "date": (lambda: {"v0": datetime.date(2026, 11, 27)}, "v0"),
    "NA": (lambda: {"k": pd.NA}, "k"),
    "None": (lambda: {"k": None}, "k"),
    "frame": (lambda: {"v0": pd.DataFrame({"a": [0.01]})}, "v0"),
}


def _unit(name: str) -> Any:
    return getattr(package("astropy.units"), name)


def _magnitude(number: float, unit: str) -> Any:
    units = package("astropy.units")
    return units.Magnitude(number, units.mag(_unit(unit)))


def _unyt(number: Any, unit: str) -> Any:
    unyt = package("unyt")
    return (unyt.unyt_array if np.ndim(number) else unyt.unyt_quantity)(number, unit)


def _masked(numbers: Sequence[float], unit: str) -> Any:
    masked = package("astropy.utils.masked").Masked
    return masked(numbers * _unit(unit), mask=[False] * len(numbers))


#: by the package, which .ci/peers installs
QUANTITIES: dict[str, tuple[str, Kind]] = {
    "pint": ("pint", (lambda: {"y0": pint(2.5, "um")}, {"y0": 2.5e-6})),
    "pint, wrong": ("pint", (lambda: {"y0": pint(2.5, "s")}, "y0")),
    "pint, hertz": ("pint", (lambda: {"f": pint(21.0, "kHz")}, {"f": 21e3})),
    "pint, cycles": ("pint", (lambda: {"f": pint(21e3, "cycle/s")}, {"f": 21e3})),
    "pint, radians": ("pint", (lambda: {"f": pint(1e5, "rad/s")}, "f")),
    "pint of a base unit": ("pint", (lambda: {"k": pint(1.2e6, "kg/s**2")}, {"k": 1.2e6})),
    "pint in per cent": ("pint", (lambda: {"mu0": pint(25.0, "percent")}, {"mu0": 0.25})),
    "pint, a mass": ("pint", (lambda: {"Fz": pint(100.0, "g")}, "Fz")),
    "pint, a temperature": ("pint", (lambda: {"mu0": pint(1.0, "degC")}, "mu0")),
    "pint, a unit alone": ("pint", (lambda: {"y0": _registry().um}, "y0")),
    "pint of a Decimal": (
        "pint",
        (lambda: {"y0": pint(decimal.Decimal("2.5"), "um")}, {"y0": 2.5e-6}),
    ),
    "astropy": ("astropy.units", (lambda: {"y0": 2.5 * _unit("um")}, {"y0": 2.5e-6})),
    "astropy, wrong": ("astropy.units", (lambda: {"y0": 2.5 * _unit("s")}, "y0")),
    "astropy, a level": ("astropy.units", (lambda: {"mu0": -10.0 * _unit("dB")}, "mu0")),
    "astropy, a positive level": ("astropy.units", (lambda: {"Fz": 10.0 * _unit("dB")}, "Fz")),
    "astropy, a magnitude": ("astropy.units", (lambda: {"y0": 2.0 * _unit("mag")}, "y0")),
    "astropy, a logarithm": ("astropy.units", (lambda: {"y0": _magnitude(2.0, "um")}, "y0")),
    "astropy, data with a unit": (
        "astropy.nddata",
        (lambda: {"y0": package("astropy.nddata").NDData(2.0, unit="um")}, "y0"),
    ),
    "astropy, a unit alone": ("astropy.units", (lambda: {"y0": _unit("um")}, "y0")),
    "astropy in per cent": (
        "astropy.units",
        (lambda: {"mu0": 25.0 * _unit("percent")}, {"mu0": 0.25}),
    ),
    "unyt": ("unyt", (lambda: {"v0": _unyt(12.0, "mm/s")}, {"v0": 0.012})),
    "unyt, wrong": ("unyt", (lambda: {"v0": _unyt(12.0, "mm")}, "v0")),
    "unyt, a unit alone": ("unyt", (lambda: {"y0": package("unyt").um}, "y0")),
    "uncertainties, no deviation here": (
        "uncertainties",
        (lambda: {"k": package("uncertainties").ufloat(1e6, math.nan)}, "k"),
    ),
}
_TWO = {"y0": [2e-6, 3e-6]}
ARRAYS: dict[str, tuple[str, Kind]] = {
    "texts": ("numpy", (lambda: {"y0": ["2um", "3um"]}, "y0")),
    "a truth among numbers": ("numpy", (lambda: {"mu0": [0.3, True]}, "mu0")),
    "lists of two lengths": ("numpy", (lambda: {"y0": [[2e-6], [2e-6, 3e-6]]}, "y0")),
    "pint array": ("pint", (lambda: {"y0": pint(np.array([2.0, 3.0]), "um")}, _TWO)),
    "list of pint": ("pint", (lambda: {"y0": [pint(2.0, "um"), pint(3e-3, "mm")]}, "y0")),
    "astropy array": ("astropy.units", (lambda: {"y0": [2.0, 3.0] * _unit("um")}, _TWO)),
    "list of astropy": (
        "astropy.units",
        (lambda: {"y0": [2.0 * _unit("um"), 3000.0 * _unit("nm")]}, "y0"),
    ),
    "astropy, masked": ("astropy.utils.masked", (lambda: {"y0": _masked([2.0, 3.0], "um")}, _TWO)),
    "unyt array": ("unyt", (lambda: {"y0": _unyt([2.0, 3.0], "um")}, _TWO)),
    "list of unyt": ("unyt", (lambda: {"y0": [_unyt(2.0, "um"), _unyt(3e-3, "mm")]}, "y0")),
    "list of unyt arrays": (
        "unyt",
        (lambda: {"y0": [_unyt([2.0, 3.0], "um")]}, "y0"),
    ),
    "pint-pandas": (
        "pint_pandas",
        (lambda: {"y0": pd.Series([2.0, 3.0], dtype="pint[um]")}, _TWO),
    ),
    "pint-pandas, wrong": (
        "pint_pandas",
        (lambda: {"y0": pd.Series([2.0, 3.0], dtype="pint[s]")}, "y0"),
    ),
    "pint-pandas without labels": (
        "pint_pandas",
        (lambda: {"y0": pd.array([2.0, 3.0], dtype="pint[um]")}, _TWO),
    ),
    "pint-pandas index": (
        "pint_pandas",
        (lambda: {"y0": pd.Index(pd.array([2.0, 3.0], dtype="pint[um]"))}, _TWO),
    ),
    "xarray attrs": (
        "xarray",
        (
            lambda: {"v0": package("xarray").DataArray([10.0, 20.0], attrs={"units": "mm s-1"})},
            {"v0": [0.01, 0.02]},
        ),
    ),
    "xarray attrs, wrong": (
        "xarray",
        (lambda: {"v0": package("xarray").DataArray([10.0, 20.0], attrs={"units": "1"})}, "v0"),
    ),
    "pint-xarray": (
        "pint_xarray",
        (
            lambda: {
                "v0": package("xarray")
                .DataArray([10.0, 20.0], attrs={"units": "mm/s"})
                .pint.quantify()
            },
            {"v0": [0.01, 0.02]},
        ),
    ),
}
#: deviations that values carry themselves
DEVIATING: dict[str, tuple[str, Callable[[], Any]]] = {
    "uncertainties": ("uncertainties", lambda: package("uncertainties").ufloat(1e6, 1e5)),
    "uncertainties in pint": (
        "uncertainties",
        lambda: pint(package("uncertainties").ufloat(1.0, 0.1), "N/um"),
    ),
    "measurement of pint": ("uncertainties", lambda: pint(1.0, "N/um").plus_minus(0.1)),
}


def by_package(kinds: Mapping[str, tuple[str, Any]]) -> list[Any]:
    """The names of kinds, those of other packages marked peer."""
    ours = ("numpy", "xarray")
    marks: dict[str, Any] = {
        name: () if kinds[name][0] in ours else pytest.mark.peer for name in kinds
    }
    return [pytest.param(name, marks=mark, id=name) for name, mark in marks.items()]


# --- entrances: a function of the case gives a number ---------------------------------------------


def surrogate() -> Any:
    return opened(1e-7)


def keywords(case: Read) -> Any:
    return surrogate().evaluate(**case).mu_macro


def mapping(case: Read) -> Any:
    return surrogate().evaluate(case).mu_macro


def law(case: Read) -> Any:
    rest = {name: x for name, x in case.items() if name != "v0"}
    return mumacro.law(surrogate(), values=[_si("v0", case["v0"])], **rest).answer.mu_macro[0]


def solved(case: Read) -> Any:
    rest = {name: x for name, x in case.items() if name != "mu0"}
    mu0 = _si("mu0", case["mu0"])
    target = surrogate().evaluate(**{**_plain(rest), "mu0": mu0}).mu_macro
    [[root]] = mumacro.solve_for(surrogate(), "mu0", target, **rest).roots
    return keywords({**_plain(rest), "mu0": root.value})


def moved(case: Read) -> Any:
    rest = {name: x for name, x in case.items() if name != "y0"}
    return mumacro.motion(**rest, y=case["y0"]).mu_macro


def stepped(case: Read) -> Any:
    contact = mumacro.Element(**{name: case[name] for name in ("mu0", "Fz", "k")})
    extra = {name: x for name, x in case.items() if name not in BASE}
    if extra:
        return mumacro.Element(case["mu0"], case["Fz"], case["k"], **extra)
    return contact.step(case["y0"], 0.0)[0]


def predicted(case: Read) -> Any:
    """mu_macro of a fit whose points have the case's Fz, y0 and f, at its v0."""
    plain = _plain(case)
    v0 = np.geomspace(1e-3, 1.0, 12)
    mu = surrogate().evaluate(**{**plain, "v0": v0, "k": 1e6, "mu0": 0.3}).mu_macro
    rest = {name: case[name] for name in case if name not in ("mu0", "k", "v0")}
    found = mumacro.fit({"v0": v0, "mu_macro": mu}, surrogate=surrogate(), **rest)
    return found.predict(v0=case["v0"]).mu_macro


def _si(name: str, value: Any) -> float:
    from mumacro.inputs.case import read_one

    return read_one(name, value)


def _plain(case: Read) -> Read:
    from mumacro.inputs.case import read

    return {name: read(name, x).si for name, x in case.items()}


PYTHON = {
    "keywords": keywords,
    "mapping": mapping,
    "law": law,
    "solve_for": solved,
    "motion": moved,
    "Element": stepped,
    "fit": predicted,
}


#: inputs that an entrance does not have
_WITHOUT = {"Element": ("v0", "f"), "fit": ("mu0", "k")}
#: what an entrance calls the amplitude
_AMPLITUDE_OF: dict[Callable[[Read], Any], str] = {moved: "y, amplitude|y must", stepped: "dx"}


def judged(entrance: Callable[[Read], Any], kind: Kind, right: Callable[[Read], Any]) -> None:
    """The right number, or a refusal that names what it refuses."""
    make, meant = kind
    case = {**BASE, **make()}
    if isinstance(meant, str):
        with pytest.raises((InputError, TypeError)) as refused:
            entrance(case)
        named = _AMPLITUDE_OF.get(entrance, meant) if meant == "y0" else meant
        assert any(name in str(refused.value) for name in named.split("|"))
        return
    got = entrance(case)
    np.testing.assert_allclose(np.asarray(got), np.asarray(right({**BASE, **meant})), rtol=1e-9)


@pytest.mark.parametrize("entrance", PYTHON)
@pytest.mark.parametrize("kind", TEXTS)
def test_a_typed_value_is_understood_or_named(kind: str, entrance: str) -> None:
    _try(TEXTS[kind], entrance)


def _try(of_kind: Kind, entrance: str) -> None:
    if {*of_kind[0]()} & {*_WITHOUT.get(entrance, ())}:
        return  # this function has no such input, or fits it
    judged(PYTHON[entrance], of_kind, PYTHON[entrance])


@pytest.mark.parametrize("entrance", PYTHON)
@pytest.mark.parametrize("kind", OBJECTS)
def test_an_object_is_understood_or_named(kind: str, entrance: str) -> None:
    _try(OBJECTS[kind], entrance)


@pytest.mark.parametrize("entrance", PYTHON)
@pytest.mark.parametrize("kind", by_package(QUANTITIES))
def test_a_value_with_a_unit_is_understood_or_named(kind: str, entrance: str) -> None:
    module, of_kind = QUANTITIES[kind]
    _importable(module)
    _try(of_kind, entrance)


def _importable(module: str) -> None:
    pytest.importorskip(module, reason=f"{module} of requirements/peers.txt is not installed")


@pytest.mark.parametrize("entrance", ["keywords", "mapping", "motion"])
@pytest.mark.parametrize("kind", by_package(ARRAYS))
def test_arrays_of_any_kind_are_understood_or_named(kind: str, entrance: str) -> None:
    module, of_kind = ARRAYS[kind]
    _importable(module)
    judged(PYTHON[entrance], of_kind, PYTHON[entrance])


@pytest.mark.parametrize("kind", by_package(DEVIATING))
def test_a_value_with_a_deviation_of_its_own_is_understood(kind: str) -> None:
    module, make = DEVIATING[kind]
    _importable(module)
    answer = surrogate().evaluate(**{**BASE, "k": make()})
    right = surrogate().evaluate(**BASE, std_k=1e5)
    assert (answer.mu_macro, answer["std"]) == close((right.mu_macro, right["std"]), rel=1e-9)
    with pytest.raises(InputError, match=r"std_k|unit belongs"):  # a column holds numbers
        surrogate().evaluate(**{**BASE, "k": [make(), 1e6]})


# --- the command, files and HTTP ------------------------------------------------------------------


@pytest.mark.parametrize("quoted", ["apart", "together"])
@pytest.mark.parametrize("kind", TEXTS)
def test_the_command_understands_or_names(capsys: Capture, kind: str, quoted: str) -> None:
    make, meant = TEXTS[kind]
    words = [f"{name}={value}" for name, value in {**BASE, **make()}.items()]
    words = words if quoted == "apart" else [" ".join(words)]
    code = main([*words, "--json", "--table", "1e-7"])
    out, err = capsys.readouterr()
    if isinstance(meant, str):
        assert code == 2
        assert meant.split()[0] in err  # blanks separate what is typed
    else:
        assert json.loads(out)["mu_macro"] == close(keywords({**BASE, **meant}), rel=1e-9)


def _asked(server: Any, change: Read, form: str) -> tuple[int, Any]:
    case: Mapping[str, Any] = {**BASE, **change, "tolerance": 1e-7}
    if form == "query":
        from urllib.parse import urlencode

        status, _, text = server.ask("GET", f"/v1/mu-macro?{urlencode(case)}")
    elif form == "one":
        status, _, text = server.ask("POST", "/v1/mu-macro", json.dumps(case))
    elif form == "rows":
        rows = [{name: x for name, x in case.items() if name != "tolerance"}]
        status, _, text = server.ask("POST", "/v1/mu-macro/batch?tolerance=1e-7", json.dumps(rows))
    else:
        columns = {name: x if name == "tolerance" else [x] for name, x in case.items()}
        status, _, text = server.ask("POST", "/v1/mu-macro/batch", json.dumps(columns))
    return status, json.loads(text)


FORMS = ["query", "one", "rows", "columns"]


@pytest.mark.parametrize("form", FORMS[:2])
@pytest.mark.parametrize("kind", TEXTS)
def test_http_understands_or_names(live_server: Any, kind: str, form: str) -> None:
    make, meant = TEXTS[kind]
    status, answer = _asked(live_server, make(), form)
    if isinstance(meant, str):
        assert status == 422
        (fault,) = answer["errors"]
        assert (fault["field"], "math.inf" in fault["reason"]) == (meant, False)  # JSON has no inf
        return
    assert status == 200, answer
    assert math.isclose(answer["mu_macro"], keywords({**BASE, **meant}), rel_tol=1e-9)


#: values of JSON that are no numbers and no texts
STRANGE: dict[str, Any] = {"true": True, "null": None, "list": [[2e-6]], "object": {"um": 2}}


@pytest.mark.parametrize("form", FORMS[1:])
@pytest.mark.parametrize("name", BASE)
@pytest.mark.parametrize("kind", STRANGE)
def test_json_that_is_no_value_is_named(live_server: Any, kind: str, name: str, form: str) -> None:
    status, answer = _asked(live_server, {name: STRANGE[kind]}, form)
    assert status == 422 or form in ("rows", "columns")
    fields = {fault["field"] for fault in answer["errors"]}
    assert fields == {name} or (kind == "null" and fields == {"omega"} and name == "f")


# --- deviations and intervals at every entrance ---------------------------------------------------


def _spread(answer: Mapping[str, Any]) -> list[float]:
    """mu_macro, its deviation and its lowest value, of JSON."""
    numbers = (answer["mu_macro"], answer.get("std"), answer.get("mu_macro_low"))
    return [float(np.ravel(x)[0]) for x in numbers if x is not None]


def _right(kind: str) -> list[float]:
    change = SPREADS[kind][1]
    rest = {name: x for name, x in BASE.items() if not ("k_low" in change and name == "k")}
    return _spread(surrogate().evaluate(**rest, **change).to_dict())


@pytest.mark.parametrize("kind", SPREADS)
def test_a_deviation_or_an_interval_is_understood_everywhere(
    capsys: Capture, live_server: Any, kind: str
) -> None:
    change, right = SPREADS[kind][0], _right(kind)
    case = {**BASE, **change}
    assert len(right) == (2 if kind == "interval" else 3)
    assert _spread(surrogate().evaluate(**case).to_dict()) == close(right, rel=1e-9)
    assert _spread(surrogate().evaluate(case).to_dict()) == close(right, rel=1e-9)
    words = " ".join(f"{name}={value}" for name, value in case.items())
    assert main([words, "--json", "--table", "1e-7"]) == 0
    assert _spread(json.loads(capsys.readouterr().out)) == close(right, rel=1e-9)
    for form in FORMS[:2]:
        status, answer = _asked(live_server, change, form)
        assert status == 200, answer
        assert _spread(answer) == close(right, rel=1e-9)
