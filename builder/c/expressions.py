"""Expressions of the kernels' language in C; see translate.py."""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .types import (
    ADD,
    ATOM,
    BOOL,
    FLOAT,
    INDEX,
    INT,
    MUL,
    PREFIX,
    REST,
    UNARY,
    Array,
    Struct,
    TranslationError,
    Type,
    Value,
    c_name,
    counted,
    literal,
    wider,
)  # fmt: skip

if TYPE_CHECKING:
    from .translate import Translator

ARITHMETIC = {ast.Mult: ("*", MUL), ast.Div: ("/", MUL), ast.Add: ("+", ADD), ast.Sub: ("-", ADD)}
BITS = {ast.BitAnd: "&", ast.BitOr: "|", ast.RShift: ">>", ast.LShift: "<<"}
COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
#: what Python calls of other libraries become; the names with PREFIX are written in primitives.h
CALLS: dict[Any, tuple[str, Type]] = {
    math.sqrt: ("sqrt", FLOAT), math.log: ("log", FLOAT), math.hypot: (PREFIX + "hypot", FLOAT),
    np.cbrt: (PREFIX + "cbrt", FLOAT), np.trunc: (PREFIX + "trunc", FLOAT), math.ldexp: (PREFIX + "ldexp", FLOAT),
    math.frexp: (PREFIX + "frexp", Struct((FLOAT, INT))),
}  # fmt: skip
PICKS = {min: "min", max: "max"}
CASTS = {np.int64: INT, int: INT, np.float64: FLOAT, float: FLOAT}


