"""Who shares what: groups of equal rows, the boundary's facets, edges and their midpoints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.kernels.cells import ELEMENTS, FACETS, Element

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def groups(rows: Ints) -> Ints:
    """Number (n,) of the group of each row (n, k) of ids >= 0: equal rows have equal numbers.

    Columns are folded one by one, so nothing overflows while n · (largest id) < 2⁶³.
    """
    _, group = np.unique(rows[:, 0], return_inverse=True)
    for column in rows[:, 1:].T:
        pair = group * (int(column.max(initial=0)) + 1) + column
        _, group = np.unique(pair, return_inverse=True)
    return np.asarray(group, dtype=np.int64)


def corner_groups(*blocks: Ints) -> list[Ints]:
    """Groups of the rows of several blocks (·, k) together, whatever the order within a row."""
    group = groups(np.sort(np.vstack(blocks), axis=1))
    return np.split(group, np.cumsum([len(b) for b in blocks])[:-1])


def all_facets(cells: Ints, element: Element) -> Ints:
    """Every facet of every cell (cells · facets, nodes per facet), cell by cell, outward."""
    return cells[:, element.facets].reshape(-1, element.facets.shape[1])


def facet_uses(cells: Ints, element: Element) -> tuple[Ints, Ints]:
    """All facets, and how many cells (·,) share each of them."""
    facets = all_facets(cells, element)
    (group,) = corner_groups(facets[:, : FACETS[element.facet].corners])
    return facets, np.bincount(group)[group]


def edges_of(corners: Ints, element: Element) -> Ints:
    """Edges (n, edges per cell, 2) of cells or facets by their corners (n, ·), VTK order."""
    return corners[:, np.array(element.cell.edges)]


def elevate(points: Floats, cells: Ints, element: Element) -> tuple[Floats, Ints, Element, Ints]:
    """Degree 2 from degree 1 with nodes at the middles of the edges.

    Returns:
        points, cells, the element of degree 2, and the edges (m, 2) whose middles follow the old
        points, sorted.
    """
    pairs = np.sort(edges_of(cells, element).reshape(-1, 2), axis=1)
    edges, middle = np.unique(pairs, axis=0, return_inverse=True)
    higher = ELEMENTS[element.name[0] + "2"]
    middle = len(points) + middle.reshape(len(cells), -1)
    return (
        np.vstack([points, points[edges].mean(axis=1)]),
        np.hstack([cells, middle]),
        higher,
        edges,
    )


def elevate_facets(facets: Ints, facet: Element, edges: Ints, first: int) -> Ints:
    """The same facets (f, corners) with the middles of ``edges``, numbered from ``first``."""
    pairs = np.sort(edges_of(facets, facet).reshape(-1, 2), axis=1)
    size = int(edges.max()) + 1
    place = np.searchsorted(edges[:, 0] * size + edges[:, 1], pairs[:, 0] * size + pairs[:, 1])
    return np.hstack([facets, first + place.reshape(len(facets), -1)])
