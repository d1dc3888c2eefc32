"""Export with ``--format fmu``: a table as a Functional Mock-up Unit, FMI 2.0 or 3.0, made from the
C header, without Python.

Inputs are mu0, Fz, k, y0, omega, v0 and Fz_amplitude; outputs mu_macro, mu_ratio and force, the
friction force along v0 that is regularised below the parameter v_rest, with directional derivatives
by all inputs; beside them error_bound, v_tilde, y_tilde, regime and source.  v0 may be negative:
all but the force are those of its absolute value.  The parameters contact and direction are
enumerations, in the order of :data:`mumacro.inputs.fields.CONTACTS` and ``DIRECTIONS``;
Fz_amplitude counts for direction normal alone, y0 for the others.  Model Exchange and
Co-Simulation.  An illegal input makes a simulator's call return "discard", with the reason in its
log.

The unit contains its sources, the binary of the machine on which it is made, and, if zig is
installed, binaries of Linux and Windows for 64-bit Intel and AMD. Without a compiler it contains
only the sources.
"""

import importlib.util
import io
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

from mumacro import __version__
from mumacro.inputs.fields import AMPLITUDE, CONTACTS, DIRECTIONS, INPUTS
from mumacro.inputs.units import unit_of
from mumacro.table import atlas
from mumacro.table.blocks import Table

from ..c import ExportError, header_text

