"""The command ``mumacro``: answers with units, advice for wrong arguments, exit codes."""

import csv
import io
import json
import math
import os
import shlex
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate, fit
from mumacro.cli.main import COMMANDS, main
from mumacro.inputs.cases import Cases
from mumacro.inputs.fields import ENDS, SI
from mumacro.outputs.tabulated import Tabulated
from mumacro.stiffness import GEOMETRIES, contact_of
from mumacro.validity import rows_of
from tests.support.cases import Capture, Case
from tests.support.comparing import close

CASE = "mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20690 v0=0.01"
SWEPT = ("law", CASE.replace("v0=0.01", ""), "--along", "v0")
NORMAL = CASE.replace("y0=2e-6", "Fz_amplitude=1N")
ALONG_NORMAL = ("--direction", "normal")
SHAKEN = ("motion", CASE.replace("y0=2e-6 ", ""))
OVER_LOADS, NO_LOAD = ("law", "--along", "Fz", "0.1kN", "1kN"), CASE.replace("Fz=10 ", "")
VALUES: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": math.tau * 20690, "v0": 0.01}


def output_of(capsys: Capture, code: Any, *words: Any) -> Any:
    """The output of ``mumacro WORDS``; if it fails, what is said in one line on stderr."""
    try:
        ended = main(words)
    except SystemExit as end:  # of the command line itself
        ended = end.code  # type: ignore[assignment]
    output = capsys.readouterr()
    assert ended == code
    if code:
        lines = output.err.splitlines()
        assert len(lines) == 1, output.err
        assert output.out == ""
        return lines[0]
    return output.out


def test_one_case_is_answered_with_units_regime_bound_and_source(
    capsys: Capture, surrogate: Surrogate
) -> None:
    text = output_of(capsys, 0, CASE)
    expected = surrogate.evaluate(**VALUES)
    row = next(line for line in text.splitlines() if line.startswith("mu_macro"))
    assert "[-]" in row
    assert text.splitlines()[-1] == f"numerical error  {expected.error_bound:.2g}"
    assert "±" not in text
    for part in (expected.regime, expected.source, surrogate.id):
        assert part in text
    _, shown, *rows = output_of(capsys, 0, CASE).splitlines()  # k to 10 % supports four digits
    assert shown.split()[:2] == ["mu_macro", f"{expected.mu_macro:#.4g}"]
    assumptions = [f"assumes  {row['row']}: {row['text']}" for row in rows_of(expected)]
    assumptions = [line.replace("k as an interval", "k=0.9..1.1N/um") for line in assumptions]
    assert rows[-len(assumptions) - 1 : -1] == assumptions
    interval = output_of(capsys, 0, CASE.replace("k=1e6", "k=0.9..1.1N/um")).splitlines()[1]
    assert " to " in interval.partition("[-]")[0]
    assert json.loads(output_of(capsys, 0, CASE, "--json", "--model"))["model"] == rows_of(expected)
    assert "model" not in json.loads(output_of(capsys, 0, CASE, "--json"))


@pytest.mark.parametrize("words", [[], ["--json"], ["--json", "--model"], ["--contact", "ball"]])
@pytest.mark.parametrize("case", [CASE, CASE.replace("k=1e6", "k=rigid")])
def test_one_case_is_made_and_evaluated_once(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch, case: str, words: list[str]
) -> None:
    """What is said beside an answer is made of what was evaluated."""
    calls = Counter[str]()

    def count(owner: Any, name: str) -> None:
        function = getattr(owner, name)

        def counted(*arguments: Any, **named: Any) -> Any:
            calls[name] += 1
            return function(*arguments, **named)

        monkeypatch.setattr(owner, name, counted)

    count(Cases, "__new__")
    for name in ("one", "rows", "extremes"):
        count(Tabulated, name)
    output_of(capsys, 0, case, *words)
    assert calls == {"__new__": 1, "one": 1}


@pytest.mark.parametrize("name", ["mumacro-1e-4.nc", "mumacro-1e-10.nc"])
def test_a_table_is_picked_by_path_or_tolerance(
    capsys: Capture, tables_dir: Path, name: str
) -> None:
    tolerance = name.removeprefix("mumacro-").removesuffix(".nc")
    for which in (str(tables_dir / name), tolerance):
        assert json.loads(output_of(capsys, 0, CASE, "--json", "--table", which))["table"][
            "tolerance"
        ] == float(tolerance)
    loose = str(3.0 * float(tolerance))
    assert json.loads(output_of(capsys, 0, CASE, "--json", "--table", loose))["table"][
        "tolerance"
    ] == float(tolerance)


