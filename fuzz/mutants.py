"""Faults made by hand: each must make a named test fail.

    python fuzz/mutants.py [--only NAME] [--jobs 2]

A copy of the working tree gets one fault at a time; a fault in C compiles the kernel again; its tests must fail.  First
the tests of every row run without a fault, and must pass.  Exit code 1 if a fault survives, or its text is not found
exactly once.
"""

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from benchmarks.measuring import ROOT, markdown, progress

C = "mumacro/kernel/"
TIGHT = "tests/test_tight_bounds.py"


class Fault(NamedTuple):
    """What is written in place of what, and the pytest arguments of the tests that must fail."""

    file: str
    old: str
    new: str
    tests: str


# fmt: off
FAULTS = [Fault(*row) for row in (
    # bounds: half of what they are
    (C + "closed_forms.c", "*bound = MU_FAST_ROUNDING * first", "*bound = 0.5 * MU_FAST_ROUNDING * first", f"{TIGHT} -k large_speed -m ''"),
    (C + "closed_forms.c", "#define MU_NEXT_ORDER 1.25", "#define MU_NEXT_ORDER 0.6", f"{TIGHT} -k every_block -m ''"),
    (C + "closed_forms.c", "#define MU_RIGID_ROUNDING 1e-15 ", "#define MU_RIGID_ROUNDING 0.5e-15 ", f"{TIGHT} -k six_inputs"),
    (C + "closed_forms.c", "#define MU_STATIC_ROUNDING 4.5e-16", "#define MU_STATIC_ROUNDING 2.2e-16", f"{TIGHT} -k six_inputs"),
    (C + "records.c", "#define MU_EDGE_LOW 0.7", "#define MU_EDGE_LOW 0.35", f"{TIGHT} -k what_the_border_does"),
    (C + "records.c", "#define MU_EDGE_HIGH 0.96", "#define MU_EDGE_HIGH 0.48", f"{TIGHT} -k what_the_border_does"),
    (C + "records.c", "return mu_limit(0.0, cusp, MU_STATIC_LIMIT)", "return mu_limit(0.0, 0.0, MU_STATIC_LIMIT)", "tests/test_bounds.py -k last_digit -m ''"),
    (C + "points.c", "out.bound = fabs(factor) * errors[0] + errors[1]", "out.bound = 0.5 * fabs(factor) * errors[0] + errors[1]", f"{TIGHT} -k may_not_be_halved_and"),
    (C + "passes.c", "bound[i] = fabs(c->factor[i]) * error[0] + error[1]", "bound[i] = 0.5 * fabs(c->factor[i]) * error[0] + error[1]", f"{TIGHT} -k may_not_be_halved_and"),
    (C + "dimensional.c", "bound[i] *= in[0][i];", "bound[i] *= 0.5 * in[0][i];", f"{TIGHT} tests/test_surrogate.py -k 'enclosure_holds or bit_for_bit or settling'"),
    (C + "points.c", "errors[0] * fabs(of_factor) + errors[1] * fabs(of_a) + errors[2] * fabs(of_b)", "0.5 * (errors[0] * fabs(of_factor) + errors[1] * fabs(of_a) + errors[2] * fabs(of_b))", f"{TIGHT} -k slopes"),
    (C + "points.c", "1.0 / (1.0 + 7.0 * (1.0 - u * u))", "0.2 / (1.0 + 7.0 * (1.0 - u * u))", f"{TIGHT} -k slopes"),
    (C + "points.c", "fabs(factor * q_b) * off / (inside - off)", "0.1 * fabs(factor * q_b) * off / (inside - off)", f"{TIGHT} -k slopes"),
    (C + "points.c", "*bound = found.bound / v;", "*bound = 0.4 * found.bound / v;", "tests/test_bounds.py -k from_rest"),
    (C + "border.c", "data->pieces[MU_PIECE_ERROR] + MU_ROUNDING", "0.5 * data->pieces[MU_PIECE_ERROR] + MU_ROUNDING", f"{TIGHT} -k 'border or regime'"),
    (C + "contact.c", "#define MU_LINE_ROUNDING 5e-16", "#define MU_LINE_ROUNDING 2e-16", f"{TIGHT} -k six_inputs"),
    (C + "contact.c", "const double most = rule->errors[0][error]", "const double most = 0.5 * rule->errors[0][error]", f"{TIGHT} -k rules_err"),
    ("mumacro/inverse/solve.py", "sign * curve.sign * bound", "0.5 * sign * curve.sign * bound", f"{TIGHT} -k enclosure"),
    ("mumacro/inverse/solve.py", "< 0.97 * beyond.error_bound", "< 0.0 * beyond.error_bound", f"{TIGHT} -k enclosure"),
    ("mumacro/settling.py", "(v * bound + power_bound) / rate", "0.5 * (v * bound + power_bound) / rate", f"{TIGHT} -k settling"),
    ("mumacro/settling.py", "periods * off / (1.0 - off)", "periods * off", f"{TIGHT} -k settling"),
    # values
    (C + "dimensional.c", "(i < 5 ? mu0 : -mu0) * along / six[i]", "(i < 5 ? mu0 : -mu0) * (i == 4 ? 1e11 : 1.0) * along / six[i]", "tests/test_bounds.py -k gradient_of_rigid"),
    (C + "dimensional.c", "(i < 5 ? mu0 : -mu0) * along / six[i]", "(i == 4 ? mu0 : -mu0) * along / six[i]", "tests/test_bounds.py -k gradient_of_rigid"),
    (C + "dimensional.c", "(i < 5 ? mu0 : -mu0) * along / six[i]", "mu0 * along / six[i]", "tests/test_bounds.py -k gradient_of_rigid"),
    (C + "dimensional.c", "mu_chain_row(n, sign, in[0], both, in[1]", "mu_chain_row(n, 1.0, in[0], both, in[1]", "tests/test_bounds.py -k gradient"),
    (C + "dimensional.c", "of[MU_OF_MU][i] + sign * stiff[i]", "of[MU_OF_MU][i] - sign * stiff[i]", "tests/test_bounds.py -k gradient"),
    (C + "dimensional.c", "const double unit = (in->k / in->Fz) / in->omega", "const double unit = (in->k / in->Fz)", "tests/test_bounds.py -k 'gradient or slope' -m ''"),
    (C + "dimensional.c", "if (*y == 0.0 && in->v0 > 0.0) return mu_limit(1.0, MU_ROUNDING", "if (*y == 0.0 && in->v0 > 0.0) return mu_limit(0.5, MU_ROUNDING", "tests/test_dimensional.py"),
    (C + "dimensional.c", "== HUGE_VAL) return mu_limit(0.0, 0.0, MU_STATIC_LIMIT", "== HUGE_VAL) return mu_limit(1.0, 0.0, MU_STATIC_LIMIT", "tests/test_dimensional.py -k precision"),
    (C + "dimensional.c", "if (!(in->y0 >= 0.0 &&", "if (!(in->y0 >= -1.0 &&", "tests/test_dimensional.py -k illegal"),
    (C + "arithmetic.c", "return mu_scale(above / below, i + j - k - l - m)", "return mu_scale(above / below, i + j - k - l + m)", "tests/test_dimensional.py -k groups"),
    (C + "closed_forms.c", "if (r < 0.2) {", "if (r < 2.0) {", "tests/test_committed_tables.py -k fresh_solves -m ''"),
    (C + "closed_forms.c", "out.first = k * q;", "out.first = k * q * (1.0 + 1e-13);", "tests/test_dimensional.py tests/test_tight_bounds.py -k 'rigid or six_inputs'"),
    (C + "charts.c", "for (int i = 0; i < 3; ++i) {\n        const double slope = 3.0", "for (int i = 0; i < 1; ++i) {\n        const double slope = 3.0", "tests/test_charts.py tests/test_bounds.py -k 'place or corner or inverse'"),
    (C + "charts.c", "root = sqrt(y), rho = v / at.crit", "root = y, rho = v / at.crit", "tests/test_border.py tests/test_passes.py tests/test_charts.py"),
    (C + "border.c", "return piece == MU_BORDER_LOW ? 0.5 * y * y : sqrt(y);", "return piece == MU_BORDER_LOW ? y * y : sqrt(y);", "tests/test_charts.py tests/test_border.py tests/test_committed_tables.py"),
    (C + "passes.c", "few[0][j] = j < rest ? v[i + j] : 1.0;", "few[0][j] = v[i];", "tests/test_passes.py"),
    (C + "passes.c", "value[i] = mu_min(mu_max(value[i], 0.0), 1.0)", "value[i] = mu_min(mu_max(value[i], 0.0), 0.999999)", "tests/test_surrogate.py tests/test_passes.py"),
    (C + "passes.c", "left |= MU_WHERE(block >= mu_all_whole(MU_FAST)) | MU_WHERE", "left |= MU_WHERE", "tests/test_passes.py"),
    (C + "cells.c", "out.w = 2.0 * (z - j) - 1.0", "out.w = 2.0 * (z - j) - 0.9999999", "tests/test_cells.py tests/test_passes.py"),
    (C + "quantities.c", "return v * (v / y);", "return v / y;", f"{TIGHT} -k 'every_block and power' -m ''"),
    (C + "quantities.c", "(2.0 * MU_LN2 + 0.5 * mu_log1(y))", "(1.0 * MU_LN2 + 0.5 * mu_log1(y))", "tests/test_surrogate.py -k creep"),
    (C + "records.c", "if (v > 0.0 || y > 1.0) return common;\n    return mu_limit(1.0", "if (v > 0.0 || y > 1.0) return common;\n    return mu_limit(0.0", "tests/test_surrogate.py -k companions"),
    ("mumacro/surrogate.py", "self.border.max_rel_error + 4.0 * charts.ROUNDING", "0.5 * self.border.max_rel_error + 4.0 * charts.ROUNDING", f"{TIGHT} -k regime"),
    ("mumacro/settling.py", "2.0 * periods, time", "periods, time", "tests/test_settling.py"),
    ("mumacro/inverse/solve.py", "_Y_CLOSEST = 1.290791", "_Y_CLOSEST = 2.290791", "tests/test_inverse.py"),
    ("mumacro/inverse/rootfinding.py", "2.0 * np.abs(step) <= np.abs(last[i])", "True", "tests/test_inverse.py"),
    ("mumacro/law.py", "_CORNER_REACH, _CORNER_TOP = 0.5, 0.7", "_CORNER_REACH, _CORNER_TOP = 0.9, 0.7", "tests/test_law.py tests/test_closed_forms.py"),
    ("mumacro/closed_forms.py", "1 - q / 20", "1 - q / 21", "tests/test_closed_forms.py -m ''"),
    ("mumacro/jax.py", "return sum(slope * tangent for", "return -sum(slope * tangent for", "tests/test_derivatives.py -k jax -m ''"),
    # the builder
    ("builder/verify.py", "low, high = 1 - 1e-13, 1 + 1e-13", "low, high = 1 + 1e-13, 1 + 1e-13", "tests/test_verify.py -m ''"),
    # the service
    ("service/quantities.py", "Part(\"std_bound\"", "Part(\"std_bund\"", f"{TIGHT} -k standard"),
    ("service/limits.py", "version not in (\"1.0\"", "version not in (\"0.9\", \"1.0\"", "tests/test_service_connection.py -k head_is_refused"),
    ("service/limits.py", "b\"content-length\", b\"0\").strip()", "b\"content-length\", b\"0\")", "tests/test_service_connection.py -k head_is_refused"),
    ("service/limits.py", ".strip(b\" \\t,\") != b\"chunked\"", ".strip(b\" \\t,\") == b\"x\"", "tests/test_service_connection.py -k head_is_refused"),
    ("service/static/page/inputs.js", "Math.sqrt(low) * Math.sqrt(high)", "(low + high) / 2", "tests/test_page.py -m '' -k typed"),
)]
# fmt: on


