"""FFCx's intermediate representation of a form or of point values → a function body in lanes.

uniform numbers → what is the same at all points → at each point: terminals, graph, sums into A
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from ffcx.codegeneration.backend import FFCXBackend
from ffcx.codegeneration.integral_generator import IntegralGenerator
from ffcx.ir.representation import ExpressionIR

from .contraction import Block, Contraction, lower, slot
from .expressions import Code, Expressions
from .gradients import PointTangent, PulledBack, derivatives
from .straight import Definitions, StraightLines, alive, symbols
from .tables import Tables, number
from .terminals import Terminals, access


def of_integral(ir: Any, options: dict[str, Any], symmetric: bool) -> str:
    """C of the body of a form's one cell integral; of a symmetric one the lower triangle."""
    graph = _Graph(ir, options)
    blocks = lower(graph.products()) if symmetric else graph.products()
    body = _Body(graph)
    shape = tuple(int(n) for n in ir.expression.tensor_shape)

    def sums(expressions: Expressions) -> list[str]:
        written = [(b.slots, expressions.vector(b.factor)) for b in blocks]
        lines: list[str] = []
        if body.tables.points == 1:
            lines, written = _weighted(written, body.tables)
        return lines + Contraction(body.tables, shape, symmetric).write(written)

    return body.write([b.factor for b in blocks], sums)


def of_tangent(ir: Any, options: dict[str, Any], tangent: PointTangent, element: Any,
               symmetric: bool) -> str:  # fmt: skip
    """C of the body of a tangent by values at points.

    Args:
        element: scalar element of both arguments.
    """
    graph = _Graph(ir, options)
    graph.tables.weights = np.asarray(tangent.weights)
    entries = graph.entries()
    body = _Body(graph)
    body.tables.values |= derivatives(element, tangent.points)
    shape = (3 * element.dim, 3 * element.dim)

    def sums(expressions: Expressions) -> list[str]:
        values = [expressions.vector(entries[i]) for i in range(len(entries))]
        back = PulledBack(tangent, values, symmetric)
        blocks = back.blocks(element.dim)
        if body.tables.points == 1:
            body.tables.weights = np.ones(1)
        return back.lines + Contraction(body.tables, shape, symmetric).write(blocks)

    return body.write(list(entries.values()), sums)


def of_points(ir: Any, options: dict[str, Any]) -> str:
    """C of the body of an expression's entries at points: A is (points × entries)."""
    graph = _Graph(ir, options)
    entries = graph.entries()
    count = int(np.prod(ir.expression.shape))
    body = _Body(graph)

    def sums(expressions: Expressions) -> list[str]:
        place = "" if body.tables.points == 1 else f"{count} * iq + "
        return [
            f"A[{place}{entry}] += {expressions.vector(value)};" for entry, value in entries.items()
        ]

    return body.write(list(entries.values()), sums)


def of_values(
    ir: Any, options: dict[str, Any], entries: Callable[[Any], Code]
) -> tuple[list[str], list[str | None]]:
    """Statements that define an expression's entries at one point, and the C of each.

    Args:
        entries: C of an entry of the expression's own coefficients.
    """
    graph = _Graph(ir, options)
    roots = graph.entries()
    body = _Body(graph, entries)
    lines = body.statements(list(roots.values()))
    count = int(np.prod(ir.expression.shape))
    return lines, [body.vector(roots[i]) if i in roots else None for i in range(count)]


def _weighted(
    blocks: list[tuple[Any, str]], tables: Tables
) -> tuple[list[str], list[tuple[Any, str]]]:
    """Factors times the one point's weight, once each; that weight is 1 from then on."""
    names = {factor: f"s_{k}" for k, factor in enumerate(dict.fromkeys(f for _, f in blocks))}
    weight = number(tables.weights[0])
    tables.weights = np.ones(1)
    lines = [f"const vec {name} = {factor} * {weight};" for factor, name in names.items()]
    return lines, [(slots, names[factor]) for slots, factor in blocks]


class _Graph:
    """FFCx's factorised scalar graph of a form or an expression."""

    def __init__(self, ir: Any, options: dict[str, Any]) -> None:
        ((self._domain, self._rule),) = ir.expression.integrand
        integrand = ir.expression.integrand[(self._domain, self._rule)]
        self._nodes = integrand["factorization"].nodes
        self.blocks = [data for _, parts in sorted(integrand["block_contributions"].items())
                       for data in parts]  # fmt: skip
        self._generator = IntegralGenerator(ir, FFCXBackend(ir, options))
        self._generator.generate_element_tables(self._domain)
        self.piecewise = self._generator.generate_piecewise_partition(self._rule, self._domain)
        self.varying = self._generator.generate_varying_partition(self._rule, self._domain)
        values = ir.expression.unique_tables[self._domain]
        weights = (
            np.ones(len(self._rule.points)) if isinstance(ir, ExpressionIR) else self._rule.weights
        )
        self.tables = Tables(weights, {name: np.asarray(v[0, 0]) for name, v in values.items()})

    def products(self) -> list[Block]:
        """Of a form: its factors with what they multiply."""
        return [Block(tuple(slot(argument.tabledata) for argument in data.ma_data),
                      self.value(data.factor_indices_comp_indices[0][0]))
                for data in self.blocks]  # fmt: skip

    def entries(self) -> dict[int, Any]:
        """Of point values: the expression of each entry that is not 0 throughout."""
        return {entry: self.value(factor) for data in self.blocks
                for factor, entry in data.factor_indices_comp_indices}  # fmt: skip

    def value(self, factor: int) -> Any:
        """FFCx's expression for a factor of the graph."""
        node = self._nodes[factor]["expression"]
        return self._generator.get_var(self._rule, self._domain, node)


class _Body:
    """Puts a body together."""

    def __init__(self, graph: _Graph, entries: Callable[[Any], Code] = access) -> None:
        self.tables = graph.tables
        self._partitions = graph.piecewise, graph.varying
        self._expressions = Expressions(entries)
        self.vector = self._expressions.vector
        self._terminals = Terminals(self.tables, self._expressions)
        self._straight = StraightLines(self._expressions)

    def statements(self, roots: list[Any]) -> list[str]:
        """C of what the roots need, all of it at one point."""
        definitions = [d for partition in self._partitions for d in _definitions(partition)]
        return self._straight.write(alive(definitions, roots))

    def write(self, roots: list[Any], sums: Callable[[Expressions], list[str]]) -> str:
        piecewise, varying = self._partitions
        definitions = [_definitions(partition) for partition in (piecewise, varying)]
        kept = alive(definitions[0] + definitions[1], roots)
        wanted = {name for value in (*roots, *(v for _, v in kept)) for name in symbols(value)}
        first = self._run(piecewise, wanted)
        each = self._run(varying, wanted)
        each += sums(self._expressions)
        points = self.tables.points
        if points > 1:
            each = [f"for (int iq = 0; iq < {points}; ++iq) {{", *each, "}"]
        weights = ", ".join(number(w) for w in self.tables.weights)
        is_weighted = any("weight[iq]" in line for line in each)
        table = [f"static const double weight[] = {{{weights}}};"] if is_weighted else []
        return "\n".join([self.tables.definitions(), *table, *first, *each])

    def _run(self, partition: Any, wanted: set[str]) -> list[str]:
        lines = self._terminals.write(partition[0], wanted)
        return lines + self._straight.write([d for d in _definitions(partition) if d[0] in wanted])


def _definitions(partition: Any) -> Definitions:
    return [(d.symbol.name, d.value) for d in partition[1]]
