"""Half a body cut out by planes: every vertex a fixed mean of vertices of the whole mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: A vertex: ids of the whole mesh and their weights, which sum to 1.
Mean = dict[int, float]


@dataclass(frozen=True, eq=False, repr=False)
class Half:
    """The half with x ≥ 0.

    Attributes:
        means: (h, n) scipy CSR, rows sum to 1: values at its vertices from those of all the mesh.
        triangles: (t, 3), counter-clockwise seen from outside.
        middle: (h,) which vertices lie on x = 0.
    """

    means: Any
    triangles: Ints
    middle: npt.NDArray[np.bool_]

    def whole(self, mirror: Ints) -> tuple[Any, Ints, Ints]:
        """Means, triangles and mirror of both halves; ``mirror`` (n,) is that of all the mesh.

        The half's own vertices come first, then the images of those off the middle.
        """
        from scipy import sparse

        h, off = len(self.middle), np.flatnonzero(~self.middle)
        image = np.where(self.middle, np.arange(h), h + np.cumsum(~self.middle) - 1)
        there = self.means[:, mirror]
        own = sparse.diags_array(np.where(self.middle, 0.5, 1.0)) @ self.means
        own = own + sparse.diags_array(np.where(self.middle, 0.5, 0.0)) @ there
        triangles = np.vstack([self.triangles, image[self.triangles[:, ::-1]]])
        return (sparse.vstack([own, there[off]]).tocsr(), triangles,
                np.concatenate([image, off]))  # fmt: skip


def cut(points: Floats, quads: Ints, sides: Sequence[Floats], snap: float = 0.3) -> Half:
    """What of the half with x ≥ 0 is where every function of ``sides`` (n,) is negative.

    A vertex nearer than ``snap`` of an edge to its crossing with a side moves there, so that no
    slivers remain. Quads are divided along their shorter diagonal.
    """
    from scipy import sparse

    left = (points[quads, 0] >= 0).all(axis=1)
    polygons = [list(map(int, quad)) for quad in quads[left]]
    means: list[Mean] = [{k: 1.0} for k in range(len(points))]
    for side in sides:
        polygons = _clip(polygons, means, side, snap)
    kept, first = np.unique([k for polygon in polygons for k in polygon], return_inverse=True)
    matrix = sparse.lil_array((len(kept), len(points)))
    for row, k in enumerate(kept):
        for column, weight in means[k].items():
            matrix[row, column] = weight
    rows = sparse.csr_array(matrix)
    corners = np.split(first.ravel(), np.cumsum([len(p) for p in polygons])[:-1])
    at = rows @ points
    return Half(rows, _triangles(at, corners), np.abs(at[:, 0]) < 1e-9)


def _clip(
    polygons: list[list[int]], means: list[Mean], side: Floats, snap: float
) -> list[list[int]]:
    """The parts of polygons on the negative side; new vertices are appended to ``means``."""
    value = np.array([sum(w * side[k] for k, w in mean.items()) for mean in means])
    edges = {(min(e), max(e)) for p in polygons for e in zip(p, p[1:] + p[:1], strict=True)}
    crossing = sorted(e for e in edges if value[e[0]] * value[e[1]] < 0)
    share = {e: float(value[e[0]] / (value[e[0]] - value[e[1]])) for e in crossing}
    nearest: dict[int, tuple[float, tuple[int, int]]] = {}
    for (a, b), t in share.items():
        for end, near in ((a, t), (b, 1 - t)):
            if near < min(snap, nearest.get(end, (1.0, (0, 0)))[0]):
                nearest[end] = (near, (a, b))
    moved = {end: _mean(means, edge, share[edge]) for end, (_, edge) in nearest.items()}
    for end, mean in moved.items():
        means[end], value[end] = mean, 0.0
    middle = {}
    for edge in crossing:
        if value[edge[0]] * value[edge[1]] < 0:
            middle[edge] = len(means)
            means.append(_mean(means, edge, share[edge]))
    return [part for p in polygons if len(part := _part(p, value, middle)) >= 3]


def _mean(means: list[Mean], edge: tuple[int, int], share: float) -> Mean:
    result: Mean = {}
    for end, weight in zip(edge, (1 - share, share), strict=True):
        for k, w in means[end].items():
            result[k] = result.get(k, 0.0) + weight * w
    return result


def _part(polygon: list[int], value: Floats, middle: dict[tuple[int, int], int]) -> list[int]:
    if not any(value[k] < 0 for k in polygon):
        return []
    part = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        if value[a] <= 0:
            part.append(a)
        if (edge := (min(a, b), max(a, b))) in middle:
            part.append(middle[edge])
    return part


def _triangles(points: Floats, polygons: Sequence[Ints]) -> Ints:
    """Ears cut off shortest diagonal first."""
    triangles = []
    for polygon in polygons:
        rest = list(polygon)
        while len(rest) > 3:
            spans = [np.linalg.norm(points[rest[i - 1]] - points[rest[(i + 1) % len(rest)]])
                     for i in range(len(rest))]  # fmt: skip
            i = int(np.argmin(spans))
            triangles.append((rest[i - 1], rest[i], rest[(i + 1) % len(rest)]))
            del rest[i]
        triangles.append(tuple(rest))
    if not triangles:
        raise MeshError("nothing of the body is left between the cuts; take hm08 unchanged.")
    return np.array(triangles, dtype=np.int64)
