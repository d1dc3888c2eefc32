"""The programs of docs/how-to/many-cases.md run unchanged and agree with the library."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from tests.support.comparing import close
from tests.support.places import ROOT

pytestmark = pytest.mark.filterwarnings("ignore")

PAGE = (ROOT / "docs" / "how-to" / "many-cases.md").read_text("utf-8")
RUN = {"Lazy designs, streaming reductions", "Files over a cluster"}
CASES: dict[str, Any] = {
    "mu0": 0.3,
    "Fz": 10.0,
    "k": 1e6,
    "y0": np.array([1e-6, 2e-6]),
    "omega": 1.3e5,
    "v0": 0.01,
}


def run(heading: str, *needs: str) -> dict[str, Any]:
    assert heading in RUN
    for package in needs:
        pytest.importorskip(package)
    section = PAGE.split(f"# {heading}\n")[1].split("\n##")[0]
    names: dict[str, Any] = {"__name__": "__main__"}  # as a script
    for block in re.findall(r"^```python\n(.*?)^```$", section, re.MULTILINE | re.DOTALL):
        exec(compile(block, heading, "exec"), names)  # noqa: S102 (our own page)
    return names


def test_every_program_of_the_page_is_in_a_section_that_runs_here() -> None:
    sections = re.findall(r"^#+ ([^\n]+)\n(.*?)(?=^##|\Z)", PAGE, re.MULTILINE | re.DOTALL)
    assert {heading for heading, text in sections if "```python" in text} == RUN


@pytest.fixture(scope="module")
def expected() -> Any:
    return Surrogate.open().evaluate(CASES).mu_macro


@pytest.mark.slow
def test_designs_and_reductions() -> None:
    output = run("Lazy designs, streaming reductions", "distributed")
    mu = output["mu"].compute()
    assert mu.size == 2**16
    assert output["mean"] == close(float(np.mean(mu)), rel=1e-12)
    assert output["spread"] == close(float(np.std(mu)), rel=1e-12)
    assert output["least"] == float(np.min(mu))
    assert output["on_two"] == output["mean"]
    exact = np.quantile(mu, [0.05, 0.5, 0.95], method="inverted_cdf")
    assert np.all((output["below"] <= exact) & (exact <= output["above"]))
    enough = output["enough"].compute()
    assert 0 < int(enough.sum()) < enough.size
    assert float(output["found"].y0) == float(output["plane"].y0.where(enough.any("v")).min())
    assert bool(enough.isel(output["place"]))


def test_files_over_a_cluster(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, expected: Any
) -> None:
    pq, pa = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("pyarrow")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    table = pa.table({name: np.broadcast_to(value, 2) for name, value in CASES.items()})
    for i in range(3):
        pq.write_table(table.slice(0, 1 + i % 2), tmp_path / "runs" / f"{i}.parquet")
    for _ in range(2):  # a second run replaces the answers of the first
        assert run("Files over a cluster", "distributed")["rows"] == [1, 2, 1]
    answers = pq.read_table(tmp_path / "answers" / "1.parquet")
    assert answers["mu_macro"].to_pylist() == list(expected)
