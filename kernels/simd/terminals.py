"""Values at a point: coordinates, unknowns and their derivatives, as FFCx's sections define them.

A section declares sums and adds to each, in a loop over shape functions, an entry of x or w times
a shape function's value. Where these values are the same at all points they are known numbers, and
the sum is written out without its zeros and ones.
"""

from __future__ import annotations

from typing import Any

from ffcx.codegeneration import lnodes as L

from .expressions import Code, Expressions
from .tables import Tables, number


class Terminals:
    """Writes sections; names their symbols."""

    def __init__(self, tables: Tables, expressions: Expressions) -> None:
        self._tables, self._code = tables, expressions

    def write(self, sections: list[Any], wanted: set[str]) -> list[str]:
        """C of those sums of FFCx's sections that are wanted."""
        lines: list[str] = []
        for section in sections:
            if section:
                lines += self._section(section, wanted)
        return lines

    def _section(self, section: Any, wanted: set[str]) -> list[str]:
        sums = {d.symbol.name: "" for d in section.declarations if d.symbol.name in wanted}
        self._code.symbols |= {name: Code(name, "vec") for name in sums}
        loops = [loop for s in section.statements for loop in _loops(s)]
        lines: list[str] = []
        rest = []
        for loop in loops:
            adds = [s.expr for s in _statements(loop.body) if s.expr.lhs.name in sums]
            known = [
                a for a in adds if self._tables.constant(_factors(a)[1].array.name) is not None
            ]
            for a in known:
                sums[a.lhs.name] += self._written_out(a, loop)
            rest.append((loop, [a for a in adds if a not in known]))
        for name, text in sums.items():
            lines.append(
                f"const vec {name} = {text};" if text else f"vec {name} = supple_all(0.0);"
            )
        return lines + [line for loop, adds in rest if adds for line in self._loop(loop, adds)]

    def _written_out(self, add: Any, loop: Any) -> str:
        """The terms of a sum whose factors are known."""
        entry, table = _factors(add)
        values = self._tables.constant(table.array.name)
        assert values is not None
        terms = ""
        for i in range(loop.begin.value, loop.end.value):
            access = f"{_ARRAYS.get(entry.array.name, entry.array.name)}[{index(entry, str(i))}]"
            terms += term(float(values[i]), access)
        return terms or "supple_all(0.0)"

    def _loop(self, loop: Any, adds: list[Any]) -> list[str]:
        i = loop.index.name
        lines = [f"for (int {i} = {self._code_int(loop.begin)}; {i} < {loop.end.value}; ++{i}) {{"]
        for add in adds:
            entry, table = _factors(add)
            access = f"{_ARRAYS.get(entry.array.name, entry.array.name)}[{index(entry, i)}]"
            lines.append(f"{add.lhs.name} += {access} * {self._tables.at(table.array.name, i)};")
        return [*lines, "}"]

    @staticmethod
    def _code_int(node: Any) -> int:
        return int(node.value)


_ARRAYS = {"coordinate_dofs": "x"}


def term(factor: float, value: str) -> str:
    """What adds factor * value to a sum, shorter where the factor is 0, 1 or -1."""
    if factor == 0.0:
        return ""
    sign = " - " if factor < 0 else " + "
    return sign + (value if abs(factor) == 1.0 else f"{number(abs(factor))} * {value}")


def access(node: Any) -> Code:
    """C of an entry of w or x."""
    name = node.array.name
    return Code(f"{_ARRAYS.get(name, name)}[{index(node, '')}]", "vec")


def index(entry: Any, loop: str) -> str:
    """C of an entry's index, ``loop`` the value of the loop's own index."""
    (place,) = entry.indices
    text = _integer(place, loop)
    return str(text[1]) if not text[0] else _affine(*text, loop)


def _affine(stride: int, shift: int, loop: str) -> str:
    if loop.isdigit():
        return str(stride * int(loop) + shift)
    scaled = loop if stride == 1 else f"{stride} * {loop}"
    return scaled if shift == 0 else f"{scaled} + {shift}"


def _integer(node: Any, loop: str) -> tuple[int, int]:
    """(stride, shift) of an index that is affine in the loop's."""
    if isinstance(node, L.LiteralInt):
        return 0, int(node.value)
    if isinstance(node, L.Symbol):
        return 1, 0
    if isinstance(node, (L.Sum, L.Product)):
        parts = [_integer(part, loop) for part in node.args]
    else:
        parts = [_integer(node.lhs, loop), _integer(node.rhs, loop)]
    total = parts[0]
    for other in parts[1:]:
        if isinstance(node, (L.Add, L.Sum)):
            total = (total[0] + other[0], total[1] + other[1])
        else:
            total = (total[0] * other[1] + total[1] * other[0], total[1] * other[1])
    return total


def _loops(statement: Any) -> list[Any]:
    if isinstance(statement, L.ForRange):
        return [statement]
    return [loop for s in statement.statements for loop in _loops(s)]


def _statements(body: Any) -> list[Any]:
    if isinstance(body, L.StatementList):
        return [s for part in body.statements for s in _statements(part)]
    return [body]


def _factors(add: Any) -> tuple[Any, Any]:
    """Entry of x or w, and of a table, of a term."""
    return add.rhs.lhs, add.rhs.rhs
