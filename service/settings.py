"""Read the settings of the service from ``MUMACRO_*`` environment variables, and check them before
anything starts.

Each setting has a row in the table of docs/operations.md.  A bad setting is reported in one line
that names the variable, the value and what it must be.  The value of the API key is never shown.
"""

import os
from functools import cached_property, partial
from ipaddress import ip_network
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, BeforeValidator, DirectoryPath, Field, Secret, ValidationError
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

PREFIX = "MUMACRO_"
_MAX_AGE_S = 3600


class SettingsError(ValueError):
    """Report settings that cannot be used; the text says which, and what they must be."""


def _split(value: Any, separator: str = ",") -> Any:
    """Return ``a, b`` -> [``a``, ``b``]; return a value that is not a text unchanged."""
    return (
        [part.strip() for part in value.split(separator) if part.strip()]
        if isinstance(value, str)
        else value
    )


def _pairs(value: Any) -> Any:
    """Return ``a=1, b=2`` -> {``a``: ``1``, ``b``: ``2``}; return a value that is not a text
    unchanged.

    Raise ValueError for a part without a name, and for a name that occurs twice.
    """
    if not isinstance(value, str):
        return value
    pairs: dict[str, str] = {}
    for part in value.split(","):
        name, _, key = map(str.strip, part.partition("="))
        if not name or name in pairs:
            raise ValueError("a name is missing, or is given twice")
        pairs[name] = key
    return pairs


def _without_dots(path: str) -> str:
    if not {".", ".."}.isdisjoint(path.split("/")):
        raise ValueError("a step that is . or ..")
    return path


def _an_origin(text: str) -> str:
    """Return the origin of a page as a browser sends it: without path and final slash."""
    parts = urlsplit(text)
    if text != "*" and not (parts.netloc and text == f"{parts.scheme}://{parts.netloc}".lower()):
        raise ValueError("not an origin")
    return text


def _networks(texts: tuple[str, ...]) -> tuple[str, ...]:
    if texts != ("*",):
        for text in texts:
            ip_network(text)
    return texts


# in site-packages this folder may belong to PyTables, and then has no table
_BESIDE = Path(__file__).resolve().parent.parent / "tables"
_TABLES = _BESIDE if any(_BESIDE.glob("*.nc")) else Path("tables")


def _default_guide() -> Path | None:
    service = Path(__file__).resolve().parent
    # in the image, and in a wheel that was built after it; in a checkout where dev.py builds it
    places = service / "guide", service.parent / "build" / "docs"
    return next((place for place in places if (place / "index.html").is_file()), None)


def _one_name_each(keys: dict[str, Secret[str]]) -> dict[str, Secret[str]]:
    if len(set(keys.values())) != len(keys):
        raise ValueError("two names for one key")
    return keys


def _whole(default: int, least: int, most: int, condition: str = "") -> Any:
    return Field(
        default, ge=least, le=most, description=f"an integer from {least}{condition} to {most}"
    )


#: advice for keys that cannot be used
_NO_KEY = "unset the variable where no key is needed"

# An empty variable must not count as "no key", because somebody who sets the variable intends a
# key.
Key = Secret[Annotated[str, Field(pattern=r"^[!-~]{1,512}$")]]
KeyName = Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,64}$")]


