"""Run the service: ``python -m service`` (from an installed wheel: ``mumacro serve``).  ``python -m
service healthcheck`` checks whether a running service is ready.

Exit codes: 0 stopped by a signal (or ready); 1 could not run (or not ready); 2 bad setting or
argument.
"""

import os
import signal
import sys

# A requested stop is a success, also during the start: the process ends at once, with exit code 0.
# An exception could be lost or replaced by another one, because the code that is being imported may
# catch it.  The handler is set before the slow imports, because the first process of a container
# ignores a signal without a handler.  Stopping a health check is not a success.  Worker processes
# import this file under another name, and get the handler of the server.
if __name__ == "__main__" and "healthcheck" not in sys.argv:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))

import argparse
import errno
import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from types import FrameType

try:
    from .settings import PREFIX, Settings, SettingsError, load_settings
except ModuleNotFoundError as error:
    # mumacro.errors.missing is not available here: perhaps no package is installed.
    command = "python -m service" if __name__ == "__main__" else "mumacro serve"
    raise SystemExit(
        f'{command}: {error.name} is not installed: pip install "mumacro[service]" '
        '(in a checkout: pip install -e ".[service]")'
    ) from None

_COMMANDS = ("serve", "healthcheck")
_OTHER_FILES = 64  # file descriptors that are not connections: libraries, tables, the log
_OPTIONS = ("host", "port", "tables", "workers", "log_level")


def main(arguments: Sequence[str] | None = None, prog: str = "python -m service") -> int:
    """Run the command under the name ``prog``, and return the exit code."""
    parser = argparse.ArgumentParser(
        prog=prog,
        description="Serve macroscopic friction over HTTP.  Every option is also a setting "
        "MUMACRO_<OPTION>.",
        epilog="Files of cases need no server: mumacro eval --help.",
    )
    parser.add_argument(
        "command",
        nargs="?",
        metavar="{serve,healthcheck}",
        default="serve",
        help="default: serve",
    )
    for name in _OPTIONS:
        description = Settings.model_fields[name].description
        parser.add_argument(f"--{name.replace('_', '-')}", metavar=name.upper(), help=description)
    options = vars(parser.parse_args(arguments))
    # After the options, because a misspelt option must be refused by its name, not by its value.
    if options["command"] not in _COMMANDS:
        parser.error(f"{options['command']!r} is neither {' nor '.join(_COMMANDS)}")
    # The environment passes the same settings to worker processes.
    os.environ |= {
        PREFIX + name.upper(): options[name] for name in _OPTIONS if options[name] is not None
    }
    try:
        settings = load_settings()
    except SettingsError as error:
        print(error, file=sys.stderr)
        return 2
    return _serve(settings) if options["command"] == "serve" else _check(settings)


def _address(settings: Settings) -> str:
    """Return the address at which this machine reaches the service."""
    any_address = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104  (compared, never bound)
    host = any_address.get(settings.host, settings.host)
    return f"http://{f'[{host}]' if ':' in host else host}:{settings.port}"


def _ask(url: str) -> None:
    """Send a request to an address of this machine, without a proxy.  Raise OSError or ValueError
    if the service is not ready."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    opener.open(url, timeout=10.0).close()  # any other status raises


def _announce(settings: Settings) -> None:
    """Tell a person at a terminal which address to open, as soon as it can be opened."""
    while True:
        time.sleep(0.1)
        with suppress(OSError, ValueError):
            _ask(f"{_address(settings)}/readyz")
            print(f"Open {_address(settings)}  (Ctrl+C stops the service)", flush=True)
            return


def _is_taken(settings: Settings) -> bool:
    """Return whether another program listens at the address."""
    if not settings.port:  # 0 means any free port
        return False
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.socket(family) as probe:
        if os.name != "nt":  # on Windows this would share the address
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((settings.host, settings.port))
        except OSError as error:
            return error.errno == errno.EADDRINUSE
    return False


def _check(settings: Settings) -> int:
    """Request /readyz, so that a container needs no other program for its health check."""
    url = f"{_address(settings)}/readyz"
    try:
        _ask(url)
    except (OSError, ValueError) as error:
        print(f"{url}: {error}", file=sys.stderr)
        return 1
    return 0


def _allow_files(connections: int) -> str | None:
    """Allow this process one file for each connection.  Return what to do if the system does not
    permit it."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows has no such limit
        return None
    files = connections + _OTHER_FILES
    soft, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft in (resource.RLIM_INFINITY, -1) or soft >= files:
        return None
    allowed = files if most in (resource.RLIM_INFINITY, -1) else min(most, files)
    resource.setrlimit(resource.RLIMIT_NOFILE, (allowed, most))
    if allowed == files:
        return None
    return (
        f"{PREFIX}MAX_CONNECTIONS={connections} needs {files} open files, and the system allows "
        f"{allowed}: raise its limit (ulimit -n), or lower the setting"
    )


def _open_standard_files() -> None:
    """Open standard files that were closed (``>&-``) as the null device.  Otherwise a connection
    could get the number of one, and the log would be written to it."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number


def _at_a_stop(do: Callable[[int, FrameType | None], None]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, do)


def _serve(settings: Settings) -> int:
    _open_standard_files()
    _at_a_stop(lambda *_: os._exit(0))  # the command mumacro has not set it

    if _is_taken(settings):
        print(
            f"port {settings.port} is taken by another program: stop it, or choose another port, "
            f"as in --port {settings.port + 1 if settings.port < 65535 else 8001}",
            file=sys.stderr,
        )
        return 1

    if warning := _allow_files(settings.max_connections):
        print(warning, file=sys.stderr)
    # Imported here, because a health check must not load the server.
    import uvicorn

    if settings.workers == 1:
        # Here, and not in the server: from now on a stop is an exception (see above).
        from . import app, server  # noqa: F401
    from .metrics import shared_counters
    from .observe import log_config

    # The server sets its own handlers, shuts down gracefully, and raises the signal again.  By
    # default this would end the process with the signal's exit status.  From here on there is
    # something to clean up: the rest of the log, and the folder that several workers share.
    _at_a_stop(lambda *_: sys.exit(0))
    if (
        sys.stdout is not None and sys.stdout.isatty() and settings.port
    ):  # 0 means any free port, which the log names
        threading.Thread(target=_announce, args=(settings,), daemon=True).start()
    try:
        with shared_counters(settings.workers) if settings.workers > 1 else nullcontext():
            # By name, so that only worker processes import it and not their parent.  It reads the
            # headers of proxies.
            uvicorn.run(
                f"{__package__}.app:create_app",
                factory=True,
                http=f"{__package__}.server:Connection",
                ws="none",
                host=settings.host,
                port=settings.port,
                workers=settings.workers,
                root_path=settings.root_path,
                log_config=log_config(settings.log_level),
                log_level=settings.log_level,
                access_log=False,
                server_header=False,
                proxy_headers=False,
                # long work is ended after the grace period, with an answer
                timeout_graceful_shutdown=settings.shutdown_grace_s + 1,
                # on a busy machine a worker may need more than 5 s to start
                timeout_worker_healthcheck=30,
            )
    except SystemExit as stop:
        return 1 if stop.code else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
