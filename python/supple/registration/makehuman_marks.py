"""Landmarks, the surgeon's drawing and regions of the torso, from its shape and topology."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from supple.errors import MeshError
from supple.registration.landmark_rules import (
    axilla,
    breast_edges,
    drawn_through,
    fold_below,
    notch_height,
    xiphoid_height,
)
from supple.registration.template import OnSurface

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Skin:
    """The torso's surface: left half first, then its image, triangle by triangle.

    Attributes:
        points: (n, 3) m LPS, symmetric in x.
        triangles: (t, 3); triangle i + t/2 is the image of i, its corners in reverse.
        mirror: (n,).
    """

    points: Floats
    triangles: Ints
    mirror: Ints

    def nearest(self, place: npt.ArrayLike, closed: bool = False) -> OnSurface:
        """Where places (k, 3) m land on the left half."""
        from supple.surface import Surface

        half = self.triangles[: len(self.triangles) // 2]
        hit = Surface(self.points, half).closest(np.atleast_2d(place))
        return OnSurface(hit.triangle.astype(np.int64), hit.barycentric, closed)

    def image(self, marks: OnSurface) -> OnSurface:
        """The same on the other side."""
        half = len(self.triangles) // 2
        return OnSurface((marks.triangle + half) % (2 * half), marks.barycentric[:, ::-1],
                         marks.closed)  # fmt: skip

    def at(self, marks: OnSurface) -> Floats:
        return marks.at(self.points, self.triangles)

    def normals(self) -> Floats:
        """Unit outward normals (t, 3)."""
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        cross = np.cross(b - a, c - a)
        return np.asarray(cross / np.linalg.norm(cross, axis=1, keepdims=True))

    def middle(self, front: bool) -> Floats:
        """The profile (m, 3) m in x = 0, from below to the neck."""
        on = self.points[np.abs(self.points[:, 0]) < 1e-9]
        spine = np.median(on[:, 1])
        line = on[(on[:, 1] < spine) == front]
        return np.asarray(line[np.argsort(line[:, 2])])

    def profile(self, low: float, high: float, count: int) -> Floats:
        """Points (count, 3) m on the front's profile between two heights, evenly in height."""
        line = self.middle(front=True)
        z = np.linspace(low, high, count)
        return np.stack([np.zeros(count), np.interp(z, line[:, 2], line[:, 1]), z], axis=1)

    def outline(self, field: Floats, level: float, count: int) -> Floats:
        """The longest line (count, 3) m on the left half where ``field`` (n,) is ``level``.

        It is closed and runs evenly in length, from its lowest point towards the midline.

        Raises:
            MeshError: no such line closes.
        """
        half = self.triangles[: len(self.triangles) // 2]
        ends: dict[tuple[int, int], list[tuple[int, int]]] = {}
        above = field[half] > level
        for triangle in half[above.any(axis=1) & ~above.all(axis=1)].tolist():
            crossed = [(min(a, b), max(a, b))
                       for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True)
                       if (field[a] > level) != (field[b] > level)]  # fmt: skip
            for one, other in (crossed, crossed[::-1]):
                ends.setdefault(one, []).append(other)
        loops = _loops(ends)
        if not loops:
            raise MeshError("the targets must move a breast with a closed outline; take hm08's.")
        edges = np.array(max(loops, key=len))
        share = (level - field[edges[:, 0]]) / (field[edges[:, 1]] - field[edges[:, 0]])
        line = self.points[edges[:, 0]] * (1 - share[:, None])
        return _even(line + self.points[edges[:, 1]] * share[:, None], count)


def _loops(ends: dict[tuple[int, int], list[tuple[int, int]]]) -> list[list[tuple[int, int]]]:
    """Closed chains of edges; ``ends`` names the neighbours of each."""
    left, loops = set(ends), []
    while left:
        first = min(left)
        chain = [first]
        left.discard(first)
        while following := [e for e in ends[chain[-1]] if e in left]:
            chain.append(min(following))
            left.discard(chain[-1])
        if first in ends[chain[-1]] and len(chain) > 2:
            loops.append(chain)
    return loops


def _even(line: Floats, count: int) -> Floats:
    line = np.roll(line, -int(line[:, 2].argmin()), axis=0)
    if line[1, 0] > line[-1, 0]:
        line = np.roll(line[::-1], 1, axis=0)
    line = np.vstack([line, line[:1]])
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]
    s = np.linspace(0, length[-1], count, endpoint=False)
    return np.stack([np.interp(s, length, column) for column in line.T], axis=1)


