"""The one table per cell: how files (VTK, meshio) and kernels (Basix) number nodes and facets.

A cell is stated once, by its corners, edges and facets as VTK numbers them; everything else is
derived: a node is the barycentre of the corners of a sub-entity (the corner itself, an edge, a
quadrilateral, the cell), and the kernels' order is that of Basix, by dimension and then by the
sub-entity's sorted vertices. Reference cells are Basix': the unit simplex, cube and prism. Inside
Supple arrays are in VTK order; only the door to the kernels permutes:
``kernel_cells = vtk_cells[:, element.from_vtk]``.

Where VTK contradicts itself meshio and Gmsh are followed: the first triangle of a wedge of 6 nodes
turns as that of one of 18, its normal into the cell (meshio swaps two pairs of nodes in VTK files).

Sources: VTK's vtkCellType.h and its cells' edge and face arrays; Basix' ``topology(cell)``;
serendipity span: Arnold and Awanou (2011), superlinear degree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.intp]
Floats = npt.NDArray[np.float64]
Corners = tuple[int, ...]

#: Fills the rows of facets with fewer nodes than the widest of their element (triangles of prisms).
NO_NODE = -1


@dataclass(frozen=True)
class Cell:
    """Corners, edges and facets of one reference cell, numbered as in VTK."""

    name: str  # Basix' name
    corners: tuple[tuple[int, ...], ...]  # (c, dim) reference coordinates
    edges: tuple[Corners, ...]
    facets: tuple[Corners, ...]  # corner loops, outward; the order of VTK's face nodes

    @property
    def dim(self) -> int:
        """Dimension of the reference cell."""
        return len(self.corners[0])

    @property
    def is_simplex(self) -> bool:
        """Whether this is a triangle or a tetrahedron."""
        return len(self.corners) == self.dim + 1

    @property
    def is_cube(self) -> bool:
        """Whether this is a quadrilateral or a hexahedron."""
        return self.dim > 1 and len(self.corners) == 2**self.dim


@dataclass(frozen=True, eq=False)
class Element:
    """One element: a cell with nodes at its corners and, at degree 2, on its edges and beyond."""

    name: str  # P1, P2, Q1, Q2, Q2L, Pr1, Pr2; facets T1, T2, S1, S2, S2L
    meshio: str  # meshio's cell type
    cell: Cell
    degree: int
    entities: tuple[Corners, ...]  # (nodes) corners that each node is the barycentre of
    points: Floats  # (nodes, dim) reference coordinates in VTK order
    from_vtk: Ints  # (nodes,) VTK number of each kernel node
    to_vtk: Ints  # (nodes,) kernel number of each VTK node
    facet_elements: tuple[str, ...]  # names of its kinds of facet; () for a facet element
    facets: Ints  # (facets, most nodes) VTK numbers, each row in VTK order, outward, then NO_NODE
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
        powers = _span(self.cell, 1, full=True)
        corners = np.linalg.inv(_monomials(self.points[: self.corners], powers))
        return np.asarray(_monomials(self.points, powers) @ corners, dtype=float)

    def values(self, at: npt.ArrayLike) -> Floats:
        """Shape functions (q, nodes), nodes in VTK order, at (q, dim)."""
        monomials = _monomials(np.asarray(at, dtype=float), self.powers)
        result: Floats = monomials @ self._coefficients()
        return result

    def gradients(self, at: npt.ArrayLike) -> Floats:
        """Shape functions' reference gradients (q, nodes, dim), nodes in VTK order, at (q, dim)."""
        slopes = _monomial_slopes(np.asarray(at, dtype=float), self.powers)
        result: Floats = np.einsum("qmd,mn->qnd", slopes, self._coefficients())
        return result

    def carried(self, places: Floats, at: Floats) -> Floats:
        """Values at points ``places`` (q, dim) → values at ``at`` (r, dim), a matrix (r, q).

        Least squares by the shape functions' monomials, or by fewer (those of the corners alone, a
        constant) where the points do not tell them apart.
        """
        spans = (self.powers, _span(self.cell, 1, True), np.zeros((1, self.cell.dim), np.intp))
        told_apart = (s for s in spans if np.linalg.matrix_rank(_monomials(places, s)) == len(s))
        span = next(told_apart)
        fit = np.linalg.pinv(_monomials(places, span))
        return np.asarray(_monomials(at, span) @ fit, dtype=float)

    def _coefficients(self) -> Floats:
        """Monomials' coefficients (m, nodes) in each shape function."""
        return np.asarray(np.linalg.inv(_monomials(self.points, self.powers)), dtype=float)


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


def _span(cell: Cell, degree: int, full: bool) -> Ints:
    """Exponents of the shape functions' monomials.

    Total degree on a simplex; products of a triangle's and an interval's on a prism; on a cube
    products (``full``) or superlinear degree (serendipity; at degree 1 they are the same).
    """

    def order(exponents: Sequence[int]) -> int:
        if cell.is_simplex:
            return sum(exponents)
        if cell.is_cube:
            return max(exponents) if full else sum(e for e in exponents if e != 1)
        return sum(exponents[:2])

    every = product(range(degree + 1), repeat=cell.dim)
    return np.array([e for e in every if order(e) <= degree], dtype=np.intp)


