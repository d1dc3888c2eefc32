"""From the library's scalar Python functions to C99: what is translated is the very source that numba compiles.

A function is translated where it is first called, with the types that the call has, as numba does; what it calls
follows.  The language is the one the kernels are written in: floats, integers and truth values; ``if``, ``for`` over
``range``, conditional expressions; tuples as results; arrays that are parameters or constants, by index; and rows of
arrays, element by element.  Anything else raises :class:`TranslationError` with the place, so that a kernel which
outgrows the language is noticed when the header is made and not when it is used.

Python's meaning is kept: evaluation order, true division, comparison chains, ``min`` and ``max`` that keep the first
of equals.  Operations are not reordered, so that C and the interpreted Python give the same bits wherever the two use
the same mathematical library; the compiled kernels may differ in the last digits, since they fuse multiply-adds.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mumacro.errors import MumacroError

__all__ = ["BOOL", "FLOAT", "INT", "Array", "TranslationError", "Translator", "literal"]


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
_RANK = {BOOL: 0, INT: 1, FLOAT: 2}
_OF_ANNOTATION = {"float": FLOAT, "int": INT, "bool": BOOL}
# keywords of C and C++, and names that common headers define as macros
_TAKEN = frozenset(
    "and asm auto bool break case catch char class const continue default delete do double else enum extern far float "
    "for goto if inline int interface long near new not operator or private protected public register return "
    "short signed sizeof small static struct switch template this throw try typedef union unsigned using void "
    "volatile while xor I".split()
)
_ATOM, _UNARY, _MUL, _ADD, _REST = 5, 4, 3, 2, 0
_ARITHMETIC = {ast.Mult: ("*", _MUL), ast.Div: ("/", _MUL), ast.Add: ("+", _ADD), ast.Sub: ("-", _ADD)}
_BITS = {ast.BitAnd: "&", ast.BitOr: "|", ast.RShift: ">>", ast.LShift: "<<"}
_COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
#: what Python calls of other libraries become; the names with PREFIX are written in header.c
_CALLS: dict[Any, tuple[str, Type]] = {
    math.sqrt: ("sqrt", FLOAT), math.log: ("log", FLOAT), math.hypot: (PREFIX + "hypot", FLOAT),
    np.cbrt: (PREFIX + "cbrt", FLOAT), np.trunc: (PREFIX + "trunc", FLOAT), math.ldexp: (PREFIX + "ldexp", FLOAT),
    math.frexp: (PREFIX + "frexp", Struct((FLOAT, INT))),
}  # fmt: skip
_PICKS = {min: "min", max: "max"}
_CASTS = {np.int64: INT, int: INT, np.float64: FLOAT, float: FLOAT}
_INDEX = "@"  # stands for the running index in the code of a row


@dataclass(frozen=True)
class Value:
    """C code of an expression, its type, and how tightly it binds."""

    code: str
    type: Type
    binds: int = _ATOM

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
        count = f"int64_t {name}_count, " if _counted(kind) else ""
        return f"{count}{const}double (*{name}){inner}" if inner else f"double {name}[{kind.shape[0]}]"
    return f"{kind.name if isinstance(kind, Struct) else 'int' if kind == BOOL else kind} {name}"


@dataclass
class Translator:
    """Translates functions and keeps what they need: other functions, tuple types, constants, constant arrays.

    Attributes
    ----------
    functions : dict of str to str
        C definitions by name, callees before callers.
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
            return Value(c_name if value.ndim > 1 else f"{c_name}[{_INDEX}]", Array(value.shape))
        kind = BOOL if isinstance(value, bool) else INT if isinstance(value, int) else FLOAT
        text = literal(value)
        c_name = PREFIX.upper() + name.strip("_").upper()
        if self.macros.setdefault(c_name, text) != text:
            raise TranslationError(f"two constants are called {name}")
        return Value(c_name, kind)


