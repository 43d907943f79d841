"""The chest wall: a smooth surface through the front of the pectoral muscles, ribs and sternum.

On the unrolled thorax the wall is one radius per level and azimuth. The signal's step from muscle
to fat is looked for with semi-global matching (Hirschmüller 2008, IEEE TPAMI 30(2): sums of
dynamic programmes along both axes, both ways), first near the ellipse of an ordinary thorax, then
near a smooth surface through what was seen clearly; that surface fills in where nothing is seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.grid import Field, Points
    from supple.breast.segment_level import Level
    from supple.breast.segment_thorax import Thorax

#: Radius of the first guess; reach inwards and outwards of it, then of what was seen, mm.
RADIUS, FIRST_REACH, SECOND_REACH = 78.0, (28.0, 40.0), (14.0, 20.0)
#: The wall lies at least this deep beneath the skin, mm.
LEAST_DEPTH = 5.0
#: Price of a change of radius by 1 mm from one sample to the next; at most MOST_STEP mm.
BEND, MOST_STEP = 0.04, 4
#: Half of the step that is looked for, mm; a step (ln) that counts as certain.
_ARM, _CERTAIN = 6, 0.5


@dataclass(frozen=True)
class ChestWall:
    """Radius (levels, azimuths) mm of the wall, and how surely it is seen there, 0 to 1."""

    radius: Points
    seen: Points

    def share_seen(self, thorax: Thorax) -> float:
        """Share of the wall behind the breasts that the image shows."""
        first, last = thorax.levels
        ahead = np.abs(thorax.azimuth) < np.radians(70)
        return float((self.seen[first : last + 1, ahead] > 0.4).mean())


def find_chest_wall(
    thorax: Thorax, level: Level, depth: Field, lowest: Points, highest: Points
) -> ChestWall:
    """The wall.

    Args:
        thorax: the cylinder.
        level: signal relative to fat.
        depth: mm beneath the skin, negative outside of the image.
        lowest: (levels, azimuths) mm that the radius does not fall below, from seeds.
        highest: the same from above.
    """
    beneath = thorax.unroll(depth, -1.0)
    step = _steps(thorax, level, beneath)
    forbidden = (beneath >= 0) & (beneath < LEAST_DEPTH)
    forbidden |= (thorax.radius < lowest[..., None]) | (thorax.radius > highest[..., None])
    radius, seen = _match(thorax, step, forbidden, np.full(step.shape[:2], RADIUS), FIRST_REACH)
    radius, seen = _match(thorax, step, forbidden, _through(radius, seen, 3.0), SECOND_REACH)
    return ChestWall(np.clip(_through(radius, seen, 1.5), lowest, highest), seen)


def _steps(thorax: Thorax, level: Level, beneath: Field) -> Field:
    """How much each sample (levels, azimuths, radii) looks like the wall: fat outside, a step."""
    relative = ndimage.gaussian_filter(thorax.unroll(level.relative, 0.0), (0.7, 0.7, 0.0))
    mean = ndimage.uniform_filter1d(relative, _ARM, axis=2)
    outside, inside = np.roll(mean, -_ARM // 2, axis=2), np.roll(mean, _ARM // 2, axis=2)
    if level.fat_suppressed:
        step = (inside - outside) * _no_lung(np.where(beneath > 8, outside, 0.0))
    else:
        step = outside - inside
    step = step * np.exp(-0.5 * (outside / 0.35) ** 2)
    valid = (beneath > LEAST_DEPTH - 1) & np.roll(beneath > 2, -_ARM // 2, axis=2)
    valid &= np.roll(beneath > LEAST_DEPTH, _ARM, axis=2)
    valid[..., :_ARM] = valid[..., -_ARM:] = False
    return np.where(valid, np.clip(step / _CERTAIN, -0.3, 1.0), 0.0).astype(np.float32)


def _no_lung(relative: Field) -> Field:
    """1 where nothing as dark as lung lies within 25 mm in front, else less: heart is no wall."""
    darkest = ndimage.minimum_filter1d(relative, 25, axis=2, origin=-12)
    return np.asarray(np.exp(-0.5 * ((darkest + 0.35).clip(max=0.0) / 0.15) ** 2))


def _match(
    thorax: Thorax,
    step: Field,
    forbidden: NDArray[np.bool_],
    near: Points,
    reach: tuple[float, float],
) -> tuple[Points, Points]:
    """Radius (levels, azimuths) of least cost, and the step seen there."""
    away = thorax.radius - near[..., None]
    away = away / np.where(away < 0, *reach)
    cost = np.where(forbidden, 3.0, away**2 - step).astype(np.float32)
    total = sum(_sweep(cost, axis, way) for axis in (0, 1) for way in (1, -1))
    best = np.asarray(total).argmin(axis=2)
    seen = np.take_along_axis(step, best[..., None], axis=2)[..., 0]
    return thorax.radius[best], np.clip(seen, 0.0, 1.0).astype(float)


def _sweep(cost: Field, axis: int, way: int) -> Field:
    """Least cost of a path along `axis` up to each sample and radius."""
    lines = np.moveaxis(cost, axis, 0)[::way]
    paths = np.empty_like(lines)
    paths[0] = lines[0]
    for n in range(1, len(lines)):
        before, best = paths[n - 1], paths[n - 1].copy()
        for k in range(1, MOST_STEP + 1):
            bent = before + np.float32(BEND * k * k)
            best[..., k:] = np.minimum(best[..., k:], bent[..., :-k])
            best[..., :-k] = np.minimum(best[..., :-k], bent[..., k:])
        paths[n] = lines[n] + best - before.min(axis=-1, keepdims=True)
    return np.moveaxis(paths[::way], 0, axis)


def _through(radius: Points, seen: Points, sigma: float) -> Points:
    """A smooth surface through the radii that are seen, deaf to what lies far off (5 rounds)."""
    weight = seen + 0.02
    for _ in range(5):
        mass = ndimage.gaussian_filter(weight, sigma, mode="nearest")
        surface = ndimage.gaussian_filter(weight * radius, sigma, mode="nearest") / mass
        weight = (seen + 0.02) * np.exp(-0.5 * ((radius - surface) / 10.0) ** 2) + 1e-6
    return np.asarray(surface)
