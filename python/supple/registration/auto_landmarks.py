"""Landmarks that the shape of a torso shows: nipples, sternal notch, xiphoid and axillae.

1. square up   turn the scan until its front is symmetric (midline.py)
2. nipples     tops of the mounds, seen along the way that breasts point; a left and a right
3. notch       where the steep of the upper chest ends in the corner of the neck, on the midline
4. xiphoid     on the midline, between what the notch and what the nipples say
5. axillae     the crease between chest and arm, near where notch and nipples put it

Each has a confidence; what is not found is not proposed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from supple.registration.height_map import HeightMap, curvatures, seen_along
from supple.registration.midline import FRONT, square_up
from supple.surface import Surface

Floats = npt.NDArray[np.float64]

#: More points than this are thinned: the maps' pixels hold several of them each.
_POINTS = 40_000
#: Breasts point this far outward, rad: on 110 averaged torsos 29°, on MakeHuman's body 26°.
_OUTWARD = np.radians(25.0)
#: m from the midline, between which nipples are sought, and their mean and sd.
_NIPPLE_AT, _NIPPLE_MEAN = (0.04, 0.19), (0.105, 0.03)
#: m around a peak over which its top is fitted.
_ROUND = 0.026
#: m that the nipples of a pair differ by, off the mirror (sd).
_PAIR = 0.02
#: m above the nipples, mean and sd over the shapes and poses of both templates; the sternum's
#: length to the xiphoid; and the axillae's distance from the midline.
_NOTCH_UP, _XIPHOID_UP, _AXILLA_UP = (0.160, 0.03), -0.034, (0.070, 0.015)
_STERNUM, _AXILLA_ASIDE = 0.19, (0.150, 0.015)
#: The notch lies at most this much deeper than the skin between the breasts, m.
_DEEPEST = 0.10
#: Share of the way from the chest's slope to the neck's that the slope has come at the notch.
_RECOVERED = 0.15


@dataclass(frozen=True, eq=False)
class Proposal:
    """A landmark that was found.

    Attributes:
        point: (3,) m, in the scan's frame.
        confidence: 0 to 1: how sure it is that the point is within 15 mm.
        found_by: what showed it, a phrase.
    """

    point: Floats
    confidence: float
    found_by: str


def propose(
    scan: Surface,
    frame: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    nipples_only: bool = False,
) -> dict[str, Proposal]:
    """Landmarks of the front of a torso, by name; those that do not show are missing.

    Args:
        scan: a surface or a cloud, m.
        frame: R (3, 3) and t (3,) that carry the scan roughly (20°) into LPS, upright; by default
            the scan is so already.
        nipples_only: the others are not looked for, which takes less time.
    """
    R0, t0 = (np.eye(3), np.zeros(3)) if frame is None else map(np.asarray, frame)
    points = scan.points[:: max(1, len(scan.points) // _POINTS)] @ R0.T + t0
    if len(points) < 500:
        return {}
    plane = square_up(points)
    R, t = plane.R @ R0, plane.R @ t0 + plane.t
    points = points @ plane.R.T + plane.t
    found = _found(points, plane.likeness, nipples_only)
    return {name: Proposal(R.T @ (p.point - t), p.confidence, p.found_by)
            for name, p in found.items()}  # fmt: skip


def _found(points: Floats, likeness: float, nipples_only: bool) -> dict[str, Proposal]:
    """Proposals in the frame whose plane of symmetry is x = 0."""
    sides = [_mounds(points, sign) for sign in (1.0, -1.0)]
    found = _nipples(sides[0], sides[1], likeness)
    if nipples_only or not found:
        return found
    front = seen_along(points, FRONT)
    level = float(np.mean([p.point[2] for p in found.values()]))
    sure = float(np.mean([p.confidence for p in found.values()]))
    line = _profile(front).near_side(level)
    notch = _notch(line, front.pixel, level, sure)
    if notch is not None:
        found["sternal_notch"] = notch
    found |= _axillae(front, level, sure)
    xiphoid = _xiphoid(line, notch, level, sure)
    return found | ({} if xiphoid is None else {"xiphoid": xiphoid})


@dataclass(frozen=True, eq=False)
class _Mound:
    point: Floats  # (3,) m
    rise: float  # m above the wide surroundings
    seen: float  # share of the pixels around that hold skin
    round: float  # mean curvature, 1/m


def _mounds(points: Floats, sign: float) -> list[_Mound]:
    """Tops of the skin seen along the way that the breast of one side points, highest rise first.

    At the top the skin's normal is that way: a nipple's is, to about 5°, on templates and people.
    """
    c, s = np.cos(_OUTWARD), sign * np.sin(_OUTWARD)
    axes = np.array([[c, s, 0.0], [0.0, 0.0, 1.0], [s, -c, 0.0]])
    near = points[(sign * points[:, 0] > -0.02) & (np.abs(points[:, 0]) < 0.26)]
    if len(near) < 200:
        return []
    view = seen_along(near, axes)
    top, weight = view.smooth(9e-3)
    wide, _ = view.smooth(35e-3)
    mean, _ = curvatures(top, view.pixel)
    row, column = _peaks(np.where(weight > 0.4, top, -np.inf), 5)
    place = np.array([_apex(view, r, k) for r, k in zip(row, column, strict=True)]).reshape(-1, 3)
    place = place @ axes
    mounds = [_Mound(p, float(top[r, k] - wide[r, k]), float(min(weight[r, k], 1)), -mean[r, k])
              for p, r, k in zip(place, row, column, strict=True)
              if _NIPPLE_AT[0] < sign * p[0] < _NIPPLE_AT[1]]  # fmt: skip
    return sorted((m for m in mounds if m.rise > 0), key=lambda m: -m.rise)[:6]


def _apex(view: HeightMap, row: int, column: int) -> tuple[float, float, float]:
    """Across, up and height, m, of the top of a quadratic through the skin around a peak.

    Noise moves the top of a flat dome far; it moves that of a quadratic much less.
    """
    reach = int(_ROUND / view.pixel)
    rows = slice(max(row - reach, 0), row + reach + 1)
    columns = slice(max(column - reach, 0), column + reach + 1)
    v, u = np.nonzero(view.seen[rows, columns])
    high = view.height[rows, columns][v, u]
    v, u = v + rows.start - row, u + columns.start - column
    near = u**2 + v**2 <= reach**2
    u, v, high = u[near].astype(float), v[near].astype(float), high[near]
    if len(u) < 12:
        across, up = view.place(row, column)
        return float(across), float(up), float(high.mean())
    basis = np.stack([np.ones_like(u), u, v, u * u / 2, u * v, v * v / 2], axis=1)
    fit = np.linalg.lstsq(basis, high, rcond=None)[0]
    hessian, step = np.array([[fit[3], fit[4]], [fit[4], fit[5]]]), np.zeros(2)
    if fit[3] + fit[5] < 0 and np.linalg.det(hessian) > 0:
        step = -np.linalg.solve(hessian, fit[1:3])
        step = step * min(1.0, 3.0 / max(float(np.linalg.norm(step)), 1e-9))
    top = fit[0] + fit[1:3] @ step + step @ hessian @ step / 2
    across, up = view.place(row + step[1], column + step[0])
    return float(across), float(up), float(top)


def _peaks(values: Floats, radius: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Rows and columns of the pixels that no other within ``radius`` pixels exceeds."""
    from scipy.ndimage import maximum_filter

    top = maximum_filter(values, 2 * radius + 1)
    row, column = np.nonzero((values == top) & np.isfinite(values))
    inside = (row > 1) & (column > 1) & (row < values.shape[0] - 2)
    inside &= column < values.shape[1] - 2
    return row[inside], column[inside]


