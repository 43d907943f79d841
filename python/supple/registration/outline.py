"""The part of a template inside of a closed curve on it: triangles cut where the curve passes.

curve ─► distance of each vertex, negative inside ─► edges cut at its zero ─► smaller triangles
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError
from supple.registration.skin import edges, free_edges, vertex_normals
from supple.registration.template import Template

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

#: A vertex nearer to the curve than this share of an edge is on it: no slivers.
_SNAP = 0.05


@dataclass(frozen=True, eq=False, repr=False)
class Cut:
    """The skin inside of a curve.

    Attributes:
        corners: (q, 2) vertices of the template that each point lies between.
        share: (q,) of the second of them.
        triangles: (t, 3) points, anticlockwise seen from outside.
        rim: (b,) points on the curve, anticlockwise seen from outside.
        distance: (n,) m of the template's vertices from the curve, negative inside.
    """

    corners: Ints
    share: Floats
    triangles: Ints
    rim: Ints
    distance: Floats

    def at(self, vertices: Floats) -> Floats:
        """The points (…, q, 3) m with the template's vertices at (…, n, 3) m."""
        a, b = (vertices[..., self.corners[:, k], :] for k in (0, 1))
        return np.asarray(a + self.share[:, None] * (b - a))


@lru_cache(maxsize=16)
def cut_along(template: Template, curve: str, inside: str) -> Cut:
    """The skin inside of ``curve``, where the landmark ``inside`` is.

    Raises:
        MeshError: the curve does not go once around the landmark, on one sheet of skin.
    """
    return cut_at(template, signed_distance(template, curve, inside), f"the curve {curve!r}")


def cut_at(template: Template, distance: Floats, curve: str) -> Cut:
    """The skin where ``distance`` (n,) is negative, cut along its zero.

    Raises:
        MeshError: it is not one disc; ``curve`` is what its rim is called then.
    """
    corners, share, loops = _clipped(template.triangles, distance)
    whole = Cut(corners, share, np.empty((0, 3), dtype=np.int64), np.empty(0, np.int64), distance)
    triangles = _split(loops, whole.at(template.points))
    return replace(whole, triangles=triangles, rim=_loop(triangles, curve))


def signed_distance(template: Template, curve: str, inside: str) -> Floats:
    """(n,) m of each vertex from a closed curve, negative on the side of a landmark."""
    points, faces = template.points, template.triangles
    line = template.curves[curve].at(points, faces)
    distance, side = _sides(points, vertex_normals(points, faces), line)
    longest = np.linalg.norm(np.diff(points[edges(faces)], axis=2), axis=3).max(axis=(1, 2))
    reach = np.zeros(len(points))
    np.maximum.at(reach, faces.ravel(), np.repeat(longest, 3))
    side = _flooded(faces, side, distance < 1.5 * reach)
    corners = faces[template.landmarks[inside].triangle[0]]
    if side[corners[template.landmarks[inside].barycentric[0].argmax()]] > 0:
        side = -side
    signed = distance * side
    signed[np.abs(signed) < _SNAP * reach] = 0.0
    return np.asarray(signed)


def _sides(points: Floats, normals: Floats, line: Floats) -> tuple[Floats, Floats]:
    """Distance (n,) from a closed line, and ±1 for its left and right; right only near it."""
    following = np.roll(line, -1, axis=0)
    along = following - line
    square = np.maximum((along**2).sum(axis=1), 1e-30)
    share = np.clip(np.einsum("nsd,sd->ns", points[:, None] - line, along) / square, 0, 1)
    off = points[:, None] - line - share[..., None] * along
    distances = np.linalg.norm(off, axis=2)
    nearest = distances.argmin(axis=1)
    rows = np.arange(len(points))
    unit = along / np.sqrt(square)[:, None]
    s = share[rows, nearest]
    tangent = unit[nearest]  # at a corner of the line, the mean of the two
    tangent = tangent + np.where((s >= 1)[:, None], unit[(nearest + 1) % len(line)], 0.0)
    tangent = tangent + np.where((s <= 0)[:, None], unit[nearest - 1], 0.0)
    left = np.einsum("nd,nd->n", np.cross(normals, tangent), off[rows, nearest])
    return distances[rows, nearest], np.where(left > 0, 1.0, -1.0)


def _flooded(faces: Ints, side: Floats, near: Mask) -> Floats:
    """Sides of all vertices: what is not near the curve has the side of what it borders on."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends = edges(faces).reshape(-1, 2)
    far = ~near[ends].any(axis=1)
    n = len(side)
    _, part = connected_components(
        coo_array((np.ones(far.sum()), ends[far].T), shape=(n, n)), directed=False
    )
    votes = np.zeros(part.max() + 1)
    for a, b in ((0, 1), (1, 0)):
        border = ~near[ends[:, a]] & near[ends[:, b]]
        np.add.at(votes, part[ends[border, a]], side[ends[border, b]])
    return np.where(near, side, np.where(votes[part] > 0, 1.0, -1.0))


def _clipped(faces: Ints, level: Floats) -> tuple[Ints, Floats, list[list[int]]]:
    """Corners (q, 2) and shares (q,) of points, and loops of 3 or 4 of them, where level ≤ 0."""
    names: dict[tuple[int, int], int] = {}

    def name(a: int, b: int) -> int:
        """The point where the level is 0 between two vertices; of one vertex, itself."""
        return names.setdefault((min(a, b), max(a, b)), len(names))

    loops = []
    for face in faces[(level[faces] < 0).any(axis=1)].tolist():
        loop: list[int] = []
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            if level[a] <= 0:
                loop.append(name(a, a))
            if level[a] * level[b] < 0:
                loop.append(name(a, b))
        loops.append(loop)
    corners = np.array(list(names), dtype=np.int64).reshape(-1, 2)
    first, second = level[corners].T
    whole = corners[:, 0] == corners[:, 1]
    return corners, np.where(whole, 0.0, first / np.where(whole, 1.0, first - second)), loops


def _split(loops: list[list[int]], points: Floats) -> Ints:
    """Triangles (t, 3) of loops, a loop of 4 along its shorter diagonal: both breasts alike."""
    triangles = []
    for loop in loops:
        if len(loop) == 4:
            a, b, c, d = points[loop]
            turned = loop if np.linalg.norm(a - c) < np.linalg.norm(b - d) else loop[1:] + loop[:1]
            triangles += [turned[:3], [turned[0], *turned[2:]]]
        else:
            triangles.append(loop)
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _loop(triangles: Ints, curve: str) -> Ints:
    """The rim of a disc, in the direction of its triangles."""
    if len(triangles):
        rim = edges(triangles)[free_edges(triangles)]
        after = dict(rim.tolist())
        loop = [int(rim[0, 0])]
        while len(loop) <= len(rim) and after.get(loop[-1], loop[0]) != loop[0]:
            loop.append(after[loop[-1]])
        if len(loop) == len(rim) and len(after) == len(rim):
            return np.array(loop)
    raise MeshError(f"{curve} must go once around one sheet of skin; draw it again.")
