"""What the documents tell a reader to run is run, or the page says that it is not
(tests/support/documents.py).

Commands and sessions run unchanged, those of a page in one scratch folder and in its order.
README and tutorial have what `pip install .` gives; the other pages, and commands that start the
service, have the wheel and the packages of the running environment, for extras.
What another check runs is in ``ELSEWHERE``.
"""

import importlib.metadata
import json
import os
import re
import shutil
import site
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.project.test_wheel import CORE, build
from tests.support.comparing import close
from tests.support.documents import (
    MANIFESTS,
    PAGES,
    Block,
    Mention,
    blocks,
    comments,
    mentions,
    plain,
)
from tests.support.places import ROOT
from tests.support.serving import CASE, running

posix = pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")

BARE = {"README", "tutorial"}
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
SERVICE = "http://127.0.0.1:8000"
#: the sessions of all pages in one process, so that packages are imported once: each is a
#: folder and a file, and the program names those that fail
SESSIONS = """
import doctest, os, sys
failed = []
for folder, file in zip(sys.argv[1::2], sys.argv[2::2]):
    os.chdir(folder)
    text = open(file, encoding="utf-8").read()
    test = doctest.DocTestParser().get_doctest(text, {}, file, file, 0)
    result = doctest.DocTestRunner(verbose=False).run(test)
    if result.failed or not result.attempted:
        failed.append(file)
sys.exit(", ".join(failed) or 0)
"""
#: these make the environments
INSTALLS = {"bare": "pip install .", "service": 'pip install ".[service]"'}
#: the file that runs a command, perhaps with smaller numbers, and the words there that do
ELSEWHERE = {
    "python3 dev.py test": ("dev.py", "for word in MARKS.get(option"),  # by dev.py test --all
    "python3 dev.py test --all": (".ci/run", "python3 dev.py test --all"),
    "python3 dev.py wheels": (".ci/run", "python3 dev.py wheels"),
    "python3 dev.py check": ("dev.py", "failed = check()"),  # by dev.py test
    "python3 dev.py docs": ("dev.py", "return docs() or"),  # by dev.py wheels
    'python3 dev.py exec pytest -m "" tests/mumacro/questions/test_law.py': (
        ".ci/run",
        "dev.py exec pytest",
    ),
    "bash deploy/container.sh": (".ci/container", "bash deploy/container.sh"),
    "docker build -t mumacro .": ("deploy/container.sh", '"$engine" build'),
    "python -m builder build --tolerance 1e-8 --out my-table.nc": (
        "tests/builder/test_builder_cli.py",
        'here("build", "--tolerance", "1e-4", "--out", out',
    ),
    "python -m builder verify my-table.nc --points 20000": (
        "tests/builder/test_builder_cli.py",
        'here("verify", out, "--points", 300',
    ),
    "python -m builder solve --v 0.1 --y 0.5": (
        "tests/builder/test_builder_cli.py",
        'run_builder("solve", "--v", 0.1, "--y", 0.5)',
    ),
    "python -m builder figures --out figures": (
        "tests/builder/test_figures.py",
        '["figures", "--out"',
    ),
    "python -m mumacro.builder": ("tests/project/test_wheel.py", "python -m mumacro.builder solve"),
    "python benchmarks/speed_against_error.py": (
        "tests/project/test_benchmarks.py",
        'run("speed_against_error", ',
    ),
    "python benchmarks/hard_cases.py": ("tests/project/test_benchmarks.py", '"hard_cases")'),
    "python benchmarks/validation.py": ("tests/project/test_benchmarks.py", '("validation", '),
    "python benchmarks/validity.py": ("tests/project/test_benchmarks.py", '"validity", '),
    "python benchmarks/measured.py": (
        "tests/mumacro/fits/test_measured.py",
        "measured.SECTIONS",
    ),
    "python benchmarks/friction_models.py": (
        "tests/mumacro/fits/test_measured.py",
        "friction_models.elements()",
    ),
    "nice python benchmarks/fit_coverage.py": (
        "tests/mumacro/fits/test_fitting.py",
        "fit_coverage.SET_UPS",
    ),
    "python benchmarks/loops.py": (
        "tests/mumacro/fits/test_loop.py",
        "benchmark.random_loops(",
    ),
    "mumacro fit --json": ("tests/mumacro/cli/test_command.py", '*words, "--json")'),
    "python benchmarks/error_distribution.py": (
        "tests/project/test_benchmarks.py",
        'run("error_distribution", "--share"',
    ),
    "python -m builder verify TABLE --write": (
        "tests/builder/test_builder_cli.py",
        'here(*words, "--write")',
    ),
    "python -m builder verify my-table.nc --seed 2 --write": (
        "tests/builder/test_builder_cli.py",
        'here(*words, "--write")',
    ),
    "python benchmarks/tables_readme.py": (
        "tests/project/test_benchmarks.py",
        '"benchmarks.tables_readme").tables(',
    ),
    "gcc -O2 -c mumacro.c mumacro_table.c && gfortran mumacro.f90 friction.f90 mumacro.o "
    "mumacro_table.o -lm": ("tests/builder/export/test_c_languages.py", '"mumacro.f90"'),
    "python docs/reference.py": ("tests/project/test_documents.py", "reference.py"),
    "mumacro export --format fmu": ("tests/builder/export/test_fmu.py", 'params=["fmu", "fmu3"]'),
    "mumacro export --format fmu3 --table 1e-7": (
        "tests/builder/export/test_fmu.py",
        'params=["fmu", "fmu3"]',
    ),
    "mkoctfile --mex": (
        "tests/builder/export/test_c_languages.py",
        "test_octave_has_the_same_answers",
    ),
}
#: pages whose Python programs another file runs
PROGRAMS_ELSEWHERE = {"docs/how-to/many-cases.md": "tests/project/test_recipes.py"}
#: made by the program: tests/project/test_documents.py makes them, and
#: tests/project/test_docstrings.py runs the examples of docstrings
REFERENCE = {ROOT / "docs" / f"{name}.md" for name in ("python", "http-fields")}
SHELL = ("bash", "console")
#: what the reader of a page has, and ports and folders of this machine
HERE = (
    (r"--host \S+", "--host 127.0.0.1"),
    (r"--port \d+", "--port 0"),
    (r"/srv/mumacro/", f"{ROOT}/tables/"),
)
REMEDY = "put it into a ```bash block, name in ELSEWHERE what runs it, or say Not run by the checks"


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def having(*languages: str) -> list[Path]:
    return [
        page
        for page in PAGES
        if page not in REFERENCE and any(not block.marked for block in blocks(page, *languages))
    ]


