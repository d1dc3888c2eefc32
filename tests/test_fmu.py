"""``--format fmu`` and ``fmu3``: FMPy validates and simulates them, with Python's values and derivatives."""

import os
import shutil
import subprocess
import zipfile

import numpy as np
import pytest

from builder.export import export_table
from comparing import close
from mumacro import Surrogate
from mumacro.contact import CONTACTS, DIRECTIONS
from mumacro.inputs import FIELDS

pytestmark = pytest.mark.slow

CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
FORMATS = {"fmu": 2, "fmu3": 3}


@pytest.fixture(scope="module")
def table(tables_dir):
    return Surrogate.open(tables_dir / "mumacro-1e-4.nc", threads=1)


@pytest.fixture(scope="module")
def units(table, tmp_path_factory):
    """Both units by format."""
    root = tmp_path_factory.mktemp("fmu")
    for kind in FORMATS:
        export_table(table.path, kind, root / f"{kind}.fmu")
    return {kind: root / f"{kind}.fmu" for kind in FORMATS}


@pytest.fixture(params=FORMATS)
def unit(request, units):
    return units[request.param]


@pytest.fixture
def fmpy(compilers):
    """FMPy, and a compiler that has built the unit's binary."""
    compilers.compiler("gcc")
    pytest.importorskip("fmpy.validation", reason="fmpy is not installed")
    import fmpy

    return fmpy


def test_the_sources_compile_without_a_warning(unit, compilers, tmp_path):
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
        names = archive.namelist()
    assert {"modelDescription.xml", "sources/mumacro.h", "sources/instance.h"} < set(names)
    (source,) = (tmp_path / "sources").glob("*.c")
    for compiler in ("gcc", "clang"):
        if shutil.which(compiler):
            strict = ("-std=c99", "-O1", *compilers.STRICT, "-fsyntax-only")
            compilers.run(*compilers.compiler(compiler), *strict, source)


@pytest.mark.usefixtures("fmpy")
def test_fmpy_finds_no_fault(unit):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit)) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_a_simulation_follows_its_inputs(unit, fmpy, table, kind):
    time = np.linspace(0.0, 1.0, 41)
    v0 = 10.0 ** (-4.0 + 5.0 * time)
    given = np.array(list(zip(time, v0, strict=True)), dtype=[("time", float), ("v0", float)])
    outputs = ["mu_macro", "mu_ratio", "error_bound", "v_tilde", "y_tilde", "regime", "source"]
    found = fmpy.simulate_fmu(
        str(unit), fmi_type=kind, stop_time=1.0, output_interval=0.025, input=given, output=["v0", *outputs],
        start_values={"Fz": 20.0, "mu0": 0.2},
    )  # fmt: skip
    assert len(found) >= 41
    answer = table.evaluate({**CASE, "Fz": 20.0, "mu0": 0.2, "v0": found["v0"]}, groups=True)
    for name in outputs[:5]:
        expected = getattr(answer, name)
        assert np.allclose(found[name], expected, rtol=1e-6 if name == "error_bound" else 1e-13, atol=0.0), name
    assert np.array_equal(found["source"], answer.source_code)
    assert set(found["regime"]) == {0, 1}


def instance(fmpy, unit, folder, choices=None):
    """The unit, loaded and initialised with parameters, and its variables by name."""
    description = fmpy.read_model_description(str(unit))
    folder = fmpy.extract(str(unit), str(folder))
    made = fmpy.instantiate_fmu(folder, description, fmi_type="CoSimulation")
    if description.fmiVersion == "2.0":
        made.setupExperiment(startTime=0.0)
    at = {v.name: v.valueReference for v in description.modelVariables}
    for name, value in (choices or {}).items():
        (made.setInteger if description.fmiVersion == "2.0" else made.setInt64)([at[name]], [value])
    made.enterInitializationMode()
    made.exitInitializationMode()
    return made, at


def test_directional_derivatives_are_the_gradient(unit, fmpy, table, tmp_path):
    made, at = instance(fmpy, unit, tmp_path)
    put = made.setReal if hasattr(made, "setReal") else made.setFloat64
    for case in (CASE, {**CASE, "v0": 1.0}, {**CASE, "y0": 2e-5}):
        put([at[name] for name in FIELDS], list(case.values()))
        answer = table.evaluate(case, gradient=True)
        for name in FIELDS:
            slopes = made.getDirectionalDerivative([at["mu_macro"], at["mu_ratio"]], [at[name]], [1.0])
            of_ratio = (answer.gradient[name] - answer.mu_ratio * (name == "mu0")) / case["mu0"]
            assert slopes == close([answer.gradient[name], of_ratio], rel=1e-9)
        seeds = [1e-3 * value for value in case.values()]
        expected = sum(answer.gradient[name] * seed for name, seed in zip(FIELDS, seeds, strict=True))
        (along,) = made.getDirectionalDerivative([at["mu_macro"]], [at[name] for name in FIELDS], seeds)
        assert along == close(expected, rel=1e-9)
    if hasattr(made, "getAdjointDerivative"):
        adjoint = made.getAdjointDerivative([at["mu_macro"]], [at[name] for name in FIELDS], [2.0], len(FIELDS))
        assert adjoint == close([2.0 * answer.gradient[name] for name in FIELDS], rel=1e-9)
    made.terminate()
    made.freeInstance()


