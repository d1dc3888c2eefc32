"""Write the pages that the program describes itself: commands, fields of HTTP, Python, scripts.

    python docs/reference.py            # writes docs/http-fields.md and python.md, the help in
                                        # command-line.md and the lists of scripts in decisions.md
    python docs/reference.py --check    # names those that are not what they would be now

They are text, so that they read alike on the site and in the repository; a test compares them with
the program.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import io
import re
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from functools import cache, cached_property
from itertools import pairwise
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any
from unittest.mock import patch

from sphinx.pycode import ModuleAnalyzer

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
COLUMNS = "100"
MADE = "This page is made by `python docs/reference.py`."

COMMANDS = (
    *(
        f"mumacro {name}".strip()
        for name in (
            "", "eval", "law", "solve-for", "fit", "fit-loop", "map", "motion", "stiffness",
            "table", "export", "serve",
        )
    ),
    *(
        f"python -m builder {name}".strip()
        for name in ("", "build", "solve", "verify", "export", "figures")
    ),
)  # fmt: skip

#: the headings of the page on Python, each with its names; a module stands for all that it defines
PYTHON = {
    "mumacro": (
        "mumacro.open", "mumacro.Surrogate", "mumacro.Answer", "mumacro.results.Result",
        "mumacro.REGIMES", "mumacro.SOURCES", "mumacro.errors.MumacroError",
        "mumacro.errors.InputError", "mumacro.errors.TextError", "mumacro.errors.TableError",
    ),
    "mumacro.fit, mumacro.fit_loop, mumacro.Element": (
        "mumacro.fit", "mumacro.Fit", "mumacro.fit_loop", "mumacro.LoopFit", "mumacro.Element",
    ),
    "mumacro.motion, mumacro.harmonics, mumacro.solve_motion": (
        "mumacro.motion", "mumacro.Motion", "mumacro.motions.motion.Cycle", "mumacro.harmonics",
        "mumacro.Harmonics", "mumacro.solve_motion", "mumacro.MotionSolution",
        "mumacro.questions.search.Root",
    ),
    "mumacro.law, mumacro.solve_for": (
        "mumacro.law", "mumacro.questions.law.Law", "mumacro.questions.borders.Crossing",
        "mumacro.solve_for", "mumacro.questions.solve_for.TableSolution",
        "mumacro.questions.solve_for.TableRoot", "mumacro.questions.solutions.Reach",
    ),
    "mumacro.closed_forms": ("mumacro.closed_forms",),
    "mumacro.stiffness": ("mumacro.stiffness",),
    "mumacro.validity": ("mumacro.validity.notes_of", "mumacro.validity.ROWS"),
    "mumacro.files": ("mumacro.files.answer", "mumacro.files.evaluate_files"),
    "mumacro.table": (
        "mumacro.table.blocks.Table", "mumacro.table.blocks.Block",
        "mumacro.table.blocks.BorderPiece", "mumacro.table.netcdf.read_table",
        "mumacro.table.netcdf.write_table",
    ),
    "builder": (
        "builder.solver.steady.solve", "builder.solver.steady.Steady",
        "builder.solver.steady.border", "builder.figures.steady_cycle",
        "builder.tables.build.build_table", "builder.export.grid.export_table",
        "builder.figures.draw_figures",
    ),
}  # fmt: skip
PYTHON_INTRODUCTION = """Every name on this page is public. *array_like* arguments broadcast as \
in NumPy, and a `float` argument gives a `float` result. Units in brackets are SI; inputs of one \
case may also be [texts with a unit and values that carry one](units.md). Every result also has \
the members of [`Result`](#mumacroresultsresult), and is a table in a notebook. What `include`, \
`std` and `remarks` give: [outputs, deviations, remarks](outputs.md). Answers in the shape of \
pandas, xarray or Dask: [many cases](how-to/many-cases.md). The functions of `builder` need the \
extra `builder` and are `mumacro.builder` in a wheel; those of `mumacro.files` need the extra \
`files`."""


# --- commands -------------------------------------------------------------------------------------


def help_of(command: str) -> str:
    """Return what ``command --help`` prints, without starting a process."""
    words = [*command.removeprefix("python -m ").split(), "--help"]
    main = importlib.import_module(f"{words[0]}.__main__").main
    text = io.StringIO()
    with (
        redirect_stdout(text),
        suppress(SystemExit),
        patch.dict("os.environ", {"COLUMNS": COLUMNS}),
    ):
        main(words[1:])
    return text.getvalue().strip()


def with_help(page: str) -> str:
    """Return a page with the help of every command between its markers made anew."""
    helps = [f"### {one}\n\n```text\n{help_of(one)}\n```" for one in COMMANDS]
    text = "\n\n".join(["<!-- begin help -->", *helps, "<!-- end help -->"])
    return re.sub(r"<!-- begin help -->.*?<!-- end help -->", lambda _: text, page, flags=re.DOTALL)


# --- scripts --------------------------------------------------------------------------------------


def script_list(folder: str) -> str:
    """Return a table of the scripts of a folder, with the first sentence of each."""
    rows = ["| script | what it does |", "| --- | --- |"]
    for path in sorted((ROOT / folder).glob("*.py")):
        text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
        first = text.partition("\n\n")[0].replace("\n", " ").replace("|", "\\|")
        rows.append(f"| `{folder}/{path.name}` | {first.replace('``', '`')} |")
    return "\n".join(rows)


def with_scripts(page: str) -> str:
    """Return a page with the lists between its markers made anew."""

    def made(match: re.Match[str]) -> str:
        folder = match[1]
        marker = f"<!-- {{}} scripts {folder} -->"
        return f"{marker.format('begin')}\n\n{script_list(folder)}\n\n{marker.format('end')}"

    pattern = r"<!-- begin scripts (\w+) -->.*?<!-- end scripts \1 -->"
    return re.sub(pattern, made, page, flags=re.DOTALL)


# --- HTTP -----------------------------------------------------------------------------------------


def http_page() -> str:
    """Return the page with every operation of the service and its fields, from its description."""
    from service.app import create_app
    from service.settings import Settings

    description = create_app(Settings(tables=(ROOT / "tables",))).openapi()
    introduction = (
        f"{MADE} It shows what the service serves as `/openapi.json`; [HTTP](http.md) explains the "
        "requests. A dot stands for a field within a field, as in `power.saved`; brackets stand "
        "for the entries of a list, as in `results[].target`."
    )
    text = "\n".join(["# Every field of the service", "", introduction, *operations(description)])
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def operations(description: dict[str, Any]) -> Iterator[str]:
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
    text = _spans(schema.get("description", "").replace("|", "\\|").replace("\n", " "))
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
        values = schema.get("enum", [schema.get("const")])
        return ", ".join(f"`{value}`" for value in values).replace("|", "\\|")
    kind = str(schema.get("type", "any"))
    inner = schema.get("items") or schema.get("additionalProperties")
    if kind in ("array", "object") and isinstance(inner, dict):
        kind = f"{kind} of {' or '.join(_kind(one, schemas) for one in _resolved(inner, schemas))}"
    return " ".join([kind, *bounds])


# --- Python ---------------------------------------------------------------------------------------

SECTIONS = r"(Parameters|Returns|Raises|Attributes|Notes|Examples)"
ROLE = re.compile(r":(\w+):`~?([^`<]*?)(?:\s*<[^>]*>)?`")


def _spans(text: str) -> str:
    """Return a paragraph of reStructuredText as Markdown."""
    text = re.sub(r"``([^`]+)``", r"`\1`", text)
    text = ROLE.sub(lambda role: f"${role[2]}$" if role[1] == "math" else f"`{role[2]}`", text)
    parts = re.split(r"(`[^`]*`|\$[^$]*\$)", text)
    # names of the field such as y~, and signs that GitHub would take for a tag
    return "".join(
        part if part[:1] in ("`", "$") else re.sub(r"[\w/]*~[\w/]*|<\w[^>\s]*>?", r"`\g<0>`", part)
        for part in parts
    )


def _paragraphs(lines: list[str]) -> Iterator[str]:
    """Yield paragraphs, lists and blocks of code as Markdown."""
    for block in re.split(r"\n\s*\n", "\n".join(lines).strip("\n")):
        text = inspect.cleandoc(block)
        if text.startswith(">>>"):
            yield f"```pycon\n{text}\n```"
        elif block.startswith("    "):
            yield f"```text\n{text}\n```"
        elif text.startswith(("- ", "* ")):
            yield _spans(re.sub(r"\n\s+", " ", text))
        elif text:
            yield _spans(text.removesuffix("::") + (":" if text.endswith("::") else "")).replace(
                "\n", " "
            )


def _entries_of(lines: list[str]) -> Iterator[str]:
    """Yield the entries of a section such as Parameters as items of a list."""
    name, words = "", list[str]()
    for line in [*lines, "end"]:
        if line and not line.startswith(" "):
            if name:
                head, _, kind = name.partition(" : ")
                told = _spans(" ".join(word.strip() for word in words if word.strip()))
                kind = f" ({_spans(kind)})" if kind else ""
                yield f"- `{head}`{kind}{': ' if told else ''}{told}"
            name, words = line, []
        else:
            words.append(line)


def markdown_of(text: str) -> str:
    """Return a docstring with sections as numpydoc has them, as Markdown."""
    lines = inspect.cleandoc(text).splitlines()
    starts = [
        i
        for i in range(len(lines) - 1)
        if re.fullmatch(SECTIONS, lines[i].strip()) and re.fullmatch(r"-{3,}", lines[i + 1].strip())
    ]
    parts = list(_paragraphs(lines[: starts[0] if starts else None]))
    for start, end in pairwise([*starts, len(lines)] if starts else []):
        title, inside = lines[start].strip(), lines[start + 2 : end]
        parts.append(f"**{title}**")
        if title in ("Notes", "Examples"):
            parts += _paragraphs(inside)
        else:
            parts.append("\n".join(_entries_of(inside)))
    return "\n\n".join(part for part in parts if part)


@cache
def _comments(module: str) -> dict[tuple[str, str], list[str]]:
    return dict(ModuleAnalyzer.for_module(module).find_attr_docs())


def _comment(module: str, owner: str, name: str) -> str:
    return _spans(" ".join(_comments(module).get((owner, name), [])).strip())


def _signature(value: Any) -> str:
    try:
        signature = inspect.signature(value)
    except (TypeError, ValueError):
        return "()"
    plain = [
        one.replace(annotation=inspect.Parameter.empty)
        for one in signature.parameters.values()
        if one.name != "self"
    ]
    text = str(signature.replace(parameters=plain, return_annotation=inspect.Signature.empty))
    # a default that is no literal, such as that of an input that is left out
    return re.sub(r"=(?!None|True|False|[-'\"(\d])[^,()]*(?:\([^)]*\))?", "=...", text)


def _is_defined_in(value: Any, module: str) -> bool:
    return getattr(value, "__module__", None) == module


#: members whose docstring is their own; a plain value has that of its type, a field of a named
#: tuple one that counts fields
DOCUMENTED = (FunctionType, classmethod, staticmethod, property, cached_property)


def _class_page(title: str, value: type) -> Iterator[str]:
    """Yield the parts of a class; what every result has is shown once, at ``Result``."""
    short = title.rsplit(".", 1)[1]
    yield f"### {title}\n\n```text\n{short}{_signature(value)}\n```"
    yield markdown_of(value.__doc__ or "")
    shown = set[str]()
    for base in [value, *value.__mro__[1:-1]]:
        if not base.__module__.startswith(("mumacro", "builder")):
            continue
        if base.__qualname__ == "Result" and base is not value:
            continue
        attributes = [
            (name, _comment(base.__module__, base.__name__, name))
            for owner, name in _comments(base.__module__)
            if owner == base.__name__ and not name.startswith("_")
        ]
        if attributes:
            yield "\n".join(f"- `{name}`: {told}" for name, told in attributes)
        for name, member in vars(base).items():
            text = inspect.getdoc(member) if isinstance(member, DOCUMENTED) else None
            if name.startswith("_") or not text or name in shown:
                continue
            shown.add(name)
            if isinstance(member, property) or not callable(getattr(value, name)):
                yield f"#### `{short}.{name}`\n\n{markdown_of(text)}"
            else:
                function = getattr(value, name)
                yield f"#### `{short}.{name}{_signature(function)}`\n\n{markdown_of(text)}"


def _found(title: str) -> tuple[str, Any]:
    """Return the module and the value behind a name."""
    module, _, name = title.rpartition(".")
    with suppress(ModuleNotFoundError):
        value = getattr(importlib.import_module(module), name)
        if not isinstance(value, ModuleType):
            return module, value
    return title, importlib.import_module(title)


def _entry(title: str) -> Iterator[str]:
    """Yield the parts of one name of the page on Python."""
    module, value = _found(title)
    if isinstance(value, ModuleType):
        yield markdown_of(value.__doc__ or "")
        for name, member in vars(value).items():
            if (
                not name.startswith("_")
                and _is_defined_in(member, title)
                and inspect.getdoc(member)
            ):
                yield from _entry(f"{title}.{name}")
        for owner, name in _comments(title):
            if not owner and not name.startswith("_"):
                yield f"### {title}.{name}\n\n{_comment(title, '', name)}"
    elif inspect.isclass(value):
        yield from _class_page(title, value)
    elif callable(value):
        short = title.rsplit(".", 1)[1]
        yield f"### {title}\n\n```text\n{short}{_signature(value)}\n```"
        yield markdown_of(inspect.getdoc(value) or "")
    else:
        name = title.rsplit(".", 1)[1]
        places = (module, "mumacro.outputs.answer")
        home = next((place for place in places if ("", name) in _comments(place)), module)
        yield f"### {title}\n\n{_comment(home, '', name)}"


def python_page() -> str:
    """Return the page with every public name of Python."""
    parts = ["# Python reference", MADE, PYTHON_INTRODUCTION]
    for heading, names in PYTHON.items():
        parts.append(f"## {heading}")
        for name in names:
            parts += _entry(name)
    return "\n\n".join(part for part in parts if part) + "\n"


def pages() -> dict[str, str]:
    """Return every page that is made here, by its path under docs."""
    return {
        "command-line.md": with_help((DOCS / "command-line.md").read_text("utf-8")),
        "http-fields.md": http_page(),
        "python.md": python_page(),
        "decisions.md": with_scripts((DOCS / "decisions.md").read_text("utf-8")),
    }


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    made = pages()
    old = [name for name, text in made.items() if (DOCS / name).read_text("utf-8") != text]
    if "--check" in sys.argv:
        raise SystemExit(f"make again: {', '.join(old)}" if old else 0)
    for name in old:
        (DOCS / name).write_text(made[name], encoding="utf-8")