def _nipples(left: list[_Mound], right: list[_Mound], likeness: float) -> dict[str, Proposal]:
    """The pair that rises most and mirrors best; one alone where the other side shows none."""
    best, chosen = -np.inf, None
    for a in left:
        for b in right:
            off = (a.point * [-1, 1, 1] - b.point) / _PAIR
            score = _worth(a) + _worth(b) - 0.25 * float(off @ off)
            if score > best:
                best, chosen = score, (a, b)
    if chosen is None:
        return {}
    a, b = chosen
    sure = _sigmoid(0.9 * (best - 2.0)) * (0.4 + 0.6 * min(max(likeness, 0.0) / 0.5, 1.0))
    how = "top of a breast mound, with its mirror image"
    return {"nipple_left": Proposal(a.point, sure * a.seen, how),
            "nipple_right": Proposal(b.point, sure * b.seen, how)}  # fmt: skip


def _worth(mound: _Mound) -> float:
    """How like a breast: rise in cm, bounded, and the distance from the midline."""
    aside = (abs(mound.point[0]) - _NIPPLE_MEAN[0]) / _NIPPLE_MEAN[1]
    return 2.0 * min(mound.rise / 0.01, 2.5) - 0.5 * float(aside**2)


@dataclass(frozen=True, eq=False)
class _Profile:
    """The skin on the midline, (k,) each: up and height (m), slope, bend (1/m), share seen."""

    up: Floats
    height: Floats
    slope: Floats
    bend: Floats
    seen: Floats

    def near_side(self, level: float) -> _Profile:
        """Without what lies too deep to be the front: the nape, seen through a hole."""
        around = (np.abs(self.up - level) < 0.04) & (self.seen > 0.3)
        if not around.any():
            return self
        deep = self.height < np.median(self.height[around]) - _DEEPEST
        return _Profile(self.up, self.height, self.slope, self.bend, np.where(deep, 0.0, self.seen))


