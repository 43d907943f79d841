"""Scans with two walls: a skin that was thickened, or an inside that was scanned too."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration.scan_topology import connected

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

#: A wall is at least and at most this thick, m; arms and breasts are thicker, noise is thinner.
_WALL = (0.8e-3, 20e-3)
#: Share of the skin that must have another sheet behind it before the scan counts as two-walled.
_SHARE = 0.4
#: m that a unit of difference between normals is away, where sheets facing alike are sought.
_TURN = 0.03
#: Points that are looked at first, to learn whether there may be two walls at all.
_SAMPLE = 4000


def outer_sheet(points: Floats, triangles: Ints, of: Ints, normals: Floats) -> Mask:
    """Which triangles (t,) to keep: all, or of a scan with two walls those outside.

    A scan has two walls when most of its skin, 1 to 20 mm deep, has skin behind it that faces the
    other way, or when one piece lies inside another along most of it. Which wall is outside, the
    distance to the middle of the body tells, on the mean of each part.

    Args:
        points: (n, 3) m.
        triangles: (t, 3), neighbours of one orientation.
        of: (n,) the piece of each point.
        normals: (t, 3) of any length.
    """
    some = _some(len(points), _SAMPLE)
    ring = _ring_normals(triangles, normals, some, len(points))
    if np.mean(_partner(points[some], ring, of[some]) >= 0) < _SHARE:
        return np.ones(len(triangles), dtype=bool)
    everyone = np.arange(len(points))
    ring = _ring_normals(triangles, normals, everyone, len(points))
    outer = _outer(points, triangles, ring, _partner(points, ring, of))
    return np.asarray(outer[triangles].sum(axis=1) >= 2)


def _outer(points: Floats, triangles: Ints, normals: Floats, partner: Ints) -> Mask:
    """Which points (n,) are outside: cut at the rim, which has no other wall or folds sharply.

    Each part then votes.
    """
    paired = partner >= 0
    a, b = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    tie = paired[a] & paired[b] & (np.einsum("ed,ed->e", normals[a], normals[b]) > 0.2)
    part, count = connected(a[tie], b[tie], len(points))
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    lead = np.where(paired, away - away[partner], 0.0)
    outer = np.asarray(np.bincount(part, lead, count)[part] > 0)
    outer[~paired] = _as_nearest(points, normals, paired, outer)
    return outer


def _as_nearest(points: Floats, normals: Floats, paired: Mask, outer: Mask) -> Mask:
    """What the nearest point of a wall that faces alike is, for those of no wall."""
    from scipy.spatial import cKDTree

    place = np.hstack([points, _TURN * normals])
    _, found = cKDTree(place[paired]).query(place[~paired])
    return np.asarray(outer[paired][found])


def _partner(points: Floats, normals: Floats, of: Ints) -> Ints:
    """The point (n,) on the other wall of each point; -1 where there is none.

    The other wall faces the other way and lies behind (or, of a scan inside out, in front, on
    the whole); or it is of another piece and faces either way.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(np.hstack([points, _TURN * normals]))
    query = np.hstack([points, -_TURN * normals])
    _, near = tree.query(query, distance_upper_bound=0.03)
    everyone = np.arange(len(points))
    found = _checked(points, normals, everyone, near, -1.0)
    main = np.flatnonzero(np.bincount(of) > 0.15 * len(of))
    for piece in main if len(main) > 1 else ():
        others = np.flatnonzero(np.isin(of, main) & (of != piece))
        own = np.flatnonzero((of == piece) & (found < 0))
        if len(own):
            _, near = cKDTree(points[others]).query(points[own], distance_upper_bound=0.03)
            near = np.append(others, len(points))[near]
            found[own] = _checked(points, normals, own, near, 1.0)
    return found


def _checked(points: Floats, normals: Floats, some: Ints, found: Ints, facing: float) -> Ints:
    """``found`` where it is a wall's thickness off along the normal, on the side of most."""
    hit = found < len(points)
    to = np.where(hit, found, 0)
    apart = points[some] - points[to]
    gap = np.einsum("nd,nd->n", apart, normals[some])
    alike = np.einsum("nd,nd->n", normals[some], normals[to]) * facing
    hit &= (alike > 0.5) & (np.abs(gap) > _WALL[0]) & (np.linalg.norm(apart, axis=1) < _WALL[1])
    side = 1.0 if (gap[hit] > 0).sum() * 2 >= hit.sum() else -1.0
    return np.where(hit & (gap * side > 0), found, -1)


def _ring_normals(triangles: Ints, normals: Floats, some: Ints, count: int) -> Floats:
    """Unit normal (k, 3) of the triangles round each of the points ``some``."""
    new = np.full(count, -1)
    new[some] = np.arange(len(some))
    corner = new[triangles]
    total = np.zeros((len(some), 3))
    for ids in corner.T:
        hit = ids >= 0
        for axis in range(3):
            total[:, axis] += np.bincount(ids[hit], normals[hit, axis], len(some))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30))


def _some(count: int, most: int) -> Ints:
    """At most ``most`` of ``count`` rows, spread over all."""
    if count <= most:
        return np.arange(count)
    return np.linspace(0, count - 1, most).astype(np.int64)