class Settings(BaseSettings):
    """Hold all settings.  Each description says what a value must be."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, extra="forbid", frozen=True)

    tables: Annotated[
        tuple[Path, ...], NoDecode, BeforeValidator(partial(_split, separator=os.pathsep))
    ] = Field(
        default_factory=lambda: (_TABLES,),
        min_length=1,
        description="a table file or a directory of *.nc files, or several joined by "
        f"{os.pathsep!r}",
    )
    host: str = Field("127.0.0.1", min_length=1, description="an address or host name to listen on")
    port: int = _whole(8000, 0, 65535, " (any free port)")
    workers: int = _whole(1, 1, 256)
    max_body_bytes: int = _whole(16 * 2**20, 1024, 2**31)
    max_held_bytes: int = _whole(32 * 2**20, 1024, 2**40)
    max_batch: int = _whole(100_000, 1, 10_000_000)
    max_computations: int = _whole(8, 1, 1024)
    max_connections: int = _whole(1000, 1, 1_000_000)
    keep_alive_s: int = _whole(75, 1, 3600)
    client_timeout_s: int = _whole(30, 1, 3600)
    compute_limit_s: int = _whole(30, 1, 86400)
    time_limit_s: int = _whole(300, 1, 86400)
    api_key: Key | None = Field(
        None, description=f"1 to 512 printable ASCII characters without spaces; {_NO_KEY}"
    )
    api_keys: Annotated[
        dict[KeyName, Key], NoDecode, BeforeValidator(_pairs), AfterValidator(_one_name_each)
    ] = Field(
        default_factory=dict,
        description="name=key pairs joined by commas, each name and each key once; names of "
        f"letters, digits and . _ -; {_NO_KEY}",
    )
    cors_origins: Annotated[
        tuple[Annotated[str, AfterValidator(_an_origin)], ...], NoDecode, BeforeValidator(_split)
    ] = Field(
        (),
        description="origins such as https://tool.example joined by commas, in lower case and "
        "without a path, or *",
    )
    root_path: Annotated[str, AfterValidator(_without_dots)] = Field(
        "",
        pattern=r"^(/[A-Za-z0-9._~-]+)*$",
        description="a path such as /friction without . and .. as steps, or nothing",
    )
    trusted_proxies: Annotated[
        tuple[str, ...], NoDecode, BeforeValidator(_split), AfterValidator(_networks)
    ] = Field(
        ("127.0.0.1",),
        description="addresses such as 10.0.0.1 or networks such as 10.0.0.0/8 joined by commas, "
        "or *",
    )
    guide: Annotated[DirectoryPath | None, BeforeValidator(lambda place: place or None)] = Field(
        default_factory=_default_guide,
        description="a directory with the built documentation, or empty for none",
    )
    log_level: Annotated[
        Literal["debug", "info", "warning", "error", "critical"], BeforeValidator(str.lower)
    ] = Field("info", description="one of debug, info, warning, error, critical")
    shutdown_grace_s: int = _whole(10, 0, 3600)

    def keys(self) -> dict[str, str]:
        """Return API key -> name of its holder, which logs show; return an empty dict if no key is
        needed."""
        holders = {key.get_secret_value(): name for name, key in self.api_keys.items()}
        if self.api_key is not None:
            holders.setdefault(self.api_key.get_secret_value(), "default")
        return holders

    @cached_property
    def cache_fields(self) -> dict[str, str]:
        """Return how long, and by whom, an answer may be cached: with an API key, only by the
        client itself."""
        if not self.keys():
            return {"Cache-Control": f"public, max-age={_MAX_AGE_S}"}
        return {
            "Cache-Control": f"private, max-age={_MAX_AGE_S}",
            "Vary": "X-API-Key, Authorization",
        }


def load_settings(**overrides: Any) -> Settings:
    """Return the settings of the environment; ``overrides`` replace them.  SettingsError names all
    bad settings, in one line."""
    try:
        return Settings(**overrides)
    except ValidationError as error:
        lines: dict[str, str] = {}
        for problem in error.errors(include_url=False):
            name = str(problem["loc"][0]).lower()
            bound = Settings.model_fields[name].description
            value = "(hidden)" if name in ("api_key", "api_keys") else repr(problem["input"])[:200]
            lines.setdefault(name, f"{PREFIX}{name.upper()} must be {bound}, got {value}")
        raise SettingsError("; ".join(lines.values())) from None


def unknown_variables() -> list[str]:
    """Return variables that begin with MUMACRO_ and are not settings.  Most are spelling mistakes,
    so the log warns of them."""
    names = {f"{PREFIX}{name.upper()}" for name in Settings.model_fields}
    return sorted(
        name for name in os.environ if name.upper().startswith(PREFIX) and name.upper() not in names
    )
