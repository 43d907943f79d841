"""What a surgeon measures on breasts: volume, size, distances, ptosis, asymmetry; each with an sd.

1. frame       the body's own axes and its midline, from chest bone and sternum
2. each side   volume to the chest wall (breast_patch), base, distances straight and along the skin
3. asymmetry   left minus right, and the left breast mirrored onto the right one
4. spread      all of it again at postures one sd away along the axes of the covariance

Where a closest point or a shortest way is asked for, it is found once and then moves along with the
skin: its length then changes as the true one does, to first order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from supple.registration.breast_patch import BreastPatch, base_plane, breast_patch, volumes
from supple.registration.geodesic import Ways, length
from supple.registration.mirrored import Mirrored
from supple.registration.posture import Posture, posed
from supple.registration.spread import deviations, offset_deviations
from supple.registration.template import OnSurface, Template

if TYPE_CHECKING:
    from supple.registration.registration import Registration

Floats = npt.NDArray[np.float64]

SIDES = ("left", "right")
#: Of the ptosis, m: level with the fold within this, and far below it.
_LEVEL, _FAR = 10e-3, 30e-3

#: Name → unit and meaning, of each breast.
OF_A_BREAST = {
    "volume": ("ml", "between the skin within the outline and a soap film stretched over the "
                     "outline, in place of the chest wall, which no scan sees; a chest that bulges "
                     "there makes it too large, by tens of ml"),
    "projection": ("mm", "nipple to that soap film, the shortest way"),
    "base_width": ("mm", "extent of the outline across the body"),
    "base_height": ("mm", "extent of the outline along the body"),
    "nipple_notch": ("mm", "nipple to sternal notch, straight"),
    "nipple_notch_skin": ("mm", "nipple to sternal notch, along the skin"),
    "nipple_midline": ("mm", "nipple to the plane through the sternum"),
    "nipple_fold": ("mm", "nipple to the fold below it, straight"),
    "nipple_fold_skin": ("mm", "nipple to the fold below it, along the skin"),
    "ptosis": ("mm", "how far the nipple is below the fold, along the body"),
    "overhang": ("mm", "how far the lowest skin of the breast is below the fold"),
}  # fmt: skip
#: Name → unit and meaning, of both: left minus right.
OF_BOTH = {
    "volume_difference": ("ml", "left minus right"),
    "volume_difference_share": ("%", "left minus right, of their mean"),
    "nipple_height_difference": ("mm", "left minus right, positive when the left one is higher"),
    "mirrored_rms": ("mm", "root mean square distance of each breast's skin, mirrored in the "
                           "plane through the sternum, to the other side"),
}  # fmt: skip


@dataclass(frozen=True)
class Measure:
    """One number; ``sd`` is None where the fit has no covariance."""

    name: str
    side: str  #: "left", "right", or "" of both
    value: float
    sd: float | None
    unit: str
    meaning: str


@dataclass(frozen=True)
class Measures:
    """All measures of a fit.

    Attributes:
        rows: of the left breast, of the right one, of both.
        ptosis: side → "none", "pseudoptosis", "1", "2" or "3" (Regnault 1976), upright only.
    """

    rows: tuple[Measure, ...]
    ptosis: dict[str, str]

    def of(self, name: str, side: str = "") -> Measure:
        """The measure of that name; of both sides where ``side`` is empty."""
        return next(row for row in self.rows if (row.name, row.side) == (name, side))


def measures(registration: Registration) -> Measures:
    """Measures of a registered torso, with standard deviations where it has a covariance.

    Raises:
        MeshError: an outline of the template does not go around its nipple.
    """
    r = registration
    return measured(r.template, r.posture, r.points, r.covariance, r.offset_precision)


def measured(
    template: Template, posture: Posture, points: Floats, covariance: Floats | None = None,
    offset_precision: Any = None,
) -> Measures:  # fmt: skip
    """Measures of ``template`` with its vertices at ``points`` (n, 3) m.

    Args:
        posture: from which the points came; its chest says where up is.
        covariance: (9 K + A, 9 K + A) of ``Posture.stepped``; None for no standard deviations.
        offset_precision: (n, n) sparse, 1/m², of what the points are off the posture's along their
            normals; None where they are not.
    """
    chest = [bone.name for bone in template.bones].index("chest")
    ask = _questions(template, points)
    turn = posture.rotations[None, chest]
    value = ask(points[None], turn)[0]
    sd: list[float] | list[None] = [None] * len(value)
    if covariance is not None:
        beyond = points - posed(template, posture)  # what bones and blendshapes do not reach
        of_posture = deviations(lambda at, rotations: ask(at + beyond, rotations[:, chest]),
                                template, posture, covariance)  # fmt: skip
        of_offset = np.zeros_like(value)
        if offset_precision is not None:
            of_offset = offset_deviations(lambda at: ask(at, np.repeat(turn, len(at), axis=0)),
                                          points, template.triangles, offset_precision)  # fmt: skip
        sd = np.hypot(of_posture, of_offset).tolist()
    names = [(name, side, *of) for side in SIDES for name, of in OF_A_BREAST.items()]
    names += [(name, "", *of) for name, of in OF_BOTH.items()]
    rows = tuple(Measure(name, side, float(v), s, unit, meaning) for (name, side, unit, meaning), v,
                 s in zip(names, value, sd, strict=True))  # fmt: skip
    found = Measures(rows, {})
    for side in SIDES:
        found.ptosis[side] = grade(1e-3 * found.of("ptosis", side).value,
                                   1e-3 * found.of("overhang", side).value)  # fmt: skip
    return found


def grade(ptosis: float, overhang: float) -> str:
    """Grade of ptosis of a nipple and a lowest contour that far (m) below the fold.

    1: level with the fold, within 10 mm. 2: below it. 3: at the lowest contour too, or more than
    30 mm below the fold. Above the fold: "pseudoptosis" where the breast hangs below it, or "none".
    Source: Regnault (1976), Clin. Plast. Surg. 3, 193–203, with the limits that are in use.
    """
    if ptosis <= -_LEVEL:
        return "pseudoptosis" if overhang > _LEVEL else "none"
    if ptosis <= _LEVEL:
        return "1"
    return "3" if ptosis > _FAR or overhang - ptosis < _LEVEL else "2"


@lru_cache(maxsize=8)
def _patch(template: Template, side: str) -> BreastPatch:
    return breast_patch(template, side)


def _questions(template: Template, points: Floats) -> Callable[[Floats, Floats], Floats]:
    """A function of vertices (s, n, 3) and turns of the chest (s, 3, 3): measures (s, k)."""
    ways = Ways(points, template.triangles)
    patches = [_patch(template, side) for side in SIDES]
    breasts = [_Breast(template, patch, points, ways) for patch in patches]
    mirrored = Mirrored(template, points, patches)

    def ask(at: Floats, turns: Floats) -> Floats:
        frame = _frame(template, at, turns)
        left, right = (breast.ask(at, *frame) for breast in breasts)
        height = np.einsum("sd,sd->s", breasts[0].nipple(at) - breasts[1].nipple(at), frame[1])
        volume = left[:, 0] - right[:, 0]
        share = 200 * volume / (left[:, 0] + right[:, 0])
        rms = mirrored.ask(at, frame[0], frame[2])
        return np.column_stack([left, right, volume, share, 1e3 * height, 1e3 * rms])

    return ask


def _frame(template: Template, at: Floats, turns: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors (s, 3) to the body's left and up, and a point (s, 3) m of its midline plane.

    The plane holds sternal notch and xiphoid; how it turns about the sternum is the chest's.
    """
    notch, xiphoid = (_place(template, template.landmarks[name], at)
                      for name in ("sternal_notch", "xiphoid"))  # fmt: skip
    along = _unit(notch - xiphoid)
    left = _unit(_across(turns[:, :, 0], along))
    return left, _unit(_across(turns[:, :, 2], left)), (notch + xiphoid) / 2


