"""How numpy reports overflow, division by zero and invalid numbers is the caller's choice for the
caller's arrays: it changes no answer, and ends no public function."""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mumacro
from mumacro import Surrogate, closed_forms, stiffness
from mumacro.outputs import OUTPUTS
from tests.support.cases import CASE, PAIRS, as_kind, opened, without

EDGES = np.array([0.0, 5e-324, 1e-300, 1e-150, 1e-3, 1.0, 1e3, 1e150, 1e300, np.inf, np.nan])
STEEL = {"E": 210e9, "nu": 0.3}
RIG: dict[str, Any] = {"Fz": 10.0, "y0": 2e-6, "f": 20e3}


def evaluated(s: Surrogate) -> Any:
    """Every input at the ends of the range, every output, every kind."""
    out = []
    for pair in PAIRS:
        names, _, case = as_kind({**CASE, "v0": EDGES}, pair)
        for name, value in CASE.items():
            if name not in case or name == "v0":
                continue
            grid = {**case, name: value * np.array([1e-200, 1.0, 1e200])[:, None]}
            lacks = {"settling", "power"} if pair[1] != "across" else set()
            include = [output for output in OUTPUTS if output != "std" and output not in lacks]
            out.append(s.evaluate(grid, **names, include=include).to_dict())
            out.append(s.evaluate(grid, **names, **{f"std_{name}": 0.1 * value}).to_dict())
    return out


def one_by_one(s: Surrogate) -> Any:
    return [
        s.evaluate(
            **{**CASE, name: scale * value}, include=[name for name in OUTPUTS if name != "std"]
        ).to_dict()
        for name, value in CASE.items()
        for scale in (1e-300, 1e-150, 1.0, 1e150, 1e295)
    ]


def intervals(s: Surrogate) -> Any:
    return [
        s.evaluate(**{**without(CASE, "k"), "k": "0.8..1.2 N/um", "v0": EDGES}).to_dict(),
        s.evaluate(**{**without(CASE, "k"), "k": "rigid", "v0": EDGES}).to_dict(),
    ]


def groups(s: Surrogate) -> Any:
    v, y = np.meshgrid(EDGES, EDGES)
    return [
        s.mu_ratio(v, y),
        s.power(v, y),
        s.stick_fraction(v, y),
        s.v_tilde_crit(y),
        *(s.slopes(v, y, name, bounds=True) for name in ("mu_ratio", "power", "stick_fraction")),
        *(s.quantity("mu_ratio", v, y, contact=c, direction=d) for c, d in PAIRS),
    ]


def solved(s: Surrogate) -> Any:
    targets = [1e-6, 0.01, 0.15, 0.17, 0.2999999, 0.3]
    return [
        mumacro.solve_for(s, unknown, target, **without({**CASE, "y0": y0}, unknown)).to_dict()
        for unknown in CASE
        for target in targets
        for y0 in (1e-9, 3e-6, 1e-4)
    ]


def fitted(s: Surrogate) -> Any:
    v0 = np.geomspace(1e-3, 1.0, 12)
    mu = s.evaluate(mu0=0.3, k=1e6, v0=v0, **RIG).mu_macro * (1.0 + 0.01 * np.cos(9.0 * v0))
    found = mumacro.fit({"v0": v0, "mu_macro": mu}, surrogate=s, **RIG)
    known = mumacro.fit({"v0": v0, "mu_macro": mu}, "k", mu0=0.3, surrogate=s, **RIG)
    return [found.to_dict(), known.to_dict(), found.predict(v0=EDGES[:-2]).to_dict(), found.curve()]


def motions(s: Surrogate) -> Any:
    del s
    case = without(CASE, "y0", "v0")
    return [
        mumacro.motion(**case, v0=v0, x=x, y=2e-6, contact=contact).to_dict()
        for v0 in (0.0, 1e-6, 0.01, 10.0)
        for x in (0.0, 1e-6)
        for contact in ("spring", "ball")
    ]


def solved_motions(s: Surrogate) -> Any:
    del s
    case = without(CASE, "y0", "v0")
    return mumacro.solve_motion("v0", 0.15, **case, y=2e-6, x=1e-6, within=(1e-3, 1.0)).to_dict()


def laws(s: Surrogate) -> Any:
    return [
        mumacro.law(s, start=1e-6, stop=10.0, **without({**CASE, "y0": y0}, "v0")).answer.to_dict()
        for y0 in (0.0, 1e-300, 2e-6, 1e-3)
    ]


def forms(s: Surrogate) -> Any:
    del s
    out = []
    for name, form in vars(closed_forms).items():
        if inspect.isfunction(form) and form.__module__ == closed_forms.__name__ and name[0] != "_":
            out.append(form(*[EDGES] * len(inspect.signature(form).parameters)))
    return out


def contacts(s: Surrogate) -> Any:
    del s
    steel = stiffness.Material(**STEEL)
    return [
        stiffness.ball_on_flat(1e-3, 10.0, steel, steel),
        stiffness.flat_punch(1e-3, 10.0, steel, steel),
        stiffness.in_series(1e6, 1e300, 1e-3),
    ]


def stepped(s: Surrogate) -> Any:
    del s
    element = mumacro.Element(mu0=0.3, Fz=10.0, k=1e6)
    return [element.step(x, y) for x in (0.0, 1e-300, 1e-6, 1e3) for y in (0.0, -1e-6)]


def settled(s: Surrogate) -> Any:
    return [
        s.evaluate({**CASE, "v0": EDGES[:-2]}, contact=contact, include="settling").to_dict()
        for contact in ("spring", "ball")
    ]


ASKED: list[Callable[[Surrogate], Any]] = [
    *(evaluated, one_by_one, intervals, groups, solved, fitted, motions, solved_motions, laws),
    *(forms, contacts, stepped, settled),
]


@pytest.mark.parametrize("ask", ASKED, ids=lambda ask: ask.__name__)
def test_how_numpy_reports_errors_changes_no_answer(ask: Callable[[Surrogate], Any]) -> None:
    table = opened(1e-4)
    with np.errstate(all="ignore"):
        quiet = repr(ask(table))
    with np.errstate(all="raise"):
        assert repr(ask(table)) == quiet
