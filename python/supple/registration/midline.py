"""The plane of symmetry of a torso, as its front shows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from supple.registration.height_map import HeightMap, seen_along

Floats = npt.NDArray[np.float64]

#: Axes of a view from the front: across (+x, the left), up, towards the viewer (-y).
FRONT = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
#: m: symmetry shows in less detail than landmarks need.
_PIXEL, _POINTS = 7e-3, 20_000
#: A turn of less than this, rad, needs no further round.
_STRAIGHT = np.radians(1.5)
#: Tilts of the midline that are tried, degrees, and how far it may lie from the middle, m (sd).
_TILTS, _MIDDLE = np.arange(-24, 25, 2), 0.05


@dataclass(frozen=True, eq=False)
class Midline:
    """A frame in which the plane of symmetry is x = 0.

    Attributes:
        R, t: carry points, as `propose` sees them, into it.
        likeness: correlation of the front with its mirror image, -1 to 1.
    """

    R: Floats
    t: Floats
    likeness: float


def square_up(points: Floats) -> Midline:
    """Turn ``points`` (n, 3) m, about LPS, until the front is symmetric: tilt, yaw and shift."""
    R, t = np.eye(3), np.zeros(3)
    likeness = 0.0
    points = points[:: max(1, len(points) // _POINTS)]
    tilts, yaw, tilt = _TILTS, 1.0, 1.0
    for _ in range(3):
        if max(abs(yaw), abs(tilt)) < _STRAIGHT:
            break
        view = seen_along(points @ R.T + t, FRONT, _PIXEL)
        tilt, shift, likeness = _axis(view, tilts)
        turn = _about_y(tilt)
        R, t = turn @ R, turn @ t - np.array([shift, 0, 0])
        yaw, depth = _yaw(seen_along(points @ R.T + t, FRONT, _PIXEL))
        turn = _about_z(yaw)
        R, t = turn @ R, turn @ (t - [0, depth, 0]) + [0, depth, 0]
        tilts = _TILTS[np.abs(_TILTS) <= 8]
    return Midline(R, t, likeness)


def _axis(view: HeightMap, tilts: npt.NDArray[np.int64]) -> tuple[float, float, float]:
    """Tilt (rad), place after it (m) of the line that mirrors the map best, and the likeness.

    Each row is convolved with itself: the peak is at twice the place of its mirror.
    """
    small, weight = view.smooth(10e-3)
    large, _ = view.smooth(45e-3)
    detail = np.where(weight > 0.5, np.clip(small - large, -0.015, 0.015), 0.0)
    columns = detail.shape[1]
    size = 1 << int(np.ceil(np.log2(2 * columns)))
    both = np.fft.rfft(detail, size)
    match = np.fft.irfft(both * both, size)  # column s: pixels c and s - c
    power = float((detail**2).sum())
    rows = np.arange(len(detail))
    _, up = view.place(rows, 0)
    middle = _middle(view)
    place = view.low[0] + (np.arange(2 * columns) / 2 + 0.5) * view.pixel
    sums = np.flatnonzero(np.abs(place - middle) < 3 * _MIDDLE)
    across = place[sums]
    best = (-np.inf, 0.0, 0.0)
    for degrees in tilts:
        slope = np.tan(np.radians(degrees))
        lean = 2 * slope * (up - up.mean()) / view.pixel
        at = sums[None, :] + lean[:, None]
        whole = np.floor(at).astype(np.int64)
        inside = (whole >= 0) & (whole < size)
        score = np.where(inside, match[rows[:, None], np.clip(whole, 0, size - 1)], 0.0).sum(axis=0)
        score /= power + 1e-12
        ranked = score - 0.5 * ((across - middle) / (3 * _MIDDLE)) ** 2 - (degrees / 60) ** 2
        k = int(np.argmax(ranked))
        if ranked[k] > best[0]:
            best = (float(ranked[k]), float(np.arctan(slope)), float(across[k]))
            likeness = float(score[k])
    tilt = best[1]
    foot = np.array([best[2], 0.0, float(up.mean())])
    return -tilt, float((_about_y(-tilt) @ foot)[0]), likeness


def _middle(view: HeightMap) -> float:
    """Across, m, of the middle of what is seen, each row counting alike."""
    across, _ = view.place(0, np.arange(view.seen.shape[1]))
    count = view.seen.sum(axis=1)
    rows = count > 10
    return float(np.median((view.seen[rows] @ across) / count[rows]))


def _yaw(view: HeightMap) -> tuple[float, float]:
    """Turn about z (rad) that makes both sides equally deep, and the depth (y) it turns about."""
    small, weight = view.smooth(10e-3)
    _, middle = view.at(0.0, 0.0)
    steps = np.arange(int(0.03 / view.pixel), int(0.12 / view.pixel))
    left = np.rint(middle + steps).astype(np.int64)
    right = np.rint(middle - steps).astype(np.int64)
    good = (left < small.shape[1]) & (right >= 0)
    left, right, steps = left[good], right[good], steps[good]
    if not len(steps):
        return 0.0, 0.0
    both = (weight[:, left] > 0.5) & (weight[:, right] > 0.5)
    if both.sum() < 50:
        return 0.0, 0.0
    slope = (small[:, left] - small[:, right]) / (2 * view.pixel * steps)
    depth = -float(np.median(small[:, left][both])) + 0.1
    return float(np.clip(np.arctan(np.median(slope[both])), -0.5, 0.5)), depth


def _about_y(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _about_z(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
