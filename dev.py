#!/usr/bin/env python3
"""Commands that need an environment.

    python3 dev.py demo            start the service, send it one request, stop it
    python3 dev.py test [ARGS]     every check, then the tests that are not slow; --all adds those
                                   marked slow, .ci/peers those marked peer; --nightly runs the
                                   longer forms of some alone; ARGS go to pytest
    python3 dev.py check           the checks without pytest
    python3 dev.py docs            build the documentation as a site, into build/docs
    python3 dev.py serve [ARGS]    run the service until a signal stops it
    python3 dev.py wheels          the wheels of all platforms and the source distribution, checked
    python3 dev.py exec CMD [ARGS] run one command inside the development environment
    python3 dev.py lock [ARGS]     pin the dependencies again (ARGS, e.g. --upgrade, go to uv)

Needs Python 3.11 or newer and nothing else: the rest is installed into ``.venv`` beside this file,
as pinned in ``requirements/``, and again when these files or the kernel's sources change.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = str(BIN / ("python.exe" if os.name == "nt" else "python"))
MARKER = VENV / "mumacro-installed.json"
OLDEST, NEWER_NAMES = (3, 11), ("python3.13", "python3.12", "python3.11")
# Each set holds those before it, at the same versions; zig.txt is added where a compiler is
# missing.
SETS = {
    "service": ("build", "service"),
    "docs": ("build", "service", "docs"),
    "test": ("test", "docs"),
    "tools": ("test", "docs", "tools"),
}
#: what pytest's -m is for each option of the tests
MARKS = {
    "--all": ("-m", "not nightly and not peer"),
    "--nightly": ("-m", "nightly and not peer"),
}


class FailedError(Exception):
    """A failure with a complete message for the user."""


def environment() -> dict[str, str]:
    """The environment variables with ``.venv`` first, without those that would add other packages;
    caches are in it."""
    # without compiled modules kept there, each of hundreds of processes would compile up to 3,000
    # again
    env = {
        k: v
        for k, v in os.environ.items()
        if k not in ("PYTHONHOME", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE")
    }
    env |= {"VIRTUAL_ENV": str(VENV), "PATH": f"{BIN}{os.pathsep}{env.get('PATH', os.defpath)}"}
    return {
        "MUMACRO_BUILD_CACHE": str(VENV / "kernel"),
        "ZIG_GLOBAL_CACHE_DIR": str(VENV / "zig"),
        "NUMBA_CACHE_DIR": str(VENV / "numba"),
        "PYTHONPYCACHEPREFIX": str(VENV / "bytecode"),
        **env,
    }


def run(*command: str | Path, quiet: bool = False) -> int:
    """Run a command from the root and return its exit code; ``quiet``: its output is shown only
    when it fails."""
    env = environment()
    words = [shutil.which(command[0], path=env["PATH"]) or command[0], *map(str, command[1:])]
    out, err = (subprocess.PIPE, subprocess.STDOUT) if quiet else (None, None)
    done = subprocess.run(  # noqa: S603
        words, cwd=ROOT, env=env, stdout=out, stderr=err, text=True, check=False
    )
    if quiet and done.returncode:
        print(done.stdout, file=sys.stderr, flush=True)
    return done.returncode


def digest(*paths: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()


def current() -> dict[str, str]:
    """Digests of what each part of ``.venv`` is made from: sets of locks, the kernel and its
    sources."""
    kernel = sorted(
        [
            *(ROOT / "src" / "mumacro" / "kernel").glob("*.[ch]"),
            *(ROOT / "src" / "mumacro" / "kernel").glob("_declarations.py"),
            *(ROOT / "src" / "mumacro").glob("_kernel.*"),
        ]
    )
    locks = {
        key: digest(*(ROOT / "requirements" / f"{name}.txt" for name in names))
        for key, names in SETS.items()
    }
    return {**locks, "kernel": digest(ROOT / "hatch_build.py", *kernel)}


def installed() -> dict[str, str]:
    """The parts that ``.venv`` holds and that are current; empty if it is absent, broken or
    incomplete."""
    try:
        parts = json.loads(MARKER.read_text(encoding="utf-8"))
        # a link may be broken
        works = subprocess.run([PYTHON, "-c", ""], check=False).returncode == 0  # noqa: S603
    except (OSError, ValueError):
        return {}
    if not isinstance(parts, dict) or not works:
        return {}
    valid = dict(parts.items() & current().items())
    old = parts.keys() & SETS.keys() - valid.keys()  # packages that newer locks dropped must go too
    return {name: checksum for name, checksum in valid.items() if not old or name not in SETS}


def pip(*arguments: str) -> None:
    """Install packages: by uv where it is on the PATH, else, or where it cannot, by pip.

    uv links the files of a package from its cache, so that a second environment costs nothing.  It
    does not read pip's settings, such as the address of another index.
    """
    if uv := shutil.which("uv"):
        words = ("pip", "install", "--quiet", "--no-progress", "--python", PYTHON, *arguments)
        if run(uv, *words, quiet=True) == 0:
            return
        print("uv could not install (see above); pip tries", file=sys.stderr, flush=True)
    # Without compiling: Python compiles files on import, only a third of them.
    if run(
        PYTHON, "-m", "pip", "-q", "--no-input", "install", "--no-compile", *arguments, quiet=True
    ):
        raise FailedError(f"pip could not install {' '.join(arguments)} (see above)")


def install_locks(*names: str) -> None:
    """Install exactly what the locks pin."""
    print(f"Installing requirements/{' and '.join(names)}.txt", flush=True)
    pip(
        "--require-hashes", *(word for name in names for word in ("-r", f"requirements/{name}.txt"))
    )


def ensure(set_name: str = "tools") -> None:
    """Install the locked set into ``.venv`` and compile the kernel; do nothing if both are there
    already."""
    have = installed()
    complete = any(name in have for name in list(SETS)[list(SETS).index(set_name) :])
    if complete and "kernel" in have:
        return
    MARKER.unlink(missing_ok=True)
    if not complete:
        # absent, or made from older locks: packages that they dropped must go too
        if not have.keys() & SETS.keys():
            print(f"Making {VENV} with Python {sys.version.split()[0]}", flush=True)
            if run(sys.executable, "-m", "venv", "--clear", VENV, quiet=True):
                raise FailedError(
                    "no virtual environment (see above); Debian has apt-get install python3-venv "
                    "for it"
                )
        install_locks(*SETS[set_name])
    # without isolation: the build backend is among the pins; what it needs on this machine it says
    # itself
    needed = "hatchling.build.get_requires_for_build_editable()"
    if (
        run(PYTHON, "-c", f"import hatchling.build; raise SystemExit(7 * ('zig' in str({needed})))")
        == 7
    ):
        install_locks("zig")
    print("Compiling the kernel", flush=True)
    pip("--no-deps", "--no-build-isolation", "-e", ".")
    names = {set_name, "kernel", *have}
    MARKER.write_text(
        json.dumps({name: checksum for name, checksum in current().items() if name in names}),
        encoding="utf-8",
    )


def check() -> int:
    """Run the checks of pyproject.toml, one on each processor; returns how many failed."""
    # not at the top: an interpreter without it must still reach the message in main()
    import tomllib

    ensure()
    checks = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["mumacro"][
        "checks"
    ]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        codes = pool.map(lambda words: run(*words.split(), quiet=True), checks.values())
        failed = [name for name, code in zip(checks, codes, strict=True) if code]
    print(f"FAILED: {', '.join(failed)}" if failed else "All checks passed", flush=True)
    return len(failed)


def test(*arguments: str) -> int:
    """Another ``-m`` replaces that of pyproject.toml; every processor runs a file at a time, with
    ``-n 0`` one."""
    failed = check()
    marks = [word for option in arguments for word in MARKS.get(option, ())]
    chosen = [*marks, *(word for word in arguments if word not in MARKS)]
    spread = ("-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder")  # see tests/conftest.py
    return run(PYTHON, "-m", "pytest", *spread, *chosen) or failed


def demo() -> int:
    ensure("service")
    return run(PYTHON, "examples/demo.py")


def serve(*arguments: str) -> int:
    """The page's guide is built first; only what has changed is built again."""
    docs()
    os.chdir(ROOT)
    if os.name != "nt":  # the service receives the signals itself
        os.execve(PYTHON, [PYTHON, "-m", "service", *arguments], environment())  # noqa: S606
    return run(PYTHON, "-m", "service", *arguments)


