"""``--format fmu`` and ``fmu3``: FMPy validates and simulates them, with Python's values and
derivatives."""

import math
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.export.fmu.model import STARTS
from builder.export.grid import export_table
from mumacro import Surrogate
from mumacro.inputs.fields import CONTACTS, DIRECTIONS, FIELDS, INPUTS
from tests.support import compilers
from tests.support.cases import CASE, PAIRS, as_kind, tables
from tests.support.comparing import close

pytestmark = pytest.mark.slow

table = tables(1e-4)


@pytest.fixture(scope="module", params=["fmu", "fmu3"])
def unit(
    request: pytest.FixtureRequest, table: Surrogate, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    path = tmp_path_factory.mktemp("fmu") / f"{request.param}.fmu"
    export_table(table.path, request.param, path)
    return path


@pytest.fixture
def fmpy() -> Any:
    """FMPy, and a compiler that has built the unit's binary."""
    compilers.compiler("gcc")
    pytest.importorskip("fmpy.validation", reason="fmpy of requirements/peers.txt is not installed")
    import fmpy

    return fmpy


def test_the_sources_compile_without_a_warning(unit: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
        names = archive.namelist()
    assert {"modelDescription.xml", "sources/mumacro.h", "sources/instance.h"} < set(names)
    text = (tmp_path / "modelDescription.xml").read_text("utf-8")
    for name in STARTS:
        assert f'description="{INPUTS[name].meaning}' in text
    (source,) = (tmp_path / "sources").glob("*.c")
    for compiler in ("gcc", "clang"):
        if shutil.which(compiler):
            strict = ("-std=c99", "-O1", *compilers.STRICT, "-fsyntax-only")
            compilers.run(*compilers.compiler(compiler), *strict, source)


@pytest.mark.usefixtures("fmpy")
def test_fmpy_finds_no_fault(unit: Path) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit)) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_a_simulation_follows_its_inputs(
    unit: Path, fmpy: Any, table: Surrogate, kind: Any
) -> None:
    time = np.linspace(0.0, 1.0, 41)
    v0 = 10.0 ** (-4.0 + 5.0 * time)
    inputs = np.array(list(zip(time, v0, strict=True)), dtype=[("time", float), ("v0", float)])
    outputs = ["mu_macro", "mu_ratio", "error_bound", "v_tilde", "y_tilde", "regime", "source"]
    simulated = fmpy.simulate_fmu(
        str(unit),
        fmi_type=kind,
        stop_time=1.0,
        output_interval=0.025,
        input=inputs,
        output=["v0", *outputs],
        start_values={"Fz": 20.0, "mu0": 0.2},
    )
    assert len(simulated) >= 41
    answer = table.evaluate(
        {**CASE, "Fz": 20.0, "mu0": 0.2, "v0": simulated["v0"]}, include="groups"
    )
    for name in outputs[:5]:
        expected = getattr(answer, name)
        assert np.allclose(
            simulated[name], expected, rtol=1e-6 if name == "error_bound" else 1e-13, atol=0.0
        ), name
    assert np.array_equal(simulated["source"], answer.source_code)
    assert set(simulated["regime"]) == {0, 1}


class Loaded:
    """A unit of either standard, loaded and initialised with parameters; variables by name."""

    def __init__(self, fmpy: Any, path: Path, folder: Path, **parameters: Any) -> None:
        description = fmpy.read_model_description(str(path))
        self.unit = unit = fmpy.instantiate_fmu(
            fmpy.extract(str(path), str(folder)), description, fmi_type="CoSimulation"
        )
        self.at = {
            variable.name: variable.valueReference for variable in description.modelVariables
        }
        self.outputs = [self.at[output.variable.name] for output in description.outputs]
        if description.fmiVersion == "2.0":
            unit.setupExperiment(startTime=0.0)
            self._set, self._get = (unit.setReal, unit.setInteger), (unit.getReal, unit.getInteger)
            self.save, self.restore, self.drop = (
                unit.getFMUstate,
                unit.setFMUstate,
                unit.freeFMUstate,
            )
        else:
            self._set, self._get = (
                (unit.setFloat64, unit.setInt64),
                (unit.getFloat64, unit.getInt64),
            )
            self.save, self.restore, self.drop = (
                unit.getFMUState,
                unit.setFMUState,
                unit.freeFMUState,
            )
        for name, value in parameters.items():
            self.put(**{name: value})
        unit.enterInitializationMode()
        unit.exitInitializationMode()

    def put(self, **values: Any) -> None:
        """Set numbers, or with whole ones enumerations."""
        for name, value in values.items():
            self._set[isinstance(value, int)]([self.at[name]], [value])

    def get(self, *names: Any, whole: bool = False) -> Any:
        """Numbers, or the values of enumerations."""
        return self._get[whole]([self.at[name] for name in names])

    def slope(self, output: Any, **seeds: Any) -> Any:
        """The derivative of an output along a direction of the inputs."""
        fixed = [self.at[name] for name in seeds]
        return self.unit.getDirectionalDerivative([self.at[output]], fixed, list(seeds.values()))[0]


