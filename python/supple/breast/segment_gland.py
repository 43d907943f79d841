"""Gland and fat: seeded region growing in what is darker than the fat around it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import SimpleITK as sitk
from scipy import ndimage

from supple.breast.segment_body import otsu

if TYPE_CHECKING:
    from collections.abc import Iterable

    from supple.breast.grid import Field, Mask

#: Bounds of the threshold between gland and fat, ln of signal over fat's.
_LOWEST, _HIGHEST = -0.7, -0.2
#: Means of two tissues differ at least by this much (ln), and gland fills this share of the breast.
_APART, _LEAST_SHARE = 0.3, 0.003
#: What grows from seeds keeps parts of at least this volume, mm³.
_LEAST_PART = 150.0


def find_gland(
    relative: Field,
    breast: Mask,
    spacing: float,
    seeds: Iterable[tuple[int, int, int]] = (),
) -> Mask | None:
    """Gland in `breast` (skin left out); None where fat and gland cannot be told apart.

    Args:
        relative: (z, y, x) ln of signal over fat's; gland is the darker of the two.
        breast: where gland may lie.
        spacing: mm.
        seeds: indices z, y, x in gland, beside those that are found.
    """
    values = relative[breast].clip(-1.5, 0.3)
    if values.size == 0 or np.ptp(values) == 0:
        return None
    limit = float(np.clip(otsu(values), _LOWEST, _HIGHEST))
    dark = values < limit
    if dark.mean() < _LEAST_SHARE or values[~dark].mean() - values[dark].mean() < _APART:
        return None
    sure = breast & ndimage.binary_erosion(relative < limit - 0.1)
    return _tidy(grow(relative, breast, (-1e3, limit), [*np.argwhere(sure), *seeds]), spacing)


def grow_bright(
    relative: Field, breast: Mask, spacing: float, seeds: list[tuple[int, int, int]]
) -> Mask:
    """Gland by hand in a fat-suppressed image: grown from seeds through what is as bright."""
    around = [relative[tuple(slice(max(i - 1, 0), i + 2) for i in s)].mean() for s in seeds]
    limit = 0.5 * float(np.mean(around)) + 0.5 * float(np.median(relative[breast]))
    return _tidy(grow(relative, breast, (limit, 1e3), seeds), spacing)


def grow(
    values: Field,
    within: Mask,
    limits: tuple[float, float],
    seeds: Iterable[tuple[int, int, int]],
) -> Mask:
    """What is connected to a seed inside `within` and `limits`."""
    low, high = limits
    bounded = np.where(within, values, high + 1e3).astype(np.float32)
    points = [tuple(int(i) for i in seed)[::-1] for seed in seeds]
    image = sitk.GetImageFromArray(bounded)
    return np.asarray(
        sitk.GetArrayFromImage(sitk.ConnectedThreshold(image, points, low, high)), bool
    )


def _tidy(gland: Mask, spacing: float) -> Mask:
    """Close pinholes, drop specks."""
    closed = ndimage.binary_closing(np.pad(gland, 2))[2:-2, 2:-2, 2:-2]
    parts, count = ndimage.label(closed)
    sizes = np.bincount(parts.ravel(), minlength=count + 1) * spacing**3
    sizes[0] = 0.0
    return np.asarray((sizes >= _LEAST_PART)[parts])
