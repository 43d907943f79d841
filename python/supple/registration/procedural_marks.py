"""Landmarks, drawn curves and regions of the procedural torso."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.landmark_rules import axilla, fold_below, level_with
from supple.registration.procedural_mesh import Skin
from supple.registration.procedural_rig import BASE, BASE_RADII, arm_part, breast_radius, left
from supple.registration.template import CURVES, LANDMARKS, OnSurface
from supple.surface import Surface

Floats = npt.NDArray[np.float64]

#: Heights of the ends of the sternum, m: the lower is 0.9 of the way down to the breasts' folds.
NOTCH, XIPHOID = 0.140, -0.055
_MEET = (NOTCH + XIPHOID) / 2  # where the arrows point at each other
_MIDDLE = {"sternal_notch": NOTCH, "xiphoid": XIPHOID}


def marks(skin: Skin) -> tuple[dict[str, OnSurface], dict[str, OnSurface]]:
    """Landmarks and curves on the triangles of ``skin``; those on the right are mirror images."""
    found = {name: _on_midline(skin, np.array([z])) for name, z in _MIDDLE.items()}
    found |= {"sternum_arrow_upper": _arrow(skin, NOTCH - 0.004, _MEET + 0.010),
              "sternum_arrow_lower": _arrow(skin, XIPHOID + 0.004, _MEET - 0.010)}  # fmt: skip
    fold = fold_below(skin.points, skin.triangles, body.nipple())
    front = axilla(skin.points, skin.triangles)
    by_shape = {"breast_inferior_left": fold[None], "axilla_left": front[None]}
    for name, points in {**_left_places(), **by_shape}.items():
        found[name] = _nearest(skin, points, closed=name == "breast_left")
        found[name.removesuffix("left") + "right"] = mirrored(skin, found[name])
    return {name: found[name] for name in LANDMARKS}, {name: found[name] for name in CURVES}


def regions(points: Floats) -> dict[str, npt.NDArray[np.bool_]]:
    """Masks (n,) of the parts of the skin at ``points`` (n, 3) m."""
    p = left(points)
    n = body.normals(points)
    arm, breast = arm_part(p) > 0.5, breast_radius(p) < 1
    neck = ((p - body.NECK) @ body.NECK_AXIS > 0.025) & ~arm
    trunk = ~arm & ~neck
    front = (n[:, 1] < 0) & trunk
    on_left, on_right = points[:, 0] > 0, points[:, 0] < 0
    sternum = front & (p[:, 0] < 0.025) & (p[:, 2] < NOTCH) & (p[:, 2] > XIPHOID)
    back = (n[:, 1] > 0.25) & (p[:, 1] > 0.02) & trunk
    return {
        "breast_left": breast & trunk & on_left,
        "breast_right": breast & trunk & on_right,
        "sternum": sternum,
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


@cache
def _left_places() -> dict[str, Floats]:
    """Points (k, 3) m of the left: of each landmark and of the breast's outline."""
    outline = np.pi + np.linspace(0, 2 * np.pi, 48, endpoint=False)
    on_base = BASE + BASE_RADII * np.stack([np.cos(outline), np.sin(outline)], axis=1)
    start = body.BREAST + on_base @ body.BREAST_AXES[:2] + 0.10 * body.BREAST_AXES[2]
    line = body.met(start, -body.BREAST_AXES[2])
    nipple = body.nipple()
    medial, lateral = level_with(line, nipple)
    return {
        "nipple_left": nipple[None],
        "breast_medial_left": medial[None],
        "breast_lateral_left": lateral[None],
        "breast_left": line,
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