#: the words, and what is said of them in one line
FAULTS: list[tuple[str | tuple[str, ...], str]] = [
    # names and values of a case
    (CASE.replace("f=20690", "f=20.69khz"), "did you mean 20.69kHz?"),
    (CASE.replace("f=20690", "omega=20kHz"), "did you mean f=20kHz?"),
    (CASE.replace("k=1e6", "k=0.8-1.2N/um"), "write an interval as 0.8..1.2N/um"),
    (CASE.replace("Fz", "Fzz"), "unknown input 'Fzz': did you mean Fz?"),
    (CASE.replace("k=", "K="), "did you mean k?"),
    (CASE.replace("k=1e6", "stiffness=1e6"), "did you mean k?"),
    (CASE + " Fz=11", "Fz is given twice"),
    (CASE + " contatc=ball", "did you mean the option --contact ball?"),
    (CASE + " contact=ball", "contact is an option: --contact ball"),
    (CASE.replace("y0=2e-6 ", "y0= "), "y0 must be a number [m]"),
    (CASE.replace("k=1e6 ", ""), "missing: k [N/m] (k=rigid for a rigid contact)"),
    (CASE.replace("f=20690", ""), "missing: omega [rad/s] or f [Hz]"),
    (CASE + " fast", "v0 must be in metres per second"),
    (CASE + " v0 0.02", "'v0', '0.02' are no name=value"),
    (CASE + " omega=1", "exactly one of omega [rad/s] and f [Hz]"),
    (CASE.replace("1e6", "1000 furlongs"), "k must be in newtons per metre"),
    (CASE.replace("k=1e6", "k=1±0.1N/um y0=1..2um").replace("y0=2e-6 ", ""), "k alone"),
    (CASE.replace("0.3", "-0.3"), "mu0 must be finite and > 0, got -0.3"),
    (CASE.replace("0.01", "1e999"), "v0 must be one number: it is too large, above 1.8e308"),
    # contact and direction
    ((CASE, *ALONG_NORMAL), "y0 does not belong to --direction normal, whose amplitude is Fz_amp"),
    (NORMAL, "Fz_amplitude is the amplitude of --direction normal; otherwise it is y0"),
    ((NORMAL, *ALONG_NORMAL, "--contact", "ball"), "across or along for a ball"),
    ((NORMAL.replace("1N", "10N"), *ALONG_NORMAL), "lifts off"),
    (("solve-for", "y0", NORMAL, *ALONG_NORMAL, "--target", "0.1"), "y0 does not belong"),
    (("law", NORMAL, "--along", "Fz_amplitude", "1", "2"), "the swept input is one of mu0"),
    (("law", CASE, "--along", "v", "1", "2"), "--along v: the swept input is one of mu0"),
    ((*SWEPT, "1s", "2s"), "'2s'"),
    # commands and options
    (("eval", "mu0=0.4", "Fz=0.5N", "k=2e6"), "without eval: mumacro mu0=0.4 Fz=0.5N k=2e6"),
    (("table", ""), "unrecognized arguments: "),
    (("table", " "), "unrecognized arguments: "),
    ((CASE, "--sideways"), "--sideways"),
    ((CASE, "--directoin"), "did you mean --direction?"),
    ((CASE, "--includ=std"), "did you mean --include?"),
    ((CASE, "--contact", "Ball"), "invalid choice: 'Ball', did you mean ball?"),
    ((CASE, "--contact", "xyz"), "choose from"),
    (("law", CASE), 'missing: --along, as in mumacro law "'),
    (("law", CASE, "--along", "v0"), 'expected 3 arguments, as in mumacro law "'),
    (("law", CASE, "--points", "x"), "--points"),
    (("law", CASE, "--stiffness-exponent", "third"), "stiffness_exponent must be"),
    (("map", "--radius", "1"), "--radius"),
    (("solve-for", "mass", CASE, "--target", "0.2"), "'mass'"),
    (("solve-for", "y0", CASE), 'missing: --target, as in mumacro solve-for y0 "'),
    (("solve-for", "y0", CASE, "--target", "half"), "got 'half': give mu_macro, such as 0.15"),
    (("solve-for", "y0", CASE, "--target", "1..2"), "target must be one number"),
    ((*OVER_LOADS, CASE), "Fz must be left out"),
    ((*OVER_LOADS, NO_LOAD, "--stiffness-exponent", "0.5"), "the load at which k holds"),
    ((*OVER_LOADS, CASE, "--stiffness-exponent", "2"), "one number from 0 to 1"),
    ((*SWEPT, "1", "2", "--stiffness-exponent", "0.5"), "left out where v0 is"),
    # motions
    ((*SHAKEN, "--y", "2N"), "y, amplitude"),
    ((*SHAKEN, "--y", "2um@90N"), "y, phase"),
    ((*SHAKEN, "--y", "2um@"), "2um@90deg"),
    ((*SHAKEN, "--y", "1.5:2um"), "whole number"),
    ((*SHAKEN, "--y", "a:2um"), "y, harmonic"),
    ((*SHAKEN, "--normal", "2um"), "normal, amplitude"),
    ((*SHAKEN, "--normal", "10N"), "lifts off"),
    ((*SHAKEN, "--normal", "1N", "--contact", "ball"), "contact radius"),
    (("motion", CASE), "--y"),
    (("motion", SHAKEN[1].replace("1e6", "0.9..1.1N/um"), "--y", "2um"), "one k"),
    (("motion", SHAKEN[1].replace("1e6", "rigid"), "--y", "2um"), "rigid"),
    (("motion", "mu0=0.3 Fz=10N", "--y", "2um"), "missing: k"),
    # stiffnesses
    (("stiffness",), "missing: GEOMETRY, as in mumacro stiffness ball"),
]