def _entities(cell: Cell, degree: int, full: bool) -> tuple[Corners, ...]:
    """Corners of the sub-entity that each node is the middle of, in VTK order."""
    corners = tuple((c,) for c in range(len(cell.corners)))
    if degree == 1:
        return corners
    faces = tuple(f for f in cell.facets if len(f) == 4 and full)
    whole = (tuple(range(len(cell.corners))),) if cell.is_cube and full else ()
    return corners + cell.edges + faces + whole


def _from_vtk(cell: Cell, entities: Sequence[Corners]) -> list[int]:
    """VTK number of each kernel node.

    Basix sorts vertices by their coordinates, last axis first, and sub-entities of each dimension
    by their vertices: forwards, but backwards on simplices.
    """
    vertices = sorted(range(len(cell.corners)), key=lambda c: cell.corners[c][::-1])
    number = {corner: vertex for vertex, corner in enumerate(vertices)}

    def place(node: int) -> tuple[int, list[int]]:
        own = sorted(number[c] for c in entities[node])
        backwards = cell.is_simplex and len(own) > 1
        return len(own), [-v for v in own] if backwards else own

    return sorted(range(len(entities)), key=place)


def _facets(entities: Sequence[Corners], loops: Sequence[Corners], own: Sequence[Element]) -> Ints:
    """Nodes of each facet: those of its element, found in the cell by the corners they lie between.

    Args:
        entities: of the cell; loops: corners of each facet; own: element of each facet.
    """
    node = {frozenset(entity): i for i, entity in enumerate(entities)}
    width = max((element.nodes for element in own), default=0)
    table = np.full((len(loops), width), NO_NODE, dtype=np.intp)
    for row, loop, element in zip(table, loops, own, strict=True):
        row[: element.nodes] = [node[frozenset(loop[c] for c in e)] for e in element.entities]
    return table


def _element(
    name: str, meshio: str, cell: Cell, degree: int, full: bool = False, facets: str = ""
) -> Element:
    """Derive the tables of one element; they are shared, so they are read-only.

    Args:
        full: nodes also at the middles of quadrilaterals and cubes.
        facets: names of the facets' elements, by their number of corners.
    """
    kinds = {FACETS[kind].corners: FACETS[kind] for kind in facets.split()}
    entities = _entities(cell, degree, full)
    corners = np.array(cell.corners, dtype=float)
    from_vtk = np.array(_from_vtk(cell, entities), dtype=np.intp)
    loops = cell.facets if kinds else ()
    element = Element(
        name=name,
        meshio=meshio,
        cell=cell,
        degree=degree,
        entities=entities,
        points=np.array([corners[list(entity)].mean(axis=0) for entity in entities]),
        from_vtk=from_vtk,
        to_vtk=np.argsort(from_vtk),
        facet_elements=tuple(kind.name for kind in kinds.values()),
        facets=_facets(entities, loops, [kinds[len(loop)] for loop in loops]),
        powers=_span(cell, degree, full),
    )
    tables = (element.points, from_vtk, element.to_vtk, element.facets, element.powers)
    for table in tables:
        table.flags.writeable = False
    return element


TRIANGLE = Cell(
    name="triangle",
    corners=((0, 0), (1, 0), (0, 1)),
    edges=((0, 1), (1, 2), (2, 0)),
    facets=(),
)
QUADRILATERAL = Cell(
    name="quadrilateral",
    corners=((0, 0), (1, 0), (1, 1), (0, 1)),
    edges=((0, 1), (1, 2), (2, 3), (3, 0)),
    facets=(),
)
TETRAHEDRON = Cell(
    name="tetrahedron",
    corners=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    edges=((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    facets=((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
)
HEXAHEDRON = Cell(
    name="hexahedron",
    corners=(
        *((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)),
        *((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    ),
    edges=(
        *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    facets=(
        *((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4)),
        *((3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    ),
)
PRISM = Cell(
    name="prism",
    corners=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)),
    edges=((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    facets=((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
)

#: Facet elements by name.
FACETS = {
    element.name: element
    for element in (
        _element("T1", "triangle", TRIANGLE, 1),
        _element("T2", "triangle6", TRIANGLE, 2),
        _element("S1", "quad", QUADRILATERAL, 1),
        _element("S2", "quad8", QUADRILATERAL, 2),
        _element("S2L", "quad9", QUADRILATERAL, 2, full=True),
    )
}

#: Volume elements by name.
ELEMENTS = {
    element.name: element
    for element in (
        _element("P1", "tetra", TETRAHEDRON, 1, facets="T1"),
        _element("P2", "tetra10", TETRAHEDRON, 2, facets="T2"),
        _element("Q1", "hexahedron", HEXAHEDRON, 1, facets="S1"),
        _element("Q2", "hexahedron20", HEXAHEDRON, 2, facets="S2"),
        _element("Q2L", "hexahedron27", HEXAHEDRON, 2, full=True, facets="S2L"),
        _element("Pr1", "wedge", PRISM, 1, facets="T1 S1"),
        _element("Pr2", "wedge18", PRISM, 2, full=True, facets="T2 S2L"),
    )
}
