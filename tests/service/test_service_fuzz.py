"""Strange requests, damaged framing, many clients at once: short forms of trials in fuzz/."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from tests.support.nightly import nightly
from tests.support.scripts import script
from tests.support.serving import Server, serving

attacks, framing, strange = map(script, ("fuzz.attacks", "fuzz.framing", "fuzz.strange"))
MOST_MB = 400
#: with a small share it is the attack before it
SAME = "The same on 4 connections"
#: these go on until a computation may take no longer
LONGEST = ("Searches with 1,000", SAME, "The slowest motions of a ball")


@pytest.fixture(scope="module")
def attacked() -> Iterator[Callable[[str], tuple[Server, float]]]:
    """One service for all attacks with a limit of computations, and the processor time of its
    start."""
    services: dict[str, tuple[Server, float]] = {}
    with ExitStack() as ends:

        def of(limit: str) -> tuple[Server, float]:
            if limit not in services:
                server = ends.enter_context(serving(MUMACRO_COMPUTE_LIMIT_S=limit))
                services[limit] = server, server.busy()
            return services[limit]

        yield of


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "share"),
    [
        *((name, 0.05) for name in attacks.ATTACKS if name != SAME),
        *(nightly(name, 0.2) for name in attacks.ATTACKS),
    ],
)
def test_an_attack_takes_little_memory_and_keeps_nobody_waiting(
    name: str, share: float, attacked: Callable[[str], tuple[Server, float]]
) -> None:
    """While ``/livez`` or ``/metrics`` waits the service computes less than for its own start; it
    rests after the attack."""
    server, start = attacked("3" if share < 0.1 and name.startswith(LONGEST) else "30")
    cost = attacks.cost_of(attacks.ATTACKS[name], share, server)
    assert cost.memory < MOST_MB
    assert cost.busy < start


def test_a_strange_request_is_answered_or_refused_and_never_an_error(live_server: Server) -> None:
    tally = strange.Tally()
    tally.ask(live_server, 1, 1000)
    assert tally.bad == []
    assert set(tally.counts) == set(strange.KINDS)
    assert {200, 400, 404, 422} <= set(tally.statuses)
    assert live_server.errors() == []


def test_a_connection_is_divided_into_the_same_requests_as_by_h11(live_server: Server) -> None:
    assert {framing.compared(live_server, seed) for seed in range(2000)} == {
        "the same",
        "fewer here",
    }
    assert live_server.errors() == []
