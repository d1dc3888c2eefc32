"""The servers for comparison: ``python benchmarks/service_peers.py raw|fastapi|umbridge PORT``.

``raw``: stock uvicorn and orjson, which reads six numbers and answers one, without checks: the cost of the server
underneath.  ``fastapi``: models in and out around the same table, as in its tutorial.  ``umbridge``: the Python server
of UM-Bridge around a constant.
"""

import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
FIELDS = ("mu0", "Fz", "k", "y0", "omega", "v0")


def raw() -> Any:
    """The floor."""
    import orjson

    async def app(scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] != "http":
            while (await receive())["type"] != "lifespan.shutdown":
                await send({"type": "lifespan.startup.complete"})
            await send({"type": "lifespan.shutdown.complete"})
            return
        given = orjson.loads((await receive())["body"])
        six = [float(given[name]) for name in FIELDS]
        body = orjson.dumps({"mu_macro": six[0]})
        headers = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(body))]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    return app


def fastapi() -> Any:
    """Models in and out, around the same table."""
    from fastapi import FastAPI

    from mumacro import Surrogate
    from service.models import CaseAnswer
    from service.options import Case

    surrogate = Surrogate.open(ROOT / "tables" / "mumacro-1e-12.nc")
    label = {"id": surrogate.id, "tolerance": surrogate.tolerance}
    app = FastAPI()

    @app.post("/v1/mu-macro", response_model=CaseAnswer)
    async def one(case: Case) -> Any:  # type: ignore[valid-type]
        found = surrogate.evaluate(**case.model_dump())  # type: ignore[attr-defined]
        names = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
        return {**{name: getattr(found, name) for name in names}, "table": label, "api_version": "1"}

    return app


def serve_umbridge(port: int) -> None:
    """Only the protocol is measured."""
    import umbridge

    class Model(umbridge.Model):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__("mu_macro")

        def get_input_sizes(self, config: Any) -> list[int]:  # noqa: ARG002
            return [6]

        def get_output_sizes(self, config: Any) -> list[int]:  # noqa: ARG002
            return [1]

        def __call__(self, parameters: Any, config: Any) -> list[list[float]]:  # noqa: ARG002
            return [[0.28123456789123]]

        def supports_evaluate(self) -> bool:
            return True

    umbridge.serve_models([Model()], port)


def main(name: str, port: int) -> None:
    """Serve until the process is stopped."""
    if name == "umbridge":
        serve_umbridge(port)
        return
    import uvicorn

    app = {"raw": raw, "fastapi": fastapi}[name]()
    uvicorn.run(app, port=port, access_log=False, server_header=False, log_level="warning")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
