"""Compare what two checkouts answer on this machine, to the last bit.

    python -m tests.support.guard OLD NEW [KIND ...]
    python -m tests.support.guard --write FILE CHECKOUT     # then FILE may stand for the checkout

Each checkout answers in its own environment (``python3 dev.py exec true`` makes it): the OpenAPI
description, 10,000 answers from all tables, contacts, directions and outputs, roots, motions, laws,
fits, requests of the service, every table file of the tests and every command of the documents.
What differs is listed by kind, and the exit code is 1.  It shows that a change of form changed no
answer, and names what a change was meant to change.

A name that changed has both of its forms here, the new one first: see :func:`first_accepted`.
"""

from __future__ import annotations

import asyncio
import contextlib
import difflib
import hashlib
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

Results = dict[str, Any]  # by the name of what was asked; a list of numbers holds their bits
SHOWN = 12  # differences of a kind that are listed
SECONDS = 600
SERVICE = "http://127.0.0.1:8000"
# what needs another machine, time or environment
LEFT_OUT = ("dev.py", "pip install", "mumacro serve", "MUMACRO_WORKERS", "builder build", "verify")
TABLES = (1e-4, 1e-7, 1e-10, 1e-12)
PAIRS = (
    ("spring", "across"),
    ("ball", "across"),
    ("spring", "along"),
    ("ball", "along"),
    ("spring", "normal"),
)
INPUTS = ("mu0", "Fz", "k", "y0", "omega", "v0")
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}


def first_accepted(*forms: Callable[[], Any]) -> Any:
    """Return what the first form gives whose names this checkout knows."""
    import mumacro

    refused: Exception | None = None
    for form in forms:
        try:
            return form()
        except (TypeError, mumacro.InputError) as error:
            refused = refused or error
    assert refused is not None
    raise refused


def bits(values: Any) -> Any:
    """Return the bits of numbers, and the words of an array of words."""
    import numpy as np

    array = np.asarray(values)
    if array.dtype.kind in "OUT":
        return array.ravel().tolist()
    return np.atleast_1d(array.astype(np.float64)).ravel().view(np.int64).tolist()


# --- what a checkout answers ----------------------------------------------------------------------


def openapi(_folder: Path) -> Results:
    """Return the paths and schemas of the description, each as text."""
    from service.app import create_app

    description = create_app().openapi()
    schemas = description.get("components", {}).get("schemas", {})
    parts = {f"path {name}": part for name, part in description["paths"].items()}
    parts |= {f"schema {name}": part for name, part in schemas.items()}
    return {name: json.dumps(part, indent=1, sort_keys=True) for name, part in parts.items()}