@pytest.mark.parametrize(("words", "said"), FAULTS)
def test_what_is_wrong_gets_advice_in_one_line(
    capsys: Capture, words: str | tuple[str, ...], said: str
) -> None:
    assert said in output_of(capsys, 2, *([words] if isinstance(words, str) else words))


def test_a_value_may_stand_apart_from_its_name(capsys: Capture) -> None:
    apart = CASE.replace("=", " = ")
    assert output_of(capsys, 0, apart) == output_of(capsys, 0, CASE)


def test_everything_that_is_wrong_with_a_case_is_told_at_once(capsys: Capture) -> None:
    message = output_of(capsys, 2, "mu0=-0.3 Fzz=10 k=soft v0=nan f=-1 fast")
    for part in (
        "mu0 must be finite and > 0",
        "did you mean Fz?",
        "k must be",
        "v0 must be",
        "f must be",
        "'-1 fast'",
    ):
        assert message.count(part) == 1
    assert message.endswith("missing: y0 [m]")


def test_a_unit_may_be_given_beside_the_number_or_apart(
    capsys: Capture, surrogate: Surrogate
) -> None:
    expected = surrogate.evaluate(**VALUES).mu_macro
    for case in (
        "mu0=30% Fz=10N k=1N/um y0=2um f=20.69kHz v0=1cm/s",
        "mu0=30 % Fz = 0.01 kN k=1 N/um y0=2 um f=20690Hz, v0=10mm/s",
    ):
        assert json.loads(output_of(capsys, 0, case, "--json"))["mu_macro"] == expected
    inputs = CASE.replace("v0=0.01", "")
    for ends in (("1e-3", "1"), ("1mm/s", "100cm/s")):
        law = json.loads(
            output_of(capsys, 0, "law", inputs, "--along", "v0", *ends, "--points", "2", "--json")
        )
        assert law["values"] == [1e-3, 1.0]
    assert "v0 must be in metres per second" in output_of(
        capsys, 2, "law", inputs, "--along", "v0", "1um", "1"
    )
    assert "1 to 2 m/s" in output_of(
        capsys, 1, "solve-for", "v0", inputs, "--target", "0.1", "--between", "1", "200cm/s"
    )


def test_no_words_show_three_examples_that_run_and_a_misspelt_command_is_corrected(
    capsys: Capture,
) -> None:
    lines = [line.split(": ", 1)[1].strip() for line in output_of(capsys, 0).splitlines()]
    assert len(lines) == 4
    for line in lines[:3]:
        assert output_of(capsys, 0, *shlex.split(line)[1:])
    assert "unknown command 'evl': did you mean eval?" in output_of(capsys, 2, "evl", "cases.csv")
    assert "did you mean solve-for?" in output_of(capsys, 2, "solve_for", "y0")


def test_a_table_that_cannot_be_read_or_does_not_exist(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "text.nc").write_text("no table")
    assert "text.nc" in output_of(capsys, 1, CASE, "--table", str(tmp_path / "text.nc"))
    assert "no such file" in output_of(capsys, 1, CASE, "--table", str(tmp_path / "none.nc"))
    assert "tolerance must be >=" in output_of(capsys, 2, CASE, "--table", "1e-30")
    assert "tolerance" in output_of(capsys, 2, CASE, "--table", "-1")


@pytest.mark.parametrize("word", [*COMMANDS, ""])
def test_every_command_explains_itself_on_one_screen(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch, word: Any
) -> None:
    if word == "serve":
        pytest.importorskip("uvicorn")
    monkeypatch.setenv("COLUMNS", "100")
    text = output_of(capsys, 0, *word.split(), "--help")
    assert len(text.splitlines()) <= 40
    assert max(map(len, text.splitlines())) <= 100
    assert "usage: " in text
    assert word == "serve" or f"mumacro {word}" in text
    assert word not in ("", "law", "solve-for", "map") or all(
        f"[{unit}]" in text for unit, _ in SI.values()
    )


