"""The REST service: SI inputs in, macroscopic friction out, read from a verified table."""

__all__ = ["API_VERSION", "__version__"]

API_VERSION = "1"


def __getattr__(name: str) -> str:
    # Imported on first use: a health check imports this package every few seconds and must stay small.
    if name == "__version__":
        from mumacro.version import __version__

        return __version__
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
