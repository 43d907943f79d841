"""The body's closed, smooth surface: a level set, and nodes put onto it.

A label map has steps one voxel high. The signed distance to it, smoothed, has none, but lies
inside of it where the body bulges; its level is therefore shifted until it encloses the voxels'
volume again. The zero of that field is the surface.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage
from scipy.optimize import brentq

from supple.breast.facets import boundary_facets, enclosed_volume

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.grid import Field, PatientGrid, Points
    from supple.breast.region import BreastRegion

    Cells = NDArray[np.int32]

BAND = 20.0  # mm around the surface in which the field is a distance


def smooth_level(region: BreastRegion, smoothing_mm: float) -> Field:
    """(grid) smooth signed distance in mm; its zero encloses the volume of the region's voxels.

    Args:
        region: the body.
        smoothing_mm: standard deviation of the Gaussian, mm; 0 keeps the voxels' steps.
    """
    grid = region.grid
    level = region.level.clip(-BAND, BAND)
    if smoothing_mm > 0:
        level = ndimage.gaussian_filter(level, smoothing_mm / grid.spacing)
    near = level[np.abs(level) < BAND / 2]
    deep = float(np.count_nonzero(level <= -BAND / 2))
    wanted = region.volume_mm3 / grid.spacing**3

    def surplus(shift: float) -> float:
        """Nodes' cells inside, a cell on the surface counting by the share of it inside."""
        share = 0.5 + (shift - near) / grid.spacing
        return deep + float(share.clip(0.0, 1.0).sum()) - wanted

    shift = brentq(surplus, -BAND / 3, BAND / 3, xtol=1e-3)
    return np.asarray(level - shift, np.float32)


def fit_to_level(
    grid: PatientGrid, level: Field, points: Points, cells: Cells, volume_mm3: float
) -> Points:
    """`points` (n, 3) mm with the boundary nodes moved onto the zero of `level`.

    Flat facets cut the corners of a round body, so the nodes are moved on by the same small
    distance everywhere until the mesh holds `volume_mm3`. Where a move would spoil a cell's shape
    it is shortened, then left out.
    """
    facets = boundary_facets(cells)
    nodes = np.unique(facets)
    slopes = grid.gradient(level)
    offset = 0.0
    for _ in range(8):
        at = points[nodes]
        slope = np.stack([grid.sample(s, at) for s in slopes], axis=1)
        steep = np.maximum(np.einsum("ij,ij->i", slope, slope), 0.25)
        step = (offset - grid.sample(level, at))[:, None] * slope / steep[:, None]
        points = _move(points, cells, nodes, _limited(step, grid.spacing / 2))
        volume, area = enclosed_volume(points, facets)
        offset += float(np.clip((volume_mm3 - volume) / area, -0.2, 0.2))
    return points


def _limited(step: Points, longest: float) -> Points:
    length = np.linalg.norm(step, axis=1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, longest / np.maximum(length, 1e-12)))


def _move(
    points: Points, cells: Cells, nodes: NDArray[np.int32], step: Points, good: float = 0.3
) -> Points:
    """`points` with `nodes` moved, no cell's mean ratio falling under `good` or further below."""
    least = np.minimum(mean_ratios(points, cells), good)
    for share in (0.5, 0.5, 0.5, 0.0, 0.0, 0.0):
        moved = points.copy()
        moved[nodes] += step
        spoilt = mean_ratios(moved, cells) < least
        if not spoilt.any():
            return moved
        step[np.isin(nodes, cells[spoilt])] *= share
    return points


def mean_ratios(points: Points, cells: Cells) -> Points:
    """(c,) 12 (3V)^(2/3) / Σ l² of tetrahedra: 1 for a regular one, 0 for a flat or inverted one.

    Source: Liu & Joe (1994), BIT 34, 268–287.
    """
    ends = [points[cells[:, i]] - points[cells[:, j]] for i, j in combinations(range(4), 2)]
    squares = sum((np.einsum("ij,ij->i", e, e) for e in ends), np.zeros(len(cells)))
    return np.asarray(12.0 * np.cbrt(3.0 * signed_volumes(points, cells).clip(0.0)) ** 2 / squares)


def signed_volumes(points: Points, cells: Cells) -> Points:
    """(c,) volume of each tetrahedron; positive cells have outward faces as in `facets.FACES`."""
    a, b, c, d = (points[cells[:, i]] for i in range(4))
    return np.asarray(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0)