def test_a_law_along_the_frequency_is_one_along_omega_and_marks_the_border(capsys: Capture) -> None:
    inputs = CASE.replace("f=20690", "")
    words = ("law", inputs, "--along", "f", "100", "1e5")
    over_f = json.loads(output_of(capsys, 0, *words, "--json"))
    ends = (repr(math.tau * 100), repr(math.tau * 1e5))
    over_omega = json.loads(
        output_of(capsys, 0, "law", inputs, "--along", "omega", *ends, "--json")
    )
    assert over_f["mu_macro"] == close(over_omega["mu_macro"], rel=1e-13)
    assert np.array(over_f["values"]) * math.tau == close(np.array(over_omega["values"]), rel=1e-15)
    ((of_f,), (of_omega,)) = over_f["border"], over_omega["border"]
    assert of_f["value"] * math.tau == close(of_omega["value"], rel=1e-14)
    text = output_of(capsys, 0, *words)
    assert "border of continuous sliding at f" in text


KINDS: dict[str, tuple[str, Case, Case]] = {
    "spring": (CASE, {}, {}),
    "rigid": (CASE.replace("1e6", "rigid"), {}, {"k": "rigid"}),
    "ball": (CASE, {"contact": "ball"}, {}),
    "along": (CASE, {"direction": "along"}, {}),
    "ball along": (CASE, {"contact": "ball", "direction": "along"}, {}),
    "normal": (NORMAL, {"direction": "normal"}, {"Fz_amplitude": 1.0}),
    "range": (
        CASE.replace("1e6", "0.8..1.2N/um"),
        {"contact": "ball"},
        {"k_low": 0.8e6, "k_high": 1.2e6},
    ),
}


def question_of(name: str) -> Any:
    """The words and options of a case, and the keywords of the library."""
    words, kind, more = KINDS[name]
    inputs = {**VALUES, **more, **kind}
    inputs.pop("y0" if "Fz_amplitude" in more else "", None)
    inputs.pop("k" if "k_low" in more else "", None)
    return words, [f"--{key}={value}" for key, value in kind.items()], inputs


@pytest.mark.parametrize("name", KINDS)
def test_an_answer_is_the_librarys_to_every_bit(
    capsys: Capture, surrogate: Surrogate, name: str
) -> None:
    words, options, inputs = question_of(name)
    expected = surrogate.evaluate(**inputs, gradient=True)
    apart = (*words.split()[:2], "--json", *words.split()[2:])
    answer = json.loads(
        output_of(capsys, 0, *apart, *options, "--include", "gradient"), parse_constant=pytest.fail
    )
    for key in ("mu_macro", "regime", "source", "error_bound"):
        assert answer[key] == getattr(expected, key)
    members = expected.to_dict()  # of a rigid contact without a slope along k
    assert answer == {
        **members,
        "table": {"id": surrogate.id, "tolerance": surrogate.tolerance},
    }
    text = output_of(capsys, 0, words, *options)
    assert f"{expected.mu_macro:.4g}"[:5] in text
    assert expected.regime in text


@pytest.mark.parametrize("name", KINDS)
def test_law_and_solve_for_know_them_too(
    capsys: Capture, tmp_path: Path, surrogate: Surrogate, name: str
) -> None:
    words, options, inputs = question_of(name)
    words = words.replace("v0=0.01", "")
    out = tmp_path / "law.csv"
    output_of(
        capsys,
        0,
        "law",
        words,
        "--along",
        "v0",
        "1mm/s",
        "1m/s",
        "--points",
        "5",
        *options,
        "-o",
        str(out),
    )
    with out.open() as stream:
        rows = list(csv.DictReader(stream))
    expected = surrogate.evaluate(
        **{**inputs, "v0": np.array([float(row["v0 [m/s]"]) for row in rows])}
    )
    columns = ["mu_macro"] + ["mu_macro_low", "mu_macro_high"] * ("k_low" in inputs)
    assert list(rows[0]) == ["v0 [m/s]", *columns, "regime", "error_bound", "source", "mu_static"]
    for column in columns:
        assert [float(row[column]) for row in rows] == getattr(expected, column).tolist()
    assert [row["regime"] for row in rows] == expected.regime.tolist()
    if "k_low" in inputs:
        both = json.loads(
            output_of(capsys, 0, "solve-for", "v0", words, "--target", "0.29", *options, "--json")
        )["ends"]
        for end, k in zip(both, (inputs["k_low"], inputs["k_high"]), strict=True):
            for root in end["results"][0]["roots"]:
                one = {**{key: x for key, x in inputs.items() if key not in ENDS}, "k": k}
                there = surrogate.evaluate(**{**one, "v0": root["value"]})
                assert there.mu_macro == close(0.29, abs=1e-10)
        return
    answer = json.loads(
        output_of(capsys, 0, "solve-for", "v0", words, "--target", "0.29", *options, "--json")
    )
    ((*roots,),) = (one["roots"] for one in answer["results"])
    for root in roots:
        there = surrogate.evaluate(**{**inputs, "v0": root["value"]})
        assert there.mu_macro == close(0.29, abs=1e-10)
    assert roots


