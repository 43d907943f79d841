"""What is asked of a triangulated skin again and again: its normals, its free edges."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.surface import area_vectors

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

#: Corners of the edges of a triangle.
_EDGES = ((0, 1), (1, 2), (2, 0))


def vertex_normals(points: Floats, triangles: Ints, smoothed: int = 0) -> Floats:
    """Unit normals (n, 3), of a vertex the mean of its triangles' by area; 0 without triangles.

    Args:
        smoothed: how often to take the mean over each triangle, and of those again.
    """
    corners = np.ascontiguousarray(triangles.T)
    normals = _gathered(area_vectors(points, triangles).T, corners, len(points))
    for _ in range(smoothed):
        a, b, c = (normals[:, ids] for ids in corners)
        normals = _gathered(a + b + c, corners, len(points))
    return np.ascontiguousarray(normals.T)


def _gathered(of_triangles: Floats, corners: Ints, count: int) -> Floats:
    """Unit sums (3, n) at the corners (3, t) of what triangles have (3, t)."""
    sums = np.stack([sum(np.bincount(ids, row, count) for ids in corners) for row in of_triangles])
    length = np.sqrt((sums**2).sum(axis=0))
    return np.asarray(sums / np.where(length > 0, length, 1.0))


def edges(triangles: Ints) -> Ints:
    """(t, 3, 2) ends of the edges of each triangle, in its direction."""
    return triangles[:, _EDGES]


def free_edges(triangles: Ints, points: Floats | None = None) -> Mask:
    """(t, 3) which edges no other triangle has; points (m, 3) in one place count as one."""
    if not len(triangles):
        return np.zeros((0, 3), dtype=bool)
    ends = edges(triangles).reshape(-1, 2)
    if points is not None:
        ends = np.unique(points, axis=0, return_inverse=True)[1].ravel()[ends]
    ends = np.sort(ends, axis=1)
    keys = ends[:, 0] * (ends.max() + 1) + ends[:, 1]
    _, which, count = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray((count[which.ravel()] == 1).reshape(-1, 3))
