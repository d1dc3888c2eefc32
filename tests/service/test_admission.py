"""What one process takes on at the same time: bytes, slots, shares of a client, the end of work."""

import asyncio
import socket
import struct
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mumacro
from mumacro.kernel.threads import STOP, StopError
from service import admission as admissions
from service import batch, tables
from service.admission import Admission
from service.bodies import within
from service.problems import RequestError
from tests.support.admitting import run
from tests.support.places import ROOT, TABLES
from tests.support.serving import CASE, Server, connect, head, running, to_end

MOTION: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.01}
SWEPT = {name: x for name, x in CASE.items() if name != "v0"}
LAW = {**SWEPT, "start": 1e-3, "stop": 1.0}
PATIENCE_S = 60


# --- the counts -----------------------------------------------------------------------------------


def test_one_client_has_half_of_the_slots_beside_another_and_never_the_last() -> None:
    async def main(admission: Admission) -> None:
        admission.see("a")
        for _ in range(7):
            await admission.take("a", False)
        with pytest.raises(RequestError):
            await admission.take("a", False)
        admission.see("b")
        await admission.take("b", False)
        for _ in range(4):
            admission.give_back("a", False)
        await admission.take("a", False)
        with pytest.raises(RequestError) as refusal:
            await admission.take("a", False)  # it has four, and b asked a moment ago
        assert int(refusal.value.headers["Retry-After"]) >= 1
        for _ in range(3):
            await admission.take("b", False)
        assert admission.slots == 8

    run(main)


def test_long_work_has_half_of_the_slots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(admissions, "WAIT_S", 0.05)

    async def main(admission: Admission) -> None:
        for client in "ba":
            admission.see(client)
        for client in "ab":
            for _ in range(2):
                await admission.take(client, True)
            with pytest.raises(RequestError):
                await admission.take(client, True)
        admission.see("c")
        with pytest.raises(RequestError):
            await admission.take("c", True)
        await admission.take("c", False)

    run(main)


def test_who_waits_is_admitted_before_a_client_with_more_slots() -> None:
    order: list[str] = []

    async def ask(admission: Admission, client: str) -> None:
        await admission.take(client, False)
        order.append(client)

    async def main(admission: Admission) -> None:
        for client in "ab":
            admission.see(client)
        for client in "aab":
            await admission.take(client, False)
        await admission.take("b", False)
        waiting = [asyncio.create_task(ask(admission, client)) for client in "aac"]
        await asyncio.sleep(0)
        admission.give_back("b", False, 0.1)
        await asyncio.sleep(0.01)
        assert order == ["c"]
        admission.give_back("a", False, 0.1)
        await asyncio.sleep(0.01)
        assert order == ["c", "a"]
        waiting[1].cancel()
        await asyncio.gather(*waiting, return_exceptions=True)
        assert not admission.queue

    run(main, max_computations=4)


@given(st.lists(st.tuples(st.sampled_from("abc"), st.booleans(), st.booleans()), max_size=40))
def test_slots_are_counted_however_they_are_taken(moves: list[tuple[str, bool, bool]]) -> None:
    async def main(admission: Admission) -> None:
        held: list[tuple[str, bool]] = []
        for client, is_long, back in moves:
            if back and held:
                admission.give_back(*held.pop())
                continue
            admission.see(client)
            before = admission.slots
            task = asyncio.create_task(admission.take(client, is_long))
            await asyncio.sleep(0)
            if task.done() and task.exception() is None:
                held.append((client, is_long))
            else:
                task.cancel()
                await asyncio.gather(task, return_exceptions=True)
                assert admission.slots == before
            assert admission.slots == len(held) <= 8
            assert sum(long for _, long in held) <= 4
        while held:
            admission.give_back(*held.pop())
        assert not admission.slots
        assert not admission.queue

    run(main)


def test_the_bytes_of_a_client_are_limited_beside_another() -> None:
    async def main(admission: Admission) -> None:
        admission.see("a")
        admission.weigh("a", 1792)
        with pytest.raises(RequestError, match="one client"):
            admission.weigh("a", 1793)
        admission.hold("a", 1792)
        admission.see("b")
        admission.weigh("b", 256)
        with pytest.raises(RequestError, match="all requests"):
            admission.weigh("b", 257)
        admission.hold("a", -1792)
        admission.weigh("b", 1024)
        with pytest.raises(RequestError, match="one client"):
            admission.weigh("b", 1025)
        assert not admission.held_bytes

    run(main, max_held_bytes=2048)


def test_a_service_that_stops_takes_no_new_work() -> None:
    async def main(admission: Admission) -> None:
        await admission.take("a", False)
        admission.begin_stop()
        with pytest.raises(RequestError, match="the service stops"):
            await admission.take("a", False)
        assert admission.slots == 1

    run(main)


# --- the end of work ------------------------------------------------------------------------------