def run(folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    variables = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False, timeout=300)


def tested(folder: Path, tests: str) -> int:
    """Exit code of pytest: 0 all passed, 1 some failed or did not end."""
    options = ("-q", "-x", "-p", "no:cacheprovider", "-n", "0")
    try:
        return run(folder, sys.executable, "-m", "pytest", *options, *shlex.split(tests)).returncode
    except subprocess.TimeoutExpired:
        return 1


def in_a_copy(tests: str, fault: Fault | None = None) -> str:
    """What became of a fault in a copy of the working tree: killed, survived, or why it cannot be tried.

    Without a fault: empty if the tests pass.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "copy"
        shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(".*", "build", "dist", "__pycache__"))
        if fault is None:
            return "" if tested(folder, tests) == 0 else "its tests fail without it"
        path = folder / fault.file
        text = path.read_text("utf-8")
        if (found := text.count(fault.old)) != 1:
            return f"its text is there {found} times"
        path.write_text(text.replace(fault.old, fault.new), "utf-8")
        if path.suffix in (".c", ".h") and run(folder, sys.executable, "hatch_build.py").returncode:
            return "does not compile"
        code = tested(folder, tests)
        return {0: "SURVIVED", 1: "killed"}.get(code, f"pytest ended with {code}")


def mutants(only: str, jobs: int) -> str:
    """Try all faults, or those whose file or text holds ``only``."""
    chosen = [fault for fault in FAULTS if only in f"{fault.file} {fault.new}"]
    suites = list(dict.fromkeys(fault.tests for fault in chosen))
    with ThreadPoolExecutor(jobs) as pool:
        broken = dict(zip(suites, pool.map(in_a_copy, suites), strict=True))

        def one(fault: Fault) -> list[str]:
            row = [fault.file, fault.new.splitlines()[0], broken[fault.tests] or in_a_copy(fault.tests, fault)]
            progress(" | ".join(row))
            return row

        rows = list(pool.map(one, chosen))
    killed = sum(row[2] == "killed" for row in rows)
    return f"{markdown(('file', 'fault', 'result'), rows, 3)}\n\n{killed} of {len(rows)} killed."


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="faults whose file or text holds this")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    print(text := mutants(**vars(parser.parse_args())))
    killed, _, tried, _ = text.split()[-4:]
    raise SystemExit(killed != tried)
