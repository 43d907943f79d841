"""Tissues of a prone image, with no hand or with seeds.

    image ─► patient grid ─► body ─► thorax ─► signal over fat ─► chest wall ─► gland ─► labels

segment_body: threshold and growing of air · segment_thorax: midline and cylinder coordinates ·
segment_level: bias correction · segment_chest: the wall behind the breasts · segment_gland: region
growing · segment_nipple: landmarks · segment_seeds: what a hand adds. Mazier 2022, §5.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import SimpleITK as sitk
from scipy import ndimage

from supple.breast.segment_body import find_body, on_patient_grid
from supple.breast.segment_chest import LEAST_DEPTH, RADIUS, find_chest_wall
from supple.breast.segment_gland import find_gland, grow_bright
from supple.breast.segment_level import Level, relative_to_fat
from supple.breast.segment_nipple import Point, find_nipples
from supple.breast.segment_seeds import SeedIndex, Seeds, index_seeds, wall_limits
from supple.breast.segment_thorax import AXIS, Thorax, find_thorax
from supple.breast.tissues import Tissue

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.grid import Field, Mask

#: Spacing of the label image, mm.
SPACING = 2.0
#: Skin counts as fat to this depth; gland keeps this far from the wall, mm.
SKIN, FROM_WALL = 4.0, 6.0
#: Gland is looked for in front of the presternal skin, and this far behind it, mm.
BEHIND_SKIN = 5.0
#: Less of the wall than this makes a warning; less than the second figure is an estimate.
WELL_SEEN, SEEN = 0.5, 0.2


@dataclass(frozen=True)
class Segmentation:
    """What `segment` finds.

    Attributes:
        labels: uint8 image of `Tissue` codes on a grid along the patient's axes, LPS mm.
        tissues_told_apart: whether fat and gland are; otherwise all breast tissue is FAT.
        warnings: one sentence each.
        nipples_mm: estimated right and left nipple, x, y, z.
        chest_seen: share of the chest wall behind the breasts that the image shows, 0 to 1.
    """

    labels: sitk.Image
    tissues_told_apart: bool
    warnings: tuple[str, ...]
    nipples_mm: tuple[Point, Point]
    chest_seen: float


def segment(image: sitk.Image, seeds: Seeds | None = None) -> Segmentation:
    """Label air, fat, gland and what lies behind the chest wall.

    Args:
        image: 3-D, T1-weighted, prone, LPS mm with any direction cosines (`read_image`).
        seeds: points x, y, z mm known to be in a tissue. AIR removes what is connected and no
            brighter; CHEST, FAT and GLAND bound the chest wall; GLAND also grows.

    Raises:
        InputError: no body, no breast that hangs towards -y, or a seed outside of the image.
    """
    grid, signal = on_patient_grid(image, SPACING)
    points = index_seeds(grid, seeds or {})
    body, least = find_body(signal, points.get(Tissue.AIR, ()))
    thorax, warnings = find_thorax(grid, body)
    depth = _depth(signal, body, grid.spacing)
    level = relative_to_fat(signal, least, depth, *_front(body, thorax))
    wall = find_chest_wall(thorax, level, depth, *wall_limits(thorax, points))
    height = thorax.height(wall.radius)
    labels, beneath = _label(body, height, grid.spacing)
    where = (labels == Tissue.FAT) & (beneath > SKIN) & (height > FROM_WALL) & _ahead(thorax)
    gland = _gland(level, where, grid.spacing, points.get(Tissue.GLAND, []))
    if gland is not None:
        labels[gland] = Tissue.GLAND
    seen = wall.share_seen(thorax)
    warnings += _told(seen, gland is not None, level.fat_suppressed)
    nipples = find_nipples(grid, body, depth, level, thorax.middle)
    return Segmentation(grid.image(labels), gland is not None, warnings, nipples, seen)


def _depth(signal: Field, body: Mask, spacing: float) -> Field:
    """Depth beneath the skin, mm; -1 outside of the body where the scanner has filled in zeros."""
    air = signal[~body]
    blank = (signal <= 0) & ~body if air.size and np.median(air) > 0 else np.zeros_like(body)
    depth = ndimage.distance_transform_edt(body | blank, sampling=spacing).astype(np.float32)
    depth[blank] = -1.0
    return np.asarray(depth)


def _front(body: Mask, thorax: Thorax) -> tuple[Mask, Mask]:
    """The body in front of the thorax's middle; what hangs, away from the ends of the image."""
    grid = thorax.grid
    y = (grid.origin[1] + grid.spacing * np.arange(grid.shape[1]))[None, :, None]
    z = np.arange(grid.shape[0])[:, None, None]
    first, last = thorax.levels
    margin = grid.shape[0] // 12
    central = (z >= max(first, margin)) & (z <= min(last, grid.shape[0] - 1 - margin))
    return body & (y < thorax.axis[:, None, None] - 30.0), body & central & (y < thorax.skin - 10.0)


def _ahead(thorax: Thorax) -> Mask:
    """Where gland may be: not far behind the presternal skin, at the levels of the breasts."""
    grid = thorax.grid
    y = (grid.origin[1] + grid.spacing * np.arange(grid.shape[1]))[None, :, None]
    z = np.arange(grid.shape[0])[:, None, None]
    limit = (thorax.axis - AXIS + BEHIND_SKIN)[:, None, None]
    return np.asarray((y < limit) & (z >= thorax.levels[0]) & (z <= thorax.levels[1]))


def _label(body: Mask, height: Field, spacing: float) -> tuple[NDArray[np.uint8], Field]:
    """AIR, FAT and CHEST, and the depth beneath the skin, mm.

    What lies behind the wall and behind some part of the body is CHEST, dark lung and the image's
    noisy back included.
    """
    behind = np.maximum.accumulate(body, axis=1) & (height <= 0)
    depth = ndimage.distance_transform_edt(body | behind, sampling=spacing)
    labels = np.full(body.shape, Tissue.AIR, np.uint8)
    labels[body] = Tissue.FAT
    labels[behind & (depth > LEAST_DEPTH - spacing)] = Tissue.CHEST
    return labels, np.asarray(depth, np.float32)


def _gland(level: Level, where: Mask, spacing: float, seeds: list[SeedIndex]) -> Mask | None:
    """Gland, or None where it is not told apart from fat."""
    if not level.fat_suppressed:
        return find_gland(level.relative, where, spacing, seeds)
    return grow_bright(level.relative, where, spacing, seeds) if seeds else None


def _told(seen: float, told_apart: bool, suppressed: bool) -> tuple[str, ...]:
    """What the reader should know about the labels."""
    warnings = ["The nipples are estimated from the shape of the skin."]
    if not told_apart:
        why = "fat is suppressed in the image" if suppressed else "their signals are alike"
        warnings.append(f"Fat and gland are not told apart ({why}): breast tissue is one tissue.")
    if seen < SEEN:
        warnings.append(
            f"The chest wall shows in {seen:.0%} of its area only: it is taken from an elliptic"
            f" thorax {AXIS - RADIUS:.0f} mm behind the presternal skin."
        )
    elif seen < WELL_SEEN:
        warnings.append(
            f"The chest wall shows in {seen:.0%} of its area; it is interpolated in the rest."
        )
    return tuple(warnings)
