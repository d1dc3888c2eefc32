"""How results show themselves: at most 16 lines in a terminal, a table in a notebook, a dict for
JSON, a frame of pandas."""

import inspect
import json
import re
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

import mumacro
from mumacro import InputError, Surrogate
from mumacro.cli.main import main
from mumacro.inputs.units import known
from mumacro.outputs import OUTPUTS
from mumacro.results import Result
from tests.support.cases import Case
from tests.support.comparing import close

CASE: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}
MOTION: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e5, "f": 50.0, "x": 1e-4, "normal": (8.0, -90.0)}


def without(*names: str) -> dict[str, Any]:
    return {name: x for name, x in CASE.items() if name not in names}


def fit_of(n: int, warn: bool = False) -> mumacro.Fit:
    s, v0 = Surrogate.open(1e-7), np.geomspace(1e-3, 1.0, n)
    noise = 2e-3 * np.cos(17.0 * np.arange(n)) + (0.01 if warn else 0.0)
    rig = without("v0", "k", "mu0")
    if warn:  # k is hardly determined
        rig["y0"] = 1e-9
    mu = s.evaluate(**{**CASE, **rig, "v0": v0}).mu_macro
    return mumacro.fit({"v0": v0, "mu_macro": mu + noise}, surrogate=s, **rig)


EVERY = [*OUTPUTS]
#: what is computed, of one case and of many
RESULTS: dict[str, Callable[[Surrogate, int], Any]] = {
    "answer": lambda s, n: s.evaluate(**without("v0"), v0=np.geomspace(1e-4, 1.0, n)),
    "answer with all outputs": lambda s, n: s.evaluate(
        **without("v0"), v0=np.geomspace(1e-4, 1.0, n), include=EVERY, std_k=1e5
    ),
    "answer in two dimensions": lambda s, n: s.evaluate(
        **without("v0", "y0"), v0=np.geomspace(1e-4, 1.0, n)[:, None], y0=[1e-6, 2e-6]
    ),
    "interval": lambda s, n: s.evaluate(
        **without("k", "v0"), v0=[0.01] * n, k_low=8e5, k_high=1.2e6
    ),
    "law": lambda s, n: mumacro.law(s, start=1e-4, stop=1.0, points=n + 1, **without("v0")),
    "solution": lambda s, n: mumacro.solve_for(
        s, "y0", np.linspace(0.1, 0.4, n), **without("y0")
    ),
    "motion": lambda _, n: mumacro.motion(**MOTION, v0=np.geomspace(1e-3, 1.0, n)),
    "cycle": lambda _, n: mumacro.motion(**MOTION, v0=0.01).cycle(points=n + 1),
    "solution of a motion": lambda _, n: mumacro.solve_motion(
        "v0", np.linspace(-0.2, 0.2, n), **MOTION
    ),
    "prediction": lambda _, n: fit_of(9).predict(v0=np.geomspace(1e-3, 1.0, n)),
    "fit": lambda _, n: fit_of(n + 3),
}  # fmt: skip
ONE: dict[str, Callable[[Surrogate], Any]] = {
    "answer": lambda s: s.evaluate(**CASE),
    "answer with all outputs": lambda s: s.evaluate(**CASE, include=EVERY, std_k=1e5),
    "rigid": lambda s: s.evaluate(**{**CASE, "k": "rigid"}),
    "interval": lambda s: s.evaluate(**without("k"), k_low=8e5, k_high=1.2e6),
    "motion": lambda _: mumacro.motion(**MOTION, v0=0.01),
    "solution of a motion": lambda _: mumacro.solve_motion("v0", 0.0, **MOTION),
    "solution without a root": lambda s: mumacro.solve_for(s, "y0", 0.5, **without("y0")),
    "prediction": lambda _: fit_of(9).predict(v0=0.01),
    "fit with warnings": lambda _: fit_of(12, warn=True),
    "surrogate": lambda s: s,
    "element": lambda _: mumacro.Element(0.3, 10.0, 1e6, contact="ball"),
    "elements": lambda _: mumacro.Element(np.full(1000, 0.3), 10.0, 1e6),
}


