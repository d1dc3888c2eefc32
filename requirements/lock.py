"""Pin the dependencies of pyproject.toml in the .txt files of this folder, with hashes.

    python requirements/lock.py [ARGS]     write them (ARGS, e.g. --upgrade, go to uv)
    python requirements/lock.py --check    exit code 1 if pyproject.toml has changed since

test.txt is made first and constrains the others.  peers.txt has only what test.txt, docs.txt and
tools.txt lack: it is installed beside them.  npm/package-lock.json pins npm/package.json where
there is npm.  No index is named in the result: the installing machine chooses it.
"""

import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
NPM = FOLDER / "npm"
EXTRAS = ("arrow", "builder", "dask", "figures", "files", "service")  # that tests need
UV = "uv==0.13.8"  # pins the resolver too: two people who lock on the same day get the same file
PROJECT = tomllib.loads((FOLDER.parent / "pyproject.toml").read_text("utf-8"))
BUILD, ZIG = PROJECT["build-system"]["requires"], PROJECT["tool"]["mumacro"]["zig"]
UNUSED = PROJECT["tool"]["mumacro"]["unused"]


def inputs_digest() -> str:
    """Digest of everything that the pins depend on; it is in the second line of every file."""
    names = ("requires-python", "dependencies", "optional-dependencies")
    inputs = [
        BUILD,
        ZIG,
        UNUSED,
        PROJECT["dependency-groups"],
        *(PROJECT["project"][name] for name in names),
    ]
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()[:16]


HEADER = f"# Pinned by: python3 dev.py lock\n# inputs: {inputs_digest()}\n"


def without(pins: str, *names: str) -> str:
    """The pins of packages that none of these files has."""
    held = "".join((FOLDER / f"{name}.txt").read_text("utf-8") for name in names)
    there = {*re.findall(r"^([\w.-]+)==", held, re.MULTILINE)}
    each = re.findall(r"^([\w.-]+)(==.*\n(?: .*\n)*)", pins, re.MULTILINE)
    return "".join(package + rest for package, rest in each if package not in there)


def stale() -> list[str]:
    """The files that were made from other requirements."""
    return [
        path.name for path in FOLDER.glob("*.txt") if not path.read_text("utf-8").startswith(HEADER)
    ]


def stale_npm() -> list[str]:
    """The lock of npm, if it is that of another package.json."""
    wanted, pinned = (
        json.loads((NPM / name).read_text("utf-8"))
        for name in ("package.json", "package-lock.json")
    )
    same = wanted["dependencies"] == pinned["packages"][""]["dependencies"]
    return [] if same else ["npm/package-lock.json"]


def lock_npm() -> None:
    """Write the lock of npm, without the addresses of those who can be paid."""
    npm = shutil.which("npm")
    if npm is None:
        print("npm is not installed: requirements/npm stays as it is")
        return
    options = ("--package-lock-only", "--ignore-scripts", "--no-audit", "--no-fund")
    subprocess.run([npm, "install", *options], cwd=NPM, check=True)  # noqa: S603
    path = NPM / "package-lock.json"
    pins = json.loads(path.read_text("utf-8"))
    for package in pins["packages"].values():
        package.pop("funding", None)
    text = json.dumps(pins, indent=2) + "\n"
    if "://" in text:
        raise SystemExit("the lock of npm names a place to download from; it must not")
    path.write_text(text, encoding="utf-8", newline="\n")
    print(f"requirements/npm: {len(pins['packages']) - 1} pins")


def lock(folder: Path, arguments: list[str]) -> None:
    """Write all files; a file that uv cannot resolve ends the program."""
    venv.create(folder / "venv", with_pip=True)
    (bin_,) = (path for path in (folder / "venv").iterdir() if path.name in ("bin", "Scripts"))
    subprocess.run([bin_ / "python", "-m", "pip", "-q", "install", UV], check=True)  # noqa: S603
    build, zig = folder / "build.in", folder / "zig.in"
    build.write_text("\n".join([*BUILD, "editables"]))  # hatchling needs it to install in place
    zig.write_text(ZIG)
    unused = folder / "unused.txt"
    unused.write_text("\n".join(UNUSED))
    test: list[str | Path] = [
        "pyproject.toml",
        "--group=test",
        *(f"--extra={extra}" for extra in EXTRAS),
        build,
    ]
    within: list[str | Path] = ["--constraint", FOLDER / "test.txt"]
    sources: dict[str, list[str | Path]] = {
        "test": test,
        "docs": ["--group=docs", *within],
        "tools": ["--group=tools", *within, "--constraint", FOLDER / "docs.txt"],
        "service": ["pyproject.toml", "--extra=service", *within],
        "build": [build, *within],
        "zig": [zig],
        "peers": ["--group=peers", *within, "--constraint", FOLDER / "tools.txt"],
    }
    for name, source in sources.items():
        out = folder / f"{name}.txt"
        shutil.copyfile(FOLDER / out.name, out)  # uv keeps the pins it finds there
        options = [
            "--universal",
            "--python-version=3.11",
            "--generate-hashes",
            "--no-annotate",
            "--no-header",
            f"--excludes={unused}",
            "-q",
        ]
        places: list[str | Path] = [
            "--no-emit-index-url",
            "--no-emit-find-links",
            "--output-file",
            out,
        ]
        command: list[str | Path] = [
            bin_ / "uv",
            "pip",
            "compile",
            *options,
            *places,
            *arguments,
            *source,
        ]
        subprocess.run(command, cwd=FOLDER.parent, check=True)  # noqa: S603
        pins = "".join(
            line for line in out.read_text("utf-8").splitlines(True) if not line.startswith("#")
        )
        if "://" in pins or "file:" in pins or " @ " in pins:
            raise SystemExit(f"the lock for {name} names a place to download from; it must not")
        if name == "peers":
            pins = without(pins, "test", "docs", "tools")
        (FOLDER / out.name).write_text(HEADER + pins, encoding="utf-8", newline="\n")
        print(f"requirements/{name}.txt: {pins.count('==')} pins")


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        names = stale() + stale_npm()
        raise SystemExit(
            f"{', '.join(names)}: the dependencies have changed; run python3 dev.py lock"
            if names
            else 0
        )
    with tempfile.TemporaryDirectory() as name:
        lock(Path(name), sys.argv[1:])
    lock_npm()
