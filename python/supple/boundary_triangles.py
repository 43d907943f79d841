"""Facets of any element as flat triangles between their nodes, to look at and to intersect."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .kernels.cells import Element
from .mesh_topology import by_kind

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Triangles (t, 3) of each kind of facet; nodes in VTK order: corners, middles of edges, middle.
_SPLITS = {
    "T1": ((0, 1, 2),),
    "T2": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    "S1": ((0, 1, 2), (0, 2, 3)),
    "S2": ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)),
    "S2L": tuple((*side, 8) for side in
                 ((0, 4), (4, 1), (1, 5), (5, 2), (2, 6), (6, 3), (3, 7), (7, 0))),
}  # fmt: skip


def triangles_of(facets: Ints, element: Element) -> tuple[Ints, Ints]:
    """Triangles (t, 3) node ids, turned as their facets are, and the row (t,) of each one's facet.

    A curved facet becomes as many flat triangles as its nodes span, so that a closed surface stays
    closed.
    """
    triangles, rows = [], []
    for kind, own in by_kind(facets, element):
        split = np.array(_SPLITS[kind.name])
        triangles.append(facets[own][:, split].reshape(-1, 3))
        rows.append(np.repeat(own, len(split)))
    return np.concatenate(triangles), np.concatenate(rows)


def unit_normals(corners: Floats) -> Floats:
    """Normals (t, 3) at length 1 of triangles (t, 3, 3), 0 without an area."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.maximum(size, np.finfo(float).tiny))
