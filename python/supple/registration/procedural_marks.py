"""Landmarks, drawn curves and regions of the procedural torso."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.landmark_rules import (
    armpit,
    breast_edges,
    drawn_through,
    fold_aside,
    fold_before,
    fold_of,
    notch_height,
    xiphoid_height,
)
from supple.registration.procedural_mesh import Skin
from supple.registration.procedural_rig import BASE, BASE_RADII, arm_part, breast_radius, left
from supple.registration.template import CURVES, LANDMARKS, OnSurface
from supple.surface import Surface

Floats = npt.NDArray[np.float64]


def marks(skin: Skin) -> tuple[dict[str, OnSurface], dict[str, OnSurface]]:
    """Landmarks and curves on the triangles of ``skin``; those on the right are mirror images."""
    fold = fold_of(_section(body.nipple(), -0.13, 0.0), body.nipple())
    top, low = sternum(skin.points, float(fold[2]))
    meet = (top + low) / 2  # where the arrows point at each other
    found = {"sternal_notch": _on_midline(skin, np.array([top])),
             "xiphoid": _on_midline(skin, np.array([low])),
             "sternum_arrow_upper": _arrow(skin, top, meet + 0.005),
             "sternum_arrow_lower": _arrow(skin, low, meet - 0.005)}  # fmt: skip
    apex = _saddle(armpit(skin.points, skin.triangles))
    beside = np.r_[fold_aside(body.SHOULDER), apex[1:]]
    front = fold_before(_section(beside, -0.01, 0.08), apex)
    by_shape = {"breast_inferior_left": fold[None], "axilla_left": front[None]}
    for name, points in {**_left_places(skin, fold), **by_shape}.items():
        found[name] = _nearest(skin, points, closed=name == "breast_left")
        found[name.removesuffix("left") + "right"] = mirrored(skin, found[name])
    return {name: found[name] for name in LANDMARKS}, {name: found[name] for name in CURVES}


def sternum(points: Floats, fold: float) -> tuple[float, float]:
    """Heights of the notch and the xiphoid, m; ``fold`` is that of the folds under the breasts."""
    top = notch_height(points, float(body.nipple()[2]))
    return top, xiphoid_height(top, fold)


def _saddle(near: Floats) -> Floats:
    """Where the closed form's skin faces straight down, (3,) m, ``near`` a point of the mesh."""
    from scipy.optimize import fsolve

    def off(p: Floats) -> Floats:
        level, slope = body.level(p[None]), body.slope(p[None], 1e-4)[0, :2]
        return np.asarray(np.r_[level, 0.01 * slope])

    return np.asarray(fsolve(off, near))


def _section(through: Floats, low: float, high: float) -> Floats:
    """The front's sagittal section (k, 3) m from ``low`` to ``high`` m above a point.

    Of the closed form, so that it does not depend on the mesh.
    """
    height = through[2] + np.arange(low, high, 1e-3)
    start = np.stack([np.full_like(height, through[0]), np.full_like(height, -0.3), height], 1)
    line = body.met(start, np.array([0.0, 1.0, 0.0]))
    return np.asarray(line[np.abs(body.level(line)) < 1e-3])


def regions(points: Floats, notch: float, xiphoid: float) -> dict[str, npt.NDArray[np.bool_]]:
    """Masks (n,) of the parts of the skin at ``points`` (n, 3) m.

    The sternum is between the heights ``notch`` and ``xiphoid``, m.
    """
    p = left(points)
    n = body.normals(points)
    arm, breast = arm_part(p) > 0.5, breast_radius(p) < 1
    neck = ((p - body.NECK) @ body.NECK_AXIS > 0.025) & ~arm
    trunk = ~arm & ~neck
    front = (n[:, 1] < 0) & trunk
    on_left, on_right = points[:, 0] > 0, points[:, 0] < 0
    bone = front & (p[:, 0] < 0.025) & (p[:, 2] < notch) & (p[:, 2] > xiphoid)
    back = (n[:, 1] > 0.25) & (p[:, 1] > 0.02) & trunk
    return {
        "breast_left": breast & trunk & on_left,
        "breast_right": breast & trunk & on_right,
        "sternum": bone,
        "back": back,
        "abdomen": front & (p[:, 2] < -0.09),
        "neck": neck,
        "arm_left": arm & on_left,
        "arm_right": arm & on_right,
    }


