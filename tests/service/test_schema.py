"""The interface against its own description: schemathesis makes valid and invalid requests and
checks the responses.

All checks are on for every operation; the requests are always the same.  One check has an
exception: a request that the description allows may be refused for a rule that JSON Schema cannot
express, a relation between two fields or a field and the loaded tables.  ``RELATIONS`` lists these
reasons; a refusal for any other reason fails.  A bad line of a stream, or a bad case of a batch, is
refused at its position in the response, not by the status.
"""

import json
import re
from typing import Any

import pytest

from tests.support.places import TABLES

schemathesis = pytest.importorskip(
    "schemathesis", reason="schemathesis of requirements/peers.txt is not installed"
)

from hypothesis import HealthCheck, settings  # noqa: E402
from schemathesis.config import (  # noqa: E402
    GenerationConfig,
    ProjectConfig,
    ProjectsConfig,
    SchemathesisConfig,
)

from service.app import create_app  # noqa: E402
from service.settings import Settings  # noqa: E402

pytestmark = pytest.mark.peer
EXAMPLES = 25
RELATIONS = (
    r"must be (left out: no effect unless|given if) include has std",
    r"must be left out: it is the unknown or swept input",
    r"must be >= 1e-12: no loaded table is tighter",
    r"is given in the query and in the body",
    r"is given more than once",  # k=low..high beside k_range
    r"must be two (ascending, finite )?numbers",
    r"must be (finite and )?> start",
    r"lists must have one length",
    r"is required: (omega|the tangential stiffness)",
    r"omega is given, too",
    r"must be left out beside omega",
    r"must be finite and > 0 on a logarithmic scale",
    r"must be mu_macro where mu0 is the unknown",
    r".* is the swept input",
    r"(mu0|Fz|k) must be finite and > 0",
    r"is not in the answer",
    r"must be left out (for direction|beside)",
    r"must be two stiffnesses",
    r"must be across or along for a ball",
    r"must be without (y0|Fz_amplitude)",
    r".* is (not computed|for one case)",
    r"must be >= 0 and below Fz",
    r"must be left out: (over an interval|unknown field)",
    r"must be left out where",
    r"must be given\b",
    r"must be without \w+ for ",
    r"must be without (model|inputs)",
    r"must be left out over a motion",
    r"speed must be at most",
    r"mu0 Fz / k must be a length",
    r"must be finite: a rigid contact is the limit",
    r"must be > 0, or x or y an oscillation",
    r"must be left out: this direction has no",
    r"must be >= 1e-07 for a ball",
    r"must be one of mu_macro",
    r"must be left out, because \w+ is the unknown",
    r"must be finite and > 0, or rigid",  # a law that goes along k from 0
)
#: further ones of a path: what a geometry needs depends on its name; random points hold no
#: information
OF_PATH = {
    "/v1/stiffness": (
        r"must be finite in at least one of the two bodies",
        r"must be >= \S+, the (half )?width of the contact",
        r"must be finite and > 0, from ",
        r"must be in pascals: did you mean",
    ),
    "/v1/fit": (
        r"must be left out: it is among the unknowns",
        r"must be one or both of",
        r"must be columns of one length",
        r"must be left out beside f \[Hz\]",
        r"must be points ",
        r"must be > 0 in at least one point",
        r"must be finite and (>|>=) 0$",  # an entry of a list
        r"must be finite and >= 0, within",
        r"must be <= mu0, within",
    ),
}
FIVE = ("mu0", "Fz", "y0", "omega", "v0")  # one of these is the unknown, the others are required


def described() -> Any:
    """The description, from an application that is never started: pytest needs the operations
    during collection."""
    generation = GenerationConfig(deterministic=True, max_examples=EXAMPLES)
    config = SchemathesisConfig(
        projects=ProjectsConfig(default=ProjectConfig(generation=generation))
    )
    tables = TABLES
    return schemathesis.openapi.from_dict(
        create_app(Settings(tables=(tables,))).openapi(), config=config
    )


SCHEMA = described()


def is_beyond_a_schema(response: Any) -> Any:
    """Whether a refusal is only for relations that a schema cannot express."""
    if response.status_code != 422:
        return False
    faults = response.json().get("errors", [])
    reasons = (*RELATIONS, *OF_PATH.get(response.request.path_url, ()))

    def is_beyond(fault: Any) -> Any:
        if fault["reason"] == "is required":
            return fault["field"] in (*FIVE, "Fz_amplitude", "k_low", "k_high")
        if fault["field"] in ("k_low", "k_high") and fault["reason"] == "must be finite and > 0":
            return True  # an end of k=low..high, which is a text: 0
        return any(re.match(reason, fault["reason"]) for reason in reasons)

    return bool(faults) and all(map(is_beyond, faults))


def is_refused_in_its_place(response: Any) -> Any:
    """Whether a bad case of a batch is refused at its position: it affects only itself."""
    batch = response.status_code == 200 and response.request.path_url.startswith(
        "/v1/mu-macro/batch"
    )
    return batch and b'"errors":[{' in response.content


@pytest.mark.slow
@SCHEMA.parametrize()  # type: ignore[untyped-decorator]
@settings(max_examples=EXAMPLES, derandomize=True, suppress_health_check=list(HealthCheck))
def test_every_answer_is_as_described(case: Any, live_server: Any) -> None:
    response = case.call(base_url=live_server.url)
    excluded = (
        [schemathesis.checks.positive_data_acceptance] if is_beyond_a_schema(response) else []
    )
    if is_refused_in_its_place(response):
        excluded.append(schemathesis.checks.negative_data_rejection)
    case.validate_response(response, excluded_checks=excluded)


def test_every_operation_is_tried(live_server: Any) -> None:
    labels = {operation.ok().label for operation in SCHEMA.get_all_operations()}
    served = json.loads(live_server.ask("GET", "/openapi.json")[2])["paths"]
    assert labels == {
        f"{method.upper()} {path}" for path, methods in served.items() for method in methods
    }
    assert "POST /v1/mu-macro/batch" in labels