# --- nothing is left out --------------------------------------------------------------------------


def run_here() -> set[str]:
    """Every command that this file runs."""
    return {
        plain(command)
        for page in PAGES
        for block in blocks(page, *SHELL)
        if not block.marked
        for command, _ in block.entries()
    }


def is_run(mention: Mention, commands: set[str]) -> bool:
    """Whether a command begins so; "..." stands for anything."""
    begins = re.compile(".*".join(map(re.escape, mention.command.split("..."))) + r"(?: .*)?")
    return any(begins.fullmatch(command) for command in commands)


def is_covered(block: Block) -> bool:
    """Whether a block is run, is marked, or is no program."""
    if block.marked or block.language in (*SHELL, "pycon"):
        return True
    if block.language == "python":
        return name(block.page) in PROGRAMS_ELSEWHERE
    if block.language == "c":  # the program of the page's own commands
        return any("program.c" in other.text for other in blocks(block.page, *SHELL))
    return block.language in ("math", "text", "toctree") or block.language.startswith("{")


@pytest.mark.parametrize("page", sorted({*PAGES, *MANIFESTS} - REFERENCE), ids=name)
def test_every_command_and_program_is_run_or_said_not_to_be(page: Path) -> None:
    commands = run_here() | ELSEWHERE.keys() | {*INSTALLS.values()}
    commands_shown = comments(page) if page in MANIFESTS else mentions(page)
    missing = [
        f"{name(page)}:{one.line}: {one.command}"
        for one in commands_shown
        if not one.marked and (one.indented or not is_run(one, commands))
    ]
    if page not in MANIFESTS:
        missing += [
            f"{name(page)}:{block.line}: a block of {block.language or 'no language'}"
            for block in blocks(page)
            if not is_covered(block)
        ]
    assert missing == [], REMEDY


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_commands_have_quotes_that_every_shell_takes(page: Path) -> None:
    """cmd.exe knows no single quotes."""
    commands = [command for block in blocks(page, *SHELL) for command, _ in block.entries()]
    commands += [mention.command for mention in mentions(page)]
    own = [one for one in commands if re.match(r"mumacro |pip install ", one)]
    assert [one for one in own if "'" in plain(one)] == []


