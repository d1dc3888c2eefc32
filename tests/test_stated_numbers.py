"""Numbers that stand in the sentences of the documents: each is read from its page and compared with what it is of."""

import csv
import math
import re
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from builder import assemble, rounding, verify
from builder.limits import V_RANGE, Y_RANGE
from builder.radau import RADAU_NODES
from builder.steady import border, solve
from builder.sweep import Sweep
from builder.verify import draw
from mumacro import Surrogate, cells, charts, closed_forms, table
from mumacro.inverse import solve_for
from mumacro.stiffness import Material, ball_on_flat, in_series

ROOT = Path(__file__).resolve().parent.parent
WORDS = {"three": 3.0, "four": 4.0, "nine": 9.0, "ten": 10.0, "twice": 2.0, "2^17": 2.0**17}
NUMBER = rf"({'|'.join(map(re.escape, WORDS))}|\d+(?:,\d{{3}})*(?:\.\d+)?(?:e[-+]?\d+)?)"
TABLES = sorted((ROOT / "tables").glob("*.nc"))
FINE = Surrogate.open()
STEEL = Material(210e9, 0.3)
Row = dict[str, str]


def text(page: str) -> str:
    """A document on one line, without the signs of comments."""
    return " ".join((ROOT / page).read_text("utf-8").split()).replace(" # ", " ")


def said(page: str, sentence: str) -> list[tuple[str, ...]]:
    """The numbers of a sentence, ``#`` for each, in every place where it stands."""
    found = re.findall(re.escape(sentence).replace(r"\#", NUMBER).replace(r"\ ", " "), text(page))
    assert found, f"{page}: {sentence}"
    return [(item,) if isinstance(item, str) else item for item in found]


def number(printed: str) -> float:
    return WORDS.get(printed) or float(printed.replace(",", ""))


def rounds_to(value: float, printed: str) -> bool:
    """Whether ``printed`` is ``value`` rounded to the digits that are shown."""
    mantissa, _, exponent = printed.replace(",", "").partition("e")
    unit = 0.0 if printed in WORDS else 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return abs(value - number(printed)) <= 0.501 * unit + 1e-14 * abs(value)


def rows(page: str, section: str) -> list[Row]:
    """The table of a generated section; test_validation.py compares it with what its script measures."""
    part = (ROOT / page).read_text("utf-8").split(f"<!-- begin {section} -->")[1].split(f"<!-- end {section} -->")[0]
    lines = [[cell.strip(" *") for cell in line.strip("|").split("|")] for line in part.splitlines() if line[:1] == "|"]
    return [dict(zip(lines[0], line, strict=True)) for line in lines[2:]]


def cell(section: str, row: str, column: str, page: str = "docs/validation.md") -> float:
    """One number of a generated table, without its sign."""
    (found,) = (line for line in rows(page, section) if next(iter(line.values())) == row)
    return abs(float(found[column]))


def law_within(percent: float) -> float:
    """Largest amplitude of the table up to which the paper's law of friction is that close."""
    off = {float(line["y~"]): float(line["the paper's law [%]"]) for line in rows("docs/validation.md", "master_curve")}
    return max(y for y in off if all(off[x] <= percent for x in off if x <= y))


def no_formula_within(percent: float) -> float:
    """Amplitude of the tables from which no law of the paper is that close at all speeds."""
    first = min(
        float(line["y~"])
        for line in rows("docs/validation.md", "master_curve")
        if float(line["the paper's law [%]"]) > percent
    )
    above = [line for line in rows("docs/validation.md", "summary") if float(line["y~"]) >= first]
    assert all(
        max(float(line[f"{kind}, off by [%]"]) for kind in ("stick-slip", "continuous")) > percent for line in above
    )
    return first


def references(name: str) -> float:
    with (ROOT / "tests" / "data" / f"{name}.csv").open(newline="") as stream:
        return float(sum(1 for _ in csv.DictReader(stream)))


@cache
def limit() -> float:
    """v~crit/sqrt(y~) for y~ -> infinity."""
    return border(1e14)[0] / 1e7


def crossing() -> float:
    """Amplitude at which the border meets the line of small angles."""
    return float(brentq(lambda y: math.hypot(1.0, border(y)[0]) - y, 1.0, 1.2))