_HERE = Path(__file__).parent
STARTS = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01, AMPLITUDE: 0.0}
REST = 1e-4  # v_rest at the start [m/s]
OPTIONS = ("-O2", "-std=c99", "-fPIC", "-shared", "-fvisibility=hidden")
_TEXTS = {
    **{name: INPUTS[name].meaning for name in STARTS},
    "k": f"{INPUTS['k'].meaning}; infinite: rigid contact",
    "v0": f"{INPUTS['v0'].meaning}; all but force are those of its absolute value",
    "mu_macro": "macroscopic friction coefficient",
    "mu_ratio": "mu_macro / mu0",
    "error_bound": "bound of the absolute error of mu_macro",
    "v_tilde": "v0 k / (mu0 Fz omega)",
    "y_tilde": "y0 k / (mu0 Fz); normal: Fz_amplitude / Fz",
    "regime": ", ".join(f"{i}: {name}" for i, name in enumerate(atlas.REGIMES)),
    "source": ", ".join(f"{i}: {name}" for i, name in enumerate(atlas.SOURCES)),
    "contact": "one spring, or a ball on a flat: k is that before slip",
    "direction": "of the oscillation: across the sliding direction, along it, or of the normal "
    "force (not of a ball)",
    "force": "friction force along v0, mu_macro Fz from v_rest on",
    "v_rest": "speed below which force is regularised",
}
_MEASURED = (*STARTS, "force", "v_rest")  # these have units
_OUTPUTS, _INTEGERS = ("mu_macro", "mu_ratio", "force"), ("regime", "source")
_CHOICES: dict[str, tuple[str, ...]] = {"contact": CONTACTS, "direction": DIRECTIONS}
_UNITS = """<UnitDefinitions>
<Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
<Unit name="N/m"><BaseUnit kg="1" s="-2"/></Unit>
<Unit name="m"><BaseUnit m="1"/></Unit><Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>
<Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
</UnitDefinitions>"""
_BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="mumacro">
<SourceFileSet language="C99"><SourceFile name="fmu3.c"/></SourceFileSet>
</BuildConfiguration></fmiBuildDescription>
"""


def fmu2(table: Table) -> bytes:
    """Return an FMU of FMI 2.0."""
    return _unit(table, 2)


def fmu3(table: Table) -> bytes:
    """Return an FMU of FMI 3.0."""
    return _unit(table, 3)


def _unit(table: Table, version: int) -> bytes:
    starts = ", ".join(map(repr, STARTS.values()))
    sources = {
        name: (_HERE / name).read_text("ascii") for name in ("instance.h", f"fmu{version}.c")
    }
    macros = f"#define MUMACRO_FMU_STARTS {{{starts}}}\n#define MUMACRO_FMU_REST {REST!r}\n"
    sources["instance.h"] = macros + sources["instance.h"]
    sources["mumacro.h"] = header_text(table)
    description = _description(version, str(table.attributes["content_sha256"]))
    files: dict[str, str | bytes] = {"modelDescription.xml": description}
    files |= {f"sources/{name}": text for name, text in sources.items()}
    if version == 3:
        files["sources/buildDescription.xml"] = _BUILD
    binaries: dict[str, str | bytes] = {}
    for path, command in _targets(version):
        if f"binaries/{path}" not in binaries:
            library = [] if path.endswith(".dll") else ["-lm"]
            binaries[f"binaries/{path}"] = _compile(
                sources, [*command, *OPTIONS, f"fmu{version}.c", *library]
            )
    if not binaries:
        print(
            "mumacro: no C compiler is installed: the FMU has sources and no binary",
            file=sys.stderr,
        )
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in (files | binaries).items():
            entry = zipfile.ZipInfo(name)  # year 1980, so that the same table gives the same bytes
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, content)
    return out.getvalue()


def _targets(version: int) -> Iterator[tuple[str, list[str]]]:
    """Yield files below ``binaries`` and the commands that make them. zig comes first, because it
    links to an old C library."""
    folders = {
        "x86_64-linux": "linux64",
        "x86_64-windows": "win64",
        "x86_64-darwin": "darwin64",
    }

    def library_path(target: str) -> str:
        suffix = {"windows": ".dll", "darwin": ".dylib"}.get(target.partition("-")[2], ".so")
        return f"{folders.get(target, target) if version == 2 else target}/mumacro{suffix}"

    for target, zig_target in (
        ("x86_64-linux", "x86_64-linux-gnu.2.17"),
        ("x86_64-windows", "x86_64-windows-gnu"),
    ):
        if command := _zig(zig_target):
            yield library_path(target), [*command, "-s"]
    processor = {"arm64": "aarch64"}.get(platform.machine(), platform.machine())
    compiler = next((path for path in map(shutil.which, ("gcc", "clang", "cc")) if path), None)
    if compiler and platform.system() in ("Linux", "Darwin") and processor in ("x86_64", "aarch64"):
        yield library_path(f"{processor}-{platform.system().lower()}"), [compiler]


def _zig(target: str) -> list[str] | None:
    """Return the command that compiles for a target of zig, or None if the package ziglang is not
    installed."""
    package = importlib.util.find_spec("ziglang")
    return [sys.executable, "-m", "ziglang", "cc", "-target", target] if package else None


def _compile(texts: dict[str, str], command: list[str]) -> bytes:
    """Return the output of ``command``, run in a folder that holds ``texts`` by name."""
    with tempfile.TemporaryDirectory(prefix="mumacro-") as folder:
        for name, text in texts.items():
            Path(folder, name).write_text(text, "ascii")
        # the complete path of the folder, because zig's cache would take two files "./mumacro.h"
        # for one
        arguments = [*command, f"-I{folder}", "-o", "made"]
        process = subprocess.run(  # noqa: S603
            arguments, cwd=folder, capture_output=True, text=True, check=False
        )
        if process.returncode != 0:
            raise ExportError(f"{' '.join(arguments)}: {process.stderr.strip()[-2000:]}")
        return Path(folder, "made").read_bytes()


def _description(version: int, token: str) -> str:
    """Return modelDescription.xml."""
    fmi2, numbers = version == 2, {name: number for number, name in enumerate(_TEXTS, 1)}
    token_name, state_flag, derivatives_flag = (
        ("guid", "canGetAndSetFMUstate", "providesDirectionalDerivative")
        if fmi2
        else ("instantiationToken", "canGetAndSetFMUState", "providesDirectionalDerivatives")
    )
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="{version}.0" modelName="mumacro" {token_name}="{token}"'
        ' description="Macroscopic friction of a contact that is oscillated"'
        f' version="{__version__}" license="Apache-2.0" generationTool="mumacro {__version__}"'
        f' variableNamingConvention="flat"'
        f"{' numberOfEventIndicators=' + quoteattr('0') if fmi2 else ''}>",
    ]
    for interface, extra in (
        ("ModelExchange", ""),
        ("CoSimulation", ' canHandleVariableCommunicationStepSize="true"'),
    ):
        source_files = '<SourceFiles><File name="fmu2.c"/></SourceFiles>' if fmi2 else ""
        lines.append(
            f'<{interface} modelIdentifier="mumacro" {state_flag}="true" '
            f'{derivatives_flag}="true"{extra}>{source_files}</{interface}>'
        )
    lines += [
        _UNITS,
        "<TypeDefinitions>",
        *(_type(fmi2, name) for name in _CHOICES),
        "</TypeDefinitions>",
    ]
    lines += ['<DefaultExperiment startTime="0" stopTime="1"/>', "<ModelVariables>"]
    if not fmi2:
        lines.append(
            '<Float64 name="time" valueReference="0" causality="independent" '
            'variability="continuous"/>'
        )
    lines += [_variable(fmi2, *item) for item in numbers.items()]
    lines += ["</ModelVariables>", "<ModelStructure>"]
    dependencies = " ".join(str(numbers[name]) for name in STARTS)
    for group in ("Output", "InitialUnknown"):
        name, index = ("Unknown", "index") if fmi2 else (group, "valueReference")
        rows = [
            f'<{name} {index}="{numbers[output]}" dependencies="{dependencies}"/>'
            for output in _OUTPUTS
        ]
        lines += [f"<{group}s>", *rows, f"</{group}s>"] if fmi2 else rows
    return "\n".join([*lines, "</ModelStructure>", "</fmiModelDescription>", ""])


def _type(fmi2: bool, name: str) -> str:
    """Return the enumeration of a parameter."""
    items = "".join(f'<Item name="{item}" value="{i}"/>' for i, item in enumerate(_CHOICES[name]))
    if fmi2:
        return f'<SimpleType name="{name}"><Enumeration>{items}</Enumeration></SimpleType>'
    return f'<EnumerationType name="{name}">{items}</EnumerationType>'


def _variable(fmi2: bool, name: str, reference: int) -> str:
    parameter = name in _CHOICES or name == "v_rest"
    causality = (
        "input"
        if name in STARTS
        else "output"
        if name in _OUTPUTS
        else "parameter"
        if parameter
        else "local"
    )
    variability = "discrete" if name in _INTEGERS else "fixed" if parameter else "continuous"
    value_type = "Enumeration" if name in _CHOICES else "Real" if fmi2 else "Float64"
    if name in _INTEGERS:
        value_type = "Integer" if fmi2 else "Int32"
    attributes = (
        f'name="{name}" valueReference="{reference}" description={quoteattr(_TEXTS[name])} '
        f'causality="{causality}" variability="{variability}"'
    )
    unit = unit_of({"force": "Fz", "v_rest": "v0"}.get(name, name)) if name in _MEASURED else "-"
    value = "" if unit == "-" else f' unit="{unit}"'
    if name in STARTS:
        value += f' start="{STARTS[name]!r}"' + (' min="0"' if name != "v0" else "")
    elif name == "v_rest":
        value += f' start="{REST!r}" min="0"'
    elif name in _CHOICES:
        value = f' declaredType="{name}" start="0"'
    else:
        attributes += ' initial="calculated"'
    if fmi2:
        return f"<ScalarVariable {attributes}><{value_type}{value}/></ScalarVariable>"
    return f"<{value_type} {attributes}{value}/>"
