"""From a deformed mesh to voxels: which material point lies at each voxel's centre."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from supple.breast.phantom_anatomy import Array
from supple.breast.phantom_mesh import Index

#: Columns of voxels handled at once: bounds the memory.
_CHUNK = 400_000


@dataclass(frozen=True)
class Grid:
    """An axis-parallel image grid in LPS, metres; arrays on it are indexed [z, y, x].

    Attributes:
        origin: centre of the first voxel, xyz.
        spacing: voxel size, xyz.
        shape: numbers of voxels, zyx.
    """

    origin: Array
    spacing: Array
    shape: tuple[int, int, int]

    def index(self, points: Array) -> Array:
        """Continuous indices (..., 3) xyz of ``points`` (..., 3) m."""
        return np.asarray((points - self.origin) / self.spacing)

    def centres(self, flat: Index) -> Array:
        """Positions (n, 3) m of voxels given by flat index."""
        z, y, x = np.unravel_index(flat, self.shape)
        return np.asarray(self.origin + np.stack([x, y, z], axis=-1) * self.spacing)

    def along(self, axis: int) -> Array:
        """Coordinates, m, of the voxel centres along ``axis`` (0 = x, 1 = y, 2 = z)."""
        count = self.shape[2 - axis]
        return np.asarray(self.origin[axis] + np.arange(count) * self.spacing[axis])


def paint(grid: Grid, points: Array, tetrahedra: Index, values: Array) -> tuple[Index, Array]:
    """Voxels whose centres lie in the tetrahedra, with linearly interpolated nodal values.

    A row of voxels along x meets a tetrahedron in one interval, found from its four faces; so only
    voxels inside are ever touched.

    Args:
        grid: the image grid.
        points: (n, 3) node positions, m.
        tetrahedra: (t, 4) node ids.
        values: (n, c) what to interpolate.

    Returns:
        Sorted flat voxel indices (v,) and values (v, c); a voxel on a shared face appears once.
    """
    corners = grid.index(points)[tetrahedra]
    weight = _barycentric(corners)
    nodal = np.einsum("tmk,tmc->tkc", weight, values[tetrahedra])
    found = [
        _paint_rows(grid, weight[tets], nodal[tets], *_spread(count, size, low))
        for tets, count, size, low in _candidate_rows(grid, corners)
    ]
    flat, first = np.unique(np.concatenate([f for f, _ in found]), return_index=True)
    return flat, np.concatenate([v for _, v in found])[first]


def _candidate_rows(grid: Grid, corners: Array) -> Iterator[tuple[Index, Index, Index, Index]]:
    """Chunks of tetrahedra with the rectangle of rows that each may meet.

    Yields:
        ids (c,); numbers of rows (c,); sizes (c, 2) and first row (c, 2) of the rectangles, yz.
    """
    limit = np.array([grid.shape[1], grid.shape[0]]) - 1
    low = np.maximum(np.ceil(corners[..., 1:].min(axis=1) - 1e-9).astype(np.int64), 0)
    high = np.minimum(np.floor(corners[..., 1:].max(axis=1) + 1e-9).astype(np.int64), limit)
    size = np.maximum(high - low + 1, 0)
    count = size.prod(axis=1)
    total = np.cumsum(count)
    cuts = np.searchsorted(total, np.arange(_CHUNK, total[-1], _CHUNK))
    for part in np.split(np.arange(len(corners)), cuts):
        yield part, count[part], size[part], low[part]


def _spread(count: Index, size: Index, low: Index) -> tuple[Index, Index]:
    """Every row of every rectangle: owner (r,) and its y, z (r, 2)."""
    owner = np.repeat(np.arange(count.size), count)
    nth = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
    return owner, np.stack(np.divmod(nth, size[owner, 1]), axis=-1) + low[owner]


def _paint_rows(
    grid: Grid, weight: Array, nodal: Array, owner: Index, rows: Index
) -> tuple[Index, Array]:
    """Flat voxels (v,) and values (v, c) where ``rows`` (r, 2) run inside their tetrahedra."""
    base = weight[owner, :, 0] + weight[owner, :, 2] * rows[:, :1]
    base += weight[owner, :, 3] * rows[:, 1:]
    first, last = _interval(base, weight[owner, :, 1], grid.shape[2])
    met = np.flatnonzero(last >= first)
    first, count, owner, rows = first[met], (last - first + 1)[met], owner[met], rows[met]
    row = np.repeat(np.arange(met.size), count)
    x = np.arange(row.size) - np.repeat(np.cumsum(count) - count - first, count)
    start = nodal[owner, 0] + nodal[owner, 2] * rows[:, :1] + nodal[owner, 3] * rows[:, 1:]
    flat = (rows[row, 1] * grid.shape[1] + rows[row, 0]) * grid.shape[2] + x
    return flat, start[row] + nodal[owner, 1][row] * x[:, None]


def _barycentric(corners: Array) -> Array:
    """(u, 4, 4): barycentric coordinate m of a point p is w[m, 0] + w[m, 1:] . p."""
    ones = np.ones((*corners.shape[:2], 1))
    return np.asarray(np.swapaxes(np.linalg.inv(np.concatenate([ones, corners], axis=2)), 1, 2))


def _interval(base: Array, slope: Array, columns: int) -> tuple[Index, Index]:
    """First and last x at which base + slope x >= 0 for all four faces (empty: last < first)."""
    tiny = 1e-9
    steep = np.where(np.abs(slope) < tiny, tiny, slope)
    cut = (-base - tiny) / steep
    low = np.where(slope >= tiny, cut, -1.0).max(axis=1)
    high = np.where(slope <= -tiny, cut, float(columns)).min(axis=1)
    outside = ((np.abs(slope) < tiny) & (base < -tiny)).any(axis=1)
    first = np.maximum(np.ceil(low), 0).astype(np.int64)
    last = np.minimum(np.floor(high), columns - 1).astype(np.int64)
    return first, np.where(outside, first - 1, last)
