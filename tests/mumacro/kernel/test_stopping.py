"""A computation that another thread ends: every question of the library looks at the flag."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mumacro
from mumacro.kernel.binding import kernels
from mumacro.kernel.threads import Stop, StopError, share_out
from tests.support.cases import CASE, opened

SWEPT = {name: x for name, x in CASE.items() if name != "v0"}
V0 = np.geomspace(1e-3, 0.3, 20)
TABLE = opened(1e-12)
POINTS = {**SWEPT, "v0": V0, "mu_macro": TABLE.evaluate(**SWEPT, v0=V0).mu_macro}
WAY = 5e-6 * np.sin(np.linspace(0.0, 4.0 * np.pi, 401))
QUESTIONS: dict[str, Callable[[], Any]] = {
    "array": lambda: TABLE.evaluate(**SWEPT, v0=V0),
    "outputs": lambda: TABLE.evaluate(**SWEPT, v0=V0, include=("power", "settling", "gradient")),
    "law": lambda: mumacro.law(TABLE, "v0", start=1e-3, stop=1.0, **SWEPT),
    "solve_for": lambda: mumacro.solve_for(TABLE, "v0", [0.1, 0.2], **SWEPT),
    "fit": lambda: mumacro.fit({n: x for n, x in POINTS.items() if n not in ("k", "mu0")}),
    "fit_loop": lambda: mumacro.fit_loop(WAY, 3.0 * np.tanh(WAY / 2e-6), Fz=10.0),
    "map": lambda: TABLE.mu_ratio(V0, V0),
    "motion": lambda: mumacro.motion(mu0=0.3, Fz=10.0, k=1e6, f=2e4, v0=0.01, x=1e-6),
    "solve_motion": lambda: mumacro.solve_motion("v0", 0.1, mu0=0.3, Fz=10.0, k=1e6, f=2e4, x=1e-6),
}


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_question_ends_once_the_flag_is_set(name: str) -> None:
    stop = Stop()
    with stop.of_this_thread():
        QUESTIONS[name]()
        stop.set()
        with pytest.raises(StopError):
            QUESTIONS[name]()
    QUESTIONS[name]()


def test_a_long_loop_ends_between_its_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    from mumacro.fits import loop

    way, stop, calls = np.tile(WAY, 20), Stop(), list[int]()

    class Kernel:
        @staticmethod
        def loop_forces(code: int, p: np.ndarray, *rest: Any) -> Any:
            calls.append(p.size)
            stop.set()
            return kernels[-1].loop_forces(code, p, *rest)

    monkeypatch.setattr(loop, "_KERNEL", Kernel)
    monkeypatch.setattr(loop, "_AT_ONCE", 4 * way.size)
    with stop.of_this_thread(), pytest.raises(StopError):
        mumacro.fit_loop(way, 3.0 * np.tanh(way / 2e-6), Fz=10.0)
    assert calls == [calls[0]]
    assert calls[0] <= 4


def test_an_array_ends_between_its_pieces() -> None:
    for threads in (1, 2):
        stop, pieces = Stop(), list[slice]()

        def work(part: slice, stop: Stop = stop, pieces: list[slice] = pieces) -> None:
            pieces.append(part)
            stop.set()
            time.sleep(0.01)

        with stop.of_this_thread(), pytest.raises(StopError):
            share_out(10_000_000, threads, work)
        assert 1 <= len(pieces) <= threads + 1
