# ruff: noqa: N999 - PyInstaller finds a hook by this name
"""Tell PyInstaller what an application must contain: the compiled kernel, the tables, and the
modules that are imported by name when they are first used."""

from PyInstaller.utils.hooks import (  # type: ignore[import-untyped, import-not-found, unused-ignore]
    collect_data_files,
    collect_submodules,
)

# parts that need other programs are left out
_APART = ("mumacro.service", "mumacro.builder", "mumacro._pyinstaller")

datas = collect_data_files("mumacro", includes=["**/*.so", "**/*.dll", "**/*.dylib", "data/*.nc"])
hiddenimports = collect_submodules("mumacro", filter=lambda name: not name.startswith(_APART))
