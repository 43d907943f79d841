"""Meshes of a round bar with truly round sections, and the sections that a mesh really has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..mesh import Mesh

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Half the side of the square in the middle of the disk, of its radius.
_CORE = 0.45


def round_bar(length: float, radius: float, across: int, along: int, element: str) -> Mesh:
    """A bar from x = 0 to ``length``, m, about the x axis; at degree 2 its surface is curved.

    Args:
        across: cells along a side of the disk's inner square, and half as many around it.
        along: cells along the bar.
        element: of tetrahedra or hexahedra.
    """
    flat, quads = _disk(across)
    cut = element.startswith("P")
    points = np.concatenate(
        [np.column_stack([np.full(len(flat), x), radius * flat])
         for x in np.linspace(0.0, length, along + 1)]
    )  # fmt: skip
    layer = _tetrahedra(quads, len(flat)) if cut else np.hstack([quads, quads + len(flat)])
    if cut:
        edges = points[layer[:, 1:]] - points[layer[:, :1]]
        layer = np.where(np.linalg.det(edges)[:, None] < 0, layer[:, [0, 2, 1, 3]], layer)
    cells = np.concatenate([layer + k * len(flat) for k in range(along)])
    mesh = Mesh(points, cells, "P1" if cut else "Q1")
    return mesh if element == mesh.element else _rounded(mesh.elevated(element), radius)


def _disk(n: int) -> tuple[Floats, Ints]:
    """Points (k, 2) and quadrilaterals of the unit disk: a square, and four blocks around it."""
    t, outwards = np.linspace(-1.0, 1.0, n + 1), np.linspace(0.0, 1.0, (n + 1) // 2 + 1)
    square = np.stack(np.meshgrid(_CORE * t, _CORE * t, indexing="ij"), axis=-1)
    side = np.column_stack([np.full(n + 1, _CORE), _CORE * t])
    arc = np.column_stack([np.cos(np.pi / 4 * t), np.sin(np.pi / 4 * t)])
    block = side + outwards[:, None, None] * (arc - side)
    turns = [np.array([[c, s], [-s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    blocks = [square, *(block @ turn for turn in turns)]
    points, start, quads = np.concatenate([b.reshape(-1, 2) for b in blocks]), 0, []
    for b in blocks:
        ids = start + np.arange(b[..., 0].size).reshape(b.shape[:2])
        corners = (ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:])
        quads.append(np.stack([c.ravel() for c in corners], axis=1))
        start += ids.size
    _, first, same = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return points[first], same.ravel()[np.concatenate(quads)]


def _tetrahedra(quads: Ints, step: int) -> Ints:
    """Three a prism, six a block; diagonals start at the lower number, so that neighbours agree."""
    a, b, c = np.sort(np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), axis=1).T
    tets = [(a, b, c, c + step), (a, b, b + step, c + step), (a, a + step, b + step, c + step)]
    return np.concatenate([np.stack(t, axis=1) for t in tets])


def _rounded(mesh: Mesh, radius: float) -> Mesh:
    """Every node of the bar's side moved onto the circle."""
    outside, points = mesh.boundary(), mesh.points.copy()
    corners = outside[:, : 3 if mesh.element.startswith("P") else 4]
    on_side = (np.hypot(*points[corners, 1:].transpose(2, 0, 1)) > radius * (1 - 1e-6)).all(axis=1)
    nodes = np.unique(outside[on_side])
    points[nodes, 1:] *= radius / np.hypot(*points[nodes, 1:].T)[:, None]
    return mesh.moved(points)


@dataclass(frozen=True)
class Sections:
    """Area (k,) m² and second moment (k,) m⁴ about z through the centroid, along the bar."""

    area: Floats
    moment: Floats


def sections(mesh: Mesh, count: int = 201) -> Sections:
    """Plane sections across x, at equal steps, of a mesh of straight tetrahedra, cut exactly.

    The first and the last plane lie a thousandth of a step inside.
    """
    low, high = mesh.points[:, 0].min(), mesh.points[:, 0].max()
    places = np.linspace(low, high, count)
    places[[0, -1]] += (high - low) / (count - 1) * np.array([1e-3, -1e-3])
    return Sections(*np.array([_cut(mesh, x) for x in places]).T)


def _cut(mesh: Mesh, x: float) -> tuple[float, float]:
    corners = mesh.points[mesh.cells[:, :4]]
    order = np.argsort(corners[..., 0], axis=1)
    corners = np.take_along_axis(corners, order[..., None], axis=1)
    below = (corners[..., 0] < x).sum(axis=1)
    triangles = [
        np.stack([_meet(corners[below == n], x, *edge) for edge in three], axis=1)
        for n, three in _TRIANGLES
    ]
    return _area_and_moment(np.concatenate(triangles))


#: How many corners lie below the plane; edges that a triangle of the section has its corners on.
_TRIANGLES = (
    (1, ((0, 1), (0, 2), (0, 3))),
    (2, ((0, 2), (0, 3), (1, 3))),
    (2, ((0, 2), (1, 3), (1, 2))),
    (3, ((0, 3), (1, 3), (2, 3))),
)


def _meet(corners: Floats, x: float, a: int, b: int) -> Floats:
    """(y, z) where the edge from corner a to corner b meets the plane."""
    one, other = corners[:, a], corners[:, b]
    share = (x - one[:, :1]) / (other[:, :1] - one[:, :1])
    return np.asarray((one + share * (other - one))[:, 1:])


def _area_and_moment(t: Floats) -> tuple[float, float]:
    """Of triangles (k, 3, 2): mid-edge rule, exact for the y² of a second moment."""
    (ay, az), (by, bz) = (t[:, 1] - t[:, 0]).T, (t[:, 2] - t[:, 0]).T
    area = np.abs(ay * bz - az * by) / 2
    middle = (t[..., 0] + np.roll(t[..., 0], 1, axis=1)) / 2
    whole, first = area.sum(), (area * middle.mean(axis=1)).sum()
    return float(whole), float((area * (middle**2).mean(axis=1)).sum() - first**2 / whole)