def test_directional_derivatives_are_the_gradient(
    unit: Path, fmpy: Any, table: Surrogate, tmp_path: Path
) -> None:
    model = Loaded(fmpy, unit, tmp_path)
    assert model.outputs == [model.at[name] for name in ("mu_macro", "mu_ratio", "force")]
    for case in (CASE, {**CASE, "v0": 1.0}, {**CASE, "y0": 2e-5}, {**CASE, "v0": -0.01}):
        model.put(**case)
        answer = table.evaluate({**case, "v0": abs(case["v0"])}, gradient=True)
        sign = math.copysign(1.0, case["v0"])
        assert model.get("force") == [close(sign * answer.mu_macro * case["Fz"], rel=1e-13)]
        signs = {name: sign if name == "v0" else 1.0 for name in FIELDS}
        gradient = {name: answer.gradient[name] * signs[name] for name in FIELDS}
        for name in FIELDS:
            of_ratio = (gradient[name] - answer.mu_ratio * (name == "mu0")) / case["mu0"]
            of_force = sign * (gradient[name] * case["Fz"] + answer.mu_macro * (name == "Fz"))
            result = [
                model.slope(output, **{name: 1.0}) for output in ("mu_macro", "mu_ratio", "force")
            ]
            assert result == close([gradient[name], of_ratio, of_force], rel=1e-9)
        seeds = {name: 1e-3 * value for name, value in case.items()}
        expected = sum(gradient[name] * seed for name, seed in seeds.items())
        assert model.slope("mu_macro", **seeds) == close(expected, rel=1e-9)
        if hasattr(model.unit, "getAdjointDerivative"):
            fixed = [model.at[name] for name in FIELDS]
            adjoint = model.unit.getAdjointDerivative(
                [model.at["mu_macro"]], fixed, [2.0], len(FIELDS)
            )
            assert adjoint == close([2.0 * slope for slope in gradient.values()], rel=1e-9)


@pytest.mark.parametrize("pair", PAIRS[1:], ids=" ".join)
def test_other_contacts(unit: Path, fmpy: Any, table: Surrogate, tmp_path: Path, pair: Any) -> None:
    kind = {"contact": CONTACTS.index(pair[0]), "direction": DIRECTIONS.index(pair[1])}
    words, fields, _ = as_kind(CASE, pair)
    case = {name: {**CASE, "Fz_amplitude": 4.0}[name] for name in fields}
    model = Loaded(fmpy, unit, tmp_path, **kind)
    model.put(Fz_amplitude=4.0)
    assert model.get(*kind, whole=True) == list(kind.values())
    for v0 in 10.0 ** np.linspace(-4.0, 1.0, 21):
        model.put(v0=v0)
        answer = table.evaluate({**case, "v0": v0}, **words, include="groups")
        expected = [answer.mu_macro, answer.y_tilde, answer.mu_macro * CASE["Fz"]]
        assert model.get("mu_macro", "y_tilde", "force") == close(expected, rel=1e-13)
    model.put(v0=CASE["v0"])
    exact = table.evaluate(case, **words, gradient=True).gradient
    for name in (*FIELDS, "Fz_amplitude"):
        assert model.slope("mu_macro", **{name: 1.0}) == close(exact.get(name, 0.0), rel=1e-9)
    for name, wrong in (
        ("contact", -1),
        ("contact", 2),
        ("direction", -1),
        ("direction", 3),
        ("source", 0),
    ):
        with pytest.raises(Exception, match="status 3"):
            model.put(**{name: wrong})
    model.put(contact=1, direction=2)
    with pytest.raises(Exception, match="status 2"):  # a ball whose normal force oscillates
        model.get("mu_macro")


