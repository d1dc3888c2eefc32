"""Samples of the trials that the scripts in fuzz/ run in full."""

from pathlib import Path

import numpy as np
import pytest

from builder.limits import Y_RANGE
from builder.steady import solve
from builder.sweep import CheckpointError, Sweep
from mumacro import Surrogate
from mumacro.closed_forms import outer
from mumacro.writing import BusyError, alone_in, write_whole

pytest.importorskip("pyarrow", reason="the extra files is not installed")

from fuzz import answers, faults, number_strings, strange, tables
from fuzz.hostile_tables import HOSTILE

ROOT = Path(__file__).resolve().parent.parent


# --- untrusted tables --------------------------------------------------------------------------------

#: a table with other numbers and a matching checksum is a different table; any answer is allowed
ANOTHER = {
    "numbers of 1.7e308, checksum right", "random numbers of 1e100, checksum right",
    "amplitudes of 1e300, checksum right", "errors of 1e308, checksum right",
}  # fmt: skip
HARMLESS = {"a group that contains itself", "3,000 nested groups"}


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, str, float, float]]:
    """Every hostile file, opened by another process that may use 256 MB."""
    folder = tmp_path_factory.mktemp("hostile")
    for i, make in enumerate(HOSTILE.values()):
        make(folder / f"{i}.nc")
    outcomes, code = tables.in_other_process(*(str(folder / f"{i}.nc") for i in range(len(HOSTILE))))
    names = list(HOSTILE)
    assert len(outcomes) == len(names), f"died of: {names[len(outcomes)]}"
    assert code == 0
    return dict(zip(names, outcomes, strict=True))


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_before_memory_is_taken(opened, name: str) -> None:
    found = opened[name]
    assert found.what == ("differs" if name in ANOTHER else "same" if name in HARMLESS else "refused"), found
    assert found.megabytes < 128.0


@pytest.mark.parametrize("change", tables.CHANGES)
def test_damaged_files_are_refused_or_answer_the_same(change: str) -> None:
    size = tables.SMALLEST.stat().st_size
    images = {}
    for start in range(0, size, 4096 if change == "cut" else 2501):
        images.update(tables.work(start, 1, change))
    assert len(images) > 30
    found = [tables.outcome(image, Path(f"{start}.nc")) for start, image in images.items()]
    assert {one.what for one in found} <= {tables.REFUSED, tables.SAME}, found
    # the rest is in room that HDF5 leaves empty
    assert sum(one.what == tables.REFUSED for one in found) > 0.6 * len(found)


# --- answers ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[1e-4, 1e-12])
def table(request: pytest.FixtureRequest) -> Surrogate:
    return Surrogate.open(request.param)


@pytest.mark.parametrize("promise", ["finite", "monotone", "neighbours", "seams", "same_bits"])
def test_answers_have_their_properties_over_the_full_double_range(table: Surrogate, promise: str) -> None:
    found = getattr(answers, promise)(table, 0.01)
    assert found.tried >= 500
    assert found.broken == 0


@pytest.mark.slow
def test_bounds_cover_fresh_solves_over_the_solvers_range() -> None:
    found = answers.fresh_solves(Surrogate.open(1e-12), 0.02)
    assert found.tried >= 500
    assert found.broken == 0


@pytest.mark.parametrize("x", [0.6, 1.18, 2.68, 30.0, 54.0, 55.0, 125.0, 250.0])
@pytest.mark.parametrize("y", [1e120, 1e149, 1e151, 1e181, 1e198, 1e202, 1e241, 1e296, 1e304])
def test_layers_at_the_largest_amplitudes_depend_on_one_number(table: Surrogate, x: float, y: float) -> None:
    """(mu~ - f(r)) r = G(v~/sqrt y~); f was taken without a logarithm above 1e200, G was left out above 1e150."""
    last = Y_RANGE[1]  # where G is solved

    def layer(x: float) -> float:
        r = np.sqrt(last) / x
        return (solve(last / r, last).mu_ratio - float(outer(r))) * r

    def expected(v: float, y: float) -> float:
        return float(outer(y / v)) + layer(v / np.sqrt(y)) * (v / y)

    v = x * np.sqrt(y)
    found, bound, _ = table.ratio_with_bound(v, y)
    assert abs(found - expected(v, y)) <= bound + 1e-14 * found
    along_v, along_y, error_v, error_y = table.slopes(v, y, bounds=True)[1:]
    near = {h: (expected(v * (1.0 + h), y), expected(v, y * (1.0 + h))) for h in (-1e-4, 1e-4)}
    noise = 1e-7 * found  # error of the differences
    assert abs(along_v - (near[1e-4][0] - near[-1e-4][0]) / 2e-4) <= error_v + noise
    assert abs(along_y - (near[1e-4][1] - near[-1e-4][1]) / 2e-4) <= error_y + noise


