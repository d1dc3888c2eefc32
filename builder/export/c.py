"""Export with ``--format c``: the evaluation's own C sources and a table as C text, in one header
or in three files.

The functions are those of ``mumacro/kernel``, joined into one text; nothing is translated.  This
module needs no packages beyond those of the library.
"""

import re
from collections.abc import Iterable
from pathlib import Path

import mumacro
from mumacro import __version__
from mumacro.errors import MumacroError
from mumacro.kernel.arrays import Array
from mumacro.kernel.quadrature import driven_rule
from mumacro.table import atlas
from mumacro.table.atomic import write_whole
from mumacro.table.blocks import Table, TabulatedContact
from mumacro.table.polynomials import block_rows, border_cells, outer_cells, quantity_cells

#: tolerance of the table that is exported by default: a C program holds all of its numbers as text
DEFAULT_TOLERANCE = 1e-7
_KERNEL = Path(mumacro.__file__).parent / "kernel"
_BANNER = f"/* Written by mumacro {__version__}; do not edit.  {{}}. */\n"
_DECLARATION = """
#ifdef __cplusplus
extern "C" {
#endif
extern const mumacro_export mumacro_table;
#ifdef __cplusplus
}
#endif

"""
_STATIC = "#ifndef MUMACRO_API\n#define MUMACRO_API static inline\n#endif\n"
# Private names of the kernel get a prefix, because a program may have them, too.  Members of
# structs with such a name are public and keep it.
_PRIVATE = re.compile(r"\b(mu|MU)_(?!macro\b|ratio\b)(?=\w)")


class ExportError(MumacroError):
    """Report that a table cannot be exported, or not to this place.  The message has the reason,
    with the compiler's words if it failed."""


def header_text(table: Table) -> str:
    """Return everything in one header.  Its functions are static, so several files of a program may
    include it."""
    kernel = join_includes("kernel.c", set()) + table_text(table, "static ") + _file("interface.c")
    private = _PRIVATE.sub(lambda match: f"mumacro_{match[1]}_", kernel)
    banner = _BANNER.format("Declarations, the kernel, the table, the interface")
    guard = "#ifndef MUMACRO_WHOLE_H\n#define MUMACRO_WHOLE_H\n"
    return f"{banner}{guard}{_STATIC}{_file('mumacro.h')}\n{private}#endif\n"


def files(table: Table) -> dict[str, str]:
    """Return the texts of ``mumacro.h``, ``mumacro.c`` and ``mumacro_table.c``; the first two are
    the same for all tables."""
    file_names: set[str] = set()
    return {
        "mumacro.h": _BANNER.format("What mumacro.c defines") + _file("mumacro.h"),
        "mumacro.c": _BANNER.format("The evaluation")
        + '#include "mumacro.h"\n\n'
        + join_includes("kernel.c", file_names)
        + _DECLARATION
        + _file("interface.c"),
        "mumacro_table.c": _BANNER.format("The table")
        + join_includes("data.h", set())
        + _DECLARATION
        + table_text(table, ""),
    }


def write_c(table: Table, out: Path) -> list[Path]:
    """Write one header if ``out`` ends in ``.h``, otherwise three files into the folder ``out``;
    return the paths.

    Raises
    ------
    ExportError
        If ``out`` is neither a folder nor the name of a new one, or ends in ``.h`` and is a folder.
    OSError
        If it cannot be written.
    """
    if out.suffix == ".h":
        if out.is_dir():
            raise ExportError(
                f"{out} is a folder: name a folder without the suffix .h, or a header in it"
            )
        texts = {out: header_text(table)}
    else:
        if out.exists() and not out.is_dir():
            raise ExportError(
                f"{out} is a file: name a folder for three files, or a header that ends in .h"
            )
        out.mkdir(exist_ok=True)
        texts = {out / name: text for name, text in files(table).items()}
    for path, text in texts.items():
        write_whole(path, text.encode("ascii"))
    return list(texts)


def join_includes(name: str, file_names: set[str]) -> str:
    """Return a file of the kernel with the files that it includes, each once."""
    file_names.add(name)
    lines = []
    for line in _file(name).splitlines(keepends=True):
        match = re.fullmatch(r'#include "(.+)"\n', line)
        if match is None:
            lines.append(line)
        elif match[1] not in file_names:
            lines.append("\n" + join_includes(match[1], file_names))
    return "".join(lines)


def _file(name: str) -> str:
    return (_KERNEL / name).read_text("ascii")


# --- the table ------------------------------------------------------------------------------------


def table_text(table: Table, linkage: str) -> str:
    """Return the arrays of :class:`mumacro.kernel.binding.Data` as constants, and
    ``mumacro_table``."""
    border, pieces = border_cells(table.border)
    arrays: dict[str, Array] = {"border": border, "pieces": pieces, "outer": outer_cells()}
    arrays["rule_driven"] = driven_rule()
    contacts = [_contact_text(contact, table, arrays) for contact in table.contacts.values()]
    checksum, tolerance = table.attributes["content_sha256"], table.contacts["spring"].tolerance
    members = ",\n    ".join([*contacts, f'{tolerance!r}, "{checksum}", "{__version__}"'])
    definition = f"{linkage}const mumacro_export mumacro_table = {{\n    {members}}};\n\n"
    return (
        "".join(_array(f"mumacro_table_{name}", array) for name, array in arrays.items())
        + definition
    )


def _contact_text(contact: TabulatedContact, table: Table, arrays: dict[str, Array]) -> str:
    """Return the initializer of one contact's ``mumacro_data``, and add its arrays to
    ``arrays``."""
    blocks = f"{contact.name}_blocks"
    arrays[blocks] = block_rows(contact)
    rows = [f"{len(arrays['border'])}, {_names('', ('border', 'pieces', blocks, 'outer'))}"]
    quantities = []
    for code, name in enumerate(atlas.QUANTITY_NAMES):
        if name not in table.quantities:
            quantities.append("{0, 0, NULL, NULL, NULL}")
            continue
        polynomials, errors, cell_errors = quantity_cells(contact, code)
        # the stick fraction is zero in continuous sliding
        first = int(polynomials.any(axis=(1, 2)).argmax())
        parts = {
            "cells": polynomials[first:],
            "errors": errors,
            "cell_errors": cell_errors[first:],
        }
        prefix = f"{contact.name}_{name}_"
        arrays |= {f"{prefix}{part}": array for part, array in parts.items()}
        names = _names(prefix, parts)
        quantities.append(f"{{{first}, {len(polynomials) - first}, {names}}}")
    rows.append("{" + ",\n      ".join(quantities) + "}")
    rows.append(f"{{{len(arrays['rule_driven'])}, mumacro_table_rule_driven}}")
    return f"{{{f',{chr(10)}     '.join(rows)}}}"


def _names(prefix: str, parts: Iterable[str]) -> str:
    return ", ".join(f"mumacro_table_{prefix}{part}" for part in parts)


def _array(name: str, values: Array) -> str:
    """Return eight numbers on a line, each with the fewest digits that read back exactly."""
    rows = values.reshape(-1, 8 if values.size % 8 == 0 else values.shape[-1]).tolist()
    lines = (",".join(map(_number, row)) for row in rows)
    return f"static const double {name}[{values.size}] = {{\n{f',{chr(10)}'.join(lines)}}};\n\n"


def _number(value: float) -> str:
    if value == int(value) and abs(value) < 1e6:
        return str(int(value)) if value else "0"
    mantissa, _, exponent = repr(value).partition("e")
    return mantissa.removesuffix(".0") + (f"e{int(exponent)}" if exponent else "")