def idle(app: Any) -> None:
    """Wait until nothing is held any more."""
    until = time.monotonic() + PATIENCE_S
    while app.state.admission.slots or app.state.admission.running:
        assert time.monotonic() < until
        time.sleep(0.01)
    assert not app.state.admission.held_bytes


def test_a_computation_beyond_its_limit_is_ended_and_gives_its_slot_back(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = threading.Event()

    def slow_motion(**_: Any) -> Any:
        stop = STOP.get()
        try:
            while True:
                stop.look()
                time.sleep(0.01)
        except StopError:
            ended.set()
            raise

    monkeypatch.setattr(mumacro, "motion", slow_motion)
    with started(compute_limit_s=1) as client:
        late = client.post("/v1/motion", json={**MOTION, "x": 1e-6})
        assert late.status_code == 503
        assert late.json()["type"].endswith("took-too-long")
        assert late.headers["retry-after"] == "1"
        assert ended.wait(PATIENCE_S)
        idle(client.app)
        assert client.post("/v1/law", json=LAW).status_code == 200


def test_more_than_the_slots_may_come_again_after_a_wait_and_the_others_go_on(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    end, real, begun = threading.Event(), mumacro.motion, threading.Semaphore(0)

    def slow_motion(**scene: Any) -> Any:
        if scene["contact"] == "ball":
            begun.release()
            assert end.wait(PATIENCE_S)
        return real(**{**scene, "contact": "spring"})

    monkeypatch.setattr(mumacro, "motion", slow_motion)
    ball = {**MOTION, "contact": "ball", "x": 1e-6}
    with started() as client, ThreadPoolExecutor(3) as pool:
        try:
            answers = [pool.submit(client.post, "/v1/motion", json=ball) for _ in range(3)]
            for _ in answers:
                assert begun.acquire(timeout=PATIENCE_S)
            refused = client.post("/v1/motion", json=ball)
            assert (refused.status_code, refused.headers["connection"]) == (503, "close")
            assert int(refused.headers["retry-after"]) >= 1
            for path in ("/livez", "/readyz", "/metrics", "/v1/table"):
                assert client.get(path).status_code == 200
            for path, body in (
                ("motion", {**MOTION, "x": 1e-6}),
                ("law", LAW),
                ("mu-macro", CASE),
                ("mu-macro/batch", {**CASE, "v0": [0.01] * 20_000}),
            ):
                assert client.post(f"/v1/{path}", json=body).status_code == 200
        finally:
            end.set()
        assert [answer.result().status_code for answer in answers] == [200] * 3
        idle(client.app)


def test_a_batch_that_is_read_holds_no_bytes_any_more(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    held, read, write = list[int](), batch.read, batch.Batch.write
    with started() as client:
        admission = client.app.state.admission

        def watched_read(*arguments: Any) -> Any:
            held.append(admission.held_bytes)
            return read(*arguments)

        def watched_write(*arguments: Any) -> Iterator[bytes]:
            held.append(admission.held_bytes)
            yield from write(*arguments)

        monkeypatch.setattr(batch, "read", watched_read)
        monkeypatch.setattr(batch.Batch, "write", watched_write)
        body = orjson.dumps({**CASE, "v0": [0.01] * 20_000})
        assert client.post("/v1/mu-macro/batch", content=body).status_code == 200
    assert held == [len(body), 0]


def test_a_small_batch_that_asks_for_much_is_computed_in_a_thread(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    slots, write = list[int](), batch.Batch.write
    with started() as client:

        def watched(*arguments: Any) -> Iterator[bytes]:
            slots.append(client.app.state.admission.slots)
            yield from write(*arguments)

        monkeypatch.setattr(batch.Batch, "write", watched)
        for include, slot in (([], 0), (["settling"], 1)):
            body = {**CASE, "v0": [0.01] * 2, "contact": "ball", "include": include}
            assert client.post("/v1/mu-macro/batch", json=body).status_code == 200
            assert slots.pop() == slot


def test_a_question_is_checked_in_a_thread_with_a_slot_if_it_is_long(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(admissions, "WAIT_S", 0.05)
    body = orjson.dumps({"geometry": "ball", "radius": 5e-3, "E": 210e9, "nu": 0.3, "Fz": 10.0})
    with started() as client:
        monkeypatch.setattr(Admission, "slots", 8)  # all of them
        for blanks, status in ((0, 200), (20_000, 503)):
            response = client.post("/v1/stiffness", content=body + b" " * blanks)
            assert response.status_code == status, response.text


def test_the_last_piece_of_a_batch_is_sent_without_a_slot_and_its_bytes_are_counted(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A client that reads it slowly keeps no other one from computing, and cannot fill the
    memory."""
    used = list[tuple[int, int]]()
    with started() as client:
        admission = client.app.state.admission

        async def watched(limit: int, move: Any, *kind: Any) -> Any:
            used.append((admission.slots, admission.held_bytes))
            return await within(limit, move, *kind)

        monkeypatch.setattr("service.routers.batch.within", watched)
        body = {**CASE, "v0": [0.01] * 60_000}
        answer = client.post("/v1/mu-macro/batch", json=body)
        assert answer.status_code == 200
        *_, first, second, (slots, held) = used
        assert (first, second, slots) == ((1, 0), (1, 0), 0)
        assert 0 < held < len(answer.content) / 2
        assert admission.held_bytes == 0


SEARCH = {
    **{name: x for name, x in MOTION.items() if name != "k"},
    "unknown": "k",
    "x": {"harmonic": 20, "amplitude": 1e-6},
    "contact": "ball",
    "target": np.linspace(0.01, 0.29, 1000).tolist(),
}


def posted(path: str, body: Any) -> bytes:
    content = orjson.dumps(body)
    return head(path, len(content)) + content


def rest(server: Server) -> None:
    """Wait until a server takes no processor time any more."""
    until, before = time.monotonic() + PATIENCE_S, server.busy()
    while True:
        time.sleep(0.5)
        if (now := server.busy()) - before < 0.1:
            return
        assert time.monotonic() < until, "it goes on computing"
        before = now


def test_a_search_ends_with_its_limit_or_its_client(serving: Any) -> None:
    """Without its client it would go on for an hour, whether the client resets the connection or
    closes it."""
    with serving(MUMACRO_COMPUTE_LIMIT_S="2") as server:
        status, headers, _ = server.ask("POST", "/v1/solve-for", orjson.dumps(SEARCH))
        assert (status, headers["retry-after"]) == (503, "2")
        rest(server)
    with serving(MUMACRO_COMPUTE_LIMIT_S="3600") as server:
        for resets in (True, False):
            with connect(server) as raw:
                linger = struct.pack("ii", resets, 0)
                raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
                raw.sendall(posted("/v1/solve-for", SEARCH))
                time.sleep(0.3)
        rest(server)
        assert not server.errors()


@pytest.mark.parametrize("grace_s", [0, 1])
def test_a_stop_ends_long_work_with_an_answer(serving: Any, grace_s: int) -> None:
    """Also the work that waits for the slot of another one."""
    settings = {"MUMACRO_SHUTDOWN_GRACE_S": str(grace_s), "MUMACRO_MAX_COMPUTATIONS": "2"}
    with serving(**settings) as server, ExitStack() as stack:
        connections = [stack.enter_context(connect(server)) for _ in range(2)]
        for raw in connections:
            raw.sendall(posted("/v1/solve-for", SEARCH))
        time.sleep(0.5)
        assert server.stop() == 0
        answers = [to_end(raw) for raw in connections]
    for answer in answers:
        assert answer.startswith(b"HTTP/1.1 503")
        assert b"the service stops" in answer


def test_a_file_system_that_hangs_stops_nobody_else(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with started() as client:
        end = threading.Event()
        monkeypatch.setattr(tables, "_PATIENCE_S", 0.1)
        looks = list[Any]()

        def hang(table: Any) -> None:
            looks.append(table)
            end.wait(PATIENCE_S)

        monkeypatch.setattr(tables.LoadedTable, "check", hang)
        for _ in range(3):
            response = client.get("/readyz")
            assert response.status_code == 503
            assert "do not answer" in response.json()["detail"]
            assert client.get("/livez").status_code == 200
        assert len(looks) == 1
        end.set()
        monkeypatch.undo()
        until = time.monotonic() + PATIENCE_S
        while client.get("/readyz").status_code != 200:
            assert time.monotonic() < until


HANGING = """
import sys, threading
from service.tables import Tables

Tables._check_files = lambda self: threading.Event().wait()
if __name__ == "__main__":
    from service.__main__ import main
    sys.exit(main(["--port", "0"]))
"""


def test_a_stop_waits_for_no_file_system_that_hangs(tmp_path: Path) -> None:
    """The process ends beside the thread that waits for it, with its last lines and exit code 0."""
    program = tmp_path / "hanging.py"
    program.write_text(HANGING)
    command = [sys.executable, str(program)]
    settings = {"MUMACRO_SHUTDOWN_GRACE_S": "0", "MUMACRO_TABLES": str(TABLES)}
    with running(command, tmp_path / "log.jsonl", ROOT, **settings) as server:
        status, _, body = server.ask("GET", "/readyz")
        assert (status, b"do not answer" in body) == (503, True)
        assert server.stop() == 0
    assert sum("a thread that does not end" in line for line in server.lines) == 1


def test_no_work_goes_on_when_the_service_has_ended(
    started: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python that ends beside a thread in compiled code aborts: the description is made in one."""
    monkeypatch.setattr("service.app._END_S", PATIENCE_S)  # however busy the machine is
    with started():
        pass
    assert [thread for thread in threading.enumerate() if thread.name == "work"] == []