def test_a_ratio_beyond_double_range_is_bounded(table: Surrogate) -> None:
    """y0 omega/v0 beyond double range: eq. (35) is 2.5e-306 there, not 0."""
    case = {"mu0": 1.0, "Fz": 1.0, "k": None, "y0": 1.7976931348623157e308, "v0": 1e160}
    inside, beyond = (table.evaluate(**case, omega=omega) for omega in (1e160, np.nextafter(1e160, 1e161)))
    assert inside.mu_ratio > 2.5e-306
    assert abs(inside.mu_ratio - beyond.mu_ratio) <= inside.error_bound + beyond.error_bound


def test_scaling_at_constant_groups_changes_nothing(table: Surrogate) -> None:
    for by_twos in (True, False):
        found = answers.scaled(table, 0.01, by_twos)
        assert found.tried > 5000
        assert found.broken == 0


def test_another_processor_answers_within_the_bounds() -> None:
    """Guaranteed across processors: both bounds and the source, but not the bits."""
    here, there = answers.across_processors(20_000, 1e-12)
    assert np.all(np.abs(here[0] - there[0]) <= here[2] + there[2])
    assert np.array_equal(here[3], there[3])


@pytest.mark.parametrize("kind", ["csv", "ndjson"])
@pytest.mark.parametrize("what", number_strings.KINDS)
def test_number_strings_give_the_bits_of_float_or_are_refused(tmp_path: Path, what: str, kind: str) -> None:
    same, refused, other = number_strings.compare(number_strings.drawn(1000, 5, what), kind, tmp_path)
    assert other == 0
    if what in ("beyond the range", "no numbers"):
        assert refused == 1000
    elif what != "random digits and exponents":  # some of those are beyond the range, or no JSON
        assert same == 1000


# --- disks, permissions, processes --------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "disk full while a table is written",
        "no permission to write a table",
        "no permission to write eval's output",
        "a clock that steps",
    ],
)
def test_a_fault_loses_no_data(name: str) -> None:
    what, seen = faults.tried(faults.FAULTS[name])
    if what == "not tried":
        pytest.skip(seen)
    assert what == "held", seen


def test_a_full_disk_in_a_sweep_is_reported_and_finished_work_stays(tmp_path: Path) -> None:
    v, y = np.full(60, 0.1), np.geomspace(0.1, 10.0, 60)
    try:
        with faults.small_disk(tmp_path, "16k") as disk, Sweep(1, checkpoint=disk / "work.checkpoint") as sweep:
            sweep.solve("full", v[:20], y[:20])
            kept = faults.left(disk)
            many = np.geomspace(0.1, 10.0, 600)  # 29 kB of results
            with pytest.raises(
                CheckpointError, match=r"work\.checkpoint: finished work cannot be stored: No space left"
            ):
                sweep.solve("full", many, many)
            assert faults.left(disk) == kept
    except faults.NotTriedError as error:
        pytest.skip(str(error))


@pytest.mark.slow
def test_a_second_build_to_one_output_is_refused_in_a_line(run_builder, tmp_path: Path) -> None:
    out = tmp_path / "rough.nc"
    with alone_in(tmp_path / "rough.nc.checkpoint"):
        done = run_builder("build", "--tolerance", "1e-2", "--out", out)
    assert done.returncode == 1
    assert "rough.nc.checkpoint: another process is at work here; wait for it, or stop it" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_given_back_at_the_end(tmp_path: Path) -> None:
    folder = tmp_path / "work"
    with alone_in(folder):
        with pytest.raises(BusyError, match="another process is at work here"), alone_in(folder):
            pass
        (folder / "part").touch()
    assert folder.is_dir()  # unfinished work is kept
    with alone_in(folder):
        (folder / "part").unlink()
    assert not folder.exists()


def test_a_file_is_complete_or_absent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_whole(tmp_path / "a", b"old")

    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", fail)
        with pytest.raises(KeyboardInterrupt):
            write_whole(tmp_path / "a", b"new")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a", b"old")]


# --- the service --------------------------------------------------------------------------------------


@pytest.mark.slow
def test_strange_requests_are_answered_or_refused() -> None:
    found = strange.strange_requests(0.003)
    assert "FAILED" not in found, found
