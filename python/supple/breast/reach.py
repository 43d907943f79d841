"""How far the finite-element body reaches around the breasts.

The *base plane* runs along the front of the chest wall between the breasts and tilts with it. What
stands out of it by a share of the most prominent point on its side is the breast proper. A point's
*foot* is the nearest point of the chest wall. Within reach is what has its foot near the feet of
the breasts proper, and lies not far behind the base plane. Arms, axillae, and the fat around the
torso and on the abdomen stand out less than that: the cuts follow the breasts themselves, stand
upright on the chest wall and need no landmark.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import SimpleITK as sitk
from scipy import ndimage, stats

from supple.breast.grid import FAR, PatientGrid, corners
from supple.breast.tissues import BREAST, Tissue
from supple.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from supple.breast.grid import Field, Mask


@dataclass(frozen=True)
class RegionSettings:
    """Lengths in mm, shares of the greatest prominence in front of the base plane.

    Attributes:
        coarse, fine: spacings of the grids that find the breasts and that hold the body.
        sternum: width of the strip of chest wall that carries the base plane.
        core_share: what is more prominent than this share of its side's top is breast proper.
        least_share: a side less prominent than this share of the other one carries no breast.
        least_top: tissue less prominent than this holds no breast at all.
        reach_share, reach: how far the body goes on beyond the breasts' feet, and its bounds.
        between: a gap narrower than this between the reaches of the two breasts is closed.
        behind: the body ends this far behind the base plane.
        sheet: fat thinner than this is left out.
        crevice: gaps of air and tongues of chest wall narrower than this are filled.
        bridge: holes and notches narrower than this in what is left of a sheet are kept.
        least_part: a part smaller than this share of the largest one is an island, and dropped.
    """

    coarse: float = 3.0
    fine: float = 1.5
    sternum: float = 60.0
    core_share: float = 0.4
    least_share: float = 0.4
    least_top: float = 15.0
    reach_share: float = 0.45
    reach: tuple[float, float] = (60.0, 60.0)
    between: float = 60.0
    behind: float = 60.0
    sheet: float = 3.0
    crevice: float = 8.0
    bridge: float = 16.0
    least_part: float = 0.05


def reach(
    labels: sitk.Image, s: RegionSettings, tumour_mm: Sequence[float] | None
) -> tuple[PatientGrid, Field, Mask, tuple[str, ...]]:
    """Coarse grid, how far beyond reach its nodes lie (mm, < 0 within), tissue within, notes.

    Raises:
        InputError: nothing stands out far enough to be a breast.
    """
    grid = PatientGrid.around(*corners(labels), s.coarse)
    codes = grid.resample(labels, sitk.sitkNearestNeighbor, Tissue.AIR)
    tissue, chest = np.isin(codes, BREAST), codes == Tissue.CHEST
    prominence = _prominence(grid, chest, s.sternum)
    foot = ndimage.distance_transform_edt(~chest, return_distances=False, return_indices=True)
    beyond = np.full(grid.shape, FAR, np.float32)
    breasts, notes = _breasts_proper(grid, np.where(tissue, prominence, -FAR), chest, s)
    for core, top in breasts:
        length = float(np.clip(s.reach_share * top, *s.reach))
        beyond = np.minimum(beyond, _from_feet(grid, foot, core) - length)
    between = grid.signed_distance(grid.closing(beyond < 0, s.between / 2))
    beyond = np.maximum(np.minimum(beyond, between), -prominence - s.behind)
    if tumour_mm is not None:
        at_tumour = np.zeros(grid.shape, bool)
        at_tumour[grid.nodes_at([tumour_mm])] = True
        beyond = np.minimum(beyond, _from_feet(grid, foot, at_tumour & tissue) - s.reach[0])
    beyond = ndimage.gaussian_filter(beyond.clip(-30.0, 30.0), 1.0)
    return grid, beyond, tissue & (beyond < 0), notes


def _prominence(grid: PatientGrid, chest: Mask, width: float) -> Field:
    """Distance of each node in front of the base plane, mm; negative behind it.

    The plane is a line in the sagittal plane: the median of the slopes between the chest wall's
    front points in a strip along the middle (Theil–Sen), so that notches in it count little.
    """
    x, y, z = grid.axes()
    middle = float(np.median(grid.points(chest)[:, 0]))
    strip = chest[:, :, np.abs(x - middle) <= max(width / 2, grid.spacing)]
    rows, columns = np.nonzero(strip.any(axis=1))
    if not len(rows):
        rows, columns = np.nonzero((strip := chest).any(axis=1))
    front = y[strip.argmax(axis=1)[rows, columns]]
    levels = np.unique(rows)
    middles = np.array([np.median(front[rows == row]) for row in levels])
    slope, base = 0.0, float(np.median(middles))
    if len(levels) > 2:
        slope, base = stats.theilslopes(middles, z[levels])[:2]
    plane = base + slope * z[:, None, None] - y[None, :, None]
    ahead = plane / np.hypot(1.0, slope)
    return np.broadcast_to(ahead, grid.shape).astype(np.float32)


def _breasts_proper(
    grid: PatientGrid, prominence: NDArray[Any], chest: Mask, s: RegionSettings
) -> tuple[list[tuple[Mask, float]], tuple[str, ...]]:
    """For each side that carries a breast: the breast proper, its top in mm; and notes."""
    x = grid.axes()[0]
    middle = float(np.median(grid.points(chest)[:, 0]))
    sides = [np.broadcast_to(side, grid.shape) for side in (x <= middle, x > middle)]
    tops = [float(prominence[side].max(initial=0.0)) for side in sides]
    if max(tops) < s.least_top:
        raise InputError(
            f"labels must hold a breast, got tissue that stands no more than {max(tops):.0f} mm in"
            f" front of the chest wall where at least {s.least_top:.0f} mm is expected: check the"
            " segmentation, that its lengths are in mm and that the patient lies prone."
        )
    carry = [top >= s.least_share * max(tops) for top in tops]
    breasts = [
        (side & (prominence > s.core_share * top), top)
        for side, top, breast in zip(sides, tops, carry, strict=True)
        if breast
    ]
    missing = tuple(
        f"The {name} side carries no breast: it stands out by only {top:.0f} mm."
        for name, top, breast in zip(("right", "left"), tops, carry, strict=True)
        if not breast
    )
    return breasts, missing


def _from_feet(grid: PatientGrid, foot: NDArray[Any], nodes: Mask) -> Field:
    """Distance of each node's foot to the nearest foot of `nodes`, mm."""
    feet = np.zeros(grid.shape, bool)
    feet[tuple(foot[:, nodes])] = True
    return np.asarray(grid.distance(feet)[tuple(foot)], np.float32)
