"""The servers for comparison: ``python benchmarks/service_peers.py NAME PORT``.

``raw``: ASGI and orjson only, without checks: the cost of the server underneath.  ``inside``: the same, answered by
a middleware of a FastAPI application.  ``fastapi`` and ``fastapi_sync``: models in and out, as in its tutorial.
``umbridge``: the Python server of UM-Bridge.  ``mlserver``: writes a model's folder and starts MLServer.
"""

import json
import os
import socket
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

ANSWER = {
    "mu_macro": 0.28123456789123,
    "mu_ratio": 0.91234567891234,
    "regime": "stick_slip",
    "error_bound": 1.2345e-13,
    "source": "stick_slip_low",
    "table": {"id": "mumacro-1e-12", "tolerance": 1e-12},
    "api_version": "1",
}


def raw() -> Any:
    """The floor."""
    import orjson

    async def app(scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] != "http":
            while (await receive())["type"] != "lifespan.shutdown":
                await send({"type": "lifespan.startup.complete"})
            await send({"type": "lifespan.shutdown.complete"})
            return
        if scope["method"] == "POST":
            message = await receive()
            orjson.loads(message["body"])
        else:
            pairs = (part.split(b"=") for part in scope["query_string"].split(b"&"))
            {name: float(text) for name, text in pairs}
        body = orjson.dumps(ANSWER)
        headers = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(body))]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    return app


def inside() -> Any:
    """The floor as a middleware: no application that lets other middleware see its requests is faster."""
    from fastapi import FastAPI

    floor = raw()

    class Floor:
        def __init__(self, app: Any) -> None:
            self.app = app

        async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
            await (floor if scope["type"] == "http" else self.app)(scope, receive, send)

    app = FastAPI()
    app.add_middleware(Floor)
    return app


def fastapi(sync: bool) -> Any:
    """Models in and out, around the same table."""
    from fastapi import FastAPI
    from service.schemas import Case, CaseAnswer

    from mumacro import Surrogate

    surrogate = Surrogate.open(_table())
    surrogate.warm_up()
    label = {"id": surrogate.id, "tolerance": surrogate.tolerance}
    app = FastAPI()

    def answer(case: Case) -> Any:
        found = surrogate.evaluate(**case.model_dump())
        return {
            "mu_macro": found.mu_macro,
            "mu_ratio": found.mu_ratio,
            "regime": found.regime,
            "error_bound": found.error_bound,
            "source": found.source,
            "table": label,
            "api_version": "1",
        }

    if sync:

        @app.post("/v1/mu-macro", response_model=CaseAnswer)
        def one(case: Case) -> Any:
            return answer(case)

    else:

        @app.post("/v1/mu-macro", response_model=CaseAnswer)
        async def one(case: Case) -> Any:
            return answer(case)

    @app.post("/v1/mu-macro/batch", response_model=list[CaseAnswer])
    def many(cases: list[Case]) -> Any:
        return [answer(case) for case in cases]

    return app


def _table() -> Path:
    return ROOT / "tables" / "mumacro-1e-12.nc"


def serve_umbridge(port: int) -> None:
    """The server of UM-Bridge, around a constant: only the protocol is measured."""
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


_RUNTIME = """
from mlserver import MLModel
from mlserver.codecs import decode_args
import numpy as np

class Friction(MLModel):
    async def load(self):
        return True

    @decode_args
    async def predict(self, x: np.ndarray) -> np.ndarray:
        return x[:, :1]
"""


def serve_mlserver(port: int) -> None:
    """MLServer, around a model that returns its first input: only the protocol is measured."""
    import tempfile

    folder = Path(tempfile.mkdtemp(prefix="mlserver-"))
    (folder / "friction_runtime.py").write_text(_RUNTIME)
    (folder / "model-settings.json").write_text(
        json.dumps({"name": "mu_macro", "implementation": "friction_runtime.Friction"})
    )
    with socket.socket() as first, socket.socket() as second:
        for probe in (first, second):
            probe.bind(("127.0.0.1", 0))
        grpc, metrics = first.getsockname()[1], second.getsockname()[1]
    settings = {
        "host": "127.0.0.1", "http_port": port, "grpc_port": grpc, "metrics_port": metrics,
        "parallel_workers": 0, "access_log": False, "debug": False,
    }  # fmt: skip
    (folder / "settings.json").write_text(json.dumps(settings))
    os.chdir(folder)
    program = Path(sys.executable).with_name("mlserver")
    os.execv(program, [str(program), "start", "."])  # noqa: S606


def main(name: str, port: int) -> None:
    """Serve until the process is stopped."""
    if name == "umbridge":
        serve_umbridge(port)
    elif name == "mlserver":
        serve_mlserver(port)
    else:
        import uvicorn

        made = {"raw": raw, "inside": inside, "fastapi": lambda: fastapi(False), "fastapi_sync": lambda: fastapi(True)}
        app = made[name]()
        uvicorn.run(app, port=port, access_log=False, server_header=False, log_level="warning")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
