"""A scan seen from one side: the height of the foremost skin over a grid of pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

#: Skin this much deeper than the foremost of its rows is the far side, seen through a hole, m.
_DEPTH = 0.15
#: Points this close behind the foremost of a pixel are of the same skin, m.
_SKIN = 8e-3
#: A pixel that differs by more than this from its neighbours' median is a speckle, m.
_SPECKLE = 0.02


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights over a grid; row r, column c is the pixel with its middle at ``place(r, c)``.

    Attributes:
        height: (rows, columns) m towards the viewer; 0 where ``seen`` is not.
        seen: (rows, columns) bool.
        low: m, across and up, of the lower left corner.
        pixel: m.
    """

    height: Floats
    seen: Mask
    low: tuple[float, float]
    pixel: float

    def place(self, row: npt.ArrayLike, column: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Across and up, m, of pixels; numbers need not be whole."""
        return (np.asarray(self.low[0] + (np.asarray(column) + 0.5) * self.pixel),
                np.asarray(self.low[1] + (np.asarray(row) + 0.5) * self.pixel))  # fmt: skip

    def at(self, across: npt.ArrayLike, up: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Row and column, not rounded, of places in m."""
        return (np.asarray((np.asarray(up) - self.low[1]) / self.pixel - 0.5),
                np.asarray((np.asarray(across) - self.low[0]) / self.pixel - 0.5))  # fmt: skip

    def smooth(self, sigma: float) -> tuple[Floats, Floats]:
        """Heights by a Gaussian of ``sigma`` m over the pixels seen, and how much was seen, 0–1.

        Where little was seen the height is that of what is nearest; normalised convolution,
        Knutsson & Westin (1993).
        """
        from scipy.ndimage import gaussian_filter

        weight = gaussian_filter(self.seen.astype(float), sigma / self.pixel, mode="constant")
        value = gaussian_filter(self.height, sigma / self.pixel, mode="constant")
        return value / np.maximum(weight, 1e-6), weight


def seen_along(points: Floats, axes: Floats, pixel: float = 4e-3) -> HeightMap:
    """The map of ``points`` (n, 3) m seen along ``axes`` (3, 3): rows across, up, to the viewer."""
    across, up, high = axes @ points.T
    low = (float(across.min()) - 2 * pixel, float(up.min()) - 2 * pixel)
    column = ((across - low[0]) / pixel).astype(np.int64)
    row = ((up - low[1]) / pixel).astype(np.int64)
    columns, rows = int(column.max()) + 3, int(row.max()) + 3
    cell = row * columns + column
    front = np.full(rows * columns, -np.inf)
    np.maximum.at(front, cell, high)
    skin = high > front[cell] - _SKIN
    count = np.bincount(cell[skin], minlength=rows * columns).reshape(rows, columns)
    total = np.bincount(cell[skin], high[skin], rows * columns).reshape(rows, columns)
    height, seen = total / np.maximum(count, 1), count > 0
    seen &= _near_side(height, seen)
    height[~seen] = 0.0
    return _despeckled(HeightMap(height, seen, low, pixel))


def _near_side(height: Floats, seen: Mask) -> Mask:
    """Pixels that are not much deeper than what lies foremost in the rows around."""
    from scipy.ndimage import maximum_filter1d

    values = np.where(seen, height, np.nan)
    rows = np.flatnonzero(seen.sum(axis=1) > 5)
    top = np.full(len(height), -np.inf)
    for row in rows:
        own = values[row][seen[row]]
        top[row] = np.partition(own, int(0.95 * (len(own) - 1)))[int(0.95 * (len(own) - 1))]
    top = maximum_filter1d(top, 9)
    return np.asarray(np.where(seen, height, -np.inf) > top[:, None] - _DEPTH)


def _despeckled(found: HeightMap) -> HeightMap:
    """Without pixels that stand off from what is around them."""
    around, weight = found.smooth(3 * found.pixel)
    seen = found.seen & (np.abs(found.height - around) < _SPECKLE) & (weight > 0.05)
    return HeightMap(np.where(seen, found.height, 0.0), seen, found.low, found.pixel)


def curvatures(height: Floats, pixel: float) -> tuple[Floats, Floats]:
    """Mean and Gaussian curvature, 1/m and 1/m², of a smooth map; a dome has mean < 0.

    Source: do Carmo (1976), §3-3, a graph z = h(x, y).
    """
    hy, hx = np.gradient(height, pixel)
    hxy, hxx = np.gradient(hx, pixel)
    hyy = np.gradient(hy, pixel, axis=0)
    size = 1 + hx**2 + hy**2
    mean = ((1 + hx**2) * hyy - 2 * hx * hy * hxy + (1 + hy**2) * hxx) / (2 * size**1.5)
    return mean, (hxx * hyy - hxy**2) / size**2
