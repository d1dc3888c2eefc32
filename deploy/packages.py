"""Build the source distribution and wheels into a folder, and check them.

    python deploy/packages.py FOLDER [--all]

One wheel, of this machine; with ``--all`` one of every platform in pyproject.toml, by zig.
"""

import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def run(platform: str, *words: str | Path) -> None:
    """One command, which must succeed; ``platform``: of the wheel that it builds."""
    print("---", *words, platform, flush=True)
    env = {**os.environ, "MUMACRO_BUILD_PLATFORM": platform}
    subprocess.run(words, cwd=ROOT, env=env, check=True)  # noqa: S603


def build(folder: Path, platforms: Iterable[str]) -> None:
    """Everything in the folder is new."""
    shutil.rmtree(folder, ignore_errors=True)
    run("", "hatchling", "build", "-t", "sdist", "-d", folder)
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # each compiles in a folder of its own
        list(
            pool.map(
                lambda platform: run(platform, "hatchling", "build", "-t", "wheel", "-d", folder),
                platforms,
            )
        )
    run("", "check-wheel-contents", *folder.glob("*.whl"))
    for wheel in folder.glob("*linux*.whl") if sys.platform == "linux" else ():
        # a folder without libraries: those of this machine must not count
        run("", "auditwheel", "show", "--ldpaths", folder, wheel)


if __name__ == "__main__":
    table = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["mumacro"]
    try:
        build(ROOT / sys.argv[1], table["wheels"] if "--all" in sys.argv else [""])
    except subprocess.CalledProcessError as error:
        raise SystemExit(f"FAILED: {error}") from None
