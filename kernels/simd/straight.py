"""The scalar graph as straight lines of C: what is used, powers and divisions shared.

UFL's derivatives bring the same power with exponents one apart, and many divisions by one value.
A power is a product of such as are known already, or of the base itself where the exponent is a
small whole or half number; a divisor that comes more than once is inverted once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from ffcx.codegeneration import lnodes as L

from .expressions import Code, Expressions, value_of

#: Greatest whole exponent that is written as products.
_MOST = 8
#: Greatest power of a cube root that is written as products.
_THIRDS = 11
#: Greatest distance of two exponents of which one power is made from the other.
_APART = 3

Definitions = list[tuple[str, Any]]


def alive(definitions: Definitions, roots: Iterable[Any]) -> Definitions:
    """Those definitions that the expressions ``roots`` need, in their order."""
    wanted = {name for root in roots for name in symbols(root)}
    kept = []
    for name, value in reversed(definitions):
        if name in wanted:
            kept.append((name, value))
            wanted.update(symbols(value))
    return kept[::-1]


def symbols(node: Any) -> Iterator[str]:
    """Names of the scalars in an expression."""
    if isinstance(node, L.Symbol):
        yield node.name
    elif not isinstance(node, L.ArrayAccess):
        for part in _operands(node):
            yield from symbols(part)


def _operands(node: Any) -> tuple[Any, ...]:
    if isinstance(node, L.Conditional):
        return node.condition, node.true, node.false
    if isinstance(node, L.MathFunction):
        return tuple(node.args)
    if isinstance(node, L.BinOp):
        return node.lhs, node.rhs
    return (node.arg,) if isinstance(node, (L.Neg, L.Not)) else ()


class StraightLines:
    """Writes definitions, remembering powers and inverses over several runs."""

    def __init__(self, expressions: Expressions) -> None:
        self._code = expressions
        self._inverses: dict[str, str] = {}
        self._powers: dict[str, dict[float, str]] = {}
        self._divisors: Counter[str] = Counter()
        self._lines: list[str] = []

    def write(self, definitions: Definitions) -> list[str]:
        """C of a run, one definition a line; their symbols are named from then on."""
        self._lines = []
        self._divisors = Counter(
            v.rhs.name for _, v in definitions
            if isinstance(v, L.Div) and isinstance(v.rhs, L.Symbol)
        )  # fmt: skip
        for name, value in definitions:
            self._define(name, value)
        return self._lines

    def _define(self, name: str, value: Any) -> None:
        if isinstance(value, L.MathFunction) and value.function == "power":
            code = self._power(value)
        elif isinstance(value, L.Div):
            code = self._quotient(value)
        else:
            code = self._code(value)
        if not isinstance(value, (L.Symbol, L.LiteralFloat, L.LiteralInt, L.ArrayAccess)):
            code = self._line(name, code)
        self._code.symbols[name] = code

    def _line(self, name: str, code: Code) -> Code:
        self._lines.append(f"const {code.kind} {name} = {code.text};")
        return Code(name, code.kind)

    def _quotient(self, value: Any) -> Code:
        divisor = self._code(value.rhs)
        shared = isinstance(value.rhs, L.Symbol) and self._divisors[value.rhs.name] > 1
        if divisor.kind != "vec" or not (shared or divisor.text in self._inverses):
            return self._code(value)
        above = self._code(value.lhs)
        inverse = self._inverse(divisor.text)
        is_one = above.kind == "double" and above.text == "1.0"
        return Code(inverse if is_one else f"({above.text} * {inverse})", "vec")

    def _inverse(self, base: str) -> str:
        if base not in self._inverses:
            code = self._line(f"{_name(base)}_inv", Code(f"1.0 / {base}", "vec"))
            self._inverses[base] = code.text
        return self._inverses[base]

    def _power(self, value: Any) -> Code:
        base, exponent = self._code(value.args[0]), _number(value.args[1])
        if exponent is None or base.kind != "vec":
            return self._code(value)
        return Code(self._raised(base.text, exponent), "vec")

    def _raised(self, base: str, exponent: float) -> str:
        """Name of a known or newly defined power."""
        known = self._powers.setdefault(base, {1.0: base})
        if exponent not in known:
            text = self._new_power(base, exponent, known)
            known[exponent] = self._line(f"{_name(base)}_p{len(known)}", Code(text, "vec")).text
        return known[exponent]

    def _new_power(self, base: str, exponent: float, known: dict[float, str]) -> str:
        if exponent == 0.5:
            return f"supple_sqrt({base})"
        if (2 * exponent).is_integer() and abs(exponent) <= _MOST:
            if exponent < 0:
                return f"1.0 / {self._raised(base, -exponent)}"
            half = (exponent + 1) // 2 if exponent % 1 == 0 else exponent - 0.5
            return f"{self._raised(base, half)} * {self._raised(base, exponent - half)}"
        for other, text in list(known.items()):
            step = exponent - other
            if (round(step) and abs(step) <= _APART and not float(other).is_integer()
                    and abs(step - round(step)) < 1e-15 * abs(exponent)):  # fmt: skip
                whole = self._raised(base, float(abs(round(step))))
                return f"{text} * {whole if step > 0 else self._inverse(whole)}"
        thirds = round(3 * exponent)
        if abs(3 * exponent - thirds) <= 4e-15 * abs(thirds) and abs(thirds) <= _THIRDS:
            return f"supple_pow_thirds({base}, {thirds})"
        return f"supple_pow({base}, supple_all({exponent!r}))"


def _name(text: str) -> str:
    """A word that the text of a value can begin the name of another with."""
    return "".join(c if c.isalnum() else "_" for c in text)


def _number(node: Any) -> float | None:
    if isinstance(node, L.Neg):
        inner = _number(node.arg)
        return None if inner is None else -inner
    return value_of(node) if isinstance(node, (L.LiteralFloat, L.LiteralInt)) else None
