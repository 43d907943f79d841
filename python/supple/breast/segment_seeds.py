"""What a hand adds: points that are known to lie in a tissue."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from supple.breast.tissues import Tissue
from supple.errors import InputError

if TYPE_CHECKING:
    from supple.breast.grid import PatientGrid, Points
    from supple.breast.segment_thorax import Thorax

Seeds = Mapping[Tissue, Sequence[Sequence[float]]]
SeedIndex = tuple[int, int, int]

#: The wall passes a seed at this distance, mm, and is bound around it by a cone of 45 degrees.
_PASS = 3.0


def index_seeds(grid: PatientGrid, seeds: Seeds) -> dict[Tissue, list[SeedIndex]]:
    """Indices z, y, x of the nodes at `seeds` (mm).

    Raises:
        InputError: an unknown tissue, not three numbers, or a point outside of the image.
    """
    found: dict[Tissue, list[SeedIndex]] = {}
    for code, points in seeds.items():
        if code not in (Tissue.AIR, Tissue.FAT, Tissue.GLAND, Tissue.CHEST):
            raise InputError(
                f"seeds must be in air (0), fat (1), gland (2) or chest (3), got {code!r}: use"
                " these tissues."
            )
        found[Tissue(code)] = [_index(grid, point, Tissue(code)) for point in points]
    return found


def wall_limits(
    thorax: Thorax, seeds: Mapping[Tissue, Sequence[SeedIndex]]
) -> tuple[Points, Points]:
    """Least and greatest radius (levels, azimuths) mm of the chest wall that seeds allow."""
    shape = (thorax.grid.shape[0], len(thorax.azimuth))
    lowest, highest = np.full(shape, -np.inf), np.full(shape, np.inf)
    for seed in seeds.get(Tissue.CHEST, ()):
        radius, cone = _cone(thorax, seed)
        lowest = np.maximum(lowest, radius + _PASS - cone)
    for tissue in (Tissue.FAT, Tissue.GLAND):
        for seed in seeds.get(tissue, ()):
            radius, cone = _cone(thorax, seed)
            highest = np.minimum(highest, np.maximum(radius - _PASS, thorax.radius[0]) + cone)
    return np.minimum(lowest, highest), highest


def _cone(thorax: Thorax, seed: SeedIndex) -> tuple[float, Points]:
    """Radius of a seed, and the distance of each column from it along the wall, mm."""
    point = np.asarray(seed[::-1]) * thorax.grid.spacing + thorax.grid.origin
    level, azimuth, radius = (float(c[0]) for c in thorax.cylindrical(point[None]))
    along = (np.arange(thorax.grid.shape[0]) - level) * thorax.grid.spacing
    return radius, np.hypot(along[:, None], radius * (thorax.azimuth - azimuth)[None, :])


def _index(grid: PatientGrid, point: Sequence[float], tissue: Tissue) -> SeedIndex:
    place = np.asarray(point, float)
    low, high = grid.corners().min(axis=0), grid.corners().max(axis=0)
    if place.shape != (3,) or not np.all((place >= low) & (place <= high)):
        span = ", ".join(f"{a:.0f} to {b:.0f}" for a, b in zip(low, high, strict=True))
        raise InputError(
            f"seeds in {tissue.name.lower()} must be three LPS coordinates in mm inside the image"
            f" ({span}), got {list(point)}: correct this point."
        )
    k, j, i = (int(n[0]) for n in grid.nodes_at(place[None]))
    return k, j, i