def test_the_forms_of_all_results_are_made_in_one_place(surrogate: Surrogate) -> None:
    steel = mumacro.stiffness.Material("steel")
    made = {type(of_n(surrogate, 2)) for of_n in RESULTS.values()}
    made |= {mumacro.LoopFit, mumacro.Harmonics, type(surrogate.evaluate(**CASE))}
    made.add(type(mumacro.stiffness.ball_on_flat(5e-3, 10.0, steel, steel)))
    for kind in made:
        for name in ("to_dict", "to_frame", "__repr__", "_repr_html_"):
            assert getattr(kind, name) is getattr(Result, name), (kind, name)


def is_short(text: str) -> bool:
    lines = text.splitlines()
    return len(lines) <= 16 and max(map(len, lines)) <= 100


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", RESULTS)
@pytest.mark.parametrize("n", [1, 11, 300])
def test_a_result_fits_16_lines_and_other_forms_hold_all_of_it(
    surrogate: Surrogate, name: str, n: int
) -> None:
    pandas = pytest.importorskip("pandas")
    result = RESULTS[name](surrogate, n)
    assert is_short(repr(result)), repr(result)
    assert well_formed(result._repr_html_())
    assert len(result._repr_html_()) < 50_000
    frame = result.to_frame()
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) >= n or name.startswith("solution")
    for path in getattr(result, "paths", ()):
        np.testing.assert_array_equal(frame[path].to_numpy(), np.ravel(result[path]))
    # what json writes by itself is strict JSON: no NaN
    json.loads(json.dumps(result.to_dict(), allow_nan=False))


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", ONE)
def test_one_result_fits_16_lines(surrogate: Surrogate, name: str) -> None:
    result = ONE[name](surrogate)
    assert is_short(repr(result)), repr(result)
    if hasattr(result, "_repr_html_"):
        assert well_formed(result._repr_html_())
        json.loads(json.dumps(result.to_dict(), allow_nan=False))
        assert len(result.to_frame()) >= ("root" not in name)


def well_formed(text: str) -> bool:
    """Whether every tag of HTML is closed."""
    open_tags: list[str] = []

    class Tags(HTMLParser):
        def handle_starttag(self, tag: str, _: Any) -> None:
            open_tags.append(tag)

        def handle_endtag(self, tag: str) -> None:
            assert open_tags.pop() == tag

    Tags().feed(text)
    return not open_tags