def mirrored(skin: Skin, part: OnSurface) -> OnSurface:
    """The same on the other side: triangles of the halves pair up, two of their corners swapped."""
    half = len(skin.triangles) // 2
    other = np.where(part.triangle < half, part.triangle + half, part.triangle - half)
    return OnSurface(other, part.barycentric[:, [0, 2, 1]], part.closed)


def _nearest(skin: Skin, points: Floats, closed: bool = False) -> OnSurface:
    """The points of the left half closest to ``points`` (k, 3) m."""
    half = Surface(skin.points, skin.triangles[: len(skin.triangles) // 2])
    near = half.closest(points)
    return OnSurface(
        np.asarray(near.triangle, dtype=np.int64), np.asarray(near.barycentric), closed
    )


def _left_places(skin: Skin, fold: Floats) -> dict[str, Floats]:
    """Points (k, 3) m of the left: of each landmark and of the breast's outline.

    Above, the outline is the base's; below, the half ellipse through the ``fold`` (3,) m; both
    are drawn through the edges of the breast.
    """
    outline = np.pi + np.linspace(0, 2 * np.pi, 48, endpoint=False)
    aside, under = (fold - body.BREAST) @ body.BREAST_AXES[:2].T - BASE
    low = abs(under) / np.sqrt(1 - (aside / BASE_RADII[0]) ** 2)
    up = np.where(np.sin(outline) < 0, low, BASE_RADII[1])
    on_base = BASE + np.stack([BASE_RADII[0] * np.cos(outline), up * np.sin(outline)], axis=1)
    start = body.BREAST + on_base @ body.BREAST_AXES[:2] + 0.10 * body.BREAST_AXES[2]
    line = body.met(start, -body.BREAST_AXES[2])
    nipple = body.nipple()
    medial, lateral = breast_edges(skin.points, skin.triangles, nipple, fold)
    return {
        "nipple_left": nipple[None],
        "breast_medial_left": medial[None],
        "breast_lateral_left": lateral[None],
        "breast_left": drawn_through(line, np.stack([medial, fold, lateral])),
    }


def _on_midline(skin: Skin, heights: Floats) -> OnSurface:
    """Where the planes z = ``heights`` (k,) m cut the front's midline, on edges of the left."""
    x, y, z = skin.points.T
    left = skin.triangles[: len(skin.triangles) // 2]
    triangle, corner = np.nonzero((x[left] == 0) & (x[np.roll(left, -1, axis=1)] == 0))
    a, b = left[triangle, corner], left[triangle, (corner + 1) % 3]
    cuts = (z[a] - heights[:, None]) * (z[b] - heights[:, None]) <= 0
    edge = np.where(cuts, (y[a] + y[b]) / 2, np.inf).argmin(axis=1)
    share = (heights - z[a[edge]]) / (z[b[edge]] - z[a[edge]])
    barycentric = np.zeros((len(heights), 3))
    rows = np.arange(len(heights))
    barycentric[rows, corner[edge]] = 1 - share
    barycentric[rows, (corner[edge] + 1) % 3] = share
    return OnSurface(triangle[edge], barycentric)


def _arrow(skin: Skin, start: float, tip: float) -> OnSurface:
    """On the midline from ``start`` to ``tip`` (heights, m), left barb, tip, right barb."""
    shaft = _on_midline(skin, np.linspace(start, tip, 12))
    back = _on_midline(skin, np.array([tip + 0.012 * np.sign(start - tip)]))
    barb = _nearest(skin, back.at(skin.points, skin.triangles) + np.array([0.008, 0.0, 0.0]))
    end = OnSurface(shaft.triangle[-1:], shaft.barycentric[-1:])
    parts = (shaft, barb, end, mirrored(skin, barb))
    return OnSurface(np.concatenate([part.triangle for part in parts]),
                     np.vstack([part.barycentric for part in parts]))  # fmt: skip
