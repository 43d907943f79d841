"""The one table per cell: how files (VTK, meshio) and kernels (Basix) number nodes and facets.

A cell is stated once, by its corners and edges in both numberings; everything else (midside nodes,
permutations, facets of either order) is derived from that. Reference cells are Basix': the unit
simplex and the unit cube. Inside Supple arrays are in VTK order; only the door to the kernels
permutes: ``kernel_cells = vtk_cells[:, element.from_vtk]``.

Sources: VTK's vtkCellType.h and its cells' edge and face arrays; Basix' ``topology(cell)``;
serendipity span: Arnold and Awanou (2011), superlinear degree.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.intp]
Floats = npt.NDArray[np.float64]
Pairs = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Cell:
    """Corners, edges and facets of one reference cell."""

    name: str  # Basix' name
    corners: tuple[tuple[int, ...], ...]  # (c, dim) reference coordinates in VTK order
    from_vtk: tuple[int, ...]  # VTK number of each Basix vertex
    edges: Pairs  # VTK edges by VTK corners
    kernel_edges: Pairs  # Basix edges by Basix vertices
    facets: tuple[tuple[int, ...], ...]  # corner loops, VTK order and numbers, outward

    @property
    def dim(self) -> int:
        """Dimension of the reference cell."""
        return len(self.corners[0])

    @property
    def is_simplex(self) -> bool:
        """Whether this is a triangle or a tetrahedron."""
        return len(self.corners) == self.dim + 1


@dataclass(frozen=True, eq=False)
class Element:
    """One element: a cell with nodes at its corners and, at degree 2, at its edges' midpoints."""

    name: str  # P1, P2, Q1, Q2; facets T1, T2, S1, S2
    meshio: str  # meshio's cell type
    cell: Cell
    degree: int
    facet: str  # name of the facets' element; "" for a facet element
    points: Floats  # (nodes, dim) reference coordinates in VTK order
    from_vtk: Ints  # (nodes,) VTK number of each kernel node
    to_vtk: Ints  # (nodes,) kernel number of each VTK node
    facets: Ints  # (facets, nodes per facet) VTK numbers, each row in VTK order, outward
    powers: Ints  # (nodes, dim) exponents of the monomials that the shape functions span

    @property
    def nodes(self) -> int:
        """Nodes per cell."""
        return len(self.points)

    @property
    def corners(self) -> int:
        """Corner nodes per cell; they come first in both numberings."""
        return len(self.cell.corners)

    def corner_values(self) -> Floats:
        """Shape functions of the cell's corners alone, degree 1, at all nodes (nodes, corners)."""
        powers = _span(self.cell, 1)
        result: Floats = _monomials(self.points, powers) @ np.linalg.inv(
            _monomials(self.points[: self.corners], powers)
        )
        return result

    def gradients(self, at: npt.ArrayLike) -> Floats:
        """Shape functions' reference gradients (q, nodes, dim), nodes in VTK order, at (q, dim)."""
        coefficients = np.linalg.inv(_monomials(self.points, self.powers))
        slopes = _monomial_slopes(np.asarray(at, dtype=float), self.powers)
        result: Floats = np.einsum("qmd,mn->qnd", slopes, coefficients)
        return result


def _monomials(points: Floats, powers: Ints) -> Floats:
    """Monomials (q, m) of exponents (m, dim) at points (q, dim)."""
    result: Floats = np.prod(points[:, None, :] ** powers, axis=2)
    return result


def _monomial_slopes(points: Floats, powers: Ints) -> Floats:
    """Derivatives (q, m, dim) of those monomials."""
    slopes = []
    for axis, unit in enumerate(np.eye(powers.shape[1], dtype=np.intp)):
        lower = np.maximum(powers - unit, 0)
        slopes.append(powers[:, axis] * _monomials(points, lower))
    return np.stack(slopes, axis=2)


def _span(cell: Cell, degree: int) -> Ints:
    """Exponents: total degree on a simplex; superlinear degree (serendipity) on the others."""

    def order(exponents: Sequence[int]) -> int:
        return sum(e for e in exponents if cell.is_simplex or e != 1)

    every = product(range(degree + 1), repeat=cell.dim)
    return np.array([e for e in every if order(e) <= degree], dtype=np.intp)