def smooth_outline(skin: Skin, line: Floats, waves: int = 5) -> OnSurface:
    """A closed line (k, 3) m without the mesh's zigzag: its first ``waves`` harmonics, on the skin.

    Its x stays that of the left half.
    """
    spectrum = np.fft.rfft(line, axis=0)
    spectrum[waves + 1 :] = 0
    smooth = _even(np.fft.irfft(spectrum, len(line), axis=0), len(line))
    return skin.nearest(smooth, closed=True)


def landmarks(skin: Skin, nipple: Floats, joint: Floats) -> dict[str, OnSurface]:
    """LANDMARKS; ``nipple`` (n,) is how far its targets move, ``joint`` (3,) m the left shoulder's.

    Nipple: the middle of what moves with the nipple's tip. Medial, lateral: the breast's edges at
    the nipple's height; inferior: the fold below the nipple. Xiphoid: on the profile, 0.9 of the
    way down from the notch to the folds.
    """
    tip = np.where(skin.points[:, 0] > 0, nipple, 0.0)
    tip = np.where(tip > 0.8 * tip.max(), tip, 0.0)
    summit = tip @ skin.points / tip.sum()
    fold = fold_below(skin.points, skin.triangles, summit)
    medial, lateral = breast_edges(skin.points, skin.triangles, summit, fold)
    marks = {
        "nipple": skin.nearest(summit),
        "axilla": skin.nearest(axilla(skin.points, skin.triangles, joint)),
        "breast_medial": skin.nearest(medial),
        "breast_lateral": skin.nearest(lateral),
        "breast_inferior": skin.nearest(fold),
    }
    top = notch_height(skin.points, float(summit[2]))
    end = xiphoid_height(top, float(fold[2]))
    result = {"sternal_notch": skin.nearest(skin.profile(top, top, 1)),
              "xiphoid": skin.nearest(skin.profile(end, end, 1))}  # fmt: skip
    for name, mark in marks.items():
        result |= {f"{name}_left": mark, f"{name}_right": skin.image(mark)}
    return result


def curves(skin: Skin, marks: dict[str, OnSurface], outline: OnSurface) -> dict[str, OnSurface]:
    """CURVES: arrows from the notch down and from the xiphoid up; the outlines of the breasts.

    These are drawn through the landmarks around the breast.
    """
    around = ("breast_medial_left", "breast_inferior_left", "breast_lateral_left")
    anchors = np.vstack([skin.at(marks[name]) for name in around])
    outline = skin.nearest(drawn_through(skin.at(outline), anchors), closed=True)
    top, low = (skin.at(marks[name])[0, 2] for name in ("sternal_notch", "xiphoid"))
    middle, gap = (top + low) / 2, 0.005
    return {
        "sternum_arrow_upper": skin.nearest(skin.profile(top, middle + gap, 24)),
        "sternum_arrow_lower": skin.nearest(skin.profile(low, middle - gap, 24)),
        "breast_left": outline,
        "breast_right": skin.image(outline),
    }


def regions(skin: Skin, weights: dict[str, Floats], inside: Mask,
            marks: dict[str, OnSurface]) -> dict[str, Mask]:  # fmt: skip
    """REGIONS; ``inside`` (n,) is the left breast, ``weights`` those of each bone (n,)."""
    p = skin.points
    top, low = (skin.at(marks[name])[0, 2] for name in ("sternal_notch", "xiphoid"))
    depth = np.interp(p[:, 2], *_centre(skin))
    trunk = weights["arm_left"] + weights["arm_right"] + weights["neck"] < 0.5
    front = p[:, 1] < depth
    return {
        "breast_left": inside,
        "breast_right": inside[skin.mirror],
        "sternum": front & (np.abs(p[:, 0]) < 0.02) & (p[:, 2] < top + 1e-3) & (p[:, 2] > low),
        "back": trunk & ~front & (p[:, 1] > depth + 0.02),
        "abdomen": trunk & front & (weights["abdomen"] > 0.5),
        "neck": weights["neck"] > 0.5,
        "arm_left": weights["arm_left"] > 0.5,
        "arm_right": weights["arm_right"] > 0.5,
    }


def _centre(skin: Skin) -> tuple[Floats, Floats]:
    """The mean depth (m) between breast bone and spine, along the height."""
    front, back = skin.middle(front=True), skin.middle(front=False)
    z = np.linspace(back[0, 2], back[-1, 2], 50)
    return z, (np.interp(z, *front[:, [2, 1]].T) + np.interp(z, *back[:, [2, 1]].T)) / 2
