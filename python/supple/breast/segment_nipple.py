"""Where the nipples are: the sharpest bump of the skin near each breast's foremost point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from supple.breast.segment_body import smooth

if TYPE_CHECKING:
    from supple.breast.grid import Field, Mask, PatientGrid
    from supple.breast.segment_level import Level

#: A nipple lies within this distance of the foremost point, mm.
REACH = 35.0
#: Skin that bends around a bump leaves a ball of about this radius emptier, mm.
_BALL = 6.0
#: What one unit of ln(signal) beneath the skin counts, against the share of the ball.
_AREOLA = 0.1

Point = tuple[float, float, float]


def find_nipples(
    grid: PatientGrid, body: Mask, depth: Field, level: Level, middle: float
) -> tuple[Point, Point]:
    """The right and the left nipple, x, y, z mm, on the skin.

    The share of a ball around a skin point that lies inside the body tells its curvature (half on
    a plane, less on a bump). Beneath the areola there is no fat but tissue that is darker, or in a
    fat-suppressed image brighter. Height and nearness to the foremost point decide the rest.

    Args:
        grid: of the arrays (z, y, x).
        body: what is not air.
        depth: mm beneath the skin.
        level: signal relative to fat.
        middle: x of the midline, mm.
    """
    filled = ndimage.gaussian_filter(body.astype(np.float32), _BALL / grid.spacing)
    other = level.relative if level.fat_suppressed else -level.relative
    areola = smooth(other, body & (depth > 2) & (depth < 9), 2.0)
    rank = filled - _AREOLA * areola.clip(-0.8, 0.8)
    skin = body & ~ndimage.binary_erosion(body, border_value=1)
    x = grid.origin[0] + grid.spacing * np.arange(grid.shape[2])
    right, left = (_nipple(grid, skin & side, rank) for side in (x < middle, x >= middle))
    return right, left


def _nipple(grid: PatientGrid, skin: Mask, rank: Field) -> Point:
    points, value = grid.points(skin), rank[skin]
    tip = points[points[:, 1].argmin()]
    distance = np.linalg.norm(points - tip, axis=1)
    near = distance < REACH
    score = value[near] + (0.1 * (points[near, 1] - tip[1]) + 0.05 * distance[near]) / REACH
    best = points[near][score.argmin()]
    return float(best[0]), float(best[1]) - 0.5 * grid.spacing, float(best[2])
