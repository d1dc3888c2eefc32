"""Limits with many clients at once: a short form of fuzz/attacks.py, which tries their maximum counts."""

import sys

import pytest

SHARE = 0.2
MOST_MB, MOST_S = 512, 2.0  # the aim for the wait is 0.25 s, on a machine that does nothing else


@pytest.fixture(scope="module")
def attacks(repository):
    sys.path.insert(0, str(repository / "fuzz"))
    try:
        import attacks
    finally:
        sys.path.remove(str(repository / "fuzz"))
    return attacks


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["tiny_fields", "pipelined", "silent", "waiting_bodies", "long_head_of_csv", "blank_lines", "brackets",
     "everything", "strange_words", "idle_streams", "descriptions"],
)  # fmt: skip
def test_an_attack_takes_little_memory_and_keeps_nobody_waiting(attacks, name):
    assert {attack.__name__ for attack in attacks.ATTACKS} >= {name}
    memory, wait = attacks.tried(getattr(attacks, name), SHARE)
    assert memory < MOST_MB
    assert wait < MOST_S


def test_every_attack_is_tried_above(attacks):
    names = [mark.args[1] for mark in test_an_attack_takes_little_memory_and_keeps_nobody_waiting.pytestmark
             if mark.name == "parametrize"]  # fmt: skip
    assert sorted(names[0]) == sorted(attack.__name__ for attack in attacks.ATTACKS)
