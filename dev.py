#!/usr/bin/env python3
"""Commands that need an environment: demo, tests, checks, documentation, service, locks.

    python3 dev.py demo            start the service, send it one request, stop it
    python3 dev.py test [ARGS]     every check, then every test (ARGS go to pytest)
    python3 dev.py test --quick    every check, then the tests that are not marked slow
    python3 dev.py check           the checks without pytest
    python3 dev.py docs            build the documentation as a site, into build/docs
    python3 dev.py serve [ARGS]    run the service until a signal stops it
    python3 dev.py wheels          the wheel of every platform and the source distribution, checked, in dist
    python3 dev.py page            the page as a folder for any static host, in build/page; needs zig, or clang and lld
    python3 dev.py exec CMD [ARGS] run one command inside the development environment
    python3 dev.py lock [ARGS]     pin the dependencies again (ARGS, e.g. --upgrade, go to uv)

Needs Python 3.11 or newer and nothing else.  The rest is installed into ``.venv`` beside this file, with versions and
hashes from ``requirements/``; that includes zig where no C compiler works.  An environment is used again as long as
its lock files are unchanged; the kernel, ``mumacro/_kernel.so``, is compiled again when its sources change.
"""

from __future__ import annotations

import contextlib
import hashlib
import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
MARKER = VENV / "mumacro-installed.json"

OLDEST = (3, 11)
NEWER_NAMES = ("python3.13", "python3.12", "python3.11")

# An environment is made from these locks.  dev.txt holds all of build and service at the same versions, so that an
# environment for "dev" can stand in for one for "service".  zig.txt is added where a compiler is missing.
SETS = {"service": ("build", "service"), "dev": ("dev",)}
LOCKS = ("dev", "service", "build", "zig")  # in the order of making: the first constrains the others
UV = "uv==0.13.8"  # pins the resolver too: two people who lock on the same day get the same file

CASE = {"mu0": "0.3", "Fz": "10", "k": "1e6", "y0": "2e-6", "omega": "1.3e5", "v0": "0.01"}
UNITS = {"mu0": "-", "Fz": "N", "k": "N/m", "y0": "m", "omega": "rad/s", "v0": "m/s"}
READY_S = 120.0
STOP_S = 20.0


class FailedError(Exception):
    """A failure with a complete message for the user."""


# --- environment --------------------------------------------------------------------------------------


def run(*command: str | Path, env: dict[str, str] | None = None, quiet: bool = False) -> int:
    """Run one command from the root of the project and return its exit code.

    With `quiet`, its output is held back and shown only when it fails.
    """
    words = [str(word) for word in command]
    out = subprocess.PIPE if quiet else None
    done = subprocess.run(  # noqa: S603 - every command is written in this file or typed by its user
        words, cwd=ROOT, env=env, stdout=out, stderr=subprocess.STDOUT if quiet else None, text=True, check=False
    )
    if quiet and done.returncode:
        print(done.stdout, file=sys.stderr, flush=True)
    return done.returncode


def works(python: str | Path) -> bool:
    """Whether that interpreter starts; a name on the PATH or a link in ``.venv`` may be broken."""
    try:
        done = subprocess.run([str(python), "-c", ""], capture_output=True, check=False)  # noqa: S603 - fixed words
    except OSError:
        return False
    return done.returncode == 0


def environment() -> dict[str, str]:
    """The environment variables with ``.venv`` first; without those that would add other packages."""
    env = {name: value for name, value in os.environ.items() if name not in ("PYTHONHOME", "PYTHONPATH")}
    env["VIRTUAL_ENV"] = str(VENV)
    env.setdefault("ZIG_GLOBAL_CACHE_DIR", str(VENV / "zig"))
    env["PATH"] = f"{BIN}{os.pathsep}{env.get('PATH', os.defpath)}"
    return env


def lock_path(name: str) -> Path:
    return ROOT / "requirements" / f"{name}.txt"


