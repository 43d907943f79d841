"""How far a supine scan lies from the model's supine skin, where both show the same skin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from supple.errors import InputError
from supple.surface import Surface

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: A scan point farther than this from the first model skin shows something else, m.
REACH = 50e-3
#: The worst share of the distances is left out: hair, cloth, holes' ragged rims.
TRIM = 0.02
#: Fewer scan points than this on the model's skin say nothing about it.
LEAST = 100


@dataclass(frozen=True)
class SkinMisfit:
    """Scan points (s, 3) m that the model's skin ``triangles`` (t, 3) are held against."""

    scan: Floats
    triangles: Ints

    @classmethod
    def overlapping(cls, scan: Floats, points: Floats, triangles: Ints) -> SkinMisfit:
        """Only the points of an aligned ``scan`` whose nearest skin is not the skin's own rim.

        Args:
            scan: (s, 3) m, in the model's frame.
            points: (n, 3) m, nodes of the supine model, its parameters near the truth.
            triangles: (t, 3) its skin.

        Raises:
            InputError: the scan hardly overlaps the model's skin.
        """
        landed = _surface(points, triangles).closest(scan)
        rim = _at_rim(triangles)[np.asarray(landed.triangle)]
        keep = ~rim & (np.asarray(landed.distance) < REACH)
        if keep.sum() < LEAST:
            raise InputError(
                f"the scan must show the skin of the breasts, got {int(keep.sum())} of {len(scan)} "
                "points near it after alignment: scan the breasts, and the chest around them."
            )
        return cls(scan[keep], triangles)

    def signed(self, points: Floats) -> Floats:
        """Distance (s,) m of each scan point to the skin on ``points`` (n, 3), > 0 outside."""
        landed = _surface(points, self.triangles).closest(self.scan)
        outward = np.einsum("ij,ij->i", self.scan - landed.point, landed.normal) >= 0
        return np.where(outward, landed.distance, -np.asarray(landed.distance))


def mean_absolute(signed: Floats) -> float:
    """Mean of the absolute distances without the worst `TRIM` of them."""
    distance = np.sort(np.abs(signed))
    return float(distance[: max(1, round((1.0 - TRIM) * len(distance)))].mean())


def _surface(points: Floats, triangles: Ints) -> Surface:
    nodes, rows = np.unique(triangles, return_inverse=True)
    return Surface(points[nodes], rows.reshape(-1, 3))


def _at_rim(triangles: Ints) -> NDArray[np.bool_]:
    """(t,) whether a triangle has a node on the open rim of the surface."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]],
                                    triangles[:, [2, 0]]]), axis=1)  # fmt: skip
    edges, count = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(np.isin(triangles, edges[count == 1]).any(axis=1))
