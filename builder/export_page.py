"""Writes the page as a folder for any static host: it computes in the browser, from a table compiled to WebAssembly.

    python -m builder export tables/mumacro-1e-7.nc --format wasm --out mumacro.wasm
    python -m builder.export_page tables/mumacro-1e-7.nc mumacro.wasm FOLDER

It is the page of the service with another ``service.js``.  It hides the functions that need the service, and says so.
"""

import html
import json
import shutil
import sys
from pathlib import Path
from typing import Any

from mumacro import MumacroError, Surrogate
from mumacro.page import POLICY, map_of, names

from .c.source import ExportError

# the files of the service, as data: this package does not import it
_FOLDER = Path(__file__).resolve().parent.parent / "service" / "static" / "page"
_POLICY = POLICY.replace("script-src 'self'", "script-src 'self' 'wasm-unsafe-eval'").replace(
    "; frame-ancestors 'none'", ""
)  # browsers ignore frame-ancestors in a meta element


def write_page(table: Path, wasm: Path, out: Path) -> Surrogate:
    """Write the folder ``out`` from a table and the module that was exported from it; what is in it is replaced.

    Raises
    ------
    ExportError
        The module was exported from another table.
    TableError, OSError
        The table cannot be read; a file cannot be read or written.
    """
    surrogate, module = Surrogate.open(table), wasm.read_bytes()
    if surrogate.checksum.encode() not in module:
        raise ExportError(f"{wasm} was not exported from {table}")
    parts = out / "static" / "page"
    parts.mkdir(parents=True, exist_ok=True)
    for path in _FOLDER.glob("*.*s"):  # scripts and styles
        shutil.copyfile(path, parts / path.name)
    shutil.copyfile(_FOLDER.parent / "alone" / "service.js", parts / "service.js")
    made = {"mumacro.wasm": module, "names.json": _json(names()), "map.json": _json(map_of(surrogate))}
    for name, content in made.items():
        (parts / name).write_bytes(content)
    text = (_FOLDER / "index.html").read_text("utf-8")
    for place, new in (
        ("<title>", f'<meta http-equiv="Content-Security-Policy" content="{html.escape(_POLICY)}">\n<title>'),
        ("</header>", f'<p id="alone" class="notice">{_about(surrogate)}</p>\n</header>'),
    ):
        before, after = text.split(place)  # occurs once
        text = before + new + after
    (out / "index.html").write_text(text, "utf-8")
    return surrogate


def _json(content: Any) -> bytes:
    return json.dumps(content, separators=(",", ":")).encode()


def _about(surrogate: Surrogate) -> str:
    name = html.escape(f"{surrogate.id}, tolerance {surrogate.tolerance:g}, checksum {surrogate.checksum[:12]}")
    return (
        f"Everything here is computed in this browser, from the table {name}, without a server. Not offered here: "
        "solving for an input, other contacts and directions, k from materials, and the fit of measured points."
    )


def main(words: list[str]) -> int:
    """``python -m builder.export_page TABLE MODULE FOLDER``."""
    if len(words) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        write_page(*map(Path, words))
    except (MumacroError, OSError) as error:
        print(f"builder.export_page: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
