"""``--format fmu``: a table as a Functional Mock-up Unit, FMI 2.0 or 3.0, made of the C header; no Python inside.

Inputs are mu0, Fz, k, y0, omega, v0; outputs mu_macro and mu_ratio with directional derivatives by all inputs; beside
them error_bound, v_tilde, y_tilde, regime and source.  Model Exchange and Co-Simulation.  An illegal input makes a
simulator's call return "discard", with the reason in its log.

The unit holds its sources, the binary of the machine it is made on, and where zig is installed those of Linux and
Windows for 64-bit Intel and AMD; without any compiler the sources alone.
"""

from __future__ import annotations

import importlib.util
import io
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO
from xml.etree import ElementTree as Xml

from mumacro import charts
from mumacro.errors import MumacroError
from mumacro.inputs import FIELDS, UNITS
from mumacro.table import Table
from mumacro.version import __version__

from ..source import header_text

__all__ = ["CompilerError", "write_fmu2", "write_fmu3"]

_HERE = Path(__file__).parent
NAME = "mumacro"
STARTS = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
OPTIONS = ("-O2", "-std=c99", "-fPIC", "-shared", "-fvisibility=hidden")
_TEXTS = {
    "mu0": "Coulomb friction coefficient", "Fz": "normal force", "k": "tangential stiffness; infinite: rigid contact",
    "y0": "amplitude of the transverse oscillation", "omega": "angular frequency of the oscillation",
    "v0": "sliding speed",
}  # fmt: skip
_OUTPUTS = {"mu_macro": "macroscopic friction coefficient", "mu_ratio": "mu_macro / mu0"}
_OTHERS = {
    "error_bound": "bound of the absolute error of mu_macro", "v_tilde": "v0 k / (mu0 Fz omega)",
    "y_tilde": "y0 k / (mu0 Fz)", "regime": ", ".join(f"{i}: {name}" for i, name in enumerate(charts.REGIMES)),
    "source": ", ".join(f"{i}: {name}" for i, name in enumerate(charts.SOURCES)),
}  # fmt: skip
_WHOLE = ("regime", "source")
#: unit -> exponents of SI base units
_UNITS: dict[str, dict[str, int]] = {
    "N": {"kg": 1, "m": 1, "s": -2}, "N/m": {"kg": 1, "s": -2}, "m": {"m": 1}, "rad/s": {"s": -1, "rad": 1},
    "m/s": {"m": 1, "s": -1},
}  # fmt: skip


class CompilerError(MumacroError):
    """The C compiler refuses the unit's sources; the text is its message."""


def write_fmu2(table: Table, out: BinaryIO) -> None:
    """Write an FMU of FMI 2.0."""
    _write(table, out, 2)


def write_fmu3(table: Table, out: BinaryIO) -> None:
    """Write an FMU of FMI 3.0."""
    _write(table, out, 3)


def _write(table: Table, out: BinaryIO, version: int) -> None:
    starts = ", ".join(repr(STARTS[name]) for name in FIELDS)
    sources = {
        "mumacro.h": header_text(table),
        "instance.h": f"#define MUMACRO_FMU_STARTS {{{starts}}}\n" + (_HERE / "instance.h").read_text("ascii"),
        f"fmu{version}.c": (_HERE / f"fmu{version}.c").read_text("ascii"),
    }
    token = str(table.attributes["content_sha256"])
    files: dict[str, bytes] = {"modelDescription.xml": _bytes(_description(version, token))}
    files |= {f"sources/{name}": text.encode("ascii") for name, text in sources.items()}
    if version == 3:
        files["sources/buildDescription.xml"] = _bytes(_build_description())
    files |= _binaries(sources, version)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name)  # 1980: the same table gives the same bytes
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, content)


# --- binaries -------------------------------------------------------------------------------------------


def _binaries(sources: dict[str, str], version: int) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory(prefix="mumacro-") as name:
        folder = Path(name)
        for source, text in sources.items():
            (folder / source).write_text(text, "ascii")
        for (two, three), suffix, command in _targets():
            place = f"binaries/{two if version == 2 else three}/{NAME}{suffix}"
            if place not in found:
                made = folder / f"{three}{suffix}"
                words = [*command, *OPTIONS, f"fmu{version}.c", "-o", made.name, *(["-lm"] if suffix != ".dll" else [])]
                done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
                if done.returncode != 0:
                    raise CompilerError(f"{' '.join(words)}: {done.stderr.strip()[-2000:]}")
                found[place] = made.read_bytes()
    if not found:
        print("mumacro: no C compiler is installed: the FMU has sources and no binary", file=sys.stderr)
    return found