class _Breast:
    """One breast's measures at any vertices near ``points``."""

    def __init__(self, template: Template, patch: BreastPatch, points: Floats, ways: Ways) -> None:
        self._template, self._patch = template, patch
        marks, side = template.landmarks, patch.side
        self._marks = {name: marks[f"{name}_{side}"] for name in ("nipple", "breast_inferior")}
        self._marks["notch"] = marks["sternal_notch"]
        self._ways = [ways.shortest(self._marks["nipple"], self._marks[name])
                      for name in ("notch", "breast_inferior")]  # fmt: skip
        self._foot = self._behind(points)

    def nipple(self, at: Floats) -> Floats:
        """(s, 3) m."""
        return _place(self._template, self._marks["nipple"], at)

    def ask(self, at: Floats, left: Floats, up: Floats, middle: Floats) -> Floats:
        """(s, 11) as in OF_A_BREAST, at vertices (s, n, 3) m."""
        nipple, notch, fold = (_place(self._template, self._marks[name], at)
                               for name in ("nipple", "notch", "breast_inferior"))  # fmt: skip
        skin = self._patch.skin_points(at)
        rim = skin[:, self._patch.cut.rim]
        wide, high = self._base(rim, up)
        by_skin = [length(at, self._template.triangles, way) for way in self._ways]
        lowest = np.einsum("sqd,sd->sq", skin, up).min(axis=1)
        lengths = [
            self._projection(at, nipple), wide, high,
            np.linalg.norm(nipple - notch, axis=1), by_skin[0],
            np.abs(np.einsum("sd,sd->s", nipple - middle, left)),
            np.linalg.norm(nipple - fold, axis=1), by_skin[1],
            np.einsum("sd,sd->s", fold - nipple, up),
            np.einsum("sd,sd->s", fold, up) - lowest,
        ]  # fmt: skip
        return np.column_stack([1e6 * volumes(self._patch, at), *(1e3 * x for x in lengths)])

    def _base(self, rim: Floats, up: Floats) -> tuple[Floats, Floats]:
        """Extents (s,) of the outline across and along the body, in its own plane."""
        normal, _ = base_plane(rim)
        along = _unit(_across(up, normal))
        across = np.cross(along, normal)
        wide, high = (np.ptp(np.einsum("sbd,sd->sb", rim, axis), axis=1)
                      for axis in (across, along))  # fmt: skip
        return wide, high

    def _behind(self, points: Floats) -> OnSurface:
        """The place of the chest wall that is closest to the nipple."""
        from supple.surface import Surface

        wall = Surface(self._patch.wall_points(points), self._patch.cut.triangles)
        landed = wall.closest(self.nipple(points[None]))
        return OnSurface(landed.triangle.astype(np.int64), landed.barycentric)

    def _projection(self, at: Floats, nipple: Floats) -> Floats:
        corners = self._patch.wall_points(at)[:, self._patch.cut.triangles[self._foot.triangle[0]]]
        foot = np.einsum("c,scd->sd", self._foot.barycentric[0], corners)
        return np.asarray(np.linalg.norm(nipple - foot, axis=1))


def _place(template: Template, place: OnSurface, at: Floats) -> Floats:
    """The first place (s, 3) m, with the vertices at (s, n, 3) m."""
    corners = at[:, template.triangles[place.triangle[0]]]
    return np.asarray(np.einsum("c,scd->sd", place.barycentric[0], corners))


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _across(vectors: Floats, axis: Floats) -> Floats:
    """The part of vectors (s, 3) across unit vectors (s, 3)."""
    return np.asarray(vectors - np.einsum("sd,sd->s", vectors, axis)[:, None] * axis)
