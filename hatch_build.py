"""Compile mumacro/kernel into the shared object that the library opens, and parse its declarations:
``python hatch_build.py [FOLDER]``.

Without FOLDER both are made in place.  hatchling calls the class below for wheels and editable
installs.  The compiler is the one that CC names, else cc, clang or gcc, else the package ziglang,
which then becomes a build dependency.  CFLAGS is not read: other flags give other bits.  Three
variables change what is made, or how:

    MUMACRO_BUILD_DEBUG=1             no optimization, with debugger symbols and sanitizers;
                                      needs gcc or clang
    MUMACRO_BUILD_PLATFORM=win_amd64  by zig for one of the platforms in pyproject.toml,
                                      [tool.mumacro.wheels]
    MUMACRO_BUILD_CACHE=FOLDER        keeps each shared object there, for the next build by the same
                                      compiler from the same sources
"""

import functools
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import platform_tags

ROOT = Path(__file__).resolve().parent
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["mumacro"]
TARGETS: dict[str, str] = SETTINGS["wheels"]
DEBUG = [
    "-O0",
    "-g",
    "-fno-omit-frame-pointer",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
]
FLAGS = ["-std=c99", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-fPIC"]
# a mistake that newer compilers refuse, and older ones do not
FLAGS += ["-Werror=implicit-function-declaration"]
FLAGS += DEBUG if os.environ.get("MUMACRO_BUILD_DEBUG") else ["-O3", "-DNDEBUG"]
AVX2 = ["-mavx2", "-mfma"]
AVX512 = [*AVX2, "-mavx512f", "-mavx512dq", "-mavx512vl", "-mavx512bw", "-mprefer-vector-width=512"]
# of the built documents: no page needs it
NOT_READ = {".doctrees", "_sources", ".buildinfo", ".inv", ".map"}
NO_COMPILER = "No C compiler works here (tried cc, clang and gcc)"
PROBE = (
    "#include <math.h>\n#include <stdint.h>\nint64_t f(double x) { return (int64_t)floor(x); }\n"
)


def levels(platform: str) -> dict[str, list[str]]:
    """The instruction levels of a platform with their flags; one of them is chosen when the library
    is loaded."""
    return (
        {"base": [], "avx2": AVX2, "avx512": AVX512}
        if platform.endswith(("x86_64", "amd64"))
        else {"base": []}
    )


def own_platform() -> str:
    """The tag of this machine.  It promises no older C library: a local compiler binds to the one
    that is here."""
    return next(tag for tag in platform_tags() if not tag.startswith(("manylinux", "musllinux")))


@functools.cache
def local_compiler() -> list[str]:
    """The compiler of this machine, tried on a small program: it may lack headers or AVX-512.
    Empty if none works."""
    named, last = os.environ.get("CC"), list(levels(own_platform()).values())[-1]
    # gcc for Windows stores AVX registers at addresses that are not aligned (GCC bug 54412): the
    # program would crash.
    for name in [named] if named else [] if os.name == "nt" else ["cc", "clang", "gcc"]:
        words = shlex.split(name, posix=os.name != "nt")
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "probe.c").write_text(PROBE, "utf-8")
            command = [*words, *FLAGS, *last, "-shared", "probe.c", "-o", "probe.so"]
            try:
                # the user's compiler
                subprocess.run(command, cwd=folder, check=True, capture_output=True)  # noqa: S603
                return words
            except (OSError, subprocess.CalledProcessError):
                continue
    if named:
        sys.exit(
            f"CC={named} makes no shared object with {shlex.join(FLAGS + last)}: name another, or "
            "unset CC"
        )
    return []


def choose(platform: str | None) -> tuple[list[str], str]:
    """The command that compiles for a platform of ``TARGETS``, or without one for this machine; the
    platform."""
    if platform and platform not in TARGETS:
        sys.exit(f"MUMACRO_BUILD_PLATFORM={platform} is not one of {', '.join(TARGETS)}")
    if not platform and (local := local_compiler()):
        return local, own_platform()
    if DEBUG[0] in FLAGS:
        sys.exit(
            "MUMACRO_BUILD_DEBUG needs gcc or clang on this machine: zig has no sanitizer for "
            "addresses"
        )
    if not find_spec("ziglang"):
        sys.exit(f"{NO_COMPILER}: install one, or the package ziglang (pip install ziglang)")
    platform = platform or next(
        (tags for tags in TARGETS if {*tags.split(".")} & {*platform_tags()}), None
    )
    target = ["-target", TARGETS[platform]] if platform else ["-mcpu=baseline"]
    return [sys.executable, "-m", "ziglang", "cc", *target, "-s"], platform or own_platform()


