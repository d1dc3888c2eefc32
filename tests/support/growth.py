"""How the time of a regular expression grows with its text: one worst text for each repetition.

``python -m tests.support.growth`` reads lines of JSON, each ``[where, pattern, flags, method]``,
and writes one line for each repetition before it is tried, and one with what was found after it.
Run it in a process of its own with a limit on its time: nothing can interrupt a match.
"""

import heapq
import json
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import product
from operator import itemgetter
from re import _parser  # type: ignore[attr-defined]
from typing import Any, NamedTuple

SHORT, LONG = 4 * 1024, 64 * 1024  # characters
#: the largest ratio of the times of a long and a short text: 16 if linear, 256 if quadratic
MOST = 64.0
#: characters, while the worst text is looked for: the first find what is cubic or has no end, and
#: which texts are slow enough to be tried longer
_LOOK, _LONGER, _TRIED_LONGER = 250, 2000, 30
_LASTING = 0.05  # seconds: one run tells them well enough
_TOO_LONG = 3000.0  # times as long as an expression that takes each character once
_CHARACTERS = "\t\n !\"%'()*,-./019:;<=>@AZ[\\]_az{}~\0é–µ"
_CATEGORIES = {
    f"CATEGORY_{name}": re.compile(text)
    for name, text in {
        "SPACE": r"\s",
        "NOT_SPACE": r"\S",
        "DIGIT": r"\d",
        "NOT_DIGIT": r"\D",
        "WORD": r"\w",
        "NOT_WORD": r"\W",
    }.items()
}
_REPEATS = ("MAX_REPEAT", "MIN_REPEAT", "POSSESSIVE_REPEAT")
# of the processor where it is fine enough: other programs may run beside this one
_clock = (
    time.process_time
    if time.get_clock_info("process_time").resolution < 1e-6
    else time.perf_counter
)

Node = tuple[Any, Any]


class Repetition(NamedTuple):
    """A repeated part of an expression: what it repeats, and texts that lead to it and follow."""

    body: Sequence[Node]
    before: tuple[str, ...]
    behind: Sequence[Node]


def _accepts(node: Node, character: str) -> bool:
    """Whether a node of one character matches this one, without regard to flags."""
    kind, value = str(node[0]), node[1]
    if kind == "LITERAL":
        return character == chr(value)
    if kind == "NOT_LITERAL":
        return character != chr(value)
    if kind == "RANGE":
        return bool(value[0] <= ord(character) <= value[1])
    if kind == "CATEGORY":
        return _CATEGORIES[str(value)].match(character) is not None
    if kind == "IN":
        negated = str(value[0][0]) == "NEGATE"
        return negated != any(_accepts(one, character) for one in value[negated:])
    return kind == "ANY" and character != "\n"


def _sample(nodes: Sequence[Node], characters: str, least: int) -> str:
    """A text that matches; every repetition at least so often."""
    text = ""
    for kind, value in nodes:
        name = str(kind)
        if name in _REPEATS:
            text += _sample(value[2], characters, least) * min(max(value[0], least), 300)
        elif name == "BRANCH":
            text += _sample(value[1][0], characters, least)
        elif name == "SUBPATTERN":
            text += _sample(value[3], characters, least)
        elif name == "ATOMIC_GROUP":
            text += _sample(value, characters, least)
        elif name == "LITERAL":
            text += chr(value)
        else:
            text += next((one for one in characters if _accepts((kind, value), one)), "")
    return text


def _within(node: Node) -> list[Sequence[Node]]:
    """The parts of a node that are sequences themselves."""
    name, value = str(node[0]), node[1]
    if name == "BRANCH":
        return list(value[1])
    if name == "SUBPATTERN":
        return [value[3]]
    if name in ("ASSERT", "ASSERT_NOT"):
        return [value[1]]
    if name == "ATOMIC_GROUP":
        return [value]
    return [value[2]] if name in _REPEATS else []


def _single(nodes: Sequence[Node]) -> Iterator[Node]:
    """The nodes of one character, inner ones too; of a word its first one."""
    word = False
    for node in nodes:
        parts = _within(node)
        if not parts and str(node[0]) not in ("AT", "GROUPREF") and not word:
            yield node
        word = str(node[0]) == "LITERAL"
        for part in parts:
            yield from _single(part)


def _alphabet(nodes: Sequence[Node], written: str) -> str:
    """One character of each kind that the expression tells apart."""
    single = list(_single(nodes))
    kinds: dict[tuple[bool, ...], str] = {}
    for character in _CHARACTERS + written:
        kinds.setdefault(tuple(_accepts(node, character) for node in single), character)
    return "".join(kinds.values())


