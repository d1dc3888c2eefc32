"""Three directives that let the program describe itself: ``command-help``, ``rest-reference`` and
``script-list``."""

from __future__ import annotations

import ast
import importlib
import io
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).resolve().parent.parent.parent
TABLES = ROOT / "tables"
COLUMNS = "100"


def help_of(command: str) -> str:
    """What ``command --help`` prints, without starting a process."""
    words = [*command.removeprefix("python -m ").split(), "--help"]
    main = importlib.import_module(f"{words[0]}.__main__").main
    text = io.StringIO()
    with (
        redirect_stdout(text),
        suppress(SystemExit),
        patch.dict("os.environ", {"COLUMNS": COLUMNS}),
    ):
        main(words[1:])
    return text.getvalue()


class CommandHelp(SphinxDirective):
    """``{command-help} mumacro law``: a heading and the help of that command."""

    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        self.env.note_reread()  # the program may have changed where the page has not
        (command,) = self.arguments
        text = help_of(command).strip()
        if "usage" not in text.lower():
            raise self.error(f"{command} --help prints no usage: {text!r}")
        return self.parse_text_to_nodes(
            f"## `{command} --help`\n\n```text\n{text}\n```\n", allow_section_headings=True
        )


class ScriptList(SphinxDirective):
    """``{script-list} benchmarks``: the scripts of a folder, with the first sentence of each."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        self.env.note_reread()
        (folder,) = self.arguments
        rows = ["| script | what it does |", "| --- | --- |"]
        for path in sorted((ROOT / folder).glob("*.py")):
            text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
            first = text.partition("\n\n")[0].replace("\n", " ").replace("|", "\\|")
            rows.append(f"| `{folder}/{path.name}` | {first.replace('``', '`')} |")
        return self.parse_text_to_nodes("\n".join(rows) + "\n")


class RestReference(SphinxDirective):
    """Every operation of the service with its fields, from the description that it serves as
    /openapi.json."""

    def run(self) -> list[nodes.Node]:
        self.env.note_reread()
        from service.app import create_app
        from service.settings import Settings

        description = create_app(Settings(tables=(TABLES,))).openapi()
        text = "\n".join(_operations(description))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def _operations(description: dict[str, Any]) -> Iterator[str]:
    schemas = description["components"]["schemas"]
    yield "\n## Errors\n\nEvery error has this form.\n"
    yield from _fields(schemas["Problem"], schemas, "problem")
    for path, methods in description["paths"].items():
        for method, operation in methods.items():
            yield (
                f"\n## {method.upper()} {path}\n\n{operation['summary']}. "
                f"{operation.get('description', '')}\n"
            )
            fields = [
                (
                    p["name"],
                    {"description": p.get("description", ""), **p["schema"]},
                    p.get("required", False),
                )
                for p in operation.get("parameters", [])
            ]
            yield from _table("query", fields, schemas)
            body = operation.get("requestBody", {}).get("content", {})
            if body:
                yield f"\nBody: {', '.join(f'`{kind}`' for kind in body)}\n"
                yield from _fields(
                    body.get("application/json", {}).get("schema", {}), schemas, "body"
                )
            for status, response in operation["responses"].items():
                content = response.get("content", {})
                yield (
                    f"\n**{status}** {response['description']}: "
                    f"{', '.join(f'`{kind}`' for kind in content)}\n"
                )
                if status == "200":
                    yield from _fields(
                        content.get("application/json", {}).get("schema", {}), schemas, "answer"
                    )


def _resolved(schema: dict[str, Any], schemas: dict[str, Any]) -> list[dict[str, Any]]:
    """What a schema may be, references followed."""
    if "$ref" in schema:
        return _resolved(schemas[schema["$ref"].rsplit("/", 1)[1]], schemas)
    options = [*schema.get("oneOf", []), *schema.get("anyOf", [])]
    return [resolved for option in options for resolved in _resolved(option, schemas)] or [schema]


def _fields(schema: dict[str, Any], schemas: dict[str, Any], what: str) -> Iterator[str]:
    for one in _resolved(schema, schemas):
        name = one.get("title", "")
        title = what if name.lower() in ("", what) else f"{what} {name}"
        yield from _table(title, _entries(one), schemas)


def _entries(schema: dict[str, Any]) -> list[tuple[str, dict[str, Any], bool]]:
    """Name, schema and whether it is required, of each field of an object."""
    required = schema.get("required", [])
    return [(name, entry, name in required) for name, entry in schema.get("properties", {}).items()]


def _table(
    what: str, fields: list[tuple[str, dict[str, Any], bool]], schemas: dict[str, Any]
) -> Iterator[str]:
    if fields:
        yield f"\n| {what} | type | meaning |\n| --- | --- | --- |"
    for name, schema, required in fields:
        yield from _rows(name, schema, required, schemas)


def _rows(
    name: str, schema: dict[str, Any], required: bool, schemas: dict[str, Any]
) -> Iterator[str]:
    """One field, then the fields within it: ``power.saved``, ``results[].target``."""
    options = _resolved(schema, schemas)
    kinds = " or ".join(dict.fromkeys(_kind(one, schemas) for one in options))
    text = schema.get("description", "").replace("|", "\\|").replace("\n", " ")
    yield f"| `{name}`{', required' if required else ''} | {kinds} | {text} |"
    for option in options:
        inner = [(f"{name}.", option)]
        if "items" in option:
            inner = [(f"{name}[].", one) for one in _resolved(option["items"], schemas)]
        for prefix, one in inner:
            for part, entry, _ in _entries(one):
                yield from _rows(prefix + part, entry, False, schemas)


def _kind(schema: dict[str, Any], schemas: dict[str, Any]) -> str:
    """Type and bounds in words."""
    words = {
        "exclusiveMinimum": "> {:g}",
        "minimum": ">= {:g}",
        "maximum": "<= {:g}",
        "maxItems": "at most {}",
    }
    bounds = [text.format(schema[key]) for key, text in words.items() if key in schema]
    if "enum" in schema or "const" in schema:
        return ", ".join(f"`{value}`" for value in schema.get("enum", [schema.get("const")]))
    kind = str(schema.get("type", "any"))
    inner = schema.get("items") or schema.get("additionalProperties")
    if kind in ("array", "object") and isinstance(inner, dict):
        kind = f"{kind} of {' or '.join(_kind(one, schemas) for one in _resolved(inner, schemas))}"
    return " ".join([kind, *bounds])


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("command-help", CommandHelp)
    app.add_directive("rest-reference", RestReference)
    app.add_directive("script-list", ScriptList)
    return {"parallel_read_safe": True}