def _targets() -> Iterable[tuple[tuple[str, str], str, list[str]]]:
    """Platform names of FMI 2.0 and 3.0, suffix, command; zig first, which binds to an old C library."""
    if importlib.util.find_spec("ziglang") is not None:
        zig = [sys.executable, "-m", "ziglang", "cc", "-s", "-target"]
        yield ("linux64", "x86_64-linux"), ".so", [*zig, "x86_64-linux-gnu.2.17"]
        yield ("win64", "x86_64-windows"), ".dll", [*zig, "x86_64-windows-gnu"]
    here = {
        ("Linux", "x86_64"): (("linux64", "x86_64-linux"), ".so"),
        ("Linux", "aarch64"): (("aarch64-linux", "aarch64-linux"), ".so"),
        ("Darwin", "x86_64"): (("darwin64", "x86_64-darwin"), ".dylib"),
        ("Darwin", "arm64"): (("aarch64-darwin", "aarch64-darwin"), ".dylib"),
    }.get((platform.system(), platform.machine()))
    compiler = next((path for path in map(shutil.which, ("gcc", "clang", "cc")) if path), None)
    if here is not None and compiler is not None:
        yield *here, [compiler]


# --- descriptions ---------------------------------------------------------------------------------------


def _bytes(root: Any) -> bytes:
    Xml.indent(root)
    buffer = io.BytesIO()
    Xml.ElementTree(root).write(buffer, encoding="UTF-8", xml_declaration=True)
    return buffer.getvalue()


def _description(version: int, token: str) -> Any:
    """modelDescription.xml."""
    second = version == 2
    root = Xml.Element("fmiModelDescription", {
        "fmiVersion": f"{version}.0", "modelName": NAME, "guid" if second else "instantiationToken": token,
        "description": "Macroscopic friction of a contact that is oscillated transversely to its sliding direction",
        "version": __version__, "license": "Apache-2.0", "generationTool": f"mumacro {__version__}",
        "variableNamingConvention": "flat", **({"numberOfEventIndicators": "0"} if second else {}),
    })  # fmt: skip
    state = "canGetAndSetFMUstate" if second else "canGetAndSetFMUState"
    serial = "canSerializeFMUstate" if second else "canSerializeFMUState"
    able = {
        "modelIdentifier": NAME, state: "true", serial: "true",
        "providesDirectionalDerivative" if second else "providesDirectionalDerivatives": "true",
    }  # fmt: skip
    if not second:
        able["providesAdjointDerivatives"] = "true"
    for kind in ("ModelExchange", "CoSimulation"):
        extra = {"canHandleVariableCommunicationStepSize": "true"} if kind == "CoSimulation" else {}
        element = Xml.SubElement(root, kind, {**able, **extra})
        if second:
            Xml.SubElement(Xml.SubElement(element, "SourceFiles"), "File", name="fmu2.c")
    units = Xml.SubElement(root, "UnitDefinitions")
    for unit, base in _UNITS.items():
        exponents = {name: str(power) for name, power in base.items()}
        Xml.SubElement(Xml.SubElement(units, "Unit", name=unit), "BaseUnit", exponents)
    Xml.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1")
    variables = Xml.SubElement(root, "ModelVariables")
    if not second:
        Xml.SubElement(variables, "Float64", name="time", valueReference="0", causality="independent",
                       variability="continuous")  # fmt: skip
    for reference, (name, text) in enumerate((_TEXTS | _OUTPUTS | _OTHERS).items(), 1):
        _variable(variables, version, name, str(reference), text)
    structure = Xml.SubElement(root, "ModelStructure")
    first = len(_TEXTS) + 1
    known = " ".join(str(i) for i in range(1, first))
    if second:
        for group in ("Outputs", "InitialUnknowns"):
            element = Xml.SubElement(structure, group)
            for i in range(first, first + len(_OUTPUTS)):
                Xml.SubElement(element, "Unknown", index=str(i), dependencies=known)
    else:
        for group in ("Output", "InitialUnknown"):
            for i in range(first, first + len(_OUTPUTS)):
                Xml.SubElement(structure, group, valueReference=str(i), dependencies=known)
    return root


def _variable(parent: Any, version: int, name: str, reference: str, text: str) -> None:
    given = name in _TEXTS
    about = {
        "name": name, "valueReference": reference, "description": text,
        "causality": "input" if given else "output" if name in _OUTPUTS else "local",
        "variability": "discrete" if name in _WHOLE else "continuous",
    }  # fmt: skip
    if not given:
        about["initial"] = "calculated"
    unit = UNITS.get(name, "-")
    value = {} if unit == "-" else {"unit": unit}
    if given:
        value |= {"start": repr(STARTS[name]), "min": "0"}
    if version == 2:
        variable = Xml.SubElement(parent, "ScalarVariable", about)
        Xml.SubElement(variable, "Integer" if name in _WHOLE else "Real", value)
    else:
        Xml.SubElement(parent, "Int32" if name in _WHOLE else "Float64", {**about, **value})


def _build_description() -> Any:
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=NAME)
    files = Xml.SubElement(configuration, "SourceFileSet", language="C99")
    Xml.SubElement(files, "SourceFile", name="fmu3.c")
    return root