def better_from() -> float:
    """Amplitude from which (23) is closer to the border than (24): they are off by as much in opposite directions."""
    both = brentq(lambda y: closed_forms.border_23(y) + closed_forms.border_24(y) - 2.0 * border(y)[0], 0.5, 0.7)
    return float(both)


def closest_peer() -> float:
    lines = (line for line in rows("README.md", "headline") if "peer" in line["method"])
    return min(float(line["max abs error of mu~"]) for line in lines)


def gain() -> float:
    """Largest factor by which twice the nodes reduce the error in the coordinates (phi, s0) of the corner."""
    errors = [float(line["mu~/phi on (phi, s0)"]) for line in rows(HARD, "cusp")]
    return max(a / b for a, b in pairwise(errors))


def next_exponent() -> float:
    """Exponent of 1 - v~/v~crit in what stick-slip and the orbit that slides all the time differ by, beyond 2."""
    gaps = np.array([4e-3, 2e-3, 1e-3])
    v, y = border(1.0)[0] * (1.0 - gaps), np.ones(3)
    with Sweep(1) as sweep:
        full, sliding = (sweep.solve(kind, v, y)["mu_ratio"] for kind in ("full", "continuous"))
    steps = np.diff((full - sliding) / gaps**2)
    return 2.0 + math.log2(steps[0] / steps[1])


def tolerances() -> tuple[float, float]:
    """The coarsest and the tightest of the committed tables."""
    found = [Surrogate.open(path).tolerance for path in TABLES]
    return max(found), min(found)


def readme_answer() -> tuple[float, float, float]:
    a = FINE.evaluate(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01)
    return a.mu_macro, a.mu_ratio, a.error_bound


def tutorial() -> tuple[float, float, float]:
    """mu_macro, l0 in um, and the amplitude in um that halves the friction."""
    case = {"mu0": 0.3, "Fz": 10.0, "k": 1.307e7, "f": 20e3, "v0": 0.005}
    a = FINE.evaluate(**case, y0=0.2e-6)
    return a.mu_macro, 1e6 * a.length_scale, 1e6 * solve_for(FINE, "y0", 0.15, case).roots[0][0].value


def normal_over_tangential() -> float:
    contact = ball_on_flat(5e-3, 10.0, STEEL, STEEL)
    return contact.k_normal / contact.k


def raised(share_of_resonance: float) -> float:
    """Amplitude at the contact over the imposed one."""
    return cell("inertia", f"{share_of_resonance:g}", "amplitude at the contact over the imposed one", VALIDITY)


def share(*kinds: str) -> float:
    """Percent of the points of a verification that are of these kinds."""
    return 100.0 * sum(part for name, part, _ in verify.CASES if name in kinds)


def largest_share() -> float:
    """Largest error found in a block of a committed table, over the table's tolerance."""
    return max(block.max_abs_error / s.tolerance for s in map(Surrogate.open, TABLES) for block in s.table.blocks)


VALIDATION, MODEL, VALIDITY, HARD = (f"docs/{name}.md" for name in ("validation", "model", "validity", "hard-cases"))
ACCURACY, FORMAT, ARCHITECTURE = "docs/accuracy.md", "docs/table-format.md", "docs/architecture.md"