def test_what_runs_elsewhere_is_there_and_is_still_told() -> None:
    commands = run_here() | {one.command for page in PAGES for one in mentions(page)}
    assert {*INSTALLS.values()} <= commands
    for command, (file, words) in ELSEWHERE.items():
        assert command in commands, f"no document has it any more: {command}"
        assert words in (ROOT / file).read_text("utf-8"), f"{file} does not run {command}"
    for page, file in PROGRAMS_ELSEWHERE.items():
        assert Path(page).name in (ROOT / file).read_text("utf-8")


@pytest.mark.parametrize(
    ("text", "covered"),
    [
        ("```bash\nmumacro new\n```\n", True),
        ("    mumacro new  # in an indented block\n", False),
        ("Use `mumacro new-command`.\n", False),
        ("Use `mumacro new-command` (not run by\nthe checks).\n", True),
        ("- `mumacro new-command` (not run by the checks)\n- `mumacro other`\n", False),
        ("Not run by the checks:\n\n| `mumacro new-command` |\n", True),
        ("Not run by the checks:\n\nBut `mumacro new-command`:\n\n`mumacro other`\n", False),
        ("```python\nimport mumacro\n```\n", False),
        ("Not run by the checks:\n\n```python\nimport mumacro\n```\n", True),
        ("```sh\nmumacro new\n```\n", False),
    ],
)
def test_a_new_command_must_be_run_or_said_not_to_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, covered: bool
) -> None:
    page = tmp_path / "page.md"
    page.write_text(text, "utf-8")
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    if covered:
        test_every_command_and_program_is_run_or_said_not_to_be(page)
    else:
        with pytest.raises(AssertionError, match="Not run by the checks"):
            test_every_command_and_program_is_run_or_said_not_to_be(page)


# --- environments ---------------------------------------------------------------------------------


def environment(programs: Path, **more: str) -> dict[str, str]:
    variables = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "MUMACRO_"))
    }
    path = f"{programs}{os.pathsep}/usr/local/bin{os.pathsep}/usr/bin{os.pathsep}/bin"
    return {**variables, "PATH": path, "COLUMNS": "120", "MPLBACKEND": "agg", **more}


