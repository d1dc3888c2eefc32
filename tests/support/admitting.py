"""What a process takes on, without its server: a coroutine with an admission of its own."""

import asyncio
from collections.abc import Callable, Coroutine
from types import SimpleNamespace
from typing import Any

from service.admission import Admission
from service.settings import Settings


def run(main: Callable[[Admission], Coroutine[Any, Any, None]], **settings: Any) -> None:
    """Run a coroutine with an admission of these settings."""

    async def with_loop() -> None:
        await main(Admission(Settings(**settings)))

    asyncio.run(with_loop())


def scope_of(admission: Admission, **more: Any) -> dict[str, Any]:
    """What a request to an application with this admission has."""
    app = SimpleNamespace(state=SimpleNamespace(admission=admission))
    return {"type": "http", "path": "/v1/law", "app": app, "client": ("10.1.2.3", 1), **more}
