"""From the library's scalar Python functions to C99: the translated source is the one that numba compiles.

A function is translated where it is first called, with the types that the call has, as numba does; what it calls
follows.  The language is the one the kernels are written in: floats, integers and truth values; ``if``, ``for`` over
``range``, conditional expressions; tuples as results; arrays that are parameters or constants, by index; and rows of
arrays, element by element.  Anything else raises :class:`TranslationError` with the place, so that a kernel which
leaves the language is found when the header is made and not when it is used.

C keeps Python's semantics: evaluation order, true division, comparison chains, ``min`` and ``max`` that keep the first
of equals.  Operations are not reordered, so that C and the interpreted Python give the same bits wherever the two use
the same mathematical library; the compiled kernels may differ in the last digits, since they fuse multiply-adds.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .expressions import Expressions
from .types import (
    BOOL,
    FLOAT,
    INDEX,
    INT,
    OF_ANNOTATION,
    PREFIX,
    Array,
    Struct,
    TranslationError,
    Type,
    Value,
    c_name,
    counted,
    declared,
    literal,
    wider,
    words_of,
)  # fmt: skip

__all__ = ["Translator"]


@dataclass
class Translator:
    """Translates functions and keeps what they need: other functions, tuple types, constants, constant arrays.

    Attributes
    ----------
    functions : dict of str to str
        C definitions by name, called functions first.
    structs : dict of str to Struct
        Tuple types by C name.
    macros : dict of str to str
        Named scalar constants of the translated modules.
    tables : dict of str to ndarray
        Constant arrays of the translated modules, by C name.
    """

    functions: dict[str, str] = field(default_factory=dict)
    structs: dict[str, Struct] = field(default_factory=dict)
    macros: dict[str, str] = field(default_factory=dict)
    tables: dict[str, np.ndarray[Any, Any]] = field(default_factory=dict)
    _known: dict[str, tuple[Any, list[Type], Type | None]] = field(default_factory=dict)

    def call(self, function: Callable[..., Any], types: Sequence[Type]) -> tuple[str, Type | None]:
        """C name and result type of ``function``, translated for arguments of ``types`` if it is not yet."""
        plain = getattr(function, "py_func", function)
        name = PREFIX + plain.__name__.lstrip("_")
        if name not in self._known:
            one = _Function(self, plain, name, list(types))
            self.functions[name] = one.text()
            self._known[name] = plain, one.parameters, one.result
        other, parameters, result = self._known[name]
        if other is not plain:
            raise TranslationError(f"{other.__module__} and {plain.__module__} both have a function {plain.__name__}")
        if len(types) != len(parameters) or any(
            a != b for a, b in zip(types, parameters, strict=True) if isinstance(a, Array) or isinstance(b, Array)
        ):
            raise TranslationError(f"{plain.__name__} is called with {list(types)}, translated for {parameters}")
        return name, result

    def struct(self, items: Sequence[Type]) -> Struct:
        found = Struct(tuple(INT if item == BOOL else str(item) for item in items))
        self.structs[found.name] = found
        return found

    def constant(self, name: str, value: Any) -> Value:
        """A named constant of a module."""
        if isinstance(value, np.ndarray):
            c_name = PREFIX + name.strip("_").lower()
            if not np.array_equal(self.tables.setdefault(c_name, value), value):
                raise TranslationError(f"two arrays are called {name}")
            return Value(c_name if value.ndim > 1 else f"{c_name}[{INDEX}]", Array(value.shape))
        kind = BOOL if isinstance(value, bool) else INT if isinstance(value, int) else FLOAT
        text = literal(value)
        c_name = PREFIX.upper() + name.strip("_").upper()
        if self.macros.setdefault(c_name, text) != text:
            raise TranslationError(f"two constants are called {name}")
        return Value(c_name, kind)


class _Function(Expressions):
    """One function during its translation to C."""

    def __init__(self, into: Translator, function: Any, name: str, types: list[Type]) -> None:
        super().__init__(into, function)
        self.name = name
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        definition = tree.body[0]
        if not isinstance(definition, ast.FunctionDef):
            raise TranslationError(f"{name} is no function")
        self.definition = definition
        arguments = definition.args.args
        if len(arguments) != len(types):
            raise TranslationError(f"{function.__name__} takes {len(arguments)} arguments, not {len(types)}")
        self.parameters: list[Type] = [
            OF_ANNOTATION.get(ast.unparse(a.annotation), t) if a.annotation else t
            for a, t in zip(arguments, types, strict=True)
        ]
        self.locals = {a.arg: t for a, t in zip(arguments, self.parameters, strict=True)}
        self.result: Type | None = None
        self.lines: list[str] = []
        self.depth = 1

    def text(self) -> str:
        """The definition in C: translated again until the types of all variables are settled."""
        names = list(self.locals)
        while True:
            before = dict(self.locals), self.result
            self.lines = []
            self.block(self.definition.body)
            if before == (self.locals, self.result):
                break
        head = ", ".join(declared(self.locals[n], c_name(n)) for n in names)
        result = declared(self.result, "").strip() if self.result is not None else "void"
        said = comment(self.function.__doc__)
        return "\n".join([
            *([said] if said else []), f"static inline {result} {self.name}({head}) {{",
            *self.variables(names), *self.unused(names), *self.lines, "}",
        ])  # fmt: skip

    def unused(self, parameters: Sequence[str]) -> list[str]:
        """Statements that keep compilers from warning about unused parameters."""
        used = words_of(" ".join(self.lines))
        counts = [f"{n}_count" for n in parameters if counted(self.locals[n])]
        return [f"    (void){name};" for name in (*map(c_name, parameters), *counts) if name not in used]

    def variables(self, parameters: Sequence[str]) -> list[str]:
        """Declarations of the local variables, a line a type."""
        scalars: dict[str, list[str]] = {}
        rows = []
        for name, kind in self.locals.items():
            if name in parameters:
                continue
            if isinstance(kind, Array):
                rows.append(f"    {declared(kind, c_name(name))};")
            else:
                scalars.setdefault(declared(kind, "").strip(), []).append(c_name(name))
        return [f"    {kind} {', '.join(names)};" for kind, names in scalars.items()] + rows

    def put(self, line: str) -> None:
        self.lines.append("    " * self.depth + line)

    def block(self, body: Sequence[ast.stmt]) -> None:
        for statement in body:
            self.statement(statement)

    def nested(self, head: str, body: Sequence[ast.stmt]) -> None:
        self.put(head + " {")
        self.depth += 1
        self.block(body)
        self.depth -= 1

    def statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Expr(ast.Constant(str())):  # the docstring
                return
            case ast.Expr(ast.Call() as call):
                self.put(self.expression(call).code + ";")
            case ast.Assign(targets, value):
                self.assign(targets, value)
            case ast.AnnAssign(target, _, ast.expr() as value):
                self.assign([target], value)
            case ast.AugAssign(target, operator, value):
                load: Any = ast.parse(ast.unparse(target), mode="eval").body
                self.assign([target], ast.copy_location(ast.BinOp(load, operator, value), node))
            case ast.If(test, body, orelse):
                self.nested(f"if ({self.expression(test).code})", body)
                while len(orelse) == 1 and isinstance(inner := orelse[0], ast.If):
                    self.nested(f"}} else if ({self.expression(inner.test).code})", inner.body)
                    orelse = inner.orelse
                if orelse:
                    self.nested("} else", orelse)
                self.put("}")
            case ast.For(ast.Name(name), ast.Call(ast.Name("range"), bounds), body, []) if len(bounds) in (1, 2):
                start, stop = ("0", *(self.expression(b).code for b in bounds))[-2:]
                self.settle(node, name, INT)
                self.nested(f"for ({c_name(name)} = {start}; {c_name(name)} < {stop}; ++{c_name(name)})", body)
                self.put("}")
            case ast.Break():
                self.put("break;")
            case ast.Return(value):
                self.give(node, value)
            case _:
                raise self.fail(node, f"no translation of: {ast.unparse(node)}")

    def give(self, node: ast.Return, value: ast.expr | None) -> None:
        """``return``; a choice between tuples becomes two."""
        if value is None:
            self.put("return;")
        elif isinstance(value, ast.IfExp) and isinstance(value.body, ast.Tuple):
            self.put(f"if ({self.expression(value.test).code}) {{")
            self.depth += 1
            self.give(node, value.body)
            self.depth -= 1
            self.put("}")
            self.give(node, value.orelse)
        elif isinstance(value, ast.Tuple):
            items = [self.expression(item) for item in value.elts]
            kind = self.into.struct([item.type for item in items])
            if isinstance(self.result, Struct):
                kind = self.into.struct([wider(a, b) for a, b in zip(kind.items, self.result.items, strict=True)])
            self.result = kind
            self.put(f"return {kind.name}_of({', '.join(item.code for item in items)});")
        else:
            found = self.expression(value)
            scalar = isinstance(found.type, str) and isinstance(self.result, str)
            self.result = wider(found.type, self.result) if scalar else found.type
            self.put(f"return {found.code};")

    def settle(self, node: ast.AST, name: str, kind: Type) -> None:
        """The type of a variable: the wider of what it is given here and elsewhere."""
        before = self.locals.get(name, kind)
        if isinstance(kind, Array):
            kind = Array(kind.shape, constant=False)
        if isinstance(before, str) and isinstance(kind, str):
            self.locals[name] = wider(before, kind)
        elif before == kind or name not in self.locals:
            self.locals[name] = kind
        else:
            raise self.fail(node, f"{name} is {before} and {kind}")

    def assign(self, targets: Sequence[ast.expr], value: ast.expr) -> None:
        for target in targets:
            match target, value:
                case ast.Tuple(names), ast.Tuple(items):
                    self.together(target, names, [self.expression(item) for item in items])
                case ast.Tuple(names), _:
                    found = self.expression(value)
                    if not isinstance(found.type, Struct) or len(names) != len(found.type.items):
                        raise self.fail(value, "only a tuple of that length can be unpacked")
                    self.put("{")
                    self.depth += 1
                    self.put(f"const {found.type.name} found = {found.code};")
                    for i, (name, kind) in enumerate(zip(names, found.type.items, strict=True)):
                        if not (isinstance(name, ast.Name) and name.id == "_"):
                            self.store(name, Value(f"found._{i}", kind))
                    self.depth -= 1
                    self.put("}")
                case _:
                    self.store(target, self.expression(value))

    def together(self, node: ast.AST, names: Sequence[ast.expr], items: Sequence[Value]) -> None:
        """``a, b = x, y``: all right sides before all left ones, where it matters."""
        if len(names) != len(items):
            raise self.fail(node, "tuples of different lengths")
        written = [{n.id for n in ast.walk(name) if isinstance(n, ast.Name)} for name in names]
        if all(words_of(item.code).isdisjoint(map(c_name, w)) for i, item in enumerate(items) for w in written[:i]):
            for name, item in zip(names, items, strict=True):
                self.store(name, item)
            return
        self.put("{")
        self.depth += 1
        for i, item in enumerate(items):
            self.put(f"const {declared(item.type, f'item_{i}')} = {item.code};")
        for i, (name, item) in enumerate(zip(names, items, strict=True)):
            self.store(name, Value(f"item_{i}", item.type))
        self.depth -= 1
        self.put("}")

    def store(self, target: ast.expr, found: Value) -> None:
        match target:
            case ast.Name(name):
                self.settle(target, name, found.type)
                if isinstance(found.type, Array):
                    self.each(target, f"{c_name(name)}[{INDEX}]", found.code, found.type.shape)
                else:
                    self.put(f"{c_name(name)} = {found.code};")
            case ast.Subscript(ast.Name(name), ast.Tuple(parts)) if all(isinstance(p, ast.Slice) for p in parts):
                kind = self.locals[name]
                if not isinstance(kind, Array) or isinstance(found.type, Array):
                    raise self.fail(target, "only a number can fill an array")
                places = [f"i{d}" for d in range(len(kind.shape))]
                loops = "".join(
                    f"for (int {i} = 0; {i} < {n}; ++{i}) " for i, n in zip(places, kind.shape, strict=True)
                )
                self.put(f"{loops}{c_name(name)}{''.join(f'[{i}]' for i in places)} = {found.code};")
            case ast.Subscript():
                self.put(f"{self.expression(target).code} = {found.code};")
            case _:
                raise self.fail(target, "cannot be assigned to")

    def each(self, node: ast.AST, target: str, code: str, shape: tuple[int, ...]) -> None:
        """A row element by element; it may read itself at the same place only."""
        if target.removesuffix(f"[{INDEX}]") + f"[{INDEX} + " in code:
            raise self.fail(node, "a row that is read at another place than it is written")
        run = f"for (int e = 0; e < {shape[0]}; ++e) {target} = {code};"
        self.put(run.replace(INDEX, "e"))


def comment(text: str | None) -> str:
    """The first paragraph of a docstring."""
    first = re.split(r"\n\s*\n", inspect.cleandoc(text or ""))[0]
    plain = re.sub(r":\w+:`~?([^`]*)`|``([^`]*)``", lambda m: m[1] or m[2], first).replace("*/", "* /")
    return "/* " + plain.replace("\n", "\n * ") + " */" if plain else ""