def test_without_pandas_a_frame_names_it(
    surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(mumacro.MumacroError, match="pip install pandas"):
        surrogate.evaluate(**CASE).to_frame()


# --- one case: what the command prints ------------------------------------------------------------


@pytest.mark.parametrize(
    "more",
    [
        "",
        "k=rigid",
        "k=0.8..1.2N/um",
        "k=1±0.1N/um",
        "contact=ball",
        "direction=along",
        "include=power,settling,gradient",
        "v0=0",
        "Fz=1e12",
    ],
)
def test_a_notebook_shows_of_one_case_what_the_command_prints(
    surrogate: Surrogate, capsys: pytest.CaptureFixture[str], more: str
) -> None:
    case = {"mu0": "0.3", "Fz": "10N", "k": "1N/um", "y0": "2um", "f": "20kHz", "v0": "10mm/s"}
    name, _, value = more.partition("=")
    options = {name: value} if name in ("contact", "direction", "include") else {}
    if more and not options:
        case[name] = value
    words = " ".join(f"{name}={value}" for name, value in case.items())
    assert main([words, *(f"--{name}={value}" for name, value in options.items())]) == 0
    _case, _, printed = capsys.readouterr().out.partition("\n")  # a cell shows its case itself
    cells = re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>|<p>(.*?)</p>", html_of(surrogate, case, options))
    shown = " ".join(a or b for a, b in cells)
    assert shown.split() == printed.replace(">", "&gt;").replace("<", "&lt;").split()


def html_of(surrogate: Surrogate, case: Any, options: Any) -> str:
    return str(surrogate.evaluate(case, **options)._repr_html_())


@pytest.mark.parametrize("options", [{}, {"include": ("limits", "gradient", "power", "settling")}])
@pytest.mark.parametrize("k", [1.0, [1.0, 2.0, 1e6]])
def test_a_doubt_is_shown_with_the_answer(surrogate: Surrogate, k: Any, options: Any) -> None:
    case = {"mu0": 0.3, "Fz": 10.0, "k": k, "y0": 2e-6, "f": 20e3, "v0": 0.01}
    answer = surrogate.evaluate(case, **options)
    (remark,) = answer.remarks
    for shown in (repr(answer), answer._repr_html_()):
        assert remark["text"] in " ".join(shown.split())
    assert is_short(repr(answer))
    assert "remark" not in repr(surrogate.evaluate({**case, "k": 1e6}, **options))


# --- numbers with the digits that are known -------------------------------------------------------


def test_no_digit_is_below_the_error_and_none_that_is_known_is_lost() -> None:
    rng = np.random.default_rng(5)
    for _ in range(2000):
        value = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-12.0, 12.0))
        error = float(abs(value) * 10.0 ** rng.uniform(-12.0, 3.0))
        text = known(value, 6, error=error)
        off = abs(float(text) - value)
        assert off <= max(0.5 * 10.0 ** np.ceil(np.log10(error)), 5.1e-6 * abs(value))
        mantissa, _, exponent = text.partition("e")
        places = len(mantissa.partition(".")[2])
        last = 10.0 ** (int(exponent or 0) - places)
        assert text == "0" or last >= 0.99 * 10.0 ** np.floor(np.log10(error))


# --- the value of a solution ----------------------------------------------------------------------


def test_the_value_of_a_solution_is_its_one_root(surrogate: Surrogate) -> None:
    solution = mumacro.solve_for(surrogate, "y0", 0.15, **without("y0"))
    assert solution.value == solution.roots[0][0].value
    assert solution.unit == "m"
    at = surrogate.evaluate(**{**CASE, "y0": solution.value})
    assert at.mu_macro == close(0.15, abs=1e-12)


@pytest.mark.parametrize(
    ("unknown", "target", "says"),
    [
        ("y0", 0.5, "out of reach"),
        ("y0", [0.1, 0.2], "2: see .roots"),
        ("k", 0.05, "there are"),
    ],
)
def test_a_solution_without_one_root_has_no_value(
    surrogate: Surrogate, unknown: str, target: Any, says: str
) -> None:
    case: Case = {**CASE, "y0": 1e-4, "v0": 0.5} if unknown == "k" else CASE
    case = {name: x for name, x in case.items() if name != unknown}
    if unknown == "k":  # a fold: several roots
        curve = surrogate.evaluate(**case, k=np.geomspace(1e3, 1e9, 4000)).mu_macro
        turns = np.flatnonzero(np.diff(np.sign(np.diff(curve))) != 0)
        target = float(curve[turns + 1].mean())
    solution = mumacro.solve_for(surrogate, unknown, target, **case)
    with pytest.raises(InputError) as error:
        _ = solution.value
    assert says in str(error.value)


# --- signatures -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(mumacro.__all__))
def test_signatures_are_readable(name: str) -> None:
    """No argument has a type of more than 60 characters."""
    thing = getattr(mumacro, name)
    functions: list[Any] = [thing] if inspect.isfunction(thing) else []
    if inspect.isclass(thing) and not issubclass(thing, Exception):
        functions = [f for n, f in vars(thing).items() if inspect.isfunction(f) and n[0] != "_"]
        functions.append(thing.__init__)
    for function in functions:
        if function.__qualname__.startswith(
            ("Fit.__init__", "LoopFit.__init__", "MotionSolution.__init__")
        ):
            continue  # made by the package
        for parameter in inspect.signature(function).parameters.values():
            shown = str(parameter).partition(":")[2].partition("=")[0]
            assert len(shown) <= 60, f"{function.__qualname__}: {parameter}"