def _draws(n: int, normal: bool, seed: int) -> dict[str, Any]:
    """Return inputs that reach every block, limit and closed form."""
    import numpy as np

    rng = np.random.default_rng(seed)
    v, y = 10.0 ** rng.uniform(-4.0, 3.0, n), 10.0 ** rng.uniform(-3.0, 2.0, n)
    mu0, load, k = (
        rng.uniform(0.05, 1.0, n),
        10.0 ** rng.uniform(-2, 3, n),
        10.0 ** rng.uniform(4.0, 8.0, n),
    )
    omega, length = 10.0 ** rng.uniform(2.0, 6.0, n), mu0 * load / k
    cases = {"mu0": mu0, "Fz": load, "k": k, "omega": omega, "v0": v * length * omega}
    if normal:
        cases["Fz_amplitude"] = load * rng.uniform(0.0, 0.999, n)
    else:
        cases["y0"] = y * length
    special = rng.integers(0, n, (5, max(n // 50, 1)))
    cases["k"][special[0]] = np.inf
    cases["v0"][special[1]] = 0.0
    cases["omega"][special[2]] = 0.0
    cases["mu0"][special[3]] = np.nan
    cases["v0"][special[4]] = -1.0
    return cases


def answers(_folder: Path) -> Results:
    """Return 10,000 answers with all that the library computes of them."""
    results: Results = {}
    for seed, (tolerance, pair) in enumerate(itertools.product(TABLES, PAIRS)):
        found = _answers_of(tolerance, pair, seed)
        results |= {f"{tolerance:g} {' '.join(pair)} {name}": x for name, x in found.items()}
    return results


def _answers_of(tolerance: float, pair: tuple[str, str], seed: int) -> Results:
    """Return the answers of one table to 500 cases of one contact and direction."""
    import numpy as np

    import mumacro
    from mumacro.outputs import OUTPUTS

    table, normal = mumacro.open(tolerance), pair[1] == "normal"
    words: dict[str, Any] = dict(zip(("contact", "direction"), pair, strict=True))
    cases = _draws(500, normal, seed)
    lacking = {"std"} | ({"settling"} if pair[1] != "across" else set())
    lacking |= {"power"} if normal else set()
    names = [name for name in OUTPUTS if name not in lacking]
    spreads: dict[str, Any] = {"k": 0.1 * np.where(np.isinf(cases["k"]), 1.0, cases["k"])}
    spreads |= {"Fz_amplitude" if normal else "y0": 1e-9}
    flat = {f"std_{name}": x for name, x in spreads.items()}
    old: dict[str, Any] = {"include": names, "std": spreads}
    answer = first_accepted(
        lambda: table.evaluate({**cases, **flat}, include=names, **words),
        lambda: table.evaluate(cases, **old, **words),
    )
    results = {path: bits(answer[path]) for path in answer.paths}
    results["remarks"] = json.dumps(answer.remarks)
    one_k = {name: x for name, x in cases.items() if name != "k"}
    ends = {"k_low": 0.5 * cases["k"], "k_high": 2.0 * cases["k"]}
    band = table.evaluate({**one_k, **ends}, **words)
    results |= {f"interval {path}": bits(band[path]) for path in band.paths}
    for i in range(0, 500, 25):
        one = {name: float(x[i]) for name, x in cases.items()}
        results[f"one case {i}"] = _said(table.evaluate, one, include=names, **words)
    return results


def _said(function: Callable[..., Any], *arguments: Any, **keywords: Any) -> str:
    """Return the members of what a function returns, or how it refuses."""
    import mumacro

    try:
        return repr(function(*arguments, **keywords).to_dict())
    except mumacro.InputError as error:
        return f"refused: {error}"


def roots(_folder: Path) -> Results:
    """Return 150 questions for an input, a few of them over motions."""
    import numpy as np

    import mumacro

    table, rng = mumacro.open(), np.random.default_rng(1)
    results: Results = {}
    unknowns = ("v0", "y0", "k", "Fz", "mu0", "omega", "f")
    for i in range(140):
        unknown, pair = unknowns[i % len(unknowns)], PAIRS[(i // len(unknowns)) % 4]
        case = {**CASE, "mu0": rng.uniform(0.1, 0.8), "v0": 10.0 ** rng.uniform(-3.0, -1.0)}
        case.pop("f" if unknown in ("omega", "f") else unknown)
        target = float(rng.uniform(0.01, 0.5))
        words = dict(zip(("contact", "direction"), pair, strict=True))
        name = f"{i} {unknown} {' '.join(pair)}"
        results[name] = _said(mumacro.solve_for, table, unknown, target, **words, **case)
    for i in range(10):
        case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "x": (1e-6 * (1 + i), 90.0)}
        case |= {"y": 2e-6, "normal": (float(i % 3), 45.0)}
        results[f"{i} motion"] = _said(mumacro.solve_motion, "v0", 0.02 * (i + 1), **case)
    return results


def motions(_folder: Path) -> Results:
    """Return 200 motions."""
    import numpy as np

    import mumacro

    rng = np.random.default_rng(2)
    results: Results = {}
    for i in range(200):
        x, y = (tuple(row) for row in rng.uniform((0.0, 0.0), (4e-6, 360.0), (2, 2)).tolist())
        normal = (float(rng.uniform(0.0, 8.0)), 45.0) if i % 3 == 0 else 0.0
        case: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3}
        case["v0"] = float(rng.uniform(0.0, 0.3))
        contact = "ball" if i % 4 == 1 and not normal else "spring"
        case |= {"x": x, "y": y, "normal": normal, "contact": contact, "tolerance": 1e-4}
        results[f"{i}"] = _said(mumacro.motion, **case)
    return results


def laws(_folder: Path) -> Results:
    """Return laws over every input, over an interval and with a deviation."""
    import mumacro

    table = mumacro.open()
    ranges = {"v0": (1e-4, 1.0), "y0": (1e-7, 1e-5), "Fz": (1.0, 100.0), "k": (1e5, 1e8)}
    ranges |= {"mu0": (0.1, 1.0), "f": (1e3, 1e5)}
    results: Results = {}
    for (along, (start, stop)), pair in itertools.product(ranges.items(), PAIRS[:4]):
        case = {name: x for name, x in CASE.items() if name != along}
        words = dict(zip(("contact", "direction"), pair, strict=True))
        ask = {"along": along, "start": start, "stop": stop, "points": 41, **words}
        results[f"{along} {' '.join(pair)}"] = _said(mumacro.law, table, **ask, **case)
    no_k = {name: x for name, x in CASE.items() if name not in ("k", "v0")}
    ask = {"along": "v0", "start": 1e-4, "stop": 1.0, "points": 41}
    for k in ("0.8..1.2 N/um", "1 ± 0.1 N/um", "rigid"):
        results[f"k={k}"] = _said(mumacro.law, table, **ask, **no_k, k=k)
    return results


def fits(_folder: Path) -> Results:
    """Return fits of points of each contact and direction, with noise and without."""
    import numpy as np

    import mumacro

    table, rng = mumacro.open(), np.random.default_rng(3)
    v0 = np.geomspace(1e-3, 0.2, 8)
    results: Results = {}
    for pair, noise in itertools.product(PAIRS[:4], (0.0, 1e-3)):
        words = dict(zip(("contact", "direction"), pair, strict=True))
        fixed: dict[str, Any] = {"Fz": 10.0, "y0": 4e-7, "f": 20e3}
        mu = table.evaluate(mu0=0.31, k=1.3e7, v0=v0, **fixed, **words).mu_macro
        points = {"v0": v0, "mu_macro": mu * (1.0 + noise * rng.standard_normal(v0.size))}
        results[f"{' '.join(pair)} {noise:g}"] = _said(mumacro.fit, points, **words, **fixed)
    return results


_BATCH = {**CASE, "v0": [0.0, 0.01, 0.02, -1.0, None], "k": [1e6, "rigid", None, 2e6, 1e6]}
REQUESTS: dict[str, tuple[str, Any]] = {
    "one case": ("/v1/mu-macro", CASE),
    "texts": ("/v1/mu-macro", {**CASE, "k": "1 N/um", "y0": "2um"}),
    "all outputs": (
        "/v1/mu-macro",
        {**CASE, "include": ["groups", "limits", "gradient", "stick_fraction", "power"]},
    ),
    "an interval": ("/v1/mu-macro", {**CASE, "k": "0.8..1.2 N/um"}),
    "a deviation": ("/v1/mu-macro", {**CASE, "k": "1 ± 0.1 N/um"}),
    "no k": ("/v1/mu-macro", {**CASE, "k": None}),
    "a bad unit": ("/v1/mu-macro", {**CASE, "v0": "2 N"}),
    "an unknown name": ("/v1/mu-macro", {**CASE, "speed": 1.0}),
    "columns": ("/v1/mu-macro/batch", _BATCH),
    "columns with outputs": ("/v1/mu-macro/batch", {**_BATCH, "include": ["power", "gradient"]}),
    "rows": ("/v1/mu-macro/batch", [CASE, {**CASE, "k": "rigid"}, {**CASE, "v0": -1}, {}, 3]),
    "a law": ("/v1/law", {**CASE, "v0": None, "start": 1e-3, "stop": 1.0, "points": 21}),
    "a root": ("/v1/solve-for", {**CASE, "y0": None, "unknown": "y0", "target": 0.15}),
    "a motion": (
        "/v1/motion",
        {"mu0": 0.3, "Fz": 10, "k": 1e6, "f": 2e4, "v0": 0.01, "x": [1e-6, 90], "y": 2e-6},
    ),
    "a stiffness": (
        "/v1/stiffness",
        {"geometry": "ball", "radius": "5mm", "Fz": 10, "E": 210e9, "nu": 0.3},
    ),
    "a fit": (
        "/v1/fit",
        {"v0": [1e-3, 5e-3, 0.02, 0.1], "mu_macro": [0.069, 0.174, 0.247, 0.289], "Fz": 10}
        | {"y0": 4e-7, "f": 2e4},
    ),
}


def requests(_folder: Path) -> Results:
    """Return the status and body of requests of every kind."""
    from service.app import create_app

    app = create_app()

    async def ask(path: str, body: bytes) -> str:
        received, sent = [body], list[Any]()

        async def receive() -> Any:
            if received:
                return {"type": "http.request", "body": received.pop(), "more_body": False}
            await asyncio.sleep(SECONDS)
            return None

        async def send(message: Any) -> None:
            sent.append(message)

        headers = {"host": "x", "content-type": "application/json", "content-length": len(body)}
        scope = {
            "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "POST",
            "path": path, "raw_path": path.encode(), "root_path": "", "query_string": b"",
            "headers": [(name.encode(), str(x).encode()) for name, x in headers.items()],
            "client": ("127.0.0.1", 1), "server": ("x", 80), "scheme": "http", "state": {},
        }  # fmt: skip
        await app(scope, receive, send)
        text = b"".join(one.get("body", b"") for one in sent if one["type"].endswith("body"))
        return f"{sent[0]['status']} {_without_ids(text.decode())}"

    async def ask_all() -> Results:
        async with app.router.lifespan_context(app):
            return {
                name: await ask(path, json.dumps(body).encode())
                for name, (path, body) in REQUESTS.items()
            }

    return asyncio.run(ask_all())


def _without_ids(text: str) -> str:
    """Return a text without what changes from one run to the next."""
    text = re.sub(r'"(request_id|instance)":\s*"[^"]*",?', "", text)
    return re.sub(r"\b\d+(\.\d+)? (ms|s|rows/s)\b", "TIME", text)


def _run(folder: Path, *words: str, checkout: Path | None = None) -> str:
    """Return exit code and all that a command prints, in an environment of the checkout."""
    root = checkout or Path.cwd()
    programs = f"{root}/.venv/bin{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    environment = {name: x for name, x in os.environ.items() if not name.startswith("MUMACRO_")}
    environment |= {"PATH": programs, "PYTHONPATH": str(root), "MPLBACKEND": "agg"}
    try:
        done = subprocess.run(
            words, cwd=folder, env=environment, capture_output=True, text=True, errors="replace",
            stdin=subprocess.DEVNULL, timeout=SECONDS, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"not ended after {SECONDS} s"
    text = f"exit code {done.returncode}\n{done.stdout}\n--- stderr\n{done.stderr}"
    return _without_ids(text.replace(str(folder), ".").replace(str(root), "CHECKOUT"))


def files(folder: Path) -> Results:
    """Return what ``eval`` and ``fit`` make of every table file of the tests."""
    data = Path.cwd() / "tests" / "data"
    tables = [*data.glob("*.csv"), *(data / "rigs").iterdir(), *(data / "cases/files").iterdir()]
    results: Results = {}
    for table in sorted(tables):
        own = folder / table.parent.name
        own.mkdir(exist_ok=True)
        shutil.copy(table, own)
        words = ("mumacro", "eval", table.name, "-o", "out.csv", "--force")
        results[f"eval {table.parent.name}/{table.name}"] = "\n".join(
            [_run(own, *words), *_contents(own, {"out.csv", "out.csv.rejects.csv"})]
        )
        for path in own.glob("out.csv*"):
            path.unlink()
        fit = ("mumacro", "fit", table.name, "Fz=10N y0=0.4um f=20kHz", "--json")
        results[f"fit {table.parent.name}/{table.name}"] = _run(own, *fit)
    return results


def _contents(folder: Path, names: set[str]) -> Iterator[str]:
    for path in sorted(folder.iterdir()):
        if path.name in names:
            yield f"--- {path.name}\n{path.read_text('utf-8', errors='replace')}"


def documents(folder: Path) -> Results:
    """Return what every command of the documents prints, and the files that it leaves."""
    from tests.support.documents import PAGES, blocks, plain
    from tests.support.places import ROOT
    from tests.support.serving import running

    results: Results = {}
    with running([sys.executable, "-m", "service", "--port", "0"], folder / "log") as server:
        server.wait_until_ready()
        for page in PAGES:
            where = page.relative_to(ROOT).as_posix()
            own = folder / where.replace("/", "-")
            own.mkdir()
            for program in blocks(page, "c"):
                (own / "program.c").write_text(program.text, "utf-8")
            for block in blocks(page, "bash", "console"):
                for line, _ in [] if block.marked else block.entries():
                    command = plain(line)
                    if any(word in command for word in LEFT_OUT):
                        continue
                    ask = command.replace(SERVICE, server.url)
                    results[f"{where}: {command}"] = _run(own, "bash", "-c", ask)
            for path in sorted(own.rglob("*")):
                if path.suffix in (".csv", ".h", ".c", ".tsv", ".json"):
                    digest = hashlib.sha256(path.read_bytes()).hexdigest()
                    results[f"{where}: file {path.relative_to(own)}"] = digest
    return results


KINDS = {
    probe.__name__: probe
    for probe in (openapi, answers, roots, motions, laws, fits, requests, files, documents)
}


# --- the comparison -------------------------------------------------------------------------------


def ask(checkout: Path, kinds: list[str], out: Path) -> None:
    """Write what a checkout answers, asked in its own environment."""
    words = [str(checkout / ".venv/bin/python"), __file__, "--here", str(out), *kinds]
    environment = {**os.environ, "MUMACRO_TABLES": str(checkout / "tables")}
    environment.pop("PYTHONPATH", None)
    subprocess.run(words, cwd=checkout, env=environment, check=True)


def answers_of(side: Path, kinds: list[str]) -> dict[str, Results]:
    """Return what a checkout answers, or what a file holds of it."""
    if side.is_file():
        return dict(json.loads(side.read_text("utf-8")))
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "results.json"
        ask(side, kinds, out)
        return answers_of(out, kinds)


def answer_here(out: Path, kinds: list[str]) -> None:
    """Write what the checkout in the working directory answers."""
    root = str(Path.cwd())
    sys.path[:] = [root, f"{root}/src", *(x for x in sys.path if x != str(Path(__file__).parent))]
    found = {}
    for kind in kinds:
        print(f"{root}: {kind}", file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(sys.stderr):
            found[kind] = KINDS[kind](Path(folder))
    out.write_text(json.dumps(found), "utf-8")


def differences(old: Results, new: Results) -> Iterator[str]:
    """Yield each result that is not the same in both, with the first lines that differ."""
    for name in [*old, *(name for name in new if name not in old)]:
        if name not in new or name not in old:
            yield f"{name}: only in the {'old' if name in old else 'new'} checkout"
        elif old[name] == new[name]:
            continue
        elif isinstance(old[name], list) and len(old[name]) == len(new[name]):
            unlike = [a != b for a, b in zip(old[name], new[name], strict=True)]
            first = unlike.index(True)
            yield f"{name}: {sum(unlike)} of {len(unlike)} differ, the first at {first}"
        else:
            texts = (str(old[name]).splitlines(), str(new[name]).splitlines())
            lines = list(difflib.unified_diff(*texts, lineterm="", n=0))[2:]
            changed = [line[:240] for line in lines if not line.startswith("@@")]
            yield "\n      ".join([f"{name}:", *changed[:8]])


def main(arguments: list[str]) -> int:
    """Compare two checkouts; 1 where something differs."""
    if arguments[:1] == ["--here"]:
        answer_here(Path(arguments[1]), arguments[2:])
        return 0
    if arguments[:1] == ["--write"] and len(arguments) == 3:
        ask(Path(arguments[2]).resolve(), [*KINDS], Path(arguments[1]).resolve())
        return 0
    if len(arguments) < 2 or not {*arguments[2:]} <= KINDS.keys():
        print(f"{__doc__}\nKinds: {', '.join(KINDS)}", file=sys.stderr)
        return 2
    kinds = arguments[2:] or [*KINDS]
    old, new = (answers_of(Path(side).resolve(), kinds) for side in arguments[:2])
    total = 0
    for kind in kinds:
        unlike = [*differences(old[kind], new[kind])]
        total += len(unlike)
        print(f"{kind}: {len(unlike)} of {len({*old[kind], *new[kind]})} results differ")
        for text in unlike[:SHOWN]:
            print(f"    {text}")
        if len(unlike) > SHOWN:
            print(f"    and {len(unlike) - SHOWN} more")
    return int(total > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
