"""Does a mesh lie in itself? Its cells may all be positive and yet two parts be in one place.

    boundary as triangles ─► edges that pierce a triangle          parts that cross
                          └► points just inside that lie in twice  parts within one another

Where cells are positive, the number of times that a place is covered changes at the boundary only,
so a place that is covered twice borders on a boundary facet whose inner side is covered twice.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .boundary_triangles import triangles_of, unit_normals
from .box_pairs import meeting
from .errors import ConvergenceError
from .kernels.cells import NO_NODE
from .mesh_checks import some
from .mesh_topology import all_facets, corner_groups, facet_corners, facet_uses

if TYPE_CHECKING:
    from .mesh import Mesh
    from .state import Rest

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

#: Of the mesh's size: parts that are in each other by less are in contact.
DEPTH = 1e-6
#: Where points of a triangle are looked at: its middle and near its corners.
_PLACES = np.array([[1 / 3, 1 / 3, 1 / 3], [0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]])
#: Of no mesh an edge or a facet lies along this axis, the third.
_ASKEW = np.linalg.qr(np.array([[0.61, 0.37, 0.23], [0.29, 0.83, 0.41], [0.53, 0.19, 0.71]]))[0]


def overlapping(mesh: Mesh, depth: float = DEPTH) -> Ints:
    """Sorted rows (k,) of ``mesh.boundary()`` that lie inside the mesh or cross its boundary.

    Parts that only touch do not overlap. Curved facets are looked at as flat triangles between
    their nodes, and of neighbours that share an edge only how often they cover a place is asked.

    Args:
        depth: of the mesh's size; what lies in another part by less is in contact with it.
    """
    facets = mesh.boundary()
    triangles, rows = triangles_of(facets, mesh.table)
    margin = depth * mesh.size
    found = _crossing(mesh.points, triangles, margin)
    found |= _covered_twice(mesh.points, triangles, margin)
    return np.unique(rows[found])


def owners(mesh: Mesh) -> Ints:
    """The cell (f,) that each row of ``mesh.boundary()`` is a facet of."""
    _, uses = facet_uses(mesh.cells, mesh.table)
    return np.asarray(np.flatnonzero(uses == 1) // len(mesh.table.facets))


def turned_over(mesh: Mesh) -> Ints:
    """Cells (k,) that lie on the same side as their neighbour of half of the facets they share.

    Each of them is positive by itself, and in its neighbours: a cell that was inside out and had
    its nodes reordered to look right. The whole mesh may then be overlapping there.
    """
    facets = all_facets(mesh.cells, mesh.table)
    corners = facet_corners(facets, mesh.table)
    (group,) = corner_groups(corners)
    shared = (np.bincount(group) == 2)[group]
    alike = shared & (np.bincount(group, _turns(corners))[group] != 1)
    per_cell = (x.reshape(len(mesh.cells), -1).sum(axis=1) for x in (alike, shared))
    wrong, neighbours = per_cell
    return np.flatnonzero((wrong > 0) & (2 * wrong >= neighbours))


def _turns(corners: Ints) -> Mask:
    """Which way (f,) loops (f, most corners) run from their least node."""
    count, rows = (corners != NO_NODE).sum(axis=1), np.arange(len(corners))
    least = np.where(corners == NO_NODE, corners.max() + 1, corners).argmin(axis=1)
    after, before = (corners[rows, (least + step) % count] for step in (1, -1))
    return np.asarray(after < before)


def require_apart(rest: Rest) -> Rest:
    """Refuse a rest shape that overlaps itself where the shape that was given does not.

    Returns:
        The rest shape; with a warning where the shape that was given overlaps itself.

    Raises:
        ConvergenceError: how many facets, of which cells.
    """
    rows = found = overlapping(rest.mesh)
    if len(found):  # a mesh may have been given so: that is not the rest shape's
        rows = np.setdiff1d(found, overlapping(rest.loaded))
    if not len(rows):
        return _warned(rest, len(found)) if len(found) else rest
    cells, cause = np.unique(owners(rest.mesh)[rows]), "rest shape overlaps itself"
    raise ConvergenceError(
        f"no usable rest shape: the {cause} at {len(rows)} boundary facets of cells {some(cells)}; "
        "try a smaller load, a stiffer material or a skin, or leave check_overlap out.",
        history=rest.history,
        cells=cells.tolist(),
        load_factor=1.0,
        cause=cause,
        points=rest.points,
    )


def _warned(rest: Rest, facets: int) -> Rest:
    warning = (
        f"the given mesh overlaps itself, and so does the rest shape, at {facets} boundary facets; "
        "its volume and weight count twice there."
    )
    return replace(rest, warnings=(*rest.warnings, warning))


def _crossing(points: Floats, triangles: Ints, margin: float) -> Mask:
    """Triangles (t,) that an edge of another pierces, or whose edge pierces another.

    Both ends of the edge lie off the triangle's plane by more than ``margin``, on either side of
    it, and the edge passes it inside the triangle. An edge that shares a node with a triangle can
    meet it elsewhere only by lying in its plane.
    """
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, owner = np.unique(edges, axis=0, return_inverse=True)
    of_triangle = owner.reshape(-1, 3)
    ends, corners = points[edges], points[triangles]
    e, t = meeting(ends.min(axis=1), ends.max(axis=1), corners.min(axis=1), corners.max(axis=1))
    apart = (edges[e][:, :, None] != triangles[t][:, None, :]).all(axis=(1, 2))
    e, t = e[apart], t[apart]
    pierced = _pierces(ends[e], corners[t], margin)
    found, by = np.zeros(len(triangles), dtype=bool), np.zeros(len(edges), dtype=bool)
    found[t[pierced]] = True
    by[e[pierced]] = True
    return np.asarray(found | by[of_triangle].any(axis=1))


def _pierces(ends: Floats, corners: Floats, margin: float) -> Mask:
    """Which segments (k, 2, 3) go through which triangles (k, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = unit_normals(corners)
    from_plane = np.einsum("kei,ki->ke", ends - a[:, None], normal)
    through = (from_plane.max(axis=1) > margin) & (from_plane.min(axis=1) < -margin)
    share = np.divide(from_plane[:, 0], from_plane[:, 0] - from_plane[:, 1],
                      out=np.zeros(len(ends)), where=through)  # fmt: skip
    at = ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])
    for start, end in ((a, b), (b, c), (c, a)):
        through &= np.einsum("ki,ki->k", np.cross(end - start, at - start), normal) > 0
    return np.asarray(through)


