"""Kinds of values by entrances: every cell is the right number, or a refusal that names what it
refuses."""

import functools
import importlib
import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
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
TEXTS: dict[str, Kind] = {
    "number": (lambda: {"y0": 2.5e-6}, {"y0": 2.5e-6}),
    "text in SI": (lambda: {"y0": "2.5e-6"}, {"y0": 2.5e-6}),
    "text with a unit": (lambda: {"y0": "2.5um", "v0": "12 mm/s"}, {"y0": 2.5e-6, "v0": 0.012}),
    "decimal comma": (lambda: {"y0": "2,5 um"}, {"y0": 2.5e-6}),
    "another unit system": (lambda: {"Fz": "1 kgf"}, {"Fz": 9.80665}),
    "exponents": (lambda: {"k": "1200 N mm^-1"}, {"k": 1.2e6}),
    "per cent": (lambda: {"mu0": "25 %"}, {"mu0": 0.25}),
    "rpm": (lambda: {"f": "600000 rpm"}, {"f": 1e4}),
    "wrong dimension": (lambda: {"y0": "2 N"}, "y0"),
    "peak to peak": (lambda: {"y0": "4umpp"}, "y0"),
    "mass": (lambda: {"Fz": "100 g"}, "Fz"),
    "ambiguous": (lambda: {"Fz": "1,000"}, "Fz"),
    "no number": (lambda: {"v0": "fast"}, "v0"),
    "interval of another input": (lambda: {"y0": "1um..2um"}, "y0"),
    "misspelt name": (lambda: {"vo": 0.02}, "vo"),
    "negative": (lambda: {"v0": "-1 mm/s"}, "v0"),
}
QUANTITIES: dict[str, tuple[str, Kind]] = {
    "pint": ("pint", (lambda: {"y0": pint(2.5, "um")}, {"y0": 2.5e-6})),
    "pint, wrong": ("pint", (lambda: {"y0": pint(2.5, "s")}, "y0")),
    "pint, hertz": ("pint", (lambda: {"f": pint(21.0, "kHz")}, {"f": 21e3})),
    "pint of a base unit": ("pint", (lambda: {"k": pint(1.2e6, "kg/s**2")}, {"k": 1.2e6})),
    "astropy": (
        "astropy.units",
        (lambda: {"y0": 2.5 * package("astropy.units").um}, {"y0": 2.5e-6}),
    ),
    "astropy, wrong": ("astropy.units", (lambda: {"y0": 2.5 * package("astropy.units").s}, "y0")),
    "unyt": ("unyt", (lambda: {"v0": package("unyt").unyt_quantity(12.0, "mm/s")}, {"v0": 0.012})),
    "unyt, wrong": ("unyt", (lambda: {"v0": package("unyt").unyt_quantity(12.0, "mm")}, "v0")),
}
ARRAYS: dict[str, tuple[str, Kind]] = {
    "array": ("numpy", (lambda: {"y0": np.array([2e-6, 3e-6])}, {"y0": [2e-6, 3e-6]})),
    "texts": ("numpy", (lambda: {"y0": ["2um", 3e-6]}, {"y0": [2e-6, 3e-6]})),
    "masked": ("numpy", (lambda: {"y0": np.ma.array([2e-6, 3e-6])}, {"y0": [2e-6, 3e-6]})),
    "pint array": (
        "pint",
        (lambda: {"y0": pint(np.array([2.0, 3.0]), "um")}, {"y0": [2e-6, 3e-6]}),
    ),
    "list of pint": (
        "pint",
        (lambda: {"y0": [pint(2.0, "um"), pint(3e-3, "mm")]}, {"y0": [2e-6, 3e-6]}),
    ),
    "astropy array": (
        "astropy.units",
        (lambda: {"y0": [2.0, 3.0] * package("astropy.units").um}, {"y0": [2e-6, 3e-6]}),
    ),
    "pint-pandas": (
        "pint_pandas",
        (
            lambda: {"y0": package("pandas").Series([2.0, 3.0], dtype="pint[um]")},
            {"y0": [2e-6, 3e-6]},
        ),
    ),
    "xarray attrs": (
        "xarray",
        (
            lambda: {"v0": package("xarray").DataArray([10.0, 20.0], attrs={"units": "mm s-1"})},
            {"v0": [0.01, 0.02]},
        ),
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


def settled(case: Read) -> Any:
    return mumacro.settling(surrogate(), **case).periods


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
    from mumacro.inputs.reading import read_one

    return read_one(name, value)


def _plain(case: Read) -> Read:
    from mumacro.inputs.reading import read

    return {name: read(name, x).si for name, x in case.items()}


PYTHON = {
    "keywords": keywords,
    "mapping": mapping,
    "law": law,
    "solve_for": solved,
    "settling": settled,
    "motion": moved,
    "Element": stepped,
    "fit": predicted,
}


#: what an entrance calls the amplitude
_AMPLITUDE_OF: dict[Callable[[Read], Any], str] = {moved: "y, amplitude", stepped: "dx"}


def judged(entrance: Callable[[Read], Any], kind: Kind, right: Callable[[Read], Any]) -> None:
    """The right number, or a refusal that names what it refuses."""
    make, meant = kind
    case = {**BASE, **make()}
    if isinstance(meant, str):
        with pytest.raises((InputError, TypeError)) as refused:
            entrance(case)
        named = _AMPLITUDE_OF.get(entrance, meant) if meant == "y0" else meant
        assert named in str(refused.value)
        return
    got = entrance(case)
    np.testing.assert_allclose(np.asarray(got), np.asarray(right({**BASE, **meant})), rtol=1e-9)


@pytest.mark.parametrize("entrance", PYTHON)
@pytest.mark.parametrize("kind", TEXTS)
def test_a_typed_value_is_understood_or_refused(kind: str, entrance: str) -> None:
    skip = {"Element": ("v0", "f"), "fit": ("mu0", "k")}
    change, meant = TEXTS[kind][0](), TEXTS[kind][1]
    if set(change) & set(skip.get(entrance, ())):
        return  # this function has no such input, or fits it
    assert PYTHON[entrance] is not None
    judged(PYTHON[entrance], (lambda: change, meant), PYTHON[entrance])


@pytest.mark.peer
@pytest.mark.parametrize("entrance", PYTHON)
@pytest.mark.parametrize("kind", QUANTITIES)
def test_a_value_with_a_unit_is_understood_or_refused(kind: str, entrance: str) -> None:
    module, of_kind = QUANTITIES[kind]
    pytest.importorskip(module, reason=f"{module} of requirements/peers.txt is not installed")
    skip = {"Element": ("v0", "f"), "fit": ("mu0", "k")}
    if set(of_kind[0]()) & set(skip.get(entrance, ())):
        return
    judged(PYTHON[entrance], of_kind, PYTHON[entrance])


@pytest.mark.parametrize("entrance", ["keywords", "mapping", "settling", "motion"])
@pytest.mark.parametrize("kind", ARRAYS)
def test_arrays_of_any_kind_are_understood(kind: str, entrance: str) -> None:
    module, of_kind = ARRAYS[kind]
    pytest.importorskip(module, reason=f"{module} of requirements/peers.txt is not installed")
    judged(PYTHON[entrance], of_kind, PYTHON[entrance])


# --- the command and HTTP -------------------------------------------------------------------------


@pytest.mark.parametrize("kind", TEXTS)
def test_the_command_understands_or_refuses(capsys: Capture, kind: str) -> None:
    make, meant = TEXTS[kind]
    words = [f"{name}={value}" for name, value in {**BASE, **make()}.items()]
    code = main([*words, "--json", "--table", "1e-7"])
    out, err = capsys.readouterr()
    if isinstance(meant, str):
        assert code == 2
        assert meant in err
    else:
        assert json.loads(out)["mu_macro"] == close(keywords({**BASE, **meant}), rel=1e-9)


def _asked(server: Any, kind: str, form: str) -> tuple[int, Any]:
    make, _ = TEXTS[kind]
    case: Mapping[str, Any] = {**BASE, **make(), "tolerance": 1e-7}
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


@pytest.mark.parametrize("form", ["query", "one", "rows", "columns"])
@pytest.mark.parametrize("kind", TEXTS)
def test_http_understands_or_refuses(live_server: Any, kind: str, form: str) -> None:
    meant = TEXTS[kind][1]
    status, answer = _asked(live_server, kind, form)
    if isinstance(meant, str):
        faults = answer["errors"]
        assert status == 422 or form in ("rows", "columns")
        assert [fault["field"] for fault in faults] == [meant]
        return
    assert status == 200, answer
    got = answer["results"][0]["mu_macro"] if form == "rows" else np.ravel(answer["mu_macro"])[0]
    assert math.isclose(got, keywords({**BASE, **meant}), rel_tol=1e-9)