# page, sentence, what its numbers are, from the numbers themselves where one is the question and the next the answer
STATED: list[tuple[str, str, Callable[..., tuple[float, ...]]]] = [
    # --- validation.md: the sentences and the tables of the same page
    (VALIDATION, "within # % up to y~ = # in stick-slip and within # % up to #",
     lambda a, _y, b, _z: (a, law_within(a), b, law_within(b))),
    (VALIDATION, "(35) holds within # at y~ = # and # at y~ = # in absolute value",
     lambda _a, y, _b, z: (cell("large_amplitudes", f"{y:g}", "(35) too low by"), y,
                           cell("large_amplitudes", f"{z:g}", "(35) too low by"), z)),
    (VALIDATION, "From y~ = # on no formula of the paper is within # % of mu~", lambda _, p: (no_formula_within(p), p)),
    ("paper.md", "a dimensionless amplitude of # and infinity none of them holds within # percent",
     lambda _, p: (no_formula_within(p), p)),
    (VALIDATION, "constants are rounded: # is #, # is #.", lambda a, _, b, __: (a, 1.0 / limit() ** 2, b, limit())),
    (VALIDATION, "- # in (26) is #, so the border is (26) plus # %",
     lambda a, *_: (a, 1.0 / limit() ** 2, 100.0 * (math.sqrt(a) * limit() - 1.0))),
    (VALIDATION, "# in (26) and (27) adds another # %", lambda a, _: (a, 100.0 * (1.0 / math.sqrt(4.5) / a - 1.0))),
    (VALIDATION, "the dashed line near y~ = #.", lambda _: (crossing(),)),
    (VALIDATION, "is the better formula from y~ = # on", lambda _: (better_from(),)),
    (VALIDATION, "Their deviations are up to # to # % and # %",
     lambda *_: (cell("border", "(26) with 4.5", "1e+06"), cell("border", "(26) with 0.47", "1e+06"),
                 float(said(VALIDATION, "(27) is farthest off, by -# %")[0][0]))),
    (VALIDATION, "its amplitude is too large by about y~^2/#",
     lambda _: (0.1**2 * 100.0 / cell("angles", "0.1", "amplitude (18) [%]"),)),
    (VALIDATION, "the value at the border is right to # % up to y~ = #",
     lambda _, y: (cell("continuous", "with (5/64) y~^4, at the border", f"off by [%] at y~ = {y:g}"), y)),
    (VALIDATION, "and by # % of it at y~ = #", lambda _, y: (cell("plateau", f"{y:g}", "of the rise to 1 [%]"), y)),
    (VALIDATION, "(28) is a fit to that limit, N_0, within #",
     lambda _: (float(said(VALIDATION, "(28) less N_0 is lowest, -#")[0][0]),)),
    (VALIDATION, "The exact curves differ by up to # for y~ <= #, and by up to # for all nine amplitudes",
     lambda _a, y, _b: (cell("collapse", f"0.1 to {y:g}", "largest spread of the curves"), y,
                        cell("collapse", "0.1 to 0.9", "largest spread of the curves"))),
    (VALIDATION, "limits the deviation to # in all of continuous sliding",
     lambda _: (float(said(VALIDATION, "The last formula is off by # at the most")[0][0]),)),
    (MODEL, "abs(mu~ - E) < #", lambda _: (float(said(VALIDATION, "The last formula is off by # at the most")[0][0]),)),
    (VALIDATION, "the deviation is within # % at y~ = #",
     lambda _, y: (cell("continuous", "(31)", f"off by [%] at y~ = {y:g}"), y)),
    # --- model.md
    (MODEL, "y~ / v~crit^2 -> # for y~ -> infinity", lambda _: (1.0 / limit() ** 2,)),
    (MODEL, "(y~^2 / 2)(1 - # y~^2 / #)", lambda _, d: (d * (1.0 - 2e4 * border(1e-2)[0]) / 1e-4, d)),
    (MODEL, "The tail blocks have # nodes along 1/y~",
     lambda _: tuple({float(block.a.size) for chart, block in zip(charts.CHARTS, FINE.table.blocks, strict=True)
                      if chart.a.name == "inverse_y"})),
    (MODEL, "The next term is (1 - v~/v~crit)^(#/#)", lambda _, b: (b * next_exponent(), b)),
    (MODEL, "It is stored in # pieces", lambda _: (float(len(FINE.table.border)),)),
    # --- hard-cases.md
    (HARD, "(Radau IIA, # stages)", lambda _: (float(RADAU_NODES.size),)),
    (HARD, "The solver's range is v~ from # to # and y~ from # to #", lambda *_: (*V_RANGE, *Y_RANGE)),
    (HARD, "twice the nodes reduce the error by a factor below #", lambda x: (x if gain() < x else gain(),)),
    (HARD, "is -pi plus a small number, and is rounded to #", lambda _: (float(np.spacing(math.pi)),)),
    (HARD, "the true value is # v~, between", lambda _: (solve(1e-13, 2.0).mu_ratio / 1e-13,)),
    # --- validity.md
    (VALIDITY, "omega < # omega_n (# %), < # omega_n (# %)",
     lambda x, _a, z, _b: (x, 100.0 * (raised(x) - 1.0), z, 100.0 * (raised(z) - 1.0))),
    (VALIDITY, "Hence # % at # and # % at #",
     lambda _a, x, _b, z: (100.0 * (raised(x) - 1.0), x, 100.0 * (raised(z) - 1.0), z)),
    (VALIDITY, "omega a/c_s is # for a = # um, # kHz and the shear wave speed of steel, # m/s",
     lambda _, a, f, c: (2.0 * math.pi * f * 1e3 * a * 1e-6 / c, a, f, c)),
    (VALIDITY, "Ignoring k_d > # k changes k by less than # %",
     lambda d, _: (d, math.ceil(100.0 * (1.0 - in_series(1.0, d))) )),
    (VALIDITY, "(2 - nu)/(2 (1 - nu)) = # for steel", lambda _: (normal_over_tangential(),)),
    (VALIDITY, "With alpha = # and mu0 = # it changes by # % at y~ = # and by # % at y~ = #",
     lambda alpha, mu0, _a, y, _b, z: (alpha, mu0, 100.0 * normal_over_tangential() * mu0 * alpha * y, y,
                                       100.0 * normal_over_tangential() * mu0 * alpha * z, z)),
    (VALIDITY, "So for ultrasonic amplitudes of # to # um y~ is between # and #",
     lambda *_: tuple(end(float(line[name]) for line in rows(VALIDITY, "rigs"))
                      for name in ("y0 [um]", "y~") for end in (min, max))),
    # --- accuracy.md, table-format.md, architecture.md and how-to: what the code and the committed files hold
    (ACCURACY, "# points and # borders solved in quadruple", lambda *_: (references("points"), references("border"))),
    ("README.md", "# quadruple-precision reference points", lambda _: (references("points"),)),
    (ACCURACY, "**# the largest error that fresh solves found in it**", lambda _: (assemble.SAFETY,)),
    (ACCURACY, "it compares # further solves with the bounds, # % of them at the border, the corner, seams and tails",
     lambda *_: (float(assemble.FINAL_POINTS), share("border", "corner", "seams", "tails"))),
    (ACCURACY, "the largest error found is at most # of the tolerance",
     lambda x: (x if 0.5 * x < largest_share() <= x else math.nan,)),
    (FORMAT, "Table format, version #", lambda _: (float(table.FORMAT_VERSION),)),
    (FORMAT, "| `format_version` | #", lambda _: (float(table.FORMAT_VERSION),)),
    (FORMAT, "or the format version is not #", lambda _: (float(table.FORMAT_VERSION),)),
    (ARCHITECTURE, "the table file, format #", lambda _: (float(table.FORMAT_VERSION),)),
    (FORMAT, "CF-# metadata", lambda _: (float(str(FINE.attributes["Conventions"]).removeprefix("CF-")),)),
    (FORMAT, "Variables of more than # numbers are compressed", lambda _: (float(table.FEW),)),
    (FORMAT, "log-spaced from # to #", lambda *_: (float(FINE.table.v_tilde[0]), float(FINE.table.y_tilde[-1]))),
    (FORMAT, "one group for each of the # blocks", lambda _: (float(len(FINE.table.blocks)),)),
    (FORMAT, "below 1/# of the tolerance", lambda _: (float(rounding.STEPS),)),
    (FORMAT, "may be # times as large", lambda _: (assemble.ABS_TO_REL,)),
    ("docs/how-to/table.md", "may be # times that", lambda _: (assemble.ABS_TO_REL,)),
    (FORMAT, "| `errors` | # numbers", lambda _: (float(FINE.table.blocks[0].errors.size),)),
    (FORMAT, "larger than # MiB", lambda _: (table.MOST_BYTES / 2.0**20,)),
    ("docs/how-to/table.md", "with the package, # to #.", lambda *_: tolerances()),
    ("README.md", "tables/ # committed tables, # to #;", lambda *_: (float(len(TABLES)), *tolerances())),
    ("paper.md", "Tables of # to # are verified", lambda *_: tolerances()),
    ("docs/how-to/table.md", "From # down to # is possible",
     lambda *_: (assemble.MAX_TOLERANCE, assemble.MIN_TOLERANCE)),
    (ARCHITECTURE, "forms v~ = # and y~ = #",
     lambda *_: (1e6 * 0.01 / (0.3 * 10.0 * 1.3e5), 1e6 * 2e-6 / (0.3 * 10.0))),
    (ARCHITECTURE, "sums its # coefficients", lambda _: (float(cells.WIDTH**2),)),
    ("docs/how-to/uncertainty.md", "# evenly spread samples",
     lambda _: (float(pytest.importorskip("service.quantities").SAMPLES),)),
    ("docs/how-to/amplitude.md", "The shaker needs # times the power that the drive saves",
     lambda _: (round(float(said("docs/how-to/amplitude.md", "# mW from the shaker")[0][0])
                      / float(said("docs/how-to/amplitude.md", "# mW less from the drive")[-1][0])) * 1.0,)),
    # --- answers that are told again in a sentence
    ("docs/tutorial.md", "The friction falls from # to #.", lambda mu0, _: (mu0, tutorial()[0])),
    ("docs/tutorial.md", "before it slips, here # um", lambda _: (tutorial()[1],)),
    ("docs/tutorial.md", "So # um in place of # um", lambda _, y: (tutorial()[2], y)),
    ("README.md", "a.mu_macro, a.error_bound #, #", lambda *_: readme_answer()[::2]),
    ("README.md", '{"mu_macro": #, "mu_ratio": #, "regime": "stick_slip", "error_bound": #',
     lambda *_: readme_answer()),
    ("paper.md", "reach about # here", lambda _: (closest_peer(),)),
    ("paper.md", "in quadruple precision to #",
     lambda _: (cell("model", "quadruple precision, another solver", "largest difference of mu~"),)),
]  # fmt: skip