def _profile(front: HeightMap, half: float = 0.014, sigma: float = 0.014) -> _Profile:
    """Quadratics fitted to what is seen of the midline, each under a Gaussian of ``sigma`` m."""
    _, middle = front.at(0.0, 0.0)
    first, last = int(middle - half / front.pixel + 0.5), int(middle + half / front.pixel + 1.5)
    strip = slice(max(first, 0), max(last, 1))
    weight = front.seen[:, strip].sum(axis=1).astype(float)
    total = front.height[:, strip].sum(axis=1)
    steps = np.arange(-int(3 * sigma / front.pixel), int(3 * sigma / front.pixel) + 1)
    z = steps * front.pixel / sigma
    window = np.exp(-(z**2) / 2)
    moments = [np.convolve(weight, (window * z**k)[::-1], "same") for k in range(5)]
    means = [np.convolve(total, (window * z**k)[::-1], "same") for k in range(3)]
    matrix = np.stack([np.stack([moments[i + j] for j in range(3)], -1) for i in range(3)], -2)
    matrix = matrix + 1e-6 * np.eye(3) * (1 + moments[0][:, None, None])
    fit = np.linalg.solve(matrix, np.stack(means, -1)[..., None])[..., 0]
    up = front.place(np.arange(len(weight)), 0)[1]
    full = window.sum() * max(last - first, 1)
    return _Profile(up, fit[:, 0], fit[:, 1] / sigma, 2 * fit[:, 2] / sigma**2, moments[0] / full)


def _notch(line: _Profile, step: float, level: float, trust: float) -> Proposal | None:
    """Above the nipples, where the slope begins to turn from the chest's to the neck's."""
    rows = np.flatnonzero((np.abs(line.up - level - _NOTCH_UP[0]) < 0.07) & (line.seen > 0.4))
    if len(rows) < 8:
        return None
    off = (line.up[rows] - level - _NOTCH_UP[0]) / _NOTCH_UP[1]
    corner = rows[int(np.argmax(line.bend[rows] / 8 - 0.5 * off**2))]
    below = rows[(rows <= corner) & (rows > corner - int(0.05 / step))]
    above = rows[(rows >= corner) & (rows < corner + int(0.05 / step))]
    steep = below[int(np.argmin(line.slope[below]))]
    low, high = float(line.slope[steep]), float(line.slope[above].max())
    k = min(steep + int(np.argmax(line.slope[steep:] > low + _RECOVERED * (high - low))), corner)
    off = (line.up[k] - level - _NOTCH_UP[0]) / _NOTCH_UP[1]
    clear = _sigmoid(5.0 * (high - low - 0.5)) * min(float(line.seen[k]), 1.0)
    sure = trust * clear * float(np.exp(-0.25 * off**2))
    point = np.array([0.0, -line.height[k], line.up[k]])
    return Proposal(point, sure, "corner between chest and neck on the midline")


def _xiphoid(line: _Profile, notch: Proposal | None, level: float, trust: float) -> Proposal | None:
    """Where the nipples, and a sternum of the usual length below the notch, put it."""
    guess = level + _XIPHOID_UP
    if notch is not None:
        share = 0.4 * notch.confidence
        guess += share * (float(notch.point[2]) - _STERNUM - guess)
    k = int(np.argmin(np.abs(line.up - guess)))
    if line.seen[k] < 0.3:
        return None
    return Proposal(np.array([0.0, -line.height[k], line.up[k]]), 0.5 * trust,
                    "midline, by the places of notch and nipples")  # fmt: skip


def _axillae(front: HeightMap, level: float, trust: float) -> dict[str, Proposal]:
    """The most hollow place of each side near where the nipples put it."""
    smooth, weight = front.smooth(8e-3)
    mean, _ = curvatures(smooth, front.pixel)
    rows, columns = np.indices(mean.shape)
    across, up = front.place(rows, columns)
    found = {}
    for name, sign in (("axilla_left", 1.0), ("axilla_right", -1.0)):
        off = ((sign * across - _AXILLA_ASIDE[0]) / _AXILLA_ASIDE[1]) ** 2
        off += ((up - level - _AXILLA_UP[0]) / _AXILLA_UP[1]) ** 2
        score = np.where((weight > 0.5) & (off < 9), mean / 10 - off / 2, -np.inf)
        k = np.unravel_index(int(np.argmax(score)), score.shape)
        if not np.isfinite(score[k]):
            continue
        point = np.array([across[k], -smooth[k], up[k]])
        confidence = 0.35 * trust * _sigmoid(2.0 * (float(score[k]) - 0.3))
        found[name] = Proposal(point, confidence, "hollow between chest and arm")
    return found


def _sigmoid(x: float) -> float:
    return float(1 / (1 + np.exp(-x)))