@pytest.fixture
def measured(tmp_path: Path, surrogate: Surrogate) -> Any:
    """Thirty points of a ball, with scatter, in a file; and the same in SI."""
    v0 = np.geomspace(1e-3, 1.0, 30)
    exact = surrogate.evaluate(
        mu0=0.3, Fz=10, k=1e6, y0=2e-6, f=20e3, v0=v0, contact="ball"
    ).mu_macro
    mu = exact + 1e-3 * np.cos(17.0 * np.arange(30))
    rows = [
        f"{1e3 * v!r},a note,{100.0 * m!r}" for v, m in zip(v0.tolist(), mu.tolist(), strict=True)
    ]
    path = tmp_path / "measured.csv"
    path.write_text("\n".join(["v0 [mm/s],note,mu_macro [%]", *rows, ""]))
    return path, {"v0": 1e3 * v0 / 1e3, "mu_macro": 100.0 * mu / 100.0}


RIG = ("Fz=10N y0=2um", "f=20kHz")


@pytest.mark.parametrize("unknowns", [("k", "mu0"), ("k",), ("mu0",)])
def test_fit_is_the_librarys(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch, measured: Any, unknowns: Any
) -> None:
    pytest.importorskip("scipy")
    path, points = measured
    inputs: Case = {
        name: value for name, value in {"k": 1e6, "mu0": 0.3}.items() if name not in unknowns
    }
    words = [*RIG, *(f"{name}={value!r}" for name, value in inputs.items()), "--contact", "ball"]
    expected = fit(points, unknowns, contact="ball", Fz=10.0, y0=2e-6, f=20e3, **inputs)
    answer = json.loads(
        output_of(capsys, 0, "fit", str(path), "--unknown", *unknowns, *words, "--json")
    )
    for name in unknowns:
        assert answer["values"][name] == close(expected.values[name], rel=1e-9)
        assert answer["std"][name] == close(expected.std[name], rel=1e-6)
        assert answer["interval"][name] == close(list(expected.interval[name]), rel=1e-6)
    assert (answer["contact"], answer["warnings"]) == ("ball", list(expected.warnings))
    assert answer.keys() == {*expected.to_dict(), "table"}
    stdin = io.TextIOWrapper(io.BytesIO(path.read_bytes()))
    monkeypatch.setattr(sys, "stdin", stdin)
    text = output_of(capsys, 0, "fit", "-", *words, "--unknown", *unknowns)
    assert [line.split()[0] for line in text.splitlines()[: len(unknowns)]] == list(unknowns)
    assert f"+- {expected.std[unknowns[0]]:.2g}" in text
    assert "95 %" in text


def test_a_fit_goes_into_csv_with_warnings(capsys: Capture, tmp_path: Path, measured: Any) -> None:
    pytest.importorskip("scipy")
    path, points = measured
    output_of(
        capsys, 0, "fit", str(path), *RIG, "--contact", "ball", "-o", str(tmp_path / "fit.csv")
    )
    with (tmp_path / "fit.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["v0 [m/s]"]) for row in rows] == close(points["v0"].tolist(), rel=1e-15)
    same = tmp_path / "same.csv"
    output_of(capsys, 0, "fit", str(path), *RIG, "--contact", "ball", "--plot", str(same))
    assert same.read_bytes() == (tmp_path / "fit.csv").read_bytes()
    fitted = fit(points, contact="ball", Fz=10.0, y0=2e-6, f=20e3)
    curve = (points["mu_macro"] - fitted.residuals).tolist()
    assert [float(row["mu_macro fitted"]) for row in rows] == close(curve, rel=1e-9)
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:3]))
    assert "warning: as many points as unknowns" in output_of(
        capsys, 0, "fit", str(path), *RIG, "--contact", "ball"
    )


@pytest.mark.parametrize(
    ("text", "words", "code", "parts"),
    [
        (
            "speed,mu_macro\n1,0.2\n",
            RIG,
            1,
            ["no column v0; 'speed' is similar: rename that column to v0 [m/s]"],
        ),
        *(
            (f"v0,{head}\n1,0.2\n", RIG, 1, [f"'{head}' is similar: rename that column to {new}"])
            for head, new in (("µ", "mu_macro [-]"), ("COF [%]", "mu_macro [%]"))
        ),
        (
            "v0,mu_macro\n1,\nx,0.2\n1,2,3\n1_0,0.1\n",
            RIG,
            1,
            [
                "line 2: mu_macro is missing",
                "line 3: v0 must be a number",
                "line 4 has 3 cells",
                "line 5: v0 must",
            ],
        ),
        ("v0,mu_macro\n1,0.2\n2,0.21\n", RIG[:1], 2, ["missing: omega [rad/s] or f [Hz]"]),
        ("v0,mu_macro\n1,0.2\n2,0.21\n", (*RIG, "v0=1"), 2, ["leave v0 out"]),
        ("v0,mu_macro\n1,0.2\n2,0.21\n", (*RIG, "--unknown", "y0"), 2, ["k, mu0 or both"]),
    ],
)
def test_bad_points_are_told_by_line_and_name(
    capsys: Capture, tmp_path: Path, text: str, words: Any, code: Any, parts: Any
) -> None:
    (tmp_path / "points.csv").write_text(text)
    message = output_of(capsys, code, "fit", str(tmp_path / "points.csv"), *words)
    assert all(part in message for part in parts), message


