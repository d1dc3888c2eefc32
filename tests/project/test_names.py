"""Documents, manifests and examples name no file, option, setting or metric that is not there;
names in the code are nouns of the field.

CHANGELOG.md may name what has gone.
"""

import ast
import contextlib
import functools
import importlib
import io
import re
import shlex
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

from mumacro.cli.main import COMMANDS
from mumacro.stiffness import GEOMETRIES
from service.metrics import Metrics
from service.settings import PREFIX, Settings
from tests.support.documents import MANIFESTS, PAGES, SPAN, blocks, is_command, mentions, plain
from tests.support.places import ROOT

TEXTS = sorted(
    {*PAGES, *MANIFESTS, *(ROOT / "deploy").glob("*.*"), *(ROOT / "examples").rglob("*.*")}
    - {ROOT / "CHANGELOG.md"}
)
FOLDERS = sorted(
    path.name
    for path in ROOT.iterdir()
    if path.is_dir() and path.name not in ("build", "dist") and not path.name.startswith(".")
)
SOURCE = r"(?:py|[ch]|f90|m?js|sh|ya?ml|toml|cff|css|html)"
#: files that a reader makes, and one of Octave and MATLAB
OTHER_FILES = {"mumacro-1e-4.h", "mumacro.c", "mumacro_table.c", "program.c", "mex.h"}
#: what a program in C calls, sets or finds, and what the build is told
KERNEL = ("hatch_build.py", "src/mumacro/kernel/*.[ch]", "builder/export/c.py")


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


# --- files ----------------------------------------------------------------------------------------


@functools.cache
def file_names() -> set[str]:
    """The names of all files of the project, without their folders."""
    places = [ROOT.glob("*"), *((ROOT / folder).rglob("*") for folder in FOLDERS)]
    return {path.name for paths in places for path in paths}


def listed(text: str) -> Iterator[str]:
    """The files of a list that has a row for each folder, as in CONTRIBUTING.md."""
    for folder, row in re.findall(r"^    (\w\S*/) +(.*(?:\n {5,}.*)*)", text, re.MULTILINE):
        for file in re.findall(rf"(?<![\w*])[\w/]+\.{SOURCE}\b", row):
            yield folder + file


def missing_files(text: str) -> set[str]:
    """Return paths from the root, names of sources and files of a row that are not there."""
    folders = "|".join(map(re.escape, [".ci", *FOLDERS]))
    paths = re.findall(rf"(?<![\w./\\$}}>~-])(?:{folders})/[\w./*-]*\w", text)
    sources = re.findall(rf"(?<![\w./*<\\-])\w[\w-]*\.{SOURCE}(?![\w(])", text)
    missing = {path for path in [*paths, *listed(text)] if not any(ROOT.glob(path))}
    return missing | ({*sources} - file_names() - OTHER_FILES)


# --- options --------------------------------------------------------------------------------------


@functools.cache
def of_help(package: str, *words: str) -> set[str]:
    """The options that ``python -m PACKAGE WORDS --help`` prints."""
    text = io.StringIO()
    main = importlib.import_module(f"{package}.__main__").main
    with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
        main([*words, "--help"])
    lines = re.findall(r"^ +-.*", text.getvalue(), re.MULTILINE)  # no examples
    return {*re.findall(r"--[A-Za-z][\w-]*", "".join(lines))}


@functools.cache
def of_script(path: str) -> set[str]:
    """The options of a script: texts in its source, and keywords for the ``main`` that many
    share."""
    shared = "tests/support/measuring.py"
    nodes = [*ast.walk(ast.parse((ROOT / path).read_text("utf-8")))]
    texts = {node.value for node in nodes if isinstance(node, ast.Constant)}
    options = {text for text in texts if isinstance(text, str) and text.startswith("--")}
    for node in nodes:
        if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] == "main":
            options |= {f"--{keyword.arg}" for keyword in node.keywords}
            options |= of_script(shared) if path != shared else set()
    return options


def options_of(words: list[str]) -> set[str] | None:
    """The options that a command takes; None for programs of others."""
    match words:
        case ["python3", "dev.py", "exec", *rest] | [".ci/peers", "--", *rest]:
            return options_of(rest)
        case ["mumacro" | "dev.py", "serve", *_] | ["-m", "service", *_]:
            return of_help("service")
        case ["dev.py", "lock", *_]:  # those of uv
            return None
        case ["mumacro", "stiffness", geometry, *_] if geometry in GEOMETRIES:
            return of_help("mumacro", "stiffness", geometry)
        case ["mumacro", command, *_]:
            return of_help("mumacro", *[command] * (command in COMMANDS))
        case ["-m", "builder" | "mumacro.builder", command, *_]:
            return of_help("builder", command)
        case [script, *_] if script.endswith(".py") and (ROOT / script).exists():
            return of_script(script)
        case ["python" | "python3", *rest]:
            return options_of(rest)
    return None


