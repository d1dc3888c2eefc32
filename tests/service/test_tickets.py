"""What a request holds until it is answered or its client has gone; headers that say two things."""

import asyncio
import json
import time
from collections.abc import Callable
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from service import admission as admissions
from service.admission import Admission, Ticket
from service.bodies import read_body
from service.middleware import HEALTH_PATHS, Entrance
from service.problems import FULL, RequestError
from tests.support.admitting import run, scope_of
from tests.support.serving import CASE


def test_a_request_that_goes_as_it_is_admitted_keeps_no_slot() -> None:
    async def main(admission: Admission) -> None:
        admission.see("a")
        await admission.take("a", False)
        waiting = asyncio.create_task(admission.take("b", False))
        await asyncio.sleep(0)
        admission.give_back("a", False)
        assert admission.slots == 1
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        assert (admission.slots, admission.queue) == (0, [])

    run(main, max_computations=1)


def test_of_those_who_wait_the_client_with_the_fewest_slots_comes_first() -> None:
    async def main(admission: Admission) -> None:
        for client, slots in (("d", 4), ("a", 3), ("b", 1)):
            admission.see(client)
            for _ in range(slots):
                await admission.take(client, False)
        first, second = (asyncio.create_task(admission.take(x, False)) for x in "ab")
        await asyncio.sleep(0)
        admission.give_back("d", False)
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert (first.done(), second.done()) == (False, True)
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)

    run(main, max_computations=8)


def test_one_client_has_half_of_the_places_in_the_queue_beside_another() -> None:
    async def main(admission: Admission) -> None:
        for client in "ba":
            admission.see(client)
        await admission.take("b", False)
        waiting = [asyncio.create_task(admission.take(x, False)) for x in 32 * "a"]
        await asyncio.sleep(0)
        with pytest.raises(RequestError, match="too many requests wait"):
            await admission.take("a", False)
        waiting.append(asyncio.create_task(admission.take("b", False)))
        await asyncio.sleep(0)
        assert len(admission.queue) == 33
        for task in waiting:
            task.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)

    run(main, max_computations=1)


def test_a_body_that_grows_counts_once_and_one_too_many_is_counted() -> None:
    async def main(admission: Admission) -> None:
        ticket = Ticket(scope_of(admission))
        ticket.weigh(800)
        ticket.hold(800)
        ticket.weigh(850)  # fifty bytes more
        ticket.hold(850)
        assert (admission.held_bytes, admission.refused) == (850, 0)
        with pytest.raises(RequestError, match="one client may have 896 bytes"):
            ticket.weigh(900)
        assert admission.refused == 1
        ticket.hold(0)
        assert admission.held_bytes == 0

    run(main, max_held_bytes=1024)


def test_a_small_body_that_comes_in_pieces_is_held() -> None:
    held: list[int] = []

    async def main(admission: Admission) -> None:
        pieces = iter([b"{" + b" " * 9, b" " * 10, b"}"])

        async def receive() -> Message:
            held.append(admission.held_bytes)
            body = next(pieces)
            return {"type": "http.request", "body": body, "more_body": not body.endswith(b"}")}

        body = await read_body({}, receive, 1000, scope_of(admission))
        assert json.loads(body) == {}

    run(main)
    assert held == [0, 10, 20]


async def never() -> Message:
    """What a client sends that waits for its answer."""
    await asyncio.Event().wait()
    raise AssertionError


@pytest.mark.slow
def test_the_time_limit_is_that_of_all_computations_of_a_request() -> None:
    async def main(admission: Admission) -> None:
        ticket = Ticket(scope_of(admission))
        await ticket.run(lambda: time.sleep(1.2), 1.0, never)
        with pytest.raises(RequestError, match="up to 2 s"):
            await ticket.run(lambda: time.sleep(1.2), 1.0, never)

    run(main, compute_limit_s=2)


def test_long_work_after_short_work_of_a_request_needs_a_slot_of_long_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(admissions, "WAIT_S", 0.05)

    async def main(admission: Admission) -> None:
        ticket = Ticket(scope_of(admission))
        await ticket.run(lambda: None, 1.0, never)
        await admission.take("b", True)  # the only one
        with pytest.raises(RequestError, match="no computation has ended"):
            await ticket.run(lambda: None, 2.0 * admissions.LONG, never)
        admission.give_back("b", True)
        await ticket.run(lambda: None, 2.0 * admissions.LONG, never)

    run(main, max_computations=2)


@pytest.mark.parametrize("path", sorted(HEALTH_PATHS))
def test_beyond_the_connections_only_the_probes_are_answered(path: str) -> None:
    answered: list[str] = []

    async def app(scope: Scope, _receive: Receive, _send: Send) -> None:
        answered.append(scope["path"])

    async def main(admission: Admission) -> None:
        full = scope_of(admission, state={FULL: True})
        ends: Any = None
        await Entrance(app)({**full, "path": path}, ends, ends)
        with pytest.raises(RequestError, match="too many connections"):
            await Entrance(app)(full, ends, ends)
        await Entrance(app)({**full, "state": {}}, ends, ends)

    run(main)
    assert answered == [path, "/v1/law"]


@pytest.mark.parametrize(
    ("scope", "client"),
    [
        ({"client": ("10.0.0.1", 80)}, "10.0.0.1"),
        ({"client": ("2001:db8:1:2:3::4", 80)}, "2001:db8:1:2::/64"),
        ({"client": ("x:y" * 99, 0)}, ("x:y" * 99)[:64]),
        ({"client": None}, ""),
        ({"client": ("10.0.0.1", 80), "key_holder": "lab"}, "key lab"),
    ],
)
def test_a_client_is_a_key_an_address_or_a_network(scope: dict[str, Any], client: str) -> None:
    async def main(admission: Admission) -> None:
        assert Ticket(scope_of(admission, **scope)).client == client

    run(main)


@pytest.mark.parametrize(
    "name",
    ["x-api-key", "authorization", "content-type", "content-encoding", "x-request-id"],
)
def test_a_header_that_decides_something_is_given_once(
    client: Any, problem: Callable[[Any, int], Any], name: str
) -> None:
    document = problem(client.get("/v1/tables", headers=[(name, "a"), (name, "a")]), 400)
    assert document["detail"] == f"the header {name} is given more than once"


@pytest.mark.parametrize(
    ("path", "needs_key"),
    [("/guide/", False), ("/guide/any.html", False), ("/guidebook", True), ("/guide-2/", True)],
)
def test_only_what_is_below_the_guide_is_open(started: Any, path: str, needs_key: bool) -> None:
    with started(api_key="k" * 20) as client:
        assert (client.get(path).status_code == 401) == needs_key


@pytest.mark.parametrize(
    ("number", "shown"),
    [
        (2**64 - 1, 2**64 - 1),
        (2**64, "an integer of many digits"),
        (-(2**63), -(2**63)),
        (-(2**63) - 1, "an integer of many digits"),
    ],
)
def test_an_integer_at_fault_is_shown_as_long_as_json_has_it(
    client: Any, problem: Callable[[Any, int], Any], number: int, shown: object
) -> None:
    document = problem(client.post("/v1/mu-macro", json={**CASE, "contact": number}), 422)
    assert document["errors"][0]["value"] == shown