def _covered_twice(points: Floats, triangles: Ints, margin: float) -> Mask:
    """Triangles (t,) with a place just below them that the surface encloses more than once."""
    corners = points[triangles]
    below = margin * unit_normals(corners)[:, None]
    inside = np.einsum("pk,tkx->tpx", _PLACES, corners) - below
    times = windings(points, triangles, inside.reshape(-1, 3)).reshape(len(triangles), -1)
    return np.asarray((times > 1).any(axis=1))


def windings(points: Floats, triangles: Ints, places: Floats) -> Ints:
    """How often a closed surface, outward, encloses each of ``places`` (k, 3): (k,).

    A ray from each place counts 1 where it leaves and -1 where it enters. Two triangles see the
    edge that they share with the same rounding, so that a ray passes through one of them.
    """
    turned, seen = points @ _ASKEW, places @ _ASKEW
    corners = turned[triangles]
    flat = corners[:, :, :2]
    p, t = meeting(seen[:, :2], seen[:, :2], flat.min(axis=1), flat.max(axis=1))
    sides = [_side(turned, triangles[t][:, k], triangles[t][:, (k + 1) % 3], seen[p])
             for k in range(3)]  # fmt: skip
    left, right = np.all(sides, axis=0), ~np.any(sides, axis=0)
    a, b, c = (corners[t, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    ahead = np.einsum("ki,ki->k", a - seen[p], normal) * np.sign(normal[:, 2]) > 0
    counted = np.where(ahead, left.astype(np.int64) - right.astype(np.int64), 0)
    return np.bincount(p, counted, len(places)).astype(np.int64)


def _side(points: Floats, start: Ints, end: Ints, places: Floats) -> Mask:
    """Whether places lie left of start → end, seen along the third axis; never of both ways."""
    swap = start > end
    a, b = points[np.where(swap, end, start), :2], points[np.where(swap, start, end), :2]
    d, e = b - a, places[:, :2] - a
    return np.asarray((d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0] >= 0) != swap)
