"""The interface against its own description: schemathesis makes requests from it, good and bad, and checks the answers.

Every check is on, for every operation; always the same requests.  One check knows an exception: a request that the
description allows may be refused for what no JSON Schema can say, a relation between two fields, or between a field
and the tables that are loaded.  ``RELATIONS`` lists these reasons; a refusal for any other reason fails.  And a bad
line of a stream, or a bad case of a batch, is refused in its place in the answer, not by the status.
"""

import json
import re
import urllib.request
from pathlib import Path

import pytest

schemathesis = pytest.importorskip("schemathesis", reason="the PyPI package schemathesis is not installed")

from hypothesis import HealthCheck, settings  # noqa: E402
from schemathesis.config import GenerationConfig, ProjectConfig, ProjectsConfig, SchemathesisConfig  # noqa: E402

from service.app import create_app  # noqa: E402
from service.settings import Settings  # noqa: E402

EXAMPLES = 25
ARROW, NDJSON = "application/vnd.apache.arrow.stream", "application/x-ndjson"
RELATIONS = (
    r"has no effect unless include asks for std",
    r"is required where include asks for std",
    r"must be left out: it is what is asked for",
    r"no loaded table is that tight; the tightest has 1e-12",
    r"must be one of mumacro-1e-12, mumacro-1e-10, mumacro-1e-7, mumacro-1e-4",
    r"choose by one id or by tolerance",
    r"is given in the query and in the body",
    r"must be two ascending, finite numbers",
    r"must be finite and > start",
    r"lists must have one length",
    r"is required: omega",
    r"is required: the tangential stiffness",
    r"omega is given, too",
    r"give the standard deviation of omega or of f, not of both",
    r"must be > 0 on a logarithmic scale",
    r"must be mu_macro where mu0 is the unknown",
    r"must be left out: the family has its values",
    r".* is what is swept",
    r"all curves together may have",
    r"(mu0|Fz|k) must be finite and > 0",
    r"is not in the answer",
)
FIVE = ("mu0", "Fz", "y0", "omega", "v0")  # of which one is asked for, and the others are required


@schemathesis.serializer(ARROW)
def as_it_is(_context, value):
    """An Arrow stream is bytes, and what is generated for it mostly is none."""
    return value if isinstance(value, bytes) else json.dumps(value, default=str).encode()


@schemathesis.serializer(NDJSON)
def one_line(_context, value):
    """The description is that of a line."""
    return value if isinstance(value, bytes) else json.dumps(value).encode() + b"\n"


@schemathesis.deserializer(NDJSON)
def first_line(_context, response):
    """As above."""
    return json.loads(response.content.split(b"\n", 1)[0])


def described():
    """The description, from an application that is never started: pytest asks for the operations while it collects."""
    generation = GenerationConfig(deterministic=True, max_examples=EXAMPLES)
    config = SchemathesisConfig(projects=ProjectsConfig(default=ProjectConfig(generation=generation)))
    tables = Path(__file__).resolve().parent.parent / "tables"
    return schemathesis.openapi.from_dict(create_app(Settings(tables=(tables,))).openapi(), config=config)


SCHEMA = described()


def is_beyond_a_schema(case, response):
    """Whether a refusal names only relations that a schema cannot say, or is that of bytes that are no stream."""
    if case.media_type in (ARROW, "text/csv") and response.status_code in (400, 422):
        return True
    if response.status_code != 422:
        return False
    faults = response.json().get("errors", [])
    path = response.request.path_url.split("?")[0]

    def known(fault):
        if fault["reason"] == "is required":
            return path in ("/v1/solve-for", "/v1/law", "/v1/law.csv") and fault["field"] in FIVE
        return any(re.match(reason, fault["reason"]) for reason in RELATIONS)

    return bool(faults) and all(map(known, faults))


def is_refused_in_its_place(response):
    """Whether a bad line or a bad case of a batch is refused where it stands, and not by the status of the whole.

    A stream has begun with 200 before anybody has read the line.  A bad case of a batch spoils only itself.
    """
    batch = response.status_code == 200 and response.request.path_url.startswith("/v1/mu-macro/batch")
    return batch and re.search(rb'"urn:problem-type:|"errors":\[\{', response.content) is not None


# UM-Bridge has an error form and statuses of its own, 500 InvalidOutput among them; test_umbridge.py has its rules.
@SCHEMA.exclude(tag="UM-Bridge 1.0").parametrize()
@settings(max_examples=EXAMPLES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_every_answer_is_as_described(case, live_server):
    response = case.call(base_url=live_server.url)
    known = [schemathesis.checks.positive_data_acceptance] if is_beyond_a_schema(case, response) else []
    if is_refused_in_its_place(response):
        known.append(schemathesis.checks.negative_data_rejection)
    case.validate_response(response, excluded_checks=known)


def test_every_operation_is_tried(live_server):
    labels = {operation.ok().label for operation in SCHEMA.get_all_operations()}
    with urllib.request.urlopen(f"{live_server.url}/openapi.json", timeout=60) as response:
        served = json.load(response)["paths"]
    assert labels == {f"{method.upper()} {path}" for path, methods in served.items() for method in methods}
    assert "POST /v1/mu-macro/batch" in labels