def test_an_interval_in_a_column_k_gets_a_remedy(capsys: Capture, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    path, out = tmp_path / "points.csv", str(tmp_path / "out.csv")
    path.write_text("mu0,Fz,k,y0,f,v0\n0.3,10,0.8..1.2,2e-6,2e4,0.01\n")
    main(["eval", str(path), "-o", out])
    capsys.readouterr()
    assert "columns k_low and k_high" in Path(f"{out}.rejects.csv").read_text()


def test_the_files_of_rigs_are_fitted(capsys: Capture, repository: Path) -> None:
    pytest.importorskip("scipy")
    rigs = repository / "tests" / "data" / "rigs"
    for name, *words in (
        ("preamble.csv",),
        ("windows_1252.csv", "Fz=10N", "--sep", ";", "--decimal", ","),
        ("labview.lvm", "Fz=10N"),
    ):
        assert main(["fit", str(rigs / name), *words, "y0=0.4um f=20kHz", "--json"]) == 0
        captured = capsys.readouterr()
        assert json.loads(captured.out)["values"]["k"] == close(8899923.56587856, rel=1e-6)
        assert captured.err.startswith("mumacro fit: read as: ")
        assert len(captured.err.splitlines()) == 1


PICTURES = {
    "law": ("law", CASE.replace("v0=0.01", ""), "--along", "v0", "1mm/s", "1m/s"),
    "solve-for": ("solve-for", "y0", CASE.replace("y0=2e-6", ""), "--target", "0.15"),
    "rest": (
        "solve-for",
        "v0",
        CASE.replace("v0=0.01", ""),
        "--target",
        "0.25",
        "--between",
        "0",
        "1",
    ),
    "map": ("map", CASE),
    "motion": (*SHAKEN, "--x", "2um@90deg", "--y", "4um"),
    "solve-for of a motion": (
        *("solve-for", "normal.phase", "mu0=0.3 Fz=10N k=0.1N/um f=50Hz v0=5mm/s"),
        *("--x", "0.1mm", "--normal", "8N", "--target", "0"),
    ),
    "fit": ("fit", "MEASURED", *RIG, "--contact", "ball"),
}


@pytest.mark.slow
@pytest.mark.parametrize("words", PICTURES.values(), ids=PICTURES)
def test_results_go_into_pictures_and_csv(
    capsys: Capture, tmp_path: Path, measured: Any, words: Any
) -> None:
    pytest.importorskip("matplotlib")
    pytest.importorskip("scipy")
    words = [str(measured[0]) if word == "MEASURED" else word for word in words]
    for ending, begin in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        out = tmp_path / f"out{ending}"
        assert str(out) in output_of(capsys, 0, *words, "-o", str(out))
        assert out.read_bytes().startswith(begin)
    output_of(capsys, 0, *words, "-o", str(tmp_path / "out.csv"))
    head, *rows = (tmp_path / "out.csv").read_text().splitlines()
    assert rows
    assert {row.count(",") for row in rows} == {head.count(",")}
    wrong = output_of(capsys, 2, *words, "-o", str(tmp_path / "out.xyz"))
    assert "ends in .png, .svg, .pdf, or for the command in .csv" in wrong
    assert b"<dc:date>" not in (tmp_path / "out.svg").read_bytes()


@pytest.mark.parametrize(
    ("unknown", "k", "heads"),
    [
        ("k", "", "k [N/m],between,and,mu_macro [-],regime"),
        ("y0", "k=1N/um", "y0 [m],between,and,mu_macro [-],regime"),
        ("y0", "k=0.8..1.2N/um", "k [N/m],y0 [m],between,and,mu_macro [-],regime"),
    ],
)
def test_roots_go_into_csv_with_their_stiffness_where_it_has_an_interval(
    capsys: Capture, tmp_path: Path, unknown: str, k: str, heads: str
) -> None:
    case = f"mu0=0.3 Fz=10N f=20kHz v0=10mm/s {k}" + (" y0=2um" if unknown == "k" else "")
    out = tmp_path / "roots.csv"
    output_of(capsys, 0, "solve-for", unknown, case, "--target", "0.2", "-o", str(out))
    head, *rows = out.read_text().splitlines()
    assert head == heads
    assert len(rows) == (3 if ".." in k else 1)
    assert {row.count(",") for row in rows} == {head.count(",")}


def test_a_picture_names_the_extra_it_needs(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("figure", "pyplot"):
        monkeypatch.setitem(sys.modules, f"matplotlib.{name}", None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert 'pip install "mumacro[plot]"' in output_of(
        capsys, 1, "map", "-o", str(tmp_path / "map.png")
    )


def test_a_case_beyond_the_map_is_said_to_be_so(capsys: Capture, tmp_path: Path) -> None:
    out = str(tmp_path / "map.csv")
    assert "outside" not in output_of(capsys, 0, "map", CASE, "-o", out)
    for case in (
        CASE.replace("1e6", "rigid"),
        CASE.replace("0.01", "0"),
        CASE.replace("1e6", "1e30"),
    ):
        assert "the case lies outside the map, at its edge: v~ = " in output_of(
            capsys, 0, "map", case, "-o", out
        )


BALL = ("ball", "--radius", "5mm", "--Fz", "10N", "--E", "210GPa", "--nu", "0.3")


@pytest.mark.parametrize(
    ("words", "geometry", "arguments"),
    [
        (BALL, "ball", {}),
        ((*BALL, "--E2", "3 MPa", "--nu2", "0.5"), "ball", {"E2": 3e6, "nu2": 0.5}),
        ((*BALL, "--E2", "rigid"), "ball", {"E2": math.inf}),
        (("flat", *BALL[1:]), "flat", {}),
        (
            ("cylinder", *BALL[1:], "--length", "1cm", "--oscillation", "along"),
            "cylinder",
            {"length": 0.01, "oscillation": "along"},
        ),
    ],
)
def test_what_stiffness_prints_goes_into_a_command(
    capsys: Capture, words: Any, geometry: Any, arguments: Any
) -> None:
    stiffness = json.loads(output_of(capsys, 0, "stiffness", *words, "--json"))
    expected = contact_of(geometry, radius=5e-3, Fz=10.0, E=210e9, nu=0.3, **arguments)
    assert (stiffness["k"], stiffness["contact"]) == (expected.k, expected.contact)
    lines = output_of(capsys, 0, "stiffness", *words).partition("\nwarning")[0].splitlines()
    assert lines[-2].split() == ["contact", expected.contact]
    pasted = lines[-1].split()[1:]
    answer = json.loads(output_of(capsys, 0, CASE.replace("k=1e6", ""), *pasted, "--json"))
    inputs = {**VALUES, "k": expected.k}
    assert answer["mu_macro"] == close(
        Surrogate.open().evaluate(**inputs, contact=expected.contact).mu_macro, rel=1e-3
    )


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_the_example_of_a_geometry_answers(capsys: Capture, geometry: str) -> None:
    message = output_of(capsys, 2, "stiffness", geometry)
    example = message.partition("as in mumacro ")[2].partition(" (")[0]
    assert "paste  " in output_of(capsys, 0, *example.split())


def test_a_wide_contact_is_told_below_its_stiffness(capsys: Capture) -> None:
    words = "stiffness", "ball", "--radius", "5mm", "--Fz", "10N", "--nu", "0.3", "--E"
    assert (
        output_of(capsys, 0, *words, "1MPa")
        .splitlines()[-1]
        .startswith("warning: the contact's half width 0.00409 m")
    )
    assert "did you mean 210 GPa?" in output_of(capsys, 2, *words, "210")
    assert "warning" not in output_of(capsys, 0, *words, "210GPa")


def test_the_arguments_of_a_stiffness_are_those_of_its_geometry(capsys: Capture) -> None:
    message = output_of(capsys, 2, "stiffness", *BALL[:2], "5mN", "--Fz", "10V", *BALL[5:])
    assert "radius must be in metres" in message
    assert "Fz must be in newtons" in message
    assert "nu must be" in output_of(capsys, 2, "stiffness", *BALL[:-1], "0.7")
    for geometry, about in GEOMETRIES.items():
        error = output_of(capsys, 2, "stiffness", geometry)
        assert all(f"--{name}" in error for name in (*about.arguments, "E", "nu"))
    assert "--length" in output_of(capsys, 2, "stiffness", *BALL, "--length", "1")


def test_solve_for_reports_the_reachable_range(capsys: Capture) -> None:
    inputs = CASE.replace("v0=0.01", "")
    assert "to 0.3" in output_of(capsys, 1, "solve-for", "v0", inputs, "--target", "0.5")
    assert "leave v0 out" in output_of(capsys, 2, "solve-for", "v0", CASE, "--target", "0.2")
    still = CASE.replace("y0=2e-6", "y0=0").replace("v0=0.01", "")
    assert "no influence" in output_of(capsys, 1, "solve-for", "v0", still, "--target", "0.2")
    words = ("solve-for", "v0", inputs, "--target")
    (result,) = json.loads(output_of(capsys, 0, *words, "0.8", "--ratio", "--json"))["results"]
    assert result["target"] == close(0.24, rel=1e-15)
    assert "v0 from 0.0001 to 0.001 m/s" in output_of(
        capsys, 1, *words, "0.24", "--between", "1e-4", "1e-3"
    )


def test_the_table_in_use_is_described(capsys: Capture, surrogate: Surrogate) -> None:
    properties = json.loads(output_of(capsys, 0, "table", "--json"))
    expected = (str(surrogate.path), surrogate.checksum, surrogate.max_abs_error)
    assert (
        properties["path"],
        properties["checksum"],
        properties["verified_max_abs_error"],
    ) == expected
    assert properties["error_distribution"] == surrogate.error_distribution
    assert properties["interpolation_errors"] == surrogate.table.interpolation_errors
    text = output_of(capsys, 0, "table")
    assert text.count(".nc") > len(properties["bundled"])
    assert "times the error its bound is: 1 or more is a bound that holds." in text
    assert f"{surrogate.error_distribution['border']['0.95']:.2g}" in text
    grid = text.partition("interpolate the plain grid")[2]
    assert f"{surrogate.table.interpolation_errors['cubic']['0.99']:.2g}" in grid


def test_export_is_that_of_the_builder(capsys: Capture, tmp_path: Path, tables_dir: Path) -> None:
    out, table = tmp_path / "grid.csv", str(tables_dir / "mumacro-1e-4.nc")
    words = ("export", "--format", "csv", "--out", str(out), "--table", "1e-4")
    report = json.loads(output_of(capsys, 0, *words, "--json"))
    assert report["table"] == table
    stated = Surrogate.open(table).attributes
    assert (
        report["interpolation_error_cubic_largest"] == stated["interpolation_error_cubic_largest"]
    )
    rows = [line.split() for line in output_of(capsys, 0, *words).splitlines()]
    assert rows[:3] == [["table", table], ["format", "csv"], ["out", str(out)]]
    assert out.read_text().startswith("v_tilde,")


@pytest.mark.slow
def test_a_closed_output_pipe_is_no_error(repository: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "mumacro",
        "law",
        CASE.replace("v0=0.01", ""),
        "--along",
        "v0",
        "1e-4",
        "1",
    ]
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([*command, "--points", "20000"], cwd=repository, **pipes) as process:
        assert process.stdout
        assert process.stdout.readline().startswith(b"mu0 = 0.3, Fz = 10 N")
        assert any(process.stdout.readline().startswith(b"v0 [mm/s]") for _ in range(3))
        process.stdout.close()
        assert process.wait(timeout=120) == 0
        assert process.stderr
        assert b"Traceback" not in process.stderr.read()


@pytest.mark.parametrize("text", ["0.15", "15%", "0,15", "15 percent", "1.5×10⁻¹"])
def test_a_target_is_read_as_other_values_are(capsys: Capture, text: str) -> None:
    words = CASE.replace("y0=2e-6 ", "")
    answer = json.loads(output_of(capsys, 0, "solve-for", "y0", words, "--target", text, "--json"))
    assert answer["results"][0]["target"] == 0.15


@pytest.mark.parametrize("row_of_units", [False, True])
def test_eval_doubts_a_value_in_the_unit_of_its_column(
    capsys: Capture, tmp_path: Path, row_of_units: bool
) -> None:
    names, units = ("mu0", "Fz", "k", "y0", "f", "v0"), ("-", "N", "N/um", "um", "kHz", "mm/s")
    if row_of_units:
        head = ",".join(names) + "\n" + ",".join(units)
    else:
        head = ",".join(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True))
    (tmp_path / "cases.csv").write_text(f"{head}\n0.3,10,1,2,20000,10\n")
    main(["eval", str(tmp_path / "cases.csv"), "-o", str(tmp_path / "out.csv")])
    said = capsys.readouterr()
    assert "is f = 20000 kHz right?" in said.out + said.err


def test_the_last_line_of_eval_has_the_remarks(capsys: Capture, tmp_path: Path) -> None:
    cases = tmp_path / "cases.csv"
    cases.write_text(
        "mu0,Fz,k,y0,f,v0\n0.3,10,1,2e-6,2e4,0.01\n0.3,10,1,2e-6,2e4,0.1\n30,10,1e6,2e-6,2e4,1\n"
    )
    last = output_of(capsys, 0, "eval", str(cases), "-o", str(tmp_path / "out.csv")).splitlines()
    assert len(last) == 1
    assert last[0].startswith("3 of 3 rows evaluated with")
    assert "; remark on mu0: mu0 = 30" in last[0]
    assert "; remark on k in 2 rows: l0 = mu0 Fz / k = 3 m" in last[0]


def test_a_terminal_of_another_codec_does_not_end_a_run_that_has_written_its_output(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "µ"
    folder.mkdir()
    (folder / "c.csv").write_text("mu0,Fz,k,y0,f,v0\n0.3,10,1e6,2e-6,20e3,0.01\n")
    words = [sys.executable, "-m", "mumacro", "eval", str(folder / "c.csv"), "-o"]
    done = subprocess.run(
        [*words, str(folder / "o.csv")],
        capture_output=True,
        env={**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert b"\\xb5" in done.stdout
    assert (folder / "o.csv").is_file()
