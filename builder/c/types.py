"""Types, names and constants of the C that kernels are translated to."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from mumacro.errors import MumacroError


class TranslationError(MumacroError):
    """Something in a kernel that has no translation; the text names the function and the line."""


@dataclass(frozen=True)
class Array:
    """An array of doubles with a shape known in advance; a first length of -1 is passed along beside the array."""

    shape: tuple[int, ...]
    constant: bool = True


@dataclass(frozen=True)
class Struct:
    """A tuple of scalars."""

    items: tuple[str, ...]

    @property
    def name(self) -> str:
        return PREFIX + "".join(item[0] for item in self.items)


Type = str | Array | Struct
FLOAT, INT, BOOL = "double", "int64_t", "bool"
PREFIX = "mumacro_in_"
RANK = {BOOL: 0, INT: 1, FLOAT: 2}
OF_ANNOTATION = {"float": FLOAT, "int": INT, "bool": BOOL}
# keywords of C and C++, and names that common headers define as macros
RESERVED = (
    "and asm auto bool break case catch char class const continue default delete do double else enum extern far float "
    "for goto if inline int interface long near new not operator or private protected public register return "
    "short signed sizeof small static struct switch template this throw try typedef union unsigned using void "
    "volatile while xor I"
)
TAKEN = frozenset(RESERVED.split())
ATOM, UNARY, MUL, ADD, REST = 5, 4, 3, 2, 0
INDEX = "@"  # stands for the running index in the code of a row


@dataclass(frozen=True)
class Value:
    """C code of an expression, its type, and how tightly it binds."""

    code: str
    type: Type
    binds: int = ATOM

    def inside(self, binds: int) -> str:
        """The code as an operand of something that binds as tightly as that."""
        return self.code if self.binds >= binds else f"({self.code})"


def literal(x: float | int | bool) -> str:
    """A Python number as a C constant that is read back as the same number."""
    if isinstance(x, (bool, np.bool_)):
        return str(int(x))
    if isinstance(x, (int, np.integer)):
        return str(x) if abs(x) < 2**31 else f"INT64_C({x})"
    if math.isnan(x):
        return "NAN"
    if math.isinf(x):
        return "HUGE_VAL" if x > 0.0 else "(-HUGE_VAL)"
    return repr(float(x)) if x >= 0.0 else f"({float(x)!r})"


def declared(kind: Type, name: str) -> str:
    """Declaration of a parameter or variable."""
    if isinstance(kind, Array):
        const = "const " if kind.constant else ""
        inner = "".join(f"[{n}]" for n in kind.shape[1:])
        count = f"int64_t {name}_count, " if counted(kind) else ""
        return f"{count}{const}double (*{name}){inner}" if inner else f"double {name}[{kind.shape[0]}]"
    return f"{kind.name if isinstance(kind, Struct) else 'int' if kind == BOOL else kind} {name}"


def wider(a: Type | None, b: Type | None) -> str:
    """The type that holds the values of both."""
    if a is None or b is None:
        a = b = a or b
    if not (isinstance(a, str) and isinstance(b, str)):
        raise TranslationError(f"no common type of {a} and {b}")
    return a if RANK[a] >= RANK[b] else b


def counted(kind: Type) -> bool:
    return isinstance(kind, Array) and kind.shape[0] < 0


def words_of(code: str) -> set[str]:
    return set(re.findall(r"[A-Za-z_]\w*", code))


def c_name(name: str) -> str:
    if name == "_":
        return "turn"
    return name + "_" if name in TAKEN else name
