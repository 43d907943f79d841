"""Landmarks, drawn curves and regions of the procedural torso."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from supple.registration import procedural_body as body
from supple.registration.procedural_mesh import Skin
from supple.registration.procedural_rig import BASE, BASE_RADII, arm_part, breast_radius, left
from supple.registration.template import CURVES, LANDMARKS, OnSurface
from supple.surface import Surface

Floats = npt.NDArray[np.float64]

NOTCH, XIPHOID = 0.140, -0.030  #: heights of the ends of the sternum, m
AXILLA = np.array([0.152, -0.012, 0.056])  #: near the left one, m
_CORNERS = np.array([np.pi, 0.0, -np.pi / 2])  # medial, lateral and inferior on an outline


def marks(skin: Skin) -> tuple[dict[str, OnSurface], dict[str, OnSurface]]:
    """Landmarks and curves on the triangles of ``skin``; those on the right are mirror images."""
    places = _places()
    near = Surface(skin.points, skin.triangles).closest(np.vstack(list(places.values())))
    ends = np.cumsum([len(points) for points in places.values()])[:-1]
    triangles = np.split(np.asarray(near.triangle, dtype=np.int64), ends)
    weights = np.split(np.asarray(near.barycentric), ends)
    found: dict[str, OnSurface] = {}
    for name, triangle, weight in zip(places, triangles, weights, strict=True):
        found[name] = OnSurface(triangle, weight, closed=name == "breast_left")
        if name.endswith("_left"):
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


@cache
def _places() -> dict[str, Floats]:
    """Points (k, 3) m of the midline and of the left: each landmark and each curve."""
    outline = np.pi + np.linspace(0, 2 * np.pi, 48, endpoint=False)
    on_breast = np.vstack([body.NIPPLE[None, :2], _outline(_CORNERS), _outline(outline)])
    nipple, medial, lateral, inferior, *breast = _on_breast(on_breast)
    middle = (NOTCH + XIPHOID) / 2
    return {
        "sternal_notch": _midline(np.array([NOTCH])),
        "xiphoid": _midline(np.array([XIPHOID])),
        "nipple_left": nipple[None],
        "axilla_left": AXILLA[None],
        "breast_medial_left": medial[None],
        "breast_lateral_left": lateral[None],
        "breast_inferior_left": inferior[None],
        "sternum_arrow_upper": _arrow(NOTCH - 0.004, middle + 0.010),
        "sternum_arrow_lower": _arrow(XIPHOID + 0.004, middle - 0.010),
        "breast_left": np.array(breast),
    }


def _outline(angle: Floats) -> Floats:
    """Places (k, 2) m on the base of the left breast, to the side and up, in its axes."""
    return np.asarray(BASE + BASE_RADII * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def _on_breast(place: Floats) -> Floats:
    """Points (k, 3) m of the skin before places (k, 2) m in the left breast's axes."""
    start = body.BREAST + place @ body.BREAST_AXES[:2] + 0.10 * body.BREAST_AXES[2]
    return body.met(start, -body.BREAST_AXES[2])


def _midline(height: Floats) -> Floats:
    start = np.stack([0 * height, 0 * height - 0.2, height], axis=1)
    return body.met(start, np.array([0.0, 1.0, 0.0]))


def _arrow(start: float, tip: float) -> Floats:
    """Shaft, tip, one barb, tip, other barb: points (k, 3) m before the skin of the midline."""
    along = np.append(np.linspace(start, tip, 12), tip + 0.012 * np.sign(start - tip))
    *shaft, back = _midline(along)
    side = np.array([0.008, 0.0, 0.0])
    return np.vstack([*shaft, back + side, shaft[-1], back - side])