@functools.cache
def all_options() -> set[str]:
    """The options of every command and script of the project."""
    commands = [["mumacro", command] for command in ("", *COMMANDS)]
    commands += [["mumacro", "stiffness", geometry] for geometry in GEOMETRIES]
    commands += [["-m", "builder", "build"], ["-m", "builder", "verify"], ["dev.py"]]
    for folder in ("benchmarks", "fuzz", "deploy"):
        commands += [[name(path)] for path in (ROOT / folder).glob("*.py")]
    return set().union(*(options_of(words) or set() for words in commands))


def programs(command: str) -> Iterator[list[str]]:
    """The words of each program of a line, from its name."""
    for part in re.split(r" (?:\||&&) ", plain(command)):
        try:
            words = shlex.split(part)
        except ValueError:  # a sentence has a part of a command
            words = part.split()
        while words and (words[0] == "nice" or re.fullmatch(r"[A-Z_]+=.*", words[0])):
            del words[0]
        yield words


def missing_options(page: Path) -> set[str]:
    """Return options that our commands do not take, and those of a sentence that none takes."""
    shells = blocks(page, "bash", "console")
    commands = [command for block in shells for command, _ in block.entries()]
    commands += [mention.command for mention in mentions(page)]
    missing = set()
    for words in (words for command in commands for words in programs(command)):
        if (taken := options_of(words)) is not None:
            asked = {word.partition("=")[0] for word in words if re.match(r"--[A-Za-z]", word)}
            missing |= asked - taken
    spans = [span for span in SPAN.findall(page.read_text("utf-8")) if not is_command(span)]
    alone = {word for span in spans for word in re.findall(r"(?<!\S)--[A-Za-z][\w-]*", span)}
    return missing | (alone - all_options())


# --- settings and metrics -------------------------------------------------------------------------


@functools.cache
def of_kernel(pattern: str) -> set[str]:
    """Names in the sources of the kernel and of its build."""
    texts = (path.read_text("utf-8") for place in KERNEL for path in ROOT.glob(place))
    return {found for text in texts for found in re.findall(pattern, text)}


def missing_settings(text: str) -> set[str]:
    """Return names that begin as a setting and are neither one nor a macro in C."""
    settings = {f"{PREFIX}{setting.upper()}" for setting in Settings.model_fields}
    pattern = rf"\b{PREFIX}[A-Z][A-Z_]*\b"
    return {*re.findall(pattern, text)} - settings - of_kernel(pattern)


def missing_metrics(text: str) -> set[str]:
    """Return names that begin as a metric and are neither one nor a function in C."""
    endings = {"counter": ["_total"], "histogram": ["", "_bucket", "_count", "_sum"]}
    metrics = {
        metric.name + ending
        for metric in Metrics([]).registry.collect()
        for ending in endings.get(metric.type, [""])
    }
    pattern = r"(?<![\w/.])mumacro_[a-z]\w*(?!\w*\.)"
    return {*re.findall(pattern, text)} - metrics - of_kernel(pattern) - {"mumacro_mex"}


# --- nothing is missing ---------------------------------------------------------------------------

IN_TEXT = (missing_files, missing_settings, missing_metrics)


@pytest.mark.parametrize("path", TEXTS, ids=name)
def test_files_settings_and_metrics_that_are_named_are_there(path: Path) -> None:
    text = path.read_text("utf-8")
    assert {one.__name__: one(text) for one in IN_TEXT} == {one.__name__: set() for one in IN_TEXT}


@pytest.mark.parametrize("page", [page for page in PAGES if page in TEXTS], ids=name)
def test_options_that_are_named_are_there(page: Path) -> None:
    assert missing_options(page) == set()


@pytest.mark.parametrize(
    ("find", "good", "bad"),
    [
        (missing_files, "see `src/mumacro/errors.py`", "src/mumacro/mistakes.py"),
        (missing_files, "COPY requirements/service.txt /build/", "requirements/servant.txt"),
        (missing_files, "tables: `tables/*.nc`", "tables/*.csv"),
        (missing_files, "in `netcdf.py`", "netcfd.py"),
        (missing_files, "    service/   app.py,\n               metrics.py", "service/netcdf.py"),
        (missing_settings, '{MUMACRO_WORKERS: "1"}', "MUMACRO_WORKER"),
        (missing_settings, "-DMUMACRO_ONE_LANE", "MUMACRO_TWO_LANES"),
        (missing_metrics, "rate(mumacro_requests_total[5m])", "mumacro_requests"),
        (missing_metrics, "mumacro_request_duration_seconds_bucket{le=", "mumacro_slots_total"),
        (missing_metrics, "`mumacro_evaluate_cycle(...)`", "mumacro_evaluate_circle"),
    ],
)
def test_a_name_that_is_not_there_is_found(
    find: Callable[[str], Iterable[str]], good: str, bad: str
) -> None:
    assert find(good) == set()
    planted = bad if "   " not in good else f"{good}, {Path(bad).name}"
    assert find(f"{good} and `{planted}`" if planted == bad else planted) == {bad}


