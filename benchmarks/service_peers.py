"""The servers that the service is compared with.

    python -m benchmarks.service_peers raw|fastapi

``raw``: stock uvicorn and orjson, which reads six numbers and answers one, without checks: the cost
of the server underneath.  ``fastapi``: models in and out around the same table, as in its tutorial.
"""

import sys
from typing import Any

from mumacro.inputs.fields import FIELDS
from tests.support.measuring import FINEST


def raw() -> Any:
    import orjson

    async def app(scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] != "http":
            while (await receive())["type"] != "lifespan.shutdown":
                await send({"type": "lifespan.startup.complete"})
            await send({"type": "lifespan.shutdown.complete"})
            return
        case = orjson.loads((await receive())["body"])
        six = [float(case[name]) for name in FIELDS]
        body = orjson.dumps({"mu_macro": six[0]})
        headers = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(body))]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    return app


def fastapi() -> Any:
    from fastapi import FastAPI

    from mumacro import Surrogate
    from service.models.answers import CaseAnswer
    from service.models.inputs import CaseInputs

    surrogate = Surrogate.open(FINEST)
    label = {"id": surrogate.id, "tolerance": surrogate.tolerance}
    app = FastAPI()

    @app.post("/v1/mu-macro", response_model=CaseAnswer)
    async def one(case: CaseInputs) -> Any:
        answer = surrogate.evaluate(**case.model_dump(exclude_none=True))
        names = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
        return {
            **{name: getattr(answer, name) for name in names},
            "table": label,
            "api_version": "1",
        }

    return app


if __name__ == "__main__":
    import uvicorn

    uvicorn.run(
        {"raw": raw, "fastapi": fastapi}[sys.argv[1]](),
        port=0,
        access_log=False,
        server_header=False,
    )
