"""A client in strict TypeScript, whose types openapi-typescript makes from ``/openapi.json``: the
bodies of the documents compile, faults in them do not, and the answers are the library's."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from mumacro import Surrogate
from tests.support.cases import Case
from tests.support.comparing import close
from tests.support.compilers import run
from tests.support.places import ROOT

GENERATOR = shutil.which("openapi-typescript")
pytestmark = [
    pytest.mark.peer,
    pytest.mark.slow,
    pytest.mark.skipif(GENERATOR is None, reason="npm or requirements/npm is not installed"),
]

#: what a strict compiler must refuse: the line below each comment
FAULTS = """
// @ts-expect-error a misspelt input
export const misspelt: Body<"/v1/mu-macro"> = {mu0: 0.3, Fz: 10, k: 1e6, y0: 2e-6, f: 2e4, vo: 1};
// @ts-expect-error no stiffness
export const soft: Body<"/v1/mu-macro"> = {mu0: 0.3, Fz: 10, y0: 2e-6, f: 2e4, v0: 0.01};
// @ts-expect-error a gap is never rigid
export const gap: Body<"/v1/mu-macro"> = {mu0: 0.3, Fz: 10, k: null, y0: 2e-6, f: 2e4, v0: 0.01};
// @ts-expect-error no frequency
export const still: Body<"/v1/mu-macro"> = {mu0: 0.3, Fz: 10, k: 1e6, y0: 2e-6, v0: 0.01};
// @ts-expect-error an unknown contact
export const wheel: Body<"/v1/mu-macro"> = {...CASE, contact: "wheel"};
"""
PROGRAM = """
import createClient from "openapi-fetch";
import type {paths} from "./schema.d.ts";

declare const process: {argv: string[]};
type Body<P extends keyof paths> = paths[P] extends {
  post: {requestBody: {content: {"application/json": infer B}}};
} ? B : never;
const CASE = {mu0: 0.3, Fz: "10 N", k: "1 N/um", y0: "2um", f: 20e3, v0: 0.01};
const IN_SI = {mu0: 0.3, Fz: 10, k: 1e6, y0: 2e-6, f: 20e3, v0: 0.01};
%s
const client = createClient<paths>({baseUrl: process.argv[2] ?? ""});
const one = await client.POST("/v1/mu-macro", {body: {...CASE, include: ["power", "inputs"]}});
if (one.data === undefined) throw new Error(one.error.detail);
const mu: number = one.data.mu_macro;
const saved: number | null | undefined = one.data.power?.saved;
const k: number | "rigid" | undefined = one.data.inputs?.["k"]?.value;
const query = {...CASE, k: "rigid", omega: 1.3e5, f: undefined};
const rigid = await client.GET("/v1/mu-macro", {params: {query}});
const refused = await client.POST("/v1/mu-macro", {body: {...CASE, mu0: -0.3}});
if (refused.error === undefined) throw new Error("a negative coefficient is answered");
const field: string | undefined = refused.error.errors?.[0]?.field;
const columns = await client.POST("/v1/mu-macro/batch", {
  body: {...IN_SI, v0: [0, 0.01], omega: null},
});
const BALL = {...IN_SI, contact: "ball" as const};
const rows = await client.POST("/v1/mu-macro/batch", {body: [BALL, {...BALL, v0: 0}]});
console.log(JSON.stringify([mu, saved, k, rigid.data?.mu_macro, field, columns.data, rows.data]));
"""
DOCUMENTED = re.compile(r"curl [^\n]*?(/v1/[a-z/-]+)[^\n]*? -d '(\{[^\n]*?\})'")


def bodies(described: dict[str, Any]) -> list[tuple[str, str]]:
    """Path and body of each request in JSON that the documents or the description show."""
    found: list[tuple[str, str]] = []
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        found += DOCUMENTED.findall(page.read_text("utf-8"))
    assert len(found) >= 6
    schemas = described["components"]["schemas"]
    for path, operations in described["paths"].items():
        if "post" not in operations:
            continue
        content = operations["post"]["requestBody"]["content"]["application/json"]
        name = content["schema"].get("$ref", "").rpartition("/")[2]
        examples = [*schemas.get(name, {}).get("examples", ())]
        examples += [content["example"]] if "example" in content else []
        assert examples, f"no example of {path}"
        found += [(path, json.dumps(example)) for example in examples]
    return found


def test_a_strict_client_compiles_with_the_documented_bodies_and_is_answered(
    live_server: Any, tmp_path: Path, surrogate: Surrogate
) -> None:
    text = live_server.ask("GET", "/openapi.json")[2]
    (tmp_path / "openapi.json").write_bytes(text)
    (tmp_path / "node_modules").symlink_to(Path(str(GENERATOR)).parent.parent)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    written = bodies(json.loads(text))
    assert {path for path, _ in written} >= {
        f"/v1/{name}" for name in ("mu-macro", "law", "solve-for", "motion", "stiffness", "fit")
    }
    constants = "\n".join(
        f'export const body{i}: Body<"{path}"> = {body};' for i, (path, body) in enumerate(written)
    )
    (tmp_path / "program.ts").write_text(PROGRAM % (constants + FAULTS))
    run(str(GENERATOR), "openapi.json", "-o", "schema.d.ts", cwd=tmp_path)
    options = (
        "--strict --exactOptionalPropertyTypes false --noUncheckedIndexedAccess --target es2022"
    )
    options += " --module nodenext --lib es2022,dom,dom.iterable --allowImportingTsExtensions"
    options += " --rewriteRelativeImportExtensions --outDir built program.ts"
    run("tsc", *options.split(), cwd=tmp_path)
    mu, saved, k, rigid, field, columns, rows = json.loads(
        run("node", "built/program.js", live_server.url, cwd=tmp_path)
    )
    case: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3}
    right = surrogate.evaluate(**case, v0=0.01)
    balls = surrogate.evaluate(**case, v0=[0.01, 0.0], contact="ball").mu_macro.tolist()
    assert (mu, saved) == close((right.mu_macro, (0.3 - right.mu_macro) * 0.1), rel=1e-12)
    assert (k, field) == (1e6, "mu0")
    without_f = {name: x for name, x in case.items() if name not in ("k", "f")}
    assert rigid == surrogate.evaluate(**without_f, k="rigid", omega=1.3e5, v0=0.01).mu_macro
    assert columns["mu_macro"] == [surrogate.evaluate(**case, v0=0.0).mu_macro, right.mu_macro]
    assert [row["mu_macro"] for row in rows["results"]] == balls