def declare(folder: Path) -> Path:
    """Parse what the shared object offers into a module that cffi's small half reads (its
    out-of-line ABI mode): the parser would take as long at every start as all else together."""
    from cffi import FFI

    sources, path = ROOT / "src" / "mumacro" / "kernel", folder / "kernel" / "_declarations.py"
    texts = ((sources / name).read_text("ascii") for name in ("data.h", "records.h", "library.h"))
    lines = (line for text in texts for line in text.splitlines() if not line.startswith("#"))
    ffi = FFI()
    ffi.cdef("\n".join(lines))
    ffi.set_source("mumacro.kernel._declarations", None)
    path.parent.mkdir(exist_ok=True)
    ffi.emit_python_code(str(path))
    return path


def kept(command: list[str], *words: object) -> Path | None:
    """Where a shared object is kept between builds: its name is the digest of all that decides its
    bytes."""
    if not (cache := os.environ.get("MUMACRO_BUILD_CACHE")):
        return None
    version = subprocess.check_output([*command, "--version"])  # noqa: S603
    made_from = hashlib.sha256(repr((command, version, FLAGS, *words)).encode())
    for source in sorted((ROOT / "src" / "mumacro" / "kernel").glob("*.[ch]")):
        made_from.update(repr((source.name, source.read_bytes())).encode())
    return Path(cache, made_from.hexdigest())


def build(folder: Path, platform: str | None = None) -> tuple[Path, str]:
    """Compile into a folder; return the path of the shared object and its platform."""
    command, platform = choose(platform)
    name = "_kernel.dll" if platform.startswith("win") else "_kernel.so"
    # musl has another file name on every system; it is always there, Python has loaded it.
    libraries = {"win": [], "mus": ["-nostdlib"]}.get(platform[:3], ["-lm"])
    sources, has = ROOT / "src" / "mumacro" / "kernel", levels(platform)
    objects = {
        f"{level}.o": ["level.c", f"-DMUMACRO_LEVEL={level}", *flags]
        for level, flags in has.items()
    }
    objects["dispatch.o"] = ["dispatch.c", *(f"-DMUMACRO_HAS_{level.upper()}" for level in has)]
    compiling = [
        [f"{sources / file}", *words, "-c", "-o", name] for name, (file, *words) in objects.items()
    ]
    before = kept(command, platform, objects, libraries)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        lists = [compiling, [["-shared", *objects, "-o", name, *libraries]]]
        if before and before.is_file():
            shutil.copyfile(before, Path(place) / name)
            lists = []
        for words in lists:  # each at the same time
            jobs = [
                subprocess.Popen([*command, *FLAGS, *one], cwd=place)  # noqa: S603 - see above
                for one in words
            ]
            if sum(job.wait() != 0 for job in jobs):  # waits for all
                sys.exit("The C compiler failed: see above")
        if before and lists:
            before.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(Path(place) / name, f"{before}.{os.getpid()}")
            os.replace(f"{before}.{os.getpid()}", before)
        # A running program keeps the old file: the new one takes its place and is not written into
        # it.
        return (Path(place) / name).replace(folder / name), platform


def guide() -> dict[str, str]:
    """The built documents, where there are any, and their places in the wheel: the service shows
    them."""
    site = ROOT / "build" / "docs"
    read = (
        path
        for path in site.rglob("*.*")
        if NOT_READ.isdisjoint((*path.relative_to(site).parts, path.suffix))
    )
    files = [path for path in read if path.is_file()]
    return {
        str(path): f"mumacro/service/guide/{path.relative_to(site).as_posix()}" for path in files
    }


class KernelHook(BuildHookInterface[Any]):
    """A wheel gets the shared object, the guide and a tag for its platform; an editable install has
    it in place."""

    def dependencies(self) -> list[str]:
        """Ziglang if no compiler works here, or if another platform is asked for."""
        if not os.environ.get("MUMACRO_BUILD_PLATFORM"):
            if local_compiler():
                return []
            print(f"{NO_COMPILER}: the package ziglang compiles the kernel", file=sys.stderr)
        return [SETTINGS["zig"]]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, in place or into a folder of its own that ends with the process."""
        if version == "editable":
            build(ROOT / "src" / "mumacro")
            declare(ROOT / "src" / "mumacro")
            return
        self.folder = tempfile.TemporaryDirectory()
        folder = Path(self.folder.name)
        path, platform = build(folder, os.environ.get("MUMACRO_BUILD_PLATFORM"))
        build_data["force_include"] |= {
            str(made): f"mumacro/{made.relative_to(folder).as_posix()}"
            for made in (path, declare(folder))
        }
        build_data["force_include"] |= guide()
        build_data |= {"tag": f"py3-none-{platform}", "pure_python": False}


if __name__ == "__main__":
    place = Path(sys.argv[1]).resolve() if sys.argv[1:] else ROOT / "src" / "mumacro"
    path, platform = build(place)
    declare(place)
    print(f"{path} for {platform}, {path.stat().st_size} bytes")
