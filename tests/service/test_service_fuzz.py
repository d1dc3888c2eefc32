"""Strange requests, damaged framing, many clients at once: short forms of trials in fuzz/."""

import pytest

from tests.support.nightly import nightly
from tests.support.scripts import script
from tests.support.serving import Server

attacks, framing, strange = map(script, ("fuzz.attacks", "fuzz.framing", "fuzz.strange"))
MOST_MB, MOST_S = 400, 2.0  # the aim for the wait is 0.25 s, on a machine that does nothing else


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.05, nightly(0.2)])
@pytest.mark.parametrize("name", attacks.ATTACKS)
def test_an_attack_takes_little_memory_and_keeps_nobody_waiting(name: str, share: float) -> None:
    cost = attacks.cost_of(attacks.ATTACKS[name], share)
    assert cost.memory < MOST_MB
    assert max(cost.livez, cost.metrics) < MOST_S
    assert cost.after < 0.5


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
