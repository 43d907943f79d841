"""Coefficients of linear forms in a few constants, each by one sweep backwards through the graph.

FFCx carries the coefficient of every argument forwards through every operation: nine products where
one number is multiplied with the gradient of a trial function. Backwards, the derivative of the
whole by each operation's result comes first, and the arguments' coefficients last (the reverse mode
of automatic differentiation; Griewank and Walther 2008, §3.2).
"""

from __future__ import annotations

from typing import Any

import ufl
from ffcx.ir.analysis.graph import build_scalar_graph
from ffcx.ir.analysis.modified_terminals import is_modified_terminal
from ufl.constantvalue import Zero


class NotLinear(Exception):
    """An operation that is not linear in the argument, or none that is known here."""


class ScalarGraph:
    """Scalar operations of some expressions, operands before their results."""

    def __init__(self, expressions: list[Any]) -> None:
        graph = build_scalar_graph(ufl.as_vector(expressions))
        self._values = [node["expression"] for node in graph.nodes.values()]
        self._index = graph.e2i
        self._flags: dict[int, list[bool]] = {}  # which nodes depend on an argument, by its number
        self.roots: list[int] = [0] * len(expressions)
        for i, node in graph.nodes.items():
            for component in node.get("component", []):
                self.roots[component] = i

    def coefficients(self, root: int, argument: Any) -> dict[int, Any]:
        """Entry of ``argument`` → the scalar that multiplies it in the value of node ``root``.

        Raises:
            NotLinear: the value is not linear in the argument.
        """
        depends = self._dependents(argument)
        found: dict[int, Any] = {}
        slopes = {root: ufl.as_ufl(1.0)}
        for i in range(root, -1, -1):
            if i in slopes and depends[i]:
                self._back(i, slopes.pop(i), argument, depends, slopes, found)
        return found

    def _dependents(self, argument: Any) -> list[bool]:
        key = argument.number()
        if key not in self._flags:
            flags: list[bool] = []
            for value in self._values:
                if is_modified_terminal(value):
                    flags.append(_entry(value, argument) is not None)
                else:
                    flags.append(any(flags[j] for j in self._operands(value)))
            self._flags[key] = flags
        return self._flags[key]

    def _operands(self, value: Any) -> list[int]:
        return [self._index[o] for o in value.ufl_operands if o in self._index]

    def _back(self, i: int, slope: Any, argument: Any, depends: list[bool],
              slopes: dict[int, Any], found: dict[int, Any]) -> None:  # fmt: skip
        value = self._values[i]
        if is_modified_terminal(value):
            _add(found, _entry(value, argument), slope)
        elif isinstance(value, ufl.classes.Conditional):
            self._chosen(value, slope, argument, found)
        else:
            for j, factor in self._slopes(value, depends):
                _add(slopes, j, slope if factor is None else slope * factor)

    def _slopes(self, value: Any, depends: list[bool]) -> list[tuple[int, Any]]:
        """(operand, what it is multiplied with); None for 1."""
        operands = [self._index[o] for o in value.ufl_operands]
        inside = [j for j in operands if depends[j]]
        if isinstance(value, ufl.classes.Sum):
            return [(j, None) for j in inside]
        if isinstance(value, ufl.classes.Product) and len(inside) == 1:
            other = operands[1] if operands[0] == inside[0] else operands[0]
            return [(inside[0], self._values[other])]
        if isinstance(value, ufl.classes.Division) and inside == operands[:1]:
            return [(inside[0], 1.0 / self._values[operands[1]])]
        raise NotLinear

    def _chosen(self, value: Any, slope: Any, argument: Any, found: dict[int, Any]) -> None:
        """Each branch by itself: what is not chosen may be infinite."""
        condition, *branches = value.ufl_operands
        yes, no = (self.coefficients(self._index[b], argument) for b in branches)
        for entry in sorted({*yes, *no}):
            either = [side.get(entry, Zero()) for side in (yes, no)]
            _add(found, entry, slope * ufl.conditional(condition, *either))


def _entry(value: Any, argument: Any) -> int | None:
    """Which entry of the argument a terminal is, None where it is none."""
    if not isinstance(value, ufl.classes.Indexed):
        return None
    whole: Any
    whole, place = value.ufl_operands
    if isinstance(whole, ufl.classes.ReferenceValue):
        (whole,) = whole.ufl_operands
    return int(place[0]) if whole == argument else None


def _add(sums: dict[int, Any], key: Any, value: Any) -> None:
    sums[key] = sums[key] + value if key in sums else value