def _edge_numbers(edges: Pairs, wanted: Iterable[tuple[int, int]]) -> list[int]:
    """Position in ``edges`` of each wanted edge, whatever its direction."""
    number = {frozenset(edge): i for i, edge in enumerate(edges)}
    return [number[frozenset(edge)] for edge in wanted]


def _permutation(cell: Cell, degree: int) -> list[int]:
    """VTK number of each kernel node: vertices, then at degree 2 one node an edge."""
    vertices = list(cell.from_vtk)
    if degree == 1:
        return vertices
    wanted = [(vertices[a], vertices[b]) for a, b in cell.kernel_edges]
    return vertices + [len(vertices) + e for e in _edge_numbers(cell.edges, wanted)]


def _facet(cell: Cell, degree: int, loop: tuple[int, ...]) -> list[int]:
    """Nodes of one facet: its corners, then at degree 2 the midpoints along the same loop."""
    if degree == 1:
        return list(loop)
    wanted = zip(loop, (*loop[1:], loop[0]), strict=True)
    return [*loop, *(len(cell.corners) + e for e in _edge_numbers(cell.edges, wanted))]


def _element(name: str, meshio: str, cell: Cell, degree: int, facet: str = "") -> Element:
    """Derive the tables of one element; they are shared, so they are read-only."""
    corners = np.array(cell.corners, dtype=float)
    middles = corners[np.array(cell.edges)].mean(axis=1)
    from_vtk = np.array(_permutation(cell, degree), dtype=np.intp)
    facets = np.array([_facet(cell, degree, loop) for loop in cell.facets], dtype=np.intp)
    points = corners if degree == 1 else np.vstack([corners, middles])
    element = Element(
        name=name,
        meshio=meshio,
        cell=cell,
        degree=degree,
        facet=facet,
        points=points,
        from_vtk=from_vtk,
        to_vtk=np.argsort(from_vtk),
        facets=facets,
        powers=_span(cell, degree),
    )
    for table in (points, from_vtk, element.to_vtk, facets, element.powers):
        table.flags.writeable = False
    return element


TRIANGLE = Cell(
    name="triangle",
    corners=((0, 0), (1, 0), (0, 1)),
    from_vtk=(0, 1, 2),
    edges=((0, 1), (1, 2), (2, 0)),
    kernel_edges=((1, 2), (0, 2), (0, 1)),
    facets=(),
)
QUADRILATERAL = Cell(
    name="quadrilateral",
    corners=((0, 0), (1, 0), (1, 1), (0, 1)),
    from_vtk=(0, 1, 3, 2),
    edges=((0, 1), (1, 2), (2, 3), (3, 0)),
    kernel_edges=((0, 1), (0, 2), (1, 3), (2, 3)),
    facets=(),
)
TETRAHEDRON = Cell(
    name="tetrahedron",
    corners=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    from_vtk=(0, 1, 2, 3),
    edges=((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    kernel_edges=((2, 3), (1, 3), (1, 2), (0, 3), (0, 2), (0, 1)),
    facets=((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
)
HEXAHEDRON = Cell(
    name="hexahedron",
    corners=(
        *((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)),
        *((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    ),
    from_vtk=(0, 1, 3, 2, 4, 5, 7, 6),
    edges=(
        *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    kernel_edges=(
        *((0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3)),
        *((2, 6), (3, 7), (4, 5), (4, 6), (5, 7), (6, 7)),
    ),
    facets=(
        *((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4)),
        *((3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    ),
)

#: Volume elements by name.
ELEMENTS = {
    element.name: element
    for element in (
        _element("P1", "tetra", TETRAHEDRON, 1, facet="T1"),
        _element("P2", "tetra10", TETRAHEDRON, 2, facet="T2"),
        _element("Q1", "hexahedron", HEXAHEDRON, 1, facet="S1"),
        _element("Q2", "hexahedron20", HEXAHEDRON, 2, facet="S2"),
    )
}

#: Facet elements by name.
FACETS = {
    element.name: element
    for element in (
        _element("T1", "triangle", TRIANGLE, 1),
        _element("T2", "triangle6", TRIANGLE, 2),
        _element("S1", "quad", QUADRILATERAL, 1),
        _element("S2", "quad8", QUADRILATERAL, 2),
    )
}