def digest(*paths: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()


def current() -> dict[str, str]:
    """Digests of what each part of ``.venv`` is made from: two sets of locks, the kernel and its sources."""
    kernel = sorted([*(ROOT / "mumacro" / "kernel").glob("*.[ch]"), *(ROOT / "mumacro").glob("_kernel.*")])
    return {
        **{name: digest(*map(lock_path, locks)) for name, locks in SETS.items()},
        "kernel": digest(ROOT / "hatch_build.py", *kernel),
    }


def installed() -> dict[str, str]:
    """The parts that ``.venv`` holds and that are current; empty if it is absent, broken or incomplete."""
    try:
        marker = json.loads(MARKER.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return dict(marker.items() & current().items()) if isinstance(marker, dict) and works(PYTHON) else {}


def pip_install(*arguments: str | Path) -> None:
    # Without compiling: Python compiles files on import, only a third of them.
    pip = (PYTHON, "-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--no-compile")
    if run(*pip, *arguments, env=environment(), quiet=True):
        raise FailedError(f"pip could not install {' '.join(map(str, arguments))} (see above)")


def install_locks(*names: str) -> None:
    """Install exactly what the locks pin."""
    print(f"Installing requirements/{' and '.join(names)}.txt", flush=True)
    pip_install("--require-hashes", *(word for name in names for word in ("-r", lock_path(name))))


def install_project() -> None:
    """Install the project in place, which compiles its kernel.

    Without isolation: the build backend is among the pins, so nothing unpinned is downloaded.  What it needs on this
    machine it says itself, as it would say to pip: zig, where no compiler works.
    """
    question = "import hatchling.build; print(*hatchling.build.get_requires_for_build_editable())"
    asked = subprocess.run(  # noqa: S603 - our own interpreter and words
        [str(PYTHON), "-c", question], cwd=ROOT, env=environment(), stdout=subprocess.PIPE, text=True, check=False
    )
    if asked.returncode:
        raise FailedError("the build backend could not be asked for its requirements (see above)")
    if "ziglang" in asked.stdout:
        install_locks("zig")
    print("Compiling the kernel", flush=True)
    pip_install("--no-deps", "--no-build-isolation", "-e", ".")


def ensure(set_name: str) -> None:
    """Install the locked set into ``.venv`` and compile the kernel; do nothing if both are there already."""
    started = time.monotonic()
    have = installed()
    complete = set_name in have or "dev" in have
    if complete and "kernel" in have:
        return
    MARKER.unlink(missing_ok=True)
    if not complete:
        if not have.keys() & SETS.keys():  # absent, or made from older locks: packages that they dropped must go too
            print(f"Making {VENV} with Python {sys.version.split()[0]}", flush=True)
            if run(sys.executable, "-m", "venv", "--clear", VENV, quiet=True):
                raise FailedError(
                    "Python could not make a virtual environment (see above).\n"
                    "Debian and Ubuntu keep that in a package of its own: apt-get install python3-venv"
                )
        install_locks(*SETS[set_name])
    install_project()
    names = {set_name, "kernel", *have}
    MARKER.write_text(json.dumps({name: made for name, made in current().items() if name in names}), encoding="utf-8")
    print(f"Installed in {time.monotonic() - started:.0f} s", flush=True)


# --- demo and serve -----------------------------------------------------------------------------------


def ask(port: int, path: str) -> tuple[int, str]:
    """GET `path` from the local service; http.client because it never goes through a proxy."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    try:
        connection.request("GET", path, headers={"Accept": "application/json"})
        reply = connection.getresponse()
        return reply.status, reply.read().decode("utf-8", "replace")
    finally:
        connection.close()


def wait_until_ready(server: subprocess.Popen[bytes], port: int) -> float:
    """Poll /readyz; return the seconds it took."""
    started = time.monotonic()
    while (seconds := time.monotonic() - started) < READY_S:
        if server.poll() is not None:
            raise FailedError(f"The service ended by itself with exit code {server.returncode}")
        with contextlib.suppress(OSError, http.client.HTTPException):
            if ask(port, "/readyz")[0] == 200:
                return seconds
        time.sleep(0.1)
    raise FailedError(f"The service was not ready after {READY_S:.0f} s")


def stop(server: subprocess.Popen[bytes]) -> None:
    server.terminate()
    try:
        server.wait(STOP_S)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()


def demo() -> int:
    """Start the service on a free loopback port, send one request, stop it."""
    ensure("service")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    # The demo uses the defaults, not the settings of the user's shell.
    env = {name: value for name, value in environment().items() if not name.startswith("MUMACRO_")}
    env |= {"MUMACRO_HOST": "127.0.0.1", "MUMACRO_PORT": str(port)}
    print("Starting", flush=True)
    with tempfile.TemporaryFile() as log:
        server = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            [str(PYTHON), "-m", "service"], cwd=ROOT, env=env, stdin=subprocess.DEVNULL, stdout=log, stderr=log
        )
        try:
            seconds = wait_until_ready(server, port)
            print(f"The service is ready on port {port} after {seconds:.1f} s\n")
            path = f"/v1/mu-macro?{urlencode(CASE)}"
            print("Question: " + ", ".join(f"{name} = {value} [{UNITS[name]}]" for name, value in CASE.items()))
            print(f"GET http://127.0.0.1:{port}{path}")
            status, body = ask(port, path)
            if status != 200:
                raise FailedError(f"The service answered {status}: {body}")
            answer = json.loads(body)
            print(json.dumps(answer, indent=2))
            if not 0.0 <= float(answer["mu_macro"]) <= float(CASE["mu0"]):
                raise FailedError("That answer cannot be right: mu_macro lies between 0 and mu0")
            print(f"Answer:   mu_macro = {answer['mu_macro']:.12g} [-]\n")
        except BaseException:
            log.seek(0)
            tail = log.read().decode("utf-8", "replace").splitlines()[-30:]
            print("--- last lines of the service's log", *tail, "---", sep="\n", file=sys.stderr)
            raise
        finally:
            stop(server)
    start = f"{Path(sys.executable).stem} dev.py serve"
    print(f"The service is stopped.  To start it for good, on port 8000:  {start}")
    return 0


def serve(arguments: list[str]) -> int:
    """Run the service in the foreground; it receives the signals itself."""
    ensure("service")
    command = [str(PYTHON), "-m", "service", *arguments]
    os.chdir(ROOT)
    if os.name != "nt":
        os.execve(PYTHON, command, environment())  # noqa: S606 - replaces this process on purpose
    return run(*command, env=environment())


# --- checks and tests ---------------------------------------------------------------------------------


def stale_locks() -> list[str]:
    """The lock files that were made from other requirements than those of pyproject.toml now."""
    return [name for name in LOCKS if f"# inputs: {inputs_digest()}" not in lock_path(name).read_text("utf-8")]


def docs_command(folder: str | Path) -> tuple[str | Path, ...]:
    """Build the site into a folder; a warning, such as a broken link, is an error."""
    return BIN / "sphinx-build", "-W", "--keep-going", "-q", "docs", folder


def docs() -> int:
    ensure("dev")
    code = run(*docs_command("build/docs"), env=environment())
    print("The site is in build/docs: open build/docs/index.html" if code == 0 else "FAILED: see above")
    return code


def page() -> int:
    """Make the page that computes in the browser from the table of 1e-7: a folder for any static host."""
    ensure("dev")
    table, module, folder = "tables/mumacro-1e-7.nc", "build/mumacro.wasm", "build/page"
    (ROOT / "build").mkdir(exist_ok=True)
    python = (PYTHON, "-m")
    export = (*python, "builder", "export", table, "--format", "wasm", "--out", module)
    code = run(*export, env=environment(), quiet=True)
    code = code or run(*python, "builder.export_page", table, module, folder, env=environment())
    print(f"The page is in {folder}; try it:  python3 -m http.server -d {folder}" if code == 0 else "FAILED")
    return code


def passes(title: str, tool: str | Path, *arguments: str | Path, **variables: str) -> bool:
    """Run one check of the environment's tools, then print its output at once."""
    words, env = [str(BIN / tool), *map(str, arguments)], environment() | variables
    done = subprocess.run(  # noqa: S603 - every command is written in this file
        words, cwd=ROOT, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    print(f"--- {title}\n{done.stdout}", end="", flush=True)
    return done.returncode == 0


def packages_pass(folder: Path, platforms: Iterable[str]) -> bool:
    """Build the source distribution and the wheel of each platform into a folder, and check them."""
    good = passes("source distribution", "hatchling", "build", "-t", "sdist", "-d", folder)
    for name in platforms:
        title = f"wheel for {name or 'this machine'}"
        good &= passes(title, "hatchling", "build", "-t", "wheel", "-d", folder, MUMACRO_BUILD_PLATFORM=name)
    wheels = sorted(folder.glob("*.whl"))
    good &= passes("twine", "twine", "check", "--strict", *folder.iterdir())
    good &= passes("check-wheel-contents", "check-wheel-contents", *wheels)
    for wheel in wheels if sys.platform == "linux" else ():
        if "linux" in wheel.name:
            # a folder without libraries: those of this machine must not count
            good &= passes(f"auditwheel {wheel.name}", "auditwheel", "show", "--ldpaths", folder, wheel)
    return good


def in_a_folder(check: Callable[[Path], bool]) -> bool:
    """Run a check that writes files, in a folder that ends with it."""
    with tempfile.TemporaryDirectory() as folder:
        return check(Path(folder))


def wheels() -> int:
    """Build what is published: the wheel of every platform, by zig, and the source distribution."""
    ensure("dev")
    install_locks("zig")
    folder = ROOT / "dist"
    shutil.rmtree(folder, ignore_errors=True)
    good = not docs() and packages_pass(folder, project_table()["tool"]["mumacro"]["wheels"])
    print("The wheels are in dist" if good else "FAILED: see above")
    return not good


def failed_checks() -> list[str]:
    """Run every check but pytest, one on each processor; return the names of those that failed."""
    if stale := stale_locks():
        raise FailedError(
            f"requirements/{' and '.join(stale)}.txt no longer match pyproject.toml: run python3 dev.py lock"
        )
    ensure("dev")
    tables = sorted((ROOT / "tables").glob("*.nc"))
    if not tables:
        raise FailedError("no *.nc in tables/")
    commands: dict[str, tuple[str | Path, ...]] = {
        "mypy": ("mypy",),
        "mypy of dev.py": ("mypy", "dev.py", "hatch_build.py"),
        "CF conventions": ("compliance-checker", "--test=cf:1.11", *tables),
        "ruff check": ("ruff", "check", "."),
        "ruff format": ("ruff", "format", "--check", "."),
        "import-linter": ("lint-imports",),
        "validate-pyproject": ("validate-pyproject", "pyproject.toml"),
        "codespell": ("codespell",),
        "interrogate": ("interrogate", "mumacro", "builder", "service"),
        "sp-repo-review": ("sp-repo-review", "--show", "err", "."),
    }
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # the longest first
        results = {
            "documentation": pool.submit(in_a_folder, lambda folder: passes("documentation", *docs_command(folder))),
            "packages": pool.submit(in_a_folder, lambda folder: packages_pass(folder, [""])),
        }
        results |= {title: pool.submit(passes, title, *words) for title, words in commands.items()}
    return [title for title, result in results.items() if not result.result()]


def check() -> int:
    failed = failed_checks()
    print(f"FAILED: {', '.join(failed)}" if failed else "All checks passed")
    return len(failed)


def test(arguments: list[str]) -> int:
    """Run the checks, then pytest.

    Without ``--quick`` the slow tests run too: an empty ``-m`` replaces the ``-m`` of pyproject.toml.  Every
    processor runs a file at a time; ``-n 0`` among ARGS keeps them in one process.
    """
    failed = failed_checks()
    print("--- pytest", flush=True)
    chosen = [word for word in arguments if word != "--quick"]
    which = () if len(chosen) < len(arguments) else ("-m", "")
    code = run(PYTHON, "-m", "pytest", "-n", "auto", "--dist", "loadfile", *which, *chosen, env=environment())
    if failed:
        print(f"FAILED before pytest: {', '.join(failed)}", file=sys.stderr)
    return code or len(failed)


# --- lock ---------------------------------------------------------------------------------------------


def project_table() -> dict[str, Any]:
    import tomllib  # not at the top: an interpreter without it must still reach the message in main()

    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


def inputs_digest() -> str:
    """Digest of everything in pyproject.toml that the locks depend on; it is in their second line."""
    table = project_table()
    project = table["project"]
    names = ("requires-python", "dependencies", "optional-dependencies")
    inputs = [table["build-system"]["requires"], table["tool"]["mumacro"]["zig"], *(project[name] for name in names)]
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()[:16]


def lock(arguments: list[str]) -> int:
    """Write requirements/dev.txt, then the others at its versions.

    ``--universal`` keeps one file right for every platform and every Python from 3.11 on.  No index is
    named in the result: the installing machine chooses it.
    """
    with tempfile.TemporaryDirectory() as folder:
        venv = Path(folder) / "venv"
        bin_ = venv / BIN.name
        if run(sys.executable, "-m", "venv", venv, quiet=True):
            raise FailedError("Python could not make a virtual environment (see above)")
        if run(bin_ / PYTHON.name, "-m", "pip", "--disable-pip-version-check", "install", UV, quiet=True):
            raise FailedError(f"pip could not install {UV} (see above)")
        build, zig = Path(folder) / "build.in", Path(folder) / "zig.in"
        # hatchling needs editables to install in place.
        build.write_text("\n".join([*project_table()["build-system"]["requires"], "editables"]), "utf-8")
        zig.write_text(project_table()["tool"]["mumacro"]["zig"], "utf-8")
        sources: dict[str, list[str | Path]] = {
            "dev": ["pyproject.toml", "--extra", "dev", build],
            "service": ["pyproject.toml", "--extra", "service", "--constraint", lock_path("dev")],
            "build": [build, "--constraint", lock_path("dev")],
            "zig": [zig],
        }
        for name in LOCKS:
            out = Path(folder) / f"{name}.txt"
            if lock_path(name).exists():
                shutil.copyfile(lock_path(name), out)  # uv keeps the pins it finds there
            command: list[str | Path] = [
                *(bin_ / "uv", "pip", "compile", "--universal", "--python-version", ".".join(map(str, OLDEST))),
                *("--generate-hashes", "--no-annotate", "--no-header", "--quiet"),
                *("--no-emit-index-url", "--no-emit-find-links"),
                *("--output-file", out, *arguments, *sources[name]),
            ]
            if run(*command):
                raise FailedError(f"uv could not resolve {name} (see above)")
            pins = out.read_text("utf-8")
            if "://" in pins or "file:" in pins or " @ " in pins:
                raise FailedError(f"the lock for {name} names a place to download from; it must not")
            header = f"# Pinned by: python3 dev.py lock\n# inputs: {inputs_digest()}\n"
            body = "".join(line for line in pins.splitlines(keepends=True) if not line.startswith("#"))
            lock_path(name).parent.mkdir(exist_ok=True)
            lock_path(name).write_text(header + body, encoding="utf-8", newline="\n")
            print(f"{lock_path(name).relative_to(ROOT)}: {body.count('==')} pins, {body.count('--hash')} hashes")
    return 0


def execute(command: list[str]) -> int:
    """Run any command in the development environment."""
    ensure("dev")
    found = shutil.which(command[0], path=environment()["PATH"])
    return run(found or command[0], *command[1:], env=environment())


# --- command line -------------------------------------------------------------------------------------


def use_a_newer_python() -> None:
    """On an interpreter that is too old, continue in a newer one if the machine has it."""
    for name in NEWER_NAMES:
        other = shutil.which(name)
        if other and works(other):
            raise SystemExit(run(other, Path(__file__).resolve(), *sys.argv[1:]))
    version = ".".join(map(str, sys.version_info[:3]))
    raise FailedError(f"Python 3.11 or newer is needed; this is {version}, and no newer one is on the PATH")


ALONE = {"demo": demo, "check": check, "docs": docs, "page": page, "wheels": wheels}
WITH_ARGUMENTS = {"test": test, "serve": serve, "exec": execute, "lock": lock}


def main(arguments: list[str]) -> int:
    """Run the command that the first argument names; 2 if it is unknown."""
    word, rest = (arguments[0], arguments[1:]) if arguments else ("", [])
    try:
        if sys.version_info < OLDEST:
            use_a_newer_python()
        if word in ALONE and not rest:
            return ALONE[word]()
        if word in WITH_ARGUMENTS and (rest or word != "exec"):
            return WITH_ARGUMENTS[word](rest)
    except FailedError as error:
        print(f"dev.py {word}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    print(__doc__)
    return 0 if word in ("-h", "--help", "help") else 2


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
