"""Coordinates around the thorax: in them the chest wall is nearly flat and the breasts point up.

A point is (level, azimuth, radius): x = middle + ASPECT radius sin(azimuth) and
y = axis(level) - radius cos(azimuth), an elliptic cylinder whose axis follows the slope of the
sternum. The axis lies AXIS mm behind the skin between the breasts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage, stats

from supple.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.grid import Field, Mask, PatientGrid, Points

#: Width of an adult thorax over its depth; depth of its axis behind the presternal skin, mm.
ASPECT, AXIS = 1.35, 90.0
#: A breast hangs at least this far in front of the skin between the breasts, mm.
LEAST_HANG = 20.0


@dataclass(frozen=True)
class Thorax:
    """The cylinder, and the samples of azimuth and radius that images are unrolled on.

    Attributes:
        middle: x of the midline, mm.
        axis: (levels,) y of the axis at each level z of the grid, mm.
        skin: y of the skin between the breasts, median over the levels of the breasts, mm.
        tips: x of the right and the left breast's tip, mm.
        levels: first and last level index at which a breast hangs.
    """

    grid: PatientGrid
    middle: float
    axis: Points
    skin: float
    tips: tuple[float, float]
    levels: tuple[int, int]

    @property
    def azimuth(self) -> Points:
        """Sampled azimuths, rad."""
        return np.linspace(-100.0, 100.0, 101) * (np.pi / 180.0)

    @property
    def radius(self) -> Points:
        """Sampled radii, mm."""
        return np.arange(45.0, 130.0)

    def unroll(self, field: NDArray[Any], outside: float) -> Field:
        """`field` (z, y, x) at (levels, azimuths, radii); `outside` beyond the grid."""
        h, (x0, y0, _) = self.grid.spacing, self.grid.origin
        sine, cosine = np.sin(self.azimuth)[:, None], np.cos(self.azimuth)[:, None]
        column = (self.middle + ASPECT * self.radius * sine - x0) / h
        rows = ((y - self.radius * cosine - y0) / h for y in self.axis)
        slices = [
            ndimage.map_coordinates(part, [row, column], order=1, cval=outside, output=np.float32)
            for part, row in zip(field, rows, strict=True)
        ]
        return np.stack(slices)

    def cylindrical(self, points: Points) -> tuple[Points, Points, Points]:
        """Level index, azimuth in rad and radius in mm of `points` (n, 3) mm."""
        level = (points[:, 2] - self.grid.origin[2]) / self.grid.spacing
        axis = np.interp(level, np.arange(len(self.axis)), self.axis)
        across, ahead = (points[:, 0] - self.middle) / ASPECT, axis - points[:, 1]
        return level, np.arctan2(across, ahead), np.hypot(across, ahead)

    def height(self, wall: Points) -> Field:
        """Radius less that of `wall` (levels, azimuths), mm, at each node; wall's ends go on."""
        nz, ny, nx = self.grid.shape
        h, (x0, y0, _) = self.grid.spacing, self.grid.origin
        across = ((x0 + h * np.arange(nx) - self.middle) / ASPECT)[None, :]
        rows, heights = y0 + h * np.arange(ny), np.empty((nz, ny, nx), np.float32)
        for level in range(nz):
            ahead = (self.axis[level] - rows)[:, None]
            azimuth = np.arctan2(across, ahead)
            at = np.interp(azimuth.ravel(), self.azimuth, wall[level]).reshape(azimuth.shape)
            heights[level] = np.hypot(across, ahead) - at
        return heights


def find_thorax(grid: PatientGrid, body: Mask) -> tuple[Thorax, tuple[str, ...]]:
    """The cylinder of a prone body from its front skin, and warnings.

    Raises:
        InputError: no breast hangs towards -y.
    """
    h = grid.spacing
    skin = np.where(body.any(axis=1), body.argmax(axis=1), grid.shape[1]) * h
    front = ndimage.gaussian_filter1d(np.percentile(skin, 5, axis=0), 8.0 / h)
    right, left, middle, warnings = _landmarks(front, body, h)
    at = round(middle)
    line = np.median(skin[:, max(at - 3, 0) : at + 4], axis=1)
    level = np.arange(len(line))
    near = line < line.min() + 70.0
    slope, start, *_ = stats.theilslopes(line[near], level[near])
    slope = float(np.clip(slope, -0.7 * h, 0.7 * h))
    start = float(np.median(line[near] - slope * level[near]))
    axis = slope * level + start + AXIS
    hang = (axis - AXIS - skin.min(axis=1)) > LEAST_HANG
    levels = np.flatnonzero(hang)
    x0, y0, _ = grid.origin
    thorax = Thorax(
        grid, x0 + middle * h, axis + y0, float(np.median(line[near])) + y0,
        (x0 + right * h, x0 + left * h), (int(levels[0]), int(levels[-1])),
    )  # fmt: skip
    return thorax, warnings


def _landmarks(front: Points, body: Mask, h: float) -> tuple[int, int, float, tuple[str, ...]]:
    """Columns of the right and left tip and of the midline, from the frontmost skin per column."""
    edge = np.pad(front, 2, constant_values=np.inf)
    lowest = np.min(np.lib.stride_tricks.sliding_window_view(edge, 5), axis=1)
    tips = np.flatnonzero(front == lowest)
    pairs = [(i, j) for i in tips for j in tips if (j - i) * h > 60.0]
    rises = [float(front[i:j].max() - max(front[i], front[j])) for i, j in pairs]
    if pairs and max(rises) > LEAST_HANG:
        i, j = pairs[int(np.argmax(rises))]
        valley = front[i:j]
        return int(i), int(j), float(i + np.flatnonzero(valley > valley.max() - 8.0).mean()), ()
    return _one_breast(front, body, h)


def _one_breast(front: Points, body: Mask, h: float) -> tuple[int, int, float, tuple[str, ...]]:
    """The same where one side hangs: the midline is then the middle of the body."""
    columns = np.flatnonzero(body.any(axis=(0, 1)))
    tip, middle = int(front.argmin()), float(columns.mean())
    hang = float(front[round(middle)] - front[tip])
    if hang < LEAST_HANG or abs(tip - middle) * h < 25.0:
        raise InputError(
            f"image must show breasts that hang at least {LEAST_HANG:.0f} mm towards anterior (-y"
            f" in LPS), got {max(hang, 0.0):.0f} mm: check that the patient lies prone and that the"
            " header's orientation is right."
        )
    other = round(2 * middle - tip)
    right, left = sorted((tip, int(np.clip(other, 0, len(front) - 1))))
    return right, left, middle, ("Only one breast hangs: the midline is the body's middle.",)