class _Function:
    """One function on its way to C."""

    def __init__(self, into: Translator, function: Any, name: str, types: list[Type]) -> None:
        self.into, self.function, self.name = into, function, name
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        definition = tree.body[0]
        if not isinstance(definition, ast.FunctionDef):
            raise TranslationError(f"{name} is no function")
        self.definition, self.scope = definition, function.__globals__
        arguments = definition.args.args
        if len(arguments) != len(types):
            raise TranslationError(f"{function.__name__} takes {len(arguments)} arguments, not {len(types)}")
        self.parameters: list[Type] = [
            _OF_ANNOTATION.get(ast.unparse(a.annotation), t) if a.annotation else t
            for a, t in zip(arguments, types, strict=True)
        ]
        self.locals: dict[str, Type] = {a.arg: t for a, t in zip(arguments, self.parameters, strict=True)}
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
        head = ", ".join(declared(self.locals[n], _c_name(n)) for n in names)
        result = declared(self.result, "").strip() if self.result is not None else "void"
        comment = _comment(self.function.__doc__)
        return "\n".join([
            *([comment] if comment else []), f"static inline {result} {self.name}({head}) {{",
            *self.variables(names), *self.unused(names), *self.lines, "}",
        ])  # fmt: skip

    def unused(self, parameters: Sequence[str]) -> list[str]:
        """Statements that keep compilers from asking about parameters that are not needed."""
        used = _words(" ".join(self.lines))
        counts = [f"{n}_count" for n in parameters if _counted(self.locals[n])]
        return [f"    (void){name};" for name in (*map(_c_name, parameters), *counts) if name not in used]

    def variables(self, parameters: Sequence[str]) -> list[str]:
        """Declarations of the local variables, a line a type."""
        scalars: dict[str, list[str]] = {}
        rows = []
        for name, kind in self.locals.items():
            if name in parameters:
                continue
            if isinstance(kind, Array):
                rows.append(f"    {declared(kind, _c_name(name))};")
            else:
                scalars.setdefault(declared(kind, "").strip(), []).append(_c_name(name))
        return [f"    {kind} {', '.join(names)};" for kind, names in scalars.items()] + rows

    def fail(self, node: ast.AST, why: str) -> TranslationError:
        line = getattr(node, "lineno", 0)
        return TranslationError(f"{self.function.__module__}.{self.function.__name__}, line {line}: {why}")

    # --- statements -----------------------------------------------------------------------------------

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
                self.nested(f"for ({_c_name(name)} = {start}; {_c_name(name)} < {stop}; ++{_c_name(name)})", body)
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
                kind = self.into.struct([_wider(a, b) for a, b in zip(kind.items, self.result.items, strict=True)])
            self.result = kind
            self.put(f"return {kind.name}_of({', '.join(item.code for item in items)});")
        else:
            found = self.expression(value)
            scalar = isinstance(found.type, str) and isinstance(self.result, str)
            self.result = _wider(found.type, self.result) if scalar else found.type
            self.put(f"return {found.code};")

    def settle(self, node: ast.AST, name: str, kind: Type) -> None:
        """The type of a variable: the wider of what it is given here and elsewhere."""
        before = self.locals.get(name, kind)
        if isinstance(kind, Array):
            kind = Array(kind.shape, constant=False)
        if isinstance(before, str) and isinstance(kind, str):
            self.locals[name] = _wider(before, kind)
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
        if all(_words(item.code).isdisjoint(map(_c_name, w)) for i, item in enumerate(items) for w in written[:i]):
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
                    self.each(target, f"{_c_name(name)}[{_INDEX}]", found.code, found.type.shape)
                else:
                    self.put(f"{_c_name(name)} = {found.code};")
            case ast.Subscript(ast.Name(name), ast.Tuple(parts)) if all(isinstance(p, ast.Slice) for p in parts):
                kind = self.locals[name]
                if not isinstance(kind, Array) or isinstance(found.type, Array):
                    raise self.fail(target, "only a number can fill an array")
                places = [f"i{d}" for d in range(len(kind.shape))]
                loops = "".join(f"for (int {i} = 0; {i} < {n}; ++{i}) " for i, n in zip(places, kind.shape, strict=True))
                self.put(f"{loops}{_c_name(name)}{''.join(f'[{i}]' for i in places)} = {found.code};")
            case ast.Subscript():
                self.put(f"{self.expression(target).code} = {found.code};")
            case _:
                raise self.fail(target, "cannot be assigned to")

    def each(self, node: ast.AST, target: str, code: str, shape: tuple[int, ...]) -> None:
        """A row element by element; it may read itself at the same place only."""
        if target.removesuffix(f"[{_INDEX}]") + f"[{_INDEX} + " in code:
            raise self.fail(node, "a row that is read at another place than it is written")
        run = f"for (int e = 0; e < {shape[0]}; ++e) {target} = {code};"
        self.put(run.replace(_INDEX, "e"))

    # --- expressions ----------------------------------------------------------------------------------

    def expression(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(bool() | int() | float() as x):
                return Value(literal(x), BOOL if isinstance(x, bool) else INT if isinstance(x, int) else FLOAT)
            case ast.Name(name) if name in self.locals:
                kind = self.locals[name]
                row = isinstance(kind, Array) and len(kind.shape) == 1
                return Value(f"{_c_name(name)}[{_INDEX}]" if row else _c_name(name), kind)
            case ast.Attribute(array, "size"):
                return Value(str(math.prod(self.array(array).shape)), INT)
            case ast.Name() | ast.Attribute(ast.Name()):
                return self.known(node)
            case ast.UnaryOp(ast.USub(), x):
                inner = self.expression(x)
                return Value(f"-{inner.inside(_ATOM)}", inner.type, _UNARY)
            case ast.UnaryOp(ast.Not(), x):
                return Value(f"!{self.expression(x).inside(_ATOM)}", BOOL, _UNARY)
            case ast.BinOp(left, operator, right):
                return self.binary(node, left, operator, right)
            case ast.BoolOp(operator, parts):
                sign = " && " if isinstance(operator, ast.And) else " || "
                return Value(sign.join(self.expression(p).inside(_UNARY) for p in parts), BOOL, _REST)
            case ast.Compare(first, operators, others):
                return self.compare(node, [first, *others], operators)
            case ast.IfExp(test, yes, no):
                a, b = self.expression(yes), self.expression(no)
                kind = a.type if a.type == b.type else _wider(a.type, b.type)
                return Value(f"{self.expression(test).inside(_UNARY)} ? {a.inside(_ADD)} : {b.inside(_ADD)}", kind, _REST)
            case ast.Call(function, arguments, []):
                return self.call(node, function, arguments)
            case ast.Subscript(value, index):
                return self.element(node, value, index)
        raise self.fail(node, f"no translation of: {ast.unparse(node)}")

    def known(self, node: ast.expr) -> Value:
        """A constant of the function's module, or of one that it imports."""
        value = self.found(node)
        if not isinstance(value, (bool, int, float, np.ndarray)):
            raise self.fail(node, f"{ast.unparse(node)} is no number and no array")
        if isinstance(node, ast.Attribute) and self.scope.get(ast.unparse(node.value)) is math:
            return Value(literal(value), FLOAT)
        return self.into.constant(node.id if isinstance(node, ast.Name) else ast.unparse(node).split(".")[-1], value)

    def found(self, node: ast.expr) -> Any:
        """What a name stands for outside of the function."""
        if isinstance(node, ast.Name):
            builtins = {"min": min, "max": max, "abs": abs, "int": int, "float": float}
            if node.id in self.scope or node.id in builtins:
                return self.scope.get(node.id, builtins.get(node.id))
        elif isinstance(node, ast.Attribute):
            return getattr(self.found(node.value), node.attr)
        raise self.fail(node, f"{ast.unparse(node)} is not known")

    def array(self, node: ast.expr) -> Array:
        kind = self.expression(node).type
        if not isinstance(kind, Array):
            raise self.fail(node, f"{ast.unparse(node)} is no array")
        return kind

    def binary(self, node: ast.expr, left: ast.expr, operator: ast.operator, right: ast.expr) -> Value:
        if isinstance(operator, ast.Pow):
            if not (isinstance(left, ast.Name) and isinstance(right, ast.Constant) and right.value in (2, 4)):
                raise self.fail(node, "only squares and fourth powers of a variable")
            square = self.expression(ast.copy_location(ast.BinOp(left, ast.Mult(), left), node))
            code = square.code if right.value == 2 else f"({square.code}) * ({square.code})"
            return Value(code, square.type, _MUL)
        a, b = self.expression(left), self.expression(right)
        if type(operator) in _BITS:
            if FLOAT in (a.type, b.type):
                raise self.fail(node, "bits of a float")
            return Value(f"{a.inside(_ATOM)} {_BITS[type(operator)]} {b.inside(_ATOM)}", _wider(a.type, b.type), _REST)
        if type(operator) not in _ARITHMETIC:
            raise self.fail(node, f"no translation of: {ast.unparse(node)}")
        sign, binds = _ARITHMETIC[type(operator)]
        rows = {t for t in (a.type, b.type) if isinstance(t, Array)}
        if len(rows) > 1 or any(len(t.shape) != 1 for t in rows):
            raise self.fail(node, "only rows of one length can be combined")
        kind: Type = Array(next(iter(rows)).shape) if rows else _wider(_wider(a.type, b.type), INT)
        if sign == "/" and kind == INT:
            a, kind = Value(f"(double){a.inside(_ATOM)}", FLOAT, _UNARY), FLOAT
        return Value(f"{a.inside(binds)} {sign} {b.inside(binds + 1)}", kind, binds)

    def compare(self, node: ast.expr, sides: Sequence[ast.expr], operators: Sequence[ast.cmpop]) -> Value:
        parts = []
        for left, operator, right in zip(sides, operators, sides[1:], strict=False):
            a = self.expression(left).inside(_ADD)
            if isinstance(operator, ast.In) and isinstance(right, ast.Tuple):
                parts += [" || ".join(f"({a} == {self.expression(item).inside(_ADD)})" for item in right.elts)]
            elif type(operator) in _COMPARE:
                parts += [f"{a} {_COMPARE[type(operator)]} {self.expression(right).inside(_ADD)}"]
            else:
                raise self.fail(node, f"no translation of: {ast.unparse(node)}")
        if any(not isinstance(side, (ast.Name, ast.Constant, ast.Attribute)) for side in sides[1:-1]):
            raise self.fail(node, "the middle of a chain must be a name or a number")
        return Value(parts[0] if len(parts) == 1 else " && ".join(f"({part})" for part in parts), BOOL, _REST)

    def call(self, node: ast.expr, function: ast.expr, arguments: Sequence[ast.expr]) -> Value:
        values = [self.expression(a) for a in arguments if not _is_kind(a)]
        if isinstance(function, ast.Attribute) and function.attr == "view":
            to = _CASTS[self.found(arguments[0])]
            inner = self.expression(function.value)
            return Value(f"{PREFIX}{'bits' if to == INT else 'number'}({inner.code})", to)
        target = self.found(function)
        if target in _CASTS:
            kind = _CASTS[target]
            return values[0] if values[0].type == kind else Value(f"({kind}){values[0].inside(_ATOM)}", kind, _UNARY)
        if target is abs and values[0].type == FLOAT:
            return Value(f"fabs({values[0].code})", FLOAT)
        if target in _PICKS and len(values) == 2:
            kind = _wider(values[0].type, values[1].type)
            letter = "f" if kind == FLOAT else "i"
            return Value(f"{PREFIX}{letter}{_PICKS[target]}({values[0].code}, {values[1].code})", kind)
        if target in _CALLS:
            name, result = _CALLS[target]
            if isinstance(result, Struct):
                self.into.struct(result.items)
            return Value(f"{name}({', '.join(v.code for v in values)})", result)
        if not callable(target) or not getattr(target, "__module__", "").startswith(("mumacro", "builder")):
            raise self.fail(node, f"{ast.unparse(function)} has no translation")
        if any(_INDEX in v.code for v in values):
            raise self.fail(node, "a row as an argument")
        name, kind_of_result = self.into.call(target, [v.type for v in values])
        given = [f"{v.code}_count, {v.code}" if _counted(v.type) else v.code for v in values]
        return Value(f"{name}({', '.join(given)})", kind_of_result or "void")

    def element(self, node: ast.expr, value: ast.expr, index: ast.expr) -> Value:
        if isinstance(value, ast.Attribute) and value.attr == "shape" and isinstance(index, ast.Constant):
            length = self.array(value.value).shape[int(str(index.value))]
            return Value(str(length) if length >= 0 else f"{self.expression(value.value).code}_count", INT)
        base = self.expression(value)
        if isinstance(base.type, Struct) and isinstance(index, ast.Constant):
            return Value(f"{base.code}._{index.value}", base.type.items[int(str(index.value))])
        if not isinstance(base.type, Array):
            raise self.fail(node, f"no translation of: {ast.unparse(node)}")
        shape, code = base.type.shape, base.inside(_ATOM)
        if isinstance(index, ast.Slice):
            return self.stretch(node, base, index)
        parts = index.elts if isinstance(index, ast.Tuple) else [index]
        for part in parts:
            place = self.expression(part).code
            code = code.replace(_INDEX, place) if len(shape) == 1 else f"{code}[{place}]"
            shape = shape[1:]
            code += f"[{_INDEX}]" * (len(shape) == 1)
        if len(shape) > 1:
            raise self.fail(node, "an array of rows as a value")
        return Value(code, Array(shape) if shape else FLOAT)

    def stretch(self, node: ast.expr, base: Value, index: ast.Slice) -> Value:
        """``row[:4]`` or ``row[4:]``."""
        if not isinstance(base.type, Array) or len(base.type.shape) != 1 or index.step is not None:
            raise self.fail(node, "only a row can be cut, without steps")
        ends = [int(ast.unparse(e)) if e is not None else None for e in (index.lower, index.upper)]
        start, stop = ends[0] or 0, base.type.shape[0] if ends[1] is None else ends[1]
        code = base.code if start == 0 else base.code.replace(_INDEX, f"{_INDEX} + {start}")
        return Value(code, Array((stop - start,)))


def _wider(a: Type | None, b: Type | None) -> str:
    """The type that holds the values of both."""
    if a is None or b is None:
        a = b = a or b
    if not (isinstance(a, str) and isinstance(b, str)):
        raise TranslationError(f"no common type of {a} and {b}")
    return a if _RANK[a] >= _RANK[b] else b


def _counted(kind: Type) -> bool:
    return isinstance(kind, Array) and kind.shape[0] < 0


def _words(code: str) -> set[str]:
    return set(re.findall(r"[A-Za-z_]\w*", code))


def _is_kind(node: ast.expr) -> bool:
    """Whether an argument is a type, as of ``x.view(np.int64)``."""
    return isinstance(node, ast.Attribute) and ast.unparse(node) in ("np.int64", "np.float64")


def _c_name(name: str) -> str:
    if name == "_":
        return "turn"
    return name + "_" if name in _TAKEN else name


def _comment(text: str | None) -> str:
    """The first paragraph of a docstring."""
    first = re.split(r"\n\s*\n", inspect.cleandoc(text or ""))[0]
    plain = re.sub(r":\w+:`~?([^`]*)`|``([^`]*)``", lambda m: m[1] or m[2], first).replace("*/", "* /")
    return "/* " + plain.replace("\n", "\n * ") + " */" if plain else ""