@pytest.mark.parametrize(
    ("contact", "direction"), [("ball", "across"), ("spring", "along"), ("ball", "along"), ("spring", "normal")]
)
def test_contacts_and_directions(unit, fmpy, table, tmp_path, contact, direction):
    kind = {"contact": CONTACTS.index(contact), "direction": DIRECTIONS.index(direction)}
    time = np.linspace(0.0, 1.0, 21)
    given = np.array(list(zip(time, 10.0 ** (-4.0 + 5.0 * time), strict=True)), dtype=[("time", float), ("v0", float)])
    found = fmpy.simulate_fmu(
        str(unit), fmi_type="CoSimulation", stop_time=1.0, output_interval=0.05, input=given,
        output=["v0", "mu_macro", "y_tilde", "source"], start_values={**kind, "Fz_amplitude": 4.0},
    )  # fmt: skip
    case = {name: value for name, value in CASE.items() if direction != "normal" or name != "y0"}
    case |= {"Fz_amplitude": 4.0} if direction == "normal" else {}
    answer = table.evaluate({**case, "v0": found["v0"]}, contact=contact, direction=direction, groups=True)
    assert np.allclose(found["mu_macro"], answer.mu_macro, rtol=1e-13, atol=0.0)
    assert np.allclose(found["y_tilde"], answer.y_tilde, rtol=1e-15, atol=0.0)
    assert np.array_equal(found["source"], answer.source_code)
    made, at = instance(fmpy, unit, tmp_path, kind)
    second = hasattr(made, "setReal")
    put, choose, chosen = (
        (made.setReal, made.setInteger, made.getInteger) if second else (made.setFloat64, made.setInt64, made.getInt64)
    )
    assert chosen([at[name] for name in kind]) == list(kind.values())
    put([at["Fz_amplitude"]], [4.0])
    exact = table.evaluate(case, contact=contact, direction=direction, gradient=True).gradient
    for name in (*FIELDS, "Fz_amplitude"):
        assert made.getDirectionalDerivative([at["mu_macro"]], [at[name]], [1.0]) == close(
            [exact.get(name, 0.0)], rel=1e-9
        )
    for name, wrong in (("contact", -1), ("contact", 2), ("direction", -1), ("direction", 3), ("source", 0)):
        with pytest.raises(Exception, match="status 3"):
            choose([at[name]], [wrong])
    choose([at["contact"], at["direction"]], [1, 2])
    with pytest.raises(Exception, match="status 2"):  # a ball whose normal force oscillates
        (made.getReal if second else made.getFloat64)([at["mu_macro"]])
    made.freeInstance()


def test_states_are_kept_and_illegal_inputs_are_discarded(unit, fmpy, table, tmp_path):
    made, at = instance(fmpy, unit, tmp_path)
    second = hasattr(made, "setReal")
    put, get = (made.setReal, made.getReal) if second else (made.setFloat64, made.getFloat64)
    save, restore, drop = (
        (made.getFMUstate, made.setFMUstate, made.freeFMUstate) if second
        else (made.getFMUState, made.setFMUState, made.freeFMUState)
    )  # fmt: skip
    expected = table.evaluate(CASE).mu_macro
    assert get([at["mu_macro"]]) == [close(expected, rel=1e-13)]
    kept = save()
    put([at["v0"]], [-1.0])
    with pytest.raises(Exception, match="status 2"):  # discard
        get([at["mu_macro"]])
    put([at["v0"]], [1.0])
    assert get([at["mu_macro"]]) != [close(expected, rel=1e-3)]
    restore(kept)
    drop(kept)
    assert get([at["mu_macro"], at["v0"]]) == [close(expected, rel=1e-13), 0.01]
    with pytest.raises(Exception, match="status 3"):  # no such variable
        get([99])
    made.reset()
    assert get([at["k"]]) == [1e6]
    made.freeInstance()


def test_another_units_token_is_refused(unit, fmpy, tmp_path):
    description = fmpy.read_model_description(str(unit))
    folder = fmpy.extract(str(unit), str(tmp_path))
    description.guid = description.instantiationToken = "another"
    with pytest.raises(Exception, match=r"(?i)instantiate"):
        fmpy.instantiate_fmu(folder, description, fmi_type="CoSimulation")


def test_zig_makes_linux_and_windows(table, tmp_path, compilers, repository):
    zig = compilers.compiler("zig cc")
    export_table(table.path, "fmu3", tmp_path / "both.fmu")
    with zipfile.ZipFile(tmp_path / "both.fmu") as archive:
        archive.extractall(tmp_path)
    binaries = tmp_path / "binaries"
    assert (binaries / "x86_64-linux" / "mumacro.so").read_bytes()[:4] == b"\x7fELF"
    library = binaries / "x86_64-windows" / "mumacro.dll"
    assert library.read_bytes()[:2] == b"MZ"
    wine = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")
    if wine is None:
        pytest.skip("wine64 is not installed: the DLL is there, and has not been loaded")
    source = repository / "tests" / "c" / "fmu_windows.c"
    compilers.run(*zig, "-target", "x86_64-windows-gnu", source, "-o", tmp_path / "load.exe")
    token = table.checksum
    environment = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"}
    done = subprocess.run(
        [wine, "load.exe", str(library.relative_to(tmp_path)), token], cwd=tmp_path, env=environment,
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    version, first, second = done.stdout.split()
    assert version == "3.0"
    assert float(first) == close(table.evaluate(CASE).mu_macro, rel=1e-13)
    assert float(second) == close(table.evaluate({**CASE, "v0": 1.0}).mu_macro, rel=1e-13)