def run(programs: Path, folder: Path, *words: str | Path, **more: str) -> str:
    done = subprocess.run(
        words,
        cwd=folder,
        env=environment(programs, **more),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{words}\n{done.stdout}{done.stderr}"
    return done.stdout


def pip(programs: Path, place: Path, command: str, **settings: str) -> None:
    quiet = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_COMPILE": "1"}
    run(programs, place, "sh", "-c", command, **quiet, **settings)


def venv(folder: Path) -> Path:
    """The programs of a new virtual environment: by uv, which links pip from its cache, where it is
    there."""
    uv = shutil.which("uv")
    words = [uv, "venv", "-q", "--seed", "-p"] if uv else []
    subprocess.run([*words, sys.executable, *([] if uv else ["-m", "venv"]), folder], check=True)
    return folder / "bin"


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """This tree as git clones it: nothing is compiled or installed in place."""
    folder = tmp_path_factory.mktemp("clone") / "mumacro"
    unwanted = shutil.ignore_patterns(
        ".*", "build", "dist", "_kernel.*", "_declarations.py", "__pycache__", "tests"
    )
    shutil.copytree(ROOT, folder, ignore=unwanted)
    return folder


@pytest.fixture(scope="module")
def bare(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What ``pip install .`` gives in a clone."""
    folder = tmp_path_factory.mktemp("bare")
    programs = venv(folder / "venv")
    # the tested versions, probably in pip's cache
    pins = folder / "pins.txt"
    pins.write_text("".join(f"{name}=={importlib.metadata.version(name)}\n" for name in CORE))
    settings = {"PIP_CONSTRAINT": str(pins)}
    if cache := os.environ.get("MUMACRO_BUILD_CACHE"):  # the same sources, compiled before
        settings["MUMACRO_BUILD_CACHE"] = cache
    pip(programs, clone, INSTALLS["bare"], **settings)
    return programs


@pytest.fixture(scope="module")
def bare_with_packages(bare: Path) -> Path:
    """The same with the packages of this environment, which meet every extra, but without the
    links to this tree."""
    (packages,) = bare.parent.glob("lib/python*/site-packages")
    (packages / "more.pth").write_text("\n".join(site.getsitepackages()), "utf-8")
    return bare


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel and the packages of this one, which meet the extra service."""
    wheel = build(tmp_path_factory.mktemp("wheel"))
    programs = venv(tmp_path_factory.mktemp("full") / "venv")
    pip(programs, ROOT, f"pip install --no-deps {wheel}")
    (packages,) = programs.parent.glob("lib/python*/site-packages")
    # behind the wheel, and without the links to this tree that an installation in place has
    (packages / "more.pth").write_text("\n".join(site.getsitepackages()), "utf-8")
    # with a wheel file in place of the dot, as the pages allow
    pip(programs, ROOT, INSTALLS["service"].replace(".", str(wheel), 1), PIP_NO_INDEX="1")
    return programs


@pytest.fixture(scope="module")
def service(full: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service with every extra."""
    log = tmp_path_factory.mktemp("service") / "log.jsonl"
    with running([str(full / "mumacro"), "serve", "--port", "0"], log, PYTHONPATH="") as process:
        process.wait_until_ready()
        yield process.url


@pytest.fixture
def reader(tmp_path: Path) -> Path:
    """A folder with the files of cases and of measured points that the commands name."""
    import pandas as pd

    cases = pd.DataFrame({**CASE, "v0": [1e-3, 1e-2]})
    cases.to_csv(tmp_path / "cases.csv", index=False)
    cases.to_csv(tmp_path / "german.csv", index=False, sep=";", decimal=",")
    table = cases.to_csv(index=False, sep="\t")
    (tmp_path / "rig.txt").write_text(f"Rig 7\nRun 1\n\n{table}", "utf-8")
    cases.to_excel(tmp_path / "cases.xlsx", index=False)
    cases.to_parquet(tmp_path / "cases.parquet")
    (tmp_path / "runs").mkdir()
    cases.to_parquet(tmp_path / "runs" / "one.parquet")
    v0 = np.geomspace(1e-3, 1.0, 8)
    mu = [0.162, 0.197, 0.242, 0.268, 0.283, 0.294, 0.302, 0.299]
    pd.DataFrame({"v0": v0, "mu_macro": mu}).to_csv(tmp_path / "measured.csv", index=False)
    x = 5e-6 * np.sin(np.linspace(0.0, 4.0 * np.pi, 200))
    pd.DataFrame({"x": x, "Ft": np.clip(2e6 * x, -3.0, 3.0)}).to_csv(
        tmp_path / "loop.csv", index=False
    )
    return tmp_path


# --- running --------------------------------------------------------------------------------------


@posix
@pytest.mark.slow
@pytest.mark.parametrize("where", ["bare", "full"])
def test_python_sessions(where: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    programs, words = request.getfixturevalue(where), list[Path]()
    for page in having("pycon"):
        if (page.stem in BARE) == (where == "bare"):
            file = tmp_path / name(page).replace("/", "-") / "session.txt"
            file.parent.mkdir()
            session = "\n".join(block.text for block in blocks(page, "pycon") if not block.marked)
            file.write_text(session, "utf-8")
            # a newcomer is still in the folder from which it was installed
            words += [request.getfixturevalue("clone") if where == "bare" else file.parent, file]
    assert words
    run(programs, tmp_path, programs / "python", "-c", SESSIONS, *words)


def number_parts(text: str) -> tuple[list[str], list[str]]:
    return NUMBER.sub("#", text).split(), NUMBER.findall(text)


def last_place(number: str) -> float:
    """What one unit is in the last digit of a printed number."""
    digits, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))


def test_a_number_of_the_guide_has_a_last_place() -> None:
    assert [last_place(text) for text in ("8.444e-16", "0.2400", "-12", "1e-12")] == [
        1e-19,
        1e-4,
        1.0,
        1e-12,
    ]


@pytest.mark.parametrize("page", having(*SHELL), ids=name)
def test_no_page_shows_digits_that_depend_on_the_processor(page: Path) -> None:
    shown = (shown for block in blocks(page, "console") for _, shown in block.entries())
    numbers = (number for text in shown for number in NUMBER.findall(text))
    digits = (
        (number.partition("e")[0].replace(".", "").lstrip("-0"), number) for number in numbers
    )
    assert [number for mantissa, number in digits if len(mantissa) > 12] == []


def compare(output: str, shown: str, command: str) -> None:
    """What a command printed, with what the page shows."""
    (words, numbers), (shown_words, shown_numbers) = number_parts(output), number_parts(shown)
    assert words == shown_words, f"{command}\n{output}"
    for number, shown_number in zip(numbers, shown_numbers, strict=True):
        # the last of sixteen digits depend on the processor
        expected = close(float(shown_number), rel=1e-9, abs=1.01 * last_place(shown_number))
        assert float(number) == expected, f"{command}\n{output}"


def serve(programs: Path, log: Path, command: str) -> None:
    """A command that runs until a signal: it gets ready, and ends with 0."""
    for theirs, ours in HERE:
        command = re.sub(theirs, ours, command)
    path = f"{programs}{os.pathsep}/usr/bin{os.pathsep}/bin"
    words = ["sh", "-c", f"exec env {command}"]
    with running(words, log, PATH=path, PYTHONPATH="", MUMACRO_PORT="0") as process:
        process.wait_until_ready()
        assert process.stop() == 0


@posix
@pytest.mark.slow
@pytest.mark.parametrize("page", having(*SHELL), ids=name)
def test_commands(page: Path, reader: Path, request: pytest.FixtureRequest) -> None:
    for program in blocks(page, "c"):
        (reader / "program.c").write_text(program.text, "utf-8")
    entries = [
        entry for block in blocks(page, *SHELL) if not block.marked for entry in block.entries()
    ]
    for line, shown in entries:
        command, more = plain(line), {}
        if command in ELSEWHERE or command in INSTALLS.values():
            continue
        in_checkout = "dev.py" in command
        runs_until_a_signal = re.search(r"\bserve\b(?! healthcheck)", command) is not None
        if SERVICE in command or "healthcheck" in command:
            if shutil.which("curl") is None:
                pytest.skip("curl is not installed")
            url = request.getfixturevalue("service")
            command, more = command.replace(SERVICE, url), {"MUMACRO_PORT": url.rpartition(":")[2]}
        bare = page.stem in BARE and not runs_until_a_signal
        if in_checkout:
            programs, folder = Path(sys.executable).parent, ROOT
        elif bare:
            programs, folder = request.getfixturevalue("bare"), request.getfixturevalue("clone")
        else:
            programs, folder = request.getfixturevalue("full"), reader
        if runs_until_a_signal:
            serve(programs, reader / "log.jsonl", command)
            continue
        output = run(programs, folder, "sh", "-c", command, **more)
        if shown:
            compare(output, shown, command)


@posix
@pytest.mark.slow
def test_every_entrance_works_in_the_folder_from_which_it_was_installed(
    clone: Path, bare_with_packages: Path, tmp_path: Path
) -> None:
    programs = bare_with_packages
    assert not list(clone.rglob("_kernel.*"))
    places = "import mumacro, builder, service; print(mumacro.__file__, builder.__file__)"
    library, builder = run(programs, clone, "python", "-c", places).split()
    assert Path(library).is_relative_to(programs.parent)
    assert Path(builder).is_relative_to(clone)
    words = ["python", "-m", "builder", "solve", "--v", "0.1", "--y", "0.5"]
    # not compiled, which takes longer than one solve
    solved = json.loads(run(programs, clone, *words, NUMBA_DISABLE_JIT="1"))
    assert solved["regime"] == "stick_slip"
    shown = run(programs, clone, "mumacro", "mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20e3 v0=0.01", "--json")
    for words in (["mumacro", "serve"], ["python", "-m", "service"]):
        command = [str(programs / words[0]), *words[1:], "--port", "0"]
        with running(command, tmp_path / "log.jsonl", cwd=clone, PYTHONPATH="") as server:
            server.wait_until_ready()
            query = "mu0=0.3&Fz=10&k=1e6&y0=2e-6&f=20e3&v0=0.01"
            answer = run(programs, clone, "curl", "-s", f"{server.url}/v1/mu-macro?{query}")
            assert json.loads(answer)["mu_macro"] == json.loads(shown)["mu_macro"]
