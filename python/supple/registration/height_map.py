"""A scan seen from one side: the height of the foremost skin over a grid of pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

#: Skin that lies this much deeper, or further in front, than most of the near side is not of it, m.
_DEPTH = 0.12
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
    near = _near_side(up, high)
    across, up, high = across[near], up[near], high[near]
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
    return _despeckled(HeightMap(total / np.maximum(count, 1), count > 0, low, pixel))


def _near_side(up: Floats, high: Floats) -> Mask:
    """Which points are neither the far side, seen through a hole, nor something far in front.

    The near side is told by the upper third of the heights of all that is within 80 mm up or down.
    """
    level = ((up - up.min()) / 0.02).astype(np.int64)
    bins = np.linspace(high.min(), high.max(), 100)
    step = np.minimum(((high - bins[0]) / (bins[1] - bins[0])).astype(np.int64), 99)
    count = np.bincount(level * 100 + step, minlength=(int(level.max()) + 1) * 100)
    total = np.cumsum(count.reshape(-1, 100), axis=0)
    reach = 4
    low = np.maximum(np.arange(len(total)) - reach - 1, -1)
    top = np.minimum(np.arange(len(total)) + reach, len(total) - 1)
    around = total[top] - np.where(low[:, None] >= 0, total[np.maximum(low, 0)], 0)
    share = np.cumsum(around, axis=1) / np.maximum(around.sum(axis=1, keepdims=True), 1)
    front = bins[np.argmax(share > 0.75, axis=1)][level]
    return np.asarray((high > front - _DEPTH) & (high < front + _DEPTH))


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