class Expressions:
    """Translates the expressions of one function."""

    def __init__(self, into: Translator, function: Any) -> None:
        self.into, self.function, self.scope = into, function, function.__globals__
        self.locals: dict[str, Type] = {}

    def fail(self, node: ast.AST, why: str) -> TranslationError:
        line = getattr(node, "lineno", 0)
        return TranslationError(f"{self.function.__module__}.{self.function.__name__}, line {line}: {why}")

    def expression(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(bool() | int() | float() as x):
                return Value(literal(x), BOOL if isinstance(x, bool) else INT if isinstance(x, int) else FLOAT)
            case ast.Name(name) if name in self.locals:
                kind = self.locals[name]
                row = isinstance(kind, Array) and len(kind.shape) == 1
                return Value(f"{c_name(name)}[{INDEX}]" if row else c_name(name), kind)
            case ast.Attribute(array, "size"):
                return Value(str(math.prod(self.array(array).shape)), INT)
            case ast.Name() | ast.Attribute(ast.Name()):
                return self.known(node)
            case ast.UnaryOp(ast.USub(), x):
                inner = self.expression(x)
                return Value(f"-{inner.inside(ATOM)}", inner.type, UNARY)
            case ast.UnaryOp(ast.Not(), x):
                return Value(f"!{self.expression(x).inside(ATOM)}", BOOL, UNARY)
            case ast.BinOp(left, operator, right):
                return self.binary(node, left, operator, right)
            case ast.BoolOp(operator, parts):
                sign = " && " if isinstance(operator, ast.And) else " || "
                return Value(sign.join(self.expression(p).inside(UNARY) for p in parts), BOOL, REST)
            case ast.Compare(first, operators, others):
                return self.compare(node, [first, *others], operators)
            case ast.IfExp(test, yes, no):
                a, b = self.expression(yes), self.expression(no)
                kind = a.type if a.type == b.type else wider(a.type, b.type)
                return Value(f"{self.expression(test).inside(UNARY)} ? {a.inside(ADD)} : {b.inside(ADD)}", kind, REST)
            case ast.Call(function, arguments, []):
                return self.call(node, function, arguments)
            case ast.Subscript(value, index):
                return self.element(node, value, index)
        raise self.fail(node, f"no translation of: {ast.unparse(node)}")

    def known(self, node: ast.expr) -> Value:
        """A constant of the function's module, or of one that it imports."""
        value = self.found(node)
        if isinstance(node, ast.Attribute) and self.scope.get(ast.unparse(node.value)) is math:
            return Value(literal(float(value)), FLOAT)
        if not isinstance(value, (bool, int, float, np.ndarray)):
            raise self.fail(node, f"{ast.unparse(node)} is no number and no array")
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
            return Value(code, square.type, MUL)
        a, b = self.expression(left), self.expression(right)
        if type(operator) in BITS:
            if FLOAT in (a.type, b.type):
                raise self.fail(node, "bits of a float")
            return Value(f"{a.inside(ATOM)} {BITS[type(operator)]} {b.inside(ATOM)}", wider(a.type, b.type), REST)
        if type(operator) not in ARITHMETIC:
            raise self.fail(node, f"no translation of: {ast.unparse(node)}")
        sign, binds = ARITHMETIC[type(operator)]
        rows = {t for t in (a.type, b.type) if isinstance(t, Array)}
        if len(rows) > 1 or any(len(t.shape) != 1 for t in rows):
            raise self.fail(node, "only rows of one length can be combined")
        kind: Type = Array(next(iter(rows)).shape) if rows else wider(wider(a.type, b.type), INT)
        if sign == "/" and kind == INT:
            a, kind = Value(f"(double){a.inside(ATOM)}", FLOAT, UNARY), FLOAT
        return Value(f"{a.inside(binds)} {sign} {b.inside(binds + 1)}", kind, binds)

    def compare(self, node: ast.expr, sides: Sequence[ast.expr], operators: Sequence[ast.cmpop]) -> Value:
        parts = []
        for left, operator, right in zip(sides, operators, sides[1:], strict=False):
            a = self.expression(left).inside(ADD)
            if isinstance(operator, ast.In) and isinstance(right, ast.Tuple):
                parts += [" || ".join(f"({a} == {self.expression(item).inside(ADD)})" for item in right.elts)]
            elif type(operator) in COMPARE:
                parts += [f"{a} {COMPARE[type(operator)]} {self.expression(right).inside(ADD)}"]
            else:
                raise self.fail(node, f"no translation of: {ast.unparse(node)}")
        if any(not isinstance(side, (ast.Name, ast.Constant, ast.Attribute)) for side in sides[1:-1]):
            raise self.fail(node, "the middle of a chain must be a name or a number")
        return Value(parts[0] if len(parts) == 1 else " && ".join(f"({part})" for part in parts), BOOL, REST)

    def call(self, node: ast.expr, function: ast.expr, arguments: Sequence[ast.expr]) -> Value:
        values = [self.expression(a) for a in arguments if not is_kind(a)]
        if isinstance(function, ast.Attribute) and function.attr == "view":
            to = CASTS[self.found(arguments[0])]
            inner = self.expression(function.value)
            return Value(f"{PREFIX}{'bits' if to == INT else 'number'}({inner.code})", to)
        target = self.found(function)
        if target in CASTS:
            kind = CASTS[target]
            return values[0] if values[0].type == kind else Value(f"({kind}){values[0].inside(ATOM)}", kind, UNARY)
        if target is abs and values[0].type == FLOAT:
            return Value(f"fabs({values[0].code})", FLOAT)
        if target in PICKS and len(values) == 2:
            kind = wider(values[0].type, values[1].type)
            letter = "f" if kind == FLOAT else "i"
            return Value(f"{PREFIX}{letter}{PICKS[target]}({values[0].code}, {values[1].code})", kind)
        if target in CALLS:
            name, result = CALLS[target]
            if isinstance(result, Struct):
                self.into.struct(result.items)
            return Value(f"{name}({', '.join(v.code for v in values)})", result)
        if not callable(target) or not getattr(target, "__module__", "").startswith(("mumacro", "builder")):
            raise self.fail(node, f"{ast.unparse(function)} has no translation")
        if any(INDEX in v.code for v in values):
            raise self.fail(node, "a row as an argument")
        name, kind_of_result = self.into.call(target, [v.type for v in values])
        given = [f"{v.code}_count, {v.code}" if counted(v.type) else v.code for v in values]
        return Value(f"{name}({', '.join(given)})", kind_of_result or "void")

    def element(self, node: ast.expr, value: ast.expr, index: ast.expr) -> Value:
        if isinstance(value, ast.Attribute) and value.attr == "shape" and isinstance(index, ast.Constant):
            length = self.array(value.value).shape[int(str(index.value))]
            return Value(str(length) if length >= 0 else f"{self.expression(value.value).code}_count", INT)
        base = self.expression(value)
        if isinstance(base.type, Struct) and isinstance(index, ast.Constant):
            return Value(f"{base.code}._{index.value!s}", base.type.items[int(str(index.value))])
        if not isinstance(base.type, Array):
            raise self.fail(node, f"no translation of: {ast.unparse(node)}")
        shape, code = base.type.shape, base.inside(ATOM)
        if isinstance(index, ast.Slice):
            return self.stretch(node, base, index)
        parts = index.elts if isinstance(index, ast.Tuple) else [index]
        for part in parts:
            place = self.expression(part).code
            code = code.replace(INDEX, place) if len(shape) == 1 else f"{code}[{place}]"
            shape = shape[1:]
            code += f"[{INDEX}]" * (len(shape) == 1)
        if len(shape) > 1:
            raise self.fail(node, "an array of rows as a value")
        return Value(code, Array(shape) if shape else FLOAT)

    def stretch(self, node: ast.expr, base: Value, index: ast.Slice) -> Value:
        """``row[:4]`` or ``row[4:]``."""
        if not isinstance(base.type, Array) or len(base.type.shape) != 1 or index.step is not None:
            raise self.fail(node, "only a row can be cut, without steps")
        ends = [int(ast.unparse(e)) if e is not None else None for e in (index.lower, index.upper)]
        start, stop = ends[0] or 0, base.type.shape[0] if ends[1] is None else ends[1]
        code = base.code if start == 0 else base.code.replace(INDEX, f"{INDEX} + {start}")
        return Value(code, Array((stop - start,)))


def is_kind(node: ast.expr) -> bool:
    """Whether an argument is a type, as of ``x.view(np.int64)``."""
    return isinstance(node, ast.Attribute) and ast.unparse(node) in ("np.int64", "np.float64")