def execute(*command: str) -> int:
    ensure("test" if command[:1] in (("pytest",), ("python",)) else "tools")
    return run(*command)


def docs() -> int:
    ensure("docs")
    code = run("sphinx-build", "-W", "--keep-going", "-q", "docs", "build/docs")
    if not code:
        print(f"The site is in {ROOT / 'build' / 'docs' / 'index.html'}", flush=True)
    return code


def wheels() -> int:
    ensure()
    install_locks("zig")
    return docs() or run(PYTHON, "deploy/packages.py", "dist", "--all")  # the wheel holds the guide


COMMANDS: dict[str, Callable[..., int]] = {
    **{command.__name__: command for command in (demo, test, check, docs, serve, wheels)},
    "exec": execute,
    "lock": partial(run, sys.executable, "requirements/lock.py"),
}


def main(word: str = "", *rest: str) -> int:
    """Run the command that the first argument names; 2 if it is unknown."""
    takes_arguments = word in ("test", "serve", "exec", "lock")
    if (
        word not in COMMANDS
        or (rest and not takes_arguments)
        or (word != "exec" and "--help" in rest)
    ):
        print(__doc__)
        return 0 if "--help" in (word, *rest) or word in ("-h", "help") else 2
    if sys.version_info < OLDEST:
        for name in filter(shutil.which, NEWER_NAMES):
            return run(name, __file__, word, *rest)
        raise FailedError("Python 3.11 or newer is needed, and none is on the PATH")
    return COMMANDS[word](*rest)


if __name__ == "__main__":
    try:
        raise SystemExit(main(*sys.argv[1:]))
    except FailedError as error:
        raise SystemExit(f"dev.py: {error}") from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None