@pytest.mark.parametrize("kind", [{}, {"contact": 1}, {"direction": 1}, {"direction": 2}])
def test_the_force_passes_through_zero_with_its_derivatives(
    unit: Path, fmpy: Any, tmp_path: Path, kind: Any
) -> None:
    model = Loaded(fmpy, unit, tmp_path, **kind, v_rest=1e-3)
    model.put(Fz_amplitude=4.0)

    def force(**moved: Any) -> Any:
        model.put(**moved)
        return model.get("force")[0]

    assert (force(v0=0.0), force(v0=-4e-4)) == (0.0, -force(v0=4e-4))
    assert (
        0.0
        < force(v0=4e-4)
        < force(v0=9e-4)
        < force(v0=1e-3)
        == CASE["Fz"] * model.get("mu_macro")[0]
    )
    for case in ({**CASE, "v0": 4e-4}, {**CASE, "v0": -9e-4}, {**CASE, "v0": 0.0}):
        model.put(**case)
        slopes = {name: model.slope("force", **{name: 1.0}) for name in FIELDS}
        for name, value in case.items():
            step = 1e-5 * (value or 1e-3)
            difference = (force(**{name: value + step}) - force(**{name: value - step})) / (
                2.0 * step
            )
            model.put(**{name: value})
            assert slopes[name] == close(
                difference, rel=2e-4, abs=1e-5 * abs(force()) / (abs(value) + 1e-3)
            ), name
    for wrong in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(Exception, match="status 3"):
            model.put(v_rest=wrong)
    assert model.get("v_rest") == [1e-3]


def test_states_are_kept_and_illegal_inputs_discarded(
    unit: Path, fmpy: Any, table: Surrogate, tmp_path: Path
) -> None:
    model = Loaded(fmpy, unit, tmp_path)
    expected = table.evaluate(CASE).mu_macro
    assert model.get("mu_macro") == [close(expected, rel=1e-13)]
    state = model.save()
    model.put(y0=-1.0)
    for output in ("mu_macro", "force"):
        with pytest.raises(Exception, match="status 2"):  # discard
            model.get(output)
    model.put(y0=CASE["y0"], v0=1.0)
    assert model.get("mu_macro") != [close(expected, rel=1e-3)]
    model.restore(state)
    model.drop(state)
    assert model.get("mu_macro", "v0") == [close(expected, rel=1e-13), 0.01]
    model.at["nothing"] = 99
    with pytest.raises(Exception, match="status 3"):
        model.get("nothing")
    model.unit.reset()
    assert model.get("k", "v_rest") == [1e6, 1e-4]


def test_another_units_token_is_told(unit: Path, fmpy: Any, tmp_path: Path) -> None:
    description = fmpy.read_model_description(str(unit))
    folder = fmpy.extract(str(unit), str(tmp_path))
    description.guid = description.instantiationToken = "another"
    with pytest.raises(Exception, match=r"(?i)instantiate"):
        fmpy.instantiate_fmu(folder, description, fmi_type="CoSimulation")


def test_zig_makes_linux_and_windows(table: Surrogate, tmp_path: Path) -> None:
    compilers.compiler("zig cc")
    export_table(table.path, "fmu3", tmp_path / "both.fmu")
    with zipfile.ZipFile(tmp_path / "both.fmu") as archive:
        archive.extractall(tmp_path)
    binaries = tmp_path / "binaries"
    assert (binaries / "x86_64-linux" / "mumacro.so").read_bytes()[:4] == b"\x7fELF"
    assert (binaries / "x86_64-windows" / "mumacro.dll").read_bytes()[:2] == b"MZ"
