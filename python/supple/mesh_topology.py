"""Who shares what: groups of equal rows, the boundary's facets, edges and their midpoints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.kernels.cells import ELEMENTS, FACETS, NO_NODE, Element

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def groups(rows: Ints) -> Ints:
    """Number (n,) of the group of each row (n, k) of ids: equal rows have equal numbers.

    Ids are >= 0 but in the first column, where they may be anything.
    Columns are folded into one number and only sorted where that would pass 2⁶³; nothing overflows
    while n · (largest id) stays below that.
    """
    group = rows[:, 0] - rows[:, 0].min(initial=0)
    count = int(group.max(initial=0)) + 1
    for column in rows[:, 1:].T:
        width = int(column.max(initial=0)) + 1
        if count * width >= 2**63:
            group = _ranks(group)
            count = int(group.max(initial=0)) + 1
        group, count = group * width + column, count * width
    return _ranks(group)


def _ranks(numbers: Ints) -> Ints:
    """Rank (n,) of each number among the different ones."""
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    rank = np.empty(len(numbers), dtype=np.int64)
    rank[order] = np.cumsum(np.append(0, ordered[1:] != ordered[:-1]))[: len(numbers)]
    return rank


def corner_groups(*blocks: Ints) -> list[Ints]:
    """Groups of the rows of several blocks (·, k) together, whatever the order within a row."""
    group = groups(np.sort(np.vstack(blocks), axis=1))
    return np.split(group, np.cumsum([len(b) for b in blocks])[:-1])


def all_facets(cells: Ints, element: Element) -> Ints:
    """Every facet of every cell (cells · facets, most nodes), cell by cell, outward.

    A row of a facet with fewer nodes than the widest ends in NO_NODE.
    """
    facets = cells[:, element.facets]
    facets[:, element.facets == NO_NODE] = NO_NODE
    return facets.reshape(-1, element.facets.shape[1])


def by_kind(facets: Ints, element: Element) -> list[tuple[Element, Ints]]:
    """Rows (k,) of ``facets`` (f, most nodes) of each kind that is among them."""
    kinds = [FACETS[name] for name in element.facet_elements]
    if len(kinds) == 1:
        return [(kinds[0], np.arange(len(facets)))]
    nodes = (facets != NO_NODE).sum(axis=1)
    found = [(kind, np.flatnonzero(nodes == kind.nodes)) for kind in kinds]
    return [(kind, rows) for kind, rows in found if len(rows)]


def facet_corners(facets: Ints, element: Element) -> Ints:
    """Corners (f, most corners) of facets (f, most nodes), in both NO_NODE where there is none."""
    most = max(FACETS[name].corners for name in element.facet_elements)
    if len(element.facet_elements) == 1:
        return facets[:, :most]
    corners = np.full((len(facets), most), NO_NODE, dtype=np.int64)
    for kind, rows in by_kind(facets, element):
        corners[rows, : kind.corners] = facets[rows, : kind.corners]
    return corners


def padded(facets: Ints, element: Element) -> Ints:
    """Facets (f, nodes) of one kind as rows (f, most nodes) of all kinds of ``element``."""
    missing = element.facets.shape[1] - facets.shape[1]
    return np.pad(facets, ((0, 0), (0, missing)), constant_values=NO_NODE)


def facet_uses(cells: Ints, element: Element) -> tuple[Ints, Ints]:
    """All facets, and how many cells (·,) share each of them."""
    facets = all_facets(cells, element)
    (group,) = corner_groups(facet_corners(facets, element))
    return facets, np.bincount(group)[group]


def of_degree(degree: int, element: Element) -> str:
    """Name of the element of that degree on the same cell, the one with fewest nodes."""
    same = [e for e in ELEMENTS.values() if e.cell is element.cell and e.degree == degree]
    return min(same, key=lambda e: e.nodes).name


def elevate(
    points: Floats, cells: Ints, element: Element, higher: Element
) -> tuple[Floats, Ints, list[Ints]]:
    """Degree 2 from degree 1 with nodes at the middles of edges and, if it has them, faces, cells.

    Returns:
        points, cells, and arrays (m, corners) of the sub-entities whose middles follow the old
        points: edges, then faces, then cells, each sorted.
    """
    parents: list[Ints] = []
    places, columns, count = [points], [cells], len(points)
    for size in sorted({len(entity) for entity in higher.entities} - {1}):
        local = np.array([entity for entity in higher.entities if len(entity) == size])
        rows = np.sort(cells[:, local].reshape(-1, size), axis=1)
        corners, number = np.unique(rows, axis=0, return_inverse=True)
        places.append(points[corners].mean(axis=1))
        columns.append(count + number.reshape(len(cells), -1))
        parents.append(corners)
        count += len(corners)
    return np.vstack(places), np.hstack(columns), parents


def elevate_facets(
    tagged: Ints, cells: Ints, element: Element, new_cells: Ints, higher: Element
) -> Ints:
    """Tagged facets at degree 2: the cells' own facets in the same places, outward."""
    old, new = all_facets(cells, element), all_facets(new_cells, higher)
    known, own = corner_groups(facet_corners(old, element), facet_corners(tagged, element))
    numbers, first = np.unique(known, return_index=True)
    return new[first[np.searchsorted(numbers, own)]]