@pytest.mark.parametrize(
    ("page", "sentence", "value"), STATED, ids=[f"{Path(page).stem}: {sentence}" for page, sentence, _ in STATED]
)
def test_a_number_in_a_sentence_is_what_it_is_of(
    page: str, sentence: str, value: Callable[..., tuple[float, ...]]
) -> None:
    for printed in said(page, sentence):
        found = value(*map(number, printed))
        assert all(rounds_to(*pair) for pair in zip(found, printed, strict=True)), (found, printed)


def test_the_regions_are_those_of_the_atlas() -> None:
    page = (ROOT / MODEL).read_text("utf-8")
    edges = {"low": charts.Y_CONT, "mid_1": charts.Y_MID, "mid_2": charts.Y_HIGH, "high": charts.Y_TAIL}
    whole = {charts.Y_CONT, *edges.values()}
    corner = {charts.Y_STICK_LO, charts.Y_STICK_HI, charts.S_CUT}
    expected = {
        "continuous_low": {charts.Y_CONT}, "continuous_mid_1, _2, _high": whole, "continuous_tail": {charts.Y_TAIL},
        "fast, a closed form": {charts.RHO_MAX, charts.Y_CONT, charts.Y_TAIL, charts.L_MAX},
        "stick_slip_low": {charts.Y_STICK_LO}, "stick_slip_mid": corner, "corner": corner,
        "stick_slip_mid_1, _2, _high": whole, "stick_slip_tail": {charts.Y_TAIL},
    }  # fmt: skip
    told = re.findall(r"^\| ([a-z_12, ]+) \| (.*[<>].*) \| .+ \|$", page, re.MULTILINE)
    assert {name: {number(x) for x in re.findall(NUMBER, where)} for name, where in told} == expected


@pytest.mark.slow
def test_the_errors_of_the_headline_are_those_of_the_tables(sweep) -> None:
    lines = [line for line in rows("README.md", "headline") if line["method"].startswith("mumacro")]
    assert len(lines) == 4
    v, y = draw("random", 20_000, FINE, seed=6)
    truth = sweep.solve("full", v, y)["mu_ratio"]
    for line in lines:
        s = Surrogate.open(ROOT / "tables" / f"{line['method']}.nc")
        assert int(line["solves to build"].replace(",", "")) == s.attributes["n_solves"]
        # the page has the largest of fifty times as many points
        assert 0.5 < np.abs(s.mu_ratio(v, y) - truth).max() / float(line["max abs error of mu~"]) < 1.05
