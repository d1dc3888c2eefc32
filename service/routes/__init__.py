"""The endpoints, and the dependencies that they share."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from pydantic import ValidationError
from starlette.requests import Request

from ..errors import FieldFault, faults_of, names_at, refusal

__all__ = ["etag_matches", "no_query", "once_each", "parameters_of"]


async def no_query(request: Request) -> None:
    """Refuse a query where there is a body."""
    if request.scope["query_string"]:
        pairs = request.query_params.multi_items()[:100]
        faults = [FieldFault(name, "belongs in the body", text, place="parameter") for name, text in pairs]
        if faults:
            raise refusal(faults)


async def once_each(request: Request) -> None:
    """Refuse parameters that are given more than once; ``include`` may be."""
    if request.scope["query_string"]:
        counts = Counter(name for name, _ in request.query_params.multi_items())
        faults = [
            FieldFault(name, "is given more than once", place="parameter")
            for name, count in counts.items()
            if count > 1 and name != "include"
        ]
        if faults:
            raise refusal(faults[:100])


@contextmanager
def parameters_of(path: str) -> Iterator[None]:
    """Report the errors of a model as faults of the query of that path."""
    try:
        yield
    except ValidationError as error:
        entries = error.errors(include_url=False)
        raise refusal(faults_of(entries, "parameter", names_at(path))) from None


def etag_matches(request: Request, etag: str) -> bool:
    """Whether the client has this answer already (If-None-Match, weak comparison)."""
    offered = request.headers.get("if-none-match")
    if offered is None:
        return False
    return offered.strip() == "*" or etag in (part.strip().removeprefix("W/") for part in offered.split(","))
