"""Scans with two walls: a skin that was thickened, or an inside that was scanned too."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration.scan_topology import connected, neighbours

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

#: A wall is at least and at most this thick, m; arms and breasts are thicker, noise is thinner.
_WALL = (0.8e-3, 20e-3)
#: Share of the skin that must have another sheet behind it before the scan counts as two-walled.
_SHARE = 0.4
#: m that a unit of difference between normals is away, where sheets facing alike are sought.
_TURN = 0.03
_SAMPLE, _TREE = 1000, 20000


def outer_sheet(points: Floats, triangles: Ints, of: Ints) -> Mask:
    """Which triangles (t,) to keep: all, or of a scan with two walls those outside.

    A scan has two walls when most of its skin, 1 to 20 mm deep, has skin behind it that faces the
    other way, or when one piece lies inside another along most of it. Which wall is outside, the
    distance to the middle of the body tells, on the mean of each part.

    Args:
        points: (n, 3) m.
        triangles: (t, 3), neighbours of one orientation.
        of: (t,) the piece of each.
    """
    centre, normal = _centres(points, triangles)
    pick = _some(len(centre), _SAMPLE)
    partner = _partner(centre, normal, of, pick, _some(len(centre), _TREE))
    if np.mean(partner >= 0) < _SHARE:
        return np.ones(len(triangles), dtype=bool)
    everyone = np.arange(len(centre))
    partner = _partner(centre, normal, of, everyone, everyone)
    return _outer(points, triangles, centre, normal, partner)


def _outer(points: Floats, triangles: Ints, centre: Floats, normal: Floats, partner: Ints) -> Mask:
    """Cut the skin where it has no other wall (the rim); each part votes for itself."""
    paired = partner >= 0
    left, right, _ = neighbours(triangles, len(points))
    tie = paired[left] & paired[right]
    part, count = connected(left[tie], right[tie], len(triangles))
    away = np.linalg.norm(centre - np.median(centre, axis=0), axis=1)
    lead = np.where(paired, away - away[partner], 0.0)
    outer = np.asarray(np.bincount(part, lead, count)[part] > 0)
    outer[~paired] = _as_nearest(centre, normal, paired, outer)
    return outer


def _as_nearest(centre: Floats, normal: Floats, paired: Mask, outer: Mask) -> Mask:
    """What the nearest triangle of a wall that faces alike is, for those of no wall."""
    from scipy.spatial import cKDTree

    place = np.hstack([centre, _TURN * normal])
    _, found = cKDTree(place[paired]).query(place[~paired])
    return np.asarray(outer[paired][found])


def _partner(centre: Floats, normal: Floats, of: Ints, some: Ints, rows: Ints) -> Ints:
    """Of triangles ``some``, that of ``rows`` on the other wall; -1 where there is none.

    The other wall faces the other way and lies behind (or, of a scan inside out, in front, on
    the whole); or it is of another piece and faces either way.
    """
    from scipy.spatial import cKDTree

    found = np.full(len(some), -1)
    tree = cKDTree(np.hstack([centre[rows], _TURN * normal[rows]]))
    query = np.hstack([centre[some], -_TURN * normal[some]])
    found = _taken(tree.query(query, distance_upper_bound=0.03)[1], rows)
    found = _checked(centre, normal, some, found, -1.0)
    if of.max() == 0:
        return found
    main = np.flatnonzero(np.bincount(of) > 0.15 * len(of))
    for piece in main if len(main) > 1 else ():
        others = rows[np.isin(of[rows], main) & (of[rows] != piece)]
        own = np.flatnonzero((of[some] == piece) & (found < 0))
        if len(others) and len(own):
            near = cKDTree(centre[others]).query(centre[some[own]], distance_upper_bound=0.03)[1]
            found[own] = _checked(centre, normal, some[own], _taken(near, others), 1.0)
    return found


def _taken(near: Ints, rows: Ints) -> Ints:
    return np.where(near < len(rows), rows[np.minimum(near, len(rows) - 1)], -1)


def _checked(centre: Floats, normal: Floats, some: Ints, found: Ints, facing: float) -> Ints:
    """``found`` where it is a wall's thickness off along the normal, on the side of most."""
    hit = found >= 0
    gap = np.einsum("nd,nd->n", centre[some] - centre[found], normal[some])
    aside = np.linalg.norm(centre[some] - centre[found], axis=1)
    alike = np.einsum("nd,nd->n", normal[some], normal[found]) * facing
    hit &= (alike > 0.5) & (np.abs(gap) > _WALL[0]) & (aside < _WALL[1])
    side = 1.0 if (gap[hit] > 0).mean() >= 0.5 else -1.0
    return np.where(hit & (gap * side > 0), found, -1) if hit.any() else np.full(len(some), -1)


def _centres(points: Floats, triangles: Ints) -> tuple[Floats, Floats]:
    """Middles (t, 3), and unit normals (t, 3) of the corners' means, which noise turns less."""
    from scipy.sparse import csr_matrix

    a, b, c = (points[triangles[:, i]] for i in range(3))
    t = len(triangles)
    cross = np.cross(b - a, c - a)
    ones, starts = np.ones(3 * t), np.arange(0, 3 * t + 1, 3)
    corners = csr_matrix((ones, triangles.ravel(), starts), shape=(t, len(points)))
    mean = corners @ (corners.T @ cross)
    size = np.sqrt(np.einsum("td,td->t", mean, mean))
    return (a + b + c) / 3, mean / np.maximum(size, 1e-30)[:, None]


def _some(count: int, most: int) -> Ints:
    """At most ``most`` of ``count`` rows, spread over all."""
    if count <= most:
        return np.arange(count)
    return np.random.default_rng(0).permutation(count)[:most]
