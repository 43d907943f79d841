"""The deformed skin as dense samples, and the voxels of the body up to it and just beyond."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.breast.phantom_anatomy import Array
from supple.breast.phantom_mesh import Box, Index
from supple.breast.phantom_raster import Grid, paint


@dataclass(frozen=True)
class Skin:
    """Dense samples of a deformed skin.

    Attributes:
        points: (a, l, 3) m, on grid lines of azimuth and level.
        normals: (a, l, 3) unit, outward.
        zeta: (a, l, 3) material coordinates.
    """

    points: Array
    normals: Array
    zeta: Array


def sample_skin(box: Box, points: Array, each: int) -> Skin:
    """The skin of the mesh at ``points`` (n, 3) m, cells' faces cut into ``each`` x ``each``."""
    refined, nodes = box.refined(points, each)
    fine = nodes[refined.skin]
    normals = np.cross(np.gradient(fine, axis=0), np.gradient(fine, axis=1))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    zeta = np.stack(np.meshgrid(*refined.axes[:2], [1.0], indexing="ij"), axis=-1)[:, :, 0]
    return Skin(fine, normals, zeta)


@dataclass(frozen=True)
class Voxels:
    """The deformable body in an image grid: its voxels and those just outside its skin.

    Attributes:
        flat: (v,) flat voxel indices.
        zeta: (v, 3) material coordinates; those of the skin for voxels outside, a depth from -1
            to 0 in whatever layer backs the body.
        outside: (v,) signed distance, m, to the skin, positive in the air; only exact within
            ``reach`` of the skin, -reach further inside.
        extent: (v,) width, m, of a voxel across the skin.
    """

    flat: Index
    zeta: Array
    outside: Array
    extent: Array


def voxelise(grid: Grid, box: Box, points: Array, skin: Skin, reach: float = 2.5e-3) -> Voxels:
    """The body with nodes at ``points`` (n, 3) m on ``grid``, and the air within ``reach``."""
    fine, nodes = box.refined(points, 3)
    flat, zeta = paint(grid, nodes, fine.tetrahedra, fine.zeta)
    near, distance, extent, sample = _near_skin(grid, skin, reach)
    where = np.searchsorted(flat, near)
    known = (where < flat.size) & (flat[np.minimum(where, flat.size - 1)] == near)
    deep, width = np.full(flat.size, -reach), np.full(flat.size, float(grid.spacing.mean()))
    deep[where[known]], width[where[known]] = distance[known], extent[known]
    new = ~known
    return Voxels(
        np.concatenate([flat, near[new]]),
        np.concatenate([zeta, skin.zeta.reshape(-1, 3)[sample[new]]]),
        np.concatenate([deep, distance[new]]),
        np.concatenate([width, extent[new]]),
    )


def _near_skin(grid: Grid, skin: Skin, reach: float) -> tuple[Index, Array, Array, Index]:
    """Voxels within ``reach`` of the skin: index, signed distance, extent, nearest sample."""
    from scipy.spatial import cKDTree

    points, normals = skin.points.reshape(-1, 3), skin.normals.reshape(-1, 3)
    flat = _neighbourhood(grid, points, reach)
    centres = grid.centres(flat)
    _, sample = cKDTree(points).query(centres, workers=2)
    distance = np.einsum("ni,ni->n", centres - points[sample], normals[sample])
    aside = np.linalg.norm(centres - points[sample], axis=1)
    extent = np.abs(normals[sample]) @ grid.spacing
    keep = aside < reach
    return flat[keep], distance[keep], extent[keep], sample[keep]


def _neighbourhood(grid: Grid, points: Array, reach: float) -> Index:
    """Flat indices of the voxels in the little boxes, ``reach`` wide each way, around points."""
    from scipy.ndimage import binary_dilation

    limit = np.array(grid.shape[::-1])
    at = np.rint(grid.index(points)).astype(np.int64)
    at = at[((at >= 0) & (at < limit)).all(axis=1)]
    mask: NDArray[Any] = np.zeros(grid.shape, dtype=bool)
    mask[at[:, 2], at[:, 1], at[:, 0]] = True
    for axis, step in enumerate(grid.spacing[::-1]):
        width = 2 * int(np.ceil(reach / step)) + 1
        shape = [width if n == axis else 1 for n in range(3)]
        mask = binary_dilation(mask, np.ones(shape, dtype=bool))
    return np.flatnonzero(mask)
