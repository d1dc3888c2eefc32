"""Settings of the service: ``MUMACRO_*`` environment variables, checked before anything starts.

Each setting has a heading of the same name in docs/operations.md.  A bad one is reported in one line that
names the variable, the value and what it must be; the value of the API key is never shown.
"""

import os
import re
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, DirectoryPath, Field, SecretStr, ValidationError, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

__all__ = ["PREFIX", "Settings", "SettingsError", "load_settings", "unknown_variables"]

PREFIX = "MUMACRO_"
_MAX_AGE_S = 3600


class SettingsError(ValueError):
    """One or more settings cannot be used; the text says which, and what they must be."""


def _split_paths(value: object) -> object:
    """``a:b`` (``a;b`` on Windows) -> (``a``, ``b``); one path or a sequence of paths is taken as it is."""
    if isinstance(value, str):
        return tuple(part for part in value.split(os.pathsep) if part)
    if isinstance(value, Path):
        return (value,)
    if isinstance(value, Sequence):
        return tuple(value)
    return value


def _split_list(value: object) -> object:
    """``a, b`` -> (``a``, ``b``)."""
    if isinstance(value, str):
        return tuple(part.strip() for part in value.split(",") if part.strip())
    return value


def _split_keys(value: object) -> object:
    """``a=1,b=2`` -> {``a``: ``1``, ``b``: ``2``}."""
    if isinstance(value, str):
        pairs = [part.partition("=") for part in value.split(",") if part.strip()]
        return {name.strip(): key for name, _, key in pairs}
    return value


def _default_tables() -> tuple[Path, ...]:
    # An installed package has site-packages as its parent, where PyTables owns a folder of this name:
    # only a folder that really holds tables counts.
    beside = Path(__file__).resolve().parent.parent / "tables"
    return (beside,) if any(beside.glob("*.nc")) else (Path("tables"),)


def _default_guide() -> Path | None:
    beside = Path(__file__).resolve().parent / "guide"  # in a wheel that was built after the documents
    return beside if (beside / "index.html").is_file() else None


def _usable(key: SecretStr) -> SecretStr:
    # An empty variable must not count as "no key": a variable that is set shows that a key was intended.
    if not re.fullmatch(r"[!-~]{1,512}", key.get_secret_value()):
        raise ValueError("unusable key")
    return key


Key = Annotated[SecretStr, AfterValidator(_usable)]
KeyName = Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,64}$")]


class Settings(BaseSettings):
    """All settings.  Each description says what a value must be."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, extra="forbid", frozen=True)

    tables: Annotated[tuple[Path, ...], NoDecode, BeforeValidator(_split_paths)] = Field(
        default_factory=_default_tables,
        min_length=1,
        description=f"a table file or a directory of *.nc files, or several joined by {os.pathsep!r}",
    )
    host: str = Field("127.0.0.1", min_length=1, description="an address or host name to listen on")
    port: int = Field(8000, ge=0, le=65535, description="an integer from 0 (any free port) to 65535")
    workers: int = Field(1, ge=1, le=256, description="an integer from 1 to 256")
    max_body_bytes: int = Field(16 * 2**20, ge=1024, le=2**31, description="an integer from 1024 to 2147483648")
    max_batch: int = Field(100_000, ge=1, le=10_000_000, description="an integer from 1 to 10000000")
    max_batches: int = Field(4, ge=1, le=1024, description="an integer from 1 to 1024")
    max_connections: int = Field(1000, ge=1, le=1_000_000, description="an integer from 1 to 1000000")
    keep_alive_s: int = Field(75, ge=1, le=3600, description="an integer from 1 to 3600")
    client_timeout_s: int = Field(30, ge=1, le=3600, description="an integer from 1 to 3600")
    time_limit_s: int = Field(300, ge=1, le=86400, description="an integer from 1 to 86400")
    api_key: Key | None = Field(None, description="1 to 512 printable ASCII characters without spaces")
    api_keys: Annotated[dict[KeyName, Key], NoDecode, BeforeValidator(_split_keys)] = Field(
        default_factory=dict, description="name=key pairs joined by commas; names of letters, digits and . _ -"
    )
    cors_origins: Annotated[tuple[str, ...], NoDecode, BeforeValidator(_split_list)] = Field(
        (), description="origins such as https://tool.example joined by commas, or *"
    )
    root_path: str = Field("", pattern=r"^(/[A-Za-z0-9._~-]+)*$", description="a path such as /friction, or nothing")
    trusted_proxies: str = Field("127.0.0.1", description="addresses or networks joined by commas, or *")
    guide: DirectoryPath | None = Field(
        default_factory=_default_guide, description="a directory with the built documentation"
    )
    log_level: Literal["debug", "info", "warning", "error", "critical"] = Field(
        "info", description="one of debug, info, warning, error, critical"
    )
    shutdown_grace_s: int = Field(10, ge=0, le=3600, description="an integer from 0 to 3600")

    @field_validator("log_level", mode="before")
    @classmethod
    def _lower(cls, value: object) -> object:
        return value.lower() if isinstance(value, str) else value

    @field_validator("api_keys")
    @classmethod
    def _one_name_each(cls, keys: dict[str, SecretStr]) -> dict[str, SecretStr]:
        if len({key.get_secret_value() for key in keys.values()}) != len(keys):
            raise ValueError("two names for one key")
        return keys

    def keys(self) -> dict[str, str]:
        """API key -> name of its holder, which logs show; empty where no key is needed."""
        found = {key.get_secret_value(): name for name, key in self.api_keys.items()}
        if self.api_key is not None:
            found.setdefault(self.api_key.get_secret_value(), "default")
        return found

    @cached_property
    def cache_fields(self) -> dict[str, str]:
        """How long, and by whom, an answer may be cached: with an API key, only by the client itself."""
        if not self.keys():
            return {"Cache-Control": f"public, max-age={_MAX_AGE_S}"}
        return {"Cache-Control": f"private, max-age={_MAX_AGE_S}", "Vary": "X-API-Key, Authorization"}


def load_settings(**chosen: Any) -> Settings:
    """Read the settings from the environment; ``chosen`` wins over it.

    Raises
    ------
    SettingsError
        Names every bad variable, its value and its bound, in one line.
    """
    try:
        return Settings(**chosen)
    except ValidationError as error:
        lines: dict[str, str] = {}
        for problem in error.errors(include_url=False):
            name = str(problem["loc"][0]).lower() if problem["loc"] else "settings"
            field = Settings.model_fields.get(name)
            bound = field.description if field is not None else "a known setting"
            given = "(hidden)" if name in ("api_key", "api_keys") else repr(problem["input"])[:200]
            lines.setdefault(name, f"{PREFIX}{name.upper()} must be {bound}, got {given}")
        raise SettingsError("; ".join(lines.values())) from None


def unknown_variables() -> list[str]:
    """Variables that begin with MUMACRO_ and are not settings: mostly spelling mistakes, so the log warns of them."""
    known = {f"{PREFIX}{name.upper()}" for name in Settings.model_fields}
    return sorted(name for name in os.environ if name.upper().startswith(PREFIX) and name.upper() not in known)
