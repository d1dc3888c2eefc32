"""The REST service: SI inputs in, macroscopic friction out, read from a verified table."""

from importlib.metadata import PackageNotFoundError, version

__all__ = ["API_VERSION", "__version__"]

API_VERSION = "1"

try:
    __version__ = version("mumacro")
except PackageNotFoundError:  # run from a source tree that was never installed
    __version__ = "0+unknown"
