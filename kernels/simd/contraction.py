"""Sums over shape functions at one point into the element's tensor A.

The factor f of a block belongs to component a of the test function through table r (a derivative of
its shape functions), and to b of the trial function through c:

    A[a + s i, b + s j] += w Σ_rc f[a, r, b, c] r[i] c[j]

written as t[a, b, c] = w Σ_r f r[i] once an i, then Σ_c t c[j]: a third of the products of FFCx's
loops. Of a symmetric tensor only j ≤ i, and one factor of each symmetric pair.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from .tables import Tables, number

#: Entries of a block of A that are written out one by one where all numbers are known.
_WRITTEN_OUT = 16

_WORD = re.compile(r"\w+")


class Slot(NamedTuple):
    """A component of an argument through one table of its shape functions."""

    base: int  # dof of component 0, shape function 0
    stride: int  # dofs from one shape function to the next
    nodes: int  # shape functions
    component: int
    table: str  # "" where the one shape function is 1

    @property
    def space(self) -> tuple[int, int, int]:
        return self.base, self.stride, self.nodes


@dataclass
class Block:
    """A factor, a symbol of the graph, and what it multiplies; the rank is that of A."""

    slots: tuple[Slot, ...]
    factor: Any


def slot(table: Any) -> Slot:
    """Of FFCx's table reference."""
    stride = table.block_size
    component = table.offset % stride if stride > 1 else 0
    name = "" if table.ttype == "ones" else table.name
    return Slot(table.offset - component, stride, table.values.shape[3], component, name)


def lower(blocks: list[Block]) -> list[Block]:
    """Blocks of a symmetric tensor, every pair with the factor of one of the two.

    Rows of a space before its columns' are dropped: they are above the diagonal.
    """
    factors = {block.slots: block.factor for block in blocks}
    kept = []
    for block in blocks:
        row, column = block.slots
        if row.space >= column.space:
            mirrored = factors.get((column, row)) if row < column else None
            kept.append(Block(block.slots, block.factor if mirrored is None else mirrored))
    return kept


class Contraction:
    """Writes the sums of one kernel; ``shape`` is that of A, factors are C of vectors."""

    def __init__(self, tables: Tables, shape: tuple[int, ...], symmetric: bool) -> None:
        self._tables, self._shape, self._symmetric = tables, shape, symmetric

    def write(self, blocks: list[tuple[tuple[Slot, ...], str]]) -> list[str]:
        """C that adds blocks of (slots, factor)."""
        rank = len(self._shape)
        if rank == 0:
            return [f"A[0] += {factor} * {self._weight()};" for _, factor in blocks]
        spaces = defaultdict(list)
        for slots, factor in blocks:
            spaces[tuple(s.space for s in slots)].append((slots, factor))
        write = self._vector if rank == 1 else self._matrix
        return [line for group in spaces.values() for line in write(group)]

    def _weight(self) -> str:
        if self._tables.points == 1:
            return number(self._tables.weights[0])
        return "weight[iq]"

    def _vector(self, group: list[tuple[tuple[Slot, ...], str]]) -> list[str]:
        """Entries of A, one sum of all blocks of a component each."""
        first = group[0][0][0]
        sums = defaultdict(list)
        for (s,), factor in group:
            sums[s.component].append((s.table, factor))
        return self._over(first, "i", lambda i: [
            f"A[{_place(first, a, i)}] += {text};"
            for a, terms in sums.items() if (text := self._sum(terms, i, True))
        ])  # fmt: skip

    def _matrix(self, group: list[tuple[tuple[Slot, ...], str]]) -> list[str]:
        """One loop over the rows' shape functions, within it one over the columns'."""
        row, column = group[0][0]
        symmetric = self._symmetric and row.space == column.space
        halves: dict[tuple[int, int, str], list[tuple[str, str]]] = defaultdict(list)
        for (r, c), factor in group:
            halves[r.component, c.component, c.table].append((r.table, factor))

        def rows(i: str) -> list[str]:
            names: dict[tuple[int, int], list[tuple[str, str]]] = defaultdict(list)
            lines = {}
            for (a, b, table), terms in halves.items():
                if text := self._sum(terms, i, True):
                    name = f"t_{a}_{b}_{table or 'one'}"
                    lines[name] = f"const vec {name} = {text};"
                    names[a, b].append((table, name))
            sums = columns(i, names)
            used = set(_WORD.findall("\n".join(sums)))
            return ["{", *(line for name, line in lines.items() if name in used), *sums, "}"]

        def entries(i: str, j: str, names: dict[tuple[int, int], list[tuple[str, str]]],
                    diagonal: bool) -> list[str]:  # fmt: skip
            width = self._shape[1]
            place = f"({_place(row, 0, i)}) * {width} + {_place(column, 0, j)}"
            return [f"A[{place} + {a * width + b}] += {text};"
                    for (a, b), terms in names.items() if b <= a or not diagonal
                    if (text := self._sum(terms, j, False))]  # fmt: skip

        def columns(i: str, names: dict[tuple[int, int], list[tuple[str, str]]]) -> list[str]:
            if self._is_known(column):
                last = int(i) if symmetric else column.nodes - 1
                return [line for j in range(last + 1)
                        for line in entries(i, str(j), names, symmetric and j == last)]  # fmt: skip
            end = i if symmetric else str(column.nodes)
            loop = [f"for (int j = 0; j < {end}; ++j) {{", *entries(i, "j", names, False), "}"]
            return loop + (entries(i, i, names, True) if symmetric else [])

        return self._over(row, "i", rows)

    def _is_known(self, s: Slot) -> bool:
        """Whether a space is small and its shape functions are the same at all points."""
        return self._tables.points == 1 and s.nodes * s.stride <= _WRITTEN_OUT

    def _over(self, s: Slot, name: str, body: Any) -> list[str]:
        if self._is_known(s):
            return [line for i in range(s.nodes) for line in body(str(i))]
        return [f"for (int {name} = 0; {name} < {s.nodes}; ++{name}) {{", *body(name), "}"]

    def _sum(self, terms: Iterable[tuple[str, str]], i: str, weighted: bool) -> str:
        """Σ table[i] factor, weighted where it is the rows'; "" where it is known to vanish."""
        return " + ".join(self._terms(terms, i, weighted)).replace("+ -", "- ")

    def _terms(self, terms: Iterable[tuple[str, str]], i: str, weighted: bool) -> Iterator[str]:
        for table, factor in terms:
            if not table:
                yield f"{factor} * {self._weight()}" if weighted else factor
                continue
            known = self._tables.constant(table) if i.isdigit() else None
            if known is None:
                name = self._tables.weighted(table) if weighted else table
                yield f"{factor} * {self._tables.at(name, i)}"
            elif known[int(i)] != 0.0:
                value = known[int(i)] * (self._tables.weights[0] if weighted else 1.0)
                yield {1.0: factor, -1.0: f"-{factor}"}.get(value, f"{factor} * {number(value)}")


def _place(s: Slot, component: int, i: str) -> str:
    shift = s.base + component
    if i.isdigit():
        return str(s.stride * int(i) + shift)
    return f"{s.stride} * {i} + {shift}"
