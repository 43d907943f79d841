"""Which skin stays where it is between two poses: the strip between the bulges and above them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import InputError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BULGE = 6e-3  #: skin this far (m) in front of the smooth chest is bulge
GROWTH = 12e-3  #: and so is what lies this close (m) to it
HALF_WIDTH = 0.12  #: still skin ends this far (m) from the midline: flanks slump
BELOW = 20e-3  #: and this far (m) below the lowest bulge: the belly moves


@dataclass(frozen=True)
class Body:
    """The skin to align with, ready for queries."""

    points: Array  #: (v, 3) m, LPS
    normals: Array  #: (v, 3) unit, outward
    front: Mask  #: (v,) skin that faces the front or a side
    spacing: float  #: mean edge length, m
    tree: Any  #: k-d tree of ``points``

    @classmethod
    def build(cls, points: Array, triangles: ArrayLike) -> Body:
        """Vertex normals weighted by area, turned outward; zero at a vertex of no triangle."""
        from scipy.spatial import cKDTree

        tri = np.asarray(triangles)
        if tri.ndim != 2 or tri.shape[1] != 3 or not len(tri) or tri.min() < 0:
            raise InputError(f"target_triangles must be (t, 3) rows of points, got {tri.shape}.")
        if tri.max() >= len(points):
            raise InputError(
                f"target_triangles must name one of {len(points)} points, got {tri.max()}."
            )
        a, b, c = points[tri[:, 0]], points[tri[:, 1]], points[tri[:, 2]]
        area = np.cross(b - a, c - a)
        outward = np.einsum("td,td->", (a + b + c) / 3 - points[tri].mean(axis=(0, 1)), area)
        size = np.linalg.norm(area, axis=1).sum() * np.linalg.norm(np.ptp(points, axis=0))
        if abs(outward) < 0.02 * size:  # a flat sheet has no inside: let it face the front
            outward = -area[:, 1].sum()
        normals = np.zeros_like(points)
        for corner in tri.T:
            np.add.at(normals, corner, area if outward >= 0 else -area)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(length > 0, length, 1.0)
        spacing = float(np.linalg.norm(b - a, axis=1).mean())
        return cls(points, normals, normals[:, 1] < 0.2, spacing, cKDTree(points))


@dataclass(frozen=True)
class Chest:
    """The smooth chest under the bulges: height -y = a polynomial in x and z."""

    origin: Array  #: (3,) m
    coefficients: Array  #: of ``_basis``

    @classmethod
    def fit(cls, points: Array, rounds: int = 40) -> Chest:
        """Fit the lower envelope of front points (n, 3) m.

        What lies in front of it loses weight, what lies behind keeps it.
        """
        origin = np.median(points, axis=0)
        basis, height = _basis(points - origin), -points[:, 1]
        weight = np.ones(len(points))
        fit: Array = np.zeros(basis.shape[1])
        for _ in range(rounds):
            root = np.sqrt(weight)
            fit = np.asarray(
                np.linalg.lstsq(basis * root[:, None], height * root, rcond=None)[0],
                dtype=np.float64,
            )
            weight = 1.0 / (1.0 + (np.maximum(height - basis @ fit, 0.0) / 3e-3) ** 2)
        return cls(origin, fit)

    def above(self, points: Array) -> Array:
        """How far (n,) m the points (n, 3) m stand in front of the chest."""
        return np.asarray(-points[:, 1] - _basis(points - self.origin) @ self.coefficients)

    def bulges(self, points: Array, of: Array | None = None) -> Mask:
        """(n,) mask of the points at or beside a bulge of the sheet ``of`` (themselves if None)."""
        from scipy.spatial import cKDTree

        sheet = points if of is None else of
        bulge = sheet[self.above(sheet) > BULGE]
        if not len(bulge):
            return np.zeros(len(points), dtype=bool)
        flat = cKDTree(bulge[:, [0, 2]])  # seen from the front: the side of a bulge is steep
        near, _ = flat.query(points[:, [0, 2]], distance_upper_bound=GROWTH)
        return np.asarray(np.isfinite(near), dtype=bool)


def still_skin(body: Body) -> tuple[Mask, Chest | None]:
    """(v,) mask of the skin between and above the bulges, and the chest that they stand on.

    Front skin within 0.12 m of the midline, not on or beside a bulge, and not below the bulges.
    """
    facing = body.normals[:, 1] < -0.4
    if facing.sum() < 50:
        return facing, None
    front = body.points[facing]
    chest = Chest.fit(front)
    bulge = chest.bulges(front)
    still = facing.copy()
    still[facing] = ~bulge
    still &= np.abs(body.points[:, 0] - np.median(front[:, 0])) < HALF_WIDTH
    if bulge.any():
        still &= body.points[:, 2] > np.percentile(front[bulge, 2], 2) - BELOW
    return still, chest


def _basis(offset: Array) -> Array:
    x, z = offset[:, 0] / 0.1, offset[:, 2] / 0.1
    return np.stack([np.ones_like(x), x, x**2, x**4, z, z**2, x * z, z**3, x**2 * z], axis=1)