@pytest.mark.parametrize(
    ("text", "bad"),
    [
        ("```bash\nmumacro law mu0=0.3 --along v0 1 2 --points 4 --pionts 5\n```\n", "--pionts"),
        ("```bash\nmumacro stiffness ball --radius 5mm --side 1mm\n```\n", "--side"),
        ("```console\n$ mumacro mu0=0.3 --json --target 1\n0.1 --no\n```\n", "--target"),
        ("Use `MUMACRO_PORT=1 mumacro serve --host h --ports 1`.\n", "--ports"),
        ("Use `python -m builder verify t.nc --points 9 --tolerance 1`.\n", "--tolerance"),
        ("```bash\npython3 dev.py exec python fuzz/answers.py --share 1 --shy 1\n```\n", "--shy"),
        ("Run `python3 dev.py test --all` or `python3 dev.py test --none`.\n", "--none"),
        ("With `--json` or with `--xml`, as `curl --any`.\n", "--xml"),
    ],
)
def test_an_option_that_is_not_there_is_found(tmp_path: Path, text: str, bad: str) -> None:
    page = tmp_path / "page.md"
    page.write_text(text, "utf-8")
    assert missing_options(page) == {bad}


# --- modules of the library -----------------------------------------------------------------------


def test_no_two_modules_of_the_library_have_one_name() -> None:
    """A command alone has the name of the module whose function it calls."""
    library = ROOT / "src" / "mumacro"
    modules = [path for path in library.rglob("*.py") if not path.stem.startswith("__")]
    stems = [path.stem for path in modules if path.parent.name != "cli"]
    assert len(stems) > 50
    assert len({*stems}) == len(stems), sorted(stem for stem in stems if stems.count(stem) > 1)


# --- names in the code ----------------------------------------------------------------------------

#: words that do not say what a value is, and one that had three meanings
BANNED = {"at", "both", "given", "like", "more", "others", "own", "reading", "strange"}
SEARCHED = ("builder", "service", "src/mumacro")


def bindings(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield each name that a program binds, with its line."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=bound) | ast.AsyncFunctionDef(name=bound):
                yield node.lineno, bound
            case ast.ClassDef(name=bound) | ast.ExceptHandler(name=str(bound)):
                yield node.lineno, bound
            case ast.arg(arg=bound):
                yield node.lineno, bound
            case ast.Name(id=bound, ctx=ast.Store()) | ast.Attribute(attr=bound, ctx=ast.Store()):
                yield node.lineno, bound
            case ast.alias(name=imported, asname=renamed):
                yield node.lineno, renamed or imported
            case ast.MatchAs(name=str(bound)) | ast.MatchStar(name=str(bound)):
                yield node.lineno, bound
            case ast.MatchMapping(rest=str(bound)):
                yield node.lineno, bound


def banned_names(path: Path) -> list[str]:
    """Return the banned names that a module has or binds, with their lines."""
    found = [(1, path.stem), *bindings(ast.parse(path.read_text("utf-8")))]
    return [f"{path.name}:{line} {bound}" for line, bound in found if bound.strip("_") in BANNED]


@pytest.mark.parametrize("folder", SEARCHED)
def test_names_in_the_code_are_nouns_of_the_field(folder: str) -> None:
    modules = [*(ROOT / folder).rglob("*.py")]
    assert len(modules) > 20
    assert [found for module in sorted(modules) for found in banned_names(module)] == []


@pytest.mark.parametrize(
    "text",
    [
        "def at(): ...",
        "async def _given(): ...",
        "class own: ...",
        "def f(x, *, more=1): ...",
        "def f(**others): ...",
        "lambda like: like",
        "both = 1",
        "for at, x in []: ...",
        "[at for at in []]",
        "x.at = 1",
        "if (own := 1): ...",
        "import json as strange",
        "from mumacro.files import reading",
        "with open('x') as given: ...",
        "try: ...\nexcept OSError as others: ...",
        "match x:\n    case [1, *more]: ...",
        "match x:\n    case {'a': 1, **others}: ...",
        "match x:\n    case 1 as given: ...",
    ],
)
def test_a_banned_name_is_found(tmp_path: Path, text: str) -> None:
    module = tmp_path / "module.py"
    module.write_text(text, "utf-8")
    assert len(banned_names(module)) == 1
    (module := tmp_path / "reading.py").write_text("x = 1", "utf-8")
    assert len(banned_names(module)) == 1
