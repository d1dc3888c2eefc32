"""Checks whether a service on this machine is ready.  A container needs no other program for its health check."""

import urllib.request

from .settings import Settings

__all__ = ["is_ready", "loopback_url"]

_ANY_ADDRESS = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104  (compared, never bound)


def loopback_url(settings: Settings) -> str:
    """Return the URL of /readyz on the machine that the service runs on."""
    host = _ANY_ADDRESS.get(settings.host, settings.host)
    return f"http://[{host}]:{settings.port}/readyz" if ":" in host else f"http://{host}:{settings.port}/readyz"


def is_ready(url: str, timeout_s: float = 3.0) -> bool:
    """Do one GET without a proxy; True for status 200."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(url, timeout=timeout_s) as response:
            return bool(response.status == 200)
    except (OSError, ValueError):
        return False
