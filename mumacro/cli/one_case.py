"""``mumacro "mu0=0.3 Fz=10N ..."``: the friction of one case."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from mumacro.answer import BAND, DEFAULT
from mumacro.cli import common
from mumacro.cli.common import OneLineParser, as_json, in_columns, open_table, read_case
from mumacro.inputs.doubts import UNITS
from mumacro.inputs.fields import LIKE, PER_UNIT
from mumacro.inputs.kind import SPRING, Kind
from mumacro.outputs import MEMBERS
from mumacro.surrogate import Surrogate
from mumacro.validity import model_rows
from mumacro.version import __version__

EXAMPLE = "mu0=0.3 Fz=10N k=1N/um y0=2um f=20kHz v0=10mm/s"
REGIME_WORDS = {
    "continuous": "slips all the time",
    "stick_slip": "sticks during a part of each period",
    "static": "at rest: the limit v0 -> 0",
    "partial_slip": "the rim of the contact slips all the time, its middle sticks during a part of "
    "each period",
    "reverse_slip": "slips forwards and backwards in each period",
}
_SHOWN = ("std", "std_share", "gradient")  # in rows of their own
ROW_OF_K = ("k is known", True)  # the answer for an interval tells that already


def run(words: Sequence[str], description: str) -> str:
    """``mumacro "mu0=0.3 ..."``; ``description`` is what the help says of the whole command."""
    parser = OneLineParser(prog="mumacro", description=description + common.ABOUT_INPUTS)
    common.add_case(parser, "the six inputs, quoted together or apart")
    common.add_include(parser)
    parser.add_argument("--gradient", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument(
        "--model", action="store_true", help="in JSON, too: what the model leaves out in this case"
    )
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    chosen = parser.parse_intermixed_args(words)
    kind = common.kind_in(chosen)
    case = read_case(chosen.words, kind, deviations=True)
    surrogate, std = open_table(chosen.table), case.pop("std", None)
    include = (*common.included(chosen), *(["gradient"] if chosen.gradient else []))
    options: dict[str, Any] = {**kind.names, "include": include, "std": std}
    answer: Any = surrogate.evaluate(case, **options)
    middle = common.middle_of(case)
    rows = model_rows(surrogate, middle, **kind.names) if chosen.model or not chosen.json else []
    if chosen.json:
        members = answer.to_dict()
        ends = {name: members.pop(name) for name in BAND if "k_range" in case}
        result = {name: members.pop(name) for name in DEFAULT}
        result |= {"v_tilde": answer.v_tilde, "y_tilde": answer.y_tilde, **members}
        result |= {"inputs": middle, "k_range": {"k": case["k_range"], **ends} if ends else None}
        result |= {"model": rows} if chosen.model else {}
        result |= dict(kind.names.items() - SPRING.names.items())
        return as_json({**result, "table": common.about(surrogate)})
    lines = [
        ("assumes", f"{row['row']}: {common.in_words(row['text'], middle)}")
        for row in rows
        if (row["row"], "k_range" in case) != ROW_OF_K and row["row"] != UNITS  # a remark
    ]
    lines += [("remark", f"{one['field']}: {one['text']}") for one in answer.remarks]
    text = in_columns(
        _rows_of(answer, surrogate, case, kind, common.format_for(chosen, surrogate, case, kind))
    )
    error = f"numerical error  {answer.error_bound:.2g}"
    return "\n".join([text, *([in_columns(lines)] if lines else []), error])


def _rows_of(
    answer: Any, surrogate: Surrogate, case: Mapping[str, Any], kind: Kind, form: str
) -> list[Sequence[str]]:
    """An answer as rows of name, value, unit, meaning."""
    groups = "Fz_amplitude / Fz" if kind.normal else "y0 k / (mu0 Fz)"
    rows = [
        ("mu_macro", f"{answer.mu_macro:#{form}}", "[-]", ""),
        ("mu_ratio", f"{answer.mu_ratio:#{form}}", "[-]", "mu_macro / mu0"),
        ("regime", answer.regime, "", REGIME_WORDS[answer.regime]),
        ("v_tilde", f"{answer.v_tilde:{form}}", "[-]", "v0 k / (mu0 Fz omega)"),
        ("y_tilde", f"{answer.y_tilde:{form}}", "[-]", groups),
        ("source", answer.source, "", f"of {surrogate.id}, tolerance {surrogate.tolerance:g}"),
    ]
    if "k_range" in case:
        low, high = (f"{end:.6g}" for end in case["k_range"])
        middle = f"at k = {common.middle_of(case)['k']:.6g} N/m, the geometric middle"
        rows[:1] = [
            (*rows[0][:3], middle),
            (
                "from",
                f"{answer.mu_macro_low:#{form}}",
                "[-]",
                f"the least for k from {low} to {high} N/m",
            ),
            ("to", f"{answer.mu_macro_high:#{form}}", "[-]", "the most"),
        ]
    if "std" in answer.paths:
        shares = {name: answer[f"std_share.{name}"] for name in kind.fields}
        parts = ", ".join(f"{name} {100.0 * x:.3g} %" for name, x in shares.items() if x > 0.0)
        rows.insert(1, ("+-", f"{answer['std']:.2g}", "[-]", f"standard deviation; {parts}"))
    for name, slope in (answer.gradient or {}).items():
        unit = PER_UNIT[LIKE.get(name, name)]
        rows.append((f"slope {name}", f"{slope:{form}}", f"[{unit}]", f"d mu_macro / d {name}"))
    rows += [
        (path, f"{value:{form}}", f"[{MEMBERS[path].unit}]", MEMBERS[path].meaning)
        for path, value in answer.outputs.items()
        if path.partition(".")[0] not in _SHOWN and "_bound" not in path
    ]
    return list(rows)
