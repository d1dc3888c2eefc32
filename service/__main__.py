"""``python -m service``: serve.  ``python -m service healthcheck``: ask a running service whether it is ready.
``python -m service eval CASES -o OUT``: answer a file of cases, see :mod:`service.bulk`.

Exit codes: 0 stopped on request (or ready), 1 could not run (or not ready), 2 bad setting or argument.
"""

import argparse
import gc
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from types import FrameType

from service.settings import PREFIX, Settings, SettingsError, load_settings

__all__ = ["main"]

_OPTIONS = ("host", "port", "tables", "workers", "log_level")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m service",
        description="Serve macroscopic friction over HTTP.  Every option is also a setting MUMACRO_<OPTION>.",
        epilog="python -m service eval --help: answer a file of cases without a server.",
    )
    parser.add_argument("command", nargs="?", choices=("serve", "healthcheck"), default="serve", help="default: serve")
    for name in _OPTIONS:
        description = Settings.model_fields[name].description
        parser.add_argument(f"--{name.replace('_', '-')}", metavar=name.upper(), help=description)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words[:1] == ["eval"]:
        from service.bulk import main as evaluate

        return evaluate(words[1:])
    chosen = _parser().parse_args(words)
    for name in _OPTIONS:
        value = getattr(chosen, name)
        if value is not None:
            # Through the environment, so that worker processes see what was chosen here.
            os.environ[PREFIX + name.upper()] = value
    try:
        settings = load_settings()
    except SettingsError as error:
        print(error, file=sys.stderr)
        return 2
    if chosen.command == "healthcheck":
        from service.healthcheck import is_ready, loopback_url

        return 0 if is_ready(loopback_url(settings)) else 1
    return _serve(settings)


def _stop(_signal: int, _frame: FrameType | None) -> None:
    raise SystemExit(0)


def _serve(settings: Settings) -> int:
    # The server shuts down gracefully, then raises the signal once more, which by default would end the process
    # with the signal's own exit status.  A stop that was asked for is a success.
    # Set before the slow imports: as a container's first process this one would ignore the signal until then.
    signal.signal(signal.SIGTERM, _stop)

    # Importing makes no garbage worth looking for; service.warm.settle_memory turns the collector on again.
    gc.disable()

    # Imported here: a health check must not pay for the server and the kernels.
    import uvicorn

    from service.logs import log_config
    from service.shared import shared_folder

    try:
        with shared_folder() if settings.workers > 1 else nullcontext():
            uvicorn.run(
                # By name, so that only the processes that serve import it, not the one that watches over several.
                "service.app:create_app",
                factory=True,
                http="service.connection:Connection",
                host=settings.host,
                port=settings.port,
                workers=settings.workers,
                log_config=log_config(settings.log_level),
                log_level=settings.log_level,
                access_log=False,
                server_header=False,
                ws="none",
                timeout_graceful_shutdown=settings.shutdown_grace_s,
            )
    except SystemExit as stop:
        return 1 if stop.code else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
