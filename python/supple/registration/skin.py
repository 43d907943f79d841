"""What is asked of a triangulated skin again and again: its normals, its free edges."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

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
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = _gathered(np.cross(b - a, c - a), triangles, len(points))
    for _ in range(smoothed):
        normals = _gathered(normals[triangles].mean(axis=1), triangles, len(points))
    return normals


def _gathered(of_triangles: Floats, triangles: Ints, count: int) -> Floats:
    """Unit sums (n, 3) at the corners of what triangles (t, 3) have."""
    own, whole = triangles.ravel(), np.repeat(of_triangles, 3, axis=0)
    sums = np.stack([np.bincount(own, whole[:, k], count) for k in range(3)], axis=1)
    length = np.linalg.norm(sums, axis=1, keepdims=True)
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
