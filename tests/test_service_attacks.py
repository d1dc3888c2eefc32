"""Limits with many clients at once: a short form of fuzz/attacks.py, which tries their maximum counts."""

import pytest

from fuzz import attacks

SHARE = 0.2
MOST_MB, MOST_S = 512, 2.0  # the aim for the wait is 0.25 s, on a machine that does nothing else


@pytest.mark.slow
@pytest.mark.parametrize("name", attacks.ATTACKS)
def test_an_attack_takes_little_memory_and_keeps_nobody_waiting(name: str) -> None:
    memory, wait = attacks.tried(attacks.ATTACKS[name], SHARE)
    assert memory < MOST_MB
    assert wait < MOST_S
