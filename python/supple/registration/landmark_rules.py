"""What landmarks mean where a definition needs more than a glance, the same on every template."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: The xiphoid is this part of the way down from the sternal notch to the breasts' folds.
_XIPHOID = 0.9
#: m below the nipple, where the chord ends from which the fold is furthest; and how deep it may be.
_CHORD, _DEEP = 0.13, 0.10
#: mm along the profile over which it turns at the notch.
_ARM = 30
#: The medial edge of a breast, of its nipple's distance from the midline; m behind the fold, where
#: the front of a section ends.
_MEDIAL, _BEHIND = 0.3, 0.02
#: m around the armpit's apex, where its front fold is; m from the shoulder's joint to the midline,
#: where along the fold its landmark is: before the humeral head's inner half.
_NEAR, _INNER = 0.08, 0.010
#: m above the apex, round which the fold's skin runs; m by which skin may be behind the fold's
#: foremost and still be its edge, whose middle counts: a mesh has the foremost anywhere on it.
_WITHIN, _ROUND = 0.03, 4e-3


def notch_height(points: Floats, nipple: float) -> float:
    """Height of the sternal notch, m: where the front's profile turns most from chest to neck.

    Between points 30 mm before and after it on a spline through the vertices at x = 0, above the
    height of the nipples.
    """
    from scipy.interpolate import CubicSpline

    middle = points[np.abs(points[:, 0]) < 1e-9]
    front = middle[middle[:, 1] < np.median(middle[:, 1])]
    front = front[np.argsort(front[:, 2])]
    z = np.arange(front[0, 2], front[-1, 2], 5e-4)
    line = np.stack([CubicSpline(front[:, 2], front[:, 1])(z), z], axis=1)
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]
    even = np.arange(0, length[-1], 1e-3)
    y, z = (np.interp(even, length, column) for column in line.T)
    step = np.stack([y[_ARM:] - y[:-_ARM], z[_ARM:] - z[:-_ARM]])
    before, after = step[:, :-_ARM], step[:, _ARM:]
    turn = np.arctan2(before[0] * after[1] - before[1] * after[0], (before * after).sum(axis=0))
    place = z[_ARM:-_ARM]
    return float(place[np.where(place > nipple, turn, -np.inf).argmax()])


def turning(line: Floats) -> tuple[Floats, Floats, Floats]:
    """How much a sagittal ``line`` (k, 3) m, from below upwards, turns from chest to neck.

    Returns:
        Of points every mm along a spline through it: length (j,) m, turn (j,) rad between 30 mm
        before and after, NaN next to the ends, and the points (j, 3) m.
    """
    from scipy.interpolate import CubicSpline

    step = np.linalg.norm(np.diff(line, axis=0), axis=1)
    own = np.r_[0, np.cumsum(np.maximum(step, 1e-6))]
    even = np.arange(0, own[-1], 1e-3)
    curve = CubicSpline(own, line)(even)
    arm = curve[_ARM:, 1:] - curve[:-_ARM, 1:]
    before, after = arm[:-_ARM].T, arm[_ARM:].T
    turn = np.full(len(even), np.nan)
    turn[_ARM:-_ARM] = np.arctan2(
        before[0] * after[1] - before[1] * after[0], (before * after).sum(axis=0)
    )
    return even, turn, curve


def xiphoid_height(notch: float, fold: float) -> float:
    """Height of the xiphoid on the midline, from those of notch and folds, m.

    A sternum of 19 cm on a chest whose folds are 21 cm below the notch.
    """
    return (1 - _XIPHOID) * notch + _XIPHOID * fold


def sagittal(points: Floats, triangles: npt.NDArray[np.int64], x: float) -> Floats:
    """Points (k, 3) m where edges of the skin cross the plane of that ``x`` m, in any order."""
    return _section(points, triangles, 0, x)


def _section(points: Floats, triangles: npt.NDArray[np.int64], axis: int, at: float) -> Floats:
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    cut = (a[:, axis] < at) != (b[:, axis] < at)
    share = ((at - a[cut, axis]) / (b[cut, axis] - a[cut, axis]))[:, None]
    return np.asarray((1 - share) * a[cut] + share * b[cut])


def breast_edges(
    points: Floats, triangles: npt.NDArray[np.int64], nipple: Floats, fold: Floats
) -> tuple[Floats, Floats]:
    """The medial and the lateral edge (3,) m of the left breast, at its nipple's height.

    Medial: at 0.3 of the nipple's distance from the midline. Lateral: beside the nipple, where the
    skin is as deep as the ``fold`` below it; nearer to the nipple than the arm's.
    """
    level = _section(points, triangles, 2, float(nipple[2]))
    front = level[(level[:, 0] > 0) & (level[:, 0] < nipple[0]) & (level[:, 1] < fold[1] + _BEHIND)]
    front = front[np.argsort(front[:, 0])]
    x = _MEDIAL * float(nipple[0])
    medial = np.array([x, np.interp(x, front[:, 0], front[:, 1]), nipple[2]])
    beside = level[level[:, 0] > nipple[0]]
    beside = beside[np.argsort(np.linalg.norm(beside - nipple, axis=1), kind="stable")]
    first = max(int(np.argmax(beside[:, 1] > fold[1])), 1)
    before, behind = beside[first - 1], beside[first]
    share = (fold[1] - before[1]) / (behind[1] - before[1])
    return medial, np.asarray((1 - share) * before + share * behind)


def drawn_through(outline: Floats, anchors: Floats) -> Floats:
    """A closed ``outline`` (k, 3) m shifted so that it passes through ``anchors`` (a, 3) m.

    Its highest point stays; between there and the anchors the shift changes smoothly along it.
    """
    ends = np.linalg.norm(outline[:, None] - anchors, axis=2).argmin(axis=0)
    knots = np.r_[ends, outline[:, 2].argmax()]
    shifts = np.vstack([anchors - outline[ends], np.zeros(3)])
    order = np.argsort(knots, kind="stable")
    knots, shifts = knots[order], shifts[order]
    number = np.arange(len(outline))
    right = np.searchsorted(knots, number, side="right") % len(knots)
    left = right - 1
    span = (knots[right] - knots[left]) % len(outline)
    share = ((number - knots[left]) % len(outline)) / np.maximum(span, 1)
    smooth = (share * share * (3 - 2 * share))[:, None]
    return np.asarray(outline + (1 - smooth) * shifts[left] + smooth * shifts[right])


def fold_below(points: Floats, triangles: npt.NDArray[np.int64], nipple: Floats) -> Floats:
    """The crease (3,) m under a breast, on an edge of the skin, straight below its ``nipple``.

    Where the sagittal section through the nipple is furthest behind the chord from the nipple to
    the chest 13 cm below it.
    """
    return fold_of(sagittal(points, triangles, float(nipple[0])), nipple)


def fold_of(line: Floats, nipple: Floats) -> Floats:
    """The crease (3,) m of a sagittal section ``line`` (k, 3) m through the ``nipple``."""
    below = nipple[2] - line[:, 2]
    line = line[(below > 0) & (below < _CHORD) & (line[:, 1] < nipple[1] + _DEEP)]
    lowest = line[line[:, 2].argmin()]
    along = (lowest - nipple)[1:] / np.linalg.norm((lowest - nipple)[1:])
    off = line[:, 1:] - nipple[1:]
    return np.asarray(line[np.argmax(off[:, 1] * along[0] - off[:, 0] * along[1])])


def axilla(points: Floats, triangles: npt.NDArray[np.int64], joint: Floats) -> Floats:
    """The edge (3,) m of the left anterior axillary fold, on an edge of the skin.

    Before the armpit, where the skin turns from facing down to facing forward: of a sagittal
    section, the point furthest forward and down alike. The fold is a ridge from chest to arm; the
    section is 1 cm nearer to the midline than the shoulder's ``joint`` (3,) m. The armpit's apex,
    the saddle of the height between arm and trunk, moves along that ridge by 1 mm for each degree
    that a template's arms happen to be raised.
    """
    apex = armpit(points, triangles)
    return fold_before(sagittal(points, triangles, fold_aside(joint)), apex)


def fold_aside(joint: Floats) -> float:
    """How far aside, m, the fold's landmark is, from the left shoulder's ``joint`` (3,) m."""
    return float(joint[0]) - _INNER


def fold_before(line: Floats, apex: Floats) -> Floats:
    """The edge (3,) m of the fold in a sagittal section ``line`` (k, 3) m near the ``apex``."""
    line = line[(line[:, 2] > apex[2] - _NEAR / 4) & (line[:, 1] < apex[1])]
    line = line[np.linalg.norm(line - apex, axis=1) < _NEAR]
    centre = apex + np.array([0.0, 0.0, _WITHIN])
    line = line[np.argsort(np.arctan2(line[:, 2] - centre[2], centre[1] - line[:, 1]))]
    back = line[:, 1] + line[:, 2]
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]
    weight = np.gradient(length) * np.exp((back.min() - back) / _ROUND)
    middle = weight @ length / weight.sum()
    return np.array([np.interp(middle, length, line[:, k]) for k in range(3)])


def armpit(points: Floats, triangles: npt.NDArray[np.int64]) -> Floats:
    """The apex (3,) m of the left armpit: the saddle vertex of the height between arm and trunk.

    It joins the two deepest valleys of the left half.
    """
    near = _neighbours(points, triangles)
    return np.asarray(points[_joining(points[:, 2], np.flatnonzero(points[:, 0] > 0), near)])


def _neighbours(points: Floats, triangles: npt.NDArray[np.int64]) -> list[set[int]]:
    near: list[set[int]] = [set() for _ in points]
    for a, b in triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist():
        near[a].add(b)
        near[b].add(a)
    return near


def _joining(height: Floats, kept: npt.NDArray[np.int64], near: list[set[int]]) -> int:
    """The vertex where, with the level rising, the deepest second valley meets another.

    Edelsbrunner and Harer (2010), Computational Topology, VII.1: the merge of most persistence.
    """
    lowest: dict[int, int] = {}  # of each vertex under water, one nearer to its valley's lowest

    def valley(k: int) -> int:
        while lowest[k] != k:
            lowest[k] = k = lowest[lowest[k]]
        return k

    deepest, chosen = -1.0, -1
    for k in kept[np.argsort(height[kept], kind="stable")].tolist():
        met = sorted({valley(j) for j in near[k] if j in lowest}, key=lambda j: height[j])
        lowest[k] = met[0] if met else k
        for other in met[1:]:
            lowest[other] = met[0]
            if height[k] - height[other] > deepest:
                deepest, chosen = height[k] - height[other], k
    return chosen