def _repetitions(
    nodes: Sequence[Node], characters: str, before: tuple[str, ...] = ("",)
) -> Iterator[Repetition]:
    """All repetitions of a parsed expression, inner ones too."""
    nodes = list(nodes)
    for i, node in enumerate(nodes):
        if str(node[0]) in _REPEATS and node[1][1] > 1:
            yield Repetition(list(node[1][2]), before, nodes[i + 1 :])
        for part in _within(node):
            yield from _repetitions(part, characters, before)
        endings = {_sample([node], characters, least) for least in (0, 1)}
        before = tuple(sorted({a + b for a, b in product(before, endings)}, key=len))
        before = before[:1] + before[-1:] if len(before) > 2 else before


def _texts(repetition: Repetition, characters: str) -> Iterator[Callable[[int], str]]:
    """Texts of any length that lead to a repetition, repeat it, and then do not match."""
    body, before, behind = repetition
    pumps = {_sample(body, characters[i:] + characters[:i], 1) for i in range(len(characters))}
    pumps |= {_sample(behind, characters, least) for least in (0, 1)}  # as of .*a.*b
    short = ["", *characters]
    ends = {a + b for a, b in product(short, short)}
    ends |= {_sample(behind, characters, least) + end for least in (0, 1) for end in short}
    for start, pump, end in product(before, sorted(pumps - {""}), sorted(ends)):
        yield partial(_pumped, start, pump, end)


def _pumped(start: str, pump: str, end: str, size: int) -> str:
    return start + pump * (size // len(pump)) + end


def _best(run: Callable[[Any], object], text: Any, times: int) -> float:
    """The shortest time of several runs [s]; of a long one the first."""
    best = float("inf")
    for _ in range(times):
        begun = _clock()
        run(text)
        best = min(best, _clock() - begun)
        if best > _LASTING:
            break
    return best


def _runner(compiled: re.Pattern[Any], method: str) -> Callable[[Any], object]:
    """What is timed, of one text."""
    if method in ("sub", "subn"):
        return lambda text: getattr(compiled, method)(text[:0], text)
    if method == "finditer":
        return lambda text: sum(1 for _ in compiled.finditer(text))
    one: Callable[[Any], object] = getattr(compiled, method)
    return one


@cache
def _once(size: int) -> float:
    """The time of an expression that takes each of so many characters once [s]."""
    return _best(re.compile("[ab]*c").match, "a" * size, 20)


def _ratio(run: Callable[[int], float]) -> float:
    """Of the times of a long and a short text; a quadratic one is left before the longest."""
    for _ in range(3):  # another program may have run beside one of them
        short = run(SHORT)
        for size in (SHORT * 2, SHORT * 4, SHORT * 8, LONG):
            ratio = run(size) / short
            if ratio > (size / SHORT) ** 1.5:  # between linear and quadratic; MOST for the longest
                break
        else:
            return ratio
    return max(ratio, MOST)


def growth(pattern: str | bytes, flags: int, method: str) -> Iterator[tuple[str, float]]:
    """For each repetition the worst text, in short, and the ratio of its times; infinite where a
    text of 2000 characters takes too long already."""
    run = _runner(re.compile(pattern, flags), method)
    tree = _parser.parse(pattern, flags)
    characters = _alphabet(tree, pattern if isinstance(pattern, str) else pattern.decode("latin-1"))

    def seconds(make: Callable[[int], str], times: int, size: int) -> float:
        text = make(size)
        return _best(run, text if isinstance(pattern, str) else text.encode(), times)

    def too_long(make: Callable[[int], str], size: int, taken: float) -> bool:
        limit = _TOO_LONG * _once(size)
        return taken > limit and seconds(make, 5, size) > limit

    def worst(repetition: Repetition) -> tuple[Callable[[int], str], float | None]:
        """The slowest text, and its ratio where that is known already."""
        looked = list[tuple[float, Callable[[int], str]]]()
        for make in _texts(repetition, characters):
            looked.append((seconds(make, 2, _LOOK), make))
            if too_long(make, _LOOK, looked[-1][0]):
                return make, float("inf")
        tried = list[tuple[float, Callable[[int], str]]]()
        for _, make in heapq.nlargest(_TRIED_LONGER, looked, key=itemgetter(0)):
            tried.append((seconds(make, 2, _LONGER), make))
            if too_long(make, _LONGER, tried[-1][0]):
                return make, float("inf")
        return max(tried, key=itemgetter(0))[1], None

    for repetition in _repetitions(tree, characters):
        make, ratio = worst(repetition)
        yield repr(make(8)), _ratio(partial(seconds, make, 5)) if ratio is None else ratio


def main() -> None:
    """Try every expression of the standard input."""
    for line in sys.stdin:
        where, pattern, flags, method = json.loads(line)
        text = pattern if isinstance(pattern, str) else pattern[0].encode("latin-1")
        print(json.dumps({"where": where, "begun": True}), flush=True)
        for shown, ratio in growth(text, flags, method):
            found = {"where": where, "text": shown, "ratio": min(ratio, 1e9)}
            print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
