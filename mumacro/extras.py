"""What to install when a package is missing that only one part of the project needs."""

_OURS = ("mumacro", "builder", "service")


def missing(extra: str, error: ImportError) -> str:
    """What to install, in one line, where an import raised ``error``; ``extra`` is empty for the
    library itself.

    Raises ``error`` itself when one of the project's own modules is missing: a fault that must not
    be hidden.

    >>> missing("files", ModuleNotFoundError("No module named 'pyarrow'", name="pyarrow"))
    "pyarrow is not installed: pip install 'mumacro[files]' (in a checkout: pip install -e
    '.[files]')"
    """
    if error.name is None:  # a sentence of our own: the compiled kernel is missing
        return str(error)
    package = error.name.partition(".")[0]
    if package in _OURS:
        raise error
    brackets = f"[{extra}]" if extra else ""
    return (
        f"{package} is not installed: pip install 'mumacro{brackets}' (in a checkout: pip "
        f"install -e '.{brackets}')"
    )
