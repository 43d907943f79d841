"""Expressions of FFCx's graph as C on vectors: text and kind of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ffcx.codegeneration import lnodes as L

from .tables import number

#: FFCx's name of a function → what computes it lane by lane.
FUNCTIONS = {
    "sqrt": "supple_sqrt", "abs": "supple_abs", "exp": "supple_exp", "ln": "supple_log",
    "sin": "supple_sin", "cos": "supple_cos", "tan": "supple_tan", "sinh": "supple_sinh",
    "cosh": "supple_cosh", "tanh": "supple_tanh", "acos": "supple_acos", "asin": "supple_asin",
    "atan": "supple_atan", "atan_2": "supple_atan2", "power": "supple_pow",
    "min_value": "supple_min", "max_value": "supple_max", "erf": "supple_erf",
    "exponential_integral": "supple_exponential_integral",
}  # fmt: skip

_ARITHMETIC = (L.Add, L.Sub, L.Mul, L.Div)
_COMPARISONS = (L.EQ, L.NE, L.LT, L.GT, L.LE, L.GE)
_LOGIC = {L.And: "&", L.Or: "|"}


class Code(NamedTuple):
    """C of a value; its kind is vec, double (the same for all cells) or mask."""

    text: str
    kind: str


class Expressions:
    """C of expressions whose symbols have been named.

    Args:
        access: C of an entry of an array.
    """

    def __init__(self, access: Callable[[Any], Code]) -> None:
        self._access = access
        self.symbols: dict[str, Code] = {}

    def __call__(self, node: Any) -> Code:
        """C of a node; an operation stands in brackets."""
        if isinstance(node, L.Symbol):
            return self.symbols[node.name]
        if isinstance(node, (L.LiteralFloat, L.LiteralInt)):
            return Code(_bracketed(value_of(node)), "double")
        if isinstance(node, L.ArrayAccess):
            return self._access(node)
        if isinstance(node, L.Conditional):
            return self._conditional(node)
        if isinstance(node, L.MathFunction):
            return self._function(node)
        return self._operation(node)

    def vector(self, node: Any) -> str:
        """C of a node as a vector."""
        text, kind = self(node)
        return f"supple_all({text})" if kind == "double" else text

    def _operation(self, node: Any) -> Code:
        if isinstance(node, L.Neg):
            text, kind = self(node.arg)
            return Code(f"(-{text})", kind)
        if isinstance(node, L.Not):
            return Code(f"(~{self(node.arg).text})", "mask")
        if isinstance(node, _ARITHMETIC):
            left, right = self(node.lhs), self(node.rhs)
            kind = "vec" if "vec" in (left.kind, right.kind) else "double"
            return Code(f"({left.text} {node.op} {right.text})", kind)
        if isinstance(node, _COMPARISONS):
            return Code(f"({self.vector(node.lhs)} {node.op} {self.vector(node.rhs)})", "mask")
        if type(node) in _LOGIC:
            sign = _LOGIC[type(node)]
            return Code(f"({self(node.lhs).text} {sign} {self(node.rhs).text})", "mask")
        raise TypeError(f"FFCx's graph holds a {type(node).__name__}, which has no C in lanes")

    def _conditional(self, node: Any) -> Code:
        chosen = f"{self.vector(node.true)}, {self.vector(node.false)}"
        return Code(f"supple_choose({self(node.condition).text}, {chosen})", "vec")

    def _function(self, node: Any) -> Code:
        if node.function == "frozen":
            return self(node.args[0])
        arguments = ", ".join(self.vector(argument) for argument in node.args)
        return Code(f"{FUNCTIONS[node.function]}({arguments})", "vec")


def value_of(literal: Any) -> float:
    """Of a number in the graph."""
    return float(literal.value)


def _bracketed(value: float) -> str:
    return f"({number(value)})" if value < 0 else number(value)
