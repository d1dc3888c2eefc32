"""Settings: sources, bounds, error messages, and completeness of the manual."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from annotated_types import Ge, Le

from service.__main__ import main
from service.settings import Settings, SettingsError, load_settings

BAD = {
    "MUMACRO_TABLES": ("", os.pathsep),
    "MUMACRO_HOST": ("",),
    "MUMACRO_WORKERS": ("0", "257", "two"),
    "MUMACRO_PORT": ("", "http", "-1", "65536", "80.5", "tcp://10.0.0.1:80"),
    "MUMACRO_LOG_LEVEL": ("", "loud"),
    "MUMACRO_MAX_BODY_BYTES": ("1023", "1e6", str(2**31 + 1)),
    "MUMACRO_MAX_HELD_BYTES": ("1023", "32M", str(2**40 + 1)),
    "MUMACRO_MAX_BATCH": ("0", "10000001"),
    "MUMACRO_MAX_COMPUTATIONS": ("0", "1025"),
    "MUMACRO_COMPUTE_LIMIT_S": ("0", "86401"),
    "MUMACRO_MAX_CONNECTIONS": ("0", "many", "1000001"),
    "MUMACRO_KEEP_ALIVE_S": ("0", "3601"),
    "MUMACRO_CLIENT_TIMEOUT_S": ("0", "3601"),
    "MUMACRO_API_KEYS": (
        "",
        " ",
        ",",
        "a=x,",
        "alice",
        "alice=",
        "=x",
        "two words=x",
        "a=same,b=same",
        "a=one,a=two",
    ),
    "MUMACRO_API_KEY": ("", " ", "two words", "schlüssel", "x" * 513, "line\nbreak"),
    "MUMACRO_ROOT_PATH": ("friction", "/a/", "/a b", "/a/../b", "/./a", "/.."),
    "MUMACRO_CORS_ORIGINS": ("tool.example", "https://tool.example/", "https://T.example", "null"),
    "MUMACRO_TRUSTED_PROXIES": ("foo", "10.0.0.1:80", "10.0.0.1/8", "*,10.0.0.1"),
    "MUMACRO_GUIDE": ("no/such/directory", __file__),
    "MUMACRO_TIME_LIMIT_S": ("0", "86401"),
    "MUMACRO_SHUTDOWN_GRACE_S": ("-1", "3601", "soon"),
}


@pytest.fixture(autouse=True)
def _clean_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(os.environ):
        if name.startswith("MUMACRO_"):
            monkeypatch.delenv(name)


@pytest.mark.parametrize(
    ("name", "value"), [(name, value) for name, values in BAD.items() for value in values]
)
def test_a_bad_setting_is_named_in_one_line(
    monkeypatch: pytest.MonkeyPatch, name: str, value: Any
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(SettingsError, match=rf"^{name} must be [^\n]*$") as error:
        load_settings()
    assert name != "MUMACRO_API_KEY" or not value.strip() or value not in str(error.value)


def test_settings_come_from_the_environment(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name, value in (
        ("TABLES", f"{tmp_path}{os.pathsep}other.nc"),
        ("PORT", "81"),
        ("LOG_LEVEL", "WARNING"),
    ):
        monkeypatch.setenv(f"MUMACRO_{name}", value)
    settings = load_settings(host="::1")
    assert settings.tables == (tmp_path, Path("other.nc"))
    assert (settings.host, settings.port, settings.log_level) == ("::1", 81, "warning")
    monkeypatch.setenv("MUMACRO_PORT", "x")
    monkeypatch.setenv("MUMACRO_WORKERS", "y")
    with pytest.raises(SettingsError, match=r"MUMACRO_PORT .*; MUMACRO_WORKERS "):
        load_settings()


def test_lists_of_settings_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUMACRO_API_KEYS", " alice = one , bob=two=2 ")
    monkeypatch.setenv("MUMACRO_CORS_ORIGINS", "https://tool.example, http://localhost:3000")
    monkeypatch.setenv("MUMACRO_TRUSTED_PROXIES", "10.0.0.0/8, ::1")
    settings = load_settings()
    assert settings.keys() == {"one": "alice", "two=2": "bob"}
    assert settings.cors_origins == ("https://tool.example", "http://localhost:3000")
    assert settings.trusted_proxies == ("10.0.0.0/8", "::1")


def test_a_key_that_is_given_twice_keeps_the_name_of_its_holder() -> None:
    settings = load_settings(api_key="one", api_keys={"alice": "one", "bob": "two"})
    assert settings.keys() == {"one": "alice", "two": "bob"}


def test_a_misspelt_variable_is_noticed(
    started: Any, monkeypatch: pytest.MonkeyPatch, caplog: Any
) -> None:
    monkeypatch.setenv("MUMACRO_TABLE", "x")
    monkeypatch.setenv("MUMACRO_PORT", "81")
    with started():
        warnings = [message for message in caplog.messages if "not a setting" in message]
    assert warnings == ["MUMACRO_TABLE is not a setting and has no effect"]


def test_the_key_is_never_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUMACRO_API_KEY", "s3cret")
    monkeypatch.setenv("MUMACRO_API_KEYS", "alice=s3cret-too")
    assert "s3cret" not in repr(load_settings())


def test_the_health_check_asks_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.environ", os.environ.copy())  # main writes its options there
    monkeypatch.setattr(
        "urllib.request.OpenerDirector.open", opened := Mock(side_effect=LookupError)
    )
    addresses = {
        "0.0.0.0": "127.0.0.1",  # noqa: S104
        "::": "[::1]",
        "10.1.2.3": "10.1.2.3",
    }
    for host, address in addresses.items():
        with pytest.raises(LookupError):
            main(["healthcheck", "--host", host])
        assert opened.call_args.args == (f"http://{address}:8000/readyz",)


def test_the_manual_and_the_settings_agree(repository: Path) -> None:
    names = {f"MUMACRO_{name.upper()}" for name in Settings.model_fields}
    assert set(BAD) == names
    text = (repository / "docs" / "operations.md").read_text()
    rows = re.findall(r"^\| `(MUMACRO_\w+)` \| (.*?) \| (.*?) \| ", text, re.MULTILINE)
    defaults = {name: default for name, default, _ in rows}
    allowed = {name: cell for name, _, cell in rows}
    assert defaults.keys() == names
    for name, field in Settings.model_fields.items():
        value = ",".join(field.default) if isinstance(field.default, tuple) else field.default
        default = "none" if value in (None, "") else f"`{value}`"
        variable = f"MUMACRO_{name.upper()}"
        assert field.default_factory or defaults[variable] == default
        if field.annotation is int:
            bounds = {type(bound): bound for bound in field.metadata}
            least, most = bounds[Ge].ge, bounds[Le].le
            assert allowed[variable] == f"{least} to {most}"
            assert {str(least - 1), str(most + 1)} <= {*BAD[variable]}, variable
    assert load_settings().tables == (repository / "tables",)


def test_every_setting_is_read_by_something(repository: Path) -> None:
    text = "".join(path.read_text("utf-8") for path in (repository / "service").rglob("*.py"))
    of_service = re.findall(r"settings\.(\w+)", text)
    of_itself = re.findall(r"\bself\.(\w+)", (repository / "service" / "settings.py").read_text())
    assert Settings.model_fields.keys() <= {*of_service, *of_itself}


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--port", "70000"], "MUMACRO_PORT must be"),
        (["--workers=0"], "MUMACRO_WORKERS must be"),
        (["--log-level", "x"], "MUMACRO_LOG_LEVEL must be"),
        (["--nonsense"], "usage"),
        (["fly"], "usage"),
    ],
)
def test_a_bad_argument_ends_the_process_without_a_traceback(
    repository: Path, option: Any, message: Any
) -> None:
    words = [sys.executable, "-m", "service", *option]
    process = subprocess.run(words, cwd=repository, capture_output=True, text=True, check=False)
    assert (process.returncode, process.stdout) == (2, "")
    assert process.stderr.startswith(message)
    assert "Traceback" not in process.stderr


def test_a_misspelt_option_is_named_and_not_its_value(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["--prt", "1"])
    assert capsys.readouterr().err.endswith("error: unrecognized arguments: --prt\n")
