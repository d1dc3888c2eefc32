"""mumacro_evaluate_as of the C export: the library's bits, and what it refuses."""

import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.c.source import write_c
from mumacro import REGIMES, Surrogate
from mumacro.contact import CONTACTS, DIRECTIONS
from mumacro.table import read_table
from tests.cases import Case
from tests.test_c_header import LANES, STRICT

pytestmark = [pytest.mark.slow, pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")]
MAIN = """\
#include <stdio.h>
#include "mumacro.h"
int main(void) {
    int contact, direction;
    double x[6];
    while (scanf("%d %d %la %la %la %la %la %la", &contact, &direction, x, x + 1, x + 2, x + 3, x + 4, x + 5) == 8) {
        mumacro_answer a;
        int error = mumacro_evaluate_as(contact, direction, x[0], x[1], x[2], x[3], x[4], x[5], &a);
        printf("%d %d %d %a %a %a %a", error, a.source, a.regime, a.mu_macro, a.error_bound, a.v_tilde, a.y_tilde);
        for (int i = 0; i < 6; ++i) printf(" %a %a", a.gradient[i], a.gradient_bound[i]);
        puts("");
    }
    puts(mumacro_error_text(MUMACRO_LIFT_OFF));
    puts(mumacro_error_text(MUMACRO_NO_NORMAL_BALL));
    puts(mumacro_error_text(MUMACRO_NO_CONTACT));
    return 0;
}
"""


def cases() -> list[tuple[int, int, tuple[float, ...]]]:
    rng, found = np.random.default_rng(4), []
    for contact, direction in ((0, 0), (1, 0), (0, 1), (1, 1), (0, 2)):
        for i in range(40):
            six = np.array([0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01]) * 10.0 ** rng.uniform(-1, 1, 6)
            if direction == 2:
                six[3] = six[1] * rng.uniform(0.0, 0.99)
            if i < 6:
                six[i] = math.inf if i == 2 else -1.0 if i in (0, 1) else 0.0
            found.append((contact, direction, tuple(six.tolist())))
    return found


@pytest.mark.parametrize("form", ["one", "three"])
@pytest.mark.parametrize("language", ["gcc", "g++"])
def test_the_bits_of_the_library(tables_dir: Path, tmp_path: Path, form: Any, language: Any) -> None:
    path = tables_dir / "mumacro-1e-4.nc"
    write_c(read_table(path), tmp_path / "mumacro.h" if form == "one" else tmp_path)
    (tmp_path / "main.c").write_text(MAIN, "ascii")
    sources = ["main.c"] if form == "one" else ["main.c", "mumacro.c", "mumacro_table.c"]
    standard = ["-std=c99"] if language == "gcc" else ["-x", "c++", "-std=c++17"]
    fused = [*LANES[4], "-ffp-contract=off"]
    command = [language, *standard, "-O1", *STRICT, *fused, *sources, "-o", "main", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=300)
    refused = [(1, 2, (0.3, 10.0, 1e6, 1.0, 1e5, 0.01)), (0, 2, (0.3, 10.0, 1e6, 10.0, 1e5, 0.01)),
               (2, 0, (1.0,) * 6), (0, -1, (1.0,) * 6)]  # fmt: skip
    given = cases()
    text = "".join(f"{c} {d} {' '.join(float(x).hex() for x in six)}\n" for c, d, six in given + refused)
    done = subprocess.run([tmp_path / "main"], input=text, capture_output=True, text=True, check=True, timeout=300)
    lines = done.stdout.splitlines()
    s = Surrogate.open(path)
    for (contact, direction, six), line in zip(given, lines, strict=False):
        words = line.split()
        names = ("mu0", "Fz", "k", "Fz_amplitude" if direction == 2 else "y0", "omega", "v0")
        kind: Case = {"contact": CONTACTS[contact], "direction": DIRECTIONS[direction]}
        a = s.evaluate({n: [x] for n, x in zip(names, six, strict=True)}, gradient=True, **kind)
        source = a.source_code[0]
        assert int(words[1]) == source
        assert (int(words[0]) == 0) == (source >= 0)
        assert source == -1 or REGIMES[int(words[2])] == a.regime[0]
        expected = [a.mu_macro, a.error_bound, a.v_tilde, a.y_tilde]
        expected += [x for n in names for x in (a.gradient[n], a.gradient_bound[n])]
        got = [float("nan") if "nan" in w else float.fromhex(w) for w in words[3:]]
        assert np.array_equal(got, np.ravel(expected), equal_nan=True)
    assert [int(line.split()[0]) for line in lines[len(given) : len(given) + 4]] == [-4, 7, -3, -3]
    assert "lifts off" in lines[-3]
    assert "radius" in lines[-2]
